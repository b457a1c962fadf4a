use proptest::prelude::*;
use sketchnav_mapping::{Cell, Map};
use sketchnav_schemas::geometry::Pose;

use super::*;
use crate::reading::{DrawnMap, Intent, Options, SketchError, read};

/// A room of 4 × 3 m with a wall to the left of its middle, seen from its lower left corner.
fn room() -> Learned {
    let (width, height) = (90, 70);
    let cell = |index: usize| {
        let (column, row) = (index % width, index / width);
        let inside = (5..85).contains(&column) && (5..65).contains(&row);
        let border = (4..=85).contains(&column) && (4..=65).contains(&row);
        match (inside, border) {
            (true, _) if column == 40 && row > 25 => Cell::Occupied,
            (true, _) => Cell::Free,
            (false, true) => Cell::Occupied,
            (false, false) => Cell::Unknown,
        }
    };
    let map = LearnedMap { origin_m: [-1.0, -1.0], width, cells: (0..width * height).map(cell).collect() };
    let goal = |task: &str, at, at_m: Option<[f64; 2]>| Goal {
        task: task.to_owned(),
        at,
        at_m,
        reached: at_m.is_some(),
    };
    let goals = vec![goal("corner", [300.0, 100.0], Some([2.5, 1.5])), goal("beyond", [700.0, 100.0], None)];
    // The drawing is 100 px/m and has its origin 1 m to the left of the start and 2 m above it.
    let pairs = vec![[100.0, 200.0, 0.0, 0.0], [300.0, 200.0, 2.0, 0.0], [100.0, 50.0, 0.0, 1.5]];
    let start = LearnedStart { at: [100.0, 200.0], heading_deg: 0.0 };
    let drawing = DrawingFile::of("rooms/a.json", b"strokes");
    let end = Some(LearnedEnd { at_m: [2.5, 1.0], heading_deg: -90.0 });
    Learned { learned: VERSION, drawing, map, start, goals, pairs, end }
}

fn placed(goal: [f64; 2]) -> Result<(DrawnMap, crate::reading::Places), SketchError> {
    placed_in(&room(), goal)
}

fn placed_in(learned: &Learned, goal: [f64; 2]) -> Result<(DrawnMap, crate::reading::Places), SketchError> {
    let task = crate::reading::ImageTask {
        name: "tea".into(),
        points: vec![goal],
        is_named: false,
        resolved: None,
        time_limit_s: 60.0,
    };
    learned.place("a.learned", &Intent { tasks: vec![task], ..Intent::default() }, &Options::default())
}

#[test]
fn what_is_written_is_read() {
    let learned = room();
    let bytes = learned.to_bytes();
    assert_eq!(Learned::parse(&bytes).unwrap(), learned);
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains("\"4u82o4u\"") && text.contains("\"file\": \"a.json\""), "{text}");
}

#[test]
fn files_that_are_no_learned_map_are_refused_with_the_key() {
    let text = String::from_utf8(room().to_bytes()).unwrap();
    for (from, to, words) in [
        ("\"learned\": 2", "\"learned\": 3", "learned: expected version 1 or 2, found 3"),
        ("\"learned\": 2", "\"learned\": \"new\"", "expected version 1 or 2, found \"new\""),
        ("\"learned\": 2,", "", "as `sketchnav learn` writes it: missing field `learned`"),
        ("\"resolution_m\": 0.05", "\"resolution_m\": 0.1", "map.resolution_m: expected 0.05, found 0.1"),
        ("\"4u82o4u\"", "\"4u81o4u\"", "map.rows[4]: expected runs of u, f and o as long as the map is wide"),
        ("\"4u82o4u\"", "\"4u82o4x\"", "map.rows[4]"),
        ("\"4u82o4u\"", "\"99999999999999999999u\"", "map.rows[4]"),
        ("\"4u82o4u\"", "\"4u82o4u1\"", "map.rows[4]"),
        ("\"width\": 90", "\"width\": 4294967296", "map: expected 1 to 3180080 cells"),
        ("\"heading_deg\": 0.0", "\"heading_deg\": 1e9", "start.heading_deg: expected -360 to 360"),
        ("\"heading_deg\": -90.0", "\"heading_deg\": 361", "end.heading_deg: expected -360 to 360"),
        (
            "\"at_m\": [\n      2.5,\n      1.0",
            "\"at_m\": [\n      1e300,\n      1.0",
            "end.at_m: expected numbers",
        ),
        ("300.0,", "1e300,", "expected numbers from -100000 to 100000, found 1e300"),
        ("\"reached\": true", "\"arrived\": true", "unknown field `arrived`"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = Learned::parse(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(words), "{to}: {error}");
    }
    assert!(Learned::parse(b"\x89PNG").is_err());
}

/// Maps that were learned before version 2 can still be used. The robot is then likeliest where the drive began.
#[test]
fn a_map_without_the_last_pose_is_read() {
    let text = String::from_utf8(Learned { end: None, ..room() }.to_bytes()).unwrap();
    let read = Learned::parse(text.replace("\"learned\": 2", "\"learned\": 1").as_bytes()).unwrap();
    assert_eq!(read, Learned { end: None, ..room() });
    let (_, places) = placed_in(&read, [300.0, 100.0]).unwrap();
    assert_eq!([places.start.x, places.start.y, places.start.yaw_rad], [20.0, 20.0, 0.0]);
}

#[test]
fn the_last_pose_is_the_likeliest_start() {
    let (_, places) = placed([300.0, 100.0]).unwrap();
    assert_eq!([places.start.x, places.start.y], [70.0, 40.0]);
    assert!((places.start.yaw_rad + std::f64::consts::FRAC_PI_2).abs() < 1e-9, "{:?}", places.start);
}

#[test]
fn a_drawing_is_recognized_by_its_content() {
    let drawing = DrawingFile::of("rooms/a.json", b"strokes");
    assert!(drawing.is_same(&DrawingFile::of("/elsewhere/b.json", b"strokes")));
    assert!(!drawing.is_same(&DrawingFile::of("rooms/a.json", b"stroked")));
    // The check value of CRC-32.
    assert_eq!(DrawingFile::of("x", b"123456789").crc32, "cbf43926");
}

/// The map is the drawing, at 20 px/m. What was not seen is neither free nor wall.
#[test]
fn a_goal_of_the_drive_is_where_the_robot_arrived() {
    let (drawing, places) = placed([300.0, 100.0]).unwrap();
    assert_eq!((drawing.width_px, drawing.height_px, drawing.scale), (90, 70, 1.0));
    let end = places.tasks[0].end();
    assert!((end.x - 70.0).abs() < 1e-9 && (end.y - 50.0).abs() < 1e-9, "{end:?}");
    assert!(places.start_spread_px >= 90.0 && places.start_spread_rad >= std::f64::consts::PI);
    let count = |code: u8| drawing.cells.iter().filter(|cell| **cell == code).count();
    let not_free = count(sketchnav_schemas::codes::WALL) + count(sketchnav_stage::drawn::UNSEEN);
    assert_eq!(not_free, 90 * 70 - 80 * 60 + 39);
}

#[test]
fn another_goal_is_where_the_correspondence_has_it_if_that_was_seen() {
    let (_, places) = placed([200.0, 200.0]).unwrap();
    let end = places.tasks[0].end();
    assert!((end.x - 40.0).abs() < 1.0 && (end.y - 20.0).abs() < 1.0, "{end:?}");
    let error = placed([700.0, 100.0]).unwrap_err().to_string();
    assert!(error.starts_with("task 1 (tea) at (700, 100): expected a place that the robot saw"), "{error}");
}

#[test]
fn the_map_of_map_server_has_its_rows_from_the_top() {
    let learned = room();
    let MapServer { yaml, pgm } = map_server(&learned.map, "a.pgm");
    assert!(yaml.contains("image: \"a.pgm\"\nresolution: 0.05\norigin: [-1, -1, 0.0]\n"), "{yaml}");
    let pixels = pgm.strip_prefix(b"P5\n90 70\n255\n").unwrap();
    assert_eq!(pixels.len(), 90 * 70);
    // The wall to the left of the middle begins at the top.
    let tone = |column: usize, up: usize| pixels[(69 - up) * 90 + column];
    assert_eq!((tone(40, 60), tone(40, 10), tone(0, 0)), (0, 254, 205));
}

/// A drawing of the room with another room to the right, which was not seen.
#[test]
fn the_corrected_drawing_shows_what_was_not_seen_as_drawn() {
    let strokes = r#"{"canvas":[900,300],"strokes":[
        {"points":[[20,20],[880,20],[880,280],[20,280],[20,20]]},{"points":[[425,20],[425,280]]}]}"#;
    let drawing = read(strokes.as_bytes(), "a.json", &Options::default()).unwrap();
    let picture = svg(&room(), &drawing);
    for words in
        ["class=\"walls\"", "class=\"drawn\"", "class=\"free\"", ">corner<", ">beyond<", "stroke-dasharray"]
    {
        assert!(picture.contains(words), "{words}");
    }
    let path = |class: &str| {
        let line = picture.lines().find(|line| line.contains(&format!("class=\"{class}\""))).unwrap();
        line.matches('M').count()
    };
    assert!(path("drawn") > 20 && path("walls") > 60, "{} {}", path("drawn"), path("walls"));
    let named =
        Learned { goals: vec![Goal { task: "a <b> & c".into(), ..room().goals[0].clone() }], ..room() };
    assert!(svg(&named, &drawing).contains("a &lt;b&gt; &amp; c"));
}

/// The picture used to lie as the robot's first heading had it, with the names of goals only.
#[test]
fn the_corrected_drawing_lies_like_the_drawing_and_has_its_names() {
    let strokes = r#"{"canvas":[900,300],"strokes":[
        {"points":[[20,20],[880,20],[880,280],[20,280],[20,20]]},{"points":[[425,20],[425,280]]}],
        "labels":[{"text":"Kitchen & bar","at":[150,220]},{"text":"Corner","at":[350,250]},{"text":"Tea","at":[305,100]}]}"#;
    let drawing = read(strokes.as_bytes(), "a.json", &Options::default()).unwrap();
    // In the drawing, the robot began to drive upwards, or to the left.
    for (quarters, heading_deg) in [(0, 0.0), (1, 90.0), (2, 180.0)] {
        let turned = |[column, row, x, y]: [f64; 4]| {
            let [x, y] = [[x, y], [y, -x], [-x, -y]][quarters];
            [column, row, x, y]
        };
        let map = turned_map(&room().map, quarters);
        let pairs = room().pairs.into_iter().map(turned).collect();
        let goals = vec![Goal { at_m: None, ..room().goals[0].clone() }];
        let picture = svg(&Learned { map, pairs, goals, ..room() }, &drawing);
        let (_, rest) = picture.split_once("<g transform=\"rotate(").unwrap();
        let (degrees, _) = rest.split_once(')').unwrap();
        let off = degrees.parse::<f64>().unwrap() + heading_deg;
        assert!((off - 360.0 * (off / 360.0).round()).abs() < 0.2, "{degrees}");
        // Wider than high, like the drawing.
        let (_, size) = picture.split_once("viewBox=\"").unwrap();
        let size: Vec<f64> =
            size.split_once('"').unwrap().0.split(' ').map(|number| number.parse().unwrap()).collect();
        assert!(size[2] > 2.0 * size[3], "{size:?}");
        let at = |words: &str| {
            let line = picture.lines().find(|line| line.contains(words)).unwrap();
            let number =
                |key: &str| line.split_once(key).unwrap().1.split_once('"').unwrap().0.parse::<f64>();
            [number(" x=\"").unwrap(), number(" y=\"").unwrap()]
        };
        let [name, goal] = [at(">Kitchen &amp; bar</text>"), at(">corner</text>")];
        // The name is 1.5 m to the left of the goal and 1.2 m below it.
        assert!(
            (goal[0] - 10.0 - name[0] - 30.0).abs() < 1.5 && (name[1] - goal[1] - 24.0).abs() < 1.5,
            "{name:?} {goal:?}"
        );
        // At the goal, which it must not cover.
        let tea = at(">Tea</text>");
        assert!(
            (goal[1] - tea[1] - 16.0).abs() < 0.2 && (goal[0] - 10.0 - tea[0]).abs() < 2.0,
            "{tea:?} {goal:?}"
        );
        assert!(!picture.contains(">Corner<"), "the goal has this name already");
    }
}

/// Turns a map clockwise by quarters of a full turn about its origin.
fn turned_map(map: &LearnedMap, quarters: usize) -> LearnedMap {
    (0..quarters).fold(map.clone(), |map, _| {
        let (width, height) = (map.width, map.height());
        let cell = |index: usize| map.cells[index % height * width + width - 1 - index / height];
        // x of the new map is y of the old one, and y of the new map is −x of the old one.
        let origin_m = [map.origin_m[1], -(map.origin_m[0] + width as f64 * CELL_M)];
        LearnedMap { origin_m, width: height, cells: (0..width * height).map(cell).collect() }
    })
}

fn cell() -> impl Strategy<Value = Cell> {
    prop_oneof![Just(Cell::Unknown), Just(Cell::Free), Just(Cell::Occupied)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn every_map_is_read_as_it_was_written(width in 1_usize..40, cells in proptest::collection::vec(cell(), 40..800), x in -100.0..100.0f64) {
        let height = cells.len() / width;
        let map = LearnedMap { origin_m: [x, -x], width, cells: cells[..width * height].to_vec() };
        let learned = Learned { map, ..room() };
        prop_assert_eq!(Learned::parse(&learned.to_bytes()), Ok(learned));
    }

    /// A damaged file is refused or read, but never crashes the reader.
    #[test]
    fn any_damage_is_read_or_refused(at in 0_usize..4000, byte in any::<u8>(), cut in 0_usize..4000) {
        let mut bytes = room().to_bytes();
        let (at, cut) = (at % bytes.len(), cut % (bytes.len() - 1));
        bytes[at] = byte;
        if let Ok(read) = Learned::parse(&bytes) {
            prop_assert_eq!(read.map.cells.len(), read.map.width * read.map.height());
        }
        prop_assert!(Learned::parse(&bytes[..cut]).is_err());
    }

    #[test]
    fn any_text_is_refused(text in ".*") {
        prop_assert!(Learned::parse(text.as_bytes()).is_err());
    }
}

/// For the first third of the drive, the robot was localized at a wrong place.
#[test]
fn maps_are_merged_by_the_poses_that_agree() {
    let truth = Pose::<Map>::new(4.0, -2.0, 2.0);
    let pair = |k: i32, motion: &Pose<Map>| {
        let seen = Pose::new(0.5 * f64::from(k), 0.1 * f64::from(k * k), 0.2 * f64::from(k));
        let known = motion.compose(&seen);
        let jitter = 0.05 * f64::from(k % 3 - 1);
        (seen, Pose::new(known.x + jitter, known.y - jitter, known.yaw_rad))
    };
    let wrong = (0..5).map(|k| pair(k, &Pose::new(-9.0, 5.0, -1.0)));
    let poses: Vec<_> = wrong.chain((5..15).map(|k| pair(k, &truth))).collect();
    let found = merge::motion(&poses).unwrap();
    assert!((found.x - truth.x).hypot(found.y - truth.y) < 0.1, "{found:?}");
    assert!((found.yaw_rad - truth.yaw_rad).abs() < 0.02, "{found:?}");
    assert!(merge::motion(&poses[4..6]).is_none(), "two poses that do not agree");
}

/// A square of 1 m that is turned by a quarter and reaches from the wall in the room to above the room's upper wall.
#[test]
fn the_newer_map_counts_where_both_know_a_cell() {
    let known = room().map;
    let newer = LearnedMap { origin_m: [0.0, 0.0], width: 20, cells: vec![Cell::Free; 400] };
    let merged = known.updated_by(&newer, &Pose::new(1.5, 1.75, std::f64::consts::FRAC_PI_2)).unwrap();
    for (at, cell) in [
        ([1.025, 1.025], Cell::Occupied),
        ([1.025, 2.025], Cell::Free),
        ([1.025, 2.725], Cell::Free),
        ([2.025, 2.275], Cell::Occupied),
        ([2.025, 2.725], Cell::Unknown),
        ([-0.725, -0.725], Cell::Free),
    ] {
        assert_eq!(merged.at_m(at), cell, "{at:?}");
    }
    assert_eq!(merged.height(), known.height() + 5);
    let far = Pose::new(90_000.0, 0.0, 0.0);
    assert!(matches!(known.updated_by(&newer, &far), Err(LearnError::TooLarge(_))));
}

#[test]
fn what_is_known_of_a_goal_stays() {
    let before = room();
    let goal = |at, at_m: Option<[f64; 2]>| Goal { task: "later".into(), at, at_m, reached: at_m.is_some() };
    let later = [
        goal([300.5, 100.0], Some([9.0, 9.0])),
        goal([700.0, 100.0], Some([6.5, 1.0])),
        goal([5.0, 5.0], None),
    ];
    let merged = before.with(before.map.clone(), later);
    let found: Vec<_> = merged.goals.iter().map(|goal| (goal.at[0], goal.at_m)).collect();
    assert_eq!(found, [(300.0, Some([2.5, 1.5])), (700.0, Some([6.5, 1.0])), (5.0, None)]);
    assert_eq!(merged.pairs.len(), before.pairs.len() + 1);
    assert_eq!(Learned::parse(&merged.to_bytes()), Ok(merged));
}

/// The room of [`room`] with a larger one to its right, as seen between two columns. They are connected by a door.
fn rooms(seen: std::ops::Range<usize>) -> LearnedMap {
    let (width, height) = (190, 70);
    let cell = |index: usize| {
        let (column, row) = (index % width, index / width);
        let is_wall = [4, 185].contains(&column)
            || [4, 65].contains(&row)
            || column == 40 && row > 25
            || column == 85 && !(10..30).contains(&row);
        let border = (4..=185).contains(&column) && (4..=65).contains(&row) && seen.contains(&column);
        match (border, is_wall) {
            (false, _) => Cell::Unknown,
            (true, true) => Cell::Occupied,
            (true, false) => Cell::Free,
        }
    };
    LearnedMap { origin_m: [-1.0, -1.0], width, cells: (0..width * height).map(cell).collect() }
}

/// The origin of the other drive's map in the first one.
const OTHER: Pose<Map> = Pose::new(3.0, 1.0, 2.0);

/// Returns what was learned in the left room, and what was learned by another drawing on a drive in both. The second map has
/// its own origin and direction.
fn two_drives() -> (Learned, Learned) {
    let back = OTHER.motion_to(&Pose::new(0.0, 0.0, 0.0));
    let back = Pose::<Map>::new(back.x, back.y, back.yaw_rad);
    let nothing = LearnedMap { origin_m: [0.0; 2], width: 1, cells: vec![Cell::Unknown] };
    let map = nothing.extended_by(&rooms(30..190), &back).unwrap();
    let there = |x: f64, y: f64| {
        let at = back.compose(&Pose::<Map>::new(x, y, 0.0));
        [at.x, at.y]
    };
    let goal = |task: &str, at, at_m| Goal { task: task.into(), at, at_m, reached: true };
    let goals = vec![
        goal("office", [60.0, 10.0], Some(there(7.0, 1.0))),
        goal("Corner", [20.0, 10.0], Some(there(2.6, 1.4))),
        goal("nowhere", [70.0, 10.0], None),
    ];
    let [near, far] = [there(2.0, 0.0), there(7.0, 1.0)];
    let pairs = vec![[20.0, 0.0, near[0], near[1]], [60.0, 10.0, far[0], far[1]]];
    let drawing = DrawingFile::of("b.json", b"other strokes");
    (Learned { map: rooms(0..130), ..room() }, Learned { drawing, map, goals, pairs, ..room() })
}

#[test]
fn what_was_learned_by_another_drawing_is_converted() {
    let (first, other) = two_drives();
    let (both, gain) = first.combined_with(&other).unwrap();
    let Pose { x, y, yaw_rad, .. } = gain.motion;
    assert!((x - OTHER.x).hypot(y - OTHER.y) < 0.1 && (yaw_rad - OTHER.yaw_rad).abs() < 0.01, "{gain:?}");
    assert!((gain.floor_m2 - 2.8 * 3.0).abs() < 0.7 && gain.agreement.share() > 0.95, "{gain:?}");
    // The corner is known under the same name. The drawing of the first drive has 100 px/m.
    assert_eq!((&gain.goals[..], &gain.left_out[..]), (&["office".to_owned()][..], &[][..]));
    let [.., office] = &both.goals[..] else { panic!("{:?}", both.goals) };
    let [[column, row], [x, y]] = [office.at, office.at_m.unwrap()];
    assert!((column - 800.0).hypot(row - 100.0) < 12.0 && (x - 7.0).hypot(y - 1.0) < 0.1, "{office:?}");
    assert_eq!((&both.drawing, &both.pairs, both.end), (&first.drawing, &first.pairs, first.end));
    assert_eq!(Learned::parse(&both.to_bytes()), Ok(both.clone()));
    // What the first drive saw is unchanged, and the other room can be driven to.
    let is_kept = |k: usize| {
        let at = [k % 130, k / 130].map(|cells| -1.0 + (cells as f64 + 0.5) * CELL_M);
        first.map.at_m(at) == Cell::Unknown || both.map.at_m(at) == first.map.at_m(at)
    };
    assert!((0..130 * 70).all(is_kept));
    assert!(placed_in(&first, [800.0, 100.0]).is_err() && placed_in(&both, [800.0, 100.0]).is_ok());
    let names: Vec<_> = both.known_goals().into_iter().map(|label| label.text).collect();
    assert_eq!(names, ["corner", "office"]);
    // Both files contain the same place, each by its drawing.
    let (swapped, _) = other.combined_with(&first).unwrap();
    assert!(swapped.drawing.is_same(&other.drawing) && swapped.goals.len() == 3, "{:?}", swapped.goals);
    assert!(swapped.map.free_cells().abs_diff(both.map.free_cells()) < 300);
}

#[test]
fn correspondences_of_the_same_drawing_are_added() {
    let (first, other) = two_drives();
    let other = Learned { drawing: first.drawing.clone(), ..other };
    let (both, gain) = first.combined_with(&other).unwrap();
    assert_eq!((gain.goals.as_slice(), both.goals[2].at), (&["office".to_owned()][..], [60.0, 10.0]));
    // That of the place that the first drive saw is left out.
    let [column, row, x, y] = both.pairs[first.pairs.len()];
    assert_eq!((both.pairs.len(), column, row), (first.pairs.len() + 1, 60.0, 10.0));
    assert!((x - 7.0).hypot(y - 1.0) < 0.1, "{x} {y}");
}

/// The goal used to be there twice, once reached and once not.
#[test]
fn a_goal_that_only_the_other_drive_reached_is_completed() {
    let (mut first, other) = two_drives();
    let corner = first.goals[0].clone();
    first.goals[0] = Goal { at_m: None, reached: false, ..corner.clone() };
    let (both, gain) = first.combined_with(&other).unwrap();
    assert_eq!(
        (gain.goals, both.goals.len()),
        (vec!["office".into(), "Corner".into()], first.goals.len() + 1)
    );
    let [x, y] = both.goals[0].at_m.unwrap();
    let [wanted_x, wanted_y] = corner.at_m.unwrap();
    assert!((x - wanted_x).hypot(y - wanted_y) < 0.2 && both.goals[0].reached, "{:?}", both.goals[0]);
    assert_eq!(both.goals[0].at, corner.at);
}

#[test]
fn goals_without_room_or_without_a_place_in_the_drawing_are_named() {
    let (first, other) = two_drives();
    let (_, gain) = Learned { pairs: Vec::new(), ..first.clone() }.combined_with(&other).unwrap();
    assert_eq!((gain.goals, gain.left_out), (Vec::<String>::new(), vec!["office".to_owned()]));
    let goals = vec![first.goals[0].clone(); MAX_TASKS];
    let (both, gain) = Learned { goals, ..first }.combined_with(&other).unwrap();
    assert_eq!((both.goals.len(), gain.left_out), (MAX_TASKS, vec!["office".to_owned()]));
}

#[test]
fn maps_that_do_not_determine_the_motion_are_refused() {
    let (first, other) = two_drives();
    let blank = LearnedMap { cells: vec![Cell::Free; first.map.cells.len()], ..first.map.clone() };
    let error = first.combined_with(&Learned { map: blank, ..other }).unwrap_err().to_string();
    assert_eq!(error, "expected walls in both maps, found none in the second one");
}
