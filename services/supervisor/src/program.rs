//! How this program is started again, as a process of a system or as a command.

use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// A program and its first arguments.
static GIVEN: OnceLock<(PathBuf, Vec<OsString>)> = OnceLock::new();

/// Sets how this program is started if not by its executable, for example by an interpreter with the given arguments. Only the
/// first call has an effect.
pub fn start_by(program: PathBuf, arguments: Vec<OsString>) {
    let _ = GIVEN.set((program, arguments));
}

/// Returns a command that starts this program. The caller adds the arguments.
///
/// # Errors
/// An error if the path of the executable is unknown.
pub fn this_program() -> io::Result<Command> {
    let Some((program, arguments)) = GIVEN.get() else { return Ok(Command::new(std::env::current_exe()?)) };
    let mut command = Command::new(program);
    command.args(arguments);
    Ok(command)
}
