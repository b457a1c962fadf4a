//! Tests of figure 23, and of recoveries in simulation.

use super::*;
use crate::custom_map::tests::counting;
use crate::custom_map::{CustomMap, Entry, Response};
use crate::generate::uniform;
use crate::geometry::Point;
use crate::navigator::{Navigator, Settings};
use crate::testing::plane;
use crate::transitions::{Kinds, Transitions};
use crate::traversal::{Kind, Noise, Traversal};
use sketchnav_schemas::seed::stream;

const R: DotId = 0;
const A: DotId = 1;
const B: DotId = 2;
const C: DotId = 3;
const D: DotId = 4;
const I: DotId = 5;
const E: usize = 6;
const F: usize = 7;

/// The dots R, A, B, C, D and I of figure 23, followed by E and F, which lie outside the window.
const FIGURE_23: [(f64, f64); 8] =
    [(0.0, 0.0), (1.0, 2.0), (3.0, 6.0), (8.0, 4.0), (9.0, 2.0), (7.0, 9.0), (-6.0, 7.0), (14.0, -3.0)];

fn window() -> Window {
    Window::new(10.0, 1.5).unwrap()
}

fn counts(dots: &[(f64, f64)]) -> Vec<u8> {
    Signature::of_all(&plane(dots), window()).into_iter().map(Signature::count).collect()
}

fn to_i(world: &Plane) -> Transition {
    let all = Transitions::new(world, window(), Kinds::ISOLATED);
    *all.from(R).iter().find(|entry| entry.corner == Corner::Sw).unwrap()
}

fn without(left_out: usize) -> Vec<(f64, f64)> {
    FIGURE_23.iter().enumerate().filter(|(index, _)| *index != left_out).map(|(_, dot)| *dot).collect()
}

#[test]
fn figure_23_has_the_counts_of_table_3() {
    assert_eq!(counts(&FIGURE_23)[..6], [2, 4, 4, 3, 3, 2], "R, A, B, C, D, I");
    // E adds to the counts of A and B (and R), and F to that of D.
    assert_eq!(counts(&without(E))[..6], [1, 3, 3, 3, 3, 2]);
    assert_eq!(counts(&without(F))[..6], [2, 4, 4, 3, 2, 2]);
}

#[test]
fn figure_23_is_recoverable_as_the_paper_says() {
    let world = plane(&FIGURE_23);
    let signatures = Signature::of_all(&world, window());
    let recoveries = Recoveries::new(&world, window(), &signatures, Descriptor::Isolated).unwrap();
    let transition = to_i(&world);
    assert_eq!((transition.to, transition.candidates), (I, 5));
    assert_eq!(recoveries.mistaken(R, &transition, 0.0), [A, B, C, D]);
    let Check::Recoverable(verification) = recoveries.check(R, &transition, 0.0) else { panic!() };
    let back = |corner| Response::Recover(Recovery { corner, word: Descriptor::Isolated });
    // Table 3: recover from 4 by the south-west and from 3 by the south-east, and accept 2.
    assert_eq!(verification.response(counting(4)), back(Corner::Sw));
    assert_eq!(verification.response(counting(3)), back(Corner::Se));
    assert_eq!(verification.response(counting(2)), Response::Correct);
    // From C the recovery leads to B, and from B to I, so the target is reached transitively (condition 3).
    let next = |dot, corner| recoveries.next(dot, Recovery { corner, word: Descriptor::Isolated });
    assert_eq!((next(C, Corner::Se), next(B, Corner::Sw)), (Some(B), Some(I)));
}

#[test]
fn a_count_that_is_not_unique_is_not_verifiable() {
    // Without F, D has the same count as I.
    let world = plane(&without(F));
    let signatures = Signature::of_all(&world, window());
    let recoveries = Recoveries::new(&world, window(), &signatures, Descriptor::Isolated).unwrap();
    assert_eq!(recoveries.check(R, &to_i(&world), 0.0), Check::Unverifiable);
}

#[test]
fn one_candidate_is_trivial() {
    let world = plane(&[(0.0, 0.0), (5.0, 5.0)]);
    let signatures = Signature::of_all(&world, window());
    let recoveries = Recoveries::new(&world, window(), &signatures, Descriptor::Isolated).unwrap();
    let check = recoveries.check(0, &to_i(&world), 0.0);
    assert_eq!((check, check.verification()), (Check::Trivial, None));
    assert!(Recoveries::new(&world, window(), &[], Descriptor::Isolated).is_err());
}

/// Runs the navigator from a dot that it has mistaken for the target, with this verification.
fn recovers(world: &Plane, verification: Verification, from: DotId, target: DotId) -> Kind {
    let entry = Entry {
        kind: None,
        word: Descriptor::Any,
        bearing_deg: None,
        trajectory: None,
        verification: Some(verification),
        place: None,
    };
    let map = CustomMap::new(vec![entry]).unwrap();
    let settings = Settings { most_recoveries: 40, ..Settings::new(window(), 0.0) };
    let navigator = Navigator::new(settings, map).unwrap();
    let journey = Traversal::new(world, &navigator, std::slice::from_ref(&target), Noise::NONE).unwrap();
    journey.run(world.dot(from), &mut stream(1, "journey"), |_, _, _| {}).kind
}

#[test]
fn figure_23_recovers_in_simulation() {
    let world = plane(&FIGURE_23);
    let signatures = Signature::of_all(&world, window());
    let recoveries = Recoveries::new(&world, window(), &signatures, Descriptor::Isolated).unwrap();
    let verification = recoveries.check(R, &to_i(&world), 0.0).verification().unwrap();
    for mistaken in [A, B, C, D] {
        assert_eq!(recovers(&world, verification, mistaken, I), Kind::Recovered, "{mistaken}");
    }
    assert_eq!(recovers(&world, verification, I, I), Kind::Direct);
}

/// On random planes, every recoverable transition, in parkways and on trajectories, must recover from every dot that can be
/// mistaken for its target. A detectable transition must never end anywhere else unnoticed.
#[test]
fn whatever_is_recoverable_recovers() {
    let (mut recoverable, mut detectable) = (0, 0);
    for seed in 0..12 {
        let world = uniform(150, 100.0, seed).unwrap();
        let signatures = Signature::of_all(&world, window());
        let recoveries = Recoveries::new(&world, window(), &signatures, Descriptor::Isolated).unwrap();
        let all = Transitions::new(&world, window(), Kinds::PAPER);
        for (from, transition) in all.all() {
            let check = recoveries.check(from, transition, 1.0);
            let Some(verification) = check.verification() else { continue };
            for mistaken in recoveries.mistaken(from, transition, 1.0) {
                let kind = recovers(&world, verification, mistaken, transition.to);
                if check.is_recoverable() {
                    assert_eq!(kind, Kind::Recovered, "seed {seed}: {from} to {transition:?} by {mistaken}");
                    recoverable += 1;
                } else {
                    assert!(matches!(kind, Kind::Recovered | Kind::Lost), "{kind:?}");
                    detectable += 1;
                }
            }
        }
    }
    assert!(recoverable > 200 && detectable > 20, "{recoverable} {detectable}");
}

#[test]
fn a_dot_far_away_is_not_mistaken_on_a_sure_slide() {
    let world = plane(&[(0.0, 0.0), (6.0, 0.0), (40.0, 0.0), (37.0, 5.5)]);
    let signatures = Signature::of_all(&world, window());
    let recoveries = Recoveries::new(&world, window(), &signatures, Descriptor::Isolated).unwrap();
    let all = Transitions::new(&world, window(), Kinds::PAPER);
    let slide = all.from(0).iter().find(|entry| entry.to == 2).unwrap();
    assert_eq!(recoveries.check(0, slide, 0.01), Check::Trivial);
    assert_eq!(recoveries.mistaken(0, slide, 1.0), [3]);
    assert_eq!(world.dot(3) - world.dot(2), Point::new(-3.0, 5.5));
}
