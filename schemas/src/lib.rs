//! Messages, channels and file formats common to all navigators, and the macros that each navigator declares its own with.
//!
//! - [`message`] defines the structs as they appear in shared memory, [`declare`] the macros that declare
//!   them, and [`codes`] the enumerations whose numbers they contain.
//! - [`declared`] declares messages and channels at run time.
//! - [`layout`] derives the memory layout of messages, and [`ros2`] their ROS 2 form. [`valid`] checks their
//!   contents.
//! - [`channels`] describes the pipeline, with the writer and the readers of each channel. [`erased`] handles
//!   messages as bytes.
//! - [`geometry`] defines frames and units, and [`time`] converts between seconds and nanoseconds.
//! - [`mission`], [`floor_plan`], [`robot`] and [`fault_plan`] define the files that people write.
//!   [`toml_text`] reads them, and [`bounds`] limits the numbers in them.
//! - [`shown`] escapes untrusted text for printing, [`nearest`] suggests corrections of misspelt words, and [`named`] finds tasks
//!   by name. [`run`] describes a run, as passed to each process at its start, [`seed`] provides random streams, and [`statistics`]
//!   computes confidence intervals of counts and means.
//!
//! This crate does not read clocks or depend on how messages are transported.

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
