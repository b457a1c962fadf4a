//! Times the reading of a drawing of each kind that ships. For comparison, the same run times imageproc's exact distance transform
//! of the same number of pixels (Felzenszwalb and Huttenlocher 2012).

#![expect(clippy::disallowed_methods, reason = "a benchmark reads files")]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use image::{GrayImage, Luma};
use imageproc::distance_transform::euclidean_squared_distance_transform;
use sketchnav_sketch::reading::{Options, read};

/// Drawings of the same building, as SVG, strokes, a photograph and a filled picture.
const DRAWINGS: [&str; 4] = ["sketch-a.svg", "sketch-b.json", "sketch-c.jpg", "sketch-d.png"];

fn reading(criterion: &mut Criterion) {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../sim/missions/building");
    let mut group = criterion.benchmark_group("reading a drawing");
    group.sample_size(10);
    let options = Options::default();
    for name in DRAWINGS {
        let bytes = std::fs::read(missions.join(name)).expect("a drawing that ships");
        let drawing = read(&bytes, name, &options).expect("a drawing");
        group.throughput(Throughput::Elements(drawing.cells.len() as u64));
        group.bench_function(name, |bencher| bencher.iter(|| read(black_box(&bytes), name, &options)));
        let walls = GrayImage::from_fn(drawing.width_px, drawing.height_px, |x, y| {
            Luma([drawing.cells[(y * drawing.width_px + x) as usize]])
        });
        group.bench_function(format!("yardstick: imageproc's distances in {name}"), |bencher| {
            bencher.iter(|| euclidean_squared_distance_transform(black_box(&walls)));
        });
    }
}

criterion_group!(benches, reading);
criterion_main!(benches);
