//! Suites of routes past landmarks (Chronis 2007, chapter 5): `landmark-scenes`, `landmark-features`,
//! `landmark-isolation`, `landmark-deformed`, `landmark-labels` and `landmark-sites`. For suites under the thesis's own
//! conditions, see [`thesis`], and for what these leave open, see [`unknowns`].
//!
//! The scenes and sketches are not those of the thesis, whose figures are lost (see [`sketchnav_sim::scenes`]). A drive
//! succeeds if the robot stops in front of the object at the end of the route.

mod figures;
pub mod isolation;
mod published;
mod tables;
pub mod thesis;
pub mod unknowns;
mod variants;
mod warnings;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use sketchnav_landmarks::file;
use sketchnav_landmarks::mission::{KIND, METHODS};
use sketchnav_landmarks::sketch::{Landmark, Reading, Sketch};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::mission::{Mission, NavigatorChoice, Parameters, Task, WorldSource};
use sketchnav_sim::files;
use sketchnav_sim::scenes::{Scene, middle};

use self::variants::{paper, variants};
use crate::error::EvalError;
use crate::experiments::person::{self, Person};
use crate::experiments::suite::{Curve, Folders, Remark, Suite};
use crate::experiments::trial::Trial;

const ROBOT: &str = "nomad200";
/// The robot with a camera that finds markers.
const ROBOT_WITH_CAMERA: &str = "nomad200-camera";
const BELIEF: &str = METHODS[0];
const STATES: &str = METHODS[1];
const FOLDER: &str = "sim/missions/landmarks";
const REPETITIONS: u32 = 5;
/// Number of sketches for each scene and degree.
const SKETCHES: u64 = 10;
const DEGREES: [f64; 4] = [0.0, 0.5, 1.0, 1.5];

const NOTICE: &str = "paper: Chronis 2007, tables 5.2 to 5.5: 11 and 9 people's sketches of two other scenes, in another simulator. Here both scenes are rebuilt from the text, and the sketches are drawn by a program.";

/// Returns a mission in a scene, with the given keys of its navigator.
fn mission(folders: &Folders, scene: &Scene, given: toml::Table) -> Mission {
    let goal = &scene.objects[scene.goal].name;
    Mission {
        name: format!("landmarks/{}", scene.name),
        description: String::new(),
        robot: ROBOT.into(),
        navigator: NavigatorChoice { kind: KIND.into(), given },
        world: source(folders, scene),
        start: scene.start(),
        task: vec![Task {
            name: format!("to the {goal}"),
            there: scene.there(),
            time_limit_s: 60.0 + scene.path_m() / 0.1,
            given: toml::Table::new(),
        }],
        parameters: Parameters::default(),
    }
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn trial(name: String, line: String, mission: Mission) -> Result<Trial, EvalError> {
    Ok(Trial::new(name, line, mission, files::robot(ROBOT)?))
}

/// Returns the trials with the sketches in the repository, of which 11 show scene A and 9 show scene B.
fn sketched(folders: &Folders) -> Result<Vec<Trial>, EvalError> {
    let mut trials = Vec::new();
    for (scene, count) in [(Scene::a(), 11), (Scene::b(), 9)] {
        for i in 1..=count {
            let file = folders.project.join(FOLDER).join(format!("sketches/{}-{i:02}.json", scene.name));
            let given = toml::Table::from_iter([("drawing".to_owned(), text(&file).into())]);
            let line = format!("scene {}", scene.name.to_uppercase());
            trials.push(trial(format!("{}/{i:02}", scene.name), line, mission(folders, &scene, given))?);
        }
    }
    Ok(trials)
}

/// Loads the `landmark-scenes` suite.
///
/// # Errors
/// [`EvalError`] if a file is missing.
pub fn scenes(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = sketched(folders)?;
    let others: Vec<_> = variants(&trials).into_iter().skip(trials.len()).collect();
    trials.extend(others);
    Ok(Suite {
        title: "Two scenes of Chronis 2007 by 11 and 9 sketches, five runs each.".into(),
        notices: vec![NOTICE.into()],
        trials,
        lines: Some("scene"),
        methods: METHODS.map(str::to_owned).into(),
        repetitions: REPETITIONS,
        paper: paper(),
        sections: Some(tables::sections),
        ..Suite::default()
    })
}

/// A version of the method, as in Chronis 2007, table 5.1.
struct Version {
    line: &'static str,
    /// Whether proximity, width, neighbouring directions and temporal matching are used.
    features: [bool; 4],
    /// Parameter c of the distance measure that joins returns (4.4).
    joining_c: f64,
    /// Tolerance of a proximity, in inches: 11 before version 3 (5.1).
    proximity_in: f64,
}

/// The versions, each of which adds one feature to the previous one. "Larger objects" result from a greater c. The text does not
/// give a number, so c is doubled here.
const VERSIONS: [Version; 6] = {
    const C: f64 = 24.0;
    const fn version(line: &'static str, features: [bool; 4]) -> Version {
        Version { line, features, joining_c: C, proximity_in: 22.0 }
    }
    [
        version("1 main direction", [false, false, false, false]),
        Version { proximity_in: 11.0, ..version("2 and proximity", [true, false, false, false]) },
        version("3 and histogram width", [true, true, false, false]),
        Version { joining_c: 2.0 * C, ..version("4 and larger objects", [true, true, false, false]) },
        version("5 and neighbour directions", [true, true, true, false]),
        version("6 and temporal objects", [true, true, true, true]),
    ]
};

/// What the thesis says about each version.
const REMARKS: [(&str, &str); 6] = [
    ("1 main direction", "unsuccessful"),
    ("2 and proximity", "unsuccessful"),
    ("3 and histogram width", "no significant change"),
    ("4 and larger objects", "not improved"),
    ("5 and neighbour directions", "a significant improvement"),
    ("6 and temporal objects", "acceptable"),
];

impl Version {
    fn set(&self, parameters: &mut Parameters) {
        const INCH_M: f64 = 0.0254;
        let names = ["proximity", "width", "neighbours", "temporal"];
        let features = names.into_iter().zip(self.features);
        let features: toml::Table = features.map(|(name, value)| (name.to_owned(), value.into())).collect();
        let states = toml::Table::from_iter([("features".to_owned(), features.into())]);
        let perception = toml::Table::from_iter([("joining".to_owned(), (16.0 / self.joining_c).into())]);
        let tolerance_m = self.proximity_in * INCH_M;
        parameters.of_mut(Process::Planner).insert("states".into(), states.into());
        parameters.of_mut(Process::Localizer).insert("perception".into(), perception.into());
        parameters.of_mut(Process::Sketcher).insert("proximity_tolerance_m".into(), tolerance_m.into());
    }
}

/// Loads the `landmark-features` suite.
///
/// # Errors
/// Same as [`scenes`].
pub fn features(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    for version in &VERSIONS {
        for mut trial in sketched(folders)? {
            version.set(&mut trial.mission.parameters);
            let line = version.line;
            let name = format!("{}/{}", &line[..1], trial.name);
            let method = Some(STATES.into());
            trials.push(Trial { drawing: line.into(), variant_of: Some(trial.name), name, method, ..trial });
        }
    }
    Ok(Suite {
        title: "Landmark states with more and more features (Chronis 2007, table 5.1), by all sketches."
            .into(),
        notices: vec![
            NOTICE.into(),
            "paper: Chronis 2007, table 5.1, shows drives by one sketch as pictures: none of versions 1 to 4 follows the route, 5 is \"a significant improvement\", and 6 is \"acceptable\" and led a real robot along the route 20 of 20 times.".into(),
        ],
        trials,
        lines: Some("features"),
        repetitions: 1,
        remarks: REMARKS.map(|(line, words)| Remark { method: STATES, line, words }).into(),
        ..Suite::default()
    })
}

/// Returns a world that consists of a scene's objects in a large open area.
fn source(folders: &Folders, scene: &Scene) -> WorldSource {
    let FloorPlan { furniture, .. } = scene.plan();
    let open = folders.project.join(FOLDER).join("open.floor.toml");
    WorldSource { floor_plan: Some(text(&open)), furniture, ..WorldSource::default() }
}

/// Loads the `landmark-deformed` suite.
///
/// # Errors
/// Same as [`scenes`].
pub fn deformed(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(Suite {
        title: "Twelve scenes with ten sketches of each degree, deformed as people deform them.".into(),
        ..by_degrees(folders, Scene::twelve(1), by_deformed)?
    })
}

/// Loads the `landmark-labels` suite, which repeats the drives of `landmark-deformed` with a robot that recognizes the objects
/// named in the sketch.
///
/// # Errors
/// Same as [`scenes`].
pub fn labels(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(Suite {
        title: "The same scenes and sketches, driven by a robot with a camera. The objects have markers, and the mission assigns them the sketch's labels.".into(),
        ..by_degrees(folders, Scene::twelve(1), by_labels)?
    })
}

/// Loads the `landmark-answers` suite, which repeats the drives of `landmark-deformed` while a person watches and answers.
///
/// # Errors
/// Same as [`scenes`].
pub fn answered(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(Suite {
        title: "The same scenes and sketches. A person watches and, if the robot is lost, chooses one of the places that it offers, or points at its place in the sketch.".into(),
        sections: Some(person::sections),
        ..by_degrees(folders, Scene::twelve(1), by_answers)?
    })
}

/// Loads the `landmark-sites` suite. Its scenes come from another generator than those of `landmark-choice`, and are of other
/// kinds.
///
/// # Errors
/// Same as [`scenes`].
pub fn sites(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(Suite {
        title: "Two shops, parks, car parks, churches, markets and depots with ten sketches of each degree, deformed as people deform them.".into(),
        ..by_degrees(folders, Scene::sites(1), by_deformed)?
    })
}

/// Creates a trial of a scene, given the degree and the number of its sketch and the line of the table that it counts for.
type ByDegree = fn(&Folders, &Scene, f64, u64, String) -> Result<Trial, EvalError>;

fn by_degrees(
    folders: &Folders,
    scenes: impl IntoIterator<Item = Scene>,
    trial: ByDegree,
) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    let scenes: Vec<_> = scenes.into_iter().collect();
    for degree in DEGREES {
        for scene in &scenes {
            for number in 1..=SKETCHES {
                trials.push(trial(folders, scene, degree, number, format!("degree {degree:.1}"))?);
            }
        }
    }
    let points = DEGREES.map(|degree| (degree, format!("degree {degree:.1}"))).into();
    Ok(Suite {
        notices: vec![
            "The belief's parameters were chosen on other scenes and sketches: `landmark-choice`.".into(),
        ],
        trials,
        lines: Some("sketches"),
        repetitions: 1,
        curves: vec![Curve { title: "Deformation".into(), unit: "degree".into(), points }],
        sections: Some(warnings::sections),
        ..Suite::default()
    })
}

/// Loads the `landmark-choice` suite, whose scenes and sketches are used to choose parameters and are not reported on.
///
/// # Errors
/// Same as [`scenes`].
pub fn choice(folders: &Folders) -> Result<Suite, EvalError> {
    const FIRST: u64 = 101;
    let mut trials = Vec::new();
    for scene in (0..4).flat_map(|ten| Scene::ten(FIRST + 10 * ten)) {
        let line = scene.name.split('-').next().unwrap_or_default().to_owned();
        for number in FIRST..FIRST + SKETCHES {
            trials.push(by_deformed(folders, &scene, 1.0, number, line.clone())?);
        }
    }
    Ok(Suite {
        title: "Forty scenes with ten sketches of degree 1, for choosing parameters.".into(),
        trials,
        lines: Some("kind of scene"),
        repetitions: 1,
        sections: Some(warnings::sections),
        ..Suite::default()
    })
}

/// Creates a trial with a sketch that is deformed at random.
fn by_deformed(
    folders: &Folders,
    scene: &Scene,
    degree: f64,
    number: u64,
    line: String,
) -> Result<Trial, EvalError> {
    let sketch = sketchnav_deform::scenes::sketch(scene, degree, sketch_seed(degree, number));
    let given = toml::Table::from_iter([
        ("drawing".to_owned(), "sketch".into()),
        ("canvas_m".to_owned(), sketch.canvas_m().into()),
    ]);
    let name = format!("{}/{degree:.1}/{number}", scene.name);
    let one = trial(name, line, mission(folders, scene, given))?;
    Ok(Trial { bytes: Some(sketch.file().into_bytes().into()), ..one })
}

/// Creates a trial like [`by_deformed`], but with a camera on the robot and markers on the objects. The robot recognizes those
/// objects whose label in the sketch is their own.
fn by_labels(
    folders: &Folders,
    scene: &Scene,
    degree: f64,
    number: u64,
    line: String,
) -> Result<Trial, EvalError> {
    let mut one = by_deformed(folders, scene, degree, number, line)?;
    one.robot = files::robot(ROBOT_WITH_CAMERA)?;
    one.mission.robot = ROBOT_WITH_CAMERA.into();
    one.mission.world.marker = scene.markers();
    let known = known(scene, degree, number);
    let labels = scene.marker_numbers().filter(|(name, _)| known.contains_key(*name));
    let table: toml::Table = labels.map(|(name, numbers)| (name.to_owned(), numbers.into())).collect();
    one.mission.navigator.given.insert("markers".into(), table.into());
    Ok(one)
}

/// Creates a trial like [`by_deformed`], but with a person who watches, and tells the robot where it is when it is lost.
fn by_answers(
    folders: &Folders,
    scene: &Scene,
    degree: f64,
    number: u64,
    line: String,
) -> Result<Trial, EvalError> {
    let one = by_deformed(folders, scene, degree, number, line)?;
    let known = known(scene, degree, number);
    let matched = scene.objects.iter().filter_map(|object| {
        Some((Point::from(middle(&object.outline)), Point::from(*known.get(&object.name)?)))
    });
    let person = Some(Arc::new(Person::new(matched)));
    Ok(Trial { person, ..one })
}

/// Returns the centres of those objects of a sketch whose label is their own, in pixels of the canvas, by name.
fn known(scene: &Scene, degree: f64, number: u64) -> BTreeMap<String, [f64; 2]> {
    let sketch = sketchnav_deform::scenes::sketch(scene, degree, sketch_seed(degree, number));
    let reading = Reading { canvas_m: sketch.canvas_m(), ..Reading::default() };
    let read = file::read(sketch.file().as_bytes()).and_then(|drawing| Sketch::read(&drawing, &reading));
    let Ok(Sketch { landmarks, metres_per_pixel, .. }) = read else { return BTreeMap::new() };
    let is_known = |name: &str| landmarks.iter().filter(|landmark| landmark.name == name).count() == 1;
    let known = landmarks.iter().filter(|landmark| is_known(&landmark.name));
    let outline = |landmark: &Landmark| -> Vec<_> {
        landmark.outline.iter().map(|at| [at.x, at.y].map(|x| x / metres_per_pixel)).collect()
    };
    known.map(|landmark| (landmark.name.clone(), middle(&outline(landmark)))).collect()
}

/// Returns the seed of a sketch.
fn sketch_seed(degree: f64, number: u64) -> u64 {
    number + 1000 * (degree * 10.0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trials without additional states are driven only by states, since driving them by a belief would repeat the same drive.
    #[test]
    fn a_trial_with_its_own_method_is_driven_once() {
        let suite = scenes(&Folders::of_checkout()).unwrap();
        assert_eq!((suite.trials.len(), suite.methods.len()), (80, 2));
        let count = |methods: &[&str]| {
            let methods: Vec<_> = methods.iter().map(|method| (*method).to_owned()).collect();
            let of =
                |method| suite.trials.iter().filter(|trial| suite.is_driven(trial, method, &methods)).count();
            methods.iter().map(|method| of(method)).collect::<Vec<_>>()
        };
        assert_eq!(count(&[BELIEF, STATES]), [20, 80]);
        assert_eq!((count(&[BELIEF]), count(&[STATES])), (vec![20], vec![80]));
        let isolated = isolation::suite(&Folders::of_checkout()).unwrap();
        let methods = [BELIEF.to_owned()];
        assert!(isolated.trials.iter().all(|trial| isolated.is_driven(trial, BELIEF, &methods)));
    }
}
