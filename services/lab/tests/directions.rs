//! Drives journeys over a plane on which landmarks are easily confused, in gusts of wind and with a camera that misses dots and
//! reports false ones. Everything runs in one process, including the judge.

use std::path::Path;

use sketchnav_directions::traversal::Kind;
use sketchnav_lab::judge::directions::{JourneyVerdict, journeys};
use sketchnav_lab::judge::judge;
use sketchnav_lab::judge::log::Log;
use sketchnav_rehearsal::Rehearsal;
use sketchnav_schemas::floor_plan::Person;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::{files, poles};

fn run(mission: &str, seed: u64) -> RunConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/directions").join(mission);
    let (mission, robot) = sketchnav_sim::mission_file::load(&path).unwrap();
    RunConfig::lockstep("rehearsal", mission, robot, seed)
}

fn log_of(run: &RunConfig) -> Log {
    let mut log = Log::default();
    Rehearsal::new(run).unwrap().run(&mut log).unwrap();
    log
}

fn judged(run: &RunConfig, log: &Log, dots: &[[f64; 2]]) -> Vec<JourneyVerdict> {
    let names: Vec<_> = run.mission.task.iter().map(|task| task.name.clone()).collect();
    journeys(log, &names, dots)
}

fn driven(mission: &str, seed: u64) -> Vec<JourneyVerdict> {
    let run = run(mission, seed);
    let dots = files::plane_file(Path::new(run.mission.world.plane.as_deref().unwrap())).unwrap().dots;
    judged(&run, &log_of(&run), &dots)
}

/// Asserts that the number of arrivals is within three standard deviations of the stated number.
fn arrive_as_stated(verdicts: &[JourneyVerdict]) {
    let is_success = |verdict: &&JourneyVerdict| verdict.kind.is_some_and(Kind::is_success);
    let arrived = verdicts.iter().filter(is_success).count() as f64;
    let stated = verdicts.iter().map(|verdict| verdict.stated.unwrap());
    let (mean, variance) =
        stated.fold((0.0, 0.0), |(mean, variance), p| (mean + p, variance + p * (1.0 - p)));
    assert!((arrived - mean).abs() < 3.0 * f64::sqrt(variance), "{arrived} {mean} {verdicts:?}");
}

#[test]
fn journeys_in_gusts_and_clusters_arrive_as_often_as_predicted() {
    let verdicts: Vec<_> = (1..=6).flat_map(|seed| driven("crowded.toml", seed)).collect();
    arrive_as_stated(&verdicts);
}

/// The navigator has no map. The judge compares each landmark that the navigator attained with the most probable one.
#[test]
fn with_a_belief_as_many_journeys_arrive_as_stated_and_most_landmarks_are_known() {
    let verdicts: Vec<_> = (1..=6).flat_map(|seed| driven("belief.toml", seed)).collect();
    arrive_as_stated(&verdicts);
    let (right, accepted) =
        verdicts.iter().fold((0, 0), |(right, all), verdict| (right + verdict.right, all + verdict.accepted));
    assert!(accepted > 24 && 10 * right >= 8 * accepted, "{verdicts:?}");
    assert!(verdicts.iter().any(|verdict| verdict.kind == Some(Kind::Recovered)), "{verdicts:?}");
}

/// A person stands halfway between two poles. The robot must go around the person without contact. Since the person hides poles,
/// the robot may mistake one pole for another and get lost.
#[test]
fn on_land_the_robot_drives_around_a_person_without_contact() {
    let mut run = run("poles.toml", 1);
    run.mission.task.truncate(1);
    let made = sketchnav_directions::stages::sketcher::make(&run, &|file| std::fs::read(file)).unwrap();
    let places: Vec<_> = made.landmarks[0].iter().map(|(_, at)| *at).collect();
    let length_m = |pair: &&[sketchnav_directions::Point]| (pair[1] - pair[0]).norm();
    let longest = places.windows(2).max_by(|a, b| length_m(a).total_cmp(&length_m(b))).unwrap();
    let middle = (longest[0] + longest[1]) * 0.5;
    run.mission.world.person.push(Person {
        waypoints: vec![[middle.x, middle.y]],
        speed_mps: 0.5,
        radius_m: 0.25,
        pause_s: 0.0,
    });
    let log = log_of(&run);
    let verdict = judged(&run, &log, &poles::poles(1)).remove(0);
    assert!(verdict.accepted as usize > places.len() / 2, "{verdict:?}");
    assert!(log.contacts.is_empty(), "{:?}", log.contacts.len());
}

/// The robot sees only with its laser. It must drive around the poles in its way without contact.
#[test]
fn on_land_the_robot_drives_from_pole_to_pole_without_contact() {
    let run = run("poles.toml", 1);
    let log = log_of(&run);
    let verdicts = judged(&run, &log, &poles::poles(1));
    for verdict in &verdicts {
        assert!(matches!(verdict.kind, Some(Kind::Direct | Kind::Recovered)), "{verdicts:?}");
        assert!(verdict.attained.len() > 4 && verdict.stated.unwrap() > 0.8, "{verdicts:?}");
    }
    assert!(log.contacts.is_empty());
    assert!(judge(&run.mission, &log.truth, &log.status, &[]).tasks.iter().all(|task| task.reached));
}
