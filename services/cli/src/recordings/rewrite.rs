//! Creates recordings from other ones. A result gets its final name only when it is complete. The exit codes are those of the
//! official MCAP tool.

use std::path::Path;

use anyhow::{Context, anyhow, bail, ensure};
use regex_lite::Regex;
use sketchnav_files::draft::{Draft, Sink};
use sketchnav_recordings::copy::{self, Copy, Damaged, Limit, PartFacts};
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::rosbag2::METADATA;
use sketchnav_recordings::{Recording, RecordingError, rosbag2};
use sketchnav_schemas::time::{nanoseconds, seconds};

use super::args::{FilterOptions, RecoverOptions, SplitOptions};
use super::guard::{Guard, begin, finish};
use super::whole::{self, Lacks, Whole};
use crate::failure::{Failure, OrInput, Outcome};
use crate::folder::MadeFolders;
use crate::output::{out, say};

/// Copies everything that can be read.
pub fn recover(file: &Path, options: &RecoverOptions) -> Result<Outcome, Failure> {
    if file.is_dir() {
        let names: Vec<_> =
            whole::recordings_in(file).or_input()?.iter().map(|path| path.display().to_string()).collect();
        let (folder, names) = (file.display(), names.join(", "));
        return Err(Failure::Input(anyhow!(
            "{folder}: expected a file, because the files of a folder are recovered one by one; found {names}"
        )));
    }
    let copied = recover_file(file, options).map_err(Failure::Plain)?;
    if options.json {
        out!("{}", serde_json::to_string(&copied).context("the result as JSON")?)?;
    } else {
        let copy::Copied { messages, lost_chunks, lost_bytes, was_whole, .. } = copied;
        let end = if was_whole { "had its end" } else { "was cut off" };
        out!(
            "{messages} messages recovered; {lost_chunks} chunks and {lost_bytes} bytes lost; the file {end}"
        )?;
    }
    let is_all = !copied.has_loss() && copied.kept_damaged == 0;
    Ok(if is_all { Outcome::Success } else { Outcome::Loss })
}

fn recover_file(file: &Path, options: &RecoverOptions) -> anyhow::Result<copy::Copied> {
    let place = || file.display().to_string();
    let unpacked = Whole::best_effort(file).with_context(place)?;
    let damaged = if options.keep_damaged { Damaged::Keep } else { Damaged::LeaveOut };
    let known = |error: RecordingError| unpacked.known_error(error.into());
    let (draft, mut copy) = begin(&options.output, &copy::profile(unpacked.path()).map_err(known)?)?;
    let copied = copy::recover(unpacked.path(), damaged, &mut copy).map_err(known)?;
    // Printed first, because it explains why the copy may then be rejected.
    tell_lost(&copied);
    let guard = Guard::of([file.to_owned()]).over_all().with_force(options.force);
    finish(draft, copy, &guard)?;
    Ok(copied)
}

/// Prints which parts of the source are missing from a copy.
fn tell_lost(copied: &copy::Copied) {
    for lost in &copied.lost {
        let copy::Lost { at, bytes, reason, messages } = lost;
        let held = match messages {
            None => "it is not known how many messages it contained".to_owned(),
            Some(1) => "it contained one message".to_owned(),
            Some(messages) => format!("it contained {messages} messages, according to the file's index"),
        };
        say!("lost: {bytes} bytes from byte {at} on ({reason}); {held}");
    }
    if copied.kept_damaged > 0 {
        say!("notice: {} chunks with a wrong checksum are in the copy, as requested", copied.kept_damaged);
    }
    let is_for_checksum = |lost: &copy::Lost| lost.reason.contains("checksum of a chunk");
    if copied.lost.iter().any(is_for_checksum) {
        say!("notice: --keep-damaged copies chunks whose checksum is wrong");
    }
}

/// Copies the selected topics and period.
pub fn filter(whole: &Whole, options: &FilterOptions) -> Result<Outcome, Failure> {
    let times_ns = options.times.ns().or_input()?;
    let work = || -> anyhow::Result<Made> {
        let recording = Recording::open(whole.path())?;
        let selection = selection(&recording, options)?.between(times_ns);
        check_topics(&recording, &selection)?;
        let (draft, mut copy) = begin(&options.output, &recording.header().profile)?;
        copy::filter(&recording, &selection, &mut copy)?;
        let made = Made::of(&copy, [(whole, &recording)])?;
        finish(draft, copy, &Guard::of(whole.sources().to_vec()).with_force(options.force))?;
        Ok(made)
    };
    work().map_err(Failure::Plain)?.report(options.json)
}

fn selection(recording: &Recording, options: &FilterOptions) -> anyhow::Result<Selection> {
    if let Some(regex) = &options.regex {
        return Ok(Selection::of_topics(matching(recording, regex)?));
    }
    let topics = options.topics.iter().map(|topic| format!("/{}", topic.trim_start_matches('/')));
    Ok(if options.topics.is_empty() { Selection::default() } else { Selection::of_topics(topics) })
}

/// Returns the topics of a recording whose names, without their leading slashes, match a regular expression.
///
/// # Errors
/// If no topic matches.
pub fn matching(recording: &Recording, regex: &Regex) -> anyhow::Result<Vec<String>> {
    let known: Vec<_> = recording.topics()?.iter().map(|topic| topic.name.clone()).collect();
    let matches = |topic: &&String| regex.is_match(topic.trim_start_matches('/'));
    let found: Vec<_> = known.iter().filter(matches).cloned().collect();
    ensure!(!found.is_empty(), "--regex: expected a match of {}, found none", known.join(", "));
    Ok(found)
}

/// The result of copying whole recordings.
struct Made {
    messages: u64,
    lost: Lost,
}

impl Made {
    fn of<'a>(
        copy: &Copy<Sink>,
        sources: impl IntoIterator<Item = (&'a Whole, &'a Recording)>,
    ) -> Result<Self, RecordingError> {
        Ok(Self { messages: copy.messages(), lost: Lost::of(copy.left_out(), sources)? })
    }

    fn report(&self, json: bool) -> Result<Outcome, Failure> {
        let Self { messages, lost } = self;
        if json {
            let all = lost.all();
            out!(
                "{}",
                serde_json::json!({ "messages": messages, "cut_off": all.cut_off, "left_out": all.left_out })
            )?;
        } else {
            out!("{messages} messages")?;
        }
        Ok(lost.report())
    }
}

/// What a copy lacks, compared with the original content of its sources.
struct Lost {
    /// Losses noticed while the copy was made.
    now: Lacks,
    /// Losses noticed, and printed, while the source was put together from several files.
    before: Lacks,
}

impl Lost {
    fn of<'a>(
        left_out: &Rejections,
        sources: impl IntoIterator<Item = (&'a Whole, &'a Recording)>,
    ) -> Result<Self, RecordingError> {
        let now = Lacks { left_out: left_out.clone(), ..Lacks::default() };
        let mut lost = Self { now, before: Lacks::default() };
        for (whole, recording) in sources {
            if recording.index()?.is_cut_off() {
                lost.now.cut_off.push(whole.name().display().to_string());
            }
            lost.before.extend(whole.lacks());
        }
        Ok(lost)
    }

    fn all(&self) -> Lacks {
        let mut all = Lacks::default();
        [&self.before, &self.now].into_iter().for_each(|lacks| all.extend(lacks));
        all
    }

    /// Prints the losses. As with the official MCAP tool, copying a recording that was cut off is not a full success.
    fn report(&self) -> Outcome {
        for name in &self.now.cut_off {
            say!("notice: {name} was cut off; what was whole is in the copy");
        }
        for left_out in self.now.left_out.list() {
            say!("notice: left out {left_out}");
        }
        if self.now.is_empty() && self.before.is_empty() { Outcome::Success } else { Outcome::Loss }
    }
}

fn check_topics(recording: &Recording, selection: &Selection) -> anyhow::Result<()> {
    let known: Vec<_> = recording.topics()?.iter().map(|topic| topic.name.clone()).collect();
    match selection.topics.iter().flatten().find(|topic| !known.contains(topic)) {
        Some(topic) => Err(anyhow!("topic {topic}: expected one of {}", known.join(", "))),
        None => Ok(()),
    }
}

/// Merges several recordings into one.
pub fn merge(wholes: &[Whole], output: &Path, json: bool) -> Result<Outcome, Failure> {
    let work = || -> anyhow::Result<Made> {
        let open = |whole: &Whole| Recording::open(whole.path());
        let recordings = wholes.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        let (draft, mut copy) = begin(output, common_profile(&recordings))?;
        copy::merge(&recordings, &mut copy)?;
        let made = Made::of(&copy, wholes.iter().zip(&recordings))?;
        finish(draft, copy, &Guard::of(wholes.iter().flat_map(|whole| whole.sources().to_vec())))?;
        Ok(made)
    };
    work().map_err(Failure::Plain)?.report(json)
}

/// Returns the profile that all recordings share, or an empty string if their profiles differ.
pub fn common_profile(recordings: &[Recording]) -> &str {
    let mut profiles = recordings.iter().map(|recording| recording.header().profile.as_str());
    let first = profiles.next().unwrap_or_default();
    if profiles.all(|profile| profile == first) { first } else { "" }
}

/// Splits a recording into parts.
pub fn split(whole: &Whole, options: &SplitOptions) -> Result<Outcome, Failure> {
    let limit = limit(options)?;
    let recording = Recording::open(whole.path()).map_err(|error| Failure::Plain(error.into()))?;
    let guard = Guard::of(whole.sources().to_vec());
    let named = || options.output.display().to_string();
    let made = MadeFolders::with_parents(&options.output).with_context(named).map_err(Failure::Plain)?;
    let parts = parts(&recording, options, limit, &guard).inspect_err(|_| made.discard());
    let parts = parts.map_err(Failure::Plain)?;
    let mut left_out = Rejections::default();
    parts.iter().for_each(|(_, part)| left_out.extend(&part.left_out));
    let lost = Lost::of(&left_out, [(whole, &recording)]).map_err(|error| Failure::Plain(error.into()))?;
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
    Ok(lost.report())
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
    guard: &Guard,
) -> anyhow::Result<Vec<(String, PartFacts)>> {
    let folder = &options.output;
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
    for (draft, part) in drafts.into_iter().zip(&facts) {
        guard.place(draft, part.messages.values().sum())?;
    }
    let parts: Vec<_> = facts.into_iter().enumerate().map(|(number, part)| (name(number), part)).collect();
    if options.rosbag2 {
        let yaml = folder.join(METADATA);
        let text = rosbag2::metadata_yaml(&parts, &recording.topics()?);
        sketchnav_files::write(&yaml, text).with_context(|| yaml.display().to_string())?;
    }
    Ok(parts)
}

/// Rejects a folder that contains parts of an earlier split. These would remain there and could not be told apart from the new
/// ones.
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
