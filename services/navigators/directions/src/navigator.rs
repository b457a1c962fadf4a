//! The navigator, which follows a custom map through the view of its window (Park and Kender 1995, 3, 5.5, 6.3).
//!
//! The navigator has a map and a window, but no information about the plane. A step computes the velocity of the window, in its own
//! axes, from the state, the elapsed time and the positions of the dots in view relative to the window's centre. It does not
//! allocate. The state is small and serializable.
//!
//! A robot on land that may face any direction first finds its heading ([`crate::orientation`]). For each entry of the map, the
//! navigator
//! 1. *describes*: stands still, looks, and picks the landmark that the word refers to;
//! 2. for a trajectory, *centres* the window on the pair and *slides* until a new dot comes into view;
//! 3. *verifies*, if the map says how: looks around the landmark and counts the occupied quadrants;
//! 4. *adjusts*, which moves the landmark to its corner; or *recovers*, which moves it to the corner of the recovery and
//!    describes again; or *branches*, which moves it to the corner of the branch and continues at the entry of the branch.
//!
//! If a robot on land does not see the landmark, it looks again from behind the reference and from further ahead. If it loses sight
//! of the reference, it makes way for a while, because a person in the line of sight may be waiting for the robot to move.
//!
//! Above a plane, the window moves freely. On land ([`Window::land`]), the navigator is a robot that drives around the landmarks in
//! its path (8). It seeks by driving to a landmark and adjusts by driving past it, and there are no trajectories.
//!
//! The navigator reports when it has arrived, when it cannot locate a landmark, and when it is lost ([`Outcome`]).

pub mod by_map;
mod detour;
pub mod guide;
pub mod heading;
mod steps;
pub mod tracks;
pub mod view;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::custom_map::CustomMap;
use crate::description::{Descriptor, Vocabulary};
use crate::error::Error;
use crate::geometry::{Corner, Point, Window};
use crate::sides::Course;
use crate::signature::Signature;
use by_map::Progress;
use guide::{Counts, Guide, Next};
use heading::Heading;
use tracks::Tracks;
use view::View;

/// Settings of a navigator. Lengths are in the plane's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The navigator's window.
    pub window: Window,
    /// The words that the navigator understands.
    pub vocabulary: Vocabulary,
    /// Maximum speed, per second.
    pub speed: f64,
    /// Rate at which the navigator removes a position error, per second.
    pub gain: f64,
    /// Position error within which a landmark counts as being in its corner.
    pub tolerance: f64,
    /// Maximum distance between a dot and its expected position.
    pub gate: f64,
    /// Weight of a dot's new position while the window moves, from 0 to 1.
    pub weight: f64,
    /// Number of views that the navigator takes at rest before each decision. The paper's navigator takes one.
    pub looks: u8,
    /// Number of times that the navigator looks again for a landmark that it cannot locate, and number of views for which it
    /// keeps following an unseen landmark.
    pub patience: u8,
    /// Maximum number of recoveries within one entry.
    pub most_recoveries: u8,
    /// Time after which the navigator gives up on an entry, in seconds.
    pub longest_entry_s: f64,
    /// Standard deviation of the heading at the start, in radians. If it is above 0, the navigator corrects its heading by the
    /// bearings of its map.
    pub heading_rad: f64,
    /// Standard deviation of the change of the heading error over a distance of 1, in radians. It grows with the square root of the
    /// distance. It is 0 for a window that never turns.
    pub heading_drift_rad: f64,
    /// The turns of a robot that has to face where it drives, or `None` if it can drive in any direction.
    pub turning: Option<Turning>,
    /// Whether the robot may face any direction at the start, so that it first finds its heading by the landmarks around it.
    pub heading_unknown: bool,
}

/// The turns of a robot with a differential drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Turning {
    /// Maximum turn rate, in radians per second.
    pub rate_radps: f64,
    /// Standard deviation of the change of the heading error over a turn by 1 radian, in radians. It grows with the square root of
    /// the angle.
    pub drift_rad: f64,
}

/// The tolerance and the gate of a robot on land, as fractions of its range.
const LAND_TOLERANCE: f64 = 0.012_5;
const LAND_GATE: f64 = 0.037_5;

impl Settings {
    /// Creates settings for a window and a position error, with a speed of one window side per second and a gate of 3.5 standard
    /// deviations.
    pub fn new(window: Window, sigma: f64) -> Self {
        let above = Self {
            window,
            vocabulary: Vocabulary::ALL,
            speed: window.side,
            gain: 4.0,
            tolerance: 0.02 * window.side,
            gate: 0.03 * window.side + 3.5 * sigma,
            weight: 0.4,
            looks: 1,
            patience: 5,
            most_recoveries: 8,
            longest_entry_s: 120.0,
            heading_rad: 0.0,
            heading_drift_rad: 0.0,
            turning: None,
            heading_unknown: false,
        };
        match window.land {
            None => above,
            // A robot needs time to brake, and a landmark that it passes may hide others for a while.
            Some(land) => Self {
                gain: 1.5,
                tolerance: LAND_TOLERANCE * land.range,
                gate: LAND_GATE * land.range + 3.5 * sigma,
                looks: 3,
                patience: 60,
                ..above
            },
        }
    }

    /// Returns the distance outside a quadrant up to which a dot is accepted as a candidate if there is no other.
    pub fn slack(&self) -> f64 {
        self.gate.min(self.window.margin)
    }

    pub(crate) fn check(self) -> Result<Self, Error> {
        let wrong = |what, expected, found| Err(Error::Parameter { what, expected, found });
        match self.window.land {
            Some(land) => Window::on_land(land)?,
            None => Window::new(self.window.side, self.window.margin)?,
        };
        for (what, value) in [
            ("speed", self.speed),
            ("gain", self.gain),
            ("tolerance", self.tolerance),
            ("gate", self.gate),
            ("longest entry", self.longest_entry_s),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return wrong(what, "a number above 0", value);
            }
        }
        if !(0.0..=1.0).contains(&self.heading_rad) {
            return wrong("error of the heading", "0 to 1 radians", self.heading_rad);
        }
        if self.heading_unknown && self.heading_rad == 0.0 {
            return wrong("error of the heading", "above 0 if it has to be found", self.heading_rad);
        }
        if !(0.0..=1.0).contains(&self.heading_drift_rad) {
            return wrong("drift of the heading", "0 to 1 radians", self.heading_drift_rad);
        }
        if let Some(Turning { rate_radps, drift_rad }) = self.turning {
            if !(rate_radps > 0.0 && rate_radps.is_finite()) {
                return wrong("turn rate", "a number above 0", rate_radps);
            }
            if !(0.0..=1.0).contains(&drift_rad) {
                return wrong("drift of the heading in turns", "0 to 1 radians", drift_rad);
            }
        }
        if !(self.weight > 0.0 && self.weight <= 1.0) {
            return wrong("weight", "a number above 0, at most 1", self.weight);
        }
        if self.looks == 0 {
            return wrong("looks", "at least 1", 0.0);
        }
        Ok(self)
    }
}

/// Maximum number of dots considered in a view if the heading is uncertain. A description fails on far fewer.
const MOST_SEEN: usize = 128;

/// The current activity of a navigator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Activity {
    /// Looks for the landmark that a word refers to.
    Seek,
    /// Brings a pair of landmarks to the middle of the window, or slides along the line through them.
    Slide,
    /// Looks around the landmark that it has attained.
    Verify,
    /// Moves the landmark to the corner that the entry names.
    Adjust,
    /// Moves a wrong landmark to the corner of a recovery, or seeks from there.
    Recover,
    /// Rests after the journey.
    Rest,
}

/// The outcome of a journey from the navigator's point of view (7.2.6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// The navigator believes it is at the goal.
    Arrived,
    /// Failure 1: the navigator cannot locate a landmark.
    CannotLocate,
    /// Failure 2: the verification has shown that the navigator is lost, and the map has no recovery.
    Lost,
}

/// The result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Velocity of the window in its own axes, per second.
    pub velocity: Point,
    /// The current activity.
    pub activity: Activity,
    /// Number of the current entry or, without a map, of the current movement, from 0.
    pub entry: u16,
    /// Estimated position of the reference landmark, relative to the window's centre.
    pub reference: Option<Point>,
    /// Number of entries finished, each with a landmark that was accepted as right.
    pub accepted: u16,
    /// The landmark of the map that the navigator believes it accepted last, as the number of its entry. In a straight map, this is
    /// the entry just finished. In general, it is the entry after which the next entry of the map begins, and the last entry stands
    /// for the goal.
    pub meant: u16,
    /// Total number of recoveries, and of branches to any entry other than the next.
    pub recoveries: u16,
    /// Whether the navigator knows its heading.
    pub is_oriented: bool,
    /// The outcome of the journey, or `None` while it is under way.
    pub outcome: Option<Outcome>,
}

/// A landmark followed from view to view.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Mark {
    place: Point,
    missed: u8,
}

/// The current phase of the work on an entry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Phase {
    /// Stands still, looks, and finds the heading by the landmarks around the start.
    Orient,
    /// Stands still, looks, and picks the landmark that the word refers to. If there is a corner, the reference lies in it.
    Describe { word: Descriptor, corner: Option<Corner>, is_recovery: bool },
    /// On land, drives to another place beside the reference, or as far as possible in the time allowed, to look again from there.
    Elsewhere { word: Descriptor, corner: Corner, is_recovery: bool, until_s: f64 },
    /// Brings the midpoint between the reference and the second landmark to the middle of the window.
    Centre { second: Mark },
    /// Slides. `aside` is the distance of the pair's line to the left of the window's centre, and `slid` is the distance that
    /// the window has slid along it.
    Slide { along: Point, aside: f64, slid: f64 },
    /// Looks around the reference, which is in the corner with this number.
    Around { corner: u8 },
    /// Brings the reference to a corner.
    Adjust { corner: Corner, next: Next },
    /// Rests after the journey.
    Finished { outcome: Outcome },
}

/// The memory of a navigator. Equal states, views and times result in equal steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State<M = Progress> {
    phase: Phase,
    /// The guide's memory.
    memory: M,
    /// Seconds since the entry began.
    spent_s: f64,
    velocity: Point,
    /// The estimated heading. All positions in the state are in the map's axes according to this estimate.
    heading: Heading,
    /// Direction of the last movement in the window's own axes, which a robot that has to turn faces.
    faces: Point,
    reference: Option<Mark>,
    /// The direction of travel, by which landmarks are counted.
    course: Course,
    /// Position of the landmark at which the current entry began, relative to the window's centre.
    began: Option<Point>,
    /// Number of views taken since the window stopped.
    looks: u8,
    /// Number of looks in which the landmark was not found.
    waited: u8,
    /// Number of other places from which the navigator has looked for the landmark.
    elsewhere: u8,
    signature: Signature,
    /// On land, how often the robot has made way in this entry because the reference was out of sight, and for how many more
    /// seconds it will.
    retreats: u8,
    retreat_s: f64,
    /// The dots seen since the window stopped or began to slide.
    tracks: Tracks,
    /// The dots seen by the last description. All others are new.
    before: Tracks,
}

/// A navigator and its guide, by default a custom map.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigator<G = CustomMap> {
    settings: Settings,
    guide: G,
}

impl Navigator {
    /// Creates a navigator. Rejects settings out of range, and maps with words that the navigator doesn't understand.
    pub fn new(settings: Settings, map: CustomMap) -> Result<Self, Error> {
        for (entry, line) in (1..).zip(map.entries()) {
            if let Some(word) = line.words().find(|&word| !settings.vocabulary.has(word)) {
                return Err(Error::Vocabulary { entry, word: word.word() });
            }
            if let (Some(direction), Some(_)) = (line.trajectory, settings.window.land) {
                return Err(Error::Vocabulary { entry, word: direction.word() });
            }
        }
        Self::guided(settings, map)
    }

    /// Returns the map.
    pub fn map(&self) -> &CustomMap {
        &self.guide
    }
}

impl<G: Guide> Navigator<G> {
    /// Creates a navigator with any guide. Rejects settings out of range.
    pub fn guided(settings: Settings, guide: G) -> Result<Self, Error> {
        Ok(Self { settings: settings.check()?, guide })
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the guide.
    pub fn guide(&self) -> &G {
        &self.guide
    }

    /// Returns the initial state, without a reference.
    pub fn start(&self) -> State<G::Memory> {
        self.start_with(self.guide.begin())
    }

    fn start_with(&self, memory: G::Memory) -> State<G::Memory> {
        let is_known = !self.settings.heading_unknown;
        let heading =
            if is_known { Heading::of_sigma(self.settings.heading_rad) } else { Heading::unknown() };
        State {
            phase: self.begins(&memory, heading),
            memory,
            spent_s: 0.0,
            velocity: Point::default(),
            heading,
            faces: Point::new(1.0, 0.0),
            reference: None,
            course: Course::default(),
            began: None,
            looks: 0,
            waited: 0,
            elsewhere: 0,
            retreats: 0,
            retreat_s: 0.0,
            signature: Signature::default(),
            tracks: Tracks::default(),
            before: Tracks::default(),
        }
    }

    /// Returns the initial state of a journey that follows another one. It keeps the estimated heading and whatever the guide
    /// carries over.
    pub fn start_after(&self, last: &State<G::Memory>) -> State<G::Memory> {
        let arrived = (last.outcome() == Some(Outcome::Arrived)).then_some(&last.memory);
        let start = self.start_with(self.guide.begin_after(arrived));
        let phase = self.begins(&start.memory, last.heading);
        State { heading: last.heading, faces: last.faces, phase, ..start }
    }

    /// Returns the first phase of a journey.
    fn begins(&self, memory: &G::Memory, heading: Heading) -> Phase {
        match heading.is_known() {
            true => Phase::Describe { word: self.guide.order(memory).word, corner: None, is_recovery: false },
            false => Phase::Orient,
        }
    }

    /// Performs one step, given the current view and the time since the last step, which is 0 for the first.
    pub fn step(&self, state: &mut State<G::Memory>, view: View<'_>, elapsed_s: f64) -> Output {
        let mut turned = ArrayVec::new();
        steps::step(self, state, self.in_map_axes(state, view, &mut turned), elapsed_s);
        self.output(state)
    }

    /// Performs one step after the journey, while the window moves over the attained landmark. The output has an outcome once the
    /// window is there or, on land, if the robot loses sight of the landmark.
    pub fn hover(&self, state: &mut State<G::Memory>, view: View<'_>, elapsed_s: f64) -> Output {
        let mut turned = ArrayVec::new();
        let view = self.in_map_axes(state, view, &mut turned);
        let has_ended = steps::hover(&self.settings, state, view, elapsed_s);
        Output { outcome: state.outcome().filter(|_| has_ended), ..self.output(state) }
    }

    /// Converts the view to the map's axes. If the heading has no error, the window's axes are those of the map.
    fn in_map_axes<'a>(
        &self,
        state: &State<G::Memory>,
        view: View<'a>,
        turned: &'a mut ArrayVec<Point, MOST_SEEN>,
    ) -> View<'a> {
        if self.settings.heading_rad == 0.0 {
            return view;
        }
        turned.extend(view.dots.iter().take(MOST_SEEN).map(|dot| dot.turned(state.heading.turned_rad)));
        View { dots: turned, ..view }
    }

    /// Returns the result of the last step.
    pub fn output(&self, state: &State<G::Memory>) -> Output {
        let turned_rad = state.heading.turned_rad;
        let Counts { entry, accepted, meant, recoveries } = self.guide.counts(&state.memory);
        Output {
            velocity: state.velocity.turned(-turned_rad),
            activity: state.activity(),
            entry,
            reference: state.reference.map(|mark| mark.place.turned(-turned_rad)),
            accepted,
            meant,
            recoveries,
            is_oriented: state.heading.is_known(),
            outcome: state.outcome(),
        }
    }
}

impl<M> State<M> {
    /// Returns the guide's memory.
    pub fn memory(&self) -> &M {
        &self.memory
    }

    /// Records that the window was stopped and will not move until the next step.
    pub fn stand_still(&mut self) {
        self.moves_by(Point::default());
    }

    /// Records a different velocity of the window until the next step, used if something is in its path. The velocity is in the
    /// window's own axes.
    pub fn moves_by(&mut self, velocity: Point) {
        self.velocity = velocity.turned(self.heading.turned_rad);
    }

    /// Returns the outcome of the journey, or `None` if it has not ended.
    pub fn outcome(&self) -> Option<Outcome> {
        match self.phase {
            Phase::Finished { outcome } => Some(outcome),
            _ => None,
        }
    }

    fn activity(&self) -> Activity {
        match self.phase {
            Phase::Orient
            | Phase::Describe { is_recovery: false, .. }
            | Phase::Elsewhere { is_recovery: false, .. } => Activity::Seek,
            Phase::Centre { .. } | Phase::Slide { .. } => Activity::Slide,
            Phase::Around { .. } => Activity::Verify,
            Phase::Adjust { next: Next::Entry(_), .. } => Activity::Adjust,
            Phase::Describe { .. } | Phase::Elsewhere { .. } | Phase::Adjust { .. } => Activity::Recover,
            Phase::Finished { .. } => Activity::Rest,
        }
    }
}

#[cfg(test)]
mod tests;
