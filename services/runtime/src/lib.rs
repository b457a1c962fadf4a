//! Processes and channels over shared memory: the one crate that names iceoryx2.
//!
//! - [`System`]: a named system's folder, who lives in it, and how it goes away without a trace.
//! - [`Channels`]: every channel of the table, created and held by the supervisor.
//! - [`Node`]: a process in a system; opens a [`Writer`] or a [`Reader`] of a channel and waits.
//! - [`host()`]: runs a stage of a navigator as a process; all of the following is at work in it.
//! - [`Checkpoints`]: a process's state, for the one that goes on when it was killed.
//! - [`SendTimes`]: when the last messages of a channel were sent, by the clock.
//! - [`Notices`]: what the supervisor is to tell everybody.
//! - Faults by plan are at work in the writers (`trap.rs`); without a plan there is nothing.
//! - [`provide_files`], [`provide_stack`]: what a process needs of its limits;
//! - [`Room`], [`Peer`]: what a system needs of its machine, and who is connected; for tools.
//! - [`HealthReporter`], [`CountingAllocator`], [`Pacer`]: what a process says about itself, and time.
//!
//! A message is written once, in shared memory, and read there: [`Loan`] and [`Sample`] are references
//! into the same file of `/dev/shm`. Receiving allocates nothing, and sending nothing but iceoryx2's own
//! handle of a loan.
//!
//! Any process may be killed at any moment. Its writers keep their last messages, and its checkpoint says where in
//! each channel it stood. Its successor takes what it missed out of the channels' histories, and computes again what
//! it may have sent already. It sends only what is new: each message exactly once.
//!
//! Nothing here knows what a message means, except the tick. No process but the supervisor creates a channel: a
//! process that dies while it creates one would block it for good (iceoryx2 0.10).

// `say!` prints: it escapes what could steer a terminal.
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
pub use limits::{NEEDED_FILES, provide_files, provide_stack};
pub use node::{Node, Wake, Waker};
pub use notices::{Notice, Notices, Ordered};
pub use pacer::Pacer;
pub use reader::{RawReader, RawSample, Reader, Sample};
pub use survey::{Peer, Room};
pub use system::System;
pub use watch::{ProcessState, Watch};
pub use writer::{Loan, RawLoan, RawWriter, Writer};

/// What a function of this crate returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;
