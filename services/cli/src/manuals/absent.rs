//! Stands in for completions and manual pages in a program that was built without them. All functions return an error that explains
//! how to build it.

use std::path::Path;

use anyhow::anyhow;

use crate::args::Shell;
use crate::failure::{Failure, Outcome};

/// Always returns an error.
pub fn completions(_: Shell) -> Result<Outcome, Failure> {
    missing("completions")
}

/// Always returns an error.
pub fn man(_: &Path) -> Result<Outcome, Failure> {
    missing("manual pages")
}

fn missing(what: &str) -> Result<Outcome, Failure> {
    let advice = "cargo build --features manuals";
    Err(Failure::Input(anyhow!("this program was built without {what}; build it with: {advice}")))
}
