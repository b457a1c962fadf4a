//! Every message, channel and file format common to all navigators, declared once, and the macros with which each navigator
//! declares its own.
//!
//! - [`message`] has the structs as they are in shared memory, [`declare`] the macros that declare them, and [`codes`] the
//!   enumerations whose numbers they contain.
//! - [`declared`] declares messages and channels while the program runs.
//! - [`layout`] derives their memory layout and [`ros2`] their ROS 2 form. [`valid`] checks their contents.
//! - [`channels`] is the pipeline with the writer and the readers of each channel; [`erased`] handles messages as bytes.
//! - [`geometry`] has frames and units, [`time`] seconds and nanoseconds.
//! - [`mission`], [`floor_plan`], [`robot`] and [`fault_plan`] are the files that people write, which [`toml_text`] reads;
//!   [`bounds`] limits the numbers in them.
//! - [`shown`] makes text from outside safe to print, [`nearest`] guesses what a misspelt word meant, [`named`] finds tasks
//!   by name, [`run`] is what a process receives at its start, [`seed`] has random streams, and [`statistics`] the intervals
//!   of counts and means.
//!
//! Nothing in this crate opens a file, reads a clock or depends on how a message travels.

pub mod bounds;
pub mod channels;
pub mod codes;
pub mod cpp;
pub mod declare;
pub mod declared;
pub mod erased;
pub mod fault_plan;
pub mod floor_plan;
pub mod geometry;
pub mod layout;
pub mod message;
pub mod mission;
pub mod named;
pub mod nearest;
pub mod python;
pub mod robot;
pub mod ros2;
pub mod run;
pub mod samples;
pub mod seed;
pub mod shown;
pub mod statistics;
pub mod time;
pub mod toml_text;
pub mod valid;
