//! The stages of the navigator `directions`.
//!
//! - [`mission`] reads the keys of a mission of this kind. [`settings`] derives what the stages need from the
//!   mission's parameters and robot.
//! - [`sketcher`] is the map-maker, which sees the whole plane as the global camera does ([`survey`]) and
//!   writes the custom maps.
//! - [`localizer`] describes the view.
//! - [`planner`] is the navigator, which receives only the custom map and the description. On land, [`guard`] keeps the robot away
//!   from everything that isn't a landmark.
//! - [`belief`] is the method without a map: the messages of its map-maker and its navigator.
//! - [`mod@reference`] infers from a journey which landmark of the map the navigator believes it is at.
//! - [`lookout`] draws a journey for the page, and [`account`] reports on a run.
//!
//! The messages of the stages are in [`messages`](crate::messages).

pub mod account;
pub mod belief;
pub mod error;
pub mod guard;
pub mod localizer;
pub mod lookout;
pub mod mission;
mod navigator;
pub mod planner;
pub mod reference;
pub mod settings;
pub mod sketcher;
pub mod survey;

pub use error::DirectionsError;
pub use navigator::NAVIGATOR;
