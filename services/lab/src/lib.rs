//! What recordings and runs are worth: judging, pictures, pages; and experiments, which drive and judge many runs.
//!
//! - [`judge`]: how a mission went, and how far its estimates were off.
//! - [`picture`]: what it looked like, as SVG; [`page`]: pages of HTML that show it.
//! - [`sections`]: what a report has of one kind of navigator alone.
//! - [`experiments`]: suites of trials, driven in one process, judged and counted.
//!
//! Never opens shared memory, never prints. Reads recordings and the files that suites are made of, writes none.

pub mod error;
pub mod experiments;
pub mod judge;
pub mod page;
pub mod picture;
pub mod sections;

pub use error::EvalError;
