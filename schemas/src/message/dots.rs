//! The view of a camera that looks down on a plane of dots (Park and Kender 1995).
//!
//! Positions in the view are in metres relative to the window's centre, with x to the right and y upwards.

use crate::declare::{messages, parts};
use crate::valid;

/// Maximum number of dots in a view.
pub const MAX_DOTS: usize = 64;
/// Maximum number of dots in a plane.
pub const MAX_PLANE_DOTS: usize = 20_000;

messages! {
    /// The part of a plane of dots that a square window shows. All dots are alike, without names or numbers.
    pub struct DotView version 1 in "window" valid if valid::view {
        /// Side of the window.
        pub side_m: f32,
        /// Distance that the camera sees beyond each edge of the window.
        pub margin_m: f32,
        /// Time between two views.
        pub frame_time_s: f32,
        /// Number of entries of `dots` in use.
        pub dot_count: u32 as Count,
        /// The dots, from the bottom of the view to its top.
        pub dots: [SeenDot; 64] where dot_count counts,
    }
}

parts! {
    /// A dot in view.
    pub struct SeenDot {
        /// Position to the right of the window's centre, in metres.
        pub x_m: f32,
        /// Position above the window's centre, in metres.
        pub y_m: f32,
    }
}

impl DotView {
    /// Returns the valid entries of `dots`.
    pub fn dots(&self) -> &[SeenDot] {
        &self.dots[..(self.dot_count as usize).min(MAX_DOTS)]
    }
}
