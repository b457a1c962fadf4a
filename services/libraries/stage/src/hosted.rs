//! What a stage is, and how its hosts see it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Heard, Instant, Outbox, Remains, StageError};

/// A part of a navigator.
///
/// The same messages in the same order must give the same messages, to the bit, because a host recomputes steps after a kill.
/// Everything that changes is in [`Stage::state`], except for what follows from the instructions in force: those are heard
/// again before the state is restored.
pub trait Stage {
    /// Name and version of the state's format, for example `sketch planner 5`. Change it whenever the format changes.
    const FORM: &'static str;
    /// The state as it is read back.
    type State: DeserializeOwned;

    /// Receives a message that belongs to no instant: an instruction, which is in force from now on, or a request.
    ///
    /// # Errors
    /// A message that the stage cannot work with; it ends the process. A person's request should be answered instead.
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        let _ = message;
        Ok(())
    }

    /// Sends what is to be sent outside a step: at the start, after each request, and again on resuming after a kill. It must
    /// follow from the state, because a message that was already sent is dropped by its number.
    ///
    /// # Errors
    /// As [`Stage::hear`].
    fn speak(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let _ = out;
        Ok(())
    }

    /// Whether it can take a step. While it cannot, instants wait.
    fn is_ready(&self) -> bool {
        true
    }

    /// Takes the step of an instant: reads what belongs to the instant and sends what follows from it.
    ///
    /// # Errors
    /// As [`Stage::hear`].
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let _ = (instant, out);
        Ok(())
    }

    /// Everything that changes, serialized as a [`Stage::State`] is; nothing needs to be copied for it.
    fn state(&self) -> impl Serialize;

    /// Resumes from a state.
    ///
    /// # Errors
    /// A state that does not belong to this run. The host then starts over without it: see [`Stage::recover`].
    fn restore(&mut self, state: Self::State) -> Result<(), StageError>;

    /// Starts without a state after a kill, because none can be used; `remains` has the last messages sent before. Called
    /// before anything is heard.
    fn recover(&mut self, remains: &dyn Remains) {
        let _ = remains;
    }
}

/// A stage as its hosts store it. Every [`Stage`] is one.
pub trait Hosted {
    /// As [`Stage::FORM`].
    fn form(&self) -> &'static str;
    /// As [`Stage::hear`].
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError>;
    /// As [`Stage::speak`].
    fn speak(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError>;
    /// As [`Stage::is_ready`].
    fn is_ready(&self) -> bool;
    /// As [`Stage::step`].
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError>;
    /// Writes the state to the beginning of `room` and returns its length in bytes. Allocates nothing.
    ///
    /// # Errors
    /// [`postcard::Error::SerializeBufferFull`] if there is not enough room.
    fn save(&self, room: &mut [u8]) -> Result<usize, postcard::Error>;
    /// Resumes from a state that [`Hosted::save`] wrote.
    ///
    /// # Errors
    /// Bytes that are no such state; otherwise as [`Stage::restore`].
    fn load(&mut self, state: &[u8]) -> Result<(), StageError>;
    /// As [`Stage::recover`].
    fn recover(&mut self, remains: &dyn Remains);
}

impl<S: Stage> Hosted for S {
    fn form(&self) -> &'static str {
        S::FORM
    }

    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        Stage::hear(self, message)
    }

    fn speak(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        Stage::speak(self, out)
    }

    fn is_ready(&self) -> bool {
        Stage::is_ready(self)
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        Stage::step(self, instant, out)
    }

    fn save(&self, room: &mut [u8]) -> Result<usize, postcard::Error> {
        Ok(postcard::to_slice(&self.state(), room)?.len())
    }

    fn load(&mut self, state: &[u8]) -> Result<(), StageError> {
        self.restore(postcard::from_bytes(state)?)
    }

    fn recover(&mut self, remains: &dyn Remains) {
        Stage::recover(self, remains);
    }
}
