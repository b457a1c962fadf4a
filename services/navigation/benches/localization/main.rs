//! How long an update of the localization takes, and how many particle-beams a second it weighs.

#[path = "../../tests/support/mod.rs"]
mod support;
mod weighing;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sketchnav_navigation::localization::parameters::{Likelihood, Parameters};
use sketchnav_schemas::geometry::{Odom, Pose};
use support::{Drawing, Drive, WAY};

/// The paper's canvas would show the little building at some 100 pixels a metre.
const DRAWINGS: [(&str, Drawing); 2] = [
    ("500x500", Drawing { size: [500, 500], a: 21.0, b: 13.0, turn_rad: 0.0, wobble_px: 0.0 }),
    ("2540x1252", Drawing { size: [2540, 1252], a: 140.0, b: 95.0, turn_rad: 0.0, wobble_px: 0.0 }),
];

fn update(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update");
    for likelihood in [Likelihood::Visibility, Likelihood::Field] {
        let parameters = Parameters { likelihood, ..Parameters::default() };
        group.throughput(Throughput::Elements((parameters.particles * parameters.beams) as u64));
        for (size, drawing) in DRAWINGS {
            let mut drive = Drive::new(drawing, parameters.clone(), 1);
            let (_, scan) = drive.advance(WAY[1]);
            let mut away = false;
            group.bench_function(format!("{likelihood:?}/{size}"), |bencher| {
                bencher.iter(|| {
                    // There and back again, so that every scan is used.
                    away = !away;
                    let odometry = Pose::<Odom>::new(if away { 0.25 } else { 0.0 }, 0.0, 0.0);
                    black_box(drive.localizer.step(&odometry, &scan))
                });
            });
        }
    }
}

criterion_group!(
    benches,
    weighing::field,
    weighing::visibility,
    weighing::scalar,
    weighing::resampling,
    weighing::preparing,
    update
);
criterion_main!(benches);
