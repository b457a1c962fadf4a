//! Stages are the parts of a navigator, written as pure functions from messages to messages with explicit
//! state.
//!
//! A navigator consists of three stages. The *sketcher* reads a person's input, the *localizer* works out where the robot is, and
//! the *planner* drives. A stage is declared once, by implementing [`Stage`], and can then be hosted in three ways:
//! `sketchnav-runtime` runs it as a process over shared memory, and `sketchnav-rehearsal` runs it in a single process without
//! shared memory, or against a recording. The hosts take care of channels, positions in them, checkpoints, waiting and health.
//!
//! - [`Stage`] is the trait that you implement to write a navigator.
//! - [`Instant`] provides the inputs of a step, and [`Incoming`] is a message that can arrive at any time.
//!   [`Outbox`] writes the stage's messages directly into the memory that they are sent from.
//! - [`Navigator`] combines three stages under the name that a mission selects them with.
//! - [`lookout`] draws the view of a navigator on a page while it drives, and [`drawn`] interprets drawings made on that page.
//!   [`doubts`] warns about problems before the start, and [`account`] reports on a run once it is over.
//! - [`Hosted`], [`Access`], [`Inputs`], [`Sink`] and [`Remains`] are the interface for hosts. [`InProcess`]
//!   implements the host's side in ordinary memory.
//!
//! This crate does not open channels or files, read clocks, or draw random numbers.
//!
//! # Example: a stage, and one of its steps
//!
//! The planner below drives straight ahead for a hundred steps. Its host is ordinary memory, as in a test.
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
//! `tests/stranger/wall_follower.rs` is a complete navigator, and `docs/write-a-navigator.md` walks through it.

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
pub use hosted::{Hosted, SaveError, Stage, Unanswered, step};
pub use in_process::{InProcess, Tap};
pub use input::{Incoming, Inputs, Instant, Reading, Remains};
pub use navigator::{Files, FoundPlace, Make, Navigator, Review, Watch};
pub use output::{Fill, Outbox, Put, Sink};

/// Why a stage cannot continue, for example an invalid parameter, drawing or message.
pub type StageError = Box<dyn std::error::Error + Send + Sync>;
