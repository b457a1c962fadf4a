//! The `directions-land` suite drives journeys of about 30 m from pole to pole by a custom map, with a noisy
//! laser. The paper mentions such a navigator but does not build one (Park and Kender 1995, 8).
//!
//! Each trial uses its own field of poles. The map-maker is given the poles, while the navigator only has its laser. A journey
//! succeeds if the robot stops next to its goal without touching anything on the way.

pub mod buildings;
mod tables;

use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

use rand_distr::{Distribution, StandardNormal};
use sketchnav_directions::path::{Atlas, Measure, Objective, Start as Beginning, best};
use sketchnav_directions::reliability::Reliability;
use sketchnav_directions::stages::{mission as keys, settings};
use sketchnav_directions::transitions::Kinds;
use sketchnav_directions::{Plane, Point};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::mission::{Mission, NavigatorChoice, Parameters, Place, Start, Task, WorldSource};
use sketchnav_schemas::seed;
use sketchnav_sim::{files, poles};

use crate::error::EvalError;
use crate::experiments::suite::{Folders, Suite};
use crate::experiments::trial::{Page, Trial};

/// Number of fields.
const FIELDS: usize = 100;
/// Straight-line distance from the start to the goal, in metres.
const DISTANCE_M: f64 = 30.0;
/// Distances, in metres, of the robot's start from its first pole, and of its final stop from its last pole.
const BESIDE_M: f64 = 0.8;
const THERE_M: f64 = 1.2;
/// Standard deviation of the heading at the start, in degrees.
const HEADING_DEG: f64 = 2.0;
/// The slowest average speed, in metres per second.
const SLOWEST_MPS: f64 = 0.08;

/// Loads the suite.
///
/// # Errors
/// [`EvalError`] if a file is missing.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = Vec::with_capacity(FIELDS);
    let mut unjoined = 0;
    let mut number = 1;
    while trials.len() < FIELDS {
        match trial(folders, number)? {
            Some(trial) => trials.push(trial),
            None => unjoined += 1,
        }
        number += 1;
    }
    let notices = vec![format!(
        "In {unjoined} further fields there is no path between the two poles, as the map-maker reports beforehand."
    )];
    Ok(Suite {
        title: "From pole to pole over 30 m by a custom map, with a noisy laser; reached: at the pole without contact.".into(),
        notices,
        trials,
        lines: Some("place"),
        repetitions: 1,
        sections: Some(tables::sections),
        ..Suite::default()
    })
}

/// Returns the journey on a field, or `None` if no path leads to the goal.
fn trial(folders: &Folders, number: u64) -> Result<Option<Trial>, EvalError> {
    let field = poles::poles(number);
    let distance_m = |pole: &[f64; 2]| (pole[0] - field[0][0]).hypot(pole[1] - field[0][1]);
    let off = |pole: &[f64; 2]| (distance_m(pole) - DISTANCE_M).abs();
    let Some(goal) = field.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))) else { return Ok(None) };
    let open = folders.project.join("sim/missions/landmarks/open.floor.toml").to_string_lossy().into_owned();
    let journey = Journey {
        name: format!("{number:03}"),
        line: "field of poles".into(),
        robot: "panorama.toml",
        world: WorldSource {
            floor_plan: Some(open),
            furniture: poles::furniture(&field),
            ..WorldSource::default()
        },
        plan: &poles::plan(number),
        start: field[0].map(|at| at + BESIDE_M * FRAC_1_SQRT_2),
        goal,
        way_m: DISTANCE_M,
        number,
        markers: BTreeMap::new(),
    };
    let trial = journey.trial(folders)?;
    Ok(is_joined(&trial, &field, goal)?.then_some(trial))
}

/// A journey from pole to pole.
struct Journey<'a> {
    name: String,
    line: String,
    /// Name of the file of the robot that drives.
    robot: &'static str,
    world: WorldSource,
    /// The floor with its poles, as given to the map-maker.
    plan: &'a FloorPlan,
    start: [f64; 2],
    goal: [f64; 2],
    /// Length of the way to the goal, in metres.
    way_m: f64,
    /// Determines the robot's pose at the start.
    number: u64,
    /// The numbers of the markers on the landmarks of each kind.
    markers: BTreeMap<&'static str, Vec<u32>>,
}

/// Returns the path of a robot's file.
fn robot(folders: &Folders, name: &str) -> String {
    folders.project.join("sim/missions/directions").join(name).to_string_lossy().into_owned()
}

impl Journey<'_> {
    fn trial(self, folders: &Folders) -> Result<Trial, EvalError> {
        let robot = robot(folders, self.robot);
        let heading: f64 = StandardNormal.sample(&mut seed::stream(self.number, "eval/land/heading"));
        let given = [
            ("floor_file", toml::Value::from("the floor")),
            ("landmark_radius_m", poles::RADIUS_M.into()),
            ("range_m", 8.0.into()),
            ("heading_noise_deg", HEADING_DEG.into()),
        ];
        let number = |id: &u32| toml::Value::from(i64::from(*id));
        let of_kind = |(kind, ids): (&&str, &Vec<u32>)| {
            ((*kind).to_owned(), toml::Value::Array(ids.iter().map(number).collect()))
        };
        let markers: toml::Table = self.markers.iter().map(of_kind).collect();
        let has_markers = !markers.is_empty();
        let markers = has_markers.then_some(("markers", toml::Value::Table(markers)));
        let mut parameters = Parameters::default();
        let effort = [("trial_journeys", 32), ("journeys", 256)]
            .map(|(key, count)| (key.to_owned(), toml::Value::from(count)));
        *parameters.of_mut(Process::Sketcher) = effort.into_iter().collect();
        let to_goal = toml::Value::Array(self.goal.map(toml::Value::from).to_vec());
        let mission = Mission {
            name: format!("land/{}", self.name),
            description: String::new(),
            robot: robot.clone(),
            navigator: NavigatorChoice {
                kind: keys::KIND.into(),
                given: given.into_iter().chain(markers).map(|(key, value)| (key.to_owned(), value)).collect(),
            },
            world: self.world,
            start: Start { world: self.start, world_heading_deg: (heading * HEADING_DEG).clamp(-20.0, 20.0) },
            task: vec![Task {
                name: "to the pole".into(),
                there: Place { polygon: None, center: Some(self.goal), radius_m: Some(THERE_M) },
                time_limit_s: 60.0 + self.way_m / SLOWEST_MPS,
                given: toml::Table::from_iter([("goal".to_owned(), to_goal)]),
            }],
            parameters,
        };
        let robot = files::robot(&robot)?;
        let bytes = toml::to_string(self.plan).unwrap_or_default();
        Ok(Trial {
            ends_with_contact: true,
            bytes: Some(Page::from(bytes.into_bytes())),
            ..Trial::new(self.name, self.line, mission, robot)
        })
    }
}

/// Returns true if isolated landmarks join the start and the goal.
fn is_joined(trial: &Trial, field: &[[f64; 2]], goal: [f64; 2]) -> Result<bool, EvalError> {
    let pilot = settings::pilot(&trial.mission, &trial.robot, 0.0).map_err(|error| EvalError::Trial {
        trial: trial.name.clone(),
        cause: Box::new(sketchnav_rehearsal::RehearsalError::Stage(error.into())),
    })?;
    let plane = Plane::new(field.iter().map(|&[x, y]| Point::new(x, y)).collect())?;
    let goal = field.iter().position(|pole| *pole == goal).unwrap_or_default() as u32;
    let atlas = Atlas::new(plane, pilot.settings.window, Kinds::ISOLATED, Reliability::fitted(pilot.noise));
    let start = Beginning::over(&atlas.plane, 0)?;
    Ok(best(&atlas, start, goal, Measure::Windows, Objective::SHORTEST).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_has_a_goal_about_30_m_away_and_all_keys() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert_eq!(suite.trials.len(), FIELDS);
        for trial in &suite.trials {
            keys::check(&trial.mission, &trial.robot).unwrap();
            let ([x, y], goal) = (trial.mission.start.world, trial.mission.task[0].there.center.unwrap());
            assert!(((goal[0] - x).hypot(goal[1] - y) - DISTANCE_M).abs() < 3.0, "{}", trial.name);
        }
    }
}
