//! Properties of the dipole calculus: its converse, neighbourhood and composition match those of actual
//! segments.

use proptest::prelude::*;
use sketchnav_qualitative::algebra::{Compose, Converse, Relation, RelationSet};
use sketchnav_qualitative::dipole::{Dipole, DraC, DraF};
use sketchnav_qualitative::{Network, Table};

use crate::point;

fn dipole([start, end]: [[f64; 2]; 2]) -> Dipole {
    Dipole::new(point(start), point(end)).unwrap()
}

fn of(a: Dipole, b: Dipole) -> DraF {
    DraF::of(a, b, 0.0).unwrap()
}

/// Returns the dipoles between all points of a grid.
fn on_grid(width: u8, height: u8) -> Vec<Dipole> {
    let places = || (0..width).flat_map(|x| (0..height).map(move |y| [x, y].map(f64::from)));
    let pairs = places().flat_map(|start| places().map(move |end| [start, end]));
    pairs.filter(|[start, end]| start != end).map(dipole).collect()
}

/// Tries all arrangements of three dipoles on small grids.
#[test]
fn the_composition_of_dipoles_contains_what_three_segments_show() {
    let mut shown = vec![RelationSet::<DraF>::EMPTY; 72 * 72];
    for dipoles in [on_grid(5, 4), on_grid(7, 2), on_grid(6, 1)] {
        let row = |a: &Dipole| dipoles.iter().map(|b| of(*a, *b)).collect();
        let related: Vec<Vec<DraF>> = dipoles.iter().map(row).collect();
        for ac in &related {
            for (ab, bc) in ac.iter().zip(&related) {
                for (bc, ac) in bc.iter().zip(ac) {
                    shown[ab.index() * 72 + bc.index()].insert(*ac);
                }
            }
        }
    }
    let mut entries = [0, 0];
    for a in DraF::all() {
        for b in DraF::all() {
            let (composed, shown) = (a.compose(b), shown[a.index() * 72 + b.index()]);
            assert_eq!(composed.intersection(shown), shown, "{a}, {b}");
            entries[0] += composed.len();
            entries[1] += shown.len();
        }
    }
    // Entries that do not occur on these grids need finer ones.
    assert!(entries[1] * 10 > entries[0] * 9, "{entries:?}");
}

fn grid_or_anywhere() -> impl Strategy<Value = [[f64; 2]; 2]> {
    let on_grid =
        [[-3_i8..=3, -3_i8..=3], [-3_i8..=3, -3_i8..=3]].prop_map(|ends| ends.map(|at| at.map(f64::from)));
    let anywhere = [[-10.0..10.0, -10.0..10.0], [-10.0..10.0, -10.0..10.0]];
    prop_oneof![on_grid, anywhere].prop_filter("ends apart", |[start, end]| start != end)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn dipoles_agree_with_converse_composition_and_mirror(
        ends in [grid_or_anywhere(), grid_or_anywhere(), grid_or_anywhere()],
    ) {
        let [a, b, c] = ends.map(dipole);
        prop_assert_eq!(of(a, b).converse(), of(b, a));
        prop_assert!(of(a, b).compose(of(b, c)).contains(of(a, c)), "{}, {}, {}", of(a, b), of(b, c), of(a, c));
        let mirror = |ends: [[f64; 2]; 2]| dipole(ends.map(|[x, y]| [-x, y]));
        prop_assert_eq!(of(a, b).mirrored(), of(mirror(ends[0]), mirror(ends[1])));
        // The coarse relation is the fine one, if there is one.
        let coarse = DraC::of(a, b, 0.0);
        let needs_no_line = of(a, b).to_string().chars().all(|letter| "lrse".contains(letter));
        prop_assert_eq!(coarse.map(|word| word.to_string()), needs_no_line.then(|| of(a, b).to_string()));
        if let [Some(ab), Some(bc), Some(ac)] = [coarse, DraC::of(b, c, 0.0), DraC::of(a, c, 0.0)] {
            prop_assert!(ab.compose(bc).contains(ac));
        }
    }

    #[test]
    fn a_small_motion_leads_away_from_an_instant_by_its_limits(
        [a, b] in prop::array::uniform2([[-2_i8..=2, -2_i8..=2], [-2_i8..=2, -2_i8..=2]]),
        by in prop::array::uniform4(prop_oneof![[-9_i8..=9, -9_i8..=9], [Just(0), Just(0)]]),
    ) {
        prop_assume!(a[0] != a[1] && b[0] != b[1]);
        let moved = |share: f64| {
            let end = |at: [i8; 2], by: [i8; 2]| [0, 1].map(|axis| f64::from(at[axis]) + share * f64::from(by[axis]));
            let ends = [end(a[0], by[0]), end(a[1], by[1]), end(b[0], by[2]), end(b[1], by[3])];
            of(dipole([ends[0], ends[1]]), dipole([ends[2], ends[3]]))
        };
        // A power of two, so that no digit is lost.
        let (instant, after) = (moved(0.0), moved(2.0_f64.powi(-12)));
        prop_assert!(after == instant || after.limits_to(instant), "{after}, {instant}");
    }

    #[test]
    fn tolerances_make_neither_gaps_nor_panics(
        ends in [grid_or_anywhere(), grid_or_anywhere()],
        tolerance in 0.0..3.0,
    ) {
        let [a, b] = ends.map(dipole);
        prop_assert!(DraF::of(a, b, tolerance).is_some());
    }
}

#[test]
fn letters_say_where_the_ends_are() {
    let (a, ahead) = (dipole([[0.0, 0.0], [2.0, 0.0]]), dipole([[3.0, 0.0], [4.0, 0.0]]));
    assert_eq!(of(a, ahead).to_string(), "ffbb");
    assert_eq!(of(a, dipole([[2.0, 0.0], [2.0, 2.0]])).to_string(), "ells");
    assert_eq!(of(a, dipole([[1.0, -1.0], [1.0, 1.0]])).to_string(), "rllr");
    assert_eq!(DraC::of(a, ahead, 0.0), None);
    // The start of b may come nearer to the end of a by one step, while its distance from the line is only the square of a step.
    let limits = |from: &str, to: &str| from.parse::<DraF>().unwrap().limits_to(to.parse().unwrap());
    assert!(limits("lllr", "eses") && limits("blrr", "sese") && !limits("llll", "sese"));
    assert_eq!(DraF::of(a, dipole([[2.0, 0.01], [2.0, 2.0]]), 0.1).unwrap().to_string(), "ells");
    assert_eq!(
        format!("{:?}", Dipole::new(point([1.0, 1.0]), point([1.0, 1.0])).unwrap_err()),
        "Extent { what: \"dipole\", found: 0.0 }"
    );
}

/// Dipoles that follow each other in a polygon and all turn left rule out a last one that turns right everywhere.
#[test]
fn a_network_of_dipoles_is_closed() {
    let table = Table::<DraC>::default();
    let mut square = Network::new(3);
    let ells: DraC = "ells".parse().unwrap();
    square.constrain(0, 1, ells).unwrap();
    square.constrain(1, 2, ells).unwrap();
    table.close(&mut square).unwrap();
    let ends = square.relations(0, 2).unwrap();
    assert!(ends.contains("lsel".parse().unwrap()) && !ends.contains("rser".parse().unwrap()), "{ends}");
    square.constrain(0, 2, "rrrr".parse::<DraC>().unwrap()).unwrap();
    assert!(table.close(&mut square).is_err());
}
