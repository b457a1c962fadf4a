//! The histogram of forces between two polygons (Matsakis and Wendling 1999). It says how much of one is in each direction from
//! the other; near parts count more.
//!
//! The force of an argument A on a referent B in direction θ is a sum over all pairs of points p in A and q in B.
//! Those with p − q in direction θ count, and each attracts by |p − q|^−r:
//!
//! F_r(θ) = ∫ du ∬ (p − q)^−r dp dq, the inner integrals along the parallels at θ, u across them.
//!
//! F_0 is the histogram of constant forces, F_2 that of gravitational ones. Its integral over all directions is
//! ∬ |p − q|^−(r + 1) dp dq over both areas. θ is counter-clockwise from the first axis.
//!
//! - [`Polygon`]: an object, of one or more rings (several parts, holes).
//! - [`Pair`]: two objects, prepared for any exponent and direction.
//! - [`View`]: a histogram as seen with a heading: degrees of truth, main direction, width, surround relations.
//!
//! A force can be infinite ([`Force::Infinite`]): for r ≥ 1 if the objects overlap in the direction, for r ≥ 2 if they touch
//! along an edge, and for r ≥ 3 if they touch at a point.

use std::ops::Add;

mod chords;
mod pair;
mod polygon;
mod power;
mod view;

pub use pair::{Pair, Workspace};
pub use polygon::Polygon;
pub use view::{Assessment, Grade, Surround, View, degree_of_truth};

/// A force in a direction.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub enum Force {
    /// A number from 0.
    Finite(f64),
    /// More than any number: the objects touch or overlap.
    Infinite,
}

impl Force {
    /// No force.
    pub const ZERO: Self = Self::Finite(0.0);

    /// The number; `None` for an infinite force.
    pub const fn finite(self) -> Option<f64> {
        match self {
            Self::Finite(force) => Some(force),
            Self::Infinite => None,
        }
    }

    /// Whether there is any.
    pub fn is_some(self) -> bool {
        self != Self::ZERO
    }
}

impl Add for Force {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Self::Finite(a), Self::Finite(b)) => Self::Finite(a + b),
            _ => Self::Infinite,
        }
    }
}
