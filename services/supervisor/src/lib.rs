//! Owns the processes of a system: creates every channel and holds it, starts the processes, starts one
//! again that died, and takes everything down with it, so that no process, no shared memory and no folder is left.
//!
//! ```text
//! start:     system → channels → processes, in any order → order to start the mission
//! poll:      what has come, who has died, whether somebody pressed Ctrl-C
//! shut_down: every service ends → the recorder drains its channels, closes its file and ends
//!            → channels and system are removed
//! ```
//! The processes sit in groups of their own, so a terminal's Ctrl-C reaches the supervisor alone, which
//! decides. Where the supervisor is killed, the kernel ends them (`PR_SET_PDEATHSIG`), and the next
//! system that starts sweeps what is left.
//!
//! A process that dies is started again and goes on from its checkpoint, at once or, where it gets
//! nowhere, after growing pauses, until it is given up; then the mission ends. One that
//! was given bad input ends the mission with its death. One that is stopped or hangs is found by its silence,
//! and killed where that lasts. Every kill, death, restart, recovery and silence is told on `faults`.
//!
//! The supervisor never looks into what the services do.

mod child;
mod error;
mod faults;
mod lives;
mod restarts;
mod stall;
mod supervisor;
mod watchdog;

pub use child::ProcessLine;
pub use error::{Death, Error};
pub use supervisor::{Ceded, Grace, Progress, Supervisor, check_file_limit};

/// What a function of this crate returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;
