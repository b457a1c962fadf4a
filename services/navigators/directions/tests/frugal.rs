//! Tests that no step of the navigator allocates, whatever the navigator is doing.

use std::sync::Arc;

use sketchnav_directions::arrival::Pilot;
use sketchnav_directions::belief::{Chart, Journey, navigator};
use sketchnav_directions::generate::uniform;
use sketchnav_directions::geometry::Window;
use sketchnav_directions::navigator::view::Seen;
use sketchnav_directions::navigator::{Activity, Navigator, Settings};
use sketchnav_directions::path::{Atlas, Measure, Objective, Start, best};
use sketchnav_directions::plan::{Plan, Verify};
use sketchnav_directions::reliability::Reliability;
use sketchnav_directions::transitions::Kinds;
use sketchnav_directions::traversal::{Helicopter, Noise, STEP_S};
use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};
use sketchnav_schemas::seed::stream;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn a_step_allocates_nothing() {
    let window = Window::new(100.0, 15.0).unwrap();
    let noise = Noise { misses: 0.05, false_dots: 0.2, ..Noise::of_sigma(2.0) };
    let (mut steps, mut activities) = (0, Vec::new());
    for seed in 0..40 {
        let plane = uniform(120, 1000.0, seed).unwrap();
        let atlas = Atlas::new(plane, window, Kinds::PAPER, Reliability::fitted(noise));
        let start = Start::over(&atlas.plane, 0).unwrap();
        let Ok(path) = best(&atlas, start, 60, Measure::Windows, Objective::Ratio) else { continue };
        let plan = Plan::new(&atlas, path, Verify::Detectable).unwrap();
        let settings = Settings { looks: 3, ..Settings::new(window, noise.sigma) };
        let navigator = Navigator::new(settings, plan.map).unwrap();
        let (mut state, mut rng, mut view) = (navigator.start(), stream(seed, "journey"), Seen::default());
        let mut helicopter = Helicopter::new(start.centre, 0.0);
        while state.outcome().is_none() {
            helicopter.look(&atlas.plane, window, noise, &mut rng, &mut view);
            let before = allocations_of_this_thread();
            let output = navigator.step(&mut state, view.view(), STEP_S);
            assert_eq!(allocations_of_this_thread() - before, 0, "{:?}", output.activity);
            if !activities.contains(&output.activity) {
                activities.push(output.activity);
            }
            steps += 1;
            helicopter.fly(output.velocity, STEP_S, noise, &mut rng);
        }
    }
    assert!(steps > 1000, "{steps}");
    for activity in [Activity::Seek, Activity::Slide, Activity::Verify, Activity::Adjust, Activity::Recover] {
        assert!(activities.contains(&activity), "{activity:?} was never seen");
    }
}

#[test]
fn a_step_with_a_belief_allocates_nothing() {
    let window = Window::new(100.0, 15.0).unwrap();
    let noise = Noise { misses: 0.05, ..Noise::of_sigma(5.0) };
    let pilot = Pilot { settings: Settings::new(window, noise.sigma), noise };
    let mut movements = 0;
    for seed in 0..4 {
        let plane = uniform(120, 1000.0, seed).unwrap();
        let chart = Chart::new(plane.dots().iter().copied(), noise.map_sigma).unwrap();
        let model = Arc::new(chart.model(&pilot, 8, seed).unwrap());
        let journey = Journey { start: plane.dot(0), goal: 60 };
        let navigator = navigator(&chart, &pilot, &model, journey).unwrap();
        let (mut state, mut rng, mut view) = (navigator.start(), stream(seed, "journey"), Seen::default());
        let mut helicopter = Helicopter::new(journey.start, 0.0);
        while state.outcome().is_none() {
            helicopter.look(&plane, window, noise, &mut rng, &mut view);
            let before = allocations_of_this_thread();
            let output = navigator.step(&mut state, view.view(), STEP_S);
            assert_eq!(allocations_of_this_thread() - before, 0, "{:?}", output.activity);
            helicopter.fly(output.velocity, STEP_S, noise, &mut rng);
        }
        movements += navigator.output(&state).entry;
    }
    assert!(movements > 10, "{movements}");
}
