//! The `sensitivity` suite varies one condition at a time, leaving all others unchanged, and measures how this affects success.
//!
//! The trials are those of the `deformed` suite at degree 0.5 on the shipped floors, two for each drawing. A condition changes the
//! trial rather than parameters of the methods, except for the parameter that gives the expected size of a building. All lines of a
//! trial have the same seeds, so that they differ only in the condition.

use sketchnav_schemas::codes::Process;

use crate::error::EvalError;
use crate::experiments::deformed::{self, DRAWINGS, Site};
use crate::experiments::suite::{Curve, Folders, Suite};
use crate::experiments::trial::Trial;
use crate::experiments::unmapped::{clutter, walkers};

const TITLE: &str = "Success as a function of one condition at a time: drawings of the two shipped floors, deformed at degree 0.5, two trials with each drawing.";
const DEGREE: f64 = 0.5;
/// Number of trials per drawing.
const TRIALS: usize = 2;
/// Name of the line that all curves share.
const AS_IT_IS: &str = "as-it-is";

/// A condition that is varied.
struct Condition {
    /// The word for the condition in the names of its lines.
    word: &'static str,
    title: &'static str,
    unit: &'static str,
    /// The values in order, one of which is `usual`.
    values: &'static [f64],
    /// The value used in the unchanged trials.
    usual: f64,
    change: fn(&mut Trial, &Site, f64),
}

const CONDITIONS: [Condition; 8] = [
    Condition {
        word: "start-error",
        title: "Error of the start mark",
        unit: "multiples of a person's (1 % of the diagonal, 5°)",
        values: &[0.0, 1.0, 2.0, 4.0, 6.0],
        usual: 1.0,
        change: start_error,
    },
    Condition {
        word: "odometry",
        title: "Noise of the odometry",
        unit: "multiples of the robot's (standard deviations)",
        values: &[0.0, 1.0, 2.0, 4.0, 8.0],
        usual: 1.0,
        change: odometry,
    },
    Condition {
        word: "range",
        title: "Range of the laser",
        unit: "metres",
        values: &[2.0, 4.0, 5.6, 10.0, 20.0],
        usual: 5.6,
        change: |trial, _, range_m| {
            trial.robot.laser.iter_mut().for_each(|laser| laser.range_max_m = range_m);
        },
    },
    Condition {
        word: "view",
        title: "Field of view",
        unit: "degrees",
        values: &[60.0, 120.0, 180.0, 240.0, 360.0],
        usual: 240.0,
        change: view,
    },
    Condition {
        word: "clutter",
        title: "Clutter that is not drawn",
        unit: "pieces in addition to the floor's furniture",
        values: &[0.0, 10.0, 20.0, 40.0],
        usual: 0.0,
        change: |trial, site, count| {
            trial.mission.world.furniture = clutter(&site.ground, trial, count as usize);
        },
    },
    Condition {
        word: "walkers",
        title: "People who walk",
        unit: "more than the floor's own",
        values: &[0.0, 2.0, 4.0, 8.0],
        usual: 0.0,
        change: |trial, site, count| {
            trial.mission.world.person = walkers(&site.ground, trial, count as usize)
        },
    },
    Condition {
        word: "slow",
        title: "Slow cores",
        unit: "seconds per step (scans come every 0.1 s)",
        values: &[0.0, 0.1, 0.2, 0.3, 0.4],
        usual: 0.0,
        change: |trial, _, step_s| {
            trial.thinking_scans = (step_s * trial.robot.tick_hz()).round() as u32;
        },
    },
    Condition {
        word: "size",
        title: "Size of a building that the localizer expects",
        unit: "metres (these are 20 and 9 m long)",
        values: &[6.0, 12.5, 25.0, 50.0, 100.0],
        usual: 25.0,
        change: |trial, _, size_m| {
            let table = trial.mission.parameters.of_mut(Process::Localizer);
            table.insert("building_size_m".into(), size_m.into());
        },
    },
];

/// Loads the suite.
///
/// # Errors
/// [`EvalError`] if a file is missing or malformed.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite {
        title: TITLE.into(),
        repetitions: 1,
        lines: Some("condition"),
        curves: CONDITIONS.iter().map(Condition::curve).collect(),
        ..Suite::default()
    };
    let sites = deformed::shipped(folders)?;
    let mut usual: Vec<(&Site, Trial)> = Vec::new();
    for site in &sites {
        for number in 1..=DRAWINGS {
            let trials = site.trials(DEGREE, number)?.into_iter().take(TRIALS);
            usual.extend(trials.map(|trial| (site, trial)));
        }
    }
    suite.trials.extend(usual.iter().map(|(_, trial)| variant(trial, AS_IT_IS)));
    for condition in &CONDITIONS {
        suite.trials.extend(condition.trials(&usual));
    }
    Ok(suite)
}

impl Condition {
    fn line(&self, value: f64) -> String {
        if value == self.usual { AS_IT_IS.into() } else { format!("{}-{value}", self.word) }
    }

    fn curve(&self) -> Curve {
        let points = self.values.iter().map(|&value| (value, self.line(value)));
        Curve { title: self.title.into(), unit: self.unit.into(), points: points.collect() }
    }

    fn trials<'a>(&'a self, usual: &'a [(&Site, Trial)]) -> impl Iterator<Item = Trial> + 'a {
        let others = self.values.iter().filter(|&&value| value != self.usual);
        others.flat_map(move |&value| {
            usual.iter().map(move |(site, trial)| {
                let mut changed = trial.clone();
                (self.change)(&mut changed, site, value);
                variant(&changed, &self.line(value))
            })
        })
    }
}

/// Returns a copy of the trial as part of a line.
pub(crate) fn variant(trial: &Trial, line: &str) -> Trial {
    Trial {
        name: format!("{line}/{}", trial.name),
        drawing: line.to_owned(),
        variant_of: Some(trial.name.clone()),
        ..trial.clone()
    }
}

fn start_error(trial: &mut Trial, _: &Site, times: f64) {
    if let Some(error) = trial.sheet.as_mut().and_then(|sheet| sheet.start_error.as_mut()) {
        error.spread_share *= times;
        error.heading_deg *= times;
    }
}

fn odometry(trial: &mut Trial, _: &Site, times: f64) {
    let Some(noise) = &mut trial.robot.odometry else { return };
    let variances = [
        &mut noise.alpha_speed_speed,
        &mut noise.alpha_speed_turn,
        &mut noise.alpha_turn_speed,
        &mut noise.alpha_turn_turn,
    ];
    variances.into_iter().for_each(|variance| *variance *= times * times);
    noise.drift_distance *= times;
    noise.drift_yaw_radpm *= times;
    noise.slips_per_m *= times;
}

/// Sets the field of view of the laser while keeping the density of its beams.
fn view(trial: &mut Trial, _: &Site, degrees: f64) {
    let Some(laser) = &mut trial.robot.laser else { return };
    let beams = f64::from(laser.beams - 1) * degrees / laser.field_of_view_deg;
    laser.beams = beams.round() as u32 + 1;
    laser.field_of_view_deg = degrees;
}

#[cfg(test)]
mod tests {

    use sketchnav_schemas::robot::Robot;

    use super::*;

    #[test]
    fn every_line_changes_one_parameter_of_the_same_trials() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        let lines = suite.drawings();
        assert_eq!(lines.len(), 1 + CONDITIONS.iter().map(|c| c.values.len() - 1).sum::<usize>());
        for (_, line) in suite.curves.iter().flat_map(|curve| &curve.points) {
            assert!(lines.contains(line), "{line}");
        }
        let usual: Vec<_> = suite.trials.iter().filter(|trial| trial.drawing == AS_IT_IS).collect();
        for line in &lines[1..] {
            let changed = suite.trials.iter().filter(|trial| trial.drawing == *line);
            for (one, other) in usual.iter().zip(changed) {
                assert_eq!(one.variant_of, other.variant_of);
                let start_error = |trial: &Trial| trial.sheet.as_ref().unwrap().start_error;
                let differs = [
                    one.robot.laser != other.robot.laser,
                    one.robot.odometry != other.robot.odometry,
                    start_error(one) != start_error(other),
                    one.mission.world.furniture != other.mission.world.furniture,
                    one.mission.world.person != other.mission.world.person,
                    one.thinking_scans != other.thinking_scans,
                    one.mission.parameters != other.mission.parameters,
                ];
                assert_eq!(differs.iter().filter(|differs| **differs).count(), 1, "{line}: {differs:?}");
                let robot = toml::to_string(&other.robot).unwrap();
                assert_eq!(Robot::parse(&robot).unwrap(), other.robot, "{line}");
                sketchnav_sim::files::world(&other.mission.world).unwrap();
            }
        }
    }
}
