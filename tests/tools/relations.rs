//! `sketchnav relations` computes how objects relate to each other over time, from a table and from a recording.

use std::process::Command;

use serde_json::Value;
use support::{Ended, Place, repository};

/// A human and a robot that approach each other. The human arrives first.
const ENCOUNTER: &str = "time_s,object,x_m,y_m\n\
    0.0,human,0,0\n0.0,robot,5,0.5\n0.1,human,1,0\n0.1,robot,4,0.5\n0.2,human,2,0\n0.2,robot,4,0.5\n\
    0.3,human,2,0\n0.3,robot,3,0.5\n";

fn relations(answer: &Value) -> Vec<(String, String)> {
    let held = answer["series"][0]["relations"].as_array().unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    held.iter().map(|held| (text(&held["relation"]), text(&held["change"]))).collect()
}

#[test]
fn a_table_of_positions_yields_the_relations_of_an_encounter() {
    let place = Place::new();
    std::fs::write(place.files().join("encounter.csv"), ENCOUNTER).unwrap();
    let answer = place.run("relations encounter.csv --calculus qtc-b --json").json();
    assert_eq!(answer["calculus"], "qtc-b");
    assert_eq!(answer["series"][0]["between"], serde_json::json!(["human", "robot"]));
    let story = [("-,-", "first"), ("-,0", "neighbour"), ("0,0", "inserted"), ("0,-", "neighbour")];
    let story: Vec<_> = story.map(|(relation, change)| (relation.to_owned(), change.to_owned())).into();
    assert_eq!(relations(&answer), story);
    // With the objects swapped, the signs are swapped.
    let turned = place.run("relations encounter.csv --calculus qtc-b --between robot,human --json").json();
    assert_eq!(relations(&turned)[1].0, "0,-");
    let csv = place.run("relations encounter.csv --calculus argd --csv");
    assert_eq!(csv.out.lines().next(), Some("between,from_s,to_s,relation,change"), "{csv}");
    assert!(csv.out.contains("human robot,0.000,0.000,far,first"), "{csv}");
    assert!(csv.out.contains("human robot,0.200,0.300,near,neighbour"), "{csv}");
}

#[test]
fn boxes_and_headings_are_related_by_intervals_and_oriented_points() {
    let place = Place::new();
    let table = "time_s,object,x_m,y_m,heading_deg,length_m,width_m\n\
        0.0,cart,0,0,90,2,1\n0.0,door,3,0,0,2,1\n0.1,cart,1,0,90,2,1\n0.1,door,3,0,0,2,1\n";
    std::fs::write(place.files().join("boxes.csv"), table).unwrap();
    let words = |calculus: &str| {
        let answer = place.run(&format!("relations boxes.csv --calculus {calculus} --json")).json();
        relations(&answer).into_iter().map(|(word, _)| word).collect::<Vec<_>>()
    };
    assert_eq!(words("allen"), ["<", "m"]);
    // The door is on the right of the cart, and the cart behind the door.
    assert_eq!(words("opra-1"), ["3_2"]);
    assert_eq!(words("opra-4"), ["12_8"]);
    // As dipoles of two metres, the door is on the right of the cart, which begins on its right and ends on its left.
    assert_eq!(words("dra-f"), ["rrrl"]);
    assert_eq!(words("dra-c"), ["rrrl"]);
    // The cart is behind the door, whose heading is east: the eighth of sixteen directions.
    assert_eq!(words("forces"), ["8 satisfactory"]);
}

#[test]
fn a_third_point_is_on_the_way_of_two_others() {
    let place = Place::new();
    let table =
        "time_s,object,x_m,y_m\n0.0,a,0,0\n0.0,b,4,0\n0.0,c,2,1\n0.1,a,0,0\n0.1,b,4,0\n0.1,c,2,0.05\n";
    std::fs::write(place.files().join("way.csv"), table).unwrap();
    let found = |calculus: &str| {
        relations(
            &place.run(&format!("relations way.csv --calculus {calculus} --tolerance-m 0.1 --json")).json(),
        )
    };
    assert_eq!(found("flipflop"), [("l".into(), "first".into()), ("i".into(), "neighbour".into())]);
    assert_eq!(found("doublecross"), [("lc".into(), "first".into()), ("sc".into(), "neighbour".into())]);
}

#[test]
fn thresholds_are_the_greatest_or_the_least_distances_of_their_labels() {
    let place = Place::new();
    std::fs::write(place.files().join("encounter.csv"), ENCOUNTER).unwrap();
    let words = |options: &str| {
        let command = format!("relations encounter.csv --calculus argd --every-sample --json {options}");
        relations(&place.run(&command).json()).into_iter().map(|(word, _)| word).collect::<Vec<_>>()
    };
    // The distances are 5.02, 3.04, 2.06 and 1.12 m.
    let thresholds = "--thresholds near=1.1,medium=2.5,far=4.0";
    assert_eq!(words(thresholds), ["far", "far", "medium", "medium"]);
    assert_eq!(words(&format!("{thresholds} --bound lower")), ["far", "medium", "near", "near"]);
}

#[test]
fn speeds_of_an_encounter_are_compared() {
    let place = Place::new();
    std::fs::write(place.files().join("encounter.csv"), ENCOUNTER).unwrap();
    let words = |calculus: &str| {
        let answer = place
            .run(&format!("relations encounter.csv --calculus {calculus} --observed-only --json"))
            .json();
        relations(&answer).into_iter().map(|(word, _)| word).collect::<Vec<_>>()
    };
    assert_eq!(words("qtc-b22"), ["-,-,0", "-,0,+", "0,-,-"]);
    assert_eq!(words("qtc-c22"), ["-,-,+,+,0,0", "-,0,+,0,+,0", "0,-,0,+,-,0"]);
}

/// People were once not recorded, so their relations could not be computed afterwards.
#[test]
fn a_recording_yields_the_relations_of_the_robot_and_every_person() {
    let place = Place::new();
    let mission = repository().join("sim/missions/building/building-a.toml");
    let text = std::fs::read_to_string(&mission).unwrap();
    // The mission is shortened to one task, limited to four seconds.
    let end = text.match_indices("[[task]]").nth(1).unwrap().0;
    let short = text[..end].replace("time_limit_s = 60.0", "time_limit_s = 4.0");
    for file in ["building.floor.toml", "sketch-a.svg"] {
        std::fs::copy(mission.with_file_name(file), place.files().join(file)).unwrap();
    }
    std::fs::write(place.files().join("short.toml"), short).unwrap();
    let (report, _) = place.mission("run short.toml --out results", "relations");
    let recording = report["recording"].as_str().unwrap();
    let answer = place.run(&format!(
        "relations {recording} --calculus qtc-c --between robot,person-1 --quantisation-m 0.001 --json"
    ));
    let held = relations(&answer.json());
    assert!(held.len() > 1 && held[0].1 == "first", "{answer}");
    let boxes = place.run(&format!("relations {recording} --calculus rcc8 --json")).json();
    assert!(boxes["series"].as_array().unwrap().len() >= 3, "the robot and two people or more: {boxes}");
    let wrong = place.run(&format!("relations {recording} --calculus qtc-b --between robot,person-99"));
    assert_eq!(wrong.code, Some(2), "{wrong}");
    assert!(
        wrong.err.contains("--between: expected some of robot, person-1") && wrong.err.contains("person-99"),
        "{wrong}"
    );
}

#[test]
fn errors_in_tables_and_options_name_the_line_and_the_expectation() {
    let place = Place::new();
    let write = |name: &str, text: &str| std::fs::write(place.files().join(name), text).unwrap();
    write("no-y.csv", "time_s,object,x_m\n0,a,1\n");
    write("nan.csv", &format!("{ENCOUNTER}0.4,robot,NaN,0\n"));
    write("good.csv", ENCOUNTER);
    for (arguments, words) in [
        ("no-y.csv --calculus qtc-b", "no-y.csv: line 1: expected a column \"y_m\""),
        ("nan.csv --calculus qtc-b", "nan.csv: line 10: x_m: expected a number within ± 1e7, found \"NaN\""),
        ("missing.csv --calculus qtc-b", "missing.csv: expected a table of positions, found no such file"),
        ("good.csv --calculus rcc8", "expected the columns length_m and width_m"),
        ("good.csv --calculus dra-f", "expected the columns length_m and width_m for a calculus of dipoles"),
        ("good.csv --calculus forces", "expected the columns length_m and width_m"),
        ("good.csv --calculus argd --bound middle", "possible values: upper, lower"),
        ("good.csv --calculus tpcc", "expected 3 objects or more, found human, robot"),
        ("good.csv --calculus qtc-b --between human", "--between: qtc-b expected 2 objects, found 1"),
        ("good.csv --calculus qtc-b --between human,human", "--between: expected different objects"),
        (
            "good.csv --calculus argd --thresholds near=x",
            "--thresholds: expected LABEL=METRES, found \"near=x\"",
        ),
        ("good.csv --calculus argd --thresholds near=-1", "expected a finite number above 0, found -1"),
        ("good.csv --calculus qtc-b --quantisation-m=-1", "quantisation distance: expected"),
        ("good.csv --calculus nonsense", "possible values: qtc-b"),
    ] {
        let ended = place.run(&format!("relations {arguments}"));
        assert_eq!(ended.code, Some(2), "{arguments}: {ended}");
        assert!(ended.err.contains(words), "{arguments}: {ended}");
    }
}

#[test]
fn the_relations_of_arrays_in_python_are_those_of_their_definitions() {
    let modules = "numpy, sketchnav._core";
    let Some(python) = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", modules) else { return };
    for tests in ["test_relations.py", "test_qsrlib.py"] {
        let tests = repository().join("python/tests").join(tests);
        let ended: Ended = Command::new(&python).arg(tests).output().unwrap().into();
        assert_eq!(ended.code, Some(0), "{ended}");
    }
}

/// The command and the package use the same library, so they compute the same relations from a table.
#[test]
fn the_command_and_python_find_the_same_relations_in_a_table() {
    let modules = "numpy, sketchnav._core";
    let Some(python) = needs::python("wheel", "SKETCHNAV_WHEEL_PYTHON", modules) else { return };
    let place = Place::new();
    std::fs::write(place.files().join("encounter.csv"), ENCOUNTER).unwrap();
    let script = "import json, numpy\nfrom sketchnav import relations\n\
        rows = numpy.genfromtxt('encounter.csv', delimiter=',', skip_header=1, usecols=(0, 2, 3))\n\
        time_s, human, robot = rows[::2, 0], rows[::2, 1:], rows[1::2, 1:]\n\
        found = relations.QtcC(0.1).series(human, robot, time_s=time_s)\n\
        print(json.dumps([timed._asdict() for timed in found]))\n";
    let ended: Ended =
        Command::new(python).args(["-c", script]).current_dir(place.files()).output().unwrap().into();
    let told = place.run("relations encounter.csv --calculus qtc-c --quantisation-m 0.1 --json").json();
    assert_eq!(ended.json(), told["series"][0]["relations"], "{ended}");
}
