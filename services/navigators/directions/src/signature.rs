//! The surroundings of a landmark, described by the other dots in its quadrants (Park and Kender 1995, 6.3.1).
//!
//! A navigator above the plane counts the occupied quadrants, while a navigator on land describes its surroundings by a *panorama*,
//! one word for each of the four quadrants in order (8).

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::geometry::{Corner, Window};
use crate::plane::{DotId, Plane};
use crate::transitions::Candidates;

/// The words for no, one, two, and three or more dots in a quadrant.
const WORDS: [&str; 4] = ["none", "point", "pair", "group"];

/// The number of dots in each quadrant of a landmark: 0, 1, 2, or 3 for three and more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub struct Signature(u8);

impl Signature {
    /// Returns the panorama with a code, which has two bits for each quadrant.
    pub const fn of_code(code: u8) -> Self {
        Self(code)
    }

    /// Returns the code of this panorama, which has two bits for each quadrant.
    pub const fn code(self) -> u8 {
        self.0
    }

    /// Adds one dot to a quadrant.
    pub fn occupy(&mut self, quadrant: Corner) {
        if self.dots(quadrant) < 3 {
            self.0 += 1 << (2 * quadrant as u8);
        }
    }

    /// Returns the number of dots in a quadrant. 3 stands for 3 or more.
    pub fn dots(self, quadrant: Corner) -> u8 {
        self.0 >> (2 * quadrant as u8) & 3
    }

    /// Returns true if a quadrant is occupied.
    pub fn has(self, quadrant: Corner) -> bool {
        self.dots(quadrant) > 0
    }

    /// Returns the quadrant occupancy count (QOC), from 0 to 4.
    pub fn count(self) -> u8 {
        Corner::ALL.into_iter().map(|quadrant| u8::from(self.has(quadrant))).sum()
    }

    /// Returns the difference between two panoramas, summed over the quadrants.
    pub fn difference(self, other: Self) -> u8 {
        Corner::ALL.into_iter().map(|quadrant| self.dots(quadrant).abs_diff(other.dots(quadrant))).sum()
    }

    /// Parses a panorama of four words, in the notation of custom maps.
    pub fn of_words(text: &str) -> Option<Self> {
        let mut signature = Self::default();
        let mut words = text.split('+');
        for quadrant in Corner::ROUND {
            let word = words.next()?;
            let dots = WORDS.iter().position(|known| known.eq_ignore_ascii_case(word))?;
            (0..dots).for_each(|_| signature.occupy(quadrant));
        }
        words.next().is_none().then_some(signature)
    }

    /// Returns the signature of a dot.
    pub fn of(plane: &Plane, dot: DotId, window: Window) -> Self {
        let place = plane.dot(dot);
        let mut signature = Self::default();
        if window.land.is_some() {
            let mut candidates = Candidates::default();
            for quadrant in Corner::ALL {
                candidates.find(plane, window, dot, quadrant);
                candidates.dots.iter().for_each(|_| signature.occupy(quadrant));
            }
            return signature;
        }
        for (other, at) in plane.around(place, window.side) {
            if other != dot {
                let quadrants =
                    Corner::ALL.into_iter().filter(|quadrant| quadrant.covers(at - place, window.side));
                quadrants.for_each(|quadrant| signature.occupy(quadrant));
            }
        }
        signature
    }

    /// Returns the signatures of all dots.
    pub fn of_all(plane: &Plane, window: Window) -> Vec<Self> {
        (0..plane.len() as DotId).map(|dot| Self::of(plane, dot, window)).collect()
    }
}

impl fmt::Display for Signature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = Corner::ROUND.map(|quadrant| WORDS[usize::from(self.dots(quadrant))]);
        f.write_str(&words.join("+"))
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
    fn a_panorama_is_read_as_it_is_printed() {
        for text in ["none+point+pair+group", "group+none+none+none"] {
            assert_eq!(Signature::of_words(text).unwrap().to_string(), text);
        }
        let read = Signature::of_words("none+point+pair+GROUP").unwrap();
        assert_eq!(Corner::ROUND.map(|quadrant| read.dots(quadrant)), [0, 1, 2, 3]);
        assert_eq!(
            (read.count(), read.difference(Signature::of_words("point+point+none+pair").unwrap())),
            (3, 4)
        );
        for wrong in ["", "none", "none+none+none", "none+none+none+none+none", "none+none+none+two"] {
            assert_eq!(Signature::of_words(wrong), None, "{wrong}");
        }
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
