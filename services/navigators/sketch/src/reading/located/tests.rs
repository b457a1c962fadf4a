//! Tests of goals that are rooms by their position, in a flat of which few rooms have a name.

use serde_json::json;
use sketchnav_schemas::mission::Mission;

use super::*;
use crate::reading::{ImageTask, Intent, Options, Settings, read};

/// ```text
/// ┌─────────┬────────┬───────────┐
/// │ kitchen │        │   bath    │
/// ├──   ────┴──   ───┴───   ─────┤
/// │ corridor, without a name     │
/// ├────   ────────┬───   ────────┤
/// │    lounge     ├──────────────┤
/// │                    store     │
/// └───────────────┴──────────────┘
/// ```
fn flat() -> DrawnMap {
    drawing(json!([
        { "points": [[100, 100], [900, 100], [900, 700], [100, 700], [100, 100]] },
        { "points": [[350, 100], [350, 350]] }, { "points": [[600, 100], [600, 350]] },
        { "points": [[100, 350], [200, 350]] }, { "points": [[260, 350], [440, 350]] },
        { "points": [[500, 350], [720, 350]] }, { "points": [[780, 350], [900, 350]] },
        { "points": [[100, 450], [270, 450]] }, { "points": [[330, 450], [670, 450]] },
        { "points": [[730, 450], [900, 450]] },
        { "points": [[500, 450], [500, 600]] }, { "points": [[500, 660], [500, 700]] },
        { "points": [[500, 575], [900, 575]] },
    ]))
}

fn drawing(strokes: serde_json::Value) -> DrawnMap {
    let labels = json!([
        { "text": "kitchen", "at": [200, 180] }, { "text": "Bath", "at": [750, 225] },
        { "text": "lounge", "at": [300, 575] }, { "text": "store", "at": [700, 640] },
    ]);
    let page = json!({ "canvas": [1000, 800], "strokes": strokes, "labels": labels });
    read(page.to_string().as_bytes(), "flat.json", &Options::default()).unwrap()
}

fn mission(goal: &str) -> SketchMission {
    let text = format!(
        "name = 'm'\nrobot = 'robotino'\nworld = {{ map = 'm.yaml' }}\n\
         start = {{ world = [0, 0], world_heading_deg = 0 }}\n\
         [navigator]\nkind = 'sketch'\ndrawing = 'flat.json'\nstart = [150, 400]\nstart_heading_deg = 0\n\
         places = {{ 'coffee machine' = [850, 420] }}\n\
         [[task]]\nname = 'there'\ngoal = '{goal}'\n"
    );
    SketchMission::of(&Mission::parse(&text).unwrap()).unwrap()
}

/// Returns the goal in image pixels, rounded to tens, and what it was resolved to.
fn found(drawing: &DrawnMap, goal: &str) -> Result<([f64; 2], Option<String>), String> {
    let intent = Intent::of_mission(&mission(goal), drawing);
    let intent = intent.map_err(|error| error.to_string())?;
    let places = intent.place(drawing, &Settings::default()).map_err(|error| error.to_string())?;
    let at = drawing.to_image(&places.tasks[0].end()).map(|px| (px / 10.0).round() * 10.0);
    Ok((at, intent.tasks[0].resolved.clone()))
}

#[test]
fn a_room_without_a_name_is_found_by_its_neighbours() {
    let flat = flat();
    for goal in [
        "the room right of the kitchen",
        "the room to the left of bath",
        "The Room between Kitchen and the Bath",
        "room between bath and kitchen",
        "the room left of the room right of the room right of the kitchen",
    ] {
        let (at, words) = found(&flat, goal).unwrap();
        assert!((at[0] - 475.0).abs() < 40.0 && (at[1] - 225.0).abs() < 40.0, "{goal}: {at:?}");
        let words = words.unwrap();
        assert!(words.ends_with(" is the one at (475, 227)"), "{words}");
    }
    let (at, _) = found(&flat, "the room below the kitchen").unwrap();
    assert!((at[1] - 400.0).abs() <= 10.0, "the corridor is a room: {at:?}");
    let (at, _) = found(&flat, "the room above store").unwrap();
    assert!((at[1] - 510.0).abs() <= 20.0 && at[0] > 500.0, "{at:?}");
}

#[test]
fn a_room_with_a_name_is_called_by_it_and_driven_to_as_by_its_name() {
    let flat = flat();
    for (goal, name, at) in [
        ("the room nearest to the store", "lounge", [300.0, 580.0]),
        ("the room above the room below the kitchen", "", [0.0; 2]),
        ("the room above the coffee machine", "Bath", [750.0, 230.0]),
        // Errors listed the rooms in diagonal directions, but nobody could ask for them.
        ("the room above right of the lounge", "Bath", [750.0, 230.0]),
        ("the room left of the room right of the lounge", "", [0.0; 2]),
    ] {
        match found(&flat, goal) {
            Ok((found, words)) => {
                assert_eq!(found, at, "{goal}");
                let words = words.unwrap();
                assert!(words.starts_with(&format!("{goal} is {name:?} at (")), "{words}");
            }
            Err(error) => assert!(name.is_empty() && error.contains("expected one room"), "{goal}: {error}"),
        }
    }
    assert_eq!(found(&flat, "kitchen").unwrap().1, None, "a name needs no explanation");
    assert_eq!(found(&flat, "the kitchen").unwrap().0, [200.0, 180.0], "an article does no harm");
}

#[test]
fn several_rooms_are_listed_and_none_is_chosen() {
    let flat = flat();
    let error = found(&flat, "the room above left of the store").unwrap_err();
    assert!(error.contains("expected one room above left of the store in flat.json, found \"kitchen\" at (200, 180), a room at (475, 227)"), "{error}");
    let error = found(&flat, "the room right of the lounge").unwrap_err();
    assert!(
        error.starts_with("task 1 (there).goal: expected one room right of the lounge in flat.json, found ")
            && error.contains("\"store\" at (700, 640)")
            && error.contains("a room at (")
            && error.ends_with("; name the one that you mean on the drawing or in navigator.places"),
        "{error}"
    );
}

#[test]
fn where_no_room_is_the_neighbours_are_listed() {
    let error = found(&flat(), "the room left of the kitchen").unwrap_err();
    assert!(
        error.starts_with("task 1 (there).goal: expected a room left of the kitchen in flat.json, found right of the kitchen a room at (")
            && error.contains("; below the kitchen a room at ("),
        "{error}"
    );
    let open = drawing(json!([{ "points": [[100, 100], [900, 100]] }]));
    let error = found(&open, "the room left of the kitchen").unwrap_err();
    assert!(
        error.ends_with("expected a room left of the kitchen in flat.json, found no rooms at all"),
        "{error}"
    );
}

#[test]
fn words_that_are_no_relation_are_answered_with_those_that_are() {
    let flat = flat();
    for (goal, words) in [
        (
            "the room behind the kitchen",
            "task 1 (there).goal: expected the name of a place, found \"the room behind the kitchen\"; a room without a name is \
             \"the room\" left of, right of, above, below or nearest to a place, or between two, as in \"the room left of the \
             kitchen\"",
        ),
        (
            "the room left of the kichen",
            "task 1 (there).goal: expected the name of a place, found \"kichen\"; did you mean \"kitchen\"?",
        ),
        (
            "the room left of",
            "task 1 (there).goal: expected the name of a place after \"left of\", found nothing in \"the room left of\"; write it as \
             in \"the room left of the kitchen\"",
        ),
    ] {
        assert_eq!(found(&flat, goal).unwrap_err(), words);
    }
}

/// Whoever writes on the drawing what reads like a relation means the name.
#[test]
fn a_name_comes_before_a_relation() {
    let flat = flat();
    let mission = SketchMission {
        places: [("the room right of the kitchen".to_owned(), [750.0, 510.0])].into(),
        ..mission("x")
    };
    let found = Atlas::of(&mission, &flat).find("goal", "The room right of the kitchen").unwrap();
    assert_eq!(found, Located { at: [750.0, 510.0], room: None });
}

/// `send goal the room left of thare` used to suggest the task "there", whose name is no place, and refused it in turn.
#[test]
fn a_task_is_only_suggested_where_it_can_be_meant() {
    let flat = flat();
    let error = |goal: &str| ImageTask::named(goal, &mission("kitchen"), &flat).unwrap_err().to_string();
    assert!(error("thare").ends_with("; did you mean the task \"there\"?"), "{}", error("thare"));
    for goal in ["the room left of thare", "the room left of there", "the room between bath and thare"] {
        let error = error(goal);
        assert!(error.ends_with("; there are Bath, coffee machine, kitchen, lounge, store"), "{error}");
    }
}

#[test]
fn a_person_is_told_the_name_of_the_room() {
    let flat = flat();
    let task = ImageTask::named("the room nearest to the store", &mission("kitchen"), &flat).unwrap();
    assert_eq!((task.name.as_str(), task.resolved.is_some()), ("lounge", true));
    let task = ImageTask::named("the room right of the kitchen", &mission("kitchen"), &flat).unwrap();
    assert_eq!(task.name, "room at (475, 227)");
}
