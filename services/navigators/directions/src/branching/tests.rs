//! Tests of branching maps, on a few worlds.

use super::*;
use crate::arrival::simulate;
use crate::custom_map::CustomMap;
use crate::generate::uniform;
use crate::geometry::Window;
use crate::navigator::Settings;
use crate::reliability::Reliability;
use crate::transitions::Kinds;
use crate::traversal::Noise;

const EFFORT: Effort = Effort { trials: 64, trial_journeys: 32, journeys: 64 };

/// Returns a world with position errors of 5 mm, the start of a journey, and its navigator.
fn world(seed: u64) -> (Atlas, Start, Pilot) {
    let (window, noise) = (Window::new(100.0, 15.0).unwrap(), Noise::of_sigma(5.0));
    let kinds = Kinds { words: &crate::arrival::WORDS, trajectories: true };
    let atlas = Atlas::new(uniform(100, 1000.0, seed).unwrap(), window, kinds, Reliability::fitted(noise));
    let start = Start::over(&atlas.plane, 0).unwrap();
    (atlas, start, Pilot { settings: Settings::new(window, noise.sigma), noise })
}

#[test]
fn maps_that_branch_arrive_more_often_than_straight_ones_and_are_at_most_three_times_as_long() {
    let mut arrivals = [0; 2];
    for seed in [700_000, 700_001, 700_004] {
        let (atlas, start, pilot) = world(seed);
        let straight = most_probable(&atlas, start, 1, &pilot, EFFORT, seed).unwrap();
        let plan = most_probable_branching(&atlas, start, 1, &pilot, EFFORT, seed).unwrap();
        assert!(plan.map.branches(), "{seed}: {}", plan.map);
        assert!(plan.map.entries().len() <= LONGEST * straight.map.entries().len());
        assert_eq!((plan.landmarks.len(), plan.landmarks.last()), (plan.map.entries().len(), Some(&1)));
        assert_eq!(plan.map.to_string().parse::<CustomMap>().unwrap(), plan.map);
        for (sum, plan) in arrivals.iter_mut().zip([&straight, &plan]) {
            *sum += simulate(&atlas, plan, &pilot, 200, (seed, "test")).unwrap().arrivals();
        }
    }
    assert!(arrivals[1] > arrivals[0] + 100, "{arrivals:?} of 600");
}

#[test]
fn a_seed_gives_the_same_map_and_its_graph_names_each_entry() {
    let (atlas, start, pilot) = world(700_006);
    let plan = || most_probable_branching(&atlas, start, 1, &pilot, EFFORT, 3).unwrap();
    assert_eq!(plan(), plan());
    let text = plan().itinerary().to_string();
    assert_eq!(text.lines().count(), plan().map.entries().len() + 2, "{text}");
    assert!(text.contains("1, the goal") && text.contains("probability of arrival"), "{text}");
}
