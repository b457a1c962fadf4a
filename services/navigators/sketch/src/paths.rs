//! Planning in a sketch, from a goal or a drawn route down to a local path.
//!
//! Planning follows Boniardi et al. 2015, III-C, and Boniardi et al. 2016, III-A, and combines two planners. The global planner,
//! [`cost_field`], uses the whole drawing but no metric, while the local planner, [`sketchnav_motion::local`], works in metres
//! around the robot without the drawing. [`chart`] connects the two by converting places in the drawing to the odometry frame and
//! back, using the estimated pose and the two local scales.
//!
//! [`route`] tracks the robot's progress on a drawn route, and [`parameters`] contains everything that can be tuned.
//!
//! Tasks, time limits and recovery are left to [`planner`](crate::planner). Once the structures are built, no step allocates.

pub mod chart;
pub mod cost_field;
pub mod parameters;
pub mod route;
