//! Owns the processes of a system. It creates and holds every channel, starts the processes, and starts one again that
//! died. At the end it takes everything down: no process, no shared memory and no folder is left.
//!
//! ```text
//! start:     system → channels → processes, in any order → order to start the mission
//! poll:      what has come, who has died, whether somebody pressed Ctrl-C
//! shut_down: every service ends → the recorder drains its channels, closes its file and ends
//!            → channels and system are removed
//! ```
//! The processes have groups of their own, so a terminal's Ctrl-C reaches the supervisor alone. If the supervisor is
//! killed, the kernel ends them (`PR_SET_PDEATHSIG`). The next system that starts removes what is left.
//!
//! A process that dies is started again and goes on from its checkpoint. If it dies before it gets any further, pauses
//! grow, until it is given up and the mission ends. A process that was given bad input ends the mission at once. A
//! process that is stopped or hangs is reported as unresponsive, and killed if that lasts. Every kill, death, restart,
//! recovery and unresponsive process is reported on `faults`.
//!
//! The supervisor never looks into what the services compute.

// `say!` prints: it escapes what could steer a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod child;
mod error;
mod faults;
mod lives;
mod restarts;
mod stall;
mod supervisor;
mod watchdog;

pub use child::ProcessLine;
pub use error::{Death, Error, INCOMPLETE};
pub use faults::RecordingFailure;
pub use supervisor::{Ceded, Grace, Progress, Supervisor, check_file_limit};

/// What a function of this crate returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;
