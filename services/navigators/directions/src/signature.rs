//! What surrounds a landmark: which of its quadrants hold another dot (Park and Kender 1995, 6.3.1).

use serde::{Deserialize, Serialize};

use crate::geometry::{Corner, Window};
use crate::plane::{DotId, Plane};

/// The quadrants of a landmark that are occupied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub struct Signature(u8);

impl Signature {
    /// Says that a quadrant is occupied.
    pub fn occupy(&mut self, quadrant: Corner) {
        self.0 |= 1 << quadrant as u8;
    }

    /// Whether a quadrant is occupied.
    pub fn has(self, quadrant: Corner) -> bool {
        self.0 >> quadrant as u8 & 1 == 1
    }

    /// The quadrant occupancy count, QOC: 0 to 4.
    pub fn count(self) -> u8 {
        self.0.count_ones() as u8
    }

    /// The signature of a dot.
    pub fn of(plane: &Plane, dot: DotId, window: Window) -> Self {
        let place = plane.dot(dot);
        let mut signature = Self::default();
        for (other, at) in plane.around(place, window.side) {
            if other != dot {
                let quadrants =
                    Corner::ALL.into_iter().filter(|quadrant| quadrant.covers(at - place, window.side));
                quadrants.for_each(|quadrant| signature.occupy(quadrant));
            }
        }
        signature
    }

    /// The signatures of all dots.
    pub fn of_all(plane: &Plane, window: Window) -> Vec<Self> {
        (0..plane.len() as DotId).map(|dot| Self::of(plane, dot, window)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::plane;

    #[test]
    fn figure_22_has_three_quadrants_occupied() {
        let around = plane(&[(0.0, 0.0), (-3.0, 4.0), (-2.0, -2.0), (5.0, -1.0), (30.0, 30.0)]);
        let signature = Signature::of(&around, 0, Window::new(10.0, 0.0).unwrap());
        assert_eq!(signature.count(), 3);
        assert_eq!(Corner::ALL.map(|quadrant| signature.has(quadrant)), [true, false, true, true]);
    }

    #[test]
    fn a_dot_on_an_axis_occupies_two_quadrants_and_a_dot_apart_none() {
        let two = plane(&[(0.0, 0.0), (0.0, 10.0), (50.0, 50.0)]);
        let counts: Vec<_> = Signature::of_all(&two, Window::new(10.0, 0.0).unwrap())
            .into_iter()
            .map(Signature::count)
            .collect();
        assert_eq!(counts, [2, 2, 0]);
    }
}
