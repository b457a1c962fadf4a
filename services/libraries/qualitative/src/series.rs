//! Turns samples over time into series of relations, each with the period during which it held.
//!
//! A [`Stream`] takes one sample at a time. It keeps only the last one and does not allocate. [`series`] does the same for
//! a whole recording.
//!
//! **Times.** A relation that describes a single time (RCC, directions) has the time of its sample as both
//! [`Timed::from_s`] and [`Timed::to_s`]. A relation of motion (QTC, moving or stationary) describes two samples. Its
//! `from_s` is the time of the first, whose poses "towards" and "left" refer to, and its `to_s` is the time of the second.
//!
//! **Gaps.** A sample has no scene if an object was not seen. Relations before and after such a gap are not compared with
//! each other: there is no motion across it, nothing is inserted, and no neighbourhood is checked. A pause longer than
//! [`Options::max_gap_s`] is a gap too.

use serde::{Deserialize, Serialize};

use crate::algebra::Relation;
use crate::calculus::Calculus;
use crate::error::Error;

/// Options for deriving a series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Merge consecutive equal relations.
    pub collapse: bool,
    /// Insert relations that continuous motion must have passed through between two observations. See [`Relation::between`].
    pub validate: bool,
    /// Maximum pause between two samples that belong together, in seconds, or `None` for no limit.
    pub max_gap_s: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { collapse: true, validate: true, max_gap_s: None }
    }
}

/// How a relation follows the preceding one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Change {
    /// The relation is the first in the series or the first after a gap.
    First,
    /// The relation is the same as the preceding one.
    Same,
    /// The relation is a conceptual neighbour of the preceding one.
    Neighbour,
    /// The relation is not a neighbour of the preceding one, so something was missed between the samples.
    Jump,
    /// The relation was not observed, but must have held for an instant between two observations.
    Inserted,
}

/// A relation with the period during which it held.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timed<R> {
    /// The relation.
    pub relation: R,
    /// Time of the first sample that shows the relation, in seconds. For an inserted relation, the time of the sample before
    /// it.
    pub from_s: f64,
    /// Time of the last sample that shows the relation, in seconds. For an inserted relation, the time of the sample after it.
    pub to_s: f64,
    /// Change from the preceding relation to this one.
    pub change: Change,
}

/// The relations that a sample adds to a series: none, an observed one, or an inserted one followed by an observed one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step<R> {
    inserted: Option<Timed<R>>,
    observed: Option<Timed<R>>,
}

impl<R> Step<R> {
    const NOTHING: Self = Self { inserted: None, observed: None };

    /// Returns the observed relation, or `None` if it continues the preceding one and equal relations are merged.
    pub fn observed(self) -> Option<Timed<R>> {
        self.observed
    }

    /// Returns the relation that was inserted before the observed one, if any.
    pub fn inserted(self) -> Option<Timed<R>> {
        self.inserted
    }
}

impl<R> IntoIterator for Step<R> {
    type Item = Timed<R>;
    type IntoIter = std::iter::Flatten<std::array::IntoIter<Option<Timed<R>>, 2>>;

    fn into_iter(self) -> Self::IntoIter {
        [self.inserted, self.observed].into_iter().flatten()
    }
}

/// The state of a stream, for use in checkpoints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State<S, R> {
    samples: usize,
    time_s: Option<f64>,
    /// The last scene, unless there is a gap after it.
    scene: Option<S>,
    /// The last relation and the time when it was first seen, unless there is a gap after it.
    last: Option<(R, f64)>,
}

impl<S, R> Default for State<S, R> {
    fn default() -> Self {
        Self { samples: 0, time_s: None, scene: None, last: None }
    }
}

/// Derives relations from samples, one at a time.
#[derive(Debug, Clone)]
pub struct Stream<C: Calculus> {
    calculus: C,
    options: Options,
    state: State<C::Scene, C::Relation>,
}

impl<C: Calculus> Stream<C> {
    /// Creates a stream that has seen nothing yet.
    pub fn new(calculus: C, options: Options) -> Self {
        Self::resumed(calculus, options, State::default())
    }

    /// Creates a stream that continues from the state of another.
    pub fn resumed(calculus: C, options: Options, state: State<C::Scene, C::Relation>) -> Self {
        Self { calculus, options, state }
    }

    /// Returns the state of the stream, for [`Self::resumed`] to continue from.
    pub fn state(&self) -> State<C::Scene, C::Relation> {
        self.state
    }

    /// Returns the calculus together with its parameters.
    pub fn calculus(&self) -> &C {
        &self.calculus
    }

    /// Returns the relation in the last sample and the time since when it has held, or `None` in a gap.
    pub fn current(&self) -> Option<Timed<C::Relation>> {
        let ((relation, from_s), to_s) = (self.state.last?, self.state.time_s?);
        Some(Timed { relation, from_s, to_s, change: Change::Same })
    }

    /// Takes the scene at a time, or `None` if not all objects were seen.
    ///
    /// # Errors
    /// [`Error::Time`] if the time is not a finite number later than that of the preceding sample. The stream is then left
    /// unchanged.
    pub fn push(&mut self, time_s: f64, scene: Option<C::Scene>) -> Result<Step<C::Relation>, Error> {
        let after_s = self.state.time_s.unwrap_or(f64::NEG_INFINITY);
        if !(time_s > after_s && time_s < f64::INFINITY) {
            return Err(Error::Time { sample: self.state.samples, after_s, found_s: time_s });
        }
        let is_gap = scene.is_none() || self.options.max_gap_s.is_some_and(|most| time_s - after_s > most);
        if is_gap {
            (self.state.scene, self.state.last) = (None, None);
        }
        let before = self.state.scene.as_ref().map(|before| (before, time_s - after_s));
        let relation = scene.as_ref().and_then(|scene| self.calculus.relate(before, scene));
        let from_s = if C::OF_MOTION { after_s } else { time_s };
        let step = relation.map_or(Step::NOTHING, |relation| self.follow(relation, from_s, time_s));
        self.state.samples += 1;
        (self.state.time_s, self.state.scene) = (Some(time_s), scene);
        Ok(step)
    }

    fn follow(&mut self, relation: C::Relation, from_s: f64, to_s: f64) -> Step<C::Relation> {
        let last = self.state.last;
        let is_same = last.is_some_and(|(last, _)| last == relation);
        self.state.last =
            Some((relation, if is_same { last.map_or(from_s, |(_, since_s)| since_s) } else { from_s }));
        if is_same && self.options.collapse {
            return Step::NOTHING;
        }
        let via = last.filter(|_| self.options.validate).and_then(|(last, _)| last.between(relation));
        let inserted = via.map(|via| Timed {
            relation: via,
            from_s: self.state.time_s.unwrap_or(from_s),
            to_s,
            change: Change::Inserted,
        });
        let change = match (last, inserted) {
            (None, _) => Change::First,
            (Some(_), Some(inserted)) if inserted.relation.is_neighbour(relation) => Change::Neighbour,
            (Some((last, _)), _) if last == relation => Change::Same,
            (Some((last, _)), _) if last.is_neighbour(relation) => Change::Neighbour,
            _ => Change::Jump,
        };
        Step { inserted, observed: Some(Timed { relation, from_s, to_s, change }) }
    }
}

/// Returns the series of relations of a recording. If equal relations are merged, [`Timed::to_s`] is the time of the last
/// sample that shows the relation.
///
/// # Errors
/// [`Error::Time`] if a sample is not later than the preceding one.
pub fn series<C: Calculus>(
    calculus: C,
    options: Options,
    samples: impl IntoIterator<Item = (f64, Option<C::Scene>)>,
) -> Result<Vec<Timed<C::Relation>>, Error> {
    let mut stream = Stream::new(calculus, options);
    let mut found: Vec<Timed<C::Relation>> = Vec::new();
    for (time_s, scene) in samples {
        let step = stream.push(time_s, scene)?;
        if step.observed.is_none()
            && let (Some(current), Some(last)) = (stream.current(), found.last_mut())
        {
            last.to_s = current.to_s;
        }
        found.extend(step);
    }
    Ok(found)
}

/// Joins the tracks of two objects into scenes. Each time in either track yields both objects, or `None` if only one was
/// seen.
///
/// The times of each track must increase. Times are only matched if they are exactly equal.
pub fn joined<'a, O: Copy>(
    first: &'a [(f64, O)],
    second: &'a [(f64, O)],
) -> impl Iterator<Item = (f64, Option<[O; 2]>)> + 'a {
    let (mut i, mut j) = (0, 0);
    std::iter::from_fn(move || {
        let (a, b) = (first.get(i), second.get(j));
        let time_s = match (a, b) {
            (Some((a_s, _)), Some((b_s, _))) => a_s.min(*b_s),
            (Some((time_s, _)), None) | (None, Some((time_s, _))) => *time_s,
            (None, None) => return None,
        };
        let a = a.filter(|(at_s, _)| *at_s <= time_s);
        let b = b.filter(|(at_s, _)| *at_s <= time_s);
        i += usize::from(a.is_some());
        j += usize::from(b.is_some());
        // A time that is NaN belongs to neither track. It is passed on so that the stream rejects it.
        if a.is_none() && b.is_none() {
            (i, j) = (i + 1, j + 1);
        }
        Some((time_s, a.zip(b).map(|(a, b)| [a.1, b.1])))
    })
}
