//! Where the robot probably is in the drawing: [`crate::belief`] by what [`crate::memory`] has of its surroundings.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Point};

use crate::belief::{Belief, Believing, Estimate};
use crate::drawn::{Drawn, DrawnMetres};
use crate::error::Error;
use crate::memory::{Memory, Remembering, SeenMarker, polar};
use crate::numbers;
use crate::outlines::Outlines;
use crate::plane;
use crate::route::INCH_M;
use crate::sketch::Sketch;

/// The first steps of a drawn route, which give its heading.
const FIRST_STEPS: DrawnMetres = DrawnMetres(20.0 * INCH_M);

/// How the robot locates itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Locating {
    /// The belief.
    pub belief: Believing,
    /// The memory.
    pub memory: Remembering,
}

impl Locating {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
    pub fn check(&self) -> Result<(), Error> {
        numbers::within("belief", self.belief.check())?;
        numbers::within("memory", self.memory.check())
    }
}

/// What a ring of range sensors measured.
#[derive(Debug, Clone, Copy)]
pub struct Returns<'a> {
    /// Where the beams point, counter-clockwise from ahead.
    pub angles_rad: &'a [f64],
    /// The ranges from the ring.
    pub ranges_m: &'a [f64],
    /// How far the ring is from the robot's centre.
    pub ring_m: f64,
    /// Ranges from here on are no returns.
    pub range_max_m: f64,
}

/// What the locator remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Located {
    belief: Belief,
    memory: Memory,
    /// Whether the robot has moved since the belief was updated. Sensors may speak at other instants than odometry.
    has_moved: bool,
}

/// Locates a robot in a sketch.
#[derive(Debug, Clone)]
pub struct Locator {
    outlines: Outlines,
    located: Located,
}

impl Locator {
    /// At the start of a sketch's route. The objects with the numbers `marked` have markers.
    ///
    /// # Errors
    /// [`Error::NoRoute`].
    pub fn new(sketch: &Sketch, marked: &[usize], settings: Locating, seed: u64) -> Result<Self, Error> {
        if sketch.route.len() < 2 {
            return Err(Error::NoRoute { objects: sketch.landmarks.len(), stray: 0 });
        }
        // A hand trembles where it begins: the heading is that of the first steps together.
        let begun = plane::at_length(&sketch.route, FIRST_STEPS.0);
        let heading_rad = sketch.route[0].direction_rad(&begun);
        let belief = Belief::new(sketch.route[0], heading_rad, settings.belief, seed);
        let located = Located { belief, memory: Memory::new(settings.memory), has_moved: false };
        Ok(Self { outlines: Outlines::of(sketch, marked), located })
    }

    /// What it remembers.
    pub const fn located(&self) -> &Located {
        &self.located
    }

    /// Goes on from there.
    pub fn restore(&mut self, mut located: Located) {
        located.belief.reserve();
        located.memory.reserve();
        self.located = located;
    }

    /// Where the robot probably is.
    pub fn estimate(&self) -> Estimate {
        self.located.belief.estimate()
    }

    /// Where everything is that is remembered.
    pub fn places(&self) -> &[Point<Base>] {
        self.located.memory.places()
    }

    /// A person says where in the drawing the robot is; and its heading there, where it is said.
    pub fn place(&mut self, at: Point<Drawn>, heading_rad: Option<f64>) {
        self.located.belief.place(at, heading_rad);
    }

    /// The robot sees markers, where it is after the last step.
    pub fn see_markers(&mut self, seen: impl Iterator<Item = SeenMarker>) {
        self.located.memory.see_markers(seen);
    }

    /// The robot moved and turned, in real metres and radians, and sees this, where its sensor has spoken.
    pub fn step(&mut self, moved_m: f64, turned_rad: f64, returns: Option<&Returns<'_>>) {
        let Located { belief, memory, has_moved } = &mut self.located;
        *has_moved |= moved_m != 0.0 || turned_rad != 0.0;
        belief.moved(moved_m, turned_rad);
        memory.moved(moved_m, turned_rad);
        let Some(returns) = returns else { return };
        let ranges = returns.angles_rad.iter().zip(returns.ranges_m);
        let ranges = ranges
            .filter(|(_, range)| range.is_finite() && (0.0..returns.range_max_m).contains(*range))
            .map(|(angle, range)| polar(*angle, range + returns.ring_m));
        memory.see(ranges);
        if std::mem::take(has_moved) {
            belief.seen(memory, &self.outlines);
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
        Locator::new(&Sketch { landmarks, route, metres_per_pixel: 0.1 }, &[], Locating::default(), 1)
            .unwrap()
    }

    const AHEAD: Returns<'_> =
        Returns { angles_rad: &[0.0], ranges_m: &[1.5], ring_m: 0.25, range_max_m: 6.0 };

    /// A sonar that spoke at another instant than the odometry was never believed: the robot had not moved just then.
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
