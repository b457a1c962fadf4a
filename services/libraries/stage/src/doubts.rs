//! Doubts about a mission, to be raised with a person before the robot starts.

use serde::Serialize;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::run::RunConfig;

/// Doubts about the files of a mission.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Doubts {
    /// Warnings about likely problems with the files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Parts of the files that will be ignored.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// Goals that the mission describes instead of naming them, each with the place that was found. They are not doubtful, but shown
    /// so that a person can check them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub resolved: Vec<String>,
}

/// The plan that a navigator makes before the start, and the doubts about it.
#[derive(Debug, Clone, Copy)]
pub struct Planned {
    /// The channel of the sketcher's plan.
    pub on: &'static ChannelSpec,
    /// Returns the doubts about a message of that channel.
    pub doubts: fn(&RunConfig, &[u8]) -> Vec<String>,
    /// Returns why the robot should not start on the plan in a message of that channel, unless a person insists, or `None` if it
    /// may start.
    pub objection: fn(&RunConfig, &[u8]) -> Option<String>,
    /// The channel of the plan as text for people, which is sent before that message. A plan may come without text.
    pub text: &'static ChannelSpec,
}

/// The drawing that the robot is localized in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Canvas {
    /// Width and height of the drawing, in pixels of the grid.
    pub size_px: [f64; 2],
    /// Number of pixels of the grid per image pixel.
    pub scale: f64,
}
