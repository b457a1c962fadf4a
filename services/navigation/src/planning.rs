//! Planning in a sketch: from a goal or a drawn route to a velocity.
//!
//! Sources: Boniardi et al. 2015 (paper 001), III-C, and Boniardi et al. 2016 (paper 004), III-A.
//! Two planners work together. The global one, [`cost_field`], knows the whole drawing and nothing
//! of its metric; the local one, [`local`], knows the metres around the robot and nothing of the
//! drawing. [`chart`] joins them: the estimated pose and the two local scales carry a place of the
//! drawing into the odometry frame and back.
//!
//! - [`weighted_grid`]: Dijkstra's algorithm, once, for both planners; [`buckets`]: its queue;
//! - [`obstacles`]: what the laser saw lately; [`route`]: where the robot is on a drawn route;
//! - [`pursuit`]: the velocity that follows a local path; [`parameters`]: all that can be tuned.
//!
//! Nothing here knows of tasks, messages other than the laser scan, time limits or recovery: those
//! are the planner service's. No step allocates once the structures are built.

pub mod buckets;
pub mod chart;
pub mod cost_field;
pub mod local;
pub mod obstacles;
pub mod parameters;
pub mod pursuit;
pub mod route;
pub mod weighted_grid;
