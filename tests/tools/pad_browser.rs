//! The pad's page in a real browser, with a running system. A person draws a mission's map and path with a pen, sends
//! both, executes, aborts and restores, and the robot arrives.
//!
//! These tests need node. The browser test also needs chromium and playwright-core (`.ci/run` installs them).
//! `SKETCHNAV_PLAYWRIGHT` names the folder that contains `node_modules`, by default `target/browser`, and
//! `SKETCHNAV_CHROMIUM` names the browser, by default `/usr/bin/chromium`. Without them, the tests print a notice and
//! are skipped.

use std::env::var_os;
use std::fs;
use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use sketchnav_schemas::mission::Mission;
use sketchnav_sketch::learned::{DrawingFile, Learned};
use sketchnav_sketch::reading::{Options, read};
use support::arms::doubtful;
use support::browser::{Browser, MISSION, mission, pad, pad_in};
use support::page::{TOKEN, free_port, wait_for};
use support::{Ended, Place, repository};

#[test]
fn the_modules_of_the_page_pass_their_own_tests() {
    let Some(mut node) = needs::program("node") else { return };
    let folder = fs::read_dir(repository().join("tests/pad")).unwrap();
    let mut tests: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
    tests.retain(|path| path.to_string_lossy().ends_with(".test.mjs"));
    tests.sort();
    assert!(tests.len() >= 3, "{tests:?}");
    let ended: Ended = node.arg("--test").args(tests).output().unwrap().into();
    assert_eq!(ended.code, Some(0), "{ended}");
}

#[test]
fn a_person_with_a_pen_draws_sends_drives_stops_and_arrives() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    let ended = browser.draws_and_drives(&place, &link, 3);
    assert_eq!(ended.code, Some(0), "{ended}");
    // The measurements of the test's browser, for people to read.
    eprintln!("{}", ended.out.trim());
    keep_pictures(place.files(), &["desktop.png", "phone.png", "arrived.png"]);

    pad.must_live();
    the_localizer_has_the_drawing(&place);
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// Whatever is drawn can be selected, moved, scaled, turned, copied, grouped, aligned and edited point by point, and each step
/// can be undone.
#[test]
fn drawings_are_edited_by_mouse_pen_touch_and_keyboard() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    let ended = browser.selects(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_looks(place.files(), &["select"]);

    pad.must_live();
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// No drawing is lost when a page is closed, the browser is killed or the server ends; the library lists them all.
#[test]
fn drawings_are_kept_in_a_library_with_and_without_the_server() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    let ended = browser.keeps(&place, &link, "draws");
    assert_eq!(ended.code, Some(0), "{ended}");
    pad.must_live();
    pad.signal(Signal::SIGINT);
    pad.end();
    let ended = browser.keeps(&place, &link, "offline");
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_pictures(
        place.files(),
        &["wide", "phone-light", "phone-dark", "offline"].map(|look| format!("library-{look}.png")),
    );
    place.assert_nothing_left("pad");
}

/// Drawings can be dropped, pasted or opened, whichever program made them, and nothing in them is run. An SVG that the page saves
/// has the walls of the drawing for every reader.
#[test]
fn drawings_are_exchanged_with_other_programs() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    let ended = browser.exchanges(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    let options = Options::of_mission(&mission(), 1).unwrap();
    let walls = |name: &str| {
        let bytes = fs::read(place.files().join(name)).unwrap();
        read(&bytes, name, &options).unwrap()
    };
    let [svg, strokes] = ["exported.svg", "exported.json"].map(walls);
    assert_eq!((svg.width_px, svg.height_px), (strokes.width_px, strokes.height_px));
    let different = svg.cells.iter().zip(&strokes.cells).filter(|(a, b)| a != b).count();
    let solid = strokes.cells.iter().filter(|cell| **cell > 50).count();
    assert!(solid > 10_000 && different < solid / 20, "{different} of {solid} cells differ");
    pad.must_live();
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// Ways through walls, closed rooms and rooms that look alike are marked on the drawing until it is corrected.
#[test]
fn drawings_are_checked_before_a_robot_drives_by_them() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    let ended = browser.checks(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_looks(place.files(), &["checks"]);
    pad.must_live();
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// During a drive, the page shows the corrected drawing as it grows, and after it the robot's map over the drawing. Once a
/// person accepts it, the robot drives by it without a mark, from wherever it stands.
#[test]
fn what_the_robot_has_learned_is_accepted_driven_by_and_rejected() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad_in(&place, "sim/missions/building/building-a", 2);
    let ended = browser.learns(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_looks(place.files(), &["growing", "learned", "again"]);
    pad.must_live();
    let saved = |name: &str| fs::read(place.files().join(name)).unwrap();
    let learned = Learned::parse(&saved("again.learned")).unwrap();
    assert!(
        learned.drawing.is_same(&DrawingFile::of("again.json", &saved("again.json"))),
        "{:?}",
        learned.drawing
    );
    assert_eq!(learned.goals.iter().map(|goal| goal.reached).collect::<Vec<_>>(), [true, true]);
    let mission = String::from_utf8(saved("again.toml")).unwrap();
    assert!(mission.contains("learned_file = \"again.learned\""), "{mission}");
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// Somebody draws a hall and a goal in it, but does not mark where the robot stands.
#[test]
fn a_robot_without_a_start_mark_finds_out_where_it_is() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad_in(&place, "sim/missions/hall/hall-unmarked", 4);
    let ended = browser.finds_the_start(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_pictures(place.files(), &["unmarked-driving.png", "unmarked-arrived.png"]);
    pad.must_live();
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// A robot follows a route past landmarks that was drawn on the page, and gets lost because the route ends in open space. A person
/// chooses one of the places that it offers, then taps its position, adds an object that was missing from the map, and draws the
/// rest of the route, which leads it to the goal.
#[test]
fn a_route_past_landmarks_is_corrected_and_drawn_on_from_where_the_robot_stands() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad_in(&place, "sim/missions/landmarks/pad", 4);
    let ended = browser.passes_landmarks(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_pictures(place.files(), &["landmarks-lost.png", "landmarks-corrected.png", "landmarks-arrived.png"]);
    pad.must_live();
    let saved = fs::read_to_string(place.files().join("past-the-table.toml")).unwrap();
    let saved = Mission::parse(&saved).unwrap();
    let given = &saved.navigator.given;
    assert_eq!(given["drawing"].as_str(), Some("past-the-table.json"), "{saved:?}");
    assert!(given["route"].as_array().is_some_and(|route| route.len() > 2), "{saved:?}");
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// The page draws where the robot may be. A tap on one of these places, or on its button, is an answer.
#[test]
fn a_question_is_answered_by_a_tap_and_by_a_button() {
    let Some(browser) = Browser::find() else { return };
    let (place, port) = (doubtful(), free_port());
    let mut running =
        place.start(&format!("run arms.toml --pad --port {port} --system asks --speed 2 --json"));
    wait_for(&mut running, port);
    let ended = browser.answers(&place, &format!("http://127.0.0.1:{port}/?token={TOKEN}"));
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_pictures(place.files(), &["asks.png", "asks-again.png"]);
    running.end();
    place.assert_nothing_left("asks");
}

/// Regression test: a page lost the wheel only if its link was lost. Now, a person who watches can ask for it.
#[test]
fn the_wheel_is_handed_over_while_the_robot_drives() {
    let Some(browser) = Browser::find() else { return };
    let (place, port) = (Place::new(), free_port());
    let mission = repository().join("sim/missions/building/building-a.toml");
    let mut running = place
        .start(&format!("run {} --pad --port {port} --system handed --speed 1 --json", mission.display()));
    wait_for(&mut running, port);
    let ended = browser.hands_over(&place, &format!("http://127.0.0.1:{port}/?token={TOKEN}"));
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_looks(place.files(), &["may-ask", "asked", "asks"]);
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("handed");
}

/// Several people draw in one drawing, one of them without a link for a while. One sends the map, another drives by it.
#[test]
fn several_people_draw_at_once_and_one_of_them_drives() {
    let Some(browser) = Browser::find() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    let ended = browser.draws_together(&place, &link);
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_looks(place.files(), &["together", "together-choice"]);
    pad.must_live();
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

/// Checks what the page of a study measures about the pen, and what it stores.
#[test]
fn a_participant_completes_a_session_and_the_next_can_begin() {
    let Some(browser) = Browser::find() else { return };
    let (place, port) = (Place::new(), free_port());
    let mission = repository().join(format!("{MISSION}.toml"));
    let options = format!("--port {port} --system study --study kept --speed 2");
    let mut running = place.start(&format!("pad --mission {} {options}", mission.display()));
    wait_for(&mut running, port);
    let ended = browser.takes_part(&place, &format!("http://127.0.0.1:{port}/?token={TOKEN}"));
    assert_eq!(ended.code, Some(0), "{ended}");
    keep_pictures(
        place.files(),
        &["study-begin.png", "study-drawn.png", "study-answers.png", "study-thanks.png"],
    );

    let record = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(place.files().join("kept").join(name)).unwrap()).unwrap()
    };
    let drawn: Value = record("p-1/drawing-1.json");
    let count = |key: &str| drawn[key].as_array().map_or(0, Vec::len) as u64;
    let measures = &record("p-1/drive.json")["measures"];
    let strokes = measures["strokes"].as_u64().unwrap();
    assert_eq!(
        strokes,
        count("strokes") + count("obstacles") + 1,
        "with the one that was undone: {measures}"
    );
    assert_eq!((&measures["undone"], &measures["erased"]), (&json!(1), &json!(0)), "{measures}");
    assert!(measures["drawing_s"].as_f64().unwrap() > 0.0 && measures["screen"] == "landscape", "{measures}");
    let answers = record("p-1/answers.json");
    assert_eq!((&answers["ratings"]["intuitive"], &answers["ratings"]["editing"]), (&json!(1), &json!(1)));
    assert_eq!(answers["suggestions"], "more colours");
    assert_eq!(record("p-2/participant.json")["sheet"], "portrait");
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("study");
}

/// Asserts that the cells on the channel are those that result from reading the drawing as the page saves it.
fn the_localizer_has_the_drawing(place: &Place) {
    let echoed = place.run("echo sketch --count 1 --system pad").json();
    let grid = &echoed["message"]["grid"];
    let mission = mission();
    let options = Options::of_mission(&mission, 1).unwrap();
    let drawing = read(&fs::read(place.files().join("sent.json")).unwrap(), "sent.json", &options).unwrap();
    assert_eq!(grid["info"]["width"], drawing.width_px, "{}", grid["info"]);
    assert_eq!(grid["info"]["height"], drawing.height_px, "{}", grid["info"]);
    let cells = grid["data"].as_array().unwrap();
    let same = |(sent, cell): (&Value, &u8)| sent.as_i64() == Some(i64::from(*cell));
    assert!(cells.len() == drawing.cells.len() && cells.iter().zip(&drawing.cells).all(same));
}

/// Keeps the pictures of these scenes in all looks: on a wide page and on a phone, each light and dark.
fn keep_looks(folder: &Path, scenes: &[&str]) {
    let looks = ["wide-light", "wide-dark", "phone-light", "phone-dark"];
    let of_scene = |scene: &&str| looks.map(|look| format!("{scene}-{look}.png"));
    keep_pictures(folder, &scenes.iter().flat_map(of_scene).collect::<Vec<_>>());
}

/// Keeps screenshots for people to look at, if `SKETCHNAV_PICTURES` names a folder.
fn keep_pictures(from: &Path, names: &[impl AsRef<Path>]) {
    let Some(folder) = var_os("SKETCHNAV_PICTURES").map(PathBuf::from) else { return };
    for name in names {
        fs::copy(from.join(name), folder.join(name.as_ref())).unwrap();
    }
}
