//! Compares the predictions of equations 1 and 2 with drives, for single transitions and for whole paths (figure 25).

use std::ops::Range;

use sketchnav_schemas::statistics::mean;

use super::Table;
use super::journeys::{Setting, World};
use crate::arrival::estimates;
use crate::error::Error;
use crate::path::{Atlas, Leg, Objective, Path, Start};
use crate::plan::{Plan, Verify};
use crate::plane::DotId;
use crate::transitions::{Kinds, Movement, Transition};

/// Number of simulations per transition.
const TRIALS: u32 = 64;
/// Number of journeys per path.
const JOURNEYS: u64 = 5;

/// Number of candidates from which seeks belong to the last class. The other classes contain seeks with fewer candidates, one class
/// for each number, and trajectories.
const MOST: u16 = 5;
const CLASSES: usize = MOST as usize + 1;

fn class(transition: &Transition) -> usize {
    match transition.movement {
        Movement::Seek => usize::from(transition.candidates.min(MOST)) - 1,
        Movement::Forward | Movement::Backward => CLASSES - 1,
    }
}

fn name(class: usize) -> String {
    match class + 1 {
        CLASSES => "trajectory".to_owned(),
        candidates if candidates == usize::from(MOST) => format!("{MOST} candidates and more"),
        1 => "1 candidate".to_owned(),
        candidates => format!("{candidates} candidates"),
    }
}

/// Drives each transition of many worlds once, on its own, and returns how often it attains its target according to equations 1
/// and 2, according to the simulation of transitions, and in the drives. The values are means over worlds; those of the drives
/// have Student's confidence interval.
pub fn of_transitions(sigmas: &[f64], worlds: Range<u64>) -> Result<Table, Error> {
    let head = ["transition", "equations, %", "simulated, %", "driven, %", "low", "high", "worlds", "drives"];
    let mut table = Table::new("Equations 1 and 2 against drives: transitions", &head);
    for &sigma in sigmas {
        let setting = Setting::of_sigma(sigma)?;
        // For each class, the mean of each world and the total number of drives.
        let mut classes: [([Vec<f64>; 3], f64); CLASSES] = Default::default();
        for seed in worlds.clone() {
            let Some(world) = World::new(seed, &setting, Kinds::PAPER)? else { continue };
            for (own, all) in transitions(&world, &setting, seed)?.into_iter().zip(&mut classes) {
                let [equations, ..] = &own;
                all.1 += equations.len() as f64;
                if !equations.is_empty() {
                    own.iter().zip(&mut all.0).for_each(|(shares, means)| means.push(100.0 * mean(shares)));
                }
            }
        }
        for (class, ([equations, simulated, driven], drives)) in classes.iter().enumerate() {
            let mut row = vec![mean(equations), mean(simulated)];
            row.extend(Table::mean_of(driven));
            row.push(*drives);
            table.row(format!("{sigma} mm, {}", name(class)), &row);
        }
    }
    Ok(table)
}

/// Returns, for each class of a world's transitions, the predictions of the equations, those of the simulation, and the
/// outcomes of the drives.
fn transitions(world: &World, setting: &Setting, seed: u64) -> Result<[[Vec<f64>; 3]; CLASSES], Error> {
    let mut classes: [[Vec<f64>; 3]; CLASSES] = Default::default();
    let (atlas, pilot) = (&world.atlas, setting.pilot());
    let simulated = estimates(atlas, &pilot, TRIALS, seed, |_| true)?;
    for (number, (from, transition)) in (0..).zip(atlas.transitions.all()) {
        let plan = Plan::new(atlas, alone(atlas, from, number, *transition)?, Verify::Nothing)?;
        let tally = world.fly(&plan, &pilot, 1, seed ^ u64::from(number) << 32)?;
        let shares = [plan.path.reliability(), simulated[number as usize].plain, f64::from(tally.arrivals())];
        classes[class(transition)].iter_mut().zip(shares).for_each(|(all, share)| all.push(share));
    }
    Ok(classes)
}

/// Returns a path that consists of a single transition.
fn alone(atlas: &Atlas, from: DotId, number: u32, transition: Transition) -> Result<Path, Error> {
    let distance = atlas.window_distance(from, &transition, None);
    let unreliability = f64::from(atlas.unreliability[number as usize]);
    let leg = Leg { from, number, transition, place: None, distance, unreliability };
    Ok(Path { start: Start::over(&atlas.plane, from)?, legs: vec![leg], distance, unreliability })
}

/// Drives whole paths, on random planes or, as in figure 25, through a wall of clutter. For each of three paths, returns its
/// length, the share of its landmarks with more than three candidates, and how often it arrives according to equations 1 and 2
/// and in the drives. The values are means over worlds; those of the drives have Student's confidence interval.
pub fn of_paths(sigmas: &[f64], is_walled: bool, worlds: Range<u64>) -> Result<Table, Error> {
    let title = if is_walled {
        "Figure 25: from one side of a cluttered wall to the other"
    } else {
        "Equations 1 and 2 against drives: paths"
    };
    let head = ["path", "D, mm", "cluttered, %", "equations, %", "driven, %", "low", "high", "worlds"];
    let mut table = Table::new(title, &head);
    for &sigma in sigmas {
        for (name, objective) in [
            ("shortest", Objective::SHORTEST),
            ("D/R", Objective::Ratio),
            ("most reliable", Objective::MOST_RELIABLE),
        ] {
            let of_worlds = driven(objective, &Setting::of_sigma(sigma)?, is_walled, worlds.clone())?;
            let [ways, cluttered, equations, driven] = of_worlds;
            let mut row = [ways, cluttered, equations].map(|numbers| mean(&numbers)).to_vec();
            row.extend(Table::mean_of(&driven));
            table.row(format!("{sigma} mm, {name}"), &row);
        }
    }
    Ok(table)
}

/// Returns, for each world, the length of the path, its share of cluttered landmarks, the probability of arrival by the
/// equations, and the share of drives that arrive. Shares are in percent.
fn driven(
    objective: Objective,
    setting: &Setting,
    is_walled: bool,
    worlds: Range<u64>,
) -> Result<[Vec<f64>; 4], Error> {
    let mut all: [Vec<f64>; 4] = Default::default();
    let pilot = setting.pilot();
    for seed in worlds {
        let world =
            if is_walled { World::walled(seed, setting)? } else { World::new(seed, setting, Kinds::PAPER)? };
        let Some(world) = world else { continue };
        let path = world.path(objective)?;
        let cluttered = path.legs.iter().filter(|leg| leg.transition.candidates > 3).count();
        let (legs, predicted) = (path.legs.len().max(1) as f64, path.reliability());
        let distance = path.distance;
        let plan = Plan::new(&world.atlas, path, Verify::Nothing)?;
        let tally = world.fly(&plan, &pilot, JOURNEYS, seed)?;
        let arrived = f64::from(tally.arrivals()) / f64::from(tally.journeys());
        let numbers = [distance, 100.0 * cluttered as f64 / legs, 100.0 * predicted, 100.0 * arrived];
        all.iter_mut().zip(numbers).for_each(|(all, number)| all.push(number));
    }
    Ok(all)
}
