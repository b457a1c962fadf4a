//! Recordings: one MCAP file per run, with every channel in it as ROS 2 messages.
//!
//! - [`writer`]: writes one, over any [`std::io::Write`]; [`sequence`]: counts what is missing.
//! - [`reader`]: reads one message by message, complete or cut off by a kill; [`index`]: where everything is in the file.
//! - [`join`](mod@join): joins the parts that a recorder leaves if it is killed.
//! - [`series`]: a recording that was cut into files while it grew.
//! - [`diff`]: the first difference of two; [`info`]: what is in one; [`mod@faults`]: what went wrong in it;
//!   [`rejected`]: its invalid messages.
//! - [`copy`](mod@copy): repairs, filters, merges, splits; [`rosbag2`]: folders as in ROS 2.
//! - [`foreign`]: what is not a recording, or not one of ours; [`dynamic`]: any ROS 2 message, by the schema in the file.
//! - [`carmen`], [`mod@import`]: other people's logs; [`sources`]: the files of a run inside its recording.
//!
//! This crate does not judge or draw recordings; `sketchnav-lab` does. Nothing here reads a clock, or depends on how a message
//! travels between processes. Recordings are read from files and written to any sink that the caller provides. Only [`sources`]
//! reads other files: those that a mission of this machine names. [`series`] lists the files of a folder. Whatever a recording
//! says, nothing outside of it is read.

pub mod carmen;
mod content;
pub mod copy;
pub mod diff;
mod directory;
pub mod dynamic;
pub mod error;
mod facts;
pub mod faults;
pub mod foreign;
pub mod import;
pub mod index;
pub mod info;
pub mod join;
mod open;
mod parts;
pub mod reader;
mod record_file;
pub mod records;
pub mod rejected;
pub mod rosbag2;
pub mod samples;
mod selection;
pub mod sequence;
pub mod series;
pub mod sources;
mod timeline;
pub mod writer;

pub use error::RecordingError;
pub use join::join;
pub use reader::Recording;
pub use writer::Writer;
