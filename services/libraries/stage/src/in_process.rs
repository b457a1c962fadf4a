//! Holds the messages of a process in ordinary memory, for a host without channels.

use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::erased::{self, Owned};

use crate::{Denied, Inputs, Put, Reading, Sink, StageError};

/// An observer of every sent message.
pub trait Tap {
    /// Receives a message and the cells that follow it. `cells` is empty if the channel has none.
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]);
}

/// The latest message of each channel that a process writes or reads. A new message of a channel reuses the memory of an earlier
/// one. Stages can send their messages here.
#[derive(Debug, Clone, Default)]
pub struct InProcess {
    slots: Vec<Slot>,
}

#[derive(Debug, Clone)]
struct Slot {
    spec: &'static ChannelSpec,
    newest: Owned,
    /// Memory for the next message, which becomes the latest one once it is filled.
    next: Owned,
    seq: u64,
    is_fresh: bool,
}

impl InProcess {
    /// Allocates memory for the channels that `process` writes in a run with a navigator of kind `kind`.
    pub fn of_writer(process: Process, kind: &str) -> Self {
        Self::of(channels::written_by(process, kind))
    }

    /// Allocates memory for the channels that `process` reads in a run with a navigator of kind `kind`.
    pub fn of_reader(process: Process, kind: &str) -> Self {
        Self::of(channels::read_by(process, kind))
    }

    fn of(specs: impl Iterator<Item = &'static ChannelSpec>) -> Self {
        let slot =
            |spec| Slot { spec, newest: Owned::default(), next: Owned::default(), seq: 0, is_fresh: false };
        Self { slots: specs.map(slot).collect() }
    }

    /// Returns the latest message of a channel, if there is one.
    pub fn get(&self, spec: &ChannelSpec) -> Option<&Owned> {
        self.slots.iter().find(|slot| slot.spec == spec && slot.seq > 0).map(|slot| &slot.newest)
    }

    /// Stores a numbered message as the latest of its channel. Messages of channels that this process does not use are ignored.
    pub fn keep(&mut self, spec: &ChannelSpec, message: Owned) {
        if let Some(slot) = self.slots.iter_mut().find(|slot| slot.spec == spec) {
            slot.seq = erased::header(message.bytes()).seq;
            (slot.newest, slot.is_fresh) = (message, true);
        }
    }

    /// Ends the instant, so that all messages stored so far belong to an earlier one.
    pub fn end_instant(&mut self) {
        self.slots.iter_mut().for_each(|slot| slot.is_fresh = false);
    }

    /// Returns a sink that stores messages here and shows each of them to `tap`.
    pub fn tapped<'a, T: Tap>(&'a mut self, tap: &'a mut T) -> impl Sink + 'a {
        Tapped { memory: self, tap }
    }
}

impl Inputs for InProcess {
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
        let slot = self.slots.iter().find(|slot| slot.spec == spec && slot.seq > 0)?;
        let (message, cells) = (slot.newest.bytes(), slot.newest.cells());
        Some(Reading { message, cells, is_fresh: slot.is_fresh })
    }
}

impl<const N: usize> Inputs for [&InProcess; N] {
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
        self.iter().find_map(|memory| memory.newest(spec))
    }
}

impl Sink for InProcess {
    fn put(&mut self, put: Put<'_>) -> Result<u64, StageError> {
        let slot = self.slots.iter_mut().find(|slot| slot.spec == put.spec);
        let slot = slot.ok_or_else(|| Denied::to_write(put.spec))?;
        let ChannelSpec { name, max_cells, .. } = *put.spec;
        if put.cells > max_cells {
            return Err(
                format!("channel {name:?} takes at most {max_cells} cells, found {}", put.cells).into()
            );
        }
        let (message, cells) = slot.next.blank(put.spec.message.size, put.cells);
        (put.fill)(message, cells)?;
        slot.seq += u64::from(!put.is_repeated);
        let header = erased::header_mut(message);
        header.seq = slot.seq;
        if put.spec.is_sensed() {
            header.source_seq = slot.seq;
        }
        std::mem::swap(&mut slot.newest, &mut slot.next);
        slot.is_fresh = true;
        Ok(slot.seq)
    }

    fn last(&self, spec: &ChannelSpec) -> Result<u64, Denied> {
        let slot = self.slots.iter().find(|slot| slot.spec == spec);
        slot.map(|slot| slot.seq).ok_or_else(|| Denied::to_write(spec))
    }
}

struct Tapped<'a, T> {
    memory: &'a mut InProcess,
    tap: &'a mut T,
}

impl<T: Tap> Sink for Tapped<'_, T> {
    fn put(&mut self, put: Put<'_>) -> Result<u64, StageError> {
        let spec = put.spec;
        let seq = self.memory.put(put)?;
        if let Some(newest) = self.memory.get(spec) {
            self.tap.see(spec, newest.bytes(), newest.cells());
        }
        Ok(seq)
    }

    fn last(&self, spec: &ChannelSpec) -> Result<u64, Denied> {
        self.memory.last(spec)
    }
}
