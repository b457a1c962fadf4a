//! What several tests need.

#![allow(dead_code, reason = "each test uses a part")]

pub mod carmen;

use std::path::{Path, PathBuf};

/// The folder that `SKETCHNAV_DATA` names, else `../shared/data` beside the checkout. It need not be there.
#[allow(
    clippy::disallowed_methods,
    reason = "the crate gets its configuration as arguments; its tests do not"
)]
pub fn data() -> PathBuf {
    let checkout =
        || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find(|at| at.join("Cargo.lock").is_file());
    let beside = || checkout().unwrap_or(Path::new(".")).join("../shared/data");
    std::env::var_os("SKETCHNAV_DATA").map_or_else(beside, PathBuf::from)
}
