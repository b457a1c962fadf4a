//! What a person should know before a robot starts.

use serde::Serialize;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::run::RunConfig;

/// Doubts about the files of a mission.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Doubts {
    /// Warnings, in words, of what may go wrong with them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// What is in them but not used.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
}

/// Doubts about what the navigator plans before the start.
#[derive(Debug, Clone, Copy)]
pub struct Planned {
    /// The channel on which the sketcher sends its plan.
    pub on: &'static ChannelSpec,
    /// The doubts about such a message.
    pub doubts: fn(&RunConfig, &[u8]) -> Vec<String>,
}

/// The drawing in which a run's robot is localized.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Canvas {
    /// Its width and height, pixels of the grid.
    pub size_px: [f64; 2],
    /// Pixels of the grid per image pixel.
    pub scale: f64,
}
