//! A map of what a robot has seen on its drive, and where places of a drawing lie in it.
//!
//! - [`mapper`]: local mapping. Matches laser scans with the map so far and enters them.
//! - [`occupancy`]: the map: cells that are free, occupied or unknown, of bounded size.
//! - [`matching`]: where a scan fits the map best, within a window around the odometry's guess.
//! - [`grid`]: the map as plain cells.
//! - [`region`], [`survey`], [`outline`]: the free part of the map and its outline; the same for a drawing.
//! - [`alignment`]: which piece of one outline corresponds to which piece of the other.
//! - [`harmonic`]: what follows for places inside.
//!
//! Nothing here uses a clock, a file or a channel, starts a thread or draws a random number. The same scans in the same order
//! give the same bytes.

pub mod alignment;
pub mod error;
pub mod grid;
pub mod harmonic;
pub mod mapper;
pub mod matching;
pub mod occupancy;
pub mod outline;
pub mod parameters;
pub mod region;
pub mod scan;
pub mod survey;

pub use error::Error;
pub use grid::{Cell, CellGrid};
pub use mapper::{Mapper, Outcome};
pub use parameters::Parameters;
pub use scan::Scan;
pub use survey::Survey;

/// The frame of the map: metres, its origin where the robot stood at its first scan, x along its heading then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Map;
