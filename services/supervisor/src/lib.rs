//! Owns the processes of a system. The supervisor creates and holds all channels, starts the processes, and restarts those that
//! die. At the end, it shuts everything down, leaving no processes, shared memory or folders behind.
//!
//! ```text
//! start:     system → channels → processes, in any order → order to start the mission
//! poll:      new messages, deaths of processes, Ctrl-C
//! shut_down: every service ends → the recorder drains its channels, closes its file and ends
//!            → channels and system are removed
//! ```
//! Each process has its own process group, so Ctrl-C in a terminal reaches only the supervisor. If the supervisor is killed,
//! the kernel ends the processes (`PR_SET_PDEATHSIG`), and the next system that starts removes whatever is left.
//!
//! A process that dies is restarted and resumes from its checkpoint. If it keeps dying without making progress, the pauses between
//! restarts grow, until the supervisor gives up on it and ends the mission. A process that received bad input ends the mission at
//! once. A process that is stopped or hangs is reported as unresponsive, and killed if it stays that way. Kills, deaths, restarts,
//! recoveries and unresponsive processes are all reported on `faults`.
//!
//! The supervisor is independent of the services' computations.

// `say!` prints, and escapes text that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod child;
mod error;
mod faults;
mod lives;
mod program;
mod restarts;
mod stall;
mod supervisor;
mod watchdog;

pub use child::ProcessLine;
pub use error::{Death, Error, INCOMPLETE};
pub use faults::RecordingFailure;
pub use program::{start_by, this_program};
pub use supervisor::{Ceded, Grace, Progress, Supervisor, check_file_limit};

/// The result type of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
