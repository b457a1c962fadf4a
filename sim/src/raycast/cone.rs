//! Finds the exact nearest point in a cone. Each face is clipped at the two edges of the cone, and the rest
//! has one nearest point. Nothing can hide this point, because anything that hid it would itself be nearer
//! and in the cone.

use nalgebra::{Rotation2, Vector2};

use super::Faces;
use crate::convex::Segment;

/// A cone, in coordinates relative to its apex and axis.
#[derive(Debug, Clone, Copy)]
pub struct Cone {
    apex: Vector2<f64>,
    /// Rotation that turns the cone's axis into the x axis.
    from_world: Rotation2<f64>,
    half_rad: f64,
    /// Direction of the upper edge, as a unit vector.
    edge: Vector2<f64>,
}

impl Cone {
    /// Creates a cone from `apex` (in metres, frame `World`) along `axis_rad`, with the half-angle `half_rad` (below π/2).
    pub fn new(apex: Vector2<f64>, axis_rad: f64, half_rad: f64) -> Self {
        let edge = Vector2::new(half_rad.cos(), half_rad.sin());
        Self { apex, from_world: Rotation2::new(-axis_rad), half_rad, edge }
    }

    /// Returns the distance from the apex to the nearest point of `faces` and `discs` in the cone, in metres, or +∞ if there is
    /// none within `max_m`.
    pub fn nearest(&self, faces: &Faces, discs: &[([f64; 2], f64)], max_m: f64) -> f64 {
        let of_faces = faces.near(self.apex, max_m).filter_map(|face| self.segment(face));
        let of_discs = discs.iter().filter_map(|(center, radius_m)| self.disc((*center).into(), *radius_m));
        let nearest = of_faces.chain(of_discs).fold(f64::INFINITY, f64::min);
        if nearest <= max_m { nearest } else { f64::INFINITY }
    }

    fn local(&self, point: Vector2<f64>) -> Vector2<f64> {
        self.from_world * (point - self.apex)
    }

    /// Returns the distances of a point from the upper and the lower edge, both of which are positive inside the cone.
    fn inside(&self, p: Vector2<f64>) -> [f64; 2] {
        let (cos, sin) = (self.edge.x, self.edge.y);
        [sin * p.x - cos * p.y, sin * p.x + cos * p.y]
    }

    fn segment(&self, [a, b]: &Segment) -> Option<f64> {
        let (a, b) = (self.local((*a).into()), self.local((*b).into()));
        let (from_a, from_b) = (self.inside(a), self.inside(b));
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for (a, b) in from_a.into_iter().zip(from_b) {
            match (a >= 0.0, b >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (true, false) => last = last.min(a / (a - b)),
                (false, true) => first = first.max(a / (a - b)),
            }
        }
        let along = b - a;
        let foot = -a.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        (first <= last).then(|| (a + along * foot.clamp(first, last)).norm())
    }

    /// Returns the distance to a disc, if it is in the cone. Its nearest point lies on the ray of the cone that comes nearest
    /// to its centre.
    fn disc(&self, center: Vector2<f64>, radius_m: f64) -> Option<f64> {
        let to_center = self.local(center);
        let distance_m = to_center.norm();
        if distance_m <= radius_m {
            return Some(0.0);
        }
        let bearing = to_center.y.atan2(to_center.x);
        let aside = (bearing - bearing.clamp(-self.half_rad, self.half_rad)).abs();
        let half_chord = (radius_m.powi(2) - (distance_m * aside.sin()).powi(2)).sqrt();
        (aside < std::f64::consts::FRAC_PI_2 && half_chord.is_finite())
            .then(|| distance_m * aside.cos() - half_chord)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use crate::raycast::cast_disc;

    const MAX_M: f64 = 6.0;

    /// Returns the minimum range in a fan of rays.
    fn by_a_fan(faces: &Faces, discs: &[([f64; 2], f64)], at: Vector2<f64>, axis: f64, half: f64) -> f64 {
        let rays = 2000;
        let ray = |i: i32| {
            let angle = axis - half + 2.0 * half * f64::from(i) / f64::from(rays);
            let direction = Vector2::new(angle.cos(), angle.sin());
            let disc = |(center, radius): &([f64; 2], f64)| {
                cast_disc((*center).into(), *radius, at, direction, MAX_M)
            };
            let of_discs = discs.iter().filter_map(disc).fold(f64::INFINITY, f64::min);
            faces.cast(at, direction, MAX_M).unwrap_or(f64::INFINITY).min(of_discs)
        };
        (0..=rays).map(ray).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 300, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn a_cone_measures_the_nearest_of_many_rays(
            lines in prop::collection::vec(prop::array::uniform4(-5.0..5.0), 0..8),
            discs in prop::collection::vec(([-5.0..5.0, -5.0..5.0], 0.1..0.5), 0..3),
            axis in -3.2..3.2,
            half in 0.02..0.7,
        ) {
            let segments: Vec<_> = lines.iter().map(|[a, b, c, d]| [[*a, *b], [*c, *d]]).collect();
            // If the end of a line lies between two rays, the fan misses it and only the cone sees it.
            let faces = Faces::new(segments);
            let found = Cone::new(Vector2::zeros(), axis, half).nearest(&faces, &discs, MAX_M);
            let inner = by_a_fan(&faces, &discs, Vector2::zeros(), axis, half);
            let outer = by_a_fan(&faces, &discs, Vector2::zeros(), axis, half + 1e-3);
            prop_assert!(found <= inner + 5e-3, "{} {}", found, inner);
            prop_assert!(found >= outer - 0.03 || found >= outer * 0.99, "{} {}", found, outer);
        }
    }

    #[test]
    fn the_edge_of_the_cone_meets_an_oblique_wall_first() {
        let wall = Faces::new(vec![[[2.0, -9.0], [2.0, 9.0]]]);
        let nearest = |axis: f64| Cone::new(Vector2::zeros(), axis, 0.2).nearest(&wall, &[], MAX_M);
        assert!((nearest(0.1) - 2.0).abs() < 1e-12, "the foot lies in the cone");
        assert!((nearest(0.7) - 2.0 / 0.5_f64.cos()).abs() < 1e-12);
        assert_eq!((nearest(1.6), nearest(3.0)), (f64::INFINITY, f64::INFINITY));
    }
}
