//! Things that tests need but that not every machine has: programs, Python modules, and data that is not part of the
//! project.
//!
//! Tests request anything they need from this crate. If that is missing, the test prints a notice and passes, or fails if
//! `SKETCHNAV_ALL_TESTS` requires it. No test may call a program in any other way (see `tests/house/rules.rs`), so [`PROGRAMS`] is
//! the complete list of programs that a machine may lack.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The environment variable that names what must not be missing: words separated by commas, or `1` for everything.
const ALL_TESTS: &str = "SKETCHNAV_ALL_TESTS";

/// The external programs that the tests and the commands in the documentation call. The Rust toolchain, `cc` and the
/// coreutils are not listed, since nothing can be built without them.
pub const PROGRAMS: [&str; 18] = [
    "bash",     // runs the commands of the pages
    "g++",      // compiles the C++ header
    "ip",       // network namespaces: two hosts on one machine
    "kill",     // signals a process, as a person does
    "man",      // reads the manual pages
    "mount",    // a separate disk for a test
    "node",     // the pad's modules, the browser's driver, Foxglove's packages
    "prlimit",  // limits a running process
    "promtool", // checks what Prometheus would read
    "python3",  // other people's readers of recordings
    "sed",      // in scripts
    "setpriv",  // another user
    "setsid",   // a separate terminal
    "sh",       // scripts, limits
    "umount",   // the other half of `mount`
    "unshare",  // separate shared memory and disks for a test
    "chromium", // the pad's page
    "git",      // the commit that was driven
];

/// The coreutils that the tests and the commands in the documentation call.
pub const COREUTILS: [&str; 3] = ["mkdir", "printf", "sleep"];

/// Prints a notice that the current test, or a part of it, was skipped for lack of `what`. `kind` is the word with
/// which `SKETCHNAV_ALL_TESTS` requires it.
///
/// # Panics
/// Panics if `SKETCHNAV_ALL_TESTS` requires it.
pub fn skipped(kind: &str, what: impl Display) {
    let asked = std::env::var(ALL_TESTS).unwrap_or_default();
    let is_asked_for = asked.split(',').any(|word| word == kind || word == "1");
    assert!(!is_asked_for, "{what}, and {ALL_TESTS}={asked} asks for {kind}");
    let name = std::thread::current().name().unwrap_or_default().to_owned();
    // A test harness hides what passing tests print, but not what they write to standard error directly. If standard
    // error is closed, the notice is lost.
    let _ = writeln!(std::io::stderr(), "skipped: {name}: {what} ({kind})");
}

/// Returns a command that calls a program of [`PROGRAMS`]. If this machine does not have the program, prints a notice
/// and returns `None`.
///
/// # Panics
/// Panics if the program is not in the list.
pub fn program(name: &str) -> Option<Command> {
    assert!(PROGRAMS.contains(&name), "{name}: add it to needs::PROGRAMS");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file());
    if found.is_none() {
        skipped(name, format_args!("no {name} on this machine"));
    }
    found.map(Command::new)
}

/// Returns true if all of these programs exist. Prints a notice for the first one that does not.
pub fn has(names: &[&str]) -> bool {
    names.iter().all(|name| program(name).is_some())
}

/// Returns a Python that has the modules: the one that `variable` names or, by default, `python3`. If it lacks them,
/// prints a notice and returns `None`.
pub fn python(kind: &str, variable: &str, modules: &str) -> Option<PathBuf> {
    let python = std::env::var_os(variable).map_or_else(|| "python3".into(), PathBuf::from);
    let found = Command::new(&python).args(["-c", &format!("import {modules}")]).output();
    let found = found.is_ok_and(|output| output.status.success()).then_some(python);
    if found.is_none() {
        skipped(kind, format_args!("no Python with {modules} ({variable})"));
    }
    found
}

/// Returns the folder of maps, logs and drawings that are not part of the project. It is the one that `SKETCHNAV_DATA`
/// names or, by default, `../shared/data` next to the checkout, and need not exist.
pub fn data() -> PathBuf {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."));
    std::env::var_os("SKETCHNAV_DATA").map_or_else(|| checkout.join("../shared/data"), PathBuf::from)
}

/// Returns a file or folder in [`data`]. If it is missing, prints a notice and returns `None`.
pub fn data_file(file: &str) -> Option<PathBuf> {
    let path = data().join(file);
    if !path.exists() {
        skipped("data", format_args!("{} is not there", path.display()));
        return None;
    }
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "add it to needs::PROGRAMS")]
    fn an_unlisted_program_is_an_error() {
        program("frobnicate");
    }
}
