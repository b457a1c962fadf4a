//! A navigator in Python is a single file. It does all that the same navigator in Rust does: `stranger.rs`.
//!
//! These tests need a Python in which the wheel of this checkout is installed. `SKETCHNAV_WHEEL_PYTHON` names it; without it, the
//! tests are skipped.

use std::process::Command;

use support::room::ALONG_THE_WALL;
use support::{Ended, Place, repository, room};

/// Creates a place in which `sketchnav` is the wall follower with these parts replaced, or returns `None` without a Python that has
/// the wheel.
fn place_with(changes: &[(&str, &str)]) -> Option<Place> {
    let python = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "sketchnav._core")?;
    let mut text = std::fs::read_to_string(repository().join("tests/stranger/wall_follower.py")).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    let place = Place::of_script(python, &text);
    room::write(place.files());
    std::fs::write(place.files().join("wall.toml"), ALONG_THE_WALL).unwrap();
    Some(place)
}

fn place() -> Option<Place> {
    place_with(&[])
}

#[test]
fn it_drives_a_mission_and_its_recording_is_replayed_executed_again_and_judged() {
    let Some(place) = place() else { return };
    let report = place.fine("run wall.toml --out out --json").json();
    assert_eq!((&report["lost_messages"], report["tasks"].as_array().map(Vec::len)), (&0.into(), Some(2)));
    let recording = report["recording"].as_str().unwrap();
    let messages = place.messages(recording);
    assert!(messages.contains_key("/walls") && messages["/walls"] == messages["/tick"], "{messages:?}");
    place.is_reproduced(recording, &["world", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert_eq!(judged[0]["method"], "wall-follower", "{judged}");
    assert!(judged.to_string().contains("\"reached\":true"), "{judged}");
    // The messages are those of the navigator in Rust, whose program reads and judges the recording as its own.
    let rust = Place::of_program("wall_follower");
    let judged = rust.fine(&format!("judge {} --json", place.files().join(recording).display())).json();
    let nearest = judged[0]["account"]["nearest wall on the right"].as_str().unwrap();
    assert!(nearest.ends_with(" m") && !nearest.starts_with("inf"), "{nearest}");
}

#[test]
fn twenty_kills_leave_the_same_bytes() {
    let Some(place) = place() else { return };
    let told =
        place.fine("chaos wall.toml --kills 20 --targets world,localizer,planner,recorder --json").json();
    assert_eq!(told["identical"], true, "{told}");
}

#[test]
fn it_drives_in_real_time() {
    let Some(place) = place() else { return };
    let report = place.fine("run wall.toml --speed 10 --json").json();
    assert_eq!((&report["success"], &report["lost_messages"]), (&true.into(), &0.into()), "{report:#}");
}

#[test]
fn what_its_mission_lacks_is_said_before_anything_starts() {
    let Some(place) = place() else { return };
    let path = place.files().join("wall.toml");
    std::fs::write(&path, ALONG_THE_WALL.replace("seconds = 40\n", "")).unwrap();
    let ended = place.run("run wall.toml");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("error: wall.toml: task 2.seconds: expected a number of seconds"), "{ended}");
    assert!(!ended.err.contains("Traceback"), "{ended}");
    std::fs::write(&path, ALONG_THE_WALL.replace("nomad200", "robotino")).unwrap();
    let ended = place.run("run wall.toml");
    assert!(ended.code == Some(2) && ended.err.contains("[sonar]"), "{ended}");
}

#[test]
fn an_exception_is_an_error_of_the_stage_and_its_traceback_is_in_the_log() {
    let step = "        walls = instant.newest(WALLS)\n";
    let fails =
        format!("{step}        if instant.tick == 30:\n            raise ArithmeticError('no wall')\n");
    let Some(place) = place_with(&[(step, &fails)]) else { return };
    let ended = place.run("run wall.toml --system walls");
    assert_eq!(ended.code, Some(2), "{ended}");
    let (_, error) = ended.err.split_once("error: planner: Driver.step: ArithmeticError: no wall (").unwrap();
    assert!(
        error.contains("navigator.py, line ") && error.contains("traceback (most recent call last):\n"),
        "{ended}"
    );
    assert!(error.contains("raise ArithmeticError('no wall')"), "{ended}");
    place.assert_nothing_left("walls");
}

/// The memory of a message belongs to the host once the step is over.
#[test]
fn what_is_kept_of_a_message_without_a_copy_is_an_error() {
    let step = "        walls = instant.newest(WALLS)\n";
    for kept in ["walls", "memoryview(walls._memory)[8:]"] {
        let keeps = format!("{step}        self.kept = {kept} if walls else None\n");
        let Some(place) = place_with(&[(step, &keeps)]) else { return };
        let ended = place.run("run wall.toml");
        assert_eq!(ended.code, Some(2), "{ended}");
        assert!(
            ended.err.contains("kept beyond the call") && ended.err.contains("message.copy()"),
            "{ended}"
        );
    }
    let copies = format!("{step}        self.kept = walls.copy() if walls else None\n");
    if let Some(place) = place_with(&[(step, &copies)]) {
        place.fine("run wall.toml");
    }
}

#[test]
fn a_message_that_has_a_gap_is_refused_where_it_is_declared() {
    let changes = [("    ahead_m: Annotated[f64,", "    sure: sketchnav.f32\n    ahead_m: Annotated[f64,")];
    let Some(place) = place_with(&changes) else { return };
    let ended = place.run("channels");
    assert_ne!(ended.code, Some(0), "{ended}");
    assert!(ended.err.contains("Walls.ahead_m: expected no gap before the field"), "{ended}");
}

#[test]
fn numpy_views_a_reading_without_a_copy() {
    if needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "numpy").is_none() {
        return;
    }
    let first = "    first, step = ";
    let views = format!(
        "    seen = numpy.asarray(scan.ranges_m)\n    assert not seen.flags.owndata and not seen.flags.writeable\n    \
         assert len(seen) == scan.sonar_count > 0\n{first}"
    );
    let changes = [("import sketchnav\n", "import sketchnav\nimport numpy\n"), (first, &views)];
    let Some(place) = place_with(&changes) else { return };
    place.fine("run wall.toml");
}

#[test]
fn messages_are_declared_filled_and_read() {
    let Some(python) = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "sketchnav._core") else { return };
    let tests = repository().join("python/tests/test_messages.py");
    let ended: Ended = Command::new(python).arg(tests).output().unwrap().into();
    assert_eq!(ended.code, Some(0), "{ended}");
}

/// The page's code is that of the file.
#[test]
fn the_code_of_the_page_is_that_of_the_file() {
    let read = |path: &str| std::fs::read_to_string(repository().join(path)).unwrap();
    let (page, file) = (read("docs/python.md"), read("tests/stranger/wall_follower.py"));
    let blocks: Vec<_> =
        page.split("```python\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert_eq!(blocks.len(), 4);
    blocks.iter().for_each(|block| assert!(file.contains(block), "{block}"));
}
