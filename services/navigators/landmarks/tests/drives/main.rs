//! Drives by sketches of two scenes, with a simulated robot that follows them (Chronis 2007, chapter 5).
//!
//! `cargo test -p sketchnav-landmarks --test drives -- --nocapture` prints the figures.

mod scenes;
mod world;

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_8;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scenes::{PIXEL_M, Scene, exactly, scene_a, scene_b};
use sketchnav_landmarks::belief::Estimate;
use sketchnav_landmarks::drawn::{Drawn, DrawnMetres, Stretch};
use sketchnav_landmarks::extraction::track::headings;
use sketchnav_landmarks::extraction::{Parameters, extract};
use sketchnav_landmarks::file;
use sketchnav_landmarks::follower::{Event, Follower, Following, Viewed};
use sketchnav_landmarks::guide::{Guide, Guided, Guiding, Outcome};
use sketchnav_landmarks::language;
use sketchnav_landmarks::locator::{Locating, Locator, Returns};
use sketchnav_landmarks::perception::{Perceiving, Perception};
use sketchnav_landmarks::plane::{length, resample};
use sketchnav_landmarks::route::Route;
use sketchnav_landmarks::sketch::{Reading, Sketch};
use sketchnav_schemas::geometry::{Point, Pose, World as Floor};
use world::{Object, RANGE_MAX_M, ROBOT_RADIUS_M, World};

const CYCLE_S: f64 = 0.192;

/// How a drive ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    /// The robot stops in front of its goal.
    Goal,
    /// The robot stops in front of another object.
    Elsewhere,
    /// The robot reports that it is lost.
    Lost,
    /// The time given is over before any of the other ends.
    Nowhere,
}

/// Outcome of a drive by states: how it ended, how many states were matched, and where the robot is at the end.
#[derive(Debug, Clone, PartialEq)]
struct Followed {
    end: End,
    matched: usize,
    at: Point<Floor>,
}

fn follow(objects: &[Object], scene: &Scene, route: &Route, seed: u64) -> Followed {
    follow_from(objects, scene, route, seed, None)
}

/// Follows a route from a state to which a person led the robot. The state is given by its number, from 0, and its distance along
/// the route.
fn follow_from(
    objects: &[Object],
    scene: &Scene,
    route: &Route,
    seed: u64,
    led: Option<(usize, DrawnMetres)>,
) -> Followed {
    let mut perception = Perception::nomad(Perceiving::default()).unwrap();
    let mut follower = Follower::new(route.clone(), Following::default()).unwrap();
    let mut world = World { objects, pose: scene.start, noise: Some(Pcg64Mcg::seed_from_u64(seed)) };
    if let Some((state, along)) = led {
        follower.resume_at(state).unwrap();
        world.pose = on_the_way(scene, along);
    }
    let (mut moved, mut matched, mut end) = ([0.0; 2], 0, End::Nowhere);
    for _ in 0..2000 {
        let sectors = sectors(world.ranges());
        let seen = perception.see(&sectors).unwrap();
        let [moved_m, turned_rad] = moved;
        let (drive, event) =
            follower.step(&Viewed { seen, sectors: &sectors, time_s: CYCLE_S, moved_m, turned_rad });
        match event {
            Some(Event::Matched(_)) => matched += 1,
            Some(Event::Arrived) => end = arrived(&world, scene),
            Some(Event::Lost(_)) => end = End::Lost,
            None => {}
        }
        if end != End::Nowhere {
            break;
        }
        moved = world.drive(drive, CYCLE_S);
    }
    Followed { end, matched, at: world.pose.position() }
}

/// Returns the pose of a robot that has driven this far along the route of a scene.
fn on_the_way(scene: &Scene, DrawnMetres(along): DrawnMetres) -> Pose<Floor> {
    let way = scene.as_sketch().route;
    let step = length(&way) / (way.len() - 1) as f64;
    let i = ((along / step).round() as usize).min(way.len() - 2);
    Pose::new(way[i].x, way[i].y, headings(&way)[i])
}

fn arrived(world: &World<'_>, scene: &Scene) -> End {
    if world.nearest().0 == scene.goal { End::Goal } else { End::Elsewhere }
}

/// Drives by our own method. Returns how the drive ended, and the robot's path.
fn guide(objects: &[Object], scene: &Scene, sketch: &Sketch, seed: u64) -> (End, Vec<Point<Drawn>>) {
    let angles_rad: [f64; 16] = std::array::from_fn(|i| i as f64 * FRAC_PI_8);
    let mut locator = Locator::new(sketch, Locating::default(), seed).unwrap();
    let mut guide = Guide::new(sketch, Guiding::default()).unwrap();
    let mut world = World { objects, pose: scene.start, noise: Some(Pcg64Mcg::seed_from_u64(seed + 100)) };
    let (mut moved, mut way) = ([0.0; 2], vec![exactly(&scene.start.position())]);
    for _ in 0..1000 {
        let sectors = sectors(world.ranges());
        let (ring_m, range_max_m) = (ROBOT_RADIUS_M, RANGE_MAX_M);
        let [moved_m, turned_rad] = moved;
        let returns = Returns { angles_rad: &angles_rad, ranges_m: &sectors, ring_m, range_max_m };
        locator.step(moved_m, turned_rad, Some(&returns));
        let (estimate, sure) = (locator.estimate(), locator.sure_places() as u32);
        let guided = Guided { estimate, sectors: &sectors, moved_m, turned_rad, sure };
        let (drive, outcome) = guide.step(&guided);
        match outcome {
            Some(Outcome::Arrived) => return (arrived(&world, scene), way),
            Some(Outcome::Lost | Outcome::NoGoal) => return (End::Lost, way),
            None => {}
        }
        moved = world.drive(drive, CYCLE_S);
        way.push(exactly(&world.pose.position()));
    }
    (End::Nowhere, way)
}

/// Returns the path of a robot that software guides along the route of a scene by its true pose (Chronis 2007, 5.2.3), at the
/// speeds of the thesis.
fn guided_exactly(scene: &Scene, seed: u64) -> Vec<Point<Drawn>> {
    let settings = Guiding { ahead_m: 0.4, avoid: 0.0, ..Guiding::default() };
    let mut guide = Guide::new(&scene.as_sketch(), settings).unwrap();
    let noise = Some(Pcg64Mcg::seed_from_u64(seed));
    let mut world = World { objects: &scene.objects, pose: scene.start, noise };
    let (mut moved, mut way) = ([0.0; 2], vec![exactly(&scene.start.position())]);
    for _ in 0..1000 {
        let sectors = sectors(world.ranges());
        let at = exactly(&world.pose.position());
        let (heading_rad, spread) = (world.pose.yaw_rad, DrawnMetres::default());
        let estimate = Estimate { at, heading_rad, stretch: Stretch::NONE, spread, fit: 1.0 };
        let [moved_m, turned_rad] = moved;
        let guided = Guided { estimate, sectors: &sectors, moved_m, turned_rad, sure: 0 };
        let (drive, outcome) = guide.step(&guided);
        if let Some(outcome) = outcome {
            assert_eq!(outcome, Outcome::Arrived);
            return way;
        }
        moved = world.drive(drive, CYCLE_S);
        way.push(exactly(&world.pose.position()));
    }
    panic!("the robot did not arrive");
}

/// Replaces ranges that count as no return by infinity.
fn sectors(ranges_m: [f64; 16]) -> [f64; 16] {
    ranges_m.map(|range| if range < RANGE_MAX_M { range } else { f64::INFINITY })
}

fn read(text: &str) -> Sketch {
    Sketch::read(&file::read(text.as_bytes()).unwrap(), &Reading::default()).unwrap()
}

/// Counts how often drives ended in each way.
fn count(ends: impl Iterator<Item = End>) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    ends.for_each(|end| *counts.entry(format!("{end:?}")).or_default() += 1);
    counts
}

fn of(counts: &BTreeMap<String, usize>, end: End) -> usize {
    counts.get(&format!("{end:?}")).copied().unwrap_or(0)
}

/// Drives by states five times for each sketch.
fn by_states(scene: &Scene, sketches: &[&str], parameters: &Parameters) -> BTreeMap<String, usize> {
    count(sketches.iter().flat_map(|text| {
        let route = extract(&read(text), parameters);
        (0..5).map(move |seed| {
            route.as_ref().map_or(End::Nowhere, |route| follow(&scene.objects, scene, route, seed).end)
        })
    }))
}

/// Drives by our own method `runs` times for each sketch.
fn by_belief(scene: &Scene, sketches: &[&str], runs: u64) -> BTreeMap<String, usize> {
    count(sketches.iter().flat_map(|text| {
        let sketch = read(text);
        (0..runs).map(move |seed| guide(&scene.objects, scene, &sketch, seed).0)
    }))
}

/// States of scene A, chosen by hand from what the sonars see when the command changes (Chronis 2007, 5.2.3).
const BY_HAND: &str = include_str!("../../../../../sim/missions/landmarks/route.txt");

#[test]
fn states_of_the_true_scene_lead_to_the_goal() {
    // The thesis reports 20 of 20 runs, with all states matched.
    let scene = scene_a();
    let route = language::read(BY_HAND).unwrap();
    let runs: Vec<_> = (0..20).map(|seed| follow(&scene.objects, &scene, &route, seed)).collect();
    let perfect = runs.iter().filter(|run| run.end == End::Goal && run.matched == 6).count();
    println!("states of the true scene: {perfect} of 20");
    assert_eq!(perfect, 20);
}

#[test]
fn states_of_the_exact_way_lead_to_the_goal_of_scene_b() {
    // Such runs used to lead nowhere, because what was meant to make the states stricter made them looser, and objects within the
    // sensors' range were not in view. In scene A they still lead nowhere, for the reasons given in the navigator's docs.
    let scene = scene_b();
    let extracted = extract(&scene.as_sketch(), &Parameters::default()).unwrap();
    let runs = count((0..20).map(|seed| follow(&scene.objects, &scene, &extracted, seed).end));
    println!("states of the exact way of scene B: {runs:?}");
    assert!(of(&runs, End::Goal) >= 15, "{runs:?}");
}

#[test]
fn routes_that_the_robot_drove_lead_to_the_goal() {
    // Chronis 2007, 5.2.3: software guides the robot along the route in the true scene, five times, and 25 of 25 runs succeed.
    let scene = scene_a();
    let by_way = |way: &[Point<Drawn>], drawn: u64| {
        let sketch = Sketch { route: resample(way, 4.0 * PIXEL_M), ..scene.as_sketch() };
        let route = extract(&sketch, &Parameters::default()).unwrap();
        let ends = (0..5).map(|seed| follow(&scene.objects, &scene, &route, 10 * drawn + seed).end);
        ends.collect::<Vec<_>>()
    };
    let counts = count((0..5).flat_map(|drawn| by_way(&guided_exactly(&scene, drawn), drawn)));
    println!("routes that the robot drove: {counts:?}");
    assert!(of(&counts, End::Goal) >= 24, "{counts:?}");
    // A robot that drives by a belief cuts its turns by some decimetres, which makes its path a different route. The thesis does
    // not report this case.
    let believed = count((0..5).flat_map(|drawn| {
        let (end, way) = guide(&scene.objects, &scene, &scene.as_sketch(), drawn);
        assert_eq!(end, End::Goal);
        by_way(&way, drawn)
    }));
    println!("routes that the robot drove by its belief: {believed:?}");
}

#[test]
fn a_robot_whose_landmarks_are_gone_knows_that_it_is_lost() {
    // Chronis 2007, 5.3.1: objects are removed.
    let scene = scene_a();
    let route = extract(&scene.as_sketch(), &Parameters::default()).unwrap();
    for gone in [&["trash"][..], &["trash", "cabinet"], &["trash", "boxes", "table"]] {
        let objects: Vec<_> = scene.objects.iter().filter(|one| !gone.contains(&one.name)).cloned().collect();
        for seed in 0..5 {
            let run = follow(&objects, &scene, &route, seed);
            assert_eq!(run.end, End::Lost, "{gone:?}, {run:?}");
        }
    }
}

#[test]
fn a_scene_that_is_longer_than_its_sketch_is_crossed() {
    // Chronis 2007, figure 5.10: objects on the right are moved farther to the right, so that no absolute position is correct.
    let scene = scene_a();
    let route = extract(&scene.as_sketch(), &Parameters::default()).unwrap();
    let mut objects = scene.objects.clone();
    for object in objects.iter_mut().filter(|one| ["cabinet", "desk", "table"].contains(&one.name)) {
        object.outline.iter_mut().for_each(|at| at.x += 8.0 * PIXEL_M);
    }
    let counts = count((0..5).map(|seed| follow(&objects, &scene, &route, seed).end));
    println!("distorted scene, by states: {counts:?}");
    let ours = count((0..5).map(|seed| guide(&objects, &scene, &scene.as_sketch(), seed).0));
    println!("distorted scene, by belief: {ours:?}");
    assert_eq!(of(&ours, End::Goal), 5);
}

#[test]
fn a_route_in_words_drives_as_the_sketch_that_it_was_made_from() {
    let scene = scene_a();
    for text in &scene.sketches[..4] {
        let route = extract(&read(text), &Parameters::default()).unwrap();
        let words = language::read(&language::print(&route)).unwrap();
        for seed in 0..2 {
            let [one, other] = [&route, &words].map(|route| follow(&scene.objects, &scene, route, seed));
            assert_eq!(one, other);
        }
    }
}

#[test]
fn sketches_are_followed_by_states() {
    // The thesis reports 27 of 55 for A, 48 with additional states, and 32 of 45 for B, but with other sketches and scenes than
    // these.
    for (name, scene) in [("A", scene_a()), ("B", scene_b())] {
        for additional_states in [false, true] {
            let parameters = Parameters { additional_states, ..Parameters::default() };
            let counts = by_states(&scene, &scene.sketches, &parameters);
            println!("scene {name}, by states, additional {additional_states}: {counts:?}");
            assert!(of(&counts, End::Goal) >= 5, "{counts:?}");
            // When the robot fails, it mostly knows that it does.
            assert!(of(&counts, End::Lost) > of(&counts, End::Elsewhere), "{counts:?}");
        }
    }
}

#[test]
fn careful_sketches_are_followed_by_belief() {
    let [a, b] = [scene_a(), scene_b()].map(|scene| by_belief(&scene, &scene.sketches, 5));
    println!("scene A, by belief: {a:?}\nscene B, by belief: {b:?}");
    assert!(of(&a, End::Goal) * 100 >= 95 * 55, "{a:?}");
    assert!(of(&b, End::Goal) * 100 >= 90 * 45, "{b:?}");
}

#[test]
fn careless_sketches_are_followed_by_belief() {
    let [a, b] = [scene_a(), scene_b()].map(|scene| by_belief(&scene, &scene.coarse, 3));
    println!("scene A, careless, by belief: {a:?}\nscene B, careless, by belief: {b:?}");
    assert!(of(&a, End::Goal) * 100 >= 90 * 33, "{a:?}");
    assert!(of(&b, End::Goal) * 100 >= 60 * 27, "{b:?}");
}

#[test]
fn a_lost_robot_that_is_led_on_reaches_its_goal() {
    // Chronis 2007, 4.8: the trash is gone, so states that include it are not matched. A person leads the robot to each of them.
    let scene = scene_a();
    let route = extract(&scene.as_sketch(), &Parameters::default()).unwrap();
    let objects: Vec<_> = scene.objects.iter().filter(|one| one.name != "trash").cloned().collect();
    let mut run = follow(&objects, &scene, &route, 1);
    assert_eq!(run.end, End::Lost);
    let (mut state, mut helped) = (0, 0);
    while run.end == End::Lost {
        // This is the state that was not matched.
        state += run.matched + 1;
        let along = route.along()[state].unwrap();
        run = follow_from(&objects, &scene, &route, 1, Some((state, along)));
        helped += 1;
    }
    assert!(run.end == End::Goal && helped <= 3, "{run:?}, led to state {state}, the last of {helped}");
}
