//! A surveyed map serves as the drawing. Regression test: without `method`, the robot drove by `outline`, which does not rely on the
//! proportions of the map, and timed out in some maps.

use std::fs;
use support::Place;

/// Width and height of the map, in cells of 0.05 m.
const SIZE: [usize; 2] = [220, 160];

const MISSION: &str = r#"
name = "in-my-map"
robot = "robotino"
world = { map = "flat.yaml" }
start = { world = [1.0, 1.0], world_heading_deg = 0 }
[navigator]
kind = "sketch"
drawing = "flat.pgm"
start = [30, 130]
start_heading_deg = 0
[[task]]
name = "kitchen"
goal = [180, 125]
there = { center = [8.5, 1.25], radius_m = 0.5 }
[[task]]
name = "bedroom"
goal = [170, 40]
there = { center = [8.0, 5.5], radius_m = 0.5 }
[[task]]
name = "hall"
goal = [40, 40]
there = { center = [1.5, 5.5], radius_m = 0.5 }
"#;

/// Returns the tone of map_server for a cell: a flat of 10 × 7 m with two rooms beside a hall, amid what was never seen.
fn tone(column: usize, row: usize) -> u8 {
    let is_inside = (11..209).contains(&column) && (11..149).contains(&row);
    let is_border = (9..211).contains(&column) && (9..151).contains(&row);
    let is_wall = (115..118).contains(&column) && !(35..55).contains(&row) && !(105..125).contains(&row)
        || (118..209).contains(&column) && (80..83).contains(&row)
        || (60..75).contains(&column) && (60..90).contains(&row);
    match (is_inside && !is_wall, is_border) {
        (true, _) => 254,
        (false, true) => 0,
        (false, false) => 205,
    }
}

#[test]
fn a_robot_drives_in_a_surveyed_map_by_the_proportions_unless_a_method_is_named() {
    let place = Place::new();
    let write = |name: &str, content: &[u8]| fs::write(place.files().join(name), content).unwrap();
    let cells = (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| tone(column, row)));
    let picture: Vec<u8> = b"P5\n220 160\n255\n".iter().copied().chain(cells).collect();
    write("flat.pgm", &picture);
    write("flat.yaml", b"image: flat.pgm\nresolution: 0.05\norigin: [-0.5, -0.5, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
    write("flat.toml", MISSION.as_bytes());
    for (line, method) in [("flat.toml", "beam"), ("flat.toml --method outline", "outline")] {
        let recording = place.driven(line);
        let is_aligned = place.messages(&recording).contains_key("/correspondence");
        assert_eq!(is_aligned, method == "outline", "{line}: only `outline` aligns outlines");
        // Regression test: the figures once stated the method of a drawing, `outline`, in either case.
        let judged = place.fine(&format!("judge --json {recording}")).json();
        assert_eq!(judged[0]["method"], method, "{line}");
    }
}
