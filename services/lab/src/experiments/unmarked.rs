//! The `…-unmarked` suites repeat the drives of other suites without a start mark: the robot stands where it stood there, with any
//! heading, and has to find out where in the drawing that is.

use rand::RngExt;
use sketchnav_schemas::seed;
use sketchnav_sim::SimError;
use sketchnav_sketch::mission::SketchMission;

use crate::error::EvalError;
use crate::experiments::single_drives::single_drives;
use crate::experiments::suite::Suite;
use crate::experiments::trial::Trial;

/// Time for finding out where the robot is, in seconds. It is added to the time limit of the drive with a mark.
pub(super) const FINDING_S: f64 = 300.0;

/// Returns the suite whose drives are the tasks of `suite`, without a mark.
///
/// # Errors
/// [`EvalError`] if a mission of the suite is invalid.
pub fn of(suite: Suite) -> Result<Suite, EvalError> {
    let title = format!("{} Nobody marks the start, and the robot may face anywhere.", suite.title);
    let mut suite = single_drives(Suite { title, ..suite })?;
    for Trial { name, mission, sheet, .. } in &mut suite.trials {
        let mut rng = seed::stream(1, &format!("eval/unmarked/{}/{name}", mission.name));
        mission.start.world_heading_deg = rng.random_range(-180.0..180.0);
        mission.task[0].time_limit_s += FINDING_S;
        let sketch = SketchMission::of(mission).map_err(SimError::from)?;
        SketchMission { start: None, start_heading_deg: None, ..sketch }.write_to(mission);
        if let Some(sheet) = sheet {
            (sheet.start_error, sheet.correspondence) = (None, None);
        }
    }
    Ok(suite)
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
