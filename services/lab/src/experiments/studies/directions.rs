//! The experiments of Park and Kender 1995, including some that the authors left out: directions from landmark to landmark over
//! random planes of dots.

use sketchnav_directions::arrival::Effort;
use sketchnav_directions::experiments::{self, Goal, PUBLISHED_WAY, Table};
use sketchnav_directions::fit;

use super::{Attempt, ByWorld, Case, Drawn, Figure, Run, Size, Study};
use crate::error::EvalError;

/// Standard deviations of position errors, in millimetres: those of figure 26, and one in between.
const SIGMAS: [f64; 3] = [1.0, 3.0, 5.0];
/// Seeds for fitting equations 1 and 2. The coefficients in use were fitted with the first one.
const FITS: [u64; 3] = [1995, 1, 2];
/// Columns of the success rate and its interval in a table of kinds.
const SUCCESS: [usize; 3] = [1, 2, 3];
/// Offset of the calibration's seeds, which separates its worlds from those used for fitting.
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
        run: Run::ByWorld(ByWorld { offset: 0, cases: views, figures: views_figures }),
    },
    Study {
        name: "directions-success",
        title: "Success by cost, verification and error of position, with counts of the six outcomes (figures 26 and 28, and 7.2.6).",
        worlds: 200,
        run: Run::ByWorld(ByWorld { offset: 0, cases: success, figures: success_figures }),
    },
    Study {
        name: "directions-calibration",
        title: "The stated probability of arrival against the share of journeys that arrive, on worlds that were not used for any fit.",
        // This yields about 20,000 journeys for each method.
        worlds: 106,
        run: Run::ByWorld(ByWorld { offset: UNSEEN, cases: calibration, figures: calibration_figures }),
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

fn views() -> Result<Vec<Case>, EvalError> {
    Ok(experiments::words_and_windows(SIGMAS[0])?)
}

fn views_figures(cases: &[Case], worlds: &[Vec<Attempt>]) -> Vec<Figure> {
    let title = format!("Success in percent by words and by window, D/R path, {} mm", SIGMAS[0]);
    vec![shares(experiments::success(&title, &experiments::by_case(cases, worlds)))]
}

/// Returns the cases with one look for each error, followed by those with nine looks.
fn success() -> Result<Vec<Case>, EvalError> {
    let mut cases = experiments::costs(&SIGMAS, 1)?;
    cases.extend(experiments::costs(&[5.0], 9)?);
    Ok(cases)
}

fn success_figures(cases: &[Case], worlds: &[Vec<Attempt>]) -> Vec<Figure> {
    let by_case = experiments::by_case(cases, worlds);
    let (one_look, nine_looks): (Vec<_>, Vec<_>) =
        by_case.into_iter().partition(|(case, _)| case.setting.looks == 1);
    let title = |looks| format!("Success in percent over {} worlds, {looks} looks", worlds.len());
    vec![
        shares(experiments::success(&title(1), &one_look)),
        shares(experiments::success(&title(9), &nine_looks)),
        shares(experiments::stated_and_reached("Stated and reached, 1 looks", &one_look)),
    ]
}

fn calibration() -> Result<Vec<Case>, EvalError> {
    Ok(experiments::calibration(Effort::USUAL)?)
}

fn calibration_figures(cases: &[Case], worlds: &[Vec<Attempt>]) -> Vec<Figure> {
    let by_case = experiments::by_case(cases, worlds);
    vec![shares(experiments::stated_and_reached("Calibration of the probability of arrival", &by_case))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::studies::find;
    use crate::experiments::suite::Folders;

    #[test]
    fn a_study_gives_the_same_tables_for_the_same_seed() {
        let study = find("directions-components").unwrap();
        let run = |seed| study.run(&Folders::of_checkout(), Size { worlds: 2, seed }, 1).unwrap();
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
