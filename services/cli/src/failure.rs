//! Exit codes of commands, and the output that accompanies them.

use std::ffi::{OsStr, OsString};

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use sketchnav_schemas::nearest::nearest;
use sketchnav_schemas::shown::{OneLine, one_line};
use sketchnav_supervisor::INCOMPLETE;

use crate::args::Cli;
use crate::output::{self, out};

/// The reason why a command failed.
#[derive(Debug)]
pub enum Failure {
    /// Bad input or usage: exit 2.
    Input(anyhow::Error),
    /// A tool that follows the exit codes of the official MCAP tool failed: exit 1.
    Plain(anyhow::Error),
    /// Anything else: exit 3.
    Other(anyhow::Error),
    /// Anything else, after the command has printed as much as possible: exit 3.
    Reported(anyhow::Error),
    /// The recording is incomplete: exit 4.
    Incomplete(anyhow::Error),
}

/// The outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done, every task reached, no difference: exit 0.
    Success,
    /// The command completed, but a task was not reached, or the recordings differ: exit 1.
    Short,
    /// Recovered, but with losses: exit 3.
    Loss,
    /// Every task reached, but the recording is incomplete: exit 4.
    Incomplete,
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        Self::Other(error)
    }
}

impl Failure {
    /// Returns the error of any kind of failure.
    pub fn into_error(self) -> anyhow::Error {
        match self {
            Self::Input(error)
            | Self::Plain(error)
            | Self::Other(error)
            | Self::Reported(error)
            | Self::Incomplete(error) => error,
        }
    }
}

/// Marks errors as bad input.
pub trait OrInput<T> {
    /// Turns an error into [`Failure::Input`].
    fn or_input(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> OrInput<T> for Result<T, E> {
    fn or_input(self) -> Result<T, Failure> {
        self.map_err(|error| Failure::Input(error.into()))
    }
}

/// Prints a failure and returns the exit code. With `json`, also prints an object with the error to standard output, so
/// that a program always finds an object there.
pub fn exit_code(result: Result<Outcome, Failure>, json: bool) -> u8 {
    match result {
        Ok(Outcome::Success) => 0,
        Ok(Outcome::Short) => 1,
        Ok(Outcome::Loss) => 3,
        Ok(Outcome::Incomplete) => INCOMPLETE,
        Err(Failure::Plain(error)) => report(&error, 1, json),
        Err(Failure::Input(error)) => report(&error, 2, json),
        Err(Failure::Other(error)) => report(&error, 3, json),
        Err(Failure::Reported(error)) => report(&error, 3, false),
        Err(Failure::Incomplete(error)) => report(&error, INCOMPLETE, json),
    }
}

fn report(error: &anyhow::Error, code: u8, json: bool) -> u8 {
    if output::is_unheard(error) {
        return 0;
    }
    let story = story(error);
    if json {
        // If standard output itself has failed, the error is still on standard error.
        let _ = out!("{}", serde_json::json!({ "error": story, "exit": code }));
    }
    output::aside(on_lines(&story));
    code
}

/// Texts after which an error contains intentional line breaks: the position in a TOML file, the last output
/// of a process, and the calls that led to an exception.
const LINES_FOLLOW: [&str; 3] =
    ["TOML parse error at line ", "; its last words:\n", "; traceback (most recent call last):\n"];
/// Marks the position in a YAML file, which is on a line of its own after some spaces.
const YAML_PLACE: &str = "--> <input>:";

/// Formats an error for printing. The file name is kept on one line, even if it contains line breaks. Lines that
/// follow, such as an excerpt of the file, are indented so that none of them looks like another message.
fn on_lines(story: &str) -> String {
    let yaml = story.find(YAML_PLACE).map(|at| story[..at].trim_end_matches(' ').len());
    let yaml = yaml.and_then(|end| Some(story[..end].strip_suffix('\n')?.len()));
    let follow = LINES_FOLLOW.iter().filter_map(|mark| story.find(mark)).chain(yaml).min();
    let (first, lines) = story.split_at(follow.unwrap_or(story.len()));
    format!("error: {}{}", OneLine(first), lines.replace('\n', "\n  "))
}

/// Prints a usage error or the requested help, and returns the exit code.
pub fn refuse_usage(error: &clap::Error, words: &[OsString]) -> u8 {
    match tame(words.iter()) {
        // Printed with colours, the only escape sequences that are left. If the output cannot be written, nothing is
        // lost.
        Some(tame) => drop(tame.print()),
        None => output::aside(error.render()),
    }
    u8::try_from(error.exit_code()).unwrap_or(2)
}

/// Returns the usage error for these words with their special characters escaped, since any of the words may be a file
/// name and contain anything.
fn tame(words: impl Iterator<Item: AsRef<OsStr>>) -> Option<clap::Error> {
    let words: Vec<_> = words.map(|word| one_line(word.as_ref().to_string_lossy())).collect();
    let mut error = Cli::try_parse_from(&words).err()?;
    suggest(&mut error, &words);
    Some(error)
}

/// Adds the command that was probably meant to an error about an unknown one. The parser only suggests commands that begin alike.
fn suggest(error: &mut clap::Error, words: &[String]) {
    let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidSubcommand).cloned() else {
        return;
    };
    if error.get(ContextKind::SuggestedSubcommand).is_some() {
        return;
    }
    let mut command = &Cli::command();
    for word in words.iter().skip(1) {
        command = command.find_subcommand(word).unwrap_or(command);
    }
    let known = command.get_subcommands().map(clap::Command::get_name);
    if let Some(meant) = nearest(&unknown, known) {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![meant.to_owned()]));
    }
}

/// Joins an error and its causes, leaving out causes whose text already appears.
pub fn story(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |story, cause| {
        let cause = cause.to_string();
        if story.contains(&cause) { story } else { format!("{story}: {cause}") }
    })
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::shown;

    use super::*;

    /// Regression test: an error that quoted a rejected escape sequence used to send it to the terminal itself.
    #[test]
    fn no_error_controls_the_terminal_or_forges_a_line() {
        let name = "a\u{1b}[31m\u{202e}\nerror: forged\u{9b}";
        let error = anyhow::anyhow!("{name}: expected a mission");
        assert_eq!(
            output_of(&error),
            "error: a\\u001b[31m\\u202e\\nerror: forged\\u009b: expected a mission"
        );
        // The excerpt of the file is kept on lines of its own below the error.
        let toml = toml::from_str::<toml::Table>("a = 1\nb\u{1b}[2J = = 2\n").unwrap_err();
        let output = output_of(&anyhow::Error::from(toml).context("m\n.toml"));
        assert!(output.starts_with("error: m\\n.toml: TOML parse error at line 2"), "{output}");
        assert!(output.contains("\n  2 | b\\u001b[2J = = 2\n"), "{output}");
        assert!(output.lines().skip(1).all(|line| line.starts_with("  ")), "{output}");
        for yaml in ["image: a.pgm\nresolution: [\n", "image: a.pgm\nresolution: 1\norigin: [1, 2]\n"] {
            let yaml = sketchnav_sim::ros_map::MapInfo::parse(yaml).unwrap_err();
            let output = output_of(&anyhow::Error::from(yaml));
            assert!(!output.contains("\\n"), "{output}");
        }
    }

    /// The second word stands for a file name that a shell pattern happened to match.
    #[test]
    fn a_rejected_argument_is_shown_escaped() {
        let words = ["sketchnav", "inf\u{1b}[31m\u{202e}o\n"].map(OsString::from);
        let output = tame(words.into_iter()).unwrap().render().ansi().to_string();
        assert!(output.contains("inf\\u001b[31m\\u202eo\\n") && !output.contains("\u{202e}"), "{output}");
    }

    /// The parser suggests nothing for two letters in the wrong order.
    #[test]
    fn the_command_that_was_probably_meant_is_suggested() {
        let shown = |line: &str| tame(line.split(' ')).unwrap().render().to_string();
        assert!(shown("sketchnav rnu x.toml").contains("'run'"), "{}", shown("sketchnav rnu x.toml"));
        assert!(shown("sketchnav param lsit").contains("'list'"), "{}", shown("sketchnav param lsit"));
        assert!(!shown("sketchnav qqqq").contains("similar"), "{}", shown("sketchnav qqqq"));
    }

    fn output_of(error: &anyhow::Error) -> String {
        shown::lines(on_lines(&story(error)))
    }

    /// Regression test: a missing file was once reported three times: "m.toml: cannot be read: No such file …: cannot be …".
    #[test]
    fn each_cause_is_printed_once() {
        let missing = sketchnav_sim::mission_file::load("/nowhere/m.toml".as_ref()).unwrap_err();
        let story = story(&anyhow::Error::from(missing).context("the mission"));
        assert!(story.starts_with("the mission: /nowhere/m.toml: "), "{story}");
        assert_eq!(story.matches("no such file").count(), 1, "{story}");
    }
}
