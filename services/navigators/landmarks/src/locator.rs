//! Locates the robot in the drawing: a [`crate::belief`] that is updated by ranges and markers, the robot's [`crate::memory`], and
//! the [`crate::sure`] places, to which the belief is reset when the robot is back at one.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Point};

use crate::belief::{BEAMS, Beam, Belief, Believing, Estimate, Sight};
use crate::drawn::{Drawn, DrawnMetres};
use crate::error::Error;
use crate::memory::{Memory, Remembering, polar};
use crate::numbers;
use crate::outlines::Outlines;
use crate::plane;
use crate::route::INCH_M;
use crate::sketch::Sketch;
use crate::sure::{Assuring, SurePlaces};

/// Maximum number of markers in an update.
const MARKERS: usize = 32;
/// Length of the first part of a drawn route, from which the initial heading is taken.
const FIRST_STEPS: DrawnMetres = DrawnMetres(20.0 * INCH_M);

/// Parameters for locating the robot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Locating {
    /// Parameters of the belief.
    pub belief: Believing,
    /// Parameters of the memory.
    pub memory: Remembering,
    /// Parameters that determine where the robot is sure of its pose.
    pub sure: Assuring,
}

impl Locating {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        numbers::within("belief", self.belief.check())?;
        numbers::within("memory", self.memory.check())?;
        numbers::within("sure", self.sure.check())
    }
}

/// A reading of a ring of range sensors.
#[derive(Debug, Clone, Copy)]
pub struct Returns<'a> {
    /// Directions of the beams, in radians counter-clockwise from ahead.
    pub angles_rad: &'a [f64],
    /// Ranges measured from the ring, in metres.
    pub ranges_m: &'a [f64],
    /// Radius of the ring around the robot's centre, in metres.
    pub ring_m: f64,
    /// Minimum range that counts as no return, in metres.
    pub range_max_m: f64,
}

/// State of a locator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Located {
    belief: Belief,
    memory: Memory,
    sure: SurePlaces,
    /// The markers seen last, each with the index of its object. Cleared once they have updated the belief.
    marked: Vec<(usize, Point<Base>)>,
}

/// Locates a robot in a sketch.
#[derive(Debug, Clone)]
pub struct Locator {
    outlines: Outlines,
    located: Located,
}

impl Locator {
    /// Creates a locator at the start of a sketch's route.
    ///
    /// # Errors
    /// [`Error::NoRoute`] if the route has fewer than two points.
    pub fn new(sketch: &Sketch, settings: Locating, seed: u64) -> Result<Self, Error> {
        if sketch.route.len() < 2 {
            return Err(Error::NoRoute { objects: sketch.landmarks.len(), stray: 0 });
        }
        // A hand trembles at the start of a line, so the heading is that of the first part as a whole.
        let begun = plane::at_length(&sketch.route, FIRST_STEPS.0);
        let heading_rad = sketch.route[0].direction_rad(&begun);
        let belief = Belief::new(sketch.route[0], heading_rad, settings.belief, seed);
        let (memory, sure) = (Memory::new(settings.memory), SurePlaces::new(settings.sure));
        let located = Located { belief, memory, sure, marked: Vec::with_capacity(MARKERS) };
        Ok(Self { outlines: Outlines::of(sketch), located })
    }

    /// Returns the state of the locator.
    pub const fn located(&self) -> &Located {
        &self.located
    }

    /// Resumes from a stored state.
    pub fn restore(&mut self, mut located: Located) {
        located.belief.reserve();
        located.memory.reserve();
        located.sure.reserve();
        located.marked.reserve_exact(MARKERS.saturating_sub(located.marked.len()));
        self.located = located;
    }

    /// Returns the estimated pose of the robot.
    pub fn estimate(&self) -> Estimate {
        self.located.belief.estimate()
    }

    /// Returns the number of places on the way at which the robot has been sure of its pose.
    pub const fn sure_places(&self) -> usize {
        self.located.sure.count()
    }

    /// Returns the remembered positions of objects, in the robot's frame.
    pub fn places(&self) -> &[Point<Base>] {
        self.located.memory.places()
    }

    /// Sets the estimate to where a person says the robot is in the drawing. If no heading is given, the estimated one is kept.
    pub fn place(&mut self, at: Point<Drawn>, heading_rad: Option<f64>) {
        self.located.belief.place(at, heading_rad);
    }

    /// Records the markers that the robot sees from its position after the last step, each with the index of its object.
    pub fn see_markers(&mut self, seen: impl Iterator<Item = (usize, Point<Base>)>) {
        self.located.marked.clear();
        self.located.marked.extend(seen.take(MARKERS));
    }

    /// Moves the robot, in real metres and radians. Then updates the belief if there are new measurements and the robot has moved
    /// far enough.
    pub fn step(&mut self, moved_m: f64, turned_rad: f64, returns: Option<&Returns<'_>>) {
        let Located { belief, memory, sure, marked } = &mut self.located;
        belief.moved(moved_m, turned_rad);
        memory.moved(moved_m, turned_rad);
        sure.moved(moved_m, turned_rad);
        if let Some(before) = sure.back() {
            belief.return_to(&before);
        }
        let (sin, cos) = turned_rad.sin_cos();
        for (_, place) in marked.iter_mut() {
            let [x, y] = [place.x - moved_m, place.y];
            *place = Point::new(x * cos + y * sin, y * cos - x * sin);
        }
        let Some(returns) = returns else { return };
        let ranges = returns.angles_rad.iter().zip(returns.ranges_m);
        let valid = |range: f64| range.is_finite() && (0.0..returns.range_max_m).contains(&range);
        let seen = ranges.clone().filter(|(_, range)| valid(**range));
        memory.see(seen.map(|(angle, range)| polar(*angle, range + returns.ring_m)));
        if belief.is_due() {
            let mut beams = [Beam { angle_rad: 0.0, range_m: 0.0 }; BEAMS];
            let count = returns.ranges_m.len().min(BEAMS);
            for (beam, (angle, range)) in beams.iter_mut().zip(ranges) {
                let range_m = if valid(*range) { range + returns.ring_m } else { f64::INFINITY };
                *beam = Beam { angle_rad: *angle, range_m };
            }
            belief.seen(&Sight { beams: &beams[..count], marked }, &self.outlines);
            marked.clear();
            sure.add(&belief.estimate());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::Landmark;

    fn locator() -> Locator {
        let outline = [[5.0, -2.0], [5.5, -2.0], [5.5, 2.0], [5.0, 2.0]].map(Point::from).into();
        let landmarks = vec![Landmark { name: "wall".into(), outline }];
        let route = plane::resample(&[Point::new(0.0, 0.0), Point::new(4.0, 0.0)], 0.5);
        Locator::new(&Sketch { landmarks, route, metres_per_pixel: 0.1 }, Locating::default(), 1).unwrap()
    }

    const AHEAD: Returns<'_> =
        Returns { angles_rad: &[0.0], ranges_m: &[1.5], ring_m: 0.25, range_max_m: 6.0 };

    /// Sonar measurements that arrived at other instants than the odometry used to be ignored, because the robot had not moved at
    /// those instants.
    #[test]
    fn a_sensor_that_speaks_after_the_robot_moved_is_believed_once() {
        let mut locator = locator();
        locator.step(0.0, 0.0, Some(&AHEAD));
        let standing = locator.estimate();
        locator.step(0.1, 0.0, None);
        let moved = locator.estimate();
        locator.step(0.0, 0.0, Some(&AHEAD));
        let believed = locator.estimate();
        locator.step(0.0, 0.0, Some(&AHEAD));
        assert_eq!(standing.fit, 1.0);
        assert_ne!(believed, moved);
        assert_eq!(locator.estimate(), believed, "a robot that stands learns nothing new");
    }
}
