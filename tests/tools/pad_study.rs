//! A user study with its whole system and consecutive participants, over real sockets. The study's folder records the progress of
//! each of them.

use std::fs;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use nix::sys::signal::Signal;
use serde_json::{Value, json};
use sketchnav_sketch::mission::SketchMission;
use support::browser::{MISSION, mission};
use support::page::{Page, body, free_port, wait_for};
use support::{Place, Running, repository, wait_until};

/// The time between two checks whether the next participant can begin.
const PAUSE: Duration = Duration::from_millis(200);

/// A running study.
struct Study {
    place: Place,
    running: Running,
    port: u16,
}

impl Study {
    fn start(place: Place) -> Self {
        let port = free_port();
        let mission = repository().join(format!("{MISSION}.toml"));
        let options = format!("--port {port} --system study --study kept --speed 2");
        let mut running = place.start(&format!("pad --mission {} {options}", mission.display()));
        wait_for(&mut running, port);
        Self { place, running, port }
    }

    /// Opens a page that has control and is waiting for a participant.
    fn page(&mut self) -> Page {
        let mut found = None;
        wait_until("a page for the next participant", || {
            self.running.must_live();
            found =
                Page::try_open(self.port, None).ok().filter(|page| page.hello["study"]["stage"] == "welcome");
            // A page that is opened too often is not let in.
            sleep(if found.is_some() { Duration::ZERO } else { PAUSE });
            found.is_some()
        });
        let mut page = found.unwrap();
        assert_eq!(page.hello["drives"], true);
        // A machine that is busy for a while must not count as a lost link.
        page.must("/api/limit", &json!({ "link_limit_s": 60 }));
        page.until_state("no-sketch");
        page
    }

    fn kept(&self, name: &str) -> PathBuf {
        self.place.files().join("kept").join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.kept(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Ends the study as a person would.
    fn end(self) -> Place {
        self.running.signal(Signal::SIGINT);
        let ended = self.running.end();
        assert_eq!(ended.code, Some(0), "{ended}");
        self.place.assert_nothing_left("study");
        self.place
    }
}

fn post(page: &Page, body: &Value) -> u16 {
    page.post("/api/study", body.to_string().as_bytes()).0
}

fn until_stage(page: &mut Page, stage: &str) {
    while page.hello["study"]["stage"] != stage {
        page.read();
    }
}

fn strokes() -> Vec<u8> {
    fs::read(repository().join(format!("{MISSION}.json"))).unwrap()
}

fn route() -> Value {
    json!({ "route": SketchMission::of(&mission()).unwrap().tasks[0].aim.route().unwrap() })
}

fn measures() -> Value {
    json!({ "measures": {
        "drawing_s": 95.5, "path_s": 4.25, "strokes": 14, "undone": 2, "erased": 1, "screen": "landscape",
    } })
}

/// Gives the same answer to every question.
fn answers(page: &Page, rating: u8) -> Value {
    let statements = page.hello["study"]["statements"].as_array().unwrap();
    let ratings =
        statements.iter().map(|statement| (statement["key"].as_str().unwrap().to_owned(), json!(rating)));
    json!({ "answers": { "ratings": ratings.collect::<serde_json::Map<_, _>>(), "suggestions": "more, \"colours\"" } })
}

/// Draws and sends the drawing, and waits until the robot is ready to drive.
fn draw(page: &mut Page) {
    page.until_allowed("sketch");
    let (status, answer) = page.post("/api/sketch", &strokes());
    assert_eq!(status, 200, "{answer}");
    page.must("/api/path", &route());
    page.until_allowed("execute");
}

#[test]
fn participants_follow_each_other_and_everything_is_kept() {
    let mut study = Study::start(Place::new());
    let mut page = study.page();
    assert_eq!(page.post("/api/sketch", &strokes()).0, 409, "no participant yet");
    assert!(body(study.port, "/api/place.svg").contains("<svg"));
    assert_eq!(post(&page, &json!({ "begin": { "code": "../p" } })), 400);
    assert_eq!(post(&page, &json!({ "begin": { "code": "P-1", "age": 30 } })), 200);
    until_stage(&mut page, "draw");
    assert_eq!(
        (&page.hello["study"]["code"], &page.hello["study"]["sheet"]),
        (&json!("p-1"), &json!("landscape"))
    );
    let watcher = Page::open(study.port, None);
    assert_eq!(post(&watcher, &measures()), 403, "only the participant's page belongs to the study");

    draw(&mut page);
    let (status, answer) = page.order("execute");
    assert_eq!(status, 409, "{answer}");
    assert!(answer["error"].as_str().unwrap().contains("how long they took"), "{answer}");
    assert_eq!(post(&page, &measures()), 200);
    assert_eq!(page.order("execute").0, 200);
    until_stage(&mut page, "driven");
    page.until_state("driving");
    assert_eq!(post(&page, &answers(&page, 4)), 409, "not while the robot drives");
    page.until_state("ended");
    for step in ["sketch", "path", "execute", "again"] {
        assert!(!page.feed["allowed"].as_array().unwrap().contains(&json!(step)), "{step}: {}", page.feed);
    }
    assert_eq!((page.post("/api/sketch", &strokes()).0, page.order("again").0), (409, 409), "it drives once");
    assert_eq!(post(&page, &answers(&page, 6)), 400);
    assert_eq!(post(&page, &answers(&page, 4)), 200);
    until_stage(&mut page, "done");
    drop((page, watcher));

    // The robot is back at its start, and the first participant has been judged.
    let mut page = study.page();
    let outcome: Value = serde_json::from_str(&study.read("p-1/outcome.json")).unwrap();
    assert!(outcome["path_m"].as_f64().unwrap() > 0.5, "{outcome}");
    assert!(outcome["rotation_deg"].as_f64().unwrap().abs() < 30.0, "drawn as the floor lies: {outcome}");
    let sent: Value = serde_json::from_str(&study.read("p-1/drawing-1.json")).unwrap();
    assert_eq!(sent, serde_json::from_slice::<Value>(&strokes()).unwrap());
    let drive: Value = serde_json::from_str(&study.read("p-1/drive.json")).unwrap();
    assert_eq!(drive["measures"], measures()["measures"]);
    assert!(study.kept(drive["recording"].as_str().unwrap()).is_file(), "{drive}");
    assert!(
        study.read("p-1/index.html").contains("<svg") && study.read("index.html").contains("p-1/index.html")
    );
    assert!(
        study
            .read("participants.csv")
            .lines()
            .last()
            .unwrap()
            .ends_with("4,4,4,4,4,4,\"more, \"\"colours\"\"\"")
    );
    assert_eq!(
        post(&page, &json!({ "begin": { "code": "p-1" } })),
        409,
        "a participant who has finished does not begin again"
    );
    assert_eq!(post(&page, &json!({ "begin": { "code": "p-2" } })), 200);
    until_stage(&mut page, "draw");
    assert_eq!(page.hello["study"]["sheet"], "portrait", "the other group");
    drop(page);

    let place = study.end();
    let ended = place.fine("pad --study kept --report");
    assert!(ended.out.contains("2 participants, 1 finished; 0 left out"), "{ended}");
    let broken = place.files().join("kept/p-1/answers.json");
    fs::write(&broken, "{").unwrap();
    let ended = place.run("pad --study kept --report");
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.out.contains("1 participants, 0 finished; 1 left out"), "{ended}");
    assert!(ended.err.contains("p-1/answers.json: expected a participant's answers in JSON"), "{ended}");
    assert!(fs::read_to_string(place.files().join("kept/index.html")).unwrap().contains("1 left out"));
}

/// The whole system is stopped before the drive, or between the drive and the answers.
#[test]
fn a_stopped_study_resumes_with_the_same_participant() {
    let mut study = Study::start(Place::new());
    let mut page = study.page();
    assert_eq!(post(&page, &json!({ "begin": { "code": "p-1" } })), 200);
    draw(&mut page);
    drop(page);

    let mut study = Study::start(study.end());
    let mut page = study.page();
    assert_eq!(post(&page, &json!({ "begin": { "code": "p-1" } })), 200);
    until_stage(&mut page, "draw");
    draw(&mut page);
    assert_eq!(post(&page, &measures()), 200);
    assert_eq!(page.order("execute").0, 200);
    page.until_state("ended");
    drop(page);

    let mut study = Study::start(study.end());
    let mut page = study.page();
    assert_eq!(post(&page, &json!({ "begin": { "code": "p-1" } })), 200);
    until_stage(&mut page, "driven");
    assert_eq!(page.post("/api/sketch", &strokes()).0, 409, "only the answers are missing");
    assert_eq!(post(&page, &answers(&page, 5)), 200);
    drop(page);
    drop(study.page());
    let drive: Value = serde_json::from_str(&study.read("p-1/drive.json")).unwrap();
    assert_eq!(drive["drawing"], "drawing-2.json", "both drawings are kept, and the last one was driven");
    assert!(study.kept("p-1/drawing-1.json").exists() && study.kept("p-1/outcome.json").exists());
    study.end();
}

#[test]
fn a_folder_without_a_study_is_reported() {
    let place = Place::new();
    let mission = repository().join(format!("{MISSION}.toml"));
    let refused = |arguments: &str, words: &str| {
        let ended = place.run(&format!("pad {arguments}"));
        assert_eq!(ended.code, Some(2), "{arguments}: {ended}");
        assert!(ended.err.contains(words), "{arguments}: {ended}");
    };
    refused("--study nothing --report", "nothing: expected the folder of a study");
    refused("--report", "--study");
    fs::create_dir(place.files().join("mine")).unwrap();
    fs::write(place.files().join("mine/thesis.tex"), "by hand").unwrap();
    let line = format!("--mission {} --port 0 --study", mission.display());
    refused(&format!("{line} mine"), "thesis.tex: expected only what a study writes");
    refused(&format!("{line} mine/thesis.tex/below"), "thesis.tex/below");
    refused(&format!("{line} new --out out"), "--out");
    assert_eq!(fs::read_dir(place.files().join("mine")).unwrap().count(), 1, "nothing is written there");
}
