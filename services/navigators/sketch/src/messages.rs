//! Its messages and channels: the drawing, the tasks in it, where the robot is, what it is about to do, and what it asks.

use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::{MAX_TASKS, PoseM, PosePx, Text};
use sketchnav_schemas::valid::{Checked, FAR, metres, near, rotation, within};

use crate::mission::KIND;

mod map;

/// Most particles that are published of a particle set.
pub const MAX_PARTICLES: usize = 512;
/// Most points of the global path in a [`Plan`].
pub const MAX_GLOBAL_POINTS: usize = 1024;
/// Most points of the local path in a [`Plan`].
pub const MAX_LOCAL_POINTS: usize = 256;
/// Most samples of a drawing's outline.
pub const MAX_SAMPLES: usize = 256;
/// Most cells of a sketch: the canvas of Boniardi et al. 2016, IV, 2540 × 1252, in either orientation.
pub const MAX_SKETCH_CELLS: usize = 2540 * 1252;

codes! {
    /// What a course of the method `outline` leads to.
    pub enum CourseAim {
        /// There is no course.
        None = 0 "none",
        /// Where the goal is.
        Goal = 1 "goal",
        /// A gap in what was seen that leads to the goal.
        Gap = 2 "gap",
        /// Where the best rival alignment has the goal.
        Rival = 3 "rival",
    }

    /// What a sample of a drawing's outline corresponds to.
    pub enum PartnerKind {
        /// Nothing that was seen.
        Nothing = 0 "nothing",
        /// A wall that was seen.
        Wall = 1 "wall",
        /// It lies behind a gap of what was seen.
        Gap = 2 "gap",
    }

    /// What a robot asks a person.
    pub enum QuestionKind {
        /// Nothing, or nothing any more.
        Nothing = 0 "nothing",
        /// At which of several places of the drawing it is.
        Which = 1 "which",
        /// Where in the drawing it is.
        Where = 2 "where",
    }
}

messages! {
    /// What a person drew, as a grid; its cells travel behind it as a byte slice, row 0 at the
    /// bottom, [`sketchnav_schemas::codes::FREE`] or [`sketchnav_schemas::codes::WALL`] each (ROS 2: the cells are a
    /// `nav_msgs/OccupancyGrid`).
    pub struct SketchMap version 1 {
        /// Width of the grid.
        pub width_px: u32,
        /// Height of the grid.
        pub height_px: u32,
        /// Direction of the walls in (−π/4, π/4], modulo a right angle (Boniardi et al. 2015, III-B).
        pub wall_direction_rad: f64,
        /// Width of the pen's stroke.
        pub pen_width_px: f64,
        /// Where the robot starts.
        pub start: PosePx,
        /// Spread of the start pose that the person's mark may be off by.
        pub start_spread_px: f64,
        /// Spread of the start heading.
        pub start_spread_rad: f64,
    }

    /// The tasks of the mission as places in the sketch: goals, or routes drawn by hand.
    pub struct Route version 1 in "sketch" {
        /// How many entries of `tasks` count.
        pub task_count: u32 as Count,
        /// How many entries of `points_px` count.
        pub point_count: u32 as Count,
        /// The tasks in order.
        pub tasks: [RouteTask; 64] where task_count counts,
        /// All points of all tasks (frame [`Sketch`], x and y).
        pub points_px: [[f64; 2]; 8192] where point_count counts,
    }

    /// The robot's pose in the sketch and the sketch's local metric there (Boniardi et al. 2015, III-A).
    pub struct PoseEstimate version 1 in "sketch" valid if estimate {
        /// The pose: the mode of the particles, never a mean of several modes.
        pub pose: PosePx,
        /// The local scale along the wall direction, pixels a metre.
        pub scale_a_pxpm: f64,
        /// The local scale across the wall direction, pixels a metre.
        pub scale_b_pxpm: f64,
        /// Covariance of (x px, y px, yaw rad, a px/m, b px/m) around the mode, row by row.
        pub covariance: [f64; 25],
        /// Kish's effective sample size of the weights before resampling.
        pub effective_sample_size: f64,
        /// How well the scan fits: mean log likelihood of a beam at the estimate.
        pub fit: f64,
        /// The odometry at the scan's time, so that a reader can go on from here.
        pub odometry: PoseM,
        /// How many particles there are.
        pub particle_count: u32,
        /// How sure the localizer is.
        pub tracking: u32 as Tracking,
    }

    /// A sample of the particle set.
    pub struct Particles version 1 in "sketch" {
        /// How many entries of `particles` count.
        pub count: u32 as Count,
        /// How many particles the set has.
        pub total: u32,
        /// Every n-th particle of the set.
        pub particles: [Particle; 512] where count counts,
    }

    /// What the planner is about to do.
    pub struct Plan version 1 in "sketch" {
        /// Index of the task.
        pub task: u32,
        /// How many entries of `global_px` count.
        pub global_count: u32 as Count,
        /// How many entries of `local_px` count.
        pub local_count: u32 as Count,
        /// 1: the task follows a drawn route, 0: it goes to a goal.
        pub follows_route: u32,
        /// The waypoint that the local path leads to (frame [`Sketch`]).
        pub target_px: [f64; 2],
        /// The path through the sketch to the goal, or the drawn route that remains.
        pub global_px: [[f32; 2]; 1024] where global_count counts,
        /// The path around what the laser sees, to the target.
        pub local_px: [[f32; 2]; 256] where local_count counts,
    }

    /// The outline of the drawing, aligned with that of what the robot has seen, and what it drives to because of it. Places of
    /// the map are in metres; its origin is where the robot was at its first scan, x along its heading then.
    pub struct Correspondence version 1 in "map" {
        /// The robot in the map.
        pub robot: PoseM,
        /// The odometry that belongs to it.
        pub odometry: PoseM,
        /// Where the goal lies by the walls that were seen.
        pub goal_m: [f64; 2],
        /// Share of the outline around the goal that was seen.
        pub seen_share: f64,
        /// Share that lies behind gaps.
        pub hidden_share: f64,
        /// What the alignment costs.
        pub cost: f64,
        /// What the best alignment that has the goal elsewhere costs more; negative where none was asked for.
        pub rival_margin: f64,
        /// Where that has the goal, or the gap that leads to it.
        pub rival_m: [f64; 2],
        /// What the robot looks for on its course.
        pub target_m: [f64; 2],
        /// What the course leads to.
        pub aim: u32 as CourseAim,
        /// How many gaps the outline of what was seen has.
        pub gap_count: u32,
        /// How many entries of `samples` count.
        pub sample_count: u32 as Count,
        /// How many entries of `way_m` count.
        pub way_count: u32 as Count,
        /// The samples of the drawing's outline, counter-clockwise.
        pub samples: [OutlineSample; 256] where sample_count counts,
        /// The way to the end of the course.
        pub way_m: [[f32; 2]; 128] where way_count counts,
    }

    /// What the robot asks a person: where in the drawing it is. The answer is an order `here`.
    pub struct Question version 1 in "sketch" {
        /// What is asked.
        pub kind: u32 as QuestionKind,
        /// How many entries of `places` count.
        pub place_count: u32 as Count,
        /// Where the robot may be, the likeliest first: A, B, C, D for people.
        pub places: [PossiblePlace; 4] where place_count counts,
    }
}

parts! {
    /// A task of a [`Route`].
    pub struct RouteTask {
        /// Name, for people.
        pub name: Text<32>,
        /// Index of its first point in the route's points.
        pub first_point: u32,
        /// 1 for a goal, more for a drawn route.
        pub point_count: u32,
        /// Simulation time after which the task has failed.
        pub time_limit_s: f64,
    }
}

parts! {
    /// A particle: pose and local scales (Boniardi et al. 2015, equation 6).
    pub struct Particle {
        /// Position, pixels.
        pub x_px: f32,
        /// Position, pixels, upwards.
        pub y_px: f32,
        /// Heading.
        pub yaw_rad: f32,
        /// Local scale along the wall direction, pixels a metre.
        pub scale_a_pxpm: f32,
        /// Local scale across the wall direction, pixels a metre.
        pub scale_b_pxpm: f32,
        /// Normalized weight.
        pub weight: f32,
    }
}

parts! {
    /// A place of the drawing where the robot may be.
    pub struct PossiblePlace {
        /// First coordinate, pixels.
        pub x_px: f64,
        /// Second coordinate, pixels, upwards.
        pub y_px: f64,
        /// What the alignment that has the robot there costs more than the best one.
        pub margin: f64,
    }
}

parts! {
    /// A sample of a drawing's outline.
    pub struct OutlineSample {
        /// Where it is in the drawing, pixels.
        pub x_px: f32,
        /// Where it is in the drawing, pixels, upwards.
        pub y_px: f32,
        /// Its partner's place in the map; of a gap its middle.
        pub x_m: f32,
        /// Its partner's place in the map.
        pub y_m: f32,
        /// What it corresponds to: a number of [`PartnerKind`].
        pub partner: u32,
        /// Share of the goal's outline that it has.
        pub goal_share: f32,
    }
}

impl Question {
    /// The places that count.
    pub fn places(&self) -> &[PossiblePlace] {
        &self.places[..(self.place_count as usize).min(self.places.len())]
    }
}

impl Correspondence {
    /// The samples that count.
    pub fn samples(&self) -> &[OutlineSample] {
        &self.samples[..(self.sample_count as usize).min(MAX_SAMPLES)]
    }
}

impl PoseEstimate {
    /// The odometry that belongs to the estimate.
    pub fn odometry(&self) -> Pose<Odom> {
        self.odometry.pose()
    }
}

impl Route {
    /// The tasks that count.
    pub fn tasks(&self) -> &[RouteTask] {
        &self.tasks[..(self.task_count as usize).min(MAX_TASKS)]
    }

    /// The points of `task`: one for a goal, more for a drawn route; none where its indices lie.
    pub fn points(&self, task: &RouteTask) -> impl ExactSizeIterator<Item = Point<Sketch>> + '_ {
        let first = task.first_point as usize;
        let range = first..first.saturating_add(task.point_count as usize);
        self.points_px.get(range).unwrap_or(&[]).iter().map(|p| Point::new(p[0], p[1]))
    }
}

channels! {
    of KIND;
    /// The drawing.
    SKETCH: Instruction SketchMap = "sketch", Sketcher => [Localizer, Planner, Pad],
        behind it up to MAX_SKETCH_CELLS;
    /// The tasks.
    ROUTE: Instruction Route = "route", Sketcher => [Planner];
    /// A sample of the particle set.
    PARTICLES: Detail Particles = "particles", Localizer => [Pad];
    /// Where the robot is in the drawing.
    ESTIMATE: Situation PoseEstimate = "estimate", Localizer => [Planner, Pad];
    /// What the planner is about to do.
    PLAN: Detail Plan = "plan", Planner => [Pad];
    /// What of the drawing corresponds to what the robot has seen.
    CORRESPONDENCE: Detail Correspondence = "correspondence", Planner => [Pad];
    /// What the robot asks a person.
    QUESTION: Detail Question = "question", Planner => [Pad];
}

/// Two poses and two scales.
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
