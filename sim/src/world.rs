//! The simulated world as one state machine: a command in, a laser period of motion, messages out.
//!
//! It never reads a clock and never decides about pace: whoever calls [`World::step`] does.

use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_schemas::message::{
    Contact, GroundTruth, Header, LaserScan, MAX_CONTACTS, Odometry, PoseM, Twist, VelocityCommand,
};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::seed;

use crate::convex::{Convex, Segment};
use crate::description::WorldDescription;
use crate::drive;
use crate::error::{SimError, check_finite};
use crate::laser::Scanner;
use crate::odometry::DeadReckoning;
use crate::people::Walker;
use crate::physics::{Physics, Touching, TruePose};
use crate::raycast::Faces;

/// A command older than this stops the robot, nanoseconds of simulation time.
pub const COMMAND_LIMIT_NS: u64 = 500_000_000;
/// Physics steps a second, at least.
const PHYSICS_HZ: f64 = 100.0;
const STOP: Twist = Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };

/// The world and everything in it; its whole state can be stored and restored with serde.
#[derive(Serialize, Deserialize)]
pub struct World {
    outline: Vec<Segment>,
    furniture: Vec<Convex>,
    faces: Faces,
    robot: Robot,
    scanner: Scanner,
    odometry: DeadReckoning,
    people: Vec<Walker>,
    physics: Physics,
    touches: Vec<Touch>,
    events: Vec<Event>,
    command: Option<Held>,
    steps: u64,
    period_ns: u64,
    substeps: u32,
}

/// The command that the robot follows.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Held {
    /// Forward, left, m/s; rad/s.
    velocity: [f64; 3],
    stamp_ns: u64,
}

/// What is known of the contact with a body.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Touch {
    /// Whether the robot touched the body during the last step.
    now: bool,
    /// Whether the begin of the contact has been reported and its end not.
    reported: bool,
    place: [f64; 2],
    impulse_ns: f64,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Event {
    body: usize,
    begins: bool,
    touch: Touch,
}

/// Outside the outermost walls there is nothing to be seen, and nowhere to go.
fn check_within_walls(start: &Pose<WorldFrame>, outline: &[Segment]) -> Result<(), SimError> {
    let extent = |axis: usize| {
        let along = outline.iter().flatten().map(|corner| corner[axis]);
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ((left, right), (bottom, top)) = (extent(0), extent(1));
    let within = (left..=right).contains(&start.x) && (bottom..=top).contains(&start.y);
    let walls = format!(
        "({}, {}) m, outside the walls, which reach from ({left:.2}, {bottom:.2}) to ({right:.2}, {top:.2}) m",
        start.x, start.y
    );
    if within {
        return Ok(());
    }
    Err(SimError::Value { key: "start.world".into(), expected: "a place within the walls", found: walls })
}

impl World {
    /// A world in which the robot stands at `start`, at time 0, before its first scan.
    ///
    /// # Errors
    /// [`SimError::Start`] where the robot does not fit there.
    pub fn new(
        description: WorldDescription,
        robot: &Robot,
        start: Pose<WorldFrame>,
        seed: u64,
    ) -> Result<Self, SimError> {
        check_finite("start", &[start.x, start.y, start.yaw_rad])?;
        check_within_walls(&start, &description.outline)?;
        let period_s = 1.0 / robot.laser.rate_hz;
        let substeps = substeps(robot, period_s);
        let at = TruePose { at: start.position().coords(), yaw_rad: start.yaw_rad };
        let physics = Physics::new(&description, robot, at, period_s / f64::from(substeps))?;
        let stream = |name| seed::stream(seed, name);
        let WorldDescription { outline, furniture, people, .. } = description;
        let faces: Vec<_> = outline.iter().copied().chain(furniture.iter().flat_map(Convex::edges)).collect();
        Ok(Self {
            outline,
            furniture,
            faces: Faces::new(&faces),
            robot: robot.clone(),
            scanner: Scanner::new(&robot.laser, stream("world/laser")),
            odometry: DeadReckoning::new(&robot.odometry, robot.drive, stream("world/odometry")),
            people: people.iter().map(Walker::new).collect(),
            touches: vec![Touch::default(); physics.body_count()],
            physics,
            events: Vec::with_capacity(MAX_CONTACTS),
            command: None,
            steps: 0,
            period_ns: (period_s * 1e9).round() as u64,
            substeps,
        })
    }

    /// Moves the world on by one laser period. A new `command` takes the place of the one before;
    /// with `None` the robot follows that until it is too old, and then brakes.
    pub fn step(&mut self, command: Option<&VelocityCommand>) {
        if let Some(command) = command {
            let Twist { vx_mps, vy_mps, yaw_rate_radps } = command.twist;
            // A stamp of the future would never grow old.
            let stamp_ns = command.header.stamp_ns.min(self.stamp_ns());
            self.command = Some(Held { velocity: [vx_mps, vy_mps, yaw_rate_radps], stamp_ns });
        }
        let before = self.robot_pose();
        self.touches.iter_mut().for_each(|touch| touch.now = false);
        for substep in 0..self.substeps {
            self.substep(substep);
        }
        self.steps += 1;
        self.odometry.step(&before.motion_to(&self.robot_pose()), self.period_ns as f64 / 1e9);
        self.collect_events();
    }

    fn substep(&mut self, substep: u32) {
        let dt_ns = self.period_ns / u64::from(self.substeps);
        let now_ns = self.stamp_ns() + u64::from(substep) * dt_ns;
        let (dt_s, pose) = (dt_ns as f64 / 1e9, self.physics.robot_pose());
        let (drive, limits) = (self.robot.drive, &self.robot.limits);
        let goal = self.goal(now_ns);
        let velocity =
            drive::accelerate(self.physics.robot_velocity(), pose.yaw_rad, &goal, drive, limits, dt_s);
        self.physics.set_robot_velocity(velocity);
        for (i, person) in self.people.iter_mut().enumerate() {
            person.step(dt_s, pose.at, self.robot.radius_m);
            self.physics.move_person(i, person.position());
        }
        self.physics.step();
        for touching in self.physics.touching() {
            self.touches[touching.body].update(&touching);
        }
    }

    fn goal(&self, now_ns: u64) -> Twist {
        let fresh = self.command.filter(|held| now_ns.saturating_sub(held.stamp_ns) <= COMMAND_LIMIT_NS);
        fresh.map_or(STOP, |Held { velocity: [vx_mps, vy_mps, yaw_rate_radps], .. }| Twist {
            vx_mps,
            vy_mps,
            yaw_rate_radps,
        })
    }

    /// A contact begins with the first step that saw it and ends with the first that did not: what
    /// comes and goes within a step is one contact. More events than a step can hold wait for the next.
    fn collect_events(&mut self) {
        self.events.clear();
        for (body, touch) in self.touches.iter_mut().enumerate() {
            if touch.now != touch.reported && self.events.len() < MAX_CONTACTS {
                self.events.push(Event { body, begins: touch.now, touch: *touch });
                touch.reported = touch.now;
                if !touch.now {
                    touch.impulse_ns = 0.0;
                }
            }
        }
    }

    /// Simulation time of the last step's end, nanoseconds since the start: the stamp of what the
    /// sensors now say.
    pub fn stamp_ns(&self) -> u64 {
        self.steps * self.period_ns
    }

    /// Steps done: 0 before the first; the scan after step n is the robot's scan number n + 1.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Time between two scans, nanoseconds.
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// Writes what the odometry says; all but the header.
    pub fn fill_odometry(&self, odometry: &mut Odometry) {
        odometry.pose = PoseM::new(&self.odometry.pose());
        odometry.twist = self.odometry.twist();
    }

    /// Writes the truth; all but the header.
    pub fn fill_truth(&self, truth: &mut GroundTruth) {
        truth.pose = PoseM::new(&self.robot_pose());
        truth.twist = self.robot_twist();
    }

    /// Writes what the laser sees; all but the header. As often as it is asked, the same scan.
    pub fn fill_scan(&self, scan: &mut LaserScan) {
        let people = self.people.iter().map(|person| (person.position().into(), person.radius_m()));
        self.scanner.fill(&self.robot_pose(), &self.faces, people, self.steps, scan);
    }

    /// The contacts that began or ended during the last step, at most [`MAX_CONTACTS`]; headers zero.
    pub fn contacts(&self) -> impl ExactSizeIterator<Item = Contact> + '_ {
        self.events.iter().map(|event| Contact {
            header: Header { seq: 0, stamp_ns: 0, source_seq: 0 },
            position_m: event.touch.place,
            impulse_ns: event.touch.impulse_ns,
            body_kind: self.physics.kind(event.body).code(),
            begins: u32::from(event.begins),
        })
    }

    /// Where the robot truly is.
    pub fn robot_pose(&self) -> Pose<WorldFrame> {
        let TruePose { at, yaw_rad } = self.physics.robot_pose();
        Pose::new(at.x, at.y, yaw_rad)
    }

    /// How fast it truly moves, in its own axes.
    pub fn robot_twist(&self) -> Twist {
        let velocity = self.physics.robot_velocity();
        let body = Rotation2::new(-self.robot_pose().yaw_rad) * velocity.linear;
        Twist { vx_mps: body.x, vy_mps: body.y, yaw_rate_radps: velocity.angular }
    }

    /// The faces of the walls, metres, frame `World`.
    pub fn outline(&self) -> &[Segment] {
        &self.outline
    }

    /// What stands around.
    pub fn furniture(&self) -> &[Convex] {
        &self.furniture
    }

    /// Who walks around: place in metres and radius.
    pub fn people(&self) -> impl ExactSizeIterator<Item = (Vector2<f64>, f64)> + '_ {
        self.people.iter().map(|person| (person.position(), person.radius_m()))
    }
}

impl Touch {
    fn update(&mut self, touching: &Touching) {
        if !self.now || touching.impulse_ns >= self.impulse_ns {
            self.place = touching.place.into();
        }
        self.impulse_ns = self.impulse_ns.max(touching.impulse_ns);
        self.now = true;
    }
}

/// Physics steps a laser period: often enough that the robot never moves far within one.
fn substeps(robot: &Robot, period_s: f64) -> u32 {
    let by_rate = PHYSICS_HZ * period_s;
    let by_speed = 4.0 * robot.limits.speed_mps * period_s / robot.radius_m;
    (by_rate.max(by_speed) - 1e-9).ceil() as u32
}
