//! Where the maps, logs and drawings lie that are not part of the project.

use std::path::{Path, PathBuf};

/// The folder that `SKETCHNAV_DATA` names, else `../shared/data` beside the checkout. It need not be there.
#[allow(
    clippy::disallowed_methods,
    reason = "some crates get their configuration as arguments; their tests do not"
)]
pub fn folder() -> PathBuf {
    let checkout =
        || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find(|at| at.join("Cargo.lock").is_file());
    let beside = || checkout().unwrap_or(Path::new(".")).join("../shared/data");
    std::env::var_os("SKETCHNAV_DATA").map_or_else(beside, PathBuf::from)
}
