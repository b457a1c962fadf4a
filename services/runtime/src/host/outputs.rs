//! The channels that a stage writes.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{self, ChannelSpec, Role};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::Header;
use sketchnav_stage::{Denied, Put, Remains, Sink, StageError};

use crate::{Node, RawWriter, Result};

/// Number of the last message of each channel, in the order of the table.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Positions(Vec<u64>);

pub(super) struct Outputs {
    writers: Vec<RawWriter>,
    /// Buffer for [`Outputs::positions`].
    positions: Positions,
}

impl Outputs {
    pub(super) fn open(node: &Node, kind: &str) -> Result<Self> {
        let writers = channels::written_by(node.process(), kind).map(|spec| node.raw_writer(spec));
        let writers: Vec<_> = writers.collect::<Result<_>>()?;
        let positions = Positions(Vec::with_capacity(writers.len()));
        Ok(Self { writers, positions })
    }

    pub(super) fn positions(&mut self) -> &Positions {
        self.positions.0.clear();
        self.positions.0.extend(self.writers.iter().map(RawWriter::last_seq));
        &self.positions
    }

    /// Resumes after the messages that a predecessor sent.
    pub(super) fn resume(&mut self, positions: &Positions) {
        for (writer, &last) in self.writers.iter_mut().zip(&positions.0) {
            writer.resume_after(last);
        }
    }

    /// Like [`Outputs::resume`], but skips channels that are already beyond the position given for them.
    pub(super) fn resume_no_earlier(&mut self, positions: &Positions) {
        for (writer, &last) in self.writers.iter_mut().zip(&positions.0) {
            writer.resume_after(last.max(writer.last_seq()));
        }
    }

    pub(super) fn resume_after_history(&mut self) {
        self.writers.iter_mut().for_each(RawWriter::resume_after_history);
    }

    pub(super) fn last_sent(&self, spec: &ChannelSpec) -> Option<Header> {
        self.writer(spec)?.last_sent().map(|kept| *erased::header(bytemuck::cast_slice(&kept)))
    }

    fn writer(&self, spec: &ChannelSpec) -> Option<&RawWriter> {
        self.writers.iter().find(|writer| writer.spec() == spec)
    }
}

impl Sink for Outputs {
    /// Sends a message. One that only observers read wakes no process, since another message of the same step follows.
    fn put(&mut self, put: Put<'_>) -> Result<u64, StageError> {
        let writer = self.writers.iter_mut().find(|writer| writer.spec() == put.spec);
        let writer = writer.ok_or_else(|| Denied::to_write(put.spec))?;
        if put.is_repeated {
            writer.resume_after(writer.last_seq().saturating_sub(1));
        }
        let mut loan = writer.loan(put.cells)?;
        let (message, cells) = loan.parts_mut();
        (put.fill)(message, cells)?;
        Ok(if put.spec.role == Role::Detail { loan.send_quietly()? } else { loan.send()? })
    }

    fn last(&self, spec: &ChannelSpec) -> std::result::Result<u64, Denied> {
        self.writer(spec).map(RawWriter::last_seq).ok_or_else(|| Denied::to_write(spec))
    }
}

impl Remains for Outputs {
    fn last(&self, spec: &ChannelSpec) -> Option<Vec<u64>> {
        let kept = self.writer(spec)?.last_sent();
        kept.filter(|message| size_of_val(message.as_slice()) == spec.message.size)
    }
}
