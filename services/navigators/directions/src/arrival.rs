//! The probability of arrival, by simulation of the navigator; and the path that maximises it. This part is ours.
//!
//! The map-maker knows its own errors and the navigator's. It simulates:
//! 1. each transition by itself, as geometry, without and with verification: how often errors of position lead to
//!    another dot. This takes the place of equations 1 and 2 in a search for the most reliable path. It also says
//!    where verification pays, since a count may be misread, too.
//! 2. whole journeys with the navigator, for a few candidate plans: verification, recovery, misses and all. The best one is
//!    kept;
//! 3. fresh journeys with that plan: their share of arrivals is the probability that the plan states. The choice among
//!    candidates does not flatter it, since it comes from other random numbers.
//!
//! In each simulation the dots lie elsewhere, by the map-maker's own errors.

mod trial;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::seed::stream;

use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::error;
use crate::geometry::Point;
use crate::navigator::{Navigator, Settings};
use crate::path::{Atlas, Measure, Objective, Path, Start, Weights, best};
use crate::plan::{Plan, Verify};
use crate::plane::{DotId, Plane};
use crate::traversal::{Kind, Noise, Traversal};
use crate::wording::reworded;
pub(crate) use trial::Trial;
pub use trial::{Estimate, estimates};

/// Around a path, how many window sides of the plane are simulated.
const REACH: f64 = 4.0;

/// The navigator and the errors that the map-maker reckons with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pilot {
    /// How the navigator sees and moves.
    pub settings: Settings,
    /// The errors.
    pub noise: Noise,
}

/// How much is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Trials of each transition.
    pub trials: u32,
    /// Journeys of each candidate.
    pub trial_journeys: u32,
    /// Journeys for the stated probability.
    pub journeys: u32,
}

impl Effort {
    /// For a plan that is used: half a second for a hundred dots.
    pub const USUAL: Self = Self { trials: 128, trial_journeys: 128, journeys: 512 };
}

/// How journeys ended, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// How many ended in each kind, in the order of [`Kind::ALL`].
    pub counts: [u32; 6],
}

impl Tally {
    /// Counts one.
    pub fn add(&mut self, kind: Kind) {
        self.counts[kind as usize] += 1;
    }

    /// Counts those of another.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts).for_each(|(own, more)| *own += more);
    }

    /// How many journeys there were.
    pub fn journeys(&self) -> u32 {
        self.counts.iter().sum()
    }

    /// How many arrived.
    pub fn arrivals(&self) -> u32 {
        Kind::ALL.iter().zip(self.counts).filter(|(kind, _)| kind.is_success()).map(|(_, count)| count).sum()
    }

    /// The share that arrived, drawn towards the middle as by one success and one failure more (Laplace).
    pub fn probability(&self) -> f64 {
        f64::from(self.arrivals() + 1) / f64::from(self.journeys() + 2)
    }
}

/// Simulates journeys by a plan. The same seed and round give the same errors to every plan.
pub fn simulate(
    atlas: &Atlas,
    plan: &Plan,
    pilot: &Pilot,
    journeys: u32,
    (seed, round): (u64, &str),
) -> Result<Tally, Error> {
    let navigator = Navigator::new(pilot.settings, plan.map.clone())?;
    let (near, intended) = surroundings(atlas, plan);
    let mut tally = Tally::default();
    for journey in 0..journeys {
        let mut rng = stream(seed, &format!("directions/{round}/{journey}"));
        let plane = disturbed(&near, pilot.noise.map_sigma, &mut rng)?.among(atlas.plane.walls().clone());
        let journey = Traversal::new(&plane, &navigator, &intended, pilot.noise)?;
        tally.add(journey.run(plan.path.start.centre, &mut rng, |_, _, _| {}).kind);
    }
    Ok(tally)
}

/// The dots around a path, and the numbers that its landmarks have among them.
fn surroundings(atlas: &Atlas, plan: &Plan) -> (Vec<Point>, Vec<DotId>) {
    let landmarks = plan.landmarks();
    let places = landmarks.iter().map(|&dot| atlas.plane.dot(dot));
    let (mut low, mut high) = (plan.path.start.centre, plan.path.start.centre);
    for place in places {
        low = Point::new(low.x.min(place.x), low.y.min(place.y));
        high = Point::new(high.x.max(place.x), high.y.max(place.y));
    }
    let margin = Point::new(REACH * atlas.window.side, REACH * atlas.window.side);
    let mut near: Vec<DotId> = atlas.plane.within(low - margin, high + margin).map(|(dot, _)| dot).collect();
    near.sort_unstable();
    let number = |dot: &DotId| near.binary_search(dot).unwrap_or_default() as DotId;
    let intended = landmarks.iter().map(number).collect();
    (near.iter().map(|&dot| atlas.plane.dot(dot)).collect(), intended)
}

/// The dots as they may lie, given where the map-maker sees them.
pub fn disturbed(dots: &[Point], sigma: f64, rng: &mut Pcg64Mcg) -> Result<Plane, Error> {
    Plane::new(dots.iter().map(|&dot| dot + error(rng, sigma)).collect())
}

/// The plan with the greatest probability of arrival that this search finds, and that probability.
pub fn most_probable(
    atlas: &Atlas,
    start: Start,
    goal: DotId,
    pilot: &Pilot,
    effort: Effort,
    seed: u64,
) -> Result<Plan, Error> {
    let estimates = estimates(atlas, pilot, effort.trials, seed)?;
    let mut plans = Vec::new();
    let Settings { vocabulary, .. } = pilot.settings;
    for path in candidates(atlas, &estimates, start, goal, seed)? {
        // First in other words: of equals, the first plan is kept.
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
    // All have a short trial, the best a long one.
    let plans = ranked(atlas, distinct, pilot, effort.trial_journeys, (seed, "trial"))?;
    let finalists = plans.into_iter().take(FINALISTS).collect();
    let plans = ranked(atlas, finalists, pilot, effort.trial_journeys * 4, (seed, "final"))?;
    let plan = plans.into_iter().next().ok_or(Error::NoDots)?;
    let tally = simulate(atlas, &plan, pilot, effort.journeys, (seed, "stated"))?;
    Ok(Plan { probability: Some(tally.probability()), ..plan })
}

/// How many plans have a long trial.
pub(crate) const FINALISTS: usize = 4;
/// How many paths are drawn by estimates that vary as much as their trials leave open.
const DRAWN: u64 = 6;

/// Plans with the most arrivals first; of equals, those that come first.
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

/// Paths that may be the most probable. They come from simulated transitions with and without a preference for short
/// ways, from transitions that vary, and from the models.
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

/// The words with which this map-maker plans: each has a definite landmark, and together they join more than one alone.
pub const WORDS: [Descriptor; 2] = [Descriptor::Isolated, Descriptor::IsolatedPair];

#[cfg(test)]
mod tests;
