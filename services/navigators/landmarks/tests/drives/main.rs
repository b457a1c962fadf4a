//! Drives: sketches of two scenes, and a simulated robot that follows them (Chronis 2007, chapter 5).

mod scenes;
mod world;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scenes::{Scene, scene_a, scene_b};
use sketchnav_landmarks::extraction::{Parameters, extract};
use sketchnav_landmarks::follower::{Event, Follower, Following, Sensed};
use sketchnav_landmarks::language;
use sketchnav_landmarks::perception::{Perceiving, Perception};
use sketchnav_landmarks::route::Route;
use sketchnav_landmarks::sketch::{Drawing, Reading, Sketch};
use world::World;

/// How a drive ended.
#[derive(Debug, Clone, PartialEq)]
struct Ended {
    event: Option<Event>,
    /// The object before which the robot stopped.
    at: &'static str,
    /// How many states were matched.
    matched: usize,
    is_at_goal: bool,
}

fn follow(scene: &Scene, route: Route, seed: Option<u64>, trace: bool) -> Ended {
    let perception = Perception::nomad(Perceiving::default()).unwrap();
    let settings = Following::default();
    let mut follower = Follower::new(route, perception, settings).unwrap();
    let noise = seed.map(Pcg64Mcg::seed_from_u64);
    let mut world = World { objects: &scene.objects, pose: scene.start, noise };
    let mut last = ([0.0, 0.0], None);
    let mut matched = 0;
    for cycle in 0..2000 {
        let ranges_m = world.ranges();
        let [moved_m, turned_rad] = last.0;
        let sensed = Sensed { ranges_m: &ranges_m, time_s: settings.rhythm.cycle_s, moved_m, turned_rad };
        let (drive, event) = follower.step(&sensed).unwrap();
        if trace && (event.is_some() || cycle % 5 == 0) {
            let [x, y] = world.pose.at.map(|x| x / scenes::PIXEL_M);
            println!("{cycle} ({x:.0}, {y:.0}) {:.0}° {event:?}", world.pose.heading_rad.to_degrees());
        }
        matched += usize::from(matches!(event, Some(Event::Matched(_))));
        last.1 = event.or(last.1);
        if matches!(event, Some(Event::Arrived | Event::Lost(_))) {
            break;
        }
        last.0 = world.drive(drive, settings.rhythm.cycle_s);
    }
    let (at, _) = world.nearest();
    let event = last.1;
    Ended { event, at, matched, is_at_goal: event == Some(Event::Arrived) && at == scene.goal }
}

fn read(text: &str) -> Sketch {
    let drawing: Drawing = serde_json::from_str(text).unwrap();
    Sketch::read(&drawing, &Reading::default()).unwrap()
}

fn parameters(additional_states: bool) -> Parameters {
    Parameters { additional_states, ..Parameters::default() }
}

/// Successes of five runs for each sketch.
fn runs(scene: &Scene, additional_states: bool) -> Vec<usize> {
    let of_sketch = |text: &&str| {
        let Ok(route) = extract(&read(text), &parameters(additional_states)) else { return 0 };
        (0..5).filter(|seed| follow(scene, route.clone(), Some(*seed), false).is_at_goal).count()
    };
    scene.sketches.iter().map(of_sketch).collect()
}

#[test]
fn show() {
    for (name, scene) in [("A", scene_a()), ("B", scene_b())] {
        let route = extract(&scene.as_sketch(), &parameters(true)).unwrap();
        println!("{name}\n{}", language::table(&route));
        println!("{:?}", follow(&scene, route, None, true));
        for additional in [false, true] {
            let found = runs(&scene, additional);
            println!(
                "{name} additional {additional}: {found:?} {}/{}",
                found.iter().sum::<usize>(),
                found.len() * 5
            );
        }
        for text in &scene.sketches {
            let route = extract(&read(text), &parameters(true)).unwrap();
            let kinds: Vec<_> = route.states.iter().map(|state| (state.kind, state.command)).collect();
            let _ = kinds;
            println!("{:?}", follow(&scene, route.clone(), Some(1), false));
        }
    }
}
