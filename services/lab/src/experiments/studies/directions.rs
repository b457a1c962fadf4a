//! The experiments of Park and Kender 1995, including those that the authors leave out: directions from landmark to
//! landmark over random planes of dots.

use sketchnav_directions::arrival::Effort;
use sketchnav_directions::experiments::{self, Goal, PUBLISHED_WAY, Setting, Table};
use sketchnav_directions::fit;

use super::{Drawn, Figure, Run, Size, Study};
use crate::error::EvalError;

/// Standard deviations of position errors, in millimetres: those of figure 26, and one in between.
const SIGMAS: [f64; 3] = [1.0, 3.0, 5.0];
/// Number of journeys over each world.
const JOURNEYS: u64 = 5;
/// Seeds for fitting equations 1 and 2. The coefficients in use are those of the first one.
const FITS: [u64; 3] = [1995, 1, 2];
/// Columns of the success rate and its interval in a table of kinds.
const SUCCESS: [usize; 3] = [1, 2, 3];
/// Offset of the calibration's seeds, which keeps its worlds apart from those used for fitting.
const UNSEEN: u64 = 1000;

/// All studies of this module.
pub static STUDIES: [Study; 8] = [
    Study {
        name: "directions-parkways",
        title: "Number of parkways on a random plane as a function of its population: five windows and three kinds of parkways (figure 7).",
        worlds: 20,
        run: Run::BySize(parkways),
    },
    Study {
        name: "directions-components",
        title: "Number of strongly connected components, with parkways alone and with trajectories (figure 11).",
        worlds: 20,
        run: Run::BySize(components),
    },
    Study {
        name: "directions-paths",
        title: "Costs of paths (figures 14, 15, 26 and 27, section 5.3), to goals as far away as the paper's, and as far as any path leads.",
        worlds: 30,
        run: Run::BySize(paths),
    },
    Study {
        name: "directions-reliability",
        title: "Equations 1 and 2 against simulation (figure 21) and drives, and how often recovery is possible (figures 28 and 29).",
        worlds: 30,
        run: Run::BySize(reliability),
    },
    Study {
        name: "directions-clutter",
        title: "From one side of a cluttered wall to the other, by the shortest path and by more reliable ones (figure 25).",
        worlds: 200,
        run: Run::BySize(clutter),
    },
    Study {
        name: "directions-views",
        title: "Success by the map-maker's vocabulary and by the size of the window.",
        worlds: 200,
        run: Run::BySize(views),
    },
    Study {
        name: "directions-success",
        title: "Success by cost, verification and error of position, with counts of the six outcomes (figures 26 and 28, and 7.2.6).",
        worlds: 200,
        run: Run::BySize(success),
    },
    Study {
        name: "directions-calibration",
        title: "The stated probability of arrival against the share of journeys that arrive, on worlds that were not used for any fit.",
        worlds: 400,
        run: Run::BySize(calibration),
    },
];

fn curves(table: Table, x_unit: &'static str, unit: &'static str, columns: std::ops::Range<usize>) -> Figure {
    Figure { table, drawn: Drawn::Curves { x_unit, unit, columns: columns.collect() } }
}

fn shares(table: Table) -> Figure {
    Figure { table, drawn: Drawn::Shares(SUCCESS) }
}

fn parkways(Size { worlds, seed }: Size) -> Result<Vec<Figure>, EvalError> {
    let by_window = experiments::windows(&[25, 50, 100, 200, 300, 400, 600, 800, 1200], worlds, seed)?;
    let by_kind = experiments::parkways(&[10, 25, 50, 75, 100, 150, 200, 300, 450], worlds, seed)?;
    Ok(vec![curves(by_window, "dots", "parkways", 0..5), curves(by_kind, "dots", "parkways", 0..3)])
}

fn components(Size { worlds, seed }: Size) -> Result<Vec<Figure>, EvalError> {
    let table = experiments::components(&[25, 50, 100, 150, 200, 300, 450], worlds, seed)?;
    Ok(vec![curves(table, "dots", "components", 0..2)])
}

fn plain(table: Table) -> Figure {
    Figure { table, drawn: Drawn::Nothing }
}

fn paths(size: Size) -> Result<Vec<Figure>, EvalError> {
    let of = |goal| experiments::paths(goal, size.seeds(0));
    Ok(vec![plain(of(Goal::At(PUBLISHED_WAY))?), plain(of(Goal::Furthest)?)])
}

fn reliability(size: Size) -> Result<Vec<Figure>, EvalError> {
    let recoverable = experiments::recoverable(&[50, 100, 150, 200, 300], size.worlds, size.seed)?;
    Ok(vec![
        plain(experiments::fits(fit::Effort::FULL, &FITS)?),
        plain(experiments::reliability(fit::Effort::FULL, size.seed)?),
        plain(experiments::of_transitions(&SIGMAS, size.seeds(0))?),
        plain(experiments::of_paths(&SIGMAS, false, size.seeds(0))?),
        curves(recoverable, "dots", "share of the transitions", 0..4),
    ])
}

fn clutter(size: Size) -> Result<Vec<Figure>, EvalError> {
    Ok(vec![plain(experiments::of_paths(&SIGMAS, true, size.seeds(0))?)])
}

fn views(size: Size) -> Result<Vec<Figure>, EvalError> {
    Ok(vec![shares(experiments::words_and_windows(1.0, size.seeds(0), JOURNEYS)?)])
}

fn success(size: Size) -> Result<Vec<Figure>, EvalError> {
    let [one_look, stated] = experiments::costs(&SIGMAS, 1, size.seeds(0), JOURNEYS)?;
    let [nine_looks, _] = experiments::costs(&[5.0], 9, size.seeds(0), JOURNEYS)?;
    Ok(vec![shares(one_look), shares(nine_looks), shares(stated)])
}

fn calibration(size: Size) -> Result<Vec<Figure>, EvalError> {
    let settings = [1.0, 2.0, 3.0, 5.0, 8.0].map(Setting::of_sigma);
    let settings = settings.into_iter().collect::<Result<Vec<_>, _>>()?;
    // Use one journey over each world, since several would not be independent.
    let calibrated = |settings: &[Setting]| {
        Ok::<_, EvalError>(experiments::calibration(settings, Effort::USUAL, size.seeds(UNSEEN), 1)?.table())
    };
    let (by_sigma, mut all_errors) = (calibrated(&settings)?, calibrated(&[Setting::of_all_errors()?])?);
    all_errors.title.push_str(", all errors at once");
    Ok(vec![shares(by_sigma), shares(all_errors)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::studies::find;
    use crate::experiments::suite::Folders;

    #[test]
    fn a_study_gives_the_same_tables_for_the_same_seed() {
        let study = find("directions-components").unwrap();
        let run = |seed| study.run(&Folders::of_checkout(), Size { worlds: 2, seed }).unwrap();
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }

    /// In figure 7, few dots have few parkways, while with many dots most parkways are joined into one.
    #[test]
    fn general_parkways_have_their_peak_between() {
        let figures = parkways(Size { worlds: 2, seed: 1 }).unwrap();
        let general = figures[1].table.column(0);
        let peak = general.iter().copied().fold(0.0, f64::max);
        assert!(peak > general[0] && peak > general[general.len() - 1], "{general:?}");
    }
}
