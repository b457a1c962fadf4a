//! Journeys over random worlds, planned by a choice of methods. Each world is a separate experiment, so a study can be divided
//! among machines. [`super::success`] makes the tables.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::seed::stream;

use super::{DOTS, SIDE, window};
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

/// A method in a setting: one line of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name of the line.
    pub name: String,
    /// Name of the method. Probabilities that one method states are counted together.
    pub method: &'static str,
    /// The method by which plans are chosen.
    pub choice: Choice,
    /// The errors and the window.
    pub setting: Setting,
    /// Number of journeys over each world.
    pub journeys: u64,
}

/// The result of a method in one world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Attempt {
    /// No path of isolated landmarks joins the start and the goal, so the world is left out.
    Unjoined,
    /// The method found no plan.
    Unplanned,
    /// Journeys were simulated.
    Tried {
        /// Number of entries of the map or, without a map, of landmarks in the list.
        entries: usize,
        /// The probability of arrival that the plan states, if it does.
        stated: Option<f64>,
        /// How the journeys ended.
        tally: Tally,
    },
}

impl Case {
    /// Plans a journey in the world with the given seed, and simulates it with random numbers not used by the plan.
    pub fn attempt(&self, seed: u64) -> Result<Attempt, Error> {
        let Some(world) = World::new(seed, &self.setting, self.setting.kinds(self.choice))? else {
            return Ok(Attempt::Unjoined);
        };
        match world.tried(self.choice, &self.setting.pilot(), seed, self.journeys) {
            Err(Error::Unreachable { .. }) => Ok(Attempt::Unplanned),
            tried => tried,
        }
    }
}

/// A true world, and the same world as the map-maker sees it.
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
        // Worlds are selected by the paper's transitions, so that all methods are tried on the same ones.
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

    /// Plans a journey and simulates it over the true world.
    fn tried(&self, choice: Choice, pilot: &Pilot, seed: u64, journeys: u64) -> Result<Attempt, Error> {
        let Self { atlas, start, goal, .. } = self;
        let plan = match choice {
            Choice::Paper(objective, verify) => Plan::new(atlas, self.path(objective)?, verify)?,
            Choice::Simulated(effort) => most_probable(atlas, *start, *goal, pilot, effort, seed)?,
            Choice::Branching(effort) => most_probable_branching(atlas, *start, *goal, pilot, effort, seed)?,
            Choice::Belief(effort) => return self.believed(pilot, effort, seed, journeys),
        };
        let tally = self.fly(&plan, pilot, journeys, seed)?;
        Ok(Attempt::Tried { entries: plan.map.entries().len(), stated: plan.probability, tally })
    }

    /// The same with a belief, in place of a map.
    fn believed(&self, pilot: &Pilot, effort: Effort, seed: u64, journeys: u64) -> Result<Attempt, Error> {
        let charted =
            Charted::new(&self.atlas, &[&self.path(Objective::MOST_RELIABLE)?], pilot.noise.map_sigma)?;
        let journey = charted.journey(self.start, self.goal).ok_or(Error::NoDots)?;
        let model = Arc::new(charted.chart.model(pilot, effort.trials, seed)?);
        let stated =
            charted.simulate(&self.atlas, pilot, (&model, journey), effort.journeys, (seed, "stated"))?;
        let navigator = belief::navigator(&charted.chart, pilot, &model, journey)?;
        let tally = self.journeys(&navigator, (journey.start, &charted.dots), pilot.noise, journeys, seed)?;
        let stated = Some(stated.probability());
        Ok(Attempt::Tried { entries: charted.dots.len(), stated, tally })
    }

    pub(super) fn path(&self, objective: Objective) -> Result<Path, Error> {
        best(&self.atlas, self.start, self.goal, Measure::Windows, objective)
    }

    /// Simulates journeys over the true world by a plan.
    pub(super) fn fly(&self, plan: &Plan, pilot: &Pilot, journeys: u64, seed: u64) -> Result<Tally, Error> {
        let navigator = Navigator::new(pilot.settings, plan.map.clone())?;
        self.journeys(&navigator, (plan.path.start.centre, &plan.landmarks()), pilot.noise, journeys, seed)
    }

    /// Simulates journeys over the true world, in which dots have the same numbers as for the map-maker.
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
