//! Tools for recordings.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_recordings::faults::{FaultInfo, faults};
use sketchnav_recordings::info::{Info, TopicInfo};
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_schemas::channels::FAULTS;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::recordings;
use crate::recordings::whole::Whole;

/// Compares two recordings.
pub fn diff(a: &Path, b: &Path, json: bool) -> Result<Outcome, Failure> {
    let difference = sketchnav_recordings::diff::diff(a, b).or_input()?;
    let cut_off = [a, b].map(Recording::open).into_iter().collect::<Result<Vec<_>, _>>();
    let cut_off = cut_off.and_then(|recordings| recordings::cut_off(&recordings)).or_input()?;
    cut_off.iter().for_each(recordings::tell_cut_off);
    if json {
        let object = serde_json::json!({
            "identical": difference.is_none(),
            "difference": difference,
            "cut_off": cut_off,
        });
        out!("{object}")?;
    } else {
        match &difference {
            None => out!("identical: every message of every channel (health, faults and latency left out)")?,
            Some(difference) => out!("different: {difference}")?,
        }
    }
    Ok(if difference.is_none() { Outcome::Success } else { Outcome::Short })
}

/// Most faults of a recording that are printed for people.
const MAX_FAULTS: usize = 60;

/// What there is to tell of a recording.
#[derive(Serialize)]
struct Told {
    #[serde(flatten)]
    info: Info,
    faults: Vec<FaultInfo>,
}

fn look(file: &Path) -> Result<Told, RecordingError> {
    let info = sketchnav_recordings::info::info(file)?;
    let is_faults = |topic: &&TopicInfo| topic.topic.strip_prefix('/') == Some(FAULTS.spec.name);
    let none = info.topics.iter().find(is_faults).is_none_or(|topic| topic.messages == 0);
    let faults = if none { Vec::new() } else { faults(file)? };
    Ok(Told { info, faults })
}

/// Prints what a recording holds, or every recording of a folder.
pub fn info(path: &Path, json: bool) -> Result<Outcome, Failure> {
    if !path.is_dir() {
        let mut told = look(Whole::of(path)?.path()).or_input()?;
        told.info.path = path.display().to_string();
        return if json { print_json(&told) } else { print(&told) }
            .map(|()| Outcome::Success)
            .map_err(Failure::from);
    }
    let files = recordings_in(path).with_context(|| path.display().to_string()).or_input()?;
    if files.is_empty() {
        return Err(Failure::Input(anyhow!("{}: expected a recording (.mcap), found none", path.display())));
    }
    let infos: Result<Vec<_>, _> = files.iter().map(|file| look(file)).collect();
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

fn print(told: &Told) -> anyhow::Result<()> {
    let info = &told.info;
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
            out!("{}: {} messages missing after number {}", topic.topic, gap.missing, gap.after_seq)?;
        }
    }
    print_faults(&told.faults)
}

fn print_faults(faults: &[FaultInfo]) -> anyhow::Result<()> {
    for fault in faults.iter().take(MAX_FAULTS) {
        let FaultInfo { stamp_s, kind, process, pid, duration_ms, words, .. } = fault;
        let took = if *duration_ms > 0.0 { format!("{duration_ms:.0} ms") } else { String::new() };
        out!("{stamp_s:9.2} s  {process:<10} {kind:<17} {took:>8}  {words} ({pid})")?;
    }
    match faults.len().saturating_sub(MAX_FAULTS) {
        0 => Ok(()),
        more => out!("and {more} more faults: --json lists them all"),
    }
}
