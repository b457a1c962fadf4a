//! Tests with hand-made plans, which serve as drawings and as maps of what a robot has seen.

use proptest::prelude::*;
use sketchnav_mapping::{Cell, CellGrid};
use sketchnav_schemas::codes::{FREE, WALL};

use super::*;

/// Rectangles of free space: x, y, width and height, in metres.
type Plan = Vec<[f64; 4]>;

/// A corridor with three rooms above it and two below, all of them different.
fn office() -> Plan {
    vec![
        [1.0, 5.0, 14.0, 2.0],
        [1.0, 7.2, 3.0, 4.0],
        [4.2, 7.2, 6.0, 4.0],
        [10.4, 7.2, 4.6, 3.0],
        [1.0, 1.8, 7.0, 3.0],
        [8.2, 1.0, 6.8, 3.8],
        // Doors.
        [2.0, 7.0, 0.9, 0.2],
        [8.0, 7.0, 0.9, 0.2],
        [11.0, 7.0, 0.9, 0.2],
        [6.0, 4.8, 0.9, 0.2],
        [9.0, 4.8, 0.9, 0.2],
    ]
}

const START: [f64; 2] = [2.0, 6.0];
/// A place in each of the five rooms.
const GOALS: [[f64; 2]; 5] = [[2.5, 9.0], [7.0, 9.5], [12.5, 8.7], [4.0, 3.2], [12.0, 3.0]];

fn is_free(plan: &Plan, [x, y]: [f64; 2]) -> bool {
    plan.iter().any(|[left, low, width, height]| {
        (*left..left + width).contains(&x) && (*low..low + height).contains(&y)
    })
}

fn size(plan: &Plan) -> [f64; 2] {
    let end = |k: usize| plan.iter().map(|part| part[k] + part[k + 2]).fold(0.0, f64::max) + 1.0;
    [end(0), end(1)]
}

/// Draws a plan with `px` pixels per metre along x and y.
fn drawn(plan: &Plan, px: [f64; 2]) -> Floor {
    let [width, height] = [0, 1].map(|k| (size(plan)[k] * px[k]).ceil() as usize);
    let cell = |k: usize| {
        let at = [(k % width) as f64 + 0.5, (k / width) as f64 + 0.5];
        if is_free(plan, [at[0] / px[0], at[1] / px[1]]) { FREE } else { WALL }
    };
    let cells: Vec<_> = (0..width * height).map(cell).collect();
    let sketch = SketchGrid::new(width, height, &cells, 0.0).unwrap();
    Floor::of_drawing(&sketch, Pose::new(START[0] * px[0], START[1] * px[1], 0.0), 100.0).unwrap()
}

/// Maps the part of a plan that was seen. The map's origin is the start, and its x axis is turned by `yaw_rad`.
fn mapped(plan: &Plan, yaw_rad: f64, is_seen: impl Fn([f64; 2]) -> bool, drawing: &Floor) -> Floor {
    const CELL_M: f64 = 0.05;
    const SIDE: usize = 720;
    let [sin, cos] = [yaw_rad.sin(), yaw_rad.cos()];
    let to_plan = |[x, y]: [f64; 2]| [START[0] + cos * x - sin * y, START[1] + sin * x + cos * y];
    let origin = [-(SIDE as f64) / 2.0 * CELL_M; 2];
    let what = |k: usize| {
        let at = [k % SIDE, k / SIDE];
        let place = to_plan([0, 1].map(|axis| origin[axis] + (at[axis] as f64 + 0.5) * CELL_M));
        let near = |dx: f64, dy: f64| is_free(plan, [place[0] + dx, place[1] + dy]);
        match is_free(plan, place) {
            _ if !is_seen(place) => Cell::Unknown,
            true => Cell::Free,
            false if [-0.08, 0.0, 0.08].iter().any(|x| [-0.08, 0.0, 0.08].iter().any(|y| near(*x, *y))) => {
                Cell::Occupied
            }
            false => Cell::Unknown,
        }
    };
    let survey = Survey::of(CellGrid::of([SIDE, SIDE], CELL_M, origin, what), [0.0, 0.0], 0.5);
    Floor::of_map(&survey, [0.0, 0.0], yaw_rad + 0.1, drawing).unwrap()
}

/// Converts a place of a map to the plan.
fn in_plan([x, y]: [f64; 2], yaw_rad: f64) -> [f64; 2] {
    let [sin, cos] = [yaw_rad.sin(), yaw_rad.cos()];
    [START[0] + cos * x - sin * y, START[1] + sin * x + cos * y]
}

/// Returns the distance between the goal according to the answer and the true goal, in metres, and the answer.
fn asked(drawing: &Floor, map: &Floor, goal: [f64; 2], px: [f64; 2], yaw_rad: f64) -> (f64, Answer) {
    let answer = locate(drawing, map, [0, 1].map(|k| goal[k] * px[k])).unwrap();
    let place = answer.hypotheses[0].place.map_or([f64::INFINITY; 2], |place| in_plan(place, yaw_rad));
    ((place[0] - goal[0]).hypot(place[1] - goal[1]), answer)
}

#[test]
fn a_corridor_with_five_rooms_is_six_regions_and_five_doors() {
    let drawing = drawn(&office(), [20.0; 2]);
    assert_eq!(drawing.rooms.iter().filter(|room| !room.tokens.is_empty()).count(), 6);
    assert_eq!(drawing.doors.len(), 5);
    let corridor = &drawing.rooms[drawing.home as usize];
    let doors: Vec<_> =
        corridor.tokens.iter().filter(|token| matches!(token.kind, Kind::Door { .. })).collect();
    assert_eq!(doors.len(), 5, "{doors:?}");
    // The plan has 125 m², and the only clue to the scale is the width of the doors.
    let area_m2: f64 = drawing.rooms.iter().map(|room| room.area_m2).sum();
    assert!((100.0..160.0).contains(&area_m2), "{area_m2}");
}

#[test]
fn a_drawing_to_scale_has_every_goal_where_it_is() {
    let px = [20.0; 2];
    let drawing = drawn(&office(), px);
    let map = mapped(&office(), 0.0, |_| true, &drawing);
    for goal in GOALS {
        let (off_m, answer) = asked(&drawing, &map, goal, px, 0.0);
        assert!(off_m < 0.7, "{goal:?}: {off_m} m off, {answer:?}");
        assert!(answer.hypotheses[0].share > 0.9 && answer.margin.unwrap() > 3.0, "{goal:?}: {answer:?}");
        assert_eq!(answer.doors, Doors { matched: 5, only_drawn: 0, only_seen: 0 }, "{goal:?}");
        let place = answer.hypotheses[0].place.unwrap();
        assert!(
            answer.share_near(place, 1.0) > 0.9 && answer.share_near([place[0] + 9.0, place[1]], 1.0) == 0.0
        );
    }
}

/// The doors are drawn in the right order, but not at their true places.
#[test]
fn proportions_count_little() {
    let mut sketched = office();
    for part in &mut sketched {
        if part[2] > 1.0 && part[1] > 7.0 {
            part[3] *= 0.6;
        }
    }
    let px = [26.0, 17.0];
    let drawing = drawn(&sketched, px);
    let map = mapped(&office(), 0.0, |_| true, &drawing);
    for goal in [[2.5, 8.4], [7.0, 8.4], [12.5, 8.2], [4.0, 3.2], [12.0, 3.0]] {
        let (off_m, answer) = asked(&drawing, &map, goal, px, 0.0);
        assert!(off_m < 2.0, "{goal:?}: {off_m} m off, {answer:?}");
    }
}

/// The robot has seen only the corridor. Each goal lies beyond the gap at the door of its room.
#[test]
fn a_goal_in_a_room_that_was_not_seen_lies_beyond_its_door() {
    let px = [20.0; 2];
    let drawing = drawn(&office(), px);
    let map = mapped(&office(), 0.0, |[_, y]| (4.7..7.15).contains(&y), &drawing);
    for (goal, door) in
        GOALS.into_iter().zip([[2.45, 7.1], [8.45, 7.1], [11.45, 7.1], [6.45, 4.9], [9.45, 4.9]])
    {
        let (_, answer) = asked(&drawing, &map, goal, px, 0.0);
        let best = &answer.hypotheses[0];
        let gap = in_plan(best.gap.unwrap_or([f64::INFINITY; 2]), 0.0);
        assert!((gap[0] - door[0]).hypot(gap[1] - door[1]) < 0.6, "{goal:?}: {gap:?} instead of {door:?}");
        assert!(best.place.is_none());
    }
}

/// The drawing lacks the first room above the corridor. The others keep their places.
#[test]
fn a_room_that_was_forgotten_does_not_shift_the_others() {
    let px = [20.0; 2];
    let mut sketched = office();
    sketched.remove(6);
    sketched.remove(1);
    let drawing = drawn(&sketched, px);
    let map = mapped(&office(), 0.0, |_| true, &drawing);
    for goal in &GOALS[1..] {
        let (off_m, answer) = asked(&drawing, &map, *goal, px, 0.0);
        assert!(off_m < 1.0, "{goal:?}: {off_m} m off, {answer:?}");
        assert_eq!((answer.doors.matched, answer.doors.only_seen), (4, 1), "{goal:?}");
    }
}

/// Two rooms on one side are identical, and the drawing shows only one of them, in the middle.
#[test]
fn a_goal_in_one_of_two_equal_rooms_has_a_small_margin() {
    let rooms = [[1.0, 5.0, 14.0, 2.0], [1.0, 1.8, 14.0, 3.0], [3.0, 4.8, 0.9, 0.2]];
    let twins = [[4.0, 7.2, 4.0, 4.0], [8.2, 7.2, 4.0, 4.0], [5.6, 7.0, 0.9, 0.2], [9.8, 7.0, 0.9, 0.2]];
    let floor: Plan = rooms.iter().chain(&twins).copied().collect();
    let sketched: Plan = rooms.iter().copied().chain([[6.2, 7.2, 4.0, 4.0], [7.7, 7.0, 0.9, 0.2]]).collect();
    let px = [20.0; 2];
    let drawing = drawn(&sketched, px);
    let map = mapped(&floor, 0.0, |_| true, &drawing);
    let (_, unsure) = asked(&drawing, &map, [8.2, 9.0], px, 0.0);
    let (_, sure) = asked(&drawing, &map, [8.0, 3.0], px, 0.0);
    let [unsure, sure] = [unsure.margin.unwrap(), sure.margin.unwrap()];
    assert!(unsure < 2.0 && sure > unsure + 2.0, "{unsure} {sure}");
}

/// The corridor runs around a block, whose rooms are entered from it.
#[test]
fn rooms_inside_a_ring_of_corridors_are_found() {
    let plan: Plan = vec![
        [1.0, 5.0, 16.0, 1.8],
        [1.0, 13.0, 16.0, 1.8],
        [1.0, 5.0, 1.8, 9.8],
        [15.2, 5.0, 1.8, 9.8],
        [3.0, 7.0, 5.0, 5.8],
        [8.2, 7.0, 6.8, 5.8],
        [5.0, 6.8, 0.9, 0.2],
        [10.0, 12.8, 0.9, 0.2],
    ];
    let px = [20.0; 2];
    let drawing = drawn(&plan, px);
    let map = mapped(&plan, 0.0, |_| true, &drawing);
    for goal in [[5.0, 10.0], [12.0, 9.0]] {
        let (off_m, answer) = asked(&drawing, &map, goal, px, 0.0);
        assert!(off_m < 1.0, "{goal:?}: {off_m} m off, {answer:?}");
    }
}

#[test]
fn a_goal_that_no_door_leads_to_counts_for_the_nearest_region() {
    let mut plan = office();
    plan.truncate(10);
    let drawing = drawn(&plan, [20.0; 2]);
    let map = mapped(&plan, 0.0, |_| true, &drawing);
    let answer = locate(&drawing, &map, [12.0 * 20.0, 3.0 * 20.0]).unwrap();
    assert!(!answer.hypotheses.is_empty());
    assert!(drawing.way_to(drawing.rooms.len() as u16).is_none());
}

/// A floor of a hundred rooms in a grid, each joined to its neighbours, has an enormous number of alignments.
#[test]
fn work_is_bounded() {
    let mut plan: Plan = Vec::new();
    for (x, y) in (0..10).flat_map(|x| (0..10).map(move |y| (f64::from(x), f64::from(y)))) {
        plan.push([1.0 + 3.2 * x, 5.0 + 3.2 * y, 3.0, 3.0]);
        plan.push([2.0 + 3.2 * x, 8.0 + 3.2 * y, 0.9, 0.2]);
        plan.push([4.0 + 3.2 * x, 6.0 + 3.2 * y, 0.2, 0.9]);
    }
    let px = [12.0; 2];
    let drawing = drawn(&plan, px);
    let map = mapped(&plan, 0.0, |[x, y]| x < 18.0 && y < 20.0, &drawing);
    let way: Vec<_> = Vec::new();
    let nothing = joint::Forbidden::new();
    let joint = joint::Joint::new([&drawing, &map], way, &nothing);
    assert!(joint.energy().is_finite() && joint.size() <= joint::MOST_ENERGIES);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    /// Neither the size of the drawing nor the robot's initial direction matters.
    #[test]
    fn scale_and_heading_do_not_matter(px in 12.0..32.0, yaw_rad in -3.1..3.1_f64, goal in 0..5_usize) {
        let px = [px; 2];
        let drawing = drawn(&office(), px);
        let map = mapped(&office(), yaw_rad, |_| true, &drawing);
        let (off_m, answer) = asked(&drawing, &map, GOALS[goal], px, yaw_rad);
        prop_assert!(off_m < 1.0, "{:?}: {} m off, {:?}", GOALS[goal], off_m, answer);
    }
}
