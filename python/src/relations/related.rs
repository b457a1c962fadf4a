//! The interface of a calculus to Python, in which relations are numbers regardless of the calculus.

use std::sync::OnceLock;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sketchnav_qualitative::tpcc::Permutation;
use sketchnav_qualitative::{
    Calculus, Change, Compose, Converse, Error, Inconsistent, Network, Options, Relation, RelationSet, Table,
    series,
};

use super::arrays::{Array, Scene};

/// The number for no relation.
pub const NONE: i16 = -1;

/// The samples of some objects over time.
pub struct Given {
    /// The objects, in the order of the relation.
    pub arrays: Vec<Array>,
    /// The times of the samples, in seconds, or `None` if samples are one unit of time apart.
    pub times_s: Option<Vec<f64>>,
}

impl Given {
    /// Returns the time of a sample.
    fn time_s(&self, sample: usize) -> f64 {
        self.times_s.as_ref().map_or(sample as f64, |times_s| times_s[sample])
    }
}

/// A series of relations, with one array for each property.
#[derive(Default)]
pub struct Series {
    /// When each relation began to hold, in seconds.
    pub from_s: Vec<f64>,
    /// When each relation was last seen, in seconds.
    pub to_s: Vec<f64>,
    /// The relations.
    pub relations: Vec<i16>,
    /// The kinds of change from the previous relation, as numbers in the order of [`Change`].
    pub changes: Vec<i8>,
}

/// A question about given relations.
pub enum Question {
    /// The relations that b may have to a, if a has one of the given ones to b.
    Converse,
    /// The relations that may follow the given ones when objects move continuously.
    Neighbours,
    /// The relations that a may have to c, if the relations of a to b and of b to c are given.
    Compose,
    /// The relations that the same objects may have if they are named in another order.
    Permuted(Permutation),
}

/// What to compute about a network of relations.
pub enum Task {
    /// The relations that remain after enforcing path consistency.
    Close,
    /// One relation for each pair of objects, such that all of them are consistent.
    Scenario,
    /// For each pair of objects, the relations that occur in at least one scenario.
    Minimal,
}

/// The possible relations of each pair of objects in a network, ordered by the first and then by the second object.
pub type Sets = Vec<Vec<usize>>;

/// A calculus with its parameters.
pub trait Related: Send + Sync {
    /// Returns the words of the relations, in the order of their numbers.
    fn words(&self) -> Vec<String>;

    /// Returns the number of a relation.
    ///
    /// # Errors
    /// If no relation has this word.
    fn parse(&self, word: &str) -> Result<usize, Error>;

    /// Computes the relations of all samples of all tracks.
    ///
    /// # Errors
    /// If a row does not describe an object.
    fn relate(&self, given: &Given, out: &mut [i16]) -> PyResult<()>;

    /// Computes the series of one track.
    ///
    /// # Errors
    /// If a row does not describe an object, or the times do not increase.
    fn series(&self, given: &Given, options: Options) -> PyResult<Series>;

    /// Answers a question, or returns `None` if the calculus has no answer.
    fn answer(&self, question: &Question, relations: &[usize]) -> Option<Vec<usize>>;

    /// Reasons about a network, or returns `None` if the calculus has no table.
    fn reason(&self, task: &Task, objects: usize, sets: &[Vec<usize>]) -> Option<Result<Sets, Inconsistent>>;
}

type Unary<R> = Box<dyn Fn(R) -> RelationSet<R> + Send + Sync>;
type Permuted<R> = fn(R, Permutation) -> RelationSet<R>;
type Binary<R> = Box<dyn Fn(R, R) -> RelationSet<R> + Send + Sync>;

/// A calculus and what is known about its relations.
pub struct Of<C: Calculus> {
    calculus: C,
    /// The words, in the order of the relations. Their number may be below that of the calculus.
    words: Vec<String>,
    /// Whether words are looked up in `words`. If not, the calculus parses them, and also accepts other forms of a word.
    has_own_words: bool,
    converse: Option<Unary<C::Relation>>,
    compose: Option<Binary<C::Relation>>,
    permuted: Option<Permuted<C::Relation>>,
    make_table: Option<Box<dyn Fn() -> Table<C::Relation> + Send + Sync>>,
    table: OnceLock<Table<C::Relation>>,
}

impl<C: Calculus> Of<C> {
    /// Creates a calculus about whose relations nothing else is known.
    pub fn new(calculus: C) -> Self {
        let words = C::Relation::all().map(|relation| relation.to_string()).collect();
        let (converse, compose, permuted, make_table, table) = (None, None, None, None, OnceLock::new());
        Self { calculus, words, has_own_words: false, converse, compose, permuted, make_table, table }
    }

    /// Uses these words instead of those of the calculus.
    pub fn named(self, words: Vec<String>) -> Self {
        Self { words, has_own_words: true, ..self }
    }

    /// Adds the converses of the relations.
    pub fn converses(
        self,
        converse: impl Fn(C::Relation) -> RelationSet<C::Relation> + Send + Sync + 'static,
    ) -> Self {
        Self { converse: Some(Box::new(converse)), ..self }
    }

    /// Adds the compositions of the relations.
    pub fn composed(
        self,
        compose: impl Fn(C::Relation, C::Relation) -> RelationSet<C::Relation> + Send + Sync + 'static,
    ) -> Self {
        Self { compose: Some(Box::new(compose)), ..self }
    }

    /// Adds the relations of the same objects in another order.
    pub fn permuted(self, permuted: Permuted<C::Relation>) -> Self {
        Self { permuted: Some(permuted), ..self }
    }

    /// Adds the table for networks.
    pub fn with_table(self, table: impl Fn() -> Table<C::Relation> + Send + Sync + 'static) -> Self {
        Self { make_table: Some(Box::new(table)), ..self }
    }

    /// Adds converses that are single relations.
    pub fn with_converse(self) -> Self
    where
        C::Relation: Converse,
    {
        self.converses(|relation| relation.converse().into())
    }

    /// Adds the converses, the compositions and the table of the calculus.
    pub fn with_algebra(self) -> Self
    where
        C::Relation: Converse + Compose,
    {
        self.with_converse().composed(C::Relation::compose).with_table(Table::default)
    }

    fn set(&self, numbers: &[usize]) -> RelationSet<C::Relation> {
        numbers.iter().filter_map(|number| C::Relation::from_index(*number)).collect()
    }

    fn samples(&self, given: &Given) -> PyResult<Vec<(f64, Option<C::Scene>)>>
    where
        C::Scene: Scene,
    {
        let [samples, ..] = given.arrays[0].shape();
        (0..samples).map(|i| Ok((given.time_s(i), C::Scene::read(&given.arrays, i, 0)?))).collect()
    }
}

fn numbers<R: Relation>(set: RelationSet<R>) -> Vec<usize> {
    set.iter().map(R::index).collect()
}

fn change(change: Change) -> i8 {
    match change {
        Change::First => 0,
        Change::Same => 1,
        Change::Neighbour => 2,
        Change::Jump => 3,
        Change::Inserted => 4,
    }
}

impl<C: Calculus + Clone + Send + Sync> Related for Of<C>
where
    C::Scene: Scene,
    C::Relation: Send + Sync,
{
    fn words(&self) -> Vec<String> {
        self.words.clone()
    }

    fn parse(&self, word: &str) -> Result<usize, Error> {
        if !self.has_own_words {
            return Ok(word.parse::<C::Relation>()?.index());
        }
        let unknown = || Error::UnknownRelation {
            calculus: C::Relation::CALCULUS,
            expected: self.words.join(" "),
            found: word.to_owned(),
        };
        self.words.iter().position(|own| own == word).ok_or_else(unknown)
    }

    fn relate(&self, given: &Given, out: &mut [i16]) -> PyResult<()> {
        let [times, tracks, _] = given.arrays[0].shape();
        for track in 0..tracks {
            let mut before: Option<C::Scene> = None;
            for time in 0..times {
                let now = C::Scene::read(&given.arrays, time, track)?;
                let elapsed_s =
                    given.time_s(time) - time.checked_sub(1).map_or(0.0, |last| given.time_s(last));
                let before_now = before.as_ref().map(|before| (before, elapsed_s));
                let relation = now.as_ref().and_then(|now| self.calculus.relate(before_now, now));
                out[time * tracks + track] = relation.map_or(NONE, |relation| relation.index() as i16);
                before = now;
            }
        }
        Ok(())
    }

    fn series(&self, given: &Given, options: Options) -> PyResult<Series> {
        let found = series(self.calculus.clone(), options, self.samples(given)?);
        let found = found.map_err(|error| PyValueError::new_err(format!("time_s: {error}")))?;
        let mut series = Series::default();
        for timed in found {
            series.from_s.push(timed.from_s);
            series.to_s.push(timed.to_s);
            series.relations.push(timed.relation.index() as i16);
            series.changes.push(change(timed.change));
        }
        Ok(series)
    }

    fn answer(&self, question: &Question, relations: &[usize]) -> Option<Vec<usize>> {
        let relation = |at: usize| C::Relation::from_index(*relations.get(at)?);
        let first = relation(0)?;
        let mut found = numbers(match question {
            Question::Neighbours => first.neighbours(),
            Question::Converse => self.converse.as_ref()?(first),
            Question::Compose => self.compose.as_ref()?(first, relation(1)?),
            Question::Permuted(by) => self.permuted?(first, *by),
        });
        found.retain(|number| *number < self.words.len());
        Some(found)
    }

    fn reason(&self, task: &Task, objects: usize, sets: &[Vec<usize>]) -> Option<Result<Sets, Inconsistent>> {
        let table = self.table.get_or_init(self.make_table.as_ref()?);
        let pairs = || (0..objects).flat_map(|first| (0..objects).map(move |second| (first, second)));
        let mut network = Network::new(objects);
        for ((first, second), known) in pairs().zip(sets).filter(|((first, second), _)| first != second) {
            network.constrain(first, second, self.set(known)).ok()?;
        }
        let reasoned = match task {
            Task::Close => table.close(&mut network).map(|()| network),
            Task::Minimal => table.minimal(&network),
            Task::Scenario => table
                .close(&mut network)
                .and_then(|()| table.scenario(&network).ok_or(Inconsistent::NoScenario)),
        };
        let sets = |network: Network<C::Relation>| {
            let set = |(first, second)| network.relations(first, second).map_or_else(|_| Vec::new(), numbers);
            pairs().map(set).collect()
        };
        Some(reasoned.map(sets))
    }
}
