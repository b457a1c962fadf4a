//! The part of a page about journeys by custom maps: the plane with its parkways, trajectories and journeys, how the journeys
//! ended, and the maps.

use std::path::Path;
use std::sync::Arc;

use crate::judge::directions::{JourneyVerdict, journeys};
use crate::judge::log::Log;
use crate::judge::{self, Verdict};
use crate::page;
use crate::picture::{self, PlanePicture, PlannedMap, TaskPicture};
use maud::{Markup, PreEscaped, html};
use sketchnav_directions::CustomMap;
use sketchnav_directions::description::Descriptor;
use sketchnav_directions::markers::Markers;
use sketchnav_directions::messages::Activity;
use sketchnav_directions::stages::mission::{self, DirectionsMission};
use sketchnav_directions::stages::settings;
use sketchnav_directions::stages::sketcher::{BETWEEN, maps_of};
use sketchnav_directions::stages::survey::{self, pillars};
use sketchnav_directions::transitions::{Kinds, Movement, Transitions};
use sketchnav_directions::walls::Walls;
use sketchnav_directions::{Plane, Point as Place, Window};
use sketchnav_files::{FLOOR_PLAN, Files};
use sketchnav_recordings::Recording;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::floor_plan::{FloorPlan, Wall};
use sketchnav_schemas::geometry::{Point, Pose, World};
use sketchnav_schemas::run::RunConfig;

use crate::sections::outcome;

/// Thickness of the lines that stand for the outline of a map, in metres.
const LINE_M: f64 = 0.01;
/// Number of points in time at which the window is shown.
const WINDOWS: usize = 14;

/// Returns the true dots of a run's plane, or the landmarks of a run on land, or `None` if the world has neither.
///
/// # Errors
/// Fails if a file of the world cannot be read.
pub fn dots(run: &RunConfig, files: &dyn Files) -> anyhow::Result<Option<Vec<[f64; 2]>>> {
    let world = &run.mission.world;
    if let Some(plane) = &world.plane {
        return Ok(Some(sketchnav_sim::files::plane_in(files, Path::new(plane))?.dots));
    }
    let floor = floor(run, files)?;
    Ok(floor.map(|(plan, radius_m)| pillars(&plan, radius_m).collect()))
}

/// Returns the floor of a run on land, including everything on it, and the radius of its landmarks in metres.
fn floor(run: &RunConfig, files: &dyn Files) -> anyhow::Result<Option<(FloorPlan, f64)>> {
    let world = &run.mission.world;
    let is_ours = run.mission.navigator_kind() == mission::KIND;
    let land = if is_ours { DirectionsMission::of(&run.mission)?.land } else { None };
    let Some(land) = land else { return Ok(None) };
    let mut plan: FloorPlan = match (&world.floor_plan, &world.map) {
        (Some(file), _) => toml::from_str(&files.read_to_string(Path::new(file), FLOOR_PLAN)?)?,
        (None, Some(map)) => outline(files, Path::new(map))?,
        (None, None) => return Ok(None),
    };
    plan.furniture.extend(world.furniture.iter().cloned());
    plan.marker.extend(&world.marker);
    Ok(Some((plan, land.radius_m)))
}

/// Returns the outline of a map's walls as a floor.
fn outline(files: &dyn Files, path: &Path) -> anyhow::Result<FloorPlan> {
    let map = sketchnav_sim::files::occupancy_map_in(files, path)?;
    let world = map.describe(&path.to_string_lossy())?;
    let wall = |line: [[f64; 2]; 2]| Wall { points: line.to_vec(), closed: false };
    Ok(FloorPlan {
        name: world.name,
        wall_thickness_m: LINE_M,
        wall: world.outline.into_iter().map(wall).collect(),
        door: Vec::new(),
        furniture: Vec::new(),
        person: Vec::new(),
        marker: Vec::new(),
    })
}

/// Returns the obstacles on the floor of a run other than its landmarks. A run over a plane has none.
fn walls(run: &RunConfig, files: &dyn Files) -> anyhow::Result<Arc<Walls>> {
    let Some((plan, radius_m)) = floor(run, files)? else { return Ok(Arc::default()) };
    Ok(Arc::new(survey::walls(&plan, radius_m, settings::body(&run.mission, &run.robot)?)))
}

/// Returns the verdicts on a run's journeys, or nothing if its world contains no dots or landmarks.
///
/// # Errors
/// Any error of [`dots`].
pub fn verdicts(run: &RunConfig, files: &dyn Files, log: &Log) -> anyhow::Result<Vec<JourneyVerdict>> {
    let Some(dots) = dots(run, files)? else { return Ok(Vec::new()) };
    let names: Vec<_> = run.mission.task.iter().map(|task| task.name.clone()).collect();
    let mut verdicts = journeys(log, &names, &dots);
    let kinds = kinds(run, files, &dots)?;
    for verdict in verdicts.iter_mut().filter(|_| !kinds.is_empty()) {
        verdict.kinds = verdict.attained.iter().map(|&dot| kinds[dot].clone()).collect();
    }
    Ok(verdicts)
}

/// Returns the kinds of the landmarks of a run on land, or nothing if its mission has no markers on landmarks.
fn kinds(run: &RunConfig, files: &dyn Files, dots: &[[f64; 2]]) -> anyhow::Result<Vec<String>> {
    let Some((plan, radius_m)) = floor(run, files)? else { return Ok(Vec::new()) };
    let read = DirectionsMission::of(&run.mission)?;
    let Some(camera) = settings::camera(&run.mission, &run.robot)? else { return Ok(Vec::new()) };
    let places: Vec<_> = dots.iter().map(|[x, y]| Place::new(*x, *y)).collect();
    let markers = Markers::new(camera.clone(), &places, radius_m, survey::kinds(&plan, &read))?;
    Ok((0..dots.len() as u32).map(|dot| markers.name(dot)).collect())
}

/// Returns the verdicts on the journeys in a recording, judged by the plane that it contains.
///
/// # Errors
/// Any error of [`dots`], and an error if the recorded run cannot be read.
pub fn verdicts_of(recording: &Recording, log: &Log) -> anyhow::Result<Vec<JourneyVerdict>> {
    if log.journeys.is_empty() {
        return Ok(Vec::new());
    }
    let RecordedRun { run, files } = RecordedRun::of(recording)?;
    verdicts(&run, &files, log)
}

/// Draws the plane or the land of a run with its journeys, or returns `None` if the world contains no dots or landmarks.
///
/// # Errors
/// Any error of [`dots`].
pub fn plane_picture(
    run: &RunConfig,
    files: &dyn Files,
    log: &Log,
    verdict: &Verdict,
) -> anyhow::Result<Option<String>> {
    let Some(dots) = dots(run, files)? else { return Ok(None) };
    let (window, _) = settings::sight(&run.mission, &run.robot)?;
    let walls = walls(run, files)?;
    let kinds = kinds(run, files, &dots)?;
    let words = DirectionsMission::of(&run.mission)?.planned();
    let (parkways, trajectories) = joined(log, window, &walls, &words);
    let walls: Vec<_> = walls.lines().map(|line| line.map(|at| Point::new(at.x, at.y))).collect();
    let spans = judge::spans(run.mission.task.len(), &log.status);
    let tasks: Vec<_> = (run.mission.task.iter().enumerate())
        .map(|(i, task)| TaskPicture {
            name: task.name.clone(),
            marks: Vec::new(),
            place: picture::place_outline(&task.there),
            trail: spans[i]
                .iter()
                .flat_map(|span| span.of(&log.truth))
                .map(|t| t.pose().position())
                .collect(),
            particles: Vec::new(),
            outcome: outcome(&spans[i], &verdict.tasks[i]),
        })
        .collect();
    Ok(Some(picture::plane(&PlanePicture {
        title: &format!(
            "{}, seed {}: the plane, with the true path of the window",
            run.mission.name, run.seed
        ),
        dots: &dots.iter().map(|[x, y]| Point::new(*x, *y)).collect::<Vec<_>>(),
        kinds: &kinds,
        walls: &walls,
        parkways: &parkways,
        trajectories: &trajectories,
        planned: &planned(log, run.mission.task.len()),
        ways: &ways(log),
        windows: &windows(log, window),
        tasks: &tasks,
        bar_m: window.side,
    })))
}

type Pairs = Vec<[Point<World>; 2]>;

/// Returns the parkways and trajectories between the landmarks, as the map-maker sees them.
fn joined(log: &Log, window: Window, walls: &Arc<Walls>, words: &[Descriptor]) -> (Pairs, Pairs) {
    let places = log.seen_dots.iter().map(|[x, y]| Place::new(*x, *y)).collect();
    let Ok(plane) = Plane::new(places) else {
        return (Vec::new(), Vec::new());
    };
    let plane = plane.among(walls.clone());
    let transitions = Transitions::new(&plane, window, Kinds { words, trajectories: true });
    let (mut parkways, mut trajectories) = (Vec::new(), Vec::new());
    for (from, transition) in transitions.all() {
        let pair = [from, transition.to].map(|dot| plane.dot(dot)).map(|at| Point::new(at.x, at.y));
        match transition.movement {
            Movement::Seek => parkways.push(pair),
            Movement::Forward | Movement::Backward => trajectories.push(pair),
        }
    }
    (parkways, trajectories)
}

/// Returns the custom maps of the tasks, or nothing if the recording contains none.
fn maps(log: &Log) -> Vec<CustomMap> {
    log.directions.as_deref().and_then(|text| maps_of(text).ok()).unwrap_or_default()
}

/// Returns the landmarks of each task as the map-maker sees them, and which of them lead to which others.
fn planned(log: &Log, tasks: usize) -> Vec<PlannedMap> {
    let maps = maps(log);
    let of = |task: usize| {
        let landmarks = log.itinerary.iter().flat_map(move |itinerary| itinerary.landmarks(task));
        let landmarks: Vec<Point<World>> =
            landmarks.map(|landmark| Point::new(landmark.x_m.into(), landmark.y_m.into())).collect();
        match maps.get(task) {
            Some(map) => PlannedMap::of(map, landmarks),
            None => PlannedMap { landmarks, ..PlannedMap::default() },
        }
    };
    (0..tasks).map(of).collect()
}

/// Returns the path of the window's centre, split wherever the navigator's activity changed.
fn ways(log: &Log) -> Vec<(Activity, Vec<Point<World>>)> {
    let mut ways: Vec<(Activity, Vec<Point<World>>)> = Vec::new();
    for journey in &log.journeys {
        let Some(at) = log.pose_at(journey.header.stamp_ns).map(|pose| pose.position()) else { continue };
        let activity = Activity::from_code(journey.activity).unwrap_or(Activity::Rest);
        match ways.last_mut() {
            Some((last, way)) if *last == activity => way.push(at),
            last => {
                // Each piece begins at the last point of the previous one, so that there is no gap between them.
                let before = last.and_then(|(_, way)| way.last().copied());
                ways.push((activity, before.into_iter().chain([at]).collect()));
            }
        }
    }
    ways
}

/// Returns the outline of the window at times spread evenly over the run.
fn windows(log: &Log, window: Window) -> Vec<Vec<Point<World>>> {
    if window.land.is_some() {
        // A robot on land sees in all directions, so there is no window to show.
        return Vec::new();
    }
    let step = log.truth.len().div_ceil(WINDOWS).max(1);
    let half = window.side / 2.0;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let window = |robot: Pose<World>| {
        let corner = |[x, y]: [f64; 2]| robot.compose(&Pose::<World>::new(x, y, 0.0)).position();
        corners.map(corner).to_vec()
    };
    log.truth.iter().step_by(step).map(|truth| window(truth.pose())).collect()
}

/// Returns a section about the maps and how the journeys ended. It is empty if there were no journeys.
pub fn section(run: &RunConfig, log: &Log, verdicts: &[JourneyVerdict]) -> Markup {
    if verdicts.is_empty() {
        return html! {};
    }
    let header = [
        "journey",
        "ended",
        "entries right",
        "recoveries",
        "stated probability",
        "where most simulated journeys fail",
    ];
    let planned = log.itinerary.as_ref().map(|itinerary| itinerary.journeys()).unwrap_or_default();
    let weakest = |task: usize| planned.get(task)?.weakest();
    let rows = verdicts.iter().enumerate().map(|(task, verdict)| {
        let weakest = weakest(task).unwrap_or("–".to_owned());
        row(verdict).into_iter().chain([weakest]).collect()
    });
    let (texts, read) = (log.directions.as_deref().unwrap_or_default(), maps(log));
    let between = format!("{BETWEEN}\n");
    let names: Vec<&str> = run.mission.task.iter().map(|task| task.name.as_str()).collect();
    html! {
        h2 { "Journeys" }
        (page::table(&header.map(str::to_owned), &rows.collect::<Vec<Vec<_>>>()))
        p.small {
            "Direct, recovered, unaware: at the goal, in the last case by a wrong path. Cannot locate, lost: the navigator reports that it failed. "
            "Astray: it reports that it is at the goal (Park and Kender 1995, 7.2.6)."
        }
        @if log.chart.is_empty() {
            h2 { "Custom maps" }
            @for (number, (text, name)) in texts.split(&between).zip(&names).enumerate() {
                h3 { (name) }
                pre { (text) }
                @if let Some(map) = read.get(number) { (explained(name, map)) }
            }
        } @else {
            h2 { "Belief" }
            p {
                "The navigator followed no map. It knew the positions of " (log.chart.len()) " landmarks, and chose each movement by "
                "the probability of being at each of them. The path drawn above is one that the map-maker would have planned."
            }
        }
    }
}

/// Returns a map in words and, if it branches, also as a graph.
fn explained(name: &str, map: &CustomMap) -> Markup {
    html! {
        @if map.branches() {
            div.pictures { figure { (PreEscaped(picture::map_graph("The custom map as a graph", &[(name, map)]))) } }
        }
        details {
            summary { "In words" }
            @if let Some(words) = map.around_in_words() { p { (words) } }
            ol { @for words in map.in_words() { li { (words) } } }
        }
    }
}

/// Returns the verdict as text.
fn row(verdict: &JourneyVerdict) -> [String; 5] {
    [
        verdict.task.clone(),
        verdict.kind.map_or("–", |kind| kind.word()).to_owned(),
        format!("{} of {}", verdict.right, verdict.accepted),
        verdict.recoveries.to_string(),
        verdict.stated.map_or("–".to_owned(), |stated| format!("{:.0} %", 100.0 * stated)),
    ]
}

/// Returns the figures of a recording's journeys, each with a name.
pub fn rows(verdicts: &[JourneyVerdict]) -> impl Iterator<Item = (String, String)> {
    verdicts.iter().map(|verdict| {
        let [task, ended, right, recoveries, stated] = row(verdict);
        let words = format!("{ended}; entries right: {right}; recoveries: {recoveries}; stated: {stated}");
        (format!("journey {task}"), words)
    })
}
