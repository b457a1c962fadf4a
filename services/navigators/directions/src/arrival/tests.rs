//! Tests that journeys end as simulated.

use super::*;
use crate::generate::uniform;
use crate::geometry::{Corner, Land, Window};
use crate::reliability::Reliability;
use crate::testing::{camera, plane, plane_of_kinds};
use crate::transitions::{Kinds, Movement};

const QUICK: Effort = Effort { trials: 32, trial_journeys: 12, journeys: 64 };

fn pilot(sigma: f64) -> Pilot {
    let window = Window::new(100.0, 15.0).unwrap();
    Pilot { settings: Settings::new(window, sigma), noise: Noise::of_sigma(sigma) }
}

fn atlas(plane: Plane, pilot: &Pilot) -> Atlas {
    let kinds = Kinds { words: &WORDS, trajectories: true };
    Atlas::new(plane, pilot.settings.window, kinds, Reliability::fitted(pilot.noise))
}

#[test]
fn a_tally_counts_what_arrived() {
    let mut tally = Tally::default();
    (0..90).for_each(|_| tally.add(Kind::Direct));
    (0..10).for_each(|_| tally.add(Kind::Astray));
    assert_eq!((tally.journeys(), tally.arrivals()), (100, 90));
    assert_eq!((tally.probability(), Tally::default().probability()), (91.0 / 102.0, 0.5));
}

#[test]
fn a_sure_transition_is_sure_and_a_doubtful_one_is_not() {
    let pilot = pilot(5.0);
    // From the first dot, there is one candidate in the middle of the south-west quadrant. In the north-west quadrant, there
    // are two equally isolated ones at nearly the same distance.
    let world = plane(&[(0.0, 0.0), (50.0, 50.0), (50.0, -60.0), (61.0, -50.0), (900.0, 900.0)]);
    let atlas = atlas(world, &pilot);
    let estimates = estimates(&atlas, &pilot, 400, 1, |_| true).unwrap();
    let of = |to: DotId| {
        let numbers = atlas.transitions.numbers(0);
        let mut seeks = numbers.filter(|&n| {
            let transition = atlas.transitions.number(n);
            transition.to == to && transition.movement == Movement::Seek
        });
        estimates[seeks.next().unwrap() as usize].plain
    };
    assert!(of(1) > 0.99, "{}", of(1));
    assert!((0.4..0.75).contains(&of(3)), "{}", of(3));
}

/// Two doors are in sight, and the farther one is meant. If its marker is missed, the nearer one is the only door in view.
#[test]
fn a_marker_that_is_missed_makes_its_landmark_one_of_no_kind() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let window = Window::on_land(land).unwrap();
    let pilot = Pilot { settings: Settings::new(window, 0.0), noise: Noise::NONE };
    let dots = [(0.0, 0.0, ""), (1.5, 2.5, "door"), (4.0, 3.0, "door"), (5.0, 0.8, "")];
    let of = |miss: f64| {
        let kinds = Kinds { words: &[Descriptor::Isolated], trajectories: false };
        let model = Reliability::fitted(pilot.noise);
        let atlas = Atlas::new(plane_of_kinds(camera(miss), &dots), window, kinds, model);
        let estimates = estimates(&atlas, &pilot, 1000, 1, |_| true).unwrap();
        let mut seeks = atlas.transitions.numbers(0).filter(|&number| {
            let seek = atlas.transitions.number(number);
            seek.by_kind && seek.to == 2 && seek.corner == Corner::Sw
        });
        estimates[seeks.next().unwrap() as usize].plain
    };
    assert!(of(0.0) > 0.99, "{}", of(0.0));
    // A single picture misses a marker at 4.1 m with a probability of 0.67, so three pictures miss both markers that face the robot
    // with a probability of 0.09.
    assert!((of(0.4) - 0.91).abs() < 0.03, "{}", of(0.4));
}

#[test]
fn without_errors_arrival_is_certain() {
    let pilot = pilot(0.0);
    let atlas = atlas(uniform(100, 1000.0, 4).unwrap(), &pilot);
    let start = Start::over(&atlas.plane, 1).unwrap();
    let goal =
        (0..100).rev().find(|&goal| best(&atlas, start, goal, Measure::Windows, Objective::SHORTEST).is_ok());
    let plan = most_probable(&atlas, start, goal.unwrap(), &pilot, QUICK, 1).unwrap();
    assert!(plan.probability.unwrap() > 0.98);
    assert!(plan.itinerary().to_string().contains("probability of arrival"));
}

/// On worlds that the map-maker sees with errors, a plan chosen by simulation should arrive more often than the paper's D/R
/// plan, and about as often as it states.
#[test]
fn the_stated_probability_is_kept_and_is_better_than_the_ratio_of_the_paper() {
    let pilot = pilot(3.0);
    let (mut stated, mut journeys) = (0.0, 0.0);
    let (mut ours, mut theirs) = (Tally::default(), Tally::default());
    for seed in 0..48 {
        let truth = uniform(100, 1000.0, seed).unwrap();
        let seen = disturbed(truth.dots(), pilot.noise.map_sigma, &mut stream(seed, "map")).unwrap();
        let atlas = atlas(seen, &pilot);
        let start = Start::over(&atlas.plane, 0).unwrap();
        let Ok(plan) = most_probable(&atlas, start, 50, &pilot, QUICK, seed) else { continue };
        let path = best(&atlas, start, 50, Measure::Windows, Objective::Ratio).unwrap();
        let ratio = Plan::new(&atlas, path, Verify::Recoverable).unwrap();
        let run = |plan: &Plan, tally: &mut Tally| {
            let navigator = Navigator::new(pilot.settings, plan.map.clone()).unwrap();
            for trial in 0..4 {
                let landmarks = plan.landmarks();
                let journey = Traversal::new(&truth, &navigator, &landmarks, pilot.noise).unwrap();
                tally.add(
                    journey
                        .run(start.centre, &mut stream(seed, &format!("journey/{trial}")), |_, _, _| {})
                        .kind,
                );
            }
        };
        run(&plan, &mut ours);
        run(&ratio, &mut theirs);
        stated += plan.probability.unwrap() * 4.0;
        journeys += 4.0;
    }
    assert!(journeys >= 100.0);
    let observed = f64::from(ours.arrivals()) / journeys;
    assert!((stated / journeys - observed).abs() < 0.1, "{} {observed}", stated / journeys);
    assert!(ours.probability() > theirs.probability() + 0.1, "{ours:?} {theirs:?}");
}

/// Regression test: with 3,000 dots, planning took 15 s because every transition of the plane was simulated.
#[test]
fn on_a_large_plane_only_what_lies_near_good_paths_is_simulated() {
    let pilot = pilot(1.0);
    let side = 100.0 * 1_600_f64.sqrt();
    let atlas = atlas(uniform(1_600, side, 3).unwrap(), &pilot);
    let at = |x, y| Start::wanted(&atlas.plane, atlas.window, Point::new(x, y)).unwrap().landmark;
    let (start, goal) = (Start::over(&atlas.plane, at(500.0, 500.0)).unwrap(), at(1_500.0, 1_000.0));
    let tried = tried(&atlas, start, goal, &pilot, 1).unwrap();
    assert!(tried.len() < atlas.plane.len() / 2, "{} of {}", tried.len(), atlas.plane.len());
    let plan = most_probable(&atlas, start, goal, &pilot, QUICK, 1).unwrap();
    assert!(plan.landmarks().iter().all(|dot| tried.contains(dot)));
    let surroundings = surroundings(&atlas, start.centre, &plan.landmarks());
    assert!(surroundings.dots.len() < atlas.plane.len() / 2);
    for (&near, &landmark) in surroundings.intended.iter().zip(&plan.landmarks()) {
        assert_eq!(surroundings.dots[near as usize], atlas.plane.dot(landmark));
    }
}

#[test]
fn the_dots_along_a_line_are_those_within_reach_of_it() {
    let atlas = atlas(uniform(500, 2_000.0, 5).unwrap(), &pilot(1.0));
    let ends = [Point::new(200.0, 300.0), Point::new(1_700.0, 900.0)];
    let dots = along(&atlas, ends.into_iter(), 1.5);
    for dot in 0..500 {
        let at = atlas.plane.dot(dot);
        let share =
            ((at - ends[0]).dot(ends[1] - ends[0]) / (ends[1] - ends[0]).norm_squared()).clamp(0.0, 1.0);
        let aside = (at - (ends[0] + (ends[1] - ends[0]) * share)).norm();
        // The line is covered by squares, at most one window side apart.
        assert!(aside > 140.0 || dots.binary_search(&dot).is_ok(), "{aside}");
        assert!(aside < 220.0 || dots.binary_search(&dot).is_err(), "{aside}");
    }
}
