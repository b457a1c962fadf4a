//! Properties that hold for the relations of any scene: converses, rotations, mirror images and series.

use std::f64::consts::TAU;

use proptest::prelude::*;
use sketchnav_qualitative::algebra::{Compose, Converse, Relation};
use sketchnav_qualitative::allen::Intervals;
use sketchnav_qualitative::argd::{Bound, Scale};
use sketchnav_qualitative::cardinal::{Direction, Directions};
use sketchnav_qualitative::order::{Order, Orders};
use sketchnav_qualitative::qrpc::{Projections, Qrpc};
use sketchnav_qualitative::qsrlib::{self, Parameters, Which};
use sketchnav_qualitative::qtc::{Basic, DoubleCross, QtcBc, QtcC, Switching};
use sketchnav_qualitative::rcc::{Rcc4, Rcc5, Rcc8, Regions};
use sketchnav_qualitative::rectangle::{Rectangles, Rectangular};
use sketchnav_qualitative::series::{Change, Options, Stream, series};
use sketchnav_qualitative::tpcc::Tpcc;
use sketchnav_qualitative::{Calculus, Interval, Oriented, Point, Quantisation, Rect};

use crate::point;

/// Generates points on a small grid, many of which coincide, touch or are in line.
fn on_grid() -> impl Strategy<Value = [f64; 2]> {
    [-3_i8..=3, -3_i8..=3].prop_map(|xy| xy.map(f64::from))
}

pub fn anywhere() -> impl Strategy<Value = [f64; 2]> {
    [-10.0..10.0, -10.0..10.0]
}

pub fn somewhere() -> impl Strategy<Value = Point> {
    prop_oneof![on_grid(), anywhere()].prop_map(point)
}

pub fn rect() -> impl Strategy<Value = Rect> {
    let on_grid = (on_grid(), [1_u8..=4, 1_u8..=4]).prop_map(|(low, size)| (low, size.map(f64::from)));
    let rect = prop_oneof![on_grid, (anywhere(), [0.1..8.0, 0.1..8.0])];
    rect.prop_map(|(low, size)| Rect::new(low, [low[0] + size[0], low[1] + size[1]]).unwrap())
}

pub fn oriented() -> impl Strategy<Value = Oriented> {
    let quarter = (0_u8..8).prop_map(|eighth| f64::from(eighth) * TAU / 8.0);
    (somewhere(), prop_oneof![quarter, 0.0..TAU])
        .prop_map(|(at, heading)| Oriented::new(at, heading).unwrap())
}

/// Applies a quarter turn and a shift by whole numbers, both of which are exact on the grid.
fn turned(at: Point, quarters: u8, shift: [f64; 2]) -> Point {
    let [x, y] = (0..quarters).fold([at.x(), at.y()], |[x, y], _| [-y, x]);
    point([x + shift[0], y + shift[1]])
}

pub fn rotated(at: Point, angle: f64, shift: [f64; 2]) -> Point {
    let (sin, cos) = angle.sin_cos();
    point([at.x() * cos - at.y() * sin + shift[0], at.x() * sin + at.y() * cos + shift[1]])
}

fn mirrored(at: Point) -> Point {
    point([-at.x(), at.y()])
}

fn mirrored_rect(rect: Rect) -> Rect {
    Rect::new([-rect.x().high(), rect.y().low()], [-rect.x().low(), rect.y().high()]).unwrap()
}

/// Checks a calculus of two objects that has a converse.
fn converses_agree<C>(calculus: &C, before: [C::Scene; 2], now: [C::Scene; 2])
where
    C: Calculus,
    C::Relation: Converse,
{
    let relate = |i: usize| calculus.relate(Some((&before[i], 1.0)), &now[i]).unwrap();
    assert_eq!(relate(0).converse(), relate(1));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn the_relation_of_b_to_a_is_the_converse(
        k in [somewhere(), somewhere()],
        l in [somewhere(), somewhere()],
        a in rect(),
        b in rect(),
        q in prop_oneof![Just(0.0), 0.0..2.0],
    ) {
        let (before, now) = ([[k[0], l[0]], [l[0], k[0]]], [[k[1], l[1]], [l[1], k[1]]]);
        let quantisation = Quantisation::distance(q).unwrap();
        converses_agree(&Basic { quantisation }, before, now);
        converses_agree(&DoubleCross { quantisation }, before, now);
        converses_agree(&Switching::new(quantisation, 2.0).unwrap(), before, now);
        converses_agree(&Directions, before, now);
        converses_agree(&Orders, before, now);
        let scale = [("near", 1.0), ("far", 4.0)];
        converses_agree(&Scale::new(scale, Bound::Upper).unwrap(), before, now);
        let rects = [[a, b], [b, a]];
        converses_agree(&Rectangles::new(q).unwrap(), rects, rects);
        converses_agree(&Intervals::new(q).unwrap(), rects.map(|pair| pair.map(|rect| rect.x())), rects.map(|pair| pair.map(|rect| rect.x())));
        converses_agree(&Regions::<Rcc8>::new(q).unwrap(), rects, rects);
        converses_agree(&Regions::<Rcc5>::new(q).unwrap(), rects, rects);
        let (one, other) = (Rcc4::from(Rcc8::of(a, b, q)), Rcc4::from(Rcc8::of(b, a, q)));
        prop_assert!(one.converses().contains(other));
    }

    #[test]
    fn the_relation_of_j_to_i_is_one_of_the_converses(i in oriented(), j in oriented()) {
        let tolerances = Projections::default();
        let (one, other) = (Qrpc::of(i, j, &tolerances), Qrpc::of(j, i, &tolerances));
        prop_assert!(one.converses().contains(other), "{one}, {other}, {}", one.converses());
    }

    #[test]
    fn every_qrpc_of_two_oriented_points_exists(i in oriented(), j in oriented(), angle in 0.0..0.5, distance in 0.0..2.0) {
        let found = Qrpc::of(i, j, &Projections::new(angle, distance).unwrap());
        let [i_ahead, j_ahead] = found.crossing();
        let again = Qrpc::new(found.disposition(), found.side(), [i_ahead, j_ahead], found.ahead());
        prop_assert_eq!(again, Some(found));
    }

    #[test]
    fn the_mirror_swaps_left_and_right(
        k in [somewhere(), somewhere()],
        l in [somewhere(), somewhere()],
        a in rect(),
        b in rect(),
        i in oriented(),
        j in oriented(),
        q in prop_oneof![Just(0.0), 0.0..2.0],
    ) {
        prop_assert_eq!(QtcC::of(k, l, q).mirrored(), QtcC::of(k.map(mirrored), l.map(mirrored), q));
        let tpcc = |points: [Point; 3]| Tpcc::of(points[0], points[1], points[2], 1e-9);
        let points = [k[0], l[0], k[1]];
        prop_assert_eq!(tpcc(points).mirrored(), tpcc(points.map(mirrored)));
        prop_assert_eq!(Direction::of(k[0], l[0]).mirrored(), Direction::of(mirrored(k[0]), mirrored(l[0])));
        let (am, bm) = (mirrored_rect(a), mirrored_rect(b));
        prop_assert_eq!(Rectangular::of(a, b, q).mirrored(), Rectangular::of(am, bm, q));
        prop_assert_eq!(Rcc8::of(a, b, q), Rcc8::of(am, bm, q));
        let mirror = |at: Oriented| Oriented::new(mirrored(at.position()), TAU / 2.0 - at.heading_rad()).unwrap();
        let tolerances = Projections::default();
        prop_assert_eq!(Qrpc::of(i, j, &tolerances).mirrored(), Qrpc::of(mirror(i), mirror(j), &tolerances));
    }

    #[test]
    fn collinear_and_coincident_points_are_invariant_under_quarter_turns(
        points in [on_grid(), on_grid(), on_grid(), on_grid()],
        quarters in 0_u8..4,
        shift in on_grid(),
        q in 0_u8..3,
    ) {
        let points = points.map(point);
        let moved = points.map(|at| turned(at, quarters, shift));
        let qtc = |[a, b, c, d]: [Point; 4]| QtcC::of([a, b], [c, d], f64::from(q));
        prop_assert_eq!(qtc(points), qtc(moved));
        let tpcc = |[a, b, c, _]: [Point; 4]| Tpcc::of(a, b, c, 1e-9);
        prop_assert_eq!(tpcc(points), tpcc(moved));
        let scale = Scale::new([("near", 1.0), ("far", 4.0)], Bound::Lower).unwrap();
        prop_assert_eq!(scale.rank(points[0].distance(points[1])), scale.rank(moved[0].distance(moved[1])));
    }

    #[test]
    fn relations_are_invariant_under_rotation_and_translation(
        points in [anywhere(), anywhere(), anywhere(), anywhere()],
        headings in [0.0..TAU, 0.0..TAU],
        angle in 0.0..TAU,
        shift in anywhere(),
        q in 0.01..2.0,
    ) {
        let points = points.map(point);
        let moved = points.map(|at| rotated(at, angle, shift));
        let qtc = |[a, b, c, d]: [Point; 4], q: f64| QtcC::of([a, b], [c, d], q);
        // Motions that are exactly as long as the quantisation may fall on either side of it.
        if qtc(points, q - 1e-9) == qtc(points, q + 1e-9) {
            prop_assert_eq!(qtc(points, q), qtc(moved, q));
        }
        let tpcc = |[a, b, c, _]: [Point; 4]| Tpcc::of(a, b, c, 0.01);
        let wobbled = points.map(|at| rotated(at, 0.0, [1e-9, 0.0]));
        if tpcc(points) == tpcc([points[0], points[1], wobbled[2], points[3]]) {
            prop_assert_eq!(tpcc(points), tpcc(moved));
        }
        let qrpc = |[a, b, ..]: [Point; 4], turn: f64| {
            let [i, j] = [(a, headings[0]), (b, headings[1])].map(|(at, heading)| Oriented::new(at, heading + turn).unwrap());
            Qrpc::of(i, j, &Projections::default())
        };
        prop_assert_eq!(qrpc(points, 0.0), qrpc(moved, angle));
    }

    #[test]
    fn composition_contains_the_relation_of_the_third(
        points in [somewhere(), somewhere(), somewhere()],
        rects in [rect(), rect(), rect()],
        bound in prop_oneof![Just(Bound::Upper), Just(Bound::Lower)],
    ) {
        let [a, b, c] = points;
        prop_assert!(Direction::of(a, b).compose(Direction::of(b, c)).contains(Direction::of(a, c)));
        prop_assert!(Order::of(a, b).compose(Order::of(b, c)).contains(Order::of(a, c)));
        let scale = Scale::new([("at", 1.0), ("near", 3.0), ("far", 4.0), ("beyond", 9.0)], bound).unwrap();
        let rank = |a: Point, b: Point| scale.rank(a.distance(b));
        let composed = scale.compose(rank(a, b), rank(b, c));
        prop_assert!(composed.contains(&rank(a, c)), "{composed:?}");
        let [a, b, c] = rects;
        let ra = |a, b| Rectangular::of(a, b, 0.0);
        prop_assert!(ra(a, b).compose(ra(b, c)).contains(ra(a, c)));
        let rcc = |a, b| Rcc8::of(a, b, 0.0);
        prop_assert!(rcc(a, b).compose(rcc(b, c)).contains(rcc(a, c)));
    }

    #[test]
    fn without_quantisation_results_equal_those_of_qsrlib(
        k in [somewhere(), somewhere()],
        l in [somewhere(), somewhere()],
        a in rect(),
        b in rect(),
    ) {
        let bounds = |rect: Rect| [rect.x().low(), rect.y().low(), rect.x().high(), rect.y().high()];
        prop_assert_eq!(qsrlib::rcc8(bounds(a), bounds(b), 0.0), Rcc8::of(a, b, 0.0));
        prop_assert_eq!(qsrlib::rectangular(bounds(a), bounds(b)), Rectangular::of(a, b, 0.0));
        if k[0] != l[0] {
            let found = qsrlib::qtc(Which::Qtccs, &[[k[0], l[0]], [k[1], l[1]]], &Parameters::default());
            prop_assert_eq!(found, [QtcBc::Near(QtcC::of(k, l, 0.0))]);
        }
    }

    #[test]
    fn a_validated_series_of_qtc_has_no_jumps_and_keeps_its_times(
        walk in prop::collection::vec((somewhere(), somewhere(), prop::bool::weighted(0.9), 0.01..1.0), 2..40),
    ) {
        let mut time_s = 0.0;
        let samples: Vec<_> = walk.iter().map(|(k, l, is_seen, pause)| {
            time_s += pause;
            (time_s, is_seen.then_some([*k, *l]))
        }).collect();
        is_continuous(series(Basic::default(), Options::default(), samples.clone()).unwrap())?;
        is_continuous(series(DoubleCross::default(), Options::default(), samples.clone()).unwrap())?;
        is_continuous(series(Switching::new(Quantisation::NONE, 4.0).unwrap(), Options::default(), samples.clone()).unwrap())?;
        // The whole series equals QSRlib's, except for points that coincide.
        if samples.iter().all(|(_, scene)| scene.is_some_and(|[k, l]| k != l)) {
            let ours = series(DoubleCross::default(), Options::default(), samples.clone()).unwrap();
            let points: Vec<_> = samples.iter().filter_map(|(_, scene)| *scene).collect();
            let theirs = qsrlib::qtc(Which::Qtccs, &points, &Parameters::default());
            prop_assert_eq!(ours.iter().map(|timed| QtcBc::Near(timed.relation)).collect::<Vec<_>>(), theirs);
        }
    }

    #[test]
    fn a_resumed_stream_continues_identically(
        walk in prop::collection::vec((somewhere(), somewhere(), prop::bool::weighted(0.9)), 2..20),
        at in 0_usize..20,
    ) {
        let mut whole = Stream::new(Switching::default(), Options::default());
        let mut resumed = whole.clone();
        for (i, (k, l, is_seen)) in walk.iter().enumerate() {
            let scene = is_seen.then_some([*k, *l]);
            if i == at {
                let state = serde_json::to_string(&resumed.state()).unwrap();
                let state = serde_json::from_str(&state).unwrap();
                resumed = Stream::resumed(Switching::default(), Options::default(), state);
            }
            prop_assert_eq!(whole.push(i as f64, scene), resumed.push(i as f64, scene));
        }
    }

    #[test]
    fn arbitrary_numbers_make_points_or_errors(numbers in prop::array::uniform4(any::<f64>())) {
        let [a, b, c, d] = numbers;
        if let (Ok(k), Ok(l)) = (Point::new(a, b), Point::new(c, d)) {
            let relation = QtcC::of([k, l], [l, k], 0.0);
            prop_assert_eq!(relation.converse(), QtcC::of([l, k], [k, l], 0.0));
            Tpcc::of(k, l, k, 0.0);
            prop_assert_eq!(Direction::of(k, l).converse(), Direction::of(l, k));
        }
        prop_assert!(Rect::new([a, b], [c, d]).is_ok() == (Interval::new(a, c).is_ok() && Interval::new(b, d).is_ok()));
        prop_assert!(Quantisation::distance(a).is_ok() == (0.0..=1e150).contains(&a));
    }
}

fn is_continuous<R: Relation>(found: Vec<sketchnav_qualitative::Timed<R>>) -> Result<(), TestCaseError> {
    for pair in found.windows(2) {
        let [one, next] = pair else { continue };
        prop_assert!(one.from_s <= next.from_s && next.from_s <= next.to_s && one.to_s <= next.to_s);
        match next.change {
            Change::First => {}
            Change::Inserted | Change::Neighbour => prop_assert!(one.relation.is_neighbour(next.relation)),
            Change::Same | Change::Jump => prop_assert!(false, "{one:?}, {next:?}"),
        }
    }
    Ok(())
}
