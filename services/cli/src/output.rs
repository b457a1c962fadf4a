//! Prints without panicking: the reader of our output may have gone, and the disk behind it may be full.

use std::fmt::Arguments;
use std::io::{self, Write};

/// A line of a result on standard output. Where its reader has gone nobody misses it, and what the command comes to
/// stays what it is: its exit code says so.
///
/// # Errors
/// Where it cannot be written: a full disk, say.
pub fn line(text: Arguments<'_>) -> anyhow::Result<()> {
    match live_line(text) {
        Err(error) if is_unheard(&error) => Ok(()),
        written => written,
    }
}

/// A line of an output that goes on for as long as it is read.
///
/// # Errors
/// Where nobody takes it; see [`is_unheard`].
pub fn live_line(text: Arguments<'_>) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

/// A line on standard error; it is dropped where it cannot be written.
pub fn aside(text: Arguments<'_>) {
    let _ = writeln!(io::stderr().lock(), "{text}");
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

/// Prints a line on standard error, as `eprintln!` does, without panicking.
macro_rules! say {
    ($($text:tt)*) => { $crate::output::aside(format_args!($($text)*)) };
}

pub(crate) use {live, out, say};
