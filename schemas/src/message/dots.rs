//! The view of a camera that looks down on a plane of dots (Park and Kender 1995).
//!
//! Positions in the view are in metres from the window's centre, in the window's own axes: x to its right, y upwards.

use crate::declare::{messages, parts};
use crate::valid;

/// Maximum number of dots in a view.
pub const MAX_DOTS: usize = 64;
/// Maximum number of dots in a plane.
pub const MAX_PLANE_DOTS: usize = 20_000;

messages! {
    /// What a square window shows of a plane of dots. A view has no names and no numbers: all dots are alike.
    pub struct DotView version 1 in "window" valid if valid::view {
        /// The side of the window.
        pub side_m: f32,
        /// How far the camera sees beyond each edge of the window.
        pub margin_m: f32,
        /// Time between two views.
        pub frame_time_s: f32,
        /// How many entries of `dots` count.
        pub dot_count: u32 as Count,
        /// The dots, from the bottom of the view to its top.
        pub dots: [SeenDot; 64] where dot_count counts,
    }
}

parts! {
    /// A dot in view.
    pub struct SeenDot {
        /// To the right of the window's centre, metres.
        pub x_m: f32,
        /// Above the window's centre, metres.
        pub y_m: f32,
    }
}

impl DotView {
    /// The entries of `dots` that are in use.
    pub fn dots(&self) -> &[SeenDot] {
        &self.dots[..(self.dot_count as usize).min(MAX_DOTS)]
    }
}
