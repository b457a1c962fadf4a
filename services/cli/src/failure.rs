//! How the command ends: the exit codes and what is printed with them.

use std::process::ExitCode;

use crate::output::{self, out, say};

/// Why a command did not do what it was asked to.
#[derive(Debug)]
pub enum Failure {
    /// Bad input or usage: exit 2.
    Input(anyhow::Error),
    /// A tool that has the exit codes of MCAP's own did not succeed: exit 1.
    Plain(anyhow::Error),
    /// Anything else: exit 3.
    Other(anyhow::Error),
    /// As `Other`, and the command has printed all the same what it could: exit 3.
    Reported(anyhow::Error),
}

/// What a command comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done; every task reached; no difference: exit 0.
    Success,
    /// Done, but some task was not reached, or the recordings differ: exit 1.
    Short,
    /// Recovered, but not all of it: exit 3.
    Loss,
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        Self::Other(error)
    }
}

/// Marks an error as bad input.
pub trait OrInput<T> {
    /// The value, or [`Failure::Input`].
    fn or_input(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> OrInput<T> for Result<T, E> {
    fn or_input(self) -> Result<T, Failure> {
        self.map_err(|error| Failure::Input(error.into()))
    }
}

/// Prints a failure and gives the exit code. With `json` standard output gets an object too, so that a
/// program always finds one there.
pub fn exit_code(result: Result<Outcome, Failure>, json: bool) -> ExitCode {
    match result {
        Ok(Outcome::Success) => ExitCode::from(0),
        Ok(Outcome::Short) => ExitCode::from(1),
        Ok(Outcome::Loss) => ExitCode::from(3),
        Err(Failure::Plain(error)) => report(&error, 1, json),
        Err(Failure::Input(error)) => report(&error, 2, json),
        Err(Failure::Other(error)) => report(&error, 3, json),
        Err(Failure::Reported(error)) => report(&error, 3, false),
    }
}

fn report(error: &anyhow::Error, code: u8, json: bool) -> ExitCode {
    if output::is_unheard(error) {
        return ExitCode::from(0);
    }
    let story = story(error);
    if json {
        // Where standard output is what failed, standard error alone tells.
        let _ = out!("{}", serde_json::json!({ "error": story, "exit": code }));
    }
    say!("error: {story}");
    ExitCode::from(code)
}

/// The error and its causes; a cause that is in the text already is not repeated.
pub fn story(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |story, cause| {
        let cause = cause.to_string();
        if story.contains(&cause) { story } else { format!("{story}: {cause}") }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A missing file was reported three times over: "m.toml: cannot be read: No such file …: cannot be …".
    #[test]
    fn a_cause_is_told_once() {
        let missing = sketchnav_sim::mission_file::load("/nowhere/m.toml".as_ref()).unwrap_err();
        let story = story(&anyhow::Error::from(missing).context("the mission"));
        assert!(story.starts_with("the mission: /nowhere/m.toml: "), "{story}");
        assert_eq!(story.matches("No such file").count(), 1, "{story}");
    }
}
