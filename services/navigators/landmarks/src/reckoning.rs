//! Dead reckoning: the pose of the robot according to its odometry, relative to its start.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Odom, Point};

/// The robot's pose by odometry, and the distance that it has covered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reckoning {
    /// Position relative to the start.
    pub at: Point<Odom>,
    /// Heading, in radians, not wrapped to a full turn.
    pub heading_rad: f64,
    /// Distance covered, in metres.
    pub gone_m: f64,
}

impl Default for Reckoning {
    fn default() -> Self {
        Self { at: Point::new(0.0, 0.0), heading_rad: 0.0, gone_m: 0.0 }
    }
}

impl Reckoning {
    /// Moves the robot by a distance in metres and an angle in radians, positive to the left.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        let (sin, cos) = (self.heading_rad + turned_rad / 2.0).sin_cos();
        self.at = Point::new(self.at.x + moved_m * cos, self.at.y + moved_m * sin);
        self.heading_rad += turned_rad;
        self.gone_m += moved_m.abs();
    }

    /// Converts a position from the robot's frame to the odometry frame.
    pub fn odom_from_base(&self, seen: Point<Base>) -> Point<Odom> {
        let (sin, cos) = self.heading_rad.sin_cos();
        Point::new(self.at.x + seen.x * cos - seen.y * sin, self.at.y + seen.x * sin + seen.y * cos)
    }

    /// Converts a position from the odometry frame to the robot's frame.
    pub fn base_from_odom(&self, place: Point<Odom>) -> Point<Base> {
        let (sin, cos) = self.heading_rad.sin_cos();
        let [x, y] = [place.x - self.at.x, place.y - self.at.y];
        Point::new(x * cos + y * sin, y * cos - x * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_leads_back_to_where_it_began() {
        let mut robot = Reckoning::default();
        for _ in 0..4 {
            robot.moved(2.0, 0.0);
            robot.moved(0.0, std::f64::consts::FRAC_PI_2);
        }
        assert!(robot.at.distance(&Point::new(0.0, 0.0)) < 1e-9 && robot.gone_m == 8.0, "{robot:?}");
        robot.moved(1.0, 0.0);
        let ahead = robot.odom_from_base(Point::new(1.0, 0.5));
        assert!(ahead.distance(&Point::new(2.0, 0.5)) < 1e-9, "{ahead:?}");
        assert!(robot.base_from_odom(ahead).distance(&Point::new(1.0, 0.5)) < 1e-9);
    }
}
