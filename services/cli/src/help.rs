//! `sketchnav help`: shows the help of a command and the pages of the documentation, which are part of the program.

mod pager;
mod plain;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::io::{self, IsTerminal};
use std::iter;

use anyhow::anyhow;
use clap::CommandFactory;
use ratatui::crossterm::terminal;
use sketchnav_schemas::nearest::nearest;

use crate::args::Cli;
use crate::failure::{Failure, Outcome};
use crate::output;

/// Reads pages by their paths in the repository.
macro_rules! pages {
    ($($path:literal,)*) => {
        &[$(Page { path: $path, text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $path)) }),*]
    };
}

/// All pages of the documentation.
const PAGES: &[Page] = pages![
    "README.md",
    "ARCHITECTURE.md",
    "docs/README.md",
    "docs/commands.md",
    "docs/ecosystem.md",
    "docs/faults.md",
    "docs/glossary.md",
    "docs/missions.md",
    "docs/navigators/corridor.md",
    "docs/navigators/directions.md",
    "docs/navigators/landmarks.md",
    "docs/navigators/sketch.md",
    "docs/outline.md",
    "docs/pad.md",
    "docs/python.md",
    "docs/relations.md",
    "docs/real-robot.md",
    "docs/recordings.md",
    "docs/results.md",
    "docs/style.md",
    "docs/write-a-navigator.md",
];

/// Alternative names of topics, each with the topic that it stands for.
const ALIASES: &[(&str, &str)] = &[("ros", "ecosystem"), ("ros2", "ecosystem")];
/// The page that lists all the others by what their readers want to do.
const INDEX: &str = "docs/README.md";
/// The topic of [`INDEX`].
const INDEX_TOPIC: &str = "topics";
/// Width of the output, in columns, if it does not go to a terminal.
const COLUMNS: usize = 100;
/// Narrowest and widest output on a terminal, in columns. Longer lines are hard to read.
const TERMINAL_COLUMNS: (usize, usize) = (40, 120);

/// A page of the documentation.
#[derive(Debug, Clone, Copy)]
struct Page {
    /// The page's path in the repository.
    path: &'static str,
    /// The text, in Markdown.
    text: &'static str,
}

impl Page {
    /// Returns the page of a topic, which may also be given as the page's path.
    fn of(topic: &str) -> Option<&'static Self> {
        let topic = topic.to_lowercase();
        let alias = ALIASES.iter().find(|(alias, _)| *alias == topic);
        let topic = alias.map_or(topic, |(_, topic)| (*topic).to_owned());
        PAGES.iter().find(|page| page.topic() == topic || page.path.to_lowercase() == topic)
    }

    /// Returns the page with a path in the repository.
    fn at(path: &str) -> Option<&'static Self> {
        PAGES.iter().find(|page| page.path == path)
    }

    /// Returns the word that selects the page, which is the name of its file.
    fn topic(&self) -> String {
        let file = self.path.rsplit('/').next().unwrap_or(self.path);
        match self.path {
            INDEX => INDEX_TOPIC.to_owned(),
            _ => file.trim_end_matches(".md").to_lowercase(),
        }
    }

    /// Returns true if a heading contains a word, which is given in lower case.
    fn has_heading_with(&self, word: &str) -> bool {
        let mut headings = self.text.lines().filter(|line| line.starts_with('#'));
        headings.any(|heading| heading.to_lowercase().contains(word))
    }
}

/// Shows the help of the command with these words, the page on the topic, or both if they have the same name. Without
/// words, it shows all commands and a list of the pages.
pub fn help(words: &[String]) -> Result<Outcome, Failure> {
    let page = match words {
        [] => Page::at(INDEX),
        [topic] => Page::of(topic),
        _ => None,
    };
    match (of_command(words), page) {
        (None, None) => return Err(Failure::Input(anyhow!(unknown(&words.join(" "))))),
        // Printed with colours. If the output cannot be written, nothing is lost.
        (Some(command), None) => drop(command.print()),
        (None, Some(page)) => show(&plain::page(page, columns()))?,
        (Some(command), Some(page)) => {
            show(&format!(
                "{}\n\n{}",
                command.render().to_string().trim_end(),
                plain::page(page, columns())
            ))?;
        }
    }
    Ok(Outcome::Success)
}

/// Returns the help of a command, as clap's error that contains it, or `None` if there is no such command.
fn of_command(words: &[String]) -> Option<clap::Error> {
    let line = Cli::command();
    words.iter().try_fold(&line, |command, word| command.find_subcommand(word))?;
    let words = iter::once("sketchnav").chain(words.iter().map(String::as_str)).chain(iter::once("--help"));
    line.try_get_matches_from(words).err()
}

/// Describes an unknown topic, with the topics that may have been meant.
fn unknown(word: &str) -> String {
    let known = "expected a command or a page";
    match &near(word)[..] {
        [] => format!("help: {known}, found {word:?}; `sketchnav help` lists both"),
        near => {
            format!(
                "help: {known}, found {word:?}; did you mean {}? `sketchnav help` lists both",
                near.join(", ")
            )
        }
    }
}

/// Returns the commands and pages whose names are spelled similarly or contain the word, and the pages with a heading
/// that contains it.
fn near(word: &str) -> Vec<String> {
    let word = word.to_lowercase();
    let line = Cli::command();
    let commands = line.get_subcommands().map(|command| command.get_name().to_owned());
    let names: BTreeSet<_> = commands.chain(PAGES.iter().map(Page::topic)).collect();
    let meant = nearest(&word, names.iter().map(String::as_str));
    let is_near = |name: &String| {
        let is_page_on_it = || Page::of(name).is_some_and(|page| page.has_heading_with(&word));
        Some(name.as_str()) == meant || !word.is_empty() && (name.contains(&word) || is_page_on_it())
    };
    names.iter().filter(|name| is_near(name)).cloned().collect()
}

/// Prints a text, by way of a pager if standard output is a terminal.
fn show(text: &str) -> anyhow::Result<()> {
    match io::stdout().is_terminal() && pager::show(text) {
        true => Ok(()),
        false => output::lines(text),
    }
}

/// Returns the width of the output.
fn columns() -> usize {
    let (least, most) = TERMINAL_COLUMNS;
    match terminal::size() {
        Ok((columns, _)) if io::stdout().is_terminal() => usize::from(columns).clamp(least, most),
        _ => COLUMNS,
    }
}
