//! Messages about markers: what a camera sees, what that tells of a corridor, and the rules to drive by.

use super::PoseM;
use crate::codes::Trend;
use crate::declare::{messages, parts};
use crate::geometry::{Odom, Pose};
use crate::valid;

/// Most bytes of a rule file.
pub const MAX_RULE_BYTES: usize = 1 << 16;
/// Most markers that a robot remembers.
pub const MAX_KNOWN_MARKERS: usize = 64;
/// Most markers that a camera sees at a time.
pub const MAX_MARKERS: usize = 32;

messages! {
    /// The rules by which a corridor is driven (Patil 2019, 3.1.3); the slice behind it is the rule file, checked. It is
    /// empty for a method without rules.
    pub struct Rules version 1 in "" with data {
        /// How many rule sets the file has.
        pub set_count: u32,
        /// Zero.
        pub reserved: u32 as Zero,
    }

    /// What markers tell a robot of its corridor: the relations of a pair of markers with the robot, and every marker
    /// that it remembers (Patil 2019, 3.2.2 and 3.2.3).
    pub struct Relations version 1 in "base_link" valid if valid::relations {
        /// The odometry that belongs to it.
        pub odometry: PoseM,
        /// How many pairs were seen so far: another number is another pair.
        pub pairs: u64,
        /// Since the last pair was seen; since the start before the first.
        pub pair_age_s: f64,
        /// The marker on the left of the last pair.
        pub left: PairedMarker,
        /// The marker on the right of the last pair.
        pub right: PairedMarker,
        /// How many entries of `markers` count.
        pub marker_count: u32 as Count,
        /// Zero.
        pub reserved: u32 as Zero,
        /// The markers that the robot remembers, by their numbers.
        pub markers: [KnownMarker; 64] where marker_count counts,
    }

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
    /// A marker of a pair, as it was seen last, in the robot's own axes.
    pub struct PairedMarker {
        /// Its number.
        pub id: u32,
        /// How the marker moves as the robot sees it: a number of [`Trend`]. The robot is at rest in its own axes.
        pub marker_trend: u32,
        /// How the robot moves in its own axes: a number of [`Trend`], stable always.
        pub robot_trend: u32,
        /// Its distance class: 0 for near, 1 for medium, 2 for far.
        pub distance_class: u32,
        /// Forward of the robot's centre, metres.
        pub x_m: f64,
        /// Left of the robot's centre, metres.
        pub y_m: f64,
    }
}

parts! {
    /// A marker that a robot remembers, in the robot's own axes now.
    pub struct KnownMarker {
        /// Its number.
        pub id: u32,
        /// Since it was seen, seconds.
        pub age_s: f32,
        /// Forward of the robot's centre, metres.
        pub x_m: f32,
        /// Left of the robot's centre, metres.
        pub y_m: f32,
        /// Where it looks, counter-clockwise from the robot's forward axis.
        pub facing_rad: f32,
        /// Zero.
        pub reserved: u32,
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

impl Relations {
    /// The odometry that belongs to it.
    pub fn odometry(&self) -> Pose<Odom> {
        self.odometry.pose()
    }

    /// The markers that the robot remembers.
    pub fn markers(&self) -> &[KnownMarker] {
        &self.markers[..(self.marker_count as usize).min(MAX_KNOWN_MARKERS)]
    }
}

impl PairedMarker {
    /// How the marker moves as the robot sees it.
    pub fn marker_trend(&self) -> Trend {
        Trend::from_code(self.marker_trend).unwrap_or(Trend::Unknown)
    }

    /// How the robot moves in its own axes.
    pub fn robot_trend(&self) -> Trend {
        Trend::from_code(self.robot_trend).unwrap_or(Trend::Unknown)
    }
}

impl MarkerView {
    /// The markers that count.
    pub fn markers(&self) -> &[SeenMarker] {
        &self.markers[..(self.marker_count as usize).min(MAX_MARKERS)]
    }
}
