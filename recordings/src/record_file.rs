//! A file of records, which are read one after another or from any position, and the index at its end.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use mcap::records::op;

use crate::foreign::{Foreign, LOOKED_AT};
use crate::records::{Damage, FRAME_BYTES, MAX_RECORD_BYTES, Record};

/// Size of the footer record and the magic after it.
const TAIL_BYTES: u64 = FRAME_BYTES + 20 + 8;

/// The reason why the next record cannot be read.
#[derive(Debug)]
pub enum Stop {
    /// The file ends before or within the record that begins at this offset.
    Cut(u64),
    /// The record is damaged.
    Damage(Damage),
    /// The system cannot read the file.
    Io(io::Error),
}

impl From<Damage> for Stop {
    fn from(damage: Damage) -> Self {
        Self::Damage(damage)
    }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// A file of MCAP records.
pub struct RecordFile {
    file: BufReader<File>,
    at: u64,
    bytes: u64,
    content: Vec<u8>,
    read: u64,
}

impl RecordFile {
    /// Opens a file and checks its magic.
    pub fn open(path: &Path) -> Result<Self, Stop> {
        match Self::open_damaged(path)? {
            (file, false) => Ok(file),
            (_, true) => Err(Damage::Magic.into()),
        }
    }

    /// Opens a file whose magic may be damaged, and returns true if it is, in which case a header must
    /// follow.
    pub fn open_damaged(path: &Path) -> Result<(Self, bool), Stop> {
        let (mut file, magic) = Self::begin(path)?;
        if magic == *mcap::MAGIC {
            return Ok((file, false));
        }
        let first = file.advance().map(|opcode| Record::parse(opcode, file.content()));
        if !matches!(first, Ok(Ok(Record::Header(_)))) {
            return Err(foreign(path));
        }
        file.seek(magic.len() as u64)?;
        Ok((file, true))
    }

    /// Opens a file and reads its magic. The file is then positioned after the magic.
    fn begin(path: &Path) -> Result<(Self, [u8; mcap::MAGIC.len()]), Stop> {
        let mut file = BufReader::with_capacity(1 << 16, sketchnav_files::open(path, "a recording")?);
        let bytes = file.get_ref().metadata()?.len();
        let mut magic = [0; mcap::MAGIC.len()];
        if bytes < magic.len() as u64 {
            return Err(Damage::Empty.into());
        }
        file.read_exact(&mut magic)?;
        let at = magic.len() as u64;
        Ok((Self { file, at, bytes, content: Vec::new(), read: at }, magic))
    }

    /// Returns the offset of the next record.
    pub fn at(&self) -> u64 {
        self.at
    }

    /// Returns the length of the file, in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns the total number of bytes that have been read so far.
    pub fn bytes_read(&self) -> u64 {
        self.read
    }

    /// Moves to the record that begins at `at`.
    pub fn seek(&mut self, at: u64) -> Result<(), Stop> {
        if at > self.bytes {
            return Err(Stop::Cut(at));
        }
        if at != self.at {
            // A relative seek within the read-ahead buffer does not read anything again.
            self.file.seek_relative(at as i64 - self.at as i64)?;
            self.at = at;
        }
        Ok(())
    }

    /// Reads the next record and returns its opcode. Its content is then in [`RecordFile::content`].
    pub fn advance(&mut self) -> Result<u8, Stop> {
        let begin = self.at;
        let left = self.bytes - begin;
        if left < FRAME_BYTES {
            return Err(Stop::Cut(begin));
        }
        let mut frame = [0; FRAME_BYTES as usize];
        self.fill_from_file(&mut frame)?;
        let [opcode, length @ ..] = frame;
        let length = u64::from_le_bytes(length);
        if length > MAX_RECORD_BYTES as u64 {
            return Err(Damage::TooLong { at: begin, bytes: length }.into());
        }
        if length > left - FRAME_BYTES {
            return Err(Stop::Cut(begin));
        }
        let mut content = std::mem::take(&mut self.content);
        content.resize(length as usize, 0);
        let filled = self.fill_from_file(&mut content);
        self.content = content;
        filled?;
        if opcode == op::ATTACHMENT && !is_attachment_sound(&self.content) {
            return Err(Damage::Checksum { at: begin, kind: "attachment" }.into());
        }
        Ok(opcode)
    }

    /// Returns the opcode of the record that begins at `at`, and where the record ends.
    pub fn frame_at(&mut self, at: u64) -> Result<(u8, u64), Stop> {
        self.seek(at)?;
        if self.bytes - at < FRAME_BYTES {
            return Err(Stop::Cut(at));
        }
        let mut frame = [0; FRAME_BYTES as usize];
        self.fill_from_file(&mut frame)?;
        let [opcode, length @ ..] = frame;
        let end = self.at.checked_add(u64::from_le_bytes(length)).filter(|end| *end <= self.bytes);
        end.map(|end| (opcode, end)).ok_or(Stop::Cut(at))
    }

    fn fill_from_file(&mut self, into: &mut [u8]) -> Result<(), Stop> {
        self.file.read_exact(into).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => Stop::Cut(self.at),
            _ => Stop::Io(error),
        })?;
        self.at += into.len() as u64;
        self.read += into.len() as u64;
        Ok(())
    }

    /// Returns the next position, starting with `from`, at which a chunk seems to begin. A chunk is
    /// recognized by its opcode, by lengths that are consistent with each other and the file, and by a known
    /// compression. The file is read in pieces, each of them once.
    pub fn find_chunk(&mut self, from: u64) -> Result<Option<u64>, Stop> {
        const PIECE: usize = 1 << 20;
        let mut begin = from;
        while begin < self.bytes {
            self.seek(begin)?;
            let mut piece = vec![0; PIECE.min((self.bytes - begin) as usize)];
            self.fill_from_file(&mut piece)?;
            for (offset, head) in piece.windows(CHUNK_HEAD).enumerate() {
                let at = begin + offset as u64;
                if chunk_length(head).is_some_and(|length| length <= self.bytes - at) {
                    self.seek(at)?;
                    return Ok(Some(at));
                }
            }
            if piece.len() < CHUNK_HEAD || begin + piece.len() as u64 == self.bytes {
                return Ok(None);
            }
            begin += (piece.len() - CHUNK_HEAD + 1) as u64;
        }
        Ok(None)
    }

    /// Returns the content of the last record read.
    pub fn content(&self) -> &[u8] {
        &self.content
    }

    /// Reads the records of the index at the end of the file, as one block.
    pub fn summary(&mut self) -> Result<Vec<u8>, Stop> {
        let no_index = || Stop::Damage(Damage::NoIndex);
        let tail = self.bytes.checked_sub(TAIL_BYTES).filter(|&at| at >= 8).ok_or_else(no_index)?;
        self.seek(tail)?;
        let opcode = self.advance()?;
        let Ok(Record::Footer(begin, checksum)) = Record::parse(opcode, &self.content) else {
            return Err(no_index());
        };
        let mut magic = [0; mcap::MAGIC.len()];
        self.fill_from_file(&mut magic)?;
        let length = tail.checked_sub(begin).filter(|_| begin >= 8).ok_or_else(no_index)?;
        if magic != *mcap::MAGIC || length > MAX_RECORD_BYTES as u64 {
            return Err(no_index());
        }
        self.seek(begin)?;
        // The checksum also covers the footer, up to its own position.
        let mut summary = vec![0; length as usize + FRAME_BYTES as usize + 16];
        self.fill_from_file(&mut summary)?;
        if checksum != 0 && checksum != crc32fast::hash(&summary) {
            return Err(Damage::Checksum { at: begin, kind: "summary" }.into());
        }
        summary.truncate(length as usize);
        Ok(summary)
    }
}

/// Frame, times, length, checksum, length and longest name of the compression, packed length.
const CHUNK_HEAD: usize = 9 + 8 + 8 + 8 + 4 + 4 + 4 + 8;

/// Returns the length, without its frame, of the chunk that seems to begin with `head`.
fn chunk_length(head: &[u8]) -> Option<u64> {
    let number = |at: usize| Some(u64::from_le_bytes(head.get(at..at + 8)?.try_into().ok()?));
    if *head.first()? != op::CHUNK {
        return None;
    }
    let names = ["", "lz4", "zstd"].into_iter();
    let name_bytes = names
        .map(str::as_bytes)
        .find(|name| head[37..41] == (name.len() as u32).to_le_bytes() && head[41..].starts_with(name));
    let name_length = name_bytes?.len();
    let (length, packed) = (number(1)?, number(41 + name_length)?);
    let fits = packed.checked_add((32 + name_length + 8) as u64) == Some(length);
    fits.then_some(length)
}

/// Returns the kind of the file if it does not begin as an MCAP file does.
fn foreign(path: &Path) -> Stop {
    let mut begin = Vec::new();
    match sketchnav_files::open(path, "a recording")
        .and_then(|file| file.take(LOOKED_AT as u64).read_to_end(&mut begin))
    {
        Ok(_) => Damage::NoMcap(Foreign::of(&begin)).into(),
        Err(error) => error.into(),
    }
}

/// Returns true if the checksum at the end of an attachment matches everything before it. A checksum of 0 means that there is
/// none.
fn is_attachment_sound(content: &[u8]) -> bool {
    let Some((said, checksum)) = content.split_last_chunk::<4>() else { return false };
    let checksum = u32::from_le_bytes(*checksum);
    checksum == 0 || checksum == crc32fast::hash(said)
}
