//! Suites of routes past landmarks (Chronis 2007, chapter 5): `landmark-scenes`, `landmark-features`,
//! `landmark-isolation`, `landmark-deformed`, `landmark-labels`.
//!
//! The scenes and sketches are not those of the thesis, whose figures are lost: see [`sketchnav_sim::scenes`]. A drive
//! succeeds where the robot stops before the object at the route's end.

mod figures;
mod published;
mod tables;

use std::path::Path;

use serde_json::json;
use sketchnav_landmarks::file;
use sketchnav_landmarks::mission::{KIND, METHODS};
use sketchnav_landmarks::sketch::{Reading, Sketch};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::mission::{Mission, NavigatorChoice, Parameters, Task, WorldSource};
use sketchnav_schemas::robot::OdometryNoise;
use sketchnav_sim::files;
use sketchnav_sim::scenes::{At, Scene};

use crate::error::EvalError;
use crate::experiments::run;
use crate::experiments::suite::{Curve, Folders, Published, Suite, Told};
use crate::experiments::trial::{Page, Trial};

const ROBOT: &str = "nomad200";
/// The same with a camera that finds markers.
const ROBOT_WITH_CAMERA: &str = "nomad200-camera";
const BELIEF: &str = METHODS[0];
const STATES: &str = METHODS[1];
const FOLDER: &str = "sim/missions/landmarks";
const REPETITIONS: u32 = 5;
/// Sketches of each scene and degree.
const SKETCHES: u64 = 10;
const DEGREES: [f64; 4] = [0.0, 0.5, 1.0, 1.5];

const NOTICE: &str = "paper: Chronis 2007, tables 5.2 to 5.5: 11 and 9 people's sketches of two other scenes, in another simulator. Here both scenes are rebuilt from the text, and the sketches are drawn by a program.";

/// A mission in a scene.
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
            time_limit_s: 60.0 + scene.way_m() / 0.1,
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

/// The same trials by states, without the additional ones: another line each.
fn without_additional(trials: &[Trial]) -> Vec<Trial> {
    let one = |trial: &Trial| {
        let mut base = trial.clone();
        base.name += tables::BASE;
        base.drawing += ", without additional states";
        base.variant_of = Some(trial.name.clone());
        base.method = Some(STATES.into());
        let sketcher = base.mission.parameters.of_mut(Process::Sketcher);
        sketcher.insert("additional_states".into(), false.into());
        base
    };
    trials.iter().map(one).collect()
}

/// The trials by the sketches that ship: 11 of scene A, 9 of scene B.
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

/// Loads the suite `landmark-scenes`.
///
/// # Errors
/// [`EvalError`] with the file that is missing.
pub fn scenes(folders: &Folders) -> Result<Suite, EvalError> {
    let mut trials = sketched(folders)?;
    trials.extend(without_additional(&trials));
    let published = |scene: &published::Scene, additional: bool| Published {
        name: format!(
            "paper {}{}",
            scene.word.to_uppercase(),
            if additional { "" } else { ", without additional states" }
        ),
        reached: scene.reached[usize::from(additional)] as u32,
        attempts: 5 * scene.sketches.len() as u32,
    };
    let paper = |additional: bool| published::SCENES.iter().map(move |scene| published(scene, additional));
    Ok(Suite {
        title: "Two scenes of Chronis 2007 by 11 and 9 sketches, five runs each.".into(),
        notices: vec![NOTICE.into()],
        trials,
        lines: Some("scene"),
        methods: METHODS.map(str::to_owned).into(),
        repetitions: REPETITIONS,
        paper: paper(true).chain(paper(false)).collect(),
        tells: Some(tables::sections),
        ..Suite::default()
    })
}

/// A version of the method (Chronis 2007, table 5.1).
struct Version {
    line: &'static str,
    /// Proximity, width, neighbour directions, temporal objects.
    features: [bool; 4],
    /// The c of the distance measure by which returns are joined (4.4).
    joining_c: f64,
    /// To how many inches a proximity is known: 11 before version 3 (5.1).
    proximity_in: f64,
}

/// The versions, with one feature after the other. "Larger objects" are those of a greater c; the text has no number: twice.
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

/// What is published of them.
const TOLD: [(&str, &str); 6] = [
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

/// Loads the suite `landmark-features`.
///
/// # Errors
/// As [`scenes`].
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
            "paper: Chronis 2007, table 5.1, shows drives of one sketch as pictures: none of versions 1 to 4 follows the route, 5 is \"a significant improvement\", 6 is \"acceptable\" and led a real robot along 20 of 20 times.".into(),
        ],
        trials,
        lines: Some("features"),
        repetitions: 1,
        told: TOLD.map(|(line, words)| Told { method: STATES, line, words }).into(),
        ..Suite::default()
    })
}

/// Scene A as a sketch file, with another route, and without some objects.
fn true_sketch(scene: &Scene, route: &[At]) -> Page {
    const SIDE: f64 = 1000.0;
    const ORIGIN: At = [100.0, 600.0];
    let pixel = |at: &At| [at[0] * SIDE / 20.0 + ORIGIN[0], ORIGIN[1] - at[1] * SIDE / 20.0];
    let obstacles: Vec<_> = scene
        .objects
        .iter()
        .map(|object| {
            let polygon: Vec<_> = object.outline.iter().map(pixel).collect();
            json!({ "polygon": polygon, "label": object.name })
        })
        .collect();
    let route: Vec<_> = route.iter().map(pixel).collect();
    let page = json!({ "canvas": [SIDE, SIDE], "strokes": [], "obstacles": obstacles, "route": route });
    page.to_string().into_bytes().into()
}

fn by_bytes(method: &str) -> toml::Table {
    toml::Table::from_iter([
        ("method".to_owned(), method.into()),
        ("drawing".to_owned(), "sketch".into()),
        ("canvas_m".to_owned(), 20.0.into()),
    ])
}

/// Loads the suite `landmark-isolation` (Chronis 2007, 5.2.3 and 5.3.1).
///
/// # Errors
/// As [`scenes`].
pub fn isolation(folders: &Folders) -> Result<Suite, EvalError> {
    let scene = Scene::a();
    let words = text(&folders.project.join(FOLDER).join("route.txt"));
    let given = toml::Table::from_iter([("route_file".to_owned(), words.into())]);
    let method = Some(STATES.to_owned());
    let mut trials = Vec::new();
    for i in 1..=4 {
        let one = trial(
            format!("words/{i}"),
            "states of the true scene".into(),
            mission(folders, &scene, given.clone()),
        )?;
        trials.push(Trial { method: method.clone(), ..one });
    }
    let by_true = mission(folders, &scene, by_bytes(STATES));
    for seed in 1..=5 {
        let one = trial(format!("driven/{seed}"), "routes that the robot drove".into(), by_true.clone())?;
        let page = driven_way(folders, &scene, seed)?;
        trials.push(Trial { method: method.clone(), bytes: Some(page), ..one });
    }
    for gone in [&["trash"][..], &["trash", "cabinet"], &["trash", "boxes", "table"]] {
        let mut without = scene.clone();
        without.objects.retain(|object| !gone.contains(&object.name.as_str()));
        let mut one =
            trial(format!("gone/{}", gone.join("-")), "objects removed: to be lost".into(), by_true.clone())?;
        one.mission.world = source(folders, &without);
        trials.push(Trial { method: method.clone(), bytes: Some(true_sketch(&scene, &scene.way)), ..one });
    }
    for method in [STATES, BELIEF] {
        let mut moved = scene.clone();
        for object in moved
            .objects
            .iter_mut()
            .filter(|object| ["cabinet", "desk", "table"].contains(&object.name.as_str()))
        {
            object.outline.iter_mut().for_each(|at| at[0] += 1.0);
        }
        moved.goal = scene.goal;
        let line = format!("objects on the right moved, by {method}");
        let mut one = trial(format!("moved/{method}"), line, by_true.clone())?;
        one.mission.world = source(folders, &moved);
        one.mission.task[0].there = moved.there();
        trials.push(Trial {
            method: Some(method.into()),
            bytes: Some(true_sketch(&scene, &scene.way)),
            ..one
        });
    }
    let published = |name: &str, reached| Published { name: name.into(), reached, attempts: reached };
    Ok(Suite {
        title: "Landmark states without people's errors, in scene A (Chronis 2007, 5.2.3 and 5.3.1).".into(),
        notices: vec!["Where objects are removed, the robot is to know that it is lost: none of these runs is to reach the goal.".into()],
        trials,
        lines: Some("what"),
        repetitions: REPETITIONS,
        paper: vec![published("paper: states of the true scene", 20), published("paper: routes that the robot drove", 25)],
        ..Suite::default()
    })
}

/// The objects of a scene, in a wide place.
fn source(folders: &Folders, scene: &Scene) -> WorldSource {
    let FloorPlan { furniture, .. } = scene.plan();
    let open = folders.project.join(FOLDER).join("open.floor.toml");
    WorldSource { floor_plan: Some(text(&open)), furniture, ..WorldSource::default() }
}

/// A true sketch with the route of a robot that software guided along the true way, "creating an accurate path"
/// (5.2.3). The robot's odometry is exact and it believes nothing else. It looks no further ahead than it has to. It
/// is driven where somebody wants the sketch: not for lists of jobs.
fn driven_way(folders: &Folders, scene: &Scene, seed: u64) -> Result<Page, EvalError> {
    let guided = trial("guided".into(), String::new(), mission(folders, scene, by_bytes(BELIEF)))?;
    let mut guided = Trial { bytes: Some(true_sketch(scene, &scene.way)), ..guided };
    guide_exactly(&mut guided);
    let words = format!("where the robot went along the true way of scene {}, seed {seed}", scene.name);
    let scene = scene.clone();
    Ok(Page::made(words, move || {
        let runs = run::drive(&guided, BELIEF, seed)?;
        let truth = runs.iter().flat_map(|run| &run.log.truth);
        let mut way: Vec<At> = truth.map(|truth| truth.pose()).map(|pose| [pose.x, pose.y]).collect();
        way.dedup_by(|a, b| sketchnav_sim::scenes::distance(*a, *b) < 0.1);
        true_sketch(&scene, &way).bytes()
    }))
}

/// A robot that knows where it is and follows the way closely.
fn guide_exactly(guided: &mut Trial) {
    guided.robot.odometry = guided.robot.odometry.map(|odometry| OdometryNoise {
        rate_hz: odometry.rate_hz,
        alpha_speed_speed: 0.0,
        alpha_speed_turn: 0.0,
        alpha_turn_speed: 0.0,
        alpha_turn_turn: 0.0,
        drift_distance: 0.0,
        drift_yaw_radpm: 0.0,
        slips_per_m: 0.0,
    });
    let table = |numbers: &[(&str, f64)]| -> toml::Value {
        let numbers = numbers.iter().map(|(key, number)| ((*key).to_owned(), (*number).into()));
        toml::Table::from_iter(numbers).into()
    };
    let sure = ["way_sd", "heading_sd", "stretch_sd", "start_stretch_sd", "start_sd_m", "start_heading_sd"];
    let parameters = &mut guided.mission.parameters;
    parameters.of_mut(Process::Localizer).insert("belief".into(), table(&sure.map(|key| (key, 0.0))));
    let close = table(&[("ahead_m", 0.4), ("avoid", 0.0)]);
    parameters.of_mut(Process::Planner).insert("belief".into(), close);
}

/// Loads the suite `landmark-deformed`.
///
/// # Errors
/// As [`scenes`].
pub fn deformed(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(Suite {
        title: "Twelve scenes by ten sketches of each degree, deformed as people deform them.".into(),
        ..by_degrees(folders, by_deformed)?
    })
}

/// Loads the suite `landmark-labels`: the drives of `landmark-deformed` by a robot that reads what the sketch names.
///
/// # Errors
/// As [`scenes`].
pub fn labels(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(Suite {
        title: "The same scenes and sketches by a robot with a camera: objects have markers, which the mission gives the labels of the sketch.".into(),
        ..by_degrees(folders, by_labels)?
    })
}

/// Makes a trial of a scene by a sketch of a degree and a number, for a line of the table.
type ByDegree = fn(&Folders, &Scene, f64, u64, String) -> Result<Trial, EvalError>;

fn by_degrees(folders: &Folders, trial: ByDegree) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    for degree in DEGREES {
        for scene in Scene::twelve(1) {
            for number in 1..=SKETCHES {
                trials.push(trial(folders, &scene, degree, number, format!("degree {degree:.1}"))?);
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
        ..Suite::default()
    })
}

/// Loads the suite `landmark-choice`: scenes and sketches on which parameters can be chosen, none of which is reported on.
///
/// # Errors
/// As [`scenes`].
pub fn choice(folders: &Folders) -> Result<Suite, EvalError> {
    const FIRST: u64 = 101;
    let mut trials = Vec::new();
    for scene in Scene::ten(FIRST) {
        let line = scene.name.split('-').next().unwrap_or_default().to_owned();
        for number in FIRST..FIRST + SKETCHES {
            trials.push(by_deformed(folders, &scene, 1.0, number, line.clone())?);
        }
    }
    Ok(Suite {
        title: "Ten scenes by ten sketches of degree 1, to choose parameters on.".into(),
        trials,
        lines: Some("kind of scene"),
        repetitions: 1,
        ..Suite::default()
    })
}

/// A trial by a sketch that is drawn by chance.
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

/// The same by a robot with a camera, past objects with markers. Those are known whose label in the sketch is their own.
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
    let sketch = sketchnav_deform::scenes::sketch(scene, degree, sketch_seed(degree, number));
    let reading = Reading { canvas_m: sketch.canvas_m(), ..Reading::default() };
    let read = file::read(sketch.file().as_bytes()).and_then(|drawing| Sketch::read(&drawing, &reading));
    let known = read.map_or(Vec::new(), |sketch| sketch.landmarks);
    let is_known = |name: &str| known.iter().filter(|landmark| landmark.name == name).count() == 1;
    let labels = scene.marker_numbers().filter(|(name, _)| is_known(name));
    let table: toml::Table = labels.map(|(name, numbers)| (name.to_owned(), numbers.into())).collect();
    one.mission.navigator.given.insert("markers".into(), table.into());
    Ok(one)
}

/// The seed of a sketch.
fn sketch_seed(degree: f64, number: u64) -> u64 {
    number + 1000 * (degree * 10.0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Loading the suite drove five missions, even for a list of its jobs.
    #[test]
    fn loading_the_suite_of_isolated_states_drives_nothing() {
        let mut suite = isolation(&Folders::of_checkout()).unwrap();
        suite.trials.retain(|trial| trial.name.starts_with("driven/"));
        let recipes: Vec<_> = suite.trials.iter().map(|trial| trial.bytes.clone().unwrap()).collect();
        assert_eq!(recipes.len(), 5);
        assert!(recipes.iter().all(|page| matches!(page, Page::Made(recipe) if !recipe.is_made())));
        // Each has an origin of its own.
        assert_ne!(recipes[0].origin(), recipes[1].origin());
    }

    /// The trials without additional states are by states alone: a belief would be driven twice.
    #[test]
    fn a_trial_with_a_method_of_its_own_is_driven_once() {
        let suite = scenes(&Folders::of_checkout()).unwrap();
        assert_eq!((suite.trials.len(), suite.methods.len()), (40, 2));
        let count = |methods: &[&str]| {
            let methods: Vec<_> = methods.iter().map(|method| (*method).to_owned()).collect();
            let of =
                |method| suite.trials.iter().filter(|trial| suite.is_driven(trial, method, &methods)).count();
            methods.iter().map(|method| of(method)).collect::<Vec<_>>()
        };
        assert_eq!(count(&[BELIEF, STATES]), [20, 40]);
        assert_eq!((count(&[BELIEF]), count(&[STATES])), (vec![20], vec![40]));
        let isolated = isolation(&Folders::of_checkout()).unwrap();
        let methods = [BELIEF.to_owned()];
        assert!(isolated.trials.iter().all(|trial| isolated.is_driven(trial, BELIEF, &methods)));
    }

    /// A robot that believed its sonars and looked 1.2 m ahead cut its turns. The routes were not those that were
    /// wanted, and states that were extracted from them were lost.
    #[test]
    fn routes_that_the_robot_drove_are_accurate() {
        let scene = Scene::a();
        let page = driven_way(&Folders::of_checkout(), &scene, 1).unwrap();
        let page: serde_json::Value = serde_json::from_slice(&page.bytes().unwrap()).unwrap();
        let route: Vec<At> = serde_json::from_value(page["route"].clone()).unwrap();
        let wanted: serde_json::Value =
            serde_json::from_slice(&true_sketch(&scene, &scene.way).bytes().unwrap()).unwrap();
        let wanted: Vec<At> = serde_json::from_value(wanted["route"].clone()).unwrap();
        let off = |at: &At| {
            let distances = wanted.iter().map(|other| sketchnav_sim::scenes::distance(*at, *other));
            distances.fold(f64::INFINITY, f64::min)
        };
        // Fifty pixels are a metre.
        let worst = route.iter().map(off).fold(0.0, f64::max);
        assert!(route.len() > 100 && worst < 10.0, "{} points, {worst} pixels off", route.len());
    }
}
