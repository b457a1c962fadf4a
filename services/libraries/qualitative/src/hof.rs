//! The histogram of forces between two polygons (Matsakis and Wendling 1999). It gives the extent to which one polygon lies in each
//! direction from the other, with near parts weighted more.
//!
//! The force that an argument A exerts on a referent B in direction θ is a sum over all pairs of a point p in A and a point
//! q in B for which p − q points in direction θ. Each pair attracts with |p − q|^−r:
//!
//! F_r(θ) = ∫ du ∬ (p − q)^−r dp dq, where the inner integrals run along the parallels at θ and u runs across them.
//!
//! F_0 is the histogram of constant forces and F_2 that of gravitational forces. The integral of F_r over all directions is
//! ∬ |p − q|^−(r + 1) dp dq over both areas. θ is counter-clockwise from the first axis.
//!
//! - [`Polygon`] is an object made of one or more rings, so it may have several parts, and holes.
//! - [`Pair`] contains two objects, prepared for any exponent and direction.
//! - [`View`] interprets a histogram relative to a heading: degrees of truth, main direction, width and surround relations.
//!
//! A force can be infinite ([`Force::Infinite`]). This happens for r ≥ 1 if the objects overlap in the direction, for r ≥ 2
//! if they touch along an edge, and for r ≥ 3 if they touch at a point.

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
    /// A finite force, which is never negative.
    Finite(f64),
    /// An infinite force, because the objects touch or overlap.
    Infinite,
}

impl Force {
    /// No force.
    pub const ZERO: Self = Self::Finite(0.0);

    /// Returns the value of a finite force, or `None` if the force is infinite.
    pub const fn finite(self) -> Option<f64> {
        match self {
            Self::Finite(force) => Some(force),
            Self::Infinite => None,
        }
    }

    /// Returns true unless the force is zero.
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
