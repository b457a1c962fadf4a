//! Navigation by landmark states along a sketched route (Chronis 2007): pure functions.
//!
//! A person draws objects and a route. [`extraction`] turns the drawing into a [`route::Route`]: a list of landmark
//! states, each with a command.

pub mod belief;
pub mod control;
pub mod error;
pub mod extraction;
pub mod follower;
pub mod guide;
pub mod language;
pub mod lost;
pub mod matching;
pub mod memory;
pub mod outlines;
pub mod perception;
pub mod plane;
pub mod route;
pub mod sketch;

pub use error::Error;
