//! What can be wrong with input.

/// Why input was rejected. Each variant says what was expected and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A word that names no relation of the calculus.
    #[error("{calculus}: expected one of {expected}, found {found:?}")]
    UnknownRelation {
        /// The calculus, by its identifier.
        calculus: &'static str,
        /// The notation that is accepted.
        expected: String,
        /// The word.
        found: String,
    },
    /// A coordinate that is not finite, or too large to be squared.
    #[error("{what}: expected a number within ±{limit:e}, found {found}")]
    Coordinate {
        /// Which coordinate.
        what: &'static str,
        /// The largest magnitude that is accepted.
        limit: f64,
        /// The number.
        found: f64,
    },
    /// A region without extent.
    #[error("{what}: expected an extent above 0, found {found}")]
    Extent {
        /// Which side.
        what: &'static str,
        /// Its length.
        found: f64,
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
    /// Thresholds that do not make a scale of distances.
    #[error("threshold {at}: expected a finite number above {above}, found {found}")]
    Threshold {
        /// Its place, from 0.
        at: usize,
        /// The threshold before it, or 0.
        above: f64,
        /// The threshold.
        found: f64,
    },
    /// A scale without thresholds, or with too many.
    #[error("expected 1 to {limit} thresholds, found {found}")]
    Thresholds {
        /// The greatest number of thresholds.
        limit: usize,
        /// How many there are.
        found: usize,
    },
    /// A sample that is not later than the one before.
    #[error("sample {sample}: expected a time after {after_s} s, found {found_s} s")]
    Time {
        /// The sample's number, from 0.
        sample: usize,
        /// The time of the sample before, in seconds.
        after_s: f64,
        /// Its own time, in seconds.
        found_s: f64,
    },
    /// A name that no object has.
    #[error("expected one of the objects {expected}, found {found:?}")]
    Object {
        /// The names of all objects.
        expected: String,
        /// The name.
        found: String,
    },
}
