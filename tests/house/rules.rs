//! House rules that no compiler checks: which crate may depend on which, and that every list is written down only once.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use support::repository;

use crate::graph::{Manifest, dependencies, reached};

/// Returns the crates in a folder of the repository, except for a crate of the folder itself.
fn crates_in(folder: &str) -> Vec<Manifest> {
    let folder = repository().join(folder);
    let found: Vec<_> =
        Manifest::members().filter(|crate_| crate_.folder.parent() == Some(&folder)).collect();
    assert!(found.len() > 1, "the test sees what is there: {}", folder.display());
    found
}

/// Returns the crates that must not depend on processes, networks, recordings or physics.
fn pure() -> Vec<Manifest> {
    let schemas = Manifest::read(Path::new("schemas"));
    [vec![schemas], crates_in("services/libraries"), crates_in("services/navigators")]
        .into_iter()
        .flatten()
        .collect()
}

/// The crates that a pure crate must not depend on, directly or indirectly.
const IMPURE: [&str; 7] = ["iceoryx2", "axum", "tokio", "mcap", "rapier2d", "nix", "sketchnav-runtime"];

#[test]
fn pure_crates_reach_no_process_no_network_no_recording_and_no_physics() {
    let all = dependencies();
    for pure in pure().iter().map(Manifest::name) {
        let reached = reached(&pure, &all);
        let found: Vec<_> = IMPURE.iter().filter(|impure| reached.contains(**impure)).collect();
        assert!(found.is_empty(), "{pure} reaches {found:?}");
    }
    let runtime = reached("sketchnav-runtime", &all);
    assert!(runtime.contains("iceoryx2"), "the test sees what is there");
}

/// `cargo run` builds all default members. The live view used to be one of them, so a fresh clone compiled 45 more
/// crates than it needed.
#[test]
fn a_crate_behind_a_feature_of_the_program_is_no_default_member() {
    let program = Manifest::read(Path::new(""));
    let members: BTreeSet<_> =
        program.default_members().into_iter().map(|at| Manifest::read(&at).name()).collect();
    let optional =
        program.dependencies(|table| table.get("optional").is_some_and(|it| it.as_bool() == Some(true)));
    assert!(
        optional.contains("sketchnav-view") && members.contains("sketchnav-sim"),
        "the test sees what is there"
    );
    let both: Vec<_> = optional.intersection(&members).collect();
    assert!(both.is_empty(), "{both:?}: take it out of default-members");
}

/// If a library has to be replaced some day, only one crate needs to change.
#[test]
fn each_library_of_the_edge_has_one_crate_that_depends_on_it() {
    let homes = [
        ("iceoryx2", "sketchnav-runtime"),
        ("axum", "sketchnav-pad"),
        ("mcap", "sketchnav-recordings"),
        ("rapier2d", "sketchnav-sim"),
        ("foxglove", "sketchnav-view"),
        ("ros2-client", "sketchnav-ros2"),
        ("zenoh", "sketchnav-ros2"),
        ("pyo3", "sketchnav-python"),
    ];
    let manifests: Vec<_> = Manifest::members().collect();
    for (library, home) in homes {
        let users = manifests.iter().filter(|manifest| manifest.dependencies(|_| true).contains(library));
        assert_eq!(users.map(Manifest::name).collect::<Vec<_>>(), [home], "{library}");
    }
}

/// A crate without examples in its documentation sets `doctest = false`, because it takes rustdoc a second per crate to
/// find that there are none.
#[test]
fn crates_test_their_documentation_where_it_has_examples() {
    for manifest in Manifest::members().filter(|manifest| manifest.folder.join("src").is_dir()) {
        let of_sources =
            sources(&manifest.folder.join("src"), ".rs").iter().any(|file| has_example(&read(file)));
        let shows_readme =
            read(&manifest.folder.join("src/lib.rs")).contains("include_str!(\"../README.md\")");
        let has_examples =
            of_sources || shows_readme && read(&manifest.folder.join("README.md")).contains("```rust");
        assert_eq!(manifest.tests_its_documentation(), has_examples, "{}: doctest", manifest.name());
    }
}

/// Returns true if a source file has a block of Rust code in a doc comment.
fn has_example(source: &str) -> bool {
    let comments = source
        .lines()
        .map(str::trim)
        .filter_map(|line| line.strip_prefix("///").or(line.strip_prefix("//!")));
    let mut fences = comments.filter_map(|line| line.trim().strip_prefix("```"));
    std::iter::from_fn(|| Some((fences.next()?, fences.next())))
        .any(|(open, _)| matches!(open, "" | "rust" | "no_run"))
}

/// Programs that a machine may lack are requested through `needs`, which lists all of them. The project itself calls no
/// other programs, except the reader's pager.
#[test]
fn only_listed_programs_are_called() {
    let mut found = Vec::new();
    for path in sources(repository(), ".rs") {
        let place = path.strip_prefix(repository()).unwrap().display().to_string();
        for (line, number) in read(&path).lines().zip(1..) {
            let by_name = line.split("Command::new(\"").nth(1).and_then(|after| after.split('"').next());
            let by_name =
                by_name.filter(|name| !needs::COREUTILS.contains(name) && !line.contains("clap::Command"));
            let asked = line.split("needs::program(\"").nth(1).and_then(|after| after.split('"').next());
            let is_unknown = asked.is_some_and(|name| !needs::PROGRAMS.contains(&name));
            if place != "tests/house/rules.rs" && (by_name.is_some() || is_unknown) {
                found.push(format!("{place}:{number}: {}", line.trim()));
            }
        }
    }
    assert!(found.is_empty(), "call it by needs::program:\n{}", found.join("\n"));
}

/// A navigator can be understood, changed and removed without looking at the others.
#[test]
fn no_navigator_imports_another() {
    let all = dependencies();
    let crates: Vec<_> = crates_in("services/navigators").iter().map(Manifest::name).collect();
    for navigator in &crates {
        let reached = reached(navigator, &all);
        let others: Vec<_> = crates.iter().filter(|other| reached.contains(other.as_str())).collect();
        assert!(others.is_empty(), "{navigator} imports {others:?}");
    }
}

/// Files of the command line that serve a single kind of navigator. They learn from a drive, import a
/// log with its map, print the states of a route, or print what a map-maker derives. `lib.rs` contains the library's
/// documentation.
const MADE_FOR_ONE_KIND: [&str; 6] = [
    "services/cli/src/directions.rs",
    "services/cli/src/landmarks.rs",
    "services/cli/src/lib.rs",
    "services/cli/src/recordings/args.rs",
    "services/cli/src/recordings/import.rs",
    "services/cli/src/recordings/learn.rs",
];

/// Everything that pages, viewers and reports show about a navigator comes from the navigator itself. Removing a
/// navigator therefore changes none of these.
#[test]
fn no_process_and_no_host_names_a_kind_of_navigator() {
    const FOLDERS: [&str; 10] = [
        "schemas/src",
        "services/cli/src",
        "services/pad/src",
        "services/view/src",
        "services/ros2/src",
        "services/runtime/src",
        "services/rehearsal/src",
        "services/recorder/src",
        "services/supervisor/src",
        "services/world/src",
    ];
    let words = words_of_kinds();
    assert!(words.contains("ESTIMATE") && words.contains("\"corridor\""), "the test sees what is there");
    let (mut found, mut made_for_one) = (Vec::new(), BTreeSet::new());
    for path in FOLDERS.iter().flat_map(|folder| sources(&repository().join(folder), ".rs")) {
        let (text, place) = (read(&path), place_of(&path));
        // Tests may use a kind as an example.
        let code = text.split("#[cfg(test)]").next().filter(|_| !path.ends_with("tests.rs"));
        let lines = code.unwrap_or_default().lines().filter(|line| {
            // A frame and a kind of drawing have the same name as the kind of navigator.
            !line.trim_start().starts_with("//")
                && !line.contains("in \"sketch\"")
                && !line.contains("Sketch = 1")
        });
        let tokens = lines.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && !"_\"".contains(c)));
        for token in tokens.filter(|token| words.contains(*token)) {
            match MADE_FOR_ONE_KIND.contains(&place.as_str()) {
                true => drop(made_for_one.insert(place.clone())),
                false => found.push(format!("{place}: {token}")),
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
    let listed = MADE_FOR_ONE_KIND.iter().filter(|place| !place.ends_with("lib.rs"));
    let idle: Vec<_> = listed.filter(|place| !made_for_one.contains(**place)).collect();
    assert!(idle.is_empty(), "they name none any longer: {idle:?}");
}

/// Returns the words that name a kind of navigator: its name, its crate and its channels.
fn words_of_kinds() -> BTreeSet<String> {
    let of_kinds = sketchnav_navigators::all().flat_map(|navigator| navigator.channels);
    let mut words: BTreeSet<_> = of_kinds.map(|spec| spec.name.to_uppercase()).collect();
    for navigator in crates_in("services/navigators").iter().map(Manifest::name) {
        let kind = navigator.trim_start_matches("sketchnav-");
        words.extend([format!("\"{kind}\""), format!("sketchnav_{kind}")]);
    }
    words
}

/// Returns a path relative to the repository.
fn place_of(path: &Path) -> String {
    path.strip_prefix(repository()).unwrap().display().to_string()
}

/// In each pure crate, clippy forbids clocks, threads, opening files, and maps without an order.
#[test]
fn clippy_guards_pure_crates() {
    for pure in pure() {
        let guard = pure.folder.join("clippy.toml");
        assert!(guard.exists(), "expected {}", guard.display());
        assert!(read(&guard).contains("std::time::Instant::now"), "{}", guard.display());
    }
}

/// Setting the machine's clock must not affect a mission. Half-made files in shared memory were once recognized by their
/// modification times.
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

/// People and programs see the table of channels itself.
#[test]
fn the_command_line_shows_the_actual_pipeline() {
    let place = support::Place::new();
    let shown = place.run("channels --json").json();
    sketchnav_navigators::register(&[]).unwrap();
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

/// Files with a list of channels other than the pipeline: the channels that the judge reads from a recording, and the one
/// that each sensor of a robot writes.
const OWN_LISTS: [&str; 2] = ["services/lab/src/judge/log.rs", "schemas/src/robot.rs"];

/// A second copy of a list of processes or channels becomes wrong when an entry is added. The graph was once written down in about
/// twelve places.
#[test]
fn the_pipeline_is_written_down_once() {
    let processes: Vec<_> = Process::ALL.iter().map(|process| format!("Process::{process:?}")).collect();
    let words: Vec<_> = Process::ALL.iter().map(|process| format!("\"{}\"", process.word())).collect();
    sketchnav_navigators::register(&[]).unwrap();
    let channels: Vec<_> = channels::all().map(|spec| format!("{}.spec", spec.name.to_uppercase())).collect();
    let names: Vec<_> = channels::all().map(|spec| format!("\"{}\"", spec.name)).collect();
    let mut found = Vec::new();
    for path in sources(repository(), ".rs") {
        let place = path.strip_prefix(repository()).unwrap().display().to_string();
        let is_ours =
            ["services/", "schemas/", "recordings/src", "sim/src"].iter().any(|own| place.starts_with(own));
        let is_test = place.contains("/tests");
        let is_declared = place.ends_with("/messages.rs");
        if !is_ours
            || is_test
            || is_declared
            || place == "schemas/src/channels.rs"
            || OWN_LISTS.contains(&place.as_str())
        {
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
fn a_duplicate_list_is_detected() {
    let code =
        "const A: [&str; 4] = [\"world\", \"planner\",\n \"localizer\", \"recorder\"]; fn f() { g(&[1]) }";
    assert_eq!(lists(code).filter(|list| list.contains("\"recorder\"")).count(), 1);
}

/// Returns the contents of the innermost brackets.
fn lists(code: &str) -> impl Iterator<Item = &str> {
    code.split('[').skip(1).filter_map(|after| after.split(']').next())
}

/// Returns the files below a folder whose names end with `end`, except for build outputs and hidden files.
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
