//! Tests of the planner with a kinematic robot, with a perfect estimate, in small buildings.

mod asking;
mod driving;
mod exploring;
mod finding;
mod frugal;
mod naming;
mod pad;
mod support;
