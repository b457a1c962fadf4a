//! Determines which landmarks a robot on land sees: those within its range that no others hide (Park and Kender 1995, 8).
//!
//! A landmark counts as seen only if its whole width is in sight, because an object that is partly hidden by a nearer edge cannot
//! be identified ([`crate::pillars`]). Walls hide landmarks too.

use crate::geometry::{Land, Point};
use crate::walls::Walls;

/// Minimum angle between a landmark's edges and anything nearer, in radians. At least one beam of the laser has to pass between
/// them. The beams of most lasers are 0.25° to 0.5° apart.
const CLEAR_RAD: f64 = 0.009;

/// Half of the angle that a cylinder subtends at the eye, in radians.
pub fn half_angle_rad(radius: f64, distance: f64) -> f64 {
    (radius / distance.max(radius)).asin()
}

/// A viewpoint among walls.
#[derive(Debug, Clone, Copy)]
pub struct Eye<'a> {
    /// The position of the eye.
    pub at: Point,
    /// The walls that can hide landmarks.
    pub walls: &'a Walls,
}

/// Returns true if a landmark is visible from the eye, given all other landmarks. All positions are relative to the eye.
pub fn is_seen(land: Land, eye: Eye<'_>, landmark: Point, mut others: impl Iterator<Item = Point>) -> bool {
    let distance = landmark.norm();
    if distance > land.range {
        return false;
    }
    let half = half_angle_rad(land.radius, distance) + CLEAR_RAD;
    let hides = |other: Point| {
        other.norm() < distance
            && bearing_rad(landmark, other).abs() < half + half_angle_rad(land.radius, other.norm())
    };
    !others.any(hides) && !eye.walls.hide(eye.at, landmark, half)
}

/// Returns the angle from the direction of one point to that of another, counter-clockwise, in radians.
pub(crate) fn bearing_rad(from: Point, to: Point) -> f64 {
    (from.x * to.y - from.y * to.x).atan2(from.dot(to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walls::Body;

    const LAND: Land = Land { radius: 0.15, range: 8.0, stand_off: 0.9, clearance: 0.5 };

    #[test]
    fn what_is_far_or_behind_another_is_not_seen() {
        let seen = |x, y, others: &[(f64, f64)]| {
            let eye = Eye { at: Point::default(), walls: &Walls::default() };
            is_seen(LAND, eye, Point::new(x, y), others.iter().map(|&(x, y)| Point::new(x, y)))
        };
        assert!(seen(7.9, 0.0, &[]) && !seen(8.1, 0.0, &[]));
        assert!(!seen(5.0, 0.0, &[(2.0, 0.0)]), "right behind");
        assert!(seen(2.0, 0.0, &[(5.0, 0.0)]), "in front of it");
        assert!(seen(5.0, 0.0, &[(-2.0, 0.0)]), "on the other side");
        // The nearer landmark, at 2 m, extends 0.075 rad to each side. The other one, at 5 m, extends 0.03 rad and needs a gap of
        // 0.009 rad.
        assert!(seen(5.0, 0.0, &[(2.0, 0.24)]) && !seen(5.0, 0.0, &[(2.0, 0.22)]));
        assert!(!seen(5.0, 0.0, &[(2.0, 0.18), (2.0, -0.18)]), "a slit between two");
    }

    #[test]
    fn what_is_behind_a_wall_or_close_before_it_is_not_seen() {
        let body = Body { radius: 0.2, keeps: 0.35, merges: 0.4 };
        let seen = |landmark: (f64, f64), wall: [(f64, f64); 2]| {
            let walls = Walls::new([wall.map(|(x, y)| Point::new(x + 10.0, y - 3.0))], 0.1, body);
            let eye = Eye { at: Point::new(10.0, -3.0), walls: &walls };
            is_seen(LAND, eye, Point::new(landmark.0, landmark.1), std::iter::empty())
        };
        assert!(!seen((5.0, 0.0), [(3.0, -2.0), (3.0, 2.0)]), "behind it");
        assert!(seen((5.0, 0.0), [(3.0, 0.5), (3.0, 2.0)]), "beside its end");
        assert!(
            seen((5.0, 0.0), [(3.0, 0.13), (3.0, 2.0)]) && !seen((5.0, 0.0), [(3.0, 0.1), (3.0, 2.0)]),
            "partly"
        );
        assert!(seen((5.0, 0.0), [(-3.0, -2.0), (-3.0, 2.0)]) && seen((5.0, 0.0), [(-1.0, 0.5), (9.0, 0.6)]));
        assert!(seen((5.0, 0.0), [(5.6, -2.0), (5.6, 2.0)]), "in front of it");
        assert!(!seen((5.0, 0.0), [(5.3, -2.0), (5.3, 2.0)]), "one thing with it, to a laser");
    }
}
