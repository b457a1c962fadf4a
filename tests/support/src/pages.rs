//! Reads the pages of the documentation for tests: prose, links, code and commands.
//!
//! A test runs the code blocks marked `sh`, section by section. A line that ends with `&` runs in the background. A
//! block marked `text` is only shown, but the program must accept the commands in it.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;

use super::{Place, Running, repository};

/// A page of the documentation.
pub struct Page {
    /// The page's path in the repository.
    pub path: PathBuf,
    text: String,
}

/// A block of code.
pub struct Block {
    /// The heading above the block.
    pub heading: String,
    /// The language of the block: `sh`, `toml`, `rust` or `text`.
    pub language: String,
    /// The lines of the block.
    pub lines: Vec<String>,
}

impl Block {
    /// Returns the lines of the block as one text.
    pub fn text(&self) -> String {
        self.lines.join("\n")
    }
}

/// Returns all pages that people read, which are all `.md` files in the sources.
pub fn all() -> Vec<Page> {
    let mut pages = Vec::new();
    for folder in
        ["docs", "docs/navigators", "python", "recordings", "sim/missions", "services/libraries/qualitative"]
    {
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
    /// Reads the page at the given path in the repository.
    pub fn of(path: &str) -> Self {
        let text =
            fs::read_to_string(repository().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
        Self { path: path.into(), text }
    }

    /// Returns the whole text of the page.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the page's path, for error messages.
    pub fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Returns every line with its number, and whether it belongs to a code block.
    pub fn lines(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        let mut is_code = false;
        self.text.lines().enumerate().map(move |(i, line)| {
            let is_fence = line.trim_start().starts_with("```");
            is_code ^= is_fence;
            (i + 1, line, is_code || is_fence)
        })
    }

    /// Returns the headings of the page.
    pub fn headings(&self) -> impl Iterator<Item = &str> {
        let lines = self.lines().filter(|(_, line, is_code)| !is_code && line.starts_with('#'));
        lines.map(|(_, line, _)| line.trim_start_matches('#').trim())
    }

    /// Returns the code blocks of the page.
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

    /// Returns the commands of a section that a test runs.
    pub fn commands(&self, heading: &str) -> Vec<String> {
        let runs = |block: &Block| block.language == "sh" && block.heading == heading;
        let blocks = self.blocks().into_iter().filter(runs);
        blocks.flat_map(|block| block.lines).map(|line| line.trim().to_owned()).collect()
    }

    /// Returns the headings of the sections that contain commands that a test runs.
    pub fn sections(&self) -> Vec<String> {
        let mut headings: Vec<_> =
            self.blocks().into_iter().filter(|block| block.language == "sh").map(|b| b.heading).collect();
        headings.dedup();
        headings
    }
}

/// Links the repository into a place, so that commands can name its files as in a checkout.
pub fn settle(place: &Place) {
    for name in ["sim", "services"] {
        symlink(repository().join(name), place.files().join(name)).unwrap();
    }
}

/// Parses a command line as a shell would, as far as the pages need that.
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

/// Returns the program that a command calls, if it is one that a machine may lack.
fn program_of(line: &str) -> Option<&str> {
    line.split_whitespace().next().filter(|word| *word != "sketchnav" && !needs::COREUTILS.contains(word))
}

/// Returns the name given by `--system`.
fn system_of(line: &str) -> Option<&str> {
    line.split_whitespace().skip_while(|word| *word != "--system").nth(1)
}

/// Runs the commands of a section. Each must end with exit code 0 and leave nothing behind.
pub fn run(page: &str, heading: &str) {
    let commands = Page::of(page).commands(heading);
    assert!(!commands.is_empty(), "{page}: no commands below {heading:?}");
    let programs: Vec<_> = commands.iter().filter_map(|line| program_of(line)).chain(["bash"]).collect();
    if !needs::has(&programs) {
        return;
    }
    let place = Place::new();
    settle(&place);
    let mut background: Vec<Running> = Vec::new();
    for line in &commands {
        if let Some(line) = line.strip_suffix(" &") {
            let mut running = Running::spawn(shell(&place, line));
            if let Some(system) = system_of(line) {
                place.wait_until_driving(&mut running, system);
            }
            background.push(running);
            continue;
        }
        let ended = Running::spawn(shell(&place, line)).end();
        assert_eq!(ended.code, Some(0), "{page}: {line}: {ended}");
    }
    for running in background {
        // An order on the page may have ended the command already.
        let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(running.pid() as i32), Signal::SIGINT);
        running.end();
    }
    assert_eq!(place.living(), []);
}
