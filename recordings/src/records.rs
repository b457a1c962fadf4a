//! The records of an MCAP file, read without trusting any length or count in them.
//!
//! Every length is first checked against the bytes that exist, so reading never allocates more than the length of the file,
//! or more than [`MAX_RECORD_BYTES`]. Source: the MCAP specification, version 0.
//!
//! The mcap crate's own readers, which support a `record_length_limit` since 0.26, are not used. With a limit of 64 MB, they gave
//! these results on 60,000 damaged copies of the golden recordings, both compressed and uncompressed:
//!
//! - They allocate up to 4 GB regardless of the limit, because it applies to records but not to the strings
//!   in them (`McapString`). The readers here allocated 1 MB at most.
//! - In 58 files, `LinearReader` subtracts a record's length from a smaller remainder of an uncompressed
//!   chunk. With overflow checks, it panics, and without them, it reads records from beyond the chunk.
//! - `parse_record` panics on an attachment that ends before its checksum. A test documents this, and will
//!   show when it is fixed.
//! - They do not report where in the file a record begins, which is needed for seeking, for repairing, and for the index of a
//!   file without a summary.

use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;

use mcap::records::op;

use crate::foreign::Foreign;

/// Maximum length of a record, and of a chunk in either form, that is read into memory. This leaves space for the longest file that
/// a run may name (64 MiB) together with its name and times.
pub const MAX_RECORD_BYTES: usize = 65 << 20;
/// Size of the opcode and the length.
pub(crate) const FRAME_BYTES: u64 = 9;

/// The faults in the bytes of a recording.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// The file is shorter than the magic of an MCAP file.
    #[error("the file is empty")]
    Empty,
    /// The file does not begin as an MCAP file does.
    #[error("expected an MCAP file, found {0}")]
    NoMcap(Foreign),
    /// The magic is wrong, but an MCAP file follows it.
    #[error(
        "it does not begin with the magic bytes of MCAP, but the rest is MCAP; `sketchnav recover` repairs that"
    )]
    Magic,
    /// A record is longer than any record of a recording can be.
    #[error("byte {at}: expected a record of at most {MAX_RECORD_BYTES} bytes, found {bytes}")]
    TooLong {
        /// Offset of the record in the file, in bytes.
        at: u64,
        /// The stated length, in bytes.
        bytes: u64,
    },
    /// A record's content does not match its length.
    #[error("byte {at}: the content of a {kind} record does not match its length")]
    Content {
        /// Offset of the record, or of the chunk around it, in bytes.
        at: u64,
        /// The kind of record.
        kind: &'static str,
    },
    /// The checksum is wrong.
    #[error("byte {at}: the checksum of a {kind} is wrong")]
    Checksum {
        /// Offset of the record in the file, in bytes.
        at: u64,
        /// The kind of record.
        kind: &'static str,
    },
    /// The compression of a chunk is unknown.
    #[error("byte {at}: expected a chunk compressed with zstd, with lz4 or not at all, found {found:?}")]
    Compression {
        /// Offset of the chunk in the file, in bytes.
        at: u64,
        /// The name of the compression.
        found: String,
    },
    /// The decompressed chunk does not have its stated length.
    #[error("byte {at}: a chunk does not decompress to its stated length")]
    Decompression {
        /// Offset of the chunk in the file, in bytes.
        at: u64,
    },
    /// A message belongs to a channel that was never declared.
    #[error("byte {at}: a message of channel {channel}, which the file does not declare")]
    UnknownChannel {
        /// Offset of the chunk in the file, in bytes.
        at: u64,
        /// The channel's number in the file.
        channel: u16,
    },
    /// The file ends inside a record, or before one that its index names.
    #[error("byte {at}: the file ends within the record that begins there")]
    Cut {
        /// Offset of the record in the file, in bytes.
        at: u64,
    },
    /// The file has no index at its end, or one that does not match it.
    #[error("the file has no valid index")]
    NoIndex,
}

/// Reads the fields of a record one after another. Each method returns `None` if too few bytes are left.
#[derive(Clone, Copy)]
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    /// Takes the next `count` bytes.
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

/// The schema of a topic's messages.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Schema {
    /// Name of the type, such as `sensor_msgs/msg/LaserScan`.
    pub name: String,
    /// Language of the definition, such as `ros2msg`.
    pub encoding: String,
    /// The definition.
    pub data: Vec<u8>,
}

/// The header of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileHeader {
    /// Profile: `ros2`, `ros1`, or empty.
    pub profile: String,
    /// The library that wrote the file.
    pub library: String,
}

/// The declaration of a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelRecord {
    /// Number of the channel.
    pub id: u16,
    /// Number of the channel's schema, or 0 if it has none.
    pub schema: u16,
    /// Name of the topic, such as `/scan`.
    pub topic: String,
    /// Encoding of the messages, such as `cdr`.
    pub encoding: String,
    /// Metadata of the channel.
    pub metadata: BTreeMap<String, String>,
}

/// The fields before the data of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageHead {
    /// Number of the channel in the file.
    pub channel: u16,
    /// Sequence number of the message on the channel.
    pub sequence: u32,
    /// Recording time of the message, in nanoseconds.
    pub log_ns: u64,
    /// Send time of the message, in nanoseconds.
    pub publish_ns: u64,
}

/// A chunk as listed in the index or, in a file whose messages are not in chunks, a run of records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkEntry {
    /// Time of the first message, in nanoseconds.
    pub first_ns: u64,
    /// Time of the last message, in nanoseconds.
    pub last_ns: u64,
    /// Offset of the chunk's record, or of the first record of the run, in bytes.
    pub at: u64,
    /// Length of the chunk's record including its frame, or of the whole run, in bytes.
    pub bytes: u64,
    /// Length of the redundant message index that follows the chunk, in bytes.
    pub index_bytes: u64,
    /// The channels that have messages in the chunk. Empty if they are not known.
    pub channels: Vec<u16>,
}

/// An attachment as listed in the index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttachmentEntry {
    /// Name of the attachment.
    pub name: String,
    /// Offset of the attachment's record, in bytes.
    pub at: u64,
    /// Length of the record including its frame, in bytes.
    pub record_bytes: u64,
    /// Length of the content, in bytes.
    pub bytes: u64,
}

/// The statistics at the end of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Number of messages of all channels.
    pub messages: u64,
    /// Time of the first message, in nanoseconds.
    pub first_ns: u64,
    /// Time of the last message, in nanoseconds.
    pub last_ns: u64,
    /// Number of messages by channel.
    pub by_channel: BTreeMap<u16, u64>,
}

/// A record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Record<'a> {
    /// The first record of the file.
    Header(FileHeader),
    /// A schema with its number.
    Schema(u16, Schema),
    /// A channel.
    Channel(ChannelRecord),
    /// A message.
    Message(MessageHead, &'a [u8]),
    /// A chunk with its compressed records.
    Chunk(ChunkHead, &'a [u8]),
    /// Metadata: key-value pairs under a name.
    Metadata(String, BTreeMap<String, String>),
    /// A file embedded in the recording.
    Attachment(Attachment),
    /// The end of the data.
    DataEnd,
    /// The offset of the index, and its checksum.
    Footer(u64, u32),
    /// An index entry for a chunk.
    ChunkIndex(ChunkEntry),
    /// An index entry for an attachment.
    AttachmentIndex(AttachmentEntry),
    /// An index entry for metadata: where its record begins, the record's length including the frame, and the name.
    MetadataIndex(u64, u64, String),
    /// The statistics of the index.
    Statistics(Statistics),
    /// A redundant or unknown record.
    Other,
}

/// A file embedded in the recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// Name of the file.
    pub name: String,
    /// Media type, such as `application/json`.
    pub media_type: String,
    /// Content of the file.
    pub data: Vec<u8>,
}

/// The fields before the records of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkHead {
    /// Time of the first message, in nanoseconds.
    pub first_ns: u64,
    /// Time of the last message, in nanoseconds.
    pub last_ns: u64,
    /// Length of the decompressed records, in bytes.
    pub bytes: u64,
    /// CRC-32 of the decompressed records, or 0 if there is none.
    pub checksum: u32,
    /// Compression: `zstd`, `lz4`, or empty for none.
    pub compression: String,
}

impl<'a> Record<'a> {
    /// Parses the content of a record. The error is the name of the record.
    pub fn parse(opcode: u8, content: &'a [u8]) -> Result<Self, &'static str> {
        let mut f = Fields(content);
        let (kind, record) = match opcode {
            op::HEADER => ("header", header(f)),
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

fn header<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    Some(Record::Header(FileHeader { profile: f.text()?, library: f.text()? }))
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
    let (data, _checksum) = (f.take(length)?.to_vec(), f.take(4)?);
    Some(Record::Attachment(Attachment { name, media_type, data }))
}

fn footer<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (summary, _offsets) = (f.u64()?, f.u64()?);
    Some(Record::Footer(summary, f.u32()?))
}

fn chunk_index<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (first_ns, last_ns, at, bytes) = (f.u64()?, f.u64()?, f.u64()?, f.u64()?);
    let offsets = f.map(|f| Some((f.u16()?, f.u64()?)))?;
    let (channels, index_bytes) = (offsets.into_keys().collect(), f.u64()?);
    Some(Record::ChunkIndex(ChunkEntry { first_ns, last_ns, at, bytes, index_bytes, channels }))
}

fn attachment_index<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let (at, record_bytes, _log, _created, bytes) = (f.u64()?, f.u64()?, f.u64()?, f.u64()?, f.u64()?);
    Some(Record::AttachmentIndex(AttachmentEntry { name: f.text()?, at, record_bytes, bytes }))
}

fn metadata_index<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    Some(Record::MetadataIndex(f.u64()?, f.u64()?, f.text()?))
}

fn statistics<'a>(mut f: Fields<'a>) -> Option<Record<'a>> {
    let messages = f.u64()?;
    let _counts = f.take(2 + 4 * 4)?;
    let (first_ns, last_ns) = (f.u64()?, f.u64()?);
    let by_channel = f.map(|f| Some((f.u16()?, f.u64()?)))?;
    Some(Record::Statistics(Statistics { messages, first_ns, last_ns, by_channel }))
}

/// Returns true if a record is of unknown kind, or does not have the length of its kind. Readers skip such
/// records, as the specification requires. Repairs report them, since one of them may be a chunk with a
/// damaged opcode.
pub fn is_odd(opcode: u8, content: &[u8]) -> bool {
    let length = content.len();
    match opcode {
        op::FOOTER => length != 20,
        op::DATA_END => length != 4,
        op::SUMMARY_OFFSET => length != 17,
        op::MESSAGE_INDEX => !is_filled(content, |f| f.take(2).and(f.bytes())),
        op::STATISTICS => !is_filled(content, |f| f.take(42).and(f.bytes())),
        op::METADATA_INDEX => !is_filled(content, |f| f.take(16).and(f.bytes())),
        op::ATTACHMENT_INDEX => !is_filled(content, |f| f.take(40).and(f.bytes()).and(f.bytes())),
        op::CHUNK_INDEX => {
            !is_filled(content, |f| f.take(32).and(f.bytes()).and(f.take(8)).and(f.bytes()).and(f.take(16)))
        }
        op::HEADER..=op::DATA_END => false,
        _ => true,
    }
}

/// Returns true if the fields that `take` reads take up all of a record.
fn is_filled<'a>(content: &'a [u8], take: impl Fn(&mut Fields<'a>) -> Option<&'a [u8]>) -> bool {
    let mut fields = Fields(content);
    take(&mut fields).is_some() && fields.0.is_empty()
}

/// Returns the next record in `bytes`: its opcode and the range of its content.
pub fn next_in(bytes: &[u8], at: usize) -> Option<(u8, Range<usize>)> {
    let mut fields = Fields(bytes.get(at..)?);
    let opcode = *fields.take(1)?.first()?;
    let length = usize::try_from(fields.u64()?).ok()?;
    fields.take(length)?;
    let begin = at + FRAME_BYTES as usize;
    Some((opcode, begin..begin + length))
}

/// Returns the length of a chunk record's content if nothing follows the compressed data, in bytes.
pub fn chunk_bytes(head: &ChunkHead, packed: &[u8]) -> u64 {
    /// Size of the times, length, checksum, and two lengths.
    const FIXED: usize = 8 + 8 + 8 + 4 + 4 + 8;
    (FIXED + head.compression.len() + packed.len()) as u64
}

/// Decompresses the records of a chunk into `out`, replacing its content. `at` is the offset of the chunk in
/// its file, for errors.
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
        "lz4" => {
            out.reserve_exact(length);
            let mut frame = lz4_flex::frame::FrameDecoder::new(packed).take(head.bytes + 1);
            frame.read_to_end(out).map_err(|_| Damage::Decompression { at })?;
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
