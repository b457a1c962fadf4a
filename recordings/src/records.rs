//! The records of an MCAP file, read without believing a length or a count in it.
//!
//! The mcap crate's own readers subtract and allocate by what the file says, so that a damaged file can
//! bring a program down; here every length is held against the bytes that are there first. Allocates no
//! more than the file is long, nor than [`MAX_RECORD_BYTES`]. Source: the MCAP specification, version 0.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use mcap::records::op;

/// Longest record, and longest chunk in either form, that is read into memory.
pub const MAX_RECORD_BYTES: usize = 64 << 20;
/// Opcode and length.
const FRAME_BYTES: u64 = 9;
/// Footer record and the magic behind it.
const TAIL_BYTES: u64 = FRAME_BYTES + 20 + 8;

/// What is wrong with the bytes of a recording.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// The file is shorter than what an MCAP file begins with.
    #[error("it is empty")]
    Empty,
    /// The file does not begin as an MCAP file does.
    #[error("it does not begin with the magic bytes of MCAP")]
    NoMcap,
    /// A record is longer than any that a recording has.
    #[error("byte {at}: a record claims {bytes} bytes, more than {MAX_RECORD_BYTES}")]
    TooLong {
        /// Where it begins.
        at: u64,
        /// What it says.
        bytes: u64,
    },
    /// A record's content does not fit its length.
    #[error("byte {at}: the content of a {kind} record does not fit its length")]
    Content {
        /// Where the record, or the chunk around it, begins.
        at: u64,
        /// Which record.
        kind: &'static str,
    },
    /// The checksum is another one.
    #[error("byte {at}: the checksum of a {kind} is wrong")]
    Checksum {
        /// Where it begins.
        at: u64,
        /// What it belongs to.
        kind: &'static str,
    },
    /// A chunk is compressed in a way that is not known here.
    #[error("byte {at}: expected a chunk compressed by zstd or not at all, found {found:?}")]
    Compression {
        /// Where the chunk begins.
        at: u64,
        /// What it says.
        found: String,
    },
    /// A chunk does not decompress to what it says.
    #[error("byte {at}: a chunk does not decompress to its length")]
    Decompression {
        /// Where the chunk begins.
        at: u64,
    },
    /// A message of a channel that was never declared.
    #[error("byte {at}: a message of channel {channel}, which the file does not declare")]
    UnknownChannel {
        /// Where the chunk begins.
        at: u64,
        /// Its number in the file.
        channel: u16,
    },
    /// The file has no index at its end, or one that does not fit it.
    #[error("it has no index that fits it")]
    NoIndex,
}

/// The fields of a record, taken one after the other; `None` where there are too few bytes.
#[derive(Clone, Copy)]
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    /// So many bytes.
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    fn text(&mut self) -> Option<String> {
        Some(std::str::from_utf8(self.bytes()?).ok()?.to_owned())
    }

    fn map<K: Ord, V>(
        &mut self,
        mut entry: impl FnMut(&mut Self) -> Option<(K, V)>,
    ) -> Option<BTreeMap<K, V>> {
        let mut inner = Self(self.bytes()?);
        let mut map = BTreeMap::new();
        while !inner.0.is_empty() {
            let (key, value) = entry(&mut inner)?;
            map.insert(key, value);
        }
        Some(map)
    }

    fn texts(&mut self) -> Option<BTreeMap<String, String>> {
        self.map(|fields| Some((fields.text()?, fields.text()?)))
    }
}

/// The form of a topic's messages.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Schema {
    /// `sensor_msgs/msg/LaserScan`.
    pub name: String,
    /// `ros2msg`.
    pub encoding: String,
    /// The definition.
    pub data: Vec<u8>,
}

/// Declares a channel of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelRecord {
    /// Its number.
    pub id: u16,
    /// Number of its schema; 0 where it has none.
    pub schema: u16,
    /// `/scan`.
    pub topic: String,
    /// `cdr`.
    pub encoding: String,
    /// What else the file says about it.
    pub metadata: BTreeMap<String, String>,
}

/// What stands before a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageHead {
    /// Number of its channel in the file.
    pub channel: u16,
    /// Its number on the channel.
    pub sequence: u32,
    /// When it was recorded, nanoseconds.
    pub log_ns: u64,
    /// When it was sent, nanoseconds.
    pub publish_ns: u64,
}

/// A chunk as the index has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkEntry {
    /// Time of its first message, nanoseconds.
    pub first_ns: u64,
    /// Time of its last message, nanoseconds.
    pub last_ns: u64,
    /// Where its record begins.
    pub at: u64,
    /// Length of the record with its frame.
    pub bytes: u64,
    /// The channels that have messages in it; empty where that is not known.
    pub channels: Vec<u16>,
}

/// The counts at a file's end.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Messages of all channels.
    pub messages: u64,
    /// Time of the first message, nanoseconds.
    pub first_ns: u64,
    /// Time of the last message, nanoseconds.
    pub last_ns: u64,
    /// Messages by channel.
    pub by_channel: BTreeMap<u16, u64>,
}

/// A record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Record<'a> {
    /// The file's first: profile and library.
    Header(String, String),
    /// The form of messages, and its number.
    Schema(u16, Schema),
    /// A channel.
    Channel(ChannelRecord),
    /// A message.
    Message(MessageHead, &'a [u8]),
    /// A chunk, compressed.
    Chunk(ChunkHead, &'a [u8]),
    /// Facts under a name.
    Metadata(String, BTreeMap<String, String>),
    /// A file inside the file.
    Attachment(Attachment),
    /// The end of the data.
    DataEnd,
    /// Where the index begins, and its checksum.
    Footer(u64, u32),
    /// Of the index: a chunk.
    ChunkIndex(ChunkEntry),
    /// Of the index: an attachment, its name and size.
    AttachmentIndex(u64, String, u64),
    /// Of the index: metadata and its name.
    MetadataIndex(u64, String),
    /// Of the index: counts.
    Statistics(Statistics),
    /// One that says nothing new.
    Other,
}

/// A file inside the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// Its name.
    pub name: String,
    /// `application/json`.
    pub media_type: String,
    /// Its content.
    pub data: Vec<u8>,
}

/// What stands before the records of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkHead {
    /// Time of its first message, nanoseconds.
    pub first_ns: u64,
    /// Time of its last message, nanoseconds.
    pub last_ns: u64,
    /// Length of its records.
    pub bytes: u64,
    /// CRC-32 of its records; 0 where there is none.
    pub checksum: u32,
    /// `zstd`, or nothing.
    pub compression: String,
}

impl<'a> Record<'a> {
    /// Reads a record's content; an error names the record.
    pub fn parse(opcode: u8, content: &'a [u8]) -> Result<Self, &'static str> {
        let mut f = Fields(content);
        let (kind, record) = match opcode {
            op::HEADER => ("header", (|| Some(Self::Header(f.text()?, f.text()?)))()),
            op::SCHEMA => ("schema", schema(f)),
            op::CHANNEL => ("channel", channel(f)),
            op::MESSAGE => ("message", message(f)),
            op::CHUNK => ("chunk", chunk(f)),
            op::METADATA => ("metadata", (|| Some(Self::Metadata(f.text()?, f.texts()?)))()),
            op::ATTACHMENT => ("attachment", attachment(f)),
            op::DATA_END => ("data end", Some(Self::DataEnd)),
            op::FOOTER => ("footer", footer(f)),
            op::CHUNK_INDEX => ("chunk index", chunk_index(f)),
            op::ATTACHMENT_INDEX => ("attachment index", attachment_index(f)),
            op::METADATA_INDEX => ("metadata index", metadata_index(f)),
            op::STATISTICS => ("statistics", statistics(f)),
            _ => ("other", Some(Self::Other)),
        };
        record.ok_or(kind)
    }
}

fn schema<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let id = f.u16()?;
    let (name, encoding) = (f.text()?, f.text()?);
    Some(Record::Schema(id, Schema { name, encoding, data: f.bytes()?.to_vec() }))
}

fn channel<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (id, schema, topic) = (f.u16()?, f.u16()?, f.text()?);
    Some(Record::Channel(ChannelRecord { id, schema, topic, encoding: f.text()?, metadata: f.texts()? }))
}

fn message<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (channel, sequence, log_ns, publish_ns) = (f.u16()?, f.u32()?, f.u64()?, f.u64()?);
    Some(Record::Message(MessageHead { channel, sequence, log_ns, publish_ns }, f.0))
}

fn chunk<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (first_ns, last_ns, bytes, checksum) = (f.u64()?, f.u64()?, f.u64()?, f.u32()?);
    let (compression, length) = (f.text()?, f.u64()?);
    let head = ChunkHead { first_ns, last_ns, bytes, checksum, compression };
    Some(Record::Chunk(head, f.take(usize::try_from(length).ok()?)?))
}

fn attachment<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let _two_times = f.take(16)?;
    let (name, media_type) = (f.text()?, f.text()?);
    let length = usize::try_from(f.u64()?).ok()?;
    Some(Record::Attachment(Attachment { name, media_type, data: f.take(length)?.to_vec() }))
}

/// The checksum of an attachment covers all that stands before it; 0 is none.
fn is_attachment_sound(content: &[u8]) -> bool {
    let Some((said, checksum)) = content.split_last_chunk::<4>() else { return false };
    let checksum = u32::from_le_bytes(*checksum);
    checksum == 0 || checksum == crc32fast::hash(said)
}

fn footer<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (summary, _offsets) = (f.u64()?, f.u64()?);
    Some(Record::Footer(summary, f.u32()?))
}

fn chunk_index<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (first_ns, last_ns, at, bytes) = (f.u64()?, f.u64()?, f.u64()?, f.u64()?);
    let offsets = f.map(|f| Some((f.u16()?, f.u64()?)))?;
    let channels = offsets.into_keys().collect();
    Some(Record::ChunkIndex(ChunkEntry { first_ns, last_ns, at, bytes, channels }))
}

fn attachment_index<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (at, _bytes, _log, _created, size) = (f.u64()?, f.u64()?, f.u64()?, f.u64()?, f.u64()?);
    Some(Record::AttachmentIndex(at, f.text()?, size))
}

fn metadata_index<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (at, _bytes) = (f.u64()?, f.u64()?);
    Some(Record::MetadataIndex(at, f.text()?))
}

fn statistics<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let messages = f.u64()?;
    let _counts = f.take(2 + 4 * 4)?;
    let (first_ns, last_ns) = (f.u64()?, f.u64()?);
    let by_channel = f.map(|f| Some((f.u16()?, f.u64()?)))?;
    Some(Record::Statistics(Statistics { messages, first_ns, last_ns, by_channel }))
}

/// Why the next record cannot be had.
#[derive(Debug)]
pub enum Stop {
    /// The file ends in the middle of it, or before it.
    Cut,
    /// It is damaged.
    Damage(Damage),
    /// The system cannot read it.
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

/// A file of records.
pub struct RecordFile {
    file: BufReader<File>,
    at: u64,
    bytes: u64,
    content: Vec<u8>,
    read: u64,
}

impl RecordFile {
    /// Opens a file and checks how it begins.
    pub fn open(path: &Path) -> Result<Self, Stop> {
        let mut file = BufReader::with_capacity(1 << 16, File::open(path)?);
        let bytes = file.get_ref().metadata()?.len();
        let mut magic = [0; mcap::MAGIC.len()];
        if bytes < magic.len() as u64 {
            return Err(Damage::Empty.into());
        }
        file.read_exact(&mut magic)?;
        if magic != *mcap::MAGIC {
            return Err(Damage::NoMcap.into());
        }
        let at = magic.len() as u64;
        Ok(Self { file, at, bytes, content: Vec::new(), read: at })
    }

    /// Where the next record begins.
    pub fn at(&self) -> u64 {
        self.at
    }

    /// Length of the file.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// How many bytes were read so far, in all.
    pub fn bytes_read(&self) -> u64 {
        self.read
    }

    /// Goes to another record.
    pub fn seek(&mut self, at: u64) -> Result<(), Stop> {
        if at > self.bytes {
            return Err(Stop::Cut);
        }
        if at != self.at {
            self.file.seek(SeekFrom::Start(at))?;
            self.at = at;
        }
        Ok(())
    }

    /// Reads the next record; its opcode. The content is [`RecordFile::content`].
    pub fn advance(&mut self) -> Result<u8, Stop> {
        let begin = self.at;
        let left = self.bytes - begin;
        if left < FRAME_BYTES {
            return Err(Stop::Cut);
        }
        let mut frame = [0; FRAME_BYTES as usize];
        self.fill_from_file(&mut frame)?;
        let [opcode, length @ ..] = frame;
        let length = u64::from_le_bytes(length);
        if length > MAX_RECORD_BYTES as u64 {
            return Err(Damage::TooLong { at: begin, bytes: length }.into());
        }
        if length > left - FRAME_BYTES {
            return Err(Stop::Cut);
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

    fn fill_from_file(&mut self, into: &mut [u8]) -> Result<(), Stop> {
        self.file.read_exact(into).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => Stop::Cut,
            _ => Stop::Io(error),
        })?;
        self.at += into.len() as u64;
        self.read += into.len() as u64;
        Ok(())
    }

    /// Goes to the next place from `from` on where a chunk seems to begin: its opcode, a length that ends in
    /// the file, and a compression that is known. Reads what lies between once, in pieces.
    pub fn find_chunk(&mut self, from: u64) -> Result<Option<u64>, Stop> {
        const PIECE: usize = 1 << 20;
        /// Frame, times, length, checksum, the compression's length and name.
        const HEAD: usize = 9 + 8 + 8 + 8 + 4 + 4 + 4;
        let mut begin = from;
        while begin < self.bytes {
            self.seek(begin)?;
            let mut piece = vec![0; PIECE.min((self.bytes - begin) as usize)];
            self.fill_from_file(&mut piece)?;
            for (offset, head) in piece.windows(HEAD).enumerate() {
                let at = begin + offset as u64;
                let length = head[1..9].try_into().map_or(u64::MAX, u64::from_le_bytes);
                let is_chunk = head[0] == op::CHUNK && head[37..] == b"\x04\0\0\0zstd"[..];
                if is_chunk && length <= self.bytes - at {
                    self.seek(at)?;
                    return Ok(Some(at));
                }
            }
            if piece.len() < HEAD || begin + piece.len() as u64 == self.bytes {
                return Ok(None);
            }
            begin += (piece.len() - HEAD + 1) as u64;
        }
        Ok(None)
    }

    /// The content of the record that was read last.
    pub fn content(&self) -> &[u8] {
        &self.content
    }

    /// The records of the index at the file's end, one behind the other.
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
        // The checksum covers the footer too, up to where it stands itself.
        let mut summary = vec![0; length as usize + FRAME_BYTES as usize + 16];
        self.fill_from_file(&mut summary)?;
        if checksum != 0 && checksum != crc32fast::hash(&summary) {
            return Err(Damage::Checksum { at: begin, kind: "summary" }.into());
        }
        summary.truncate(length as usize);
        Ok(summary)
    }
}

/// The next record in `bytes`: its opcode and where its content lies.
pub fn next_in(bytes: &[u8], at: usize) -> Option<(u8, Range<usize>)> {
    let mut fields = Fields(bytes.get(at..)?);
    let opcode = *fields.take(1)?.first()?;
    let length = usize::try_from(fields.u64()?).ok()?;
    fields.take(length)?;
    let begin = at + FRAME_BYTES as usize;
    Some((opcode, begin..begin + length))
}

/// Puts the records of a chunk, which begins at byte `at` of its file, into `out`, in place of what was there.
pub fn unpack(head: &ChunkHead, packed: &[u8], at: u64, out: &mut Vec<u8>) -> Result<(), Damage> {
    if head.bytes > MAX_RECORD_BYTES as u64 {
        return Err(Damage::TooLong { at, bytes: head.bytes });
    }
    let length = head.bytes as usize;
    out.clear();
    match head.compression.as_str() {
        "" => out.extend_from_slice(packed),
        "zstd" => {
            out.reserve_exact(length);
            let unpacked =
                zstd::bulk::Decompressor::new().and_then(|mut z| z.decompress_to_buffer(packed, out));
            unpacked.map_err(|_| Damage::Decompression { at })?;
        }
        other => return Err(Damage::Compression { at, found: other.to_owned() }),
    }
    if out.len() != length {
        return Err(Damage::Decompression { at });
    }
    if head.checksum != 0 && head.checksum != crc32fast::hash(out) {
        return Err(Damage::Checksum { at, kind: "chunk" });
    }
    Ok(())
}
