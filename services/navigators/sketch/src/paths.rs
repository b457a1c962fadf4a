//! Planning in a sketch, from a goal or a drawn route down to a local path.
//!
//! The sources are Boniardi et al. 2015, III-C, and Boniardi et al. 2016, III-A. Two planners work together. The global planner,
//! [`cost_field`], uses the whole drawing but not its metric. The local planner, [`sketchnav_motion::local`], uses metres around
//! the robot but not the drawing. [`chart`] connects the two: using the estimated pose and the two local scales, it converts places
//! in the drawing to the odometry frame and back.
//!
//! [`route`] determines where the robot is on a drawn route, and [`parameters`] contains everything that can
//! be tuned.
//!
//! Tasks, time limits and recovery are left to [`planner`](crate::planner). No step allocates once the
//! structures are built.

pub mod chart;
pub mod cost_field;
pub mod parameters;
pub mod route;
