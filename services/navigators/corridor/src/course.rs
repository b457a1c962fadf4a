//! The way on through free space: this project's own method.
//!
//! One rolling grid holds what is known of the walls. The laser fills it; without one, remembered markers do, each of
//! which stands for a piece of the wall that it hangs on. On the grid the robot looks for the reachable place that lies
//! farthest along its direction. Where that is near, the corridor turns or ends: then the robot looks to the sides, and at
//! last behind. Costs of the way grow near walls, so the way keeps to the middle and around people.

use std::f64::consts::{FRAC_PI_2, PI};

use bytemuck::Zeroable;
use serde::{Deserialize, Serialize};
use sketchnav_motion::local::{self, LocalPlanner, Room};
use sketchnav_motion::obstacles::{CELL_M, Cell, Obstacles};
use sketchnav_motion::pursuit::{Body, Pursuit};
use sketchnav_schemas::geometry::{Odom, Point, Pose, wrap_angle};
use sketchnav_schemas::message::{LaserScan, Twist};
use sketchnav_schemas::robot::Robot;

use crate::messages::KnownMarker;
use crate::mission::Turn;
use crate::way::Way;

/// Free space beside the robot's flank that it needs, metres: it faces where it drives.
const BESIDE_M: f64 = 0.06;
/// From so far on walls do not matter any more, metres beside the flank.
const WIDE_M: f64 = 1.1;
/// How much a metre of way counts against a metre ahead.
const WAY_SHARE: f64 = 0.35;
/// How much a metre beside the direction counts against a metre ahead.
const CROSS_SHARE: f64 = 0.3;
/// A corridor is closed whose farthest place ahead is nearer than this, metres.
const CLOSED_M: f64 = 1.3;
/// Before what closes the corridor the robot stops at this distance, metres: there it has room to turn.
const STOP_M: f64 = 0.6;
/// A side is open where it reaches so much farther than the corridor's half width, metres.
const OPENING_M: f64 = 1.2;
/// Beside an open side the corridor goes on where the robot can come so far ahead, metres.
const ON_M: f64 = 2.6;
/// Half the width of the free way before it is known, metres.
const HALF_WIDTH_M: f64 = 0.8;
/// Sides are walls that are nearer than this, metres.
const WALL_M: f64 = 1.9;
/// The direction follows places that are farther than this, metres, ...
const FAR_M: f64 = 2.0;
/// ... by this share of its error a step, ...
const ALIGN: f64 = 0.06;
/// ... of an error of this at most, radians.
const ALIGN_MOST_RAD: f64 = 0.35;
/// At a closed junction the robot waits so long for the side that it is to take, seconds.
const PATIENCE_S: f64 = 3.0;
/// Walls that close a corridor do so in all of its width: no lane is free for so much farther, metres.
const LANE_M: f64 = 1.0;
/// A corridor that is closed from wall to wall is an end after this time, seconds.
const END_S: f64 = 6.0;
/// Without progress for this long the way is blocked, seconds.
const BLOCKED_S: f64 = 60.0;
/// Progress is more than this, metres.
const PROGRESS_M: f64 = 0.3;
/// How long walls are remembered out of sight, seconds.
const MEMORY_S: f64 = 20.0;
/// Half the length of the piece of wall that a marker stands for, metres.
const WALL_PIECE_M: f64 = 0.8;
/// Beams of the scan that markers make.
const BEAMS: usize = 360;
/// How far that scan reaches, metres.
const MARKER_REACH_M: f32 = 3.2;

/// What came of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Next {
    /// It goes on.
    Driving(Reason),
    /// The corridor ends here.
    End,
    /// No way leads on.
    Blocked,
}

/// What the robot is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Along the corridor.
    Along,
    /// Something closes the corridor; it may go away.
    Waiting,
    /// Around a corner, or into another corridor.
    Turning(Turn),
    /// Back, out of a dead end.
    Back,
}

/// Where the course leads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Guide {
    /// Direction along the corridor, radians in the odometry frame.
    way_rad: f64,
    /// Where the robot was a step before.
    last: Point<Odom>,
    /// How far it has come.
    way: Way,
    /// Way since the robot last got on, metres, and how long that is ago, seconds.
    fresh_m: f64,
    stale_s: f64,
    /// For how long the corridor has been closed ahead, seconds.
    closed_s: f64,
    /// Turns taken or passed.
    turns: usize,
    /// Whether a side was open a step before.
    is_junction: bool,
    /// Half the width of the free way, metres.
    half_width_m: f64,
    /// The change of direction that is under way; straight: back.
    changed: Option<Turn>,
}

/// What counts from one step to the next, as it is read back from a checkpoint.
#[derive(Debug, Clone, Deserialize)]
pub struct State {
    guide: Guide,
    obstacles: Obstacles,
    pursuit: Pursuit,
}

/// The same where it lies: field by field a [`State`].
#[derive(Debug, Serialize)]
pub struct StateView<'a> {
    guide: &'a Guide,
    obstacles: &'a Obstacles,
    pursuit: &'a Pursuit,
}

/// A way along a corridor.
#[derive(Debug)]
pub struct Course {
    room: Room,
    footprint_m: f64,
    speed_share: f64,
    guide: Guide,
    obstacles: Obstacles,
    pursuit: Pursuit,
    local: LocalPlanner,
    path: Vec<Point<Odom>>,
    /// The scan that markers make.
    markers: Box<LaserScan>,
}

impl Guide {
    fn new(robot: &Pose<Odom>) -> Self {
        Self {
            way_rad: robot.yaw_rad,
            last: robot.position(),
            way: Way::default(),
            fresh_m: 0.0,
            stale_s: 0.0,
            closed_s: 0.0,
            turns: 0,
            is_junction: false,
            half_width_m: HALF_WIDTH_M,
            changed: None,
        }
    }

    fn turn(&mut self, turn: Turn) {
        let by_rad = match turn {
            Turn::Left => FRAC_PI_2,
            Turn::Right => -FRAC_PI_2,
            Turn::Straight => PI,
        };
        self.way_rad = wrap_angle(self.way_rad + by_rad);
        (self.closed_s, self.is_junction) = (0.0, true);
        self.way.turn(turn);
        self.changed = Some(turn);
        self.fresh_m = 0.0;
    }
}

impl Course {
    /// A course at rest that knows nothing yet; it drives at most `speed_mps`.
    pub fn new(robot: &Robot, speed_mps: f64) -> Self {
        let [_, half_width_m] = robot.half_extents_m();
        let hard_m = half_width_m + BESIDE_M;
        let body = Body { radius_m: half_width_m, drive: robot.drive, limits: robot.limits };
        let step_rad = std::f32::consts::TAU / BEAMS as f32;
        let markers = LaserScan {
            angle_min_rad: -std::f32::consts::PI,
            angle_max_rad: std::f32::consts::PI - step_rad,
            angle_increment_rad: step_rad,
            range_max_m: MARKER_REACH_M,
            beam_count: BEAMS as u32,
            ..Zeroable::zeroed()
        };
        Self {
            room: Room { hard_m, soft_m: half_width_m + WIDE_M },
            footprint_m: half_width_m,
            speed_share: (speed_mps / robot.limits.speed_mps).min(1.0),
            guide: Guide::new(&Pose::new(0.0, 0.0, 0.0)),
            obstacles: Obstacles::new(MEMORY_S),
            pursuit: Pursuit::new(body),
            local: LocalPlanner::default(),
            path: Vec::with_capacity(local::MAX_PATH + 1),
            markers: Box::new(markers),
        }
    }

    /// Takes in a scan made at `sensor` by a robot at `robot`.
    pub fn observe(&mut self, robot: &Pose<Odom>, sensor: &Pose<Odom>, scan: &LaserScan) {
        self.obstacles.observe(robot, self.footprint_m, sensor, scan);
    }

    /// Takes in the markers that a robot at `robot` remembers: each is a piece of wall.
    pub fn observe_markers(&mut self, robot: &Pose<Odom>, markers: &[KnownMarker]) {
        for (i, range_m) in self.markers.ranges_m[..BEAMS].iter_mut().enumerate() {
            let (sin, cos) = (f64::from(self.markers.angle_min_rad)
                + i as f64 * std::f64::consts::TAU / BEAMS as f64)
                .sin_cos();
            let nearest =
                markers.iter().filter_map(|marker| range(marker, [cos, sin])).fold(f64::INFINITY, f64::min);
            // Where no marker tells of a wall, nothing is known.
            *range_m = if nearest < f64::from(MARKER_REACH_M) { nearest as f32 } else { f32::NAN };
        }
        self.obstacles.observe(robot, self.footprint_m, robot, &self.markers);
    }

    /// Begins a task: the way on is where the robot looks.
    pub fn begin(&mut self, robot: &Pose<Odom>) {
        self.guide = Guide { half_width_m: self.guide.half_width_m, ..Guide::new(robot) };
    }

    /// The way along the corridor since the task began.
    pub fn way(&self) -> &Way {
        &self.guide.way
    }

    /// Direction along the corridor, radians in the odometry frame.
    pub fn way_rad(&self) -> f64 {
        self.guide.way_rad
    }

    /// Brakes.
    pub fn stop(&mut self, dt_s: f64) {
        self.pursuit.stop(dt_s);
    }

    /// The last command.
    pub fn command(&self) -> Twist {
        self.pursuit.last()
    }

    /// What counts from one step to the next.
    pub fn state(&self) -> StateView<'_> {
        StateView { guide: &self.guide, obstacles: &self.obstacles, pursuit: &self.pursuit }
    }

    /// Goes on from another's state.
    pub fn restore(&mut self, state: State) {
        (self.guide, self.obstacles, self.pursuit) = (state.guide, state.obstacles, state.pursuit);
    }

    /// Drives on for `dt_s`: at junctions by `turns`; at an end it stops, or turns back where it is not to.
    pub fn drive(&mut self, robot: &Pose<Odom>, turns: &[Turn], stops_at_end: bool, dt_s: f64) -> Next {
        self.advance(robot.position(), dt_s);
        if self.guide.stale_s > BLOCKED_S {
            self.stop(dt_s);
            return Next::Blocked;
        }
        let here = robot.position();
        self.local.prepare(&self.obstacles, here, self.room);
        self.local.search(here, None);
        let [ahead_m, left_m, right_m] = [0.0, FRAC_PI_2, -FRAC_PI_2].map(|turn| self.reach_m(here, turn));
        let reason = self.choose(ahead_m, [left_m, right_m], turns, dt_s);
        let is_closed = reason == Reason::Waiting && self.guide.closed_s > END_S;
        let is_end = is_closed && self.is_closed_by_walls(here);
        if is_end && stops_at_end {
            self.stop(dt_s);
            return Next::End;
        }
        if is_end && self.reach_m(here, PI) > CLOSED_M {
            self.guide.turn(Turn::Straight);
        }
        if reason == Reason::Waiting && ahead_m < STOP_M {
            self.stop(dt_s);
        } else {
            self.follow(robot, dt_s);
        }
        Next::Driving(reason)
    }

    /// Counts the way.
    fn advance(&mut self, here: Point<Odom>, dt_s: f64) {
        let guide = &mut self.guide;
        let step = here.coords() - guide.last.coords();
        let (sin, cos) = guide.way_rad.sin_cos();
        let along_m = step.x * cos + step.y * sin;
        match guide.changed {
            Some(Turn::Left | Turn::Right) => guide.way.round(along_m, step.y * cos - step.x * sin),
            Some(Turn::Straight) | None => guide.way.drive(along_m),
        }
        guide.last = here;
        guide.stale_s += dt_s;
        guide.fresh_m += along_m.max(0.0);
        if guide.fresh_m > PROGRESS_M {
            (guide.fresh_m, guide.stale_s) = (0.0, 0.0);
            guide.changed.take_if(|turn| *turn == Turn::Straight);
        }
    }

    /// Which way to go on, by how far the robot can come ahead, to the left and to the right.
    fn choose(&mut self, ahead_m: f64, sides_m: [f64; 2], turns: &[Turn], dt_s: f64) -> Reason {
        let guide = &mut self.guide;
        let is_open = sides_m.map(|reach_m| reach_m > guide.half_width_m + OPENING_M);
        let wanted = turns.get(guide.turns).copied();
        // A bend has one way on, a junction has two.
        let is_choice = is_open == [true; 2] || ahead_m > ON_M;
        let side = match wanted.filter(|_| is_choice) {
            Some(Turn::Left) if is_open[0] => Some(Turn::Left),
            Some(Turn::Right) if is_open[1] => Some(Turn::Right),
            _ => None,
        };
        // The opening of the last turn is not the next junction.
        if let Some(side) = side.filter(|_| !guide.is_junction) {
            guide.turns += 1;
            guide.turn(side);
            return Reason::Turning(side);
        }
        if guide.is_junction && is_open == [false; 2] {
            guide.turns += usize::from(wanted == Some(Turn::Straight) && guide.changed.is_none());
            guide.is_junction = false;
            guide.changed.take_if(|turn| *turn != Turn::Straight);
        }
        if is_open != [false; 2] && wanted == Some(Turn::Straight) {
            guide.is_junction = true;
        }
        if sides_m.iter().all(|reach_m| *reach_m < WALL_M) {
            let half_m = f64::midpoint(sides_m[0], sides_m[1]);
            guide.half_width_m += 0.1 * (half_m - guide.half_width_m);
        }
        if ahead_m > CLOSED_M {
            guide.closed_s = 0.0;
            return guide.reason();
        }
        let farther =
            if sides_m[0] >= sides_m[1] { (Turn::Left, is_open[0]) } else { (Turn::Right, is_open[1]) };
        let is_wanted = wanted.is_none_or(|wanted| wanted == farther.0) || guide.closed_s > PATIENCE_S;
        match farther {
            (side, true) if is_wanted => {
                // A bend is no junction: there is one way on.
                guide.turns += usize::from(wanted == Some(side) && is_open == [true; 2]);
                guide.turn(side);
                Reason::Turning(side)
            }
            _ => {
                guide.closed_s += dt_s;
                Reason::Waiting
            }
        }
    }

    /// Whether all lanes of the corridor end at about the same distance. Beside somebody who stands in the way one can see
    /// along it, though the robot has no room there.
    fn is_closed_by_walls(&self, here: Point<Odom>) -> bool {
        let (sin, cos) = self.guide.way_rad.sin_cos();
        let reach_m = CLOSED_M + LANE_M;
        let is_free = |beside_m: f64, ahead_m: f64| {
            let place =
                Point::new(here.x + ahead_m * cos - beside_m * sin, here.y + ahead_m * sin + beside_m * cos);
            let cell = Cell::of(place);
            self.obstacles.is_known(cell) && !self.obstacles.is_occupied(cell)
        };
        let steps = (reach_m / CELL_M).ceil() as i32;
        let is_open = |lane: i32| {
            let beside_m = f64::from(lane) / 4.0 * (self.guide.half_width_m + self.room.hard_m / 2.0);
            (0..steps).all(|step| is_free(beside_m, f64::from(step) * CELL_M))
        };
        !(-4..=4).any(is_open)
    }

    /// How far the robot can come in a direction, from that of the corridor; metres.
    fn reach_m(&self, here: Point<Odom>, from_way_rad: f64) -> f64 {
        self.farthest(here, self.guide.way_rad + from_way_rad).map_or(0.0, |(_, along_m)| along_m)
    }

    /// The place that lies farthest in a direction, by what the way there costs; and how far. A place that nobody has
    /// seen is none: behind every wall there would be a way.
    fn farthest(&self, here: Point<Odom>, direction_rad: f64) -> Option<(Point<Odom>, f64)> {
        let (sin, cos) = direction_rad.sin_cos();
        let split = |place: Point<Odom>| {
            let step = place.coords() - here.coords();
            [step.x * cos + step.y * sin, (step.y * cos - step.x * sin).abs()]
        };
        let place = self.local.best(WAY_SHARE, |place| {
            let [along_m, cross_m] = split(place);
            let is_known = along_m > 0.0 && self.obstacles.is_known(Cell::of(place));
            if is_known { CROSS_SHARE * cross_m - along_m } else { f64::INFINITY }
        })?;
        Some((place, split(place)[0]))
    }

    /// Follows the way to the farthest place ahead.
    fn follow(&mut self, robot: &Pose<Odom>, dt_s: f64) {
        let Some((place, along_m)) = self.farthest(robot.position(), self.guide.way_rad) else {
            self.stop(dt_s);
            return;
        };
        // Around a bend the way is no direction of a corridor.
        let is_rounding = matches!(self.guide.changed, Some(Turn::Left | Turn::Right));
        if along_m > FAR_M && !is_rounding {
            let bearing_rad = (place.y - robot.y).atan2(place.x - robot.x);
            let error_rad =
                wrap_angle(bearing_rad - self.guide.way_rad).clamp(-ALIGN_MOST_RAD, ALIGN_MOST_RAD);
            self.guide.way_rad = wrap_angle(self.guide.way_rad + ALIGN * error_rad);
        }
        self.local.path(place, &mut self.path);
        self.pursuit.follow(&self.path, robot, &self.obstacles, self.speed_share, dt_s);
    }
}

impl Guide {
    fn reason(&self) -> Reason {
        match self.changed {
            Some(Turn::Straight) => Reason::Back,
            Some(side) => Reason::Turning(side),
            None => Reason::Along,
        }
    }
}

/// How far a ray from the robot goes until it meets the piece of wall that a marker stands for, metres.
fn range(marker: &KnownMarker, [dx, dy]: [f64; 2]) -> Option<f64> {
    let [x, y, facing_rad] = [marker.x_m, marker.y_m, marker.facing_rad].map(f64::from);
    let (normal_y, normal_x) = facing_rad.sin_cos();
    // The robot must be on the side to which the marker looks.
    let towards = dx * normal_x + dy * normal_y;
    let distance_m = (x * normal_x + y * normal_y) / towards;
    let beside_m = (dx * distance_m - x) * -normal_y + (dy * distance_m - y) * normal_x;
    (towards < -1e-3 && distance_m > 0.0 && beside_m.abs() < WALL_PIECE_M).then_some(distance_m)
}
