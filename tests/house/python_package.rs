//! The Python package `sketchnav`: its layouts agree with the table of channels, and it reads a running system and a
//! recording.
//!
//! These tests need a Python with pytest and the package's dependencies. It is named by `SKETCHNAV_PYTHON` or found as
//! `python3`. Without it, the tests are skipped.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;
use sketchnav_schemas::channels::{self, NAVIGATORS};
use sketchnav_schemas::layout::{Kind, Layout};
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

#[test]
fn the_layouts_of_the_package_are_up_to_date() {
    sketchnav_navigators::register(&[]).unwrap();
    golden(&package().join("sketchnav/_layouts.py"), &sketchnav_schemas::python::layouts());
}

/// Returns the type of a field as a type checker sees it.
fn hint(kind: &Kind) -> String {
    match kind {
        Kind::U32 | Kind::U64 => "int".to_owned(),
        Kind::F32 | Kind::F64 => "float".to_owned(),
        Kind::Text(_) => "str".to_owned(),
        Kind::Struct(layout) => layout.name.to_owned(),
        Kind::Array(element, _) => match &**element {
            Kind::Struct(layout) => format!("list[{}]", layout.name),
            Kind::Text(_) => "list[str]".to_owned(),
            _ => "memoryview".to_owned(),
        },
    }
}

/// Writes the class of a struct, preceded by the classes of the structs that it contains.
fn class(layout: &Layout, base: &str, known: &mut BTreeSet<&'static str>, text: &mut String) {
    if !known.insert(layout.name) {
        return;
    }
    for field in &layout.fields {
        let kind = if let Kind::Array(element, _) = &field.kind { element } else { &field.kind };
        if let Kind::Struct(part) = kind {
            class(part, "Part", known, text);
        }
    }
    text.push_str(&format!("class {}({base}):\n", layout.name));
    let fields = layout.fields.iter().map(|field| format!("    {}: {}\n", field.name, hint(&field.kind)));
    text.extend(fields);
    text.push('\n');
}

/// The channels that a stage reads or writes, and the classes of their messages, for type checkers.
#[test]
fn the_stubs_of_the_package_are_those_of_the_table() {
    let folder = package().join("sketchnav");
    let of_stages: Vec<_> = channels::all()
        .filter(|spec| spec.kind.is_none() && spec.writer.is_some())
        .filter(|spec| {
            NAVIGATORS.iter().any(|stage| spec.readers.contains(stage) || spec.writer == Some(*stage))
        })
        .collect();
    let mut text = String::from(
        "\"\"\"The messages of the channels that all navigators have. Generated; tests/house/python_package.rs compares.\"\"\"\n\n\
         from .messages import Channel, Header, Message, Part, PoseM, Twist\n\n",
    );
    let mut known = BTreeSet::from(["Header", "PoseM", "Twist"]);
    for spec in &of_stages {
        class(&spec.message.layout(), "Message", &mut known, &mut text);
    }
    let source = std::fs::read_to_string(folder.join("channels.py")).unwrap();
    for spec in &of_stages {
        let constant = spec.name.to_uppercase();
        text.push_str(&format!("{constant}: Channel[{}]\n", spec.message.layout().name));
        assert!(source.contains(&format!("\n{constant} = _Common({:?})\n", spec.name)), "{constant}");
    }
    assert_eq!(source.matches(" = _Common(").count(), of_stages.len(), "channels.py has others");
    golden(&folder.join("channels.pyi"), &text);
}

/// Compares a generated file. `SKETCHNAV_UPDATE_GOLDEN=1` rewrites it.
fn golden(path: &Path, expected: &str) {
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        std::fs::write(path, expected).unwrap();
    }
    let found = std::fs::read_to_string(path).unwrap_or_default();
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

/// An observer may die at any time without occupying the pipeline's places for readers.
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

/// Trials that are driven by workers on other machines give the same report as a single machine, even if a worker is lost.
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
