//! The simulated physical world: a floor with walls, furniture and people, a round robot that drives
//! on it, and the robot's sensors.
//!
//! [`world::World`] is the whole of it: [`World::step`](world::World::step) advances one laser period
//! and the `fill_…` methods write what the sensors then say straight into messages. It knows no clock
//! and no file; the same description, robot, start, seed and commands give the same bits.
//!
//! - [`description`]: what stands where; made by [`floor_plan`] or [`ros_map`].
//! - [`world`], [`physics`], [`drive`], [`people`]: how it moves.
//! - [`laser`], [`raycast`], [`odometry`]: what the robot measures.
//! - [`robots`]: the robots that ship. [`mission_file`] and [`files`] alone
//!   open files.

pub mod convex;
pub mod description;
pub mod drive;
mod error;
pub mod files;
pub mod floor_plan;
pub mod laser;
pub mod mission_file;
pub mod odometry;
pub mod people;
pub mod physics;
pub mod raster;
pub mod raycast;
pub mod robots;
pub mod ros_map;
pub mod world;

pub use description::WorldDescription;
pub use error::SimError;
pub use world::World;
