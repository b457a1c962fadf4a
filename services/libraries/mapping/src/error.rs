//! Errors in the input of this crate.

/// An error in the parameters or input of this crate. The message names what is wrong and what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter is out of bounds.
    #[error("parameter {name}: expected {expected}, found {found}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Bounds of the parameter.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// A scan or odometry is invalid.
    #[error("scan: expected {expected}, found {found}")]
    Scan {
        /// What was expected.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// A saved state does not match the parameters.
    #[error("state of a map: expected {expected}, found {found}")]
    State {
        /// What was expected.
        expected: &'static str,
        /// What was given.
        found: String,
    },
}
