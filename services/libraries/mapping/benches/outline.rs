//! Measures the time that outlines take. The outline of the drawing is computed only once, even for the largest drawings, whereas
//! an alignment is computed about once per second of driving.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use sketchnav_mapping::alignment::{Aligner, Anchor, Problem, Search, Weights};
use sketchnav_mapping::harmonic::Interior;
use sketchnav_mapping::outline::{Outline, SeenOutline, Taking};
use sketchnav_mapping::region::Region;
use sketchnav_mapping::{Cell, CellGrid, Survey};

const SAMPLES: usize = 220;

/// Returns true for points inside a comb-shaped floor, a hall with seven arms, on a canvas of 2540 × 1252 pixels as in Boniardi et
/// al. 2016.
fn is_inside(x: f64, y: f64) -> bool {
    let in_hall = (100.0..2440.0).contains(&x) && (100.0..400.0).contains(&y);
    let in_arm = (100.0..2440.0).contains(&x) && (400.0..1150.0).contains(&y) && (x - 100.0) % 360.0 < 180.0;
    in_hall || in_arm
}

fn drawing() -> Region {
    Region::of(2540, 1252, |k| is_inside((k % 2540) as f64 + 0.5, (k / 2540) as f64 + 0.5))
}

/// Returns a map of the same floor at 94 pixels per metre, of which the robot has seen all but the right third.
fn map() -> CellGrid {
    CellGrid::of([560, 280], 0.05, [0.0, 0.0], |k| {
        let at = [(k % 560) as f64, (k / 560) as f64].map(|k| (k + 0.5) * 0.05 * 94.0);
        let is_seen = at[0] < 1700.0;
        let is_free = |dx: f64, dy: f64| is_inside(at[0] + dx, at[1] + dy);
        let is_beside = [-5.0, 5.0].into_iter().any(|d| is_free(d, 0.0) || is_free(0.0, d));
        match (is_seen, is_free(0.0, 0.0), is_beside) {
            (false, ..) | (_, false, false) => Cell::Unknown,
            (_, true, _) => Cell::Free,
            _ => Cell::Occupied,
        }
    })
}

const TAKING: Taking = Taking {
    piece_m: 0.6,
    smoothing_m: 0.12,
    wall_m: 0.15,
    least_gap_m: 0.36,
    least_wall_m: 0.24,
    most_pieces: 900,
};

fn outlines(criterion: &mut Criterion) {
    let region = drawing();
    let outline = Outline::of_region(&region, SAMPLES, 20.0);
    let interior = Interior::new(&region, &outline, 128);
    criterion.bench_function("outline of a drawing of 2540 × 1252", |bencher| {
        bencher.iter(|| Outline::of_region(black_box(&region), SAMPLES, 20.0));
    });
    criterion.bench_function("inside of a drawing of 2540 × 1252", |bencher| {
        bencher.iter(|| Interior::new(black_box(&region), &outline, 128));
    });
    criterion.bench_function("harmonic measure of a goal", |bencher| {
        bencher.iter(|| interior.measure(black_box([2250.0, 900.0])));
    });
    let survey = Survey::of(map(), [3.0, 3.0], 0.6);
    criterion.bench_function("outline of a map of 28 × 14 m", |bencher| {
        bencher.iter(|| SeenOutline::of_map(black_box(&survey), &[], &TAKING));
    });
    let seen = SeenOutline::of_map(&survey, &[], &TAKING);
    let anchor = Anchor { drawn: [280.0, 280.0], seen: [3.0, 3.0], scale_m: 0.0107 };
    let mut aligner = Aligner::default();
    criterion.bench_function("alignment of the two, whole", |bencher| {
        bencher.iter(|| {
            let (drawn, seen) = (&outline, black_box(&seen));
            let problem =
                Problem { drawn, seen, turn_rad: 0.0, anchor: Some(&anchor), emphasis: &[], forbidden: &[] };
            aligner.set(&Weights::default(), &problem);
            Search::whole(&mut aligner)
        });
    });
    let mut search = Search::default();
    criterion.bench_function("alignment of the two, a step of 600 000", |bencher| {
        bencher.iter(|| {
            if search.advance(&mut aligner, 600_000) {
                search = Search::default();
            }
        });
    });
}

criterion_group!(benches, outlines);
criterion_main!(benches);
