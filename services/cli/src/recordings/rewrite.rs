//! Recordings out of recordings. A result appears under its name when it is whole; exit codes are those of
//! the official tool.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use regex_lite::Regex;
use sketchnav_recordings::copy::{self, Copy, Limit, PartFacts};
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::{Recording, RecordingError, rosbag2};
use sketchnav_schemas::time::{nanoseconds, seconds};

use super::args::{FilterOptions, SplitOptions};
use super::draft::{Draft, Sink};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{out, say};

/// The file that names the parts of a folder of rosbag2.
const METADATA: &str = "metadata.yaml";

/// Begins a copy that appears under its name when it is whole.
pub fn begin(path: &Path) -> anyhow::Result<(Draft, Copy<Sink>)> {
    let (draft, sink) = Draft::begin(path).with_context(|| path.display().to_string())?;
    Ok((draft, Copy::new(sink)?))
}

/// Gives it its name.
pub fn finish(draft: Draft, copy: Copy<Sink>) -> anyhow::Result<()> {
    copy.finish()?;
    draft.finish()
}

/// Copies what can be read.
pub fn recover(file: &Path, output: &Path, json: bool) -> Result<Outcome, Failure> {
    let work = || -> anyhow::Result<copy::Copied> {
        let (draft, mut copy) = begin(output)?;
        let copied = copy::recover(file, &mut copy)?;
        finish(draft, copy)?;
        Ok(copied)
    };
    let copied = work().map_err(Failure::Plain)?;
    if json {
        out!("{}", serde_json::to_string(&copied).context("the result as JSON")?)?;
    } else {
        let copy::Copied { messages, lost_chunks, lost_bytes, was_whole, .. } = copied;
        let end = if was_whole { "had its end" } else { "was cut off" };
        out!(
            "{messages} messages recovered; {lost_chunks} chunks and {lost_bytes} bytes lost; the file {end}"
        )?;
    }
    Ok(if copied.has_loss() { Outcome::Loss } else { Outcome::Success })
}

/// Copies what is wanted.
pub fn filter(file: &Path, options: &FilterOptions) -> Result<Outcome, Failure> {
    let times_ns = options.times.ns().or_input()?;
    let work = || -> anyhow::Result<Made> {
        let recording = Recording::open(file)?;
        let selection = selection(&recording, options)?.between(times_ns);
        check_topics(&recording, &selection)?;
        let (draft, mut copy) = begin(&options.output)?;
        copy::filter(&recording, &selection, &mut copy)?;
        let made = Made::of(copy.messages(), std::slice::from_ref(&recording))?;
        finish(draft, copy)?;
        Ok(made)
    };
    work().map_err(Failure::Plain)?.tell(options.json)
}

fn selection(recording: &Recording, options: &FilterOptions) -> anyhow::Result<Selection> {
    if let Some(regex) = &options.regex {
        return Ok(Selection::of_topics(matching(recording, regex)?));
    }
    let topics = options.topics.iter().map(|topic| format!("/{}", topic.trim_start_matches('/')));
    Ok(if options.topics.is_empty() { Selection::default() } else { Selection::of_topics(topics) })
}

/// The topics of a recording that a regular expression matches, without the slash before their names; there is one.
pub fn matching(recording: &Recording, regex: &Regex) -> anyhow::Result<Vec<String>> {
    let known: Vec<_> = recording.topics()?.iter().map(|topic| topic.name.clone()).collect();
    let matches = |topic: &&String| regex.is_match(topic.trim_start_matches('/'));
    let found: Vec<_> = known.iter().filter(matches).cloned().collect();
    ensure!(!found.is_empty(), "--regex: expected a match of {}, found none", known.join(", "));
    Ok(found)
}

/// What became of a copy of whole recordings.
struct Made {
    messages: u64,
    /// Those of the recordings that `info` calls cut off.
    cut_off: Vec<String>,
}

impl Made {
    fn of(messages: u64, recordings: &[Recording]) -> Result<Self, RecordingError> {
        Ok(Self { messages, cut_off: super::cut_off(recordings)? })
    }

    fn tell(&self, json: bool) -> Result<Outcome, Failure> {
        let Self { messages, cut_off } = self;
        if json {
            out!("{}", serde_json::json!({ "messages": messages, "cut_off": cut_off }))?;
        } else {
            out!("{messages} messages")?;
        }
        Ok(outcome_of(cut_off))
    }
}

/// As MCAP's own tool: what was copied of a recording that was cut off is not all that was sent.
fn outcome_of(cut_off: &[String]) -> Outcome {
    for name in cut_off {
        say!("notice: {name} was cut off; what was whole is in the copy");
    }
    if cut_off.is_empty() { Outcome::Success } else { Outcome::Loss }
}

fn check_topics(recording: &Recording, selection: &Selection) -> anyhow::Result<()> {
    let known: Vec<_> = recording.topics()?.iter().map(|topic| topic.name.clone()).collect();
    match selection.topics.iter().flatten().find(|topic| !known.contains(topic)) {
        Some(topic) => Err(anyhow!("topic {topic}: expected one of {}", known.join(", "))),
        None => Ok(()),
    }
}

/// Makes one of several.
pub fn merge(files: &[PathBuf], output: &Path, json: bool) -> Result<Outcome, Failure> {
    let work = || -> anyhow::Result<Made> {
        let recordings = files.iter().map(|file| Recording::open(file)).collect::<Result<Vec<_>, _>>()?;
        let (draft, mut copy) = begin(output)?;
        copy::merge(&recordings, &mut copy)?;
        let made = Made::of(copy.messages(), &recordings)?;
        finish(draft, copy)?;
        Ok(made)
    };
    work().map_err(Failure::Plain)?.tell(json)
}

/// Cuts one into parts.
pub fn split(file: &Path, options: &SplitOptions) -> Result<Outcome, Failure> {
    let limit = limit(options)?;
    let recording = Recording::open(file).map_err(|error| Failure::Plain(error.into()))?;
    let parts = parts(&recording, options, limit).map_err(Failure::Plain)?;
    let cut_off = super::cut_off(&[recording]).map_err(|error| Failure::Plain(error.into()))?;
    if options.json {
        let object: Vec<_> =
            parts.iter().map(|(name, part)| serde_json::json!({ "file": name, "part": part })).collect();
        out!("{}", serde_json::Value::from(object))?;
    } else {
        for (name, part) in &parts {
            let span = (seconds(part.first_ns), seconds(part.last_ns));
            let messages = part.messages.values().sum::<u64>();
            out!("{name}  {:.1} to {:.1} s, {messages} messages", span.0, span.1)?;
        }
    }
    Ok(outcome_of(&cut_off))
}

fn limit(options: &SplitOptions) -> Result<Option<Limit>, Failure> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    match (options.seconds, options.megabytes) {
        (Some(s), _) if positive(s) => Ok(Some(Limit::Time(nanoseconds(s)))),
        (_, Some(megabytes)) if positive(megabytes) => Ok(Some(Limit::Bytes((megabytes * 1e6) as u64))),
        (None, None) if options.rosbag2 => Ok(None),
        (None, None) => Err(Failure::Input(anyhow!("expected --seconds, --megabytes or --rosbag2"))),
        _ => Err(Failure::Input(anyhow!("expected a number above 0"))),
    }
}

fn parts(
    recording: &Recording,
    options: &SplitOptions,
    limit: Option<Limit>,
) -> anyhow::Result<Vec<(String, PartFacts)>> {
    let folder = &options.output;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let stem = recording.path().file_stem().unwrap_or_default().to_string_lossy().into_owned();
    refuse_earlier_parts(folder, &stem, options.rosbag2)?;
    let name = |number: usize| format!("{stem}_{number}.mcap");
    let mut drafts = Vec::new();
    let facts = copy::split(recording, limit, |number| {
        let path = folder.join(name(number));
        let begun = Draft::begin(&path);
        let (draft, sink) = begun.map_err(|source| RecordingError::File { path, source })?;
        drafts.push(draft);
        Ok(sink)
    })?;
    drafts.into_iter().try_for_each(Draft::finish)?;
    let parts: Vec<_> = facts.into_iter().enumerate().map(|(number, part)| (name(number), part)).collect();
    if options.rosbag2 {
        let yaml = folder.join(METADATA);
        let (draft, mut sink) = Draft::begin(&yaml).with_context(|| yaml.display().to_string())?;
        sink.write_all(rosbag2::metadata_yaml(&parts, &recording.topics()?).as_bytes())?;
        sink.flush()?;
        draft.finish()?;
    }
    Ok(parts)
}

/// Parts of an earlier split would stay beside the new ones, and could not be distinguished.
fn refuse_earlier_parts(folder: &Path, stem: &str, rosbag2: bool) -> anyhow::Result<()> {
    let is_part = |name: &str| {
        let number = name.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_')?.strip_suffix(".mcap"));
        number.is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
    };
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let name = entry?.file_name();
        let is_in_the_way = name.to_str().is_some_and(|name| is_part(name) || (rosbag2 && name == METADATA));
        if is_in_the_way {
            bail!("{}: expected a folder without earlier parts, found {}", folder.display(), name.display());
        }
    }
    Ok(())
}
