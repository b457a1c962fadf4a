//! Checks that the repository is what it says about itself: the rules of the code, the documentation, and generated
//! files.

mod docs;
mod ecosystem;
mod graph;
mod python_package;
mod rules;
