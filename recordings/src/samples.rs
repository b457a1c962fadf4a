//! Recordings by other software, assembled byte by byte for tests, with any profile, compression, message
//! form and damage.

use std::io::Write;

use mcap::records::op;

/// A topic of a sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SampleTopic {
    /// Name, such as `/ball`.
    pub name: &'static str,
    /// Type, such as `geometry_msgs/msg/PointStamped`.
    pub kind: &'static str,
    /// Language of the definition, such as `ros2msg`.
    pub language: &'static str,
    /// The definition.
    pub definition: &'static str,
    /// Encoding of the messages, such as `cdr`.
    pub encoding: &'static str,
    /// Time in nanoseconds, sequence number and bytes of each message.
    pub messages: Vec<(u64, u32, Vec<u8>)>,
}

/// How a sample is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleForm {
    /// Profile, such as `ros2`.
    pub profile: &'static str,
    /// Compression of the chunks: `lz4`, `zstd`, or empty for none.
    pub compression: &'static str,
    /// Number of messages in a chunk.
    pub per_chunk: usize,
    /// True if the chunks' checksums are correct.
    pub has_checksums: bool,
}

impl Default for SampleForm {
    fn default() -> Self {
        Self { profile: "ros2", compression: "zstd", per_chunk: 10, has_checksums: true }
    }
}

/// The definition of `geometry_msgs/msg/PointStamped`.
pub const POINT_STAMPED: &str = "std_msgs/Header header\ngeometry_msgs/Point point\n\
    ================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
    ================\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";

/// Encodes a `geometry_msgs/msg/PointStamped` in either byte order.
pub fn point_stamped(ns: u64, [x, y]: [f64; 2], is_big_endian: bool) -> Vec<u8> {
    let order = |mut bytes: Vec<u8>| {
        if is_big_endian {
            bytes.reverse();
        }
        bytes
    };
    let number = |number: u32| order(number.to_le_bytes().to_vec());
    let head = vec![0, u8::from(!is_big_endian), 0, 0];
    let stamp = [number((ns / 1_000_000_000) as u32), number((ns % 1_000_000_000) as u32)].concat();
    let frame = [number(4), b"map\0".to_vec()].concat();
    let point = [x, y, 0.0].map(|value| order(value.to_le_bytes().to_vec())).concat();
    [head, stamp, frame, point].concat()
}

/// Returns a topic with `count` points that move along x, one every 0.1 s, without sequence numbers.
pub fn points(name: &'static str, count: u64, is_big_endian: bool) -> SampleTopic {
    let message = |n: u64| {
        let ns = 1_700_000_000_000_000_000 + n * 100_000_000;
        (ns, 0, point_stamped(ns, [n as f64, 2.0], is_big_endian))
    };
    SampleTopic {
        name,
        kind: "geometry_msgs/msg/PointStamped",
        language: "ros2msg",
        definition: POINT_STAMPED,
        encoding: "cdr",
        messages: (0..count).map(message).collect(),
    }
}

/// Returns the bytes of a recording.
pub fn recording(form: SampleForm, topics: &[SampleTopic]) -> Vec<u8> {
    let mut file = mcap::MAGIC.to_vec();
    file.extend(record(op::HEADER, &[text(form.profile), text("another tool")].concat()));
    let mut messages: Vec<_> = topics
        .iter()
        .zip(1_u16..)
        .flat_map(|(topic, id)| topic.messages.iter().map(move |message| (message, id)))
        .collect();
    messages.sort_by_key(|((ns, ..), id)| (*ns, *id));
    for part in messages.chunks(form.per_chunk) {
        let declared = topics.iter().zip(1_u16..).flat_map(|(topic, id)| declare(topic, id));
        let records: Vec<u8> = declared
            .chain(part.iter().flat_map(|((ns, seq, data), id)| message(*id, *seq, *ns, data)))
            .collect();
        let times = [part[0].0.0, part[part.len() - 1].0.0];
        file.extend(chunk(form, times, &records));
        for id in 1..=topics.len() as u16 {
            let entries = part
                .iter()
                .filter(|(_, of)| *of == id)
                .flat_map(|((ns, ..), _)| [ns.to_le_bytes(), 0_u64.to_le_bytes()].concat());
            let entries: Vec<u8> = entries.collect();
            let content = [id.to_le_bytes().to_vec(), counted(&entries)].concat();
            file.extend(record(op::MESSAGE_INDEX, &content));
        }
    }
    file.extend(record(op::DATA_END, &[0; 4]));
    file.extend(record(op::FOOTER, &[0; 20]));
    file.extend(mcap::MAGIC);
    file
}

fn record(opcode: u8, content: &[u8]) -> Vec<u8> {
    [&[opcode], (content.len() as u64).to_le_bytes().as_slice(), content].concat()
}

fn counted(bytes: &[u8]) -> Vec<u8> {
    [(bytes.len() as u32).to_le_bytes().as_slice(), bytes].concat()
}

fn text(text: &str) -> Vec<u8> {
    counted(text.as_bytes())
}

fn declare(topic: &SampleTopic, id: u16) -> Vec<u8> {
    let definition = counted(topic.definition.as_bytes());
    let schema = [id.to_le_bytes().to_vec(), text(topic.kind), text(topic.language), definition].concat();
    let numbers = [id.to_le_bytes(), id.to_le_bytes()].concat();
    let channel = [numbers, text(topic.name), text(topic.encoding), counted(&[])].concat();
    [record(op::SCHEMA, &schema), record(op::CHANNEL, &channel)].concat()
}

fn message(channel: u16, seq: u32, ns: u64, data: &[u8]) -> Vec<u8> {
    let head =
        [&channel.to_le_bytes()[..], &seq.to_le_bytes(), &ns.to_le_bytes(), &ns.to_le_bytes()].concat();
    record(op::MESSAGE, &[&head, data].concat())
}

fn chunk(form: SampleForm, [first_ns, last_ns]: [u64; 2], records: &[u8]) -> Vec<u8> {
    let checksum = crc32fast::hash(records) ^ u32::from(!form.has_checksums);
    let packed = packed(form.compression, records);
    let head = [first_ns.to_le_bytes(), last_ns.to_le_bytes(), (records.len() as u64).to_le_bytes()].concat();
    let length = (packed.len() as u64).to_le_bytes();
    let content = [&head, &checksum.to_le_bytes()[..], &text(form.compression), &length, &packed].concat();
    record(op::CHUNK, &content)
}

/// Packs bytes like those of a chunk. An unknown compression leaves them unchanged.
pub fn packed(compression: &str, bytes: &[u8]) -> Vec<u8> {
    match compression {
        "zstd" => zstd::stream::encode_all(bytes, 1).unwrap_or_default(),
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            let written = encoder.write_all(bytes);
            written.ok().and_then(|()| encoder.finish().ok()).unwrap_or_default()
        }
        _ => bytes.to_vec(),
    }
}
