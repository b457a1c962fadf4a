//! A navigator with a belief, which carries a list of landmarks instead of a map of symbols. This method is our own.
//!
//! A custom map says what to do, but not where anything is. From the positions of the landmarks ([`Chart`]), a navigator can work
//! out by itself which of them a movement attains and what the surroundings look like there. It maintains the probability of being
//! at each of them, and decides after each movement where to go next ([`policy`]).
//!
//! The model of possible outcomes is that of branching maps ([`crate::branching::model`]), which the navigator simulates from its
//! own list. Landmarks are recognised by the same signs, namely the meanings of words and the number of dots in each quadrant, so
//! the two methods differ only in what the navigator carries and remembers.

pub mod policy;

use std::sync::Arc;

use rand::RngExt;
use sketchnav_schemas::seed::stream;

use crate::arrival::{Pilot, Tally, fly, surroundings};
use crate::atlas::Atlas;
use crate::branching::model::Model;
use crate::branching::words;
use crate::error::Error;
use crate::geometry::Point;
use crate::navigator::Navigator;
use crate::path::{Path, Start};
use crate::plane::{DotId, Plane};
use crate::reliability::Reliability;
use crate::transitions::Kinds;
use policy::Policy;

/// Maximum number of landmarks of a chart. The belief contains a probability for each.
pub const MOST_LANDMARKS: usize = 512;

/// The landmarks known to a navigator.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Position of each landmark, in single precision as in messages.
    landmarks: Vec<Point>,
    /// Standard deviation of a position on each axis.
    sigma: f64,
}

impl Chart {
    /// Creates a chart of landmarks. `sigma` is the standard deviation of a position on each axis. Rejects more than
    /// [`MOST_LANDMARKS`].
    pub fn new(landmarks: impl IntoIterator<Item = Point>, sigma: f64) -> Result<Self, Error> {
        let single = |at: Point| Point::new(f64::from(at.x as f32), f64::from(at.y as f32));
        let landmarks: Vec<_> = landmarks.into_iter().map(single).collect();
        if landmarks.len() > MOST_LANDMARKS {
            let found = landmarks.len() as f64;
            return Err(Error::Parameter { what: "landmarks of a chart", expected: "at most 512", found });
        }
        Ok(Self { landmarks, sigma })
    }

    /// Returns the positions of the landmarks.
    pub fn landmarks(&self) -> &[Point] {
        &self.landmarks
    }

    /// Returns the standard deviation of a position on each axis.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Simulates the possible outcomes at each landmark, with `trials` trials. `pilot` is the navigator, and
    /// the error of its map is that of the chart.
    pub fn model(&self, pilot: &Pilot, trials: u32, seed: u64) -> Result<Model, Error> {
        let mut pilot = *pilot;
        pilot.noise.map_sigma = self.sigma;
        let words = words(pilot.settings.vocabulary);
        let kinds = Kinds { words: &words, trajectories: true };
        let plane = Plane::new(self.landmarks.clone())?;
        let dots = (0..plane.len() as DotId).collect();
        let atlas = Atlas::new(plane, pilot.settings.window, kinds, Reliability::fitted(pilot.noise));
        Ok(Model::new(&atlas, &pilot, dots, &words, trials, stream(seed, "directions/belief").random()))
    }

    /// Returns the probability of each landmark being closest to a position. `sigma` is the standard deviation of a position in the
    /// view.
    fn closest_to(&self, at: Point, sigma: f64) -> Vec<f32> {
        let squared = |landmark: &Point| (*landmark - at).norm_squared();
        let least = self.landmarks.iter().map(squared).fold(f64::INFINITY, f64::min);
        // A Gaussian whose variance is that of the difference of two positions, each with both errors.
        let spread = 4.0 * (sigma * sigma + self.sigma * self.sigma);
        let weight = |off: f64| if off > 0.0 { (-off / spread).exp() } else { 1.0 };
        let weights: Vec<f64> = self.landmarks.iter().map(|at| weight(squared(at) - least)).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| (weight / sum) as f32).collect()
    }
}

/// A journey by a chart, from its start to its goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Journey {
    /// Position of the window's centre at the start.
    pub start: Point,
    /// The goal, as the number of a landmark in the chart.
    pub goal: u16,
}

/// A chart, as produced by the map-maker.
#[derive(Debug, Clone, PartialEq)]
pub struct Charted {
    /// The chart.
    pub chart: Chart,
    /// The dot of the map-maker's plane that corresponds to each landmark, in ascending order.
    pub dots: Vec<DotId>,
}

impl Charted {
    /// Charts the dots nearest to some paths. On a small plane, these are all its dots.
    pub fn new(atlas: &Atlas, paths: &[&Path], sigma: f64) -> Result<Self, Error> {
        let mut dots: Vec<DotId> = (0..atlas.plane.len() as DotId).collect();
        if dots.len() > MOST_LANDMARKS {
            let legs: Vec<[Point; 2]> = paths.iter().flat_map(|path| legs(atlas, path)).collect();
            let off = |dot: DotId| {
                let offs = legs.iter().map(|leg| distance_to(*leg, atlas.plane.dot(dot)));
                offs.fold(f64::INFINITY, f64::min)
            };
            let mut far: Vec<(f64, DotId)> = dots.iter().map(|&dot| (off(dot), dot)).collect();
            far.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            dots = far.into_iter().take(MOST_LANDMARKS).map(|(_, dot)| dot).collect();
            dots.sort_unstable();
        }
        let chart = Chart::new(dots.iter().map(|&dot| atlas.plane.dot(dot)), sigma)?;
        Ok(Self { chart, dots })
    }

    /// Returns the journey from a start to a dot, or `None` if the chart doesn't have the dot.
    pub fn journey(&self, start: Start, goal: DotId) -> Option<Journey> {
        let goal = self.dots.binary_search(&goal).ok()?;
        Some(Journey { start: start.centre, goal: goal as u16 })
    }

    /// Simulates journeys over planes that may be the true one, and counts how they end.
    pub fn simulate(
        &self,
        atlas: &Atlas,
        pilot: &Pilot,
        (model, journey): (&Arc<Model>, Journey),
        journeys: u32,
        round: (u64, &str),
    ) -> Result<Tally, Error> {
        let navigator = navigator(&self.chart, pilot, model, journey)?;
        let near = surroundings(atlas, journey.start, &self.dots);
        let (from, mut tally) = ((journey.start, pilot.noise), Tally::default());
        fly(&navigator, &near, atlas.plane.walls(), from, journeys, round, |report| tally.add(report.kind))?;
        Ok(tally)
    }
}

/// Returns a navigator that uses a chart.
pub fn navigator(
    chart: &Chart,
    pilot: &Pilot,
    model: &Arc<Model>,
    journey: Journey,
) -> Result<Navigator<Policy>, Error> {
    Navigator::guided(pilot.settings, Policy::new(chart, pilot.noise.sigma, model.clone(), journey)?)
}

/// Returns the legs of a path, each from one landmark to the next. A path without legs has one from its landmark to itself.
fn legs(atlas: &Atlas, path: &Path) -> Vec<[Point; 2]> {
    let landmarks: Vec<Point> = path.landmarks().into_iter().map(|dot| atlas.plane.dot(dot)).collect();
    match landmarks[..] {
        [only] => vec![[only, only]],
        _ => landmarks.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
    }
}

/// Returns the distance of a position from a line segment.
fn distance_to([from, to]: [Point; 2], at: Point) -> f64 {
    let (way, off) = (to - from, at - from);
    let length = way.norm_squared();
    let share = if length > 0.0 { (off.dot(way) / length).clamp(0.0, 1.0) } else { 0.0 };
    (off - way * share).norm()
}

#[cfg(test)]
mod tests;
