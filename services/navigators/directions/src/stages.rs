//! The stages of the navigator `directions`.
//!
//! - [`mission`]: the keys of a mission of this kind;
//! - [`sketcher`]: the map-maker. It sees the whole plane as the global camera does, and writes the custom maps;
//! - [`localizer`]: describes what is in view;
//! - [`planner`]: the navigator. It has the custom map and the description, and nothing else.

pub mod error;
pub mod localizer;
pub mod mission;
pub mod planner;
pub mod sketcher;

pub use error::DirectionsError;
