//! The simulated world as a process.
