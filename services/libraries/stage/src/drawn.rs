//! Drawings that people make on the pad's page, and how a navigator interprets them.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;

use crate::lookout::Walls;
use crate::{Files, StageError};

/// Code of a cell of the drawing in which the robot has seen nothing.
pub const UNSEEN: u8 = 255;

/// Passes the messages of the planner's channels and the drawings to a [`See`], in order.
pub type Replay<'a> = dyn FnMut(&mut See<'_>) -> Result<(), StageError> + 'a;
/// Processes a message, given its channel, its bytes and the cells that follow it.
pub type See<'a> = dyn FnMut(&ChannelSpec, &[u8], &[u8]) + 'a;
/// Begins to learn from the drives of a run.
pub type Begin = fn(&RunConfig, &Files<'_>) -> Result<Box<dyn Learning>, StageError>;
/// Shows the map that was learned by a drawing, given the drawing and the file with the map.
pub type Show = fn(&RunConfig, &[u8], &[u8]) -> Result<Lesson, StageError>;

/// Functions for learning from drives by a drawing.
#[derive(Debug, Clone, Copy)]
pub struct Lessons {
    /// Begins to learn from the drives of a run.
    pub begin: Begin,
    /// Shows what a file with a learned map contains, given the drawing and the file.
    pub show: Show,
}

/// Learns from the drives of a run, message by message.
pub trait Learning: Debug + Send {
    /// Processes a message of the planner's channels or a drawing. Messages must arrive in order.
    fn see(&mut self, spec: &ChannelSpec, message: &[u8], cells: &[u8]);

    /// Returns what was learned so far: the content of a file for the next drive to start from, and how to show it. If the file
    /// is sent after its drawing, it replaces the drawing.
    ///
    /// # Errors
    /// If nothing can be learned from the drives so far.
    fn learned(&self) -> Result<(Vec<u8>, Lesson), StageError>;
}

/// A learned map, converted to the drawing that it was learned by.
#[derive(Debug, Clone)]
pub struct Lesson {
    /// The map as cells of the drawing's grid: walls, free cells, or [`UNSEEN`].
    pub seen: Walls,
    /// Converts positions between the sketch and the drawing, if the robot drives in a learned map.
    pub frame: Arc<dyn Frame>,
    /// The drawing, corrected by what was seen, as SVG: what was seen in its true proportions, and the rest as drawn and lighter.
    pub corrected: Vec<u8>,
}

/// Converts positions between a drawing and a sketch that was not read from it. Positions in the drawing are pixels of its file
/// (column, row).
pub trait Frame: Debug + Send + Sync {
    /// Converts a position from the sketch to the drawing.
    fn to_drawing(&self, sketch_px: [f64; 2]) -> [f64; 2];
    /// Converts a position from the drawing to the sketch.
    fn to_sketch(&self, image_px: [f64; 2]) -> [f64; 2];
}

/// What a person has to mark, in addition to goals, before a robot can drive in a new drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placing {
    /// Nothing, because the robot finds out where it is.
    Anywhere,
    /// The start, or a path in place of the goals, which begins where the robot stands.
    Start,
    /// A path in place of the goals.
    Path,
}

/// Functions for interpreting drawings.
#[derive(Debug, Clone, Copy)]
pub struct Drawn {
    /// Removes the drawing and its marks from a mission, because people draw while it runs.
    pub blank: fn(&mut Mission) -> Result<(), StageError>,
    /// Returns what a person has to mark in a drawing besides goals.
    pub placing: fn(&Mission) -> Placing,
    /// Returns the walls of a drawing as the sketcher understands them, or `None` if the sketcher rejects the drawing.
    pub walls: fn(&RunConfig, &[u8]) -> Option<Walls>,
    /// Writes the drawing and its marks into a mission, so that the mission can be driven without a page.
    pub keep: fn(&mut Mission, &Kept<'_>) -> Result<(), StageError>,
    /// Learns from drives. `None` if the navigator does not learn.
    pub lessons: Option<Lessons>,
}

/// A drawing to be saved, with its marks.
#[derive(Debug, Clone, Copy)]
pub struct Kept<'a> {
    /// File that contains the drawing.
    pub drawing: &'a str,
    /// File with the map learned by the drawing, if the robot should drive in that map.
    pub learned: Option<&'a str>,
    /// Width and height of the grid made from the drawing, in pixels.
    pub size_px: [u32; 2],
    /// Number of pixels of the grid per image pixel.
    pub scale: f64,
    /// Marks that placed the robot, which may be older than the current ones.
    pub placing: &'a Marks,
    /// The current marks.
    pub marks: &'a Marks,
}

/// A person's marks in addition to the walls, in image pixels. The pad sends them after the drawing, as JSON
/// with these keys.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Marks {
    /// Start of the robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<StartMark>,
    /// Goals to drive to.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub goals: Vec<GoalMark>,
    /// The route to take, as an alternative to goals.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub route: Option<Vec<[f64; 2]>>,
}

/// The mark of a start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartMark {
    /// Position, in image pixels.
    pub at: [f64; 2],
    /// Heading, in degrees counter-clockwise from the direction to the right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
}

/// The mark of a goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalMark {
    /// Display name.
    #[serde(default)]
    pub name: String,
    /// Position, in image pixels.
    pub at: [f64; 2],
}
