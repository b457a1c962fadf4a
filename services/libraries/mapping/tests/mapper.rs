//! Tests the mapper as a whole: it corrects drifting odometry, and resumes from a checkpoint bit for bit.

use sketchnav_mapping::{Cell, Map, Mapper, Parameters, Scan};
use sketchnav_schemas::geometry::{Odom, Pose};

const BEAMS: usize = 181;

/// Returns the ranges of a laser in a room of 6 × 4 m with a pillar, seen from the pose `at`.
fn ranges(at: &Pose<Map>) -> Vec<f32> {
    let ray = |i: usize| {
        let angle = at.yaw_rad - std::f64::consts::FRAC_PI_2 + (i as f64).to_radians();
        let (sin, cos) = angle.sin_cos();
        let wall = |from: f64, step: f64, low: f64, high: f64| {
            let end = if step > 0.0 { high } else { low };
            if step.abs() < 1e-9 { f64::INFINITY } else { (end - from) / step }
        };
        let room_m = wall(at.x, cos, -3.0, 3.0).min(wall(at.y, sin, -2.0, 2.0));
        // The pillar is a disc with a radius of 0.25 m at (1.5, 0.8).
        let (dx, dy) = (1.5 - at.x, 0.8 - at.y);
        let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let half = 0.0625 - across * across;
        let pillar_m = if half > 0.0 && along > 0.0 { along - half.sqrt() } else { f64::INFINITY };
        room_m.min(pillar_m) as f32
    };
    (0..BEAMS).map(ray).collect()
}

fn scan(ranges_m: &[f32]) -> Scan<'_> {
    Scan {
        ranges_m,
        first_rad: -std::f64::consts::FRAC_PI_2,
        step_rad: 1.0_f64.to_radians(),
        range_min_m: 0.05,
        range_max_m: 10.0,
        base_from_laser: Pose::new(0.0, 0.0, 0.0),
    }
}

/// Returns a drive along an arc through the room, as true poses and as odometry that is 5 % too long and turns too far.
fn drive() -> Vec<(Pose<Map>, Pose<Odom>)> {
    let at = |k: usize| {
        let share = k as f64 / 60.0;
        let pose = Pose::<Map>::new(-2.0 + 2.2 * share, -0.8 + 0.6 * share * share, 0.5 * share);
        let start = Pose::<Map>::new(-2.0, -0.8, 0.0);
        let moved = start.motion_to(&pose);
        let (sin, cos) = (0.1 * share).sin_cos();
        let (x, y) = (1.05 * moved.x, 1.05 * moved.y);
        (pose, Pose::new(x * cos - y * sin, x * sin + y * cos, moved.yaw_rad + 0.1 * share))
    };
    (0..=60).map(at).collect()
}

/// Returns the distance and the angle between the true pose and the mapper's pose.
fn off(mapper: &Mapper, start: &Pose<Map>, truth: &Pose<Map>) -> (f64, f64) {
    let error =
        start.motion_to(truth).motion_to(&Pose::new(mapper.pose().x, mapper.pose().y, mapper.pose().yaw_rad));
    (error.x.hypot(error.y), error.yaw_rad.abs())
}

#[test]
fn the_laser_corrects_drifting_odometry() {
    let (drive, mut mapper) = (drive(), Mapper::new(Parameters::default()).unwrap());
    for (truth, wheels) in &drive {
        mapper.update(*wheels, &scan(&ranges(truth))).unwrap();
    }
    let (start, (end, wheels)) = (drive[0].0, drive[60]);
    let moved = start.motion_to(&end);
    let by_wheels_m = (moved.x - wheels.x).hypot(moved.y - wheels.y);
    let (by_map_m, by_map_rad) = off(&mapper, &start, &end);
    assert!(
        by_wheels_m > 0.15 && by_map_m < 0.04 && by_map_rad < 0.02,
        "{by_wheels_m} {by_map_m} {by_map_rad}"
    );
}

#[test]
fn a_restored_mapper_continues_bit_for_bit() {
    let (drive, mut whole) = (drive(), Mapper::new(Parameters::default()).unwrap());
    let mut restored = Mapper::new(Parameters::default()).unwrap();
    for (truth, wheels) in &drive {
        let ranges_m = ranges(truth);
        whole.update(*wheels, &scan(&ranges_m)).unwrap();
        let stored = postcard::to_stdvec(restored.state()).unwrap();
        restored = Mapper::restore(Parameters::default(), postcard::from_bytes(&stored).unwrap()).unwrap();
        restored.update(*wheels, &scan(&ranges_m)).unwrap();
        let bits = |mapper: &Mapper| postcard::to_stdvec(mapper.state()).unwrap();
        assert!(bits(&whole) == bits(&restored));
    }
}

#[test]
fn scans_at_known_poses_make_a_map_without_odometry() {
    let mut mapper = Mapper::new(Parameters::default()).unwrap();
    for (truth, _) in drive() {
        mapper.enter_at(truth, &scan(&ranges(&truth))).unwrap();
    }
    let cell = |at: [f64; 2]| mapper.map().at(at.map(|m| (m / 0.05_f64).floor() as i32));
    let (wall, pillar, floor) = ([3.01, 0.0], [1.26, 0.8], [0.0, 0.0]);
    assert_eq!([wall, pillar, floor].map(cell), [Cell::Occupied, Cell::Occupied, Cell::Free]);
    let nowhere = Pose::new(f64::NAN, 0.0, 0.0);
    let error = mapper.enter_at(nowhere, &scan(&ranges(&Pose::new(0.0, 0.0, 0.0)))).unwrap_err();
    assert!(error.to_string().contains("expected finite pose"), "{error}");
}
