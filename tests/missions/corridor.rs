//! The navigator `corridor` with separate processes keeps the guarantees for all navigators.

use serde_json::Value;
use support::Place;
use support::page::{Page, free_port, wait_for};

/// Creates a place with the corridor missions that ship with the program, shortened to their first task.
fn place(mission: &str) -> Place {
    let place = Place::with_missions("corridor", mission);
    let path = place.files().join("mission.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let second = text.match_indices("[[task]]").nth(1).map_or(text.len(), |(at, _)| at);
    std::fs::write(path, &text[..second]).unwrap();
    place
}

#[test]
fn a_mission_is_driven_replayed_rerun_judged_and_shown() {
    let place = place("corridor-a.toml");
    let recording = &place.driven("mission.toml");
    let messages = place.messages(recording);
    assert_eq!(messages["/relations"], messages["/tick"], "{messages:?}");
    for topic in ["/markers", "/people", "/rules"] {
        assert!(messages.contains_key(topic), "{topic}: {messages:?}");
    }
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert_eq!(judged.pointer("/0/verdict/tasks/0/reached"), Some(&Value::Bool(true)), "{judged}");
    let words = ["the camera's view", "a person's path", "Distance of the pair", "True speed"];
    place.page_says(recording, &words);
}

/// A page was once refused for this navigator, because everything that a page could show came from a drawing.
#[test]
fn a_page_shows_the_markers_around_the_robot() {
    let (place, port) = (place("corridor-qtc.toml"), free_port());
    let mut running = place.start(&format!("run mission.toml --speed 6 --pad --port {port} --json"));
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    page.until("a pair in words", |feed| {
        let scene = feed["scene"].as_array().map_or(&[][..], Vec::as_slice);
        let is_told =
            |words| scene.iter().any(|s| s["text"].as_str().is_some_and(|text| text.contains(words)));
        is_told(" is near, ") || is_told(" is medium, ") || is_told(" is far, ")
    });
    assert_eq!((&page.hello["mode"], &page.hello["canvas"]), (&"watches".into(), &vec![1000, 1000].into()));
    page.until_allowed("abort");
    assert_eq!(page.order("abort").0, 200);
    page.until_state("aborted");
    page.until_allowed("restore");
    assert_eq!(page.order("restore").0, 200);
    drop(page);
    let ended = running.end();
    assert_eq!((ended.code, &ended.json()["success"]), (Some(0), &Value::Bool(true)), "{ended}");
}

#[test]
fn kills_leave_the_same_bytes_with_either_method() {
    for (mission, kills) in [("corridor-a.toml", 12), ("corridor-qtc.toml", 6)] {
        place(mission).is_identical_after("mission.toml", kills, "world,localizer,planner,recorder");
    }
}

#[test]
fn errors_in_a_mission_or_rule_file_are_reported_before_the_start() {
    let place = place("corridor-qtc.toml");
    let path = place.files().join("mission.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let slow = include_str!("../../sim/robots/youbot.toml").replace("rate_hz = 30.0", "rate_hz = 3.0");
    std::fs::write(place.files().join("slow.toml"), slow).unwrap();
    let rules = include_str!("../../services/navigators/corridor/rules/qtc-b.toml");
    let with_file =
        text.replace("method = \"qtc-b\"", "method = \"qtc-b\"\nrules_file = \"mine.rules.toml\"");
    let hole = rules.replacen("    { relation = \"+,-\", left = \"right\", right = \"left\" },\n", "", 1);
    for (mission, rules, words) in [
        (text.replace("youbot", "slow.toml"), rules, "camera.rate_hz: expected 4 Hz or more"),
        (text.replace("youbot", "robotino"), rules, "[camera]"),
        (
            text.replace("metres = 7.0", "metres = 7.0\nturns = [\"left\"]"),
            rules,
            "methods with rules detect neither",
        ),
        (
            with_file.clone(),
            hole.as_str(),
            "mine.rules.toml: set 1 (qtc-b): expected a rule for relation \"+,-\", found none",
        ),
        (
            with_file.replace("mine.rules", "no.rules"),
            rules,
            "navigator.rules_file: expected a file, found none at ",
        ),
    ] {
        std::fs::write(&path, mission).unwrap();
        std::fs::write(place.files().join("mine.rules.toml"), rules).unwrap();
        let ended = place.run("run mission.toml");
        assert_eq!(ended.code, Some(2), "{words}: {ended}");
        assert!(ended.err.contains(words), "{words}: {ended}");
    }
    // The floor is checked too. The robot once drove towards a marker that did not exist until its time ran out.
    let floor = text.split('"').find(|word| word.ends_with(".floor.toml")).unwrap();
    let plan = std::fs::read_to_string(place.files().join(floor)).unwrap();
    std::fs::write(place.files().join("bare.floor.toml"), plan.split("[[marker]]").next().unwrap()).unwrap();
    let ours = text.replace("method = \"qtc-b\"", "method = \"corridor\"");
    for (mission, words) in [
        (
            text.replace(floor, "bare.floor.toml"),
            "expected a floor with two [[marker]] tables or more for method = \"qtc-b\", found 0",
        ),
        (
            ours.replace("metres = 7.0", "marker = 999"),
            ".marker: expected the number of a marker of the floor, found 999; it has 1, 2",
        ),
    ] {
        std::fs::write(&path, mission).unwrap();
        let ended = place.run("run mission.toml");
        assert!(ended.code == Some(2) && ended.err.contains(words), "{words}: {ended}");
    }
    // The robot drives with a complete rule file of the user's own.
    std::fs::write(&path, with_file).unwrap();
    std::fs::write(place.files().join("mine.rules.toml"), rules).unwrap();
    place.fine("run mission.toml --json");
}
