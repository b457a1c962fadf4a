//! The state of a process, stored in two alternating slots of shared memory so that the process can resume
//! after a restart.
//!
//! A slot is `version, number, length, checksum, state`. The number is 0 while the slot is being written, so a kill at any time
//! leaves the other slot intact. If both slots are valid, the one with the larger number is used. A slot that is damaged or of
//! another version is rejected and reported.
//!
//! A checkpoint need not be recent, because a stage is deterministic: from an older state and the inputs
//! since then, the restarted process computes the very same outputs. The writers' histories cover several
//! times [`CHECKPOINT_EVERY`] steps, so even the older slot is recent enough.
//!
//! Writing does not allocate, unless the state has outgrown its slot.

use std::marker::PhantomData;
use std::path::PathBuf;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::fence;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::fingerprint;
use sketchnav_stage::SaveError;

use crate::mapping::{Mapping, WORD};
use crate::node::Node;
use crate::system::System;
use crate::{Error, HostError, Result};

/// Number of steps after which a process that is driven by ticks writes a checkpoint.
pub const CHECKPOINT_EVERY: u32 = 16;
/// Length of a slot's header, in words.
const HEAD: usize = 4;
/// Indices of the header's words. The state's length is in bytes.
const VERSION: usize = 0;
const NUMBER: usize = 1;
const LENGTH: usize = 2;
const CHECKSUM: usize = 3;
/// Offset of the number in a slot's file, in bytes.
pub(crate) const NUMBER_AT: u64 = (NUMBER * WORD) as u64;
/// Offset of the state in a slot's file, in bytes.
pub(crate) const STATE_AT: u64 = (HEAD * WORD) as u64;
/// Initial length of a slot for the state, in words. A slot grows as needed.
const FIRST_LENGTH: usize = 1 << 13;
/// Initial size, in words, of the buffer for a state before it is copied to a slot. It is large enough for a planner that remembers
/// the maximum number of obstacles. For a larger state, the buffer grows once.
const FIRST_ROOM: usize = 1 << 15;

/// The two slots of a process, for a state of type `T`. The state may also be written as a borrowed form that serializes alike.
pub struct Checkpoints<T> {
    version: u64,
    slots: [Mapping; 2],
    /// The buffer for the state before it is copied into its slot.
    room: Vec<u64>,
    /// Index of the slot to be written next, which is never the latest valid one.
    next: usize,
    number: u64,
    /// Number of steps since the last checkpoint.
    steps: u32,
    state: PhantomData<fn() -> T>,
}

/// The checkpoints that an earlier instance of the process has left.
#[derive(Debug)]
pub struct Found<T> {
    /// The latest valid checkpoint, or `None` if there is none.
    pub state: Option<T>,
    /// The reason why slots were rejected.
    pub refused: Vec<Error>,
}

impl<T> Found<T> {
    /// Reports the rejected slots and the reasons.
    pub fn report(&self, node: &Node) {
        for error in &self.refused {
            node.report_fault(FaultKind::StateRefused, 0, &error.to_string());
        }
    }

    /// Returns true if there were checkpoints but none of them can be used, in which case the process has
    /// lost its state and starts from scratch.
    pub fn is_lost(&self) -> bool {
        self.state.is_none() && !self.refused.is_empty()
    }
}

/// Returns the paths of a process's slots.
pub(crate) fn slots(system: &System, process: Process) -> Result<[PathBuf; 2]> {
    let name = |slot| format!("checkpoint_{process}_{slot}");
    let [first, second] = [0, 1].map(|slot| system.shared_memory(&name(slot)));
    Ok([first?, second?])
}

impl<T: DeserializeOwned> Checkpoints<T> {
    /// Opens the slots of the node's process and reads the checkpoints of an earlier instance. `version` names the format of the
    /// state and must change with it.
    ///
    /// # Errors
    /// [`Error::File`] if shared memory is full or inaccessible.
    pub fn open(node: &Node, version: &str) -> Result<(Self, Found<T>)> {
        Self::open_with(node, version, |bytes| postcard::from_bytes(bytes))
    }

    #[cfg(test)]
    fn open_at(slots: [PathBuf; 2], version: &str) -> Result<(Self, Found<T>)> {
        Self::open_slots(slots, version, |bytes| postcard::from_bytes(bytes))
    }
}

impl<T> Checkpoints<T> {
    /// Like [`Checkpoints::open`], but reads the state with `parse`.
    pub(crate) fn open_with(
        node: &Node,
        version: &str,
        parse: impl Fn(&[u8]) -> postcard::Result<T>,
    ) -> Result<(Self, Found<T>)> {
        Self::open_slots(slots(node.system(), node.process())?, version, parse)
    }

    fn open_slots(
        [first, second]: [PathBuf; 2],
        version: &str,
        parse: impl Fn(&[u8]) -> postcard::Result<T>,
    ) -> Result<(Self, Found<T>)> {
        let slots = [Mapping::open(&first, FIRST_LENGTH)?, Mapping::open(&second, FIRST_LENGTH)?];
        let version = fingerprint(&format!("{version} of sketchnav {}", env!("CARGO_PKG_VERSION")));
        let room = vec![0; FIRST_ROOM];
        let mut checkpoints = Self { version, slots, room, next: 0, number: 0, steps: 0, state: PhantomData };
        let found = checkpoints.read(parse);
        Ok((checkpoints, found))
    }

    fn read(&mut self, parse: impl Fn(&[u8]) -> postcard::Result<T>) -> Found<T> {
        let mut found = Found { state: None, refused: Vec::new() };
        for slot in 0..self.slots.len() {
            let [_, number, ..] = self.head(slot);
            match self.read_slot(slot, &parse) {
                Ok(Some(state)) if number > self.number => {
                    (self.number, self.next, found.state) = (number, 1 - slot, Some(state));
                }
                Ok(_) => {}
                Err(error) => found.refused.push(error),
            }
        }
        found
    }

    fn head(&self, slot: usize) -> [u64; HEAD] {
        let mut head = [0; HEAD];
        self.slots[slot].read(0, &mut head);
        head
    }

    /// Returns the state in a slot, or `None` if the slot is empty or was being written when the process was killed.
    fn read_slot(&self, slot: usize, parse: impl Fn(&[u8]) -> postcard::Result<T>) -> Result<Option<T>> {
        let [version, number, length, found] = self.head(slot);
        if number == 0 {
            return Ok(None);
        }
        let refuse = |why: String| self.refusal(slot, why);
        if version != self.version {
            return Err(refuse(format!("expected version {:016x}, found {version:016x}", self.version)));
        }
        let room = (self.slots[slot].words().len() - HEAD) * WORD;
        let bytes = usize::try_from(length).ok().filter(|&bytes| bytes <= room);
        let bytes =
            bytes.ok_or_else(|| refuse(format!("expected at most {room} bytes of state, found {length}")))?;
        let mut state = vec![0; bytes.div_ceil(WORD)];
        self.slots[slot].read(HEAD, &mut state);
        let state = &bytemuck::cast_slice(&state)[..bytes];
        let sum = checksum([version, number, length], state);
        if sum != found {
            return Err(refuse(format!("expected a state of checksum {found:08x}, found one of {sum:08x}")));
        }
        parse(state).map(Some).map_err(|error| refuse(error.to_string()))
    }

    fn refusal(&self, slot: usize, why: String) -> Error {
        Error::BadCheckpoint { path: self.slots[slot].path().into(), why }
    }

    /// Marks the latest checkpoint as unusable, and returns the reason as an error. A successor then uses the other slot, if it is
    /// valid.
    pub(crate) fn refuse_newest(&mut self, why: &str) -> Error {
        let newest = 1 - self.next;
        self.slots[newest].words()[VERSION].store(0, SeqCst);
        self.refusal(newest, why.to_owned())
    }

    /// Counts a step. Returns true if a checkpoint is due, which is the case after every [`CHECKPOINT_EVERY`] steps.
    pub(crate) fn is_due_after_step(&mut self) -> bool {
        self.steps += 1;
        self.steps >= CHECKPOINT_EVERY
    }

    /// Counts a step, and writes a checkpoint after every [`CHECKPOINT_EVERY`] steps.
    ///
    /// # Errors
    /// See [`Checkpoints::write`].
    pub fn after_step<S: Serialize>(&mut self, state: impl FnOnce() -> S) -> Result<()> {
        if self.is_due_after_step() { self.write(&state()) } else { Ok(()) }
    }

    /// Writes a checkpoint. `state` must serialize in the same way as a `T`.
    ///
    /// # Errors
    /// [`Error::File`] if the state has outgrown its slot and shared memory is full, in which case the
    /// previous content is kept.
    pub fn write(&mut self, state: &impl Serialize) -> Result<()> {
        let written = self.write_with(|room| Ok(postcard::to_slice(state, room)?.len()));
        written.map_err(|error| match error {
            HostError::Runtime(error) => error,
            HostError::Stage(error) => {
                self.refusal(self.next, format!("the state cannot be written: {error}"))
            }
        })
    }

    /// Like [`Checkpoints::write`], but `save` writes the state to the beginning of the given buffer and returns its length in
    /// bytes. If the buffer is too small, `save` is called again with a larger one.
    pub(crate) fn write_with(
        &mut self,
        save: impl FnMut(&mut [u8]) -> Result<usize, SaveError>,
    ) -> Result<(), HostError> {
        let length = self.fill(save)?;
        let (number, slot) = (self.number + 1, &mut self.slots[self.next]);
        let state = &self.room[..length.div_ceil(WORD)];
        slot.words()[NUMBER].store(0, SeqCst);
        fence(SeqCst);
        slot.grow(HEAD + state.len())?;
        slot.write(HEAD, state);
        let head = [self.version, number, length as u64];
        let sum = checksum(head, &bytemuck::cast_slice(state)[..length]);
        for (word, value) in [(VERSION, self.version), (LENGTH, length as u64), (CHECKSUM, sum)] {
            slot.words()[word].store(value, SeqCst);
        }
        fence(SeqCst);
        slot.words()[NUMBER].store(number, SeqCst);
        (self.number, self.next, self.steps) = (number, 1 - self.next, 0);
        Ok(())
    }

    /// Makes `save` write the state to [`Self::room`], and returns its length in bytes.
    fn fill(
        &mut self,
        mut save: impl FnMut(&mut [u8]) -> Result<usize, SaveError>,
    ) -> Result<usize, HostError> {
        loop {
            match save(bytemuck::cast_slice_mut(&mut self.room)) {
                Ok(length) => return Ok(length),
                Err(SaveError::Full) => self.room.resize(2 * self.room.len(), 0),
                Err(SaveError::Stage(error)) => return Err(error.into()),
            }
        }
    }
}

fn checksum(head: [u64; CHECKSUM], state: &[u8]) -> u64 {
    let mut hasher = crc32fast::Hasher::new();
    head.iter().for_each(|word| hasher.update(&word.to_ne_bytes()));
    hasher.update(state);
    hasher.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    type State = (u64, Vec<u32>);

    struct Place(tempfile::TempDir);

    impl Place {
        fn new() -> Self {
            Self(tempfile::tempdir().unwrap())
        }

        fn slot(&self, slot: usize) -> PathBuf {
            self.0.path().join(format!("slot{slot}"))
        }

        fn open(&self, version: &str) -> (Checkpoints<State>, Found<State>) {
            Checkpoints::open_at([self.slot(0), self.slot(1)], version).unwrap()
        }

        /// Writes the states 1 to `count`, the last of them to slot `(count + 1) % 2`.
        fn write(&self, count: u64) {
            let (mut checkpoints, _) = self.open("test 1");
            (1..=count).for_each(|i| checkpoints.write(&state(i)).unwrap());
        }

        fn flip(&self, slot: usize, byte: usize) {
            let mut bytes = std::fs::read(self.slot(slot)).unwrap();
            bytes[byte] ^= 0x10;
            std::fs::write(self.slot(slot), bytes).unwrap();
        }
    }

    fn state(i: u64) -> State {
        (i, vec![7; i as usize])
    }

    #[test]
    fn the_newest_counts() {
        let place = Place::new();
        assert_eq!(place.open("test 1").1.state, None);
        for count in [1, 1, 2, 5] {
            place.write(count);
            let found = place.open("test 1").1;
            assert_eq!((found.state, found.refused.len()), (Some(state(count)), 0));
        }
    }

    #[test]
    fn the_checkpoint_grows_with_the_state() {
        let place = Place::new();
        let large = (1, vec![u32::MAX; 3 * FIRST_ROOM * WORD]);
        place.open("test 1").0.write(&large).unwrap();
        assert_eq!(place.open("test 1").1.state, Some(large));
    }

    #[test]
    fn a_kill_during_writing_leaves_the_previous_checkpoint() {
        let place = Place::new();
        place.write(4);
        let (checkpoints, _) = place.open("test 1");
        // The state of the slot before the last two lines of `write`.
        checkpoints.slots[0].words()[NUMBER].store(0, SeqCst);
        checkpoints.slots[0].write(HEAD, &[5; 3]);
        let (mut successor, found) = place.open("test 1");
        assert_eq!((found.state, found.refused.len()), (Some(state(4)), 0));
        successor.write(&state(6)).unwrap();
        assert_eq!(place.open("test 1").1.state, Some(state(6)));
    }

    #[test]
    fn with_any_byte_flipped_the_other_slot_is_used() {
        let place = Place::new();
        place.write(4);
        let whole = std::fs::read(place.slot(1)).unwrap();
        for byte in 0..HEAD * WORD + 6 {
            place.flip(1, byte);
            let found = place.open("test 1").1;
            assert_eq!(found.state, Some(state(3)), "byte {byte}");
            assert!(found.refused[0].to_string().contains("checkpoint refused: expected"), "{found:?}");
            std::fs::write(place.slot(1), &whole).unwrap();
        }
    }

    /// Regression test: a state that its stage rejected used to end the process for good, and the mission with it.
    #[test]
    fn a_state_that_a_stage_refused_is_not_offered_again() {
        let place = Place::new();
        place.write(4);
        for newest in [4, 3] {
            let (mut checkpoints, found) = place.open("test 1");
            assert_eq!(found.state, Some(state(newest)));
            let error = checkpoints.refuse_newest("expected 2 routes, found 3").to_string();
            assert!(error.contains("expected 2 routes"), "{error}");
        }
        assert!(place.open("test 1").1.is_lost());
    }

    #[test]
    fn a_checkpoint_of_another_version_is_refused() {
        let place = Place::new();
        place.write(4);
        let (mut checkpoints, found) = place.open("test 2");
        assert!(found.is_lost());
        assert!(
            found.refused.iter().all(|error| error.to_string().contains("expected version")),
            "{found:?}"
        );
        checkpoints.write(&state(9)).unwrap();
        let found = place.open("test 2").1;
        assert_eq!((found.state, found.refused.len()), (Some(state(9)), 1));
    }
}
