//! The pad's page, in a real browser on the running system: a person draws a mission's map and path with
//! a pen, sends both, executes, aborts, restores, and the robot arrives.
//!
//! Needs node; the browser test needs chromium and playwright-core, too (`.ci/run` installs them): the
//! folder that holds `node_modules` is `SKETCHNAV_PLAYWRIGHT`, or `target/browser`; the browser is
//! `SKETCHNAV_CHROMIUM`, or `/usr/bin/chromium`. Skipped with a notice without them.

mod support;

use std::env::var_os;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use nix::sys::signal::Signal;
use serde_json::Value;
use sketchnav_schemas::mission::Mission;
use sketchnav_sketcher::{Options, read};
use support::{Ended, Place, Running, repository, skipped};

/// The mission whose drawing and route the pen follows.
const MISSION: &str = "sim/missions/routes/court-01";
/// How long the browser may take in all: longer than any wait in the script.
const LIMIT: Duration = Duration::from_secs(420);

fn has_node() -> bool {
    let found = Command::new("node").arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        skipped("browser", "no node");
    }
    found
}

/// The folder of playwright-core and the browser.
fn browser() -> Option<(PathBuf, PathBuf)> {
    let folder =
        var_os("SKETCHNAV_PLAYWRIGHT").map_or_else(|| repository().join("target/browser"), PathBuf::from);
    let chromium = var_os("SKETCHNAV_CHROMIUM").map_or_else(|| "/usr/bin/chromium".into(), PathBuf::from);
    let found = folder.join("node_modules/playwright-core").is_dir() && chromium.exists();
    if !found {
        skipped("browser", "no playwright-core (SKETCHNAV_PLAYWRIGHT) or no chromium (SKETCHNAV_CHROMIUM)");
    }
    found.then_some((folder, chromium))
}

#[test]
fn the_modules_of_the_page_hold_by_themselves() {
    if !has_node() {
        return;
    }
    let folder = fs::read_dir(repository().join("tests/pad")).unwrap();
    let mut tests: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
    tests.retain(|path| path.to_string_lossy().ends_with(".test.mjs"));
    tests.sort();
    assert!(tests.len() >= 3, "{tests:?}");
    let ended: Ended = Command::new("node").arg("--test").args(tests).output().unwrap().into();
    assert_eq!(ended.code, Some(0), "{ended}");
}

#[test]
fn a_person_with_a_pen_draws_sends_drives_stops_and_arrives() {
    if !has_node() {
        return;
    }
    let Some((playwright, chromium)) = browser() else { return };
    let place = Place::new();
    let (mut pad, link) = pad(&place);
    place.wait_until_joined(&mut pad, "pad", &["pad"]);
    let route = place.files().join("route.json");
    fs::write(&route, serde_json::to_vec(&mission().task[0].route).unwrap()).unwrap();

    let mut script = Command::new("node");
    script.arg(repository().join("tests/pad/browser.mjs")).arg(link);
    script.arg(repository().join(format!("{MISSION}.json"))).arg(route).arg(place.files());
    script.env("SKETCHNAV_PLAYWRIGHT", playwright).env("SKETCHNAV_CHROMIUM", chromium);
    script.env("SKETCHNAV_PAD_PID", place.pid("pad", "pad").to_string());
    script.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let ended = Running::spawn(script).end_within(LIMIT);
    assert_eq!(ended.code, Some(0), "{ended}");
    // For people: what the test's browser has measured.
    eprintln!("{}", ended.out.trim());
    keep_pictures(place.files());

    pad.must_live();
    the_localizer_has_what_was_drawn(&place);
    pad.signal(Signal::SIGINT);
    pad.end();
    place.assert_nothing_left("pad");
}

fn mission() -> Mission {
    let file = repository().join(format!("{MISSION}.toml"));
    Mission::parse(&fs::read_to_string(file).unwrap()).unwrap()
}

/// Starts the pad in the mission's world and hands back the link that it prints.
fn pad(place: &Place) -> (Running, String) {
    let file = repository().join(format!("{MISSION}.toml"));
    let options = "--port 0 --system pad --out results --speed 1";
    let mut command = place.command(&format!("pad --mission {} {options}", file.display()));
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let link = lines.by_ref().map_while(Result::ok).find_map(|line| {
        let at = line.find("http://")?;
        line[at..].split_whitespace().next().map(str::to_owned)
    });
    // Its output is read on, so that it never waits for a reader.
    std::thread::spawn(move || lines.for_each(drop));
    (Running::of(child), link.expect("the pad's link"))
}

/// The cells on the channel are those that the drawing, as the page saves it, is read as.
fn the_localizer_has_what_was_drawn(place: &Place) {
    let heard = place.run("echo sketch --count 1 --system pad").json();
    let grid = &heard["message"]["grid"];
    let mission = mission();
    let options = Options::of_mission(&mission, 1).unwrap();
    let drawing = read(&fs::read(place.files().join("sent.json")).unwrap(), "sent.json", &options).unwrap();
    assert_eq!(grid["info"]["width"], drawing.width_px, "{}", grid["info"]);
    assert_eq!(grid["info"]["height"], drawing.height_px, "{}", grid["info"]);
    let cells = grid["data"].as_array().unwrap();
    let same = |(sent, cell): (&Value, &u8)| sent.as_i64() == Some(i64::from(*cell));
    assert!(cells.len() == drawing.cells.len() && cells.iter().zip(&drawing.cells).all(same));
}

/// Screenshots for people, where `SKETCHNAV_PICTURES` names a folder.
fn keep_pictures(from: &Path) {
    let Some(folder) = var_os("SKETCHNAV_PICTURES").map(PathBuf::from) else { return };
    for name in ["desktop.png", "phone.png", "arrived.png"] {
        fs::copy(from.join(name), folder.join(name)).unwrap();
    }
}
