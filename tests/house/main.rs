//! Checks that the repository agrees with its own rules, documentation and generated files.

mod docs;
mod ecosystem;
mod graph;
mod python_package;
mod robot_file;
mod rules;
