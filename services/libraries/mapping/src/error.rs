//! What can be wrong with the input of this crate.

/// Invalid parameters or input; each names the place and what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter out of its bounds.
    #[error("parameter {name}: expected {expected}, found {found}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// Its bounds.
        expected: &'static str,
        /// What was given.
        found: f64,
    },
    /// A scan that no laser could send.
    #[error("scan: expected {expected}, found {found}")]
    Scan {
        /// What was expected.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// A saved state that does not belong to these parameters.
    #[error("state of a map: expected {expected}, found {found}")]
    State {
        /// What was expected.
        expected: &'static str,
        /// What was given.
        found: String,
    },
}
