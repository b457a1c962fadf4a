//! Learns from a whole drive: by the drawing of its mission, in what was learned before, or by what people drew on the pad.

use sketchnav_schemas::channels::{ChannelSpec, DRAWING};
use sketchnav_schemas::codes::DrawingKind;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::drawn::Replay;
use sketchnav_stage::{Files, StageError};

use super::{DrawingFile, Learned, Learner};
use crate::mission::SketchMission;
use crate::reading::DrawnMap;
use crate::reading::desk::{Change, Desk};
use crate::sketcher;

/// Returns what was learned on a drive, and the drawing that it used. `replay` supplies the drive's messages.
///
/// # Errors
/// If the drive's files cannot be read, or if nothing can be learned from it.
pub fn of_drive(
    run: &RunConfig,
    files: &Files<'_>,
    replay: &mut Replay<'_>,
) -> Result<(Learned, DrawnMap), StageError> {
    if run.pad.draws() {
        return of_people(run, replay);
    }
    let mission = SketchMission::of(&run.mission)?;
    let (drawing, places) = sketcher::understand(run, files)?;
    let mut learner = Learner::new(&run.robot)?;
    replay(&mut |spec, message, _| learner.see(spec, message))?;
    match sketcher::learned_before(run, files)? {
        Some(before) => Ok((learner.merged(&before.learned, &before.intent, &places)?, before.drawing)),
        None => {
            let file = DrawingFile::of(&mission.drawing, &files(&mission.drawing)?);
            Ok((learner.learned(file, &drawing, &places)?, drawing))
        }
    }
}

/// Returns what was learned on the drives by the last drawing that people made on the pad. The goals are those that were marked
/// last.
fn of_people(run: &RunConfig, replay: &mut Replay<'_>) -> Result<(Learned, DrawnMap), StageError> {
    let mut desk = Desk::new(run)?;
    let fresh = || Learner::new(&run.robot);
    let mut learner = fresh();
    replay(&mut |spec: &ChannelSpec, message, cells| {
        let Some(about) = DRAWING.message(spec, message) else {
            if let Ok(learner) = &mut learner {
                learner.see(spec, message);
            }
            return;
        };
        let Some(kind) = DrawingKind::from_code(about.kind) else { return };
        // A drawing that is rejected now was also rejected during the drive.
        match (desk.take(kind, cells), &mut learner) {
            (Ok(Change::Start), _) => learner = fresh(),
            (Ok(Change::Tasks), Ok(learner)) => learner.begin_tasks(),
            _ => {}
        }
    })?;
    desk.learned_by(&learner?)
}

/// Returns the content of a file with what was learned on a drive.
///
/// # Errors
/// Same as [`of_drive`].
pub fn learn(run: &RunConfig, files: &Files<'_>, replay: &mut Replay<'_>) -> Result<Vec<u8>, StageError> {
    Ok(of_drive(run, files, replay)?.0.to_bytes())
}
