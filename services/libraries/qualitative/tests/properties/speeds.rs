//! Properties of QTC with relative speed, and of the composition of QTC: they match those of moving points.

use std::collections::BTreeSet;

use proptest::prelude::*;
use sketchnav_qualitative::Point;
use sketchnav_qualitative::algebra::{Compose, Converse, Relation, RelationSet};
use sketchnav_qualitative::qtc::{QtcB, QtcB22, QtcC, QtcC22, Sign};

use crate::point;
use crate::scenes::somewhere;

/// Returns a motion from a position by whole numbers.
fn motion(at: [i32; 2], by: [i32; 2]) -> [Point; 2] {
    [at, [at[0] + by[0], at[1] + by[1]]].map(|at| point(at.map(f64::from)))
}

fn square(reach: i32) -> impl Iterator<Item = [i32; 2]> + Clone {
    (-reach..=reach).flat_map(move |x| (-reach..=reach).map(move |y| [x, y]))
}

/// Returns the two signs of a point that moves with respect to another one.
fn part(at: [i32; 2], by: [i32; 2], other: [i32; 2]) -> [Sign; 2] {
    let relation = QtcC::of(motion(at, by), motion(other, [0, 0]), 0.0);
    [relation.k, relation.k_side]
}

/// Returns the signs that a point may have with respect to two others.
fn parts(at: [i32; 2], others: [[i32; 2]; 2]) -> BTreeSet<[[Sign; 2]; 2]> {
    square(3).map(|by| others.map(|other| part(at, by, other))).collect()
}

/// Tries three points on a grid that move by whole numbers, or rest.
#[test]
fn the_composition_of_qtc_is_what_three_moving_points_show() {
    let mut shown = vec![RelationSet::<QtcC>::EMPTY; 81 * 81];
    let related = |[k, k_side]: [Sign; 2], [l, l_side]: [Sign; 2]| QtcC { k, l, k_side, l_side };
    let l = [0, 0];
    for [k, m] in square(3).flat_map(|k| square(3).map(move |m| [k, m])) {
        let (of_k, of_l, of_m) = (parts(k, [l, m]), parts(l, [k, m]), parts(m, [l, k]));
        for ([k_l, k_m], [l_k, l_m]) in of_k.iter().flat_map(|k| of_l.iter().map(move |l| (*k, *l))) {
            for [m_l, m_k] in &of_m {
                let (kl, lm) = (related(k_l, l_k), related(l_m, *m_l));
                shown[kl.index() * 81 + lm.index()].insert(related(k_m, *m_k));
            }
        }
    }
    for a in QtcC::all() {
        for b in QtcC::all() {
            assert_eq!(a.compose(b), shown[a.index() * 81 + b.index()], "{a}, {b}");
        }
    }
    // l moves towards k and away from m, so it is between them, and they approach each other as they approach l.
    let composed = |first: &str, next: &str| first.parse::<QtcC>().unwrap().compose(next.parse().unwrap());
    assert_eq!(composed("-,-,0,0", "+,-,0,0").to_string(), "{-,-,0,0}");
    assert!(composed("-,0,0,0", "-,0,0,0").is_empty(), "l cannot both rest and move");
}

#[test]
fn the_composition_of_speeds_is_what_three_moving_points_show() {
    let mut shown = vec![RelationSet::<QtcB22>::EMPTY; 27 * 27];
    // In sixteen directions, motions at three speeds lead towards, away from and past all others.
    let places = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1]];
    let directions = || square(2).filter(|[x, y]| x.abs().max(y.abs()) == 2).map(|to| to.map(f64::from));
    let moving = || {
        directions().flat_map(|[x, y]| [1.0, 2.0, 3.0].map(|speed| [x, y].map(|to| to * speed / x.hypot(y))))
    };
    let motions = || moving().chain([[0.0, 0.0]]);
    let motion = |at: [i32; 2], by: [f64; 2]| {
        let at = at.map(f64::from);
        [at, [at[0] + by[0], at[1] + by[1]]].map(point)
    };
    for [k, l, m] in places.iter().flat_map(|k| places.map(|l| places.map(|m| [*k, l, m]))).flatten() {
        for (k, l) in motions().flat_map(|by| motions().map(move |of| (motion(k, by), motion(l, of)))) {
            let kl = QtcB22::of(k, l, 1e-9);
            for m in motions().map(|by| motion(m, by)) {
                shown[kl.index() * 27 + QtcB22::of(l, m, 1e-9).index()].insert(QtcB22::of(k, m, 1e-9));
            }
        }
    }
    for a in QtcB22::all() {
        for b in QtcB22::all() {
            assert_eq!(a.compose(b), shown[a.index() * 27 + b.index()], "{a}, {b}");
        }
    }
}

/// Without sides and speeds, nothing follows, which is why QTC_B has no composition.
#[test]
fn nothing_follows_from_relations_of_qtc_b() {
    let forms =
        |of: QtcB| QtcC::all().filter(move |relation| relation.basic() == of).collect::<RelationSet<_>>();
    for [a, b] in QtcB::all().flat_map(|a| QtcB::all().map(move |b| [a, b])) {
        let composed = forms(a).compose(forms(b)).iter().map(QtcC::basic);
        assert_eq!(composed.collect::<RelationSet<_>>(), RelationSet::universal(), "{a}, {b}");
    }
}

/// Every relation that is declared to exist does exist, and no others are found.
#[test]
fn all_relations_with_speed_and_angle_are_those_of_two_moving_points() {
    let mut found = [RelationSet::<QtcC22>::EMPTY];
    for (by, of) in square(5).flat_map(|by| square(5).map(move |of| (by, of))) {
        found[0].insert(QtcC22::of(motion([0, 0], by), motion([12, 0], of), 0.0));
    }
    assert_eq!(found[0], RelationSet::universal());
}

/// Returns which of the angles between a motion and the line to the other point is greater, by comparing their cosines.
fn angle(k: [Point; 2], l: [Point; 2]) -> Sign {
    let cosine = |[before, now]: [Point; 2], other: Point| {
        let (moved, to) = (now - before, other - before);
        moved.dot(to) / (moved.length() * to.length())
    };
    let difference = cosine(l, k[0]) - cosine(k, l[0]);
    if difference.is_nan() { Sign::Zero } else { Sign::of(difference, 1e-12) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn speeds_and_angles_agree_with_their_definitions(
        k in [somewhere(), somewhere()],
        l in [somewhere(), somewhere()],
        m in [somewhere(), somewhere()],
        q in prop_oneof![Just(0.0), 0.0..2.0],
    ) {
        let (basic, cross) = (QtcB22::of(k, l, q), QtcC22::of(k, l, q));
        prop_assert_eq!(basic.converse(), QtcB22::of(l, k, q));
        prop_assert_eq!(cross.converse(), QtcC22::of(l, k, q));
        prop_assert_eq!(QtcC22::from_signs(cross.signs()), Some(cross));
        prop_assert_eq!(cross.cross(), QtcC::of(k, l, q));
        let mirror = |motion: [Point; 2]| motion.map(|at| point([-at.x(), at.y()]));
        prop_assert_eq!(cross.mirrored(), QtcC22::of(mirror(k), mirror(l), q));
        prop_assert!(QtcB22::of(k, l, 0.0).compose(QtcB22::of(l, m, 0.0)).contains(QtcB22::of(k, m, 0.0)));
        prop_assert!(QtcC::of(k, l, 0.0).compose(QtcC::of(l, m, 0.0)).contains(QtcC::of(k, m, 0.0)));
        if q == 0.0 {
            let faster = k[0].distance(k[1]) - l[0].distance(l[1]);
            prop_assert_eq!(cross.speed(), Sign::of(faster, 0.0));
            prop_assert_eq!(basic.speed, Sign::of(faster, 0.0));
            prop_assert_eq!(cross.angle(), angle(k, l), "{}", cross);
        }
    }
}
