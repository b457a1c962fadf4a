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
}
