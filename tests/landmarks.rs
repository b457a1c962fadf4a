//! The navigator `landmarks` as processes: what the house gives to every navigator holds for it.

mod support;

use serde_json::Value;
use support::{Place, repository};

const SKETCH: &str = "sketches/a-04.json";
/// A sketch that landmark states lead along.
const BY_STATES: &str = "sketches/a-02.json";

/// A place with the missions that ship.
fn place(mission: &str) -> Place {
    let place = Place::new();
    let folder = repository().join("sim/missions/landmarks");
    std::fs::create_dir(place.files().join("sketches")).unwrap();
    for part in ["", "sketches"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                std::fs::copy(&path, place.files().join(part).join(path.file_name().unwrap())).unwrap();
            }
        }
    }
    std::fs::copy(folder.join(mission), place.files().join("mission.toml")).unwrap();
    place
}

fn read(place: &Place, file: &str) -> String {
    std::fs::read_to_string(place.files().join(file)).unwrap()
}

fn write(place: &Place, file: &str, text: &str) {
    std::fs::write(place.files().join(file), text).unwrap();
}

#[test]
fn a_mission_is_driven_replayed_executed_again_judged_and_shown() {
    let place = place("scene-a.toml");
    let report = place.fine("run mission.toml --out out --json").json();
    assert_eq!((&report["success"], &report["lost_messages"]), (&Value::Bool(true), &0.into()), "{report}");
    let recording = report["recording"].as_str().unwrap();
    let info = place.fine(&format!("info {recording} --json")).json();
    let topics = info["topics"].as_array().unwrap();
    let messages = |name: &str| topics.iter().find(|t| t["topic"] == name).map(|t| t["messages"].clone());
    for topic in ["/landmark_view", "/landmark_progress", "/sonar"] {
        assert_eq!(messages(topic), messages("/tick"), "{topic}: {info}");
    }
    assert_eq!(messages("/landmark_route"), Some(1.into()), "{info}");
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    assert_eq!(judged.pointer("/0/verdict/tasks/0/reached"), Some(&Value::Bool(true)), "{judged}");
    place.fine(&format!("report {recording} -o page.html"));
    let page = read(&place, "page.html");
    for words in ["The sketch with its states", "Histograms of forces", "Fit of what is seen", "when the"] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn kills_leave_the_same_bytes_by_every_method() {
    for (mission, kills) in [("scene-b.toml", 8), ("scene-a-words.toml", 6)] {
        let place = place(mission);
        let targets = "world,sketcher,localizer,planner,recorder";
        let told =
            place.fine(&format!("chaos mission.toml --kills {kills} --targets {targets} --json")).json();
        assert_eq!(told["identical"], true, "{mission}: {told}");
    }
}

/// A route in words and the sketch that it was made from are one route: the robot drives to the same place, by the same
/// commands.
#[test]
fn a_sketch_and_its_words_drive_to_the_same_place() {
    let place = place("scene-a-states.toml");
    let drive = |folder: &str| {
        let (report, _) = place.mission(&format!("run mission.toml --out {folder}"), folder);
        let recording = report["recording"].as_str().unwrap().to_owned();
        let told = place.fine(&format!("judge {recording} --json")).json();
        (told.pointer("/0/verdict/tasks/0").unwrap().clone(), recording)
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
        let recording = sketchnav_recordings::Recording::open(std::path::Path::new(recording)).unwrap();
        let commands = recording.channel(sketchnav_schemas::channels::COMMAND).unwrap();
        commands.map(|command| command.unwrap().0).collect::<Vec<_>>()
    };
    assert_eq!(commands(&recording), commands(&again));
}

#[test]
fn a_robot_with_a_laser_drives_the_same_sketch() {
    let place = place("scene-a.toml");
    let mission = read(&place, "mission.toml").replace("nomad200", "turtlebot3").replace("120.0", "300.0");
    write(&place, "mission.toml", &mission);
    place.fine("run mission.toml --json");
}

#[test]
fn what_is_wrong_is_said_before_anything_starts() {
    let place = place("scene-a.toml");
    let mission = read(&place, "mission.toml");
    let drawn = read(&place, SKETCH);
    let no_route = drawn.replacen("\"strokes\": [", "\"strokes\": [], \"goals\": [", 1);
    let crossed = drawn.replacen(
        "\"labels\": [",
        "\"obstacles\": [{ \"polygon\": [[56, 105], [68, 105], [68, 117], [56, 117]] }], \"labels\": [",
        1,
    );
    let blind = include_str!("../sim/robots/nomad200.toml");
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
    for (mission, sketch, told) in [
        (
            mission.replace("nomad200", "blind.toml"),
            &drawn,
            "expected one of the sensors [sonar] and [laser]",
        ),
        (mission.replace("drawing =", "sketch ="), &drawn, "navigator: unknown field `sketch`"),
        (mission.replace("a-04", "a-99"), &drawn, "navigator.drawing: expected an existing file"),
        (
            mission.replace("[[task]]", "[parameters.planner.belief]\nahead = 1.0\n[[task]]"),
            &drawn,
            "parameters.planner: unknown field `ahead`",
        ),
        (mission.clone(), &no_route, "a-04.json: expected an open line as the route"),
        (mission.clone(), &crossed, "a-04.json: expected objects apart"),
        (mission.clone(), &"{ \"canvas\": 3 }".to_owned(), "a-04.json: expected strokes in JSON"),
        (by_words.clone(), &drawn, "mine.txt: line 1, word 5: expected a direction"),
        (by_words, &drawn, "did you mean \"ahead\"?"),
    ] {
        write(&place, "mission.toml", &mission);
        write(&place, SKETCH, sketch);
        write(&place, "mine.txt", words);
        let ended = place.run("run mission.toml");
        assert_eq!(ended.code, Some(2), "{told}: {ended}");
        assert!(ended.err.contains(told), "{told}: {ended}");
    }
}
