//! Moving or stationary (MOS): the motion of one object between two times. In QSRlib this is `mos`.

use crate::algebra::words;
use crate::calculus::{Before, Calculus, Quantisation};
use crate::geometry::Point;

words! {
    /// Whether an object moved.
    Motion, "mos", limits = |_, instant| instant == Motion::Stationary, {
        /// The object moved farther than the quantisation.
        Moving = "m",
        /// The object moved no farther than the quantisation.
        Stationary = "s",
    }
}

impl Motion {
    /// Returns [`Self::Moving`] if an object moved farther than `threshold`.
    pub fn of(before: Point, now: Point, threshold: f64) -> Self {
        if before.distance(now) > threshold { Self::Moving } else { Self::Stationary }
    }
}

/// [`Motion`] of one point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motions {
    /// Threshold above which a change of position counts as motion.
    pub quantisation: Quantisation,
}

impl Calculus for Motions {
    type Scene = Point;
    type Relation = Motion;
    const OF_MOTION: bool = true;

    fn relate(&self, before: Before<'_, Point>, now: &Point) -> Option<Motion> {
        before.map(|(before, elapsed_s)| Motion::of(*before, *now, self.quantisation.over(elapsed_s)))
    }
}
