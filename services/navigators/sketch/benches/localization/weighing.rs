//! Times the hot loop, which weighs every particle against every beam, as well as resampling and the preparation of a drawing, on a
//! map of 400 × 400 cells with 180 beams.
//!
//! For comparison, on one core of such a machine, beluga 2.1.1 weighs 441 to 457 million particle-beams per second with its
//! likelihood field and three-dimensional state, and nav2's filter 27 to 34 million. beluga resamples 100,000 particles in 12.8 ms.
//! The group `scalar` times this crate's own plain loops, for ratios within one run.

use std::hint::black_box;
use std::sync::Arc;

use crate::support::{Drawing, WAY, scan_from};
use criterion::{BenchmarkId, Criterion, Throughput};
use fearless_simd::Level;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon_core::ThreadPoolBuilder;
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::seed;
use sketchnav_sketch::filter::beam_model::{BeamModel, Room};
use sketchnav_sketch::filter::beams::{Beams, Mounting};
use sketchnav_sketch::filter::doors::widened;
use sketchnav_sketch::filter::field::Field;
use sketchnav_sketch::filter::grid::Grid;
use sketchnav_sketch::filter::metric::ScaleFrame;
use sketchnav_sketch::filter::outline::enclosed;
use sketchnav_sketch::filter::parameters::Parameters;
use sketchnav_sketch::filter::particles::{ParticleSet, Resampler};
use sketchnav_sketch::filter::weighing::{BeamModelOfScan, FieldOfScan, Model, weigh};
use sketchnav_sketch::filter::workers::Workers;
use sketchnav_sketch::filter::{range_code::DIRECTIONS, range_table::RangeTable};

pub const DRAWING: Drawing = Drawing { size: [400, 400], a: 22.0, b: 28.0, turn_rad: 0.1, wobble_px: 0.0 };
const BEAMS: usize = 180;
const SIZES: [usize; 3] = [2_000, 10_000, 100_000];

/// A drawing with its tables, and a scan made in it.
struct Scene {
    grid: Grid,
    table: RangeTable,
    field: Field,
    beam_model: BeamModel,
    frame: ScaleFrame,
    beams: Beams,
}

impl Scene {
    fn new() -> Self {
        let sketch = DRAWING.sketch();
        let grid = Grid::new(&sketch, 1_000_000);
        let parameters = Parameters::default();
        let mut beams = Beams::with_capacity(BEAMS);
        let scan = scan_from([WAY[1][0], WAY[1][1], 1.57], BEAMS, -3.1, 20.0, || 0.0);
        beams.select(&scan, &Mounting { x_m: 0.1, ..Mounting::default() }, BEAMS);
        assert_eq!(beams.end_m.len(), BEAMS);
        let mut beam_model = BeamModel::new(&parameters);
        beam_model.read(&beams, parameters.hit_width);
        Self {
            table: RangeTable::new(&grid),
            field: Field::new(&grid, &parameters, 25.0),
            beam_model,
            frame: ScaleFrame::new(DRAWING.turn_rad),
            beams,
            grid,
        }
    }

    fn field(&self) -> FieldOfScan<'_> {
        FieldOfScan { field: &self.field, beams: &self.beams }
    }

    fn beam_model(&self) -> BeamModelOfScan<'_> {
        BeamModelOfScan { beam_model: &self.beam_model, table: &self.table, beams: &self.beams }
    }

    fn weigh_one_by_one(
        &self,
        set: &mut ParticleSet,
        mut likelihood: impl FnMut(&Self, usize, &ParticleSet) -> f32,
    ) {
        for i in 0..set.len() {
            let gain = likelihood(self, i, set);
            set.log_weight[i] += 0.03 * gain;
        }
    }
}

/// Returns particles around the position of the scan, as in tracking.
fn around(count: usize) -> ParticleSet {
    let mut rng: Pcg64Mcg = seed::stream(3, "bench");
    let mut normal = || -> f32 { StandardNormal.sample(&mut rng) };
    let mut set = ParticleSet::new(count);
    let [x, y] = DRAWING.px(WAY[1]);
    for i in 0..count {
        set.x_px[i] = x as f32 + 12.0 * normal();
        set.y_px[i] = y as f32 + 12.0 * normal();
        set.yaw_rad[i] = 1.6 + 0.15 * normal();
        set.ln_a[i] = 22.0_f32.ln() + 0.3 * normal();
        set.ln_b[i] = 28.0_f32.ln() + 0.3 * normal();
    }
    set
}

/// Returns particles anywhere in the drawing, as at the start of a global localization.
fn anywhere(count: usize) -> ParticleSet {
    let mut rng: Pcg64Mcg = seed::stream(4, "bench");
    let mut set = around(count);
    for i in 0..count {
        set.x_px[i] = 400.0 * rng.random::<f32>();
        set.y_px[i] = 400.0 * rng.random::<f32>();
        set.yaw_rad[i] = std::f32::consts::TAU * rng.random::<f32>();
    }
    set
}

fn bench_model<'a, M: Model>(
    criterion: &mut Criterion,
    name: &str,
    scene: &'a Scene,
    model: impl Fn(&'a Scene) -> M,
) {
    let mut group = criterion.benchmark_group(name);
    let model = model(scene);
    for count in SIZES {
        group.throughput(Throughput::Elements((count * BEAMS) as u64));
        for (place, mut set) in [("around", around(count)), ("anywhere", anywhere(count))] {
            group.bench_function(BenchmarkId::new(format!("1 thread, {place}"), count), |bencher| {
                let workers = Workers::default();
                bencher.iter(|| weigh(&mut set, &model, &scene.frame, 0.03, Level::new(), &workers));
            });
        }
        let mut set = around(count);
        let pool = Arc::new(ThreadPoolBuilder::new().num_threads(2).build().unwrap());
        let workers = Workers::of(pool.clone());
        group.bench_function(BenchmarkId::new("2 threads, around", count), |bencher| {
            pool.install(|| {
                bencher.iter(|| weigh(&mut set, &model, &scene.frame, 0.03, Level::new(), &workers));
            });
        });
    }
    group.finish();
}

pub fn field(criterion: &mut Criterion) {
    let scene = Scene::new();
    bench_model(criterion, "likelihood field (beluga: 450 M/s, nav2: 30 M/s)", &scene, Scene::field);
}

pub fn beam_model(criterion: &mut Criterion) {
    let scene = Scene::new();
    bench_model(criterion, "beam_model", &scene, Scene::beam_model);
}

pub fn scalar(criterion: &mut Criterion) {
    let scene = Scene::new();
    let mut group = criterion.benchmark_group("scalar");
    group.sample_size(10);
    let mut set = around(2_000);
    group.throughput(Throughput::Elements((set.len() * BEAMS) as u64));
    let metric = |scene: &Scene, i: usize, set: &ParticleSet| {
        scene.frame.px_from_base(set.yaw_rad[i], set.ln_a[i].exp(), set.ln_b[i].exp())
    };
    group.bench_function("likelihood field/2000", |bencher| {
        bencher.iter(|| {
            scene.weigh_one_by_one(&mut set, |scene, i, set| {
                scene.field.log_likelihood(&scene.beams, [set.x_px[i], set.y_px[i]], &metric(scene, i, set))
            });
        });
    });
    let mut room = Room::new(BEAMS);
    group.bench_function("beam_model, ray by ray/2000", |bencher| {
        bencher.iter(|| {
            scene.weigh_one_by_one(&mut set, |scene, i, set| {
                let place = [set.x_px[i], set.y_px[i]];
                let metric = metric(scene, i, set);
                scene.beam_model.log_likelihood(&scene.grid, &scene.beams, place, &metric, &mut room)
            });
        });
    });
}

pub fn resampling(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("resampling (beluga, 100,000: 12.8 ms; goal 0.5 ms)");
    for count in SIZES {
        let mut set = around(count);
        let mut resampler = Resampler::new(count);
        let weights: Vec<f32> = (0..count).map(|i| -((i * 7919 % 1000) as f32) / 200.0).collect();
        set.log_weight.copy_from_slice(&weights);
        set.normalize();
        let normalized = set.weight.clone();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("systematic", count), |bencher| {
            bencher.iter(|| {
                set.weight.copy_from_slice(&normalized);
                resampler.resample(black_box(&mut set), 0.3);
            });
        });
    }
}

/// Times the work that a filter does on a drawing before the first scan. For comparison, it also times writing the bytes of the
/// table of ranges once, which shows the speed of the memory.
pub fn preparing(criterion: &mut Criterion) {
    let scene = Scene::new();
    let sketch = DRAWING.sketch();
    let mut group = criterion.benchmark_group("preparing a drawing of 400 x 400");
    group.sample_size(10);
    let mut bytes = vec![0_u8; scene.grid.cells().iter().product::<usize>() * DIRECTIONS];
    group.bench_function("yardstick: a table's bytes, written once", |bencher| {
        bencher.iter(|| black_box(&mut bytes).fill(black_box(1)));
    });
    group.bench_function("table of ranges", |bencher| bencher.iter(|| RangeTable::new(&scene.grid)));
    group.bench_function("doors", |bencher| bencher.iter(|| widened(black_box(&sketch), 22.0)));
    let [x, y] = DRAWING.px(WAY[1]);
    group.bench_function("outline", |bencher| {
        bencher.iter(|| enclosed(black_box(&sketch), Point::new(x, y), 30.0));
    });
    group.bench_function("grid", |bencher| bencher.iter(|| Grid::new(black_box(&sketch), 1_000_000)));
    let parameters = Parameters::default();
    group.bench_function("likelihood field", |bencher| {
        bencher.iter(|| Field::new(&scene.grid, &parameters, 25.0))
    });
}
