//! A robot whose laser sees two rooms notices that it was carried from one to the other, and nothing else is mistaken for it.

use proptest::prelude::*;
use sketchnav_mapping::{KidnapDetector, Scan};
use sketchnav_schemas::geometry::{Odom, Pose};

const BEAMS: usize = 241;

/// A rectangular room around the origin, with somebody in it.
#[derive(Debug, Clone, Copy)]
struct Room {
    half_m: [f64; 2],
    /// Position of a person with a radius of 0.25 m.
    person: [f64; 2],
}

const NOBODY: [f64; 2] = [100.0, 100.0];
const OFFICE: Room = Room { half_m: [2.0, 2.5], person: NOBODY };
const HALL: Room = Room { half_m: [4.5, 3.0], person: NOBODY };
/// Most of its walls are further away than the laser reaches.
const FIELD: Room = Room { half_m: [15.0, 9.0], person: NOBODY };
/// All of them are.
const NOTHING: Room = Room { half_m: [15.0, 15.0], person: NOBODY };

impl Room {
    /// Returns the ranges of a laser at a pose in the room.
    fn ranges(&self, at: &Pose<Odom>) -> Vec<f32> {
        let range = |beam: usize| {
            let (sin, cos) = (at.yaw_rad + first_rad() + step_rad() * beam as f64).sin_cos();
            let wall = |from: f64, along: f64, half_m: f64| (half_m * along.signum() - from) / along;
            let wall_m = wall(at.x, cos, self.half_m[0]).min(wall(at.y, sin, self.half_m[1]));
            let (dx, dy) = (self.person[0] - at.x, self.person[1] - at.y);
            let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let reach = 0.0625 - across * across;
            if reach > 0.0 && along > 0.0 { wall_m.min(along - reach.sqrt()) as f32 } else { wall_m as f32 }
        };
        (0..BEAMS).map(range).collect()
    }
}

fn first_rad() -> f64 {
    -2.0
}

fn step_rad() -> f64 {
    4.0 / (BEAMS - 1) as f64
}

fn observe(detector: &mut KidnapDetector, odometry: Pose<Odom>, ranges_m: &[f32]) -> bool {
    detector.observe(odometry, &scan(ranges_m, step_rad()))
}

fn scan(ranges_m: &[f32], step_rad: f64) -> Scan<'_> {
    let base_from_laser = Pose::new(0.0, 0.0, 0.0);
    Scan { ranges_m, first_rad: first_rad(), step_rad, range_min_m: 0.05, range_max_m: 10.0, base_from_laser }
}

/// Lets a robot stand in a room, after it has set off or without having done so, and then in another. Returns the scans there at
/// which it notices that it was carried.
fn noticed(from: &Room, to: &Room, sets_off: bool) -> Vec<usize> {
    let mut detector = KidnapDetector::default();
    let at = |x: f64| Pose::<Odom>::new(x, 0.3, 0.0);
    let way: Vec<f64> = (0..20).map(|k| if sets_off { 0.04 * f64::from(k) } else { 0.0 }).collect();
    for x in &way {
        assert!(!observe(&mut detector, at(*x), &from.ranges(&at(*x))));
    }
    let stands = at(way[19]);
    let elsewhere = Pose::<Odom>::new(-0.5, -0.7, 1.0);
    (0..60).filter(|_| observe(&mut detector, stands, &to.ranges(&elsewhere))).collect()
}

#[test]
fn a_robot_notices_once_that_it_was_carried() {
    assert_eq!(noticed(&OFFICE, &HALL, true), [9]);
    assert_eq!(noticed(&HALL, &OFFICE, true), [9]);
}

/// Regression test: only space in front of a wall counted as free. In a wide hall, hardly any robot noticed that it was carried.
#[test]
fn a_robot_notices_that_it_was_carried_to_where_it_sees_little_or_from_there() {
    assert_eq!(noticed(&OFFICE, &FIELD, true), [9]);
    assert_eq!(noticed(&FIELD, &OFFICE, true), [9]);
}

#[test]
fn a_laser_that_is_covered_is_not_mistaken_for_it() {
    assert_eq!(noticed(&OFFICE, &NOTHING, true), [] as [usize; 0]);
    assert_eq!(noticed(&NOTHING, &OFFICE, true), [] as [usize; 0]);
}

/// People carry a robot to where it is to start.
#[test]
fn before_it_sets_off_a_robot_may_be_carried() {
    assert_eq!(noticed(&OFFICE, &HALL, false), [] as [usize; 0]);
}

/// A kill at any moment changes nothing.
#[test]
fn a_detector_goes_on_from_a_checkpoint() {
    let mut detector = KidnapDetector::default();
    let mut noticed = Vec::new();
    for k in 0..40_u32 {
        let at = Pose::<Odom>::new(0.04 * f64::from(k.min(15)), 0.3, 0.0);
        let room = if k < 16 { OFFICE } else { HALL };
        noticed.extend(observe(&mut detector, at, &room.ranges(&at)).then_some(k));
        detector = postcard::from_bytes(&postcard::to_allocvec(&detector).unwrap()).unwrap();
    }
    assert_eq!(noticed, [25]);
}

proptest! {
    /// The robot drives wherever it likes in a room, with errors of its odometry, while a person walks past. Once, its wheels slip.
    #[test]
    fn neither_driving_nor_people_are_mistaken_for_it(
        turns in prop::collection::vec((-0.15f64..0.15, 0.0f64..0.05), 20..200), drift in -0.02f64..0.02,
        person in (-3.0f64..3.0, -2.0f64..2.0), walks in (-0.1f64..0.1, -0.1f64..0.1),
        (slips_at, slips_m, slips_rad) in (0usize..100, -0.2f64..0.2, -0.2f64..0.2),
    ) {
        let mut detector = KidnapDetector::default();
        let (mut truth, mut odometry) = (Pose::<Odom>::new(0.0, 0.0, 0.0), Pose::<Odom>::new(0.0, 0.0, 0.0));
        for (k, (turn_rad, m)) in turns.into_iter().enumerate() {
            let next = truth.compose(&Pose::<Odom>::new(m, 0.0, turn_rad));
            let is_free = next.x.abs() < HALL.half_m[0] - 0.3 && next.y.abs() < HALL.half_m[1] - 0.3;
            let m = if is_free { m } else { 0.0 };
            truth = truth.compose(&Pose::<Odom>::new(m, 0.0, turn_rad));
            odometry = odometry.compose(&Pose::<Odom>::new(1.03 * m, 0.0, turn_rad * (1.0 + drift)));
            if k == slips_at {
                odometry = odometry.compose(&Pose::<Odom>::new(slips_m, 0.0, slips_rad));
            }
            let person = [person.0 + walks.0 * k as f64, person.1 + walks.1 * k as f64];
            let is_near = (person[0] - truth.x).hypot(person[1] - truth.y) < 0.6;
            let room = Room { person: if is_near { NOBODY } else { person }, ..HALL };
            prop_assert!(!observe(&mut detector, odometry, &room.ranges(&truth)), "at scan {k}");
        }
    }

    /// Regression test: with a tiny angle between beams, the number of a beam overflowed.
    #[test]
    fn any_scan_is_survived(
        ranges in prop::collection::vec(prop_oneof![prop::num::f32::ANY, 0.1f32..9.0], 0..300), yaw in prop::num::f64::ANY,
        step_rad in prop_oneof![prop::num::f64::ANY, Just(1e-30), Just(-1e-30), Just(0.0)],
    ) {
        let mut detector = KidnapDetector::default();
        for k in 0..30 {
            detector.observe(Pose::new(0.1 * f64::from(k), 0.0, yaw), &scan(&ranges, step_rad));
            detector.observe(Pose::new(f64::NAN, 0.0, 0.0), &scan(&ranges, step_rad));
        }
    }
}
