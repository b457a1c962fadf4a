//! The map-maker as a stage: sees the plane as the global camera does, plans, and says the custom maps once.
//!
//! It knows the plane by a picture alone: spots, their centroids, and a perspective transform by known points (Park and
//! Kender 1995, 7.1.1). So its positions have errors of their own, and it reckons with them. A floor on land it knows by its
//! floor plan.

use std::fmt::Write;

use rand::RngExt;
use serde::Serialize;
use sketchnav_dots::camera::{Camera, Known};
use sketchnav_dots::picture;
use sketchnav_schemas::channels::{DIRECTIONS, ITINERARY};
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::message::{MAX_PLANNED, PlannedLandmark};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::seed::stream;
use sketchnav_stage::{Files, Outbox, Stage, StageError};

use super::error::DirectionsError;
use super::mission::{self, DirectionsMission, LandKeys, Source};
use crate::arrival::{Effort, Pilot, most_probable};
use crate::custom_map::CustomMap;
use crate::error::Error;
use crate::geometry::Point;
use crate::navigator::Navigator;
use crate::path::{Atlas, Measure, Start, best};
use crate::plan::Plan;
use crate::plane::{DotId, Plane};
use crate::reliability::Reliability;
use crate::transitions::Kinds;

/// The line between the maps of two tasks.
pub const BETWEEN: &str = "---";

/// All that the map-maker has made of a mission.
#[derive(Debug, Clone)]
pub struct Made {
    /// The dots as the map-maker sees them; empty where somebody has written the map.
    pub dots: Vec<Point>,
    /// The custom map of each task.
    pub maps: Vec<CustomMap>,
    /// The plan of each task; empty where somebody has written the map.
    pub plans: Vec<Plan>,
    /// The landmarks of each task that its map means, with their numbers among `dots`; of a written map by the order of its list.
    pub landmarks: Vec<Vec<(DotId, Point)>>,
}

/// Makes the custom maps of a run.
///
/// # Errors
/// [`DirectionsError`] with the file, the key or the task.
pub fn make(run: &RunConfig, files: &Files<'_>) -> Result<Made, DirectionsError> {
    let read = DirectionsMission::of(&run.mission)?;
    match &read.source {
        Source::Map { file } => written(run, &read, file, files),
        Source::Floor { file, noise_m } => {
            let plane = floor(&bytes("navigator.floor_file", file, files)?, file, read.land)?;
            let (_, sigma_m) = mission::sight(&run.mission, &run.robot)?;
            plans(run, &read, plane, noise_m.unwrap_or(sigma_m))
        }
        Source::Picture { file, calibration, noise_m } => {
            let bytes = bytes("navigator.plane_file", file, files)?;
            let (plane, spread_m) = see(&bytes, file, calibration)?;
            // Without a word of it, by how far the known points lie off. Four points always fit.
            let noise_m = noise_m.or(spread_m).unwrap_or(run.robot.view()?.noise_m);
            plans(run, &read, plane, noise_m)
        }
    }
}

fn bytes(key: &'static str, file: &str, files: &Files<'_>) -> Result<Vec<u8>, DirectionsError> {
    let wrong = |reason: std::io::Error| DirectionsError::File {
        key,
        file: file.to_owned(),
        reason: reason.to_string(),
    };
    files(file).map_err(wrong)
}

/// The map that somebody has written.
fn written(
    run: &RunConfig,
    read: &DirectionsMission,
    file: &str,
    files: &Files<'_>,
) -> Result<Made, DirectionsError> {
    let wrong = |reason: &str| DirectionsError::File {
        key: "navigator.map_file",
        file: file.to_owned(),
        reason: reason.to_owned(),
    };
    let text = String::from_utf8(bytes("navigator.map_file", file, files)?);
    let text = text.map_err(|_| wrong("expected UTF-8, found other bytes"))?;
    let in_file = |cause| DirectionsError::Map { file: file.to_owned(), cause };
    let map: CustomMap = text.parse().map_err(in_file)?;
    Navigator::new(mission::settings(&run.mission, &run.robot)?, map.clone()).map_err(in_file)?;
    if !read.landmarks.is_empty() && read.landmarks.len() != map.entries().len() {
        let (entries, found) = (map.entries().len(), read.landmarks.len());
        let reason =
            format!("expected one of the task's landmarks for each of its {entries} entries, found {found}");
        return Err(wrong(&reason));
    }
    let landmarks = vec![(0..).zip(read.landmarks.iter().copied()).collect()];
    Ok(Made { dots: Vec::new(), maps: vec![map], plans: Vec::new(), landmarks })
}

/// The landmarks on a floor.
fn floor(bytes: &[u8], file: &str, land: Option<LandKeys>) -> Result<Plane, DirectionsError> {
    let wrong =
        |reason: String| DirectionsError::File { key: "navigator.floor_file", file: file.to_owned(), reason };
    let text =
        std::str::from_utf8(bytes).map_err(|_| wrong("expected UTF-8, found other bytes".to_owned()))?;
    let plan: FloorPlan = toml::from_str(text).map_err(|error| wrong(error.message().to_owned()))?;
    let radius_m = land.map_or(0.0, |land| land.radius_m);
    let places: Vec<_> = pillars(&plan, radius_m).map(|[x, y]| Point::new(x, y)).collect();
    if places.is_empty() {
        return Err(wrong(format!("expected round furniture with a radius of {radius_m} m, found none")));
    }
    Plane::new(places).map_err(|cause| DirectionsError::Map { file: file.to_owned(), cause })
}

/// The landmarks of a floor: its round furniture of this radius, within a tenth.
pub fn pillars(plan: &FloorPlan, radius_m: f64) -> impl Iterator<Item = [f64; 2]> + '_ {
    let is_landmark = move |own: f64| (own - radius_m).abs() <= 0.1 * radius_m;
    plan.furniture
        .iter()
        .filter(move |piece| piece.radius_m.is_some_and(is_landmark))
        .filter_map(|piece| piece.center)
}

/// The plane in a picture, and the error of a position where the known points tell it, metres.
fn see(bytes: &[u8], file: &str, known: &[Known]) -> Result<(Plane, Option<f64>), DirectionsError> {
    let in_picture = |cause| DirectionsError::Picture { file: file.to_owned(), cause };
    let camera = Camera::calibrated(known).map_err(DirectionsError::Calibration)?;
    let (spots, _) = picture::read(bytes).map_err(in_picture)?;
    let places = spots.iter().map(|spot| camera.place(spot.at).map(|[x, y]| Point::new(x, y)));
    let places = places.collect::<Result<_, _>>().map_err(in_picture)?;
    let plane = Plane::new(places).map_err(|cause| DirectionsError::Map { file: file.to_owned(), cause })?;
    Ok((plane, camera.spread(known)))
}

fn plans(
    run: &RunConfig,
    read: &DirectionsMission,
    plane: Plane,
    map_noise_m: f64,
) -> Result<Made, DirectionsError> {
    let pilot = mission::pilot(&run.mission, &run.robot, map_noise_m)?;
    let words = read.planned();
    let kinds = Kinds { words: &words, trajectories: true };
    let atlas = Atlas::new(plane, pilot.settings.window, kinds, Reliability::fitted(pilot.noise));
    let maker = Maker { atlas: &atlas, read, pilot, effort: mission::effort(&run.mission)?, seed: run.seed };
    let [x, y] = run.mission.start.world;
    let (mut plans, mut before) = (Vec::new(), None);
    for (index, &goal) in read.goals.iter().enumerate() {
        let plan = maker.plan(index, before, Point::new(x, y), goal);
        let plan = plan.map_err(|cause| in_task(&run.mission, index, cause))?;
        before = plan.landmarks().last().copied();
        plans.push(plan);
    }
    let landmarks = plans
        .iter()
        .map(|plan| plan.landmarks().into_iter().map(|dot| (dot, atlas.plane.dot(dot))).collect());
    Ok(Made {
        landmarks: landmarks.collect(),
        maps: plans.iter().map(|plan| plan.map.clone()).collect(),
        dots: atlas.plane.dots().to_vec(),
        plans,
    })
}

fn in_task(mission: &Mission, index: usize, cause: Error) -> DirectionsError {
    DirectionsError::Plan { number: index + 1, name: mission.task[index].name.clone(), cause }
}

struct Maker<'a> {
    atlas: &'a Atlas,
    read: &'a DirectionsMission,
    pilot: Pilot,
    effort: Effort,
    seed: u64,
}

impl Maker<'_> {
    /// The plan of a task. It begins over the goal of the one before, the first one at the mission's start.
    fn plan(&self, index: usize, before: Option<DotId>, start: Point, goal: Point) -> Result<Plan, Error> {
        let Self { atlas, read, pilot, effort, seed } = self;
        let start = match before {
            Some(dot) => Start::at_goal(atlas, dot)?,
            None => Start::at(&atlas.plane, atlas.window, start)?,
        };
        // The dot that a window over the goal would show nearest to its middle.
        let goal = Start::at(&atlas.plane, atlas.window, goal).map_err(no_goal)?.landmark;
        match read.method.objective() {
            Some(objective) => {
                let path = best(atlas, start, goal, Measure::Windows, objective)?;
                Plan::new(atlas, path, read.verify)
            }
            None => most_probable(atlas, start, goal, pilot, *effort, own_seed(*seed, index)),
        }
    }
}

/// The seed of a task's simulations.
fn own_seed(seed: u64, task: usize) -> u64 {
    stream(seed, &format!("sketcher/arrival/{task}")).random()
}

fn no_goal(cause: Error) -> Error {
    match cause {
        Error::NothingInView { x, y } => Error::NoGoal { x, y },
        other => other,
    }
}

/// Says the custom maps of a run.
pub struct Sketcher {
    made: Made,
    text: String,
}

impl Sketcher {
    /// Makes them.
    ///
    /// # Errors
    /// [`DirectionsError`] with the file, the key or the task.
    pub fn new(run: &RunConfig, files: &Files<'_>) -> Result<Self, DirectionsError> {
        let made = make(run, files)?;
        let found = made.maps.iter().map(|map| map.entries().len()).sum();
        if found > MAX_PLANNED {
            return Err(DirectionsError::TooLong { limit: MAX_PLANNED, found });
        }
        Ok(Self { text: text(&made.maps), made })
    }
}

/// The maps in the text of several.
///
/// # Errors
/// [`Error`] for a text that is no map, with the line within its map.
pub fn maps_of(text: &str) -> Result<Vec<CustomMap>, Error> {
    let lines: Vec<&str> = text.lines().collect();
    lines.split(|line| line.trim() == BETWEEN).map(|lines| lines.join("\n").parse()).collect()
}

/// The maps as one text.
fn text(maps: &[CustomMap]) -> String {
    let mut text = String::new();
    for (index, map) in maps.iter().enumerate() {
        let between = if index == 0 { String::new() } else { format!("{BETWEEN}\n") };
        // Writing to a string never fails.
        let _ = write!(text, "{between}{map}");
    }
    text
}

impl Stage for Sketcher {
    const FORM: &'static str = "directions sketcher 1";
    type State = ();

    fn speak(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Self { made, text } = self;
        out.send_with(DIRECTIONS, text.len(), |directions, cells| {
            directions.map_count = made.maps.len() as u32;
            cells.copy_from_slice(text.as_bytes());
        })?;
        let landmarks = (0..).zip(&made.landmarks);
        let landmarks = landmarks.flat_map(|(task, all)| all.iter().map(move |&(dot, at)| (task, dot, at)));
        out.send_with(ITINERARY, 8 * made.dots.len(), |itinerary, cells| {
            itinerary.journey_count = made.maps.len() as u32;
            for (index, journey) in itinerary.journeys.iter_mut().take(made.maps.len()).enumerate() {
                let plan = made.plans.get(index);
                journey.distance_m = plan.map_or(0.0, |plan| plan.path.distance);
                journey.probability = plan.and_then(|plan| plan.probability).unwrap_or(-1.0);
            }
            for (place, (task, dot, at)) in itinerary.landmarks.iter_mut().zip(landmarks) {
                *place = PlannedLandmark { task, dot, x_m: at.x as f32, y_m: at.y as f32 };
                itinerary.landmark_count += 1;
            }
            for (cell, dot) in cells.chunks_exact_mut(8).zip(&made.dots) {
                cell[..4].copy_from_slice(&(dot.x as f32).to_le_bytes());
                cell[4..].copy_from_slice(&(dot.y as f32).to_le_bytes());
            }
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// The dots behind an itinerary: as the map-maker sees them.
pub fn dots_of(cells: &[u8]) -> impl Iterator<Item = Point> + '_ {
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap_or_default()));
    cells.chunks_exact(8).map(move |cell| Point::new(number(&cell[..4]), number(&cell[4..])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 320 × 100 pixels of 2.5 mm, with a dark square for each dot: column and row of its middle.
    fn picture(dots: &[[usize; 2]]) -> Vec<u8> {
        let is_dark = |column: usize, row: usize| {
            dots.iter().any(|dot| column.abs_diff(dot[0]) <= 2 && row.abs_diff(dot[1]) <= 2)
        };
        let mut text = "P2 320 100 255\n".to_owned();
        for row in 0..100 {
            for column in 0..320 {
                text.push_str(if is_dark(column, row) { "10 " } else { "245 " });
            }
            text.push('\n');
        }
        text.into_bytes()
    }

    fn made(dots: &[[usize; 2]], goal: [f64; 2]) -> Result<Made, DirectionsError> {
        let mission = format!(
            "name='m'\nrobot='helicopter'\nworld={{plane='p.toml'}}\nstart={{world=[0.1,0.1],world_heading_deg=0}}\n\
             [navigator]\nkind='directions'\nplane_file='p.png'\n\
             calibration=[[0,0,0,0.25],[320,0,0.8,0.25],[0,100,0,0],[320,100,0.8,0]]\n\
             [[task]]\nname='over'\ngoal={goal:?}\n"
        );
        let robot = sketchnav_sim::robots::find("helicopter").unwrap().unwrap();
        let run = RunConfig::lockstep("test", Mission::parse(&mission).unwrap(), robot, 1);
        make(&run, &|_| Ok(picture(dots)))
    }

    /// Two pairs, and no line of one pair leads to the other.
    const APART: [[usize; 2]; 4] = [[40, 60], [60, 40], [280, 60], [280, 36]];

    #[test]
    fn a_goal_that_no_path_reaches_is_named_with_what_would_join_it() {
        let error = made(&APART, [0.7, 0.16]).unwrap_err().to_string();
        assert!(error.starts_with("task 1 (over): no path from dot "), "{error}");
        assert!(
            error.contains(": 2 dots are reached from the start, 2 reach the goal. A path would have to"),
            "{error}"
        );
        let made = made(&APART, [0.15, 0.15]).unwrap();
        assert_eq!(made.maps[0].entries().len(), 2, "{}", made.maps[0]);
    }
}
