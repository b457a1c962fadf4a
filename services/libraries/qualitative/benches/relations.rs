//! Measures relations per second. As a yardstick, the same run measures the distances between the same points, because computing
//! any of these relations takes at least as long.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sketchnav_qualitative::cardinal::Directions;
use sketchnav_qualitative::hof::{Force, Pair, Polygon, View, Workspace};
use sketchnav_qualitative::qtc::{Basic, DoubleCross, Switching};
use sketchnav_qualitative::rcc::{Rcc8, Regions};
use sketchnav_qualitative::tpcc::Configurations;
use sketchnav_qualitative::{Calculus, Options, Point, Rect, Stream};

const SAMPLES: u32 = 10_000;

/// Returns two objects that move around each other on curves that do not repeat.
fn walk(i: u32) -> [Point; 2] {
    let t = f64::from(i) * 0.02;
    let at = |a: f64, b: f64| {
        Point::new(3.0 * (a * t).cos() + (b * t).sin(), 2.0 * (b * t).cos()).expect("finite")
    };
    [at(1.0, 0.37), at(0.71, 1.3)]
}

fn run<C: Calculus + Copy>(
    criterion: &mut Criterion,
    name: &str,
    calculus: C,
    scene: impl Fn(u32) -> C::Scene,
) {
    let scenes: Vec<_> = (0..SAMPLES).map(scene).collect();
    let mut group = criterion.benchmark_group("relations");
    group.throughput(Throughput::Elements(u64::from(SAMPLES)));
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            let mut stream = Stream::new(calculus, Options::default());
            let steps = scenes.iter().enumerate().map(|(i, scene)| stream.push(i as f64, Some(*scene)));
            steps.map(|step| step.map_or(0, |step| step.into_iter().count())).sum::<usize>()
        });
    });
    group.finish();
}

fn relations(criterion: &mut Criterion) {
    let scenes: Vec<_> = (0..SAMPLES).map(walk).collect();
    let mut group = criterion.benchmark_group("relations");
    group.throughput(Throughput::Elements(u64::from(SAMPLES)));
    group.bench_function("yardstick: distances", |bencher| {
        bencher.iter(|| scenes.iter().map(|[k, l]| black_box(k.distance(*l))).sum::<f64>());
    });
    group.finish();
    run(criterion, "QTC_B", Basic::default(), walk);
    run(criterion, "QTC_C", DoubleCross::default(), walk);
    run(criterion, "QTC_BC", Switching::default(), walk);
    run(criterion, "directions", Directions, walk);
    run(criterion, "TPCC", Configurations::default(), |i| [walk(i)[0], walk(i)[1], walk(i + 500)[0]]);
    let rects = |i| walk(i).map(|at| Rect::around(at, 2.0, 1.5).expect("an extent"));
    run(criterion, "RCC8", Regions::<Rcc8>::default(), rects);
}

/// Measures the histogram, in 180 directions, of a robot's box and an object with twelve corners, at two distances. This includes
/// everything that a navigator does in a step: preparing the objects and finding the best of sixteen directions. Nothing is
/// allocated. As a yardstick, the same run computes the positions of all corners across each of the 180 directions, since any
/// division into strips begins with that.
fn robot(criterion: &mut Criterion) {
    let at = |x, y| Point::new(x, y).expect("finite");
    let robot = Polygon::new([at(-10.0, -10.0), at(10.0, -10.0), at(10.0, 10.0), at(-10.0, 10.0)]);
    let robot = robot.expect("an area");
    let mut group = criterion.benchmark_group("robot and twelve corners, 180 directions");
    for distance in [40.0, 100.0] {
        let corners = (0..12).map(|i| (f64::from(i) / 12.0 * TAU, if i % 2 == 0 { 18.0 } else { 23.0 }));
        let corners = corners.map(|(angle, r)| [distance + r * angle.cos(), 7.0 + r * angle.sin()]);
        let corners: Vec<[f64; 2]> = corners.collect();
        let object = Polygon::new(corners.iter().map(|[x, y]| at(*x, *y))).expect("an area");
        let (mut pair, mut workspace) = (Pair::new(&object, &robot), Workspace::default());
        let mut forces = [Force::ZERO; 180];
        for r in [0.0, 1.0, 2.0] {
            group.bench_function(format!("F_{r}, {distance} in"), |bencher| {
                bencher.iter(|| {
                    pair.prepare(black_box(&object), &robot);
                    pair.histogram_into(r, &mut forces, &mut workspace)
                });
            });
        }
        let all: Vec<_> =
            corners.into_iter().chain([[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]]).collect();
        let across = |i: u32| {
            let (sin, cos) = (f64::from(i) / 180.0 * TAU).sin_cos();
            all.iter().map(|[x, y]| black_box(y * cos - x * sin)).fold(f64::INFINITY, f64::min)
        };
        group.bench_function(format!("yardstick: all corners across, {distance} in"), |bencher| {
            bencher.iter(|| (0..180).map(across).sum::<f64>());
        });
        group.bench_function(format!("best of 16, {distance} in"), |bencher| {
            bencher.iter(|| View::new(black_box(&forces), 0.3).assess(16));
        });
    }
    group.finish();
}

/// Measures the histogram, in 180 directions, of two polygons with 12 and 8 corners. The yardstick is to compute the distances of
/// all pairs of points of two 32 × 32 rasters, which is the least that a sum over points would need.
fn forces(criterion: &mut Criterion) {
    let ring = |x: f64, corners: u32| {
        let corners = (0..corners).map(|i| f64::from(i) / f64::from(corners) * TAU);
        let corners = corners.map(|angle| Point::new(x + angle.cos(), angle.sin()).expect("finite"));
        Polygon::new(corners).expect("an area")
    };
    let (a, b) = (ring(4.0, 12), ring(0.0, 8));
    let pair = Pair::new(&a, &b);
    let mut group = criterion.benchmark_group("forces");
    group.throughput(Throughput::Elements(180));
    for r in [0.0, 2.0] {
        group.bench_function(format!("F_{r}"), |bencher| bencher.iter(|| pair.histogram(black_box(r), 180)));
    }
    let raster = |x: f64| (0..1024).map(move |i| [x + f64::from(i % 32) / 16.0, f64::from(i / 32) / 16.0]);
    let raster = |x: f64| raster(x).map(|at| Point::try_from(at).expect("finite")).collect::<Vec<_>>();
    let (p, q) = (raster(4.0), raster(0.0));
    group.bench_function("yardstick: distances of two rasters", |bencher| {
        bencher.iter(|| p.iter().flat_map(|p| q.iter().map(|q| black_box(p.distance(*q)))).sum::<f64>());
    });
    group.finish();
}

criterion_group!(benches, relations, robot, forces);
criterion_main!(benches);
