//! Navigation along corridors: the stages of the navigator `corridor`, and what they stand on.
//!
//! - [`mission`]: the keys of a mission of this kind;
//! - [`sketcher`], [`localizer`], [`planner`]: the stages;
//! - [`rules`]: rule files; the methods `qtc-b` and `argd` of Patil 2019 and `combined` drive by them;
//! - [`perception`]: markers in memory, pairs, relations;
//! - [`course`], [`way`]: this project's own method: the way on through free space, seen by laser or known by markers, and its
//!   length.
//!
//! Nothing here knows a clock, a file, a channel or a map. Time, messages and configuration arrive as arguments.

pub mod course;
pub mod error;
pub mod localizer;
pub mod mission;
pub mod perception;
pub mod planner;
pub mod rules;
pub mod sketcher;
pub mod way;
