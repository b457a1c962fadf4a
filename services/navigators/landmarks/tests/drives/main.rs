//! Drives: sketches of two scenes, and a simulated robot that follows them (Chronis 2007, chapter 5).

mod scenes;
mod world;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scenes::{Scene, scene_a, scene_b};
use sketchnav_landmarks::extraction::{Parameters, extract};
use sketchnav_landmarks::follower::{Event, Follower, Following, Sensed};
use sketchnav_landmarks::guide::{Guide, Guiding, Outcome};
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
        if trace && event.is_some() {
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

/// By our own way: the outcome, the object before which the robot stopped, and whether that is the goal.
fn guided(scene: &Scene, sketch: &Sketch, seed: u64, trace: bool) -> (Option<Outcome>, &'static str, bool) {
    guided_with(scene, sketch, seed, trace, Guiding::default())
}

fn guided_with(
    scene: &Scene,
    sketch: &Sketch,
    seed: u64,
    trace: bool,
    settings: Guiding,
) -> (Option<Outcome>, &'static str, bool) {
    let angles: Vec<_> = (0..16).map(|i| f64::from(i) * std::f64::consts::FRAC_PI_8).collect();
    let mut guide = Guide::new(sketch, &angles, settings, seed).unwrap();
    let mut world = World {
        objects: &scene.objects,
        pose: scene.start,
        noise: Some(Pcg64Mcg::seed_from_u64(seed + 100)),
    };
    let [mut moved_m, mut turned_rad] = [0.0, 0.0];
    let mut outcome = None;
    for cycle in 0..2000 {
        let ranges_m = world.ranges();
        let sensed = Sensed { ranges_m: &ranges_m, time_s: 0.192, moved_m, turned_rad };
        let (drive, found) = guide.step(&sensed).unwrap();
        if trace && cycle % 10 == 0 || found.is_some() && trace {
            let [x, y] = world.pose.at.map(|x| x / scenes::PIXEL_M);
            let e = guide.estimate();
            println!(
                "{cycle} ({x:.0}, {y:.0}) {:.0}° along {:.1} est ({:.0}, {:.0}) {:.0}° x{:.2} sd {:.2} fit {:.2} {found:?}",
                world.pose.heading_rad.to_degrees(),
                guide.along_m(),
                e.at[0] / 0.127,
                e.at[1] / 0.127,
                e.heading_rad.to_degrees(),
                e.stretch,
                e.spread_m,
                e.fit
            );
        }
        outcome = found;
        if found.is_some() {
            break;
        }
        [moved_m, turned_rad] = world.drive(drive, 0.192);
    }
    let (at, _) = world.nearest();
    (outcome, at, outcome == Some(Outcome::Arrived) && at == scene.goal)
}

fn guided_runs(scene: &Scene, sketches: &[&str]) -> Vec<usize> {
    sketches
        .iter()
        .map(|text| (0..5).filter(|seed| guided(scene, &read(text), *seed, false).2).count())
        .collect()
}

#[test]
#[allow(clippy::disallowed_methods)]
fn tune() {
    let scene = scene_a();
    let mut sketches = Vec::new();
    for i in 1..=36 {
        let text = std::fs::read_to_string(format!("/tmp/gen/tune/coarse_a_{i:02}.json")).unwrap();
        let drawing: Drawing = serde_json::from_str(&text).unwrap();
        if let Ok(sketch) = Sketch::read(&drawing, &Reading::default()) {
            sketches.push(sketch)
        } else {
            println!("bad {i} {:?}", Sketch::read(&drawing, &Reading::default()).err())
        }
    }
    let base = Guiding::default();
    let b = base.belief;
    use sketchnav_landmarks::belief::Believing;
    use sketchnav_landmarks::memory::Remembering;
    let variants: Vec<(&str, Guiding)> = vec![
        ("base", base),
        ("stretch .25", Guiding { belief: Believing { start_stretch_sd: 0.25, ..b }, ..base }),
        (
            "stretch walk .06",
            Guiding { belief: Believing { stretch_sd: 0.06, start_stretch_sd: 0.25, ..b }, ..base },
        ),
        ("outline .5", Guiding { belief: Believing { outline_sd_m: 0.5, ..b }, ..base }),
        ("outline .25", Guiding { belief: Believing { outline_sd_m: 0.25, ..b }, ..base }),
        ("independent 5", Guiding { belief: Believing { independent: 5.0, ..b }, ..base }),
        ("independent 1.5", Guiding { belief: Believing { independent: 1.5, ..b }, ..base }),
        ("undrawn .3", Guiding { belief: Believing { undrawn: 0.3, ..b }, ..base }),
        ("undrawn .07", Guiding { belief: Believing { undrawn: 0.07, ..b }, ..base }),
        ("way .2", Guiding { belief: Believing { way_sd: 0.2, ..b }, ..base }),
        ("keep 5", Guiding { memory: Remembering { keep_m: 5.0, ..base.memory }, ..base }),
        ("keep 1.5", Guiding { memory: Remembering { keep_m: 1.5, ..base.memory }, ..base }),
        ("reach 5.5", Guiding { memory: Remembering { reach_m: 5.5, ..base.memory }, ..base }),
    ];
    for (name, settings) in variants {
        let mut ends = std::collections::BTreeMap::<String, usize>::new();
        for sketch in &sketches {
            for seed in 0..2 {
                let (outcome, at, is_right) = guided_with(&scene, sketch, seed, false, settings);
                let end = if is_right {
                    "right".into()
                } else if outcome == Some(Outcome::Arrived) {
                    format!("wrong {at}")
                } else {
                    format!("{outcome:?}")
                };
                *ends.entry(end).or_default() += 1;
            }
        }
        println!("{name}: {ends:?}");
    }
}

#[test]
fn ours() {
    for (name, scene) in [("A", scene_a()), ("B", scene_b())] {
        for (set, sketches) in [("careful", &scene.sketches), ("coarse", &scene.coarse)] {
            let mut ends = std::collections::BTreeMap::<String, usize>::new();
            for text in sketches {
                for seed in 0..5 {
                    let (outcome, at, is_right) = guided(&scene, &read(text), seed, false);
                    let end = if is_right { "right".into() } else { format!("{outcome:?} {at}") };
                    *ends.entry(end).or_default() += 1;
                }
            }
            println!("{name} {set}: {ends:?}");
            if name == "B" && set == "careful" {
                for seed in 0..5 {
                    println!("{:?}", guided(&scene, &read(sketches[3]), seed, true));
                }
            }
        }
    }
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
            println!("---- {}", language::table(&route));
            println!("{:?}", follow(&scene, route.clone(), Some(1), true));
        }
    }
}
