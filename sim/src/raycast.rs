//! Finds the first hit of a ray. Parry casts rays against the faces of everything static, which are in one
//! bounding volume tree, and against moving discs. Coordinates are in metres, in frame `World`.
//!
//! Rapier's own query pipeline goes through its colliders one solid at a time and takes two to three times as long for the same
//! rays (`benches/world.rs` measures both). Although parry computes in single precision, a range is accurate to two millimetres
//! even if a ray grazes a wall. [`sweep`] casts a whole scan at once, with bit-identical results, and [`cone`] finds the nearest
//! point in a cone.

pub mod cone;
pub mod sweep;

use std::ops::Range;

use nalgebra::Vector2;
use rapier2d::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier2d::parry::query::{Ray, RayCast};
use rapier2d::parry::shape::{Ball, Polyline, Segment as Line};
use rapier2d::prelude::{Real, Vector};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::convex::Segment;

/// Length by which faces extend beyond their ends, in metres, because parry lets a ray through exactly where two faces meet.
const OVERLAP_M: f64 = 2e-5;

/// Side length of the squares that group neighbouring faces, in metres.
const BLOCK_M: f64 = 2.0;

/// The faces of everything static.
#[derive(Clone)]
pub struct Faces {
    segments: Vec<Segment>,
    tree: Polyline,
    /// The segments again, grouped by block.
    pieces: Vec<Piece>,
    blocks: Vec<Block>,
}

#[derive(Clone)]
struct Piece {
    segment: Segment,
    line: Line,
    bounds: Aabb,
}

/// A group of neighbouring faces, or a single long face.
#[derive(Clone)]
struct Block {
    bounds: Aabb,
    pieces: Range<usize>,
}

impl Faces {
    /// Builds the tree of `segments`.
    pub fn new(segments: Vec<Segment>) -> Self {
        let vertices: Vec<_> = segments.iter().flat_map(lengthened).map(vector).collect();
        let lines = vertices.chunks_exact(2).map(|ends| Line::new(ends[0], ends[1]));
        let mut pieces: Vec<_> = lines
            .zip(&segments)
            .map(|(line, segment)| Piece { segment: *segment, line, bounds: line.local_aabb() })
            .collect();
        let blocks = blocks(&mut pieces);
        let indices = (0..segments.len() as u32).map(|i| [2 * i, 2 * i + 1]).collect();
        Self { tree: Polyline::new(vertices, Some(indices)), segments, pieces, blocks }
    }

    /// Returns the distance where a ray from `from` along `direction` (a unit vector) hits a face, or `None` if it hits none within
    /// `max_m`.
    pub fn cast(&self, from: Vector2<f64>, direction: Vector2<f64>, max_m: f64) -> Option<f64> {
        let ray = Ray::new(vector(from), vector(direction));
        self.tree.cast_local_ray(&ray, max_m as Real, true).map(f64::from)
    }

    /// Returns the faces whose bounding boxes come within `reach_m` of a point, and possibly more.
    fn near(&self, at: Vector2<f64>, reach_m: f64) -> impl Iterator<Item = &Segment> {
        let (at, reach) = (vector(at), reach_m as Real);
        let is_near = move |bounds: &Aabb| distance(bounds, at) <= reach;
        let blocks = self.blocks.iter().filter(move |block| is_near(&block.bounds));
        let pieces = blocks.flat_map(|block| &self.pieces[block.pieces.clone()]);
        pieces.filter(move |piece| is_near(&piece.bounds)).map(|piece| &piece.segment)
    }
}

/// Sorts the pieces by block. Returns the blocks.
fn blocks(pieces: &mut [Piece]) -> Vec<Block> {
    let long = |piece: &Piece| f64::from(piece.line.length()) > BLOCK_M;
    let cell = |v: Real| (f64::from(v) / BLOCK_M).floor() as i64;
    let square = |piece: &Piece| {
        let middle = piece.bounds.center();
        (long(piece), cell(middle.y), cell(middle.x))
    };
    pieces.sort_by_key(square);
    let runs = pieces.chunk_by(|a, b| !long(a) && square(a) == square(b));
    let mut blocks = Vec::new();
    for run in runs {
        let first = blocks.last().map_or(0, |block: &Block| block.pieces.end);
        let bounds = run.iter().skip(1).fold(run[0].bounds, |bounds, piece| bounds.merged(&piece.bounds));
        blocks.push(Block { bounds, pieces: first..first + run.len() });
    }
    blocks
}

/// Only the segments are stored, because the tree can be rebuilt from them.
impl Serialize for Faces {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.segments.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Faces {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(Self::new)
    }
}

/// Returns the distance from a point to a box, which is 0 inside.
fn distance(bounds: &Aabb, at: Vector) -> Real {
    let outside = |low: Real, high: Real, v: Real| (low - v).max(v - high).max(0.0);
    let (x, y) = (outside(bounds.mins.x, bounds.maxs.x, at.x), outside(bounds.mins.y, bounds.maxs.y, at.y));
    (x * x + y * y).sqrt()
}

/// Returns both ends of a face, moved apart by [`OVERLAP_M`].
fn lengthened([a, b]: &Segment) -> [Vector2<f64>; 2] {
    let (a, b) = (Vector2::from(*a), Vector2::from(*b));
    let hair = (b - a).cap_magnitude(OVERLAP_M);
    [a - hair, b + hair]
}

/// Returns the distance to a disc along a ray, or `None` if the ray does not hit it within `max_m`. The distance is 0 if the ray
/// starts inside the disc.
pub fn cast_disc(
    center: Vector2<f64>,
    radius_m: f64,
    from: Vector2<f64>,
    direction: Vector2<f64>,
    max_m: f64,
) -> Option<f64> {
    let ray = Ray::new(vector(from - center), vector(direction));
    Ball::new(radius_m as Real).cast_local_ray(&ray, max_m as Real, true).map(f64::from)
}

fn vector(v: Vector2<f64>) -> Vector {
    Vector::new(v.x as Real, v.y as Real)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    const CORNERS: [[f64; 2]; 4] = [[-2.5, -2.5], [2.5, -2.5], [2.5, 2.5], [-2.5, 2.5]];

    fn room() -> Faces {
        let walls: Vec<_> = (0..4).map(|i| [CORNERS[i], CORNERS[(i + 1) % 4]]).collect();
        Faces::new(walls)
    }

    fn distance_to_walls(at: Vector2<f64>, direction: Vector2<f64>) -> f64 {
        let to_wall = |axis: usize| (2.5 * direction[axis].signum() - at[axis]) / direction[axis];
        to_wall(0).min(to_wall(1))
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 5000, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]
        /// This holds even for rays straight into a corner, where two walls meet at one point.
        #[test]
        fn no_ray_escapes_a_closed_room(x in -2.4..2.4, y in -2.4..2.4, corner in 0..4_usize, off in -1e-6..1e-6) {
            let from = Vector2::new(x, y);
            for aside in [0.0, off, 1e3 * off, 1e6 * off] {
                let to_corner = Vector2::from(CORNERS[corner]) - from;
                let direction = (to_corner + Vector2::new(-to_corner.y, to_corner.x) * aside).normalize();
                let range = room().cast(from, direction, 20.0);
                let expected = distance_to_walls(from, direction);
                prop_assert!(range.is_some_and(|r| (r - expected).abs() < 2e-3), "{range:?} {expected}");
            }
        }

        #[test]
        fn rays_along_the_axes_hit_walls_along_the_axes(x in -2.4..2.4, y in -2.4..2.4) {
            let from = Vector2::new(x, y);
            for direction in [Vector2::x(), -Vector2::x(), Vector2::y(), -Vector2::y()] {
                let to_wall = if direction.x == 0.0 { 2.5 - y * direction.y } else { 2.5 - x * direction.x };
                let range = room().cast(from, direction, 9.0);
                prop_assert!(range.is_some_and(|r| (r - to_wall).abs() < 1e-5), "{range:?} {to_wall}");
            }
        }
    }

    #[test]
    fn nothing_is_hit_beyond_the_range() {
        assert_eq!(room().cast(Vector2::zeros(), Vector2::x(), 2.4), None);
    }

    #[test]
    fn rays_hit_discs_from_outside_and_at_once_from_inside() {
        let cast = |x: f64, y: f64| cast_disc(Vector2::new(x, y), 1.0, Vector2::zeros(), Vector2::x(), 9.0);
        assert_eq!(cast(3.0, 0.0), Some(2.0));
        assert_eq!((cast(-3.0, 0.0), cast(3.0, 1.5), cast(11.0, 0.0)), (None, None, None));
        assert_eq!(cast(0.5, 0.0), Some(0.0));
    }
}
