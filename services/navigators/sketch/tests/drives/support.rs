//! A small kinematic world of straight walls and round obstacles, in which the robot is a disc. The estimate of its pose in the
//! drawing is perfect, so that tests of the planner only depend on the planner.

use bytemuck::Zeroable;
use sketchnav_schemas::channels::{self, COMMAND, Channel, ChannelSpec, ODOMETRY, ORDERS, SCAN, STATUS};
use sketchnav_schemas::codes::{FREE, Order, Process, TaskState, Tracking, WALL};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch, World as WorldFrame};
use sketchnav_schemas::message::*;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::filter::Start;
use sketchnav_sketch::messages::{CHANNELS, ESTIMATE, PLAN, PoseEstimate, ROUTE, Route, SKETCH, SketchMap};
use sketchnav_sketch::mission::KIND;
use sketchnav_sketch::planner::Planner;
use sketchnav_stage::{Access, InProcess, Incoming, Inputs, Instant, Outbox, Reading, Stage};

pub const ROBOTINO: &str = include_str!("../../../../../sim/robots/robotino.toml");
pub const TURTLEBOT: &str = include_str!("../../../../../sim/robots/turtlebot3.toml");
pub const DT_S: f64 = 0.1;

/// Converts a place in the world, in metres, to the drawing, in pixels, and returns the local scales there as well.
pub type Warp = fn(f64, f64) -> ([f64; 2], [f64; 2]);

/// Draws the world with 20 px per metre along x, 30 px per metre along y, and a margin of 20 px.
pub fn stretched(x: f64, y: f64) -> ([f64; 2], [f64; 2]) {
    ([20.0 + 20.0 * x, 20.0 + 30.0 * y], [20.0, 30.0])
}

pub type Line = [f64; 4];

pub struct Scene {
    /// The true walls, in metres.
    pub walls: Vec<Line>,
    /// Round obstacles, as x, y and radius in metres.
    pub discs: Vec<[f64; 3]>,
    /// The drawn walls, in metres before the warp.
    pub drawn: Vec<Line>,
    pub warp: Warp,
    pub size_m: [f64; 2],
    pub start: Pose<WorldFrame>,
    /// Whether the drawing marks the start.
    pub is_marked: bool,
}

/// The outcome of a drive.
#[derive(Default)]
pub struct Outcome {
    /// Every final state of a task or the mission, in order, with the reason.
    pub ends: Vec<(TaskState, String)>,
    /// The true path, one point per step.
    pub way: Vec<[f64; 2]>,
    /// Minimum distance of the robot's hull from anything, in metres.
    pub closest_m: f64,
    pub commands: Vec<VelocityCommand>,
    pub seconds: f64,
    pub plans: usize,
    /// Number of times that the robot began to recover from being stuck.
    pub recoveries: usize,
    pub all_bytes: Vec<u8>,
}

/// The messages that the planner reads.
struct Senses {
    scan: Box<LaserScan>,
    estimate: Box<PoseEstimate>,
    odometry: Odometry,
}

impl Inputs for Senses {
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
        let of = |message| Some(Reading { message, cells: &[], is_fresh: true });
        match spec {
            spec if *spec == *SCAN.spec => of(bytemuck::bytes_of(&*self.scan)),
            spec if *spec == *ESTIMATE.spec => of(bytemuck::bytes_of(&*self.estimate)),
            spec if *spec == *ODOMETRY.spec => of(bytemuck::bytes_of(&self.odometry)),
            _ => None,
        }
    }
}

pub struct Drive {
    pub planner: Planner,
    /// Access of the planner to channels.
    access: Access,
    pub sent: InProcess,
    senses: Senses,
    scene: Scene,
    robot: Robot,
    truth: Pose<WorldFrame>,
    twist: Twist,
    seq: u64,
    /// Fit of the scans in the estimates.
    pub fit: f64,
    /// Confidence of the localizer in the estimates.
    pub tracking: Tracking,
    /// Whether the localizer knows where the robot is.
    pub is_placed: bool,
}

impl Scene {
    /// Creates a scene whose drawing shows every wall at its true position.
    pub fn faithful(walls: Vec<Line>, size_m: [f64; 2], start: [f64; 3]) -> Self {
        let start = Pose::new(start[0], start[1], start[2]);
        Self {
            drawn: walls.clone(),
            walls,
            discs: Vec::new(),
            warp: stretched,
            size_m,
            start,
            is_marked: true,
        }
    }

    pub fn cells(&self) -> (SketchMap, Vec<u8>) {
        let ([width, height], _) = (self.warp)(self.size_m[0], self.size_m[1]);
        let (width, height) = (width as usize + 20, height as usize + 20);
        let mut cells = vec![FREE; width * height];
        for [x0, y0, x1, y1] in &self.drawn {
            for i in 0..=2000 {
                let t = f64::from(i) / 2000.0;
                let ([x, y], _) = (self.warp)(x0 + t * (x1 - x0), y0 + t * (y1 - y0));
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    cells[(y as usize + dy) * width + x as usize + dx] = WALL;
                }
            }
        }
        let ([x, y], _) = (self.warp)(self.start.x, self.start.y);
        let start = PosePx::new(&Pose::new(x, y, self.start.yaw_rad));
        let mut map =
            SketchMap { width_px: width as u32, height_px: height as u32, start, ..Zeroable::zeroed() };
        if !self.is_marked {
            let anywhere = Start::anywhere(map.start().pose, [width, height]);
            (map.start_spread_px, map.start_spread_rad) = (anywhere.spread_px, anywhere.spread_rad);
        }
        (map, cells)
    }

    fn range(&self, x: f64, y: f64, angle: f64) -> f64 {
        let (dx, dy) = (angle.cos(), angle.sin());
        let walls = self.walls.iter().filter_map(|w| to_wall(x, y, dx, dy, w));
        let discs = self.discs.iter().filter_map(|d| to_disc(x, y, dx, dy, d));
        walls.chain(discs).fold(f64::INFINITY, f64::min)
    }

    /// Returns the free space around a place, in metres.
    pub fn clearance(&self, x: f64, y: f64) -> f64 {
        let walls = self.walls.iter().map(|w| from_wall(x, y, w));
        let discs = self.discs.iter().map(|d| (x - d[0]).hypot(y - d[1]) - d[2]);
        walls.chain(discs).fold(f64::INFINITY, f64::min)
    }
}

fn to_wall(x: f64, y: f64, dx: f64, dy: f64, [x0, y0, x1, y1]: &Line) -> Option<f64> {
    let (ex, ey) = (x1 - x0, y1 - y0);
    let det = ex * dy - ey * dx;
    let (px, py) = (x0 - x, y0 - y);
    let (t, s) = ((ex * py - ey * px) / det, (dx * py - dy * px) / det);
    (det.abs() > 1e-12 && t > 0.0 && (0.0..=1.0).contains(&s)).then_some(t)
}

fn to_disc(x: f64, y: f64, dx: f64, dy: f64, [cx, cy, r]: &[f64; 3]) -> Option<f64> {
    let along = (cx - x) * dx + (cy - y) * dy;
    let aside = (cx - x) * dy - (cy - y) * dx;
    (along > 0.0 && aside.abs() < *r).then(|| along - (r * r - aside * aside).sqrt())
}

fn from_wall(x: f64, y: f64, [x0, y0, x1, y1]: &Line) -> f64 {
    let (ex, ey) = (x1 - x0, y1 - y0);
    let t = (((x - x0) * ex + (y - y0) * ey) / (ex * ex + ey * ey)).clamp(0.0, 1.0);
    (x - x0 - t * ex).hypot(y - y0 - t * ey)
}

/// Returns a run whose mission has these planner parameters.
pub fn config(robot: &str, planner: &str) -> RunConfig {
    let mission = format!(
        "name = 'test'\nrobot = 'robotino'\nworld = {{ floor_plan = 'x' }}\nnavigator = {{ kind = 'sketch', drawing = 'x' }}\n\
         start = {{ world = [0, 0], world_heading_deg = 0 }}\n[[task]]\nname = 't'\ngoal = [0, 0]\n\
         there = {{ center = [0, 0], radius_m = 1 }}\n[parameters.planner]\n{planner}"
    );
    RunConfig::lockstep("test", Mission::parse(&mission).unwrap(), Robot::parse(robot).unwrap(), 1)
}

/// Returns a route of tasks, each of which is a line of places in the world.
pub fn route(warp: Warp, tasks: &[&[[f64; 2]]], time_limit_s: f64) -> Box<Route> {
    let mut route: Box<Route> = Box::new(Zeroable::zeroed());
    for task in tasks {
        let entry = &mut route.tasks[route.task_count as usize];
        entry.first_point = route.point_count;
        entry.point_count = task.len() as u32;
        entry.time_limit_s = time_limit_s;
        entry.name = Text::new("a task");
        route.task_count += 1;
        for place in *task {
            route.points_px[route.point_count as usize] = warp(place[0], place[1]).0;
            route.point_count += 1;
        }
    }
    route
}

impl Drive {
    pub fn new(scene: Scene, robot: &str, tasks: &[&[[f64; 2]]], time_limit_s: f64) -> Self {
        Self::with(scene, config(robot, "by_outline = false"), tasks, time_limit_s)
    }

    /// Creates a drive with the planner parameters of `config`.
    pub fn with(scene: Scene, config: RunConfig, tasks: &[&[[f64; 2]]], time_limit_s: f64) -> Self {
        channels::register(KIND, CHANNELS).unwrap();
        let (map, cells) = scene.cells();
        let route = route(scene.warp, tasks, time_limit_s);
        let mut drive = Self {
            planner: Planner::new(&config).unwrap(),
            access: Access::new(Process::Planner, KIND),
            sent: InProcess::of_writer(Process::Planner, KIND),
            senses: Senses {
                scan: Box::new(Zeroable::zeroed()),
                estimate: Box::new(Zeroable::zeroed()),
                odometry: Zeroable::zeroed(),
            },
            truth: scene.start,
            scene,
            robot: config.robot,
            twist: Zeroable::zeroed(),
            seq: 0,
            fit: 0.0,
            tracking: Tracking::Tracking,
            is_placed: true,
        };
        drive.receive(SKETCH, &map, &cells);
        drive.receive(ROUTE, &*route, &[]);
        drive.order(Order::Start);
        drive
    }

    /// Passes a message to the planner.
    pub fn receive<T: Message>(&mut self, channel: Channel<T>, message: &T, cells: &[u8]) {
        self.planner
            .receive(&Incoming::new(&self.access, channel.spec, bytemuck::bytes_of(message), cells))
            .unwrap();
    }

    /// Lets the world produce its messages.
    pub fn sense(&mut self) {
        self.seq += 1;
        let header = Header { seq: self.seq, stamp_ns: self.seq * (DT_S * 1e9) as u64, source_seq: self.seq };
        let origin = Pose::<Odom>::new(0.0, 0.0, 0.0);
        let moved = self.scene.start.motion_to(&self.truth);
        let odometry = PoseM::new(&origin.compose(&moved));
        self.senses.odometry = Odometry { header, pose: odometry, twist: self.twist };
        self.make_scan(header);
        self.make_estimate(header, odometry);
    }

    fn make_scan(&mut self, header: Header) {
        let laser = self.robot.laser().unwrap();
        let fov = laser.field_of_view_deg.to_radians();
        let scan = &mut self.senses.scan;
        scan.header = header;
        scan.angle_min_rad = (-fov / 2.0) as f32;
        scan.angle_max_rad = (fov / 2.0) as f32;
        scan.angle_increment_rad = (fov / f64::from(laser.beams - 1)) as f32;
        scan.range_min_m = laser.range_min_m as f32;
        scan.range_max_m = laser.range_max_m as f32;
        scan.beam_count = laser.beams;
        let (sin, cos) = self.truth.yaw_rad.sin_cos();
        let x = self.truth.x + cos * laser.mount_x_m - sin * laser.mount_y_m;
        let y = self.truth.y + sin * laser.mount_x_m + cos * laser.mount_y_m;
        for i in 0..laser.beams as usize {
            let angle = self.truth.yaw_rad + laser.mount_yaw_deg.to_radians() + f64::from(scan.angle_rad(i));
            // A centimetre of noise that is the same on every machine.
            let noise = 0.01 * (((self.seq * 7919 + i as u64 * 104_729) % 1000) as f64 / 500.0 - 1.0);
            let range = self.scene.range(x, y, angle) + noise;
            scan.ranges_m[i] = if range > laser.range_max_m { f32::INFINITY } else { range as f32 };
        }
    }

    fn make_estimate(&mut self, header: Header, odometry: PoseM) {
        let ([x, y], [a, b]) = (self.scene.warp)(self.truth.x, self.truth.y);
        let estimate = &mut self.senses.estimate;
        estimate.header = header;
        estimate.pose = PosePx::new(&Pose::<Sketch>::new(x, y, self.truth.yaw_rad));
        (estimate.scale_a_pxpm, estimate.scale_b_pxpm) = (a, b);
        estimate.odometry = odometry;
        estimate.tracking = self.tracking.code();
        estimate.particle_count = self.is_placed.into();
        estimate.fit = self.fit;
    }

    /// Lets the planner take its step and returns the command.
    pub fn think(&mut self) -> VelocityCommand {
        self.sent.end_instant();
        let Header { stamp_ns, source_seq, .. } = self.senses.odometry.header;
        let instant = Instant::new(&self.access, source_seq, stamp_ns, &self.senses);
        self.planner.step(&instant, &mut Outbox::new(&mut self.sent, stamp_ns, source_seq)).unwrap();
        *self.said(COMMAND).unwrap()
    }

    /// Returns the message that the planner sent on a channel in this step.
    pub fn said<T: Message>(&self, channel: Channel<T>) -> Option<&T> {
        let said = self.sent.newest(channel.spec).filter(|said| said.is_fresh);
        said.map(|said| bytemuck::from_bytes(said.message))
    }

    /// Moves the robot, which stops at walls.
    pub fn act(&mut self, twist: Twist) {
        self.twist = twist;
        let (sin, cos) = self.truth.yaw_rad.sin_cos();
        let x = self.truth.x + DT_S * (cos * twist.vx_mps - sin * twist.vy_mps);
        let y = self.truth.y + DT_S * (sin * twist.vx_mps + cos * twist.vy_mps);
        let yaw = self.truth.yaw_rad + DT_S * twist.yaw_rate_radps;
        let free = self.scene.clearance(x, y) >= self.robot.radius_m;
        self.truth = if free { Pose::new(x, y, yaw) } else { Pose::new(self.truth.x, self.truth.y, yaw) };
    }

    /// Carries the robot to a pose, which its odometry does not notice.
    pub fn carry(&mut self, x: f64, y: f64, yaw_rad: f64) {
        let moved = self.scene.start.motion_to(&self.truth);
        let back = moved.motion_to(&Pose::new(0.0, 0.0, 0.0));
        self.truth = Pose::new(x, y, yaw_rad);
        self.scene.start = self.truth.compose(&back);
    }

    /// Takes a whole step and returns the status of the mission after it.
    pub fn step(&mut self) -> MissionStatus {
        self.sense();
        let command = self.think();
        self.act(command.twist);
        *self.said(STATUS).unwrap()
    }

    /// Takes steps until the status of the mission satisfies `is_so`, for at most ten minutes.
    pub fn until(&mut self, what: &str, is_so: impl Fn(&MissionStatus) -> bool) -> MissionStatus {
        let found = (0..6000).map(|_| self.step()).find(is_so);
        found.unwrap_or_else(|| panic!("never {what}: {:?}", self.step()))
    }

    /// Returns the true position of the robot.
    pub fn place(&self) -> [f64; 2] {
        [self.truth.x, self.truth.y]
    }

    /// Passes a person's order to the planner.
    pub fn order(&mut self, order: Order) {
        self.receive(ORDERS, &MissionCommand { order: order.code(), ..Zeroable::zeroed() }, &[]);
    }

    /// Passes a person's order to go to a place of the drawing to the planner.
    pub fn send_to(&mut self, name: &str, at: [f64; 2]) {
        let mut order = MissionCommand { order: Order::Goal.code(), ..Zeroable::zeroed() };
        order.set_place(&NamedPlace { name: Text::new(name), at: Point::new(at[0], at[1]) });
        self.receive(ORDERS, &order, &[]);
    }

    /// Passes a person's mark of the robot's position in the drawing to the planner.
    pub fn tell(&mut self, x_px: f64, y_px: f64) {
        let mut order = MissionCommand { order: Order::Here.code(), ..Zeroable::zeroed() };
        order.set_here(&Here { at: Point::new(x_px, y_px), yaw_rad: None });
        self.receive(ORDERS, &order, &[]);
    }

    /// Drives until the mission ends, but for at most `most_s` seconds.
    pub fn run(mut self, most_s: f64) -> Outcome {
        let mut outcome = Outcome { closest_m: f64::INFINITY, ..Outcome::default() };
        let mut recovering = false;
        while outcome.seconds < most_s {
            self.sense();
            let command = self.think();
            let status = *self.said(STATUS).unwrap();
            if let Some(plan) = self.said(PLAN) {
                outcome.plans += 1;
                outcome.all_bytes.extend_from_slice(bytemuck::bytes_of(plan));
            }
            outcome.all_bytes.extend_from_slice(bytemuck::bytes_of(&command));
            outcome.all_bytes.extend_from_slice(bytemuck::bytes_of(&status));
            let state = TaskState::from_code(status.state).unwrap();
            if state >= TaskState::Reached {
                outcome.ends.push((state, status.reason.as_str().to_owned()));
            }
            let recovers = status.reason.as_str().starts_with("no progress");
            outcome.recoveries += usize::from(recovers && !recovering);
            recovering = recovers;
            outcome.commands.push(command);
            if command.last == 1 {
                break;
            }
            self.act(command.twist);
            outcome.way.push([self.truth.x, self.truth.y]);
            let clearance = self.scene.clearance(self.truth.x, self.truth.y);
            outcome.closest_m = outcome.closest_m.min(clearance - self.robot.radius_m);
            outcome.seconds += DT_S;
        }
        outcome
    }
}

impl Outcome {
    pub fn states(&self) -> Vec<TaskState> {
        self.ends.iter().map(|(state, _)| *state).collect()
    }

    pub fn length_m(&self) -> f64 {
        self.way.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum()
    }

    /// Returns true if the path passed within `radius_m` of the places in their order.
    pub fn passes(&self, places: &[[f64; 2]], radius_m: f64) -> bool {
        let mut way = self.way.iter();
        places.iter().all(|place| way.any(|p| (p[0] - place[0]).hypot(p[1] - place[1]) < radius_m))
    }
}
