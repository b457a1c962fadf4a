//! The `landmark-unknowns` suite varies what Chronis 2007 leaves open, one reading at a time, using sketches
//! without errors.
//!
//! Both scenes of the thesis are lost. Here, each of them is rebuilt 30 times: once as in the other suites, and 29 times with every
//! object except the goal moved at random by up to the tolerance of the relations in the text. The sketch is the scene itself, in
//! whole pixels of a PDA, with the exact route, so that drawing errors do not cause failures.

use rand::RngExt;
use sketchnav_deform::scenes::sketch;
use sketchnav_landmarks::route::INCH_M;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::seed;
use sketchnav_sim::scenes::{Object, Scene, apart, distance_to};

use super::variants::others;
use super::{STATES, mission, thesis};
use crate::error::EvalError;
use crate::experiments::suite::{Folders, Suite};
use crate::experiments::trial::Trial;

const TITLE: &str = "Two scenes of Chronis 2007, rebuilt with their objects slightly displaced, by exact sketches: the readings of what the thesis leaves open, one at a time.";
const NOTICE: &str = "paper: Chronis 2007, tables 5.2 to 5.6. Its scenes are lost, and are rebuilt from the text here. The sketches are exact, so their figures should not be expected to match the published ones.";
/// Number of times that each scene is rebuilt.
const REBUILT: u64 = 30;
/// Maximum displacement of an object along each axis, in metres. This is 5 pixels of 5 inches, the tolerance of the
/// relations that are printed for scene A (figure 4.29).
const MOVED_M: f64 = 25.0 * INCH_M;
/// Minimum distance of moved objects from the route, in metres. `BETWEEN_M` is their minimum distance from each other.
const BESIDE_WAY_M: f64 = 0.6;
const BETWEEN_M: f64 = 0.4;
/// Number of attempts to move an object. If all of them fail, the object stays where it is.
const ATTEMPTS: usize = 100;

/// An interpretation of what the text leaves open.
#[derive(Debug, Clone, Copy)]
struct Reading {
    /// Distance, in inches, between points of the route. The heading is averaged over five of them (4.3).
    step_in: f64,
    /// Whether objects other than the most significant one have only a direction (table 4.1).
    is_by_direction: bool,
    /// Multiple of the estimated time after which the robot counts as lost (4.8).
    patience: f64,
    /// Maximum factor that the last leg may apply to the estimate (4.8).
    most_stretch: f64,
    /// Tolerance of a proximity, in inches (4.3.2).
    proximity_in: f64,
}

const PUBLISHED: Reading =
    Reading { step_in: 20.0, is_by_direction: false, patience: 2.0, most_stretch: 2.0, proximity_in: 22.0 };

/// The readings: that of `landmark-published`, and others that differ from it in one or two respects.
const READINGS: [(&str, Reading); 10] = [
    ("as published", PUBLISHED),
    ("others by direction", Reading { is_by_direction: true, ..PUBLISHED }),
    ("points 5 inches apart", Reading { step_in: 5.0, ..PUBLISHED }),
    ("points 10 inches apart", Reading { step_in: 10.0, ..PUBLISHED }),
    ("points 30 inches apart", Reading { step_in: 30.0, ..PUBLISHED }),
    (
        "points 5 inches apart, others by direction",
        Reading { step_in: 5.0, is_by_direction: true, ..PUBLISHED },
    ),
    (
        "points 10 inches apart, others by direction",
        Reading { step_in: 10.0, is_by_direction: true, ..PUBLISHED },
    ),
    ("estimate by the drawing alone", Reading { most_stretch: 1.0, ..PUBLISHED }),
    ("twice as patient", Reading { patience: 4.0, ..PUBLISHED }),
    ("proximity to 44 inches", Reading { proximity_in: 44.0, ..PUBLISHED }),
];

impl Reading {
    fn of(&self, trial: &Trial) -> Trial {
        let mut one = trial.clone();
        one.mission.navigator.given.insert("route_step_m".into(), (self.step_in * INCH_M).into());
        let sketcher = one.mission.parameters.of_mut(Process::Sketcher);
        sketcher.insert("other_objects".into(), others(self.is_by_direction).into());
        sketcher.insert("proximity_tolerance_m".into(), (self.proximity_in * INCH_M).into());
        let patience = [("factor", self.patience), ("most_stretch", self.most_stretch)];
        let patience = toml::Table::from_iter(patience.map(|(key, value)| (key.to_owned(), value.into())));
        let states = toml::Table::from_iter([("patience".to_owned(), patience.into())]);
        one.mission.parameters.of_mut(Process::Planner).insert("states".into(), states.into());
        one
    }
}

/// Returns the scene with its objects displaced slightly at random. Number 0 is the scene itself.
fn rebuilt(scene: &Scene, number: u64) -> Scene {
    let mut found = scene.clone();
    if number == 0 {
        return found;
    }
    let mut rng = seed::stream(number, &format!("scenes/{} rebuilt", scene.name));
    for i in (0..scene.objects.len()).filter(|i| *i != scene.goal) {
        let moved = (0..ATTEMPTS).find_map(|_| {
            let [dx, dy] = [(); 2].map(|()| rng.random_range(-MOVED_M..=MOVED_M));
            let outline: Vec<_> = scene.objects[i].outline.iter().map(|[x, y]| [x + dx, y + dy]).collect();
            let is_beside = scene.way.iter().all(|at| distance_to(&outline, *at) >= BESIDE_WAY_M);
            let mut others = found.objects.iter().enumerate().filter(|(j, _)| *j != i);
            let is_apart = others.all(|(_, other)| apart(&other.outline, &outline) >= BETWEEN_M);
            (is_beside && is_apart).then_some(outline)
        });
        if let Some(outline) = moved {
            found.objects[i] = Object { outline, ..found.objects[i].clone() };
        }
    }
    found
}

/// Loads the `landmark-unknowns` suite.
///
/// # Errors
/// Same as [`super::scenes`].
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let robot = thesis::robot()?;
    let mut trials = Vec::new();
    for (words, reading) in READINGS {
        for (scene, number) in
            [Scene::a(), Scene::b()].iter().flat_map(|scene| (0..REBUILT).map(move |n| (scene, n)))
        {
            let rebuilt = rebuilt(scene, number);
            // An exact sketch fits on the screen if the scene does, so no scene should be skipped here.
            let Some(file) = sketch(&rebuilt, 0.0, number).on_a_pda() else { continue };
            let line = format!("{words}, scene {}", scene.name.to_uppercase());
            let name = format!("{}/{}/{number:02}", words.replace([' ', ','], "-"), scene.name);
            let mission = mission(folders, &rebuilt, thesis::by_bytes());
            let trial = Trial::new(name, line, mission, robot.clone());
            let trial = Trial { bytes: Some(file.into_bytes().into()), method: Some(STATES.into()), ..trial };
            trials.push(Trial {
                variant_of: Some(format!("{}/{number:02}", scene.name)),
                ..reading.of(&trial)
            });
        }
    }
    Ok(Suite {
        title: TITLE.into(),
        notices: vec![NOTICE.into()],
        trials,
        lines: Some("reading, scene"),
        repetitions: 1,
        ..Suite::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::suite::Folders;

    #[test]
    fn every_rebuilt_scene_is_drawn_for_every_reading() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert_eq!(suite.trials.len(), READINGS.len() * 2 * REBUILT as usize);
        for trial in &suite.trials {
            sketchnav_landmarks::mission::LandmarksMission::of(&trial.mission).unwrap();
            sketchnav_landmarks::mission::Parameters::of(&trial.mission).unwrap();
        }
    }

    #[test]
    fn objects_are_rebuilt_within_tolerance_and_the_goal_in_place() {
        for scene in [Scene::a(), Scene::b()] {
            let mut moved = 0;
            for number in 1..REBUILT {
                let other = rebuilt(&scene, number);
                assert_eq!(other.objects[scene.goal], scene.objects[scene.goal]);
                for (one, other) in scene.objects.iter().zip(&other.objects) {
                    let by = [0, 1].map(|axis| other.outline[0][axis] - one.outline[0][axis]);
                    assert!(by.iter().all(|by| by.abs() <= MOVED_M), "{}: {by:?}", one.name);
                    moved += usize::from(by != [0.0, 0.0]);
                }
            }
            assert!(moved * 10 > (REBUILT as usize - 1) * (scene.objects.len() - 1) * 9, "{moved} moved");
            assert_eq!(rebuilt(&scene, 3), rebuilt(&scene, 3));
        }
    }
}
