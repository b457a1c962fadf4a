//! Rules of the house that no compiler checks: who may depend on what, and that a list stands once.

mod support;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use support::repository;

/// Crates that know no process, no network, no recording and no physics.
const PURE: [&str; 9] = [
    "sketchnav-schemas",
    "sketchnav-stage",
    "sketchnav-corridor",
    "sketchnav-directions",
    "sketchnav-landmarks",
    "sketchnav-mapping",
    "sketchnav-motion",
    "sketchnav-qualitative",
    "sketchnav-sketch",
];
/// Pure crates that navigators may share; any other crate in `services/navigators` is a navigator of its own.
const SHARED: [&str; 3] = ["sketchnav-mapping", "sketchnav-motion", "sketchnav-qualitative"];
/// What they must not reach, by any way.
const IMPURE: [&str; 7] = ["iceoryx2", "axum", "tokio", "mcap", "rapier2d", "nix", "sketchnav-runtime"];

/// What cargo knows of the workspace.
fn metadata() -> Value {
    // Packages for other platforms may never have been downloaded.
    let host = Command::new("rustc").args(["--print", "host-tuple"]).output().unwrap();
    let host = String::from_utf8(host.stdout).unwrap();
    let cargo = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--offline",
            "--locked",
            "--filter-platform",
            host.trim(),
        ])
        .current_dir(repository())
        .output()
        .unwrap();
    assert!(cargo.status.success(), "{}", String::from_utf8_lossy(&cargo.stderr));
    serde_json::from_slice(&cargo.stdout).unwrap()
}

fn list(value: &Value) -> Vec<Value> {
    value.as_array().cloned().unwrap_or_default()
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// The names of the packages that each package depends on, those for tests left out.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let metadata = metadata();
    let names: BTreeMap<_, _> =
        list(&metadata["packages"]).iter().map(|p| (text(&p["id"]), text(&p["name"]))).collect();
    let is_normal = |dep: &Value| list(&dep["dep_kinds"]).iter().any(|kind| kind["kind"].is_null());
    let of_node = |node: &Value| {
        let deps = list(&node["deps"]);
        let deps = deps.iter().filter(|dep| is_normal(dep)).map(|dep| names[&text(&dep["pkg"])].clone());
        (names[&text(&node["id"])].clone(), deps.collect())
    };
    list(&metadata["resolve"]["nodes"]).iter().map(of_node).collect()
}

fn reached<'a>(from: &'a str, all: &'a BTreeMap<String, BTreeSet<String>>) -> BTreeSet<&'a str> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(name) = open.pop() {
        for next in all.get(name).into_iter().flatten().map(String::as_str) {
            if reached.insert(next) {
                open.push(next);
            }
        }
    }
    reached
}

#[test]
fn pure_crates_reach_no_process_no_network_no_recording_and_no_physics() {
    let all = dependencies();
    for pure in PURE {
        assert!(all.contains_key(pure), "{pure}: no such crate");
        let reached = reached(pure, &all);
        let found: Vec<_> = IMPURE.iter().filter(|impure| reached.contains(**impure)).collect();
        assert!(found.is_empty(), "{pure} reaches {found:?}");
    }
    let runtime = reached("sketchnav-runtime", &all);
    assert!(runtime.contains("iceoryx2"), "the test sees what is there");
}

/// `cargo run --release` builds all default members. The live view was one: a fresh clone compiled 45 crates more than it
/// needed.
#[test]
fn a_crate_behind_a_feature_of_the_program_is_no_default_member() {
    let metadata = metadata();
    let packages = list(&metadata["packages"]);
    let named = |id: &Value| packages.iter().find(|package| &package["id"] == id).map(|p| text(&p["name"]));
    let members: BTreeSet<_> =
        list(&metadata["workspace_default_members"]).iter().filter_map(named).collect();
    let program = packages.iter().find(|package| package["name"] == "sketchnav").unwrap();
    let dependencies = list(&program["dependencies"]);
    let optional: BTreeSet<_> =
        dependencies.iter().filter(|d| d["optional"] == true).map(|d| text(&d["name"])).collect();
    assert!(
        optional.contains("sketchnav-view") && members.contains("sketchnav-sim"),
        "the test sees what is there"
    );
    let both: Vec<_> = optional.intersection(&members).collect();
    assert!(both.is_empty(), "{both:?}: take it out of default-members");
}

/// A navigator can be understood, changed and removed without a look at the others.
#[test]
fn no_navigator_imports_another() {
    let all = dependencies();
    let folder = repository().join("services/navigators");
    let crates = std::fs::read_dir(folder).unwrap().filter_map(|entry| {
        let path = entry.unwrap().path();
        path.join("Cargo.toml").exists().then(|| format!("sketchnav-{}", path.file_name().unwrap().display()))
    });
    let crates: Vec<_> = crates.filter(|name| !SHARED.contains(&name.as_str())).collect();
    assert!(crates.contains(&"sketchnav-sketch".to_owned()), "{crates:?}");
    for navigator in &crates {
        assert!(PURE.contains(&navigator.as_str()), "{navigator}: add it to PURE");
        let reached = reached(navigator, &all);
        let others: Vec<_> = crates.iter().filter(|other| reached.contains(other.as_str())).collect();
        assert!(others.is_empty(), "{navigator} imports {others:?}");
    }
}

/// Each pure crate has clippy forbid clocks, threads, files of its own and maps without order.
#[test]
fn pure_crates_have_clippy_guard_them() {
    let manifests = sources(repository(), "Cargo.toml");
    for pure in PURE {
        let own = manifests.iter().find(|path| read(path).contains(&format!("name = \"{pure}\"")));
        let guard = own.unwrap_or_else(|| panic!("{pure}: no manifest")).with_file_name("clippy.toml");
        assert!(guard.exists(), "expected {}", guard.display());
        assert!(read(&guard).contains("std::time::Instant::now"), "{}", guard.display());
    }
}

/// Who sets the clock of the machine changes no mission. Half-made files of shared memory once were told by their times.
#[test]
fn no_process_reads_the_wall_clock() {
    let words = ["SystemTime", "UNIX_EPOCH", ".modified()", "CLOCK_REALTIME"];
    let mut found = Vec::new();
    for path in sources(repository(), ".rs") {
        let place = path.strip_prefix(repository()).unwrap().display().to_string();
        let is_ours =
            ["services/", "schemas/", "recordings/", "sim/"].iter().any(|own| place.starts_with(own));
        let text = read(&path);
        found.extend(
            words
                .iter()
                .filter(|word| is_ours && text.contains(**word))
                .map(|word| format!("{place}: {word}")),
        );
    }
    assert!(found.is_empty(), "{found:?}");
}

/// People and programs see the table itself.
#[test]
fn the_command_line_shows_the_pipeline_as_it_is() {
    let place = support::Place::new();
    let shown = place.run("channels --json").json();
    let shown: Vec<_> =
        shown.as_array().unwrap().iter().map(|row| row["channel"].as_str().unwrap().to_owned()).collect();
    assert_eq!(shown, channels::all().map(|spec| spec.name).collect::<Vec<_>>());
    let wrong = place.run("channels --kind nonsense");
    assert_eq!(wrong.code, Some(2), "{wrong}");
    assert!(
        wrong
            .err
            .contains("--kind: expected one of corridor, directions, landmarks, sketch, found \"nonsense\""),
        "{wrong}"
    );
}

/// Lists of channels that are not the pipeline: what the judge reads of a recording.
const OWN_LISTS: [&str; 1] = ["services/evaluation/src/judge/log.rs"];

/// A list of processes or channels that stands a second time goes wrong when one is added. In the first edition the graph
/// was written down in some twelve places.
#[test]
fn the_pipeline_is_written_down_once() {
    let processes: Vec<_> = Process::ALL.iter().map(|process| format!("Process::{process:?}")).collect();
    let words: Vec<_> = Process::ALL.iter().map(|process| format!("\"{}\"", process.word())).collect();
    let channels: Vec<_> = channels::all().map(|spec| format!("{}.spec", spec.name.to_uppercase())).collect();
    let names: Vec<_> = channels::all().map(|spec| format!("\"{}\"", spec.name)).collect();
    let mut found = Vec::new();
    for path in sources(repository(), ".rs") {
        let place = path.strip_prefix(repository()).unwrap().display().to_string();
        let is_ours =
            ["services/", "schemas/", "recordings/src", "sim/src"].iter().any(|own| place.starts_with(own));
        let is_test = place.contains("/tests");
        if !is_ours || is_test || place == "schemas/src/channels.rs" || OWN_LISTS.contains(&place.as_str()) {
            continue;
        }
        let text = read(&path);
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for list in lists(code) {
            let count = |of: &[String]| of.iter().filter(|name| list.contains(name.as_str())).count();
            let most = [count(&processes), count(&words), count(&channels), count(&names)].into_iter().max();
            if most >= Some(4) {
                found.push(format!("{place}: [{}]", list.split_whitespace().collect::<Vec<_>>().join(" ")));
            }
        }
    }
    assert!(found.is_empty(), "derive these from schemas/src/channels.rs:\n{}", found.join("\n"));
}

#[test]
fn a_list_that_stands_twice_is_seen() {
    let code =
        "const A: [&str; 4] = [\"world\", \"planner\",\n \"localizer\", \"recorder\"]; fn f() { g(&[1]) }";
    assert_eq!(lists(code).filter(|list| list.contains("\"recorder\"")).count(), 1);
}

/// What stands between brackets that hold no others.
fn lists(code: &str) -> impl Iterator<Item = &str> {
    code.split('[').skip(1).filter_map(|after| after.split(']').next())
}

/// The files below a folder whose names end so, those that are built or hidden left out.
fn sources(folder: &Path, end: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            found.extend(sources(&path, end));
        } else if name.ends_with(end) {
            found.push(path);
        }
    }
    found
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}
