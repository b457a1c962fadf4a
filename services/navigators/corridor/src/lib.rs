//! Navigation along corridors: the stages of the navigator `corridor`, and what they stand on.
//!
//! - [`mission`]: the keys of a mission of this kind;
//! - [`sketcher`], [`localizer`], [`planner`]: the stages;
//! - [`messages`]: what they say, and on which channels;
//! - [`lookout`]: what a page shows of them; [`account`]: what is said of a run;
//! - [`rules`]: rule files; the methods `qtc-b` and `argd` of Patil 2019 and `combined` drive by them;
//! - [`perception`]: markers in memory, pairs, relations, the trends of one sighting or of many;
//! - [`course`], [`way`]: this project's own method: the way on through free space, seen by laser or known by markers, and its
//!   length.
//!
//! Nothing here knows a clock, a file, a channel or a map. Time, messages and configuration arrive as arguments.

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
