//! Its messages and channels: the rules to drive by, and what markers tell of a corridor.

use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::PoseM;
use sketchnav_schemas::valid::{Checked, FAR, count, in_order, metres, near, within};

use crate::mission::KIND;

/// Most bytes of a rule file.
pub const MAX_RULE_BYTES: usize = 1 << 16;
/// Most markers that a robot remembers.
pub const MAX_KNOWN_MARKERS: usize = 64;

codes! {
    /// A component of a QTC relation (Van de Weghe 2004): how a marker moves as the robot sees it.
    pub enum Trend {
        /// Nothing is known yet.
        Unknown = 0 "unknown",
        /// It comes nearer.
        Towards = 1 "-",
        /// It goes away.
        Away = 2 "+",
        /// It does neither.
        Stable = 3 "0",
    }
}

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
    pub struct Relations version 1 in "base_link" valid if relations {
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

channels! {
    of KIND;
    /// The rules for a corridor.
    RULES: Instruction Rules = "rules", Sketcher => [Planner], behind it up to MAX_RULE_BYTES;
    /// What markers tell of a corridor.
    RELATIONS: Situation Relations = "relations", Localizer => [Planner, Pad];
}

/// A pose, a pair and markers, as many as are counted.
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
    fn relations_hold_as_many_markers_as_they_count() {
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
