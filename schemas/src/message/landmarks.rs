//! Messages about landmarks: the route of a sketch, what the robot sees along it, and how far it has come.

use super::PoseM;
use crate::codes::{LandmarkEvent, RouteCommand};
use crate::declare::{messages, parts};
use crate::geometry::{Odom, Pose, Sketch};
use crate::valid;

/// Most bytes behind a [`LandmarkRoute`].
pub const MAX_LANDMARK_BYTES: usize = 1 << 20;
/// Most objects that a robot sees at a time.
pub const MAX_SEEN_OBJECTS: usize = 16;
/// Most places that a robot remembers.
pub const MAX_REMEMBERED_PLACES: usize = 48;
/// Most relations that a message lists as met.
pub const MAX_MET_RELATIONS: usize = 64;

messages! {
    /// A route past landmarks, as the sketcher has read it. The slice behind it is JSON: the sketch in metres, where one
    /// was drawn, and the landmark states in words.
    pub struct LandmarkRoute version 1 in "" with data {
        /// How many objects were drawn or told of.
        pub object_count: u32,
        /// How many landmark states there are; 0 where the route is driven without.
        pub state_count: u32,
        /// Length of the route: as it was drawn, or as the states say; 0 where nobody said it.
        pub length_m: f64,
    }

    /// What a robot sees of landmarks, and where it probably is in the sketch.
    pub struct LandmarkView version 1 in "base_link" valid if valid::landmark_view {
        /// The odometry that belongs to it.
        pub odometry: PoseM,
        /// Where the robot probably is in the sketch, metres; zeros where there is no sketch.
        pub in_sketch: PoseM,
        /// Real metres for a drawn one.
        pub stretch: f64,
        /// How far hypotheses are from that place, drawn metres (standard deviation).
        pub spread_m: f64,
        /// How much of what is seen fits the sketch, from 0 to 1.
        pub fit: f64,
        /// The nearest return in each of sixteen directions, counter-clockwise from ahead, from the robot's rim; +∞ where
        /// there is none.
        pub sectors_m: [f64; 16],
        /// How many entries of `objects` count.
        pub object_count: u32 as Count,
        /// How many entries of `places_m` count.
        pub place_count: u32 as Count,
        /// The objects that are seen.
        pub objects: [SeenObject; 16] where object_count counts,
        /// Places of objects that are remembered: ahead and left of the robot's centre.
        pub places_m: [[f32; 2]; 48] where place_count counts,
    }

    /// How far a robot has come along its route of landmark states.
    pub struct LandmarkProgress version 1 in "" valid if valid::landmark_progress {
        /// How far along the drawn route, drawn metres.
        pub along_m: f64,
        /// Length of the drawn route.
        pub length_m: f64,
        /// Number of the state that the robot waits for, from 0.
        pub next: u32,
        /// How many states the route has.
        pub state_count: u32,
        /// What the robot is about.
        pub command: u32 as RouteCommand,
        /// What has just happened.
        pub event: u32 as LandmarkEvent,
        /// How many entries of `met` count.
        pub met_count: u32 as Count,
        /// Zero.
        pub reserved: u32 as Zero,
        /// Which relations of the state that has just been matched, or of the one waited for, are met by what is seen.
        pub met: [MetRelation; 64] where met_count counts,
    }
}

parts! {
    /// An object as range sensors see it: without a name.
    pub struct SeenObject {
        /// Where it is: a direction from 0 (ahead) over 4 (left) to 15; 16 all around the robot; 32 and a direction:
        /// around it from there; 48 and a direction: around it but for there.
        pub place: u32,
        /// The first of its directions, counter-clockwise.
        pub first: u32,
        /// How many directions it takes.
        pub count: u32,
        /// Zero.
        pub reserved: u32,
        /// Mean distance from the robot's rim, metres.
        pub proximity_m: f64,
        /// Width of its histogram of constant forces, from 0 to 180.
        pub width: f64,
    }
}

parts! {
    /// A relation of a landmark state that is met.
    pub struct MetRelation {
        /// The relation, by its place in the state.
        pub relation: u32,
        /// The object that meets it, by its place in what is seen.
        pub object: u32,
    }
}

impl LandmarkView {
    /// The odometry that belongs to it.
    pub fn odometry(&self) -> Pose<Odom> {
        self.odometry.pose()
    }

    /// Where the robot probably is in the sketch: in metres here, not in pixels.
    pub fn in_sketch(&self) -> Pose<Sketch> {
        self.in_sketch.pose()
    }

    /// The objects that are seen.
    pub fn objects(&self) -> &[SeenObject] {
        &self.objects[..(self.object_count as usize).min(MAX_SEEN_OBJECTS)]
    }

    /// The places that are remembered.
    pub fn places(&self) -> &[[f32; 2]] {
        &self.places_m[..(self.place_count as usize).min(MAX_REMEMBERED_PLACES)]
    }
}

impl LandmarkProgress {
    /// The relations that are met.
    pub fn met(&self) -> &[MetRelation] {
        &self.met[..(self.met_count as usize).min(MAX_MET_RELATIONS)]
    }
}
