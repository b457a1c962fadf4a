//! A navigator in Python is a single file with the same functionality as the equivalent navigator in Rust (`stranger.rs`).
//!
//! These tests need a Python with the wheel of this checkout. `SKETCHNAV_WHEEL_PYTHON` names it; without it, the tests are skipped.

use std::process::Command;

use sketchnav_recordings::Recording;
use support::room::ALONG_THE_WALL;
use support::{Ended, Place, repository, room};

/// Creates a place where `sketchnav` is the wall follower with these parts replaced, or returns `None` without a Python that has
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
    let rust = rust_place();
    let in_rust = rust.fine(&format!("judge {} --json", place.files().join(recording).display())).json();
    let nearest = in_rust[0]["account"]["nearest wall on the right"].as_str().unwrap();
    assert!(nearest.ends_with(" m") && !nearest.starts_with("inf"), "{nearest}");
    assert_eq!(judged[0]["account"], in_rust[0]["account"]);
    // The report of the navigator in Python has the same chart.
    place.fine(&format!("report {recording} -o report.html"));
    let page = std::fs::read_to_string(place.files().join("report.html")).unwrap();
    assert!(page.contains("Distance of the wall") && page.contains("m, from the centre"));
}

/// A run can be judged even if the account fails.
#[test]
fn an_account_that_fails_is_named_in_its_place() {
    let changes = [("self.right_m.append((", "self.right_m.add((")];
    let Some(place) = place_with(&changes) else { return };
    let report = place.fine("run wall.toml --out out --json").json();
    let ended = place.fine(&format!("judge {} --json", report["recording"].as_str().unwrap()));
    let judged = ended.json();
    let why = judged[0]["account"]["account"].as_str().unwrap();
    let expected = "failed: Diary.receive: AttributeError: 'list' object has no attribute 'add' (";
    assert!(why.starts_with(expected) && why.ends_with(')'), "{why}");
    assert!(ended.err.contains("Traceback"), "{ended}");
    assert!(judged.to_string().contains("\"reached\":true"), "{judged}");
}

/// Creates a place where `sketchnav` is the same navigator in Rust.
fn rust_place() -> Place {
    let place = Place::of_program("wall_follower");
    room::write(place.files());
    std::fs::write(place.files().join("wall.toml"), ALONG_THE_WALL).unwrap();
    place
}

/// Regression test: the comments in the two definitions had diverged.
#[test]
fn the_definition_of_its_message_is_that_of_the_navigator_in_rust() {
    let main = "    raise SystemExit(sketchnav.main([NAVIGATOR]))\n";
    let prints = "    sketchnav.main([NAVIGATOR])\n    print('defined:', WALLS.definition, sep='\\n')\n";
    let Some(place) = place_with(&[(main, prints)]) else { return };
    let ended = place.fine("channels --json");
    let (_, definition) = ended.out.split_once("defined:\n").unwrap();
    let rust = rust_place();
    let report = rust.fine("run wall.toml --out out --json").json();
    let recording = Recording::open(&rust.files().join(report["recording"].as_str().unwrap())).unwrap();
    let topics = recording.topics().unwrap();
    let walls = topics.iter().find(|topic| topic.name == "/walls").unwrap();
    assert_eq!(definition.trim_end(), std::str::from_utf8(&walls.schema.data).unwrap().trim_end());
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
fn a_sensor_that_no_robot_has_is_refused() {
    let Some(place) = place_with(&[("sensors=[\"sonar\",", "sensors=[\"nose\",")]) else { return };
    let ended = place.run("channels");
    assert_ne!(ended.code, Some(0), "{ended}");
    let expected = "sensors: expected one of laser, sonar, camera, view, odometry, found \"nose\"";
    assert!(ended.err.contains(expected), "{ended}");
}

/// Regression test: the second channel was silently replaced by the first one and its messages.
#[test]
fn a_channel_with_the_name_of_another_one_is_refused() {
    let (navigator, channels) = ("NAVIGATOR = Navigator(\n", "    channels=[WALLS],\n");
    let other = format!("class Other(Message):\n    far_m: f64\n\n\n{navigator}");
    let twice = "    channels=[WALLS, Channel('walls', Other, role='detail', writer='localizer', readers=['pad'])],\n";
    let Some(place) = place_with(&[(navigator, &other), (channels, twice)]) else { return };
    let ended = place.run("channels");
    assert_ne!(ended.code, Some(0), "{ended}");
    assert!(ended.err.contains("channel \"walls\": expected a name that no other channel has"), "{ended}");
}

#[test]
fn the_doctor_names_the_script_and_its_interpreter() {
    let Some(place) = place() else { return };
    let ended = place.run("doctor --json");
    assert!(ended.out.contains("python") && ended.out.contains("/navigator.py)"), "{ended}");
}

/// A seed from the environment, or options that make Python ignore it, used to give each process a different order.
#[test]
fn hashes_are_the_same_in_all_processes() {
    let shows = "import json\nimport sys\n\nprint('hash', hash('wall'), file=sys.stderr)\n";
    let Some(place) = place_with(&[("import json\n", shows)]) else { return };
    let hash = |seed: Option<&str>| {
        let mut command = place.command("channels");
        command.env_remove("PYTHONHASHSEED").envs(seed.map(|seed| ("PYTHONHASHSEED", seed)));
        let ended: Ended = command.output().unwrap().into();
        assert_eq!(ended.code, Some(0), "{ended}");
        ended.err.lines().rfind(|line| line.starts_with("hash ")).unwrap().to_owned()
    };
    let fixed = hash(Some("0"));
    for seed in [None, Some("7"), Some("random")] {
        assert_eq!(hash(seed), fixed, "{seed:?}");
    }
    for option in ["-E", "-I"] {
        let mut command = Command::new(place.command("").get_program());
        command.arg(option).arg(place.files().join("navigator.py")).arg("channels");
        place.settle(&mut command);
        let ended: Ended = command.env("PYTHONHASHSEED", "0").output().unwrap().into();
        assert_eq!(ended.code, Some(2), "{ended}");
        assert!(ended.err.contains("expected no option -E or -I"), "{ended}");
    }
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

/// The error for a misspelt field used to name only lines of this package.
#[test]
fn the_error_for_a_misspelt_field_names_the_line_of_its_author() {
    let send = "out.send(WALLS, ahead_m=ahead_m, right_m=right_m)";
    let slip = send.replace("ahead_m=", "ahed_m=");
    let Some(place) = place_with(&[(send, &slip)]) else { return };
    let ended = place.run("run wall.toml");
    assert_eq!(ended.code, Some(2), "{ended}");
    let (_, error) = ended.err.split_once("error: localizer: Ears.step: ").unwrap();
    assert!(error.contains(&slip) && !error.contains("messages.py"), "{ended}");
}

/// Exceptions in `save` restarted the process until the supervisor gave up on it, and those in `is_ready` and `recover` were
/// ignored.
#[test]
fn an_exception_in_any_method_is_an_error_of_the_stage() {
    let raises = "raise ArithmeticError('no wall')";
    let ready = "return self.agenda.is_ready()";
    // A successor that can use no checkpoint recovers without one.
    let restore = "        self.walls_m = json.loads(state)\n";
    let refuses =
        format!("        raise ValueError('not this state')\n\n    def recover(self):\n        {raises}\n");
    for (method, old, new) in [
        ("localizer: Ears.save", "return json.dumps(self.walls_m).encode()", raises),
        ("planner: Driver.is_ready", ready, raises),
        ("localizer: Ears.recover", restore, &refuses),
    ] {
        let Some(place) = place_with(&[(old, new)]) else { return };
        let kill = "[[fault]]\nchannel = \"walls\"\nmessage = 20\ndo = \"kill\"\n";
        std::fs::write(place.files().join("plan.toml"), kill).unwrap();
        let ended = place.run("run wall.toml --faults plan.toml");
        assert_eq!(ended.code, Some(2), "{ended}");
        let error = format!("error: {method}: ArithmeticError: no wall (");
        assert!(ended.err.contains(&error) && ended.err.contains("navigator.py, line "), "{ended}");
    }
}

/// The exception that ended the step was once reported as an earlier one, which had already been handled.
#[test]
fn an_error_of_the_host_that_was_caught_does_not_hide_a_later_exception() {
    let step = "        walls = instant.newest(WALLS)\n";
    let fails = format!(
        "{step}        try:\n            out.send(SONAR)\n        except RuntimeError:\n            pass\n        \
         raise ArithmeticError('no wall')\n"
    );
    let Some(place) = place_with(&[(step, &fails)]) else { return };
    let ended = place.run("run wall.toml");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("error: planner: Driver.step: ArithmeticError: no wall ("), "{ended}");
    let passes_on = format!("{step}        out.send(SONAR)\n");
    let Some(place) = place_with(&[(step, &passes_on)]) else { return };
    let ended = place.run("run wall.toml");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("sonar") && !ended.err.contains("RuntimeError"), "{ended}");
}

/// The message was once sent in its partly filled state.
#[test]
fn a_message_whose_filling_failed_is_not_sent() {
    let send = "        out.send(WALLS, ahead_m=ahead_m, right_m=right_m)\n";
    let fails = "        try:\n            out.send(WALLS, ahead_m=ahead_m, right_m='near')\n        except ValueError:\n    ";
    let Some(place) = place_with(&[(send, &format!("{fails}{send}"))]) else { return };
    let recording = place.driven("wall.toml");
    let messages = place.messages(&recording);
    assert_eq!(messages["/walls"], messages["/tick"], "{messages:?}");
    place.is_reproduced(&recording, &["localizer", "planner"]);
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
    // Here, the message is about to be sent, and its sender ignores the error.
    let send = "        out.send(WALLS, ahead_m=ahead_m, right_m=right_m)\n";
    let keeps = "        try:\n            out.send(WALLS, lambda walls: setattr(self, 'kept', walls))\n        \
                 except RuntimeError:\n";
    for then in [&format!("    {send}"), "            pass\n", &format!("            pass\n{send}")] {
        let Some(place) = place_with(&[(send, &format!("{keeps}{then}"))]) else { return };
        let ended = place.run("run wall.toml");
        assert_eq!(ended.code, Some(2), "{ended}");
        assert!(ended.err.contains("localizer: Ears.step: RuntimeError: a message"), "{ended}");
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

/// Tests the examples in the package's description, as it is published.
#[test]
fn the_examples_of_the_package_run_as_they_are() {
    let Some(python) = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "numpy, sketchnav._core") else {
        return;
    };
    let page = std::fs::read_to_string(repository().join("python/README.md")).unwrap();
    let blocks = |fence: &str| {
        let blocks = page.split(fence).skip(1).filter_map(|rest| rest.split("```").next());
        blocks.map(str::to_owned).collect::<Vec<_>>()
    };
    let ([relations, network, navigator], [floor, mission]) =
        (&blocks("```python\n")[..], &blocks("```toml\n")[..])
    else {
        panic!("expected three examples, a floor and a mission")
    };
    let place = Place::of_script(python.clone(), navigator);
    for example in [relations, network] {
        let ended: Ended = Command::new(&python).args(["-c", example]).output().unwrap().into();
        assert_eq!(ended.code, Some(0), "{ended}");
    }
    std::fs::write(place.files().join("room.floor.toml"), floor).unwrap();
    std::fs::write(place.files().join("spin.toml"), mission).unwrap();
    let report = place.fine("run spin.toml --json").json();
    assert_eq!((&report["success"], &report["lost_messages"]), (&true.into(), &0.into()), "{report}");
    place.fine("chaos spin.toml --kills 5");
}

/// Regression test: type checkers did not see the fields and the version of a navigator's messages.
#[test]
fn a_type_checker_accepts_the_package_and_the_navigator() {
    let Some(python) = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", "mypy, sketchnav._core") else {
        return;
    };
    let place = Place::new();
    let navigator = repository().join("tests/stranger/wall_follower.py").display().to_string();
    for checked in [["--check-untyped-defs", &navigator], ["--package", "sketchnav"]] {
        let mut command = Command::new(&python);
        // The packages for live systems and recordings may be missing.
        command.args(["-m", "mypy", "--ignore-missing-imports", "--cache-dir", "cache"]).args(checked);
        place.settle(&mut command);
        let ended: Ended = command.output().unwrap().into();
        assert_eq!(ended.code, Some(0), "{ended}");
    }
}

/// The code on the page is the same as in the file.
#[test]
fn the_code_of_the_page_is_that_of_the_file() {
    let read = |path: &str| std::fs::read_to_string(repository().join(path)).unwrap();
    let (page, file) = (read("docs/python.md"), read("tests/stranger/wall_follower.py"));
    let blocks: Vec<_> =
        page.split("```python\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert_eq!(blocks.len(), 5);
    blocks.iter().for_each(|block| assert!(file.contains(block), "{block}"));
}
