//! Tests of branching maps, on a few worlds.

use std::sync::Arc;

use sketchnav_schemas::seed::stream;

use super::*;
use crate::arrival::{WORDS_ON_LAND, simulate};
use crate::custom_map::CustomMap;
use crate::generate::uniform;
use crate::geometry::{Corner, Land, Point, Window};
use crate::navigator::{Navigator, Settings};
use crate::reliability::Reliability;
use crate::testing::plane;
use crate::transitions::Kinds;
use crate::traversal::{Kind, Noise, Traversal};
use crate::walls::{Body, Walls};

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

/// Two ways lead to the goal. Somebody, here a short wall that the map-maker does not know, hides the first landmark of the better
/// one. The straight map ends there, while the branching map leads to the goal by the other way.
#[test]
fn on_land_a_map_says_how_to_continue_without_a_landmark_that_is_out_of_sight() {
    let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
    let window = Window::on_land(land).unwrap();
    let noise = Noise { heading_rad: 0.02, sigma: 0.02, ..Noise::NONE };
    let world = plane(&[(0.0, 0.0), (5.0, 0.6), (4.5, 5.5), (10.5, 2.0)]);
    let kinds = Kinds { words: &WORDS_ON_LAND, trajectories: false };
    let atlas = Atlas::new(world.clone(), window, kinds, Reliability::fitted(noise));
    let settings =
        Settings { speed: 0.5, heading_rad: noise.heading_rad, ..Settings::new(window, noise.sigma) };
    let (pilot, start) =
        (Pilot { settings, noise }, Start::at(&world, window, window.centre_from(Corner::Sw)).unwrap());
    let straight = most_probable(&atlas, start, 3, &pilot, EFFORT, 1).unwrap();
    let branching = most_probable_branching(&atlas, start, 3, &pilot, EFFORT, 1).unwrap();
    assert!(!straight.map.branches() && branching.map.branches(), "{}", branching.map);
    for text in [branching.map.to_string(), branching.map.sentences()] {
        assert_eq!(text.parse::<CustomMap>().unwrap(), branching.map, "{text}");
    }
    assert!(branching.probability >= straight.probability, "{branching:?}");

    let first = world.dot(straight.landmarks[1]);
    let aside = Point::new(-first.y, first.x) * (1.3 / first.norm());
    let ends = [first * 0.55 + aside, first * 0.55 - aside];
    let walls = Walls::new([ends], 0.1, Body { radius: 0.225, keeps: 0.375, merges: 0.4 });
    let hidden = world.among(Arc::new(walls));
    let ended = |plan: &Plan| {
        let navigator = Navigator::new(settings, plan.map.clone()).unwrap();
        let journey = Traversal::new(&hidden, &navigator, &plan.landmarks, noise).unwrap();
        journey.run(start.centre, &mut stream(1, "journey"), |_, _, _| {}).kind
    };
    assert_eq!(
        (ended(&straight), ended(&branching)),
        (Kind::CannotLocate, Kind::Recovered),
        "{}",
        branching.map
    );
}
