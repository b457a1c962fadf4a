//! Iterates over everything in a recording, part by part.

use std::path::Path;

use crate::content::Part;
use crate::error::RecordingError;
use crate::open::{Open, Piece};
use crate::records::FileHeader;

/// Everything in a recording, in the order of the file. See [`crate::Recording::parts`].
pub struct Parts {
    open: Open,
    is_over: bool,
}

impl Parts {
    pub(crate) fn of(path: &Path) -> Result<Self, RecordingError> {
        Ok(Self { open: Open::new(path)?, is_over: false })
    }
}

impl Parts {
    /// Returns the number of messages so far that rosbag2 compressed individually.
    pub fn packed(&self) -> u64 {
        self.open.packed()
    }

    /// Returns the file's header. Empty before the first part has been read.
    pub fn header(&self) -> &FileHeader {
        &self.open.directory().header
    }
}

impl Iterator for Parts {
    type Item = Result<Part, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.is_over {
            match self.open.next_piece() {
                Ok(Piece::Part(part)) => return Some(Ok(part)),
                Ok(Piece::Chunk) => {}
                Ok(Piece::End { clean }) => {
                    self.is_over = true;
                    return Some(Ok(Part::End { clean }));
                }
                Err(error) => {
                    self.is_over = true;
                    return Some(Err(error));
                }
            }
        }
        None
    }
}
