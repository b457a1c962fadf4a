//! The error type for rejected input.

/// Why input was rejected. Each variant gives what was expected and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A word does not name a relation of the calculus.
    #[error("{calculus}: expected one of {expected}, found {found:?}")]
    UnknownRelation {
        /// Identifier of the calculus.
        calculus: &'static str,
        /// The accepted words.
        expected: String,
        /// The rejected word.
        found: String,
    },
    /// A coordinate is not finite, or too large to be squared.
    #[error("{what}: expected a number within ±{limit:e}, found {found}")]
    Coordinate {
        /// Name of the coordinate.
        what: &'static str,
        /// The largest accepted magnitude.
        limit: f64,
        /// The rejected value.
        found: f64,
    },
    /// A region has no extent.
    #[error("{what}: expected an extent above 0, found {found}")]
    Extent {
        /// Name of the side.
        what: &'static str,
        /// Length of the side.
        found: f64,
    },
    /// A parameter is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// The accepted range.
        expected: &'static str,
        /// The rejected value.
        found: f64,
    },
    /// The thresholds do not form a scale of distances.
    #[error("threshold {at}: expected a finite number above {above}, found {found}")]
    Threshold {
        /// Index of the threshold, from 0.
        at: usize,
        /// The preceding threshold, or 0 for the first.
        above: f64,
        /// The rejected threshold.
        found: f64,
    },
    /// A scale has no thresholds, or too many.
    #[error("expected 1 to {limit} thresholds, found {found}")]
    Thresholds {
        /// Maximum number of thresholds.
        limit: usize,
        /// Number of thresholds given.
        found: usize,
    },
    /// A sample is not later than the preceding one.
    #[error("sample {sample}: expected a time after {after_s} s, found {found_s} s")]
    Time {
        /// Index of the sample, from 0.
        sample: usize,
        /// Time of the preceding sample, in seconds.
        after_s: f64,
        /// Time of the rejected sample, in seconds.
        found_s: f64,
    },
    /// A name does not belong to any of the objects.
    #[error("expected one of the objects {expected}, found {found:?}")]
    Object {
        /// The names of all objects.
        expected: String,
        /// The rejected name.
        found: String,
    },
    /// A network does not have such a pair of objects.
    #[error("expected two different objects from 0 to below {objects}, found {first} and {second}")]
    Pair {
        /// Number of objects in the network.
        objects: usize,
        /// The first object.
        first: usize,
        /// The second object.
        second: usize,
    },
}
