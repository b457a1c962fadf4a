//! The view of a camera that finds fiducial markers.

use crate::declare::{messages, parts};
use crate::valid;

/// Maximum number of markers that a camera sees at a time.
pub const MAX_MARKERS: usize = 32;

messages! {
    /// The markers that a camera sees: fiducials such as ArUco's, each with a number of its own.
    pub struct MarkerView version 1 in "base_link" valid if valid::markers {
        /// The camera: forward of the robot's centre.
        pub camera_x_m: f32,
        /// The camera: left of the robot's centre.
        pub camera_y_m: f32,
        /// The camera's optical axis, counter-clockwise from forward.
        pub camera_yaw_rad: f32,
        /// Half the horizontal field of view.
        pub half_view_rad: f32,
        /// Shortest distance at which a marker is found.
        pub range_min_m: f32,
        /// Longest distance at which a marker is found.
        pub range_max_m: f32,
        /// Time between two pictures.
        pub frame_time_s: f32,
        /// How many entries of `markers` count.
        pub marker_count: u32 as Count,
        /// The markers, by their numbers; each at most once.
        pub markers: [SeenMarker; 32] where marker_count counts,
    }
}

parts! {
    /// A marker of a [`MarkerView`], in the robot's own axes.
    pub struct SeenMarker {
        /// The marker's number.
        pub id: u32,
        /// Forward of the robot's centre, metres.
        pub x_m: f32,
        /// Left of the robot's centre, metres.
        pub y_m: f32,
        /// Where the marker looks, counter-clockwise from the robot's forward axis.
        pub facing_rad: f32,
    }
}

impl MarkerView {
    /// The entries of `markers` that are in use.
    pub fn markers(&self) -> &[SeenMarker] {
        &self.markers[..(self.marker_count as usize).min(MAX_MARKERS)]
    }
}
