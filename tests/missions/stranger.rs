//! A third-party navigator is a single file. Once it is registered, everything in the project works with it.

use nix::sys::signal::Signal;
use serde_json::Value;
use support::page::{Page, free_port, wait_for};
use support::room::ALONG_THE_WALL;
use support::{Place, room};

/// Creates a place where `sketchnav` is the program with that navigator.
fn place() -> Place {
    let place = Place::of_program("wall_follower");
    room::write(place.files());
    std::fs::write(place.files().join("wall.toml"), ALONG_THE_WALL).unwrap();
    place
}

fn driven(place: &Place) -> String {
    let report = place.fine("run wall.toml --out out --json").json();
    assert_eq!((&report["lost_messages"], report["tasks"].as_array().map(Vec::len)), (&0.into(), Some(2)));
    report["recording"].as_str().unwrap().to_owned()
}

#[test]
fn a_stranger_drives_a_mission_that_is_replayed_rerun_and_judged() {
    let place = place();
    let recording = driven(&place);
    let info = place.fine(&format!("info {recording} --json")).json();
    let topics = info["topics"].as_array().unwrap();
    let messages = |name: &str| topics.iter().find(|t| t["topic"] == name).map(|t| t["messages"].clone());
    assert!(messages("/walls").is_some() && messages("/walls") == messages("/tick"), "{info}");
    assert_eq!(messages("/estimate"), None, "what belongs to drawings is not there");
    place.is_reproduced(&recording, &["world", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert!(judged.to_string().contains("\"reached\":true"), "{judged}");
    assert_eq!(judged[0]["method"], "wall-follower", "{judged}");
    let nearest = judged[0]["account"]["nearest wall on the right"].as_str().unwrap();
    assert!(nearest.ends_with(" m") && !nearest.starts_with("inf"), "{nearest}");
    place.fine(&format!("report {recording} -o report.html"));
    let page = std::fs::read_to_string(place.files().join("report.html")).unwrap();
    assert!(
        page.contains("nearest wall on the right") && page.contains("Distance of the wall"),
        "its account"
    );
}

/// The sketcher is not killed, because it sends nothing and so its recovery could not be observed.
#[test]
fn twenty_kills_leave_the_same_bytes() {
    let place = place();
    let output =
        place.fine("chaos wall.toml --kills 20 --targets world,localizer,planner,recorder --json").json();
    assert_eq!(output["identical"], true, "{output}");
}

#[test]
fn errors_in_its_mission_are_reported_before_the_start() {
    let place = place();
    let path = place.files().join("wall.toml");
    // An unknown key was once silently ignored.
    for (seconds, error) in [
        ("", ": missing field `seconds`"),
        ("seconds = \"long\"\n", ".seconds: invalid type: string \"long\", expected a number"),
        ("seconds = 40\ncolour = \"red\"\n", ": unknown field `colour`, expected `seconds`"),
    ] {
        std::fs::write(&path, ALONG_THE_WALL.replace("seconds = 40\n", seconds)).unwrap();
        let ended = place.run("run wall.toml");
        assert_eq!(ended.code, Some(2), "{ended}");
        assert!(ended.err.contains("task 2 (") && ended.err.contains(error), "{ended}");
    }
    let path_words = |text: &str| text.replace("[[task]]", "colour = \"red\"\n[[task]]");
    std::fs::write(&path, path_words(ALONG_THE_WALL)).unwrap();
    let ended = place.run("run wall.toml");
    assert!(ended.code == Some(2) && ended.err.contains("navigator: unknown field `colour`"), "{ended}");
    std::fs::write(&path, ALONG_THE_WALL.replace("nomad200", "robotino")).unwrap();
    let ended = place.run("run wall.toml");
    assert!(ended.code == Some(2) && ended.err.contains("[sonar]"), "{ended}");
    // The project's own program does not contain this navigator, and lists those that it does contain.
    let ours = Place::new();
    std::fs::write(ours.files().join("wall.toml"), ALONG_THE_WALL).unwrap();
    room::write(ours.files());
    let ended = ours.run("run wall.toml");
    assert!(ended.code == Some(2) && ended.err.contains("expected one of sketch"), "{ended}");
}

/// The pad used to start anyway, and ended with an error of the shared memory library about a missing channel.
#[test]
fn people_can_watch_it_but_not_draw_for_it() {
    let place = place();
    let ended = place.run("pad --mission wall.toml --system walls");
    assert_eq!(ended.code, Some(2), "{ended}");
    for words in
        ["navigator.kind: expected a mission of kind ", "\"sketch\"", "found kind \"wall-follower\"", "--pad"]
    {
        assert!(ended.err.contains(words), "{words}: {ended}");
    }
    place.assert_nothing_left("walls");
    let port = free_port();
    let mut running = place.start(&format!("run wall.toml --system walls --speed 1 --pad --port {port}"));
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    let lines = |feed: &Value, color: &str| {
        let scene = feed["scene"].as_array().map_or(&[][..], Vec::as_slice);
        scene.iter().filter(|shape| shape["shape"] == "line" && shape["color"] == color).count()
    };
    page.until("echoes and both walls", |feed| lines(feed, "scan") > 0 && lines(feed, "obstacle") == 2);
    drop(page);
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("walls");
}
