//! Steps of a drive allocate nothing.

use sketchnav_landmarks::follower::{Follower, Following, Sensed};
use sketchnav_landmarks::guide::{Guide, Guiding};
use sketchnav_landmarks::language;
use sketchnav_landmarks::perception::{Perceiving, Perception};
use sketchnav_landmarks::sketch::{Drawing, Reading, Sketch};
use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Ranges that come and go: no return, single objects, all around.
fn ranges(i: u32) -> [f64; 16] {
    std::array::from_fn(|beam| match (i / 3 + beam as u32 * 7) % 11 {
        0..4 => f64::INFINITY,
        n if i.is_multiple_of(20) => 0.5 + f64::from(n) * 0.01,
        n => 0.8 + f64::from(n) * 0.4,
    })
}

fn allocations(mut step: impl FnMut(&Sensed<'_>)) -> u64 {
    let mut drive = |i: u32| {
        let ranges_m = ranges(i);
        step(&Sensed { ranges_m: &ranges_m, time_s: 0.192, moved_m: 0.02, turned_rad: 0.05 });
    };
    (0..200).for_each(&mut drive);
    let before = allocations_of_this_thread();
    (0..400).for_each(&mut drive);
    allocations_of_this_thread() - before
}

#[test]
fn a_follower_allocates_nothing() {
    let text = "When a box is left, 2 to 3 m away, and a desk is right or behind, then turn left. \
        After 900 m, when the desk is in direction 13, with width 1 to 2, then move forward.";
    let perception = Perception::nomad(Perceiving::default()).unwrap();
    let mut follower =
        Follower::new(language::read(text).unwrap(), perception, Following::default()).unwrap();
    let mut is_waiting = true;
    let found = allocations(|sensed| is_waiting &= follower.step(sensed).unwrap().0 != Default::default());
    assert_eq!(found, 0);
    assert!(is_waiting, "it drove to the end");
}

#[test]
fn a_guide_allocates_nothing() {
    let drawing: Drawing = serde_json::from_str(include_str!("data/scene_a_01.json")).unwrap();
    let sketch = Sketch::read(&drawing, &Reading::default()).unwrap();
    let angles: Vec<_> = (0..16).map(|i| f64::from(i) * std::f64::consts::FRAC_PI_8).collect();
    // It would be lost at once in these ranges.
    let settings = Guiding { least_fit: 0.0, most_way: 1e6, beyond_m: 1e6, ..Guiding::default() };
    let mut guide = Guide::new(&sketch, &angles, settings, 7).unwrap();
    let mut steps = 0;
    let found = allocations(|sensed| steps += u32::from(guide.step(sensed).unwrap().1.is_none()));
    assert_eq!(found, 0);
    assert_eq!(steps, 600, "it drove to the end");
}
