//! Reads a log line by line, whatever is wrong with any of them. A line that is too long is skipped, and compressed data that
//! breaks off ends the log.

use std::io::{self, BufRead, ErrorKind, Read};

/// Longest line that is read, bytes.
pub const MAX_LINE_BYTES: u64 = 1 << 18;

/// What the next line is.
pub enum Next {
    /// It is in the buffer.
    Line,
    /// It is longer than [`MAX_LINE_BYTES`], and was skipped.
    TooLong,
    /// The data breaks off within it: a compressed file is cut, or damaged from here on.
    BreaksOff(io::Error),
    /// There is none.
    End,
}

/// Reads lines; none is longer than [`MAX_LINE_BYTES`].
pub struct Lines<R> {
    input: R,
    number: u64,
    text: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    pub fn new(input: R) -> Self {
        Self { input, number: 0, text: Vec::new() }
    }

    /// The number of the last line, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The last line, without its end.
    pub fn text(&self) -> &[u8] {
        &self.text
    }

    /// Reads the next line.
    ///
    /// # Errors
    /// Those of the system. Data that breaks off is not an error but an end.
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

/// The errors of decompressors for data that ends too early or is damaged.
fn breaks_off(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::UnexpectedEof | ErrorKind::InvalidInput | ErrorKind::InvalidData)
}
