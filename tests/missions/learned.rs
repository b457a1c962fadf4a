//! The next drive uses the map that a robot learned while driving by a drawing. It starts anywhere, with any heading and without a
//! mark.

use std::fs;

use sketchnav_navigators::read_from;
use sketchnav_recordings::Recording;
use sketchnav_recordings::replay::replay;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_sketch::learned::{Learned, begin, of_drive};
use sketchnav_stage::drawn::See;
use support::{Place, building, repository};

/// Drives the demo's first tasks by its drawing, learns from the drive, and writes `again.toml`. That mission uses the learned map
/// and starts in another room, with the robot's back to the door.
fn learned() -> (Place, String) {
    let place = Place::new();
    building::write(&place.files().join("first.toml"), keep_tasks);
    let recording = place.driven("first.toml");
    let report = place
        .fine(&format!("learn {recording} -o building.learned --map-server map --svg corrected.svg --json"))
        .json();
    let reached: Vec<_> = report["goals"].as_array().unwrap().iter().map(|goal| &goal["reached"]).collect();
    assert_eq!(reached, [true, true, true], "{report:#}");
    assert!(report["seen_m2"].as_f64().unwrap() > 50.0, "{report:#}");
    again(&place, |_| {});
    (place, recording)
}

fn keep_tasks(mission: &mut toml::Table) {
    mission["task"].as_array_mut().unwrap().truncate(3);
}

fn again(place: &Place, edit: impl FnOnce(&mut toml::Table)) {
    building::write(&place.files().join("again.toml"), |mission| {
        keep_tasks(mission);
        mission["start"]["world"] = vec![14.0, 10.4].into();
        mission["start"]["world_heading_deg"] = 100.0.into();
        let navigator = mission["navigator"].as_table_mut().unwrap();
        navigator.remove("start");
        navigator.remove("start_heading_deg");
        navigator.insert("learned_file".into(), "building.learned".into());
        edit(mission);
    });
}

fn read(place: &Place, file: &str) -> Vec<u8> {
    fs::read(place.files().join(file)).unwrap()
}

#[test]
fn the_next_drive_starts_anywhere_in_what_was_learned() {
    let (place, first) = learned();
    assert!(read(&place, "building.learned").len() < 100_000);
    let recording = place.driven("again.toml");
    place.is_reproduced(&recording, &["sketcher", "localizer", "planner"]);
    place.page_says(&recording, &["3 of 3 tasks reached"]);
    // The option does the same as the key of the mission. Rooms by their position are those of the drawing.
    building::write(&place.files().join("marked.toml"), |mission| {
        keep_tasks(mission);
        mission["task"][1]["goal"] = "the room right of office 1".into();
        mission["task"][2]["goal"] = "the room left of the store".into();
    });
    let recording = place.driven("marked.toml --learned building.learned");
    place.page_says(
        &recording,
        &["the room right of office 1 is &quot;office 2&quot; at (731, 307)", "3 of 3 tasks reached"],
    );
    // The learned map depends only on the messages.
    place
        .fine(&format!("replay {first} --live localizer,planner,recorder --rate max --record replayed.mcap"));
    place.fine("learn replayed.mcap -o replayed.learned");
    assert!(read(&place, "replayed.learned") == read(&place, "building.learned"));
    let (map, picture) = (place.files().join("map/building.yaml"), place.files().join("corrected.svg"));
    assert!(
        sketchnav_sim::files::occupancy_map(&map).is_ok()
            && fs::read_to_string(picture).unwrap().contains("0 → 1")
    );
}

/// The second drive leads to a goal that the first one saw but did not drive to. Its observations are added to the map, from which
/// the third drive starts.
#[test]
fn a_drive_in_what_was_learned_teaches_more() {
    let (place, _) = learned();
    let second = place.driven("again.toml");
    let report = place.fine(&format!("learn {second} -o more.learned --svg more.svg --json")).json();
    let more: serde_json::Value = serde_json::from_slice(&read(&place, "more.learned")).unwrap();
    let first: serde_json::Value = serde_json::from_slice(&read(&place, "building.learned")).unwrap();
    assert_eq!(
        [&more["drawing"], &more["goals"], &more["start"]],
        [&first["drawing"], &first["goals"], &first["start"]]
    );
    // The drive ended at its last goal, where the robot waits for the next one.
    let xy = |at: &serde_json::Value| [0, 1].map(|axis| at[axis].as_f64().unwrap());
    let ([x, y], [goal_x, goal_y]) = (xy(&first["end"]["at_m"]), xy(&first["goals"][2]["at_m"]));
    assert!((x - goal_x).hypot(y - goal_y) < 0.6, "{}", first["end"]);
    assert_ne!(more["end"], first["end"]);
    let seen = |learned: &str| {
        let text = String::from_utf8(read(&place, learned)).unwrap();
        Learned::parse(text.as_bytes()).unwrap().map.free_cells()
    };
    let [before, after] = ["building.learned", "more.learned"].map(seen);
    assert!(after > before && after < before + before / 4, "{before} {after}: {report:#}");
    again(&place, |mission| mission["navigator"]["learned_file"] = "more.learned".into());
    place.driven("again.toml");
}

/// The sketcher, the localizer and the planner are killed while the robot localizes itself, and later.
#[test]
fn kills_leave_the_same_bytes() {
    let (place, _) = learned();
    place.is_identical_after("again.toml", 6, "sketcher,localizer,planner");
}

/// A robot with a different laser, drive and size.
#[test]
fn another_robot_drives_in_what_was_learned() {
    let (place, _) = learned();
    again(&place, |mission| {
        mission["robot"] = "turtlebot3".into();
        for task in mission["task"].as_array_mut().unwrap() {
            task.as_table_mut().unwrap().insert("time_limit_s".into(), 400.0.into());
        }
    });
    place.driven("again.toml");
}

/// A recording can be learned from while it is being written, or after its recorder was killed. What was learned depends on its
/// messages only: message by message, it is the same as from a recording that ends there.
#[test]
fn a_recording_that_ends_on_the_way_teaches_what_was_seen_until_then() {
    let (place, whole) = learned();
    let bytes = fs::read(place.files().join(&whole)).unwrap();
    fs::write(place.files().join("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let ended = place.run("learn cut.mcap -o cut.learned --svg cut.svg --json");
    let words =
        "cut.mcap is still being written, or is incomplete; the map covers everything up to the last message";
    assert!(ended.code == Some(0) && ended.err.contains(words) && !ended.err.contains("cut off"), "{ended}");
    let [cut, all] =
        ["cut.learned", "building.learned"].map(|name| Learned::parse(&read(&place, name)).unwrap());
    assert!(cut.map.free_cells() > 100 && cut.map.free_cells() < all.map.free_cells());
    assert!(cut.drawing.is_same(&all.drawing));

    let recording = Recording::open(&place.files().join("cut.mcap")).unwrap();
    let RecordedRun { run, files } = RecordedRun::of(&recording).unwrap();
    let files = read_from(&files);
    // Registers the navigator's channels, which the replay passes on.
    sketchnav_navigators::of(&run.mission).unwrap();
    let mut learning = begin(&run, &files).unwrap();
    let (mut count, mut compared) = (0, 0);
    replay(&recording, "sketch", |spec, message| {
        learning.see(spec, message.bytes(), message.cells());
        count += 1;
        if count % 1000 != 0 {
            return;
        }
        let mut until = |see: &mut See<'_>| {
            let mut left = count;
            replay(&recording, "sketch", |spec, message| {
                if left > 0 {
                    left -= 1;
                    see(spec, message.bytes(), message.cells());
                }
            })?;
            Ok(())
        };
        let again = of_drive(&run, &files, &mut until).map(|(again, _)| again.to_bytes());
        let found = learning.learned().map(|(file, _)| file);
        compared += usize::from(found.is_ok());
        let [found, again] = [found, again].map(|learned| learned.map_err(|error| error.to_string()));
        assert!(found == again, "after {count} messages: {:?} {:?}", found.err(), again.err());
    })
    .unwrap();
    assert!(compared >= 2, "{compared} of {count} messages");
    assert!(learning.learned().unwrap().0 == read(&place, "cut.learned"));
}

/// Drives two drawings of the building, each through another part of it, and learns from both. The second drive begins in a room in
/// which the first one ended, but in another direction, and names its goals.
fn learned_by_two_drawings() -> Place {
    let place = Place::new();
    building::write(&place.files().join("a.toml"), keep_tasks);
    building::write_of("building-b.toml", &place.files().join("b.toml"), |mission| {
        mission["start"]["world"] = vec![14.0, 10.6].into();
        mission["start"]["world_heading_deg"] = 180.0.into();
        mission["navigator"]["start"] = vec![1162, 318].into();
        mission["navigator"]["start_heading_deg"] = 180.0.into();
        let tasks = mission["task"].as_array_mut().unwrap();
        *tasks = tasks[3..6].to_vec();
        for (task, name) in tasks.iter_mut().zip(["kitchen", "print room", "office of the director"]) {
            task.as_table_mut().unwrap().insert("name".into(), name.into());
        }
    });
    for name in ["a", "b"] {
        let recording = place.driven(&format!("{name}.toml"));
        place.fine(&format!("learn {recording} -o {name}.learned"));
        fs::rename(place.files().join(recording), place.files().join(format!("{name}.mcap"))).unwrap();
    }
    place
}

#[test]
fn what_was_learned_by_another_drawing_is_added() {
    let place = learned_by_two_drawings();
    let report = place.fine("learn a.learned --with b.learned -o both.learned --json").json();
    let merged = &report["merged"][0];
    let near = |key: &str, expected: f64, within: f64| {
        let found = merged["motion"][key].as_f64().unwrap();
        assert!((found - expected).abs() < within, "{report:#}");
    };
    // The true starts of the two drives.
    near("x_m", 14.0 - 2.0, 0.3);
    near("y_m", 10.6 - 6.95, 0.3);
    assert!((merged["motion"]["yaw_deg"].as_f64().unwrap().abs() - 180.0).abs() < 1.5, "{report:#}");
    assert_eq!(merged["drawing"], "sketch-b.json");
    let names = ["kitchen", "print room", "office of the director"];
    assert_eq!(merged["added_goals"].as_array().unwrap().as_slice(), names, "{report:#}");
    assert!(merged["added_floor_m2"].as_f64().unwrap() > 40.0, "{report:#}");
    let [a, both] = ["a.learned", "both.learned"].map(|name| Learned::parse(&read(&place, name)).unwrap());
    assert!(both.drawing.is_same(&a.drawing) && both.goals.len() == 6 && both.pairs == a.pairs);

    // The robot stands in a room that only the drive by the other drawing saw. Its goals are one of that drive, by its name, a
    // place in this drawing that only the other drive saw, and one of this drive.
    building::write(&place.files().join("again.toml"), |mission| {
        mission["start"]["world"] = vec![26.9, 10.4].into();
        mission["start"]["world_heading_deg"] = 30.0.into();
        let navigator = mission["navigator"].as_table_mut().unwrap();
        navigator.remove("start");
        navigator.remove("start_heading_deg");
        navigator.insert("learned_file".into(), "both.learned".into());
        let tasks = mission["task"].as_array_mut().unwrap();
        *tasks = [3, 4, 1].map(|k| tasks[k].clone()).to_vec();
        tasks[0].as_table_mut().unwrap().insert("goal".into(), "Kitchen".into());
        for task in tasks {
            task.as_table_mut().unwrap().insert("time_limit_s".into(), 200.0.into());
        }
    });
    let recording = place.driven("again.toml");
    place.is_reproduced(&recording, &["sketcher", "localizer", "planner"]);
    place.page_says(&recording, &["3 of 3 tasks reached"]);
    let refused = place.run("run again.toml --learned a.learned");
    assert!(refused.code == Some(2) && refused.err.contains("\"Kitchen\""), "{refused}");

    // The other way round, from the recordings, and several at once.
    let text =
        place.fine("learn b.mcap --with a.mcap --with a.learned -o swapped.learned --svg swapped.svg").out;
    let words = ["merged     a.mcap, by sketch-a.svg: moved by (", "added 0 m² of floor and no goals"];
    assert!(words.iter().all(|words| text.contains(words)), "{text}");
    let swapped = Learned::parse(&read(&place, "swapped.learned")).unwrap();
    assert_eq!((swapped.drawing.file.as_str(), swapped.goals.len()), ("sketch-b.json", 6));
    let [many, fewer] = [&swapped, &both].map(|learned| learned.map.free_cells());
    assert!(many.abs_diff(fewer) < fewer / 20, "{many} {fewer}");
    place.fine("learn b.learned --with a.learned --with a.learned -o again.learned");
    assert!(read(&place, "again.learned") == read(&place, "swapped.learned"));
}

#[test]
fn learned_maps_that_cannot_be_combined_are_refused() {
    let place = learned_by_two_drawings();
    let write = |name: &str, content: &[u8]| fs::write(place.files().join(name), content).unwrap();
    let a = String::from_utf8(read(&place, "a.learned")).unwrap();
    write("cut.learned", &a.as_bytes()[..a.len() / 2]);
    // The map without what the laser saw, that of an empty room, which looks the same after half a turn, and that of a chamber, which
    // is too small.
    let mut map: serde_json::Value = serde_json::from_str(&a).unwrap();
    map["map"]["rows"] = ["200u"; 140].as_slice().into();
    map["map"]["width"] = 200.into();
    write("unseen.learned", map.to_string().as_bytes());
    let wall = ["10u180o10u"; 2];
    let rows = [&["200u"; 10][..], &wall, &["10u2o176f2o10u"; 116], &wall, &["200u"; 10]].concat();
    map["map"]["rows"] = rows.into();
    write("empty.learned", map.to_string().as_bytes());
    map["map"]["rows"] = [&["10u40o150u"][..], &["10u1o38f1o150u"; 38], &["10u40o150u"]].concat().into();
    write("small.learned", map.to_string().as_bytes());
    let refused = |line: &str, words: &[&str]| {
        let ended = place.run(line);
        let is_refused = ended.code == Some(2) && words.iter().all(|words| ended.err.contains(words));
        assert!(is_refused, "{line}: {ended}");
    };
    for (line, words) in [
        ("a.learned --with b.learned", &["a.learned: expected --output"][..]),
        ("a.learned --with b.learned -o a.learned", &["expected a file other than the input"]),
        ("a.learned --with b.learned -o b.learned", &["expected a file other than the input"]),
        (
            "a.learned --with b.learned -o c.learned --svg c.svg",
            &["a.learned: expected a recording for --svg"],
        ),
        ("a.learned --with cut.learned -o c.learned", &["cut.learned", "expected a learned map"]),
        ("a.learned --with none.learned -o c.learned", &["none.learned"]),
        ("a.learned --with a.toml -o c.learned", &["a.toml"]),
        (
            "a.learned --with unseen.learned -o c.learned",
            &["a.learned with unseen.learned: expected walls in both maps, found none in the second one"],
        ),
        (
            "a.learned --with small.learned -o c.learned",
            &["a.learned with small.learned: expected maps that overlap, found at most"],
        ),
        (
            "empty.learned --with empty.learned -o c.learned",
            &["empty.learned with empty.learned: expected one way to lay the maps on each other", "180°"],
        ),
    ] {
        refused(&format!("learn {line}"), words);
    }
    assert!(!place.files().join("c.learned").exists());
    assert!(read(&place, "a.learned") == a.as_bytes());
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let (place, first) = learned();
    let refused = |line: &str, words: &[&str]| {
        let ended = place.run(line);
        assert!(
            ended.code == Some(2) && words.iter().all(|words| ended.err.contains(words)),
            "{line}: {ended}"
        );
    };
    let write = |name: &str, content: &[u8]| fs::write(place.files().join(name), content).unwrap();
    let text = String::from_utf8(read(&place, "building.learned")).unwrap();
    write("newer.learned", text.replace("\"learned\": 2", "\"learned\": 7").as_bytes());
    write("cut.learned", &text.as_bytes()[..text.len() / 2]);
    refused("run first.toml --learned newer.learned", &["newer.learned", "expected version 1 or 2, found 7"]);
    refused("run first.toml --learned cut.learned", &["cut.learned", "expected a learned map"]);
    refused("run first.toml --learned none.learned", &["none.learned"]);
    refused("run first.toml --learned building.learned --method boniardi-2015", &["navigator.method"]);
    let corridor = repository().join("sim/missions/corridor/corridor-qtc.toml");
    refused(
        &format!("run {} --learned building.learned", corridor.display()),
        &["learned_file", "expected `method`"],
    );
    let other = repository().join("sim/missions/building/sketch-b.json");
    again(&place, |mission| mission["navigator"]["drawing"] = other.to_str().unwrap().into());
    refused("run again.toml", &["navigator.learned_file", "sketch-b.json", "learned by sketch-a.svg"]);
    again(&place, |mission| mission["task"][0]["goal"] = vec![1993, 883].into());
    refused("run again.toml", &["task 1 (0 → 1) at (1993, 883)", "expected a place that the robot saw"]);
    refused(&format!("learn {first} -o {first}"), &["expected a file other than the input"]);
}
