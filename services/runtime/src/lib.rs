//! Processes and channels over shared memory: the one crate that names iceoryx2.
//!
//! - [`System`]: a named system's folder, its living processes, and its removal without a trace.
//! - [`Channels`]: every channel of the table, created and held by the supervisor.
//! - [`Node`]: a process in a system; opens a [`Writer`] or [`Reader`] of a channel, and waits.
//! - [`host()`]: runs a stage of a navigator as a process, using everything below.
//! - [`Checkpoints`]: a process's state, from which its successor resumes after a kill.
//! - [`SendTimes`]: when the last messages of a channel were sent, by the clock.
//! - [`Notices`]: what processes and tools ask the supervisor to publish.
//! - Planned faults are applied by the writers (`trap.rs`); without a plan there is no overhead.
//! - [`provide_files`], [`provide_stack`]: raise the process limits that a system needs.
//! - [`Room`], [`Peer`]: for tools; whether the machine has room for a system, and which processes are connected.
//! - [`HealthReporter`], [`CountingAllocator`], [`Pacer`]: what a process reports about itself, and pacing against the clock.
//!
//! A message is written once, in shared memory, and read there: [`Loan`] and [`Sample`] are references into the same
//! file of `/dev/shm`. Receiving allocates nothing, and sending allocates only iceoryx2's own handle of a loan.
//!
//! Any process may be killed at any moment. Its writers keep their last messages, and its checkpoint holds its position
//! in each channel. Its successor takes the inputs that it missed from the channels' histories, computes again what may
//! have been sent already, and sends only what is new: each message exactly once.
//!
//! Nothing here knows what a message means, except for the tick. Only the supervisor creates channels: a process that
//! died while creating one would block it for good (iceoryx2 0.10).

// `say!` prints, and escapes text that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod allocations;
mod bells;
mod channels;
mod checkpoint;
mod error;
mod half_made;
mod health;
mod history;
mod host;
mod identity;
mod limits;
mod lock;
mod mapping;
mod names;
mod node;
mod notices;
mod pacer;
mod reader;
mod root;
mod shared;
mod signals;
mod starvation;
mod survey;
mod system;
mod trap;
mod watch;
mod writer;

pub use allocations::{CountingAllocator, allocations_of_this_thread, loan_handles_of_this_thread};
pub use channels::Channels;
pub use checkpoint::{CHECKPOINT_EVERY, Checkpoints, Found};
pub use error::Error;
pub use health::{HealthReporter, Step};
pub use history::{SendTimes, Sent};
pub use host::{HostError, host};
pub use identity::pidfd;
pub use limits::{NEEDED_FILES, provide_files, provide_stack};
pub use node::{Node, Wake, Waker};
pub use notices::{Notice, Notices, Ordered};
pub use pacer::Pacer;
pub use reader::{RawReader, RawSample, Reader, Sample};
pub use survey::{Peer, Room};
pub use system::System;
pub use watch::{ProcessState, Watch};
pub use writer::{Loan, RawLoan, RawWriter, Writer};

/// The result type of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
