//! The messages and channels of the navigator `sketch`: the drawing, the tasks in it, the robot's pose and
//! plan, and its question to a person.

use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::{MAX_TASKS, PoseM, PosePx, Text};
use sketchnav_schemas::valid::{Checked, FAR, metres, near, rotation, within};

use crate::mission::KIND;

mod map;

pub use map::Origin;

/// Maximum number of particles of a set that are published.
pub const MAX_PARTICLES: usize = 512;
/// Maximum number of points of the global path in a [`Plan`].
pub const MAX_GLOBAL_POINTS: usize = 1024;
/// Maximum number of points of the local path in a [`Plan`].
pub const MAX_LOCAL_POINTS: usize = 256;
/// Maximum number of samples of a drawing's outline.
pub const MAX_SAMPLES: usize = 256;
/// Maximum number of cells of a sketch. This is the canvas of Boniardi et al. 2016, IV (2540 × 1252), in either orientation.
pub const MAX_SKETCH_CELLS: usize = 2540 * 1252;

codes! {
    /// The target of a course of the method `outline`.
    pub enum CourseAim {
        /// There is no course.
        None = 0 "none",
        /// The goal's position in the map.
        Goal = 1 "goal",
        /// A gap in the seen outline, on the way to the goal.
        Gap = 2 "gap",
        /// The position of the goal according to the best rival alignment.
        Rival = 3 "rival",
    }

    /// The kind of match that a sample of the drawing's outline has.
    pub enum PartnerKind {
        /// No match in what was seen.
        Nothing = 0 "nothing",
        /// A wall that was seen.
        Wall = 1 "wall",
        /// A gap in what was seen; the sample lies beyond it.
        Gap = 2 "gap",
    }

    /// A robot's question to a person.
    pub enum QuestionKind {
        /// No question, or the last one has been settled.
        Nothing = 0 "nothing",
        /// Which of several places in the drawing the robot is at.
        Which = 1 "which",
        /// Where in the drawing the robot is.
        Where = 2 "where",
    }
}

messages! {
    /// The drawing as a grid. Its cells follow the message as a byte slice, row 0 at the bottom, each
    /// [`sketchnav_schemas::codes::FREE`] or [`sketchnav_schemas::codes::WALL`], or in a learned map
    /// [`sketchnav_stage::drawn::UNSEEN`] (in ROS 2, the cells are a `nav_msgs/OccupancyGrid`).
    pub struct SketchMap version 1 {
        /// Width of the grid, in pixels.
        pub width_px: u32,
        /// Height of the grid, in pixels.
        pub height_px: u32,
        /// Direction of the walls in (−π/4, π/4], in radians modulo a right angle (Boniardi et al. 2015, III-B). 0 if there are no
        /// straight lines.
        pub wall_direction_rad: f64,
        /// Width of the pen's strokes, in pixels. Negative in maps, which nobody drew: see [`SketchMap::origin`].
        pub pen_width_px: f64,
        /// Pose at which the robot starts. If nobody has marked it, this is a place from where the robot can get to wherever it may
        /// be.
        pub start: PosePx,
        /// Standard deviation of the start position in pixels, since a person's mark is imprecise. Twice the sketch's diagonal if
        /// nobody has marked the start.
        pub start_spread_px: f64,
        /// Standard deviation of the start heading, in radians.
        pub start_spread_rad: f64,
    }

    /// The tasks of the mission in the sketch: goals, or routes drawn by hand.
    pub struct Route version 1 in "sketch" {
        /// Number of valid entries in `tasks`.
        pub task_count: u32 as Count,
        /// Number of valid entries in `points_px`.
        pub point_count: u32 as Count,
        /// The tasks in order.
        pub tasks: [RouteTask; 64] where task_count counts,
        /// All points of all tasks, in pixels (frame [`Sketch`], x and y).
        pub points_px: [[f64; 2]; 8192] where point_count counts,
    }

    /// The robot's pose in the sketch and the sketch's local metric there (Boniardi et al. 2015, III-A).
    pub struct PoseEstimate version 1 in "sketch" valid if estimate {
        /// The pose: the mode of the particles, never a mean of several modes.
        pub pose: PosePx,
        /// Local scale along the wall direction, in pixels per metre.
        pub scale_a_pxpm: f64,
        /// Local scale across the wall direction, in pixels per metre.
        pub scale_b_pxpm: f64,
        /// Covariance of (x px, y px, yaw rad, a px/m, b px/m) around the mode, row by row.
        pub covariance: [f64; 25],
        /// Kish's effective sample size of the weights before resampling.
        pub effective_sample_size: f64,
        /// Fit of the scan: the mean log likelihood of a beam at the estimate.
        pub fit: f64,
        /// Odometry at the time of the scan, from which a reader can extrapolate the pose.
        pub odometry: PoseM,
        /// Number of particles. If there are none and the robot is lost or doubtful, nobody has marked where it is, and the pose means
        /// nothing. It is doubtful if the drawing looks the same after half a turn, so that it may be impossible to find out.
        pub particle_count: u32,
        /// The localizer's confidence in the pose.
        pub tracking: u32 as Tracking,
    }

    /// A sample of the particle set.
    pub struct Particles version 1 in "sketch" {
        /// Number of valid entries in `particles`.
        pub count: u32 as Count,
        /// Number of particles in the whole set.
        pub total: u32,
        /// Every n-th particle of the set.
        pub particles: [Particle; 512] where count counts,
    }

    /// The paths that the planner is about to follow.
    pub struct Plan version 1 in "sketch" {
        /// Index of the task.
        pub task: u32,
        /// Number of valid entries in `global_px`.
        pub global_count: u32 as Count,
        /// Number of valid entries in `local_px`.
        pub local_count: u32 as Count,
        /// 1 if the task follows a drawn route, 0 if it goes to a goal.
        pub follows_route: u32,
        /// The waypoint that the local path leads to, in pixels (frame [`Sketch`]).
        pub target_px: [f64; 2],
        /// The path through the sketch to the goal, or the rest of the drawn route.
        pub global_px: [[f32; 2]; 1024] where global_count counts,
        /// The path to the target around the obstacles that the laser sees.
        pub local_px: [[f32; 2]; 256] where local_count counts,
    }

    /// The drawing's outline aligned with the outline of what the robot has seen, and the course that results. Positions in the
    /// map are in metres. The map's origin is the robot's position at its first scan, and its x axis points along the robot's
    /// heading at that time.
    pub struct Correspondence version 1 in "map" {
        /// Pose of the robot in the map.
        pub robot: PoseM,
        /// Odometry at the time of that pose.
        pub odometry: PoseM,
        /// Position of the goal, estimated from the walls that were seen.
        pub goal_m: [f64; 2],
        /// Share of the outline around the goal that was seen.
        pub seen_share: f64,
        /// Share of the outline around the goal that lies beyond gaps.
        pub hidden_share: f64,
        /// Cost of the alignment.
        pub cost: f64,
        /// Additional cost of the best alignment that puts the goal elsewhere; negative if none was computed.
        pub rival_margin: f64,
        /// Position of the goal in that alignment, or of the gap that leads to it.
        pub rival_m: [f64; 2],
        /// Position of the target that the robot is looking for.
        pub target_m: [f64; 2],
        /// Kind of target.
        pub aim: u32 as CourseAim,
        /// Number of gaps in the outline of what was seen.
        pub gap_count: u32,
        /// Number of valid entries in `samples`.
        pub sample_count: u32 as Count,
        /// Number of valid entries in `way_m`.
        pub way_count: u32 as Count,
        /// The samples of the drawing's outline, counter-clockwise.
        pub samples: [OutlineSample; 256] where sample_count counts,
        /// The path to the end of the course.
        pub way_m: [[f32; 2]; 128] where way_count counts,
    }

    /// The robot's question to a person: where in the drawing it is. The answer is an order `here`.
    pub struct Question version 1 in "sketch" {
        /// Kind of question.
        pub kind: u32 as QuestionKind,
        /// Number of valid entries in `places`.
        pub place_count: u32 as Count,
        /// Places where the robot may be, likeliest first. People know them as A, B, C and D.
        pub places: [PossiblePlace; 4] where place_count counts,
    }
}

parts! {
    /// A task of a [`Route`].
    pub struct RouteTask {
        /// Human-readable name.
        pub name: Text<32>,
        /// Index of the task's first point in the route's points.
        pub first_point: u32,
        /// Number of points: 1 for a goal, more for a drawn route.
        pub point_count: u32,
        /// Simulation time after which the task has failed, in seconds.
        pub time_limit_s: f64,
    }
}

parts! {
    /// A particle: pose and local scales (Boniardi et al. 2015, equation 6).
    pub struct Particle {
        /// First coordinate of the position, in pixels.
        pub x_px: f32,
        /// Second coordinate of the position, in pixels upwards.
        pub y_px: f32,
        /// Heading, in radians.
        pub yaw_rad: f32,
        /// Local scale along the wall direction, in pixels per metre.
        pub scale_a_pxpm: f32,
        /// Local scale across the wall direction, in pixels per metre.
        pub scale_b_pxpm: f32,
        /// Normalized weight.
        pub weight: f32,
    }
}

parts! {
    /// A place in the drawing where the robot may be.
    pub struct PossiblePlace {
        /// First coordinate, in pixels.
        pub x_px: f64,
        /// Second coordinate, in pixels upwards.
        pub y_px: f64,
        /// Additional cost of the alignment that puts the robot there, compared with the best alignment.
        pub margin: f64,
    }
}

parts! {
    /// A sample of a drawing's outline.
    pub struct OutlineSample {
        /// First coordinate in the drawing, in pixels.
        pub x_px: f32,
        /// Second coordinate in the drawing, in pixels upwards.
        pub y_px: f32,
        /// First coordinate of the sample's match in the map, in metres. For a gap, this is the middle of the gap.
        pub x_m: f32,
        /// Second coordinate of the sample's match in the map, in metres.
        pub y_m: f32,
        /// Kind of match, as a code of [`PartnerKind`].
        pub partner: u32,
        /// Share of the outline around the goal that the sample stands for.
        pub goal_share: f32,
    }
}

impl Question {
    /// Returns the valid places.
    pub fn places(&self) -> &[PossiblePlace] {
        &self.places[..(self.place_count as usize).min(self.places.len())]
    }
}

impl Correspondence {
    /// Returns the valid samples.
    pub fn samples(&self) -> &[OutlineSample] {
        &self.samples[..(self.sample_count as usize).min(MAX_SAMPLES)]
    }
}

impl PoseEstimate {
    /// Returns false if the pose means nothing, because nobody has marked where the robot is and the filter has not found it.
    pub fn is_placed(&self) -> bool {
        let means_nothing = [Tracking::Lost, Tracking::Doubtful].map(Tracking::code);
        self.particle_count > 0 || !means_nothing.contains(&self.tracking)
    }

    /// Returns the odometry at the time of the estimate.
    pub fn odometry(&self) -> Pose<Odom> {
        self.odometry.pose()
    }
}

impl Route {
    /// Returns the valid tasks.
    pub fn tasks(&self) -> &[RouteTask] {
        &self.tasks[..(self.task_count as usize).min(MAX_TASKS)]
    }

    /// Returns the points of `task`, which is one for a goal and more for a drawn route. Empty if the task's
    /// indices are out of range.
    pub fn points(&self, task: &RouteTask) -> impl ExactSizeIterator<Item = Point<Sketch>> + '_ {
        let first = task.first_point as usize;
        let range = first..first.saturating_add(task.point_count as usize);
        self.points_px.get(range).unwrap_or(&[]).iter().map(|p| Point::new(p[0], p[1]))
    }
}

channels! {
    of KIND;
    /// The drawing as a grid.
    SKETCH: Instruction SketchMap = "sketch", Sketcher => [Localizer, Planner, Pad],
        behind it up to MAX_SKETCH_CELLS;
    /// The tasks.
    ROUTE: Instruction Route = "route", Sketcher => [Planner];
    /// A sample of the particle set.
    PARTICLES: Detail Particles = "particles", Localizer => [Pad];
    /// The robot's pose in the drawing.
    ESTIMATE: Situation PoseEstimate = "estimate", Localizer => [Planner, Pad];
    /// The paths that the planner is about to follow.
    PLAN: Detail Plan = "plan", Planner => [Pad];
    /// The alignment of the drawing with what the robot has seen.
    CORRESPONDENCE: Detail Correspondence = "correspondence", Planner => [Pad];
    /// The robot's question to a person.
    QUESTION: Detail Question = "question", Planner => [Pad];
}

/// Checks the two poses and the two scales.
fn estimate(estimate: &PoseEstimate) -> Checked {
    let PosePx { x_px, y_px, orientation_z, orientation_w } = estimate.pose;
    near("pose", [x_px, y_px])?;
    rotation("pose", [orientation_z, orientation_w])?;
    metres("odometry", &estimate.odometry)?;
    within("scale_a_pxpm", 0.0..FAR, "a scale, 0 or above", estimate.scale_a_pxpm)?;
    within("scale_b_pxpm", 0.0..FAR, "a scale, 0 or above", estimate.scale_b_pxpm)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::samples::rejected;

    use super::*;

    #[test]
    fn an_estimate_is_a_pose_and_two_scales() {
        let mut estimate = PoseEstimate::zeroed();
        (estimate.pose.orientation_w, estimate.odometry.orientation_z) = (1.0, 1.0);
        rejected(
            estimate,
            &[
                |estimate| estimate.pose.x_px = f64::NAN,
                |estimate| estimate.scale_a_pxpm = -1.0,
                |estimate| estimate.scale_b_pxpm = f64::NAN,
                |estimate| estimate.odometry.orientation_z = 0.5,
            ],
        );
    }
}
