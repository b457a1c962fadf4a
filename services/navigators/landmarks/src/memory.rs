//! A local memory of objects, for display and for the [`crate::alternatives`] of a lost robot. Returns are kept at their positions,
//! by odometry, until the robot is far away. The belief does not use this memory, because it learns from each return immediately.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Odom, Point};

use crate::error::Error;
use crate::numbers;
use crate::reckoning::Reckoning;

/// Maximum number of positions that are remembered.
pub const PLACES: usize = 48;

/// Parameters of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Remembering {
    /// Distance below which two returns count as the same position, in metres.
    pub apart_m: f64,
    /// Maximum range of returns that are remembered, in metres. Farther away, the cone of a sonar is too
    /// wide.
    pub reach_m: f64,
    /// Distance that the robot covers before it forgets a position that it has not seen again, in metres. Odometry drifts, and
    /// drawings are accurate only locally.
    pub keep_m: f64,
}

impl Default for Remembering {
    fn default() -> Self {
        Self { apart_m: 0.3, reach_m: 4.0, keep_m: 3.0 }
    }
}

impl Remembering {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { apart_m, reach_m, keep_m } = *self;
        numbers::from_0_on(&[("apart_m", apart_m), ("reach_m", reach_m), ("keep_m", keep_m)])
    }
}

/// Returns a position in the robot's frame, given its direction from the heading, positive to the left, and its distance from the
/// robot's centre, in metres.
pub fn polar(direction_rad: f64, distance_m: f64) -> Point<Base> {
    let (sin, cos) = direction_rad.sin_cos();
    Point::new(distance_m * cos, distance_m * sin)
}

/// A position in the odometry frame, and the distance that the robot had covered when it last saw it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Place {
    at: Point<Odom>,
    seen_at_m: f64,
}

/// The robot's memory of its surroundings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    settings: Remembering,
    robot: Reckoning,
    remembered: Vec<Place>,
    /// The remembered positions in the robot's frame.
    places: Vec<Point<Base>>,
}

impl Memory {
    /// Creates an empty memory.
    pub fn new(settings: Remembering) -> Self {
        Self {
            settings,
            robot: Reckoning::default(),
            remembered: Vec::with_capacity(PLACES),
            places: Vec::with_capacity(PLACES),
        }
    }

    /// Reserves the memory for all positions. Call this after reading a checkpoint, which stores values but no spare capacity.
    pub fn reserve(&mut self) {
        self.remembered.reserve_exact(PLACES.saturating_sub(self.remembered.len()));
        self.places.reserve_exact(PLACES.saturating_sub(self.places.len()));
    }

    /// Moves the robot, in metres and radians, positive to the left.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        self.robot.moved(moved_m, turned_rad);
    }

    /// Adds returns, and forgets positions that were last seen too long ago.
    pub fn see(&mut self, returns: impl Iterator<Item = Point<Base>>) {
        let Remembering { keep_m, reach_m, .. } = self.settings;
        let gone_m = self.robot.gone_m;
        self.remembered.retain(|place| gone_m - place.seen_at_m <= keep_m);
        for one in returns.filter(|one| one.x.hypot(one.y) <= reach_m) {
            self.add(self.place(one));
        }
        self.places.clear();
        self.places.extend(self.remembered.iter().map(|place| self.robot.base_from_odom(place.at)));
    }

    /// Returns the position, in the odometry frame, of an object that the robot sees now.
    fn place(&self, seen: Point<Base>) -> Place {
        Place { at: self.robot.odom_from_base(seen), seen_at_m: self.robot.gone_m }
    }

    /// Adds a position, replacing an earlier one of the same object or, if the memory is full, the oldest one.
    fn add(&mut self, place: Place) {
        let (apart_m, known) = (self.settings.apart_m, &mut self.remembered);
        if let Some(near) = known.iter_mut().find(|near| near.at.distance(&place.at) < apart_m) {
            *near = place;
        } else if known.len() < PLACES {
            known.push(place);
        } else if let Some(oldest) = known.iter_mut().min_by(|a, b| a.seen_at_m.total_cmp(&b.seen_at_m)) {
            *oldest = place;
        }
    }

    /// Returns the remembered positions.
    pub fn places(&self) -> &[Point<Base>] {
        &self.places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn see(memory: &mut Memory, returns: &[(f64, f64)]) {
        memory.see(returns.iter().map(|(degrees, distance)| polar(degrees.to_radians(), *distance)));
    }

    #[test]
    fn what_was_in_front_is_beside_the_robot_that_went_on() {
        let mut memory = Memory::new(Remembering::default());
        see(&mut memory, &[(45.0, 8_f64.sqrt())]);
        memory.moved(2.0, 0.0);
        see(&mut memory, &[]);
        let [one] = memory.places() else { panic!() };
        assert!(one.distance(&Point::new(0.0, 2.0)) < 1e-9, "{one:?}");
        memory.moved(0.0, 90_f64.to_radians());
        see(&mut memory, &[]);
        assert!(memory.places()[0].distance(&Point::new(2.0, 0.0)) < 1e-9);
        memory.moved(1.1, 0.0);
        see(&mut memory, &[]);
        assert_eq!(memory.places(), [], "3.1 m on it is forgotten");
    }

    #[test]
    fn one_place_is_remembered_once_and_no_more_than_fit() {
        let mut memory = Memory::new(Remembering::default());
        see(&mut memory, &[(0.0, 2.0), (1.0, 2.0), (0.0, 9.0)]);
        assert_eq!(memory.places().len(), 1);
        for i in 0..200 {
            memory.moved(0.01, 0.0);
            see(&mut memory, &[(f64::from(i) * 37.0, 1.0 + f64::from(i % 7) * 0.4)]);
        }
        assert_eq!(memory.places().len(), PLACES);
    }
}
