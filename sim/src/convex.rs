//! Convex solids, which furniture and walls are built from. Coordinates are in metres, in frame `World`.

use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};
pub use sketchnav_schemas::floor_plan::Segment;

/// Number of corners of the polygon that approximates a disc. Its sagitta is half a percent of the radius.
const DISC_CORNERS: u32 = 32;

/// A convex polygon with its corners in counter-clockwise order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Convex {
    corners: Vec<[f64; 2]>,
}

impl Convex {
    /// Creates a box of `size` (length, width) around `center`, with its length rotated to `yaw_rad`.
    pub fn rectangle(center: [f64; 2], size: [f64; 2], yaw_rad: f64) -> Self {
        let (turn, half) = (Rotation2::new(yaw_rad), Vector2::from(size) / 2.0);
        let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(x, y)| (Vector2::from(center) + turn * Vector2::new(x * half.x, y * half.y)).into();
        Self { corners: signs.map(corner).to_vec() }
    }

    /// Creates a disc, which is approximated by an inscribed regular polygon.
    pub fn disc(center: [f64; 2], radius_m: f64) -> Self {
        let corner = |i| {
            let angle = f64::from(i) * std::f64::consts::TAU / f64::from(DISC_CORNERS);
            [center[0] + radius_m * angle.cos(), center[1] + radius_m * angle.sin()]
        };
        Self { corners: (0..DISC_CORNERS).map(corner).collect() }
    }

    /// Creates a polygon through `corners`, given in either direction, or returns `None` if they do not form a convex polygon.
    pub fn polygon(corners: &[[f64; 2]]) -> Option<Self> {
        let mut corners = corners.to_vec();
        if signed_area(&corners) < 0.0 {
            corners.reverse();
        }
        let polygon = Self { corners };
        polygon.is_convex().then_some(polygon)
    }

    /// Returns the corners in counter-clockwise order, in metres.
    pub fn corners(&self) -> &[[f64; 2]] {
        &self.corners
    }

    /// Returns the edges in order.
    pub fn edges(&self) -> impl Iterator<Item = Segment> + Clone + '_ {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(a, b)| [*a, *b])
    }

    /// Returns true if a point is inside. A point on an edge is not.
    pub fn contains(&self, place: [f64; 2]) -> bool {
        let to = |a: [f64; 2]| Vector2::from(place) - Vector2::from(a);
        self.edges().all(|[a, b]| (Vector2::from(b) - Vector2::from(a)).perp(&to(a)) > 0.0)
    }

    /// Returns true if every corner turns left and all corners together make one turn. A star would make more.
    fn is_convex(&self) -> bool {
        let after = self.edges().cycle().skip(1);
        let turns: Vec<_> =
            self.edges().zip(after).take(self.corners.len()).map(|(e, f)| turn(e, f)).collect();
        let once = (turns.iter().sum::<f64>() - std::f64::consts::TAU).abs() < 1e-6;
        self.corners.len() >= 3 && turns.iter().all(|t| *t > 0.0) && once
    }
}

fn turn(e: Segment, f: Segment) -> f64 {
    let direction = |[a, b]: Segment| Vector2::from(b) - Vector2::from(a);
    let (u, v) = (direction(e), direction(f));
    u.perp(&v).atan2(u.dot(&v))
}

fn signed_area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_may_be_given_in_either_direction() {
        let left = Convex::polygon(&[[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]).unwrap();
        let right = Convex::polygon(&[[0.0, 1.0], [2.0, 0.0], [0.0, 0.0]]).unwrap();
        assert!(signed_area(left.corners()) > 0.0 && signed_area(right.corners()) > 0.0);
    }

    #[test]
    fn a_concave_polygon_is_refused() {
        let dent = [[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]];
        let star: Vec<_> = (0..5).map(|i| (f64::from(i) * 144.0).to_radians().sin_cos().into()).collect();
        for corners in [&dent[..], &star, &[[0.0, 0.0], [1.0, 0.0]], &[]] {
            assert_eq!(Convex::polygon(corners), None);
        }
    }

    #[test]
    fn a_box_has_its_size() {
        let turned = Convex::rectangle([1.0, 2.0], [3.0, 0.5], 0.7);
        assert!((signed_area(turned.corners()) - 1.5).abs() < 1e-12);
        assert!(turned.is_convex());
    }
}
