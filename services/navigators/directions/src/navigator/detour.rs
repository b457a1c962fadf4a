//! Steers a robot on land around the landmarks in its path.
//!
//! The robot drives either straight towards its destination or along the tangent to a circle around a landmark, whichever free
//! direction is closest to that of the destination.

use crate::geometry::Point;

/// Distance over which a direction must be free, as a multiple of the clearance.
const AHEAD: f64 = 4.0;
/// Angle between the driven direction and the tangent to the circle, in radians.
const BESIDE_RAD: f64 = 0.02;

/// Returns the direction to take as a vector of length 1, or `None` if all directions are blocked.
pub fn direction(displacement: Point, view: &[Point], clearance: f64) -> Option<Point> {
    let length = displacement.norm().min(AHEAD * clearance);
    let straight = displacement.direction()?;
    let is_free = |way: Point| view.iter().all(|&place| !bars(way, length, place, clearance));
    if is_free(straight) {
        return Some(straight);
    }
    let near = view.iter().filter(|place| place.norm() <= length + clearance);
    let ways = near.flat_map(|&place| tangents(place, clearance)).filter(|&way| is_free(way));
    ways.max_by(|a, b| a.dot(straight).total_cmp(&b.dot(straight)))
}

/// Returns true if a landmark blocks a direction over this length. If the robot is already too close to the landmark, only
/// directions towards it are blocked.
fn bars(way: Point, length: f64, place: Point, clearance: f64) -> bool {
    let along = place.dot(way);
    if along <= 0.0 {
        return false;
    }
    let nearest = way * along.min(length);
    (place - nearest).norm() < clearance
}

/// Returns the two directions past a landmark. If the robot is too close to it, both lead slightly away from it.
fn tangents(place: Point, clearance: f64) -> impl Iterator<Item = Point> {
    let towards = place.direction();
    let distance = place.norm();
    let angle = if distance > clearance {
        (clearance / distance).asin() + BESIDE_RAD
    } else {
        std::f64::consts::FRAC_PI_2 + BESIDE_RAD
    };
    towards.into_iter().flat_map(move |towards| [towards.turned(angle), towards.turned(-angle)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::config;

    #[test]
    fn it_drives_straight_where_the_way_is_free_and_past_the_nearer_side_where_not() {
        let goal = Point::new(5.0, 0.0);
        assert_eq!(
            direction(goal, &[Point::new(1.0, 0.6), Point::new(-0.3, 0.0)], 0.5),
            Some(Point::new(1.0, 0.0))
        );
        let past = direction(goal, &[Point::new(1.0, 0.1)], 0.5).unwrap();
        assert!(past.y < 0.0 && past.x > 0.8, "{past:?}");
        // A second landmark blocks that side.
        let other = direction(goal, &[Point::new(1.0, 0.1), Point::new(1.0, -0.8)], 0.5).unwrap();
        assert!(other.y > 0.0, "{other:?}");
    }

    #[test]
    fn a_landmark_behind_the_goal_bars_nothing() {
        assert_eq!(direction(Point::new(1.0, 0.0), &[Point::new(1.9, 0.0)], 0.5), Some(Point::new(1.0, 0.0)));
    }

    proptest! {
        #![proptest_config(config(64))]

        /// The robot reaches any free position and keeps its clearance, however the landmarks are arranged.
        #[test]
        fn it_arrives_and_keeps_its_distance(
            places in prop::collection::vec((-4.0..4.0_f64, -4.0..4.0_f64), 0..9),
        ) {
            const CLEARANCE: f64 = 0.5;
            let (from, goal) = (Point::new(-6.0, 0.0), Point::new(6.0, 0.3));
            let mut landmarks: Vec<Point> = Vec::new();
            for (x, y) in places {
                let place = Point::new(x, y);
                if landmarks.iter().all(|other| (*other - place).norm() > 2.2 * CLEARANCE) {
                    landmarks.push(place);
                }
            }
            let mut at = from;
            for _ in 0..2000 {
                if (goal - at).norm() < 0.1 {
                    return Ok(());
                }
                let view: Vec<_> = landmarks.iter().map(|&place| place - at).collect();
                let way = direction(goal - at, &view, CLEARANCE);
                prop_assert!(way.is_some(), "barred at {:?} {:?}", at, landmarks);
                at = at + way.unwrap() * 0.02;
                for &place in &landmarks {
                    prop_assert!((place - at).norm() > CLEARANCE - 0.05, "{:?} {:?}", at, place);
                }
            }
            prop_assert!(false, "never arrives: {:?}", landmarks);
        }
    }
}
