//! What a person marked in a drawing beside walls: the start, goals, a route.

use serde::{Deserialize, Serialize};

/// What a person marked beside the walls; image pixels. Alone, as JSON with these keys, it is what the pad sends
/// after the drawing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Marks {
    /// Where the robot starts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<StartMark>,
    /// Where it shall go.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub goals: Vec<GoalMark>,
    /// Or how.
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
