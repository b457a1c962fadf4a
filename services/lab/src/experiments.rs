//! Experiments. A [`Suite`] is a list of [`Trial`]s, each of which is driven in a single process, by the same cores that the
//! separate processes run. A trial yields one [`TaskOutcome`] per task, and [`statistics`] summarises them.
//!
//! ```text
//! suites::load → Suite ─jobs::run_all→ TaskOutcomes ─statistics→ table, report
//! ```
//!
//! An experiment that does not drive missions is a [`Study`](studies::Study).
//!
//! The same suite, method and seed yield the same outcomes for any number of threads, because the seed of a trial is derived only
//! from the suite's seed and the trial's name.

pub mod ablation;
pub mod calibration;
pub mod corridor;
pub mod corridor_cost;
pub mod corridor_published;
pub mod cost;
pub mod deformed;
mod drawn_task;
pub mod elsewhere;
pub mod figures;
pub mod ground;
pub mod jobs;
mod joined;
pub mod kidnapped;
pub mod land;
pub mod landmarks;
pub mod learned;
pub mod logistic;
pub mod look_ahead;
pub mod outcome;
pub mod people;
pub mod person;
pub mod protocol;
pub mod report;
pub mod routes;
pub mod run;
pub mod section;
pub mod sensitivity;
pub mod single_drives;
pub mod statistics;
pub mod studies;
pub mod suite;
pub mod suites;
pub mod table;
pub mod trial;
pub mod trial_picture;
mod unmapped;
pub mod unmarked;
pub mod variance;
pub mod witnesses;

pub use outcome::{Kind, TaskOutcome};
pub use suite::Suite;
pub use trial::Trial;
