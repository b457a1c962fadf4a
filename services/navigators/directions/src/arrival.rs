//! The probability of arrival, by simulation of the navigator; and the path that maximises it. This part is ours.
//!
//! The map-maker knows its own errors and the navigator's. It simulates:
//! 1. each transition by itself, as geometry: how often errors of position lead to another dot. This takes the place of
//!    equations 1 and 2 in a search for the most reliable path;
//! 2. whole journeys with the navigator, for a few candidate plans: verification, recovery, misses and all. The best one is
//!    kept;
//! 3. fresh journeys with that plan: their share of arrivals is the probability that the plan states. The choice among
//!    candidates does not flatter it, since it comes from other random numbers.
//!
//! In each simulation the dots lie elsewhere, by the map-maker's own errors.

use rand_pcg::Pcg64Mcg;

use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::{error, stream};
use crate::geometry::Point;
use crate::journey::{Journey, Kind, Noise};
use crate::navigator::{Navigator, Settings};
use crate::path::{Atlas, Measure, Objective, Path, Start, Weights, best};
use crate::plan::{Plan, Verify};
use crate::plane::{DotId, Plane};
use crate::trajectory::Slide;
use crate::transitions::{Movement, Transition};

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

    /// The interval that holds the true share with 95 % (Wilson 1927).
    pub fn interval(&self) -> (f64, f64) {
        let n = f64::from(self.journeys());
        if n == 0.0 {
            return (0.0, 1.0);
        }
        let (share, z) = (f64::from(self.arrivals()) / n, 1.96);
        let scale = 1.0 + z * z / n;
        let middle = (share + z * z / (2.0 * n)) / scale;
        let half = z / scale * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        ((middle - half).max(0.0), (middle + half).min(1.0))
    }
}

/// The probability that each transition attains its target, one after the other, by geometry alone.
pub fn transition_probabilities(atlas: &Atlas, pilot: &Pilot, trials: u32, seed: u64) -> Vec<f64> {
    let mut trial = Trial::new(atlas, pilot, stream(seed, 10));
    let estimate = |(from, transition): (DotId, &Transition)| {
        let hits = (0..trials).filter(|_| trial.attains(from, transition)).count();
        (hits as f64 + 1.0) / (f64::from(trials) + 2.0)
    };
    atlas.transitions.all().map(estimate).collect()
}

/// One transition, again and again.
struct Trial<'a> {
    atlas: &'a Atlas,
    /// The error of a position in the view about the map-maker's.
    sigma: f64,
    noise: Noise,
    rng: Pcg64Mcg,
    places: Vec<Point>,
    dots: Vec<DotId>,
}

impl<'a> Trial<'a> {
    fn new(atlas: &'a Atlas, pilot: &Pilot, rng: Pcg64Mcg) -> Self {
        let noise = pilot.noise;
        let seen = noise.sigma / f64::from(pilot.settings.looks).sqrt();
        let noise = Noise { sigma: seen, ..noise };
        Self { atlas, sigma: noise.combined_sigma(), noise, rng, places: Vec::new(), dots: Vec::new() }
    }

    fn attains(&mut self, from: DotId, transition: &Transition) -> bool {
        let seen = self.picks(from, transition);
        if transition.movement == Movement::Seek || seen != Some(transition.seen) {
            return seen == Some(transition.to);
        }
        self.lands(from, transition) == Some(transition.to)
    }

    /// The dot that the word means in a view with errors.
    fn picks(&mut self, from: DotId, transition: &Transition) -> Option<DotId> {
        let side = self.atlas.window.side;
        let place = self.atlas.plane.dot(from) + error(&mut self.rng, self.sigma);
        self.places.clear();
        self.dots.clear();
        for (dot, at) in self.atlas.plane.around(self.atlas.plane.dot(from), side + 5.0 * self.sigma) {
            if dot != from {
                let relative = at + error(&mut self.rng, self.sigma) - place;
                if transition.corner.covers(relative, side) {
                    self.places.push(relative);
                    self.dots.push(dot);
                }
            }
        }
        transition.word.pick(&self.places).map(|index| self.dots[index])
    }

    /// The dot that a slide with errors attains.
    fn lands(&mut self, from: DotId, transition: &Transition) -> Option<DotId> {
        let atlas = self.atlas;
        let first = atlas.plane.dot(from) + error(&mut self.rng, self.sigma);
        let second = atlas.plane.dot(transition.seen) + error(&mut self.rng, self.sigma);
        let slide = Slide::of_pair(first, second, transition.movement == Movement::Backward)?;
        // What is left of equation 2 are the errors of the way, and the goal's own.
        let way = Noise { sigma: 0.0, map_sigma: 0.0, ..self.noise };
        let pair = (second - first).norm();
        let aside = atlas.reliability.trajectories.aside(f64::from(transition.slide), pair, way);
        let drawn = error(&mut self.rng, aside.hypot(self.noise.map_sigma)).x;
        slide.moved_aside(drawn).lands(&atlas.plane, atlas.window).map(|landing| landing.dot)
    }
}

/// Simulates journeys by a plan. The same seed gives the same errors to every plan.
pub fn simulate(atlas: &Atlas, plan: &Plan, pilot: &Pilot, journeys: u32, seed: u64) -> Result<Tally, Error> {
    let navigator = Navigator::new(pilot.settings, plan.map.clone())?;
    let (near, intended) = surroundings(atlas, plan);
    let mut tally = Tally::default();
    for journey in 0..journeys {
        let mut rng = stream(seed, 100 + u64::from(journey));
        let plane = disturbed(&near, pilot.noise.map_sigma, &mut rng)?;
        let journey = Journey::new(&plane, &navigator, &intended, pilot.noise);
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
    let probabilities = transition_probabilities(atlas, pilot, effort.trials, seed);
    let simulated = atlas.clone().with_probabilities(&probabilities)?;
    let mut best_plan: Option<(u32, Plan)> = None;
    for path in candidates(atlas, &simulated, start, goal)? {
        for verify in [Verify::Nothing, Verify::Recoverable, Verify::Detectable] {
            let plan = Plan::new(atlas, path.clone(), verify)?;
            let arrivals = simulate(atlas, &plan, pilot, effort.trial_journeys, seed)?.arrivals();
            if best_plan.as_ref().is_none_or(|(most, _)| arrivals > *most) {
                best_plan = Some((arrivals, plan));
            }
        }
    }
    let (_, plan) = best_plan.ok_or(Error::NoDots)?;
    let tally = simulate(atlas, &plan, pilot, effort.journeys, seed.wrapping_add(1))?;
    Ok(Plan { probability: Some(tally.probability()), ..plan })
}

/// Paths that may be the most probable: by simulated transitions with and without a taste for short ways, and by the models.
fn candidates(atlas: &Atlas, simulated: &Atlas, start: Start, goal: DotId) -> Result<Vec<Path>, Error> {
    let per_side = 1.0 / atlas.window.side;
    let taste = |distance, entries| {
        Objective::Sum(Weights { distance: distance * per_side, unreliability: 1.0, entries })
    };
    let wanted = [
        (simulated, Objective::MOST_RELIABLE),
        (simulated, taste(0.003, 0.003)),
        (simulated, taste(0.01, 0.01)),
        (simulated, Objective::Ratio),
        (atlas, Objective::MOST_RELIABLE),
        (atlas, Objective::Ratio),
    ];
    let mut paths: Vec<Path> = Vec::new();
    for (atlas, objective) in wanted {
        let path = best(atlas, start, goal, Measure::Windows, objective)?;
        let steps = |path: &Path| path.legs.iter().map(|leg| leg.number).collect::<Vec<_>>();
        if paths.iter().all(|other| steps(other) != steps(&path)) {
            paths.push(path);
        }
    }
    Ok(paths)
}

/// The words with which this map-maker plans: each has a definite landmark, and together they join more than one alone.
pub const WORDS: [Descriptor; 2] = [Descriptor::Isolated, Descriptor::IsolatedPair];

#[cfg(test)]
mod tests;
