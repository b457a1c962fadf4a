//! Shell completions and manual pages, generated from the description of the command line.

use std::path::Path;

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::{Shell as Known, generate};

use crate::args::{Cli, Shell};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output;

/// The name of the program.
const NAME: &str = "sketchnav";

/// Prints the completion script for a shell.
pub fn completions(shell: Shell) -> Result<Outcome, Failure> {
    let known = match shell {
        Shell::Bash => Known::Bash,
        Shell::Elvish => Known::Elvish,
        Shell::Fish => Known::Fish,
        Shell::Powershell => Known::PowerShell,
        Shell::Zsh => Known::Zsh,
    };
    let mut text = Vec::new();
    generate(known, &mut Cli::command(), NAME, &mut text);
    output::lines(String::from_utf8_lossy(&text).trim_end())?;
    Ok(Outcome::Success)
}

/// Writes the manual pages into a folder.
pub fn man(folder: &Path) -> Result<Outcome, Failure> {
    let named = || folder.display().to_string();
    std::fs::create_dir_all(folder).with_context(named).or_input()?;
    clap_mangen::generate_to(Cli::command(), folder).with_context(named)?;
    Ok(Outcome::Success)
}
