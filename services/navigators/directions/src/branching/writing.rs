//! Writes a controller as a custom map, with an entry for each place that journeys visit and few signs in each entry.

use super::model::{Action, Model, PANORAMAS};
use super::policy::{Node, Search};
use crate::custom_map::{Branch, CustomMap, Direction, Entry, MOST_DIFFERENCE, Sign, Verification};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::plan::Plan;
use crate::signature::Signature;
use crate::transitions::Movement;

/// Maximum number of panoramas of an entry. Including those for any other view and for no landmark, an entry has at most eight
/// signs.
const MOST_SIGNS: usize = 6;
/// Number of panoramas that are tried as signs, starting with the most important ones.
const SIGNS_TRIED: usize = 24;
/// Minimum increase in the fraction of journeys that arrive for a sign to be added.
const LEAST_GAIN: f64 = 0.001;

/// An entry's interpretation of a landmark's surroundings.
struct Reading {
    /// The panoramas of the entry, each with the place to assume for similar panoramas.
    signs: Vec<(u8, usize)>,
    /// The place to assume for any other view.
    other: usize,
    /// The place to assume for the current landmark if no landmark fits the word.
    nothing: Option<usize>,
}

/// Returns the map of a controller, or `None` if it doesn't lead to the goal.
pub fn write(model: &Model, search: &Search<'_>, straight: &Plan) -> Result<Option<Plan>, Error> {
    let policy = &search.policy;
    let readings: Vec<Option<Reading>> =
        (0..policy.nodes.len()).map(|place| reading(model, search, place)).collect();
    let order = order(model, search, &readings);
    let number = |place: usize| order.iter().position(|&other| other == place);
    let corner = |place: usize| policy.nodes[place].as_ref().map(|node| model.actions[node.action].corner);
    let first = Entry {
        kind: None,
        word: Descriptor::Any,
        bearing_deg: None,
        trajectory: None,
        verification: None,
        place: corner(policy.start),
    };
    let mut entries = vec![first];
    for (index, &place) in order.iter().enumerate() {
        let (Some(node), Some(reading)) = (&policy.nodes[place], &readings[place]) else { return Ok(None) };
        let next = order.get(index + 1).copied();
        let branch = |to: usize| Some(Branch { corner: corner(to)?, entry: number(to)? as u16 + 1 });
        let Some(entry) = entry(model.actions[node.action], reading, policy.goal, next, branch) else {
            return Ok(None);
        };
        entries.push(entry);
    }
    let landmarks = order.iter().chain([&policy.goal]).map(|&place| model.dots[place]).collect();
    let Ok(map) = CustomMap::new(entries) else { return Ok(None) };
    Ok(Some(Plan { map, landmarks, probability: None, ..straight.clone() }))
}

fn entry(
    action: Action,
    reading: &Reading,
    goal: usize,
    next: Option<usize>,
    branch: impl Fn(usize) -> Option<Branch>,
) -> Option<Entry> {
    let trajectory = match action.movement {
        Movement::Seek => None,
        Movement::Forward => Some(Direction::Forward),
        Movement::Backward => Some(Direction::Backward),
    };
    let plain = Entry {
        kind: None,
        word: action.word,
        bearing_deg: None,
        trajectory,
        verification: None,
        place: None,
    };
    let signs = reading.signs.iter().map(|&(code, to)| (Sign::Panorama(Signature::of_code(code)), to));
    let mut clauses: Vec<(Sign, usize)> = signs.chain([(Sign::Other, reading.other)]).collect();
    // The right landmark is the goal or, if the entry never leads there, the place of the next entry.
    let ends = clauses.iter().any(|&(_, to)| to == goal);
    let right = if ends { Some(goal) } else { next };
    let right = clauses.iter().position(|&(_, to)| Some(to) == right).map(|index| clauses.remove(index));
    let place: Option<Corner> = match right {
        Some((_, to)) if to != goal => Some(branch(to)?.corner),
        _ => None,
    };
    let mut verification = match right {
        Some((Sign::Other, _)) if clauses.is_empty() => Verification::default(),
        Some((sign, _)) => Verification::new(sign).ok()?,
        None => Verification::default(),
    };
    for (sign, to) in clauses {
        verification = verification.branching(sign, branch(to)?);
    }
    if let Some(to) = reading.nothing {
        verification = verification.branching(Sign::Nothing, branch(to)?);
    }
    let verification = Some(verification).filter(|signs| *signs != Verification::default());
    Some(Entry { verification, place, ..plain })
}

/// Returns the places of the map: first those of the most probable path to the goal, then those that only branches lead to.
fn order(model: &Model, search: &Search<'_>, readings: &[Option<Reading>]) -> Vec<usize> {
    let policy = &search.policy;
    let mut order = Vec::new();
    let mut place = policy.start;
    while place != policy.goal && !order.contains(&place) {
        order.push(place);
        let Some(reading) = &readings[place] else { break };
        place = most_probable(model, search, place, reading);
    }
    let mut index = 0;
    while let Some(&place) = order.get(index) {
        if let Some(reading) = &readings[place] {
            let leads = reading.signs.iter().map(|&(_, to)| to).chain([reading.other]).chain(reading.nothing);
            for to in leads {
                if to != policy.goal && !order.contains(&to) {
                    order.push(to);
                }
            }
        }
        index += 1;
    }
    order
}

fn most_probable(model: &Model, search: &Search<'_>, place: usize, reading: &Reading) -> usize {
    let mut shares: Vec<(usize, f64)> = Vec::new();
    let belief = search.belief(place);
    let Some(node) = &search.policy.nodes[place] else { return place };
    let after = super::policy::after(model, &belief, node.action);
    for (to, p) in after.to {
        for (seen, share) in model.panoramas(to).iter().enumerate() {
            let taken = reading.takes(Signature::of_code(seen as u8));
            let p = p * f64::from(*share);
            match shares.iter_mut().find(|(other, _)| *other == taken) {
                Some((_, sum)) => *sum += p,
                None => shares.push((taken, p)),
            }
        }
    }
    shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(place, |(to, _)| to)
}

impl Reading {
    fn takes(&self, seen: Signature) -> usize {
        let off = |&(code, to): &(u8, usize)| (Signature::of_code(code).difference(seen), code, to);
        let nearest = self.signs.iter().map(off).filter(|(off, ..)| *off <= MOST_DIFFERENCE).min();
        nearest.map_or(self.other, |(.., to)| to)
    }
}

/// Chooses a few signs that are almost as informative as the controller's, by repeatedly adding the best one.
fn reading(model: &Model, search: &Search<'_>, place: usize) -> Option<Reading> {
    let node = search.policy.nodes[place].as_ref()?;
    let visits = search.visits.of(place);
    if visits <= 0.0 || place == search.policy.goal {
        return None;
    }
    let after = super::policy::after(model, &search.belief(place), node.action);
    let worths = Worths::new(model, search, node, &after.to);
    let (choices, worth) = (&worths.choices, &worths.of);
    let other = (0..choices.len()).max_by(|&a, &b| worths.total(a).total_cmp(&worths.total(b)))?;
    let mut tried: Vec<u8> = (0..=u8::MAX).collect();
    let mass = |code: &u8| -> f32 {
        (0..choices.len()).map(|choice| worth[choice][usize::from(*code)]).fold(0.0, f32::max)
    };
    tried.sort_by(|a, b| mass(b).total_cmp(&mass(a)).then(a.cmp(b)));
    tried.truncate(SIGNS_TRIED);
    let mut signs: Vec<(u8, usize)> = Vec::new();
    let mut value = worths.total(other);
    let least = (LEAST_GAIN / visits.min(1.0)) as f32;
    while signs.len() < MOST_SIGNS {
        let mut best: Option<(f32, (u8, usize))> = None;
        for &code in &tried {
            if signs.iter().any(|&(known, _)| known == code) {
                continue;
            }
            for choice in 0..choices.len() {
                let is_goal = choices[choice] == search.policy.goal;
                let has_goal =
                    choices[other] == search.policy.goal || signs.iter().any(|&(_, to)| to == choice);
                if is_goal && has_goal {
                    continue;
                }
                signs.push((code, choice));
                let with = worths.by(&signs, other);
                signs.pop();
                if best.is_none_or(|(most, _)| with > most) {
                    best = Some((with, (code, choice)));
                }
            }
        }
        match best {
            Some((with, sign)) if with - value >= least => {
                value = with;
                signs.push(sign);
            }
            _ => break,
        }
    }
    Some(Reading {
        signs: signs.into_iter().map(|(code, choice)| (code, choices[choice])).collect(),
        other: choices[other],
        nothing: Some(node.nothing).filter(|&to| to != usize::MAX),
    })
}

/// The value of assuming each place for each panorama.
struct Worths {
    choices: Vec<usize>,
    of: Vec<[f32; PANORAMAS]>,
}

impl Worths {
    fn new(model: &Model, search: &Search<'_>, node: &Node, after: &[(usize, f64)]) -> Self {
        let mut choices: Vec<usize> = node.reads.iter().copied().filter(|&to| to != usize::MAX).collect();
        choices.sort_unstable();
        choices.dedup();
        let of = |&choice: &usize| {
            let mut worth = [0.0; PANORAMAS];
            for &(to, p) in after {
                let value = p as f32 * search.worth(choice, to);
                worth.iter_mut().zip(model.panoramas(to)).for_each(|(sum, share)| *sum += value * share);
            }
            worth
        };
        Self { of: choices.iter().map(of).collect(), choices }
    }

    fn total(&self, choice: usize) -> f32 {
        self.of[choice].iter().sum()
    }

    /// Returns the value of a reading with the given signs and one place for all other views.
    fn by(&self, signs: &[(u8, usize)], other: usize) -> f32 {
        let reading = Reading { signs: signs.to_vec(), other, nothing: None };
        (0..=u8::MAX).map(|seen| self.of[reading.takes(Signature::of_code(seen))][usize::from(seen)]).sum()
    }
}
