//! The `sketchnav` program: see the library.

use std::process::ExitCode;

/// Counts what each step allocates, for `health`.
#[global_allocator]
static ALLOCATOR: sketchnav_runtime::CountingAllocator = sketchnav_runtime::CountingAllocator;

fn main() -> ExitCode {
    sketchnav::main()
}
