use proptest::prelude::*;

use super::*;
use crate::grid::Cell;

const CELL_M: f64 = 0.05;

/// A wall from one point to another, in metres.
type Wall = [[f64; 2]; 2];

/// A floor of three rooms of different size above a corridor, with a pillar in the largest one.
const ROOMS: [Wall; 14] = [
    [[0.0, 0.0], [14.0, 0.0]],
    [[14.0, 0.0], [14.0, 6.0]],
    [[14.0, 6.0], [0.0, 6.0]],
    [[0.0, 6.0], [0.0, 0.0]],
    [[0.0, 2.0], [1.0, 2.0]],
    [[2.0, 2.0], [6.5, 2.0]],
    [[7.5, 2.0], [11.0, 2.0]],
    [[12.0, 2.0], [14.0, 2.0]],
    [[4.0, 2.0], [4.0, 6.0]],
    [[10.0, 2.0], [10.0, 6.0]],
    [[8.0, 4.0], [8.4, 4.0]],
    [[8.4, 4.0], [8.4, 4.4]],
    [[8.4, 4.4], [8.0, 4.4]],
    [[8.0, 4.4], [8.0, 4.0]],
];

fn to_wall(at: [f64; 2], [from, to]: Wall) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]);
    let part = ((at[0] - from[0]) * along[0] + (at[1] - from[1]) * along[1]) / (length * length);
    let part = part.clamp(0.0, 1.0);
    (from[0] + part * along[0] - at[0]).hypot(from[1] + part * along[1] - at[1])
}

/// Returns the map of a floor between two corners, as seen by a robot whose map has its origin at `origin`.
fn map(walls: &[Wall], low: [f64; 2], high: [f64; 2], origin: &Pose<Map>) -> CellGrid {
    let corners = [[low[0], low[1]], [high[0], low[1]], [low[0], high[1]], high];
    let corners = corners.map(|[x, y]| origin.motion_to(&Pose::new(x, y, 0.0)));
    let bound = |of: fn(f64, f64) -> f64| {
        [corners.map(|at| at.x), corners.map(|at| at.y)].map(|at| at.into_iter().reduce(of).unwrap())
    };
    let (least, most) = (bound(f64::min), bound(f64::max));
    let corner = least.map(|at| (at / CELL_M).floor() * CELL_M);
    let size = [0, 1].map(|axis| ((most[axis] - corner[axis]) / CELL_M) as usize + 1);
    CellGrid::of(size, CELL_M, corner, |index| {
        let [column, row] = [index % size[0], index / size[0]].map(|at| at as f64 + 0.5);
        let at =
            origin.compose(&Pose::<Map>::new(corner[0] + column * CELL_M, corner[1] + row * CELL_M, 0.0));
        let is_seen = (low[0]..=high[0]).contains(&at.x) && (low[1]..=high[1]).contains(&at.y);
        match is_seen {
            false => Cell::Unknown,
            true if walls.iter().any(|wall| to_wall([at.x, at.y], *wall) <= 0.5 * CELL_M) => Cell::Occupied,
            true => Cell::Free,
        }
    })
}

/// Returns how far a motion is from the true one, in metres and radians.
fn off(found: &Registration, first: &Pose<Map>, other: &Pose<Map>) -> (f64, f64) {
    let truth = first.motion_to(other);
    let Pose { x, y, yaw_rad, .. } = found.motion;
    ((x - truth.x).hypot(y - truth.y), wrap_angle(yaw_rad - truth.yaw_rad).abs())
}

const HERE: Pose<Map> = Pose::new(0.0, 0.0, 0.0);
/// The corners of [`ROOMS`].
const ALL: ([f64; 2], [f64; 2]) = ([-0.1, -0.1], [14.1, 6.1]);

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(3), ..ProptestConfig::default() })]

    #[test]
    fn a_moved_copy_of_a_map_gives_the_motion_back(x in -20.0..20.0_f64, y in -20.0..20.0_f64, yaw in -3.1..3.1_f64) {
        let moved = Pose::new(x, y, yaw);
        let (first, other) = (map(&ROOMS, ALL.0, ALL.1, &HERE), map(&ROOMS, ALL.0, ALL.1, &moved));
        let found = register(&first, &other).unwrap();
        let (off_m, off_rad) = off(&found, &HERE, &moved);
        // The origin may be far from the map, which multiplies the error of the angle.
        prop_assert!(off_m < 0.1 && off_rad < 0.004, "{:?} instead of {:?}", found.motion, HERE.motion_to(&moved));
        prop_assert!(found.agreement.share() > 0.99 && found.agreement.residual_m < 0.05, "{found:?}");
        prop_assert!((found.agreement.floor_m2 - 84.0).abs() < 6.0, "{found:?}");
        // The same input gives the same bytes.
        prop_assert_eq!(found, register(&first, &other).unwrap());
    }
}

/// One map shows the left half of the floor and the other the right one, with the room in the middle in common. Without furniture in
/// that room, the maps would also fit in other ways.
#[test]
fn maps_that_overlap_partly_are_registered() {
    let screens = [[[5.0, 3.0], [6.5, 3.8]], [[6.0, 4.8], [7.2, 5.4]], [[9.0, 2.6], [9.4, 3.2]]];
    let walls = [&ROOMS[..], &screens].concat();
    let moved = Pose::new(9.0, 3.0, 2.2);
    let first = map(&walls, ALL.0, [10.1, 6.1], &HERE);
    let other = map(&walls, [3.9, -0.1], ALL.1, &moved);
    let bare = [map(&ROOMS, ALL.0, [10.1, 6.1], &HERE), map(&ROOMS, [3.9, -0.1], ALL.1, &moved)];
    let refused = register(&bare[0], &bare[1]).unwrap_err();
    assert!(matches!(refused, RegistrationError::Ambiguous { .. }), "{refused}");
    for (fixed, moving, from, to) in [(&first, &other, &HERE, &moved), (&other, &first, &moved, &HERE)] {
        let found = register(fixed, moving).unwrap();
        let (off_m, off_rad) = off(&found, from, to);
        assert!(off_m < 0.1 && off_rad < 0.01, "{off_m} {off_rad} {found:?}");
        assert!((found.agreement.floor_m2 - 37.0).abs() < 4.0, "{found:?}");
    }
}

/// Furniture that was moved between the drives contradicts, but not enough to reject the motion.
#[test]
fn what_has_changed_since_does_not_matter() {
    let table = |x: f64, y: f64| {
        let corners = [[x, y], [x + 1.0, y], [x + 1.0, y + 0.6], [x, y + 0.6]];
        [0, 1, 2, 3].map(|k| [corners[k], corners[(k + 1) % 4]])
    };
    let with = |tables: &[Wall]| [&ROOMS[..], tables].concat();
    let moved = Pose::new(3.0, 1.0, -0.7);
    let first = map(&with(&table(1.0, 4.0)), ALL.0, ALL.1, &HERE);
    let other = map(&with(&table(2.5, 3.0)), ALL.0, ALL.1, &moved);
    let found = register(&first, &other).unwrap();
    let (off_m, off_rad) = off(&found, &HERE, &moved);
    assert!(off_m < 0.1 && off_rad < 0.01, "{found:?}");
    assert!(found.agreement.against_m > 4.0 && found.agreement.share() < 0.98, "{found:?}");
}

/// Two rooms that look the same after half a turn, as long as no furniture tells them apart.
#[test]
fn a_symmetric_building_is_refused() {
    let walls = [
        [[0.0, 0.0], [8.0, 0.0]],
        [[8.0, 0.0], [8.0, 5.0]],
        [[8.0, 5.0], [0.0, 5.0]],
        [[0.0, 5.0], [0.0, 0.0]],
        [[4.0, 0.0], [4.0, 2.0]],
        [[4.0, 3.0], [4.0, 5.0]],
    ];
    let (low, high) = ([-0.1, -0.1], [8.1, 5.1]);
    let moved = Pose::new(2.0, 1.0, 0.5);
    let (first, other) = (map(&walls, low, high, &HERE), map(&walls, low, high, &moved));
    let error = register(&first, &other).unwrap_err();
    let RegistrationError::Ambiguous { best, other: second, rival } = &error else { panic!("{error}") };
    assert!(*rival > 0.95, "{error}");
    assert!((wrap_angle(best.yaw_rad - second.yaw_rad).abs() - std::f64::consts::PI).abs() < 0.01, "{error}");
    assert!(error.to_string().contains("two that fit about equally well"), "{error}");
}

/// A corridor whose ends neither map shows.
#[test]
fn a_corridor_without_ends_is_refused() {
    let walls = [[[0.0, 0.0], [40.0, 0.0]], [[0.0, 2.0], [40.0, 2.0]]];
    let first = map(&walls, [5.0, -0.1], [25.0, 2.1], &HERE);
    let other = map(&walls, [12.0, -0.1], [30.0, 2.1], &Pose::new(12.0, 1.0, 1.0));
    let error = register(&first, &other).unwrap_err();
    assert!(matches!(error, RegistrationError::Ambiguous { .. }), "{error}");
}

/// A map of a room with slanted walls and one of the rooms of another building.
#[test]
fn maps_of_different_places_are_refused() {
    let walls = [
        [[0.0, 0.0], [7.0, 1.0]],
        [[7.0, 1.0], [9.0, 6.0]],
        [[9.0, 6.0], [3.0, 8.0]],
        [[3.0, 8.0], [0.0, 0.0]],
        [[4.0, 3.0], [5.0, 4.0]],
    ];
    let inside = map(&walls, [-0.1, -0.1], [9.1, 8.1], &HERE);
    let error = register(&map(&ROOMS, ALL.0, ALL.1, &HERE), &inside).unwrap_err();
    assert!(matches!(error, RegistrationError::NoOverlap(_)), "{error}");
    assert!(error.to_string().starts_with("expected maps that overlap, found at most "), "{error}");
}

#[test]
fn a_map_without_walls_is_refused() {
    let (rooms, empty) = (map(&ROOMS, ALL.0, ALL.1, &HERE), map(&[], ALL.0, ALL.1, &HERE));
    assert_eq!(register(&rooms, &empty), Err(RegistrationError::NoWalls("second")));
    assert_eq!(register(&empty, &rooms), Err(RegistrationError::NoWalls("first")));
}

/// The memory for a map grows with the square of its longest side.
#[test]
fn a_map_that_is_too_long_is_refused() {
    let long = CellGrid::of([5000, 1], CELL_M, [0.0; 2], |_| Cell::Occupied);
    let rooms = map(&ROOMS, ALL.0, ALL.1, &HERE);
    for (first, other) in [(&long, &rooms), (&rooms, &long)] {
        let error = register(first, other).unwrap_err();
        assert_eq!(error.to_string(), "expected maps of at most 4096 columns and rows, found 5000");
    }
}
