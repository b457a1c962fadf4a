use proptest::prelude::*;

use super::*;

/// Returns anchors for the corners of a room of 10 × 8 m and for four objects in it, drawn at 50 pixels per metre.
fn room() -> Vec<Anchor> {
    let places =
        [[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0], [3.0, 2.5], [7.0, 3.0], [3.5, 5.5], [6.5, 6.0]];
    places.map(|[x, y]| anchor([x, y], [50.0 * x, 50.0 * y])).to_vec()
}

fn anchor(world: [f64; 2], drawing: [f64; 2]) -> Anchor {
    Anchor { world: Point::new(world[0], world[1]), drawing: Point::new(drawing[0], drawing[1]) }
}

fn way(points: &[[f64; 2]]) -> Vec<Point<World>> {
    points.iter().map(|p| Point::new(p[0], p[1])).collect()
}

/// Returns a route drawn at 50 pixels per metre.
fn route(points: &[[f64; 2]]) -> Vec<Point<Sketch>> {
    points.iter().map(|p| Point::new(50.0 * p[0], 50.0 * p[1])).collect()
}

/// Returns a path that makes `turns` counter-clockwise turns around `center`, and starts and ends to the south of it.
fn round(center: [f64; 2], radius: f64, turns: i32) -> Vec<[f64; 2]> {
    let at = |k: i32| {
        let angle =
            f64::from(turns.signum() * k) * std::f64::consts::TAU / 24.0 - std::f64::consts::FRAC_PI_2;
        [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()]
    };
    (0..=24 * turns.abs()).map(at).collect()
}

#[test]
fn a_path_beside_the_route_is_homotopic() {
    let room = Correspondence::new(&room()).unwrap();
    let drawn = route(&[[1.0, 1.0], [5.0, 2.0], [5.0, 7.0], [9.0, 7.0]]);
    assert!(room.is_homotopic(&way(&[[1.0, 1.2], [4.4, 0.8], [5.6, 4.0], [4.6, 7.4], [8.7, 7.1]]), &drawn));
}

#[test]
fn passing_an_object_on_the_other_side_is_not_homotopic() {
    let room = Correspondence::new(&room()).unwrap();
    let drawn = route(&[[1.0, 1.0], [5.0, 2.0], [5.0, 7.0], [9.0, 7.0]]);
    let others: [&[[f64; 2]]; 3] = [
        &[[1.0, 1.0], [5.0, 2.0], [5.0, 5.0], [9.0, 5.0], [9.0, 7.0]],
        &[[1.0, 1.0], [1.0, 4.0], [5.0, 4.0], [5.0, 7.0], [9.0, 7.0]],
        &[[1.0, 1.0], [9.0, 1.0], [9.0, 7.0]],
    ];
    for other in others {
        assert!(!room.is_homotopic(&way(other), &drawn), "{other:?}");
    }
}

/// Boniardi et al. 2016, V-B, compare the path on the sketch with the drawn one with respect to the topology induced by the
/// sketch.
#[test]
fn a_path_on_the_sketch_passes_objects_on_the_same_sides() {
    let room = Correspondence::new(&room()).unwrap();
    let drawn = route(&[[1.0, 1.0], [5.0, 2.0], [5.0, 7.0], [9.0, 7.0]]);
    let beside = route(&[[1.2, 1.0], [4.4, 0.8], [5.6, 4.0], [4.6, 7.4], [8.7, 7.1]]);
    assert!(room.is_homotopic_on_sketch(&beside, &drawn));
    let other = route(&[[1.0, 1.0], [9.0, 1.0], [9.0, 7.0]]);
    assert!(!room.is_homotopic_on_sketch(&other, &drawn));
    assert!(!room.is_homotopic_on_sketch(&[], &drawn) && !room.is_homotopic_on_sketch(&beside, &[]));
}

#[test]
fn rounds_are_counted() {
    let room = Correspondence::new(&room()).unwrap();
    for (driven, drawn) in (-2..=2).flat_map(|a| (-2..=2).map(move |b| (a, b))) {
        let same =
            room.is_homotopic(&way(&round([3.0, 2.5], 1.0, driven)), &route(&round([3.0, 2.5], 0.6, drawn)));
        assert_eq!(same, driven == drawn, "{driven} and {drawn}");
    }
}

/// The line goes around the first object, around the second, back around the first, and back around the second. Every winding
/// number is 0, yet the line cannot be contracted.
#[test]
fn order_matters_even_with_equal_winding_numbers() {
    let room = Correspondence::new(&room()).unwrap();
    let (a, b) = ([3.0, 2.5], [7.0, 3.0]);
    let rounds = [round(a, 0.8, 1), round(b, 0.8, 1), round(a, 0.8, -1), round(b, 0.8, -1)];
    let commutator: Vec<_> =
        rounds.iter().flat_map(|round| [&[[5.0, 1.0]][..], round].concat()).chain([[5.0, 1.0]]).collect();
    let stay = route(&[[5.0, 1.0], [5.1, 1.0]]);
    assert!(!room.is_homotopic(&way(&commutator), &stay));
    let undone = [round(a, 0.8, 1), round(b, 0.8, 1), round(b, 0.8, -1), round(a, 0.8, -1)];
    let undone: Vec<_> =
        undone.iter().flat_map(|round| [&[[5.0, 1.0]][..], round].concat()).chain([[5.0, 1.0]]).collect();
    assert!(room.is_homotopic(&way(&undone), &stay));
}

/// Objects that the drawing does not show do not count.
#[test]
fn an_object_that_was_not_drawn_may_be_passed_on_either_side() {
    let anchors: Vec<_> = room().into_iter().filter(|anchor| anchor.world != Point::new(7.0, 3.0)).collect();
    let drawn = route(&[[5.0, 1.0], [9.0, 5.0]]);
    for around in [[9.0, 1.5], [5.0, 4.5]] {
        let driven = way(&[[5.0, 1.0], around, [9.0, 5.0]]);
        assert!(Correspondence::new(&anchors).unwrap().is_homotopic(&driven, &drawn));
    }
}

/// One object is drawn in a different part of the room. What counts is on which side it is passed, not its position.
#[test]
fn an_object_drawn_in_the_wrong_place_keeps_its_identity() {
    let mut anchors = room();
    anchors[4].drawing = Point::new(50.0 * 4.6, 50.0 * 1.4);
    let room = Correspondence::new(&anchors).unwrap();
    let north = way(&[[1.0, 1.0], [1.5, 3.5], [5.0, 3.8], [9.0, 1.0]]);
    let drawn_north = route(&[[1.0, 1.0], [4.5, 2.4], [5.5, 2.2], [9.0, 1.0]]);
    let drawn_south = route(&[[1.0, 1.0], [4.6, 0.7], [9.0, 1.0]]);
    assert!(room.is_homotopic(&north, &drawn_north) && !room.is_homotopic(&north, &drawn_south));
}

#[test]
fn anchors_without_a_partner_are_refused() {
    let mirrored: Vec<_> =
        room().iter().map(|a| Anchor { drawing: Point::new(-a.drawing.x, a.drawing.y), ..*a }).collect();
    assert_eq!(Correspondence::new(&mirrored).unwrap_err(), CorrespondenceError::Flat(8));
    assert_eq!(Correspondence::new(&room()[..2]).unwrap_err(), CorrespondenceError::Flat(2));
    let mut swapped = room();
    (swapped[0].drawing, swapped[2].drawing) = (swapped[2].drawing, swapped[0].drawing);
    assert!(Correspondence::new(&swapped).is_err());
}

#[test]
fn mapping_a_place_there_and_back_returns_it() {
    let mut anchors = room();
    anchors[6].drawing = Point::new(120.0, 330.0);
    let room = Correspondence::new(&anchors).unwrap();
    let place = Point::new(4.2, 4.9);
    let back = room.to_floor(room.to_drawing(place).unwrap()).unwrap();
    assert!(back.distance(&place) < 1e-9);
    assert!(room.to_drawing(anchors[6].world).unwrap().distance(&anchors[6].drawing) < 1e-9);
    assert!(room.to_drawing(Point::new(1e6, 0.0)).is_none());
    assert!(
        room.difference(&[], &route(&[[1.0, 1.0]])).is_none()
            && room.difference(&way(&[[1.0, 1.0]]), &[]).is_none()
    );
}

fn inside() -> impl Strategy<Value = [f64; 2]> {
    (0.2..9.8, 0.2..7.8).prop_map(|(x, y)| [x, y])
}

/// Generates drawings of the room: rotated, stretched, bent, and with each anchor shifted by up to 0.7 m.
fn drawings() -> impl Strategy<Value = Vec<Anchor>> {
    let shifts = prop::collection::vec((-0.7..0.7, -0.7..0.7), 8);
    (-3.0..3.0_f64, 0.6..1.8, -0.06..0.06, shifts).prop_map(|(turn, stretch, bend, shifts)| {
        let (sin, cos) = turn.sin_cos();
        let draw = |(anchor, shift): (Anchor, (f64, f64))| {
            let (x, y) = (anchor.world.x + shift.0, stretch * (anchor.world.y + shift.1));
            let y = y + bend * x * x;
            Anchor { drawing: Point::new(30.0 * (cos * x - sin * y), 30.0 * (sin * x + cos * y)), ..anchor }
        };
        room().into_iter().zip(shifts).map(draw).collect()
    })
}

/// Returns the path, divided finely and mapped into the drawing.
fn carried(room: &Correspondence, way: &[Point<World>]) -> Vec<Point<Sketch>> {
    let cut = |pair: &[Point<World>]| {
        let [a, b] = [pair[0], pair[1]];
        (0..400)
            .map(move |i| f64::from(i) / 400.0)
            .map(move |t| Point::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)))
    };
    let places = way.windows(2).flat_map(cut).chain(way.last().copied());
    places.map(|place| room.to_drawing(place).unwrap()).collect()
}

fn distance_to_anchors(way: &[Point<World>]) -> f64 {
    let places = way.windows(2).flat_map(|pair| {
        let [a, b] = [pair[0], pair[1]];
        (0..=100)
            .map(move |i| f64::from(i) / 100.0)
            .map(move |t| Point::<World>::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)))
    });
    let places: Vec<_> = places.collect();
    let nearest =
        |anchor: Anchor| places.iter().map(|p| p.distance(&anchor.world)).fold(f64::INFINITY, f64::min);
    room().into_iter().map(nearest).fold(f64::INFINITY, f64::min)
}

/// Returns the number of times that a closed line winds around a point.
fn winding(line: &[Point<Sketch>], about: Point<Sketch>) -> i64 {
    let angle = |p: &Point<Sketch>| (p.y - about.y).atan2(p.x - about.x);
    let turn = |(a, b): (&Point<Sketch>, &Point<Sketch>)| {
        sketchnav_schemas::geometry::wrap_angle(angle(b) - angle(a))
    };
    let sum: f64 = line.iter().zip(line.iter().cycle().skip(1)).map(turn).sum();
    (sum / std::f64::consts::TAU).round() as i64
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// The map between the planes keeps paths homotopic, however the drawing is deformed.
    #[test]
    fn a_path_is_homotopic_to_its_image(anchors in drawings(), points in prop::collection::vec(inside(), 2..12)) {
        let Ok(room) = Correspondence::new(&anchors) else { return Ok(()) };
        let way = way(&points);
        prop_assume!(distance_to_anchors(&way) > 0.1);
        prop_assert!(room.is_homotopic(&way, &carried(&room, &way)));
    }

    /// Homotopic lines must have equal winding numbers around every anchor.
    #[test]
    fn homotopic_lines_have_equal_winding_numbers(
        anchors in drawings(), mut a in prop::collection::vec(inside(), 2..7), b in prop::collection::vec(inside(), 2..7),
    ) {
        let Ok(room) = Correspondence::new(&anchors) else { return Ok(()) };
        (a[0], *a.last_mut().unwrap()) = (b[0], b[b.len() - 1]);
        let (a, b) = (way(&a), way(&b));
        prop_assume!(distance_to_anchors(&a).min(distance_to_anchors(&b)) > 0.1);
        let drawn = carried(&room, &b);
        let line: Vec<_> = carried(&room, &a).into_iter().chain(drawn.iter().rev().copied()).collect();
        let unwound = anchors.iter().all(|anchor| winding(&line, anchor.drawing) == 0);
        prop_assert!(unwound || !room.is_homotopic(&a, &drawn));
    }

    /// A corner of the path may slide as long as the path does not sweep over an anchor.
    #[test]
    fn a_corner_may_move_unless_it_crosses_an_anchor(
        points in prop::collection::vec(inside(), 3..8), which in 0_usize..6, to in inside(),
    ) {
        let room_anchors = room();
        let room = Correspondence::new(&room_anchors).unwrap();
        let which = 1 + which % (points.len() - 2);
        let mut slid = points.clone();
        slid[which] = to;
        prop_assume!(distance_to_anchors(&way(&points)).min(distance_to_anchors(&way(&slid))) > 1e-3);
        let swept = [points[which - 1], points[which], points[which + 1], to].map(|p| Point::new(50.0 * p[0], 50.0 * p[1]));
        let passed = room_anchors.iter().any(|anchor| winding(&swept, anchor.drawing) != 0);
        prop_assert_eq!(room.is_homotopic(&way(&slid), &route(&points)), !passed);
    }

    /// The answer remains the same if path and route are both reversed, or if a detour that is retraced is added.
    #[test]
    fn reversal_and_retraced_detours_do_not_matter(
        a in prop::collection::vec(inside(), 2..7), b in prop::collection::vec(inside(), 2..7), detour in prop::collection::vec(inside(), 1..5),
    ) {
        let room = Correspondence::new(&room()).unwrap();
        let spur: Vec<_> = a.iter().chain(&detour).chain(detour.iter().rev().skip(1)).chain(a.last()).copied().collect();
        prop_assume!(distance_to_anchors(&way(&spur)).min(distance_to_anchors(&way(&b))) > 1e-3);
        let same = room.is_homotopic(&way(&a), &route(&b));
        prop_assert_eq!(room.is_homotopic(&way(&spur), &route(&b)), same);
        let back = |points: &[[f64; 2]]| points.iter().rev().copied().collect::<Vec<_>>();
        prop_assert_eq!(room.is_homotopic(&way(&back(&a)), &route(&back(&b))), same);
    }
}
