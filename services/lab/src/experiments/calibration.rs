//! The `calibrate-METHOD` suites search for the values that a paper leaves open. Each value is varied separately around the one in
//! use, on drawings that no other suite uses.
//!
//! We tune published methods with the same effort as our own, and never by the figures that we want to reproduce. The authors
//! calibrated on metrically consistent maps (Boniardi et al. 2016, V-B). On such drawings alone, every value listed here reaches
//! every goal, so deformed drawings are driven as well. All drawings show floors in the repository, and their numbers are beyond
//! those of the `deformed` suite. To choose a value, take the middle of those that lie within the interval of the best one.

use sketchnav_schemas::codes::Process;
use sketchnav_sketch::filter::parameters::Parameters;
use sketchnav_sketch::method::Method;

use crate::error::EvalError;
use crate::experiments::deformed::{self, DRAWINGS};
use crate::experiments::sensitivity::variant;
use crate::experiments::suite::{Curve, Folders, Suite};
use crate::experiments::trial::Trial;

const TITLE: &str = "Parameters that the paper does not state, one at a time: drives on two floors, by drawings to scale and deformed ones that no other suite uses.";
/// Degrees of deformation, from walls traced by a person to what people draw.
const DEGREES: [f64; 3] = [0.0, 0.5, 1.0];
/// Number of drawings of each floor at each degree.
const DRAWN: u64 = 4;
/// Name of the line that all curves share.
const IN_USE: &str = "in-use";

/// A parameter of the localizer whose value the paper does not give.
struct Search {
    key: &'static str,
    title: &'static str,
    unit: &'static str,
    /// The value in use.
    used: fn(&Parameters) -> f32,
    /// The values to try, in order. The value in use has its own line.
    values: &'static [f64],
}

/// The parameters of Boniardi et al. 2015: N, σ, λ and ν of equation 7, and the noises of equation 6.
const BONIARDI_2015: [Search; 5] = [
    Search {
        key: "field_scale_width",
        title: "Width of the Laplace terms, λ = ν (equation 7)",
        unit: "of the mean scale",
        used: |parameters| parameters.field_scale_width,
        values: &[0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5],
    },
    Search {
        key: "field_sigma_m",
        title: "Width of the likelihood field, σ (equation 7)",
        unit: "metres",
        used: |parameters| parameters.field_sigma_m,
        values: &[0.1, 0.15, 0.25, 0.4, 0.6],
    },
    Search {
        key: "step_scale_noise",
        title: "Noise of the scales, σ of Γ (equation 6)",
        unit: "of the scale, an update",
        used: |parameters| parameters.step_scale_noise,
        values: &[0.01, 0.02, 0.035, 0.07, 0.14],
    },
    Search {
        key: "step_noise_m",
        title: "Noise of the position, σ₁ = σ₂ (equation 6)",
        unit: "metres, an update",
        used: |parameters| parameters.step_noise_m,
        values: &[0.01, 0.03, 0.06, 0.1],
    },
    Search {
        key: "step_noise_rad",
        title: "Noise of the heading, σ₃ (equation 6)",
        unit: "radians, an update",
        used: |parameters| parameters.step_noise_rad,
        values: &[0.02, 0.05, 0.1],
    },
];

/// Loads the `calibrate-boniardi-2015` suite.
///
/// # Errors
/// [`EvalError`] if a file is missing or malformed.
pub fn boniardi_2015(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    for site in deformed::shipped(folders)? {
        for (degree, number) in DEGREES.into_iter().flat_map(|degree| (1..=DRAWN).map(move |n| (degree, n))) {
            trials.extend(site.trials(degree, DRAWINGS + number)?);
        }
    }
    Ok(suite(Method::Boniardi2015, &BONIARDI_2015, &trials))
}

impl Search {
    fn line(&self, value: f64, in_use: &Parameters) -> String {
        // Compare in single precision, since parameters have single precision.
        if value as f32 == (self.used)(in_use) { IN_USE.to_owned() } else { format!("{}={value}", self.key) }
    }
}

fn suite(method: Method, searches: &[Search], trials: &[Trial]) -> Suite {
    let in_use = Parameters::of(method);
    let curve = |search: &Search| {
        let points = search.values.iter().map(|&value| (value, search.line(value, &in_use)));
        Curve { title: search.title.into(), unit: search.unit.into(), points: points.collect() }
    };
    let mut driven: Vec<_> = trials.iter().map(|trial| variant(trial, IN_USE)).collect();
    let lines = searches.iter().flat_map(|search| search.values.iter().map(move |&value| (search, value)));
    for (search, value) in lines {
        let line = search.line(value, &in_use);
        if line != IN_USE {
            driven.extend(trials.iter().map(|trial| {
                let mut changed = variant(trial, &line);
                let table = changed.mission.parameters.of_mut(Process::Localizer);
                table.insert(search.key.to_owned(), value.into());
                changed
            }));
        }
    }
    Suite {
        title: TITLE.into(),
        trials: driven,
        lines: Some("parameter"),
        methods: vec![method.word().to_owned()],
        repetitions: 1,
        curves: searches.iter().map(curve).collect(),
        ..Suite::default()
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_sketch::localizer::Localizer;

    use super::*;

    #[test]
    fn every_line_changes_one_parameter_that_the_localizer_knows() {
        let suite = boniardi_2015(&Folders::of_checkout()).unwrap();
        let lines = suite.drawings();
        let values: usize = BONIARDI_2015.iter().map(|search| search.values.len()).sum();
        assert_eq!(lines.len(), 1 + values - BONIARDI_2015.len(), "each parameter includes the value in use");
        for line in &lines {
            let trial = suite.trials.iter().find(|trial| trial.drawing == *line).unwrap();
            let run = trial.run(Method::Boniardi2015.word(), 1, 0).unwrap();
            Localizer::new(&run).unwrap_or_else(|error| panic!("{line}: {error}"));
            let table = trial.mission.parameters.of(Process::Localizer);
            assert_eq!(table.len(), usize::from(line != IN_USE), "{line}");
        }
        for (_, line) in suite.curves.iter().flat_map(|curve| &curve.points) {
            assert!(lines.contains(line), "{line}");
        }
    }

    /// A drawing that is used to choose values must not be used for a table.
    #[test]
    fn no_drawing_belongs_to_another_suite() {
        let calibration = boniardi_2015(&Folders::of_checkout()).unwrap();
        let deformed = deformed::suite(&Folders::of_checkout()).unwrap();
        let names = |suite: &Suite| -> std::collections::BTreeSet<_> {
            suite.trials.iter().map(|trial| trial.mission.name.clone()).collect()
        };
        assert!(names(&calibration).is_disjoint(&names(&deformed)));
    }
}
