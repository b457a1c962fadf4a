//! How well recordings and runs went: judging, pictures and pages; and experiments, which drive and judge many runs.
//!
//! - [`judge`]: how a mission went, and how far its estimates were off.
//! - [`picture`]: what it looked like, as SVG; [`page`]: pages of HTML that show it.
//! - [`sections`]: the parts of a report that concern one kind of navigator.
//! - [`experiments`]: suites of trials, driven in one process, judged and counted.
//!
//! Never opens shared memory and never prints. Reads recordings and the files that suites consist of, but writes none.

pub mod error;
pub mod experiments;
pub mod judge;
pub mod page;
pub mod picture;
pub mod sections;

pub use error::EvalError;
