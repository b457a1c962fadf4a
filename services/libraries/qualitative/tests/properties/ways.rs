//! Properties of the flip-flop calculus: its permutations and its composition are what points show.

use proptest::prelude::*;
use sketchnav_qualitative::Point;
use sketchnav_qualitative::algebra::{Relation, RelationSet};
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
        // Shares at which c is as good as at an end are left out.
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
