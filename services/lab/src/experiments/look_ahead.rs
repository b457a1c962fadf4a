//! The `routes-look-ahead` suite repeats the drives of the `routes` suite with several values of r_H, the distance by which the
//! planner looks ahead on the drawn route.
//!
//! Boniardi et al. 2016, V-B, describe the trade-off without figures. With a large r_H, the robot follows
//! "the locally optimal trajectory", which "results in considerable displacement from the drawn path". If r_H
//! is too small, "the planner is not able to react quickly enough to unmapped obstacles and the safety of the
//! navigation is severely affected". The table therefore shows the displacement and the number of drives with
//! a contact. Each floor has four obstacles that no drawing shows.

use sketchnav_schemas::codes::Process;

use crate::error::EvalError;
use crate::experiments::routes;
use crate::experiments::sensitivity::variant;
use crate::experiments::suite::{Curve, Folders, Suite};
use crate::experiments::trial::Trial;

const TITLE: &str = "The drives of the suite `routes` by r_H, the planner's look-ahead on the drawn route (Boniardi et al. 2016, V-B), two for each drawing.";
/// Key of the planner's parameter r_H.
const KEY: &str = "route_look_ahead_m";
/// Values of r_H in metres, including the one in use.
const VALUES_M: [f64; 5] = [0.3, 0.6, 1.2, 2.4, 4.8];
/// Default number of repetitions for each drawing.
const REPETITIONS: u32 = 2;

/// Loads the suite.
///
/// # Errors
/// Any error of [`routes::suite`].
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let drives = routes::suite(folders)?.trials;
    let line = |value: f64| format!("{value} m");
    let of_value = |value: f64| drives.iter().map(move |trial| looking_ahead(trial, &line(value), value));
    let curve = Curve {
        title: "Look-ahead on the drawn route, r_H".into(),
        unit: "metres".into(),
        points: VALUES_M.map(|value| (value, line(value))).into(),
    };
    Ok(Suite {
        title: TITLE.into(),
        trials: VALUES_M.into_iter().flat_map(of_value).collect(),
        lines: Some("r_H"),
        curves: vec![curve],
        repetitions: REPETITIONS,
        ..Suite::default()
    })
}

fn looking_ahead(trial: &Trial, line: &str, value: f64) -> Trial {
    let mut changed = variant(trial, line);
    changed.mission.parameters.of_mut(Process::Planner).insert(KEY.to_owned(), value.into());
    changed
}

#[cfg(test)]
mod tests {
    use sketchnav_sketch::paths::parameters::Parameters;

    use super::*;

    #[test]
    fn every_line_has_its_own_look_ahead() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert!(VALUES_M.contains(&Parameters::default().route_look_ahead_m));
        assert_eq!((suite.trials.len(), suite.drawings().len()), (25 * VALUES_M.len(), VALUES_M.len()));
        for (value, line) in &suite.curves[0].points {
            let trials = suite.trials.iter().filter(|trial| trial.drawing == *line);
            let mut drawings: Vec<_> = trials.clone().filter_map(|trial| trial.cluster.clone()).collect();
            drawings.dedup();
            assert_eq!(drawings.len(), 25, "{line}");
            for trial in trials {
                let table = trial.mission.parameters.of(Process::Planner);
                assert_eq!((table.len(), table[KEY].as_float()), (1, Some(*value)), "{line}");
            }
        }
    }
}
