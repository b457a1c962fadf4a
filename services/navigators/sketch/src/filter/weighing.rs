//! The hot loop, which weighs every particle by every beam, sixteen particles at a time.
//!
//! A particle's pose and scales become one 2 × 2 matrix. With the likelihood field, a beam then costs two multiply-adds per axis,
//! an index and a look-up. Particles are independent of each other, and each adds up its beams in order, so neither the width of
//! the processor's vectors nor the number of threads affects any bit of the result.

use std::cell::Cell;

use fearless_simd::{Level, dispatch, f32x16, i32x16, prelude::*};

use super::beam_model::{BeamModel, LEAVE_WALL_M, Powers};
use super::beams::{Beams, SHORTEST_M};
use super::field::Field;
use super::lanes::{self, LANES};
use super::metric::ScaleFrame;
use super::particles::ParticleSet;
use super::range_code::DIRECTIONS;
use super::range_table::RangeTable;
use super::workers::Workers;

/// Number of particles that a thread processes at a time.
const BLOCK: usize = 256;

/// Sixteen particles, as their positions in pixels and their matrices from metres in the robot's axes to pixels.
pub struct Group<S: Simd> {
    x: f32x16<S>,
    y: f32x16<S>,
    xx: f32x16<S>,
    xy: f32x16<S>,
    yx: f32x16<S>,
    yy: f32x16<S>,
}

/// A model of the likelihood of a scan from sixteen particles.
pub trait Model: Sync {
    /// Returns Σ ln p over the beams, for each particle.
    fn log_likelihood<S: Simd>(&self, simd: S, group: &Group<S>) -> f32x16<S>;
}

/// Adds `per_beam` times the log likelihood of the scan to the logarithm of each particle's weight.
pub fn weigh(
    set: &mut ParticleSet,
    model: &impl Model,
    frame: &ScaleFrame,
    per_beam: f32,
    level: Level,
    workers: &Workers,
) {
    let ParticleSet { x_px, y_px, yaw_rad, ln_a, ln_b, log_weight, .. } = set;
    let columns = Columns { x_px, y_px, yaw_rad, ln_a, ln_b };
    workers.each(&mut log_weight[..], BLOCK, |first, weights| {
        dispatch!(level, simd => weigh_block(simd, &columns, first, weights, model, frame, per_beam));
    });
}

struct Columns<'a> {
    x_px: &'a [f32],
    y_px: &'a [f32],
    yaw_rad: &'a [f32],
    ln_a: &'a [f32],
    ln_b: &'a [f32],
}

#[inline(always)]
fn weigh_block<S: Simd>(
    simd: S,
    columns: &Columns,
    first: usize,
    weights: &mut [f32],
    model: &impl Model,
    frame: &ScaleFrame,
    per_beam: f32,
) {
    for (k, weights) in weights.chunks_mut(LANES).enumerate() {
        let group = Group::load(simd, columns, first + k * LANES, frame);
        let gain: [f32; LANES] = (model.log_likelihood(simd, &group) * per_beam).into();
        weights.iter_mut().zip(gain).for_each(|(weight, gain)| *weight += gain);
    }
}

impl<S: Simd> Group<S> {
    /// Loads sixteen particles and computes their matrices R(φ)·diag(a, b)·R(−φ)·R(θ), by equation (3) of Boniardi et al. 2015.
    #[inline(always)]
    fn load(simd: S, columns: &Columns, first: usize, frame: &ScaleFrame) -> Self {
        let column = |column: &[f32]| lanes::load(simd, column, first);
        let [direction, frame_cos, frame_sin] = frame.direction();
        let (sin, cos) = lanes::sin_cos(column(columns.yaw_rad) - direction);
        let (a, b) = (lanes::exp(column(columns.ln_a)), lanes::exp(column(columns.ln_b)));
        Self {
            x: column(columns.x_px),
            y: column(columns.y_px),
            xx: a * cos * frame_cos - b * sin * frame_sin,
            xy: -(a * sin * frame_cos) - b * cos * frame_sin,
            yx: a * cos * frame_sin + b * sin * frame_cos,
            yy: b * cos * frame_cos - a * sin * frame_sin,
        }
    }

    /// Converts the group to units of cells of `px` pixels, counted from the corner of the ring of cells around the drawing.
    #[inline(always)]
    fn in_cells(&self, px: f32) -> Self {
        let inverse = 1.0 / px;
        Self {
            x: self.x * inverse + 1.0,
            y: self.y * inverse + 1.0,
            xx: self.xx * inverse,
            xy: self.xy * inverse,
            yx: self.yx * inverse,
            yy: self.yy * inverse,
        }
    }

    /// Returns the positions to which the vector (forward, left), in metres, leads from the particles.
    #[inline(always)]
    fn end(&self, [forward, left]: [f32; 2]) -> [f32x16<S>; 2] {
        [self.x + self.xx * forward + self.xy * left, self.y + self.yx * forward + self.yy * left]
    }

    /// Converts the vector (forward, left), in metres, to the drawing's axes.
    #[inline(always)]
    fn span(&self, [forward, left]: [f32; 2]) -> [f32x16<S>; 2] {
        [self.xx * forward + self.xy * left, self.yx * forward + self.yy * left]
    }
}

/// Returns the index of the cell that contains a position, given in cells. For a position outside, this is the nearest cell of the
/// ring.
#[inline(always)]
fn cell<S: Simd>([x, y]: [f32x16<S>; 2], [width, height]: [usize; 2]) -> i32x16<S> {
    let column: i32x16<S> = x.max(0.0).min((width - 1) as f32).to_int();
    let row: i32x16<S> = y.max(0.0).min((height - 1) as f32).to_int();
    row * width as i32 + column
}

/// The likelihood field, applied to the end points of a scan.
pub struct FieldOfScan<'a> {
    /// The likelihood field.
    pub field: &'a Field,
    /// Beams of the scan.
    pub beams: &'a Beams,
}

impl Model for FieldOfScan<'_> {
    #[inline(always)]
    fn log_likelihood<S: Simd>(&self, simd: S, group: &Group<S>) -> f32x16<S> {
        let cells = self.field.cells();
        let group = group.in_cells(self.field.px_per_cell());
        let mut sum = f32x16::splat(simd, 0.0);
        for &end in &self.beams.end_m {
            sum += lanes::gather(simd, self.field.by_cell(), cell(group.end(end), cells));
        }
        sum
    }
}

/// Arc within which only the first and the last beam are computed exactly. Between them, the look is interpolated linearly. At 6°,
/// in a drawing that is stretched twofold, this is accurate to 0.2° and a hundredth of an octave. Scans with more than one beam
/// every 3° are therefore cheap.
const ARC_RAD: f32 = 0.105;

/// The directions in which sixteen particles look along a beam, in directions of the table, and the binary logarithms of the length
/// of a metre in these directions, in pixels.
struct Look<S: Simd> {
    direction: f32x16<S>,
    log2_scale: f32x16<S>,
}

impl<S: Simd> Look<S> {
    /// Returns the difference from this look to the next, the short way round.
    #[inline(always)]
    fn to(&self, next: &Self) -> Self {
        let turn = next.direction - self.direction;
        let round = (turn * (1.0 / DIRECTIONS as f32)).round_ties_even() * DIRECTIONS as f32;
        Self { direction: turn - round, log2_scale: next.log2_scale - self.log2_scale }
    }

    /// Returns the look that is further by a part of the difference `way`.
    #[inline(always)]
    fn further(&self, way: &Self, part: f32) -> Self {
        Self {
            direction: self.direction + way.direction * part,
            log2_scale: self.log2_scale + way.log2_scale * part,
        }
    }

    /// Rounds the look to the nearest entry of the table, modulo its directions.
    #[inline(always)]
    fn nearest(&self) -> NearestLook {
        // Adds one turn, since the conversion truncates towards zero.
        let direction: i32x16<S> = (self.direction + (DIRECTIONS as f32 + 0.5)).to_int();
        NearestLook { direction: direction.into(), log2_scale: self.log2_scale.into() }
    }
}

/// A [`Look`] rounded to the nearest entry of the table, modulo its directions.
#[derive(Debug, Clone, Copy)]
struct NearestLook {
    direction: [i32; LANES],
    log2_scale: [f32; LANES],
}

/// A thread's buffers, with one entry per beam. Each step of the model is completed for all beams before the next step begins,
/// because a processor can overlap several short chains of dependent operations, but not the single long chain for one beam.
#[derive(Debug, Default)]
struct Scratch {
    looks: Vec<NearestLook>,
    expected: Vec<Powers<[f32; LANES]>>,
}

thread_local! {
    static SCRATCH: Cell<Scratch> = const { Cell::new(Scratch { looks: Vec::new(), expected: Vec::new() }) };
}

/// The beam model, applied to a scan with the table of ranges.
pub struct BeamModelOfScan<'a> {
    /// The beam model, after reading the beams.
    pub beam_model: &'a BeamModel,
    /// Table of the drawing's ranges.
    pub table: &'a RangeTable,
    /// Beams of the scan.
    pub beams: &'a Beams,
}

impl Model for BeamModelOfScan<'_> {
    #[inline(always)]
    fn log_likelihood<S: Simd>(&self, simd: S, group: &Group<S>) -> f32x16<S> {
        let mut scratch = SCRATCH.take();
        self.look_around(group, &mut scratch.looks);
        self.expect(simd, group, &mut scratch);
        let sum = self.beam_model.of(simd, &scratch.expected);
        SCRATCH.set(scratch);
        sum
    }
}

impl BeamModelOfScan<'_> {
    /// Computes the particles' looks along each beam.
    #[inline(always)]
    fn look_around<S: Simd>(&self, group: &Group<S>, looks: &mut Vec<NearestLook>) {
        looks.clear();
        let Some(&(mut first_rad)) = self.beams.angle_rad.first() else { return };
        let mut from = self.look(group, 0);
        looks.push(from.nearest());
        while looks.len() < self.beams.len() {
            let rest = &self.beams.angle_rad[looks.len()..];
            let turned = |angle: &f32| (angle - first_rad).abs();
            let between = rest[1..].iter().take_while(|angle| turned(angle) <= ARC_RAD).count();
            let to = self.look(group, looks.len() + between);
            let (way, per_rad) = (from.to(&to), 1.0 / turned(&rest[between]).max(f32::MIN_POSITIVE));
            for angle in &rest[..between] {
                looks.push(from.further(&way, turned(angle) * per_rad).nearest());
            }
            looks.push(to.nearest());
            (from, first_rad) = (to, rest[between]);
        }
    }

    #[inline(always)]
    fn look<S: Simd>(&self, group: &Group<S>, beam: usize) -> Look<S> {
        let [x, y] = group.span([self.beams.forward[beam], self.beams.left[beam]]);
        let direction = lanes::direction(x, y, DIRECTIONS as f32);
        Look { direction, log2_scale: lanes::fast_log2(x * x + y * y) * 0.5 }
    }

    /// Computes the particles' expected range of each beam, given their looks.
    #[inline(always)]
    fn expect<S: Simd>(&self, simd: S, group: &Group<S>, scratch: &mut Scratch) {
        let place = group.in_cells(self.table.px_per_cell()).end(self.beams.origin_m);
        let from: [i32; LANES] = cell(place, self.table.cells()).into();
        let rows = from.map(|cell| self.table.rows(cell as u32 as usize));
        let walled = rows.iter().any(|row| row.leave.is_some());
        let [per_code, shortest] = self.table.log2_px();
        let Scratch { looks, expected } = scratch;
        expected.clear();
        for look in looks.iter() {
            let direction = |lane: usize| look.direction[lane] as u32 as usize % DIRECTIONS;
            let nearest = -f32x16::from_slice(simd, &look.log2_scale) + shortest;
            let range = i32x16::from_fn(simd, |lane| i32::from(rows[lane].range[direction(lane)]));
            let mut log2 = range.to_float::<f32x16<S>>() * per_code + nearest;
            if walled {
                let leave =
                    |lane: usize| rows[lane].leave.map_or(0, |leave| i32::from(leave[direction(lane)]));
                let leave: f32x16<S> = i32x16::from_fn(simd, leave).to_float();
                let left = leave * per_code + nearest;
                let stuck = leave.simd_gt(0.0) & left.simd_ge(LEAVE_WALL_M.log2());
                log2 = stuck.select(f32x16::splat(simd, SHORTEST_M.log2()), log2);
            }
            expected.push(self.beam_model.expect(log2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::beam_model::Room;
    use crate::filter::grid::Grid;
    use crate::filter::lanes::levels;
    use crate::filter::parameters::Parameters;
    use crate::sketch::SketchGrid;
    use proptest::prelude::*;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;
    use rayon_core::ThreadPoolBuilder;
    use sketchnav_schemas::codes::WALL;
    use sketchnav_schemas::message::{LaserScan, MAX_BEAMS};
    use sketchnav_schemas::seed;
    use std::sync::Arc;

    /// A drawing of a few strokes and a scan of random ranges.
    struct Scene {
        grid: Grid,
        table: RangeTable,
        field: Field,
        beam_model: BeamModel,
        frame: ScaleFrame,
        beams: Beams,
    }

    impl Scene {
        fn new(rng: &mut Pcg64Mcg) -> Self {
            let grid = Grid::new(&strokes(rng), 1_000_000);
            let parameters = Parameters::default();
            let (beams, mut beam_model) = (random_beams(rng), BeamModel::new(&parameters));
            beam_model.read(&beams, rng.random_range(0.0..0.5));
            Self {
                table: RangeTable::new(&grid),
                field: Field::new(&grid, &parameters, 20.0),
                beam_model,
                frame: ScaleFrame::new(rng.random::<f64>()),
                beams,
                grid,
            }
        }

        fn weighed(&self, set: &ParticleSet, sees: bool, level: Level, workers: &Workers) -> Vec<f32> {
            let Self { table, field, beam_model, frame, beams, .. } = self;
            let mut set = set.clone();
            if sees {
                weigh(&mut set, &BeamModelOfScan { beam_model, table, beams }, frame, 1.0, level, workers);
            } else {
                weigh(&mut set, &FieldOfScan { field, beams }, frame, 1.0, level, workers);
            }
            set.log_weight
        }
    }

    fn strokes(rng: &mut Pcg64Mcg) -> SketchGrid {
        let (width, height) = (rng.random_range(60..160), rng.random_range(60..160));
        let mut cells = vec![0; width * height];
        for _ in 0..8 {
            let mut end = || [rng.random_range(0.0..width as f64), rng.random_range(0.0..height as f64)];
            let (from, to) = (end(), end());
            for k in 0..=400 {
                let at = [0, 1].map(|i| (from[i] + (to[i] - from[i]) * f64::from(k) / 400.0) as usize);
                cells[at[1] * width + at[0]] = WALL;
            }
        }
        SketchGrid::new(width, height, &cells, 0.0).unwrap()
    }

    fn random_beams(rng: &mut Pcg64Mcg) -> Beams {
        let mut scan: LaserScan = bytemuck::Zeroable::zeroed();
        scan.beam_count = 37;
        // The beams cover the full circle, or are so dense that the looks along some beams are interpolated.
        let step_rad = [0.17, -0.17, 0.03, -0.03][rng.random_range(0..4)];
        (scan.range_min_m, scan.range_max_m, scan.angle_increment_rad) = (0.02, 5.0, step_rad);
        scan.ranges_m[..37].fill_with(|| 0.1 + 6.0 * rng.random::<f32>());
        let mut beams = Beams::with_capacity(MAX_BEAMS);
        beams.select(&scan, &super::super::beams::Mounting { x_m: 0.2, y_m: -0.1, yaw_rad: 0.3 }, 37);
        beams
    }

    fn random_set(rng: &mut Pcg64Mcg, count: usize) -> ParticleSet {
        let mut set = ParticleSet::new(count);
        set.x_px.fill_with(|| rng.random_range(-10.0..170.0));
        set.y_px.fill_with(|| rng.random_range(-10.0..170.0));
        set.yaw_rad.fill_with(|| rng.random_range(-3.0..3.0));
        set.ln_a.fill_with(|| rng.random_range(1.5..3.5));
        set.ln_b.fill_with(|| rng.random_range(1.5..3.5));
        set
    }

    fn bits(values: &[f32]) -> Vec<u32> {
        values.iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        let mut rng = seed::stream(1, "weighing");
        for count in [1, 15, 16, 17, 530] {
            let (scene, set) = (Scene::new(&mut rng), random_set(&mut rng, count));
            for sees in [false, true] {
                let weighed = |level| bits(&scene.weighed(&set, sees, level, &Workers::default()));
                let expected = weighed(Level::new());
                assert!(levels().into_iter().all(|level| weighed(level) == expected));
            }
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let mut rng = seed::stream(2, "weighing");
        let (scene, set) = (Scene::new(&mut rng), random_set(&mut rng, 5000));
        for sees in [false, true] {
            let weighed = |workers: &Workers| bits(&scene.weighed(&set, sees, Level::new(), workers));
            let expected = weighed(&Workers::default());
            for threads in 1..=4 {
                let pool = Arc::new(ThreadPoolBuilder::new().num_threads(threads).build().unwrap());
                assert_eq!(weighed(&Workers::of(pool)), expected, "{threads} threads");
            }
        }
    }

    #[test]
    fn the_field_is_that_of_the_plain_loop() {
        let mut rng = seed::stream(3, "weighing");
        let (scene, set) = (Scene::new(&mut rng), random_set(&mut rng, 2000));
        let found = scene.weighed(&set, false, Level::new(), &Workers::default());
        // Rounding may put an end point into the adjacent cell, which does not matter over many particles.
        let off = |i: usize| {
            let metric = scene.frame.px_from_base(set.yaw_rad[i], set.ln_a[i].exp(), set.ln_b[i].exp());
            let plain = scene.field.log_likelihood(&scene.beams, [set.x_px[i], set.y_px[i]], &metric);
            (found[i] - plain).abs() / scene.beams.end_m.len() as f32
        };
        let offs: Vec<f32> = (0..set.len()).map(off).collect();
        assert!(offs.iter().all(|&off| off < 0.05) && offs.iter().filter(|&&off| off > 1e-4).count() < 20);
    }

    /// Returns the looks of all particles along each beam, either as computed by the model or, with `each`, computed for each beam
    /// separately.
    #[inline(always)]
    fn looks<S: Simd>(simd: S, scene: &Scene, set: &ParticleSet, each: bool) -> Vec<NearestLook> {
        let ParticleSet { x_px, y_px, yaw_rad, ln_a, ln_b, .. } = set;
        let group = Group::load(simd, &Columns { x_px, y_px, yaw_rad, ln_a, ln_b }, 0, &scene.frame);
        let Scene { beam_model, table, beams, .. } = scene;
        let model = BeamModelOfScan { beam_model, table, beams };
        let mut looks = Vec::new();
        if each {
            looks.extend((0..beams.len()).map(|beam| model.look(&group, beam).nearest()));
        } else {
            model.look_around(&group, &mut looks);
        }
        looks
    }

    #[test]
    fn between_two_beams_one_looks_where_one_would() {
        let mut rng = seed::stream(4, "weighing");
        let mut dense = 0;
        for _ in 0..40 {
            let (scene, mut set) = (Scene::new(&mut rng), random_set(&mut rng, LANES));
            // The drawing is stretched twofold at most.
            set.ln_b = set.ln_a.iter().map(|ln_a| ln_a + rng.random_range(-0.7..0.7)).collect();
            let [around, each] =
                [false, true].map(|each| dispatch!(Level::new(), simd => looks(simd, &scene, &set, each)));
            assert_eq!(around.len(), scene.beams.len());
            dense += usize::from((scene.beams.angle_rad[2] - scene.beams.angle_rad[0]).abs() < ARC_RAD);
            for (found, exact) in around.iter().zip(&each) {
                for lane in 0..LANES {
                    let turned =
                        (found.direction[lane] - exact.direction[lane]).rem_euclid(DIRECTIONS as i32);
                    assert!([0, 1, DIRECTIONS as i32 - 1].contains(&turned), "{turned}");
                    assert!((found.log2_scale[lane] - exact.log2_scale[lane]).abs() < 0.02);
                }
            }
        }
        assert!((1..40).contains(&dense), "{dense}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Every entry of the table is exact for a point in the cell and a nearby direction, which the table's own tests verify.
        /// This test covers the model as a whole, by the mean over particles anywhere.
        #[test]
        fn the_table_agrees_with_ray_casting(case in 0u64..1_000_000) {
            let mut rng = seed::stream(case, "beam_model");
            let (scene, set) = (Scene::new(&mut rng), random_set(&mut rng, 400));
            let found = scene.weighed(&set, true, Level::new(), &Workers::default());
            let off = |i: usize| {
                let metric = scene.frame.px_from_base(set.yaw_rad[i], set.ln_a[i].exp(), set.ln_b[i].exp());
                let place = [set.x_px[i], set.y_px[i]];
                let Scene { beam_model, grid, beams, .. } = &scene;
                let plain = beam_model.log_likelihood(grid, beams, place, &metric, &mut Room::default());
                (found[i] - plain).abs()
            };
            let mean_off = (0..set.len()).map(off).sum::<f32>() / (set.len() * scene.beams.len()) as f32;
            prop_assert!(mean_off < 0.08, "{mean_off}");
        }
    }
}
