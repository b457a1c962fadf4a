//! Reports what goes wrong with the processes, and right again: the channel `faults`.

use std::os::unix::process::ExitStatusExt;
use std::time::Duration;

use sketchnav_runtime::{Node, Notice, Notices, Ordered, Writer};
use sketchnav_schemas::channels::FAULTS;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::fault_plan::Starvation;
use sketchnav_schemas::message::{Fault, Header, Text};

use crate::{Death, Result};

/// The recorder could not write its files for some time, or to the end.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordingFailure {
    /// What the recorder said last of why not.
    pub words: String,
    /// The messages that it knows to be missing.
    pub missing: u64,
}

/// The supervisor's end of the channel, and what others have it say there.
pub(crate) struct Faults {
    /// None where the channel is ceded.
    writer: Option<Writer<Fault>>,
    notices: Notices,
    /// Of the mission's last status.
    now: Header,
    recording_stands: bool,
    recording_failure: Option<RecordingFailure>,
    /// What tools have it order, in turn.
    orders: Vec<Ordered>,
    /// Who is starved from now on, by process id.
    starved: Vec<(u32, Starvation)>,
}

impl Faults {
    pub(crate) fn open(node: &Node, is_ceded: bool) -> Result<Self> {
        let mut writer = (!is_ceded).then(|| node.writer(FAULTS)).transpose()?;
        writer.iter_mut().for_each(Writer::resume_behind_history);
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

    /// What is reported from here on happened after the status with this header.
    pub(crate) fn is_now(&mut self, header: Header) {
        self.now = header;
    }

    /// Whether the recorder waits for room on its disk.
    pub(crate) fn recording_stands(&self) -> bool {
        self.recording_stands
    }

    /// What the recorder says of files that it could not write, if it has said so.
    pub(crate) fn take_recording_failure(&mut self) -> Option<RecordingFailure> {
        self.recording_failure.take()
    }

    /// Reports what others have noticed.
    pub(crate) fn pass_on(&mut self) -> Result<()> {
        while let Some(notice) = self.notices.receive()? {
            let Notice { kind, process, pid, signal, missing, words, order, starvation } = notice;
            if kind == FaultKind::RecordingFailed || kind == FaultKind::RecordingResumed {
                self.hear_of_the_recording(kind, missing, &words);
            }
            self.orders.extend(order);
            self.starved.extend(starvation.map(|starvation| (pid, starvation)));
            self.tell(kind, process, pid, |fault| {
                (fault.signal, fault.missing, fault.words) = (signal, missing, Text::new(&words));
                let duration_ms = starvation.map_or(0, |starvation| starvation.duration_ms);
                fault.duration_ns = Duration::from_millis(duration_ms).as_nanos() as u64;
            })?;
        }
        Ok(())
    }

    fn hear_of_the_recording(&mut self, kind: FaultKind, missing: u32, words: &str) {
        let failure = self.recording_failure.get_or_insert_default();
        failure.missing = failure.missing.max(missing.into());
        if kind == FaultKind::RecordingFailed {
            words.clone_into(&mut failure.words);
        }
    }

    /// What tools have the supervisor order since the last call.
    pub(crate) fn take_orders(&mut self) -> Vec<Ordered> {
        std::mem::take(&mut self.orders)
    }

    /// Who is starved since the last call, by process id.
    pub(crate) fn take_starved(&mut self) -> Vec<(u32, Starvation)> {
        std::mem::take(&mut self.starved)
    }

    /// Reports something; `fill` adds to it.
    pub(crate) fn tell(
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

    /// Reports a death, behind what others say about it.
    pub(crate) fn died(&mut self, death: &Death) -> Result<()> {
        self.pass_on()?;
        self.tell(FaultKind::Died, death.process, death.pid, |fault| {
            fault.signal = death.status.signal().unwrap_or(0) as u32;
            fault.exit_code = death.status.code().unwrap_or(0) as u32;
            fault.words = Text::new(&death.how());
        })
    }

    /// Reports that a process is unresponsive, and what the supervisor does about it.
    pub(crate) fn unresponsive(
        &mut self,
        process: Process,
        pid: u32,
        for_: Duration,
        words: &str,
    ) -> Result<()> {
        self.tell(FaultKind::Unresponsive, process, pid, |fault| {
            fault.duration_ns = for_.as_nanos() as u64;
            fault.words = Text::new(words);
        })
    }
}
