//! A small mission for the method `outline`. Two arms lead upwards from a hall, and the drawing has the proportions
//! that a person would give them. The only task leads from the left arm into the right one.

use std::fs;

use super::Place;

/// The mission.
const MISSION: &str = r#"name = "arms"
robot = "robotino"

[world]
floor_plan = "arms.floor.toml"

[start]
world = [1.5, 7.0]
world_heading_deg = -90

[navigator]
kind = "sketch"
method = "outline"
drawing = "arms.svg"
start = [110, 80]
start_heading_deg = -90

[parameters.planner]
# By the outline, however narrow the hall is drawn.
least_open_share = 0.0

[[task]]
name = "the upper arm's end"
goal = [520, 90]
there = { center = [9.2, 6.6], radius_m = 1.6 }
time_limit_s = 200
"#;

/// A U-shaped floor with two arms that lead upwards from a hall.
const FLOOR: &str = r#"name = "arms"
wall_thickness_m = 0.1

[[wall]]
closed = true
points = [[0, 0], [10.5, 0], [10.5, 8], [8, 8], [8, 3], [3, 3], [3, 8.5], [0, 8.5]]
"#;

/// The same floor in a person's proportions: the arms are too wide and the hall is too low.
const DRAWING: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="640" height="440">
<rect width="640" height="440" fill="#ffffff"/>
<path d="M40 40 L190 44 L186 290 L440 290 L436 50 L600 46 L606 400 L42 396 Z" fill="none" stroke="#202020" stroke-width="6"/>
</svg>
"##;

/// Creates a place with the mission `arms.toml` and its files.
pub fn place() -> Place {
    let place = Place::new();
    for (name, text) in [("arms.toml", MISSION), ("arms.floor.toml", FLOOR), ("arms.svg", DRAWING)] {
        fs::write(place.files().join(name), text).unwrap();
    }
    place
}

/// Like [`place`], but with margins so wide that every match with a rival is in doubt. The two arms then look alike, so
/// the person at the pad is asked.
pub fn doubtful() -> Place {
    let place = place();
    let parameters =
        "least_open_share = 0.0\nrival_margin = 1000.0\nask_margin = 1000.0\nask_patience_s = 60.0";
    let mission = MISSION.replace("least_open_share = 0.0", parameters).replace("= 200", "= 600");
    fs::write(place.files().join("arms.toml"), mission).unwrap();
    place
}
