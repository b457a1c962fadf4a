//! Learns from the recording of the run, as `sketchnav learn` does, once the robot has stopped.

use std::time::Duration;

use anyhow::{Context, anyhow};
use sketchnav_files::{DRAWING, Files};
use sketchnav_recordings::Recording;
use sketchnav_recordings::replay::replay;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::drawn::{Lesson, Lessons, See};

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
    /// Learns from the recording of the drives so far, which is still being written. `drawing` is the drawing that they used.
    ///
    /// # Errors
    /// If the run is not recorded, if the recording cannot be read, or if nothing can be learned from it.
    pub fn of_run(run: &RunConfig, lessons: Lessons, drawing: &[u8]) -> anyhow::Result<Self> {
        let path =
            run.recording.as_deref().context("expected a run that is recorded, found one that is not")?;
        let recording = Recording::open(path.as_ref())?;
        let RecordedRun { run, files } = RecordedRun::of(&recording)?;
        let kind = run.mission.navigator_kind();
        let mut messages = |see: &mut See<'_>| {
            Ok(replay(&recording, kind, |spec, message| see(spec, message.bytes(), message.cells()))?)
        };
        let files = |name: &str| files.read(name.as_ref(), DRAWING);
        let file = (lessons.learn)(&run, &files, &mut messages).map_err(|error| anyhow!(error))?;
        Self::of_file(&run, lessons, (drawing, file))
    }

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
