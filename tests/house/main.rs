//! Checks what the repository says about itself against what it is: rules of the code, pages, generated files.

mod docs;
mod ecosystem;
mod graph;
mod python_package;
mod rules;
