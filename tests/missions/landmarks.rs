//! The navigator `landmarks` with separate processes keeps the guarantees for all navigators.

use serde_json::Value;
use sketchnav_landmarks::messages::LANDMARK_VIEW;
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels::MISSION;
use support::Place;

/// The time between two ticks, in nanoseconds.
const TICK_NS: u64 = 100_000_000;

const SKETCH: &str = "sketches/a-04.json";
/// A sketch that the robot follows by landmark states.
const BY_STATES: &str = "sketches/a-08.json";

fn place(mission: &str) -> Place {
    Place::with_missions("landmarks", mission)
}

fn read(place: &Place, file: &str) -> String {
    std::fs::read_to_string(place.files().join(file)).unwrap()
}

fn write(place: &Place, file: &str, text: &str) {
    std::fs::write(place.files().join(file), text).unwrap();
}

#[test]
fn a_mission_is_driven_replayed_rerun_judged_and_shown() {
    let place = place("scene-a.toml");
    let recording = &place.driven("mission.toml");
    let messages = place.messages(recording);
    for topic in ["/landmark_view", "/landmark_progress", "/sonar"] {
        assert_eq!(messages.get(topic), messages.get("/tick"), "{topic}: {messages:?}");
    }
    assert_eq!(messages.get("/landmark_route"), Some(&1), "{messages:?}");
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert_eq!(judged.pointer("/0/verdict/tasks/0/reached"), Some(&Value::Bool(true)), "{judged}");
    let sketch = std::fs::read_to_string(place.files().join(recording).with_file_name("sketch.svg")).unwrap();
    assert!(
        sketch.contains("The sketch with its states"),
        "the picture of the sketch is beside the recording"
    );
    let words = [
        "The sketch with its states",
        "The true scene: the path, and what matched",
        "Histograms of forces",
        "Fit of what is seen",
        "when the",
    ];
    place.page_says(recording, &words);
}

#[test]
fn kills_leave_the_same_bytes_with_every_method() {
    for (mission, kills) in [("scene-b.toml", 8), ("scene-a-labels.toml", 8), ("scene-a-words.toml", 6)] {
        place(mission).is_identical_after("mission.toml", kills, "world,sketcher,localizer,planner,recorder");
    }
}

/// A route in words is equivalent to the sketch that it was made from. The robot drives to the same place with the same commands.
#[test]
fn a_sketch_and_its_description_lead_to_the_same_place() {
    let place = place("scene-a-states.toml");
    let drive = |folder: &str| {
        let (report, _) = place.mission(&format!("run mission.toml --out {folder}"), folder);
        let recording = report["recording"].as_str().unwrap().to_owned();
        let output = place.fine(&format!("judge {recording} --json")).json();
        (output.pointer("/0/verdict/tasks/0").unwrap().clone(), recording)
    };
    let (by_sketch, recording) = drive("sketch");
    let words = place.fine("landmarks mission.toml").out;
    assert!(words.contains("when the") && words.contains("turn left"), "{words}");
    write(&place, "mine.txt", &words);
    let mission = read(&place, "mission.toml")
        .replace(&format!("drawing = \"{BY_STATES}\""), "route_file = \"mine.txt\"");
    write(&place, "mission.toml", &mission);
    let (by_words, again) = drive("words");
    assert_eq!(by_sketch, by_words);
    let commands = |recording: &str| {
        let recording = Recording::open(std::path::Path::new(recording)).unwrap();
        let commands = recording.channel(sketchnav_schemas::channels::COMMAND).unwrap();
        commands.map(|command| command.unwrap().0).collect::<Vec<_>>()
    };
    assert_eq!(commands(&recording), commands(&again));
}

/// The proposal is a separate sketch. The person's sketch is never overwritten, and words have nothing to smooth.
#[test]
fn a_smoother_route_is_proposed_and_can_be_driven() {
    let place = place("scene-a.toml");
    place.fine("landmarks mission.toml --smooth smoother.json");
    let mission = read(&place, "mission.toml");
    let line = mission.lines().find(|line| line.starts_with("drawing")).unwrap();
    write(&place, "smoother.toml", &mission.replace(line, "drawing = \"smoother.json\""));
    let recording = place.driven("smoother.toml");
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert_eq!(judged.pointer("/0/verdict/tasks/0/reached"), Some(&Value::Bool(true)), "{judged}");
    let sketch = line.split('"').nth(1).unwrap();
    let refused = place.run(&format!("landmarks mission.toml --smooth {sketch}"));
    assert_eq!(refused.code, Some(2), "{refused}");
    let place = self::place("scene-a-words.toml");
    let refused = place.run("landmarks mission.toml --smooth smoother.json");
    assert!(refused.err.contains("expected a mission with a sketch, found a route in words"), "{refused}");
}

/// A person sets the robot's position in the sketch, in this case near the start of the route. The robot uses it from the next view
/// on.
#[test]
fn a_robot_that_navigates_by_belief_accepts_its_pose() {
    let place = place("scene-a.toml");
    let mut running = place.start("run mission.toml --system posed --speed 1 --json --out posed");
    place.wait_until_driving(&mut running, "posed");
    let output = place.fine("send here --at 28,118 --heading 10 --system posed --json").json();
    assert_eq!(output["order"], "here", "{output:#}");
    let ordered_ns = output["stamp_ns"].as_u64().unwrap();
    support::wait_until("views after the order", || {
        let newest = place.fine("echo landmark_view --once --system posed --field fit").json();
        newest["stamp_ns"].as_u64().unwrap() > ordered_ns + 3 * TICK_NS
    });
    for (wrong, words) in [
        ("here --at 161,10", "expected a place in the drawing of 160 × 160 px, found 161,10"),
        ("resume --at 1,1", "--at: expected the order `here`, found `resume`"),
    ] {
        let ended = place.run(&format!("send {wrong} --system posed"));
        assert_eq!(ended.code, Some(2), "{ended}");
        assert!(ended.err.contains(words), "{ended}");
    }
    place.fine("send abort --system posed");
    let recording = running.end().json()["recording"].as_str().unwrap().to_owned();
    let open = Recording::open(std::path::Path::new(&recording)).unwrap();
    let orders: Vec<_> = open.channel(MISSION).unwrap().map(|order| order.unwrap().0).collect();
    let (order, here) = orders.iter().find_map(|order| Some((order, order.here()?))).unwrap();
    assert_eq!((here.at.x, here.at.y), (28.0, 42.0));
    let mut views = open.channel(LANDMARK_VIEW).unwrap().map(|view| view.unwrap().0);
    let next = views.find(|view| view.header.stamp_ns > order.header.stamp_ns + TICK_NS).unwrap().in_sketch();
    // The sketch is 160 pixels wide, which correspond to 20.32 m.
    let off_m = (next.x - 28.0 * 0.127).hypot(next.y - 42.0 * 0.127);
    assert!(off_m < 1.0 && (next.yaw_rad - 0.17).abs() < 0.6, "{next:?}");
    drop(views);
    place.fine(&format!("rerun {recording} --process sketcher"));
    for process in ["localizer", "planner"] {
        let refused = place.run(&format!("rerun {recording} --process {process}"));
        assert!(refused.code == Some(2) && refused.err.contains("people took part"), "{refused}");
    }
}

#[test]
fn labels_read_by_a_camera_are_used() {
    let place = place("scene-a-labels.toml");
    let recording = &place.driven("mission.toml");
    assert!(place.messages(recording)["/markers"] > 100);
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert_eq!(judged.pointer("/0/verdict/tasks/0/reached"), Some(&Value::Bool(true)), "{judged}");
}

/// Words name objects, and so do markers. If the labels of the trash and the crate are exchanged, the robot recognizes neither as the
/// one that the words name, and gets lost.
#[test]
fn landmark_states_match_the_labelled_objects_that_they_name() {
    let place = place("scene-a-labels.toml");
    let mission = read(&place, "mission.toml")
        .replace(&format!("drawing = \"{SKETCH}\""), "method = \"chronis-2007\"\nroute_file = \"route.txt\"");
    let exchanged = mission
        .replace("crate = [", "other = [")
        .replace("trash = [", "crate = [")
        .replace("other = [", "trash = [");
    for (name, mission, is_reached) in [("right", mission, true), ("exchanged", exchanged, false)] {
        write(&place, "words.toml", &mission);
        let (report, _) = place.mission(&format!("run words.toml --out {name}"), name);
        let recording = report["recording"].as_str().unwrap();
        let judged = place.run(&format!("judge {recording} --json")).json();
        let reached = judged.pointer("/0/verdict/tasks/0/reached");
        assert_eq!(reached, Some(&Value::Bool(is_reached)), "{name}: {judged}");
        place.is_reproduced(recording, &["sketcher", "localizer", "planner"]);
    }
}

#[test]
fn unknown_labels_and_markers_are_named() {
    let place = place("scene-a-labels.toml");
    let mission = read(&place, "mission.toml");
    for (from, to, words) in [
        (
            "desk = [61,",
            "desc = [61,",
            "navigator.markers.desc: expected one object with this label in the sketch or the words, found 0; did you mean \"desk\"?",
        ),
        (
            "desk = [61,",
            "desk = [60,",
            "navigator.markers.desk: expected a marker of the world, which has 24, found 60",
        ),
        (
            "nomad200-camera",
            "nomad200",
            "robot \"nomad200\": expected the sensor [camera] in its file, found none",
        ),
    ] {
        write(&place, "mission.toml", &mission.replace(from, to));
        let said = place.run("run mission.toml");
        assert_eq!(said.code, Some(2), "{}", said.err);
        assert!(said.err.contains(words), "{}", said.err);
    }
}

#[test]
fn a_robot_with_a_laser_drives_the_same_sketch() {
    let place = place("scene-a.toml");
    let mission = read(&place, "mission.toml").replace("nomad200", "turtlebot3").replace("120.0", "300.0");
    write(&place, "mission.toml", &mission);
    place.fine("run mission.toml --json");
}

#[test]
fn errors_are_reported_before_the_start() {
    let place = place("scene-a.toml");
    let mission = read(&place, "mission.toml");
    let drawn = read(&place, SKETCH);
    let no_route = drawn.replacen("\"strokes\": [", "\"strokes\": [], \"goals\": [", 1);
    let crossed = drawn.replacen(
        "\"labels\": [",
        "\"obstacles\": [{ \"polygon\": [[56, 105], [68, 105], [68, 117], [56, 117]] }], \"labels\": [",
        1,
    );
    let blind = include_str!("../../sim/robots/nomad200.toml");
    let blind = format!(
        "{}{}",
        &blind[..blind.find("[sonar]").unwrap()],
        &blind[blind.find("[odometry]").unwrap()..]
    );
    write(&place, "blind.toml", &blind);
    let by_states =
        mission.replace("kind = \"landmarks\"", "kind = \"landmarks\"\nmethod = \"chronis-2007\"");
    let by_words = by_states.replace(&format!("drawing = \"{SKETCH}\""), "route_file = \"mine.txt\"");
    let words = "When the desk is ahaed, then turn left.\n";
    // A route with a turn, and a single object.
    let around = |object: [[u32; 2]; 4]| {
        format!(
            "{{ \"canvas\": [160, 160], \"strokes\": [], \"obstacles\": [{{ \"polygon\": {object:?}, \"label\": \"bin\" }}], \"route\": [[20, 140], [80, 140], [80, 20]] }}"
        )
    };
    let far = around([[140, 5], [150, 5], [150, 15], [140, 15]]);
    let on_the_way = around([[40, 130], [60, 130], [60, 150], [40, 150]]);
    for (mission, sketch, expected) in [
        (
            mission.replace("nomad200", "blind.toml"),
            &drawn,
            "expected one of the sensors [sonar] and [laser]",
        ),
        (mission.replace("drawing =", "sketch ="), &drawn, "navigator: unknown field `sketch`"),
        (mission.replace("a-04", "a-99"), &drawn, "navigator.drawing: expected a file, found none at "),
        (
            mission.replace("[[task]]", "[parameters.planner.belief]\nahead = 1.0\n[[task]]"),
            &drawn,
            "parameters.planner.belief: unknown field `ahead`",
        ),
        (mission.clone(), &no_route, "a-04.json: expected an open line as the route"),
        (mission.clone(), &crossed, "a-04.json: expected separate objects"),
        (mission.clone(), &"{ \"canvas\": 3 }".to_owned(), "a-04.json: expected strokes in JSON"),
        (by_states, &far, "where the robot is to turn"),
        (
            mission.clone(),
            &on_the_way,
            "a-04.json: expected a route past objects, found one that enters bin at (",
        ),
        (
            by_words.replace("chronis-2007", "belief"),
            &drawn,
            "because method \"belief\" needs positions, and words only give directions from the robot",
        ),
        (by_words.clone(), &drawn, "mine.txt: line 1, word 5: expected a direction"),
        (by_words, &drawn, "did you mean \"ahead\"?"),
    ] {
        write(&place, "mission.toml", &mission);
        write(&place, SKETCH, sketch);
        write(&place, "mine.txt", words);
        let ended = place.run("run mission.toml");
        assert_eq!(ended.code, Some(2), "{expected}: {ended}");
        assert!(ended.err.contains(expected), "{expected}: {ended}");
    }
}
