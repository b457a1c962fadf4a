//! Finds a way ahead through free space. This is our own method.
//!
//! A rolling grid contains everything that is known about the walls. It is filled from laser scans or, if the robot has no laser,
//! from remembered markers, each of which represents a piece of the wall it hangs on. On this grid, the robot looks for the
//! reachable point that lies farthest along its direction. If that point is near, the corridor turns or ends, so the robot looks to
//! both sides and, as a last resort, behind. Paths cost more near walls, which keeps the robot in the middle of the corridor and
//! leads it around people.

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

/// Free space that the robot needs beside each flank, in metres. Its length does not matter, since it faces where it drives.
const BESIDE_M: f64 = 0.06;
/// Distance from the flank beyond which walls no longer add to the cost of a path, in metres.
const WIDE_M: f64 = 1.1;
/// Weight of a metre of path, relative to a metre gained ahead.
const WAY_SHARE: f64 = 0.35;
/// Weight of a metre of sideways offset, relative to a metre gained ahead.
const CROSS_SHARE: f64 = 0.3;
/// A corridor counts as closed if the farthest reachable point ahead is nearer than this, in metres.
const CLOSED_M: f64 = 1.3;
/// In a closed corridor, the robot stops once the farthest reachable point ahead is nearer than this, in metres. It still has
/// enough space to turn there.
const STOP_M: f64 = 0.6;
/// A side counts as open if it reaches this much farther than half the width of the corridor, in metres.
const OPENING_M: f64 = 1.2;
/// Beside an open side, the corridor counts as continuing ahead if the robot can get this far, in metres.
const ON_M: f64 = 2.6;
/// Half the width of a corridor that has not been measured yet, in metres.
const HALF_WIDTH_M: f64 = 0.8;
/// The width of the corridor is measured only while both sides reach less far than this, in metres.
const WALL_M: f64 = 1.9;
/// The direction of the corridor is corrected only towards points that are farther away than this, in metres.
const FAR_M: f64 = 2.0;
/// Share of the error in the estimated direction of the corridor that is corrected in a step.
const ALIGN: f64 = 0.06;
/// Maximum error of that direction that is taken into account in a step, in radians.
const ALIGN_MOST_RAD: f64 = 0.35;
/// Time for which the robot waits at a closed junction for the requested side to open, in seconds. After that it takes the open
/// side that reaches farther.
const PATIENCE_S: f64 = 3.0;
/// Length beyond [`CLOSED_M`], in metres, for which a lane must be free. Walls close a corridor across its
/// whole width, so a free lane means that something else is in the way.
const LANE_M: f64 = 1.0;
/// Time for which a corridor must have been closed from wall to wall before it counts as ended, in seconds.
const END_S: f64 = 6.0;
/// Time without progress until the robot counts as blocked, in seconds.
const BLOCKED_S: f64 = 60.0;
/// Distance along the corridor that counts as progress, in metres.
const PROGRESS_M: f64 = 0.3;
/// Time for which walls are remembered while they are out of sight, in seconds.
const MEMORY_S: f64 = 20.0;
/// Half the length of the piece of wall that a marker represents, in metres.
const WALL_PIECE_M: f64 = 0.8;
/// Number of beams of the scan that is made up from markers.
const BEAMS: usize = 360;
/// Range of the scan that is made up from markers, in metres.
const MARKER_REACH_M: f32 = 3.2;

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Next {
    /// The robot drives on.
    Driving(Reason),
    /// The corridor ends here.
    End,
    /// The robot has made no progress for too long.
    Blocked,
}

/// The robot's current activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Driving along the corridor.
    Along,
    /// Waiting because something blocks the corridor. It may go away.
    Waiting,
    /// Turning around a corner, or into another corridor.
    Turning(Turn),
    /// Driving back, out of a dead end.
    Back,
}

/// Progress along the corridor, and the corridor's direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Guide {
    /// Direction of the corridor, in radians in the odometry frame.
    way_rad: f64,
    /// Position of the robot one step ago.
    last: Point<Odom>,
    /// Distance covered, not counting dead ends.
    way: Way,
    /// Distance covered (in metres) and time passed (in seconds) since the last progress.
    fresh_m: f64,
    stale_s: f64,
    /// Time for which the corridor ahead has been blocked, in seconds.
    closed_s: f64,
    /// Number of turns taken or passed.
    turns: usize,
    /// Whether the robot is still at a junction that has already been counted. Cleared once both sides are
    /// closed again.
    is_junction: bool,
    /// Half the width of the corridor, in metres.
    half_width_m: f64,
    /// Change of direction in progress. [`Turn::Straight`] stands for turning back.
    changed: Option<Turn>,
}

/// State that is kept from one step to the next, as read back from a checkpoint.
#[derive(Debug, Clone, Deserialize)]
pub struct State {
    guide: Guide,
    obstacles: Obstacles,
    pursuit: Pursuit,
}

/// Borrowed counterpart of [`State`] with the same fields, for writing a checkpoint.
#[derive(Debug, Serialize)]
pub struct StateView<'a> {
    guide: &'a Guide,
    obstacles: &'a Obstacles,
    pursuit: &'a Pursuit,
}

/// Drives a robot along a corridor through free space.
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
    /// The scan that is synthesized from remembered markers.
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
    /// Creates a course at rest, with an empty grid and a top speed of `speed_mps`.
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

    /// Adds a scan made at `sensor` while the robot was at `robot`.
    pub fn observe(&mut self, robot: &Pose<Odom>, sensor: &Pose<Odom>, scan: &LaserScan) {
        self.obstacles.observe(robot, self.footprint_m, sensor, scan);
    }

    /// Adds the markers that a robot at `robot` remembers, each as a piece of wall.
    pub fn observe_markers(&mut self, robot: &Pose<Odom>, markers: &[KnownMarker]) {
        for (i, range_m) in self.markers.ranges_m[..BEAMS].iter_mut().enumerate() {
            let (sin, cos) = (f64::from(self.markers.angle_min_rad)
                + i as f64 * std::f64::consts::TAU / BEAMS as f64)
                .sin_cos();
            let nearest =
                markers.iter().filter_map(|marker| range(marker, [cos, sin])).fold(f64::INFINITY, f64::min);
            // A direction without a marker is unknown rather than free.
            *range_m = if nearest < f64::from(MARKER_REACH_M) { nearest as f32 } else { f32::NAN };
        }
        self.obstacles.observe(robot, self.footprint_m, robot, &self.markers);
    }

    /// Begins a task. The corridor is assumed to lead in the direction that the robot is facing.
    pub fn begin(&mut self, robot: &Pose<Odom>) {
        self.guide = Guide { half_width_m: self.guide.half_width_m, ..Guide::new(robot) };
    }

    /// Returns the distance covered along the corridor since the task began.
    pub fn way(&self) -> &Way {
        &self.guide.way
    }

    /// Returns the direction of the corridor, in radians in the odometry frame.
    pub fn way_rad(&self) -> f64 {
        self.guide.way_rad
    }

    /// Brakes for `dt_s` seconds.
    pub fn stop(&mut self, dt_s: f64) {
        self.pursuit.stop(dt_s);
    }

    /// Returns the last command.
    pub fn command(&self) -> Twist {
        self.pursuit.last()
    }

    /// Returns the state that is kept from one step to the next.
    pub fn state(&self) -> StateView<'_> {
        StateView { guide: &self.guide, obstacles: &self.obstacles, pursuit: &self.pursuit }
    }

    /// Resumes from a stored state.
    pub fn restore(&mut self, state: State) {
        (self.guide, self.obstacles, self.pursuit) = (state.guide, state.obstacles, state.pursuit);
    }

    /// Continues driving for `dt_s` seconds, taking junctions according to `turns`. At the end of the
    /// corridor, the robot stops if `stops_at_end` is true and turns back otherwise.
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

    /// Accounts for the distance covered and the time passed since the last step.
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

    /// Decides how to continue, given how far the robot can drive ahead, to the left and to the right, in metres.
    fn choose(&mut self, ahead_m: f64, sides_m: [f64; 2], turns: &[Turn], dt_s: f64) -> Reason {
        let guide = &mut self.guide;
        let is_open = sides_m.map(|reach_m| reach_m > guide.half_width_m + OPENING_M);
        let wanted = turns.get(guide.turns).copied();
        // A bend offers one way ahead, a junction offers two.
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
                // A bend is not a junction, since it offers only one way ahead.
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

    /// Returns true if no lane of the corridor is free for `CLOSED_M + LANE_M`. Next to a person who stands
    /// in the corridor, the laser sees a free lane, even if it is too narrow for the robot.
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

    /// Returns how far the robot can drive, in metres, in a direction relative to that of the corridor.
    fn reach_m(&self, here: Point<Odom>, from_way_rad: f64) -> f64 {
        self.farthest(here, self.guide.way_rad + from_way_rad).map_or(0.0, |(_, along_m)| along_m)
    }

    /// Returns the point that lies farthest in a direction after subtracting path costs, and its distance in
    /// metres along this direction. Only observed points count. Otherwise, free space would seem to extend
    /// behind every wall.
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

    /// Follows the path to the farthest point ahead.
    fn follow(&mut self, robot: &Pose<Odom>, dt_s: f64) {
        let Some((place, along_m)) = self.farthest(robot.position(), self.guide.way_rad) else {
            self.stop(dt_s);
            return;
        };
        // While the robot rounds a bend, its path does not show the direction of a corridor.
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

/// Returns the distance from the robot to the point where a ray meets the piece of wall that a marker represents, in metres, or
/// `None` if it misses.
fn range(marker: &KnownMarker, [dx, dy]: [f64; 2]) -> Option<f64> {
    let [x, y, facing_rad] = [marker.x_m, marker.y_m, marker.facing_rad].map(f64::from);
    let (normal_y, normal_x) = facing_rad.sin_cos();
    // The robot must be on the side that the marker faces.
    let towards = dx * normal_x + dy * normal_y;
    let distance_m = (x * normal_x + y * normal_y) / towards;
    let beside_m = (dx * distance_m - x) * -normal_y + (dy * distance_m - y) * normal_x;
    (towards < -1e-3 && distance_m > 0.0 && beside_m.abs() < WALL_PIECE_M).then_some(distance_m)
}
