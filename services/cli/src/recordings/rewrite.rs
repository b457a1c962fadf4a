//! Recordings out of recordings. A result appears under its name when it is whole; exit codes are those of
//! the official tool.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use sketchnav_recordings::copy::{self, Copy, Limit, PartFacts};
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::{Recording, RecordingError, rosbag2};

use super::args::{FilterOptions, SplitOptions};
use crate::failure::{Failure, Outcome};
use crate::output::out;

const NS_PER_S: f64 = 1e9;

type Sink = BufWriter<File>;

/// A file that is moved to its name when it is whole.
struct Draft {
    path: PathBuf,
    draft: PathBuf,
}

impl Draft {
    fn begin(path: &Path) -> anyhow::Result<(Self, Copy<Sink>)> {
        let draft = path.with_extension("unfinished");
        let file = File::create(&draft).with_context(|| draft.display().to_string())?;
        Ok((Self { path: path.to_owned(), draft }, Copy::new(BufWriter::new(file))?))
    }

    fn finish(self, copy: Copy<Sink>) -> anyhow::Result<()> {
        let sink = copy.finish()?;
        sink.get_ref().sync_data()?;
        std::fs::rename(&self.draft, &self.path).with_context(|| self.path.display().to_string())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        // After `finish` there is none.
        let _ = std::fs::remove_file(&self.draft);
    }
}

/// Copies what can be read.
pub fn recover(file: &Path, output: &Path, json: bool) -> Result<Outcome, Failure> {
    let work = || -> anyhow::Result<copy::Copied> {
        let (draft, mut copy) = Draft::begin(output)?;
        let copied = copy::recover(file, &mut copy)?;
        draft.finish(copy)?;
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
    let mut selection = match options.topics.as_slice() {
        [] => Selection::default(),
        topics => {
            Selection::of_topics(topics.iter().map(|topic| format!("/{}", topic.trim_start_matches('/'))))
        }
    };
    let ns = |s: f64| (s.max(0.0) * NS_PER_S).round() as u64;
    selection.times_ns = options.start.map_or(0, ns)..options.end.map_or(u64::MAX, ns);
    let work = || -> anyhow::Result<u64> {
        let recording = Recording::open(file)?;
        check_topics(&recording, &selection)?;
        let (draft, mut copy) = Draft::begin(&options.output)?;
        copy::filter(&recording, &selection, &mut copy)?;
        let messages = copy.messages();
        draft.finish(copy)?;
        Ok(messages)
    };
    out!("{} messages", work().map_err(Failure::Plain)?)?;
    Ok(Outcome::Success)
}

fn check_topics(recording: &Recording, selection: &Selection) -> anyhow::Result<()> {
    let known: Vec<_> = recording.topics()?.iter().map(|topic| topic.name.clone()).collect();
    match selection.topics.iter().flatten().find(|topic| !known.contains(topic)) {
        Some(topic) => Err(anyhow!("topic {topic}: expected one of {}", known.join(", "))),
        None => Ok(()),
    }
}

/// Makes one of several.
pub fn merge(files: &[PathBuf], output: &Path) -> Result<Outcome, Failure> {
    let work = || -> anyhow::Result<u64> {
        let recordings: Result<Vec<_>, _> = files.iter().map(|file| Recording::open(file)).collect();
        let (draft, mut copy) = Draft::begin(output)?;
        copy::merge(&recordings?, &mut copy)?;
        let messages = copy.messages();
        draft.finish(copy)?;
        Ok(messages)
    };
    out!("{} messages", work().map_err(Failure::Plain)?)?;
    Ok(Outcome::Success)
}

/// Cuts one into parts.
pub fn split(file: &Path, options: &SplitOptions) -> Result<Outcome, Failure> {
    let limit = limit(options)?;
    let parts = parts(file, options, limit).map_err(Failure::Plain)?;
    if options.json {
        let object: Vec<_> =
            parts.iter().map(|(name, part)| serde_json::json!({ "file": name, "part": part })).collect();
        out!("{}", serde_json::Value::from(object))?;
    } else {
        for (name, part) in &parts {
            let span = (part.first_ns as f64 / NS_PER_S, part.last_ns as f64 / NS_PER_S);
            let messages = part.messages.values().sum::<u64>();
            out!("{name}  {:.1} to {:.1} s, {messages} messages", span.0, span.1)?;
        }
    }
    Ok(Outcome::Success)
}

fn limit(options: &SplitOptions) -> Result<Option<Limit>, Failure> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    match (options.seconds, options.megabytes) {
        (Some(s), _) if positive(s) => Ok(Some(Limit::Time((s * NS_PER_S) as u64))),
        (_, Some(megabytes)) if positive(megabytes) => Ok(Some(Limit::Bytes((megabytes * 1e6) as u64))),
        (None, None) if options.rosbag2 => Ok(None),
        (None, None) => Err(Failure::Input(anyhow!("expected --seconds, --megabytes or --rosbag2"))),
        _ => Err(Failure::Input(anyhow!("expected a number above 0"))),
    }
}

fn parts(
    file: &Path,
    options: &SplitOptions,
    limit: Option<Limit>,
) -> anyhow::Result<Vec<(String, PartFacts)>> {
    let recording = Recording::open(file)?;
    let folder = &options.output;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = |number: usize| format!("{stem}_{number}.mcap");
    let facts = copy::split(&recording, limit, |number| {
        let path = folder.join(name(number));
        let created = File::create(&path).map(BufWriter::new);
        created.map_err(|source| RecordingError::File { path, source })
    })?;
    let parts: Vec<_> = facts.into_iter().enumerate().map(|(number, part)| (name(number), part)).collect();
    if options.rosbag2 {
        let yaml = folder.join("metadata.yaml");
        let draft = folder.join("metadata.yaml.unfinished");
        std::fs::write(&draft, rosbag2::metadata_yaml(&parts, &recording.topics()?))?;
        std::fs::rename(&draft, &yaml).with_context(|| yaml.display().to_string())?;
    }
    Ok(parts)
}
