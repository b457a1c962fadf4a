//! The Python package `sketchnav`: its layouts agree with the table of channels, and it reads a running system and a
//! recording.
//!
//! These tests need a Python with pytest and the package's dependencies. It is named by `SKETCHNAV_PYTHON` or found as
//! `python3`. Without it, the tests are skipped.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::Command;

use nix::sys::signal::Signal;
use support::{Place, Running, repository, room};

fn python(modules: &str) -> Option<PathBuf> {
    needs::python("python", "SKETCHNAV_PYTHON", modules)
}

fn package() -> PathBuf {
    repository().join("python")
}

fn pytest(place: &Place, python: &PathBuf, file: &str, variable: &str, value: &str) {
    let mut command = Command::new(python);
    command.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]).arg(package().join("tests").join(file));
    command.env("PYTHONPATH", package()).env("PYTHONDONTWRITEBYTECODE", "1").env(variable, value);
    place.settle(&mut command);
    let ended = Running::spawn(command).end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(!ended.out.contains("skipped"), "{ended}");
}

/// As with other generated files, `SKETCHNAV_UPDATE_GOLDEN=1` rewrites the file.
#[test]
fn the_layouts_of_the_package_are_up_to_date() {
    let path = package().join("sketchnav/_layouts.py");
    sketchnav_navigators::register(&[]).unwrap();
    let expected = sketchnav_schemas::python::layouts();
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap();
    assert!(found == expected, "{}: SKETCHNAV_UPDATE_GOLDEN=1 updates it", path.display());
}

#[test]
fn python_reads_a_running_system() {
    let Some(python) = python("pytest, numpy, iceoryx2") else { return };
    let place = Place::new();
    let mut running = place.start("run demo --json --system snake --speed 2");
    place.wait_until_driving(&mut running, "snake");
    pytest(&place, &python, "test_live.py", "SKETCHNAV_SYSTEM", "snake");
    running.signal(Signal::SIGINT);
    assert_eq!(running.end().json()["lost_messages"], 0);
    place.assert_nothing_left("snake");
}

/// An observer may die at any moment without occupying the pipeline's places for readers.
#[test]
fn killing_a_python_reader_fifty_times_does_no_harm() {
    let Some(python) = python("numpy, iceoryx2") else { return };
    let place = Place::new();
    let mut running = place.start("run demo --json --system snake --speed 1");
    place.wait_until_driving(&mut running, "snake");
    let script = "import sketchnav\nfor scan in sketchnav.connect('snake').scan: print(scan.seq, flush=True)";
    for _ in 0..50 {
        let mut command = Command::new(&python);
        command.args(["-c", script]).env("PYTHONPATH", package()).env("PYTHONDONTWRITEBYTECODE", "1");
        place.settle(&mut command);
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        child.kill().unwrap();
        let ended: support::Ended = child.wait_with_output().unwrap().into();
        assert!(line.trim().parse::<u64>().is_ok(), "{line:?}: {ended}");
        running.must_live();
    }
    running.signal(Signal::SIGINT);
    let report = running.end().json();
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    let restarts =
        report["processes"].as_array().unwrap().iter().map(|process| process["restarts"].as_u64().unwrap());
    assert_eq!(restarts.sum::<u64>(), 0, "{report:#}");
    place.assert_nothing_left("snake");
}

#[test]
fn python_reads_a_recording_as_frames() {
    let Some(python) = python("pytest, pandas, mcap_ros2, iceoryx2") else { return };
    let place = Place::new();
    room::write(place.files());
    let (report, _) = place.mission("run room.toml", "room");
    let recording = report["recording"].as_str().unwrap();
    pytest(&place, &python, "test_recordings.py", "SKETCHNAV_RECORDING", recording);
}

/// Trials that are driven by workers on other machines give the same report as a single machine, whatever happens to a
/// worker.
#[test]
fn two_dask_workers_give_the_report_of_one_machine_despite_a_kill() {
    let Some(python) = python("distributed") else { return };
    let place = Place::new();
    let project = repository().display();
    let options = format!("laboratory --drawings a --sample 2 --trials 2 --seed 3 --project {project}");
    let local = place.fine(&format!("eval {options}"));
    let mut command = Command::new(python);
    command.arg(package().join("tests/two_workers.py")).arg(place.command("").get_program());
    command.args(options.split(' ')).env("PYTHONPATH", package()).env("PYTHONDONTWRITEBYTECODE", "1");
    place.settle(&mut command);
    let merged = Running::spawn(command).end();
    assert_eq!(merged.code, Some(0), "{merged}");
    assert_eq!(merged.out, local.out, "{merged}");
}
