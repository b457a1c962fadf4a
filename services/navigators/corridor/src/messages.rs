//! Messages and channels of this navigator: the rules to drive by, and the robot's relations with the markers
//! of a corridor.

use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::PoseM;
use sketchnav_schemas::valid::{Checked, FAR, count, in_order, metres, near, within};

use crate::mission::KIND;

/// Maximum size of a rule file, in bytes.
pub const MAX_RULE_BYTES: usize = 1 << 16;
/// Maximum number of markers that a robot remembers.
pub const MAX_KNOWN_MARKERS: usize = 64;

codes! {
    /// A component of a QTC relation (Van de Weghe 2004): how a marker moves, as seen from the robot.
    pub enum Trend {
        /// Not known yet.
        Unknown = 0 "unknown",
        /// Approaching.
        Towards = 1 "-",
        /// Receding.
        Away = 2 "+",
        /// At a constant distance.
        Stable = 3 "0",
    }
}

messages! {
    /// The rules by which a corridor is driven (Patil 2019, 3.1.3). The slice after this struct is the rule file, already
    /// checked. It is empty for a method without rules.
    pub struct Rules version 1 in "" with data {
        /// Number of rule sets in the file.
        pub set_count: u32,
        /// Reserved, always zero.
        pub reserved: u32 as Zero,
    }

    /// Relations of the robot with a pair of markers, and every marker that it remembers (Patil 2019, 3.2.2 and 3.2.3).
    pub struct Relations version 1 in "base_link" valid if relations {
        /// Pose of the robot by odometry, to which the rest of the message refers.
        pub odometry: PoseM,
        /// Number of pairs seen so far. A new number means a new pair.
        pub pairs: u64,
        /// Time since the last pair was seen, or since the start if there was none, in seconds.
        pub pair_age_s: f64,
        /// The marker on the left of the last pair.
        pub left: PairedMarker,
        /// The marker on the right of the last pair.
        pub right: PairedMarker,
        /// Number of valid entries in `markers`.
        pub marker_count: u32 as Count,
        /// Reserved, always zero.
        pub reserved: u32 as Zero,
        /// The markers that the robot remembers, sorted by number.
        pub markers: [KnownMarker; 64] where marker_count counts,
    }
}

parts! {
    /// A marker of a pair as it was last seen, in the robot's own frame.
    pub struct PairedMarker {
        /// Number of the marker.
        pub id: u32,
        /// Motion of the marker as seen from the robot: a value of [`Trend`].
        pub marker_trend: u32,
        /// Motion of the robot in its own frame: a value of [`Trend`]. Stable as soon as the marker's trend is known.
        pub robot_trend: u32,
        /// Class of the marker's distance: 0 for near, 1 for medium, 2 for far.
        pub distance_class: u32,
        /// Forward of the robot's centre, in metres.
        pub x_m: f64,
        /// Left of the robot's centre, in metres.
        pub y_m: f64,
    }
}

parts! {
    /// A marker that a robot remembers, in the robot's own frame at the time of the message.
    pub struct KnownMarker {
        /// Number of the marker.
        pub id: u32,
        /// Time since the marker was last seen, in seconds.
        pub age_s: f32,
        /// Forward of the robot's centre, in metres.
        pub x_m: f32,
        /// Left of the robot's centre, in metres.
        pub y_m: f32,
        /// Direction that the marker faces, in radians counter-clockwise from the robot's forward axis.
        pub facing_rad: f32,
        /// Reserved, always zero.
        pub reserved: u32,
    }
}

impl Relations {
    /// Returns the pose of the robot by odometry, to which the rest of the message refers.
    pub fn odometry(&self) -> Pose<Odom> {
        self.odometry.pose()
    }

    /// Returns the markers that the robot remembers.
    pub fn markers(&self) -> &[KnownMarker] {
        &self.markers[..(self.marker_count as usize).min(MAX_KNOWN_MARKERS)]
    }
}

impl PairedMarker {
    /// Returns how the marker moves, as seen from the robot.
    pub fn marker_trend(&self) -> Trend {
        Trend::from_code(self.marker_trend).unwrap_or(Trend::Unknown)
    }

    /// Returns how the robot moves in its own frame.
    pub fn robot_trend(&self) -> Trend {
        Trend::from_code(self.robot_trend).unwrap_or(Trend::Unknown)
    }
}

channels! {
    of KIND;
    /// The rules by which a corridor is driven.
    RULES: Instruction Rules = "rules", Sketcher => [Planner], behind it up to MAX_RULE_BYTES;
    /// Relations of the robot with the markers of a corridor.
    RELATIONS: Situation Relations = "relations", Localizer => [Planner, Pad];
}

/// Checks the pose, the pair, and the counted markers.
fn relations(relations: &Relations) -> Checked {
    count("marker_count", relations.marker_count, MAX_KNOWN_MARKERS)?;
    metres("odometry", &relations.odometry)?;
    within("pair_age_s", 0.0..FAR, "a time, 0 or above", relations.pair_age_s)?;
    let pair = [&relations.left, &relations.right];
    near("left, right", pair.iter().flat_map(|marker| [marker.x_m, marker.y_m]))?;
    near(
        "markers",
        relations.markers().iter().flat_map(|marker| [marker.x_m, marker.y_m, marker.facing_rad]),
    )?;
    in_order(relations.markers().iter().map(|marker| marker.id))
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::samples::rejected;

    use super::*;

    #[test]
    fn relations_match_their_count_of_markers() {
        let mut valid = Relations::zeroed();
        valid.odometry.orientation_w = 1.0;
        valid.marker_count = 2;
        (valid.markers[0].id, valid.markers[1].id) = (1, 2);
        rejected(
            valid,
            &[
                |relations| relations.marker_count = 65,
                |relations| relations.markers[1].id = 1,
                |relations| relations.markers[0].x_m = f32::NAN,
                |relations| relations.left.y_m = f64::INFINITY,
                |relations| relations.pair_age_s = -1.0,
                |relations| relations.odometry.orientation_w = 0.0,
            ],
        );
    }
}
