//! The navigator: seeks, verifies, adjusts and recovers by a custom map and the view of its window (Park and Kender 1995, 3,
//! 5.5, 6.3).
//!
//! It knows its map, its own window, and nothing of the plane. A step takes the positions of the dots in view,
//! relative to the window's centre. It gives the velocity of the window in its own axes. A step is a function of
//! state, view and elapsed time; it allocates nothing. The state is small and serializable.
//!
//! For each entry of the map it:
//! 1. *describes*: stands still, looks, and picks the landmark that the word means;
//! 2. for a trajectory, *centres* the window around the pair and *slides* until a new dot comes in;
//! 3. *verifies*, where the map says how: looks around the landmark and counts its occupied quadrants;
//! 4. *adjusts*: moves the landmark to its corner; or *recovers*: to the corner of the recovery, and describes again; or
//!    *branches*: to the corner of the branch, and goes on at its entry.
//!
//! It has two bodies ([`Window::land`]). Above a plane its window moves freely. On land it is a robot that drives
//! around the landmarks in its way (8). To seek is to drive to a landmark, and to adjust is to pass beside it. There
//! it has no trajectories.
//!
//! It knows of itself that it has arrived, that it cannot locate a landmark, and that it is lost ([`Outcome`]).

mod detour;
pub mod heading;
mod steps;
pub mod tracks;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::custom_map::CustomMap;
use crate::description::{Descriptor, Vocabulary};
use crate::error::Error;
use crate::geometry::{Corner, Point, Window};
use crate::signature::Signature;
use heading::Heading;
use tracks::Tracks;

/// How a navigator sees and moves. Lengths are in the plane's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Its window.
    pub window: Window,
    /// The words that it understands.
    pub vocabulary: Vocabulary,
    /// Its greatest speed, per second.
    pub speed: f64,
    /// How fast it removes an error of position, per second.
    pub gain: f64,
    /// The error of position at which a landmark lies in its corner.
    pub tolerance: f64,
    /// How far a dot may be from where it should be.
    pub gate: f64,
    /// The weight of a new position of a dot while the window moves, from 0 to 1.
    pub weight: f64,
    /// How many views it takes where it stands before it decides. The paper's navigator takes one.
    pub looks: u8,
    /// How often it looks again for a landmark that it cannot locate, and for how many views it follows one unseen.
    pub patience: u8,
    /// How often it recovers within one entry.
    pub most_recoveries: u8,
    /// How long it works on an entry before it gives up, in seconds.
    pub longest_entry_s: f64,
    /// Standard deviation of its heading at the start, radians. Above 0, it corrects it by the bearings of its map.
    pub heading_rad: f64,
}

/// The tolerance and the gate of a robot on land, in its range.
const LAND_TOLERANCE: f64 = 0.012_5;
const LAND_GATE: f64 = 0.037_5;

impl Settings {
    /// What suits a window and an error of position: a window's side a second, and a gate of three and a half deviations.
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
        };
        match window.land {
            None => above,
            // A robot needs time to brake, and passes behind landmarks that hide others for a while.
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

    /// How far outside of a quadrant a dot is still taken for a candidate where there is no other.
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
        if !(self.weight > 0.0 && self.weight <= 1.0) {
            return wrong("weight", "a number above 0, at most 1", self.weight);
        }
        if self.looks == 0 {
            return wrong("looks", "at least 1", 0.0);
        }
        Ok(self)
    }
}

/// The most dots of a view that count on land: more than any description copes with.
const MOST_SEEN: usize = 128;

/// What a navigator is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Activity {
    /// It looks for the landmark that a word means.
    Seek,
    /// It brings a pair of landmarks to the middle of its window, or slides along their line.
    Slide,
    /// It looks around the landmark that it has attained.
    Verify,
    /// It moves the landmark to the corner that the entry says.
    Adjust,
    /// It moves a wrong landmark to the corner of a recovery, or seeks from there.
    Recover,
    /// It has finished.
    Rest,
}

/// How a journey has ended, as far as the navigator is aware (7.2.6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// It reports the goal.
    Arrived,
    /// It cannot locate a landmark: failure 1.
    CannotLocate,
    /// It has verified that it is lost, and the map has no way back: failure 2.
    Lost,
}

/// What a step gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// The velocity of the window in its own axes, per second.
    pub velocity: Point,
    /// What the navigator is doing.
    pub activity: Activity,
    /// The entry that it works on, from 0.
    pub entry: u16,
    /// Where it believes its reference landmark to be, relative to the window's centre.
    pub reference: Option<Point>,
    /// How many entries it has finished, each with a landmark that it took as right.
    pub accepted: u16,
    /// Which of the landmarks of its map it takes the one for that it accepted last: of a straight map, that of the entry; in general
    /// the one where the next entry of the map begins, and the last one is the goal.
    pub meant: u16,
    /// How often it has recovered, or branched to another entry than the next one, in all.
    pub recoveries: u16,
    /// How the journey has ended, if it has.
    pub outcome: Option<Outcome>,
}

/// A landmark that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Mark {
    place: Point,
    missed: u8,
}

/// What is done now.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Phase {
    /// Stands, looks, and picks the landmark of a word. With a corner, the reference lies there.
    Describe { word: Descriptor, corner: Option<Corner>, is_recovery: bool },
    /// Brings the reference and the second landmark to the middle.
    Centre { second: Mark },
    /// Slides. The pair's line lies so far to the left of the window's centre, and the window has slid so far along it.
    Slide { along: Point, aside: f64, slid: f64 },
    /// Looks around the reference: at the corner with this number.
    Around { corner: u8 },
    /// Brings the reference to a corner.
    Adjust { corner: Corner, next: Next },
    /// Rests.
    Finished { outcome: Outcome },
}

/// What follows when the reference lies in its corner.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Next {
    /// It seeks by a recovery's word.
    Seek(Descriptor),
    /// It goes on at an entry. One beyond the map is the end of the journey.
    Entry(u16),
}

/// All that a navigator remembers. Equal states, views and times give equal steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    phase: Phase,
    entry: u16,
    accepted: u16,
    meant: u16,
    recoveries: u16,
    /// Recoveries within this entry.
    tries: u8,
    /// Seconds since the entry began.
    spent_s: f64,
    velocity: Point,
    /// All places here are in the map's axes as this believes them.
    heading: Heading,
    reference: Option<Mark>,
    /// How many views have been taken at this stand.
    looks: u8,
    /// How often the landmark was not found.
    waited: u8,
    signature: Signature,
    /// What this stand or slide has seen.
    tracks: Tracks,
    /// What the last description saw: anything else is new.
    before: Tracks,
}

/// A navigator with its map.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigator {
    settings: Settings,
    map: CustomMap,
}

impl Navigator {
    /// Rejects settings out of range, and a map with words that the navigator does not understand.
    pub fn new(settings: Settings, map: CustomMap) -> Result<Self, Error> {
        let settings = settings.check()?;
        for (entry, line) in (1..).zip(map.entries()) {
            if let Some(word) = line.words().find(|&word| !settings.vocabulary.has(word)) {
                return Err(Error::Vocabulary { entry, word: word.word() });
            }
            if let (Some(direction), Some(_)) = (line.trajectory, settings.window.land) {
                return Err(Error::Vocabulary { entry, word: direction.word() });
            }
        }
        Ok(Self { settings, map })
    }

    /// Its settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Its map.
    pub fn map(&self) -> &CustomMap {
        &self.map
    }

    /// The number of the last entry, from 0.
    fn last_entry(&self) -> u16 {
        (self.map.entries().len() - 1) as u16
    }

    /// The state at the beginning: no reference, the first entry.
    pub fn start(&self) -> State {
        State {
            phase: Phase::Describe { word: self.map.entries()[0].word, corner: None, is_recovery: false },
            entry: 0,
            accepted: 0,
            meant: 0,
            recoveries: 0,
            tries: 0,
            spent_s: 0.0,
            velocity: Point::default(),
            heading: Heading::of_sigma(self.settings.heading_rad),
            reference: None,
            looks: 0,
            waited: 0,
            signature: Signature::default(),
            tracks: Tracks::default(),
            before: Tracks::default(),
        }
    }

    /// The state at the beginning of a journey that follows another: what it knows of its heading remains.
    pub fn start_behind(&self, last: &State) -> State {
        State { heading: last.heading, ..self.start() }
    }

    /// One step: what the window shows now, and how long ago the last step was. The first step has no time before it.
    pub fn step(&self, state: &mut State, view: &[Point], elapsed_s: f64) -> Output {
        let mut turned = ArrayVec::new();
        steps::step(self, state, self.in_map_axes(state, view, &mut turned), elapsed_s);
        state.output()
    }

    /// One step after the journey: the window moves over the landmark that was attained. It has an outcome when it is there.
    pub fn hover(&self, state: &mut State, view: &[Point], elapsed_s: f64) -> Output {
        let mut turned = ArrayVec::new();
        let view = self.in_map_axes(state, view, &mut turned);
        let is_there = steps::hover(&self.settings, state, view, elapsed_s);
        Output { outcome: state.outcome().filter(|_| is_there), ..state.output() }
    }

    /// What the window shows along the map's axes. Without an error of the heading, the window's axes are those of the map.
    fn in_map_axes<'a>(
        &self,
        state: &State,
        view: &'a [Point],
        turned: &'a mut ArrayVec<Point, MOST_SEEN>,
    ) -> &'a [Point] {
        if self.settings.heading_rad == 0.0 {
            return view;
        }
        turned.extend(view.iter().take(MOST_SEEN).map(|dot| dot.turned(state.heading.turned_rad)));
        turned
    }
}

impl State {
    /// What the last step gave.
    pub fn output(&self) -> Output {
        let turned_rad = self.heading.turned_rad;
        Output {
            velocity: self.velocity.turned(-turned_rad),
            activity: self.activity(),
            entry: self.entry,
            reference: self.reference.map(|mark| mark.place.turned(-turned_rad)),
            accepted: self.accepted,
            meant: self.meant,
            recoveries: self.recoveries,
            outcome: self.outcome(),
        }
    }

    /// Somebody stopped the window: it does not move until the next step.
    pub fn stand_still(&mut self) {
        self.moves_by(Point::default());
    }

    /// The window moves by another velocity, in its own axes, until the next step: something is in its way.
    pub fn moves_by(&mut self, velocity: Point) {
        self.velocity = velocity.turned(self.heading.turned_rad);
    }

    /// How the journey has ended, if it has.
    pub fn outcome(&self) -> Option<Outcome> {
        match self.phase {
            Phase::Finished { outcome } => Some(outcome),
            _ => None,
        }
    }

    fn activity(&self) -> Activity {
        match self.phase {
            Phase::Describe { is_recovery: false, .. } => Activity::Seek,
            Phase::Centre { .. } | Phase::Slide { .. } => Activity::Slide,
            Phase::Around { .. } => Activity::Verify,
            Phase::Adjust { next: Next::Entry(_), .. } => Activity::Adjust,
            Phase::Describe { .. } | Phase::Adjust { .. } => Activity::Recover,
            Phase::Finished { .. } => Activity::Rest,
        }
    }
}

#[cfg(test)]
mod tests;
