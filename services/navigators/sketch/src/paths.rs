//! Planning in a sketch: from a goal or a drawn route to a velocity.
//!
//! Sources: Boniardi et al. 2015, III-C, and Boniardi et al. 2016, III-A. Two planners work together. The global one,
//! [`cost_field`], knows the whole drawing but nothing of its metric. The local one, [`sketchnav_motion::local`], knows the metres
//! around the robot but nothing of the drawing. [`chart`] joins them: the estimated pose and the two local scales carry a place of
//! the drawing into the odometry frame and back.
//!
//! [`route`] determines where the robot is on a drawn route; [`parameters`] has everything that can be tuned.
//!
//! Nothing here knows of tasks, messages, time limits or recovery, which belong to [`planner`](crate::planner). No step allocates
//! once the structures are built.

pub mod chart;
pub mod cost_field;
pub mod parameters;
pub mod route;
