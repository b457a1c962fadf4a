//! A calculus with its parameters, which derives a relation from a scene.

use serde::{Deserialize, Serialize};

use crate::algebra::Relation;
use crate::error::Error;
use crate::geometry::not_negative;

/// The scene before the present one, and how many seconds lie between them.
pub type Before<'a, S> = Option<(&'a S, f64)>;

/// A calculus with its parameters.
pub trait Calculus {
    /// The objects at one time, in the order of the relation's arguments.
    type Scene: Copy;
    /// The base relations.
    type Relation: Relation;
    /// Whether a relation describes the motion between two times; otherwise it describes one time, and `before` is ignored.
    const OF_MOTION: bool;

    /// The relation; `None` if it takes two scenes and there is only one.
    fn relate(&self, before: Before<'_, Self::Scene>, now: &Self::Scene) -> Option<Self::Relation>;
}

/// How far a motion must go between two samples to count as one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked", into = "Unchecked")]
pub struct Quantisation(Unchecked);

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Unchecked {
    Distance(f64),
    Speed(f64),
}

impl Quantisation {
    /// Any motion counts.
    pub const NONE: Self = Self(Unchecked::Distance(0.0));

    /// Motion counts if it goes farther than this, however long it takes. QSRlib's `quantisation_factor`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if it is not a finite number from 0.
    pub fn distance(distance: f64) -> Result<Self, Error> {
        Ok(Self(Unchecked::Distance(not_negative("quantisation distance", distance)?)))
    }

    /// Motion counts if it is faster than this, in length units per second. The relations then do not depend on the sampling
    /// rate, even if it is irregular or changes.
    ///
    /// # Errors
    /// [`Error::Parameter`] if it is not a finite number from 0.
    pub fn speed(per_s: f64) -> Result<Self, Error> {
        Ok(Self(Unchecked::Speed(not_negative("quantisation speed", per_s)?)))
    }

    /// The distance that a motion must exceed in a time.
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
