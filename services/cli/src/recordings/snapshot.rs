//! Saves the last seconds of a running system by copying the end of its recording, which continues to grow.
//!
//! Nothing has to be buffered in memory, because the recorder writes everything to its file within a second.
//! The snapshot waits until the file contains everything that had been sent when the snapshot was requested.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, ensure};
use sketchnav_recorder::disk::part;
use sketchnav_recordings::Recording;
use sketchnav_recordings::copy::window;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::series;
use sketchnav_runtime::{Node, SendTimes, Wake};
use sketchnav_schemas::channels::{self, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::time::seconds;

use super::guard::{Guard, begin, finish};
use super::rewrite::matching;
use crate::args::SnapshotOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::systems;

/// Interval at which to look at the file.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Maximum time that the recorder may take to write messages that were sent.
const PATIENCE: Duration = Duration::from_secs(10);

/// Copies the end of a recording that is still being written.
pub fn snapshot(options: &SnapshotOptions) -> Result<Outcome, Failure> {
    let on = options.on.as_deref().map(known).transpose()?;
    let system = systems::find(options.system.as_deref())?;
    let name = system.name().to_owned();
    let run = system.run_config().or_input()?;
    let recording = run.recording.as_ref().with_context(|| format!("{name}: expected a system that records"));
    let recording = PathBuf::from(recording.or_input()?);
    if let Some(spec) = on.filter(|spec| !spec.belongs_to(run.mission.navigator_kind())) {
        let kind = run.mission.navigator_kind();
        let expected = channels::names_of_kind(kind);
        return Err(Failure::Input(anyhow!(
            "--on {}: expected one of {expected} of navigator {kind:?}",
            spec.name
        )));
    }
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    if let Some(spec) = on {
        wait_for_message(&node, spec)?;
    }
    wait(&node, options.after)?;
    let end_ns = now_ns(&node)?;
    let parts = wait_for_file(&node, &recording, end_ns)?;
    let start_ns = end_ns.saturating_sub(options.last.as_nanos().try_into().unwrap_or(u64::MAX));
    let messages = copy(&parts, options, start_ns..end_ns.saturating_add(1))?;
    if options.json {
        let (start_s, end_s) = (seconds(start_ns), seconds(end_ns));
        let object = serde_json::json!({
            "output": options.output, "messages": messages, "start_s": start_s, "end_s": end_s,
        });
        out!("{object}")?;
    } else {
        out!("{messages} messages from {:.1} to {:.1} s", seconds(start_ns), seconds(end_ns))?;
    }
    Ok(Outcome::Success)
}

fn known(name: &str) -> Result<&'static channels::ChannelSpec, Failure> {
    let unknown = || anyhow!("--on {name:?}: expected one of {}", channels::names());
    channels::find(name).ok_or_else(unknown).or_input()
}

fn wait_for_message(node: &Node, spec: &'static channels::ChannelSpec) -> anyhow::Result<()> {
    let mut reader = node.raw_reader(spec)?;
    if spec.writer.is_some() {
        reader.resume_after(SendTimes::open(node, spec)?.newest());
    }
    while reader.receive()?.is_none() {
        wait(node, LOOK_EVERY)?;
    }
    Ok(())
}

fn wait(node: &Node, time: Duration) -> anyhow::Result<()> {
    ensure!(node.nap(time) != Wake::Terminate, "interrupted, or the system has ended, before the snapshot");
    Ok(())
}

/// Returns the simulated time of the last tick, in nanoseconds.
fn now_ns(node: &Node) -> anyhow::Result<u64> {
    let ticks = SendTimes::open(node, TICK.spec)?;
    let newest = ticks.of(ticks.newest()).context("expected a system that has begun, found no tick")?;
    Ok(newest.header.stamp_ns)
}

/// Returns the parts of a recording once they contain everything that was sent by this time.
fn wait_for_file(node: &Node, path: &Path, end_ns: u64) -> anyhow::Result<Vec<Recording>> {
    let limit = Instant::now() + PATIENCE;
    loop {
        let parts = parts(path)?;
        let mut last_ns = 0;
        for part in &parts {
            last_ns = last_ns.max(part.index()?.span_ns().map_or(0, |(_, last_ns)| last_ns));
        }
        if last_ns >= end_ns {
            return Ok(parts);
        }
        let found = seconds(last_ns);
        ensure!(
            Instant::now() < limit,
            "{}: expected messages up to {:.1} s within {} s, found {found:.1} s",
            path.display(),
            seconds(end_ns),
            PATIENCE.as_secs()
        );
        wait(node, LOOK_EVERY)?;
    }
}

/// Returns the files that a recorder, or several in succession, have written so far.
fn parts(path: &Path) -> anyhow::Result<Vec<Recording>> {
    let files = (1..).map(|number| part(path, number)).take_while(|file| file.exists());
    let files = files.chain(series::files(path)?);
    // A file that was only just begun is empty.
    let files = files.filter(|file| file.metadata().is_ok_and(|found| found.len() > 0));
    let parts = files.map(|file| Recording::open(&file)).collect::<Result<Vec<_>, _>>()?;
    ensure!(!parts.is_empty(), "{}: expected the recording of the system, found none", path.display());
    Ok(parts)
}

fn copy(
    parts: &[Recording],
    options: &SnapshotOptions,
    times_ns: std::ops::Range<u64>,
) -> Result<u64, Failure> {
    let topics = options.regex.as_ref().map(|regex| matching(&parts[0], regex)).transpose().or_input()?;
    let selection = topics.map_or_else(Selection::default, Selection::of_topics).between(times_ns);
    let (draft, mut copy) = begin(&options.output, "ros2").or_input()?;
    window(parts, &selection, &mut copy).map_err(anyhow::Error::from)?;
    let messages = copy.messages();
    finish(draft, copy, &Guard::of(parts.iter().map(|part| part.path().to_owned())))?;
    Ok(messages)
}
