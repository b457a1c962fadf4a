//! What there is to see, out of the channels' newest messages: in canvas pixels, y down.
//!
//! Pure: messages go in, one JSON object comes out. Lists are thinned and numbers rounded, so that a feed stays
//! small on a slow link.

pub mod landmarks;
pub mod plane;
pub mod scene;
mod services;
mod trail;
mod warnings;

pub use services::{ServiceView, Services};
pub use trail::Trail;
pub use warnings::{Ends, Warning, warnings};

use serde::Serialize;
use sketchnav_schemas::codes::{PartnerKind, TaskState, Tracking};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::{
    Correspondence, LaserScan, MissionStatus, Particles, Plan, PoseEstimate, PossiblePlace, Question,
};
use sketchnav_schemas::robot::Robot;
use sketchnav_sketch::planning::chart::Chart;

use crate::machine::State;

/// Most points of a list.
const MAX_POINTS: usize = 256;

/// Joins the sketch's frame and the canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Height of the sketch, its pixels.
    pub height_px: f64,
    /// Pixels of the sketch a pixel of the canvas.
    pub scale: f64,
}

impl View {
    /// A place of the sketch on the canvas, tenths of a pixel.
    pub fn point(&self, x: f64, y: f64) -> [f64; 2] {
        [tenth(x / self.scale), tenth((self.height_px - y) / self.scale)]
    }

    /// A place of the canvas in the sketch.
    pub fn place(&self, [column, row]: [f64; 2]) -> Point<Sketch> {
        Point::new(column * self.scale, self.height_px - row * self.scale)
    }

    /// A length of the sketch on the canvas.
    fn length(&self, px: f64) -> f64 {
        tenth(px / self.scale)
    }
}

fn tenth(v: f64) -> f64 {
    (v * 10.0).round() / 10.0
}

fn thousandth(v: f64) -> f64 {
    (v * 1000.0).round() / 1000.0
}

/// Every n-th of a list, so that at most [`MAX_POINTS`] stay.
fn thinned<T>(list: impl ExactSizeIterator<Item = T>) -> impl Iterator<Item = T> {
    let step = list.len().div_ceil(MAX_POINTS).max(1);
    list.step_by(step)
}

/// What is the same for every page.
#[derive(Debug, Clone, Serialize)]
pub struct Feed {
    /// Simulation time, milliseconds.
    pub t_ms: u64,
    /// Where people are.
    pub state: State,
    /// Whether the navigation is ready.
    pub ready: bool,
    /// Whether anybody has the wheel and can be heard.
    pub driver: bool,
    /// Number of the walls that `/api/walls.png` has.
    pub walls: u64,
    /// The current task; null where there is none.
    pub task: Option<TaskView>,
    /// How fast the robot believes to move, m/s.
    pub speed_mps: f64,
    /// Where it believes to be; null where it does not know.
    pub pose: Option<PoseView>,
    /// A sample of the particles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub particles: Option<Vec<[f64; 2]>>,
    /// Where the laser sees something.
    pub scan: Vec<[f64; 2]>,
    /// Where it is about to go.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanView>,
    /// What lies around the robot, where there is no drawing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<Vec<scene::Shape>>,
    /// What of the drawn outline it has seen, where it goes by that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outline: Option<OutlineView>,
    /// What it asks a person, while it waits for the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub question: Option<QuestionView>,
    /// The newest point of the way that it came.
    pub trail: Option<[f64; 2]>,
    /// How it stands on a route past landmarks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub landmarks: Option<landmarks::LandmarkFeed>,
    /// What people should know.
    pub warnings: Vec<Warning>,
    /// How the processes are.
    pub services: Vec<services::ServiceView>,
}

/// How a task stands.
#[derive(Debug, Clone, Serialize)]
pub struct TaskView {
    /// From 0.
    pub index: u32,
    /// How many there are.
    pub count: u32,
    /// For people.
    pub name: String,
    /// A word of [`TaskState`].
    pub state: &'static str,
    /// Why, in words.
    pub reason: String,
    /// Since it began, seconds of simulation time.
    pub time_s: f64,
    /// Driven since then, metres.
    pub path_m: f64,
    /// Still to go, metres.
    pub remaining_m: f64,
    /// Tasks reached so far.
    pub reached: u32,
}

impl TaskView {
    /// Of a status; `None` where there are no tasks.
    pub fn new(status: &MissionStatus) -> Option<Self> {
        (status.task_count > 0).then(|| Self {
            index: status.task,
            count: status.task_count,
            name: status.name.as_str().to_owned(),
            state: TaskState::from_code(status.state).map_or("unknown", TaskState::word),
            reason: status.reason.as_str().to_owned(),
            time_s: tenth(status.task_time_s),
            path_m: tenth(status.task_path_m),
            remaining_m: if status.remaining_m.is_finite() { tenth(status.remaining_m) } else { 0.0 },
            reached: status.reached_count,
        })
    }
}

/// Where the robot believes to be.
#[derive(Debug, Clone, Serialize)]
pub struct PoseView {
    /// Column.
    pub x: f64,
    /// Row.
    pub y: f64,
    /// Counter-clockwise from "to the right", radians.
    pub heading_rad: f64,
    /// Semi-axes of two standard deviations and the first one's direction, as `heading_rad`.
    pub ellipse: [f64; 3],
    /// The robot's radius.
    pub radius_px: f64,
    /// A word of [`Tracking`].
    pub tracking: &'static str,
    /// Share of the particles that count.
    pub effective: f64,
}

impl PoseView {
    /// Of an estimate; `None` where it has no pose.
    pub fn new(estimate: &PoseEstimate, robot: &Robot, view: &View) -> Option<Self> {
        let tracking = Tracking::from_code(estimate.tracking).filter(|t| *t != Tracking::Waiting)?;
        let pose = estimate.pose.pose();
        let [x, y] = view.point(pose.x, pose.y);
        let scale_pxpm = (estimate.scale_a_pxpm * estimate.scale_b_pxpm).sqrt();
        let [major, minor, angle] = ellipse(&estimate.covariance);
        Some(Self {
            x,
            y,
            heading_rad: thousandth(pose.yaw_rad),
            ellipse: [view.length(2.0 * major), view.length(2.0 * minor), thousandth(angle)],
            radius_px: view.length(robot.radius_m * scale_pxpm),
            tracking: tracking.word(),
            effective: thousandth(estimate.effective_sample_size / f64::from(estimate.particle_count.max(1))),
        })
    }
}

/// Standard deviations along the axes of x and y's covariance, and the direction of the larger one.
fn ellipse(covariance: &[f64; 25]) -> [f64; 3] {
    let (xx, xy, yy) = (covariance[0], covariance[1], covariance[6]);
    let middle = f64::midpoint(xx, yy);
    let spread = ((xx - yy) / 2.0).hypot(xy);
    let deviation = |variance: f64| variance.max(0.0).sqrt();
    [deviation(middle + spread), deviation(middle - spread), 0.5 * (2.0 * xy).atan2(xx - yy)]
}

/// Where the robot is about to go.
#[derive(Debug, Clone, Serialize)]
pub struct PlanView {
    /// Through the drawing, to the task's end.
    pub global: Vec<[f64; 2]>,
    /// Around what the laser sees.
    pub local: Vec<[f64; 2]>,
}

impl PlanView {
    /// Of a plan.
    pub fn new(plan: &Plan, view: &View) -> Self {
        let list = |points: &[[f32; 2]], count: u32| {
            let points = &points[..(count as usize).min(points.len())];
            thinned(points.iter()).map(|p| view.point(p[0].into(), p[1].into())).collect()
        };
        Self {
            global: list(&plan.global_px, plan.global_count),
            local: list(&plan.local_px, plan.local_count),
        }
    }
}

/// What of the drawn outline the robot has seen.
#[derive(Debug, Clone, Serialize)]
pub struct OutlineView {
    /// Walls that it has seen.
    pub seen: Vec<[f64; 2]>,
    /// Walls that lie behind gaps of what it has seen.
    pub hidden: Vec<[f64; 2]>,
}

impl OutlineView {
    /// Of an alignment.
    pub fn new(found: &Correspondence, view: &View) -> Self {
        let of = |kind: PartnerKind| {
            let samples = found.samples().iter().filter(move |sample| sample.partner == kind.code());
            samples.map(|sample| view.point(sample.x_px.into(), sample.y_px.into())).collect()
        };
        Self { seen: of(PartnerKind::Wall), hidden: of(PartnerKind::Gap) }
    }
}

/// What a person is asked: where in the drawing the robot is.
#[derive(Debug, Clone, Serialize)]
pub struct QuestionView {
    /// For people.
    pub text: String,
    /// Where it may be, the likeliest first; none where anywhere is possible.
    pub places: Vec<PossibleView>,
}

/// A place where the robot may be.
#[derive(Debug, Clone, Serialize)]
pub struct PossibleView {
    /// A, B, C, …
    pub name: char,
    /// Column and row.
    pub at: [f64; 2],
}

impl QuestionView {
    /// Of a question.
    pub fn new(question: &Question, view: &View) -> Self {
        let place = |(name, place): (char, &PossiblePlace)| PossibleView {
            name,
            at: view.point(place.x_px, place.y_px),
        };
        let places: Vec<_> = ('A'..='Z').zip(question.places()).map(place).collect();
        let text = match places.split_last() {
            Some((last, others)) if !others.is_empty() => {
                let others: Vec<_> = others.iter().map(|place| place.name.to_string()).collect();
                format!("Is the robot at {} or {}? Tap where it is.", others.join(", "), last.name)
            }
            _ => "The robot is lost. Tap where it is.".to_owned(),
        };
        Self { text, places }
    }
}

/// The particles' places.
pub fn particles(particles: &Particles, view: &View) -> Vec<[f64; 2]> {
    let count = (particles.count as usize).min(particles.particles.len());
    thinned(particles.particles[..count].iter()).map(|p| view.point(p.x_px.into(), p.y_px.into())).collect()
}

/// Where the laser sees something, by the estimate's local scales; nowhere where the robot has none.
pub fn scan(
    scan: &LaserScan,
    estimate: &PoseEstimate,
    wall_direction_rad: f64,
    robot: &Robot,
    view: &View,
) -> Vec<[f64; 2]> {
    let Some(chart) = Chart::new(estimate, wall_direction_rad) else { return Vec::new() };
    let Some(laser) = &robot.laser else { return Vec::new() };
    let sensor: Pose<Odom> = chart.robot_m().compose(&laser.mount());
    let place = |(i, range): (usize, &f32)| -> Option<[f64; 2]> {
        let hit = range.is_finite() && (scan.range_min_m..=scan.range_max_m).contains(range);
        hit.then(|| {
            let angle = sensor.yaw_rad + f64::from(scan.angle_rad(i));
            let range = f64::from(*range);
            let there = Point::<Odom>::new(sensor.x + range * angle.cos(), sensor.y + range * angle.sin());
            let there: Point<Sketch> = chart.to_sketch(there);
            view.point(there.x, there.y)
        })
    };
    let places: Vec<_> = scan.ranges().iter().enumerate().filter_map(place).collect();
    thinned(places.into_iter()).collect()
}

#[cfg(test)]
mod tests;
