//! Recordings: one MCAP file per run, which contains every channel as ROS 2 messages.
//!
//! - [`writer`] writes a recording to any [`std::io::Write`], and [`sequence`] counts missing messages.
//! - [`reader`] reads a recording message by message, whether it is complete or was cut off by a kill.
//!   [`index`] locates everything in the file.
//! - [`join`](mod@join) joins the parts that a recorder leaves if it is killed.
//! - [`series`] handles a recording that was split into several files while it grew.
//! - [`diff`] finds the first difference of two recordings, [`info`] summarizes one, [`mod@faults`] lists what went wrong
//!   during the run, and [`rejected`] counts invalid messages. [`mod@replay`] passes valid ones on in order.
//! - [`copy`](mod@copy) repairs, filters, merges and splits recordings. [`rosbag2`] handles the folders that
//!   ROS 2 writes.
//! - [`foreign`] recognizes files that are not recordings, or not ours. [`dynamic`] reads any ROS 2 message
//!   by the schema in the file.
//! - [`carmen`] and [`mod@import`] read logs of other projects. [`sources`] handles the files of a run inside
//!   its recording.
//!
//! This crate does not judge or draw recordings, which is the purpose of `sketchnav-lab`. It does not read clocks or depend on how
//! messages are transported between processes. Recordings are read from files and written to any sink that the caller provides.
//! Only three modules access other files: [`sources`] reads the files that a mission of this machine names, [`series`] lists the
//! files in a folder, and [`rosbag2`] reads the metadata of a folder. Nothing outside a recording is read, regardless of its
//! content.

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
pub mod replay;
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
