//! Rectangle algebra (Balbiani, Condotta and del Cerro 1998), which consists of Allen's relation on each axis. In QSRlib
//! this is `ra`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::algebra::{Compose, Converse, Relation, RelationSet, unknown};
use crate::allen::Allen;
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Rect, not_negative};

/// One of the 169 relations of one rectangle to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Rectangular {
    /// The relation of the projections on the first axis.
    pub x: Allen,
    /// The relation of the projections on the second axis.
    pub y: Allen,
}

impl Rectangular {
    /// Returns the relation of two rectangles. Sides that differ by no more than `tolerance` count as aligned.
    pub fn of(a: Rect, b: Rect, tolerance: f64) -> Self {
        Self { x: Allen::of(a.x(), b.x(), tolerance), y: Allen::of(a.y(), b.y(), tolerance) }
    }

    /// Returns the relation in a mirror image that reverses the first axis.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self { x: self.x.mirrored(), ..self }
    }
}

impl Relation for Rectangular {
    const CALCULUS: &'static str = "ra";
    const COUNT: usize = Allen::COUNT * Allen::COUNT;

    fn index(self) -> usize {
        self.x.index() * Allen::COUNT + self.y.index()
    }

    fn from_index(index: usize) -> Option<Self> {
        let x = Allen::from_index(index / Allen::COUNT)?;
        Some(Self { x, y: Allen::from_index(index % Allen::COUNT)? })
    }

    fn limits_to(self, instant: Self) -> bool {
        let reaches = |from: Allen, to| from == to || from.limits_to(to);
        self != instant && reaches(self.x, instant.x) && reaches(self.y, instant.y)
    }
}

impl Converse for Rectangular {
    fn converse(self) -> Self {
        Self { x: self.x.converse(), y: self.y.converse() }
    }
}

impl Compose for Rectangular {
    fn compose(self, next: Self) -> RelationSet<Self> {
        let (xs, ys) = (self.x.compose(next.x), self.y.compose(next.y));
        xs.iter().flat_map(|x| ys.iter().map(move |y| Self { x, y })).collect()
    }
}

impl fmt::Display for Rectangular {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.x, self.y)
    }
}

impl FromStr for Rectangular {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        let (x, y) = word.split_once(',').ok_or_else(|| unknown::<Self>(word))?;
        Ok(Self { x: x.parse()?, y: y.parse()? })
    }
}

/// [`Rectangular`] of two rectangles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rectangles {
    tolerance: f64,
}

impl Rectangles {
    /// Creates the calculus where sides that differ by no more than `tolerance` are aligned.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is negative or not finite.
    pub fn new(tolerance: f64) -> Result<Self, Error> {
        Ok(Self { tolerance: not_negative("tolerance", tolerance)? })
    }
}

impl Calculus for Rectangles {
    type Scene = [Rect; 2];
    type Relation = Rectangular;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<Rectangular> {
        Some(Rectangular::of(*a, *b, self.tolerance))
    }
}
