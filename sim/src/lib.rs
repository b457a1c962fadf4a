//! The simulated physical world: a floor with walls, furniture and people, a robot that drives on it, and the robot's sensors.
//!
//! Every simulated world is a [`Simulation`]. [`Floor`] has walls and physics, and [`DotPlane`] is a plane of
//! identical dots. A [`World`] is either of the two, depending on the mission. A simulation does not read
//! clocks or files. The same description, robot, start, seed and commands give bit-identical results.
//!
//! - [`plane`], [`plane_file`]: the plane of dots and its files.
//! - [`description`]: the objects in a world, created by [`floor_plan`] or [`ros_map`].
//! - [`floor`], [`physics`], [`drive`], [`people`]: how everything moves.
//! - [`sensors`], [`raycast`]: the robot's measurements and their times.
//! - [`robots`], [`corridors`], [`offices`]: the robots, corridors and office floors in the repository.
//! - [`mission_file`], [`files`]: the only modules that open files.

pub mod convex;
pub mod corridors;
pub mod description;
pub mod drive;
mod error;
pub mod files;
pub mod floor;
pub mod floor_plan;
pub mod mission_file;
pub mod offices;
pub mod people;
pub mod physics;
pub mod plane;
pub mod plane_file;
pub mod poles;
pub mod raster;
pub mod raycast;
pub mod robots;
pub mod ros_map;
pub mod scenes;
pub mod sensors;
pub mod simulation;
pub mod world;

pub use description::WorldDescription;
pub use error::SimError;
pub use floor::Floor;
pub use plane::DotPlane;
pub use simulation::{Senses, Simulation};
pub use world::World;
