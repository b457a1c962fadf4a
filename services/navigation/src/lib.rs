//! Localization and planning in a hand-drawn map, as pure functions.
//!
//! Nothing here knows a clock, a file or a channel, or starts a thread: time, randomness, configuration and
//! whoever is to help with the work arrive as arguments.

pub mod localization;
pub mod planning;
pub mod sketch;
