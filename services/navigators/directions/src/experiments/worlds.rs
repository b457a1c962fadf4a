//! Experiments without a journey: figures 7, 11, 14, 15, 21, 26, 27, 28 and 29.

use super::{DOTS, SIDE, Table, window};
use crate::error::Error;
use crate::fit::{Effort, identified};
use crate::generate::uniform;
use crate::geometry::Window;
use crate::parkway::{count, general};
use crate::path::{Atlas, Measure, Objective, Path, Start, best};
use crate::plane::DotId;
use crate::recovery::Check;
use crate::reliability::{LandmarkModel, Reliability};
use crate::transitions::{Kinds, Transitions};
use crate::traversal::Noise;

/// Figure 7, above: general parkways by the number of dots, for five windows on a world of side 100.
pub fn windows(populations: &[usize], worlds: u64, seed: u64) -> Result<Table, Error> {
    let title = "Figure 7, above: general parkways by population and window (side 100)";
    let mut table = Table::new(title, &["dots", "2 x 2", "3 x 3", "4 x 4", "5 x 5", "10 x 10"]);
    for &dots in populations {
        let mut sums = [0.0; 5];
        for world in 0..worlds {
            let plane = uniform(dots, 100.0, seed.wrapping_add(world))?;
            for (sum, side) in sums.iter_mut().zip([2.0, 3.0, 4.0, 5.0, 10.0]) {
                *sum += general(&plane, Window::new(side, 0.0)?).count() as f64;
            }
        }
        table.row(dots, &sums.map(|sum| sum / worlds as f64));
    }
    Ok(table)
}

/// Figure 7, below: general, isolated and obvious parkways by the number of dots, for a window of 10 on a side of 100.
pub fn parkways(populations: &[usize], worlds: u64, seed: u64) -> Result<Table, Error> {
    let title = "Figure 7, below: parkways of three kinds by population (window 10, side 100)";
    let mut table = Table::new(title, &["dots", "general", "isolated", "obvious"]);
    for &dots in populations {
        let mut sums = [0.0; 3];
        for world in 0..worlds {
            let counts = count(&uniform(dots, 100.0, seed.wrapping_add(world))?, Window::new(10.0, 0.0)?);
            let counts = [counts.general, counts.isolated, counts.obvious];
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count as f64);
        }
        table.row(dots, &sums.map(|sum| sum / worlds as f64));
    }
    Ok(table)
}

/// Figure 11: strongly connected components without and with trajectories.
pub fn components(populations: &[usize], worlds: u64, seed: u64) -> Result<Table, Error> {
    let title = "Figure 11: strongly connected components (window 10, side 100)";
    let mut table = Table::new(title, &["dots", "parkways", "trajectories", "ratio"]);
    for &dots in populations {
        let mut sums = [0.0; 2];
        for world in 0..worlds {
            let plane = uniform(dots, 100.0, seed.wrapping_add(world))?;
            for (sum, kinds) in sums.iter_mut().zip([Kinds::ISOLATED, Kinds::PAPER]) {
                *sum += Transitions::new(&plane, Window::new(10.0, 0.0)?, kinds).components().count() as f64;
            }
        }
        let [parkways, trajectories] = sums.map(|sum| sum / worlds as f64);
        table.row(dots, &[parkways, trajectories, trajectories / parkways]);
    }
    Ok(table)
}

/// Figure 21: how often the isolated landmark is identified right, measured and by equation 1.
pub fn reliability(effort: Effort, seed: u64) -> Table {
    let title = "Figure 21: reliability of isolated landmarks (sigma in windows)";
    let mut table = Table::new(title, &["candidates, sigma", "measured", "equation 1"]);
    for point in identified(effort, seed) {
        let model = LandmarkModel::FITTED.reliability(point.candidates, point.sigma);
        table.row(format!("{}, {:.2}", point.candidates, point.sigma), &[point.fraction, model]);
    }
    table
}

/// The goal with the longest shortest path from a start: a journey worth looking at.
pub fn far_goal(atlas: &Atlas, start: Start) -> Option<DotId> {
    let path = |goal| best(atlas, start, goal, Measure::Windows, Objective::SHORTEST).ok();
    let paths = (0..atlas.plane.len() as DotId).filter_map(|goal| Some((goal, path(goal)?.distance)));
    paths.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, distance)| *distance > 0.0).map(|(goal, _)| goal)
}

fn costs_row(table: &mut Table, name: &str, atlas: &Atlas, path: &Path) {
    let (landmarks, windows) =
        (path.distance_by(atlas, Measure::Landmarks), path.distance_by(atlas, Measure::Windows));
    table.row(name, &[landmarks, windows, path.unreliability, path.ratio(), path.legs.len() as f64]);
}

/// Figures 14, 15, 26 and 27: the costs of several paths on one world, at errors of 1, 3 and 5 mm.
pub fn costs_of_one_world(seed: u64) -> Result<Table, Error> {
    let title = format!("Figures 14, 15, 26, 27: costs on world {seed}");
    let mut table = Table::new(&title, &["path", "D, landmarks", "D, windows", "-log R", "D/R", "entries"]);
    for sigma in [1.0, 3.0, 5.0] {
        let reliability = Reliability::fitted(Noise::of_sigma(sigma));
        let atlas = Atlas::new(uniform(DOTS, SIDE, seed)?, window()?, Kinds::PAPER, reliability);
        let start = Start::over(&atlas.plane, 0)?;
        let Some(goal) = far_goal(&atlas, start) else { continue };
        for (name, measure, objective) in [
            ("shortest, landmarks", Measure::Landmarks, Objective::SHORTEST),
            ("shortest, windows", Measure::Windows, Objective::SHORTEST),
            ("most reliable", Measure::Windows, Objective::MOST_RELIABLE),
            ("D/R", Measure::Windows, Objective::Ratio),
            ("fewest entries", Measure::Windows, Objective::FEWEST_ENTRIES),
        ] {
            let path = best(&atlas, start, goal, measure, objective)?;
            costs_row(&mut table, &format!("{sigma} mm, {name}"), &atlas, &path);
        }
    }
    Ok(table)
}

/// Figures 28 and 29: which share of transitions is trivial, recoverable, detectable or neither, by population.
pub fn recoverable(populations: &[usize], worlds: u64, seed: u64) -> Result<Table, Error> {
    let title = "Figures 28, 29: what can be done about errors (share of isolated parkways and trajectories)";
    let mut table = Table::new(title, &["dots", "trivial", "recoverable", "detectable", "unverifiable"]);
    let model = Reliability::fitted(Noise::of_sigma(1.5));
    for &dots in populations {
        let mut counts = [0.0; 4];
        for world in 0..worlds {
            let plane = uniform(dots, SIDE, seed.wrapping_add(world))?;
            let atlas = Atlas::new(plane, window()?, Kinds::PAPER, model);
            let recoveries = atlas.recoveries()?;
            for (from, transition) in atlas.transitions.all() {
                let aside = model.aside(&atlas.plane, from, transition);
                let column = match recoveries.check(from, transition, aside) {
                    Check::Trivial => 0,
                    Check::Recoverable(_) => 1,
                    Check::Detectable(_) => 2,
                    Check::Unverifiable => 3,
                };
                counts[column] += 1.0;
            }
        }
        let sum: f64 = counts.iter().sum();
        table.row(dots, &counts.map(|count| count / sum.max(1.0)));
    }
    Ok(table)
}
