//! Tests of the belief, on a few worlds.

use proptest::prelude::*;
use sketchnav_schemas::seed::stream;

use super::policy::Belief;
use super::*;
use crate::generate::uniform;
use crate::geometry::Window;
use crate::navigator::Settings;
use crate::navigator::guide::{Decision, Guide, Next};
use crate::navigator::view::Seen;
use crate::path::{Measure, Objective, best};
use crate::signature::Signature;
use crate::traversal::{Helicopter, Noise, STEP_S};

/// Returns a world with the given position error, and its navigator.
fn world(seed: u64, sigma: f64) -> (Atlas, Pilot) {
    let (window, noise) = (Window::new(100.0, 15.0).unwrap(), Noise::of_sigma(sigma));
    let kinds = Kinds { words: &crate::arrival::WORDS, trajectories: true };
    let atlas = Atlas::new(uniform(100, 1000.0, seed).unwrap(), window, kinds, Reliability::fitted(noise));
    (atlas, Pilot { settings: Settings::new(window, sigma), noise })
}

/// Returns the chart of all dots, its model and the journey from dot 0 to dot 1.
fn charted(atlas: &Atlas, pilot: &Pilot, trials: u32, seed: u64) -> (Charted, Arc<Model>, Journey) {
    let charted = Charted::new(atlas, &[], pilot.noise.map_sigma).unwrap();
    let model = Arc::new(charted.chart.model(pilot, trials, seed).unwrap());
    let journey = charted.journey(Start::over(&atlas.plane, 0).unwrap(), 1).unwrap();
    (charted, model, journey)
}

/// For comparison, with errors of 5 mm, branching maps arrive on about three of four journeys.
#[test]
fn a_belief_arrives_as_often_as_stated_and_knows_when_it_slips() {
    let (mut arrivals, mut recovered) = (0, 0);
    for seed in [700_000, 700_001, 700_004] {
        let (atlas, pilot) = world(seed, 5.0);
        let (charted, model, journey) = charted(&atlas, &pilot, 64, seed);
        let tally = charted.simulate(&atlas, &pilot, (&model, journey), 100, (seed, "test")).unwrap();
        arrivals += tally.arrivals();
        recovered += tally.counts[1];
    }
    assert!(arrivals > 240, "{arrivals} of 300");
    assert!(recovered > 60, "{recovered} of 300");
}

#[test]
fn without_errors_every_journey_arrives_directly() {
    let (atlas, pilot) = world(700_000, 0.0);
    let (charted, model, journey) = charted(&atlas, &pilot, 4, 1);
    // Regression test: the start was unknown, because the probabilities were divided by an error of 0.
    let navigator = super::navigator(&charted.chart, &pilot, &model, journey).unwrap();
    let begins = navigator.guide().begin();
    assert_eq!(navigator.guide().begin_after(Some(&begins)), begins);
    let astray = navigator.guide().begin_after(None);
    assert!(astray.weights().iter().all(|weight| *weight == astray.weights()[0]), "it may be anywhere");
    assert_eq!((begins.most_probable(), begins.weights()[0]), (0, 1.0));
    let tally = charted.simulate(&atlas, &pilot, (&model, journey), 5, (1, "test")).unwrap();
    assert_eq!(tally.counts, [5, 0, 0, 0, 0, 0]);
}

#[test]
fn a_chart_has_a_bound_and_the_landmarks_nearest_to_a_path() {
    let many = (0..=MOST_LANDMARKS).map(|x| Point::new(x as f64, 0.0));
    assert!(matches!(Chart::new(many.clone(), 1.0), Err(Error::Parameter { .. })));
    assert_eq!(Chart::new(many.skip(1), 1.0).unwrap().landmarks().len(), MOST_LANDMARKS);
    assert_eq!(distance_to([Point::new(0.0, 0.0), Point::new(10.0, 0.0)], Point::new(13.0, 4.0)), 5.0);
    assert_eq!(distance_to([Point::new(0.0, 0.0), Point::new(10.0, 0.0)], Point::new(6.0, -4.0)), 4.0);
    let window = Window::new(100.0, 15.0).unwrap();
    let kinds = Kinds { words: &crate::arrival::WORDS, trajectories: true };
    let plane = uniform(900, 3000.0, 3).unwrap();
    let atlas = Atlas::new(plane, window, kinds, Reliability::fitted(Noise::of_sigma(1.0)));
    let start = Start::over(&atlas.plane, 7).unwrap();
    let path = best(&atlas, start, 7, Measure::Windows, Objective::SHORTEST).unwrap();
    let charted = Charted::new(&atlas, &[&path], 1.0).unwrap();
    let off = |dot: DotId| (atlas.plane.dot(dot) - start.centre).norm();
    let furthest = charted.dots.iter().map(|&dot| off(dot)).fold(0.0, f64::max);
    let left_out = (0..900).filter(|dot| !charted.dots.contains(dot));
    assert!(charted.dots.len() == MOST_LANDMARKS && left_out.map(off).all(|off| off >= furthest));
    assert_eq!(charted.journey(start, 7).map(|journey| journey.start), Some(start.centre));
}

/// A goal outside the chart must be an error, because it may arrive in a message.
#[test]
fn a_goal_outside_the_chart_is_rejected() {
    let (atlas, pilot) = world(700_000, 1.0);
    let (charted, model, journey) = charted(&atlas, &pilot, 1, 1);
    let outside = Journey { goal: 100, ..journey };
    assert!(navigator(&charted.chart, &pilot, &model, journey).is_ok());
    assert!(matches!(navigator(&charted.chart, &pilot, &model, outside), Err(Error::Parameter { .. })));
}

/// Killing the process between any two steps must not change anything.
#[test]
fn a_state_survives_a_checkpoint_at_every_step() {
    let (atlas, pilot) = world(700_001, 5.0);
    let (charted, model, journey) = charted(&atlas, &pilot, 16, 1);
    let navigator = super::navigator(&charted.chart, &pilot, &model, journey).unwrap();
    let mut helicopter = Helicopter::new(journey.start, 0.0);
    let (mut state, mut rng, mut view) = (navigator.start(), stream(3, "journey"), Seen::default());
    while state.outcome().is_none() {
        helicopter.look(&atlas.plane, pilot.settings.window, pilot.noise, &mut rng, &mut view);
        let bytes = postcard::to_allocvec(&state).unwrap();
        assert!(bytes.len() < 2000, "{}", bytes.len());
        let mut restored = postcard::from_bytes(&bytes).unwrap();
        let output = navigator.step(&mut state, view.view(), STEP_S);
        assert_eq!(navigator.step(&mut restored, view.view(), STEP_S), output);
        assert_eq!(restored, state);
        helicopter.fly(output.velocity, STEP_S, Noise::NONE, &mut rng);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// For any sequence of observations, a belief is a distribution, and the decision is a movement of the model or an end.
    #[test]
    fn a_belief_stays_a_distribution(views in prop::collection::vec(prop::option::of(any::<u8>()), 1..80)) {
        let (atlas, pilot) = world(700_002, 5.0);
        let (charted, model, journey) = charted(&atlas, &pilot, 2, 1);
        let navigator = super::navigator(&charted.chart, &pilot, &model, journey).unwrap();
        let policy = navigator.guide();
        let mut belief: Belief = policy.begin();
        for view in views {
            let decision = match view {
                Some(code) => policy.attained(&mut belief, Signature::of_code(code), navigator.settings()),
                None => policy.nothing(&mut belief, navigator.settings()),
            };
            let sum: f32 = belief.weights().iter().sum();
            prop_assert!((sum - 1.0).abs() < 1e-3 && belief.weights().iter().all(|weight| *weight >= 0.0), "{}", sum);
            let Decision::Adjust { next: Next::Entry(action), .. } = decision else { return Ok(()) };
            prop_assert!(usize::from(action) < model.actions.len());
            prop_assert!(policy.enter(&mut belief, action));
        }
        prop_assert!(policy.counts(&belief).entry <= 60, "it goes on without end");
    }
}
