//! The simulated physical world: a floor with walls, furniture and people, a round robot that drives
//! on it, and the robot's sensors.
//!
//! Every simulated world is a [`Simulation`]. [`Floor`] is the one with walls and physics, [`DotPlane`] the one of identical
//! dots; a [`World`] is either, depending on the mission. A simulation uses no clock and no file; the same description, robot,
//! start, seed and commands give the same bits.
//!
//! - [`plane`], [`plane_file`]: the plane of dots, and its files;
//! - [`description`]: what stands where; made by [`floor_plan`] or [`ros_map`].
//! - [`floor`], [`physics`], [`drive`], [`people`]: how it moves.
//! - [`sensors`], [`raycast`]: what the robot measures, and when.
//! - [`robots`], [`corridors`]: the robots and the corridors that ship. Only [`mission_file`] and [`files`] open files.

pub mod convex;
pub mod corridors;
pub mod description;
pub mod drive;
mod error;
pub mod files;
pub mod floor;
pub mod floor_plan;
pub mod mission_file;
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
