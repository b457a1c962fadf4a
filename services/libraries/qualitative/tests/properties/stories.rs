//! Regression tests for past errors, here or in QSRlib, and statements of the literature about particular scenes.

use std::fmt::Debug;

use sketchnav_qualitative::algebra::Relation;
use sketchnav_qualitative::argd::{Bound, Scale};
use sketchnav_qualitative::mos::{Motion, Motions};
use sketchnav_qualitative::order::Orders;
use sketchnav_qualitative::qrpc::{Projections, Qrpc};
use sketchnav_qualitative::qsrlib::{self, Parameters, Which};
use sketchnav_qualitative::qtc::{Basic, QtcB, QtcBc, QtcC, Switching};
use sketchnav_qualitative::rcc::{Rcc8, Regions};
use sketchnav_qualitative::rectangle::Rectangles;
use sketchnav_qualitative::series::{Options, Stream, joined, series};
use sketchnav_qualitative::tpcc::{Configurations, Permutation, Tpcc};
use sketchnav_qualitative::{Oriented, Point, Quantisation, Rect};

use crate::point;
use crate::scenes::rotated;

fn words<R: Debug + std::fmt::Display>(
    found: impl IntoIterator<Item = sketchnav_qualitative::Timed<R>>,
) -> Vec<String> {
    found
        .into_iter()
        .map(|timed| format!("{} {}..{} {:?}", timed.relation, timed.from_s, timed.to_s, timed.change))
        .collect()
}

fn on_line(places: &[(f64, f64)]) -> Vec<(f64, [Point; 2])> {
    places.iter().map(|(time_s, x)| (*time_s, [point([*x, 0.0]), point([10.0, 0.0])])).collect()
}

#[test]
fn a_relation_of_motion_has_both_times() {
    // QSRlib numbers the relations instead, and its issue 82 asks which pose they belong to.
    let samples = on_line(&[(0.0, 0.0), (0.1, 1.0), (0.4, 2.0), (0.5, 1.0)])
        .into_iter()
        .map(|(t, scene)| (t, Some(scene)));
    let found = series(Basic::default(), Options::default(), samples).unwrap();
    assert_eq!(words(found), ["-,0 0..0.4 First", "0,0 0.4..0.5 Inserted", "+,0 0.4..0.5 Neighbour"]);
}

#[test]
fn an_object_that_is_not_seen_leaves_a_gap() {
    // QSRlib stops with an error, or relates positions before the gap to positions after it (its issues 27, 88 and 237).
    let seen = |time_s, x: f64| (time_s, Some([point([x, 0.0]), point([10.0, 0.0])]));
    let samples =
        [seen(0.0, 0.0), seen(1.0, 1.0), (2.0, None), seen(3.0, 0.5), seen(4.0, 0.0), seen(5.0, -1.0)];
    let found = series(Basic::default(), Options::default(), samples).unwrap();
    assert_eq!(words(found), ["-,0 0..1 First", "+,0 3..5 First"]);
    let long = Options { max_gap_s: Some(1.5), ..Options::default() };
    let samples = [seen(0.0, 0.0), seen(1.0, 1.0), seen(3.0, 0.5), seen(4.0, 0.0)];
    assert_eq!(words(series(Basic::default(), long, samples).unwrap()), ["-,0 0..1 First", "+,0 3..4 First"]);
}

#[test]
fn tracks_with_lost_and_extra_times_are_joined() {
    let a = [(0.0, 'a'), (1.0, 'b'), (3.0, 'c')];
    let b = [(1.0, 'x'), (2.0, 'y'), (3.0, 'z'), (4.0, 'w')];
    let found: Vec<_> = joined(&a, &b).collect();
    let expected = [(0.0, None), (1.0, Some(['b', 'x'])), (2.0, None), (3.0, Some(['c', 'z'])), (4.0, None)];
    assert_eq!(found, expected);
}

#[test]
fn a_sample_that_is_not_later_is_rejected_and_changes_nothing() {
    let mut stream = Stream::new(Orders, Options::default());
    let scene = Some([point([0.0, 0.0]), point([1.0, 0.0])]);
    assert!(stream.push(1.0, scene).is_ok());
    let state = stream.state();
    for time_s in [1.0, 0.5, f64::NAN, f64::INFINITY] {
        let error = stream.push(time_s, scene).unwrap_err();
        assert!(error.to_string().starts_with("sample 1: expected a time after 1 s, found"), "{error}");
        assert_eq!(stream.state(), state);
    }
}

#[test]
fn missed_relations_between_samples_are_inserted_or_marked() {
    let boxes =
        |x: f64| [Rect::new([x, 0.0], [x + 2.0, 2.0]).unwrap(), Rect::new([5.0, -1.0], [9.0, 3.0]).unwrap()];
    let samples = [(0.0, 0.0), (1.0, 4.0), (2.0, 6.0)].map(|(time_s, x)| (time_s, Some(boxes(x))));
    let found = series(Regions::<Rcc8>::default(), Options::default(), samples).unwrap();
    // Between partial overlap and inside, the regions may have been a tangential part or equal, so nothing is inserted.
    let expected = ["dc 0..0 First", "ec 0..1 Inserted", "po 1..1 Neighbour", "ntpp 2..2 Jump"];
    assert_eq!(words(found), expected);
    let samples = [(0.0, 0.0), (1.0, 6.0)].map(|(time_s, x)| (time_s, Some(boxes(x))));
    let found = series(Regions::<Rcc8>::default(), Options::default(), samples).unwrap();
    assert_eq!(words(found), ["dc 0..0 First", "ntpp 1..1 Jump"]);
    let plain = Options { collapse: false, validate: false, max_gap_s: None };
    let samples = [(0.0, 0.0), (1.0, 0.5), (2.0, 4.0)].map(|(time_s, x)| (time_s, Some(boxes(x))));
    let found = series(Regions::<Rcc8>::default(), plain, samples).unwrap();
    assert_eq!(words(found), ["dc 0..0 First", "dc 1..1 Same", "po 2..2 Jump"]);
}

#[test]
fn leaving_a_common_place_is_moving_away() {
    // QSRlib divides by the distance of 0 and then reports that nothing moves.
    let [here, there] = [point([1.0, 1.0]), point([2.0, 1.0])];
    assert_eq!(QtcC::of([here, there], [here, here], 0.0).to_string(), "+,0,0,0");
    assert_eq!(QtcC::of([here, there], [here, here], 1.5).to_string(), "0,0,0,0");
    let theirs = qsrlib::qtc(Which::Qtccs, &[[here, here], [there, here]], &Parameters::default());
    assert_eq!(theirs[0].to_string(), "0,0,0,0");
}

#[test]
fn touching_boxes_touch_within_a_tolerance() {
    // With a quantisation of 1, QSRlib reports that the regions overlap, and that regions with a gap of 1.5 touch.
    let bounds = |gap: f64| ([0.0, 0.0, 4.0, 4.0], [4.0 + gap, 0.0, 8.0 + gap, 4.0]);
    let rect = |[x0, y0, x1, y1]: [f64; 4]| Rect::new([x0, y0], [x1, y1]).unwrap();
    let ours = |gap: f64| {
        let (a, b) = bounds(gap);
        Rcc8::of(rect(a), rect(b), 1.0)
    };
    let theirs = |gap: f64| {
        let (a, b) = bounds(gap);
        qsrlib::rcc8(a, b, 1.0)
    };
    assert_eq!(
        [0.0, 0.5, 1.5, 2.5, -0.5, -2.0].map(ours),
        [Rcc8::Ec, Rcc8::Ec, Rcc8::Dc, Rcc8::Dc, Rcc8::Ec, Rcc8::Po]
    );
    assert_eq!([0.0, 0.5, 1.5, 2.5].map(theirs), [Rcc8::Po, Rcc8::Po, Rcc8::Ec, Rcc8::Dc]);
}

#[test]
fn points_straight_ahead_have_a_relation_despite_rounding() {
    // QSRlib raises an IndexError if an angle of −1e-16 becomes a full turn.
    for i in 0..2000 {
        let angle = f64::from(i) * 0.0123;
        let along = |r: f64| rotated(point([r, 0.0]), angle, [0.3, -0.7]);
        assert_eq!(Tpcc::of(along(0.0), along(1.3), along(1.9), 1e-9), Tpcc::Csb, "{angle}");
        assert_eq!(qsrlib::tpcc(along(0.0), along(1.3), along(1.9)), Tpcc::Csb, "{angle}");
        assert_eq!(Tpcc::of(along(0.0), along(1.3), along(3.9), 1e-9), Tpcc::Dsb, "{angle}");
    }
}

#[test]
fn an_origin_at_the_relatum_has_no_direction() {
    let [a, b] = [point([1.0, 2.0]), point([3.0, 3.0])];
    assert_eq!(Tpcc::of(a, a, b, 0.0), Tpcc::Dou);
    assert_eq!(Tpcc::of(a, a, a, 0.0), Tpcc::Tri);
    assert_eq!(Tpcc::of(b, a, a, 0.0), Tpcc::Sam);
    // QSRlib takes east as the line of sight.
    assert_eq!(qsrlib::tpcc(a, a, b), Tpcc::Dlb);
}

#[test]
fn a_border_of_two_sectors_has_a_mirror_image() {
    let [o, r] = [point([-2.0, 0.0]), point([0.0, 0.0])];
    let left = Tpcc::of(o, r, point([1.0, 1.0]), 1e-9);
    assert_eq!([left, Tpcc::of(o, r, point([1.0, -1.0]), 1e-9)], [Tpcc::Clb, Tpcc::Crb]);
    // QSRlib puts the border into the next sector counter-clockwise.
    assert_eq!(qsrlib::tpcc(o, r, point([1.0, 1.0])), Tpcc::Cbl);
    assert_eq!(qsrlib::tpcc(o, r, point([1.0, -1.0])), Tpcc::Crb);
}

#[test]
fn crossing_the_threshold_of_qtc_bc_inserts_the_relation_at_it() {
    // From far and − to near and +, near holds at the threshold, and QSRlib agrees. In the opposite case QSRlib inserts (0 0),
    // which cannot be reached from (- 0 + 0), because − and near cannot become 0 and far at the same time.
    let relation = |word: &str| word.parse::<QtcBc>().unwrap();
    assert_eq!(relation("-,0").between(relation("+,0,+,0")), Some(relation("0,0,+,0")));
    assert_eq!(relation("-,0,+,0").between(relation("+,0")), Some(relation("0,0,+,0")));
    assert_eq!(relation("-,0").between(relation("-,0,+,-")), None);
    assert!(!relation("-,0,+,0").is_neighbour(relation("0,0")));
}

#[test]
fn thresholds_of_distance_are_upper_or_lower_bounds() {
    // In Patil 2019, 3.1.2, a distance of 3.7 m is Medium. With the same thresholds, QSRlib returns Far.
    let labels = [("Far", 4.0), ("Near", 3.0), ("Medium", 3.5)];
    let [upper, lower] = [Bound::Upper, Bound::Lower].map(|bound| Scale::new(labels, bound).unwrap());
    let label = |scale: &Scale, distance: f64| scale.label(scale.rank(distance)).unwrap().to_owned();
    let distances = [0.0, 2.9, 3.0, 3.2, 3.5, 3.7, 4.0, 40.0];
    assert_eq!(
        distances.map(|d| label(&upper, d)),
        ["Near", "Near", "Near", "Medium", "Medium", "Far", "Far", "Far"]
    );
    assert_eq!(
        distances.map(|d| label(&lower, d)),
        ["Near", "Near", "Near", "Near", "Medium", "Medium", "Far", "Far"]
    );
    assert!(upper.parse("Nearby").unwrap_err().to_string().contains("Near Medium Far"));
    for (labels, expected) in [
        (vec![], "expected 1 to 64 thresholds, found 0"),
        (vec![("a", 1.0), ("b", 1.0)], "threshold 1: expected a finite number above 1, found 1"),
        (vec![("a", f64::NAN)], "threshold 0: expected a finite number above 0, found NaN"),
        (vec![("a", -1.0)], "threshold 0: expected a finite number above 0, found -1"),
    ] {
        assert_eq!(Scale::new(labels, Bound::Upper).unwrap_err().to_string(), expected);
    }
}

#[test]
fn ranked_distances_compose_by_the_triangle_inequality() {
    let scale = Scale::new([("close", 1.0), ("near", 3.0), ("far", 10.0)], Bound::Upper).unwrap();
    let rank = |label: &str| scale.parse(label).unwrap();
    assert_eq!(scale.compose(rank("close"), rank("close")), rank("close")..=rank("near"));
    assert_eq!(scale.compose(rank("close"), rank("far")), rank("near")..=rank("far"));
    assert_eq!(scale.compose(rank("near"), rank("near")), rank("close")..=rank("far"));
}

#[test]
fn signs_agree_with_the_literature() {
    // Left is − and right is +. Here k walks east towards l and to the north of the line, while l stands still.
    let at = |x: f64, y: f64| point([x, y]);
    let l = [at(10.0, 0.0); 2];
    assert_eq!(QtcC::of([at(0.0, 0.0), at(1.0, 1.0)], l, 0.0).to_string(), "-,0,-,0");
    assert_eq!(QtcC::of([at(0.0, 0.0), at(-1.0, -1.0)], l, 0.0).to_string(), "+,0,+,0");
    // The line from l is directed towards k, so left is south for l.
    assert_eq!(QtcC::of([at(0.0, 0.0); 2], [at(10.0, 0.0), at(9.0, -1.0)], 0.0).to_string(), "0,-,0,-");
    assert_eq!(QtcB::of([at(0.0, 0.0), at(1.0, 1.0)], l, 0.0).inverted().to_string(), "+,0");
}

#[test]
fn a_speed_does_not_depend_on_the_sampling_rate() {
    let samples = |rate: f64| {
        (0..20).map(move |i| {
            let time_s = f64::from(i) / rate;
            (time_s, Some([point([0.5 * time_s, 0.0]), point([100.0 - 0.1 * time_s, 0.0])]))
        })
    };
    let slow = Basic { quantisation: Quantisation::speed(0.2).unwrap() };
    for rate in [1.0, 10.0, 100.0] {
        let found = series(slow, Options::default(), samples(rate)).unwrap();
        assert_eq!(
            found.iter().map(|timed| timed.relation.to_string()).collect::<Vec<_>>(),
            ["-,0"],
            "{rate}"
        );
    }
    let far = Basic { quantisation: Quantisation::distance(0.2).unwrap() };
    assert_eq!(series(far, Options::default(), samples(10.0)).unwrap()[0].relation.to_string(), "0,0");
    let moves = Motions { quantisation: Quantisation::speed(0.2).unwrap() };
    let found = series(moves, Options::default(), samples(10.0).map(|(t, scene)| (t, scene.map(|[k, _]| k))))
        .unwrap();
    assert_eq!(found[0].relation, Motion::Moving);
}

#[test]
fn projections_agree_with_patil_2019() {
    let at = |x: f64, y: f64, degrees: f64| Oriented::new(point([x, y]), degrees.to_radians()).unwrap();
    let qrpc = |i: Oriented, j: Oriented| Qrpc::of(i, j, &Projections::default()).to_string();
    let east = at(0.0, 0.0, 0.0);
    // i comes from the north-west and crosses far in front of j.
    assert_eq!(qrpc(at(0.0, 5.0, -45.0), east), "[X - (+,+) +]");
    assert_eq!(qrpc(at(-5.0, -5.0, -90.0), east), "[X + (-,-) -]");
    assert_eq!(qrpc(at(0.0, 1.0, 0.0), east), "[↑↑ - (+,+) 0]");
    assert_eq!(qrpc(at(4.0, -1.0, 180.0), east), "[↑↓ + (+,+) +]");
    assert_eq!(qrpc(at(-4.0, -1.0, 180.0), east), "[↑↓ + (-,-) -]");
    assert_eq!(qrpc(at(4.0, 0.0, 0.0), east), "[↑ 0 (+,+) +]");
    assert_eq!(qrpc(at(4.0, 0.0, 180.0), east), "[↓ 0 (+,+) +]");
    assert_eq!(qrpc(east, east), "[↑ 0 (+,+) 0]");
    assert_eq!(qrpc(at(3.0, 0.0, 90.0), east), "[X 0 (0,+) +]");
}

#[test]
fn a_permutation_of_three_points_is_undone_by_its_inverse() {
    let sets = Permutation::ALL
        .map(|permutation| Tpcc::all().map(|of| of.permuted(permutation)).collect::<Vec<_>>());
    // The inverse of the short cut is the other cyclic order here, which homing undoes.
    let undone_by = [0, 1, 3, 2, 4];
    for (sets_there, back) in sets.iter().zip(undone_by) {
        for a in Tpcc::all() {
            assert!(!sets_there[a.index()].is_empty(), "{a}");
            for b in Tpcc::all() {
                let (there, again) = (sets_there[a.index()].contains(b), sets[back][b.index()].contains(a));
                assert_eq!(there, again, "{a}, {b}");
            }
        }
    }
    // Between the two points, or at the origin.
    assert_eq!(Tpcc::Csf.permuted(Permutation::Inverse).to_string(), "{csf sam}");
    assert_eq!(Tpcc::Sam.permuted(Permutation::ShortCut).to_string(), "{sam}");
    assert_eq!(Tpcc::Dsb.permuted(Permutation::Inverse).to_string(), "{dsf}");
}

#[test]
fn three_points_have_one_of_the_permuted_relations() {
    let sets = Permutation::ALL
        .map(|permutation| Tpcc::all().map(|of| of.permuted(permutation)).collect::<Vec<_>>());
    let relate = |[a, b, c]: [Point; 3]| Tpcc::of(a, b, c, Configurations::TOLERANCE_RAD);
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64
    };
    for i in 0..100_000 {
        // Half of the points are on a grid, which yields many on lines, at right angles and at equal distances.
        let mut at = || if i % 2 == 0 { next() % 7.0 } else { next() / 1e4 };
        let points = [0; 3].map(|_| point([at(), at()]));
        let own = relate(points);
        for (permutation, sets) in Permutation::ALL.iter().zip(&sets) {
            let other = relate(permutation.apply(points));
            assert!(sets[own.index()].contains(other), "{permutation:?} of {own}: {other}, {points:?}");
        }
    }
}

#[test]
fn configurations_beyond_range_are_rejected() {
    let error = Configurations::new(1.0).unwrap_err().to_string();
    assert_eq!(error, "tolerance_rad: expected 0 to below π/4, found 1");
    assert!(Switching::new(Quantisation::NONE, -1.0).is_err() && Rectangles::new(f64::NAN).is_err());
    assert!(Point::new(f64::NAN, 0.0).unwrap_err().to_string().starts_with("x: expected a number within"));
    let error = Rect::new([0.0, 1.0], [1.0, 1.0]).unwrap_err().to_string();
    assert_eq!(error, "height: expected an extent above 0, found 0");
}
