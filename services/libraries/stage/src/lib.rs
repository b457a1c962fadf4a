//! A stage is one part of a navigator, written as a pure function from messages to messages, with a state.
//!
//! A navigator has three stages. The *sketcher* reads what a person provides, the *localizer* works out the robot's situation, and
//! the *planner* drives. A stage is declared once, by implementing [`Stage`], and can be hosted in three ways: `sketchnav-runtime`
//! hosts it as a process over shared memory, and `sketchnav-rehearsal` hosts it in one process without shared memory, or against a
//! recording. The hosts take care of channels, positions in them, checkpoints, waiting and health.
//!
//! - [`Stage`] is the trait that the author of a navigator implements.
//! - [`Instant`] has the inputs of a step. [`Heard`] is a message that may come at any time. [`Outbox`] creates a stage's messages,
//!   in the memory that they are sent from.
//! - [`Navigator`] is three stages under the name by which a mission selects them.
//! - [`lookout`] is what a page shows of a navigator while it drives, and [`drawn`] what people draw for it on that page.
//!   [`doubts`] are warnings before the start, and [`account`] is the navigator's report when the run is over.
//! - [`Hosted`], [`Access`], [`Inputs`], [`Sink`] and [`Remains`] are what a host works with. [`InProcess`] is a host's side in
//!   ordinary memory.
//!
//! Nothing here opens a channel or a file, reads a clock or draws a random number.
//!
//! # Example: a stage, and one of its steps
//!
//! This planner drives straight ahead for a hundred steps. Its host here is ordinary memory, as in a test.
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
pub use hosted::{Hosted, SaveError, Stage};
pub use in_process::{InProcess, Tap};
pub use input::{Heard, Inputs, Instant, Reading, Remains};
pub use navigator::{Files, Make, Navigator, Review, Watch};
pub use output::{Fill, Outbox, Put, Sink};

/// The reason that a stage cannot continue, such as a parameter, a drawing or a message that it cannot work with.
pub type StageError = Box<dyn std::error::Error + Send + Sync>;
