//! Tools for recordings.

use std::path::Path;

use anyhow::Context;
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_recordings::faults::{FaultInfo, faults};
use sketchnav_recordings::info::{Info, TopicInfo};
use sketchnav_recordings::{Recording, RecordingError, rosbag2};
use sketchnav_schemas::channels::FAULTS;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};
use crate::recordings;
use crate::recordings::whole::{self, Whole};

/// Compares two recordings.
pub fn diff(a: &Path, b: &Path, json: bool) -> Result<Outcome, Failure> {
    let opened = [a, b].map(Recording::open).into_iter().collect::<Result<Vec<_>, _>>().or_input()?;
    // Only channels of ours are compared; in recordings of others there would be none.
    opened.iter().try_for_each(Recording::must_be_ours).or_input()?;
    let difference = sketchnav_recordings::diff::diff(a, b).or_input()?;
    let cut_off = recordings::cut_off(&opened).or_input()?;
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

/// Maximum number of faults of a recording that are printed for people.
const MAX_FAULTS: usize = 60;

/// The information about a recording.
#[derive(Serialize)]
struct Told {
    #[serde(flatten)]
    info: Info,
    faults: Vec<FaultInfo>,
}

fn look(file: &Path) -> Result<Told, RecordingError> {
    let info = sketchnav_recordings::info::info(file)?;
    // In recordings of others, a topic of that name may be something else.
    let spec = FAULTS.spec;
    let is_faults = |topic: &&TopicInfo| spec.is_topic(&topic.topic) && topic.ros2_type == spec.message.ros2;
    let none = info.topics.iter().find(is_faults).is_none_or(|topic| topic.messages == 0);
    let faults = if none { Vec::new() } else { faults(file)? };
    Ok(Told { info, faults })
}

/// The same for a path that may refer to several files, or to a packed one.
fn look_at(path: &Path, whole: &Whole) -> Result<Told, Failure> {
    let mut told = look(whole.path()).or_input()?;
    told.info.path = path.display().to_string();
    if path.is_file() && rosbag2::is_packed(path).unwrap_or(false) {
        told.info.notes.push(
            "a file compressed by zstd as a whole (compression_mode: FILE); it is read unpacked".to_owned(),
        );
    }
    Ok(told)
}

/// Prints the content of a recording, or of every recording of a folder.
pub fn info(path: &Path, json: bool) -> Result<Outcome, Failure> {
    if !path.is_dir() {
        let told = look_at(path, &Whole::of(path)?)?;
        return if json { print_json(&told) } else { print(&told) }
            .map(|()| Outcome::Success)
            .map_err(Failure::from);
    }
    let (files, missing) = whole::listed_in(path).or_input()?;
    let mut infos =
        files.iter().map(|file| look_at(file, &Whole::alone(file)?)).collect::<Result<Vec<_>, _>>()?;
    missing.iter().for_each(|words| say!("notice: {words}"));
    infos.iter_mut().take(1).for_each(|told| told.info.notes.extend(missing.iter().cloned()));
    if json { print_json(&infos) } else { infos.iter().try_for_each(print) }?;
    Ok(Outcome::Success)
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
    if !info.notes.is_empty() {
        let of = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
        out!("{:<10} {}", "profile", of(&info.profile))?;
        out!("{:<10} {}", "written by", of(&info.library))?;
        info.notes.iter().try_for_each(|note| out!("{:<10} {note}", "note"))?;
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
    output::lines(&table)?;
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
