//! What tests say and do where something is missing that not every machine has.

use std::fmt::Display;
use std::io::Write;

/// Names what may have to be there: words separated by commas, or `1` for all of them.
const ALL_TESTS: &str = "SKETCHNAV_ALL_TESTS";

/// Says that a test, or a part of it, does nothing without `what`; `kind` is the word of that.
///
/// The test passes then, and a harness hides what passing tests print; so this goes past it. Where
/// `SKETCHNAV_ALL_TESTS` has `kind` in it, or is `1`, the test fails instead.
#[allow(
    clippy::disallowed_methods,
    reason = "some crates get their configuration as arguments; their tests do not"
)]
pub fn skipped(kind: &str, what: impl Display) {
    let asked = std::env::var(ALL_TESTS).unwrap_or_default();
    let is_asked_for = asked.split(',').any(|word| word == kind || word == "1");
    assert!(!is_asked_for, "{what}, and {ALL_TESTS}={asked} asks for {kind}");
    let name = std::thread::current().name().unwrap_or_default().to_owned();
    // Nobody misses the notice where there is no standard error.
    let _ = writeln!(std::io::stderr(), "skipped: {name}: {what} ({kind})");
}
