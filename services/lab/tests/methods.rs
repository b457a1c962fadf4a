//! Runs the published methods under conditions where they must succeed, with the true floor plan as the drawing.

mod support;

use std::path::Path;

use sketchnav_lab::judge::judge;
use sketchnav_lab::judge::log::Log;
use sketchnav_rehearsal::Rehearsal;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::method::Method;
use sketchnav_sketch::mission::SketchMission;

/// Returns how many of the first `tasks` tasks of a shipped mission are reached with the true floor plan as the drawing.
fn reached(mission: &str, method: Method, tasks: usize, seed: u64) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions").join(mission);
    let (mission, robot) = sketchnav_sim::mission_file::load(&path).unwrap();
    let mut mission = support::true_to_scale(&mission, &folder.path().join("floor.svg")).unwrap();
    mission.task.truncate(tasks);
    SketchMission { method: Some(method), ..SketchMission::of(&mission).unwrap() }.write_to(&mut mission);
    let run = RunConfig::lockstep("rehearsal", mission, robot, seed);
    let mut log = Log::default();
    Rehearsal::new(&run).unwrap().run(&mut log).unwrap();
    judge(&run.mission, &log.truth, &log.status, &[]).tasks.iter().filter(|task| task.reached).count()
}

#[test]
fn the_papers_method_succeeds_in_the_true_floor_plan() {
    assert_eq!(reached("building/building-a.toml", Method::Boniardi2015, 4, 1), 4);
    assert_eq!(reached("laboratory/laboratory-a.toml", Method::Boniardi2015, 4, 1), 4);
}

#[test]
fn special_cases_of_the_papers_method_succeed() {
    assert_eq!(reached("building/building-a.toml", Method::Boniardi2015FixedScale, 3, 1), 3);
    assert_eq!(reached("building/building-a.toml", Method::Behzadian2015, 3, 1), 3);
}
