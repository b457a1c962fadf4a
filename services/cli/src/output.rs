//! Prints without panicking: the reader of our output may have gone, and the disk behind it may be full.
//!
//! The only place that writes to standard output and standard error, and the only way there is through
//! [`sketchnav_schemas::shown`]: what came from outside, such as a name of a file or of a task, cannot steer the terminal.

use std::fmt::{Arguments, Display};
use std::io::{self, Write};

pub(crate) use sketchnav_schemas::say;
use sketchnav_schemas::shown::{Lines, OneLine};

/// A line of a result on standard output. Where its reader has gone nobody misses it, and what the command comes to
/// stays what it is: its exit code says so.
///
/// # Errors
/// Where it cannot be written: a full disk, say.
pub fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    heard(print(OneLine(text)))
}

/// Several lines of a result: a table, say. Whoever makes them has put no name into them that could break a line.
///
/// # Errors
/// As [`line`].
pub fn lines(text: impl Display) -> anyhow::Result<()> {
    heard(print(Lines(text)))
}

/// A line of an output that goes on for as long as it is read.
///
/// # Errors
/// Where nobody takes it; see [`is_unheard`].
pub fn live_line(text: Arguments<'_>) -> anyhow::Result<()> {
    print(OneLine(text))
}

/// Several lines on standard error; they are dropped where they cannot be written.
pub fn aside(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{}", Lines(text));
}

fn print(text: impl Display) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

fn heard(written: anyhow::Result<()>) -> anyhow::Result<()> {
    match written {
        Err(error) if is_unheard(&error) => Ok(()),
        written => written,
    }
}

/// Whether the error is that the reader of our output has gone, as `head` does when it has enough.
pub fn is_unheard(error: &anyhow::Error) -> bool {
    let pipe = |cause: &io::Error| cause.kind() == io::ErrorKind::BrokenPipe;
    error.chain().any(|cause| cause.downcast_ref::<io::Error>().is_some_and(pipe))
}

/// Prints a line on standard output, as `println!` does, and says where that fails.
macro_rules! out {
    ($($text:tt)*) => { $crate::output::line(format_args!($($text)*)) };
}

/// Prints a line on standard output, and says when it is not read any more.
macro_rules! live {
    ($($text:tt)*) => { $crate::output::live_line(format_args!($($text)*)) };
}

pub(crate) use {live, out};
