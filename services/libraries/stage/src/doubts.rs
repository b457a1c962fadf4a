//! What a person should know before a robot starts.

use serde::Serialize;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::run::RunConfig;

/// What is doubted about the files of a mission.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Doubts {
    /// Why they may not lead anywhere, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// What stands in them and is not used.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
}

/// What is doubted about what the navigator plans before the start.
#[derive(Debug, Clone, Copy)]
pub struct Planned {
    /// The channel on which the sketcher says its plan.
    pub on: &'static ChannelSpec,
    /// What is doubted about such a message.
    pub doubts: fn(&RunConfig, &[u8]) -> Vec<String>,
}

/// The drawing in which the robot of a run believes it is somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Canvas {
    /// Its width and height, pixels of the grid.
    pub size_px: [f64; 2],
    /// Pixels of the grid an image pixel.
    pub scale: f64,
}
