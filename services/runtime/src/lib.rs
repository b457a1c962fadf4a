//! Processes and channels over shared memory. This is the only crate that uses iceoryx2.
//!
//! - [`System`]: the folder of a named system, the processes that are running in it, and how to remove it completely.
//! - [`Channels`]: every channel of the table, created and held by the supervisor.
//! - [`Node`]: a process in a system, which opens a [`Writer`] or [`Reader`] of a channel, and waits.
//! - [`host()`]: runs a stage of a navigator as a process, using everything below.
//! - [`Checkpoints`]: the state that a process resumes from after a kill.
//! - [`SendTimes`]: the times at which the last messages of a channel were sent.
//! - [`Notices`]: reports that processes and tools ask the supervisor to publish.
//! - Planned faults are applied by the writers (`trap.rs`). Without a plan, there is no overhead.
//! - [`provide_files`], [`provide_stack`]: raise the process limits that a system needs.
//! - [`Room`], [`Peer`]: the free resources of the machine and the connected processes, for tools.
//! - [`HealthReporter`], [`CountingAllocator`], [`Pacer`]: health reports, and pacing by the wall clock.
//!
//! A message is written once, in shared memory, and read there: [`Loan`] and [`Sample`] are references into
//! the same file of `/dev/shm`. Receiving does not allocate, and sending only allocates iceoryx2's own handle
//! of a loan.
//!
//! Any process may be killed at any time. The last messages of its writers are stored, and its checkpoint contains its position in
//! each channel. The restarted process takes the inputs that it missed from the channels' histories, recomputes messages that may
//! already have been sent, and sends only the new ones, so each message is sent exactly once.
//!
//! Apart from the tick, this crate does not interpret messages. Only the supervisor creates channels, because a process that died
//! while creating one would block it permanently (iceoryx2 0.10).

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
