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
    let words = "cut.mcap is still being written, or its recorder was killed; the map covers everything up to the last message";
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
