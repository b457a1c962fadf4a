//! Measures how long the detector of kidnapping takes for a scan: while the robot drives, and after it was carried, when scans are
//! compared in many poses. The mapper's update by the same scans is the yardstick.

use criterion::{Criterion, criterion_group, criterion_main};
use sketchnav_mapping::{KidnapDetector, Mapper, Parameters, Scan};
use sketchnav_schemas::geometry::{Odom, Pose};

const BEAMS: usize = 360;
const STEP_RAD: f64 = std::f64::consts::PI / BEAMS as f64;

/// Returns the ranges of a laser at a pose in a rectangular room around the origin.
fn ranges(half_m: [f64; 2], at: &Pose<Odom>) -> Vec<f32> {
    let range = |beam: usize| {
        let (sin, cos) = (at.yaw_rad + STEP_RAD * (beam as f64 - 0.5 * BEAMS as f64)).sin_cos();
        let wall = |from: f64, along: f64, half_m: f64| (half_m * along.signum() - from) / along;
        wall(at.x, cos, half_m[0]).min(wall(at.y, sin, half_m[1])) as f32
    };
    (0..BEAMS).map(range).collect()
}

fn scan(ranges_m: &[f32]) -> Scan<'_> {
    let base_from_laser = Pose::new(0.0, 0.0, 0.0);
    let first_rad = -0.5 * std::f64::consts::PI;
    Scan { ranges_m, first_rad, step_rad: STEP_RAD, range_min_m: 0.05, range_max_m: 10.0, base_from_laser }
}

fn scans(criterion: &mut Criterion) {
    // Back and forth on an arc, 4 cm from scan to scan.
    let at = |k: usize| {
        let x = 0.04 * (k % 50).min(50 - k % 50) as f64;
        Pose::<Odom>::new(x, 0.1 * x * x, 0.2 * x)
    };
    let driven: Vec<_> = (0..50).map(|k| (at(k), ranges([4.5, 3.0], &at(k)))).collect();
    let carried: Vec<_> = (0..50).map(|k| (at(k), ranges([2.0, 1.5], &at(k)))).collect();
    let mut k = 0;
    let mut mapper = Mapper::new(Parameters::default()).unwrap();
    criterion.bench_function("a scan: the mapper's update", |bencher| {
        bencher.iter(|| {
            k = (k + 1) % 50;
            mapper.update(driven[k].0, &scan(&driven[k].1)).is_ok()
        });
    });
    let mut detector = KidnapDetector::default();
    criterion.bench_function("a scan: the detector, driving", |bencher| {
        bencher.iter(|| {
            k = (k + 1) % 50;
            detector.observe(driven[k].0, &scan(&driven[k].1))
        });
    });
    criterion.bench_function("a scan: the detector, carried every ten scans", |bencher| {
        bencher.iter(|| {
            k = (k + 1) % 50;
            let room = if k / 10 % 2 == 0 { &driven } else { &carried };
            detector.observe(room[k].0, &scan(&room[k].1))
        });
    });
}

criterion_group!(benches, scans);
criterion_main!(benches);
