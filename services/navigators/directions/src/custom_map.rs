//! The custom map, a list of symbols that guides the navigator (Park and Kender 1995, 5.5).
//!
//! ```text
//! # from dot 12 to dot 81
//! (*, SW)
//! (Isol, (4, SW, Isol), (2, SE, Isol), (3, -), NE)
//! (Isol, Trajp, (2, NW, Isol), (1, -), -)
//! ```
//!
//! An entry has the form `([K,] D, [B,] [T,] [E,] M)`. `D` is the word for the landmark to seek ([`Descriptor`]), and `K` the kind
//! of landmark that it means, such as `door`. Without `K`, the landmark may be of any kind. `B` is the compass bearing of that
//! landmark from the reference, `000` to `359`, which a robot with an uncertain heading uses to correct it. `T` is `Trajp` or
//! `Trajn`: slide along the line from the reference to that landmark, forwards or backwards. Each `E` says what to do if the
//! attained landmark has a given number of occupied quadrants: `(3, -)` accepts the landmark as right, and `(4, SW, Isol)` moves it
//! to a corner and seeks again. `M` is the corner to move the attained landmark to, or `-` in the last entry, which moves nothing.
//!
//! A count is the number of occupied quadrants. A navigator on land sees all around, so its maps have the contents of the four
//! quadrants in order instead of a count: `(none+point+pair+group, SW, Isol)` (8). The navigator uses the panorama of the entry
//! that is most similar to its view.
//!
//! `Same`, an extension of ours, refers to the reference itself: `(Same, NE)` drives around the landmark until it lies in the
//! corner NE.
//!
//! As another extension, a map may *branch*. A number in place of a word is the number of an entry, from 1:
//!
//! ```text
//! (*, SW)
//! (Isol, (point+none+none+pair, NE, 4), (-, SE, 4), (none+point+pair+none, -), SW)
//! (Isol, (*, NE, 4), (point+point+none+none, -), -)
//! (Isol, (none+point+pair+none, SW, 3), (point+point+none+none, -), -)
//! ```
//!
//! `(point+none+none+pair, NE, 4)` means that a landmark with this panorama is a different one known to the map: move it to the
//! corner NE and continue at entry 4. Two further signs cover unexpected views: `-` stands for no landmark that fits the word, and
//! `*` for any panorama unlike all others of the entry. An entry that branches needs no right sign, and without one, `M` is `-`. In
//! a branching map, any entry may end the journey, and each entry except the first must be reachable from the previous one or by a
//! branch.
//!
//! A map may also be written in sentences ([`CustomMap::sentences`]).
//!
//! Case and white space don't matter, and `#` starts a comment. Commas between entries and brackets around all entries are
//! optional. [`CustomMap`] is printed in the same form as it is parsed.

pub mod graph;
mod parse;
mod sentences;
mod words;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::markers::LandmarkKind;
use crate::signature::Signature;

/// Maximum number of entries of a map.
pub const MOST_ENTRIES: usize = 10_000;

/// A map for the navigator. It has at least one entry, and if it has no branches, only its last entry may lack a corner.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Entry>", into = "Vec<Entry>")]
pub struct CustomMap(Vec<Entry>);

/// One line of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// The kind of landmark to seek, or `None` if it may be of any kind.
    pub kind: Option<LandmarkKind>,
    /// The word for the landmark to seek.
    pub word: Descriptor,
    /// The bearing of the landmark from the reference, in degrees clockwise from north, if the map states it.
    pub bearing_deg: Option<u16>,
    /// The direction in which to slide along the line through the reference and the landmark, if the entry has a trajectory.
    pub trajectory: Option<Direction>,
    /// How to verify the attained landmark, if the entry verifies it.
    pub verification: Option<Verification>,
    /// The corner to move the attained landmark to, if there is one.
    pub place: Option<Corner>,
}

/// The direction of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Direction {
    /// From the reference towards the landmark that is seen: `Trajp`.
    Forward,
    /// From the landmark that is seen towards the reference and beyond: `Trajn`.
    Backward,
}

/// A full turn, in degrees. Bearings are less than this.
pub const FULL_TURN_DEG: u16 = 360;
/// Maximum number of clauses of an entry, not counting the one for the right sign.
pub const MOST_WAYS: usize = 8;
/// Maximum difference between two panoramas that are considered similar.
pub(crate) const MOST_DIFFERENCE: u8 = 2;

/// A sign by which a map describes the surroundings of a landmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Sign {
    /// The quadrant occupancy count.
    Count(u8),
    /// The contents of each quadrant, in order.
    Panorama(Signature),
    /// Any view unlike all other signs of the entry: `*`.
    Other,
    /// No landmark that fits the word: `-`.
    Nothing,
}

impl Sign {
    /// Returns the difference between this sign and the view, or `None` if they don't match.
    fn difference(self, seen: Signature) -> Option<u8> {
        match self {
            Self::Count(count) => (count == seen.count()).then_some(0),
            Self::Panorama(own) => Some(own.difference(seen)).filter(|&off| off <= MOST_DIFFERENCE),
            Self::Other => Some(u8::MAX),
            Self::Nothing => None,
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
            Self::Other => write!(f, "*"),
            Self::Nothing => write!(f, "-"),
        }
    }
}

/// The actions for the possible signs of the attained landmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Verification {
    /// The sign of the right landmark, which is optional for an entry that branches.
    expected: Option<Sign>,
    /// The actions for all other signs, sorted by sign.
    ways: [Option<(Sign, Way)>; MOST_WAYS],
}

/// An action for a landmark that is not the right one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Way {
    /// Returns to the right landmark.
    Recover(Recovery),
    /// Continues from this landmark.
    Branch(Branch),
}

/// A branch, which moves the landmark to a corner and continues at another entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Branch {
    /// The corner to move the landmark to.
    pub corner: Corner,
    /// Number of the entry, from 0.
    pub entry: u16,
}

/// A recovery, which moves the wrong landmark to a corner and seeks from there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recovery {
    /// The corner to move the wrong landmark to.
    pub corner: Corner,
    /// The word for the landmark to seek.
    pub word: Descriptor,
}

/// The navigator's response to the surroundings of a landmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response {
    /// Accepts the landmark as right.
    Correct,
    /// Recovers from a wrong landmark.
    Recover(Recovery),
    /// Continues at another entry, because the landmark is a different one known to the map.
    Branch(Branch),
    /// Gives up, because the landmark is wrong and the map has no recovery for it.
    Lost,
}

impl Verification {
    /// Creates a verification that accepts a landmark with the given sign, which is either a count of occupied quadrants from 0 to
    /// 4 or a panorama.
    pub fn new(expected: impl Into<Sign>) -> Result<Self, Error> {
        match expected.into() {
            Sign::Count(count @ 5..) => Err(Error::Parameter {
                what: "quadrant occupancy count",
                expected: "0 to 4",
                found: f64::from(count),
            }),
            expected => Ok(Self { expected: Some(expected), ..Self::default() }),
        }
    }

    /// Adds a recovery for a sign, with the restrictions of [`Verification::leading`].
    pub fn recovering(self, sign: impl Into<Sign>, recovery: Recovery) -> Self {
        self.leading(sign, Way::Recover(recovery))
    }

    /// Adds a branch for a sign, with the restrictions of [`Verification::leading`].
    pub fn branching(self, sign: impl Into<Sign>, branch: Branch) -> Self {
        self.leading(sign, Way::Branch(branch))
    }

    /// Adds what to do for a sign. Ignores the expected sign, counts above 4, and signs beyond [`MOST_WAYS`].
    pub fn leading(mut self, sign: impl Into<Sign>, way: Way) -> Self {
        let sign = sign.into();
        if Some(sign) == self.expected || matches!(sign, Sign::Count(5..)) {
            return self;
        }
        let is_same = |way: &Option<(Sign, Way)>| way.is_none_or(|(other, _)| other == sign);
        let same = self.ways.iter().position(|way| way.is_some() && is_same(way));
        if let Some(place) = same.or_else(|| self.ways.iter().position(is_same)) {
            self.ways[place] = Some((sign, way));
            self.ways.sort_by_key(|way| (way.is_none(), way.map(|(sign, _)| sign)));
        }
        self
    }

    /// Returns the sign of the right landmark, or `None` if the entry only branches.
    pub fn expected(self) -> Option<Sign> {
        self.expected
    }

    /// Returns the response to the surroundings of a landmark, for the sign most similar to them.
    pub fn response(self, seen: Signature) -> Response {
        let right = self.expected.map(|sign| (sign, Response::Correct));
        let ways = self.ways().map(|(sign, way)| (sign, way.into()));
        let all = right.into_iter().chain(ways);
        let agreeing = all.filter_map(|(sign, response)| Some((sign.difference(seen)?, response)));
        let similar = agreeing.min_by_key(|(off, _)| *off).map(|(_, response)| response);
        let says_nothing = self.expected.is_none() && self.accepts();
        similar.unwrap_or(if says_nothing { Response::Correct } else { Response::Lost })
    }

    /// Returns the action if no landmark fits the word, or `None` if the map has none.
    pub fn without_landmark(self) -> Option<Way> {
        self.ways().find(|(sign, _)| *sign == Sign::Nothing).map(|(_, way)| way)
    }

    /// Returns true if the navigator has to look around the landmark, which is unnecessary if the response is the same for
    /// every view.
    pub fn looks_around(self) -> bool {
        let is_seen = |sign: Sign| matches!(sign, Sign::Count(_) | Sign::Panorama(_));
        self.expected.is_some_and(is_seen) || self.ways().any(|(sign, _)| is_seen(sign))
    }

    /// Returns true if some landmark is accepted as right: one with the right sign or, if the only clause is for a missing
    /// landmark, any landmark.
    pub fn accepts(self) -> bool {
        self.expected.is_some() || self.ways().all(|(sign, _)| sign == Sign::Nothing)
    }

    /// Iterates over the clauses for signs other than the right one.
    pub fn ways(self) -> impl Iterator<Item = (Sign, Way)> {
        self.ways.into_iter().flatten()
    }

    /// Iterates over the recoveries with their signs.
    pub fn recoveries(self) -> impl Iterator<Item = (Sign, Recovery)> {
        self.ways().filter_map(|(sign, way)| match way {
            Way::Recover(recovery) => Some((sign, recovery)),
            Way::Branch(_) => None,
        })
    }

    /// Iterates over the branches with their signs.
    pub fn branches(self) -> impl Iterator<Item = (Sign, Branch)> {
        self.ways().filter_map(|(sign, way)| match way {
            Way::Recover(_) => None,
            Way::Branch(branch) => Some((sign, branch)),
        })
    }
}

impl From<Way> for Response {
    fn from(way: Way) -> Self {
        match way {
            Way::Recover(recovery) => Self::Recover(recovery),
            Way::Branch(branch) => Self::Branch(branch),
        }
    }
}

impl Entry {
    /// Returns the landmark to seek, in the notation of custom maps.
    pub fn landmark(&self) -> impl fmt::Display + use<> {
        let Self { kind, word, .. } = *self;
        fmt::from_fn(move |f| match kind {
            Some(kind) => write!(f, "{kind}, {word}"),
            None => write!(f, "{word}"),
        })
    }

    /// Iterates over the words that a navigator has to understand for this entry.
    pub fn words(&self) -> impl Iterator<Item = Descriptor> + use<> {
        let recoveries = self.verification.into_iter().flat_map(Verification::recoveries);
        std::iter::once(self.word).chain(recoveries.map(|(_, recovery)| recovery.word))
    }

    /// Iterates over the numbers of the entries that this entry branches to, from 0.
    pub fn branches(&self) -> impl Iterator<Item = u16> + use<> {
        self.verification.into_iter().flat_map(Verification::branches).map(|(_, branch)| branch.entry)
    }

    /// Returns true if some landmark is accepted as right.
    fn accepts(&self) -> bool {
        self.verification.is_none_or(Verification::accepts)
    }
}

impl CustomMap {
    /// Creates a map from its entries. The first entry needs a landmark other than the reference, branches must lead to existing
    /// entries, and every later entry must be reachable from the previous one or by a branch.
    pub fn new(entries: Vec<Entry>) -> Result<Self, Error> {
        if entries.is_empty() || entries.len() > MOST_ENTRIES {
            return Err(Error::MapLength { limit: MOST_ENTRIES, found: entries.len() });
        }
        let mut is_led_to = vec![false; entries.len()];
        for (number, entry) in (1..).zip(&entries) {
            let is_same = entry.word == Descriptor::Same;
            if is_same && (number == 1 || entry.trajectory.is_some() || entry.kind.is_some()) {
                let expected = match (number, entry.kind) {
                    (_, Some(_)) => "a landmark other than \"Same\", since that is known without its kind",
                    (1, _) => "a landmark other than \"Same\", since there is none before the first",
                    _ => "a landmark other than \"Same\", since a line to slide along needs two",
                };
                return Err(Error::Same { entry: number, expected });
            }
            for to in entry.branches() {
                let all = entries.len();
                *is_led_to.get_mut(usize::from(to)).ok_or(Error::NoEntry {
                    entry: number,
                    found: usize::from(to) + 1,
                    all,
                })? = true;
            }
            if entry.place.is_some() && !entry.accepts() {
                return Err(Error::NothingRight { entry: number });
            }
        }
        for (number, before) in (1..).zip(&entries[..entries.len() - 1]) {
            match before.place {
                None if !is_led_to[number] && before.accepts() => {
                    return Err(Error::NoCorner { entry: number });
                }
                None if !is_led_to[number] => return Err(Error::NotLedTo { entry: number + 1 }),
                _ => {}
            }
        }
        Ok(Self(entries))
    }

    /// Returns true if any entry branches.
    pub fn branches(&self) -> bool {
        self.0.iter().any(|entry| entry.branches().next().is_some())
    }

    /// Returns the entries of the map.
    pub fn entries(&self) -> &[Entry] {
        &self.0
    }

    /// Returns true if the landmark attained by an entry is the intended one, which is always the case if the word of the entry is
    /// `Confusable`.
    pub fn is_right<T: PartialEq>(&self, entry: usize, attained: &T, meant: &T) -> bool {
        let is_confusable = |entry: &Entry| entry.word == Descriptor::Confusable;
        attained == meant || self.0.get(entry).is_some_and(is_confusable)
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
    /// Returns the word in the notation of custom maps.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Forward => "Trajp",
            Self::Backward => "Trajn",
        }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recover(Recovery { corner, word }) => write!(f, "{}, {word}", corner.word()),
            Self::Branch(Branch { corner, entry }) => write!(f, "{}, {}", corner.word(), entry + 1),
        }
    }
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}", self.landmark())?;
        if let Some(bearing_deg) = self.bearing_deg {
            write!(f, ", {bearing_deg:03}")?;
        }
        if let Some(direction) = self.trajectory {
            write!(f, ", {}", direction.word())?;
        }
        if let Some(verification) = self.verification {
            for (sign, way) in verification.ways() {
                write!(f, ", ({sign}, {way})")?;
            }
            if let Some(right) = verification.expected {
                write!(f, ", ({right}, -)")?;
            }
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
