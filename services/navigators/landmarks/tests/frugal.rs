//! Checks that no step of a drive allocates.

use sketchnav_landmarks::drawn::DrawnMetres;
use sketchnav_landmarks::file;
use sketchnav_landmarks::follower::{Follower, Following, Viewed};
use sketchnav_landmarks::guide::{Guide, Guided, Guiding};
use sketchnav_landmarks::language;
use sketchnav_landmarks::locator::{Locating, Locator, Returns};
use sketchnav_landmarks::perception::{Perceiving, Perception};
use sketchnav_landmarks::sketch::{Reading, Sketch};
use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns ranges that vary from step to step: no return, single objects, objects all around.
fn ranges(i: u32) -> [f64; 16] {
    std::array::from_fn(|beam| match (i / 3 + beam as u32 * 7) % 11 {
        0..4 => f64::INFINITY,
        n if i.is_multiple_of(20) => 0.5 + f64::from(n) * 0.01,
        n => 0.8 + f64::from(n) * 0.4,
    })
}

fn allocations(mut step: impl FnMut(&[f64; 16])) -> u64 {
    let mut drive = |i: u32| step(&ranges(i));
    (0..200).for_each(&mut drive);
    let before = allocations_of_this_thread();
    (0..400).for_each(&mut drive);
    allocations_of_this_thread() - before
}

#[test]
fn a_follower_allocates_nothing() {
    let text = "When a box is left, 2 to 3 m away, and a desk is right or behind, then turn left. \
        After 900 m, when the desk is in direction 13, with width 1 to 2, then move forward.";
    let mut perception = Perception::nomad(Perceiving::default()).unwrap();
    let mut follower = Follower::new(language::read(text).unwrap(), Following::default()).unwrap();
    let mut is_waiting = true;
    let found = allocations(|ranges| {
        let seen = perception.see(ranges).unwrap();
        let viewed = Viewed { seen, sectors: ranges, time_s: 0.192, moved_m: 0.02, turned_rad: 0.05 };
        is_waiting &= follower.step(&viewed).0 != Default::default();
    });
    assert_eq!(found, 0);
    assert!(is_waiting, "it drove to the end");
}

fn sketch() -> Sketch {
    let drawing =
        file::read(include_bytes!("../../../../sim/missions/landmarks/sketches/a-01.json")).unwrap();
    Sketch::read(&drawing, &Reading::default()).unwrap()
}

fn angles_rad() -> [f64; 16] {
    std::array::from_fn(|i| i as f64 * std::f64::consts::FRAC_PI_8)
}

#[test]
fn a_guide_allocates_nothing() {
    let (sketch, angles_rad) = (sketch(), angles_rad());
    // By default, the robot would be lost at once with these ranges.
    let settings =
        Guiding { least_fit: 0.0, most_way: 1e6, beyond_m: DrawnMetres(1e6), ..Guiding::default() };
    let mut locator = Locator::new(&sketch, Locating::default(), 7).unwrap();
    let mut guide = Guide::new(&sketch, settings).unwrap();
    let mut steps = 0;
    let found = allocations(|ranges_m| {
        let returns = Returns { angles_rad: &angles_rad, ranges_m, ring_m: 0.254, range_max_m: 6.477 };
        locator.step(0.02, 0.05, Some(&returns));
        let (estimate, sure) = (locator.estimate(), locator.sure_places() as u32);
        let guided = Guided { estimate, sectors: ranges_m, moved_m: 0.02, turned_rad: 0.05, sure };
        steps += u32::from(guide.step(&guided).1.is_none());
    });
    assert_eq!(found, 0);
    assert_eq!(steps, 600, "it drove to the end");
}

/// A checkpoint stores values but no spare capacity, so a localizer that resumed from one used to allocate when it met new objects.
#[test]
fn a_locator_that_goes_on_from_a_checkpoint_allocates_nothing() {
    let (sketch, angles_rad) = (sketch(), angles_rad());
    let mut locator = Locator::new(&sketch, Locating::default(), 7).unwrap();
    let step = |locator: &mut Locator, i| {
        let (ring_m, range_max_m) = (0.254, 6.477);
        let returns = Returns { angles_rad: &angles_rad, ranges_m: &ranges(i), ring_m, range_max_m };
        locator.step(0.02, 0.05, Some(&returns));
    };
    step(&mut locator, 1);
    let kept = serde_json::to_string(locator.located()).unwrap();
    locator.restore(serde_json::from_str(&kept).unwrap());
    let before = allocations_of_this_thread();
    (2..400).for_each(|i| step(&mut locator, i));
    assert_eq!(allocations_of_this_thread() - before, 0);
}
