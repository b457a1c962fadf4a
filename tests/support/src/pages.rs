//! The pages of the documentation, as tests read them: prose, links, code, commands.
//!
//! A block of code marked `sh` is run by a test, section by section. A line that ends with `&` runs in the background. A block
//! marked `text` is only shown; its commands must be ones that the program accepts.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;

use super::{Place, Running, repository};

/// A page.
pub struct Page {
    /// Path in the repository.
    pub path: PathBuf,
    text: String,
}

/// A block of code.
pub struct Block {
    /// The heading above it.
    pub heading: String,
    /// Its language: `sh`, `toml`, `rust`, `text`.
    pub language: String,
    /// Its lines.
    pub lines: Vec<String>,
}

impl Block {
    /// Its lines as one text.
    pub fn text(&self) -> String {
        self.lines.join("\n")
    }
}

/// The pages that people read: everything in the sources that ends with `.md`.
pub fn all() -> Vec<Page> {
    let mut pages = Vec::new();
    for folder in ["docs", "docs/navigators", "recordings", "sim/missions"] {
        pages.extend(of_folder(folder));
    }
    for navigator in fs::read_dir(repository().join("services/navigators")).unwrap() {
        let name = navigator.unwrap().file_name();
        pages.extend(of_folder(&format!("services/navigators/{}", name.to_str().unwrap())));
    }
    pages.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(Page::of));
    pages
}

fn of_folder(folder: &str) -> Vec<Page> {
    let Ok(files) = fs::read_dir(repository().join(folder)) else { return Vec::new() };
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = names.filter(|name| name.ends_with(".md")).collect();
    names.sort();
    names.iter().map(|name| Page::of(&format!("{folder}/{name}"))).collect()
}

impl Page {
    /// The page of this path in the repository.
    pub fn of(path: &str) -> Self {
        let text =
            fs::read_to_string(repository().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
        Self { path: path.into(), text }
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Its path, for error messages.
    pub fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Every line with its number, and whether it belongs to a block of code.
    pub fn lines(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        let mut is_code = false;
        self.text.lines().enumerate().map(move |(i, line)| {
            let is_fence = line.trim_start().starts_with("```");
            is_code ^= is_fence;
            (i + 1, line, is_code || is_fence)
        })
    }

    /// Its headings.
    pub fn headings(&self) -> impl Iterator<Item = &str> {
        let lines = self.lines().filter(|(_, line, is_code)| !is_code && line.starts_with('#'));
        lines.map(|(_, line, _)| line.trim_start_matches('#').trim())
    }

    /// Its blocks of code.
    pub fn blocks(&self) -> Vec<Block> {
        let (mut blocks, mut heading, mut open): (Vec<Block>, _, Option<Block>) =
            (vec![], String::new(), None);
        for (_, line, is_code) in self.lines() {
            let indented = line.trim_start();
            match (&mut open, indented.strip_prefix("```")) {
                (None, Some(language)) => {
                    open = Some(Block { heading: heading.clone(), language: language.into(), lines: vec![] });
                }
                (Some(_), Some(_)) => blocks.extend(open.take()),
                (Some(block), None) => block.lines.push(line.to_owned()),
                (None, None) if !is_code && line.starts_with('#') => {
                    heading = line.trim_start_matches('#').trim().to_owned();
                }
                _ => {}
            }
        }
        blocks
    }

    /// The commands of a section that are run.
    pub fn commands(&self, heading: &str) -> Vec<String> {
        let runs = |block: &Block| block.language == "sh" && block.heading == heading;
        let blocks = self.blocks().into_iter().filter(runs);
        blocks.flat_map(|block| block.lines).map(|line| line.trim().to_owned()).collect()
    }

    /// The sections that have such commands.
    pub fn sections(&self) -> Vec<String> {
        let mut headings: Vec<_> =
            self.blocks().into_iter().filter(|block| block.language == "sh").map(|b| b.heading).collect();
        headings.dedup();
        headings
    }
}

/// Links the repository into a place, so that commands can name what ships as in a checkout.
pub fn settle(place: &Place) {
    for name in ["sim", "services"] {
        symlink(repository().join(name), place.files().join(name)).unwrap();
    }
}

/// Parses a command as a shell does, as far as the pages need it.
fn shell(place: &Place, line: &str) -> Command {
    let program = place.command("");
    let folder = Path::new(program.get_program()).parent().unwrap().to_owned();
    let path = std::env::var("PATH").unwrap_or_default();
    let mut command = needs::program("bash").expect("bash, which was there before");
    command.args(["-euc", &format!("exec {line}")]);
    place.settle(&mut command);
    command.env("PATH", format!("{}:{path}", folder.display()));
    command.env("CHECKOUT", repository());
    command
}

/// The program that a command calls, if a machine may lack it.
fn program_of(line: &str) -> Option<&str> {
    line.split_whitespace().next().filter(|word| *word != "sketchnav" && !needs::COREUTILS.contains(word))
}

/// The name that `--system` gives.
fn system_of(line: &str) -> Option<&str> {
    line.split_whitespace().skip_while(|word| *word != "--system").nth(1)
}

/// Runs the commands of a section; each must end with exit code 0 and leave nothing.
pub fn run(page: &str, heading: &str) {
    let commands = Page::of(page).commands(heading);
    assert!(!commands.is_empty(), "{page}: no commands below {heading:?}");
    let programs: Vec<_> = commands.iter().filter_map(|line| program_of(line)).chain(["bash"]).collect();
    if !needs::has(&programs) {
        return;
    }
    let place = Place::new();
    settle(&place);
    let mut behind: Vec<Running> = Vec::new();
    for line in &commands {
        if let Some(line) = line.strip_suffix(" &") {
            let mut running = Running::spawn(shell(&place, line));
            if let Some(system) = system_of(line) {
                place.wait_until_driving(&mut running, system);
            }
            behind.push(running);
            continue;
        }
        let ended = Running::spawn(shell(&place, line)).end();
        assert_eq!(ended.code, Some(0), "{page}: {line}: {ended}");
    }
    for running in behind {
        // It may have ended by itself, by an order on the page.
        let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(running.pid() as i32), Signal::SIGINT);
        running.end();
    }
    assert_eq!(place.living(), []);
}
