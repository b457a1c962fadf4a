//! Moving a robot, as shared by several navigators: pure functions and state.
//!
//! - [`agenda`]: the framework of a planner: task order, people's orders, time limits, command and status;
//! - [`obstacles`]: what the laser saw around the robot; [`local`]: a path through it;
//! - [`pursuit`]: velocities that follow the path and hit nothing;
//! - [`progress`]: whether the robot is stuck; [`recovery`]: what it does then;
//! - [`weighted_grid`], [`buckets`]: Dijkstra's algorithm on grids.
//!
//! Nothing here uses a clock, a file, a channel or a map. Time, messages and configuration arrive as arguments.

pub mod agenda;
pub mod buckets;
pub mod local;
pub mod obstacles;
pub mod progress;
pub mod pursuit;
pub mod recovery;
pub mod weighted_grid;
