//! A recording contains the files of its run, and reading it touches no others.

use std::path::Path;

use sketchnav_files::{DRAWING, Files, Limit};
use sketchnav_recordings::reader::Attachment;
use sketchnav_recordings::sources::{self, RecordedRun};
use sketchnav_recordings::{Recording, Writer};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;

use crate::common;

/// Returns a mission with this drawing, in the world of this map.
fn mission(drawing: &Path, map: &Path) -> Mission {
    let mut mission = common::run_config().mission;
    mission.navigator.given.insert("drawing".into(), drawing.to_str().unwrap().into());
    mission.world.floor_plan = None;
    mission.world.map = Some(map.to_str().unwrap().to_owned());
    mission
}

/// Records a run of `mission` with `files` inside.
fn recording(path: &Path, mission: Mission, files: &[Attachment]) -> Recording {
    let run = RunConfig { mission, ..common::run_config() };
    let sink = std::fs::File::create(path).unwrap();
    Writer::create_with(sink, &run, files).unwrap().finish().unwrap();
    Recording::open(path).unwrap()
}

fn inside(name: &str, data: &[u8]) -> Attachment {
    Attachment { name: name.into(), media_type: "text/plain".into(), data: data.into() }
}

fn playing(recording: &Recording, run: RunConfig) -> RunConfig {
    RunConfig { files_of: Some(recording.path().to_str().unwrap().to_owned()), ..run }
}

/// Regression test: `rerun` opened the files named in the `run.json` of an untrusted recording, and `replay --live` put them
/// into another recording.
#[test]
fn a_recorded_run_reads_nothing_outside_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("id_rsa");
    std::fs::write(&secret, "secret").unwrap();
    let evil = recording(&folder.path().join("evil.mcap"), mission(&secret, &secret), &[]);
    let recorded = RecordedRun::of(&evil).unwrap();
    let drawing = recorded.run.mission.navigator.given["drawing"].as_str().unwrap();
    let map = recorded.run.mission.world.map.as_deref();
    assert_eq!((drawing, map), ("navigator/id_rsa", Some("world/id_rsa")));
    let path = secret.to_str().unwrap();
    for name in [drawing, path, "../id_rsa", "navigator/../id_rsa", "/etc/passwd"] {
        let error = recorded.files.read(name.as_ref(), DRAWING).unwrap_err().to_string();
        assert!(error.contains("evil.mcap") && error.contains(name), "{error}");
    }
    let error = recorded.check_files().unwrap_err().to_string();
    assert!(error.contains("navigator/id_rsa") && error.contains(path), "{error}");
    // These are the files that the processes of a replay read, and those that its recorder stores.
    let run = playing(&evil, recorded.run);
    assert!(sources::of_run(&run).unwrap().read(&secret, DRAWING).is_err());
    assert!(sources::to_record(&run).unwrap().is_empty());
}

/// The location that a running system gives for its files is valid only within that system.
#[test]
fn a_recording_cannot_refer_to_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let other = recording(
        &folder.path().join("other.mcap"),
        mission("plan.svg".as_ref(), "floor.yaml".as_ref()),
        &[inside("navigator/plan.svg", b"somebody's")],
    );
    let path = folder.path().join("evil.mcap");
    let run = playing(&other, common::run_config());
    Writer::create(std::fs::File::create(&path).unwrap(), &run).unwrap().finish().unwrap();
    let evil = Recording::open(&path).unwrap();
    assert_eq!(evil.run().unwrap().files_of, None);
    let recorded = RecordedRun::of(&evil).unwrap();
    assert!(recorded.files.read("navigator/plan.svg".as_ref(), DRAWING).is_err());
}

#[test]
fn embedded_files_are_read_from_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let files = [
        inside("navigator/plan.svg", b"drawn"),
        inside("world/../x", b"outside"),
        inside("world/floor.yaml", b"map"),
    ];
    let gone = mission("/gone/plan.svg".as_ref(), "/gone/floor.yaml".as_ref());
    let whole = recording(&folder.path().join("whole.mcap"), gone, &files);
    let recorded = RecordedRun::of(&whole).unwrap();
    recorded.check_files().unwrap();
    assert_eq!(recorded.files.read("navigator/plan.svg".as_ref(), DRAWING).unwrap(), b"drawn");
    let few = Limit { what: "a note", bytes: 2 };
    assert!(recorded.files.read("navigator/plan.svg".as_ref(), few).is_err());
    // The names inside a recording stay the same in a copy of a copy.
    let copy = recording(&folder.path().join("again.mcap"), recorded.run.mission.clone(), &files);
    assert_eq!(RecordedRun::of(&copy).unwrap().run.mission, recorded.run.mission);
    assert_eq!(sources::to_record(&playing(&whole, recorded.run)).unwrap().len(), files.len());
}

/// Regression test: the second of two files with the same name replaced the first.
#[test]
fn files_with_the_same_name_are_kept_apart() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    for (name, text) in [("a/plan.txt", "first"), ("b/plan.txt", "second"), ("floor.yaml", "")] {
        std::fs::create_dir_all(place(name).parent().unwrap()).unwrap();
        std::fs::write(place(name), text).unwrap();
    }
    let mut mission = mission(&place("a/plan.txt"), &place("floor.yaml"));
    for name in ["a/plan.txt", "b/plan.txt"] {
        let mut task = mission.task[0].clone();
        task.given.insert("plan_file".into(), place(name).to_str().unwrap().into());
        mission.task.push(task);
    }
    let files = sources::read(&mission);
    let found: Vec<_> = files.iter().map(|file| (file.name.as_str(), file.data.as_slice())).collect();
    assert_eq!(
        found,
        [
            ("navigator/2/plan.txt", &b"second"[..]),
            ("navigator/plan.txt", b"first"),
            ("world/floor.yaml", b"")
        ]
    );
    RecordedRun::of(&recording(&place("both.mcap"), mission, &files)).unwrap().check_files().unwrap();
}
