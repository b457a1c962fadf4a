//! The trait of a stage, and the trait through which hosts see it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;

use crate::output::RESPONSES;
use crate::{Incoming, Instant, Outbox, Remains, StageError};

/// A part of a navigator.
///
/// Given the same messages in the same order, a stage must send the same messages, bit for bit, because a
/// host repeats steps after a kill. Everything that changes must be part of [`Stage::state`], except for what
/// is derived from the current instructions, which are delivered again before the state is restored.
pub trait Stage {
    /// Name and version of the state's format, for example `sketch planner 5`. It must change whenever the format changes.
    const FORM: &'static str;
    /// The type of the state when it is read back.
    type State: DeserializeOwned;

    /// Receives a message that does not belong to an instant: either an instruction, which applies from now
    /// on, or a request.
    ///
    /// # Errors
    /// Returns an error if the stage cannot use the message. An error ends the process, so answer an invalid
    /// request from a person instead of failing.
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        let _ = message;
        Ok(())
    }

    /// Sends messages outside a step. This is called at the start, after each request, and again on resuming
    /// after a kill. The messages must be a function of the state: the host recognizes a message that was
    /// already sent by its number, and drops it.
    ///
    /// # Errors
    /// Like [`Stage::receive`].
    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let _ = out;
        Ok(())
    }

    /// Returns true if the stage can take a step. Instants wait until it can.
    fn is_ready(&self) -> bool {
        true
    }

    /// Takes the step of an instant: reads the inputs that belong to it and sends the resulting messages.
    ///
    /// # Errors
    /// Like [`Stage::receive`].
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let _ = (instant, out);
        Ok(())
    }

    /// Returns everything that changes. This must serialize exactly like a [`Stage::State`], but can borrow
    /// to avoid copies.
    fn state(&self) -> impl Serialize;

    /// Resumes from a saved state.
    ///
    /// # Errors
    /// Returns an error if the state does not belong to this run. The host then starts without it, by calling
    /// [`Stage::recover`].
    fn restore(&mut self, state: Self::State) -> Result<(), StageError>;

    /// Starts after a kill without a usable state. `remains` provides the last messages sent before the kill.
    /// This is called before the stage receives anything.
    fn recover(&mut self, remains: &dyn Remains) {
        let _ = remains;
    }
}

/// Why [`Hosted::save`] did not write the state.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The state does not fit.
    #[error("the state needs more space")]
    Full,
    /// The stage cannot be saved.
    #[error("{0}")]
    Stage(#[source] StageError),
}

impl From<postcard::Error> for SaveError {
    fn from(error: postcard::Error) -> Self {
        match error {
            postcard::Error::SerializeBufferFull => Self::Full,
            error => Self::Stage(error.into()),
        }
    }
}

/// A stage as a trait object, which is how hosts store it. Implemented by every [`Stage`].
pub trait Hosted {
    /// Returns [`Stage::FORM`].
    fn form(&self) -> &'static str;
    /// See [`Stage::receive`].
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError>;
    /// See [`Stage::announce`].
    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError>;
    /// See [`Stage::is_ready`].
    ///
    /// # Errors
    /// Returns an error if the stage cannot determine whether it is ready.
    fn is_ready(&self) -> Result<bool, StageError>;
    /// See [`Stage::step`].
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError>;
    /// Writes the state to the beginning of `room` and returns its length in bytes. Does not allocate.
    ///
    /// # Errors
    /// [`SaveError::Full`] if the state does not fit, and [`SaveError::Stage`] if the stage failed.
    fn save(&self, room: &mut [u8]) -> Result<usize, SaveError>;
    /// Resumes from a state that [`Hosted::save`] wrote.
    ///
    /// # Errors
    /// Returns an error if the bytes are not such a state, or an error of [`Stage::restore`].
    fn load(&mut self, state: &[u8]) -> Result<(), StageError>;
    /// See [`Stage::recover`].
    ///
    /// # Errors
    /// Returns an error if the stage failed.
    fn recover(&mut self, remains: &dyn Remains) -> Result<(), StageError>;
}

/// The error for a step that did not send exactly one message on each channel with which its process responds to an instant. If one
/// were missing, the other processes would wait for it forever. Only before its first response may a stage remain silent, because
/// it may still lack a reading.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{process}, tick {tick}: expected one message on channel {channel:?}, found {found}")]
pub struct Unanswered {
    /// Process that hosts the stage.
    pub process: Process,
    /// Number of the tick.
    pub tick: u64,
    /// Name of the channel.
    pub channel: &'static str,
    /// Number of messages that the stage sent.
    pub found: u32,
}

/// Lets a stage take the step of an instant, and checks its responses. Hosts call this instead of [`Hosted::step`].
///
/// # Errors
/// Any error of the stage, and [`Unanswered`] if the stage did not respond as the other processes expect.
pub fn step(stage: &mut dyn Hosted, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
    stage.step(instant, out)?;
    let (process, kind) = instant.host();
    let expected = match process {
        Process::Localizer => [1, 0, 0],
        Process::Planner => [0, 1, 1],
        _ => return Ok(()),
    };
    let mut responses = RESPONSES.into_iter().zip(out.responses).zip(expected);
    let wrong = responses.find(|((_, found), expected)| found != expected);
    let Some(((role, found), _)) = wrong else { return Ok(()) };
    match channels::of_role(role, kind) {
        Some(spec) if found > 0 || out.last_of(spec)? > 0 => {
            Err(Unanswered { process, tick: instant.tick, channel: spec.name, found }.into())
        }
        _ => Ok(()),
    }
}

impl<S: Stage> Hosted for S {
    fn form(&self) -> &'static str {
        S::FORM
    }

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        Stage::receive(self, message)
    }

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        Stage::announce(self, out)
    }

    fn is_ready(&self) -> Result<bool, StageError> {
        Ok(Stage::is_ready(self))
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        Stage::step(self, instant, out)
    }

    fn save(&self, room: &mut [u8]) -> Result<usize, SaveError> {
        Ok(postcard::to_slice(&self.state(), room)?.len())
    }

    fn load(&mut self, state: &[u8]) -> Result<(), StageError> {
        self.restore(postcard::from_bytes(state)?)
    }

    fn recover(&mut self, remains: &dyn Remains) -> Result<(), StageError> {
        Stage::recover(self, remains);
        Ok(())
    }
}
