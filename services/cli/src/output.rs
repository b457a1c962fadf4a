//! Prints without panicking: the reader of our output may be gone, or the disk that it is written to may be full.
//!
//! Only this module writes to standard output and standard error, and only through [`sketchnav_schemas::shown`], so
//! that text from outside, such as the name of a file or of a task, cannot steer the terminal.

use std::fmt::{Arguments, Display};
use std::io::{self, Write};

pub(crate) use sketchnav_schemas::say;
use sketchnav_schemas::shown::{Lines, OneLine};

/// Prints a line of a result to standard output. If its reader is gone, nothing is lost, and the command's outcome and
/// exit code remain the same.
///
/// # Errors
/// If it cannot be written, for example to a full disk.
pub fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    heard(print(OneLine(text)))
}

/// Prints several lines of a result, for example a table. The caller ensures that they
/// contain no name that could break a line.
///
/// # Errors
/// As [`line`].
pub fn lines(text: impl Display) -> anyhow::Result<()> {
    heard(print(Lines(text)))
}

/// Prints a line of an output that continues for as long as it is read.
///
/// # Errors
/// If it is not read any more (see [`is_unheard`]), or cannot be written.
pub fn live_line(text: Arguments<'_>) -> anyhow::Result<()> {
    print(OneLine(text))
}

/// Prints several lines to standard error; dropped if they cannot be written.
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

/// Whether the error means that the reader of our output is gone, as `head` is when it has enough.
pub fn is_unheard(error: &anyhow::Error) -> bool {
    let pipe = |cause: &io::Error| cause.kind() == io::ErrorKind::BrokenPipe;
    error.chain().any(|cause| cause.downcast_ref::<io::Error>().is_some_and(pipe))
}

/// Prints a line to standard output, as `println!` does, and returns an error if that fails.
macro_rules! out {
    ($($text:tt)*) => { $crate::output::line(format_args!($($text)*)) };
}

/// Prints a line to standard output, and returns an error when it is not read any more.
macro_rules! live {
    ($($text:tt)*) => { $crate::output::live_line(format_args!($($text)*)) };
}

pub(crate) use {live, out};
