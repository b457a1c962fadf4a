//! What calculi have in common: base relations, sets of them, conceptual neighbourhood, converse, composition.
//!
//! The base relations of a calculus are jointly exhaustive and pairwise disjoint: exactly one holds. Neighbourhood
//! follows from continuity (Freksa 1991) by the theory of dominance (Galton 2001). A relation that is an equation, such as
//! "touches" or "0", holds at the instant that ends or begins a period of another. Each calculus therefore says only which
//! relation may hold at the end of which: [`Relation::limits_to`]. Composition is weak composition: the set of all relations
//! that some three objects show.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use crate::error::Error;

/// How many base relations a calculus may have at most.
pub const MAX_RELATIONS: usize = 192;
const WORDS: usize = MAX_RELATIONS / 64;

/// A base relation of a calculus.
pub trait Relation: Copy + Eq + fmt::Debug + fmt::Display + FromStr<Err = Error> + 'static {
    /// The identifier of the calculus; QSRlib's if it has one.
    const CALCULUS: &'static str;
    /// How many base relations there are; at most [`MAX_RELATIONS`].
    const COUNT: usize;

    /// Its index among the base relations, from 0.
    fn index(self) -> usize;

    /// The relation at an index; `None` from [`Self::COUNT`] on.
    fn from_index(index: usize) -> Option<Self>;

    /// Whether `instant` may hold at the instant that ends a period in which `self` held.
    ///
    /// Time may run backwards, so the same pairs say what may hold after an instant. No relation limits to itself here.
    fn limits_to(self, instant: Self) -> bool;

    /// All base relations, in their order.
    fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).filter_map(Self::from_index)
    }

    /// Whether continuous motion leads from one to the other with nothing in between. It is symmetric, and nothing is
    /// its own neighbour.
    fn is_neighbour(self, other: Self) -> bool {
        self != other && (self.limits_to(other) || other.limits_to(self))
    }

    /// The conceptual neighbours.
    fn neighbours(self) -> RelationSet<Self> {
        Self::all().filter(|other| self.is_neighbour(*other)).collect()
    }

    /// What must have held between two observations that are not neighbours: the one relation that is a neighbour of
    /// both. `None` if nothing is missing, or if several could have held.
    fn between(self, next: Self) -> Option<Self> {
        if self == next || self.is_neighbour(next) {
            return None;
        }
        let mut common = Self::all().filter(|via| self.is_neighbour(*via) && next.is_neighbour(*via));
        common.next().filter(|_| common.next().is_none())
    }
}

/// Base relations whose converse is a base relation.
pub trait Converse: Relation {
    /// The relation of b to a, `self` being that of a to b.
    fn converse(self) -> Self;
}

/// Base relations whose composition is known.
pub trait Compose: Relation {
    /// Every relation that a may have to c, `self` being that of a to b and `next` that of b to c.
    fn compose(self, next: Self) -> RelationSet<Self>;
}

/// A set of base relations, for when it is not known which of them holds.
pub struct RelationSet<R> {
    words: [u64; WORDS],
    relation: PhantomData<R>,
}

impl<R: Relation> RelationSet<R> {
    /// No relation: a contradiction.
    pub const EMPTY: Self = Self { words: [0; WORDS], relation: PhantomData };

    /// Every relation: nothing is known.
    pub fn universal() -> Self {
        R::all().collect()
    }

    /// Adds a relation.
    pub fn insert(&mut self, relation: R) {
        self.words[relation.index() / 64] |= 1 << (relation.index() % 64);
    }

    /// Whether a relation is in it.
    pub fn contains(&self, relation: R) -> bool {
        self.words[relation.index() / 64] >> (relation.index() % 64) & 1 == 1
    }

    /// The relations in either.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { words: std::array::from_fn(|i| self.words[i] | other.words[i]), ..self }
    }

    /// The relations in both.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self { words: std::array::from_fn(|i| self.words[i] & other.words[i]), ..self }
    }

    /// How many relations are in it.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether no relation is in it.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The relations in it, in their order.
    pub fn iter(&self) -> impl Iterator<Item = R> {
        R::all().filter(|relation| self.contains(*relation))
    }

    /// The converses of all relations in it.
    #[must_use]
    pub fn converse(self) -> Self
    where
        R: Converse,
    {
        self.iter().map(R::converse).collect()
    }

    /// The union of the compositions of each relation here with each relation there.
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

/// The error of a word that is none of the relations.
pub(crate) fn unknown<R: Relation>(found: &str) -> Error {
    let expected = R::all().map(|relation| relation.to_string()).collect::<Vec<_>>().join(" ");
    Error::UnknownRelation { calculus: R::CALCULUS, expected, found: found.to_owned() }
}

/// Declares the base relations of a calculus whose relations are words: the enum, its order, its words both ways.
/// The function behind `limits` is its [`Relation::limits_to`].
macro_rules! words {
    ($(#[$doc:meta])* $name:ident, $calculus:literal, limits = $limits:expr, { $($(#[$of:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$of])* $variant,)+ }

        impl $name {
            /// All base relations, in their order.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// The relation's word, as QSRlib writes it.
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
