//! Splits the tours of a suite into drives.

use sketchnav_schemas::mission::MissionError;
use sketchnav_sim::SimError;
use sketchnav_sketch::mission::SketchMission;

use super::suite::Suite;
use super::trial::{Restart, Trial};
use crate::error::EvalError;

/// Makes a drive of each task of a suite's tours, which begins where the previous task ends, with the same mark as after a failure.
///
/// # Errors
/// [`EvalError`] if a mission of the suite is invalid.
pub fn single_drives(suite: Suite) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    for trial in &suite.trials {
        for (k, task) in trial.mission.task.iter().enumerate() {
            if suite.legs.is_empty() || suite.legs.iter().any(|leg| leg.name == task.name) {
                trials.push(single_drive(trial, k).map_err(SimError::from)?);
            }
        }
    }
    Ok(Suite { trials, legs: Vec::new(), repetitions: 1, ..suite })
}

/// Returns the drive of a trial's task `k`.
fn single_drive(trial: &Trial, k: usize) -> Result<Trial, MissionError> {
    let mut drive = trial.clone();
    if trial.mission.task.len() > 1 {
        drive.name = format!("{}/{}", trial.name, k + 1);
    }
    drive.cluster.get_or_insert_with(|| trial.drawing.clone());
    let mission = &mut drive.mission;
    mission.task = vec![mission.task.swap_remove(k)];
    let mut restarts = drive.sheet.iter_mut().flat_map(|sheet| std::mem::take(&mut sheet.restarts));
    let restart = k.checked_sub(1).and_then(|before| restarts.nth(before));
    if let Some(Restart { start, marked, marked_heading_deg }) = restart {
        mission.start = start;
        let start_heading_deg = Some(marked_heading_deg);
        SketchMission { start: marked, start_heading_deg, ..SketchMission::of(mission)? }.write_to(mission);
    }
    Ok(drive)
}
