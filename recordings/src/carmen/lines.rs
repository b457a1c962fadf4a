//! Reads a log line by line, no matter how damaged its lines are. A line that is too long is skipped, and
//! compressed data that breaks off ends the log.

use std::io::{self, BufRead, ErrorKind, Read};

/// Maximum length of a line that is read, in bytes.
pub const MAX_LINE_BYTES: u64 = 1 << 18;

/// The result of reading the next line.
pub enum Next {
    /// The line is in the buffer.
    Line,
    /// The line is longer than [`MAX_LINE_BYTES`] and was skipped.
    TooLong,
    /// The data breaks off within the line, because a compressed file is cut off or damaged.
    BreaksOff(io::Error),
    /// There are no more lines.
    End,
}

/// Reads lines of up to [`MAX_LINE_BYTES`].
pub struct Lines<R> {
    input: R,
    number: u64,
    text: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    pub fn new(input: R) -> Self {
        Self { input, number: 0, text: Vec::new() }
    }

    /// Returns the number of the last line that was read, counted from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Returns the text of the last line that was read, without the line break.
    pub fn text(&self) -> &[u8] {
        &self.text
    }

    /// Reads the next line.
    ///
    /// # Errors
    /// Any I/O error. Data that breaks off is not an error, see [`Next::BreaksOff`].
    pub fn next(&mut self) -> io::Result<Next> {
        self.number += 1;
        self.text.clear();
        let read = self.input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut self.text);
        match read {
            Err(error) if breaks_off(&error) => Ok(Next::BreaksOff(error)),
            Err(error) => Err(error),
            Ok(0) => Ok(Next::End),
            Ok(length) if length as u64 == MAX_LINE_BYTES && !self.text.ends_with(b"\n") => {
                match self.skip_line() {
                    Err(error) if breaks_off(&error) => Ok(Next::BreaksOff(error)),
                    skipped => skipped.map(|()| Next::TooLong),
                }
            }
            Ok(_) => Ok(Next::Line),
        }
    }

    fn skip_line(&mut self) -> io::Result<()> {
        while !self.text.ends_with(b"\n") {
            self.text.clear();
            let piece = self.input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut self.text)?;
            if piece == 0 {
                break;
            }
        }
        Ok(())
    }
}

/// Returns true for the errors that decompressors report for truncated or damaged data.
fn breaks_off(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::UnexpectedEof | ErrorKind::InvalidInput | ErrorKind::InvalidData)
}
