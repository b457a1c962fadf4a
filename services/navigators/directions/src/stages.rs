//! The stages of the navigator `directions`.
//!
//! - [`mission`]: the keys of a mission of this kind;
//! - [`sketcher`]: the map-maker. It sees the whole plane as the global camera does, and writes the custom maps;
//! - [`localizer`]: describes what is in view;
//! - [`planner`]: the navigator. It has the custom map and the description, and nothing else; on land a [`guard`] keeps it from
//!   what is no landmark;
//! - [`lookout`]: what a page shows of them; [`account`]: what is said of a run. What they say: [`messages`](crate::messages).

pub mod account;
pub mod error;
pub mod guard;
pub mod localizer;
pub mod lookout;
pub mod mission;
mod navigator;
pub mod planner;
pub mod sketcher;

pub use error::DirectionsError;
pub use navigator::NAVIGATOR;
