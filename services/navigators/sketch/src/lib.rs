//! Navigation in drawings (Boniardi et al. 2015, 2016): the stages of the navigator `sketch`, and what they stand on.
//!
//! - [`sketcher`], [`localizer`], [`planner`]: the stages;
//! - [`reading`]: from a picture or strokes to a map, with the start and the tasks placed in it;
//! - [`localization`]: Monte Carlo localization of the pose and two local scales in that map;
//! - [`planning`]: a way through the map, and along drawn routes.
//!
//! Nothing here knows a clock, a file or a channel, or starts a thread. Time, randomness, configuration and helpers
//! for the work arrive as arguments.

pub mod localization;
pub mod localizer;
pub mod planner;
pub mod planning;
pub mod reading;
pub mod sketch;
pub mod sketcher;
pub mod task;
