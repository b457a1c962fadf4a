//! Builds a map from a robot's laser scans during a drive, and locates points of a drawing in that map.
//!
//! - [`mapper`]: local mapping, which matches each laser scan with the map so far and then adds it.
//! - [`occupancy`]: the map itself, with a bounded number of cells that are free, occupied or unknown.
//! - [`matching`]: finds the best-fitting pose of a scan in the map, within a window around the odometry's guess.
//! - [`grid`]: the map as a rectangular grid of cells.
//! - [`region`], [`survey`], [`outline`]: the free space in a map or a drawing, and its outline.
//! - [`alignment`]: finds the corresponding pieces of two outlines.
//! - [`registration`]: finds the motion between two maps of the same place.
//! - [`kidnapping`]: notices that somebody has carried the robot.
//! - [`harmonic`]: extends the correspondence of two outlines to their interiors.
//!
//! This crate does not access clocks, files or channels, start threads, or draw random numbers, so the same
//! scans in the same order always produce the same bytes.

pub mod alignment;
pub mod error;
pub mod grid;
pub mod harmonic;
pub mod kidnapping;
pub mod mapper;
pub mod matching;
pub mod occupancy;
pub mod outline;
pub mod parameters;
pub mod region;
pub mod registration;
pub mod scan;
pub mod survey;

pub use error::Error;
pub use grid::{Cell, CellGrid};
pub use kidnapping::KidnapDetector;
pub use mapper::{Mapper, Outcome};
pub use parameters::Parameters;
pub use scan::Scan;
pub use survey::Survey;

/// The frame of the map, in metres. Its origin is the robot's position at the first scan, and its x axis points along the robot's
/// heading there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Map;
