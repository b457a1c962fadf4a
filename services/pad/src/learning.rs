//! Learns from the recording of the run, as `sketchnav learn` does, while it is being written.
//!
//! The recording has every message, whatever the pad has missed, so the map that grows on the page during a drive is the one that
//! `sketchnav learn` makes from the recording up to the same message, byte for byte.

use std::time::Duration;

use anyhow::{Context, anyhow};
use sketchnav_files::{DRAWING, Files};
use sketchnav_recordings::Recording;
use sketchnav_recordings::replay::replay;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::channels::{ChannelSpec, STATUS};
use sketchnav_schemas::erased::Owned;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::drawn::{Learning, Lesson, Lessons};

/// Maximum time that the recorder may take to write the end of a drive.
pub const WRITTEN_WITHIN: Duration = Duration::from_secs(3);

/// What was learned: the file, and how pages show it.
#[derive(Debug, Clone)]
pub struct Learned {
    /// The content of the file.
    pub file: Vec<u8>,
    /// The map as shown in the drawing.
    pub lesson: Lesson,
}

impl Learned {
    /// Shows a file that was learned by this drawing.
    ///
    /// # Errors
    /// If the two do not belong together.
    pub fn of_file(
        run: &RunConfig,
        lessons: Lessons,
        (drawing, file): (&[u8], Vec<u8>),
    ) -> anyhow::Result<Self> {
        let lesson = (lessons.show)(run, drawing, &file).map_err(|error| anyhow!(error))?;
        Ok(Self { file, lesson })
    }
}

/// Learns from the recording of a run as it grows. Only whole instants count, which end with a status.
#[derive(Debug)]
pub struct Follower {
    /// The path of the recording.
    recording: Option<String>,
    lessons: Lessons,
    begun: Option<Begun>,
}

/// What was taken from the recording so far.
#[derive(Debug)]
struct Begun {
    /// The navigator of the recorded run.
    kind: String,
    learning: Box<dyn Learning>,
    /// The number of messages, and the last one of them.
    taken: usize,
    last: Owned,
}

impl Follower {
    /// Creates a follower of a run's recording.
    pub fn new(run: &RunConfig, lessons: Lessons) -> Self {
        Self { recording: run.recording.clone(), lessons, begun: None }
    }

    /// Takes what has been recorded since the last call, and returns what was learned on the drives so far.
    ///
    /// # Errors
    /// If the run is not recorded, if the recording cannot be read, or if nothing can be learned from it.
    pub fn look(&mut self) -> anyhow::Result<Learned> {
        let path = self.recording.as_ref();
        let path = path.context("expected a run that is recorded, found one that is not")?;
        let recording = Recording::open(path.as_ref())?;
        let continued = self.begun.as_mut().map(|begun| begun.take(&recording)).transpose()?;
        if continued != Some(true) {
            let begun = self.begun.insert(Begun::new(&recording, self.lessons)?);
            begun.take(&recording)?;
        }
        let begun = self.begun.as_ref().context("a recording that was begun")?;
        let (file, lesson) = begun.learning.learned().map_err(|error| anyhow!(error))?;
        Ok(Learned { file, lesson })
    }
}

impl Begun {
    fn new(recording: &Recording, lessons: Lessons) -> anyhow::Result<Self> {
        let RecordedRun { run, files } = RecordedRun::of(recording)?;
        let files = |name: &str| files.read(name.as_ref(), DRAWING);
        let learning = (lessons.begin)(&run, &files).map_err(|error| anyhow!(error))?;
        let kind = run.mission.navigator_kind().to_owned();
        Ok(Self { kind, learning, taken: 0, last: Owned::default() })
    }

    /// Takes the messages that follow those taken before, up to the last status. Returns false if the recording does not continue
    /// what was taken, because a message was recorded late. Then it has to be taken from its beginning.
    fn take(&mut self, recording: &Recording) -> anyhow::Result<bool> {
        let (mut number, mut continues) = (0, self.taken == 0);
        // The messages of an instant whose status has not arrived yet.
        let mut instant: Vec<(&'static ChannelSpec, Owned)> = Vec::new();
        let Self { learning, taken, last, kind } = self;
        let before = *taken;
        replay(recording, kind, |spec, message| {
            number += 1;
            if number <= before {
                continues |= number == before && message == last;
            } else if continues {
                instant.push((spec, message.clone()));
                if STATUS.message(spec, message.bytes()).is_some() {
                    for (spec, message) in instant.drain(..) {
                        learning.see(spec, message.bytes(), message.cells());
                    }
                    (*taken, *last) = (number, message.clone());
                }
            }
        })?;
        Ok(continues)
    }
}

#[cfg(test)]
mod tests;
