//! Experiments without journeys: figures 7, 11, 21, 28 and 29.

use super::{SIDE, Table, window};
use crate::error::Error;
use crate::fit::{Effort, identified, landmarks, trajectories};
use crate::generate::uniform;
use crate::geometry::Window;
use crate::parkway::{count, general};
use crate::path::Atlas;
use crate::recovery::Check;
use crate::reliability::{LandmarkModel, Reliability, TrajectoryModel};
use crate::transitions::{Kinds, Transitions};
use crate::traversal::Noise;

/// Figure 7, upper part: the number of general parkways by the number of dots, for five windows on a square with a side of 100.
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

/// Figure 7, lower part: the number of general, isolated and obvious parkways by the number of dots, for a window of 10 on a
/// square with a side of 100.
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

/// Figure 11: the number of strongly connected components without and with trajectories.
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

/// Figure 21: how often the isolated landmark is identified correctly, in simulated views in which no dot crosses an edge of
/// the window, in views in which dots do, and according to equation 1.
pub fn reliability(effort: Effort, seed: u64) -> Result<Table, Error> {
    let title = "Figure 21: reliability of isolated landmarks (sigma in windows)";
    let mut table =
        Table::new(title, &["candidates, sigma", "no dot crosses an edge", "measured", "equation 1"]);
    for point in identified(effort, seed)? {
        let model = LandmarkModel::FITTED.reliability(point.candidates, point.sigma);
        table.row(
            format!("{}, {:.2}", point.candidates, point.sigma),
            &[point.enclosed, point.fraction, model],
        );
    }
    Ok(table)
}

/// The coefficients of a fit, and the root mean square and the maximum of its residuals.
type Fit = ([f64; 4], [f64; 2]);

/// Fits equations 1 and 2 with several seeds. Returns the coefficients in use next to the least and the greatest of all fits,
/// and the residuals of the first fit, which are probabilities for equation 1 and fractions of a variance for equation 2.
pub fn fits(effort: Effort, seeds: &[u64]) -> Result<Table, Error> {
    let head = ["coefficient", "in use", "least", "greatest", "fits"];
    let mut table = Table::new("Equations 1 and 2, fitted", &head);
    let mut all: [Vec<Fit>; 2] = Default::default();
    for &seed in seeds {
        let (one, two) = (landmarks(effort, seed)?, trajectories(effort, seed)?);
        all[0].push((one.model.coefficients, [one.rms_residual, one.max_residual]));
        all[1].push((two.model.coefficients, [two.rms_residual, two.max_residual]));
    }
    let in_use = [LandmarkModel::FITTED.coefficients, TrajectoryModel::FITTED.coefficients];
    for ((number, fits), in_use) in (1..).zip(&all).zip(in_use) {
        let mut row = |name: String, used: f64, of: &dyn Fn(&Fit) -> f64| {
            let (least, most) =
                (fits.iter().map(of).fold(f64::MAX, f64::min), fits.iter().map(of).fold(f64::MIN, f64::max));
            table.row(name, &[used, least, most, fits.len() as f64]);
        };
        for (index, letter) in (0..).zip(["A", "B", "C", "D"]) {
            row(format!("{number}: {letter}"), in_use[index], &move |fit| fit.0[index]);
        }
        for (index, what) in (0..).zip(["root mean square", "largest"]) {
            let used = fits.first().map_or(0.0, |fit| fit.1[index]);
            row(format!("{number}: residual, {what}"), used, &move |fit| fit.1[index]);
        }
    }
    Ok(table)
}

/// Figures 28 and 29: the fractions of transitions that are trivial, recoverable, detectable or none of these, by the number of
/// dots.
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
