//! Tools for recordings.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_recordings::info::Info;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Compares two recordings.
pub fn diff(a: &Path, b: &Path, json: bool) -> Result<Outcome, Failure> {
    let difference = sketchnav_recordings::diff::diff(a, b).or_input()?;
    if json {
        let object = serde_json::json!({ "identical": difference.is_none(), "difference": difference });
        out!("{object}")?;
    } else {
        match &difference {
            None => out!("identical: every message of every channel (health left out)")?,
            Some(difference) => out!("different: {difference}")?,
        }
    }
    Ok(if difference.is_none() { Outcome::Success } else { Outcome::Short })
}

/// Tells what a recording holds, or every recording of a folder.
pub fn info(path: &Path, json: bool) -> Result<Outcome, Failure> {
    if !path.is_dir() {
        let info = sketchnav_recordings::info::info(path).or_input()?;
        return if json { print_json(&info) } else { print(&info) }
            .map(|()| Outcome::Success)
            .map_err(Failure::from);
    }
    let files = recordings_in(path).with_context(|| path.display().to_string()).or_input()?;
    if files.is_empty() {
        return Err(Failure::Input(anyhow!("{}: expected a recording (.mcap), found none", path.display())));
    }
    let infos: Result<Vec<_>, _> = files.iter().map(|file| sketchnav_recordings::info::info(file)).collect();
    let infos = infos.or_input()?;
    if json { print_json(&infos) } else { infos.iter().try_for_each(print) }?;
    Ok(Outcome::Success)
}

/// The recordings that lie in a folder, by name.
fn recordings_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "mcap") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn print_json(told: &impl Serialize) -> anyhow::Result<()> {
    out!("{}", serde_json::to_string(told).context("the info as JSON")?)
}

fn print(info: &Info) -> anyhow::Result<()> {
    out!("{}  ({:.1} MB)", info.path, info.bytes as f64 / 1e6)?;
    for (key, value) in &info.run {
        out!("{key:<10} {value}")?;
    }
    let end = match (info.clean_end, info.restarts) {
        (false, _) => "cut off; what is there is whole".to_owned(),
        (true, 0) => "ended cleanly".to_owned(),
        (true, restarts) => format!("ended cleanly; the recorder was killed and went on {restarts} times"),
    };
    for (process, restarts) in info.process_restarts.iter().filter(|(_, restarts)| **restarts > 0) {
        out!("{process:<10} started again {restarts} times")?;
    }
    out!("{:.1} s simulated, {} messages, {} missing; {end}", info.duration_s, info.messages, info.missing)?;
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(["topic", "type", "messages", "rate", "missing"]);
    for topic in &info.topics {
        table.add_row([
            topic.topic.clone(),
            topic.ros2_type.clone(),
            topic.messages.to_string(),
            topic.rate_hz.map_or("–".into(), |rate| format!("{rate:.2} Hz")),
            topic.missing.to_string(),
        ]);
    }
    out!("{table}")?;
    for topic in &info.topics {
        for gap in &topic.gaps {
            out!("{}: {gap:?}", topic.topic)?;
        }
    }
    Ok(())
}
