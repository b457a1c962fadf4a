//! Guides, which decide what a navigator looks for and how it continues from each landmark.
//!
//! The navigator itself moves and looks around, while a [`Guide`] makes the decisions. A custom map is a guide (see
//! [`by_map`](super::by_map)), and so is a list of landmarks with a belief about the current one ([`crate::belief`]).

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Outcome, Settings};
use crate::custom_map::Direction;
use crate::description::Descriptor;
use crate::geometry::Corner;
use crate::markers::LandmarkKind;
use crate::plane::DotId;
use crate::signature::Signature;

/// Decides where a navigator goes. Equal memories and observations result in equal decisions, and no decision allocates.
pub trait Guide {
    /// What the guide remembers of a journey.
    type Memory: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns the memory at the start of a journey.
    fn begin(&self) -> Self::Memory;

    /// Returns the memory at the start of a journey that follows another one. `last` is the memory of that journey if it arrived.
    fn begin_after(&self, _last: Option<&Self::Memory>) -> Self::Memory {
        self.begin()
    }

    /// Returns what to look for now.
    fn order(&self, memory: &Self::Memory) -> Order;

    /// Decides what to do with the attained landmark, given its surroundings, which are empty if the order did not ask for them.
    fn attained(&self, memory: &mut Self::Memory, seen: Signature, settings: &Settings) -> Decision;

    /// Decides what to do if no landmark fits the word.
    fn nothing(&self, memory: &mut Self::Memory, settings: &Settings) -> Decision;

    /// Continues with the order of a [`Next::Entry`]. Returns false if the journey ends there.
    fn enter(&self, memory: &mut Self::Memory, entry: u16) -> bool;

    /// Returns the progress of the journey.
    fn counts(&self, memory: &Self::Memory) -> Counts;

    /// Returns the number of landmarks that the guide refers to. [`Counts::meant`] is less.
    fn landmarks(&self) -> usize;

    /// Returns the number of the goal among the guide's landmarks.
    fn goal(&self) -> usize;

    /// Returns true if the guide identified the landmark attained by an entry correctly.
    fn is_right(&self, _entry: u16, attained: DotId, meant: DotId) -> bool {
        attained == meant
    }

    /// Returns true if the guide identified all attained landmarks correctly. `entries` are the entries that attained them.
    fn is_planned(&self, attained: &[DotId], meant: &[DotId], entries: &[u16]) -> bool;
}

/// What a navigator looks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// The kind of landmark to seek, or `None` if it may be of any kind.
    pub kind: Option<LandmarkKind>,
    /// The word for the landmark to seek.
    pub word: Descriptor,
    /// The bearing of that landmark from the reference, in degrees clockwise from north, if it is known.
    pub bearing_deg: Option<u16>,
    /// The direction in which to slide along the line through the reference and that landmark.
    pub trajectory: Option<Direction>,
    /// Whether to look around the attained landmark.
    pub looks_around: bool,
}

/// What to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Decision {
    /// Moves the landmark to a corner, and then continues.
    Adjust {
        /// The corner.
        corner: Corner,
        /// How to continue.
        next: Next,
    },
    /// Ends the journey.
    Finish(Outcome),
}

/// The next step once the reference lies in its corner.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, serde::Deserialize)]
pub enum Next {
    /// Seeks the landmark named by a recovery.
    Seek(Descriptor),
    /// Continues with this order of the guide.
    Entry(u16),
}

/// The progress of a journey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Number of the current entry of a map or, without a map, of the current movement, from 0.
    pub entry: u16,
    /// Number of landmarks accepted.
    pub accepted: u16,
    /// Number of the landmark that the guide believes the last accepted one to be.
    pub meant: u16,
    /// Number of recoveries.
    pub recoveries: u16,
}
