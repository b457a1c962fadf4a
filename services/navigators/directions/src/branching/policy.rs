//! Searches for a finite-state controller of the navigator. For each place at which the navigator may believe itself to be, the
//! controller determines an action, and the place to assume next, given the panorama of the attained landmark.
//!
//! The navigator's only memory is the place at which it believes itself to be. The map-maker knows the *belief*, the distribution
//! of true places over all simulated journeys that reach this entry. Bounded policy iteration (after Poupart and Boutilier 2003)
//! alternates between two steps. For the current controller, it computes the probability of arrival from each pair of believed and
//! true places. For each belief, it then finds the action and the reading of panoramas that make arrival most probable.

use std::collections::BTreeMap;

use super::model::{Model, Outcome, PANORAMAS};

/// The weights of the policy search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Factor by which the value of arrival is multiplied for each entry, which makes entries costly.
    pub discount: f64,
    /// Factor by which the value of a place is multiplied if its word has no landmark there.
    pub nothing: f64,
    /// Cost of moving to a place that the map doesn't contain yet, as a fraction of the place's value.
    pub new_place: f64,
    /// Minimum fraction of journeys that visit a place. Places with fewer visits are left out of the map.
    pub least_visits: f64,
}

/// The navigator's action at a place, and its interpretation of the resulting view.
#[derive(Debug, Clone)]
pub struct Node {
    /// Number of the action.
    pub action: usize,
    /// For each panorama, the place to assume.
    pub reads: Box<[usize; PANORAMAS]>,
    /// The places that may be assumed, each with its panoramas.
    pub takes: Vec<(usize, Vec<u8>)>,
    /// The place to assume for the current landmark if no landmark fits the word.
    pub nothing: usize,
}

/// A controller, with a node for each place of the model. Places that the map doesn't contain have no node, nor does the goal,
/// where the controller ends.
#[derive(Debug, Clone)]
pub struct Policy {
    /// The node of each place.
    pub nodes: Vec<Option<Node>>,
    /// The place at which the controller begins.
    pub start: usize,
    /// The place at which the controller ends.
    pub goal: usize,
}

/// The frequencies with which journeys visit pairs of believed and true places.
#[derive(Debug, Clone)]
pub struct Visits {
    /// For each believed place, the true places and their frequencies.
    pub beliefs: Vec<Vec<(usize, f64)>>,
}

impl Visits {
    /// Returns the number of journeys that end at the goal, as a fraction of all.
    pub fn arrives(&self, goal: usize) -> f64 {
        self.beliefs[goal].iter().filter(|(at, _)| *at == goal).map(|(_, visits)| visits).sum()
    }

    /// Returns the number of visits to a believed place, relative to the number of journeys.
    pub fn of(&self, place: usize) -> f64 {
        self.beliefs[place].iter().map(|(_, visits)| visits).sum()
    }
}

/// Number of rounds of the policy iteration with all places, and then with only those places that the map contains.
const ROUNDS: usize = 4;
const LAST_ROUNDS: usize = 3;
/// Maximum number of entries that a journey reads.
const LONGEST: usize = 60;
/// Number of sweeps over the places in each round.
const SWEEPS: usize = 16;
/// Outcomes less probable than this are neglected.
const RARE: f64 = 0.004;

/// A search for the best controller from a start to a goal.
pub struct Search<'a> {
    model: &'a Model,
    weights: Weights,
    /// The value of each place, if the navigator always knew where it is.
    values: Vec<f64>,
    /// The value of each true place, for each believed place.
    joint: Vec<Vec<f32>>,
    allowed: Vec<bool>,
    /// The best controller found.
    pub policy: Policy,
    /// The visits of journeys with the best controller.
    pub visits: Visits,
}

impl<'a> Search<'a> {
    /// Runs the search.
    pub fn run(model: &'a Model, weights: Weights, start: usize, goal: usize) -> Self {
        let places = model.dots.len();
        let policy = Policy { nodes: vec![None; places], start, goal };
        let visits = Visits { beliefs: vec![Vec::new(); places] };
        let (values, joint) = (values(model, weights.discount, weights.nothing, goal), Vec::new());
        let mut search = Self { model, weights, values, joint, allowed: vec![true; places], policy, visits };
        search.begin();
        (0..ROUNDS).for_each(|_| search.round());
        let least = weights.least_visits;
        search.allowed = (0..places)
            .map(|place| place == goal || place == start || search.visits.of(place) >= least)
            .collect();
        search.begin();
        let mut best: Option<(f64, Policy, Visits, Vec<Vec<f32>>)> = None;
        for _ in 0..LAST_ROUNDS {
            search.round();
            let arrives = search.visits.arrives(goal);
            if best.as_ref().is_none_or(|(most, ..)| arrives > *most) {
                best = Some((arrives, search.policy.clone(), search.visits.clone(), search.joint.clone()));
            }
        }
        if let Some((_, policy, visits, joint)) = best {
            (search.policy, search.visits, search.joint) = (policy, visits, joint);
        }
        search
    }

    /// Resets the values. Initially, only the goal has a value, so values grow from below and cycles are worth nothing.
    fn begin(&mut self) {
        let Policy { nodes, goal, .. } = &mut self.policy;
        nodes.fill(None);
        self.joint = vec![vec![0.0; nodes.len()]; nodes.len()];
        self.joint[*goal][*goal] = 1.0;
    }

    /// Improves each place repeatedly, for the visits under the previous controller and starting with the places near the goal.
    /// Then computes the visits under the new controller.
    fn round(&mut self) {
        let goal = self.policy.goal;
        let mut order: Vec<_> =
            (0..self.values.len()).filter(|&place| place != goal && self.allowed[place]).collect();
        order.sort_by(|&a, &b| self.values[b].total_cmp(&self.values[a]));
        for sweep in 0..SWEEPS {
            for &place in &order {
                if sweep < 3 || sweep % 4 == 0 {
                    self.improve(place);
                }
                self.back_up(place);
            }
        }
        self.visits = visits_of(self.model, &self.policy);
    }

    /// Finds the best action and reading for the belief at a place, and adopts them if they are better than the current ones.
    /// If no journey visits the place, it is assumed to be the true one.
    fn improve(&mut self, place: usize) {
        let visited = self.visits.of(place);
        let mut belief: Vec<_> = match visited > 0.0 {
            true => self.visits.beliefs[place].iter().map(|&(at, v)| (at, v / visited)).collect(),
            false => vec![(place, 1.0)],
        };
        belief.retain(|(_, share)| *share > RARE);
        let now: f64 = belief.iter().map(|&(at, p)| p * f64::from(self.joint[place][at])).sum();
        let node = self.best_node(place, &belief);
        if let Some((_, node)) = node.filter(|(value, _)| *value > now + 1e-6) {
            self.policy.nodes[place] = Some(node);
        }
    }

    /// Updates the value of a believed place for each true place, from the values of its successors.
    fn back_up(&mut self, place: usize) {
        let Some(node) = &self.policy.nodes[place] else { return };
        // Many places lead to the same places.
        let mut led: Vec<Option<f32>> = vec![None; self.values.len()];
        let worth = |at: usize| {
            let mut value = 0.0;
            let outcome = self.model.outcome(at, node.action);
            for &(to, p) in &outcome.to {
                value += p * f64::from(*led[to].get_or_insert_with(|| self.led(node, to)));
            }
            if node.nothing != usize::MAX {
                value += self.weights.nothing * outcome.nothing * f64::from(self.joint[node.nothing][at]);
            }
            (self.weights.discount * value) as f32
        };
        self.joint[place] = (0..self.values.len()).map(worth).collect();
    }

    /// Returns the value of a true place, at which the panorama decides which place is assumed next.
    fn led(&self, node: &Node, to: usize) -> f32 {
        let panoramas = self.model.panoramas(to);
        let of =
            node.takes.iter().filter(|(taken, _)| self.joint[*taken][to] != 0.0).map(|(taken, share)| {
                let seen: f32 = share.iter().map(|&seen| panoramas[usize::from(seen)]).sum();
                seen * self.joint[*taken][to]
            });
        of.sum()
    }

    /// Returns the distribution of true places over visits to a believed place.
    pub fn belief(&self, place: usize) -> Vec<(usize, f64)> {
        let visits = self.visits.of(place).max(f64::MIN_POSITIVE);
        self.visits.beliefs[place].iter().map(|&(at, v)| (at, v / visits)).filter(|b| b.1 > RARE).collect()
    }

    /// Returns the probability of arrival from a true place while another place is assumed.
    pub fn worth(&self, taken: usize, at: usize) -> f32 {
        self.joint[taken][at]
    }

    fn best_node(&self, place: usize, belief: &[(usize, f64)]) -> Option<(f64, Node)> {
        // An upper bound of an action's value, which it would have if every landmark were recognised.
        let bound = |after: &After| {
            let led: f64 = after.to.iter().map(|&(to, p)| p * self.values[to]).sum();
            let nothing: f64 = after.nothing.iter().map(|&(at, p)| p * self.values[at]).sum();
            (led + nothing * self.weights.nothing) * self.weights.discount
        };
        let all = (0..self.model.actions.len()).map(|action| (action, after(self.model, belief, action)));
        let mut all: Vec<_> = all.map(|(action, after)| (bound(&after), action, after)).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut best: Option<(f64, Node)> = None;
        for (bound, action, after) in all {
            if best.as_ref().is_some_and(|(most, _)| bound <= *most) {
                break;
            }
            let (value, node) = self.read(place, action, &after);
            if best.as_ref().is_none_or(|(most, _)| value > *most) {
                best = Some((value, node));
            }
        }
        best
    }

    /// Returns the value of the best reading of the views after an action, and the node with this reading.
    fn read(&self, place: usize, action: usize, after: &After) -> (f64, Node) {
        let places = after.places();
        let known = |place: usize| match place == self.policy.goal || self.visits.of(place) > 0.0 {
            true => 1.0,
            false => 1.0 - self.weights.new_place,
        };
        let choices: Vec<usize> = places.iter().copied().filter(|&place| self.allowed[place]).collect();
        let worth: Vec<Vec<f32>> = choices
            .iter()
            .map(|&choice| {
                let value = |&(to, p): &(usize, f64)| (p * known(choice)) as f32 * self.joint[choice][to];
                after.to.iter().map(value).collect()
            })
            .collect();
        let (mut value, mut reads) = (0.0, Box::new([usize::MAX; PANORAMAS]));
        for seen in 0..PANORAMAS {
            let mut best = (0.0_f32, usize::MAX);
            for (choice, worth) in choices.iter().zip(&worth) {
                let of: f32 =
                    after.to.iter().zip(worth).map(|(&(to, _), w)| w * self.model.panoramas(to)[seen]).sum();
                if of > best.0 || best.1 == usize::MAX {
                    best = (of, *choice);
                }
            }
            value += f64::from(best.0);
            reads[seen] = best.1;
        }
        // Events that are impossible in the model may still happen.
        let stays = if after.nothing.is_empty() { &after.before } else { &after.nothing };
        let stay =
            |place: usize| -> f64 { stays.iter().map(|&(at, p)| p * f64::from(self.joint[place][at])).sum() };
        // Repeating the same action would be equally unsuccessful, whereas the action of another place may be right here.
        let others = (0..self.allowed.len()).filter(|&other| other != place && other != self.policy.goal);
        let others =
            others.filter(|&other| self.allowed[other]).map(|other| (stay(other) * known(other), other));
        let best = others.filter(|(worth, _)| *worth > 0.0).max_by(|a, b| a.0.total_cmp(&b.0));
        let nothing = best.map_or(usize::MAX, |(_, other)| other);
        if !after.nothing.is_empty() {
            value += best.map_or(0.0, |(worth, _)| worth * self.weights.nothing);
        }
        (value * self.weights.discount, Node { action, takes: grouped(&reads), reads, nothing })
    }
}

/// Where a node may lead: the assumed place, the true place and the probability.
type Step = (usize, usize, f64);

/// Returns the possible next steps of a node from a true place.
fn follow(model: &Model, node: &Node, at: usize) -> Vec<Step> {
    let mut next: Vec<Step> = Vec::new();
    for &(to, p) in &model.outcome(at, node.action).to {
        let panoramas = model.panoramas(to);
        let begin = next.len();
        for (seen, &taken) in node.reads.iter().enumerate() {
            if taken == usize::MAX {
                continue;
            }
            let p = p * f64::from(panoramas[seen]);
            match next[begin..].iter_mut().find(|(other, ..)| *other == taken) {
                Some((.., sum)) => *sum += p,
                None => next.push((taken, to, p)),
            }
        }
    }
    next
}

/// Groups the panoramas by the place that they are read as.
fn grouped(reads: &[usize; PANORAMAS]) -> Vec<(usize, Vec<u8>)> {
    let mut groups: Vec<(usize, Vec<u8>)> = Vec::new();
    for (seen, &taken) in reads.iter().enumerate().filter(|(_, taken)| **taken != usize::MAX) {
        match groups.iter_mut().find(|(other, _)| *other == taken) {
            Some((_, group)) => group.push(seen as u8),
            None => groups.push((taken, vec![seen as u8])),
        }
    }
    groups
}

/// Returns the frequencies with which journeys with a controller visit each believed place, and the true places at these times.
pub fn visits_of(model: &Model, policy: &Policy) -> Visits {
    let places = model.dots.len();
    let mut sums: Vec<Vec<(usize, f64)>> = vec![Vec::new(); places];
    let mut now: Vec<Vec<(usize, f64)>> = vec![Vec::new(); places];
    let mut cache: BTreeMap<(usize, usize), Vec<Step>> = BTreeMap::new();
    now[policy.start].push((policy.start, 1.0));
    for _ in 0..LONGEST {
        let mut then: Vec<Vec<(usize, f64)>> = vec![Vec::new(); places];
        for (believed, belief) in now.iter().enumerate() {
            for &(at, mass) in belief {
                add(&mut sums[believed], at, mass);
                let Some(node) = policy.nodes[believed].as_ref().filter(|_| believed != policy.goal) else {
                    continue;
                };
                let next = cache.entry((believed, at)).or_insert_with(|| follow(model, node, at));
                for &(taken, to, p) in next.iter() {
                    if mass * p > 1e-5 {
                        add(&mut then[taken], to, mass * p);
                    }
                }
                let nothing = model.outcome(at, node.action).nothing * mass;
                if nothing > 1e-5 && node.nothing != usize::MAX {
                    add(&mut then[node.nothing], at, nothing);
                }
            }
        }
        now = then;
    }
    Visits { beliefs: sums }
}

fn add(belief: &mut Vec<(usize, f64)>, at: usize, mass: f64) {
    match belief.iter_mut().find(|(other, _)| *other == at) {
        Some((_, sum)) => *sum += mass,
        None => belief.push((at, mass)),
    }
}

/// The distribution of places after an action.
pub struct After {
    /// The places attained, with their probabilities.
    pub to: Vec<(usize, f64)>,
    /// The places where the navigator remains because no landmark fits the word, with their probabilities.
    pub nothing: Vec<(usize, f64)>,
    /// The places before the action, with their probabilities.
    pub before: Vec<(usize, f64)>,
}

impl After {
    fn places(&self) -> Vec<usize> {
        self.to.iter().map(|&(to, _)| to).collect()
    }
}

/// Returns the distribution of places after an action at a belief. Rare outcomes are neglected.
pub fn after(model: &Model, belief: &[(usize, f64)], action: usize) -> After {
    let mut after = After { to: Vec::new(), nothing: Vec::new(), before: belief.to_vec() };
    for &(at, share) in belief {
        let Outcome { to, nothing } = model.outcome(at, action);
        to.iter().for_each(|&(to, p)| add(&mut after.to, to, share * p));
        if *nothing > 0.0 {
            add(&mut after.nothing, at, share * nothing);
        }
    }
    after.to.retain(|(_, p)| *p > RARE);
    after.nothing.retain(|(_, p)| *p > RARE);
    after
}

/// Returns the value of each place if the navigator always knew where it is, by value iteration. The factors are those of
/// [`Weights`].
pub fn values(model: &Model, discount: f64, nothing: f64, goal: usize) -> Vec<f64> {
    let places = model.dots.len();
    let mut values = vec![0.0; places];
    values[goal] = 1.0;
    for _ in 0..200 {
        let mut change = 0.0_f64;
        for place in (0..places).filter(|&place| place != goal) {
            for action in 0..model.actions.len() {
                let outcome = model.outcome(place, action);
                let led: f64 = outcome.to.iter().map(|&(to, p)| p * values[to]).sum();
                let value = discount * (led + outcome.nothing * nothing * values[place]);
                if value > values[place] {
                    change = change.max(value - values[place]);
                    values[place] = value;
                }
            }
        }
        if change < 1e-5 {
            break;
        }
    }
    values
}
