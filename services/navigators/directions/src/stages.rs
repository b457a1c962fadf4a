//! The stages of the navigator `directions`.
//!
//! - [`mission`] reads the keys of a mission of this kind; [`settings`] derives from its parameters and its robot what the stages
//!   need.
//! - [`sketcher`] is the map-maker, which sees the whole plane as the global camera does ([`survey`]) and writes the custom maps.
//! - [`localizer`] describes what is in view.
//! - [`planner`] is the navigator, which has nothing but the custom map and the description. On land, [`guard`] keeps the robot
//!   away from everything that isn't a landmark.
//! - [`belief`] is the method without a map: what its map-maker and its navigator send and receive.
//! - [`mod@reference`] infers from a journey for which landmark of its map the navigator takes the landmark at hand.
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
