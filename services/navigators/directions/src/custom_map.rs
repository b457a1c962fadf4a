//! The custom map: the list of symbols by which the navigator finds its way (Park and Kender 1995, 5.5).
//!
//! ```text
//! # from dot 12 to dot 81
//! (*, SW)
//! (Isol, (4, SW, Isol), (2, SE, Isol), (3, -), NE)
//! (Isol, Trajp, (2, NW, Isol), (1, -), -)
//! ```
//!
//! An entry is `(D, [B,] [T,] [E,] M)`. `D` says which landmark to seek ([`Descriptor`]). `B` is the compass bearing of that
//! landmark from the reference, `000` to `359`: a robot whose heading may be wrong corrects it by that. `T` is `Trajp` or `Trajn`:
//! slide along the line from the reference to that landmark, forwards or backwards. Each `E` says what to do when so many
//! quadrants of the attained landmark are occupied. `(3, -)` takes it as right; `(4, SW, Isol)` moves it to a corner
//! and seeks again. `M` is the corner for the attained landmark; `-` stands in the last entry alone and does nothing.
//!
//! A count says how many quadrants are occupied. A navigator on land sees all around, and has the four quadrants in order in
//! its place: `(none+point+pair+group, SW, Isol)` (8). Of all panoramas of an entry, the one that is most like what it sees counts.
//!
//! Case and white space do not matter, `#` begins a comment, commas between entries and brackets around all of them are
//! optional. [`CustomMap`] prints as it parses.

mod parse;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::signature::Signature;

/// The most entries of a map.
pub const MOST_ENTRIES: usize = 10_000;

/// A map for the navigator. It has at least one entry, and its last entry alone may have no corner.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Entry>", into = "Vec<Entry>")]
pub struct CustomMap(Vec<Entry>);

/// One line of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Which landmark to seek.
    pub word: Descriptor,
    /// Its bearing from the reference, degrees from north to the east, if the map says it.
    pub bearing_deg: Option<u16>,
    /// In which direction to slide along the line of the reference and that landmark, if at all.
    pub trajectory: Option<Direction>,
    /// How to verify the landmark that was attained, if at all.
    pub verification: Option<Verification>,
    /// The corner for the landmark that was attained; none does nothing.
    pub place: Option<Corner>,
}

/// The direction of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Direction {
    /// From the reference to the landmark that is seen: `Trajp`.
    Forward,
    /// The other way: `Trajn`.
    Backward,
}

/// Degrees of a full turn: a bearing is less.
pub const FULL_TURN_DEG: u16 = 360;
/// The most ways back of an entry.
pub const MOST_RECOVERIES: usize = 8;
/// The greatest difference of a panorama from one that is taken for it.
const MOST_DIFFERENCE: u8 = 2;

/// What is seen around a landmark, as a map has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Sign {
    /// The quadrant occupancy count.
    Count(u8),
    /// What each quadrant holds, in order.
    Panorama(Signature),
}

impl Sign {
    /// How far it is from what is seen; none where that is something else.
    fn difference(self, seen: Signature) -> Option<u8> {
        match self {
            Self::Count(count) => (count == seen.count()).then_some(0),
            Self::Panorama(own) => Some(own.difference(seen)).filter(|&off| off <= MOST_DIFFERENCE),
        }
    }
}

impl From<u8> for Sign {
    fn from(count: u8) -> Self {
        Self::Count(count)
    }
}

impl fmt::Display for Sign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => write!(f, "{count}"),
            Self::Panorama(signature) => write!(f, "{signature}"),
        }
    }
}

/// What to do for each sign of the landmark that was attained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verification {
    /// The sign of the right landmark.
    expected: Sign,
    /// For other signs the way back, in the order of the signs.
    recoveries: [Option<(Sign, Recovery)>; MOST_RECOVERIES],
}

/// A way back: move the wrong landmark to a corner, and seek from there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recovery {
    /// The corner.
    pub corner: Corner,
    /// The landmark to seek.
    pub word: Descriptor,
}

/// What the navigator does after it has looked around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response {
    /// The landmark is right.
    Correct,
    /// It is wrong, and this is the way back.
    Recover(Recovery),
    /// It is wrong, and the map has no way back.
    Lost,
}

impl Verification {
    /// Accepts a landmark with this sign: a count of occupied quadrants, 0 to 4, or a panorama.
    pub fn new(expected: impl Into<Sign>) -> Result<Self, Error> {
        match expected.into() {
            Sign::Count(count @ 5..) => Err(Error::Parameter {
                what: "quadrant occupancy count",
                expected: "0 to 4",
                found: f64::from(count),
            }),
            expected => Ok(Self { expected, recoveries: [None; MOST_RECOVERIES] }),
        }
    }

    /// Adds a way back for a sign. The expected sign, counts above 4, and signs beyond [`MOST_RECOVERIES`] have none.
    pub fn recovering(mut self, sign: impl Into<Sign>, recovery: Recovery) -> Self {
        let sign = sign.into();
        if sign == self.expected || matches!(sign, Sign::Count(5..)) {
            return self;
        }
        let is_same = |way: &Option<(Sign, Recovery)>| way.is_none_or(|(other, _)| other == sign);
        let same = self.recoveries.iter().position(|way| way.is_some() && is_same(way));
        if let Some(place) = same.or_else(|| self.recoveries.iter().position(is_same)) {
            self.recoveries[place] = Some((sign, recovery));
            self.recoveries.sort_by_key(|way| (way.is_none(), way.map(|(sign, _)| sign)));
        }
        self
    }

    /// The sign of the right landmark.
    pub fn expected(self) -> Sign {
        self.expected
    }

    /// What to do with what is seen around. Of the signs that agree with it, the most similar one counts.
    pub fn response(self, seen: Signature) -> Response {
        let right = (self.expected, Response::Correct);
        let ways = self.recoveries().map(|(sign, recovery)| (sign, Response::Recover(recovery)));
        let all = std::iter::once(right).chain(ways);
        let agreeing = all.filter_map(|(sign, response)| Some((sign.difference(seen)?, response)));
        agreeing.min_by_key(|(off, _)| *off).map_or(Response::Lost, |(_, response)| response)
    }

    /// The ways back, by their signs.
    pub fn recoveries(self) -> impl Iterator<Item = (Sign, Recovery)> {
        self.recoveries.into_iter().flatten()
    }
}

impl Entry {
    /// The words that it needs.
    pub fn words(&self) -> impl Iterator<Item = Descriptor> + use<> {
        let recoveries = self.verification.into_iter().flat_map(Verification::recoveries);
        std::iter::once(self.word).chain(recoveries.map(|(_, recovery)| recovery.word))
    }
}

impl CustomMap {
    /// A map of these entries.
    pub fn new(entries: Vec<Entry>) -> Result<Self, Error> {
        if entries.is_empty() || entries.len() > MOST_ENTRIES {
            return Err(Error::MapLength { limit: MOST_ENTRIES, found: entries.len() });
        }
        match entries[..entries.len() - 1].iter().position(|entry| entry.place.is_none()) {
            Some(entry) => Err(Error::NoCorner { entry: entry + 1 }),
            None => Ok(Self(entries)),
        }
    }

    /// The entries.
    pub fn entries(&self) -> &[Entry] {
        &self.0
    }

    /// For each entry that was finished, whether its landmark is the one that is meant. Of confusable ones each is.
    pub fn agreement<T: PartialEq>(&self, attained: &[T], meant: &[T]) -> impl Iterator<Item = bool> {
        let pairs = self.0.iter().zip(attained.iter().zip(meant));
        pairs.map(|(entry, (attained, meant))| entry.word == Descriptor::Confusable || attained == meant)
    }
}

impl TryFrom<Vec<Entry>> for CustomMap {
    type Error = Error;
    fn try_from(entries: Vec<Entry>) -> Result<Self, Error> {
        Self::new(entries)
    }
}

impl From<CustomMap> for Vec<Entry> {
    fn from(map: CustomMap) -> Self {
        map.0
    }
}

impl Direction {
    /// The word as custom maps have it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Forward => "Trajp",
            Self::Backward => "Trajn",
        }
    }
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}", self.word)?;
        if let Some(bearing_deg) = self.bearing_deg {
            write!(f, ", {bearing_deg:03}")?;
        }
        if let Some(direction) = self.trajectory {
            write!(f, ", {}", direction.word())?;
        }
        if let Some(verification) = self.verification {
            for (sign, Recovery { corner, word }) in verification.recoveries() {
                write!(f, ", ({sign}, {}, {word})", corner.word())?;
            }
            write!(f, ", ({}, -)", verification.expected)?;
        }
        write!(f, ", {})", self.place.map_or("-", Corner::word))
    }
}

impl fmt::Display for CustomMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|entry| writeln!(f, "{entry}"))
    }
}

#[cfg(test)]
pub(crate) mod tests;
