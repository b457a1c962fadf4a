//! Times an update of the localization and a step of a search, and measures how many particle-beams it weighs per second.

#[path = "../../tests/support/mod.rs"]
mod support;
mod weighing;

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rayon_core::ThreadPoolBuilder;
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_sketch::filter::parameters::Parameters;
use sketchnav_sketch::filter::workers::Workers;
use support::{Drive, WAY};

/// Times a whole update of the beam model: motion, weighing, mode, resampling and estimate.
fn update(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("a whole update, ours");
    for particles in [1_000, 10_000, 100_000] {
        let parameters = Parameters { particles, ..Parameters::default() };
        for threads in [1, 2] {
            let mut drive = Drive::new(weighing::DRAWING, parameters.clone(), 1);
            let pool = Arc::new(ThreadPoolBuilder::new().num_threads(threads).build().expect("threads"));
            if threads > 1 {
                drive.localizer.set_workers(Workers::of(pool.clone()));
            }
            let (_, scan) = drive.advance(WAY[1]);
            let mut away = false;
            let id = BenchmarkId::new(format!("{threads} thread(s)"), particles);
            group.bench_function(id, |bencher| {
                pool.install(|| {
                    bencher.iter(|| {
                        // The robot goes back and forth, so that every scan is used.
                        away = !away;
                        let odometry = Pose::<Odom>::new(if away { 0.25 } else { 0.0 }, 0.0, 0.0);
                        black_box(drive.localizer.step(&odometry, &scan))
                    });
                });
            });
        }
    }
}

/// Times a step of the search by a robot that may be anywhere in a map. All steps take the same time until it is localized.
fn search(criterion: &mut Criterion) {
    let mut drive = Drive::anywhere(1);
    let mut step = || {
        let (odometry, scan) = drive.advance(WAY[1]);
        black_box(drive.localizer.step(&odometry, &scan));
        (odometry, scan)
    };
    let (odometry, scan) = (0..40).map(|_| step()).last().expect("a step");
    let state = drive.localizer.state().clone();
    criterion.bench_function("a step of a search", |bencher| {
        bencher.iter(|| {
            drive.localizer.restore(state.clone());
            black_box(drive.localizer.step(&odometry, &scan))
        });
    });
}

criterion_group!(
    benches,
    weighing::field,
    weighing::beam_model,
    weighing::scalar,
    weighing::resampling,
    weighing::preparing,
    update,
    search
);
criterion_main!(benches);
