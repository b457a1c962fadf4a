//! Opens and reads recordings: from front to back, one channel, a range of times, or in order of time.
//!
//! A recording that was cut off by a kill is read up to the cut. A chunk is read completely or not at all,
//! since its checksum is verified before its first message is returned. A file is never loaded as a whole.
//! Only one chunk is in memory at a time or, when reading in order of time, only the chunks whose times
//! overlap.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use sketchnav_schemas::channels::{Channel, ChannelSpec};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::Header;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_schemas::run::RunConfig;

pub use crate::content::{Part, RawMessage};
pub use crate::directory::Topic;
use crate::error::RecordingError;
use crate::index::Index;
pub use crate::parts::Parts;
pub use crate::records::{Attachment, FileHeader, Schema};
pub use crate::selection::{Selected, Selection};
pub use crate::timeline::Timeline;
use crate::writer::{RUN_ATTACHMENT, RUN_METADATA, topic_name};

/// Maximum number of bytes that may be attached to a run's recording, since all of them are kept in memory.
const MAX_ATTACHED_BYTES: u64 = 256 << 20;

/// Prefix of the names of this project's own types.
const OWN_TYPES: &str = "sketchnav_msgs/";

/// A recording on disk.
///
/// ```no_run
/// use sketchnav_recordings::Recording;
/// use sketchnav_schemas::channels::SCAN;
/// # fn main() -> Result<(), sketchnav_recordings::RecordingError> {
/// let recording = Recording::open("out/demo-001/building-a.mcap".as_ref())?;
/// for scan in recording.channel(SCAN)?.between(10_000_000_000..20_000_000_000) {
///     let (scan, _) = scan?;
///     println!("{} beams", scan.beam_count);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Recording {
    path: PathBuf,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    attachments: BTreeMap<String, Attachment>,
    header: FileHeader,
    index: OnceLock<Arc<Index>>,
}

impl Recording {
    /// Opens a recording and reads its description. This is everything before the first message and, for a recording of
    /// this project, also the description elsewhere in the file.
    ///
    /// # Errors
    /// [`RecordingError::File`], [`RecordingError::Damaged`] if it is not a recording, or [`RecordingError::Run`] if more
    /// is attached than the files of a run can be.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut recording = Self::open_to_first_message(path)?;
        if let Some(index) = recording.index_of_others()? {
            recording.describe_by(&index)?;
            recording.index = OnceLock::from(Arc::new(index));
        }
        Ok(recording)
    }

    fn open_to_first_message(path: &Path) -> Result<Self, RecordingError> {
        let (mut metadata, mut attachments, mut attached) = (BTreeMap::new(), BTreeMap::new(), 0);
        let mut parts = Parts::of(path)?;
        for part in &mut parts {
            match part? {
                Part::Metadata(name, facts) => drop(metadata.insert(name, facts)),
                Part::Attachment(file) => {
                    attached += file.data.len() as u64;
                    check_attached(attached)?;
                    attachments.insert(file.name.clone(), file);
                }
                Part::Topic(_) => {}
                Part::Message(_) | Part::End { .. } => break,
            }
        }
        let (path, header) = (path.to_owned(), parts.header().clone());
        Ok(Self { path, metadata, attachments, header, index: OnceLock::new() })
    }

    /// Returns the index for finding the rest of the recording's description: the file's own, or one built by
    /// reading the file once. Returns `None` if there is no index because of a kill but the description
    /// precedes the first message, or if the file is damaged.
    fn index_of_others(&self) -> Result<Option<Index>, RecordingError> {
        match Index::of_summary(&self.path)? {
            None if !self.has_run() => Ok(Index::by_a_pass(&self.path).ok()),
            index => Ok(index),
        }
    }

    /// Reads the attachments and metadata that are listed in the index and not yet known. The project's own
    /// recorder writes them first, but other tools may put them anywhere. In recordings by other software,
    /// they are not needed here.
    fn describe_by(&mut self, index: &Index) -> Result<(), RecordingError> {
        if !self.has_run() && !index.attachments.iter().any(|entry| entry.name == RUN_ATTACHMENT) {
            return Ok(());
        }
        let mut attached = self.attachments.values().map(|file| file.data.len() as u64).sum();
        for entry in &index.attachments {
            if !self.attachments.contains_key(&entry.name) {
                attached = entry.bytes.saturating_add(attached);
                check_attached(attached)?;
                let file = index.attachment(&self.path, entry)?;
                self.attachments.insert(entry.name.clone(), file);
            }
        }
        for name in index.metadata_names() {
            if !self.metadata.contains_key(name)
                && let Some(facts) = index.metadata(&self.path, name)?
            {
                self.metadata.insert(name.to_owned(), facts);
            }
        }
        Ok(())
    }

    /// Returns the file's header: its profile and the library that wrote it.
    pub fn header(&self) -> &FileHeader {
        &self.header
    }

    /// Returns true if this project wrote the recording, or copied it from one that it wrote.
    ///
    /// # Errors
    /// Same errors as [`Recording::index`].
    pub fn is_ours(&self) -> Result<bool, RecordingError> {
        if self.attachments.contains_key(RUN_ATTACHMENT) || self.metadata.contains_key(RUN_METADATA) {
            return Ok(true);
        }
        Ok(self.topics()?.iter().any(|topic| topic.ros2_type.starts_with(OWN_TYPES)))
    }

    /// Returns true if the recording contains the description of its run. Without it, the recording cannot be judged,
    /// executed or replayed.
    pub fn has_run(&self) -> bool {
        self.attachments.contains_key(RUN_ATTACHMENT)
    }

    /// Checks that the recording is this project's own.
    ///
    /// # Errors
    /// [`RecordingError::NotOurs`] if other software wrote it, and the errors of [`Recording::index`].
    pub fn must_be_ours(&self) -> Result<(), RecordingError> {
        if self.is_ours()? { Ok(()) } else { Err(self.lacks(RUN_ATTACHMENT)) }
    }

    fn lacks(&self, missing: &'static str) -> RecordingError {
        let (path, library) = (self.path.clone(), self.header.library.clone());
        RecordingError::NotOurs { path, missing, library }
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the value of `key` in the metadata `name`. For a recording by other software, only metadata before the first
    /// message is known.
    pub fn fact(&self, name: &str, key: &str) -> Option<&str> {
        Some(self.metadata.get(name)?.get(key)?.as_str())
    }

    /// Returns all metadata by name. For a recording by other software, only the metadata before the first message.
    pub fn metadata(&self) -> &BTreeMap<String, BTreeMap<String, String>> {
        &self.metadata
    }

    /// Returns the topics, in the order of their numbers in the file.
    ///
    /// # Errors
    /// Same errors as [`Recording::index`].
    pub fn topics(&self) -> Result<Vec<Arc<Topic>>, RecordingError> {
        Ok(self.index()?.directory.topics().map(|(_, topic)| Arc::clone(topic)).collect())
    }

    /// Returns the attachments by name. For a recording by other software, only those that precede the first message.
    pub fn attachments(&self) -> &BTreeMap<String, Attachment> {
        &self.attachments
    }

    /// Returns the run that was recorded: mission, robot, seed, pace. Its paths are those of the machine on which it was recorded.
    /// To read its files, use [`RecordedRun`](crate::sources::RecordedRun).
    ///
    /// # Errors
    /// [`RecordingError::NotOurs`] if the recording has no run, and [`RecordingError::Run`] if this version cannot read it.
    pub fn run(&self) -> Result<RunConfig, RecordingError> {
        let wrong = |reason| RecordingError::Run { what: RUN_ATTACHMENT, reason };
        let file = self.attachments.get(RUN_ATTACHMENT).ok_or_else(|| self.lacks(RUN_ATTACHMENT))?;
        let mut run: RunConfig =
            serde_json::from_slice(&file.data).map_err(|error| wrong(error.to_string()))?;
        // A recording may come from anywhere, so its robot has not necessarily been parsed from a robot file.
        run.robot.check_numbers().map_err(|error| wrong(format!("robot: {error}")))?;
        // The location of the system's files has no effect on the run.
        run.files_of = None;
        if run.method.is_empty() {
            // Earlier versions wrote the method only into the metadata.
            run.method = self.fact(RUN_METADATA, "method").unwrap_or_default().to_owned();
        }
        Ok(run)
    }

    /// Returns the index of the recording: the positions of its chunks and the times that they cover. It is read once and then
    /// cached.
    ///
    /// # Errors
    /// [`RecordingError::File`], or [`RecordingError::Damaged`] if a file without its own index is damaged.
    pub fn index(&self) -> Result<&Index, RecordingError> {
        if let Some(index) = self.index.get() {
            return Ok(index);
        }
        let index = Index::read(&self.path)?;
        Ok(self.index.get_or_init(|| Arc::new(index)))
    }

    /// Iterates over everything in the file, in order, and ends with a [`Part::End`].
    ///
    /// # Errors
    /// [`RecordingError::File`]. If the file is damaged, the iterator's last item is an error.
    pub fn parts(&self) -> Result<Parts, RecordingError> {
        Parts::of(&self.path)
    }

    /// Iterates over the selected messages in the order of the file. Only chunks that may contain one are read.
    ///
    /// # Errors
    /// Any error of [`Recording::index`]. If a chunk is damaged, the iterator's last item is an error.
    pub fn select(&self, selection: Selection) -> Result<Selected, RecordingError> {
        Selected::of(&self.path, self.index()?, selection)
    }

    /// Iterates over the selected messages in order of time, and within an instant in the order of a step.
    ///
    /// # Errors
    /// Same errors as [`Recording::select`].
    pub fn timeline(&self, selection: Selection) -> Result<Timeline, RecordingError> {
        Timeline::of(&self.path, self.index()?, selection)
    }

    /// Returns the last message of each latched topic before a time, in nanoseconds. A reader that begins at
    /// that time needs these messages.
    ///
    /// # Errors
    /// Any error of [`Recording::select`] or among its items.
    pub fn latched_before(&self, before_ns: u64) -> Result<Vec<RawMessage>, RecordingError> {
        let topics = self.topics()?;
        let latched = topics.iter().filter(|topic| topic.is_latched()).map(|topic| topic.name.clone());
        let mut last = BTreeMap::new();
        for message in self.select(Selection::of_topics(latched).between(0..before_ns))? {
            let message = message?;
            last.insert(message.topic.name.clone(), message);
        }
        Ok(last.into_values().collect())
    }

    /// Iterates over the messages of a channel in the order of the file, with the slices that follow them.
    /// Empty if the channel is not in the file.
    ///
    /// # Errors
    /// Any error of [`Recording::select`]. An item is an error if the topic's type is not that of `T`, or if
    /// a message is invalid for it.
    pub fn channel<T: Ros2>(&self, channel: Channel<T>) -> Result<Messages<T>, RecordingError> {
        let selection = Selection::of_topics([topic_name(channel.spec.name)]);
        Ok(Messages { selected: self.select(selection)?, path: self.path.clone(), message: PhantomData })
    }

    /// Iterates over the headers of the messages of a channel of any type, in the order of the file.
    ///
    /// # Errors
    /// Same errors as [`Recording::channel`].
    pub fn headers(
        &self,
        spec: &'static ChannelSpec,
    ) -> Result<impl Iterator<Item = Result<Header, RecordingError>> + use<>, RecordingError> {
        let messages = self.select(Selection::of_topics([topic_name(spec.name)]))?;
        Ok(messages.map(move |raw| Ok(*erased::header(raw?.decode(spec)?.bytes()))))
    }

    /// Reads all messages of a channel into memory, without the slices that follow them.
    ///
    /// # Errors
    /// Any error of [`Recording::channel`], and the first error among its items.
    pub fn all<T: Ros2>(&self, channel: Channel<T>) -> Result<Vec<T>, RecordingError> {
        self.channel(channel)?.map(|message| Ok(message?.0)).collect()
    }
}

fn check_attached(bytes: u64) -> Result<(), RecordingError> {
    if bytes <= MAX_ATTACHED_BYTES {
        return Ok(());
    }
    let reason = format!("expected at most {MAX_ATTACHED_BYTES} bytes, found more");
    Err(RecordingError::Run { what: "attachments", reason })
}

/// An iterator over the messages of a channel. See [`Recording::channel`].
pub struct Messages<T> {
    selected: Selected,
    path: PathBuf,
    message: PhantomData<fn() -> T>,
}

impl<T> Messages<T> {
    /// Restricts the messages to these times, in nanoseconds. Chunks without any such message are not read.
    #[must_use]
    pub fn between(mut self, times_ns: std::ops::Range<u64>) -> Self {
        self.selected.narrow(times_ns);
        self
    }

    /// Returns the number of bytes of the file that have been read so far.
    pub fn bytes_read(&self) -> u64 {
        self.selected.bytes_read()
    }
}

impl<T: Ros2> Iterator for Messages<T> {
    type Item = Result<(T, Vec<u8>), RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.selected.next()?.and_then(|raw| raw.typed_in(&self.path)))
    }
}
