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
//! A map may *branch*; this part is ours. A number in place of a word is that of an entry, from 1:
//!
//! ```text
//! (*, SW)
//! (Isol, (point+none+none+pair, NE, 4), (-, SE, 4), (none+point+pair+none, -), SW)
//! (Isol, (*, NE, 4), (point+point+none+none, -), -)
//! (Isol, (none+point+pair+none, SW, 3), (point+point+none+none, -), -)
//! ```
//!
//! `(point+none+none+pair, NE, 4)` says: a landmark with this panorama is another one that the map knows. Move it to the corner NE
//! and go on at entry 4. Two more signs stand for what is not seen: `-` if no landmark is found that the word means, and `*` for
//! every panorama that is like none of the others. An entry that branches needs no right sign; without one it has `-` for `M`. In
//! a map that branches, any entry may end the journey, and each entry but the first is led to by the one before it or by a branch.
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
/// The most clauses of an entry beside that of the right sign.
pub const MOST_WAYS: usize = 8;
/// The greatest difference of a panorama from one that is taken for it.
const MOST_DIFFERENCE: u8 = 2;

/// What is seen around a landmark, as a map has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Sign {
    /// The quadrant occupancy count.
    Count(u8),
    /// What each quadrant holds, in order.
    Panorama(Signature),
    /// Whatever is like none of the other signs of the entry: `*`.
    Other,
    /// There is no landmark that the word means: `-`.
    Nothing,
}

impl Sign {
    /// How far it is from what is seen; none where that is something else.
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

/// What to do for each sign of the landmark that was attained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Verification {
    /// The sign of the right landmark; an entry that branches may have none.
    expected: Option<Sign>,
    /// What to do for other signs, in the order of the signs.
    ways: [Option<(Sign, Way)>; MOST_WAYS],
}

/// What to do with a landmark that is not the right one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Way {
    /// Go back to the right one.
    Recover(Recovery),
    /// Go on from this one.
    Branch(Branch),
}

/// A branch: move the landmark to a corner, and go on at another entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Branch {
    /// The corner.
    pub corner: Corner,
    /// The entry, from 0.
    pub entry: u16,
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
    /// It is another one that the map knows.
    Branch(Branch),
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
            expected => Ok(Self { expected: Some(expected), ..Self::default() }),
        }
    }

    /// Adds a way back for a sign, as [`Verification::leading`] does.
    pub fn recovering(self, sign: impl Into<Sign>, recovery: Recovery) -> Self {
        self.leading(sign, Way::Recover(recovery))
    }

    /// Adds a branch for a sign, as [`Verification::leading`] does.
    pub fn branching(self, sign: impl Into<Sign>, branch: Branch) -> Self {
        self.leading(sign, Way::Branch(branch))
    }

    /// Adds what to do for a sign. The expected sign, counts above 4, and signs beyond [`MOST_WAYS`] have nothing.
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

    /// The sign of the right landmark; none if the entry only branches.
    pub fn expected(self) -> Option<Sign> {
        self.expected
    }

    /// What to do with what is seen around. Of the signs that agree with it, the most similar one counts.
    pub fn response(self, seen: Signature) -> Response {
        let right = self.expected.map(|sign| (sign, Response::Correct));
        let ways = self.ways().map(|(sign, way)| (sign, way.into()));
        let all = right.into_iter().chain(ways);
        let agreeing = all.filter_map(|(sign, response)| Some((sign.difference(seen)?, response)));
        let similar = agreeing.min_by_key(|(off, _)| *off).map(|(_, response)| response);
        let says_nothing = self.expected.is_none() && self.accepts();
        similar.unwrap_or(if says_nothing { Response::Correct } else { Response::Lost })
    }

    /// What to do if there is no landmark that the word means, if the map says it.
    pub fn without_landmark(self) -> Option<Way> {
        self.ways().find(|(sign, _)| *sign == Sign::Nothing).map(|(_, way)| way)
    }

    /// Whether it looks around the landmark. It need not if it says the same of every landmark.
    pub fn looks_around(self) -> bool {
        let is_seen = |sign: Sign| matches!(sign, Sign::Count(_) | Sign::Panorama(_));
        self.expected.is_some_and(is_seen) || self.ways().any(|(sign, _)| is_seen(sign))
    }

    /// Whether it takes some landmark as right: one that has the right sign, or any if it says what to do without one and no more.
    pub fn accepts(self) -> bool {
        self.expected.is_some() || self.ways().all(|(sign, _)| sign == Sign::Nothing)
    }

    /// What to do for other signs than the right one, by these signs.
    pub fn ways(self) -> impl Iterator<Item = (Sign, Way)> {
        self.ways.into_iter().flatten()
    }

    /// The ways back, by their signs.
    pub fn recoveries(self) -> impl Iterator<Item = (Sign, Recovery)> {
        self.ways().filter_map(|(sign, way)| match way {
            Way::Recover(recovery) => Some((sign, recovery)),
            Way::Branch(_) => None,
        })
    }

    /// The branches, by their signs.
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
    /// The words that it needs.
    pub fn words(&self) -> impl Iterator<Item = Descriptor> + use<> {
        let recoveries = self.verification.into_iter().flat_map(Verification::recoveries);
        std::iter::once(self.word).chain(recoveries.map(|(_, recovery)| recovery.word))
    }

    /// The entries to which it branches, from 0.
    pub fn branches(&self) -> impl Iterator<Item = u16> + use<> {
        self.verification.into_iter().flat_map(Verification::branches).map(|(_, branch)| branch.entry)
    }

    /// Whether it takes some landmark as right.
    fn accepts(&self) -> bool {
        self.verification.is_none_or(Verification::accepts)
    }
}

impl CustomMap {
    /// A map of these entries. Each but the first is led to by the one before it or by a branch, and branches lead to entries.
    pub fn new(entries: Vec<Entry>) -> Result<Self, Error> {
        if entries.is_empty() || entries.len() > MOST_ENTRIES {
            return Err(Error::MapLength { limit: MOST_ENTRIES, found: entries.len() });
        }
        let mut is_led_to = vec![false; entries.len()];
        for (number, entry) in (1..).zip(&entries) {
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

    /// Whether it branches.
    pub fn branches(&self) -> bool {
        self.0.iter().any(|entry| entry.branches().next().is_some())
    }

    /// The entries.
    pub fn entries(&self) -> &[Entry] {
        &self.0
    }

    /// For each entry that was finished, whether its landmark is the one that is meant. Of confusable ones each is.
    pub fn agreement<T: PartialEq>(&self, attained: &[T], meant: &[T]) -> impl Iterator<Item = bool> {
        // In a map that branches, entries are not finished in their order.
        let in_order = if self.branches() { &[] } else { &self.0[..] };
        let pairs = (0..).zip(attained.iter().zip(meant));
        let is_confusable = |number: usize| {
            in_order.get(number).is_some_and(|entry: &Entry| entry.word == Descriptor::Confusable)
        };
        pairs.map(move |(number, (attained, meant))| is_confusable(number) || attained == meant)
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
        write!(f, "({}", self.word)?;
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
