//! Lengths in a drawing, and the driven lengths that correspond to them.
//!
//! Because a drawing is not to scale, lengths measured in it have a different type from lengths that the
//! robot drives. Only the [`Stretch`] of the drawing converts between the two.

use std::ops::{Add, Mul, Sub};

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::Point;

/// The frame of a drawing, with x to the right and y up. Its unit is the metre, according to the size that
/// the canvas is declared to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Drawn;

/// A length as drawn or stated by a person, in metres.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(transparent)]
pub struct DrawnMetres(pub f64);

impl DrawnMetres {
    /// Returns the distance between two points of a drawing.
    pub fn between(one: &Point<Drawn>, other: &Point<Drawn>) -> Self {
        Self(one.distance(other))
    }

    /// Returns the longer of the two lengths.
    pub const fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// Returns the shorter of the two lengths.
    pub const fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    /// Restricts the length to the range from `low` to `high`.
    pub const fn clamp(self, low: Self, high: Self) -> Self {
        Self(self.0.clamp(low.0, high.0))
    }
}

impl Add for DrawnMetres {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for DrawnMetres {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul<f64> for DrawnMetres {
    type Output = Self;

    fn mul(self, times: f64) -> Self {
        Self(self.0 * times)
    }
}

/// Number of driven metres per drawn metre.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Stretch(pub f64);

impl Stretch {
    /// Stretch of a drawing to scale.
    pub const NONE: Self = Self(1.0);

    /// Converts a driven length, in metres, to a length in the drawing.
    pub fn drawn(self, driven_m: f64) -> DrawnMetres {
        DrawnMetres(driven_m / self.0)
    }

    /// Converts a length in the drawing to a driven length, in metres.
    pub fn driven_m(self, drawn: DrawnMetres) -> f64 {
        drawn.0 * self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawn_metre_is_driven_by_its_stretch() {
        let stretch = Stretch(1.25);
        assert_eq!(stretch.driven_m(DrawnMetres(2.0)), 2.5);
        assert_eq!(stretch.drawn(2.5), DrawnMetres(2.0));
        assert_eq!(Stretch::NONE.driven_m(DrawnMetres(2.0)), 2.0);
    }
}
