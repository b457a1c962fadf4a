//! The `sketchnav` program. See the library of the same name for the documentation.

use std::process::ExitCode;

/// Counts the allocations of each step for `health`.
#[global_allocator]
static ALLOCATOR: sketchnav_runtime::CountingAllocator = sketchnav_runtime::CountingAllocator;

fn main() -> ExitCode {
    sketchnav::main()
}
