//! The trait of a calculus together with its parameters, which derives relations from scenes.

use serde::{Deserialize, Serialize};

use crate::algebra::Relation;
use crate::error::Error;
use crate::geometry::not_negative;

/// The preceding scene and the time since then, in seconds, or `None` for the first scene.
pub type Before<'a, S> = Option<(&'a S, f64)>;

/// A calculus together with its parameters.
pub trait Calculus {
    /// The objects at one time, in the order in which the relation takes them.
    type Scene: Copy;
    /// The base relations of the calculus.
    type Relation: Relation;
    /// Whether a relation describes the motion between two times. If not, it describes a single time, and `before` is ignored.
    const OF_MOTION: bool;

    /// Returns the relation that holds, or `None` if the calculus needs two scenes and only one is given.
    fn relate(&self, before: Before<'_, Self::Scene>, now: &Self::Scene) -> Option<Self::Relation>;
}

/// Threshold above which a change of position between two samples counts as motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked", into = "Unchecked")]
pub struct Quantisation(Unchecked);

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Unchecked {
    Distance(f64),
    Speed(f64),
}

impl Quantisation {
    /// Counts any motion.
    pub const NONE: Self = Self(Unchecked::Distance(0.0));

    /// Counts motion over more than this distance, however long it takes. This is QSRlib's `quantisation_factor`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the distance is negative or not finite.
    pub fn distance(distance: f64) -> Result<Self, Error> {
        Ok(Self(Unchecked::Distance(not_negative("quantisation distance", distance)?)))
    }

    /// Counts motion that is faster than this, in length units per second. Relations then do not depend on the sampling rate,
    /// even if sampling is irregular or the rate changes.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the speed is negative or not finite.
    pub fn speed(per_s: f64) -> Result<Self, Error> {
        Ok(Self(Unchecked::Speed(not_negative("quantisation speed", per_s)?)))
    }

    /// Returns the distance that an object must exceed within the given time for its motion to count.
    pub fn over(self, elapsed_s: f64) -> f64 {
        match self.0 {
            Unchecked::Distance(distance) => distance,
            Unchecked::Speed(per_s) => per_s * elapsed_s,
        }
    }
}

impl Default for Quantisation {
    fn default() -> Self {
        Self::NONE
    }
}

impl TryFrom<Unchecked> for Quantisation {
    type Error = Error;

    fn try_from(unchecked: Unchecked) -> Result<Self, Error> {
        match unchecked {
            Unchecked::Distance(distance) => Self::distance(distance),
            Unchecked::Speed(per_s) => Self::speed(per_s),
        }
    }
}

impl From<Quantisation> for Unchecked {
    fn from(quantisation: Quantisation) -> Self {
        quantisation.0
    }
}
