//! The `ablation` suite measures what each part of `beam` contributes. Each line of `PARTS` switches off one part by setting
//! mission parameters. All lines drive the same trials with the same seeds, so they differ only in that part.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_sketch::method::Method;

use crate::error::EvalError;
use crate::experiments::deformed::{self, DRAWINGS};
use crate::experiments::sensitivity::variant;
use crate::experiments::suite::{Folders, Suite};
use crate::experiments::{people, protocol};

const TITLE: &str = "What each part of our method adds: a line for each part that is switched off. Driven are pairs of the ten people's drawings, drawings deformed at degree 1, and the building's four drawings by the protocol of Table I.";
/// Number of pairs of start and goal for each drawing by people.
const PAIRS: usize = 6;
/// Number of drives for each deformed drawing of the shipped floors.
const DRIVES: usize = 2;
/// Degree of deformation of these drawings.
const DEGREE: f64 = 1.0;

/// A part of the method, with the parameters that switch it off.
struct Part {
    /// Name of the line in the table.
    name: &'static str,
    /// Content of the table `parameters.localizer`.
    localizer: &'static str,
    /// Content of the table `parameters.planner`.
    planner: &'static str,
}

/// All parts of the method. To add one, add a line here.
const PARTS: [Part; 19] = [
    Part { name: "whole", localizer: "", planner: "" },
    // Uses the likelihood field of Boniardi et al. 2015, equation 7, instead of our comparison of ranges.
    Part { name: "no-beam-model", localizer: "likelihood = 'field'", planner: "" },
    // Compares with the drawing at exactly the bearing of the beam, without tolerance for doors drawn next to their true position.
    Part { name: "no-bearing-error", localizer: "bearing_error_rad = 0.0", planner: "" },
    // Assumes the exactness of a hand drawing, regardless of the scans.
    Part { name: "learns-no-exactness", localizer: "least_hit_width = 0.25", planner: "" },
    Part { name: "one-scale", localizer: "scales = 'one'", planner: "" },
    Part { name: "free-scales", localizer: "scale_reversion_per_m = 0.0", planner: "" },
    Part { name: "stiff-scales", localizer: "scale_noise = 0.0", planner: "" },
    Part { name: "first-scan-unfiltered", localizer: "start_scales = 'least-squares'", planner: "" },
    // Assumes that the drawing as a whole is in proportion, however much the surroundings of the first scan are stretched.
    Part { name: "no-anisotropy", localizer: "anisotropic_share = 0.0", planner: "" },
    Part { name: "no-usual-size", localizer: "start_size_share = 0.0", planner: "" },
    Part { name: "500-particles", localizer: "particles = 500", planner: "" },
    Part { name: "no-outline", localizer: "outline_gap_m = 0.0", planner: "" },
    // Assumes that doors are as narrow as they are drawn.
    Part { name: "doors-as-drawn", localizer: "door_width_m = 0.0", planner: "" },
    Part { name: "walls-do-not-count", localizer: "wall_crossing_factor = 1.0", planner: "" },
    Part {
        name: "no-perturbation",
        localizer: "perturbed_share = 0.0\nperturbed_share_lost = 0.0",
        planner: "",
    },
    Part { name: "no-hysteresis", localizer: "mode_hysteresis = 1.0", planner: "" },
    Part { name: "no-memory", localizer: "", planner: "obstacle_memory_s = 0.1" },
    // Sets a doubt that is never reached.
    Part { name: "believes-arrivals", localizer: "", planner: "look_above = 100.0\ndoubt_above = 100.0" },
    // Sets a path longer than any task may need.
    Part { name: "may-circle", localizer: "", planner: "circling_path_m = 100000.0" },
];

impl Part {
    /// Returns the parameters in the form that missions use.
    fn parameters(&self) -> Result<Parameters, EvalError> {
        let mut parameters = Parameters::default();
        for (process, text) in [(Process::Localizer, self.localizer), (Process::Planner, self.planner)] {
            let wrong = |cause| EvalError::Data { what: "parts of the suite ablation", cause };
            *parameters.of_mut(process) = text.parse().map_err(wrong)?;
        }
        Ok(parameters)
    }
}

/// Loads the `ablation` suite.
///
/// # Errors
/// Any error of the suites that the trials are taken from. If people's drawings are missing, they are left out with a notice.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut people = match people::suite(folders) {
        Err(missing @ EvalError::NoData { .. }) => {
            Suite { notices: vec![format!("skipped: {missing}")], ..Suite::default() }
        }
        people => Suite { notices: Vec::new(), ..people? },
    };
    people.sample(PAIRS);
    let building = protocol::building(folders)?;
    let mut suite = Suite {
        title: TITLE.into(),
        notices: people.notices,
        repetitions: 1,
        lines: Some("without"),
        ..Suite::default()
    };
    let mut trials: Vec<_> = people.trials.into_iter().chain(building.trials).collect();
    for site in deformed::shipped(folders)? {
        for number in 1..=DRAWINGS {
            trials.extend(site.trials(DEGREE, number)?.into_iter().take(DRIVES));
        }
    }
    for part in &PARTS {
        let parameters = part.parameters()?;
        suite.trials.extend(trials.iter().map(|trial| {
            let mut changed = variant(trial, part.name);
            changed.method.get_or_insert_with(|| Method::Beam.word().to_owned());
            changed.mission.parameters.extend(&parameters);
            changed
        }));
    }
    Ok(suite)
}

#[cfg(test)]
mod tests {
    use sketchnav_sketch::localizer::Localizer;
    use sketchnav_sketch::planner::Planner;

    use super::*;

    /// If a parameter were renamed, its line would not switch anything off.
    #[test]
    fn the_services_know_every_ablated_part() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert_eq!(suite.drawings().len(), PARTS.len());
        for name in suite.drawings() {
            let trial = suite.trials.iter().find(|trial| trial.drawing == name).unwrap();
            let run = trial.run("beam", 1, 0).unwrap();
            Localizer::new(&run).unwrap_or_else(|error| panic!("{name}: {error}"));
            Planner::new(&run).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
}
