//! Motion planning and control shared by several navigators, as pure functions and plain state.
//!
//! - [`agenda`]: the framework of a planner, which covers the order of tasks, orders from people, time
//!   limits, the command and the status.
//! - [`obstacles`]: the obstacles that the laser saw around the robot, and [`local`]: a path between them.
//! - [`pursuit`]: velocities that follow the path without hitting anything.
//! - [`progress`]: detects that the robot is stuck, and [`recovery`]: frees a stuck robot.
//! - [`weighted_grid`], [`buckets`]: Dijkstra's algorithm on grids.
//!
//! This crate does not access clocks, files, channels or maps. Time, messages and configuration are passed as
//! arguments.

pub mod agenda;
pub mod buckets;
pub mod local;
pub mod obstacles;
pub mod progress;
pub mod pursuit;
pub mod recovery;
pub mod weighted_grid;
