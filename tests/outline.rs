//! The method `outline` as processes: what the house gives to every navigator holds for it, too. The planner then keeps a map
//! and an alignment that spreads over many steps.

mod support;

use support::{Place, repository};

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

/// A floor like a U: two arms upwards from a hall.
const FLOOR: &str = r#"name = "arms"
wall_thickness_m = 0.1

[[wall]]
closed = true
points = [[0, 0], [10.5, 0], [10.5, 8], [8, 8], [8, 3], [3, 3], [3, 8.5], [0, 8.5]]
"#;

/// The same in a person's proportions: too wide arms, too low a hall.
const DRAWING: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="640" height="440">
<rect width="640" height="440" fill="#ffffff"/>
<path d="M40 40 L190 44 L186 290 L440 290 L436 50 L600 46 L606 400 L42 396 Z" fill="none" stroke="#202020" stroke-width="6"/>
</svg>
"##;

fn place() -> Place {
    let place = Place::new();
    for (name, text) in [("arms.toml", MISSION), ("arms.floor.toml", FLOOR), ("arms.svg", DRAWING)] {
        std::fs::write(place.files().join(name), text).unwrap();
    }
    place
}

#[test]
fn a_mission_is_driven_replayed_executed_again_and_tells_what_corresponds() {
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

/// Drawn routes are driven as ever: by the filter.
#[test]
fn a_drawn_route_is_followed() {
    let place = place();
    let mission = repository().join("sim/missions/laboratory/laboratory-route.toml");
    place.driven(&format!("{} --method outline", mission.display()));
}
