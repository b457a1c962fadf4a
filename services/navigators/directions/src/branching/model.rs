//! The map-maker's model of the navigator's mistakes: the dots that a movement may attain from each dot, and the appearance of
//! their surroundings.
//!
//! Movements and looks are simulated separately, by geometry alone. In each trial the dots are displaced, and each look adds its
//! own errors.

use sketchnav_schemas::seed::stream;

use crate::arrival::{Pilot, Trial};
use crate::atlas::Atlas;
use crate::description::Descriptor;
use crate::geometry::Corner;
use crate::plane::DotId;
use crate::signature::Signature;
use crate::transitions::Movement;

/// Number of different panoramas.
pub const PANORAMAS: usize = 256;

/// An action of the navigator at a landmark: it moves the landmark to a corner, seeks from there, and may then slide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Action {
    /// The corner to move the landmark to.
    pub corner: Corner,
    /// The word of the landmark to seek.
    pub word: Descriptor,
    /// The movement to or along the landmark that was found.
    pub movement: Movement,
}

/// The result of an action.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// The places attained, by their numbers in the model, with their probabilities. The difference between the sum of all
    /// probabilities and 1 is the probability of a landmark outside the model.
    pub to: Vec<(usize, f64)>,
    /// The probability that no landmark fits the word.
    pub nothing: f64,
}

/// The places of a map, and the possible outcomes of movements between them.
#[derive(Debug)]
pub struct Model {
    /// The dots of the model, in ascending order. A dot's number in the model is its index in this list.
    pub dots: Vec<DotId>,
    /// The actions that are possible at each dot.
    pub actions: Vec<Action>,
    outcomes: Vec<Outcome>,
    /// Probability of each panorama around each dot.
    panoramas: Vec<[f32; PANORAMAS]>,
}

impl Model {
    /// Simulates every action at every dot, with the given number of trials.
    pub fn new(
        atlas: &Atlas,
        pilot: &Pilot,
        dots: Vec<DotId>,
        words: &[Descriptor],
        trials: u32,
        seed: u64,
    ) -> Self {
        let actions = actions(words, atlas.window.land.is_none());
        let mut counts = Counts::new(dots.len(), actions.len());
        let mut trial = Trial::new(atlas, pilot, stream(seed, "directions/slips"));
        for _ in 0..trials {
            trial.begin();
            for (place, &dot) in dots.iter().enumerate() {
                counts.look_around(place, trial.signature(dot));
                let mut number = 0;
                for corner in Corner::ALL {
                    let mut found = vec![None; words.len()];
                    // The navigator looks repeatedly for a landmark that it cannot locate.
                    for _ in 0..=pilot.settings.patience.min(MOST_PATIENCE) {
                        trial.look_around(dot, corner);
                        for (found, &word) in found.iter_mut().zip(words).filter(|(found, _)| found.is_none())
                        {
                            *found = trial.picked(corner, word);
                        }
                        if found.iter().all(Option::is_some) {
                            break;
                        }
                    }
                    for seen in found {
                        for &movement in movements(atlas.window.land.is_none()) {
                            let to = seen.and_then(|seen| match movement {
                                Movement::Seek => Some(seen),
                                movement => trial.slides(dot, seen, movement),
                            });
                            let to = to.map(|to| dots.binary_search(&to).unwrap_or(OUT));
                            // A slide that meets no dot ends the journey.
                            let to = if seen.is_some() { to.or(Some(OUT)) } else { None };
                            counts.attain(place, number, to);
                            number += 1;
                        }
                    }
                }
            }
        }
        let panoramas = counts.quadrants.iter().map(panoramas).collect();
        let outcomes = counts.attained.iter().map(|attained| outcome(attained, trials)).collect();
        Self { dots, actions, outcomes, panoramas }
    }

    /// Returns the outcome of an action at a place.
    pub fn outcome(&self, place: usize, action: usize) -> &Outcome {
        &self.outcomes[place * self.actions.len() + action]
    }

    /// Returns the probability of each panorama around a place.
    pub fn panoramas(&self, place: usize) -> &[f32; PANORAMAS] {
        &self.panoramas[place]
    }

    /// Returns the number of a dot in the model.
    pub fn place(&self, dot: DotId) -> Option<usize> {
        self.dots.binary_search(&dot).ok()
    }
}

/// Maximum number of simulated further looks. More would change nothing.
const MOST_PATIENCE: u8 = 5;
/// Stands for a landmark outside the model.
const OUT: usize = usize::MAX;

fn movements(slides: bool) -> &'static [Movement] {
    if slides { &[Movement::Seek, Movement::Forward, Movement::Backward] } else { &[Movement::Seek] }
}

/// Returns all actions, in the order in which they are simulated.
fn actions(words: &[Descriptor], slides: bool) -> Vec<Action> {
    let of_word =
        |corner, word| movements(slides).iter().map(move |&movement| Action { corner, word, movement });
    let of_corner = |corner| words.iter().flat_map(move |&word| of_word(corner, word));
    Corner::ALL.into_iter().flat_map(of_corner).collect()
}

/// Counts of what happened in the trials.
struct Counts {
    actions: usize,
    /// For each place and action, the landmarks attained and how often. `None` stands for no landmark.
    attained: Vec<Vec<(Option<usize>, u32)>>,
    /// For each place and quadrant, how often it had no, one, two, and three or more dots.
    quadrants: Vec<[[u32; 4]; 4]>,
}

impl Counts {
    fn new(places: usize, actions: usize) -> Self {
        Self { actions, attained: vec![Vec::new(); places * actions], quadrants: vec![[[0; 4]; 4]; places] }
    }

    fn look_around(&mut self, place: usize, seen: Signature) {
        for quadrant in Corner::ALL {
            self.quadrants[place][quadrant as usize][usize::from(seen.dots(quadrant))] += 1;
        }
    }

    fn attain(&mut self, place: usize, action: usize, to: Option<usize>) {
        let attained = &mut self.attained[place * self.actions + action];
        match attained.iter_mut().find(|(other, _)| *other == to) {
            Some((_, count)) => *count += 1,
            None => attained.push((to, 1)),
        }
    }
}

fn outcome(attained: &[(Option<usize>, u32)], trials: u32) -> Outcome {
    let share = |count: u32| f64::from(count) / f64::from(trials);
    let to = attained.iter().filter_map(|&(to, count)| Some((to.filter(|&to| to != OUT)?, share(count))));
    let nothing = attained.iter().find(|(to, _)| to.is_none()).map_or(0.0, |&(_, count)| share(count));
    Outcome { to: to.collect(), nothing }
}

/// Number of sightings assumed in addition to those counted, so that nothing has probability 0.
const UNSEEN: f32 = 0.25;

/// Returns the probability of each panorama, assuming that the quadrants are independent of each other.
fn panoramas(quadrants: &[[u32; 4]; 4]) -> [f32; PANORAMAS] {
    let shares = quadrants.map(|counts| {
        let all = counts.iter().sum::<u32>() as f32 + 4.0 * UNSEEN;
        counts.map(|count| (count as f32 + UNSEEN) / all)
    });
    std::array::from_fn(|code| {
        let seen = Signature::of_code(code as u8);
        Corner::ALL
            .into_iter()
            .map(|quadrant| shares[quadrant as usize][usize::from(seen.dots(quadrant))])
            .product()
    })
}
