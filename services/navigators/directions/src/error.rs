//! What can be wrong with input.

/// Why input was rejected. Each variant says what was expected and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A plane without a dot.
    #[error("expected at least one dot, found none")]
    NoDots,
    /// More dots than an index of 32 bits holds.
    #[error("expected at most {limit} dots, found {found}")]
    TooManyDots {
        /// The greatest number of dots.
        limit: usize,
        /// How many there are.
        found: usize,
    },
    /// A coordinate that is not finite, or too large to be squared.
    #[error("dot {dot}: expected coordinates within ±{limit:e}, found ({x}, {y})")]
    Coordinate {
        /// Its number, from 0.
        dot: usize,
        /// Its x.
        x: f64,
        /// Its y.
        y: f64,
        /// The largest magnitude that is accepted.
        limit: f64,
    },
    /// Two dots in one place.
    #[error("dots {first} and {second}: expected different places, found both at ({x}, {y})")]
    SamePlace {
        /// The number of the first, from 0.
        first: usize,
        /// The number of the second.
        second: usize,
        /// Their x.
        x: f64,
        /// Their y.
        y: f64,
    },
    /// A parameter out of its range.
    #[error("{what}: expected {expected}, found {found}")]
    Parameter {
        /// Which parameter.
        what: &'static str,
        /// Its range.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A dot that the plane lacks.
    #[error("dot {dot}: expected a number below {dots}")]
    UnknownDot {
        /// The number.
        dot: u32,
        /// How many dots there are.
        dots: usize,
    },
    /// A map without entries, or with too many.
    #[error("expected a map of 1 to {limit} entries, found {found}")]
    MapLength {
        /// The greatest number of entries.
        limit: usize,
        /// How many there are.
        found: usize,
    },
    /// An entry within a map that does not say where its landmark goes.
    #[error("entry {entry}: expected a corner, since other entries follow")]
    NoCorner {
        /// Its number, from 1.
        entry: usize,
    },
    /// An entry that takes no landmark as right and yet says where the right one goes.
    #[error("entry {entry}: expected \"-\" at its end, since none of its signs is the right one")]
    NothingRight {
        /// Its number, from 1.
        entry: usize,
    },
    /// A branch that leads out of the map.
    #[error("entry {entry}: expected a branch to one of the {all} entries, found {found}")]
    NoEntry {
        /// The number of the entry that branches, from 1.
        entry: usize,
        /// Where it leads, from 1.
        found: usize,
        /// How many entries there are.
        all: usize,
    },
    /// An entry that is never read.
    #[error("entry {entry}: expected the entry before it or a branch to lead to it, found none that does")]
    NotLedTo {
        /// Its number, from 1.
        entry: usize,
    },
    /// A map that breaks the grammar.
    #[error("line {line}, column {column}: expected {expected}, found {found}")]
    Map {
        /// The line, from 1.
        line: usize,
        /// The column in characters, from 1.
        column: usize,
        /// What should stand there.
        expected: &'static str,
        /// The word that stands there.
        found: String,
    },
    /// A map with a word that the navigator does not understand.
    #[error("entry {entry}: expected a word that the navigator understands, found {word:?}")]
    Vocabulary {
        /// The entry's number, from 1.
        entry: usize,
        /// The word.
        word: &'static str,
    },
    /// A start where the window shows no dot.
    #[error("start ({x}, {y}): expected a landmark in view, found none")]
    NothingInView {
        /// The window's centre.
        x: f64,
        /// The window's centre.
        y: f64,
    },
    /// A goal with no dot near it.
    #[error("goal ({x}, {y}): expected a dot within a window around it, found none")]
    NoGoal {
        /// The place.
        x: f64,
        /// The place.
        y: f64,
    },
    /// A goal to which no path leads.
    #[error(
        "no path from dot {start} to dot {goal}: {reached} dots are reached from the start, {reaching} reach the goal. \
         A path would have to lead from dot {from} to dot {to}, {why}"
    )]
    Unreachable {
        /// The landmark at the start.
        start: u32,
        /// The goal.
        goal: u32,
        /// How many dots are reached from the start, itself included.
        reached: usize,
        /// How many dots reach the goal, itself included.
        reaching: usize,
        /// The dot reached that is the closest to one that reaches the goal.
        from: u32,
        /// That one.
        to: u32,
        /// What bars the way between them.
        why: Barrier,
    },
}

/// What bars the way from a landmark to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Barrier {
    /// A wall stands between them.
    Wall {
        /// Their distance.
        gap: f64,
    },
    /// They are too far apart to be seen together.
    Far {
        /// Their distance.
        gap: f64,
        /// How far apart two can be.
        reach: f64,
    },
    /// The way between them is too narrow for the robot.
    Narrow {
        /// Their distance.
        gap: f64,
    },
    /// No word means the second one from the first.
    Word {
        /// Their distance.
        gap: f64,
    },
    /// Both are one, and no way leads from one side of it to another.
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
