//! The belief about the current landmark, and the decision where to go next.
//!
//! The belief is a Bayes filter over the landmarks of the chart. It is predicted through each movement with the probabilities of
//! the model, and updated with the surroundings seen afterwards (Thrun, Burgard and Fox, *Probabilistic Robotics*, 2005, table
//! 8.1).
//!
//! Decisions use *QMDP* with one step of look-ahead (Littman, Cassandra and Kaelbling, *Learning policies for partially observable
//! environments*, 1995). Value iteration computes the value of each movement from each landmark as if the navigator always knew
//! where it is. The value of a movement from a belief is the expected value, by QMDP, of the beliefs that result from all panoramas
//! that may be seen afterwards. The value of declaring that this is the goal is the probability that it is.

use std::sync::Arc;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::{Chart, Journey, MOST_LANDMARKS};
use crate::branching::model::{Action, Model, PANORAMAS};
use crate::branching::policy::values;
use crate::custom_map::Direction;
use crate::description::Descriptor;
use crate::error::Error;
use crate::navigator::guide::{Counts, Decision, Guide, Next, Order};
use crate::navigator::{Outcome, Settings};
use crate::plane::DotId;
use crate::signature::Signature;
use crate::transitions::Movement;

/// Factor by which the value of arrival is multiplied for each movement, which makes movements costly.
const DISCOUNT: f64 = 0.94;
/// Factor by which the value of a landmark is multiplied if a word has no landmark there.
const NOTHING: f64 = 0.8;
/// Probability that a movement attains any landmark of the chart, regardless of the model.
const ASTRAY: f32 = 0.002;
/// Landmarks less probable than this are neglected by the look-ahead.
const RARE: f32 = 0.002;
/// Panoramas less probable than this are neglected by the look-ahead.
const RARE_VIEW: f32 = 1e-4;
/// Maximum number of landmarks that the look-ahead considers after a movement.
const MOST_AFTER: usize = 48;
/// Maximum number of movements of a model: four corners, three words, three kinds.
const MOST_ACTIONS: usize = 36;
/// Maximum number of movements of a journey.
const LONGEST: usize = 60;
/// Factor by which the value of a movement is multiplied each time that it was made from the same landmark. The errors of the map
/// do not change, so a movement that went wrong once will probably go wrong again.
const AGAIN: f32 = 0.8;
/// Value below which no movement is worthwhile and the navigator is lost.
const HOPELESS: f32 = 1e-3;

/// The value of each movement from a landmark.
type Worths = [f32; MOST_ACTIONS];

/// The decisions on a journey to one landmark.
#[derive(Debug, Clone)]
pub struct Policy {
    model: Arc<Model>,
    /// Probability that the journey begins at each landmark.
    prior: Vec<f32>,
    goal: usize,
    /// Value of each movement from each landmark, if the navigator always knew where it is.
    worths: Vec<Worths>,
}

/// What a navigator with a belief remembers of a journey.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// The probability of each landmark.
    weights: ArrayVec<f32, MOST_LANDMARKS>,
    /// The movement under way, by its number in the model. `None` before the first.
    action: Option<u8>,
    /// One bit for each movement that found nothing at the current landmark.
    tried: u64,
    /// The movements made so far: the most probable landmark at that time, and the number of the movement in
    /// the model.
    made: ArrayVec<(u16, u8), LONGEST>,
    accepted: u16,
    recoveries: u16,
}

impl Belief {
    /// Returns the probability of each landmark.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// Returns the most probable landmark.
    pub fn most_probable(&self) -> usize {
        most_probable(&self.weights)
    }

    /// Scales the probabilities to a sum of 1. If their sum is 0, all landmarks become equally probable.
    fn normalize(&mut self) {
        let sum: f32 = self.weights.iter().sum();
        let even = 1.0 / self.weights.len() as f32;
        let scaled = |weight: f32| if sum > f32::MIN_POSITIVE { weight / sum } else { even };
        self.weights.iter_mut().for_each(|weight| *weight = scaled(*weight));
    }
}

fn most_probable(weights: &[f32]) -> usize {
    let all = weights.iter().enumerate();
    all.max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0))).map_or(0, |(place, _)| place)
}

impl Policy {
    /// Creates the policy of a journey. `sigma` is the standard deviation of a position in the navigator's view. Rejects a goal
    /// that the chart doesn't have.
    pub fn new(chart: &Chart, sigma: f64, model: Arc<Model>, journey: Journey) -> Result<Self, Error> {
        let (goal, places) = (usize::from(journey.goal), chart.landmarks().len());
        if goal >= places || model.dots.len() != places {
            return Err(Error::Parameter {
                what: "goal",
                expected: "a landmark of the chart",
                found: goal as f64,
            });
        }
        let values = values(&model, DISCOUNT, NOTHING, goal);
        let worth = |place: usize, action: usize| {
            let outcome = model.outcome(place, action);
            let led: f64 = outcome.to.iter().map(|&(to, p)| p * values[to]).sum();
            (DISCOUNT * (led + outcome.nothing * NOTHING * values[place])) as f32
        };
        let worths = |place: usize| {
            let mut worths = [0.0; MOST_ACTIONS];
            worths
                .iter_mut()
                .zip(0..model.actions.len())
                .for_each(|(own, action)| *own = worth(place, action));
            worths
        };
        let (worths, prior) = ((0..places).map(worths).collect(), chart.closest_to(journey.start, sigma));
        Ok(Self { model, prior, goal, worths })
    }

    /// Returns the probabilities of the landmarks after a movement. If they add up to less than 1, the rest is outside the chart.
    fn predicted(&self, weights: &[f32], action: usize) -> [f32; MOST_LANDMARKS] {
        let mut after = [0.0; MOST_LANDMARKS];
        for (place, &weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            for &(to, p) in &self.model.outcome(place, action).to {
                after[to] += weight * p as f32;
            }
        }
        after
    }

    /// Updates the belief with the surroundings of an attained landmark. Returns true if it is not the expected one.
    fn recognise(&self, belief: &mut Belief, seen: Signature) -> bool {
        let places = belief.weights.len();
        let mut after = [0.0; MOST_LANDMARKS];
        match belief.action {
            Some(action) => {
                after = self.predicted(&belief.weights, usize::from(action));
                after[..places].iter_mut().for_each(|weight| *weight += ASTRAY / places as f32);
            }
            None => after[..places].copy_from_slice(&belief.weights),
        }
        let expected = most_probable(&after[..places]);
        for (place, weight) in belief.weights.iter_mut().enumerate() {
            *weight = after[place] * self.model.panoramas(place)[usize::from(seen.code())];
        }
        belief.normalize();
        belief.most_probable() != expected
    }

    /// Decides on the next movement, or that this is the goal.
    fn decide(&self, belief: &Belief) -> Decision {
        if belief.made.is_full() {
            return Decision::Finish(Outcome::Lost);
        }
        let mut best = (belief.weights[self.goal], None);
        let factors = self.factors(belief);
        let mut bounds = self.qmdp(belief);
        bounds.iter_mut().zip(factors).for_each(|(bound, factor)| *bound *= factor);
        // QMDP is an upper bound of the look-ahead.
        while let Some((action, _)) = greatest(&bounds).filter(|(_, bound)| *bound > best.0) {
            bounds[action] = 0.0;
            let worth = factors[action] * self.look_ahead(belief, action);
            if worth > best.0 {
                best = (worth, Some(action));
            }
        }
        match best {
            (worth, _) if worth < HOPELESS => Decision::Finish(Outcome::Lost),
            (_, None) => Decision::Finish(Outcome::Arrived),
            (_, Some(action)) => {
                let corner = self.model.actions[action].corner;
                Decision::Adjust { corner, next: Next::Entry(action as u16) }
            }
        }
    }

    /// Returns the factor of each movement's value, which is 0 for movements tried in vain, and less than 1 for movements made
    /// before.
    fn factors(&self, belief: &Belief) -> Worths {
        let mut factors =
            std::array::from_fn(|action| if belief.tried >> action & 1 == 1 { 0.0 } else { 1.0 });
        let here = belief.most_probable() as u16;
        let made = belief.made.iter().filter(|(place, _)| *place == here);
        made.for_each(|&(_, action)| factors[usize::from(action)] *= AGAIN);
        factors
    }

    /// Returns the value of each movement if the navigator knew afterwards where it is.
    fn qmdp(&self, belief: &Belief) -> Worths {
        let mut sums = [0.0; MOST_ACTIONS];
        for (worths, &weight) in self.worths.iter().zip(&belief.weights).filter(|(_, weight)| **weight > 0.0)
        {
            sums.iter_mut().zip(worths).for_each(|(sum, worth)| *sum += weight * worth);
        }
        sums
    }

    /// Returns the value of a movement if the navigator sees the panorama afterwards, and then knows where it is.
    fn look_ahead(&self, belief: &Belief, action: usize) -> f32 {
        let after = self.predicted(&belief.weights, action);
        let mut to: ArrayVec<(usize, f32), MOST_AFTER> = ArrayVec::new();
        for (place, &p) in after.iter().enumerate().filter(|(_, p)| **p > RARE) {
            keep_likeliest(&mut to, (place, p));
        }
        let seen: f32 = (0..PANORAMAS).map(|code| self.worth_of_view(&to, code)).sum();
        DISCOUNT as f32 * (seen + NOTHING as f32 * self.worth_of_nothing(belief, action))
    }

    /// Returns the value of seeing a panorama at one of the landmarks, multiplied by the probability of both.
    fn worth_of_view(&self, to: &[(usize, f32)], code: usize) -> f32 {
        let joint: ArrayVec<(usize, f32), MOST_AFTER> =
            to.iter().map(|&(place, p)| (place, p * self.model.panoramas(place)[code])).collect();
        if joint.iter().map(|(_, p)| p).sum::<f32>() < RARE_VIEW {
            return 0.0;
        }
        self.worth_of(&joint)
    }

    /// Returns the value of finding nothing, multiplied by its probability, given that the same movement would find nothing again.
    fn worth_of_nothing(&self, belief: &Belief, action: usize) -> f32 {
        let mut sums = [0.0; MOST_ACTIONS];
        for (place, &weight) in belief.weights.iter().enumerate().filter(|(_, weight)| **weight > RARE) {
            let p = weight * self.model.outcome(place, action).nothing as f32;
            sums.iter_mut().zip(&self.worths[place]).for_each(|(sum, worth)| *sum += p * worth);
        }
        let others =
            sums.iter().enumerate().filter(|&(other, _)| other != action && belief.tried >> other & 1 == 0);
        others.map(|(_, sum)| *sum).fold(0.0, f32::max)
    }

    /// Returns the value of a belief by QMDP, or the probability of the goal if that is greater.
    fn worth_of(&self, weights: &[(usize, f32)]) -> f32 {
        let mut sums = [0.0; MOST_ACTIONS];
        let mut arrived = 0.0;
        for &(place, weight) in weights {
            sums.iter_mut().zip(&self.worths[place]).for_each(|(sum, worth)| *sum += weight * worth);
            arrived += if place == self.goal { weight } else { 0.0 };
        }
        sums.into_iter().fold(arrived, f32::max)
    }

    fn action(&self, belief: &Belief) -> Option<Action> {
        belief.action.map(|action| self.model.actions[usize::from(action)])
    }
}

/// Adds a landmark with its probability. If there is no room, it replaces the least probable one, unless it is itself less
/// probable.
fn keep_likeliest<const N: usize>(kept: &mut ArrayVec<(usize, f32), N>, landmark: (usize, f32)) {
    if let Err(full) = kept.try_push(landmark)
        && let Some(least) = kept.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1))
        && least.1 < landmark.1
    {
        *least = full.element();
    }
}

fn greatest(bounds: &Worths) -> Option<(usize, f32)> {
    let all = bounds.iter().copied().enumerate();
    all.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
}

impl Guide for Policy {
    type Memory = Belief;

    fn begin(&self) -> Belief {
        let weights = self.prior.iter().copied().collect();
        Belief { weights, action: None, tried: 0, made: ArrayVec::new(), accepted: 0, recoveries: 0 }
    }

    /// After a journey that arrived, the window is over the landmark that its belief is about. After any other, the navigator may
    /// be anywhere.
    fn begin_after(&self, last: Option<&Belief>) -> Belief {
        let begun = self.begin();
        let even = 1.0 / begun.weights.len() as f32;
        let weights = match last {
            Some(last) => last.weights.clone(),
            None => begun.weights.iter().map(|_| even).collect(),
        };
        Belief { weights, ..begun }
    }

    fn order(&self, belief: &Belief) -> Order {
        let Some(Action { word, movement, .. }) = self.action(belief) else {
            let word = Descriptor::Any;
            return Order { kind: None, word, bearing_deg: None, trajectory: None, looks_around: true };
        };
        let trajectory = match movement {
            Movement::Seek => None,
            Movement::Forward => Some(Direction::Forward),
            Movement::Backward => Some(Direction::Backward),
        };
        Order { kind: None, word, bearing_deg: None, trajectory, looks_around: true }
    }

    fn attained(&self, belief: &mut Belief, seen: Signature, _settings: &Settings) -> Decision {
        let slipped = self.recognise(belief, seen);
        belief.accepted += 1;
        belief.recoveries += u16::from(slipped);
        belief.tried = 0;
        self.decide(belief)
    }

    fn nothing(&self, belief: &mut Belief, _settings: &Settings) -> Decision {
        let Some(action) = belief.action else { return Decision::Finish(Outcome::CannotLocate) };
        for (place, weight) in belief.weights.iter_mut().enumerate() {
            *weight *= self.model.outcome(place, usize::from(action)).nothing as f32 + ASTRAY;
        }
        belief.normalize();
        belief.tried |= 1 << action;
        self.decide(belief)
    }

    fn enter(&self, belief: &mut Belief, action: u16) -> bool {
        let here = belief.most_probable() as u16;
        // The journey ends before the list is full.
        let _ = belief.made.try_push((here, action as u8));
        belief.action = Some(action as u8);
        true
    }

    fn counts(&self, belief: &Belief) -> Counts {
        Counts {
            entry: belief.made.len() as u16,
            accepted: belief.accepted,
            meant: belief.most_probable() as u16,
            recoveries: belief.recoveries,
        }
    }

    fn landmarks(&self) -> usize {
        self.prior.len()
    }

    fn goal(&self) -> usize {
        self.goal
    }

    fn is_planned(&self, attained: &[DotId], meant: &[DotId], _entries: &[u16]) -> bool {
        attained == meant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most probable landmark may have the highest number.
    #[test]
    fn when_there_is_no_room_the_least_probable_landmark_goes() {
        let mut kept: ArrayVec<(usize, f32), 2> = ArrayVec::new();
        for landmark in [(0, 0.1), (1, 0.05), (2, 0.8), (3, 0.01)] {
            keep_likeliest(&mut kept, landmark);
        }
        assert_eq!(kept[..], [(0, 0.1), (2, 0.8)]);
    }
}
