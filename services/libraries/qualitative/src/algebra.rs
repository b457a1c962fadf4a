//! Traits and sets shared by all calculi: base relations, conceptual neighbourhood, converse and composition.
//!
//! The base relations of a calculus are jointly exhaustive and pairwise disjoint, so exactly one of them holds. Conceptual
//! neighbourhood (Freksa 1991) follows from continuity by the theory of dominance (Galton 2001): a relation that is an
//! equation, such as "touches" or "0", holds at the very instant that ends or begins a period of another relation. A
//! calculus therefore only has to state which relations may hold at the end of which others; see [`Relation::limits_to`].
//! Composition here is weak composition: the set of all relations that some triple of objects realises.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use crate::error::Error;

/// Maximum number of base relations in a calculus. OPRA_4 has the most, with 272.
pub const MAX_RELATIONS: usize = 320;
const WORDS: usize = MAX_RELATIONS / 64;

/// A base relation of a calculus.
pub trait Relation: Copy + Eq + fmt::Debug + fmt::Display + FromStr<Err = Error> + 'static {
    /// The identifier of the calculus, as in QSRlib if QSRlib has that calculus.
    const CALCULUS: &'static str;
    /// Number of base relations, at most [`MAX_RELATIONS`].
    const COUNT: usize;

    /// Returns the index of this relation among the base relations, counted from 0.
    fn index(self) -> usize;

    /// Returns the relation at the given index, or `None` if the index is [`Self::COUNT`] or more.
    fn from_index(index: usize) -> Option<Self>;

    /// Returns true if `instant` may hold at the instant that ends a period in which `self` held.
    ///
    /// Since time may run backwards, the same pairs also determine which relations may hold right after an instant. By convention,
    /// no relation limits to itself.
    fn limits_to(self, instant: Self) -> bool;

    /// Returns all base relations, in index order.
    fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).filter_map(Self::from_index)
    }

    /// Returns true if continuous motion can lead from one relation to the other with no third relation in between. This is
    /// symmetric, and no relation is its own neighbour.
    fn is_neighbour(self, other: Self) -> bool {
        self != other && (self.limits_to(other) || other.limits_to(self))
    }

    /// Returns the conceptual neighbours of this relation.
    fn neighbours(self) -> RelationSet<Self> {
        Self::all().filter(|other| self.is_neighbour(*other)).collect()
    }

    /// Returns the relation that must have held between two observations that are not neighbours, namely the only relation that
    /// is a neighbour of both. Returns `None` if nothing is missing, or if several relations could have held.
    fn between(self, next: Self) -> Option<Self> {
        if self == next || self.is_neighbour(next) {
            return None;
        }
        let mut common = Self::all().filter(|via| self.is_neighbour(*via) && next.is_neighbour(*via));
        common.next().filter(|_| common.next().is_none())
    }
}

/// Base relations whose converses are base relations too.
pub trait Converse: Relation {
    /// Returns the relation of b to a, given `self` as the relation of a to b.
    fn converse(self) -> Self;
}

/// Base relations with a known composition.
pub trait Compose: Relation {
    /// Returns all relations that a may have to c, given `self` as the relation of a to b and `next` as that of b to c.
    fn compose(self, next: Self) -> RelationSet<Self>;
}

/// A set of base relations, used when it is not known which of them holds.
pub struct RelationSet<R> {
    words: [u64; WORDS],
    relation: PhantomData<R>,
}

impl<R: Relation> RelationSet<R> {
    /// The empty set, which represents a contradiction.
    pub const EMPTY: Self = Self { words: [0; WORDS], relation: PhantomData };

    /// Returns the set of all relations, which means that nothing is known.
    pub fn universal() -> Self {
        R::all().collect()
    }

    /// Returns the set of relations given by a bit mask over the first 128 relations.
    pub(crate) fn from_bits(bits: u128) -> Self {
        let mut words = [0; WORDS];
        (words[0], words[1]) = (bits as u64, (bits >> 64) as u64);
        Self { words, relation: PhantomData }
    }

    /// Adds a relation to the set.
    pub fn insert(&mut self, relation: R) {
        self.words[relation.index() / 64] |= 1 << (relation.index() % 64);
    }

    /// Returns true if the set contains the relation.
    pub fn contains(&self, relation: R) -> bool {
        self.words[relation.index() / 64] >> (relation.index() % 64) & 1 == 1
    }

    /// Returns the relations that are in either set.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { words: std::array::from_fn(|i| self.words[i] | other.words[i]), ..self }
    }

    /// Returns the relations that are in both sets.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self { words: std::array::from_fn(|i| self.words[i] & other.words[i]), ..self }
    }

    /// Returns the indices of the relations in the set, in ascending order.
    pub(crate) fn indices(self) -> impl Iterator<Item = usize> {
        self.words.into_iter().enumerate().flat_map(|(at, word)| {
            let rests = std::iter::successors(Some(word), |rest| Some(rest & rest.wrapping_sub(1)));
            rests.take_while(|rest| *rest != 0).map(move |rest| 64 * at + rest.trailing_zeros() as usize)
        })
    }

    /// Returns the number of relations in the set.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Returns true if the set contains no relation.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the relations in the set, in index order.
    pub fn iter(&self) -> impl Iterator<Item = R> + use<R> {
        self.indices().filter_map(R::from_index)
    }

    /// Returns the converse of every relation in the set.
    #[must_use]
    pub fn converse(self) -> Self
    where
        R: Converse,
    {
        self.iter().map(R::converse).collect()
    }

    /// Returns the union of the compositions of each relation in `self` with each relation in `next`.
    #[must_use]
    pub fn compose(self, next: Self) -> Self
    where
        R: Compose,
    {
        let pairs = self.iter().flat_map(|a| next.iter().map(move |b| a.compose(b)));
        pairs.fold(Self::EMPTY, Self::union)
    }
}

impl<R> Clone for RelationSet<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for RelationSet<R> {}

impl<R> PartialEq for RelationSet<R> {
    fn eq(&self, other: &Self) -> bool {
        self.words == other.words
    }
}

impl<R> Eq for RelationSet<R> {}

impl<R: Relation> FromIterator<R> for RelationSet<R> {
    fn from_iter<I: IntoIterator<Item = R>>(relations: I) -> Self {
        let mut set = Self::EMPTY;
        relations.into_iter().for_each(|relation| set.insert(relation));
        set
    }
}

impl<R: Relation> From<R> for RelationSet<R> {
    fn from(relation: R) -> Self {
        Self::from_iter([relation])
    }
}

impl<R: Relation> fmt::Display for RelationSet<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{{")?;
        for (i, relation) in self.iter().enumerate() {
            write!(f, "{}{relation}", if i == 0 { "" } else { " " })?;
        }
        write!(f, "}}")
    }
}

impl<R: Relation> fmt::Debug for RelationSet<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Returns the error for a word that names no relation of the calculus.
pub(crate) fn unknown<R: Relation>(found: &str) -> Error {
    let expected = R::all().map(|relation| relation.to_string()).collect::<Vec<_>>().join(" ");
    Error::UnknownRelation { calculus: R::CALCULUS, expected, found: found.to_owned() }
}

/// Declares a calculus whose base relations are words: the enum, its order, and conversion to and from the words. The
/// function given as `limits` becomes its [`Relation::limits_to`].
macro_rules! words {
    ($(#[$doc:meta])* $name:ident, $calculus:literal, limits = $limits:expr, { $($(#[$of:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$of])* $variant,)+ }

        impl $name {
            /// All base relations in index order.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// Returns the word for the relation, as written by QSRlib.
            pub const fn word(self) -> &'static str {
                match self { $(Self::$variant => $word,)+ }
            }
        }

        impl $crate::algebra::Relation for $name {
            const CALCULUS: &'static str = $calculus;
            const COUNT: usize = Self::ALL.len();

            fn index(self) -> usize {
                self as usize
            }

            fn from_index(index: usize) -> Option<Self> {
                Self::ALL.get(index).copied()
            }

            fn limits_to(self, instant: Self) -> bool {
                let limits: fn(Self, Self) -> bool = $limits;
                self != instant && limits(self, instant)
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }

        impl std::str::FromStr for $name {
            type Err = $crate::error::Error;

            fn from_str(word: &str) -> Result<Self, Self::Err> {
                let found = Self::ALL.iter().find(|relation| relation.word().eq_ignore_ascii_case(word.trim()));
                found.copied().ok_or_else(|| $crate::algebra::unknown::<Self>(word))
            }
        }
    };
}
pub(crate) use words;
