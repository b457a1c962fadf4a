//! In lockstep, the same mission and seed produce the same messages, byte for byte, in two runs, and in a rehearsal
//! that calls the same cores in one process without shared memory.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use serde_json::Value;
use sketchnav_recordings::Writer;
use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::mission_file;
use support::{Ended, Place, repository, room};

fn demo(place: &Place, seed: u64, system: &str) -> PathBuf {
    let (report, _) = place.mission(&format!("demo --seed {seed} --out results"), system);
    PathBuf::from(report["recording"].as_str().unwrap())
}

fn diff(place: &Place, a: &Path, b: &Path, options: &str) -> Ended {
    place.run(&format!("diff {} {} {options}", a.display(), b.display()))
}

#[test]
fn two_runs_of_a_seed_are_identical() {
    let place = Place::new();
    let (a, b) = (demo(&place, 3, "first"), demo(&place, 3, "second"));
    let ended = diff(&place, &a, &b, "--json");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(ended.json()["identical"], true, "{ended}");
}

/// The result does not depend on how the processes are scheduled. Here, two systems compete for the same cores.
#[test]
fn two_runs_at_the_same_time_are_identical() {
    let place = Place::new();
    room::write(place.files());
    let start = |name: &str| place.start(&format!("run room.toml --out {name} --json --system {name}"));
    let runs = ["left", "right"].map(start);
    let [a, b] = runs.map(|run| PathBuf::from(run.end().json()["recording"].as_str().unwrap()));
    let ended = diff(&place, &a, &b, "");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.out.starts_with("identical"), "{ended}");
}

/// The output describes the difference so that it can be looked up: the channel, the number, the field and both values.
#[test]
fn another_seed_is_different_and_diff_says_where() {
    let place = Place::new();
    room::write(place.files());
    let run = |seed: u64| {
        let (report, _) = place.mission(&format!("run room.toml --seed {seed}"), "room");
        PathBuf::from(report["recording"].as_str().unwrap())
    };
    let (a, b) = (run(1), run(2));
    let ended = diff(&place, &a, &b, "--json");
    assert_eq!(ended.code, Some(1), "{ended}");
    let found = ended.json();
    let difference = &found["difference"];
    assert_eq!(found["identical"], false, "{ended}");
    // The votes for the direction of the walls are the first thing that depends on the seed.
    assert_eq!((&difference["channel"], &difference["seq"]), (&"sketch".into(), &1.into()), "{ended}");
    let field = &difference["what"]["field"];
    assert_eq!(field["field"], "wall_direction_rad", "{ended}");
    assert_ne!(field["a"], field["b"], "{ended}");
    let text = diff(&place, &a, &b, "");
    assert!(text.out.starts_with("different: sketch message 1 at 0.000 s: wall_direction_rad"), "{text}");
}

/// Writes the messages of a rehearsal as the recorder would.
struct Recorder(Writer<BufWriter<File>>);

impl Tap for Recorder {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) {
        self.0.write_bytes(spec, message, cells).unwrap();
    }
}

impl Onlooker for Recorder {}

fn rehearse(mission: &Path, seed: u64, path: &Path) {
    let (mission, robot) = mission_file::load(mission).unwrap();
    let run = RunConfig::lockstep("rehearsal", mission, robot, seed);
    sketchnav_navigators::register(&[]).unwrap();
    let sink = BufWriter::new(File::create(path).unwrap());
    let mut recorder = Recorder(Writer::create(sink, &run).unwrap());
    Rehearsal::new(&run).unwrap().run(&mut recorder).unwrap();
    recorder.0.finish().unwrap().into_inner().unwrap();
}

fn rehearsal_equals_processes(mission: &Path, seed: u64) {
    let place = Place::new();
    let arguments = format!("run {} --seed {seed} --out results", mission.display());
    let (report, _) = place.mission(&arguments, "processes");
    let by_processes = PathBuf::from(report["recording"].as_str().unwrap());
    let rehearsed = place.files().join("rehearsed.mcap");
    rehearse(mission, seed, &rehearsed);
    let ended = diff(&place, &by_processes, &rehearsed, "");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_ne!(report["sim_seconds"], Value::from(0.0));
}

#[test]
fn five_processes_and_one_send_the_same_messages_in_the_building() {
    rehearsal_equals_processes(&repository().join("sim/missions/building/building-a.toml"), 7);
}

#[test]
fn five_processes_and_one_send_the_same_messages_along_drawn_routes() {
    rehearsal_equals_processes(&repository().join("sim/missions/laboratory/laboratory-route.toml"), 1);
}
