//! Estimates the probability of arrival by simulating the navigator, and finds the path that maximises it.
//! The paper has no counterpart of this.
//!
//! The map-maker knows both its own errors and the navigator's. It simulates:
//! 1. each transition on its own, purely geometrically, without and with verification, to estimate how often position errors lead
//!    to another dot. In a search for the most reliable path, these estimates replace equations 1 and 2. They also show where
//!    verification is worthwhile, which is not the case everywhere, since a count may be misread as well;
//! 2. whole journeys with the navigator, for a few candidate plans, including verification, recovery and missed dots. The best
//!    candidate is kept;
//! 3. further journeys with that plan. The fraction that arrives is the stated probability of the plan. These journeys use fresh
//!    random numbers, so the choice among candidates doesn't bias the estimate.
//!
//! In each simulation, the dots are displaced according to the map-maker's own errors.

mod trial;

use std::sync::Arc;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::seed::stream;

use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::error;
use crate::geometry::Point;
use crate::markers::Markers;
use crate::navigator::guide::Guide;
use crate::navigator::{Navigator, Settings};
use crate::path::{Atlas, Measure, Objective, Path, Start, Weights, best};
use crate::plan::{Plan, Verify, Weakest};
use crate::plane::{DotId, Plane};
use crate::traversal::{Kind, Noise, Report, Traversal};
use crate::walls::Walls;
use crate::wording::reworded;
pub(crate) use trial::Trial;
pub use trial::{Estimate, estimates};

/// Distance around a path within which the plane is simulated, in window sides.
const REACH: f64 = 4.0;
/// Maximum number of dots of a plane that is simulated as a whole. Larger planes are simulated only near their paths.
const WHOLE: usize = 1_000;

/// The navigator, and the errors that the map-maker accounts for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pilot {
    /// The navigator's settings.
    pub settings: Settings,
    /// The errors of the navigator and of the map-maker.
    pub noise: Noise,
}

/// The amount of simulation for a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Number of trials of each transition.
    pub trials: u32,
    /// Number of journeys for each candidate plan.
    pub trial_journeys: u32,
    /// Number of journeys for the stated probability.
    pub journeys: u32,
}

impl Effort {
    /// The effort for a plan that will actually be used. It takes half a second for a hundred dots.
    pub const USUAL: Self = Self { trials: 128, trial_journeys: 128, journeys: 512 };
}

/// Number of journeys by how they ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Tally {
    /// Number of journeys of each kind, in the order of [`Kind::ALL`].
    pub counts: [u32; 6],
}

impl Tally {
    /// Counts one journey.
    pub fn add(&mut self, kind: Kind) {
        self.counts[kind as usize] += 1;
    }

    /// Adds the counts of another tally.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts).for_each(|(own, more)| *own += more);
    }

    /// Returns the number of journeys.
    pub fn journeys(&self) -> u32 {
        self.counts.iter().sum()
    }

    /// Returns the number of journeys that arrived.
    pub fn arrivals(&self) -> u32 {
        Kind::ALL.iter().zip(self.counts).filter(|(kind, _)| kind.is_success()).map(|(_, count)| count).sum()
    }

    /// Returns the fraction of journeys that arrived, after adding one success and one failure (Laplace's rule of succession).
    pub fn probability(&self) -> f64 {
        f64::from(self.arrivals() + 1) / f64::from(self.journeys() + 2)
    }
}

/// Simulates journeys with a plan. With the same seed and round, every plan is subject to the same errors.
pub fn simulate(
    atlas: &Atlas,
    plan: &Plan,
    pilot: &Pilot,
    journeys: u32,
    round: (u64, &str),
) -> Result<Tally, Error> {
    let mut tally = Tally::default();
    watch(atlas, plan, pilot, journeys, round, |report| tally.add(report.kind))?;
    Ok(tally)
}

/// Returns a plan with its probability of arrival, and with the entry at which most simulated journeys fail.
pub(crate) fn stated(
    atlas: &Atlas,
    plan: Plan,
    pilot: &Pilot,
    journeys: u32,
    seed: u64,
) -> Result<Plan, Error> {
    let (mut tally, mut failures) = (Tally::default(), vec![0; plan.map.entries().len()]);
    watch(atlas, &plan, pilot, journeys, (seed, "stated"), |report| {
        tally.add(report.kind);
        if let Some(count) = failures.get_mut(usize::from(report.last_entry)) {
            *count += u32::from(!report.kind.is_success());
        }
    })?;
    let most = (0..).zip(failures).max_by_key(|&(entry, failures)| (failures, std::cmp::Reverse(entry)));
    let weakest = most.filter(|(_, failures)| *failures > 0);
    let weakest = weakest.map(|(entry, failures)| Weakest { entry, failures, journeys });
    Ok(Plan { probability: Some(tally.probability()), weakest, ..plan })
}

/// Simulates journeys with a plan. Calls `end` after each of them.
fn watch(
    atlas: &Atlas,
    plan: &Plan,
    pilot: &Pilot,
    journeys: u32,
    round: (u64, &str),
    end: impl FnMut(&Report),
) -> Result<(), Error> {
    let navigator = Navigator::new(pilot.settings, plan.map.clone())?;
    let start = plan.path.start.centre;
    let near = surroundings(atlas, start, &plan.landmarks());
    fly(&navigator, &near, atlas.plane.walls(), (start, pilot.noise), journeys, round, end)
}

/// A part of a plane in which journeys are simulated.
pub(crate) struct Surroundings {
    dots: Vec<Point>,
    /// The landmarks that the guide refers to, by their numbers among the dots.
    intended: Vec<DotId>,
    /// The markers on these dots, if there are any.
    markers: Option<Arc<Markers>>,
}

/// Returns the dots around a start and the landmarks that a guide refers to.
pub(crate) fn surroundings(atlas: &Atlas, start: Point, landmarks: &[DotId]) -> Surroundings {
    let places = std::iter::once(start).chain(landmarks.iter().map(|&dot| atlas.plane.dot(dot)));
    let near = if atlas.plane.len() <= WHOLE { around(atlas, places) } else { along(atlas, places, REACH) };
    let number = |dot: &DotId| near.binary_search(dot).unwrap_or_default() as DotId;
    let intended = landmarks.iter().map(number).collect();
    let markers = atlas.plane.markers().map(|markers| Arc::new(markers.of_some(&near)));
    Surroundings { dots: near.iter().map(|&dot| atlas.plane.dot(dot)).collect(), intended, markers }
}

/// Returns the dots in a rectangle around some positions, in ascending order.
fn around(atlas: &Atlas, places: impl Iterator<Item = Point>) -> Vec<DotId> {
    let least = |a: Point, b: Point| Point::new(a.x.min(b.x), a.y.min(b.y));
    let most = |a: Point, b: Point| Point::new(a.x.max(b.x), a.y.max(b.y));
    let ends = places.map(|place| (place, place)).reduce(|a, b| (least(a.0, b.0), most(a.1, b.1)));
    let margin = Point::new(REACH * atlas.window.side, REACH * atlas.window.side);
    let within = |(low, high)| atlas.plane.within(low - margin, high + margin).map(|(dot, _)| dot);
    let mut dots: Vec<DotId> = ends.into_iter().flat_map(within).collect();
    dots.sort_unstable();
    dots
}

/// Returns the dots along the straight lines between successive positions, in ascending order. `reach` is their maximum distance
/// on each axis, in window sides.
pub(crate) fn along(atlas: &Atlas, places: impl Iterator<Item = Point>, reach: f64) -> Vec<DotId> {
    let side = atlas.window.side;
    let (mut dots, mut before) = (Vec::new(), None);
    for place in places {
        let from = before.unwrap_or(place);
        let steps = ((place - from).norm() / side).ceil().max(1.0);
        for step in 1..=steps as u32 {
            let at = from + (place - from) * (f64::from(step) / steps);
            dots.extend(atlas.plane.around(at, reach * side).map(|(dot, _)| dot));
        }
        before = Some(place);
    }
    dots.sort_unstable();
    dots.dedup();
    dots
}

/// Simulates journeys from a position, over planes that may be the true one. Calls `end` after each of them.
pub(crate) fn fly<G: Guide>(
    navigator: &Navigator<G>,
    near: &Surroundings,
    walls: &Arc<Walls>,
    (start, noise): (Point, Noise),
    journeys: u32,
    (seed, round): (u64, &str),
    mut end: impl FnMut(&Report),
) -> Result<(), Error> {
    for journey in 0..journeys {
        let mut rng = stream(seed, &format!("directions/{round}/{journey}"));
        let plane = disturbed(&near.dots, noise.map_sigma, &mut rng)?;
        let plane = plane.among(walls.clone()).marked(near.markers.clone());
        let journey = Traversal::new(&plane, navigator, &near.intended, noise)?;
        end(&journey.run(start, &mut rng, |_, _, _| {}));
    }
    Ok(())
}

/// Returns a plane with the dots displaced at random, as they may be in reality given the map-maker's errors.
pub fn disturbed(dots: &[Point], sigma: f64, rng: &mut Pcg64Mcg) -> Result<Plane, Error> {
    Plane::new(dots.iter().map(|&dot| dot + error(rng, sigma)).collect())
}

/// Returns the plan with the greatest probability of arrival that this search can find, together with that
/// probability.
pub fn most_probable(
    atlas: &Atlas,
    start: Start,
    goal: DotId,
    pilot: &Pilot,
    effort: Effort,
    seed: u64,
) -> Result<Plan, Error> {
    let tried = tried(atlas, start, goal, pilot, seed)?;
    let estimates = estimates(atlas, pilot, effort.trials, seed, |dot| tried.binary_search(&dot).is_ok())?;
    let mut plans = Vec::new();
    let Settings { vocabulary, .. } = pilot.settings;
    for path in candidates(atlas, &estimates, start, goal, seed)? {
        // The plans with other words come first, because the first of equally good plans is kept.
        let other = reworded(atlas, &path, vocabulary, pilot.settings.gate);
        plans.push(Plan::choosing(atlas, other.clone(), |leg, _| estimates[leg.number as usize].pays())?);
        plans.push(Plan::new(atlas, other, Verify::Nothing)?);
        plans.push(Plan::choosing(atlas, path.clone(), |leg, _| estimates[leg.number as usize].pays())?);
        plans.push(Plan::new(atlas, path.clone(), Verify::Nothing)?);
        plans.push(Plan::new(atlas, path, Verify::Recoverable)?);
    }
    let mut distinct: Vec<Plan> = Vec::new();
    for plan in plans {
        if distinct.iter().all(|other| other.map != plan.map) {
            distinct.push(plan);
        }
    }
    // Every plan gets a short trial, and the best ones a longer one.
    let plans = ranked(atlas, distinct, pilot, effort.trial_journeys, (seed, "trial"))?;
    let finalists = plans.into_iter().take(FINALISTS).collect();
    let plans = ranked(atlas, finalists, pilot, effort.trial_journeys * 4, (seed, "final"))?;
    let plan = plans.into_iter().next().ok_or(Error::NoDots)?;
    stated(atlas, plan, pilot, effort.journeys, seed)
}

/// Distance around roughly estimated paths within which the dots of a large plane are tried, in window sides.
const TRIED: f64 = 3.0;
/// Number of trials for a rough estimate, in which the prediction of equations 1 and 2 has the weight of as many trials.
const ROUGH: u32 = 16;
const PREDICTED: f64 = 4.0;

/// Returns the dots whose transitions are worth many trials: all dots or, on a large plane, those near the paths that are the
/// best by a few trials.
fn tried(atlas: &Atlas, start: Start, goal: DotId, pilot: &Pilot, seed: u64) -> Result<Vec<DotId>, Error> {
    if atlas.plane.len() <= WHOLE {
        return Ok((0..atlas.plane.len() as DotId).collect());
    }
    let rough = estimates(atlas, pilot, ROUGH, seed, |_| true)?;
    let weight = PREDICTED / (PREDICTED + f64::from(ROUGH));
    let probabilities = rough
        .iter()
        .zip(&atlas.unreliability)
        .map(|(estimate, &cost)| weight * f64::from(-cost).exp() + (1.0 - weight) * estimate.best());
    let rough = atlas.clone().with_probabilities(&probabilities.collect::<Vec<_>>())?;
    let mut dots = Vec::new();
    for objective in [Objective::MOST_RELIABLE, Objective::Ratio] {
        let path = best(&rough, start, goal, Measure::Windows, objective)?;
        dots.extend(along(atlas, path.landmarks().into_iter().map(|dot| atlas.plane.dot(dot)), TRIED));
    }
    dots.sort_unstable();
    dots.dedup();
    Ok(dots)
}

/// Number of plans that get a long trial.
pub(crate) const FINALISTS: usize = 4;
/// Number of paths found with randomly varied estimates. The estimates vary by as much as their trials leave them uncertain.
const DRAWN: u64 = 6;

/// Returns the plans in descending order of their arrivals. Equally good plans keep their order.
pub(crate) fn ranked(
    atlas: &Atlas,
    plans: Vec<Plan>,
    pilot: &Pilot,
    journeys: u32,
    round: (u64, &str),
) -> Result<Vec<Plan>, Error> {
    let mut tried = Vec::with_capacity(plans.len());
    for plan in plans {
        tried.push((simulate(atlas, &plan, pilot, journeys, round)?.arrivals(), plan));
    }
    tried.sort_by_key(|(arrivals, _)| std::cmp::Reverse(*arrivals));
    Ok(tried.into_iter().map(|(_, plan)| plan).collect())
}

/// Returns candidates for the most probable path. They are found with the simulated estimates, with and
/// without a preference for short paths, with randomly varied estimates, and with equations 1 and 2.
fn candidates(
    atlas: &Atlas,
    estimates: &[Estimate],
    start: Start,
    goal: DotId,
    seed: u64,
) -> Result<Vec<Path>, Error> {
    let with = |of: &dyn Fn(&Estimate) -> f64| {
        atlas.clone().with_probabilities(&estimates.iter().map(of).collect::<Vec<_>>())
    };
    let simulated = with(&Estimate::best)?;
    let per_side = 1.0 / atlas.window.side;
    let taste = |distance, entries| {
        Objective::Sum(Weights { distance: distance * per_side, unreliability: 1.0, entries, slides: 0.0 })
    };
    let find = |atlas: &Atlas, objective| best(atlas, start, goal, Measure::Windows, objective);
    let mut paths = vec![
        find(&simulated, Objective::MOST_RELIABLE)?,
        find(&with(&|estimate| estimate.plain)?, Objective::MOST_RELIABLE)?,
        find(&simulated, taste(0.003, 0.003))?,
        find(&simulated, taste(0.01, 0.01))?,
        find(&simulated, Objective::Ratio)?,
        find(atlas, Objective::MOST_RELIABLE)?,
        find(atlas, Objective::Ratio)?,
    ];
    for draw in 0..DRAWN {
        let rng = std::cell::RefCell::new(stream(seed, &format!("directions/draws/{draw}")));
        let varied = with(&|estimate: &Estimate| {
            let normal: f64 = StandardNormal.sample(&mut *rng.borrow_mut());
            estimate.best() + 0.05 * normal * (estimate.best() * (1.0 - estimate.best())).sqrt()
        })?;
        paths.push(find(&varied, Objective::MOST_RELIABLE)?);
    }
    Ok(paths)
}

/// The words for plans above a plane. Each refers to a definite landmark, and together they connect more landmarks than either
/// alone.
pub const WORDS: [Descriptor; 2] = [Descriptor::Isolated, Descriptor::IsolatedPair];
/// The words for plans on land. Since the robot knows its heading, `*` can refer to any landmark, by its bearing. Among walls, the
/// robot also drives around a landmark.
pub const WORDS_ON_LAND: [Descriptor; 4] =
    [Descriptor::Isolated, Descriptor::IsolatedPair, Descriptor::Any, Descriptor::Same];

#[cfg(test)]
mod tests;
