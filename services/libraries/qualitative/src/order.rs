//! Order along the first axis: left, together or right. In QSRlib this is the minimal working example, `mwe`.
//!
//! For the x coordinate, this is the point algebra of Vilain and Kautz (1986), with "left" for <, "together" for = and
//! "right" for >.

use std::cmp::Ordering;

use crate::algebra::{Compose, Converse, RelationSet, words};
use crate::calculus::{Before, Calculus};
use crate::geometry::Point;

words! {
    /// The position of a along the first axis, as seen from b.
    Order, "mwe", limits = |_, instant| instant == Order::Together, {
        /// x of a is below x of b.
        Left = "left",
        /// Both have the same x.
        Together = "together",
        /// x of a is above x of b.
        Right = "right",
    }
}

impl Order {
    /// Returns the order of two points.
    pub fn of(a: Point, b: Point) -> Self {
        match a.x().partial_cmp(&b.x()) {
            Some(Ordering::Less) => Self::Left,
            Some(Ordering::Greater) => Self::Right,
            _ => Self::Together,
        }
    }
}

impl Converse for Order {
    fn converse(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Together => Self::Together,
            Self::Right => Self::Left,
        }
    }
}

impl Compose for Order {
    fn compose(self, next: Self) -> RelationSet<Self> {
        match (self, next) {
            (Self::Together, other) | (other, Self::Together) => other.into(),
            (a, b) if a == b => a.into(),
            _ => RelationSet::universal(),
        }
    }
}

/// [`Order`] of two points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Orders;

impl Calculus for Orders {
    type Scene = [Point; 2];
    type Relation = Order;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Order> {
        Some(Order::of(*a, *b))
    }
}
