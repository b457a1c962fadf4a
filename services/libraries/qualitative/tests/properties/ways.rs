//! Properties of flip-flop and of the double cross: their permutations and compositions match those of actual
//! points.

use std::f64::consts::TAU;

use proptest::prelude::*;
use sketchnav_qualitative::Point;
use sketchnav_qualitative::algebra::{Relation, RelationSet};
use sketchnav_qualitative::doublecross::DoubleCross;
use sketchnav_qualitative::flipflop::FlipFlop;
use sketchnav_qualitative::tpcc::Permutation;

use crate::point;
use crate::scenes::{anywhere, somewhere};

fn of([a, b, c]: [Point; 3]) -> FlipFlop {
    FlipFlop::of(a, b, c, 1e-9)
}

#[test]
fn the_composition_of_flip_flop_is_what_four_points_of_a_grid_show() {
    let places: Vec<_> = (0..25).map(|i| point([f64::from(i % 5), f64::from(i / 5)])).collect();
    let mut shown = [[RelationSet::<FlipFlop>::EMPTY; 9]; 9];
    for a in &places {
        for b in &places {
            for c in &places {
                let first = of([*a, *b, *c]).index();
                for d in &places {
                    shown[first][of([*b, *c, *d]).index()].insert(of([*a, *b, *d]));
                }
            }
        }
    }
    for a in FlipFlop::all() {
        for b in FlipFlop::all() {
            assert_eq!(a.compose(b), shown[a.index()][b.index()], "{a}, {b}");
        }
    }
    assert_eq!(FlipFlop::Left.compose(FlipFlop::Left).to_string(), "{l r i s b}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn points_agree_with_permutations_composition_and_mirror(
        points in [somewhere(), somewhere(), somewhere()],
        d in somewhere(),
    ) {
        let [a, b, c] = points;
        for by in Permutation::ALL {
            prop_assert_eq!(of(points).permuted(by), of(by.apply(points)), "{:?}", by);
        }
        prop_assert!(of(points).compose(of([b, c, d])).contains(of([a, b, d])));
        prop_assert_eq!(of(points).mirrored(), of(points.map(|at| point([-at.x(), at.y()]))));
    }

    #[test]
    fn points_on_a_way_stay_on_it_whatever_is_rounded(a in anywhere(), b in anywhere(), share in -2.0..3.0) {
        let c = [0, 1].map(|i| a[i] + share * (b[i] - a[i]));
        let expected = match share {
            ..0.0 => FlipFlop::Back,
            0.0..1.0 => FlipFlop::Inside,
            _ => FlipFlop::Front,
        };
        let [a, b, c] = [a, b, c].map(point);
        // Positions of c that are almost at an end are left out.
        prop_assume!(c.distance(a) > 1e-6 && c.distance(b) > 1e-6 && a.distance(b) > 1e-6);
        prop_assert_eq!(of([a, b, c]), expected);
    }
}

#[test]
fn the_same_points_in_another_order_have_another_word() {
    let words =
        |by: Permutation| FlipFlop::all().map(|r| r.permuted(by).to_string()).collect::<Vec<_>>().join(" ");
    // In the order l r f e i s b dou tri.
    assert_eq!(words(Permutation::Inverse), "r l b s i e f dou tri");
    assert_eq!(words(Permutation::ShortCut), "r l i e f dou b s tri");
    assert_eq!(words(Permutation::Homing), "l r b dou f e i s tri");
}

fn crossed([a, b, c]: [Point; 3]) -> DoubleCross {
    DoubleCross::of(a, b, c, 1e-9)
}

/// Returns the relation of c, which lies at the given angle from straight ahead at b. `distance` says whether c is farther from b
/// than the perpendicular at a is in that direction (1), nearer (−1), or as far (0). It does not matter if c is ahead of b.
fn at_angle(angle: f64, distance: Option<i32>) -> DoubleCross {
    let zone = match (angle.cos(), distance) {
        (ahead, _) if ahead > 1e-9 => 0,
        (ahead, _) if ahead > -1e-9 => 1,
        (_, Some(..0)) => 2,
        (_, Some(0)) => 3,
        _ => 4,
    };
    let side = match angle.sin() {
        left if left > 1e-9 => 0,
        left if left > -1e-9 => 1,
        _ => 2,
    };
    DoubleCross::ALL[5 * side + zone]
}

/// Returns whether c and d can exist at the given angles from straight ahead at b. `signs` compare distances: that of c from b with
/// that of the perpendicular at a, that of d with that of the perpendicular at c, and that of d with that of the perpendicular at
/// a, where these exist.
fn lengths_exist([to_c, to_d]: [f64; 2], signs: [Option<i32>; 3]) -> bool {
    let [Some(c), Some(d), Some(last)] = signs else { return true };
    let at_c = 1.0 / (to_c.cos().abs() * (to_d - to_c).cos());
    let limit = 1.0 / to_d.cos().abs();
    // The distances of d that c permits, in the open range from `low` to `high`, or only `low`.
    let (low, high) = match (c, d) {
        (0, 0) => (at_c, at_c),
        (-1, -1 | 0) | (0, -1) => (0.0, at_c),
        (1, 0 | 1) | (0, 1) => (at_c, f64::INFINITY),
        _ => (0.0, f64::INFINITY),
    };
    let e = 1e-9 * limit;
    if low == high {
        return last == if low < limit - e { -1 } else { i32::from(low > limit + e) };
    }
    match last {
        -1 => low < limit - e,
        0 => low < limit - e && limit < high - e,
        _ => high > limit + e,
    }
}

/// Compares the composition that was found on grids of points with all angles in steps of 3° and all orders of lengths.
#[test]
fn the_composition_of_the_double_cross_is_what_angles_and_lengths_permit() {
    let mut shown = [[RelationSet::<DoubleCross>::EMPTY; 17]; 17];
    let compared = |angle: f64, is_ahead: bool| {
        let is_compared = if is_ahead { angle.cos() > 1e-9 } else { angle.cos() < -1e-9 };
        if is_compared { vec![Some(-1), Some(0), Some(1)] } else { vec![None] }
    };
    let angles = || (0..120).map(|i| f64::from(i) * TAU / 120.0);
    for [to_c, to_d] in angles().flat_map(|to_c| angles().map(move |to_d| [to_c, to_d])) {
        let turn = to_d - to_c;
        for c in compared(to_c, false) {
            for d in compared(turn, true) {
                for last in compared(to_d, false) {
                    if lengths_exist([to_c, to_d], [c, d, last]) {
                        let first = at_angle(to_c, c);
                        // If d is ahead of b, the perpendicular at c separates its positions. Behind b, there is none.
                        let next = match (d, at_angle(turn, d)) {
                            (Some(distance), seen) => {
                                let zone = [2, 1, 0][(distance + 1) as usize];
                                DoubleCross::ALL[seen.index() / 5 * 5 + zone]
                            }
                            (None, seen) if turn.cos() > -1e-9 => DoubleCross::ALL[seen.index() / 5 * 5 + 3],
                            (None, seen) => DoubleCross::ALL[seen.index() / 5 * 5 + 4],
                        };
                        shown[first.index()][next.index()].insert(at_angle(to_d, last));
                    }
                }
            }
        }
    }
    let is_apart = |relation: DoubleCross| {
        !matches!(relation, DoubleCross::If | DoubleCross::Ib | DoubleCross::Dou | DoubleCross::Tri)
    };
    let mut entries = 0;
    for a in DoubleCross::all().filter(|a| is_apart(*a) || *a == DoubleCross::Ib) {
        for b in DoubleCross::all().filter(|b| is_apart(*b) || *b == DoubleCross::If) {
            let composed = a.compose(b).iter().filter(|last| *last != DoubleCross::If);
            assert_eq!(composed.collect::<RelationSet<_>>(), shown[a.index()][b.index()], "{a}, {b}");
            entries += a.compose(b).len();
        }
    }
    assert_eq!(entries, 510);
    assert_eq!(DoubleCross::Sf.compose(DoubleCross::Lf).to_string(), "{lf}");
    assert_eq!(DoubleCross::Lc.compose(DoubleCross::If).to_string(), "{lc}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn points_agree_with_the_tables_of_the_double_cross(
        points in [somewhere(), somewhere(), somewhere()],
        d in somewhere(),
    ) {
        let [a, b, c] = points;
        for by in Permutation::ALL {
            let permuted = crossed(points).permuted(by);
            prop_assert!(permuted.contains(crossed(by.apply(points))), "{:?} of {}", by, crossed(points));
        }
        let (first, next, last) = (crossed(points), crossed([b, c, d]), crossed([a, b, d]));
        prop_assert!(first.compose(next).contains(last), "{first}, {next}, {last}");
        prop_assert_eq!(first.mirrored(), crossed(points.map(|at| point([-at.x(), at.y()]))));
    }
}

#[test]
fn the_perpendiculars_divide_the_way_into_zones() {
    let at = |x: f64, y: f64| crossed([[0.0, 0.0], [2.0, 0.0], [x, y]].map(point)).to_string();
    let ahead = [3.0, 2.0, 1.0, 0.0, -1.0];
    assert_eq!(ahead.map(|x| at(x, 1.0)), ["lf", "lp", "lc", "ll", "lb"]);
    assert_eq!(ahead.map(|x| at(x, 0.0)), ["sf", "if", "sc", "ib", "sb"]);
    assert_eq!(ahead.map(|x| at(x, -1.0)), ["rf", "rp", "rc", "rl", "rb"]);
    let words = |by| DoubleCross::Lc.permuted(by).to_string();
    assert_eq!(words(Permutation::Inverse), "{rc}");
    // Either c is at least a right angle away from a or b, or both are as seen from c.
    assert_eq!(words(Permutation::Homing), "{lf lp lc}");
}
