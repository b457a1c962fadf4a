//! The method `outline` with separate processes keeps the guarantees for all navigators, although its planner maintains a map and
//! an alignment that takes many steps.

use serde_json::{Value, json};
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::{MISSION as ORDERED, ORDERS, STATUS};
use sketchnav_schemas::codes::TaskState;
use sketchnav_sketch::messages::{QUESTION, QuestionKind};
use support::arms::{doubtful, place};
use support::page::{Page, free_port, wait_for};
use support::{Place, kill_if_alive, repository, wait_until};

#[test]
fn a_mission_is_driven_replayed_rerun_and_reports_correspondences() {
    let place = place();
    let recording = &place.driven("arms.toml");
    let messages = place.messages(recording);
    assert!(messages["/correspondence"] > 5, "{messages:?}");
    place.is_reproduced(recording, &["localizer", "planner"]);
}

/// The planner is killed while it maps and aligns.
#[test]
fn kills_leave_the_same_bytes() {
    place().is_identical_after("arms.toml", 10, "localizer,planner");
}

/// Nobody has marked where the robot starts. Its planner is killed while it finds out.
#[test]
fn a_robot_without_a_start_mark_finds_out_where_it_is() {
    let place = place();
    let (mission, recording) = finds_out_where_it_is(&place, "hall/hall-unmarked.toml");
    // What the robot has learned has a start, although nobody has marked it.
    place.fine(&format!("learn {recording} -o hall.learned"));
    place.driven(&format!("{mission} --learned hall.learned"));
}

/// Among rooms, the localizer finds the robot, with ten times as many particles as it has otherwise.
#[test]
fn a_robot_among_rooms_without_a_start_mark_finds_out_where_it_is() {
    finds_out_where_it_is(&place(), "building/building-unmarked.toml");
}

/// Somebody carries the robot into another room. Localizer and planner notice it on their own, and both are killed, too.
#[test]
fn a_robot_that_is_carried_among_rooms_finds_out_where_it_is() {
    let place = place();
    let (_, recording) = finds_out_where_it_is(&place, "building/building-kidnapped.toml");
    let recording = Recording::open(recording.as_ref()).unwrap();
    let statuses = recording.channel(STATUS).unwrap().map(|status| status.unwrap().0);
    let noticed = statuses.filter(|status| status.reason.as_str().starts_with("somebody has carried it"));
    let noticed_s: Vec<_> = noticed.map(|status| status.header.stamp_ns as f64 * 1e-9).collect();
    assert!(noticed_s.len() == 1 && (12.0..14.0).contains(&noticed_s[0]), "{noticed_s:?}");
}

/// Drives a mission of those that ship, also with kills and from its recording. Returns the mission's file and the recording.
fn finds_out_where_it_is(place: &Place, mission: &str) -> (String, String) {
    let mission = repository().join("sim/missions").join(mission).display().to_string();
    let recording = place.driven(&mission);
    place.is_reproduced(&recording, &["localizer", "planner"]);
    place.is_identical_after(&mission, 7, "localizer,planner");
    (mission, recording)
}

/// A floor that looks the same after half a turn, with its drawing. No robot can know at which end of it it is.
const TWINS: [(&str, &str); 3] = [
    (
        "twins.floor.toml",
        "name = 'twins'\nwall_thickness_m = 0.1\n[[wall]]\nclosed = true\n\
         points = [[0, -3], [3, -3], [3, 0], [12, 0], [12, 6], [9, 6], [9, 3], [0, 3]]\n",
    ),
    (
        "twins.svg",
        "<svg xmlns='http://www.w3.org/2000/svg' width='680' height='530'>\
         <path d='M40 490 L190 490 L190 340 L640 340 L640 40 L490 40 L490 190 L40 190 Z' \
         fill='none' stroke='black' stroke-width='6'/></svg>",
    ),
    (
        "twins.toml",
        "name = 'twins'\nrobot = 'robotino'\nworld = { floor_plan = 'twins.floor.toml' }\n\
         start = { world = [2.0, 1.0], world_heading_deg = 30 }\n\
         navigator = { kind = 'sketch', method = 'outline', drawing = 'twins.svg' }\n\
         [[task]]\nname = 'wing'\ngoal = [565, 90]\nthere = { center = [10.5, 5.0], radius_m = 1.0 }\n\
         time_limit_s = 400\n",
    ),
];

fn twins() -> Place {
    let place = Place::new();
    for (name, text) in TWINS {
        std::fs::write(place.files().join(name), text).unwrap();
    }
    place
}

/// Nobody has placed the robot in the drawing until the person who is asked does.
#[test]
fn where_the_drawing_looks_alike_a_person_is_asked() {
    let (place, port, name) = (twins(), free_port(), "twins");
    let line = format!("run twins.toml --pad --port {port} --system {name} --speed 4 --out out --json");
    let mut running = place.start(&line);
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    let asked = page.until("a question", |feed| places(feed).len() > 1);
    assert!(asked["pose"].is_null(), "nobody has placed it yet: {asked}");
    page.must("/api/here", &json!({ "at": places(&asked)[0]["at"] }));
    drop(page);
    let report = running.end().json();
    let reason = report["tasks"][0]["reason"].as_str().unwrap();
    assert!(reason.ends_with("a person agrees"), "{report:#}");
    place.assert_nothing_left(name);
}

#[test]
fn a_robot_without_a_start_mark_is_lost_where_the_drawing_looks_alike() {
    let place = twins();
    let (report, code) = place.mission("run twins.toml", "twins");
    assert_eq!(code, 1, "{report:#}");
    let reason = report["tasks"][0]["reason"].as_str().unwrap();
    assert!(reason.contains("where the drawing looks alike"), "{report:#}");
    let route = "goal = [60, 210]\n[[task]]\nname = 'way'\nroute = [[60, 210], [90, 230]]";
    for (from, to, words) in [
        ("'outline'", "'beam'", "navigator.start: expected the start"),
        ("goal = [565, 90]", route, "task 2 (way).route: expected a goal"),
        ("goal = [565, 90]", "goal = [640, 200]", "task 1 (wing): goal at (640, 200)"),
    ] {
        std::fs::write(place.files().join("bad.toml"), TWINS[2].1.replace(from, to)).unwrap();
        let refused = place.run("run bad.toml");
        assert!(refused.code == Some(2) && refused.err.contains(words), "{refused}");
    }
}

/// An office floor that looks the same after half a turn, with its drawing.
const OFFICE: [(&str, &str); 2] = [
    (
        "office.floor.toml",
        "name = 'office'\nwall_thickness_m = 0.1\nwall = [\n\
         { closed = true, points = [[0, 0], [18, 0], [18, 11], [0, 11]] },\n\
         { points = [[0, 4.5], [18, 4.5]] }, { points = [[0, 6.5], [18, 6.5]] },\n\
         { points = [[5, 0], [5, 4.5]] }, { points = [[12, 0], [12, 4.5]] },\n\
         { points = [[13, 6.5], [13, 11]] }, { points = [[6, 6.5], [6, 11]] }]\n\
         door = [{ at = [2, 4.5], width_m = 0.9 }, { at = [9.5, 4.5], width_m = 0.9 },\n\
         { at = [15.5, 4.5], width_m = 0.9 }, { at = [16, 6.5], width_m = 0.9 },\n\
         { at = [8.5, 6.5], width_m = 0.9 }, { at = [2.5, 6.5], width_m = 0.9 }]\n",
    ),
    (
        "office.svg",
        "<svg xmlns='http://www.w3.org/2000/svg' width='760' height='480'><path d='M20 460 H740 V20 H20 Z \
         M20 280 H82 M118 280 H382 M418 280 H622 M658 280 H740 M20 200 H102 M138 200 H342 M378 200 H642 \
         M678 200 H740 M220 460 V280 M500 460 V280 M540 200 V20 M260 200 V20' fill='none' stroke='black' \
         stroke-width='4'/></svg>",
    ),
];

/// Regression test: the particles agreed on one of the two places by chance, and the robot arrived at the wrong one half of the
/// time. With its heading, the robot knows which one it is.
#[test]
fn among_rooms_that_look_alike_only_a_heading_tells_a_robot_where_it_is() {
    let place = Place::new();
    for (name, text) in OFFICE {
        std::fs::write(place.files().join(name), text).unwrap();
    }
    let mission = |heading: &str| {
        format!(
            "name = 'office'\nrobot = 'robotino'\nworld = {{ floor_plan = 'office.floor.toml' }}\n\
             start = {{ world = [3.0, 2.0], world_heading_deg = 30 }}\n\
             navigator = {{ kind = 'sketch', method = 'outline', drawing = 'office.svg'{heading} }}\n\
             [[task]]\nname = 'room'\ngoal = [660, 380]\nthere = {{ center = [16, 2], radius_m = 1.5 }}\n\
             time_limit_s = 500\n"
        )
    };
    for (heading, code, words) in
        [("", 1, "where the drawing looks alike"), (", start_heading_deg = 30", 0, "from the goal")]
    {
        std::fs::write(place.files().join("office.toml"), mission(heading)).unwrap();
        let (report, ended) = place.mission("run office.toml --seed 5", "office");
        let reason = report["tasks"][0]["reason"].as_str().unwrap();
        assert!(ended == code && reason.contains(words), "{heading}: {report:#}");
    }
}

/// Drawn routes are driven with the particle filter, as by the other methods.
#[test]
fn a_drawn_route_is_followed() {
    let place = place();
    let mission = repository().join("sim/missions/laboratory/laboratory-route.toml");
    place.driven(&format!("{} --method outline", mission.display()));
}

fn places(feed: &Value) -> Vec<Value> {
    feed["question"]["places"].as_array().cloned().unwrap_or_default()
}

/// Over the page's own protocol, the robot asks, its planner is killed in the meantime, and the robot continues after the answer.
#[test]
fn a_robot_that_asks_continues_after_the_answer() {
    let (place, port, name) = (doubtful(), free_port(), "asks");
    let line = format!("run arms.toml --pad --port {port} --system {name} --speed 3 --out out --json");
    let mut running = place.start(&line);
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    let (status, refused) = page.post("/api/here", br#"{"at":[300,300]}"#);
    assert_eq!(status, 409, "it does not ask yet: {refused}");
    let asked = page.until("a question", |feed| places(feed).len() > 1);
    assert_eq!((&asked["state"], &asked["task"]["state"]), (&json!("paused"), &json!("paused")));
    let text = asked["question"]["text"].as_str().unwrap();
    assert!(text.starts_with("Is the robot at A") && text.ends_with("Tap where it is."), "{text}");

    let before = place.serving(name, "planner");
    before.iter().for_each(|&pid| kill_if_alive(pid));
    wait_until("another planner", || place.serving(name, "planner").iter().any(|pid| !before.contains(pid)));
    page.until_allowed("here");
    assert_eq!(places(&page.feed), places(&asked), "it asks the same");

    for (body, status, words) in [
        (r#"{"at":[-1,5]}"#, 400, "expected a place in the drawing of"),
        (r#"{"at":[300]}"#, 400, "the place"),
        (r#"{"at":[300,300],"heading_deg":999}"#, 400, "-360 to 360 degrees"),
    ] {
        let (found, answer) = page.post("/api/here", body.as_bytes());
        assert!(found == status && answer["error"].as_str().unwrap().contains(words), "{body}: {answer}");
    }
    assert_eq!(page.order("here").0, 400);
    page.must("/api/here", &json!({ "at": places(&asked)[1]["at"] }));
    page.until("the way on", |feed| feed["question"].is_null() && feed["task"]["state"] == "driving");
    let again = page.until("another question", |feed| places(feed).len() > 1);
    page.must("/api/here", &json!({ "at": places(&again)[0]["at"] }));
    drop(page);
    let report = running.end().json();
    place.assert_nothing_left(name);
    let recording = report["recording"].as_str().unwrap();
    agrees_with_the_tap(recording);
    place.fine(&format!("replay {recording} --live recorder --rate max --record again.mcap"));
    for process in ["localizer", "planner"] {
        let refused = place.run(&format!("rerun {recording} --process {process}"));
        assert!(refused.code == Some(2) && refused.err.contains("people took part"), "{refused}");
    }
}

fn agrees_with_the_tap(recording: &str) {
    let recording = Recording::open(recording.as_ref()).unwrap();
    let orders = recording.channel(ORDERS).unwrap().filter_map(|order| order.unwrap().0.here());
    let questions: Vec<_> =
        recording.channel(QUESTION).unwrap().map(|question| question.unwrap().0).collect();
    let kinds: Vec<_> = questions.iter().map(|question| question.kind).collect();
    let (which, nothing) = (QuestionKind::Which.code(), QuestionKind::Nothing.code());
    assert_eq!(kinds, [which, nothing, which, nothing]);
    let tapped = [questions[0].places()[1], questions[2].places()[0]];
    for (order, place) in orders.zip(tapped) {
        // The page rounds to tenths of a pixel.
        assert!((order.at.x - place.x_px).hypot(order.at.y - place.y_px) < 0.2, "{order:?}, {place:?}");
    }
    let last = recording.channel(STATUS).unwrap().map(|status| status.unwrap().0);
    let reached = last.filter(|status| status.state == TaskState::Reached.code()).last().unwrap();
    assert!(reached.reason.as_str().ends_with("a person agrees"), "{reached:?}");
}

/// The answer can also be given by command, without the page.
#[test]
fn a_robot_that_asks_accepts_an_answer_by_command() {
    let (place, port, name) = (doubtful(), free_port(), "asking");
    let line = format!("run arms.toml --pad --port {port} --system {name} --speed 3 --out out --json");
    let mut running = place.start(&line);
    wait_for(&mut running, port);
    let mut page = Page::open(port, None);
    let asked = page.until("a question", |feed| places(feed).len() > 1);
    // The command takes pixels of the drawing's file, but this page uses pixels of the sketch that was made from it.
    let scale = 640.0 / page.hello["canvas"][0].as_f64().unwrap();
    let at = places(&asked)[0]["at"].as_array().unwrap().clone();
    let at: Vec<_> = at.iter().map(|at| (at.as_f64().unwrap() * scale).to_string()).collect();
    place.fine(&format!("send here --at {} --system {name}", at.join(",")));
    drop(page);
    let report = running.end().json();
    assert_eq!(report["success"], true, "{report:#}");
    let recording = Recording::open(report["recording"].as_str().unwrap().as_ref()).unwrap();
    assert_eq!(
        recording.channel(ORDERED).unwrap().filter(|o| o.as_ref().unwrap().0.here().is_some()).count(),
        1
    );
}

/// In lockstep no answer arrives in time. The planner is killed as it asks, and again while it waits.
#[test]
fn kills_of_a_robot_that_asks_leave_the_same_bytes() {
    let place = doubtful();
    let run = |name: &str, more: &str| {
        let line =
            format!("run arms.toml --pad --port {} --system {name} --out {name} --json {more}", free_port());
        place.fine(&line).json()["recording"].as_str().unwrap().to_owned()
    };
    let whole = run("whole", "");
    let opened = Recording::open(whole.as_ref()).unwrap();
    let asked_ns = opened.channel(QUESTION).unwrap().next().unwrap().unwrap().0.header.stamp_ns;
    let waiting_s = asked_ns as f64 * 1e-9 + 7.0;
    let kill =
        |channel: &str, when: &str| format!("[[fault]]\nchannel = \"{channel}\"\n{when}\ndo = \"kill\"\n");
    let plan = kill("question", "message = 1") + &kill("status", &format!("time_s = {waiting_s:.1}"));
    std::fs::write(place.files().join("plan.toml"), plan).unwrap();
    let killed = run("killed", "--faults plan.toml");
    place.fine(&format!("diff {whole} {killed}"));
    let deaths = place.fine(&format!("info {killed} --json")).json()["faults"].to_string();
    assert!(deaths.matches("SIGKILL").count() >= 2, "{deaths}");
    place.is_reproduced(&whole, &["localizer", "planner"]);
}
