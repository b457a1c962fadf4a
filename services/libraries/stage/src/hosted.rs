//! What a stage is, and what its hosts see of it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Heard, Instant, Outbox, Remains, StageError};

/// A part of a navigator.
///
/// The same messages in the same order must give the same messages, to the bit: a host computes steps anew after a
/// kill. All that changes is in [`Stage::state`], except for what follows from the instructions that hold: those are
/// heard again before the state is restored.
pub trait Stage {
    /// Name and version of the form of the state: `sketch planner 5`. A change of the form changes it.
    const FORM: &'static str;
    /// The state as it is read back.
    type State: DeserializeOwned;

    /// Takes in a message that belongs to no instant: an instruction that holds from now on, or a request.
    ///
    /// # Errors
    /// A message that the stage cannot work with ends its process. A request of a person should be answered instead.
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        let _ = message;
        Ok(())
    }

    /// Says what there is to say outside of a step: at its start, after each request, and again when it goes on after a
    /// kill. It must follow from the state, for a message that was sent already is dropped by its number.
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

    /// Takes the step of an instant: reads what belongs to it, sends what follows.
    ///
    /// # Errors
    /// As [`Stage::hear`].
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let _ = (instant, out);
        Ok(())
    }

    /// All that changes, written as a [`Stage::State`] is; nothing needs to be copied for it.
    fn state(&self) -> impl Serialize;

    /// Goes on from a state.
    ///
    /// # Errors
    /// A state that does not belong to this run. The host then begins anew, without it: see [`Stage::recover`].
    fn restore(&mut self, state: Self::State) -> Result<(), StageError>;

    /// Begins without a state after a kill, because none can be used: `remains` has the last messages that a
    /// predecessor sent. Called before anything is heard.
    fn recover(&mut self, remains: &dyn Remains) {
        let _ = remains;
    }
}

/// A stage as its hosts hold it. Every [`Stage`] is one.
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
    /// Writes the state to the beginning of `room`; how many bytes. Allocates nothing.
    ///
    /// # Errors
    /// [`postcard::Error::SerializeBufferFull`] if there is not room enough.
    fn save(&self, room: &mut [u8]) -> Result<usize, postcard::Error>;
    /// Goes on from a state that [`Hosted::save`] wrote.
    ///
    /// # Errors
    /// No such state, or as [`Stage::restore`].
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
