//! The process that writes all channels to a file. It is a thin shell around [`core::Core`].
//!
//! Messages do not wake the recorder. Instead, it drains all channels every few milliseconds, in the order of the table. In
//! lockstep, it acknowledges to the world the last tick up to which the file is safe, so that the world never runs further ahead
//! than the capacity of the channels.
//!
//! A full disk does not stop the robot. The recorder reports the failure and, once there is space again, continues in a new part
//! with the messages that the channels still contain, and counts the missing ones.
//!
//! If the recorder is killed, the restarted one continues in a new part with the messages after the last
//! checkpoint, which it takes from the channels' histories. At the end, the parts are joined into one file.
//!
//! If the run asks for files of a certain size or duration, the parts are those files and are kept (see
//! `series.rs`).

// `say!` prints, and escapes characters that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod attempts;
pub mod core;
pub mod disk;
mod latencies;
mod series;

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use sketchnav_recordings::writer::Latched;
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_runtime::{Checkpoints, Found, HealthReporter, Node, RawReader, Step, Wake, Writer};
use sketchnav_schemas::channels::{self, RECORDED, Role};
use sketchnav_schemas::codes::FaultKind;
use sketchnav_schemas::message::Recorded;
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_schemas::say;

use crate::attempts::Attempts;
use crate::core::{Core, Positions, Report};
use crate::disk::{Disk, part, set_aside};
use crate::latencies::Latencies;

/// Time to sleep between two passes.
const NAP: Duration = Duration::from_millis(5);
/// Maximum time between two flushes that are also synced to the device.
const SYNC_PERIOD: Duration = Duration::from_secs(1);
/// Name and version of the format of [`State`].
const CHECKPOINT: &str = "recorder 6";

/// The recording lacks messages, or is in parts, because its files could not be written.
#[derive(Debug, thiserror::Error)]
#[error("the recording is incomplete by {missing} messages: {failure}")]
pub struct Incomplete {
    /// Number of messages that are in none of the recording's files.
    pub missing: u64,
    /// The reason.
    pub failure: String,
}

/// The state that a restarted recorder resumes from.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct State {
    /// The numbers of this recording's parts, from 1. The last part is being written. Numbers whose files already existed
    /// belong to other recordings and are skipped.
    parts: Vec<u32>,
    /// Number of times that the recorder was killed and restarted.
    restarts: u32,
    /// The last sequence numbers that are safe in the parts so far.
    positions: Positions,
    acknowledged_tick: u64,
    /// Simulated time of the acknowledged tick, in nanoseconds.
    acknowledged_ns: u64,
    /// Simulated start time of the current file, in nanoseconds.
    began_ns: u64,
}

/// Records all channels of `node`'s system until it is asked to end, including everything that was sent by then.
///
/// # Errors
/// An error if the run does not specify a recording, if its file cannot be created, or if a channel fails. At
/// the end, [`Incomplete`] if the recording lacks messages or is in parts.
pub fn run(node: &Node) -> anyhow::Result<()> {
    let mut recorder = Recorder::open(node)?;
    while node.nap(NAP) != Wake::Terminate {
        recorder.pass()?;
    }
    recorder.end()
}

type FileCore = Core<BufWriter<File>>;

/// The recorder of a node's system.
pub struct Recorder<'a> {
    node: &'a Node,
    run: RunConfig,
    checkpoints: Checkpoints<State>,
    state: State,
    core: FileCore,
    /// `None` if not even the beginning of the file could be written.
    disk: Option<Disk>,
    /// Schedules further attempts if the disk is full.
    attempts: Attempts,
    inputs: Vec<Input>,
    /// `None` unless the world waits for the recorder.
    acknowledgements: Option<Writer<Recorded>>,
    latencies: Latencies,
    health: HealthReporter,
    synced: Instant,
    stamp_ns: u64,
}

impl<'a> Recorder<'a> {
    /// Begins the recording that the node's run names, or its next part, and opens all channels.
    ///
    /// # Errors
    /// Any error of [`run`].
    pub fn open(node: &'a Node) -> anyhow::Result<Self> {
        let run = node.run_config()?;
        let path = path(&run)?;
        let (mut checkpoints, found) = Checkpoints::open(node, CHECKPOINT)?;
        found.report(node);
        let mut state = resume(&run, path, found).with_context(|| path.display().to_string())?;
        let is_successor = !state.parts.is_empty();
        let (mut core, disk) = match begin_part(&run, &mut checkpoints, &mut state) {
            Ok((core, disk)) => (core, Some(disk)),
            // The robot is driving. It should not be stopped just because its recorder was killed while the disk was full.
            Err(error) if is_successor => (Core::failed(format!("{error:#}")), None),
            Err(error) => return Err(error),
        };
        core.resume_after(&state.positions, state.acknowledged_tick);
        core.survived(state.restarts);
        let kind = run.mission.navigator_kind().to_owned();
        let inputs = Input::all(node, &kind)?;
        let waits = run.pace == Pace::Lockstep;
        let mut recorder = Self {
            node,
            run,
            checkpoints,
            state,
            core,
            disk,
            attempts: Attempts::new(),
            inputs,
            acknowledgements: waits.then(|| node.writer(RECORDED)).transpose()?,
            latencies: Latencies::open(node, &kind)?,
            health: HealthReporter::new(node)?,
            synced: Instant::now(),
            stamp_ns: 0,
        };
        recorder.stamp_ns = recorder.state.acknowledged_ns;
        if is_successor {
            recorder.catch_up()?;
        }
        Ok(recorder)
    }

    /// Takes the messages that follow those which the predecessor had safely written.
    fn catch_up(&mut self) -> anyhow::Result<()> {
        for (input, position) in self.inputs.iter_mut().zip(self.state.positions) {
            for error in input.catch_up(self.node, position, &mut self.core)? {
                complain(self.node, self.disk.as_ref(), &error);
            }
        }
        if let Some(writer) = &mut self.acknowledgements {
            writer.resume_after_history();
        }
        Ok(())
    }

    /// Drains every channel once, and sends the world an acknowledgement if one is due.
    ///
    /// # Errors
    /// An error if a channel fails. Rejected messages and a full disk are only printed.
    pub fn pass(&mut self) -> anyhow::Result<()> {
        let step = Step::begin();
        self.latencies.send()?;
        self.drain()?;
        let due = self.core.end_pass();
        if let Some(recorded) = self.reported(due).flatten() {
            self.stamp_ns = recorded.header.stamp_ns;
            self.acknowledge(&recorded)?;
            self.cut_if_due()?;
        }
        self.sync_if_due();
        if self.core.has_failed() {
            self.retry_if_due()?;
        }
        self.health.end(step);
        Ok(self.health.report_if_due(self.stamp_ns)?)
    }

    /// Continues in a new part if another attempt is due and the disk has space again.
    fn retry_if_due(&mut self) -> anyhow::Result<()> {
        if self.attempts.is_due(Instant::now()) { self.retry() } else { Ok(()) }
    }

    fn retry(&mut self) -> anyhow::Result<()> {
        self.state.began_ns = self.state.acknowledged_ns;
        let begun = begin_part(&self.run, &mut self.checkpoints, &mut self.state);
        let Ok((mut core, disk)) = begun else { return Ok(()) };
        core.resume_after(&self.state.positions, self.state.acknowledged_tick);
        core.survived(self.state.restarts);
        (self.core, self.disk) = (core, Some(disk));
        self.catch_up()?;
        let missing = self.core.report().missing;
        let number = self.state.parts.last().copied().unwrap_or(1);
        let file = file(&self.run, path(&self.run)?, number);
        let words = format!("recording again, in {}: {missing} messages missing so far", file.display());
        self.node.report_fault(FaultKind::RecordingResumed, missing, &words);
        Ok(())
    }

    /// Continues in the next file if the run asks for several files and this one is full. Everything written so far is
    /// safe, and has been acknowledged to the world.
    fn cut_if_due(&mut self) -> anyhow::Result<()> {
        let bytes = self.disk.as_ref().map_or(0, Disk::whole_bytes);
        let is_full = self.run.split.is_full(bytes, self.stamp_ns.saturating_sub(self.state.began_ns));
        if !is_full || self.core.has_failed() {
            return Ok(());
        }
        let latched = self.core.take_latched();
        let failed = Core::failed("the next file does not exist yet".to_owned());
        let (report, _sink) = std::mem::replace(&mut self.core, failed).finish();
        if let Some(failure) = report.failure {
            self.fail(failure);
            return Ok(());
        }
        if let Some(Err(error)) = self.disk.as_ref().map(Disk::sync) {
            say!("a file of the recording could not be synced to the device: {error}");
        }
        self.begin_next(latched)
    }

    /// Begins the next file with the latched messages.
    fn begin_next(&mut self, latched: Vec<Option<Latched>>) -> anyhow::Result<()> {
        self.state.began_ns = self.stamp_ns;
        match begin_part(&self.run, &mut self.checkpoints, &mut self.state) {
            Ok((core, disk)) => (self.core, self.disk) = (core, Some(disk)),
            Err(error) => {
                self.disk = None;
                self.fail(format!("{error:#}"));
                return Ok(());
            }
        }
        self.core.resume_after(&self.state.positions, self.state.acknowledged_tick);
        self.core.survived(self.state.restarts);
        let repeated = self.core.repeat(latched, self.stamp_ns);
        self.reported(repeated);
        Ok(())
    }

    /// Reports that the recording failed between two files. Further attempts follow, as after any other failure.
    fn fail(&mut self, failure: String) {
        let words = format!("{failure}; the mission continues; the recording so far remains readable");
        self.node.report_fault(FaultKind::RecordingFailed, 0, &words);
        if let Some(Err(error)) = self.disk.as_ref().map(Disk::cut_back) {
            say!("its last part may be cut off: {error}");
        }
        self.core = Core::failed(failure);
    }

    /// Drains every channel one last time and ends the file.
    ///
    /// # Errors
    /// An error if a channel fails, or [`Incomplete`] if the recording lacks messages or is in parts.
    pub fn end(mut self) -> anyhow::Result<()> {
        self.health.report(self.stamp_ns)?;
        self.latencies.send()?;
        if self.core.has_failed() {
            // There may be space by now, and the channels still have some messages.
            self.retry()?;
        }
        self.take_all(|_| true)?;
        self.drain_histories()?;
        let (mut report, _sink) = self.core.finish();
        if report.failure.is_none() {
            let whole = make_whole(&self.run, &self.state, self.disk.as_ref(), &mut report);
            report.failure = whole.err().map(|error| format!("{error:#}"));
        } else if let Some(Err(error)) = self.disk.as_ref().map(Disk::cut_back) {
            say!("its last part may be cut off: {error}");
        }
        report_end(self.node, &report)
    }

    /// Takes the messages from the channels' histories that no writer has delivered. A recorder that starts late, in a
    /// mission of a few instants, finds writers that ended before they connected to it.
    fn drain_histories(&mut self) -> anyhow::Result<()> {
        for input in &mut self.inputs {
            let (spec, core, mut complaints) = (input.reader.spec(), &mut self.core, Vec::new());
            input
                .reader
                .take_kept(self.node, |message| complaints.extend(core.record(spec, message, &[]).err()))?;
            complaints.iter().for_each(|error| complain(self.node, self.disk.as_ref(), error));
        }
        Ok(())
    }

    fn drain(&mut self) -> anyhow::Result<()> {
        let (has_failed, node) = (self.core.has_failed(), self.node);
        self.take_all(|input| !(has_failed && input.waits_for_room(node)))
    }

    /// Takes everything that has arrived on the `wanted` channels. Ticks are taken first, so that everything that was sent
    /// before the last of them is taken, too.
    fn take_all(&mut self, mut wanted: impl FnMut(&mut Input) -> bool) -> anyhow::Result<()> {
        for is_tick in [true, false] {
            let turn = self.inputs.iter_mut().filter(|input| input.is_tick() == is_tick);
            for input in turn {
                if wanted(input) {
                    take_all(input, self.node, self.disk.as_ref(), &mut self.core)?;
                }
            }
        }
        Ok(())
    }

    fn acknowledge(&mut self, recorded: &Recorded) -> anyhow::Result<()> {
        // This must precede the acknowledgement, which lets the channels forget these messages.
        self.state.acknowledged_tick = recorded.header.source_seq;
        self.state.acknowledged_ns = recorded.header.stamp_ns;
        if let Some(disk) = self.disk.as_mut().filter(|_| !self.core.has_failed()) {
            disk.mark_whole()?;
            self.state.positions = self.core.positions();
        }
        self.checkpoints.write(&self.state)?;
        self.node.note_progress();
        if let Some(writer) = &mut self.acknowledgements {
            writer.send(|message| *message = *recorded)?;
        }
        Ok(())
    }

    fn sync_if_due(&mut self) {
        if self.synced.elapsed() < SYNC_PERIOD {
            return;
        }
        self.synced = Instant::now();
        let flushed = self.core.flush();
        let is_flushed = self.reported(flushed).is_some() && !self.core.has_failed();
        if let Some(disk) = self.disk.as_mut().filter(|_| is_flushed) {
            match disk.mark_whole().and_then(|()| disk.sync()) {
                Ok(()) => self.attempts.succeeded(),
                Err(error) => say!("the recording could not be synced to the device: {error}"),
            }
        }
    }

    fn reported<T>(&self, result: Result<T, RecordingError>) -> Option<T> {
        result.inspect_err(|error| complain(self.node, self.disk.as_ref(), error)).ok()
    }
}

/// Takes everything that has arrived on a channel.
fn take_all(
    input: &mut Input,
    node: &Node,
    disk: Option<&Disk>,
    core: &mut FileCore,
) -> sketchnav_runtime::Result<()> {
    while let Some(said) = input.record_next(core)? {
        if let Err(error) = said {
            complain(node, disk, &error);
        }
    }
    Ok(())
}

/// Reports an error. A file that failed is truncated to its complete part.
fn complain(node: &Node, disk: Option<&Disk>, error: &RecordingError) {
    if error.is_one_message() {
        node.count_refused();
        say!("refused: {error}");
        return;
    }
    let words = format!("{error}; the mission continues; the recording so far remains readable");
    node.report_fault(FaultKind::RecordingFailed, 0, &words);
    if let Some(Err(error)) = disk.map(Disk::cut_back) {
        say!("its last part may be cut off: {error}");
    }
}

/// Prints how the recording ended. If messages are missing, also reports that to the supervisor, because only the recorder can
/// count them.
fn report_end(node: &Node, report: &Report) -> anyhow::Result<()> {
    let Report { messages, refused, .. } = report;
    let missing = report.missing + report.unrecorded;
    say!("{messages} messages recorded, {missing} missing, {refused} refused");
    let Some(failure) = report.failure.clone() else { return Ok(()) };
    node.report_fault(FaultKind::RecordingFailed, missing, &failure);
    Err(Incomplete { missing, failure }.into())
}

fn path(run: &RunConfig) -> anyhow::Result<&Path> {
    run.recording.as_ref().map(Path::new).context("run.json: expected the recording's path, found none")
}

/// Returns the file of the part with the given number, from 1.
fn file(run: &RunConfig, path: &Path, number: u32) -> PathBuf {
    match run.split.is_never() {
        true => part(path, number),
        false => sketchnav_recordings::series::file(path, number - 1),
    }
}

/// Returns the state to resume from. If no checkpoint can be used, the recording continues after the existing parts of this run,
/// with whatever messages the channels still have.
fn resume(run: &RunConfig, path: &Path, found: Found<State>) -> std::io::Result<State> {
    let is_lost = found.is_lost();
    match found.state {
        Some(state) => Ok(State { restarts: state.restarts + 1, began_ns: state.acknowledged_ns, ..state }),
        None if is_lost => {
            let there = (1..u32::MAX).take_while(|&number| file(run, path, number).exists());
            let parts = there.filter(|&number| is_of(run, &file(run, path, number))).collect();
            Ok(State { parts, ..State::default() })
        }
        None => set_aside(&file(run, path, 1)).map(|()| State::default()),
    }
}

/// Returns true if a file is a recording of this run. An earlier version may have begun it without a method.
fn is_of(run: &RunConfig, file: &Path) -> bool {
    let Ok(found) = Recording::open(file).and_then(|recording| recording.run()) else { return false };
    let method = if run.method.is_empty() { found.method.clone() } else { run.method.clone() };
    found == RunConfig { files_of: None, method, ..run.clone() }
}

/// Begins the next part, under the first free name after the last one. The part is in the checkpoint before its file exists,
/// so that a successor finds every part that contains something.
fn begin_part(
    run: &RunConfig,
    checkpoints: &mut Checkpoints<State>,
    state: &mut State,
) -> anyhow::Result<(FileCore, Disk)> {
    let path = path(run)?;
    for number in state.parts.last().map_or(1, |last| last + 1).. {
        let file = file(run, path, number);
        if file.symlink_metadata().is_ok() {
            continue;
        }
        state.parts.push(number);
        checkpoints.write(state)?;
        let begun = begin(run, &file, state);
        if begun.is_ok() {
            return begun;
        }
        state.parts.pop();
        checkpoints.write(state)?;
        // Another process may have taken the name in the meantime.
        if file.symlink_metadata().is_err() {
            return begun;
        }
    }
    anyhow::bail!("{}: expected a free name for a part", path.display())
}

/// Begins a file that does not exist yet. If that fails, no file is left behind.
fn begin(run: &RunConfig, path: &Path, state: &State) -> anyhow::Result<(FileCore, Disk)> {
    let name = || path.display().to_string();
    let created = Disk::create(path);
    let created = created.with_context(|| format!("{}: the recording cannot be created", name()))?;
    let begun = begin_in(created, run, state).with_context(name);
    if begun.is_err() {
        // The incomplete file contains no message.
        let _ = std::fs::remove_file(path);
    }
    begun
}

fn begin_in(
    (mut disk, sink): (Disk, BufWriter<File>),
    run: &RunConfig,
    state: &State,
) -> anyhow::Result<(FileCore, Disk)> {
    let files = sketchnav_recordings::sources::to_record(run)?;
    let core = Core::at(sink, run, &files, state.began_ns)?;
    disk.mark_whole()?;
    Ok((core, disk))
}

/// Syncs the last part to the device and makes one recording of all parts, either a single file or a series of files.
fn make_whole(
    run: &RunConfig,
    state: &State,
    disk: Option<&Disk>,
    report: &mut Report,
) -> anyhow::Result<()> {
    disk.map_or(Ok(()), Disk::sync).context("its last part was not written to the device")?;
    let path = path(run)?;
    let parts: Vec<_> = state.parts.iter().map(|&number| file(run, path, number)).collect();
    if !run.split.is_never() {
        return series::close(path, parts, report).context("the recording's files");
    }
    if parts == [path] {
        return Ok(());
    }
    let names = parts.iter().map(|part| part.display().to_string()).collect::<Vec<_>>().join(", ");
    join(run, state, &parts, report).with_context(|| format!("its parts {names} cannot be joined"))
}

/// Joins the parts into one file. A kill while joining leaves all parts, which are then joined again.
fn join(run: &RunConfig, state: &State, parts: &[PathBuf], report: &mut Report) -> anyhow::Result<()> {
    let path = path(run)?;
    let whole = path.with_extension("joined.mcap");
    let joined = join_as(&whole, run, state, parts, report);
    if joined.is_err() {
        // The parts still exist, and a partial copy of them would be in the way.
        let _ = std::fs::remove_file(&whole);
    }
    joined?;
    if parts.first().is_none_or(|first| first != path) {
        set_aside(path)?;
    }
    std::fs::rename(&whole, path)?;
    for part in parts.iter().filter(|part| *part != path && part.exists()) {
        std::fs::remove_file(part)?;
    }
    Ok(())
}

fn join_as(
    whole: &Path,
    run: &RunConfig,
    state: &State,
    parts: &[PathBuf],
    report: &mut Report,
) -> anyhow::Result<()> {
    let sink = BufWriter::new(File::create(whole)?);
    let mut writer = sketchnav_recordings::join(parts, run, sink)?;
    writer.survived(state.restarts);
    report.messages = writer.message_count();
    report.missing = writer.topics().iter().map(|topic| topic.sequence.missing()).sum();
    writer.finish()?.get_ref().sync_data()?;
    Ok(())
}

/// A channel that is recorded.
struct Input {
    reader: RawReader,
    /// True if the messages stay in the channel until a file can be written.
    is_waiting: bool,
}

impl Input {
    /// Opens all recorded channels of the run, in the order of the table.
    fn all(node: &Node, kind: &str) -> sketchnav_runtime::Result<Vec<Self>> {
        let recorded = channels::of_kind(kind).filter(|spec| spec.is_recorded());
        recorded.map(|spec| Ok(Self { reader: node.raw_reader(spec)?, is_waiting: false })).collect()
    }

    fn is_tick(&self) -> bool {
        self.reader.spec().role == Role::Tick
    }

    /// Takes the next message, if one has arrived, and returns the core's result.
    fn record_next(
        &mut self,
        core: &mut FileCore,
    ) -> sketchnav_runtime::Result<Option<Result<(), RecordingError>>> {
        let sample = self.reader.receive()?;
        Ok(sample.map(|sample| core.record(self.reader.spec(), sample.message(), sample.cells())))
    }

    /// Returns true if the messages stay in the channel while writing has failed. That applies to messages with cells, which are
    /// stored nowhere else. When writing fails, the reader is opened again so that it receives the history once more, because the
    /// latest messages may have been in the part that was truncated. If the reader cannot be opened, the old one still receives new
    /// messages.
    fn waits_for_room(&mut self, node: &Node) -> bool {
        if self.reader.spec().max_cells == 0 {
            return false;
        }
        if !self.is_waiting {
            self.is_waiting = true;
            if let Ok(reader) = node.raw_reader(self.reader.spec()) {
                self.reader = reader;
            }
        }
        true
    }

    /// Resumes after the message `position`, starting with the messages in the channel's history, and returns the core's errors.
    /// Messages with cells wait in the channel itself. Right after a recorder's death none are there yet: they arrive once the
    /// writer has noticed the new reader, and a writer that has also died sends its last message again.
    fn catch_up(
        &mut self,
        node: &Node,
        position: u64,
        core: &mut FileCore,
    ) -> sketchnav_runtime::Result<Vec<RecordingError>> {
        let (spec, mut complaints) = (self.reader.spec(), Vec::new());
        self.reader.resume_after(position);
        self.reader.take_kept(node, |message| complaints.extend(core.record(spec, message, &[]).err()))?;
        if std::mem::take(&mut self.is_waiting) || spec.max_cells > 0 {
            while let Some(said) = self.record_next(core)? {
                complaints.extend(said.err());
            }
        }
        Ok(complaints)
    }
}
