//! Reads and writes the `metadata.yaml` of rosbag2 folders. Version 9 is written, for `ros2 bag` and rosbags,
//! which read it before the files. Folders by other software are read in any version. Also handles files that
//! rosbag2 has compressed as a whole.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::{self, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use sketchnav_schemas::shown::one_line;

use crate::copy::PartFacts;
use crate::directory::Topic;

/// Name of the metadata file.
pub const METADATA: &str = "metadata.yaml";
/// Extension of files that rosbag2 has compressed as a whole (`compression_mode: FILE`).
pub const PACKED: &str = "zstd";
/// The only compression that rosbag2 supports.
const COMPRESSION: &str = "zstd";
/// Limit for the metadata, which has a few lines for each of up to a few thousand topics.
const BAG: sketchnav_files::Limit = sketchnav_files::Limit { what: "the metadata of a bag", bytes: 64 << 20 };

/// A rosbag2 folder, as described by its metadata.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bag {
    /// Storage: `mcap` or `sqlite3`.
    pub storage: String,
    /// The listed files that exist, in order.
    pub files: Vec<PathBuf>,
    /// The names of the listed files that are missing.
    pub missing: Vec<String>,
    /// Number of messages in all files, if given in the metadata.
    pub messages: Option<u64>,
}

/// The reason why a rosbag2 folder cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The metadata cannot be read, or is invalid.
    #[error("{path}: {reason}", path = path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The messages are in a storage other than MCAP.
    #[error(
        "{folder}: expected MCAP files, found a rosbag2 folder with the storage {storage:?} ({files}); \
         `ros2 bag convert -i FOLDER -o OPTIONS.yaml` with `storage_id: mcap`, or for each file \
         `mcap convert FILE.db3 FILE.mcap`, makes MCAP files of it",
        folder = folder.display()
    )]
    Storage {
        /// The folder.
        folder: PathBuf,
        /// The storage.
        storage: String,
        /// The names of the files.
        files: String,
    },
    /// The files are compressed in a way that is not supported.
    #[error(
        "{folder}: expected files compressed with zstd or not at all, found a rosbag2 folder with the compression {found:?}; \
         `ros2 bag convert -i FOLDER -o OPTIONS.yaml` makes one without compression",
        folder = folder.display()
    )]
    Compression {
        /// The folder.
        folder: PathBuf,
        /// The compression.
        found: String,
    },
}

#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    storage_identifier: String,
    #[serde(default)]
    compression_format: Option<String>,
    #[serde(default)]
    relative_file_paths: Vec<String>,
    #[serde(default)]
    message_count: Option<u64>,
}

impl Bag {
    /// Reads the metadata of `folder`. Returns `None` if it has none.
    ///
    /// # Errors
    /// [`BagError::Metadata`] if the metadata is invalid, [`BagError::Compression`] if the files are compressed by anything
    /// but zstd.
    pub fn read(folder: &Path) -> Result<Option<Self>, BagError> {
        let path = folder.join(METADATA);
        let wrong = |reason: String| BagError::Metadata { path: path.clone(), reason };
        let text = match sketchnav_files::read_to_string(&path, BAG) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|error| wrong(error.to_string()))?,
        };
        let metadata: Metadata = serde_saphyr::from_str(&text)
            .map_err(|error| wrong(format!("expected the metadata of a folder of rosbag2: {error}")))?;
        let Information {
            storage_identifier: storage,
            compression_format,
            relative_file_paths,
            message_count: messages,
        } = metadata.rosbag2_bagfile_information;
        if let Some(found) = compression_format.filter(|format| !format.is_empty() && format != COMPRESSION) {
            return Err(BagError::Compression { folder: folder.to_owned(), found });
        }
        let (mut files, mut missing) = (Vec::new(), Vec::new());
        for name in relative_file_paths {
            match there(folder, &name) {
                Some(file) => files.push(file),
                None => missing.push(name),
            }
        }
        Ok(Some(Self { storage, files, missing, messages }))
    }

    /// Checks that the storage is MCAP.
    ///
    /// # Errors
    /// [`BagError::Storage`] if it is not.
    pub fn must_be_mcap(&self, folder: &Path) -> Result<(), BagError> {
        if self.storage == "mcap" {
            return Ok(());
        }
        let names = self.files.iter().filter_map(|file| file.file_name()).map(|name| name.to_string_lossy());
        let files =
            names.chain(self.missing.iter().map(|name| name.as_str().into())).collect::<Vec<_>>().join(", ");
        Err(BagError::Storage { folder: folder.to_owned(), storage: self.storage.clone(), files })
    }
}

/// Returns the path of a file that a bag lists, if it exists in the folder. Early versions prefix the
/// folder's name, and the file may have been compressed or decompressed since. A file outside the folder
/// never belongs to the bag.
fn there(folder: &Path, listed: &str) -> Option<PathBuf> {
    let listed = Path::new(listed);
    let is_inside = listed.components().all(|part| matches!(part, Component::Normal(_)));
    let name = Path::new(listed.file_name()?);
    let is_packed = name.extension().is_some_and(|extension| extension == PACKED);
    let other_form = match is_packed {
        true => name.with_extension(""),
        false => PathBuf::from(format!("{}.{PACKED}", name.to_str()?)),
    };
    let places = is_inside.then(|| listed.to_owned()).into_iter().chain([name.to_owned(), other_form]);
    places.map(|place| folder.join(place)).find(|file| file.is_file())
}

/// The result of unpacking a file.
#[derive(Debug)]
pub struct Unpacked {
    /// Number of unpacked bytes.
    pub bytes: u64,
    /// The reason why the result is incomplete, if the file is cut off or damaged.
    pub damage: Option<io::Error>,
}

/// Returns true if zstd has compressed the file as a whole.
///
/// # Errors
/// The system's errors.
pub fn is_packed(path: &Path) -> io::Result<bool> {
    let mut begin = Vec::new();
    std::fs::File::open(path)?.take(4).read_to_end(&mut begin)?;
    Ok(crate::content::is_packed(&begin))
}

/// Decompresses a file that zstd has compressed as a whole, as far as it can be read.
///
/// # Errors
/// An error if the file cannot be opened, or if `sink` fails.
pub fn unpack(path: &Path, mut sink: impl io::Write) -> io::Result<Unpacked> {
    let mut decoder = zstd::stream::read::Decoder::new(std::fs::File::open(path)?)?;
    let (mut piece, mut bytes) = (vec![0; 1 << 16], 0);
    let damage = loop {
        match decoder.read(&mut piece) {
            Ok(0) => break None,
            Ok(count) => {
                sink.write_all(&piece[..count])?;
                bytes += count as u64;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => break Some(error),
        }
    };
    sink.flush()?;
    Ok(Unpacked { bytes, damage })
}

/// Returns the text of `metadata.yaml` for these files, each with the facts about it. `topics` are all topics.
pub fn metadata_yaml(files: &[(String, PartFacts)], topics: &[Arc<Topic>]) -> String {
    let first = files.iter().map(|(_, part)| part.first_ns).min().unwrap_or(0);
    let last = files.iter().map(|(_, part)| part.last_ns).max().unwrap_or(0);
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (topic, count) in files.iter().flat_map(|(_, part)| &part.messages) {
        *counts.entry(topic).or_default() += count;
    }
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  starting_time:\n    nanoseconds_since_epoch: {first}\n  message_count: {}\n  topics_with_message_count:\n",
        last - first,
        counts.values().sum::<u64>(),
    );
    for topic in topics {
        let _ = topic_yaml(&mut text, topic, counts.get(topic.name.as_str()).copied().unwrap_or(0));
    }
    let _ = writeln!(text, "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:");
    for (name, _) in files {
        let _ = writeln!(text, "    - {name}");
    }
    let _ = writeln!(text, "  files:");
    for (name, part) in files {
        let _ = write!(
            text,
            "    - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: {}\n      duration:\n        nanoseconds: {}\n      message_count: {}\n",
            part.first_ns,
            part.last_ns - part.first_ns,
            part.messages.values().sum::<u64>(),
        );
    }
    let _ = writeln!(text, "  custom_data: ~\n  ros_distro: jazzy");
    text
}

/// Writes the entry of a topic. The profile must be word for word the one inside the files, because readers compare the two.
fn topic_yaml(text: &mut String, topic: &Topic, count: u64) -> std::fmt::Result {
    let profile = topic.metadata.get("offered_qos_profiles").map_or("", String::as_str);
    let [name, ros2_type, encoding] =
        [&topic.name, &topic.ros2_type, &topic.encoding].map(|text| scalar(text));
    write!(
        text,
        "    - topic_metadata:\n        name: {name}\n        type: {ros2_type}\n        serialization_format: {encoding}\n        offered_qos_profiles:"
    )?;
    if profile.trim().is_empty() {
        writeln!(text, " []")?;
    } else {
        writeln!(text)?;
        // Each line of the profile stays on its own line.
        profile.lines().try_for_each(|line| writeln!(text, "          {}", one_line(line)))?;
    }
    writeln!(text, "        type_description_hash: \"\"\n      message_count: {count}")
}

/// Returns a name as a YAML scalar. Any name that is not plain is quoted. It may come from anyone and could otherwise add
/// other files to the list.
fn scalar(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '_' | '-' | '.');
    let is_plain =
        text.starts_with(|c: char| c == '/' || c.is_ascii_alphabetic()) && text.chars().all(is_plain);
    if is_plain { text.to_owned() } else { one_line(serde_json::Value::from(text)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: the name of a topic could add files outside the folder to the list, which other readers then opened.
    #[test]
    fn a_topic_name_cannot_inject_yaml() {
        let topic = |name: &str, profile: &str| {
            Arc::new(Topic {
                name: name.to_owned(),
                ros2_type: "std_msgs/msg/String".to_owned(),
                encoding: "cdr".to_owned(),
                schema: Arc::default(),
                metadata: [("offered_qos_profiles".to_owned(), profile.to_owned())].into(),
            })
        };
        let forged = "\n  relative_file_paths:\r    - /etc/passwd";
        let text = metadata_yaml(
            &[],
            &[topic("/scan", "- depth: 1"), topic(&format!("/a{forged}"), &format!("- {forged}\r"))],
        );
        assert!(text.contains("        name: /scan\n") && text.contains("          - depth: 1\n"), "{text}");
        assert_eq!(text.matches("\n  relative_file_paths:").count(), 1, "{text}");
        assert!(!text.contains('\r') && text.contains(r#"name: "/a\n  relative_file_paths:\r"#), "{text}");
    }

    const OLD: &str = "rosbag2_bagfile_information:\n  version: 4\n  storage_identifier: mcap\n  message_count: 3\n\
                       \u{20} relative_file_paths:\n    - a/a_0.mcap\n    - a_1.mcap.zstd\n    - /etc/hostname\n    - gone.mcap\n";

    #[test]
    fn listed_files_are_found_or_reported_missing() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Bag::read(folder.path()).unwrap(), None);
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write(METADATA, OLD);
        // The paths are as in an early version, and one file has since been unpacked, the other packed.
        write("a_0.mcap.zstd", "");
        write("a_1.mcap", "");
        let files = || Bag::read(folder.path()).unwrap().unwrap().files;
        assert_eq!(files(), ["a_0.mcap.zstd", "a_1.mcap"].map(|name| folder.path().join(name)));
        write("a_0.mcap", "");
        let bag = Bag::read(folder.path()).unwrap().unwrap();
        assert_eq!(bag.files, ["a_0.mcap", "a_1.mcap"].map(|name| folder.path().join(name)));
        // A file outside the folder does not belong to the bag.
        assert_eq!(bag.missing, ["/etc/hostname", "gone.mcap"]);
        assert!(bag.must_be_mcap(folder.path()).is_ok());
    }

    #[test]
    fn other_storages_and_compressions_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let write = |text: &str| std::fs::write(folder.path().join(METADATA), text).unwrap();
        write(&OLD.replace(": mcap", ": sqlite3"));
        let error =
            Bag::read(folder.path()).unwrap().unwrap().must_be_mcap(folder.path()).unwrap_err().to_string();
        assert!(error.contains("sqlite3") && error.contains("ros2 bag convert"), "{error}");
        write(&OLD.replace("  message_count: 3", "  compression_format: lz9\n  compression_mode: FILE"));
        let error = Bag::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains("lz9"), "{error}");
        for text in ["a: 1\n", "[", "rosbag2_bagfile_information: 3\n"] {
            write(text);
            let error = Bag::read(folder.path()).unwrap_err().to_string();
            assert!(error.contains("metadata.yaml"), "{error}");
        }
    }

    #[test]
    fn a_truncated_compressed_file_is_decompressed_up_to_the_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap.zstd");
        let plain: Vec<u8> =
            (0..300_000_u32).flat_map(|n| n.wrapping_mul(2_654_435_761).to_le_bytes()).collect();
        let packed = zstd::stream::encode_all(plain.as_slice(), 3).unwrap();
        std::fs::write(&path, &packed).unwrap();
        assert!(is_packed(&path).unwrap());
        let mut out = Vec::new();
        assert!(unpack(&path, &mut out).unwrap().damage.is_none() && out == plain);
        std::fs::write(&path, &packed[..packed.len() / 2]).unwrap();
        out.clear();
        assert!(unpack(&path, &mut out).unwrap().damage.is_some());
        assert!(!out.is_empty() && plain.starts_with(&out));
    }
}
