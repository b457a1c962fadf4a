//! Messages and channels of this navigator: the route, the objects in view, and the progress along the route.

use sketchnav_schemas::declare::{channels, codes, messages, parts};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::PoseM;
use sketchnav_schemas::valid::{Checked, FAR, count, ensure, metres, near, within};

use crate::drawn::Drawn;
use crate::mission::KIND;

/// Maximum size of the slice after a [`LandmarkRoute`], in bytes.
pub const MAX_LANDMARK_BYTES: usize = 1 << 20;
/// Maximum number of objects that a robot sees at a time.
pub const MAX_SEEN_OBJECTS: usize = 16;
/// Maximum number of positions that a robot remembers.
pub const MAX_REMEMBERED_PLACES: usize = 48;
/// Maximum number of relations listed as met in a message.
pub const MAX_MET_RELATIONS: usize = 64;
/// Maximum code of an object's place, and maximum width of a histogram.
const MOST_SEEN: (u32, f64) = (63, 180.0);

codes! {
    /// Commands along a route of landmark states (Chronis 2007).
    pub enum RouteCommand {
        /// Move straight on.
        Forward = 0 "move forward",
        /// Turn left while moving.
        Left = 1 "turn left",
        /// Turn right while moving.
        Right = 2 "turn right",
        /// Stop.
        Stop = 3 "stop",
    }

    /// Events along a route of landmark states.
    pub enum LandmarkEvent {
        /// Nothing has happened.
        Nothing = 0 "nothing",
        /// The state before `next` has been matched.
        Matched = 1 "matched",
        /// The robot has stopped at its goal.
        Arrived = 2 "arrived",
        /// The robot is lost.
        Lost = 3 "lost",
    }
}

messages! {
    /// A route past landmarks, as the sketcher has read it. The slice after this struct is JSON with the sketch in metres, if
    /// one was drawn, and the landmark states in words.
    pub struct LandmarkRoute version 1 in "" with data {
        /// Number of objects drawn or mentioned.
        pub object_count: u32,
        /// Number of landmark states, or 0 if the route is driven without any.
        pub state_count: u32,
        /// Length of the route as drawn or as stated in words, or 0 if it is unknown.
        pub length_m: f64,
    }

    /// What a robot sees of landmarks, and its estimated pose in the sketch.
    pub struct LandmarkView version 3 in "base_link" valid if landmark_view {
        /// Pose of the robot by odometry, to which the rest of the message refers.
        pub odometry: PoseM,
        /// Estimated pose in the sketch, in drawn metres. Zero if there is no sketch.
        pub in_sketch: PoseM,
        /// Number of real metres per drawn metre around the robot.
        pub stretch: f64,
        /// Root mean square distance of the hypotheses from the estimated position, in drawn metres.
        pub spread_m: f64,
        /// Share of what the robot sees that fits the sketch, from 0 to 1.
        pub fit: f64,
        /// Number of places on the way at which the robot has been sure of its pose.
        pub sure_count: u32,
        /// Reserved, always zero.
        pub reserved: u32 as Zero,
        /// Nearest return in each of sixteen directions, counter-clockwise from ahead, in metres from the robot's rim. +∞ if
        /// there is none.
        pub sectors_m: [f64; 16],
        /// Number of valid entries in `objects`.
        pub object_count: u32 as Count,
        /// Number of valid entries in `places_m`.
        pub place_count: u32 as Count,
        /// The objects that the robot sees.
        pub objects: [SeenObject; 16] where object_count counts,
        /// Remembered positions of objects in the robot's frame, in metres: ahead and to the left of its centre.
        pub places_m: [[f32; 2]; 48] where place_count counts,
    }

    /// How far a robot has got along its route.
    pub struct LandmarkProgress version 2 in "" valid if landmark_progress {
        /// Position along the drawn route, in drawn metres.
        pub along_m: f64,
        /// Length of the drawn route, in drawn metres.
        pub length_m: f64,
        /// Number of the state that the robot is waiting for, from 0.
        pub next: u32,
        /// Number of states of the route.
        pub state_count: u32,
        /// What the robot is doing.
        pub command: u32 as RouteCommand,
        /// What has just happened.
        pub event: u32 as LandmarkEvent,
        /// Number of valid entries in `met`.
        pub met_count: u32 as Count,
        /// 1 while the robot is lost and waits for help or a new route, or else 0.
        pub is_lost: u32,
        /// Relations met by objects in view. They refer to the state that has just been matched or, if none has, to the next one.
        pub met: [MetRelation; 64] where met_count counts,
    }
}

parts! {
    /// An object as range sensors see it, without a name.
    pub struct SeenObject {
        /// Direction of the object, from 0 (ahead) through 4 (left) to 15. For an object around the robot: 16 if it surrounds the
        /// robot completely, 32 plus its main direction, or 48 plus the direction of its opening.
        pub place: u32,
        /// The first of the object's directions, counter-clockwise.
        pub first: u32,
        /// Number of directions that the object covers.
        pub count: u32,
        /// 1 plus the index of the landmark that the object has been recognized as, or 0 if the robot has not recognized it by a
        /// marker. Landmarks are counted in the order of the sketch or, if the route is in words, in the order in which the words
        /// mention them.
        pub landmark: u32,
        /// Mean distance from the robot's rim, in metres.
        pub proximity_m: f64,
        /// Width of the object's histogram of constant forces, from 0 to 180.
        pub width: f64,
    }
}

parts! {
    /// A relation of a landmark state, with the object that meets it.
    pub struct MetRelation {
        /// Index of the relation in the state.
        pub relation: u32,
        /// Index of the object among those that the robot sees.
        pub object: u32,
    }
}

impl LandmarkView {
    /// Returns the pose of the robot by odometry, to which the rest of the message refers.
    pub fn odometry(&self) -> Pose<Odom> {
        self.odometry.pose()
    }

    /// Returns the estimated pose in the sketch.
    pub fn in_sketch(&self) -> Pose<Drawn> {
        self.in_sketch.pose()
    }

    /// Returns the objects that the robot sees.
    pub fn objects(&self) -> &[SeenObject] {
        &self.objects[..(self.object_count as usize).min(MAX_SEEN_OBJECTS)]
    }

    /// Returns the positions that the robot remembers.
    pub fn places(&self) -> &[[f32; 2]] {
        &self.places_m[..(self.place_count as usize).min(MAX_REMEMBERED_PLACES)]
    }
}

impl LandmarkProgress {
    /// Returns the relations that are met.
    pub fn met(&self) -> &[MetRelation] {
        &self.met[..(self.met_count as usize).min(MAX_MET_RELATIONS)]
    }
}

channels! {
    of KIND;
    /// A route past landmarks.
    LANDMARK_ROUTE: Instruction LandmarkRoute = "landmark_route", Sketcher => [Localizer, Planner, Pad],
        behind it up to MAX_LANDMARK_BYTES;
    /// The objects in view, and the robot's pose in the sketch.
    LANDMARK_VIEW: Situation LandmarkView = "landmark_view", Localizer => [Planner, Pad];
    /// Progress along the route.
    LANDMARK_PROGRESS: Detail LandmarkProgress = "landmark_progress", Planner => [Pad];
}

/// Checks the poses, the ranges, and the counted objects and positions.
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

/// Checks the lengths, the state of the route, and the number of relations.
fn landmark_progress(progress: &LandmarkProgress) -> Checked {
    count("met_count", progress.met_count, MAX_MET_RELATIONS)?;
    near("along_m, length_m", [progress.along_m, progress.length_m])?;
    ensure(progress.is_lost <= 1, "is_lost", "0 or 1", progress.is_lost)?;
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
                |progress| progress.is_lost = 2,
                |progress| progress.met_count = 65,
                |progress| progress.along_m = f64::INFINITY,
            ],
        );
    }
}
