//! Its messages and channels: the route of a sketch, what the robot sees along it, and how far it has come.

use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::PoseM;
use sketchnav_schemas::valid::{Checked, FAR, count, ensure, metres, near, within};

use crate::drawn::Drawn;
use crate::mission::KIND;

/// Most bytes behind a [`LandmarkRoute`].
pub const MAX_LANDMARK_BYTES: usize = 1 << 20;
/// Most objects that a robot sees at a time.
pub const MAX_SEEN_OBJECTS: usize = 16;
/// Most places that a robot remembers.
pub const MAX_REMEMBERED_PLACES: usize = 48;
/// Most relations that a message lists as met.
pub const MAX_MET_RELATIONS: usize = 64;
/// Greatest place of an object in view, and widest histogram.
const MOST_SEEN: (u32, f64) = (63, 180.0);

codes! {
    /// What a robot does along a route of landmark states (Chronis 2007).
    pub enum RouteCommand {
        /// Moves straight on.
        Forward = 0 "move forward",
        /// Turns left while it moves.
        Left = 1 "turn left",
        /// Turns right while it moves.
        Right = 2 "turn right",
        /// Stops.
        Stop = 3 "stop",
    }

    /// What happens along a route of landmark states.
    pub enum LandmarkEvent {
        /// Nothing.
        Nothing = 0 "nothing",
        /// The state before the next one was matched.
        Matched = 1 "matched",
        /// The robot stopped at its goal.
        Arrived = 2 "arrived",
        /// The robot does not know where it is.
        Lost = 3 "lost",
    }
}

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
    pub struct LandmarkView version 1 in "base_link" valid if landmark_view {
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
    pub struct LandmarkProgress version 1 in "" valid if landmark_progress {
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

    /// Where the robot probably is in the sketch.
    pub fn in_sketch(&self) -> Pose<Drawn> {
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

channels! {
    of KIND;
    /// A route past landmarks.
    LANDMARK_ROUTE: Instruction LandmarkRoute = "landmark_route", Sketcher => [Localizer, Planner, Pad],
        behind it up to MAX_LANDMARK_BYTES;
    /// What the robot sees of landmarks.
    LANDMARK_VIEW: Situation LandmarkView = "landmark_view", Localizer => [Planner, Pad];
    /// How far the robot has come along its landmarks.
    LANDMARK_PROGRESS: Detail LandmarkProgress = "landmark_progress", Planner => [Pad];
}

/// Two poses, ranges in sixteen directions, objects and places, as many as are counted.
fn landmark_view(view: &LandmarkView) -> Checked {
    count("object_count", view.object_count, MAX_SEEN_OBJECTS)?;
    count("place_count", view.place_count, MAX_REMEMBERED_PLACES)?;
    metres("odometry", &view.odometry)?;
    metres("in_sketch", &view.in_sketch)?;
    within("stretch", 0.0..FAR, "a factor, 0 or above", view.stretch)?;
    within("spread_m", 0.0..FAR, "a length, 0 or above", view.spread_m)?;
    within("fit", 0.0..=1.0, "a share of 0 to 1", view.fit)?;
    let is_range = |range: f64| range == f64::INFINITY || (0.0..FAR).contains(&range);
    let sectors = view.sectors_m.iter();
    sectors.copied().try_for_each(|m| ensure(is_range(m), "sectors_m", "a range or infinity", m))?;
    for one in view.objects() {
        ensure(one.place <= MOST_SEEN.0, "objects.place", "a place of 0 to 63", one.place)?;
        within("objects.proximity_m", 0.0..FAR, "a length, 0 or above", one.proximity_m)?;
        within("objects.width", 0.0..=MOST_SEEN.1, "a width of 0 to 180", one.width)?;
    }
    near("places_m", view.places().as_flattened().iter().copied())
}

/// Lengths, a state of the route, and relations, as many as are counted.
fn landmark_progress(progress: &LandmarkProgress) -> Checked {
    count("met_count", progress.met_count, MAX_MET_RELATIONS)?;
    near("along_m, length_m", [progress.along_m, progress.length_m])?;
    let is_state = progress.next <= progress.state_count;
    ensure(is_state, "next", "a state of the route", progress.next)?;
    let (command, event) = (progress.command, progress.event);
    ensure(RouteCommand::from_code(command).is_some(), "command", "a command of a route", command)?;
    ensure(LandmarkEvent::from_code(event).is_some(), "event", "an event of a route", event)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::samples::rejected;

    use super::*;

    #[test]
    fn a_view_of_landmarks_has_objects_at_places_that_exist() {
        let mut valid = LandmarkView::zeroed();
        (valid.odometry.orientation_w, valid.in_sketch.orientation_w) = (1.0, 1.0);
        (valid.object_count, valid.place_count, valid.sectors_m[3]) = (1, 1, f64::INFINITY);
        rejected(
            valid,
            &[
                |view| view.object_count = 17,
                |view| view.place_count = 49,
                |view| view.objects[0].place = 64,
                |view| view.objects[0].width = 181.0,
                |view| view.objects[0].proximity_m = -1.0,
                |view| view.places_m[0][1] = f32::NAN,
                |view| view.sectors_m[0] = f64::NAN,
                |view| view.sectors_m[0] = -0.5,
                |view| view.in_sketch.orientation_w = 0.0,
                |view| view.fit = 1.5,
                |view| view.stretch = f64::NAN,
            ],
        );
    }

    #[test]
    fn progress_along_landmarks_is_within_its_route() {
        let mut valid = LandmarkProgress::zeroed();
        (valid.next, valid.state_count) = (3, 3);
        rejected(
            valid,
            &[
                |progress| progress.next = 4,
                |progress| progress.command = 4,
                |progress| progress.event = 4,
                |progress| progress.met_count = 65,
                |progress| progress.along_m = f64::INFINITY,
            ],
        );
    }
}
