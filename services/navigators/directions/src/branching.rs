//! Finds the most probable branching maps, using the map-maker's model of the navigator's mistakes. This
//! method is our own.
//!
//! A navigator with a straight map follows it blindly, and a single mistake ends the journey. A branching map also says, for each
//! landmark, which others the navigator may have attained instead, how to recognise them by their panoramas, and how to continue
//! from there. The map-maker
//! 1. simulates what may happen at each landmark near its paths ([`model`]);
//! 2. searches for the controller with the greatest probability of arrival ([`policy`]);
//! 3. writes this controller as a map with few entries and few signs ([`writing`]);
//! 4. compares several such maps and straight ones by whole journeys, and states the probability of arrival of the best
//!    ([`crate::arrival`]).

pub mod model;
pub mod policy;
pub mod writing;

use crate::arrival::{Effort, FINALISTS, Pilot, along, most_probable, ranked, stated};
use crate::atlas::Atlas;
use crate::description::{Descriptor, Vocabulary};
use crate::error::Error;
use crate::path::Start;
use crate::plan::Plan;
use crate::plane::DotId;
use model::Model;
use policy::{Search, Weights};

/// Distance from a path within which dots are considered, in window sides.
const REACH: f64 = 1.5;
/// Maximum number of entries of a map, as a multiple of the straight map's entries.
const LONGEST: usize = 3;

/// Maximum number of entries of a straight map for which branching maps are searched. The search uses the discounted probability of
/// arrival as the value of a place, which vanishes far from the goal.
const LONGEST_STRAIGHT: usize = 120;

/// The weights of the searches. Each yields a map, and all of these maps are compared.
const WEIGHTS: [Weights; 5] = [
    Weights { discount: 0.985, nothing: 0.8, new_place: 0.01, least_visits: 0.01 },
    Weights { discount: 0.97, nothing: 0.8, new_place: 0.03, least_visits: 0.02 },
    Weights { discount: 0.97, nothing: 0.8, new_place: 0.02, least_visits: 0.005 },
    Weights { discount: 0.95, nothing: 0.8, new_place: 0.01, least_visits: 0.01 },
    Weights { discount: 0.9, nothing: 0.8, new_place: 0.01, least_visits: 0.005 },
];
/// Number of simulated models, each with different errors. A single model would not do, because a search relies on everything in
/// its model, including chance results about rare mistakes.
const MODELS: u64 = 2;

/// The words of branching maps, as far as the navigator understands them. `*` is included because the closest landmark is often a
/// safe choice.
const WORDS: [Descriptor; 3] = [Descriptor::Isolated, Descriptor::IsolatedPair, Descriptor::Any];

/// Returns the words of branching maps that a navigator understands.
pub fn words(vocabulary: Vocabulary) -> Vec<Descriptor> {
    WORDS.into_iter().filter(|&word| vocabulary.has(word)).collect()
}

/// Returns the plan with the greatest probability of arrival among branching and straight maps, together with
/// that probability. If the straight map has more than 120 entries, no other is considered.
///
/// # Errors
/// Any error of [`most_probable`].
pub fn most_probable_branching(
    atlas: &Atlas,
    start: Start,
    goal: DotId,
    pilot: &Pilot,
    effort: Effort,
    seed: u64,
) -> Result<Plan, Error> {
    let straight = most_probable(atlas, start, goal, pilot, effort, seed)?;
    if straight.map.entries().len() > LONGEST_STRAIGHT {
        return Ok(straight);
    }
    let places = straight.path.landmarks().into_iter().map(|dot| atlas.plane.dot(dot));
    let (dots, words) = (along(atlas, places, REACH), words(pilot.settings.vocabulary));
    let mut plans = Vec::new();
    for number in 0..MODELS {
        let model = Model::new(atlas, pilot, dots.clone(), &words, effort.trials, seed.wrapping_add(number));
        let written = |weights: &Weights| written(&model, *weights, &straight).transpose();
        plans.extend(WEIGHTS.iter().filter_map(written).collect::<Result<Vec<_>, _>>()?);
    }
    plans.push(straight.clone());
    let plans = ranked(atlas, plans, pilot, effort.trial_journeys, (seed, "branching"))?;
    let finalists = plans.into_iter().take(FINALISTS).collect();
    let plans = ranked(atlas, finalists, pilot, effort.trial_journeys * 4, (seed, "branching final"))?;
    let plan = plans.into_iter().next().unwrap_or(straight);
    stated(atlas, plan, pilot, effort.journeys, seed)
}

/// Returns the map of the best controller, or `None` if it does not lead to the goal or is too long compared with the straight map.
fn written(model: &Model, weights: Weights, straight: &Plan) -> Result<Option<Plan>, Error> {
    let landmarks = straight.path.landmarks();
    let ends = [landmarks[0], landmarks[landmarks.len() - 1]].map(|dot| model.place(dot));
    let [Some(start), Some(goal)] = ends else { return Ok(None) };
    if start == goal {
        return Ok(None);
    }
    let search = Search::run(model, weights, start, goal);
    let plan = writing::write(model, &search, straight)?;
    Ok(plan.filter(|plan| plan.map.entries().len() <= LONGEST * straight.map.entries().len()))
}

#[cfg(test)]
mod tests;
