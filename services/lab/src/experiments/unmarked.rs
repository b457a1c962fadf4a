//! The `…-unmarked` suites repeat the drives of other suites without a start mark: the robot stands where it stood there, with any
//! heading, and has to find out where in the drawing that is. Each task of a tour is a drive of its own, which begins where the
//! previous task ends.

use rand::RngExt;
use sketchnav_schemas::mission::MissionError;
use sketchnav_schemas::seed;
use sketchnav_sim::SimError;
use sketchnav_sketch::mission::SketchMission;

use crate::error::EvalError;
use crate::experiments::suite::Suite;
use crate::experiments::trial::{Sheet, Trial};

/// Time for finding out where the robot is, in seconds. It is added to the time limit of the drive with a mark.
const FINDING_S: f64 = 300.0;

/// Returns the suite whose drives are the tasks of `suite`, without a mark.
///
/// # Errors
/// [`EvalError`] if a mission of the suite is invalid.
pub fn of(suite: Suite) -> Result<Suite, EvalError> {
    let title = format!("{} Nobody marks the start, and the robot may face anywhere.", suite.title);
    let mut trials = Vec::new();
    for trial in &suite.trials {
        for (k, task) in trial.mission.task.iter().enumerate() {
            if suite.legs.is_empty() || suite.legs.iter().any(|leg| leg.name == task.name) {
                trials.push(unmarked(trial, k).map_err(SimError::from)?);
            }
        }
    }
    Ok(Suite { title, trials, legs: Vec::new(), repetitions: 1, ..suite })
}

/// Returns the drive of a trial's task `k` without a mark.
fn unmarked(trial: &Trial, k: usize) -> Result<Trial, MissionError> {
    let name = match trial.mission.task.len() {
        1 => trial.name.clone(),
        _ => format!("{}/{}", trial.name, k + 1),
    };
    let mut mission = trial.mission.clone();
    let mut restarts = trial.sheet.iter().flat_map(|sheet| &sheet.restarts);
    if let Some(restart) = k.checked_sub(1).and_then(|before| restarts.nth(before)) {
        mission.start = restart.start.clone();
    }
    let mut rng = seed::stream(1, &format!("eval/unmarked/{}/{name}", mission.name));
    mission.start.world_heading_deg = rng.random_range(-180.0..180.0);
    mission.task = vec![mission.task.swap_remove(k)];
    mission.task[0].time_limit_s += FINDING_S;
    let sketch = SketchMission { start: None, start_heading_deg: None, ..SketchMission::of(&mission)? };
    sketch.write_to(&mut mission);
    let sheet = trial.sheet.as_ref().map(|sheet| Sheet {
        restarts: Vec::new(),
        start_error: None,
        correspondence: None,
        paper: sheet.paper.clone(),
    });
    let cluster = trial.cluster.clone().or_else(|| Some(trial.drawing.clone()));
    Ok(Trial { name, cluster, mission, sheet, ..trial.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::protocol;
    use crate::experiments::suite::Folders;

    #[test]
    fn each_task_of_a_tour_begins_where_the_previous_one_ends() {
        let folders = Folders::of_checkout();
        let tours = protocol::laboratory(&folders).unwrap();
        let suite = of(protocol::laboratory(&folders).unwrap()).unwrap();
        assert_eq!(suite.trials.len(), tours.legs.len() * tours.trials.len());
        for trial in &suite.trials {
            let (tour, number) = trial.name.split_once('/').unwrap();
            let k = number.parse::<usize>().unwrap() - 1;
            let tour = tours.trials.iter().find(|trial| trial.name == tour).unwrap();
            let sketch = SketchMission::of(&trial.mission).unwrap();
            assert_eq!((sketch.start, sketch.start_heading_deg, sketch.tasks.len()), (None, None, 1));
            assert_eq!(trial.mission.task[0].there, tour.mission.task[k].there);
            let [x, y] = trial.mission.start.world;
            if let Some(before) = k.checked_sub(1) {
                assert!(tour.mission.task[before].there.contains(x, y), "{}", trial.name);
            } else {
                assert_eq!([x, y], tour.mission.start.world);
            }
        }
    }
}
