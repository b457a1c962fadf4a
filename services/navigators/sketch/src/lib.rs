//! Navigation in drawings (Boniardi et al. 2015, 2016): the stages of the navigator `sketch` and their
//! building blocks.
//!
//! - [`sketcher`], [`localizer`], [`planner`]: the stages.
//! - [`messages`]: their messages and channels. [`mission`], [`method`]: the keys of a mission of this kind.
//! - [`lookout`], [`drawn`]: the page's view of a drive, and drawings made on the page. [`account`]: the
//!   charts of a report.
//! - [`learned`]: what is learned on a drive, and how the next one starts from it.
//! - [`reading`]: turns a picture or strokes into a map and places the start and the tasks in it.
//! - [`filter`]: Monte Carlo localization of the pose and two local scales in that map.
//! - [`rooms`]: locates a goal by regions that are connected by doors.
//! - [`paths`]: paths through the map and along drawn routes.
//!
//! This crate does not access clocks, files or channels, and does not start threads. Time, randomness,
//! configuration and worker threads are passed as arguments.

pub mod account;
pub mod derived;
pub mod drawn;
pub mod filter;
pub mod learned;
pub mod localizer;
pub mod lookout;
pub mod messages;
pub mod method;
pub mod mission;
mod navigator;
pub mod paths;
pub mod planner;
pub mod reading;
pub mod rooms;
pub mod sketch;
pub mod sketcher;
pub mod task;

pub use navigator::NAVIGATOR;
