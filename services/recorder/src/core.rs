//! What the recorder does with messages: writes them down, counts, says what is safe.
//!
//! Takes the messages in passes. A pass drains the ticks first, then every other channel in the order of the table. So
//! at its end everything that was sent before its last tick is written. When the disk is full it goes on without
//! writing. So the robot drives on, and the world in lockstep, which waits for the recorder, is not stopped. When
//! there is room again, another core takes over. Never opens a file, reads a clock or prints.

use std::io::Write;

use sketchnav_recordings::reader::Attachment;
use sketchnav_recordings::writer::Latched;
use sketchnav_recordings::{RecordingError, Writer};
use sketchnav_schemas::channels::{ChannelSpec, MAX_CHANNELS, RECORDED_EVERY, Role};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Recorded};
use sketchnav_schemas::run::RunConfig;

/// The last numbers of the recorded channels, in the order of the table; zeros behind.
pub type Positions = [u64; MAX_CHANNELS];

/// The recorder's state.
pub struct Core<W: Write> {
    /// `None` from the moment that it failed.
    writer: Option<Writer<W>>,
    report: Report,
    newest_tick: Header,
    acknowledged_tick: u64,
}

/// What became of the messages so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Report {
    /// Messages in the file, transforms included.
    pub messages: u64,
    /// Messages that their numbers show to be missing.
    pub missing: u64,
    /// Messages that were refused as malformed.
    pub refused: u64,
    /// Messages that came after the file had failed.
    pub unrecorded: u64,
    /// Why the file failed; `None` where it did not.
    pub failure: Option<String>,
}

impl<W: Write> Core<W> {
    /// Begins the recording of `run` in `sink`, which should be buffered; `files` are those that the run is
    /// made of.
    ///
    /// # Errors
    /// [`RecordingError`] where not even the beginning can be written.
    pub fn new(sink: W, run: &RunConfig, files: &[Attachment]) -> Result<Self, RecordingError> {
        Self::at(sink, run, files, 0)
    }

    /// The same of a file that begins at this time of the run, nanoseconds.
    ///
    /// # Errors
    /// As [`Core::new`].
    pub fn at(sink: W, run: &RunConfig, files: &[Attachment], begin_ns: u64) -> Result<Self, RecordingError> {
        let writer = Some(Writer::create_at(sink, run, files, begin_ns)?);
        let newest_tick = Header { seq: 0, stamp_ns: 0, source_seq: 0 };
        Ok(Self { writer, report: Report::default(), newest_tick, acknowledged_tick: 0 })
    }

    /// A recorder that cannot write, for the reason `failure`, and counts what it does not write.
    pub fn failed(failure: String) -> Self {
        let newest_tick = Header { seq: 0, stamp_ns: 0, source_seq: 0 };
        let report = Report { failure: Some(failure), ..Report::default() };
        Self { writer: None, report, newest_tick, acknowledged_tick: 0 }
    }

    /// Whether the sink has failed.
    pub fn has_failed(&self) -> bool {
        self.writer.is_none()
    }

    /// Goes on after an earlier part of the recording. That part holds everything up to `positions`, the last number
    /// of each recorded channel in the order of the table. The tick `acknowledged_tick` was acknowledged to the world.
    pub fn resume_after(&mut self, positions: &Positions, acknowledged_tick: u64) {
        if let Some(writer) = &mut self.writer {
            writer.resume_after(*positions);
        }
        (self.newest_tick.seq, self.acknowledged_tick) = (acknowledged_tick, acknowledged_tick);
    }

    /// Takes what a next file is to begin with: the last message of each latched channel.
    pub fn take_latched(&mut self) -> Vec<Option<Latched>> {
        self.writer.as_mut().map(Writer::take_latched).unwrap_or_default()
    }

    /// Begins with what was latched in the file before.
    ///
    /// # Errors
    /// The sink has failed, which is said once.
    pub fn repeat(&mut self, latched: Vec<Option<Latched>>, stamp_ns: u64) -> Result<(), RecordingError> {
        match self.writer.as_mut().map_or(Ok(()), |writer| writer.repeat(latched, stamp_ns)) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.fail(error)),
        }
    }

    /// Has the recording say how often its recorder was killed and started again.
    pub fn survived(&mut self, restarts: u32) {
        if let Some(writer) = &mut self.writer {
            writer.survived(restarts);
        }
    }

    /// The last number of each recorded channel, in the order of the table.
    pub fn positions(&self) -> Positions {
        let mut positions = Positions::default();
        let topics = self.writer.iter().flat_map(|writer| writer.topics());
        for (position, topic) in positions.iter_mut().zip(topics) {
            *position = topic.sequence.last();
        }
        positions
    }

    /// Writes a message down.
    ///
    /// # Errors
    /// A malformed message; or the sink has failed, which is said once: later messages are counted
    /// and dropped. In either case the recorder goes on.
    pub fn record(
        &mut self,
        spec: &'static ChannelSpec,
        message: &[u8],
        cells: &[u8],
    ) -> Result<(), RecordingError> {
        if spec.role == Role::Tick {
            self.newest_tick = *erased::header(message);
        }
        let Some(writer) = &mut self.writer else {
            self.report.unrecorded += 1;
            return Ok(());
        };
        match writer.write_bytes(spec, message, cells) {
            Ok(_) => Ok(()),
            Err(error) if error.is_one_message() => {
                self.report.refused += 1;
                Err(error)
            }
            Err(error) => {
                self.report.unrecorded += 1;
                Err(self.fail(error))
            }
        }
    }

    /// Ends a pass over all channels. Gives what to tell the world, where so many ticks came since the
    /// last time that it is due: they are flushed then.
    ///
    /// # Errors
    /// The sink has failed, which is said once.
    pub fn end_pass(&mut self) -> Result<Option<Recorded>, RecordingError> {
        let newest = self.newest_tick;
        if newest.seq < self.acknowledged_tick + RECORDED_EVERY {
            return Ok(None);
        }
        self.flush()?;
        self.acknowledged_tick = newest.seq;
        let header = Header { seq: 0, stamp_ns: newest.stamp_ns, source_seq: newest.seq };
        Ok(Some(Recorded { header, message_count: self.report().messages }))
    }

    /// Makes everything so far survive a kill.
    ///
    /// # Errors
    /// The sink has failed, which is said once.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        match self.writer.as_mut().map_or(Ok(()), Writer::flush) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.fail(error)),
        }
    }

    /// Lets go of the sink: it may be mended when this returns.
    fn fail(&mut self, error: RecordingError) -> RecordingError {
        self.report = self.report();
        self.report.failure = Some(error.to_string());
        self.writer = None;
        error
    }

    /// How it stands.
    pub fn report(&self) -> Report {
        let mut report = self.report.clone();
        if let Some(writer) = &self.writer {
            report.messages = writer.message_count();
            report.missing = writer.topics().iter().map(|topic| topic.sequence.missing()).sum();
        }
        report
    }

    /// Ends the recording; the sink, flushed, where it has not failed.
    pub fn finish(mut self) -> (Report, Option<W>) {
        let mut report = self.report();
        let Some(writer) = self.writer.take() else { return (report, None) };
        match writer.finish() {
            Ok(sink) => (report, Some(sink)),
            Err(error) => {
                report.failure = Some(error.to_string());
                (report, None)
            }
        }
    }
}
