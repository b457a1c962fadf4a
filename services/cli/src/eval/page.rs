//! Fills in pages whose figures come from experiments. A JSON file next to the first page stores the figures,
//! and markers in the pages show where they go. For experiments that were not driven, the figures in that
//! file are kept.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::Serialize;
use sketchnav_files::PAGE;
use sketchnav_lab::experiments::figures::{Experiment, Figures};

use super::all::write;
use crate::failure::{Failure, OrInput};
use crate::output::out;

/// Pages and the figures to be filled in.
pub struct Pages<'a> {
    paths: &'a [PathBuf],
    figures: Figures,
}

impl<'a> Pages<'a> {
    /// Opens the pages, and the figures next to the first page if there are any. Checks the markers, so that
    /// invalid ones are reported before anything is driven.
    pub fn open(paths: &'a [PathBuf]) -> Result<Self, Failure> {
        if let Some(first) = paths.first() {
            // If the first page were a JSON file, the figures would replace it.
            let figures = file_beside(first);
            sketchnav_files::draft::refuse_to_overwrite(paths.iter().map(PathBuf::as_path), &figures)
                .or_input()?;
        }
        let kept = paths.first().map(|page| file_beside(page)).filter(|file| file.is_file());
        let figures = kept.map(|file| read(&file)).transpose().or_input()?.unwrap_or_default();
        let pages = Self { paths, figures };
        pages.filled().or_input()?;
        Ok(pages)
    }

    /// Adds the figures of an experiment, stores them, and fills in the pages.
    pub fn put(&mut self, name: &str, experiment: Experiment) -> Result<(), Failure> {
        let Some(first) = self.paths.first() else { return Ok(()) };
        self.figures.experiments.insert(name.to_owned(), experiment);
        write(&file_beside(first), &self.stored().context("the figures as JSON").map_err(Failure::Other)?)?;
        for (path, page, _) in self.filled().map_err(Failure::Other)? {
            write(path, &page)?;
        }
        Ok(())
    }

    /// Returns the figures as JSON, with a value per line for the sake of diffs, but not indented, because they are deeply nested.
    fn stored(&self) -> anyhow::Result<String> {
        let mut text = Vec::new();
        let formatter = serde_json::ser::PrettyFormatter::with_indent(b"");
        self.figures.serialize(&mut serde_json::Serializer::with_formatter(&mut text, formatter))?;
        Ok(String::from_utf8(text)? + "\n")
    }

    /// Prints which experiments on each page still have figures of an earlier version.
    pub fn print_outdated(&self) -> Result<(), Failure> {
        for (path, _, not_driven) in self.filled().map_err(Failure::Other)? {
            let names: Vec<_> = not_driven.into_iter().collect();
            let words = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            out!("{}: figures of an earlier version: {words}", path.display())?;
        }
        Ok(())
    }

    /// Returns each page with its figures filled in, and the experiments on it for which there are no figures.
    fn filled(&self) -> anyhow::Result<Vec<(&'a Path, String, BTreeSet<String>)>> {
        let fill = |path: &'a PathBuf| {
            let named = || path.display().to_string();
            let page = sketchnav_files::read_to_string(path, PAGE).with_context(named)?;
            let filled = self.figures.fill(&page).with_context(named)?;
            Ok((path.as_path(), filled.page, filled.not_driven))
        };
        self.paths.iter().map(fill).collect()
    }
}

/// Returns the file with the figures of a page, such as `docs/results.json` for `docs/results.md`.
fn file_beside(page: &Path) -> PathBuf {
    page.with_extension("json")
}

fn read(file: &Path) -> anyhow::Result<Figures> {
    let named = || file.display().to_string();
    let text = sketchnav_files::read_to_string(file, PAGE).with_context(named)?;
    serde_json::from_str(&text).with_context(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn experiment() -> Experiment {
        let (command, program) = ("sketchnav eval routes".to_owned(), "0.1.0 7".to_owned());
        let json = r#"{ "method": "outline", "lines": {}, "total": { "attempts": 4, "reached": 4, "wrong_arrival": 0,
            "wrong_side": 0, "collided": 0, "lost": 0, "blocked": 0, "timed_out": 0, "aborted": 0, "with_collision": 0 } }"#;
        Experiment {
            command,
            program,
            methods: vec![serde_json::from_str(json).unwrap()],
            notices: Vec::new(),
            tables: Vec::new(),
            sections: Vec::new(),
        }
    }

    #[test]
    fn figures_are_kept_beside_the_page_for_later_runs() {
        let folder = tempfile::tempdir().unwrap();
        let pages = [folder.path().join("results.md"), folder.path().join("README.md")];
        let text = |old: &str| format!("<!--= routes outline of-->{old}<!--=-->");
        pages.iter().for_each(|page| std::fs::write(page, text("?")).unwrap());
        Pages::open(&pages).unwrap().put("routes", experiment()).unwrap();
        let shown = || pages.each_ref().map(|page| std::fs::read_to_string(page).unwrap());
        assert_eq!(shown(), [text("4 of 4"), text("4 of 4")]);
        let mut later = Pages::open(&pages).unwrap();
        later.put("people", experiment()).unwrap();
        assert_eq!(later.figures.experiments.len(), 2);
        assert_eq!(shown(), [text("4 of 4"), text("4 of 4")]);
    }

    #[test]
    fn a_missing_or_invalid_page_is_reported_before_any_drive() {
        let folder = tempfile::tempdir().unwrap();
        let page = [folder.path().join("results.md")];
        let words = || match Pages::open(&page).err().unwrap() {
            Failure::Input(error) => format!("{error:#}"),
            _ => panic!("expected bad input"),
        };
        assert!(words().contains("results.md"));
        std::fs::write(&page[0], "\n<!--= peopl outline of-->?<!--=-->").unwrap();
        assert!(words().contains("results.md: line 2: expected one of ablation"), "{}", words());
        std::fs::write(page[0].with_extension("json"), "{").unwrap();
        assert!(words().contains("results.json"), "{}", words());
    }
}
