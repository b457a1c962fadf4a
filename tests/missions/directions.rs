//! The navigator `directions` with separate processes, over a plane of dots, keeps the guarantees for all navigators.

use std::fs;

use serde_json::Value;
use support::Place;

fn place(mission: &str) -> Place {
    Place::with_missions("directions", mission)
}

#[test]
fn from_a_picture_of_the_plane_the_navigator_arrives() {
    let place = place("hundred.toml");
    let recording = &place.driven("mission.toml --seed 3");
    let messages = place.messages(recording);
    assert_eq!(messages.get("/view"), messages.get("/tick"), "{messages:?}");
    assert_eq!(messages.get("/description"), messages.get("/journey"), "{messages:?}");
    assert_eq!((messages["/directions"], messages["/itinerary"]), (1, 1), "{messages:?}");
    assert!(!messages.contains_key("/odometry") && !messages.contains_key("/contact"), "{messages:?}");
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    let kinds = judged.pointer("/0/journeys").and_then(Value::as_array).unwrap();
    for journey in kinds {
        assert!(matches!(journey["kind"].as_str(), Some("direct" | "recovered")), "{judged}");
        assert!(journey["stated"].as_f64().is_some_and(|stated| stated > 0.5), "{judged}");
    }
    let words = [
        "Custom maps",
        "(Isol",
        "parkways",
        "Entry of the custom map",
        "stated probability",
        "where most simulated journeys fail",
    ];
    place.page_says(recording, &words);
}

/// A map with branches works everywhere that a straight one does: run, rerun, replay, judge and report.
#[test]
fn a_branching_map_corrects_the_navigators_errors() {
    let place = place("branching.toml");
    let recording = &place.driven("mission.toml --seed 1");
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    let journey = &judged[0]["journeys"][0];
    assert_eq!(journey["kind"], "recovered", "{judged}");
    assert_eq!(
        journey["accepted"], journey["right"],
        "every landmark is the one that it is taken for: {judged}"
    );
    place
        .page_says(recording, &["The custom map as a graph", "In words", "Seek the most isolated landmark."]);
}

/// The sentences of a map direct the robot in the same way as its symbols, and the page to print shows them with a picture.
#[test]
fn a_map_in_sentences_leads_the_robot_as_its_symbols_do() {
    let place = place("written.toml");
    let symbols = place.driven("mission.toml --seed 1");
    let said = place.fine("directions mission.toml --words --page map.html").out;
    let sentences = said.lines().skip_while(|line| !line.starts_with("1. "));
    let sentences: Vec<_> = sentences.collect();
    assert!(sentences.len() > 3, "{said}");
    fs::write(place.files().join("written.directions"), sentences.join("\n")).unwrap();
    let driven = place.driven("mission.toml --seed 1");
    place.fine(&format!("diff {symbols} {driven}"));
    let page = fs::read_to_string(place.files().join("map.html")).unwrap();
    assert!(page.contains("<li>Take the landmark closest"), "{page}");
    for (mission, words) in [("hundred.toml", "<svg"), ("poles.toml", "<svg")] {
        fs::remove_file(place.files().join("map.html")).unwrap();
        place.fine(&format!("directions {mission} --page map.html"));
        let page = fs::read_to_string(place.files().join("map.html")).unwrap();
        assert!(page.contains(words) && page.contains("probability of arrival"), "{mission}: {page}");
    }
}

/// The robot does not start on a journey that will probably fail, unless a person insists. Before it starts, it prints its map.
#[test]
fn a_journey_that_will_probably_fail_is_not_started_unless_a_person_insists() {
    let place = place("hundred.toml");
    let text = fs::read_to_string(place.files().join("mission.toml")).unwrap();
    let text = text.replace(
        "[navigator]",
        "[navigator]
least_probability = 0.995",
    );
    fs::write(place.files().join("careful.toml"), text).unwrap();
    let refused = place.run("run careful.toml --seed 1");
    assert_eq!(refused.code, Some(2), "{refused}");
    for words in ["(*, ", "the stated probability of arrival is", "expected at least 99.5 %", "add --go"] {
        assert!(refused.err.contains(words), "{words}: {refused}");
    }
    let left = fs::read_dir(place.files().join("out")).map_or(0, Iterator::count);
    assert_eq!(left, 0, "the folder of a run that never began");
    let driven = place.run("run careful.toml --seed 1 --go");
    assert!(matches!(driven.code, Some(0 | 1)), "{driven}");
    assert!(driven.err.contains("# ") && driven.err.contains("probability of arrival"), "{driven}");
}

/// A navigator with a belief works everywhere that one with a map does: run, rerun, replay, judge and report.
#[test]
fn a_belief_leads_the_navigator_past_its_errors_without_a_map() {
    let place = place("belief.toml");
    let recording = &place.driven("mission.toml --seed 2");
    let messages = place.messages(recording);
    assert_eq!((messages.get("/directions"), messages["/chart"]), (None, 1), "{messages:?}");
    assert_eq!(messages.get("/journey"), messages.get("/whereabouts"), "{messages:?}");
    place.is_reproduced(recording, &["world", "sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    let journey = &judged[0]["journeys"][0];
    assert!(matches!(journey["kind"].as_str(), Some("direct" | "recovered")), "{judged}");
    assert_eq!(journey["accepted"], journey["right"], "every landmark is the most probable one: {judged}");
    assert!(journey["stated"].as_f64().is_some_and(|stated| stated > 0.5), "{judged}");
    place.page_says(
        recording,
        &["knew the positions of 100 landmarks", "Probability of the most probable landmark"],
    );
    let made = place.fine("directions mission.toml").out;
    assert!(
        made.contains("100 landmarks in 800 bytes") && made.contains("probability of arrival 0."),
        "{made}"
    );
}

/// Runs the same navigator on land, among a field of poles, with a laser and a custom map made from a floor plan.
#[test]
fn from_a_floor_plan_the_robot_arrives_among_poles() {
    let place = place("poles.toml");
    let recording = &place.driven("mission.toml --seed 1");
    let messages = place.messages(recording);
    assert_eq!((messages.get("/view"), messages.get("/contact")), (None, None), "{messages:?}");
    assert_eq!(messages.get("/description"), messages.get("/scan"), "{messages:?}");
    place.is_reproduced(recording, &["sketcher", "localizer", "planner"]);
    let judged = place.fine(&format!("judge {recording} --json")).json();
    let kinds = judged.pointer("/0/journeys").and_then(Value::as_array).unwrap();
    assert_eq!(kinds.len(), 2, "{judged}");
    for journey in kinds {
        assert!(matches!(journey["kind"].as_str(), Some("direct" | "recovered")), "{judged}");
    }
    place.page_says(recording, &["Custom maps", "(Isol", "stated probability"]);
}

/// To the laser, all landmarks of the floor are alike. The map-maker and a person name them by the kinds that their markers show.
#[test]
fn maps_that_name_kinds_lead_past_doors_and_stairs() {
    let place = place("signs.toml");
    let recording = &place.driven("mission.toml --seed 1");
    let messages = place.messages(recording);
    assert_eq!(messages.get("/description"), messages.get("/markers"), "{messages:?}");
    place.is_reproduced(recording, &["sketcher", "localizer", "planner"]);
    let judged = |recording: &str| place.fine(&format!("judge {recording} --json")).json();
    let verdict = judged(recording);
    for journey in verdict.pointer("/0/journeys").and_then(Value::as_array).unwrap() {
        assert!(matches!(journey["kind"].as_str(), Some("direct" | "recovered")), "{verdict}");
        assert!(journey["stated"].as_f64().is_some_and(|stated| stated > 0.8), "{verdict}");
    }
    place.page_says(recording, &["Custom maps", ">stairs<", ">pole<"]);
    let made = place.fine("directions mission.toml --words").out;
    assert!(made.contains("(door, ") && made.contains(" door at a bearing of "), "{made}");

    let errand = &place.driven("errand.toml --seed 1");
    let verdict = judged(errand);
    let journey = &verdict[0]["journeys"][0];
    assert_eq!(journey["kind"], "direct", "{verdict}");
    assert_eq!(journey["kinds"], serde_json::json!(["stairs", "door", "machine"]), "{verdict}");
    place.page_says(errand, &["Seek the only machine in view."]);
    fs::write(place.files().join("errand.directions"), "(stairs, *, SW)\n(lift, Isol, -)\n").unwrap();
    let ended = place.run("run errand.toml");
    let words = "errand.directions: entry 2: expected a kind that the mission has markers for (corner, door, machine, stairs), found \"lift\"";
    assert!(ended.code == Some(2) && ended.err.contains(words), "{ended}");
}

#[test]
fn kills_leave_the_same_bytes() {
    for (mission, kills) in [
        ("hundred.toml", 10),
        ("written.toml", 6),
        ("branching.toml", 6),
        ("belief.toml", 6),
        ("poles.toml", 6),
        ("signs.toml", 6),
        ("errand.toml", 6),
    ] {
        place(mission).is_identical_after("mission.toml", kills, "world,sketcher,localizer,planner,recorder");
    }
}

/// Drives a mission by a written map over a few dots. Returns the exit code and the judge's verdict on the journey.
///
/// The dots, in windows of 0.1 m:
/// ```text
///            C (0.16, 0.16)
///   A (0.1, 0.1)     B (0.17, 0.11)        D (0.6, 0.6)
/// ```
fn ended(map: &str, landmarks: &str, dots: &str) -> (Option<i32>, Value) {
    let place = Place::new();
    let write = |name: &str, text: String| fs::write(place.files().join(name), text).unwrap();
    write("small.plane.toml", format!("dots = [{dots}]\n"));
    write("small.directions", map.to_owned());
    let exact = include_str!("../../sim/robots/helicopter.toml")
        .replace("noise_m = 0.001", "noise_m = 0.0")
        .replace("translation_m = 0.001", "translation_m = 0.0")
        .replace("rotation_rad = 0.005", "rotation_rad = 0.0");
    write("exact.toml", exact);
    write(
        "mission.toml",
        format!(
            "name = 'small'\nrobot = 'exact.toml'\nworld = {{ plane = 'small.plane.toml' }}\n\
             start = {{ world = [0.1, 0.1], world_heading_deg = 0.0 }}\n\
             navigator = {{ kind = 'directions', map_file = 'small.directions' }}\n\
             [[task]]\nname = 'there'\nlandmarks = [{landmarks}]\n"
        ),
    );
    // Regression test: this run, which takes only a few milliseconds, ended before the recorder had received the messages that are
    // sent only once, at the start.
    let ended = place.run("run mission.toml --out out --json");
    let recording = ended.json()["recording"].as_str().unwrap().to_owned();
    (ended.code, place.run(&format!("judge {recording} --json")).json()[0]["journeys"][0].clone())
}

const A: &str = "[0.1, 0.1]";
const B: &str = "[0.17, 0.11]";
const C: &str = "[0.16, 0.16]";

#[test]
fn the_six_kinds_of_success_and_failure_are_distinguished() {
    let all = format!("{A}, {B}, {C}, [0.6, 0.6]");
    // The verdict is followed by the exit code, which depends on the navigator's own estimate. It does not notice when it goes
    // astray.
    for (map, landmarks, kind, says) in [
        // A is in the corner. B and C are in view with equal rank, and the one farther away is meant.
        ("(*, SW)\n(Isol, -)\n", format!("{A}, {C}"), "direct", 0),
        // C is rejected, because two of its quadrants are occupied. With C in the north-east, only A is in view, and A is
        // accepted, because one of its quadrants is occupied.
        ("(*, SW)\n(Isol, (2, NE, Isol), (1, -), -)\n", format!("{A}, {A}"), "recovered", 0),
        // The robot goes by way of C instead of B, but still arrives at B.
        ("(*, SW)\n(Isol, NW)\n(Isol, -)\n", format!("{A}, {B}, {B}"), "unaware", 0),
        ("(*, SE)\n(Isol, -)\n", format!("{A}, {C}"), "cannot locate", 1),
        ("(*, SW)\n(Isol, (4, -), -)\n", format!("{A}, {C}"), "lost", 1),
        ("(*, SW)\n(Isol, -)\n", format!("{A}, {B}"), "astray", 0),
    ] {
        let (code, journey) = ended(map, &landmarks, &all);
        assert_eq!(journey["kind"], kind, "{map}{journey}");
        // The mission doesn't state the goal's position in the world, so the navigator's own report counts.
        assert_eq!(code, Some(says), "{map}{journey}");
    }
}

/// The second entry recognizes B and C by their surroundings. It is meant for B but reaches C, which is farther away.
#[test]
fn a_written_branching_map_is_followed_and_judged_entry_by_entry() {
    let all = format!("{A}, {B}, {C}, [0.6, 0.6]");
    let knows_both = "(*, SW)\n\
                      (Isol, (none+none+point+point, NW, 4), (*, SE, 3), (point+none+none+point, -), -)\n\
                      (Isol, -)\n\
                      (Isol, -)\n";
    let (a, b, c) = (0, 1, 2);
    for (map, landmarks, kind, taken, right) in [
        // The landmarks of the entries 2, 3 and 4, and the goal. Entry 3 is never read.
        (knows_both, format!("{A}, {A}, {C}, {B}"), "recovered", [a, c, b], 3),
        (knows_both, format!("{A}, {C}, {B}, {B}"), "unaware", [a, c, b], 2),
        (knows_both, format!("{A}, {A}, {C}, {A}"), "astray", [a, c, b], 2),
        // North-west of C there is nothing, so entry 3 continues at entry 4 with C in another corner.
        (
            "(*, SW)\n(Isol, SE)\n(Isol, (-, NW, 4), -)\n(Isol, -)\n",
            format!("{A}, {C}, {C}, {B}"),
            "direct",
            [a, c, b],
            3,
        ),
    ] {
        let (code, journey) = ended(map, &landmarks, &all);
        assert_eq!((code, &journey["kind"]), (Some(0), &kind.into()), "{map}{landmarks}: {journey}");
        assert_eq!(journey["attained"], serde_json::json!(taken), "{map}{landmarks}: {journey}");
        assert_eq!((&journey["accepted"], &journey["right"]), (&3.into(), &right.into()), "{journey}");
    }
    // All of its signs differ from the sign of C.
    let knows_neither = "(*, SW)\n(Isol, (group+group+none+none, NW, 1), (group+none+none+group, -), -)\n";
    let (code, journey) = ended(knows_neither, &format!("{A}, {B}"), &all);
    assert_eq!((code, &journey["kind"]), (Some(1), &"lost".into()), "{journey}");
}

#[test]
fn errors_in_a_mission_end_with_exit_code_2() {
    let place = place("hundred.toml");
    let path = place.files().join("mission.toml");
    let text = fs::read_to_string(&path).unwrap();
    let start = text.lines().find(|line| line.starts_with("world = [")).unwrap().to_owned();
    let goal = text.lines().find(|line| line.starts_with("goal")).unwrap().to_owned();
    fs::write(place.files().join("twice.plane.toml"), "dots = [[0.1, 0.2], [0.3, 0.3], [0.1, 0.2]]\n")
        .unwrap();
    fs::write(place.files().join("word.directions"), "(*, SW)\n(IsolPair, -)\n").unwrap();
    fs::write(place.files().join("branch.directions"), "(*, SW)\n(Isol, (3, NE, 7), (2, -), -)\n").unwrap();
    let plain = format!("P2 8 8 255\n{}", "250 ".repeat(64));
    fs::write(place.files().join("plain.png"), plain).unwrap();
    let written = fs::read_to_string(place.files().join("written.toml")).unwrap();
    for (mission, words) in [
        (text.replace(&start, "world = [5.0, 5.0]"), "start (5, 5): expected a landmark in view, found none"),
        (
            text.replacen(&goal, "goal = [5.0, 5.0]", 1),
            "goal (5, 5): expected a dot within a window around it",
        ),
        (text.replace("hundred.plane", "twice.plane"), "dots 1 and 3: expected different places"),
        (text.replace("hundred.png", "plain.png"), "plain.png: expected dots on a plain ground, found none"),
        (text.replace("\"helicopter\"", "\"robotino\""), "[view]"),
        (
            written
                .replace("written.directions", "word.directions")
                .replace("kind = \"directions\"", "kind = \"directions\"\nwords = [\"Isol\", \"*\"]"),
            "word.directions: entry 2: expected a word that the navigator understands, found \"IsolPair\"",
        ),
        (
            written.replace("kind = \"directions\"", "kind = \"directions\"\nmethod = \"belief\""),
            "navigator.method: expected another method with map_file",
        ),
        (
            written.replace("written.directions", "branch.directions"),
            "branch.directions: line 2, column 16: expected a word for a landmark, or the number of an entry of this map",
        ),
    ] {
        fs::write(&path, &mission).unwrap();
        let ended = place.run("run mission.toml");
        assert_eq!(ended.code, Some(2), "{words}: {ended}");
        assert!(ended.err.contains(words), "{words}: {ended}");
    }
}
