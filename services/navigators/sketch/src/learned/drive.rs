//! Learns from whole drives, message by message: by the drawing of a mission, in what was learned before, or by what people draw on
//! the pad.

use sketchnav_schemas::channels::{ChannelSpec, DRAWING};
use sketchnav_schemas::codes::DrawingKind;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::drawn::{Learning, Lesson, Replay};
use sketchnav_stage::{Files, StageError};

use super::{DrawingFile, Learned, Learner, frame};
use crate::mission::SketchMission;
use crate::reading::desk::{Change, Desk};
use crate::reading::{DrawnMap, Places};
use crate::sketcher::{self, Before};

/// Learns from the drives of a run.
#[derive(Debug)]
struct Drives {
    robot: Robot,
    learner: Learner,
    by: By,
}

/// What the robot drives by.
#[derive(Debug)]
enum By {
    /// The drawing of a mission.
    Drawing { file: DrawingFile, drawing: Box<DrawnMap>, places: Places },
    /// A map learned before, in which the tasks are placed.
    Learned { before: Box<Before>, places: Places },
    /// What people draw. The goals are those that were marked last.
    People(Box<Desk>),
}

impl Drives {
    fn begin(run: &RunConfig, files: &Files<'_>) -> Result<Self, StageError> {
        let (robot, learner) = (run.robot.clone(), Learner::new(&run.robot)?);
        if run.pad.draws() {
            return Ok(Self { robot, learner, by: By::People(Box::new(Desk::new(run)?)) });
        }
        let mission = SketchMission::of(&run.mission)?;
        let (drawing, places) = sketcher::understand(run, files)?;
        let by = match sketcher::learned_before(run, files)? {
            Some(before) => By::Learned { before: Box::new(before), places },
            None => {
                let file = DrawingFile::of(&mission.drawing, &files(&mission.drawing)?);
                By::Drawing { file, drawing: Box::new(drawing), places }
            }
        };
        Ok(Self { robot, learner, by })
    }

    /// Returns what was learned so far, and the drawing that it was learned by.
    fn learned(&self) -> Result<(Learned, &DrawnMap), StageError> {
        match &self.by {
            By::Drawing { file, drawing, places } => {
                Ok((self.learner.learned(file.clone(), drawing, places)?, drawing))
            }
            By::Learned { before, places } => {
                Ok((self.learner.merged(&before.learned, &before.intent, places)?, &before.drawing))
            }
            By::People(desk) => desk.learned_by(&self.learner),
        }
    }
}

impl Learning for Drives {
    fn see(&mut self, spec: &ChannelSpec, message: &[u8], cells: &[u8]) {
        let By::People(desk) = &mut self.by else { return self.learner.see(spec, message) };
        let Some(about) = DRAWING.message(spec, message) else { return self.learner.see(spec, message) };
        let Some(kind) = DrawingKind::from_code(about.kind) else { return };
        // A drawing that is rejected now was also rejected during the drive.
        match desk.take(kind, cells) {
            Ok(Change::Start) => {
                // The first learner of this robot could be created, so this one can.
                if let Ok(learner) = Learner::new(&self.robot) {
                    self.learner = learner;
                }
            }
            Ok(Change::Tasks) => self.learner.begin_tasks(),
            Ok(Change::Sketch) | Err(_) => {}
        }
    }

    fn learned(&self) -> Result<(Vec<u8>, Lesson), StageError> {
        let (learned, drawing) = self.learned()?;
        Ok((learned.to_bytes(), frame::lesson(&learned, drawing)?))
    }
}

/// Begins to learn from the drives of a run.
///
/// # Errors
/// If the run's files cannot be read, or if the robot cannot map.
pub fn begin(run: &RunConfig, files: &Files<'_>) -> Result<Box<dyn Learning>, StageError> {
    Ok(Box::new(Drives::begin(run, files)?))
}

/// Returns what was learned on a drive, and the drawing that it used. `replay` supplies the drive's messages.
///
/// # Errors
/// If the drive's files cannot be read, or if nothing can be learned from it.
pub fn of_drive(
    run: &RunConfig,
    files: &Files<'_>,
    replay: &mut Replay<'_>,
) -> Result<(Learned, DrawnMap), StageError> {
    let mut drives = Drives::begin(run, files)?;
    replay(&mut |spec, message, cells| drives.see(spec, message, cells))?;
    let (learned, drawing) = drives.learned()?;
    Ok((learned, drawing.clone()))
}
