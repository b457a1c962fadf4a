//! Localization and planning in a hand-drawn map, as pure functions.
//!
//! Nothing here knows a clock, a file, a thread or a channel: time, randomness and configuration
//! arrive as arguments.

pub mod localization;
pub mod planning;
pub mod sketch;
