//! Experiments with journeys: figures 26 and 28 over many worlds, counts of the six kinds, and the calibration of stated
//! probabilities.

use std::sync::Arc;

use sketchnav_schemas::seed::stream;
use sketchnav_schemas::statistics::{mean, wilson};

use super::{DOTS, SIDE, Table, window};
use crate::arrival::{Effort, Pilot, Tally, WORDS, disturbed, most_probable};
use crate::belief::{self, Charted};
use crate::branching::most_probable_branching;
use crate::description::Descriptor;
use crate::error::Error;
use crate::generate::{uniform, walled};
use crate::geometry::{Point, Window};
use crate::navigator::guide::Guide;
use crate::navigator::{Navigator, Settings};
use crate::path::{Atlas, Measure, Objective, Path, Start, best};
use crate::plan::{Plan, Verify};
use crate::plane::{DotId, Plane};
use crate::reliability::Reliability;
use crate::transitions::Kinds;
use crate::traversal::{Noise, Traversal};

/// The method by which a plan is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice {
    /// The paper's method, which uses isolated landmarks and equations 1 and 2.
    Paper(Objective, Verify),
    /// The greatest probability of arrival, found by simulation.
    Simulated(Effort),
    /// The greatest probability of arrival when branching maps are considered as well.
    Branching(Effort),
    /// No map: a navigator with a belief, which knows the positions of all landmarks.
    Belief(Effort),
}

/// The settings shared by all journeys of an experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The navigator's window.
    pub window: Window,
    /// The words that the paper's map-maker plans with.
    pub words: &'static [Descriptor],
    /// Number of views that the navigator takes at rest before each decision.
    pub looks: u8,
    /// The errors.
    pub noise: Noise,
}

impl Setting {
    /// Returns the paper's setting: isolated landmarks, one view per decision, and no errors except those of
    /// positions.
    pub fn of_sigma(sigma: f64) -> Result<Self, Error> {
        let words = Kinds::PAPER.words;
        Ok(Self { window: window()?, words, looks: 1, noise: Noise::of_sigma(sigma) })
    }

    /// Returns a setting with all kinds of errors: positions, missed and false dots, and a helicopter that
    /// drifts by 2 mm and 1° in 100 mm.
    pub fn of_all_errors() -> Result<Self, Error> {
        let noise = Noise {
            misses: 0.02,
            false_dots: 0.02,
            translation: 0.2,
            rotation_rad: 0.001_75,
            ..Noise::of_sigma(1.0)
        };
        Ok(Self { noise, looks: 3, ..Self::of_sigma(1.0)? })
    }

    pub(super) fn pilot(&self) -> Pilot {
        let settings = Settings { looks: self.looks, ..Settings::new(self.window, self.noise.sigma) };
        Pilot { settings, noise: self.noise }
    }

    fn kinds(&self, choice: Choice) -> Kinds<'static> {
        match choice {
            Choice::Paper(..) => Kinds { words: self.words, trajectories: true },
            Choice::Simulated(_) | Choice::Branching(_) | Choice::Belief(_) => {
                Kinds { words: &WORDS, trajectories: true }
            }
        }
    }
}

/// The outcomes of journeys over many worlds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Success {
    /// The counts of all journeys.
    pub tally: Tally,
    /// Fraction of journeys that arrived, for each world with a plan. Journeys over the same world are not independent trials.
    pub arrived: Vec<f64>,
    /// Number of worlds in which a path of isolated landmarks joins the start and the goal.
    pub worlds: u32,
    /// Number of these worlds for which a plan was found.
    pub planned: u32,
    /// Number of entries of each map or, without a map, of landmarks in the list.
    pub entries: Vec<f64>,
    /// For each world with a plan that states a probability of arrival: that probability, and the fraction of journeys that
    /// arrived.
    pub stated: Vec<[f64; 2]>,
}

/// A world as it really is, and as the map-maker sees it.
pub(super) struct World {
    truth: Plane,
    pub(super) atlas: Atlas,
    start: Start,
    goal: DotId,
}

impl World {
    /// Creates a world with a start and a goal. Returns `None` if no path joins the start and the goal in the world of this
    /// seed.
    pub(super) fn new(seed: u64, setting: &Setting, kinds: Kinds<'_>) -> Result<Option<Self>, Error> {
        let truth = uniform(DOTS, SIDE, seed)?;
        let seen = disturbed(truth.dots(), setting.noise.map_sigma, &mut stream(seed, "directions/map"))?;
        let model = Reliability::fitted(setting.noise);
        let atlas = Atlas::new(seen, setting.window, kinds, model);
        let (start, goal) = (Start::over(&atlas.plane, 0)?, 1);
        // The paper's transitions decide, so that all methods are tried on the same worlds.
        let isolated = Atlas::new(atlas.plane.clone(), setting.window, Kinds::PAPER, model);
        let is_joined = best(&isolated, start, goal, Measure::Windows, Objective::SHORTEST).is_ok();
        Ok(is_joined.then_some(Self { truth, atlas, start, goal }))
    }

    /// Creates a world with a wall of clutter, where the path leads from the westernmost to the easternmost dot.
    pub(super) fn walled(seed: u64, setting: &Setting) -> Result<Option<Self>, Error> {
        let truth = walled(DOTS, DOTS / 2, SIDE, seed)?;
        let seen = disturbed(truth.dots(), setting.noise.map_sigma, &mut stream(seed, "directions/map"))?;
        let atlas = Atlas::new(seen, setting.window, Kinds::PAPER, Reliability::fitted(setting.noise));
        let east = |dot: &DotId| atlas.plane.dot(*dot).x;
        let order = |a: &DotId, b: &DotId| east(a).total_cmp(&east(b));
        let dots = || 0..atlas.plane.len() as DotId;
        let (Some(west), Some(goal)) = (dots().min_by(order), dots().max_by(order)) else { return Ok(None) };
        let start = Start::over(&atlas.plane, west)?;
        let is_joined = best(&atlas, start, goal, Measure::Windows, Objective::SHORTEST).is_ok();
        Ok(is_joined.then_some(Self { truth, atlas, start, goal }))
    }

    /// Plans a journey and simulates it over the true world. Returns the length of the map, the stated probability, and how the
    /// journeys ended.
    fn tried(&self, choice: Choice, pilot: &Pilot, seed: u64, journeys: u64) -> Result<Tried, Error> {
        let Self { atlas, start, goal, .. } = self;
        let plan = match choice {
            Choice::Paper(objective, verify) => Plan::new(atlas, self.path(objective)?, verify)?,
            Choice::Simulated(effort) => most_probable(atlas, *start, *goal, pilot, effort, seed)?,
            Choice::Branching(effort) => most_probable_branching(atlas, *start, *goal, pilot, effort, seed)?,
            Choice::Belief(effort) => return self.believed(pilot, effort, seed, journeys),
        };
        let tally = self.fly(&plan, pilot, journeys, seed)?;
        Ok((plan.map.entries().len(), plan.probability, tally))
    }

    /// The same with a belief, in place of a map.
    fn believed(&self, pilot: &Pilot, effort: Effort, seed: u64, journeys: u64) -> Result<Tried, Error> {
        let charted =
            Charted::new(&self.atlas, &[&self.path(Objective::MOST_RELIABLE)?], pilot.noise.map_sigma)?;
        let journey = charted.journey(self.start, self.goal).ok_or(Error::NoDots)?;
        let model = Arc::new(charted.chart.model(pilot, effort.trials, seed)?);
        let stated =
            charted.simulate(&self.atlas, pilot, (&model, journey), effort.journeys, (seed, "stated"))?;
        let navigator = belief::navigator(&charted.chart, pilot, &model, journey)?;
        let tally = self.journeys(&navigator, (journey.start, &charted.dots), pilot.noise, journeys, seed)?;
        Ok((charted.dots.len(), Some(stated.probability()), tally))
    }

    pub(super) fn path(&self, objective: Objective) -> Result<Path, Error> {
        best(&self.atlas, self.start, self.goal, Measure::Windows, objective)
    }

    /// Simulates journeys over the true world by a plan.
    pub(super) fn fly(&self, plan: &Plan, pilot: &Pilot, journeys: u64, seed: u64) -> Result<Tally, Error> {
        let navigator = Navigator::new(pilot.settings, plan.map.clone())?;
        self.journeys(&navigator, (plan.path.start.centre, &plan.landmarks()), pilot.noise, journeys, seed)
    }

    /// Simulates journeys over the true world, whose dots have the numbers of those that the map-maker sees.
    fn journeys<G: Guide>(
        &self,
        navigator: &Navigator<G>,
        (start, landmarks): (Point, &[DotId]),
        noise: Noise,
        journeys: u64,
        seed: u64,
    ) -> Result<Tally, Error> {
        let mut tally = Tally::default();
        for trial in 0..journeys {
            let journey = Traversal::new(&self.truth, navigator, landmarks, noise)?;
            let mut rng = stream(seed, &format!("directions/journey/{trial}"));
            tally.add(journey.run(start, &mut rng, |_, _, _| {}).kind);
        }
        Ok(tally)
    }
}

/// The length of a map, the probability of arrival that it states, and how journeys with it ended.
type Tried = (usize, Option<f64>, Tally);

/// Counts how journeys end over many worlds, for one method and one setting. Worlds without a path of isolated landmarks are
/// left out.
pub fn success(
    choice: Choice,
    setting: &Setting,
    worlds: std::ops::Range<u64>,
    journeys: u64,
) -> Result<Success, Error> {
    let pilot = setting.pilot();
    let mut result = Success::default();
    for seed in worlds {
        let Some(world) = World::new(seed, setting, setting.kinds(choice))? else { continue };
        result.worlds += 1;
        match world.tried(choice, &pilot, seed, journeys) {
            Ok((entries, stated, tally)) => {
                result.planned += 1;
                result.entries.push(entries as f64);
                let arrived = f64::from(tally.arrivals()) / f64::from(tally.journeys().max(1));
                result.stated.extend(stated.map(|stated| [stated, arrived]));
                result.arrived.push(arrived);
                result.tally.merge(&tally);
            }
            Err(Error::Unreachable { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(result)
}

const HEAD: [&str; 12] = [
    "choice",
    "planned",
    "success",
    "low",
    "high",
    "direct",
    "recovered",
    "unaware",
    "not located",
    "lost",
    "astray",
    "journeys",
];

/// Adds a row in percent: the fraction of worlds with a plan, the fraction of journeys that arrive with Student's confidence
/// interval over the worlds, and the fractions of the six kinds.
fn success_row(table: &mut Table, name: String, result: &Success) {
    let share = |count: u32, of: u32| 100.0 * f64::from(count) / f64::from(of.max(1));
    let (tally, journeys) = (&result.tally, result.tally.journeys());
    let [arrived, low, high, _] = Table::mean_of(&result.arrived).map(|share| 100.0 * share);
    let mut values = vec![share(result.planned, result.worlds), arrived, low.max(0.0), high.min(100.0)];
    values.extend(tally.counts.map(|count| share(count, journeys)));
    values.push(f64::from(journeys));
    table.row(name, &values);
}

/// Returns the success by descriptor and by window, for the paper's D/R path without verification.
pub fn words_and_windows(sigma: f64, worlds: std::ops::Range<u64>, journeys: u64) -> Result<Table, Error> {
    use Descriptor::{Isolated, IsolatedPair, Obvious, PlusPair};
    let title = format!("Success in percent by words and by window, D/R path, {sigma} mm");
    let mut table = Table::new(&title, &HEAD);
    let setting = Setting::of_sigma(sigma)?;
    let choice = Choice::Paper(Objective::Ratio, Verify::Nothing);
    let all: &'static [Descriptor] = &[Isolated, IsolatedPair, PlusPair];
    for (name, words) in
        [("Obvious", &[Obvious][..]), ("Isol", &[Isolated]), ("IsolPair", &[IsolatedPair]), ("all", all)]
    {
        let result = success(choice, &Setting { words, ..setting }, worlds.clone(), journeys)?;
        success_row(&mut table, name.to_owned(), &result);
    }
    for side in [70.0, 85.0, 100.0, 125.0, 150.0] {
        let window = Window::new(side, 0.15 * side)?;
        let result = success(choice, &Setting { window, ..setting }, worlds.clone(), journeys)?;
        success_row(&mut table, format!("Isol, window {side} mm"), &result);
    }
    Ok(table)
}

/// Returns two tables. The first is the success by cost, verification and error: the fraction that arrives with its confidence
/// interval, and the six kinds, in percent. The second has the stated probabilities of these journeys beside the fractions that
/// arrived, by method.
pub fn costs(
    sigmas: &[f64],
    looks: u8,
    worlds: std::ops::Range<u64>,
    journeys: u64,
) -> Result<[Table; 2], Error> {
    let title = format!("Success in percent over {} worlds, {looks} looks", worlds.end - worlds.start);
    let mut table = Table::new(&title, &HEAD);
    let mut stated: Vec<(&str, Vec<[f64; 2]>)> = Vec::new();
    let quick = Effort { trials: 64, trial_journeys: 64, journeys: 128 };
    for &sigma in sigmas {
        for (name, choice) in [
            ("shortest", Choice::Paper(Objective::SHORTEST, Verify::Nothing)),
            ("fewest entries", Choice::Paper(Objective::FEWEST_ENTRIES, Verify::Nothing)),
            ("most reliable", Choice::Paper(Objective::MOST_RELIABLE, Verify::Nothing)),
            ("D/R", Choice::Paper(Objective::Ratio, Verify::Nothing)),
            ("D/R, recovery", Choice::Paper(Objective::Ratio, Verify::Recoverable)),
            ("D/R, detection", Choice::Paper(Objective::Ratio, Verify::Detectable)),
            ("simulated", Choice::Simulated(quick)),
            ("branching", Choice::Branching(quick)),
            ("belief", Choice::Belief(quick)),
        ] {
            let setting = Setting { looks, ..Setting::of_sigma(sigma)? };
            let result = success(choice, &setting, worlds.clone(), journeys)?;
            success_row(&mut table, format!("{sigma} mm, {name}"), &result);
            match stated.iter_mut().find(|(known, _)| *known == name) {
                Some((_, pairs)) => pairs.extend(result.stated),
                None => stated.push((name, result.stated)),
            }
        }
    }
    Ok([table, stated_and_reached(&stated, looks)])
}

/// Returns the mean of the stated probabilities, and of the fractions that arrived with its confidence interval over the worlds,
/// for each method and tenth of the stated probability, in percent.
fn stated_and_reached(stated: &[(&str, Vec<[f64; 2]>)], looks: u8) -> Table {
    let head = ["choice, stated, %", "mean stated", "reached", "low", "high", "worlds"];
    let mut table = Table::new(&format!("Stated and reached, {looks} looks"), &head);
    for (name, pairs) in stated {
        for tenth in 0..10 {
            let is_in = |[stated, _]: &&[f64; 2]| tenth_of(*stated) == tenth;
            let (said, reached): (Vec<f64>, Vec<f64>) =
                pairs.iter().filter(is_in).map(|&[a, b]| (a, b)).unzip();
            if said.is_empty() {
                continue;
            }
            let [arrived, low, high, worlds] = Table::mean_of(&reached);
            let shares = [mean(&said), arrived, low.max(0.0), high.min(1.0)].map(|share| 100.0 * share);
            let values = [&shares[..], &[worlds]].concat();
            table.row(format!("{name}, {}-{}", tenth * 10, tenth * 10 + 10), &values);
        }
    }
    table
}

/// Returns the tenth that a probability is in, from 0 to 9.
fn tenth_of(probability: f64) -> usize {
    ((probability * 10.0) as usize).min(9)
}

/// Observed against stated probabilities, grouped by tenths of the stated probability.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// For each tenth, the sum of the stated probabilities over all journeys, the number of arrivals, and the number of
    /// journeys.
    pub bins: [(f64, u32, u32); 10],
}

impl Calibration {
    /// Returns a table of the tenths that have journeys.
    pub fn table(&self) -> Table {
        let head = ["stated, %", "mean stated", "observed", "low", "high", "journeys"];
        let mut table = Table::new("Calibration of the probability of arrival", &head);
        for (bin, &(sum, arrived, journeys)) in (0..).zip(&self.bins) {
            if journeys > 0 {
                let n = f64::from(journeys);
                let [low, high] = wilson(arrived as usize, journeys as usize);
                let shares = [sum / n, f64::from(arrived) / n, low, high].map(|share| 100.0 * share);
                let values = [&shares[..], &[n]].concat();
                table.row(format!("{}-{}", bin * 10, bin * 10 + 10), &values);
            }
        }
        table
    }
}

/// Plans by simulation on many worlds, and runs journeys over the true worlds with random numbers that the plans haven't used.
pub fn calibration(
    settings: &[Setting],
    effort: Effort,
    worlds: std::ops::Range<u64>,
    journeys: u64,
) -> Result<Calibration, Error> {
    let mut bins = [(0.0, 0, 0); 10];
    for setting in settings {
        let pilot = setting.pilot();
        let choice = Choice::Simulated(effort);
        for seed in worlds.clone() {
            let Some(world) = World::new(seed, setting, setting.kinds(choice))? else { continue };
            let (_, stated, tally) = world.tried(choice, &pilot, seed, journeys)?;
            let stated = stated.unwrap_or(0.0);
            let bin = &mut bins[tenth_of(stated)];
            bin.0 += stated * f64::from(tally.journeys());
            bin.1 += tally.arrivals();
            bin.2 += tally.journeys();
        }
    }
    Ok(Calibration { bins })
}
