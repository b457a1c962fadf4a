//! Navigation along corridors: the stages of the navigator `corridor` and their building blocks.
//!
//! - [`mission`]: the mission keys of this navigator.
//! - [`sketcher`], [`localizer`], [`planner`]: the stages.
//! - [`messages`]: their messages and channels.
//! - [`lookout`]: the view that a page shows. [`account`]: the summary of a run.
//! - [`rules`]: rule files, which the methods `qtc-b` and `argd` of Patil 2019 and `combined` drive by.
//! - [`perception`]: remembered markers, pairs, relations, and trends from two or more sightings.
//! - [`course`], [`way`]: this project's own method, which finds a way ahead through free space, as observed
//!   by a laser or inferred from markers, and measures the distance covered.
//!
//! This crate does not access clocks, files, channels or maps. Time, messages and configuration are passed as
//! arguments.

pub mod account;
pub mod course;
pub mod derived;
pub mod error;
mod line;
pub mod localizer;
pub mod lookout;
pub mod messages;
pub mod mission;
mod navigator;
pub mod perception;
pub mod planner;
pub mod rules;
pub mod sketcher;
pub mod way;

pub use navigator::NAVIGATOR;
