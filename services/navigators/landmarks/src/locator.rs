//! Where the robot probably is in the drawing: [`crate::belief`] by what [`crate::memory`] has of its surroundings.

use serde::{Deserialize, Serialize};

use crate::belief::{Belief, Believing, Estimate};
use crate::error::Error;
use crate::extraction::track::headings;
use crate::memory::{Memory, Relation, Remembering};
use crate::outlines::Outlines;
use crate::route::INCH_M;
use crate::sketch::Sketch;

/// How the robot locates itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Locating {
    /// The belief.
    pub belief: Believing,
    /// The memory.
    pub memory: Remembering,
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
}

/// Locates a robot in a sketch.
#[derive(Debug, Clone)]
pub struct Locator {
    outlines: Outlines,
    located: Located,
}

impl Locator {
    /// At the start of a sketch's route.
    ///
    /// # Errors
    /// [`Error::NoRoute`].
    pub fn new(sketch: &Sketch, settings: Locating, seed: u64) -> Result<Self, Error> {
        if sketch.route.len() < 2 {
            return Err(Error::NoRoute { objects: sketch.landmarks.len(), stray: 0 });
        }
        // A hand trembles where it begins: the heading is that of the first steps together.
        let heading_rad = headings(&sketch.route, 10.0 * INCH_M)[0];
        let belief = Belief::new(sketch.route[0], heading_rad, settings.belief, seed);
        let located = Located { belief, memory: Memory::new(settings.memory) };
        Ok(Self { outlines: Outlines::of(sketch), located })
    }

    /// What it remembers.
    pub const fn located(&self) -> &Located {
        &self.located
    }

    /// Goes on from there.
    pub fn restore(&mut self, located: Located) {
        self.located = located;
    }

    /// Where the robot probably is.
    pub fn estimate(&self) -> Estimate {
        self.located.belief.estimate()
    }

    /// Where everything is that is remembered.
    pub fn relations(&self) -> &[Relation] {
        self.located.memory.relations()
    }

    /// The robot moved and turned, in real metres and radians, and sees this, where its sensor has spoken.
    pub fn step(&mut self, moved_m: f64, turned_rad: f64, returns: Option<&Returns<'_>>) {
        let Located { belief, memory } = &mut self.located;
        belief.moved(moved_m, turned_rad);
        memory.moved(moved_m, turned_rad);
        let Some(returns) = returns else { return };
        let ranges = returns.angles_rad.iter().zip(returns.ranges_m);
        let ranges = ranges
            .filter(|(_, range)| range.is_finite() && (0.0..returns.range_max_m).contains(*range))
            .map(|(angle, range)| Relation::polar(*angle, range + returns.ring_m));
        memory.see(ranges);
        if moved_m != 0.0 || turned_rad != 0.0 {
            belief.seen(memory, &self.outlines);
        }
    }
}
