//! Drawings that people make on the pad's page, and how a navigator interprets them.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;

use crate::StageError;
use crate::lookout::Walls;

/// Functions with which a navigator interprets drawings.
#[derive(Debug, Clone, Copy)]
pub struct Drawn {
    /// Returns the walls of a drawing as the sketcher understands them, or `None` if the sketcher rejects the drawing.
    pub walls: fn(&RunConfig, &[u8]) -> Option<Walls>,
    /// Writes the drawing and its marks into a mission, so that the mission can be driven without a page.
    pub keep: fn(&mut Mission, &Kept<'_>) -> Result<(), StageError>,
}

/// A drawing to be saved, with its marks.
#[derive(Debug, Clone, Copy)]
pub struct Kept<'a> {
    /// File that contains the drawing.
    pub drawing: &'a str,
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
    /// Name, for people to read.
    #[serde(default)]
    pub name: String,
    /// Position, in image pixels.
    pub at: [f64; 2],
}
