//! The functional core of the recorder. It writes messages to the file, counts them, and reports the last tick up to which the file
//! is safe.
//!
//! Messages are taken in passes. A pass drains the ticks first and then every other channel in the order of the table, so at its
//! end, everything sent before its last tick has been written. If the disk is full, the core continues without writing, so that the
//! robot keeps driving and a lockstep world, which waits for the recorder, is not stopped. Once there is space again, another core
//! takes over. The core does not open files, read clocks or print.

use std::io::Write;

use sketchnav_recordings::reader::Attachment;
use sketchnav_recordings::writer::Latched;
use sketchnav_recordings::{RecordingError, Writer};
use sketchnav_schemas::channels::{ChannelSpec, MAX_CHANNELS, RECORDED_EVERY, Role};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Header, Recorded};
use sketchnav_schemas::run::RunConfig;

/// The last sequence numbers of the recorded channels, in the order of the table, padded with zeros.
pub type Positions = [u64; MAX_CHANNELS];

/// The recorder's state.
pub struct Core<W: Write> {
    /// `None` once writing has failed.
    writer: Option<Writer<W>>,
    report: Report,
    newest_tick: Header,
    acknowledged_tick: u64,
}

/// Counts of the messages so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Report {
    /// Number of messages in the file, including transforms.
    pub messages: u64,
    /// Number of messages missing according to the sequence numbers.
    pub missing: u64,
    /// Number of messages that were rejected as malformed.
    pub refused: u64,
    /// Number of messages that arrived after writing had failed.
    pub unrecorded: u64,
    /// Why writing failed, or `None` if it did not.
    pub failure: Option<String>,
}

impl<W: Write> Core<W> {
    /// Begins the recording of `run` in `sink`, which should be buffered. `files` are the files that belong to the run.
    ///
    /// # Errors
    /// [`RecordingError`] if not even the beginning can be written.
    pub fn new(sink: W, run: &RunConfig, files: &[Attachment]) -> Result<Self, RecordingError> {
        Self::at(sink, run, files, 0)
    }

    /// Like [`Core::new`], for a file that begins at this time of the run, in nanoseconds.
    ///
    /// # Errors
    /// Any error of [`Core::new`].
    pub fn at(sink: W, run: &RunConfig, files: &[Attachment], begin_ns: u64) -> Result<Self, RecordingError> {
        let writer = Some(Writer::create_at(sink, run, files, begin_ns)?);
        let newest_tick = Header { seq: 0, stamp_ns: 0, source_seq: 0 };
        Ok(Self { writer, report: Report::default(), newest_tick, acknowledged_tick: 0 })
    }

    /// Creates a core that cannot write because of `failure`, and only counts the messages.
    pub fn failed(failure: String) -> Self {
        let newest_tick = Header { seq: 0, stamp_ns: 0, source_seq: 0 };
        let report = Report { failure: Some(failure), ..Report::default() };
        Self { writer: None, report, newest_tick, acknowledged_tick: 0 }
    }

    /// Returns true if writing has failed.
    pub fn has_failed(&self) -> bool {
        self.writer.is_none()
    }

    /// Continues after an earlier part of the recording. That part contains everything up to `positions`, the last sequence
    /// numbers of the recorded channels in the order of the table. The tick `acknowledged_tick` has been acknowledged to
    /// the world.
    pub fn resume_after(&mut self, positions: &Positions, acknowledged_tick: u64) {
        if let Some(writer) = &mut self.writer {
            writer.resume_after(*positions);
        }
        (self.newest_tick.seq, self.acknowledged_tick) = (acknowledged_tick, acknowledged_tick);
    }

    /// Removes and returns the messages that the next file must begin with: the last message of each latched channel.
    pub fn take_latched(&mut self) -> Vec<Option<Latched>> {
        self.writer.as_mut().map(Writer::take_latched).unwrap_or_default()
    }

    /// Begins the file with the messages that were latched in the previous one.
    ///
    /// # Errors
    /// [`RecordingError`] if the sink fails, which is reported only once.
    pub fn repeat(&mut self, latched: Vec<Option<Latched>>, stamp_ns: u64) -> Result<(), RecordingError> {
        match self.writer.as_mut().map_or(Ok(()), |writer| writer.repeat(latched, stamp_ns)) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.fail(error)),
        }
    }

    /// Records in the file how often its recorder was killed and restarted.
    pub fn survived(&mut self, restarts: u32) {
        if let Some(writer) = &mut self.writer {
            writer.survived(restarts);
        }
    }

    /// Returns the last sequence number of each recorded channel, in the order of the table.
    pub fn positions(&self) -> Positions {
        let mut positions = Positions::default();
        let topics = self.writer.iter().flat_map(|writer| writer.topics());
        for (position, topic) in positions.iter_mut().zip(topics) {
            *position = topic.sequence.last();
        }
        positions
    }

    /// Writes a message to the file.
    ///
    /// # Errors
    /// [`RecordingError`] if the message is malformed, or if the sink fails. A failure of the sink is
    /// reported only once, and later messages are counted and dropped. In either case, the recorder
    /// continues.
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

    /// Ends a pass over all channels. If enough ticks have arrived since the last acknowledgement, flushes the file and
    /// returns the next acknowledgement for the world.
    ///
    /// # Errors
    /// [`RecordingError`] if the sink fails, which is reported only once.
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

    /// Flushes the file, so that everything written so far survives a kill.
    ///
    /// # Errors
    /// [`RecordingError`] if the sink fails, which is reported only once.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        match self.writer.as_mut().map_or(Ok(()), Writer::flush) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.fail(error)),
        }
    }

    /// Drops the sink and returns the error. The caller may then repair the file.
    fn fail(&mut self, error: RecordingError) -> RecordingError {
        self.report = self.report();
        self.report.failure = Some(error.to_string());
        self.writer = None;
        error
    }

    /// Returns the counts so far.
    pub fn report(&self) -> Report {
        let mut report = self.report.clone();
        if let Some(writer) = &self.writer {
            report.messages = writer.message_count();
            report.missing = writer.topics().iter().map(|topic| topic.sequence.missing()).sum();
        }
        report
    }

    /// Ends the recording. Returns the flushed sink, unless writing has failed.
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
