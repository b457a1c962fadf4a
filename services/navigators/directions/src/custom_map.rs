//! The custom map: the list of symbols by which the navigator finds its way (Park and Kender 1995, 5.5).
//!
//! ```text
//! # from dot 12 to dot 81
//! (*, SW)
//! (Isol, (4, SW, Isol), (2, SE, Isol), (3, -), NE)
//! (Isol, Trajp, (2, NW, Isol), (1, -), -)
//! ```
//!
//! An entry is `(D, [T,] [E,] M)`. `D` says which landmark to seek ([`Descriptor`]). `T` is `Trajp` or `Trajn`: slide along
//! the line from the reference to that landmark, forwards or backwards. Each `E` says what to do when so many quadrants of
//! the attained landmark are occupied: `(3, -)` takes it as right, `(4, SW, Isol)` moves it to a corner and seeks again.
//! `M` is the corner for the attained landmark; `-` stands in the last entry alone and does nothing.
//!
//! Case and white space do not matter, `#` begins a comment, commas between entries and brackets around all of them are
//! optional. [`CustomMap`] prints as it parses.

mod parse;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;

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

/// What to do for each quadrant occupancy count of the landmark that was attained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verification {
    /// The count of the right landmark.
    expected: u8,
    /// For each other count the way back, where there is one.
    recoveries: [Option<Recovery>; 5],
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
    /// Accepts a landmark with this count of occupied quadrants, 0 to 4.
    pub fn new(expected: u8) -> Result<Self, Error> {
        if expected > 4 {
            return Err(Error::Parameter {
                what: "quadrant occupancy count",
                expected: "0 to 4",
                found: f64::from(expected),
            });
        }
        Ok(Self { expected, recoveries: [None; 5] })
    }

    /// Adds a way back for a count. The expected count, and counts above 4, have none.
    pub fn recovering(mut self, count: u8, recovery: Recovery) -> Self {
        if count != self.expected && count <= 4 {
            self.recoveries[usize::from(count)] = Some(recovery);
        }
        self
    }

    /// The count of the right landmark.
    pub fn expected(self) -> u8 {
        self.expected
    }

    /// What to do with a count.
    pub fn response(self, count: u8) -> Response {
        if count == self.expected {
            return Response::Correct;
        }
        match self.recoveries.get(usize::from(count)) {
            Some(&Some(recovery)) => Response::Recover(recovery),
            _ => Response::Lost,
        }
    }

    /// The ways back, by their counts.
    pub fn recoveries(self) -> impl Iterator<Item = (u8, Recovery)> {
        (0..).zip(self.recoveries).filter_map(|(count, recovery)| Some((count, recovery?)))
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
        if let Some(direction) = self.trajectory {
            write!(f, ", {}", direction.word())?;
        }
        if let Some(verification) = self.verification {
            for (count, Recovery { corner, word }) in verification.recoveries() {
                write!(f, ", ({count}, {}, {word})", corner.word())?;
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
mod tests;
