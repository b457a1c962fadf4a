//! A small mission in two rooms of three by four metres with a door between them, drawn at 100 pixels per metre. The
//! only task leads from the left room into the right one.

use std::fs;
use std::path::Path;

use nix::sys::signal::Signal;

use super::Running;

/// The name of the mission file.
pub const MISSION: &str = "room.toml";
/// The name of the drawing.
pub const DRAWING: &str = "room.svg";
/// The name of the floor plan.
pub const FLOOR: &str = "room.floor.toml";

const MISSION_TEXT: &str = r#"name = "room"
robot = "robotino"

[world]
floor_plan = "room.floor.toml"

[start]
world = [1.0, 1.0]
world_heading_deg = 0

[navigator]
kind = "sketch"
drawing = "room.svg"
start = [120, 320]
start_heading_deg = 0

[[task]]
name = "next door"
goal = [500, 120]
there = { center = [4.8, 3.0], radius_m = 1.2 }
time_limit_s = 60
"#;

const DRAWING_TEXT: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="640" height="440">
<rect width="640" height="440" fill="#ffffff"/>
<g fill="none" stroke="#202020" stroke-width="6">
<rect x="20" y="20" width="600" height="400"/>
<line x1="320" y1="20" x2="320" y2="160"/>
<line x1="320" y1="280" x2="320" y2="420"/>
</g>
</svg>
"##;

const FLOOR_TEXT: &str = r#"name = "room"
wall_thickness_m = 0.1

[[wall]]
closed = true
points = [[0, 0], [6, 0], [6, 4], [0, 4]]

[[wall]]
points = [[3, 0], [3, 4]]

[[door]]
at = [3, 2]
width_m = 1.2
"#;

/// A mission in this room for the wall followers of `tests/stranger`.
pub const ALONG_THE_WALL: &str = r#"name = "along the wall"
robot = "nomad200"

[world]
floor_plan = "room.floor.toml"

[start]
world = [1.0, 1.0]
world_heading_deg = 0

[navigator]
kind = "wall-follower"

[[task]]
name = "there"
seconds = 60.0
there = { polygon = [[0, 0], [6, 0], [6, 4], [0, 4]] }

[[task]]
name = "and on"
seconds = 40
"#;

/// Writes the mission and its files into a folder.
pub fn write(folder: &Path) {
    for (file, text) in [(MISSION, MISSION_TEXT), (DRAWING, DRAWING_TEXT), (FLOOR, FLOOR_TEXT)] {
        fs::write(folder.join(file), text).unwrap();
    }
}

/// Replaces the only occurrence of `old` in a file.
pub fn replace(folder: &Path, file: &str, old: &str, new: &str) {
    let path = folder.join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text.matches(old).count(), 1, "{file}: {old}");
    fs::write(path, text.replace(old, new)).unwrap();
}

/// Fails unless the mission ends at its goal while `bridge` connects it to `robot`, a robot simulated by another
/// program. When that program is asked to end, it writes its position and its last command.
pub fn assert_driven_to_its_goal(mission: Running, bridge: Running, robot: Running) {
    let report = mission.end().json();
    assert_eq!(report["tasks"][0]["state"], "reached", "{report:#}");
    assert_eq!(report["lost_messages"], 0, "{report:#}");
    let ended = bridge.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    robot.signal(Signal::SIGTERM);
    let output = robot.end();
    let place_and_command = output.out.split_whitespace().map(|word| word.parse::<f64>().unwrap());
    let [x, y, speed, turn] = place_and_command.collect::<Vec<_>>()[..] else { panic!("{output}") };
    assert!((4.8 - x).hypot(3.0 - y) < 1.2, "{output}");
    assert_eq!((speed, turn), (0.0, 0.0), "ordered to stand still at the end: {output}");
}
