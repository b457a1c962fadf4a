//! A stage: one part of a navigator, as a pure function from messages to messages, with its state.
//!
//! A navigator has three stages. The *sketcher* takes in what a person gives; the *localizer* says in what situation
//! the robot is; the *planner* drives. Each is declared once, by [`Stage`], and hosted three times.
//! `sketchnav-runtime` hosts it as a process over shared memory. `sketchnav-rehearsal` hosts it in one process without
//! that, and against a recording. Channels, positions, checkpoints, waiting and health are the hosts'.
//!
//! - [`Stage`]: what the author of a navigator writes.
//! - [`Instant`] has the inputs of a step. [`Heard`] is a message that may come at any time. In [`Outbox`] a stage's
//!   messages are made, in the memory that they are sent from.
//! - [`Navigator`]: three stages under the name by which a mission chooses them.
//! - [`Hosted`], [`Inputs`], [`Sink`], [`Remains`]: what a host works with. [`Memory`] is a host's side in ordinary
//!   memory.
//!
//! Nothing here opens a channel or a file, reads a clock or draws a random number.

mod hosted;
mod input;
mod memory;
mod navigator;
mod output;

pub use hosted::{Hosted, Stage};
pub use input::{Heard, Inputs, Instant, Reading, Remains};
pub use memory::{Memory, Tap};
pub use navigator::{Files, Make, Navigator};
pub use output::{Outbox, Put, Sink};

/// Why a stage cannot go on: a parameter, a drawing, a message that it cannot work with.
pub type StageError = Box<dyn std::error::Error + Send + Sync>;
