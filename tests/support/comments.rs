//! The prose of the sources, as tests read it: doc comments by paragraphs, and error messages.

use std::path::{Path, PathBuf};

use regex_lite::Regex;

/// How an error message begins, up to its text. A format string counts as it stands, its places as words.
const MESSAGE: &str =
    r#"(?s)(?:#\[error\(|anyhow!\(|bail!\(|context\((?:\|\w*\|\s*)?(?:format!\()?)\s*"((?:[^"\\]|\\.)*)""#;

/// The doc comments of a source by paragraphs and items of lists, each with its first line. Code, headings and tables
/// are left out.
pub fn paragraphs(source: &str) -> Vec<(usize, String)> {
    let (mut paragraphs, mut goes_on, mut is_code) = (Vec::<(usize, String)>::new(), false, false);
    for (i, line) in source.lines().enumerate() {
        let line = line.trim_start();
        let Some(words) = line.strip_prefix("///").or_else(|| line.strip_prefix("//!")).map(str::trim) else {
            (goes_on, is_code) = (false, false);
            continue;
        };
        let is_fence = words.starts_with("```");
        is_code ^= is_fence;
        if is_fence || is_code || words.is_empty() || words.starts_with(['#', '|']) {
            goes_on = false;
            continue;
        }
        if !goes_on || is_item(words) {
            paragraphs.push((i + 1, String::new()));
        }
        let (_, paragraph) = paragraphs.last_mut().unwrap();
        paragraph.push_str(words.trim_start_matches("- "));
        paragraph.push(' ');
        goes_on = true;
    }
    paragraphs
}

fn is_item(words: &str) -> bool {
    words.starts_with("- ") || words.split_once(". ").is_some_and(|(number, _)| number.parse::<u8>().is_ok())
}

/// Finds the texts of a source's error messages.
pub struct Messages(Regex);

impl Messages {
    pub fn new() -> Self {
        Self(Regex::new(MESSAGE).unwrap())
    }

    /// Each with its line.
    pub fn of(&self, source: &str) -> Vec<(usize, String)> {
        let all = self.0.captures_iter(source).map(|found| found.get(1).unwrap());
        all.map(|text| {
            let lines = text.as_str().split("\\\n").map(str::trim_start);
            let words = lines.collect::<String>().replace("\\n", " ");
            (source[..text.start()].lines().count(), words)
        })
        .collect()
    }
}

/// The folder of the crate to which a source belongs.
pub fn krate(source: &Path) -> PathBuf {
    let mut folders = source.ancestors().skip(1);
    folders.find(|folder| folder.join("Cargo.toml").is_file()).unwrap_or(source).to_owned()
}
