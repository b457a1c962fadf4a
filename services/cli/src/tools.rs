//! Tools that inspect recordings.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_recordings::faults::{FaultInfo, faults};
use sketchnav_recordings::info::{Info, TopicInfo};
use sketchnav_recordings::rosbag2::{self, Bag, METADATA};
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_schemas::channels::FAULTS;

use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};
use crate::recordings;
use crate::recordings::whole::{self, Whole};

/// Compares two recordings.
pub fn diff(wholes: &[Whole], json: bool) -> Result<Outcome, Failure> {
    let [a, b] = wholes else { return Err(Failure::Input(anyhow!("expected two recordings"))) };
    let opened = [a, b].map(|whole| Recording::open(whole.path()));
    let opened = opened.into_iter().collect::<Result<Vec<_>, _>>().or_input()?;
    // Only our own channels are compared. Recordings by other software have none, so they would always seem identical.
    opened.iter().try_for_each(Recording::must_be_ours).or_input()?;
    let difference = sketchnav_recordings::diff::diff(a.path(), b.path()).or_input()?;
    let cut_off = cut_off(wholes.iter().zip(&opened)).or_input()?;
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

/// Returns the names of the recordings that `info` reports as cut off.
fn cut_off<'a>(
    recordings: impl Iterator<Item = (&'a Whole, &'a Recording)>,
) -> Result<Vec<String>, RecordingError> {
    let mut names = Vec::new();
    for (whole, recording) in recordings {
        if recording.index()?.is_cut_off() {
            names.push(whole.name().display().to_string());
        }
    }
    Ok(names)
}

/// Maximum number of a recording's faults that are printed for people.
const MAX_FAULTS: usize = 60;

/// The information about a recording.
#[derive(Serialize)]
struct Details {
    #[serde(flatten)]
    info: Info,
    faults: Vec<FaultInfo>,
}

fn look(file: &Path) -> Result<Details, RecordingError> {
    let info = sketchnav_recordings::info::info(file)?;
    // In a recording by other software, a topic with this name may mean something else.
    let spec = FAULTS.spec;
    let is_faults = |topic: &&TopicInfo| spec.is_topic(&topic.topic) && topic.ros2_type == spec.message.ros2;
    let none = info.topics.iter().find(is_faults).is_none_or(|topic| topic.messages == 0);
    let faults = if none { Vec::new() } else { faults(file)? };
    Ok(Details { info, faults })
}

/// Like [`look`], but for a path that may refer to several files or to a packed one.
fn look_at(path: &Path, whole: &Whole) -> Result<Details, Failure> {
    let mut details = look(whole.path()).or_input()?;
    details.info.path = path.display().to_string();
    if path.is_file() && rosbag2::is_packed(path).unwrap_or(false) {
        details.info.notes.push(
            "a file compressed as a whole with zstd (compression_mode: FILE); it is unpacked to be read"
                .to_owned(),
        );
    }
    Ok(details)
}

/// Describes a recording, or each recording in a folder.
pub fn info(path: &Path, json: bool) -> Result<Outcome, Failure> {
    if !path.is_dir() {
        let whole = Whole::of(path)?;
        let details = whole.known(look_at(path, &whole))?;
        return if json { print_json(&details) } else { print(&details) }
            .map(|()| Outcome::Success)
            .map_err(Failure::from);
    }
    let (files, missing) = whole::listed_in(path).or_input()?;
    let look_at_one = |file: &PathBuf| {
        let whole = Whole::alone(file)?;
        whole.known(look_at(file, &whole))
    };
    let mut infos = files.iter().map(look_at_one).collect::<Result<Vec<_>, _>>()?;
    let missing: Vec<_> = missing.into_iter().chain(fewer(path, &infos)?).collect();
    missing.iter().for_each(|words| say!("notice: {words}"));
    infos.iter_mut().take(1).for_each(|details| details.info.notes.extend(missing.iter().cloned()));
    if json { print_json(&infos) } else { infos.iter().try_for_each(print) }?;
    Ok(Outcome::Success)
}

/// Returns a warning if the files of a bag contain fewer messages than its metadata says.
fn fewer(folder: &Path, infos: &[Details]) -> Result<Option<String>, Failure> {
    let said = Bag::read(folder).or_input()?.and_then(|bag| bag.messages);
    let held = infos.iter().map(|details| details.info.messages).sum::<u64>();
    let words =
        |said| format!("{}: {METADATA} says {said} messages, its files contain {held}", folder.display());
    Ok(said.filter(|said| held < *said).map(words))
}

fn print_json(details: &impl Serialize) -> anyhow::Result<()> {
    out!("{}", serde_json::to_string(details).context("the info as JSON")?)
}

fn print(details: &Details) -> anyhow::Result<()> {
    let info = &details.info;
    out!("{}  ({:.1} MB)", info.path, info.bytes as f64 / 1e6)?;
    for (key, value) in &info.run {
        out!("{key:<10} {value}")?;
    }
    let end = match (info.clean_end, info.restarts) {
        (false, _) => "cut off; the rest is intact".to_owned(),
        (true, 0) => "ended cleanly".to_owned(),
        (true, restarts) => format!("ended cleanly; the recorder was killed and {}", restarted(restarts)),
    };
    for (process, restarts) in info.process_restarts.iter().filter(|(_, restarts)| **restarts > 0) {
        out!("{process:<10} {}", restarted(*restarts))?;
    }
    if !info.notes.is_empty() {
        let of = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
        out!("{:<10} {}", "profile", of(&info.profile))?;
        out!("{:<10} {}", "written by", of(&info.library))?;
        info.notes.iter().try_for_each(|note| out!("{:<10} {note}", "note"))?;
    }
    // Other software records real time, and its recordings do not describe a run.
    let what = if info.run.is_empty() { "recorded" } else { "simulated" };
    out!("{:.1} s {what}, {} messages, {} missing; {end}", info.duration_s, info.messages, info.missing)?;
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
    print_faults(&details.faults)
}

fn restarted(times: u64) -> String {
    if times == 1 { "restarted once".to_owned() } else { format!("restarted {times} times") }
}

fn print_faults(faults: &[FaultInfo]) -> anyhow::Result<()> {
    for fault in faults.iter().take(MAX_FAULTS) {
        let FaultInfo { stamp_s, kind, process, pid, duration_ms, words, .. } = fault;
        let took = if *duration_ms > 0.0 { format!("{duration_ms:.0} ms") } else { String::new() };
        // An order has no process.
        let is_named = *pid == 0 || words.contains(&format!("(process {pid})"));
        let pid = if is_named { String::new() } else { format!(" ({pid})") };
        out!("{stamp_s:9.2} s  {process:<10} {kind:<17} {took:>8}  {words}{pid}")?;
    }
    match faults.len().saturating_sub(MAX_FAULTS) {
        0 => Ok(()),
        more => out!("and {more} more faults: --json lists them all"),
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_recordings::samples::{SampleForm, points, recording};

    use super::*;

    /// Regression test: a bag had lost most of its messages, and the user was not warned.
    #[test]
    fn a_bag_with_fewer_messages_than_its_metadata_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("b_0.mcap");
        std::fs::write(&file, recording(SampleForm::default(), &[points("/ball", 12, false)])).unwrap();
        let details = look_at(&file, &Whole::alone(&file).unwrap()).unwrap();
        let says = |count: u64| {
            let text = format!(
                "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  message_count: {count}\n  \
                 relative_file_paths: [b_0.mcap]\n"
            );
            std::fs::write(folder.path().join(METADATA), text).unwrap();
            fewer(folder.path(), std::slice::from_ref(&details)).unwrap()
        };
        assert!(says(30).unwrap().ends_with("says 30 messages, its files contain 12"));
        assert_eq!([says(12), says(7)], [None, None]);
    }
}
