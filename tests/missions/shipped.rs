//! Whole missions with the real program: the demo, the missions that ship, and missions on real maps and drawings.

use std::path::{Path, PathBuf};

use serde_json::Value;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::{Floor, files, mission_file};
use support::{Place, repository, room};

/// The tasks of Boniardi et al. 2015, Table I, in the demo's order.
const DEMO_TASKS: [&str; 9] =
    ["0 → 1", "1 → 2", "2 → 3", "3 → 9", "9 → 4", "4 → 5", "5 → 8", "8 → 6", "6 → 7"];

/// Checks what a user sees first: nine tasks, all of them reached, no losses, two pictures and a recording.
fn the_demo_reaches_every_task(seed: u64) {
    let place = Place::new();
    let (report, code) = place.mission(&format!("demo --seed {seed} --out results"), "demo");
    assert_eq!(code, 0, "{report:#}");
    assert_eq!((&report["success"], &report["seed"]), (&Value::Bool(true), &seed.into()));
    let tasks = report["tasks"].as_array().unwrap();
    let names: Vec<_> = tasks.iter().map(|task| task["name"].as_str().unwrap()).collect();
    assert_eq!(names, DEMO_TASKS);
    assert!(tasks.iter().all(|task| task["reached"] == true), "{report:#}");
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    has_the_files_it_names(&report);
    place.assert_nothing_left("demo");
}

fn has_the_files_it_names(report: &Value) {
    assert!(Path::new(report["recording"].as_str().unwrap()).is_file(), "{report:#}");
    let pictures = report["pictures"].as_array().unwrap();
    assert_eq!(pictures.len(), 2, "{report:#}");
    for picture in pictures {
        let text = std::fs::read_to_string(picture.as_str().unwrap()).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{picture}");
    }
}

macro_rules! demos {
    ($($name:ident: $seed:literal;)*) => {$(
        #[test]
        fn $name() {
            the_demo_reaches_every_task($seed);
        }
    )*};
}

demos! {
    the_demo_reaches_every_task_with_seed_1: 1;
    the_demo_reaches_every_task_with_seed_2: 2;
    the_demo_reaches_every_task_with_seed_3: 3;
    the_demo_reaches_every_task_with_seed_4: 4;
    the_demo_reaches_every_task_with_seed_5: 5;
}

/// Regression test: after `demo --out demo`, the word `demo` meant the folder with the results.
#[test]
fn a_folder_with_the_results_of_the_demo_does_not_hide_it() {
    let place = Place::new();
    std::fs::create_dir(place.files().join("demo")).unwrap();
    let (report, code) = place.mission("run demo --out demo", "again");
    assert_eq!((code, &report["mission"]), (0, &Value::from("building-a")), "{report:#}");
    std::fs::write(place.files().join("demo/demo"), "").unwrap();
    let refused = place.run("run demo/demo");
    assert_eq!(refused.code, Some(2), "{refused}");
}

/// Scripts rely on these keys of the report.
#[test]
fn the_report_has_the_documented_keys() {
    let place = Place::new();
    room::write(place.files());
    let (report, code) = place.mission("run room.toml", "room");
    assert_eq!(code, 0, "{report:#}");
    let keys = |value: &Value| {
        let mut keys: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
        keys.sort_unstable();
        keys
    };
    let promised = [
        "driven",
        "logs",
        "lost_messages",
        "mission",
        "pictures",
        "processes",
        "real_time_factor",
        "recording",
        "rejected",
        "seed",
        "sim_seconds",
        "success",
        "tasks",
        "wall_seconds",
    ];
    assert_eq!(keys(&report), promised);
    let task = ["collisions", "final_error_m", "name", "path_m", "reached", "state", "time_s"];
    let found = keys(&report["tasks"][0]);
    assert!(task.iter().all(|key| found.iter().any(|found| found == key)), "{found:?}");
    let processes = report["processes"].as_array().unwrap();
    assert_eq!(processes.len(), 5, "{report:#}");
    let page = std::fs::read_to_string(repository().join("docs/missions.md")).unwrap();
    for key in promised.iter().chain(&task).chain(&["process", "steps", "busy_s", "step_allocations"]) {
        assert!(page.contains(&format!("`{key}")), "docs/missions.md does not name {key}");
    }
    for process in processes {
        assert!(process["steps"].as_u64().unwrap() > 0 && process["busy_s"].as_f64().unwrap() > 0.0);
        assert!(process["process"].is_string() && process["step_allocations"].is_u64());
    }
}

/// Without `--json`, the user sees a table, and where to find the recording and the pictures.
#[test]
fn a_terminal_gets_a_table() {
    let place = Place::new();
    room::write(place.files());
    let ended = place.run("run room.toml --out results --system room");
    assert_eq!(ended.code, Some(0), "{ended}");
    for words in ["next door", "yes", "1 of 1 tasks reached", "0 messages lost", "room.mcap", "floor.svg"] {
        assert!(ended.out.contains(words), "{words}: {ended}");
    }
}

/// A second run does not overwrite the results of the first.
#[test]
fn every_run_has_its_own_folder() {
    let place = Place::new();
    room::write(place.files());
    let recording = |_| place.mission("run room.toml --out results", "room").0["recording"].clone();
    let [first, second] = [0, 1].map(recording);
    assert_ne!(first, second);
    assert!(Path::new(first.as_str().unwrap()).is_file());
}

fn ships(file: &str) -> PathBuf {
    repository().join("sim/missions").join(file)
}

/// Runs a mission file. All tasks must be reached and nothing lost.
fn succeeds(path: &Path) {
    let place = Place::new();
    let (report, code) = place.mission(&format!("run {} --out results", path.display()), "mission");
    assert_eq!(code, 0, "{report:#}");
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    place.assert_nothing_left("mission");
}

/// Like [`succeeds`], but for a mission that refers to files of the external data, wherever they are.
fn succeeds_with_data(mission: &str) {
    let (mission, data) = (repository().join(mission), needs::data().canonicalize().unwrap());
    let drawing = mission.with_file_name("sketch.svg");
    let text = std::fs::read_to_string(&mission).unwrap();
    let text = text.replace("../../../shared/data", data.to_str().unwrap());
    let text = text.replace("\"sketch.svg\"", &format!("{drawing:?}"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mission.toml");
    std::fs::write(&path, text).unwrap();
    succeeds(&path);
}

#[test]
fn the_laboratory_succeeds_with_a_part_drawn_at_another_scale() {
    succeeds(&ships("laboratory/laboratory-a.toml"));
}

#[test]
fn rooms_are_reached_by_the_names_on_the_drawing() {
    succeeds(&ships("building/building-rooms.toml"));
}

#[test]
fn drawn_routes_are_followed() {
    succeeds(&ships("laboratory/laboratory-route.toml"));
}

#[test]
fn a_persons_drawing_of_a_real_environment_leads_to_its_places() {
    if needs::data_file("sketches/kth/world.yaml").is_some() {
        succeeds_with_data("tests/kth/kth-00.toml");
    }
}

#[test]
fn a_map_made_by_a_robot_serves_as_a_world() {
    if needs::data_file("maps/Freiburg79_scan_furnitures.yaml").is_some() {
        succeeds_with_data("tests/freiburg/freiburg-079.toml");
    }
}

/// A robot with a different drive and laser need not reach the same places, but it must complete the mission.
#[test]
fn another_robot_completes_the_laboratory() {
    let place = Place::new();
    for file in ["laboratory-a.toml", "laboratory.floor.toml", "sketch-a.png"] {
        std::fs::copy(ships("laboratory").join(file), place.files().join(file)).unwrap();
    }
    room::replace(place.files(), "laboratory-a.toml", "\"robotino\"", "\"turtlebot3\"");
    let (report, _) = place.mission("run laboratory-a.toml --out results", "turtle");
    assert_eq!(report["tasks"].as_array().unwrap().len(), 11, "{report:#}");
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    place.assert_nothing_left("turtle");
}

/// Otherwise, a broken mission would only be noticed by its first user.
#[test]
fn every_shipped_mission_can_be_opened() {
    let mut count = 0;
    for folder in ["building", "laboratory", "routes"] {
        for entry in std::fs::read_dir(ships(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if name.ends_with(".toml") && !name.ends_with(".floor.toml") && name != "anchors.toml" {
                can_be_opened(&path);
                count += 1;
            }
        }
    }
    assert!(count >= 33, "{count} missions");
}

fn can_be_opened(path: &Path) {
    let (mission, robot) = mission_file::load(path).unwrap();
    let start = &mission.start;
    let pose = Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians());
    let world = files::world(&mission.world).unwrap();
    Floor::new(world, &robot, pose, 1).unwrap();
    let tasks = mission.task.len();
    let run = RunConfig::lockstep("none", mission, robot, 1);
    let (_, places) = sketchnav_sketch::sketcher::understand(&run, &|file| std::fs::read(file)).unwrap();
    assert_eq!(places.tasks.len(), tasks, "{}", path.display());
}
