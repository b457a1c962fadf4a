//! What a map-maker knows of the navigator's slips: which dot a movement attains from each dot, and what is then seen around it.
//!
//! Movements and looks are simulated one by one, as geometry. In each trial the dots lie elsewhere, and each look has errors of its
//! own.

use sketchnav_schemas::seed::stream;

use crate::arrival::{Pilot, Trial};
use crate::atlas::Atlas;
use crate::description::Descriptor;
use crate::geometry::Corner;
use crate::plane::DotId;
use crate::signature::Signature;
use crate::transitions::Movement;

/// How many panoramas there are.
pub const PANORAMAS: usize = 256;

/// What the navigator does with a landmark: it moves it to a corner, seeks from there, and may slide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Action {
    /// The corner.
    pub corner: Corner,
    /// The word by which it seeks.
    pub word: Descriptor,
    /// How it moves to what it has found.
    pub movement: Movement,
}

/// What an action attains.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Places, by their numbers in the model, and their probabilities. What is missing from 1 is a landmark that is out of reach.
    pub to: Vec<(usize, f64)>,
    /// The probability that there is no landmark that the word means.
    pub nothing: f64,
}

/// The places of a map and what may happen between them.
#[derive(Debug)]
pub struct Model {
    /// The dots that count, ascending; their places in this list are their numbers here.
    pub dots: Vec<DotId>,
    /// What can be done at each of them.
    pub actions: Vec<Action>,
    outcomes: Vec<Outcome>,
    /// How probable each panorama is around each dot.
    panoramas: Vec<[f32; PANORAMAS]>,
}

impl Model {
    /// Simulates so many trials of everything that can be done at these dots.
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
                    // It looks again and again for a landmark that it cannot locate.
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
                            // A slide to nowhere ends the journey.
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

    /// What an action attains from a dot.
    pub fn outcome(&self, place: usize, action: usize) -> &Outcome {
        &self.outcomes[place * self.actions.len() + action]
    }

    /// How probable each panorama is around a dot.
    pub fn panoramas(&self, place: usize) -> &[f32; PANORAMAS] {
        &self.panoramas[place]
    }

    /// The number of a dot.
    pub fn place(&self, dot: DotId) -> Option<usize> {
        self.dots.binary_search(&dot).ok()
    }
}

/// More looks in vain change nothing.
const MOST_PATIENCE: u8 = 5;
/// A landmark that is no place of the model.
const OUT: usize = usize::MAX;

fn movements(slides: bool) -> &'static [Movement] {
    if slides { &[Movement::Seek, Movement::Forward, Movement::Backward] } else { &[Movement::Seek] }
}

/// In the order in which they are simulated.
fn actions(words: &[Descriptor], slides: bool) -> Vec<Action> {
    let of_word =
        |corner, word| movements(slides).iter().map(move |&movement| Action { corner, word, movement });
    let of_corner = |corner| words.iter().flat_map(move |&word| of_word(corner, word));
    Corner::ALL.into_iter().flat_map(of_corner).collect()
}

/// What happened in the trials.
struct Counts {
    actions: usize,
    /// For each place and action: what was attained, and how often; none where there was no landmark.
    attained: Vec<Vec<(Option<usize>, u32)>>,
    /// For each place and quadrant: how often it had none, one, two and more dots.
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

/// A count that was never seen has this many sightings.
const UNSEEN: f32 = 0.25;

/// The quadrants have their dots independently of each other.
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
