//! Reasoning about networks of relations: algebraic closure (path consistency), scenarios and minimal networks.
//!
//! A [`Network`] has a set of possible relations for each ordered pair of objects. A [`Table`] contains the converses and the
//! compositions of a calculus. Closure removes from R(i, k) every relation that is not in R(i, j) ∘ R(j, k), until nothing
//! changes (Montanari 1974; Allen 1983). A queue contains the pairs whose neighbours have yet to be visited (van Beek and Manchak
//! 1996). Closure takes O(n³) visits for n objects and is sound: relations that it removes cannot hold, and networks that it calls
//! inconsistent are inconsistent.
//!
//! The reverse depends on the calculus. In Allen's algebra, the rectangle algebra, the order of points, RCC8 and RCC5, every closed
//! network of base relations has a model (van Beek 1992; Balbiani et al. 1998; Renz 2002), and in RCC2 every network of base
//! relations has one. Regions may have any number of pieces. In these calculi, [`Table::scenario`] and [`Table::minimal`] are
//! exact. In the others, each scenario is closed, but objects that realise it need not exist.

use std::collections::VecDeque;

use crate::algebra::{Compose, Converse, Relation, RelationSet};
use crate::error::Error;

/// The possible relations between some objects, each counted from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Network<R: Relation> {
    objects: usize,
    /// The relations of object i to object j, at index i · objects + j. The diagonal is not used.
    relations: Vec<RelationSet<R>>,
}

/// Why a network has no model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Inconsistent {
    /// The relation of one object to another contradicts the relation in the reverse order.
    #[error(
        "expected a relation of object {first} to object {second}, found none that is possible in both orders"
    )]
    Pair {
        /// The first object.
        first: usize,
        /// The second object.
        second: usize,
    },
    /// No relation is left that is consistent with the relations to a third object.
    #[error("expected a relation of object {first} to object {second}, found none that object {via} permits")]
    Triangle {
        /// The first object.
        first: usize,
        /// The third object.
        via: usize,
        /// The second object.
        second: usize,
    },
    /// The network is closed, but no choice of a base relation for each pair is.
    #[error("expected a closed network of base relations, found none")]
    NoScenario,
}

impl<R: Relation> Network<R> {
    /// Creates a network in which nothing is known about any pair of objects.
    pub fn new(objects: usize) -> Self {
        Self { objects, relations: vec![RelationSet::universal(); objects * objects] }
    }

    /// Returns the number of objects.
    pub const fn objects(&self) -> usize {
        self.objects
    }

    /// Returns the possible relations of one object to another.
    ///
    /// # Errors
    /// [`Error::Pair`] if an object does not exist, or if both are the same.
    pub fn relations(&self, first: usize, second: usize) -> Result<RelationSet<R>, Error> {
        self.check(first, second)?;
        Ok(self.at(first, second))
    }

    /// Restricts the relations of one object to another to those given.
    ///
    /// # Errors
    /// Any error of [`Self::relations`].
    pub fn constrain(
        &mut self,
        first: usize,
        second: usize,
        to: impl Into<RelationSet<R>>,
    ) -> Result<(), Error> {
        self.check(first, second)?;
        self.set(first, second, self.at(first, second).intersection(to.into()));
        Ok(())
    }

    fn check(&self, first: usize, second: usize) -> Result<(), Error> {
        let is_valid = first != second && first < self.objects && second < self.objects;
        if is_valid { Ok(()) } else { Err(Error::Pair { objects: self.objects, first, second }) }
    }

    fn at(&self, first: usize, second: usize) -> RelationSet<R> {
        self.relations[first * self.objects + second]
    }

    fn set(&mut self, first: usize, second: usize, to: RelationSet<R>) {
        self.relations[first * self.objects + second] = to;
    }

    /// Returns every pair once, with the smaller index first.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<R> {
        let objects = self.objects;
        (0..objects).flat_map(move |first| (first + 1..objects).map(move |second| (first, second)))
    }

    /// Returns the pair with the fewest possible relations among the pairs with more than one.
    fn undecided(&self) -> Option<(usize, usize)> {
        let open = self.pairs().filter(|(first, second)| self.at(*first, *second).len() > 1);
        open.min_by_key(|(first, second)| self.at(*first, *second).len())
    }
}

/// The converses and compositions of all base relations of a calculus.
#[derive(Debug, Clone)]
pub struct Table<R: Relation> {
    universal: RelationSet<R>,
    converses: Vec<RelationSet<R>>,
    /// The composition of relations a and b, at index a · [`Relation::COUNT`] + b.
    compositions: Vec<RelationSet<R>>,
}

impl<R: Compose + Converse> Default for Table<R> {
    fn default() -> Self {
        Self::from_fn(RelationSet::universal(), |relation| relation.converse().into(), R::compose)
    }
}

impl<R: Relation> Table<R> {
    /// Creates the table of a calculus whose converses are sets, or whose composition depends on parameters. `universal` contains
    /// all base relations that exist.
    pub fn from_fn(
        universal: RelationSet<R>,
        converses: impl Fn(R) -> RelationSet<R>,
        compose: impl Fn(R, R) -> RelationSet<R>,
    ) -> Self {
        let compose = |a: R, b: R| {
            let exist = universal.contains(a) && universal.contains(b);
            if exist { compose(a, b) } else { RelationSet::EMPTY }
        };
        Self {
            universal,
            converses: R::all().map(converses).collect(),
            compositions: R::all()
                .flat_map(|a| R::all().map(move |b| (a, b)))
                .map(|(a, b)| compose(a, b))
                .collect(),
        }
    }

    /// Returns all relations that b may have to a, given those of a to b.
    pub fn converse(&self, relations: RelationSet<R>) -> RelationSet<R> {
        relations.indices().fold(RelationSet::EMPTY, |found, i| found.union(self.converses[i]))
    }

    /// Returns all relations that a may have to c, given those of a to b and of b to c.
    pub fn compose(&self, first: RelationSet<R>, next: RelationSet<R>) -> RelationSet<R> {
        if first == self.universal && next == self.universal {
            return self.universal;
        }
        let mut found = RelationSet::EMPTY;
        for a in first.indices() {
            found = next.indices().fold(found, |found, b| found.union(self.compositions[a * R::COUNT + b]));
            if found == self.universal {
                break;
            }
        }
        found
    }

    /// Closes a network: removes all relations that the relations to some third object rule out.
    ///
    /// # Errors
    /// [`Inconsistent`] if no relation is left for a pair. The network then has no model, and is left partially closed.
    pub fn close(&self, network: &mut Network<R>) -> Result<(), Inconsistent> {
        for (first, second) in network.pairs() {
            let both = network.at(first, second).intersection(self.universal);
            self.narrow(network, (first, second), both).ok_or(Inconsistent::Pair { first, second })?;
        }
        let all = network.pairs().collect();
        self.propagate(network, all)
    }

    /// Restricts a pair in both orders. Returns whether that changed anything, or `None` if no relation is left.
    fn narrow(
        &self,
        network: &mut Network<R>,
        (first, second): (usize, usize),
        to: RelationSet<R>,
    ) -> Option<bool> {
        let (there, back) = (network.at(first, second), network.at(second, first));
        let narrowed = there.intersection(to).intersection(self.converse(back));
        let narrowed_back = back.intersection(self.converse(narrowed));
        network.set(first, second, narrowed);
        network.set(second, first, narrowed_back);
        let is_possible = !narrowed.is_empty() && !narrowed_back.is_empty();
        is_possible.then_some(narrowed != there || narrowed_back != back)
    }

    /// Visits the triangles of the pairs in the queue, and those of all pairs that change on the way.
    fn propagate(
        &self,
        network: &mut Network<R>,
        mut queue: VecDeque<(usize, usize)>,
    ) -> Result<(), Inconsistent> {
        let objects = network.objects;
        let place = |(first, second): (usize, usize)| first.min(second) * objects + first.max(second);
        let mut is_queued = vec![false; objects * objects];
        queue.iter().for_each(|pair| is_queued[place(*pair)] = true);
        while let Some(pair @ (i, j)) = queue.pop_front() {
            is_queued[place(pair)] = false;
            for k in (0..objects).filter(|k| *k != i && *k != j) {
                for [first, via, second] in [[i, j, k], [j, i, k]] {
                    let composed = self.compose(network.at(first, via), network.at(via, second));
                    let is_changed = self
                        .narrow(network, (first, second), composed)
                        .ok_or(Inconsistent::Triangle { first, via, second })?;
                    if is_changed && !is_queued[place((first, second))] {
                        is_queued[place((first, second))] = true;
                        queue.push_back((first, second));
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns a closed network that has one of the given relations for each pair, or `None` if there is none. The search
    /// takes exponential time in the worst case.
    pub fn scenario(&self, network: &Network<R>) -> Option<Network<R>> {
        let mut closed = network.clone();
        self.close(&mut closed).ok()?;
        self.decide(closed)
    }

    /// Searches for a scenario of a closed network.
    fn decide(&self, closed: Network<R>) -> Option<Network<R>> {
        let Some(pair) = closed.undecided() else { return Some(closed) };
        closed.at(pair.0, pair.1).iter().find_map(|choice| self.decide(self.chosen(&closed, pair, choice)?))
    }

    /// Returns a closed network with a base relation chosen for a pair, or `None` if the choice is inconsistent.
    fn chosen(&self, closed: &Network<R>, pair: (usize, usize), choice: R) -> Option<Network<R>> {
        let mut network = closed.clone();
        self.narrow(&mut network, pair, choice.into())?;
        self.propagate(&mut network, VecDeque::from([pair])).ok()?;
        Some(network)
    }

    /// Returns the minimal network, which contains exactly the relations that occur in some scenario. This takes one search for
    /// each relation in question.
    ///
    /// # Errors
    /// [`Inconsistent`] if the network has no scenario.
    pub fn minimal(&self, network: &Network<R>) -> Result<Network<R>, Inconsistent> {
        let mut closed = network.clone();
        self.close(&mut closed)?;
        let mut minimal = self.decide(closed.clone()).ok_or(Inconsistent::NoScenario)?;
        for pair @ (first, second) in closed.pairs() {
            for choice in closed.at(first, second).iter() {
                if minimal.at(first, second).contains(choice) {
                    continue;
                }
                let scenario = self.chosen(&closed, pair, choice).and_then(|chosen| self.decide(chosen));
                for (known, found) in
                    minimal.relations.iter_mut().zip(scenario.iter().flat_map(|s| &s.relations))
                {
                    *known = known.union(*found);
                }
            }
        }
        Ok(minimal)
    }
}
