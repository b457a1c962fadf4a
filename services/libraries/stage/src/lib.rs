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
//! - [`lookout`]: what a page shows of them while they drive. [`drawn`]: what people draw for them on it. [`doubts`]: warnings
//!   before the start. [`account`]: what is said of them when the run is over.
//! - [`Hosted`], [`Access`], [`Inputs`], [`Sink`], [`Remains`]: what a host works with. [`InProcess`] is a host's side in ordinary
//!   memory.
//!
//! Nothing here opens a channel or a file, reads a clock or draws a random number.
//!
//! # A stage, and a step of it
//!
//! A planner that drives ahead for a hundred steps. Its host here is ordinary memory, as in a test.
//!
//! ```
//! use serde::Serialize;
//! use sketchnav_schemas::channels::COMMAND;
//! use sketchnav_schemas::codes::Process;
//! use sketchnav_stage::{Access, Instant, InProcess, Outbox, Stage, StageError};
//!
//! struct Ahead {
//!     steps: u32,
//! }
//!
//! impl Stage for Ahead {
//!     const FORM: &'static str = "ahead planner 1";
//!     type State = u32;
//!
//!     fn step(&mut self, _: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
//!         self.steps += 1;
//!         let speed_mps = if self.steps <= 100 { 0.2 } else { 0.0 };
//!         out.send(COMMAND, |command| command.twist.vx_mps = speed_mps)?;
//!         Ok(())
//!     }
//!
//!     fn state(&self) -> impl Serialize {
//!         self.steps
//!     }
//!
//!     fn restore(&mut self, steps: u32) -> Result<(), StageError> {
//!         self.steps = steps;
//!         Ok(())
//!     }
//! }
//!
//! let access = Access::new(Process::Planner, "sketch");
//! let inputs = InProcess::of_reader(Process::Planner, "sketch");
//! let mut outputs = InProcess::of_writer(Process::Planner, "sketch");
//! let (tick, stamp_ns) = (1, 100_000_000);
//! let mut stage = Ahead { steps: 0 };
//! stage.step(
//!     &Instant::new(&access, tick, stamp_ns, &inputs),
//!     &mut Outbox::new(&mut outputs, stamp_ns, tick),
//! )?;
//! let sent = outputs.get(COMMAND.spec).expect("a command");
//! let command = COMMAND.message(COMMAND.spec, sent.bytes()).expect("a message of this channel");
//! assert_eq!((command.twist.vx_mps, command.header.source_seq), (0.2, tick));
//! # Ok::<(), StageError>(())
//! ```
//!
//! `tests/stranger/wall_follower.rs` is a whole navigator, and `docs/write-a-navigator.md` goes through it.

mod access;
pub mod account;
pub mod doubts;
pub mod drawn;
mod hosted;
mod in_process;
mod input;
pub mod lookout;
mod navigator;
mod output;

pub use access::{Access, Denied};
pub use hosted::{Hosted, Stage};
pub use in_process::{InProcess, Tap};
pub use input::{Heard, Inputs, Instant, Reading, Remains};
pub use navigator::{Files, Make, Navigator, Review, Watch};
pub use output::{Outbox, Put, Sink};

/// Why a stage cannot go on: a parameter, a drawing, a message that it cannot work with.
pub type StageError = Box<dyn std::error::Error + Send + Sync>;
