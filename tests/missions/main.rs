//! Missions of every kind, driven by whole process trees.

mod allocation;
mod corridor;
mod determinism;
mod directions;
mod driver;
mod eval;
mod landmarks;
mod learned;
mod outline;
mod python;
mod python_driver;
mod shipped;
mod side_by_side;
mod simulators;
mod stranger;
mod surveyed;
