//! The process that writes every channel to a file: a thin shell around [`core::Core`].
//!
//! It is not woken by messages: every few milliseconds it drains all channels, in the order of the
//! table. In lockstep it tells the world what is safe in the file, so that the world never runs
//! further ahead than the channels can hold. A full disk does not stop the robot.

pub mod core;
pub mod disk;

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use sketchnav_recordings::RecordingError;
use sketchnav_runtime::{HealthReporter, Node, Reader, SliceReader, Step, Wake, Writer};
use sketchnav_schemas::channels::{self, Channel, ChannelVisitor, RECORDED};
use sketchnav_schemas::message::Recorded;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::{Pace, RunConfig};

use crate::core::{Core, Report};
use crate::disk::Disk;

/// Sleep between two looks at the channels.
const NAP: Duration = Duration::from_millis(5);
/// How often what is written is flushed and handed to the device, at least.
const SYNC_PERIOD: Duration = Duration::from_secs(1);

/// Records all channels of `node`'s system until it is asked to end; then what was sent by then, too.
///
/// # Errors
/// The run names no recording, its file cannot be begun, a channel fails; or, at the end, the
/// recording is incomplete because the disk was full.
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
    core: FileCore,
    disk: Disk,
    inputs: Vec<Box<dyn Input>>,
    /// Where the world waits for it.
    acknowledgements: Option<Writer<Recorded>>,
    health: HealthReporter,
    synced: Instant,
    stamp_ns: u64,
}

impl<'a> Recorder<'a> {
    /// Begins the recording that the node's run names, and reads all channels.
    ///
    /// # Errors
    /// As [`run`].
    pub fn open(node: &'a Node) -> anyhow::Result<Self> {
        let run = node.run_config()?;
        let (core, disk) = begin(&run)?;
        let mut inputs = OpenInputs { node, inputs: Vec::new() };
        channels::visit(&mut inputs)?;
        let waits = run.pace == Pace::Lockstep;
        Ok(Self {
            node,
            core,
            disk,
            inputs: inputs.inputs,
            acknowledgements: waits.then(|| node.writer(RECORDED)).transpose()?,
            health: HealthReporter::new(node)?,
            synced: Instant::now(),
            stamp_ns: 0,
        })
    }

    /// Drains every channel once, and tells the world where that is due.
    ///
    /// # Errors
    /// A channel fails. A message that is refused and a disk that is full are printed.
    pub fn pass(&mut self) -> anyhow::Result<()> {
        let step = Step::begin();
        self.drain()?;
        let due = self.core.end_pass();
        if let Some(recorded) = self.told(due).flatten() {
            self.stamp_ns = recorded.header.stamp_ns;
            self.acknowledge(&recorded)?;
        }
        self.sync_if_due();
        self.health.end(step);
        Ok(self.health.report_if_due(self.stamp_ns)?)
    }

    /// Drains every channel a last time and ends the file.
    ///
    /// # Errors
    /// A channel fails, or the recording is incomplete.
    pub fn end(mut self) -> anyhow::Result<()> {
        self.health.report(self.stamp_ns)?;
        self.drain()?;
        let (report, _sink) = self.core.finish();
        match report.failure {
            None => self.disk.sync().context("the recording's last part is not on the device")?,
            Some(_) => self.disk.cut_back().context("the recording's last part may be cut off")?,
        }
        tell(&report)
    }

    fn drain(&mut self) -> anyhow::Result<()> {
        for input in &mut self.inputs {
            while let Some(said) = input.record_next(&mut self.core)? {
                if let Err(error) = said {
                    complain(self.node, &self.disk, &error);
                }
            }
        }
        Ok(())
    }

    fn acknowledge(&mut self, recorded: &Recorded) -> anyhow::Result<()> {
        self.disk.mark_whole()?;
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
        if self.told(flushed).is_some() && self.core.report().failure.is_none() {
            let synced = self.disk.mark_whole().and_then(|()| self.disk.sync());
            if let Err(error) = synced {
                eprintln!("the recording is not on the device yet: {error}");
            }
        }
    }

    fn told<T>(&self, result: Result<T, RecordingError>) -> Option<T> {
        result.inspect_err(|error| complain(self.node, &self.disk, error)).ok()
    }
}

/// Says what went wrong; a file that failed is cut back to what is whole.
fn complain(node: &Node, disk: &Disk, error: &RecordingError) {
    if error.is_one_message() {
        node.count_refused();
        eprintln!("refused: {error}");
        return;
    }
    eprintln!("{error}; the mission goes on, the recording so far stays readable");
    if let Err(error) = disk.cut_back() {
        eprintln!("its last part may be cut off: {error}");
    }
}

fn tell(report: &Report) -> anyhow::Result<()> {
    let Report { messages, missing, refused, unrecorded, failure } = report;
    eprintln!("{messages} messages recorded, {missing} missing, {refused} refused");
    match failure {
        None => Ok(()),
        Some(failure) => {
            Err(anyhow::anyhow!("the recording is incomplete by {unrecorded} messages: {failure}"))
        }
    }
}

fn begin(run: &RunConfig) -> anyhow::Result<(FileCore, Disk)> {
    let path = run.recording.as_ref().context("run.json: expected the recording's path, found none")?;
    let (mut disk, sink) =
        Disk::create(Path::new(path)).with_context(|| format!("{path}: the recording cannot be begun"))?;
    let core = Core::new(sink, run).with_context(|| path.clone())?;
    disk.mark_whole().with_context(|| path.clone())?;
    Ok((core, disk))
}

/// A channel that is recorded.
trait Input {
    /// Takes the next message, where one has come, and what the core said to it.
    fn record_next(
        &mut self,
        core: &mut FileCore,
    ) -> sketchnav_runtime::Result<Option<Result<(), RecordingError>>>;
}

struct Fixed<T: Ros2> {
    channel: Channel<T>,
    reader: Reader<T>,
}

impl<T: Ros2> Input for Fixed<T> {
    fn record_next(
        &mut self,
        core: &mut FileCore,
    ) -> sketchnav_runtime::Result<Option<Result<(), RecordingError>>> {
        Ok(self.reader.receive()?.map(|message| core.record(self.channel, &*message, &[])))
    }
}

struct Sliced<T: Ros2> {
    channel: Channel<T>,
    reader: SliceReader<T>,
}

impl<T: Ros2> Input for Sliced<T> {
    fn record_next(
        &mut self,
        core: &mut FileCore,
    ) -> sketchnav_runtime::Result<Option<Result<(), RecordingError>>> {
        let sample = self.reader.receive()?;
        Ok(sample.map(|sample| core.record(self.channel, sample.message(), sample.bytes())))
    }
}

/// Opens a reader of every channel that is recorded.
struct OpenInputs<'a> {
    node: &'a Node,
    inputs: Vec<Box<dyn Input>>,
}

impl ChannelVisitor for OpenInputs<'_> {
    type Error = sketchnav_runtime::Error;

    fn fixed<T: Ros2>(&mut self, channel: Channel<T>) -> sketchnav_runtime::Result<()> {
        if channel.spec.recorded {
            self.inputs.push(Box::new(Fixed { channel, reader: self.node.reader(channel)? }));
        }
        Ok(())
    }

    fn sliced<T: Ros2>(&mut self, channel: Channel<T>) -> sketchnav_runtime::Result<()> {
        if channel.spec.recorded {
            self.inputs.push(Box::new(Sliced { channel, reader: self.node.slice_reader(channel)? }));
        }
        Ok(())
    }
}
