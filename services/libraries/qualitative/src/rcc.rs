//! The region connection calculus (Randell, Cui and Cohn 1992): RCC8 and the coarser RCC5, RCC4, RCC3 and RCC2.
//!
//! Regions are rectangles here, although the calculus itself is not limited to them. RCC8 is derived from the rectangle
//! algebra, and the coarser calculi from RCC8. RCC4 and RCC3 are QSRlib's. RCC4 is not an algebra: its `pp` includes equal
//! regions, so the converse of `pp` is not a single relation. RCC3's `o` covers all pairs of regions of which one is part
//! of the other.

use crate::algebra::{Compose, Converse, Relation, RelationSet, words};
use crate::allen::Allen;
use crate::calculus::{Before, Calculus};
use crate::error::Error;
use crate::geometry::{Rect, not_negative};
use crate::network::Table;
use crate::rectangle::Rectangular;

words! {
    /// The connection of one region with another.
    Rcc8, "rcc8", limits = Rcc8::reaches, {
        /// Disconnected.
        Dc = "dc",
        /// Externally connected: the regions touch.
        Ec = "ec",
        /// Partially overlapping.
        Po = "po",
        /// Equal.
        Eq = "eq",
        /// Tangential proper part: a is inside b and touches its border.
        Tpp = "tpp",
        /// Non-tangential proper part: a is inside b.
        Ntpp = "ntpp",
        /// The converse of a tangential proper part.
        Tppi = "tppi",
        /// The converse of a non-tangential proper part.
        Ntppi = "ntppi",
    }
}

words! {
    /// RCC8 without the distinctions that depend on borders.
    Rcc5, "rcc5", limits = coarse_limits, {
        /// Discrete: the regions share at most their borders.
        Dr = "dr",
        /// Partially overlapping.
        Po = "po",
        /// Proper part.
        Pp = "pp",
        /// The converse of a proper part.
        Ppi = "ppi",
        /// Equal.
        Eq = "eq",
    }
}

words! {
    /// QSRlib's RCC4. Its base relations do not all have a converse. See [`Rcc4::converses`].
    Rcc4, "rcc4", limits = coarse_limits, {
        /// Disconnected.
        Dc = "dc",
        /// Touching, or partially overlapping.
        Po = "po",
        /// Proper part, or equal.
        Pp = "pp",
        /// The converse of a proper part.
        Ppi = "ppi",
    }
}

words! {
    /// QSRlib's RCC3.
    Rcc3, "rcc3", limits = coarse_limits, {
        /// Disconnected.
        Dc = "dc",
        /// Touching, or partially overlapping.
        Po = "po",
        /// One is part of the other, or they are equal.
        O = "o",
    }
}

words! {
    /// The distinction between connected and disconnected.
    Rcc2, "rcc2", limits = coarse_limits, {
        /// Disconnected.
        Dc = "dc",
        /// Connected.
        C = "c",
    }
}

impl Rcc8 {
    /// Returns the relation of two rectangles. Sides that differ by no more than `tolerance` count as aligned, so rectangles with a
    /// gap or an overlap of no more than `tolerance` touch.
    pub fn of(a: Rect, b: Rect, tolerance: f64) -> Self {
        Rectangular::of(a, b, tolerance).into()
    }

    fn reaches(self, instant: Self) -> bool {
        use Rcc8::{Dc, Ec, Eq, Ntpp, Ntppi, Po, Tpp, Tppi};
        matches!(
            (self, instant),
            (Dc, Ec) | (Po, Ec | Tpp | Tppi | Eq) | (Ntpp, Tpp | Eq) | (Ntppi, Tppi | Eq) | (Tpp | Tppi, Eq)
        )
    }
}

impl From<Rectangular> for Rcc8 {
    fn from(relation: Rectangular) -> Self {
        use Allen::{
            After, Before, Contains, During, Equal, FinishedBy, Finishes, Meets, MetBy, StartedBy, Starts,
        };
        match (relation.x, relation.y) {
            (Before | After, _) | (_, Before | After) => Self::Dc,
            (Meets | MetBy, _) | (_, Meets | MetBy) => Self::Ec,
            (Equal, Equal) => Self::Eq,
            (During, During) => Self::Ntpp,
            (Contains, Contains) => Self::Ntppi,
            (Equal | Starts | During | Finishes, Equal | Starts | During | Finishes) => Self::Tpp,
            (Equal | StartedBy | Contains | FinishedBy, Equal | StartedBy | Contains | FinishedBy) => {
                Self::Tppi
            }
            _ => Self::Po,
        }
    }
}

impl From<Rcc8> for Rcc5 {
    fn from(relation: Rcc8) -> Self {
        match relation {
            Rcc8::Dc | Rcc8::Ec => Self::Dr,
            Rcc8::Po => Self::Po,
            Rcc8::Tpp | Rcc8::Ntpp => Self::Pp,
            Rcc8::Tppi | Rcc8::Ntppi => Self::Ppi,
            Rcc8::Eq => Self::Eq,
        }
    }
}

impl From<Rcc8> for Rcc4 {
    fn from(relation: Rcc8) -> Self {
        match relation {
            Rcc8::Dc => Self::Dc,
            Rcc8::Ec | Rcc8::Po => Self::Po,
            Rcc8::Tpp | Rcc8::Ntpp | Rcc8::Eq => Self::Pp,
            Rcc8::Tppi | Rcc8::Ntppi => Self::Ppi,
        }
    }
}

impl From<Rcc8> for Rcc3 {
    fn from(relation: Rcc8) -> Self {
        match relation {
            Rcc8::Dc => Self::Dc,
            Rcc8::Ec | Rcc8::Po => Self::Po,
            _ => Self::O,
        }
    }
}

impl From<Rcc8> for Rcc2 {
    fn from(relation: Rcc8) -> Self {
        if relation == Rcc8::Dc { Self::Dc } else { Self::C }
    }
}

/// Returns the relations of RCC8 that make up a relation of a coarser calculus.
fn refined<R: Relation + From<Rcc8>>(relation: R) -> impl Iterator<Item = Rcc8> {
    Rcc8::all().filter(move |fine| R::from(*fine) == relation)
}

fn coarse_limits<R: Relation + From<Rcc8>>(relation: R, instant: R) -> bool {
    refined(relation).any(|fine| refined(instant).any(|at| fine.limits_to(at)))
}

fn coarse_composition<R: Relation + From<Rcc8>>(first: R, next: R) -> RelationSet<R> {
    let fine = |relation: R| refined(relation).collect::<RelationSet<Rcc8>>();
    fine(first).compose(fine(next)).iter().map(R::from).collect()
}

impl Converse for Rcc8 {
    fn converse(self) -> Self {
        match self {
            Self::Tpp => Self::Tppi,
            Self::Ntpp => Self::Ntppi,
            Self::Tppi => Self::Tpp,
            Self::Ntppi => Self::Ntpp,
            symmetric => symmetric,
        }
    }
}

impl Converse for Rcc5 {
    fn converse(self) -> Self {
        match self {
            Self::Pp => Self::Ppi,
            Self::Ppi => Self::Pp,
            symmetric => symmetric,
        }
    }
}

impl Rcc4 {
    /// Returns all relations that b may have to a, given `self` as the relation of a to b.
    pub fn converses(self) -> RelationSet<Self> {
        refined(self).map(|fine| fine.converse().into()).collect()
    }

    /// Returns the table for reasoning about networks.
    pub fn table() -> Table<Self> {
        Table::from_fn(RelationSet::universal(), Self::converses, Self::compose)
    }
}

impl Converse for Rcc3 {
    fn converse(self) -> Self {
        self
    }
}

impl Converse for Rcc2 {
    fn converse(self) -> Self {
        self
    }
}

impl Compose for Rcc8 {
    /// Looks up the composition in the table of Cui, Cohn and Randell 1993.
    fn compose(self, next: Self) -> RelationSet<Self> {
        use Rcc8::{Dc, Ec, Eq, Ntpp, Ntppi, Po, Tpp, Tppi};
        let all = Rcc8::ALL;
        let relations: &[Self] = match (self, next) {
            (Eq, other) | (other, Eq) => return other.into(),
            (Dc, Dc) | (Po, Po) | (Ntpp, Ntppi) => all,
            (Dc, Tppi | Ntppi) | (Tpp | Ntpp, Dc) | (Ec, Ntppi) | (Ntpp, Ec) => &[Dc],
            (Dc, _) | (Ec, Po) | (Tpp | Ntpp, Po) | (Ntpp, Tppi) => &[Dc, Ec, Po, Tpp, Ntpp],
            (_, Dc) | (Po, Ec | Tppi | Ntppi) | (Tpp, Ntppi) => &[Dc, Ec, Po, Tppi, Ntppi],
            (Ec, Ec) | (Tpp, Tppi) => &[Dc, Ec, Po, Tpp, Tppi, Eq],
            (Ec, Tpp) => &[Ec, Po, Tpp, Ntpp],
            (Ec, Ntpp) | (Po, Tpp | Ntpp) | (Tppi, Ntpp) => &[Po, Tpp, Ntpp],
            (Ec, Tppi) | (Tpp, Ec) => &[Dc, Ec],
            (Tpp, Tpp) => &[Tpp, Ntpp],
            (Tpp, Ntpp) | (Ntpp, Tpp | Ntpp) => &[Ntpp],
            (Tppi, Ec) => &[Ec, Po, Tppi, Ntppi],
            (Tppi, Po) | (Ntppi, Ec | Po | Tpp) => &[Po, Tppi, Ntppi],
            (Tppi, Tpp) => &[Po, Tpp, Tppi, Eq],
            (Tppi, Tppi) => &[Tppi, Ntppi],
            (Tppi, Ntppi) | (Ntppi, Tppi | Ntppi) => &[Ntppi],
            (Ntppi, Ntpp) => &[Po, Tpp, Ntpp, Tppi, Ntppi, Eq],
        };
        relations.iter().copied().collect()
    }
}

macro_rules! coarse {
    ($($name:ident)+) => { $(
        impl Compose for $name {
            fn compose(self, next: Self) -> RelationSet<Self> {
                coarse_composition(self, next)
            }
        }
    )+ };
}
coarse!(Rcc5 Rcc4 Rcc3 Rcc2);

/// [`Rcc8`], or a coarser relation, of two rectangles.
#[derive(Debug, Clone, Copy)]
pub struct Regions<R = Rcc8> {
    tolerance: f64,
    relation: std::marker::PhantomData<R>,
}

impl<R> Regions<R> {
    /// Creates the calculus where sides that differ by no more than `tolerance` are aligned.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the tolerance is negative or not finite.
    pub fn new(tolerance: f64) -> Result<Self, Error> {
        Ok(Self { tolerance: not_negative("tolerance", tolerance)?, relation: std::marker::PhantomData })
    }
}

impl<R> Default for Regions<R> {
    fn default() -> Self {
        Self { tolerance: 0.0, relation: std::marker::PhantomData }
    }
}

impl<R: Relation + From<Rcc8>> Calculus for Regions<R> {
    type Scene = [Rect; 2];
    type Relation = R;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [a, b]: &Self::Scene) -> Option<R> {
        Some(Rcc8::of(*a, *b, self.tolerance).into())
    }
}
