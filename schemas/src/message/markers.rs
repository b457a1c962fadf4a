//! The view of a camera that finds fiducial markers.

use crate::declare::{messages, parts};
use crate::valid;

/// Maximum number of markers in one image.
pub const MAX_MARKERS: usize = 32;

messages! {
    /// The markers that a camera sees. They are fiducials such as ArUco's, each with a unique number.
    pub struct MarkerView version 1 in "base_link" valid if valid::markers {
        /// Position of the camera forward of the robot's centre.
        pub camera_x_m: f32,
        /// Position of the camera to the left of the robot's centre.
        pub camera_y_m: f32,
        /// Direction of the camera's optical axis, counter-clockwise from the robot's forward axis.
        pub camera_yaw_rad: f32,
        /// Half the horizontal field of view.
        pub half_view_rad: f32,
        /// Shortest distance at which a marker is found.
        pub range_min_m: f32,
        /// Longest distance at which a marker is found.
        pub range_max_m: f32,
        /// Time between two pictures.
        pub frame_time_s: f32,
        /// Number of entries of `markers` in use.
        pub marker_count: u32 as Count,
        /// The markers in the order of their numbers, each at most once.
        pub markers: [SeenMarker; 32] where marker_count counts,
    }
}

parts! {
    /// A marker of a [`MarkerView`], in the robot's own axes.
    pub struct SeenMarker {
        /// The marker's number.
        pub id: u32,
        /// Position forward of the robot's centre, in metres.
        pub x_m: f32,
        /// Position to the left of the robot's centre, in metres.
        pub y_m: f32,
        /// Direction that the marker faces, counter-clockwise from the robot's forward axis.
        pub facing_rad: f32,
    }
}

impl MarkerView {
    /// Returns the valid entries of `markers`.
    pub fn markers(&self) -> &[SeenMarker] {
        &self.markers[..(self.marker_count as usize).min(MAX_MARKERS)]
    }
}
