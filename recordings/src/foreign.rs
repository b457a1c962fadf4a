//! Recognizes files that are not MCAP recordings, and unsupported forms of messages, and suggests converters. "Not ours" and "not
//! supported" do not mean "broken", so an error describes what was found and what to do.

use std::fmt;

use crate::directory::Topic;

/// Number of bytes at the beginning of a file that are examined.
pub(crate) const LOOKED_AT: usize = 512;

/// The commands that accept any MCAP file, regardless of its messages.
pub const OF_ANY_MCAP: &str = "info, hz, filter, merge, split, recover, report and view";
/// The commands that accept every MCAP file with ROS 2 messages, no matter which software wrote it.
pub const OF_ROS2: &str = "info, echo, hz, filter, merge, split, recover, relations, report and view";

/// A file that is not an MCAP file, identified by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foreign {
    /// An SQLite database, which rosbag2 wrote by default before Iron.
    Sqlite,
    /// A ROS 1 bag.
    RosBag1,
    /// A file compressed by zstd.
    Zstd,
    /// A file compressed by LZ4.
    Lz4,
    /// A file compressed by gzip.
    Gzip,
    /// A file compressed by bzip2.
    Bzip2,
    /// A file compressed by xz.
    Xz,
    /// A ZIP archive.
    Zip,
    /// A PX4 log.
    ULog,
    /// The metadata of a rosbag2 folder.
    BagMetadata,
    /// A CARMEN laser log.
    Carmen,
    /// A Git LFS pointer in place of a file.
    LfsPointer,
    /// Any other text.
    Text,
    /// Anything else.
    Unknown,
}

/// The first bytes of binary files.
const MAGICS: [(&[u8], Foreign); 9] = [
    (b"SQLite format 3\0", Foreign::Sqlite),
    (b"#ROSBAG V", Foreign::RosBag1),
    (b"\x28\xb5\x2f\xfd", Foreign::Zstd),
    (b"\x04\x22\x4d\x18", Foreign::Lz4),
    (b"\x1f\x8b", Foreign::Gzip),
    (b"BZh", Foreign::Bzip2),
    (b"\xfd7zXZ\0", Foreign::Xz),
    (b"PK\x03\x04", Foreign::Zip),
    (b"ULog\x01\x12\x35", Foreign::ULog),
];

/// The first words of the lines in CARMEN logs.
const CARMEN_WORDS: [&str; 7] = ["FLASER", "RLASER", "ROBOTLASER1", "RAWLASER1", "ODOM", "PARAM", "# CARMEN"];

impl Foreign {
    /// Returns the kind of file that begins with these bytes.
    pub fn of(begin: &[u8]) -> Self {
        let known = MAGICS.iter().find(|(magic, _)| begin.starts_with(magic));
        known.map_or_else(|| Self::of_text(begin), |(_, foreign)| *foreign)
    }

    fn of_text(begin: &[u8]) -> Self {
        // The last character may be cut off.
        let text = match std::str::from_utf8(begin) {
            Ok(text) => text,
            Err(error) if error.error_len().is_none() => {
                std::str::from_utf8(&begin[..error.valid_up_to()]).unwrap_or_default()
            }
            Err(_) => return Self::Unknown,
        };
        if text.is_empty() || text.contains('\0') {
            return Self::Unknown;
        }
        let is_of_carmen = |line: &str| CARMEN_WORDS.iter().any(|word| line.starts_with(word));
        match text {
            _ if text.starts_with("version https://git-lfs.github.com/spec/") => Self::LfsPointer,
            _ if text.contains("rosbag2_bagfile_information") => Self::BagMetadata,
            _ if text.lines().any(is_of_carmen) => Self::Carmen,
            _ => Self::Text,
        }
    }
}

impl fmt::Display for Foreign {
    /// Describes the file and suggests a converter to a recording.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sqlite => {
                "an SQLite database, as rosbag2 writes it (sqlite3); `mcap convert FILE.db3 FILE.mcap` makes an MCAP \
                 file of it, `ros2 bag convert` of its whole folder"
            }
            Self::RosBag1 => {
                "a ROS 1 bag; `rosbags-convert --src FILE.bag --dst FOLDER` makes a ROS 2 recording of it, \
                 `mcap convert FILE.bag FILE.mcap` an MCAP file with ROS 1 messages"
            }
            Self::Zstd => "a file compressed with zstd; unpack it first: `zstd -d FILE`",
            Self::Lz4 => "a file compressed with LZ4; unpack it first: `lz4 -d FILE`",
            Self::Gzip => "a file compressed with gzip; unpack it first: `gunzip FILE` (if it is a CARMEN log: `sketchnav import`)",
            Self::Bzip2 => "a file compressed with bzip2; unpack it first: `bunzip2 FILE`",
            Self::Xz => "a file compressed with xz; unpack it first: `unxz FILE`",
            Self::Zip => "a ZIP archive; unpack it first: `unzip FILE`",
            Self::ULog => "a PX4 log (ULog), which is not a ROS 2 recording",
            Self::BagMetadata => "the metadata of a rosbag2 folder; pass the folder instead",
            Self::Carmen => "a CARMEN laser log; `sketchnav import` makes a recording of it",
            Self::LfsPointer => "a Git LFS pointer instead of the file; `git lfs pull` fetches the file",
            Self::Text => "text: it does not begin with the magic bytes of MCAP",
            Self::Unknown => "other bytes: it does not begin with the magic bytes of MCAP",
        })
    }
}

/// The form of a topic's messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// ROS 2 messages in CDR.
    Ros2,
    /// ROS 1 messages.
    Ros1,
    /// JSON text.
    Json,
    /// Anything else.
    Other,
}

impl Form {
    /// Returns the form of a topic's messages, according to the file.
    pub fn of(topic: &Topic) -> Self {
        match (topic.encoding.as_str(), topic.schema.encoding.as_str()) {
            ("cdr", _) => Self::Ros2,
            ("ros1", _) | (_, "ros1msg") => Self::Ros1,
            ("json", _) => Self::Json,
            _ => Self::Other,
        }
    }

    /// Describes the messages of a topic with this form, for example `ROS 1 messages`.
    pub fn words(self, topic: &Topic) -> String {
        match self {
            Self::Ros2 => "ROS 2 messages".to_owned(),
            Self::Ros1 => "ROS 1 messages".to_owned(),
            Self::Json => "messages in JSON".to_owned(),
            Self::Other if topic.encoding.is_empty() => {
                "messages in an encoding that the file does not name".to_owned()
            }
            Self::Other => format!("messages in the encoding {:?}", topic.encoding),
        }
    }

    /// Returns what can convert the messages into ROS 2 messages, for errors.
    pub fn way_on(self) -> &'static str {
        match self {
            Self::Ros1 => {
                "`rosbags-convert --src FILE.bag --dst FOLDER` makes a ROS 2 recording of the bag that they come from"
            }
            _ => "to get ROS 2 messages, record them with `ros2 bag record -s mcap`",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_recognised_by_its_first_bytes() {
        let cases: [(&[u8], Foreign, &str); 15] = [
            (b"SQLite format 3\0\x10\0", Foreign::Sqlite, "ros2 bag convert"),
            (b"#ROSBAG V2.0\n", Foreign::RosBag1, "rosbags-convert"),
            (b"\x28\xb5\x2f\xfd\x04", Foreign::Zstd, "zstd -d"),
            (b"\x04\x22\x4d\x18", Foreign::Lz4, "lz4 -d"),
            (b"\x1f\x8b\x08", Foreign::Gzip, "gunzip"),
            (b"BZh91AY", Foreign::Bzip2, "bunzip2"),
            (b"\xfd7zXZ\0", Foreign::Xz, "unxz"),
            (b"PK\x03\x04", Foreign::Zip, "unzip"),
            (b"ULog\x01\x12\x35", Foreign::ULog, "PX4"),
            (b"rosbag2_bagfile_information:\n  version: 9\n", Foreign::BagMetadata, "pass the folder"),
            (
                b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
                Foreign::LfsPointer,
                "git lfs pull",
            ),
            (b"# a log\nFLASER 3 1.0 1.0 1.0 0 0 0\n", Foreign::Carmen, "sketchnav import"),
            (b"hello", Foreign::Text, "text"),
            // A two-byte character that is cut off.
            (b"hell\xc3", Foreign::Text, "text"),
            (b"\xff\xd8\xff", Foreign::Unknown, "other bytes"),
        ];
        for (begin, foreign, words) in cases {
            assert_eq!(Foreign::of(begin), foreign, "{words}");
            assert!(foreign.to_string().contains(words), "{foreign}");
        }
    }
}
