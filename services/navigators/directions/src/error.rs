//! Errors in the input of this crate.

use crate::markers::LandmarkKind;

/// The reason why input was rejected. The message of each variant says what was expected and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The plane has no dots.
    #[error("expected at least one dot, found none")]
    NoDots,
    /// There are more dots than a 32-bit index can address.
    #[error("expected at most {limit} dots, found {found}")]
    TooManyDots {
        /// Maximum number of dots.
        limit: usize,
        /// Number of dots found.
        found: usize,
    },
    /// A coordinate is not finite, or is too large to be squared.
    #[error("dot {dot}: expected coordinates within ±{limit:e}, found ({x}, {y})")]
    Coordinate {
        /// Number of the dot, from 0.
        dot: usize,
        /// The dot's x coordinate.
        x: f64,
        /// The dot's y coordinate.
        y: f64,
        /// Maximum magnitude of a coordinate.
        limit: f64,
    },
    /// Two dots have the same position.
    #[error("dots {first} and {second}: expected different places, found both at ({x}, {y})")]
    SamePlace {
        /// Number of the first dot, from 0.
        first: usize,
        /// Number of the second dot, from 0.
        second: usize,
        /// The x coordinate of both dots.
        x: f64,
        /// The y coordinate of both dots.
        y: f64,
    },
    /// A parameter is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// Description of the valid range.
        expected: &'static str,
        /// The invalid value.
        found: f64,
    },
    /// The plane has no dot with this number.
    #[error("dot {dot}: expected a number below {dots}")]
    UnknownDot {
        /// The unknown number.
        dot: u32,
        /// Number of dots of the plane.
        dots: usize,
    },
    /// A map has no entries, or too many.
    #[error("expected a map of 1 to {limit} entries, found {found}")]
    MapLength {
        /// Maximum number of entries.
        limit: usize,
        /// Number of entries found.
        found: usize,
    },
    /// An entry has no corner for its landmark, although only that entry leads to the next one.
    #[error("entry {entry}: expected a corner, since other entries follow")]
    NoCorner {
        /// Number of the entry, from 1.
        entry: usize,
    },
    /// An entry has a corner for the right landmark although it accepts no landmark as right.
    #[error("entry {entry}: expected \"-\" at its end, since none of its signs is the right one")]
    NothingRight {
        /// Number of the entry, from 1.
        entry: usize,
    },
    /// An entry refers to its reference although it has none, or needs a second landmark.
    #[error("entry {entry}: expected {expected}")]
    Same {
        /// Number of the entry, from 1.
        entry: usize,
        /// What the entry needs.
        expected: &'static str,
    },
    /// A branch leads to an entry that the map doesn't have.
    #[error("entry {entry}: expected a branch to one of the {all} entries, found {found}")]
    NoEntry {
        /// Number of the entry with the branch, from 1.
        entry: usize,
        /// Number of the missing entry, from 1.
        found: usize,
        /// Number of entries of the map.
        all: usize,
    },
    /// No other entry leads to this entry, so it would never be read.
    #[error("entry {entry}: expected the entry before it or a branch to lead to it, found none that does")]
    NotLedTo {
        /// Number of the entry, from 1.
        entry: usize,
    },
    /// A map violates the grammar.
    #[error("line {line}, column {column}: expected {expected}, found {found}")]
    Map {
        /// Line number, from 1.
        line: usize,
        /// Column number in characters, from 1.
        column: usize,
        /// The words and symbols that the grammar allows at this position.
        expected: &'static str,
        /// The word found there instead.
        found: String,
    },
    /// A map uses a word that the navigator doesn't understand.
    #[error("entry {entry}: expected a word that the navigator understands, found {word:?}")]
    Vocabulary {
        /// Number of the entry, from 1.
        entry: usize,
        /// The unknown word.
        word: &'static str,
    },
    /// A map names a kind of landmark that no marker stands for.
    #[error("entry {entry}: expected a kind that the mission has markers for ({known}), found {found:?}")]
    UnknownKind {
        /// Number of the entry, from 1.
        entry: usize,
        /// The kinds with markers.
        known: String,
        /// The kind.
        found: String,
    },
    /// A word is not the name of a kind of landmark.
    #[error(
        "expected a kind: a word of at most 16 of a to z, 0 to 9 and -, which no map uses otherwise, found {found:?}"
    )]
    NoKind {
        /// The word.
        found: String,
    },
    /// A landmark has markers of two kinds.
    #[error("landmark at ({x}, {y}): expected markers of one kind, found {first} and {second}")]
    TwoKinds {
        /// The x coordinate of the landmark.
        x: f64,
        /// The y coordinate of the landmark.
        y: f64,
        /// One kind.
        first: LandmarkKind,
        /// Another kind.
        second: LandmarkKind,
    },
    /// The window shows no dot at the start.
    #[error("start ({x}, {y}): expected a landmark in view, found none")]
    NothingInView {
        /// The x coordinate of the window's centre.
        x: f64,
        /// The y coordinate of the window's centre.
        y: f64,
    },
    /// There is no dot near the goal.
    #[error("goal ({x}, {y}): expected a dot within a window around it, found none")]
    NoGoal {
        /// The goal's x coordinate.
        x: f64,
        /// The goal's y coordinate.
        y: f64,
    },
    /// No path leads to the goal.
    #[error(
        "no path from dot {start} to dot {goal}: {reached} dots are reached from the start, {reaching} reach the goal. \
         A path would have to lead from dot {from} to dot {to}, {why}"
    )]
    Unreachable {
        /// The start landmark.
        start: u32,
        /// The goal landmark.
        goal: u32,
        /// Number of dots that can be reached from the start, including the start itself.
        reached: usize,
        /// Number of dots from which the goal can be reached, including the goal itself.
        reaching: usize,
        /// The dot reached from the start that is closest to one from which the goal can be reached.
        from: u32,
        /// The dot from which the goal can be reached that is closest to `from`.
        to: u32,
        /// The reason why no transition leads from `from` to `to`.
        why: Barrier,
    },
}

/// An obstacle to a transition from one landmark to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Barrier {
    /// A wall stands between the landmarks.
    Wall {
        /// Distance between the landmarks, in the plane's unit.
        gap: f64,
    },
    /// The landmarks are too far apart to be seen together.
    Far {
        /// Distance between the landmarks, in the plane's unit.
        gap: f64,
        /// Maximum distance at which two landmarks are seen together, in the plane's unit.
        reach: f64,
    },
    /// The gap between the landmarks is too narrow for the robot to drive through.
    Narrow {
        /// Distance between the landmarks, in the plane's unit.
        gap: f64,
    },
    /// There is no word for the second landmark as seen from the first.
    Word {
        /// Distance between the landmarks, in the plane's unit.
        gap: f64,
    },
    /// Both are the same landmark, and the robot can't drive from one side of it to another.
    Around,
}

impl std::fmt::Display for Barrier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Wall { gap } => write!(f, "{gap:.3} apart with a wall between them"),
            Self::Far { gap, reach } => {
                write!(f, "{gap:.3} apart, and two are seen together up to {reach:.3}")
            }
            Self::Narrow { gap } => write!(f, "{gap:.3} apart, and walls leave too little room between them"),
            Self::Word { gap } => write!(f, "{gap:.3} apart, which no word means from there"),
            Self::Around => write!(f, "from one side of it to another, where walls leave too little room"),
        }
    }
}
