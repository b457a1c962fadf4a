//! What people draw for a navigator on the pad's page, and what the navigator makes of it.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;

use crate::StageError;
use crate::lookout::Walls;

/// What a navigator makes of drawings.
#[derive(Debug, Clone, Copy)]
pub struct Drawn {
    /// The walls of a drawing as its sketcher understands them; `None` if the sketcher refuses it.
    pub walls: fn(&RunConfig, &[u8]) -> Option<Walls>,
    /// Writes what was drawn into a mission, which is then driven without a page.
    pub keep: fn(&mut Mission, &Kept<'_>) -> Result<(), StageError>,
}

/// A drawing that is to be kept, with the marks in it.
#[derive(Debug, Clone, Copy)]
pub struct Kept<'a> {
    /// The file that contains it.
    pub drawing: &'a str,
    /// Width and height of the grid made from it.
    pub size_px: [u32; 2],
    /// Pixels of the grid per image pixel.
    pub scale: f64,
    /// The marks that placed the robot: these or earlier ones.
    pub placing: &'a Marks,
    /// The marks in force.
    pub marks: &'a Marks,
}

/// What a person marked in addition to the walls; image pixels. By itself, as JSON with these keys, it is what the pad sends
/// after the drawing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Marks {
    /// Where the robot starts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<StartMark>,
    /// Where it is to go.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub goals: Vec<GoalMark>,
    /// Or the route it is to take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub route: Option<Vec<[f64; 2]>>,
}

/// A drawn start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartMark {
    /// Where, image pixels.
    pub at: [f64; 2],
    /// Which way, degrees counter-clockwise from "to the right".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
}

/// A drawn goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalMark {
    /// Name, for people.
    #[serde(default)]
    pub name: String,
    /// Where, image pixels.
    pub at: [f64; 2],
}
