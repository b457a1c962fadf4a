//! Properties of OPRA: its composition matches that of actual triangles.

use std::f64::consts::PI;

use proptest::prelude::*;
use sketchnav_qualitative::algebra::{Compose, Converse, Relation, RelationSet};
use sketchnav_qualitative::opra::{Opra, Segments};
use sketchnav_qualitative::{Oriented, Point};

use crate::point;
use crate::scenes::oriented;

const TOLERANCE_RAD: f64 = 1e-9;

/// Returns three points for each arrangement: triangles in both orientations with angles in steps of π/steps, points on a line, and
/// points at the same position.
fn triples(steps: u32) -> Vec<[Point; 3]> {
    let (a, b) = ([0.0, 0.0], [1.0, 0.0]);
    let angles = (1..steps).flat_map(|at_a| (1..steps - at_a).map(move |at_b| [at_a, at_b]));
    let thirds = angles.flat_map(|angles| {
        let [at_a, at_b] = angles.map(|angle| f64::from(angle) * PI / f64::from(steps));
        let length = at_b.sin() / (at_a + at_b).sin();
        [1.0, -1.0].map(|side| [length * at_a.cos(), side * length * at_a.sin()])
    });
    let on_line = [[-1.0, 0.0], [0.5, 0.0], [2.0, 0.0], a, b];
    let apart = thirds.chain(on_line).map(|c| [a, b, c]);
    apart.chain([[a, a, b], [a, a, a]]).map(|points| points.map(point)).collect()
}

fn composition_is_what_triangles_show<const M: usize>() {
    let steps = 8 * M as u32;
    let headings: Vec<_> = (0..2 * steps).map(|i| f64::from(i) * PI / f64::from(steps)).collect();
    let mut shown = vec![vec![RelationSet::<Opra<M>>::EMPTY; Opra::<M>::COUNT]; Opra::<M>::COUNT];
    for [a, b, c] in triples(steps) {
        let related = |one: Point, other: Point| -> Vec<Vec<Opra<M>>> {
            let of = |at, heading: &f64| Oriented::new(at, *heading).unwrap();
            let row =
                |i| headings.iter().map(|j| Opra::of(of(one, i), of(other, j), TOLERANCE_RAD)).collect();
            headings.iter().map(row).collect()
        };
        let [ab, bc, ac] = [related(a, b), related(b, c), related(a, c)];
        for (ab, ac) in ab.iter().zip(&ac) {
            for (ab, bc) in ab.iter().zip(&bc) {
                for (bc, ac) in bc.iter().zip(ac) {
                    shown[ab.index()][bc.index()].insert(*ac);
                }
            }
        }
    }
    for a in Opra::<M>::all() {
        for b in Opra::<M>::all() {
            assert_eq!(a.compose(b), shown[a.index()][b.index()], "{a}, {b}");
        }
    }
}

#[test]
fn the_compositions_of_opra_are_what_triangles_show() {
    composition_is_what_triangles_show::<1>();
    composition_is_what_triangles_show::<2>();
}

fn keeps_its_properties<const M: usize>([a, b, c]: [Oriented; 3]) -> Result<(), TestCaseError> {
    let of = |a, b| Opra::<M>::of(a, b, TOLERANCE_RAD);
    prop_assert_eq!(of(a, b).converse(), of(b, a));
    prop_assert!(of(a, b).compose(of(b, c)).contains(of(a, c)), "{}, {}, {}", of(a, b), of(b, c), of(a, c));
    let mirror = |at: Oriented| {
        let [x, y]: [f64; 2] = at.position().into();
        Oriented::new(point([-x, y]), PI - at.heading_rad()).unwrap()
    };
    prop_assert_eq!(of(a, b).mirrored(), of(mirror(a), mirror(b)));
    let word = serde_json::to_string(&of(a, b)).unwrap();
    prop_assert_eq!(serde_json::from_str::<Opra<M>>(&word).unwrap(), of(a, b));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn oriented_points_agree_with_converse_composition_and_mirror(points in [oriented(), oriented(), oriented()]) {
        keeps_its_properties::<1>(points)?;
        keeps_its_properties::<2>(points)?;
        keeps_its_properties::<3>(points)?;
        keeps_its_properties::<4>(points)?;
    }
}

#[test]
fn segments_are_counted_to_the_left_from_the_heading() {
    let at = |x, y, heading| Oriented::new(point([x, y]), heading).unwrap();
    let (a, b) = (at(0.0, 0.0, PI / 2.0), at(3.0, 0.0, 0.0));
    // b is on the right of a, and a behind b. With m = 1, the right is a sector only from ahead to behind.
    assert_eq!(Opra::<1>::of(a, b, TOLERANCE_RAD).to_string(), "3_2");
    assert_eq!(Opra::<2>::of(a, b, TOLERANCE_RAD).to_string(), "6_4");
    assert_eq!(Opra::<2>::of(a, at(0.0, 0.0, PI), TOLERANCE_RAD).to_string(), "s_2");
    assert_eq!("S_2".parse::<Opra<2>>().unwrap().segments(), Segments::Same { heading: 2 });
    for word in ["8_0", "0_8", "s_8", "0", "_", "-1_0"] {
        let error = word.parse::<Opra<2>>().unwrap_err().to_string();
        assert!(error.contains("opra-2") && error.contains("7_7"), "{word}: {error}");
    }
}
