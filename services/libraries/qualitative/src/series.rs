//! Series of relations: from samples in time to what held over which period.
//!
//! A [`Stream`] takes one sample at a time and keeps only the last; it allocates nothing. [`series`] does the same for a whole
//! recording.
//!
//! **Times.** A relation of one time (RCC, directions) has the time of its sample as [`Timed::from_s`] and
//! [`Timed::to_s`]. A relation of motion (QTC, moving or stationary) has two samples: `from_s` is the time of the first, to
//! whose poses "towards" and "left" refer, and `to_s` that of the second.
//!
//! **Gaps.** A sample may have no scene, because an object was not seen. What was seen before a gap is not compared with what
//! was seen after it: no motion, no insertion, no neighbourhood. A pause longer than [`Options::max_gap_s`] is a gap too.

use serde::{Deserialize, Serialize};

use crate::algebra::Relation;
use crate::calculus::Calculus;
use crate::error::Error;

/// What is done with a series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Whether consecutive equal relations are merged.
    pub collapse: bool,
    /// Whether relations that continuous motion must have passed through between two observations are inserted
    /// ([`Relation::between`]).
    pub validate: bool,
    /// The longest pause between two samples that belong together, in seconds; `None` for any.
    pub max_gap_s: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { collapse: true, validate: true, max_gap_s: None }
    }
}

/// How a relation follows the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Change {
    /// Nothing was seen just before: the beginning, or the end of a gap.
    First,
    /// The same relation continues.
    Same,
    /// A conceptual neighbour of the relation before.
    Neighbour,
    /// No neighbour: something was missed between the samples.
    Jump,
    /// It was not observed, but must have held for an instant between two observations.
    Inserted,
}

/// A relation and when it held.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timed<R> {
    /// The relation.
    pub relation: R,
    /// The time of the first sample that shows it, in seconds. Of an inserted relation: of the sample before it.
    pub from_s: f64,
    /// The time of the last sample that shows it, in seconds. Of an inserted relation: of the sample after it.
    pub to_s: f64,
    /// How it follows the relation before.
    pub change: Change,
}

/// What a sample adds to a series: nothing, a relation, or an inserted relation and another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step<R> {
    inserted: Option<Timed<R>>,
    observed: Option<Timed<R>>,
}

impl<R> Step<R> {
    const NOTHING: Self = Self { inserted: None, observed: None };

    /// The relation that was observed; `None` if it continues and equal relations are merged.
    pub fn observed(self) -> Option<Timed<R>> {
        self.observed
    }

    /// The relation that was inserted before it.
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

/// The state of a stream, for checkpoints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State<S, R> {
    samples: usize,
    time_s: Option<f64>,
    /// The last scene, unless there is a gap after it.
    scene: Option<S>,
    /// The last relation and when it was first seen, unless there is a gap after it.
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
    /// A stream that has seen nothing.
    pub fn new(calculus: C, options: Options) -> Self {
        Self::resumed(calculus, options, State::default())
    }

    /// A stream that continues from the state of another.
    pub fn resumed(calculus: C, options: Options, state: State<C::Scene, C::Relation>) -> Self {
        Self { calculus, options, state }
    }

    /// Its state.
    pub fn state(&self) -> State<C::Scene, C::Relation> {
        self.state
    }

    /// The calculus with its parameters.
    pub fn calculus(&self) -> &C {
        &self.calculus
    }

    /// What holds according to the last sample, and since when; `None` in a gap.
    pub fn current(&self) -> Option<Timed<C::Relation>> {
        let ((relation, from_s), to_s) = (self.state.last?, self.state.time_s?);
        Some(Timed { relation, from_s, to_s, change: Change::Same })
    }

    /// Takes a sample: the scene at a time, `None` if not all of its objects were seen.
    ///
    /// # Errors
    /// [`Error::Time`] if the time is not a number later than that of the sample before; the stream is then unchanged.
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

/// The series of relations of a recording. If equal relations are merged, [`Timed::to_s`] is the time of the last sample that
/// shows the relation.
///
/// # Errors
/// [`Error::Time`] if a sample is not later than the one before.
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

/// Joins the tracks of two objects into scenes: at each time in either track, both objects or nothing.
///
/// The times of a track must increase; only equal times count as the same.
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
        // A time that is not a number belongs to neither; it is passed on, and rejected by the stream.
        if a.is_none() && b.is_none() {
            (i, j) = (i + 1, j + 1);
        }
        Some((time_s, a.zip(b).map(|(a, b)| [a.1, b.1])))
    })
}
