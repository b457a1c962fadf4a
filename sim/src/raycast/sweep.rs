//! Casts many rays from one point, with results that are bit-identical to [`Faces::cast`] for each ray, but
//! several times as fast.
//!
//! The tree finds the hits ray by ray. A sweep instead goes from face to face, near ones first. For each
//! face, it determines which rays may hit it, and intersects those with it. Because the rays are consecutive
//! in memory, the compiler can use vector instructions. A face is skipped if it is farther away than
//! everything that its rays have already hit.
//!
//! **Bit-identical results.** Each intersection is computed in the same way as by parry. Nevertheless, the tree's result can differ
//! from the nearest intersection: the tree skips a face whose bounding box begins after the best hit so far, and because of
//! rounding the box may begin after its own face, or miss the ray. The tree never skips a face whose box begins before the second
//! hit. In the other cases, which are rare, the sweep asks the tree. Rays that are almost parallel to a face are left to parry,
//! which treats them specially. Anything skipped by the sweep would be hit at least `CLEAR_M` after the nearest hit, which is
//! beyond the reach of rounding, since a hit is within the ends of its face.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

use nalgebra::Vector2;
use rapier2d::parry::bounding_volume::Aabb;
use rapier2d::parry::query::{Ray, RayCast};
use rapier2d::parry::shape::Segment as Line;
use rapier2d::prelude::{Real, Vector};
use sketchnav_schemas::message::MAX_BEAMS;

use super::{Block, Faces, Piece, distance, vector};

/// Generous bound on the combined error of an angle from [`angle`] and from single precision, in radians.
const SLACK_RAD: f64 = 2e-3;
/// Distance below which the directions of a face's ends are unreliable in single precision, in metres.
const TOUCHING_M: f64 = 0.02;

/// Distance after a hit, in metres, beyond which nothing can affect it.
const CLEAR_M: Real = 0.05;
/// Number of blocks of faces that are sorted by distance. Further blocks are visited in no particular order.
const SORTED_BLOCKS: usize = 256;

/// Number of rays that are intersected at once.
const LANES: usize = 8;
const _: () = assert!(MAX_BEAMS.is_multiple_of(LANES));

/// Rays from one point at equal angular distances. Entries beyond `count` point along x and are not used.
pub struct Rays {
    first_rad: f64,
    increment_rad: f64,
    count: usize,
    x: [Real; MAX_BEAMS],
    y: [Real; MAX_BEAMS],
    /// Squared lengths of the directions, which differ from 1 by rounding.
    squared: [Real; MAX_BEAMS],
}

/// For each ray, the two nearest intersections so far, and the face of the nearest one.
struct Hits {
    nearest: [Real; MAX_BEAMS],
    second: [Real; MAX_BEAMS],
    face: [u32; MAX_BEAMS],
}

/// A face as seen from the origin of the sweep, in parry's precision.
struct Seen<'a> {
    line: &'a Line,
    bounds: &'a Aabb,
    along: Vector,
    squared: Real,
    /// Vector from the beginning of the line to the origin of the sweep, and its scalar product with `along`.
    back: Vector,
    along_back: Real,
}

/// The intersection of the lines of a ray and a face.
struct Meeting {
    range: Real,
    share: Real,
    is_doubtful: bool,
}

impl Rays {
    /// Creates at most [`MAX_BEAMS`] rays from unit vectors. The first is at the angle `first_rad`, and the others follow
    /// counter-clockwise, each `increment_rad` (above 0) after the previous one, not more than once around.
    pub fn new(first_rad: f64, increment_rad: f64, directions: impl Iterator<Item = Vector2<f64>>) -> Self {
        let (x, y, squared) = ([1.0; MAX_BEAMS], [0.0; MAX_BEAMS], [1.0; MAX_BEAMS]);
        let mut rays = Self { first_rad, increment_rad, count: 0, x, y, squared };
        for (i, direction) in directions.take(MAX_BEAMS).map(vector).enumerate() {
            (rays.x[i], rays.y[i], rays.squared[i]) = (direction.x, direction.y, direction.length_squared());
            rays.count = i + 1;
        }
        rays
    }

    /// Returns the direction of ray `i`.
    pub fn direction(&self, i: usize) -> Vector2<f64> {
        Vector2::new(f64::from(self.x[i]), f64::from(self.y[i]))
    }

    /// Returns the rays that may hit anything in the span of `span_rad` counter-clockwise from `from_rad`, and a few more.
    pub fn between(&self, from_rad: f64, span_rad: f64) -> [Range<usize>; 3] {
        let margin = 1.0 + SLACK_RAD / self.increment_rad;
        let begin = turn(from_rad - self.first_rad - PI) + PI;
        [-TAU, 0.0, TAU].map(|turn| {
            let first = (begin + turn) / self.increment_rad - margin;
            let last = (begin + turn + span_rad) / self.increment_rad + margin;
            // The conversion turns a negative number into 0.
            (first as usize).min(self.count)..((last + 1.0) as usize).min(self.count)
        })
    }

    /// Returns the rays that may hit a disc, which are all rays if their origin is in or near it.
    pub fn towards_disc(&self, to_center: Vector2<f64>, radius_m: f64) -> [Range<usize>; 3] {
        let distance_m = to_center.norm();
        if distance_m < radius_m + TOUCHING_M {
            return self.all();
        }
        let half_rad = (radius_m / distance_m).asin();
        self.between(angle(to_center) - half_rad, 2.0 * half_rad)
    }

    fn towards_segment(&self, a: Vector2<f64>, b: Vector2<f64>) -> [Range<usize>; 3] {
        let along = b - a;
        let share = (-a.dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        if (a + along * share).norm_squared() < TOUCHING_M * TOUCHING_M {
            return self.all();
        }
        let (first, second) = (angle(a), angle(b));
        let turn = turn(second - first);
        if turn < 0.0 { self.between(second, -turn) } else { self.between(first, turn) }
    }

    fn towards_box(&self, bounds: &Aabb, from: Vector) -> [Range<usize>; 3] {
        if f64::from(distance(bounds, from)) < TOUCHING_M {
            return self.all();
        }
        let middle = angle(vector2(bounds.center() - from));
        let (mut right, mut left) = (0.0_f64, 0.0_f64);
        for (x, y) in
            [bounds.mins.x, bounds.maxs.x].into_iter().flat_map(|x| [(x, bounds.mins.y), (x, bounds.maxs.y)])
        {
            let turn = turn(angle(vector2(Vector::new(x, y) - from)) - middle);
            (right, left) = (right.min(turn), left.max(turn));
        }
        self.between(middle + right, left - right)
    }

    fn all(&self) -> [Range<usize>; 3] {
        [0..self.count, 0..0, 0..0]
    }

    fn ray(&self, from: Vector, i: usize) -> Ray {
        Ray::new(from, Vector::new(self.x[i], self.y[i]))
    }
}

impl Faces {
    /// Writes the distance to the nearest face along each ray from `from`, or +∞ if there is none within `max_m`.
    pub fn sweep(&self, from: Vector2<f64>, rays: &Rays, max_m: f64, ranges_m: &mut [Real]) {
        let (origin, max) = (vector(from), max_m as Real);
        // The tree skips whatever begins at the maximum range, just as it skips whatever begins after another hit.
        let second = [max; MAX_BEAMS];
        let mut hits = Hits { nearest: [Real::INFINITY; MAX_BEAMS], second, face: [0; MAX_BEAMS] };
        self.near_first(origin, max, |block, away| {
            let runs = rays.towards_box(&block.bounds, origin);
            if runs.into_iter().any(|run| hits.may_change(run, away)) {
                self.meet(block, rays, origin, max, &mut hits);
            }
        });
        for (i, range_m) in ranges_m.iter_mut().enumerate().take(rays.count) {
            *range_m = self.settled(&hits, i, &rays.ray(origin, i), max);
        }
    }

    /// Visits the blocks within range, near ones first, each with its distance.
    fn near_first(&self, origin: Vector, max: Real, mut visit: impl FnMut(&Block, Real)) {
        let mut sorted = [(0.0, 0); SORTED_BLOCKS];
        let mut count = 0;
        let away = |block: &Block| distance(&block.bounds, origin);
        let is_near = |away: Real| away <= max + CLEAR_M;
        let mut blocks = self.blocks.iter().enumerate();
        for (i, block) in blocks.by_ref() {
            let away = away(block);
            if is_near(away) {
                sorted[count] = (away, i);
                count += 1;
                if count == SORTED_BLOCKS {
                    break;
                }
            }
        }
        let sorted = &mut sorted[..count];
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        sorted.iter().for_each(|(away, i)| visit(&self.blocks[*i], *away));
        blocks
            .map(|(_, block)| (block, away(block)))
            .filter(|(_, away)| is_near(*away))
            .for_each(|(block, away)| visit(block, away));
    }

    fn meet(&self, block: &Block, rays: &Rays, origin: Vector, max: Real, hits: &mut Hits) {
        for i in block.pieces.clone() {
            let Piece { line, bounds, .. } = &self.pieces[i];
            let away = distance(bounds, origin);
            if away > max + CLEAR_M {
                continue;
            }
            let seen = Seen::new(line, bounds, origin);
            for run in rays.towards_segment(vector2(line.a - origin), vector2(line.b - origin)) {
                if hits.may_change(run.clone(), away) && seen.meet(rays, run.clone(), max, i as u32, hits) {
                    seen.ask_parry(rays, origin, run, max, i as u32, hits);
                }
            }
        }
    }

    /// Returns the nearest hit if the tree cannot have missed it, and the tree's result otherwise.
    fn settled(&self, hits: &Hits, i: usize, ray: &Ray, max: Real) -> Real {
        let nearest = hits.nearest[i];
        if nearest == Real::INFINITY {
            return nearest;
        }
        let bounds = &self.pieces[hits.face[i] as usize].bounds;
        match bounds.cast_local_ray(ray, max, true) {
            Some(begin) if begin < hits.second[i] => nearest,
            _ => self.tree.cast_local_ray(ray, max, true).unwrap_or(Real::INFINITY),
        }
    }
}

impl<'a> Seen<'a> {
    fn new(line: &'a Line, bounds: &'a Aabb, origin: Vector) -> Self {
        let (along, back) = (line.scaled_direction(), origin - line.a);
        let (squared, along_back) = (along.length_squared(), along.dot(back));
        Self { line, bounds, along, squared, back, along_back }
    }

    /// Ericson, *Real-Time Collision Detection* (2005), 5.1.9, with the operations in the same order as in parry.
    #[inline(always)]
    fn meeting(&self, x: Real, y: Real, squared: Real) -> Meeting {
        let c = x * self.back.x + y * self.back.y;
        let b = x * self.along.x + y * self.along.y;
        let both = squared * self.squared;
        let denominator = both - b * b;
        let range = (b * self.along_back - c * self.squared) / denominator;
        let share = (b * range + self.along_back) / self.squared;
        // This includes everything that parry may take for parallel, or for a point, and more.
        let is_doubtful = denominator <= both * 2e-6 + 4e-7;
        Meeting { range, share, is_doubtful }
    }

    /// Intersects a run of rays, and a few next to it, with the face. Returns true if some of them are doubtful and were left
    /// out.
    fn meet(&self, rays: &Rays, run: Range<usize>, max: Real, face: u32, hits: &mut Hits) -> bool {
        let lanes = run.start / LANES..run.end.div_ceil(LANES);
        let (x, y) = (&rays.x.as_chunks().0[lanes.clone()], &rays.y.as_chunks().0[lanes.clone()]);
        let squared = &rays.squared.as_chunks().0[lanes.clone()];
        let nearest = &mut hits.nearest.as_chunks_mut().0[lanes.clone()];
        let second = &mut hits.second.as_chunks_mut().0[lanes.clone()];
        let faces = &mut hits.face.as_chunks_mut().0[lanes];
        let mut is_doubtful = false;
        for (i, ((x, y), squared)) in x.iter().zip(y).zip(squared).enumerate() {
            let (range, doubtful) = self.ranges(x, y, squared, max);
            is_doubtful |= doubtful;
            put(&range, face, &mut nearest[i], &mut second[i], &mut faces[i]);
        }
        is_doubtful
    }

    /// Returns the ranges of some rays, +∞ for those without a hit, and whether any is doubtful. Written so that the compiler uses
    /// vector instructions.
    #[inline(always)]
    #[expect(clippy::manual_range_contains, reason = "a branch, which vector instructions do not have")]
    fn ranges(
        &self,
        x: &[Real; LANES],
        y: &[Real; LANES],
        squared: &[Real; LANES],
        max: Real,
    ) -> ([Real; LANES], bool) {
        let (mut ranges, mut doubtful) = ([0.0; LANES], [0_u32; LANES]);
        for i in 0..LANES {
            let Meeting { range, share, is_doubtful } = self.meeting(x[i], y[i], squared[i]);
            let is_hit = (range >= 0.0) & (range < max) & (share >= 0.0) & (share <= 1.0) & !is_doubtful;
            ranges[i] = if is_hit { range } else { Real::INFINITY };
            doubtful[i] = u32::from(is_doubtful);
        }
        (ranges, doubtful.iter().fold(0, |any, one| any | one) != 0)
    }

    #[cold]
    fn ask_parry(
        &self,
        rays: &Rays,
        origin: Vector,
        run: Range<usize>,
        max: Real,
        face: u32,
        hits: &mut Hits,
    ) {
        for i in run {
            if !self.meeting(rays.x[i], rays.y[i], rays.squared[i]).is_doubtful {
                continue;
            }
            let ray = rays.ray(origin, i);
            let in_box = self.bounds.cast_local_ray(&ray, max, true);
            let hit = in_box.and_then(|_| self.line.cast_local_ray(&ray, max, true));
            if let Some(range) = hit.filter(|range| *range < max) {
                hits.add(i, range, face);
            }
        }
    }
}

/// Merges new ranges of some rays into the two nearest intersections of each.
#[inline(always)]
fn put(
    range: &[Real; LANES],
    face: u32,
    nearest: &mut [Real; LANES],
    second: &mut [Real; LANES],
    faces: &mut [u32; LANES],
) {
    let (before, seconds, others) = (*nearest, *second, *faces);
    for i in 0..LANES {
        let is_nearer = range[i] < before[i];
        let other = if is_nearer { before[i] } else { range[i] };
        second[i] = if other < seconds[i] { other } else { seconds[i] };
        nearest[i] = if is_nearer { range[i] } else { before[i] };
        faces[i] = if is_nearer { face } else { others[i] };
    }
}

impl Hits {
    /// Returns true if something at this distance may affect the hits of some rays in the run.
    fn may_change(&self, run: Range<usize>, away: Real) -> bool {
        if run.is_empty() {
            return false;
        }
        // Non-negative floats have the same order as their bits, and compilers vectorize the comparison of integers.
        let bits = self.nearest[run].iter().fold(0, |most, hit| most.max(hit.to_bits() as i32));
        let farthest = Real::from_bits(bits as u32);
        away <= farthest + CLEAR_M
    }

    fn add(&mut self, i: usize, range: Real, face: u32) {
        let before = self.nearest[i];
        self.second[i] = self.second[i].min(before.max(range));
        if range < before {
            (self.nearest[i], self.face[i]) = (range, face);
        }
    }
}

/// Returns the angle of a vector, accurate to 1e-5 rad (Abramowitz and Stegun 1964, 4.4.49). Several times as fast as `atan2`.
fn angle(v: Vector2<f64>) -> f64 {
    let (x, y) = (v.x.abs(), v.y.abs());
    let tangent = x.min(y) / x.max(y).max(f64::MIN_POSITIVE);
    let t = tangent * tangent;
    let octant = tangent
        * (0.999_866_0 + t * (-0.330_299_5 + t * (0.180_141_0 + t * (-0.085_133_0 + t * 0.020_835_1))));
    let quadrant = if y > x { FRAC_PI_2 - octant } else { octant };
    let half = if v.x < 0.0 { PI - quadrant } else { quadrant };
    if v.y < 0.0 { -half } else { half }
}

/// Returns the equivalent angle in [−π, π). `wrap_angle` includes the other end of the interval instead, which would make the first
/// bearing of a scan its last.
fn turn(angle_rad: f64) -> f64 {
    // `rem_euclid` takes several times as long.
    angle_rad - TAU * ((angle_rad + PI) / TAU).floor()
}

fn vector2(v: Vector) -> Vector2<f64> {
    Vector2::new(f64::from(v.x), f64::from(v.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convex::{Convex, Segment};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// Generates boxes, some of them rotated and many with faces in line, as well as short faces and single lines.
    fn faces() -> impl Strategy<Value = Vec<Segment>> {
        let grid = || (-12..12_i32).prop_map(|v| f64::from(v) * 0.5);
        let place = move || (grid(), grid()).prop_map(|(x, y)| [x, y]);
        let size = (1..5_i32, 1..5_i32).prop_map(|(w, h)| [f64::from(w) * 0.5, f64::from(h) * 0.15]);
        let yaw = prop_oneof![3 => Just(0.0), 1 => -3.0..3.0];
        let solid = (place(), size, yaw)
            .prop_map(|(center, size, yaw)| Convex::rectangle(center, size, yaw).edges().collect::<Vec<_>>());
        let disc = (place(), 1e-4..0.6).prop_map(|(at, radius)| Convex::disc(at, radius).edges().collect());
        let line = (place(), place()).prop_map(|(a, b)| vec![[a, b]]);
        let pieces = prop::collection::vec(prop_oneof![4 => solid, 1 => disc, 1 => line], 1..14);
        pieces.prop_map(|pieces| pieces.concat())
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 20_000, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// The rays start anywhere, including on a face or a corner, and may run along faces.
        #[test]
        fn a_sweep_equals_the_tree_bit_by_bit(
            faces in faces(),
            at in prop_oneof![(-6.0..6.0, -6.0..6.0), ((-12..12_i32).prop_map(|v| f64::from(v) * 0.25), (-12..12_i32).prop_map(|v| f64::from(v) * 0.25))],
            yaw in prop_oneof![-3.2..3.2, (0..8_i32).prop_map(|v| f64::from(v) * std::f64::consts::FRAC_PI_4)],
            field in prop_oneof![Just(TAU), 0.2..TAU],
            count in 2..400_usize,
        ) {
            let (faces, from) = (Faces::new(faces), Vector2::new(at.0, at.1));
            let increment = field / count as f64;
            let direction = |i: usize| -> Vector2<f64> {
                let angle: f64 = yaw + i as f64 * increment;
                Vector2::new(angle.cos(), angle.sin())
            };
            let rays = Rays::new(yaw, increment, (0..count).map(direction));
            let mut swept = vec![0.0; count];
            faces.sweep(from, &rays, 7.0, &mut swept);
            for (i, swept) in swept.iter().enumerate() {
                let expected = faces.cast(from, direction(i), 7.0).map_or(Real::INFINITY, |range| range as Real);
                prop_assert_eq!(swept.to_bits(), expected.to_bits(), "ray {}: {} {}", i, swept, expected);
            }
        }
    }

    /// The tree skips a face whose box begins at the maximum range, although the face itself is hit slightly before it. The
    /// sweep once reported that hit.
    #[test]
    fn a_face_at_the_maximum_range_is_omitted_as_by_the_tree() {
        let faces = Faces::new(Convex::rectangle([4.0, 5.0], [0.5, 0.15], 0.0).edges().collect());
        let (from, increment) = (Vector2::new(0.25, -1.0), TAU / 186.0);
        let directions = (0..186)
            .map(|i| Vector2::new((f64::from(i) * increment).cos(), (f64::from(i) * increment).sin()));
        let mut swept = [0.0; 186];
        faces.sweep(from, &Rays::new(0.0, increment, directions.clone()), 7.0, &mut swept);
        let expected = directions.map(|direction| faces.cast(from, direction, 7.0));
        for (swept, expected) in swept.into_iter().zip(expected) {
            assert_eq!(f64::from(swept), expected.unwrap_or(f64::INFINITY));
        }
    }

    #[test]
    fn the_approximate_angle_errs_by_less_than_a_hundred_thousandth() {
        for i in -3141..3141 {
            let exact = f64::from(i) / 1000.0;
            let found = angle(Vector2::new(exact.cos(), exact.sin()) * 3.0);
            assert!((found - exact).abs() < 1.2e-5, "{exact} {found}");
        }
        assert_eq!(angle(Vector2::zeros()), 0.0);
    }
}
