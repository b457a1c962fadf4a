//! The planner: drives the robot to its goals, one task after the other.
//!
//! [`core`] is the service without its process: messages in, messages out.

pub mod core;
