//! What pages display, in canvas pixels, with y down.
//!
//! This module is pure: it takes what a lookout draws and returns one JSON object. Numbers are rounded to
//! keep the feed small on slow links.

mod services;
mod trail;
mod warnings;

pub use services::{ServiceView, Services};
pub use trail::Trail;
pub use warnings::{Ends, Warning, warnings};

use std::sync::Arc;

use serde::Serialize;
use sketchnav_schemas::codes::{TaskState, Tracking};
use sketchnav_schemas::geometry::{Point, Sketch, wrap_angle};
use sketchnav_schemas::message::MissionStatus;
use sketchnav_schemas::robot::Robot;
use sketchnav_stage::drawn::Frame;
use sketchnav_stage::lookout::{Around, Shape, Whereabouts};

use crate::machine::State;
use crate::protocol::LearnedView;

/// Half the distance, in pixels of a learned map, over which its scale and direction in the drawing are measured.
const STEP_PX: f64 = 5.0;
/// Side of the canvas around a robot without a drawing, in pixels.
pub const SIDE_PX: u32 = 1000;

/// Maps the sheet that a lookout draws on to the canvas.
#[derive(Debug, Clone)]
pub enum View {
    /// A drawing.
    Drawing {
        /// Height of the drawing, in pixels.
        height_px: f64,
        /// Pixels of the drawing per canvas pixel.
        scale: f64,
    },
    /// A map learned by a drawing that has as many pixels as the canvas.
    Learned(Arc<dyn Frame>),
    /// The robot is in the middle and faces up.
    Robot {
        /// Pixels of the canvas per metre.
        px_per_m: f64,
    },
}

impl View {
    /// The surroundings of a robot.
    pub fn around(robot: &Robot) -> Self {
        Self::Robot { px_per_m: f64::from(SIDE_PX) / 2.0 / Around::robot(robot).reach_m }
    }

    /// Returns the canvas position of a point on the sheet, rounded to tenths of a pixel.
    pub fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let middle = f64::from(SIDE_PX) / 2.0;
        match self {
            Self::Drawing { height_px, scale } => [x / scale, (height_px - y) / scale],
            Self::Learned(frame) => frame.to_drawing([x, y]),
            Self::Robot { px_per_m } => [middle - y * px_per_m, middle - x * px_per_m],
        }
        .map(tenth)
    }

    /// Returns the canvas positions of points on the sheet.
    pub fn points(&self, places: impl IntoIterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
        places.into_iter().map(|place| self.point(place)).collect()
    }

    /// Returns the shapes of the sheet, in canvas pixels.
    pub fn shapes(&self, shapes: Vec<Shape>) -> Vec<Shape> {
        shapes.into_iter().map(|shape| shape.placed(|place| self.point(place))).collect()
    }

    /// Returns the position of a canvas point in the drawing, or `None` if there is no drawing.
    pub fn place(&self, [column, row]: [f64; 2]) -> Option<Point<Sketch>> {
        match self {
            Self::Drawing { height_px, scale } => Some(Point::new(column * scale, height_px - row * scale)),
            Self::Learned(frame) => {
                let [x, y] = frame.to_sketch([column, row]);
                Some(Point::new(x, y))
            }
            Self::Robot { .. } => None,
        }
    }

    /// Returns the scale at a point of the sheet, in pixels of the canvas per unit of the sheet, and the rotation of the canvas
    /// there, in radians counter-clockwise.
    fn local(&self, [x, y]: [f64; 2]) -> (f64, f64) {
        match self {
            Self::Drawing { scale, .. } => (1.0 / scale, 0.0),
            Self::Robot { px_per_m } => (*px_per_m, 0.0),
            Self::Learned(frame) => {
                let [from, to] = [x - STEP_PX, x + STEP_PX].map(|x| frame.to_drawing([x, y]));
                let [dx, dy] = [to[0] - from[0], from[1] - to[1]];
                (dx.hypot(dy) / (2.0 * STEP_PX), dy.atan2(dx))
            }
        }
    }
}

fn tenth(v: f64) -> f64 {
    (v * 10.0).round() / 10.0
}

fn thousandth(v: f64) -> f64 {
    (v * 1000.0).round() / 1000.0
}

/// The part of a feed that is the same for all pages.
#[derive(Debug, Clone, Serialize)]
pub struct Feed {
    /// Simulation time, milliseconds.
    pub t_ms: u64,
    /// The state of the mission, as shown to people.
    pub state: State,
    /// Whether the navigation is ready.
    pub ready: bool,
    /// Whether there is a driver whose page responds.
    pub driver: bool,
    /// Number of the walls at `/api/walls.png`.
    pub walls: u64,
    /// What was learned, or null if nothing was.
    pub learned: Option<LearnedView>,
    /// The rooms that the mission's goals describe, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub resolved: Vec<String>,
    /// The current task, or null if there is none.
    pub task: Option<TaskView>,
    /// The robot's estimated speed, m/s.
    pub speed_mps: f64,
    /// The robot's estimated pose, or null if it is unknown.
    pub pose: Option<PoseView>,
    /// A sample of the particles, which are guesses of the robot's position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub particles: Option<Vec<[f64; 2]>>,
    /// What its navigator shows.
    pub scene: Vec<Shape>,
    /// What is drawn below everything else. It remains until the next one arrives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lasting: Option<Vec<Shape>>,
    /// What the robot is doing, as described by its navigator.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// The question to a person, while the robot waits for the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub question: Option<QuestionView>,
    /// The latest point of the robot's trail.
    pub trail: Option<[f64; 2]>,
    /// Warnings for people.
    pub warnings: Vec<Warning>,
    /// The state of the processes.
    pub services: Vec<services::ServiceView>,
}

/// The state of a task.
#[derive(Debug, Clone, Serialize)]
pub struct TaskView {
    /// The index, from 0.
    pub index: u32,
    /// The number of tasks.
    pub count: u32,
    /// The name.
    pub name: String,
    /// A word of [`TaskState`].
    pub state: &'static str,
    /// The reason, in words.
    pub reason: String,
    /// Simulation time since the task began, in seconds.
    pub time_s: f64,
    /// Distance driven since then, in metres.
    pub path_m: f64,
    /// Distance left, metres.
    pub remaining_m: f64,
    /// Tasks reached so far.
    pub reached: u32,
}

impl TaskView {
    /// Returns the view of a status, or `None` if there are no tasks.
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

/// The robot's estimated pose.
#[derive(Debug, Clone, Serialize)]
pub struct PoseView {
    /// Column.
    pub x: f64,
    /// Row.
    pub y: f64,
    /// Direction in radians, counter-clockwise from "to the right".
    pub heading_rad: f64,
    /// Semi-axes of the ellipse of two standard deviations, and the direction of the first one, measured like
    /// `heading_rad`.
    pub ellipse: [f64; 3],
    /// The robot's radius, in canvas pixels.
    pub radius_px: f64,
    /// A word of [`Tracking`].
    pub tracking: &'static str,
    /// Effective share of the particles.
    pub effective: f64,
}

impl PoseView {
    /// The pose of a robot in a drawing.
    pub fn new(robot: &Whereabouts, view: &View) -> Self {
        let [x, y] = view.point(robot.at);
        let [major, minor, angle] = robot.ellipse;
        let (scale, turn_rad) = view.local(robot.at);
        let length = |length: f64| tenth(length * scale);
        Self {
            x,
            y,
            heading_rad: thousandth(wrap_angle(robot.heading_rad + turn_rad)),
            ellipse: [length(major), length(minor), thousandth(wrap_angle(angle + turn_rad))],
            radius_px: length(robot.radius),
            tracking: robot.tracking.word(),
            effective: thousandth(robot.effective),
        }
    }

    /// Returns the pose of a robot in the middle of the canvas.
    pub fn in_the_middle(robot: &Robot, view: &View) -> Self {
        let [x, y] = view.point([0.0; 2]);
        Self {
            x,
            y,
            heading_rad: std::f64::consts::FRAC_PI_2,
            ellipse: [0.0; 3],
            radius_px: tenth(robot.radius_m * view.local([0.0; 2]).0),
            tracking: Tracking::Tracking.word(),
            effective: 1.0,
        }
    }
}

/// The question of where in the drawing the robot is.
#[derive(Debug, Clone, Serialize)]
pub struct QuestionView {
    /// The text.
    pub text: String,
    /// The possible places of the robot, the most probable first. Empty if it may be anywhere.
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
    /// Returns the places to ask a person about.
    pub fn new(places: &[[f64; 2]], view: &View) -> Self {
        let place = |(name, at): (char, &[f64; 2])| PossibleView { name, at: view.point(*at) };
        let places: Vec<_> = ('A'..='Z').zip(places).map(place).collect();
        let text = match places.split_last() {
            Some((last, others)) if !others.is_empty() => {
                let others: Vec<_> = others.iter().map(|place| place.name.to_string()).collect();
                format!("Is the robot at {} or {}? Tap where it is.", others.join(", "), last.name)
            }
            Some((only, _)) => format!("Is the robot at {}? Tap where it is.", only.name),
            None => "The robot is lost. Tap where it is.".to_owned(),
        };
        Self { text, places }
    }
}

#[cfg(test)]
mod tests;
