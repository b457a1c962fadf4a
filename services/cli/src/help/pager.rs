//! Shows a long text in the reader's pager, as `man` does.

use std::io::Write;
use std::process::{Command, Stdio};

use sketchnav_schemas::shown::Lines;

/// The pager if the environment variable `PAGER` is not set. With these options, `less` ends immediately if the text fits on the
/// screen.
const PAGER: &str = "less -FRX";

/// Shows a text and waits until the reader closes it. Returns false if the pager cannot be started.
pub fn show(text: &str) -> bool {
    let chosen = std::env::var("PAGER").ok().filter(|pager| !pager.trim().is_empty());
    let chosen = chosen.as_deref().unwrap_or(PAGER);
    let mut words = chosen.split_whitespace();
    let Some(program) = words.next() else { return false };
    let Ok(mut pager) = Command::new(program).args(words).stdin(Stdio::piped()).spawn() else { return false };
    if let Some(mut input) = pager.stdin.take() {
        // A reader may close the pager before the end of the text.
        let _ = writeln!(input, "{}", Lines(text));
    }
    pager.wait().is_ok()
}
