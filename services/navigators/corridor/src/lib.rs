//! Navigation along corridors: the stages of the navigator `corridor`, and the parts they are built from.
//!
//! - [`mission`]: the mission keys of this navigator;
//! - [`sketcher`], [`localizer`], [`planner`]: the stages;
//! - [`messages`]: their messages and channels;
//! - [`lookout`]: how a page shows them; [`account`]: the summary of a run;
//! - [`rules`]: rule files; the methods `qtc-b` and `argd` of Patil 2019 and `combined` drive by them;
//! - [`perception`]: markers in memory, pairs, relations, and trends from two sightings or from many;
//! - [`course`], [`way`]: this project's own method: a way ahead through free space, observed by laser or inferred from
//!   markers, and the distance covered.
//!
//! Nothing here knows about clocks, files, channels or maps. Time, messages and configuration arrive as arguments.

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
