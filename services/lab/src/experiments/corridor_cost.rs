//! The `corridor-cost` suite measures the cost of a drive along a corridor (Patil 2019, 5.5, tables 5.1 and 5.2). The corridor is
//! driven by each method of the navigator `corridor`, and by a map. The map is a drawing of degree 0, that is, an exact tracing of
//! the walls.

use std::sync::Arc;

use sketchnav_corridor::mission::METHODS;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::{Point, World};
use sketchnav_schemas::mission::Task;
use sketchnav_sim::corridors::{Corridor, Drive, Shape};
use sketchnav_sketch::method::Method;
use sketchnav_sketch::mission::{Aim, SketchMission, SketchTask, WallTone};
use sketchnav_sketch::reading::{Options, read};

use crate::error::EvalError;
use crate::experiments::corridor::{self, Beside};
use crate::experiments::suite::{Folders, Suite};
use crate::experiments::trial::{Sheet, Trial};

const TITLE: &str = "Seven metres along the middle of a corridor 2 m wide, past opposite markers: the cost with each method, and with a map.";
const NOTICES: [&str; 3] = [
    "paper: Patil 2019, tables 5.1 and 5.2, three drives each. By map: 36.5 to 41.7 s, 7.6 to 8.6 commands per second. By QTC_B: 65 to 103 s, 10.8 to 20.5 commands per second, 7.07 without repetitions.",
    "the map-based navigator drives at 0.18 m/s at most, the average of the thesis's; the rules at 0.1 m/s; `corridor` at 0.4 m/s.",
    "energy is modelled: 60 W at rest, a rolling resistance of 5 % of the weight, and kinetic energy for accelerating.",
];
/// Width of the corridor, in metres.
const WIDTH_M: f64 = 2.0;
/// Maximum speed of the map-based navigator, in metres per second.
const BY_MAP_MPS: f64 = 0.18;
const REPETITIONS: u32 = 5;

/// Loads the `corridor-cost` suite.
///
/// # Errors
/// [`EvalError`] if a file is missing.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let corridor = Corridor::new(Shape::Straight, WIDTH_M);
    let drive = corridor.drives().swap_remove(0);
    let by_markers = |method: &str| {
        let trial = corridor::trial(folders, &corridor, &drive, Beside::Middle, method.to_owned())?;
        Ok(Trial { name: method.to_owned(), method: Some(method.to_owned()), ..trial })
    };
    let [ours, published @ ..] = METHODS;
    let methods = published.into_iter().chain([ours]);
    let mut trials = methods.map(by_markers).collect::<Result<Vec<_>, EvalError>>()?;
    trials.push(by_map(folders, &corridor, &drive)?);
    Ok(Suite {
        title: TITLE.into(),
        notices: NOTICES.map(str::to_owned).into(),
        trials,
        lines: Some("method"),
        repetitions: REPETITIONS,
        shows_costs: true,
        ..Suite::default()
    })
}

/// Returns the trial that drives the same way by a map.
fn by_map(folders: &Folders, corridor: &Corridor, drive: &Drive) -> Result<Trial, EvalError> {
    let mut trial =
        corridor::trial(folders, corridor, drive, Beside::Middle, "by a map (kind sketch)".into())?;
    let path = trial.mission.world.floor_plan.clone().unwrap_or_default();
    let floor = sketchnav_deform::files::floor(path.as_ref())?;
    let drawing = sketchnav_deform::deform(&floor, 0.0, 1)?;
    let strokes = drawing.strokes_json();
    let options = Options { walls: WallTone::Dark, ..Options::default() };
    let paper = Arc::new(read(strokes.as_bytes(), &path, &options)?);
    let lost = || EvalError::NoWay { mission: trial.mission.name.clone() };
    let start = drawing.pose_to_sketch(&drive.start).ok_or_else(lost)?;
    let goal = drawing.to_sketch(&Point::<World>::new(drive.goal[0], drive.goal[1])).ok_or_else(lost)?;
    let Task { name, there, time_limit_s, .. } = trial.mission.task.swap_remove(0);
    let aim = Aim::Goal(drawing.to_image(&goal));
    let sketch = SketchMission {
        method: None,
        drawing: path,
        walls: WallTone::Dark,
        start: Some(drawing.to_image(&start.position())),
        start_heading_deg: Some(start.yaw_rad.to_degrees()),
        places: Default::default(),
        learned_file: None,
        tasks: vec![SketchTask { name, aim, time_limit_s }],
    };
    trial.mission.navigator = sketch.navigator();
    trial.mission.task = sketch.tasks.iter().map(|task| task.with_place(there.clone())).collect();
    let share = BY_MAP_MPS / trial.robot.limits.speed_mps;
    trial.mission.parameters.of_mut(Process::Planner).insert("speed_share".into(), share.into());
    let (sheet, bytes) = (Some(Sheet::new(paper)), Some(strokes.into_bytes().into()));
    Ok(Trial { name: "by-a-map".into(), method: Some(Method::Beam.word().to_owned()), sheet, bytes, ..trial })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::run;

    #[test]
    fn every_method_and_the_map_reach_the_end_at_a_known_cost() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert_eq!(suite.drawings().len(), METHODS.len() + 1);
        for trial in &suite.trials {
            let ended = run::run(trial, METHODS[0], 1, 1).unwrap().remove(0);
            assert!(ended.is_success(), "{}: {:?}", trial.name, ended);
            let cost = ended.cost;
            assert!(
                cost.commands > 100 && cost.changed_commands <= cost.commands,
                "{}: {cost:?}",
                trial.name
            );
            assert!(
                cost.clearance_m.is_some_and(|least_m| (0.3..0.9).contains(&least_m)),
                "{}: {cost:?}",
                trial.name
            );
            assert!(cost.energy_j > 60.0 * ended.time_s, "{}: {cost:?}", trial.name);
        }
    }
}
