//! Owns the processes of a system: creates every channel and holds it, starts the processes, sees one
//! die, and takes everything down with it, so that no process, no shared memory and no folder is left.
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
//! The supervisor never looks into what the services do, and a process that dies ends the mission.

mod child;
mod error;
mod supervisor;

pub use child::ProcessLine;
pub use error::{Death, Error};
pub use supervisor::{Grace, Progress, Supervisor};

/// What a function of this crate returns.
pub type Result<T, E = Error> = std::result::Result<T, E>;
