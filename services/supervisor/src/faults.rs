//! Reports faults of the processes and recoveries from them on the channel `faults`.

use std::os::unix::process::ExitStatusExt;
use std::time::Duration;

use sketchnav_runtime::{Node, Notice, Notices, Ordered, Writer};
use sketchnav_schemas::channels::FAULTS;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::fault_plan::Starvation;
use sketchnav_schemas::message::{Fault, Header, Text};

use crate::{Death, Result};

/// The recorder's report that it could not write its files for some time, or until the end.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordingFailure {
    /// The last reason given by the recorder.
    pub words: String,
    /// Number of messages that the recorder has reported missing.
    pub missing: u64,
}

/// The supervisor's writer of `faults`, and the notices of other processes and tools.
pub(crate) struct Faults {
    /// Writer of the channel, or `None` if the channel is ceded.
    writer: Option<Writer<Fault>>,
    notices: Notices,
    /// Header of the mission's last status.
    now: Header,
    recording_stands: bool,
    recording_failure: Option<RecordingFailure>,
    /// Orders requested by tools, oldest first.
    orders: Vec<Ordered>,
    /// Processes whose starvation has begun, by process id.
    starved: Vec<(u32, Starvation)>,
}

impl Faults {
    pub(crate) fn open(node: &Node, is_ceded: bool) -> Result<Self> {
        let mut writer = (!is_ceded).then(|| node.writer(FAULTS)).transpose()?;
        writer.iter_mut().for_each(Writer::resume_after_history);
        let now = Header { seq: 0, stamp_ns: 0, source_seq: 0 };
        Ok(Self {
            writer,
            notices: Notices::open(node.system())?,
            now,
            recording_stands: false,
            recording_failure: None,
            orders: Vec::new(),
            starved: Vec::new(),
        })
    }

    /// Takes the header of the mission's last status, which the following reports are stamped with.
    pub(crate) fn is_now(&mut self, header: Header) {
        self.now = header;
    }

    /// Returns true if the recorder is waiting for space on its disk.
    pub(crate) fn recording_stands(&self) -> bool {
        self.recording_stands
    }

    /// Returns the recorder's report about files that it could not write, if there is one.
    pub(crate) fn take_recording_failure(&mut self) -> Option<RecordingFailure> {
        self.recording_failure.take()
    }

    /// Publishes the notices of other processes and tools.
    pub(crate) fn pass_on(&mut self) -> Result<()> {
        while let Some(notice) = self.notices.receive()? {
            let Notice { kind, process, pid, signal, missing, words, order, starvation } = notice;
            if kind == FaultKind::RecordingFailed || kind == FaultKind::RecordingResumed {
                self.note_recording_failure(kind, missing, &words);
            }
            self.orders.extend(order);
            self.starved.extend(starvation.map(|starvation| (pid, starvation)));
            self.report(kind, process, pid, |fault| {
                (fault.signal, fault.missing, fault.words) = (signal, missing, Text::new(&words));
                let duration_ms = starvation.map_or(0, |starvation| starvation.duration_ms);
                fault.duration_ns = Duration::from_millis(duration_ms).as_nanos() as u64;
            })?;
        }
        Ok(())
    }

    fn note_recording_failure(&mut self, kind: FaultKind, missing: u32, words: &str) {
        let failure = self.recording_failure.get_or_insert_default();
        failure.missing = failure.missing.max(missing.into());
        if kind == FaultKind::RecordingFailed {
            words.clone_into(&mut failure.words);
        }
    }

    /// Returns the orders that tools have requested since the last call.
    pub(crate) fn take_orders(&mut self) -> Vec<Ordered> {
        std::mem::take(&mut self.orders)
    }

    /// Returns the processes, by process id, whose starvation has begun since the last call.
    pub(crate) fn take_starved(&mut self) -> Vec<(u32, Starvation)> {
        std::mem::take(&mut self.starved)
    }

    /// Publishes a report. `fill` sets the fields that depend on its kind.
    pub(crate) fn report(
        &mut self,
        kind: FaultKind,
        process: Process,
        pid: u32,
        fill: impl FnOnce(&mut Fault),
    ) -> Result<()> {
        match kind {
            FaultKind::RecordingFailed => self.recording_stands = true,
            FaultKind::RecordingResumed => self.recording_stands = false,
            _ => {}
        }
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.send(|fault| {
            fault.header = Header { seq: 0, ..self.now };
            (fault.kind, fault.process, fault.pid) = (kind.code(), process.code(), pid);
            fill(fault);
        })?;
        Ok(())
    }

    /// Reports a death, after any notices about it.
    pub(crate) fn died(&mut self, death: &Death) -> Result<()> {
        self.pass_on()?;
        self.report(FaultKind::Died, death.process, death.pid, |fault| {
            fault.signal = death.status.signal().unwrap_or(0) as u32;
            fault.exit_code = death.status.code().unwrap_or(0) as u32;
            fault.words = Text::new(&death.how());
        })
    }

    /// Reports that a process is unresponsive, and the supervisor's response.
    pub(crate) fn unresponsive(
        &mut self,
        process: Process,
        pid: u32,
        for_: Duration,
        words: &str,
    ) -> Result<()> {
        self.report(FaultKind::Unresponsive, process, pid, |fault| {
            fault.duration_ns = for_.as_nanos() as u64;
            fault.words = Text::new(words);
        })
    }
}
