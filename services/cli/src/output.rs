//! Prints without panicking, even if the reader of our output has exited or the disk is full.
//!
//! Only this module writes to standard output and standard error, and it does so through
//! [`sketchnav_schemas::shown`], so that text from outside, such as the name of a file or a task, cannot
//! control the terminal.

use std::fmt::{Arguments, Display};
use std::io::{self, Write};

pub(crate) use sketchnav_schemas::say;
use sketchnav_schemas::shown::{Lines, OneLine};

/// Prints a line of a result to standard output. If the reader is gone, the line is dropped without an error,
/// so that the command's outcome and exit code do not change.
///
/// # Errors
/// If the line cannot be written for any other reason, such as a full disk.
pub fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    unless_unheard(print(OneLine(text)))
}

/// Prints several lines of a result, such as a table. The caller ensures that no name in them contains a line break.
///
/// # Errors
/// Those of [`line`].
pub fn lines(text: impl Display) -> anyhow::Result<()> {
    unless_unheard(print(Lines(text)))
}

/// Prints a line of output that continues for as long as it is read.
///
/// # Errors
/// If the reader is gone (see [`is_unheard`]), or the line cannot be written.
pub fn live_line(text: Arguments<'_>) -> anyhow::Result<()> {
    print(OneLine(text))
}

/// Prints several lines to standard error, or drops them if they cannot be written.
pub fn aside(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{}", Lines(text));
}

fn print(text: impl Display) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

fn unless_unheard(written: anyhow::Result<()>) -> anyhow::Result<()> {
    match written {
        Err(error) if is_unheard(&error) => Ok(()),
        written => written,
    }
}

/// Returns true if the error means that the reader of our output is gone, as is the case with `head` once it
/// has read enough.
pub fn is_unheard(error: &anyhow::Error) -> bool {
    let pipe = |cause: &io::Error| cause.kind() == io::ErrorKind::BrokenPipe;
    error.chain().any(|cause| cause.downcast_ref::<io::Error>().is_some_and(pipe))
}

/// Prints a line to standard output like `println!`, but returns an error if that fails.
macro_rules! out {
    ($($text:tt)*) => { $crate::output::line(format_args!($($text)*)) };
}

/// Prints a line to standard output, and returns an error if its reader is gone.
macro_rules! live {
    ($($text:tt)*) => { $crate::output::live_line(format_args!($($text)*)) };
}

pub(crate) use {live, out};
