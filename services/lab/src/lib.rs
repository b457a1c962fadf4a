//! Evaluates recordings and runs: judges them, draws pictures, builds pages, and drives and judges many runs in experiments.
//!
//! - [`judge`] determines how a mission went and how far its estimates were off.
//! - [`picture`] draws missions as SVG, and [`page`] builds the HTML pages that show the pictures.
//! - [`sections`] builds the parts of a report that are specific to one navigator.
//! - [`experiments`] contains suites of trials, which are driven in one process, judged and counted.
//!
//! This crate does not open shared memory or print. It reads recordings and the files that make up suites,
//! but does not write files.

pub mod error;
pub mod experiments;
pub mod judge;
pub mod page;
pub mod picture;
pub mod sections;

pub use error::EvalError;
