//! Places at which the robot was sure of its pose in the drawing. When its odometry shows that it is back at such a place, it
//! returns to the estimate that it had there, whatever it has come to believe on the way.
//!
//! The first place is the start, where a person has put the robot.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::wrap_angle;

use crate::belief::Estimate;
use crate::drawn::DrawnMetres;
use crate::error::Error;
use crate::numbers;
use crate::reckoning::Reckoning;

/// Maximum number of places that are remembered.
const PLACES: usize = 64;
/// The robot is back at a place if it is within this distance of it, and turned within this angle of its heading there.
const BACK_M: f64 = 0.4;
const BACK_RAD: f64 = 0.4;
/// Minimum distance that the robot must cover after it was at a place before it can be back there, in metres.
const AWAY_M: f64 = 3.0;

/// Parameters that determine where the robot is sure of its pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Assuring {
    /// Minimum fit of the observations.
    pub fit: f64,
    /// Maximum spread of the hypotheses.
    pub spread_m: DrawnMetres,
    /// Minimum distance between two such places along the robot's path, in metres.
    pub apart_m: f64,
}

impl Default for Assuring {
    fn default() -> Self {
        Self { fit: 0.5, spread_m: DrawnMetres(0.7), apart_m: 2.0 }
    }
}

impl Assuring {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        numbers::from_0_on(&[("fit", self.fit), ("spread_m", self.spread_m.0), ("apart_m", self.apart_m)])
    }
}

/// A place where the robot was sure, by odometry, and its estimate there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Place {
    robot: Reckoning,
    estimate: Estimate,
}

/// The places at which the robot was sure, in the order in which it passed them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurePlaces {
    settings: Assuring,
    robot: Reckoning,
    places: Vec<Place>,
}

impl SurePlaces {
    /// Creates an empty list. The first place to be added is the start.
    pub fn new(settings: Assuring) -> Self {
        Self { settings, robot: Reckoning::default(), places: Vec::with_capacity(PLACES) }
    }

    /// Reserves the memory for all places. Call this after reading a checkpoint, which stores values but no spare capacity.
    pub fn reserve(&mut self) {
        self.places.reserve_exact(PLACES.saturating_sub(self.places.len()));
    }

    /// Moves the robot by a distance in metres and an angle in radians, positive to the left.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        self.robot.moved(moved_m, turned_rad);
    }

    /// Returns the number of places. It grows when the robot is sure, and shrinks when it is back at an earlier place.
    pub const fn count(&self) -> usize {
        self.places.len()
    }

    /// Adds the robot's current place if the robot is sure of its pose there, or if it is the first place.
    pub fn add(&mut self, estimate: &Estimate) {
        let Assuring { fit, spread_m, apart_m } = self.settings;
        let is_first = self.places.is_empty();
        let is_sure = estimate.fit >= fit && estimate.spread <= spread_m;
        let is_apart = |last: &Place| self.robot.gone_m - last.robot.gone_m >= apart_m;
        if is_first || is_sure && self.places.last().is_some_and(is_apart) && self.places.len() < PLACES {
            self.places.push(Place { robot: self.robot, estimate: *estimate });
        }
    }

    /// If the robot is back at one of the places, returns its estimate at the earlier visit, and forgets all later places.
    pub fn back(&mut self) -> Option<Estimate> {
        let robot = self.robot;
        let is_back = |place: &Place| {
            robot.gone_m - place.robot.gone_m >= AWAY_M
                && robot.at.distance(&place.robot.at) < BACK_M
                && wrap_angle(robot.heading_rad - place.robot.heading_rad).abs() < BACK_RAD
        };
        let i = self.places.iter().position(is_back)?;
        self.places.truncate(i + 1);
        self.places[i].robot.gone_m = robot.gone_m;
        Some(self.places[i].estimate)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use sketchnav_schemas::geometry::Point;

    use super::*;
    use crate::drawn::Stretch;

    fn estimate(x: f64, fit: f64) -> Estimate {
        let (at, stretch, spread) = (Point::new(x, 0.0), Stretch::NONE, DrawnMetres(0.2));
        Estimate { at, heading_rad: 0.0, stretch, spread, fit }
    }

    #[test]
    fn a_robot_that_went_back_believes_what_it_believed_there() {
        let mut places = SurePlaces::new(Assuring::default());
        places.add(&estimate(0.0, 0.5));
        for i in 1..=8 {
            places.moved(1.0, 0.0);
            places.add(&estimate(f64::from(i), if i <= 4 { 0.9 } else { 0.4 }));
            assert_eq!(places.back(), None);
        }
        assert_eq!(places.count(), 3, "at 0, 2 and 4 m");
        places.moved(0.0, PI);
        for _ in 0..4 {
            places.moved(1.0, 0.0);
        }
        assert_eq!(places.back(), None, "it faces the other way");
        places.moved(0.0, PI - 0.1);
        assert_eq!(places.back(), Some(estimate(4.0, 0.9)));
        assert_eq!(places.back(), None, "once");
        assert_eq!(places.count(), 3);
    }
}
