//! The `landmark-isolation` suite drives by landmark states that were extracted without people's errors (Chronis 2007, 5.2.3 and
//! 5.3.1).

use serde_json::json;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::robot::OdometryNoise;
use sketchnav_sim::scenes::{At, Scene, distance};

use super::{BELIEF, FOLDER, REPETITIONS, STATES, mission, source, text, trial};
use crate::error::EvalError;
use crate::experiments::run;
use crate::experiments::suite::{Folders, Published, Suite};
use crate::experiments::trial::{Page, Trial};

/// Returns a sketch file that shows a scene without errors, with the given route.
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

/// Loads the `landmark-isolation` suite (Chronis 2007, 5.2.3 and 5.3.1).
///
/// # Errors
/// Same as [`super::scenes`].
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
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
        notices: vec!["If objects are removed, the robot should know that it is lost, and none of these runs should reach the goal.".into()],
        trials,
        lines: Some("what"),
        repetitions: REPETITIONS,
        paper: vec![published("paper: states of the true scene", 20), published("paper: routes that the robot drove", 25)],
        ..Suite::default()
    })
}

/// Returns an error-free sketch with the route of a robot that software guided along the true path, "creating an accurate path"
/// (5.2.3). The robot's odometry is exact and its only source of information, and it looks no further ahead than necessary. The
/// robot is driven only when the sketch is needed, so that listing jobs does not drive it.
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
        way.dedup_by(|a, b| distance(*a, *b) < 0.1);
        true_sketch(&scene, &way).bytes()
    }))
}

/// Gives the robot exact odometry, and makes it follow the path closely.
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
    let sure = [
        "way_sd",
        "heading_sd",
        "stretch_sd",
        "start_stretch_sd",
        "aspect_sd",
        "start_sd_m",
        "start_heading_sd",
    ];
    let parameters = &mut guided.mission.parameters;
    parameters.of_mut(Process::Localizer).insert("belief".into(), table(&sure.map(|key| (key, 0.0))));
    let close = table(&[("ahead_m", 0.4), ("avoid", 0.0)]);
    parameters.of_mut(Process::Planner).insert("belief".into(), close);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: loading the suite used to drive five missions, even if only its jobs were listed.
    #[test]
    fn loading_the_suite_of_isolated_states_drives_nothing() {
        let mut suite = suite(&Folders::of_checkout()).unwrap();
        suite.trials.retain(|trial| trial.name.starts_with("driven/"));
        let recipes: Vec<_> = suite.trials.iter().map(|trial| trial.bytes.clone().unwrap()).collect();
        assert_eq!(recipes.len(), 5);
        assert!(recipes.iter().all(|page| matches!(page, Page::Made(recipe) if !recipe.is_made())));
        // Each page has its own origin.
        assert_ne!(recipes[0].origin(), recipes[1].origin());
    }

    /// Regression test: a robot that trusted its sonars and looked 1.2 m ahead cut its turns. Its routes were therefore not the
    /// intended ones, and robots with states extracted from them got lost.
    #[test]
    fn driven_routes_are_accurate() {
        let scene = Scene::a();
        let page = driven_way(&Folders::of_checkout(), &scene, 1).unwrap();
        let page: serde_json::Value = serde_json::from_slice(&page.bytes().unwrap()).unwrap();
        let route: Vec<At> = serde_json::from_value(page["route"].clone()).unwrap();
        let wanted: serde_json::Value =
            serde_json::from_slice(&true_sketch(&scene, &scene.way).bytes().unwrap()).unwrap();
        let wanted: Vec<At> = serde_json::from_value(wanted["route"].clone()).unwrap();
        let off = |at: &At| {
            let distances = wanted.iter().map(|other| distance(*at, *other));
            distances.fold(f64::INFINITY, f64::min)
        };
        // Fifty pixels correspond to one metre.
        let worst = route.iter().map(off).fold(0.0, f64::max);
        assert!(route.len() > 100 && worst < 10.0, "{} points, {worst} pixels off", route.len());
    }
}
