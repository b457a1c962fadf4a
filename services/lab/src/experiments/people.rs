//! The `people` suite drives by ten drawings of one environment, made by ten people. Two annotators matched places in the drawings
//! with places in the environment. The `people-exam` suite uses six more drawings by other people. Only the first suite may be used
//! to choose parameters. In the `people-answers` and `people-exam-answers` suites, a [person] watches the same drives and answers
//! the robot's questions.
//!
//! In each trial, the robot drives from one matched place to another in a different region, with the start marked as people would
//! mark it. Arrival is judged by region, since two annotators' marks in the same hall can be metres apart. Data: M. Mielle et al.,
//! *Using sketch-maps for robot navigation*, 2016 (repository sketch_map_matching).
//!
//! - [`mod@matches`] parses the annotators' files, and [`regions`] contains the rooms of the environment.

pub mod matches;
pub mod regions;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sketchnav_schemas::codes::FREE;
use sketchnav_schemas::geometry::{Point, World};
use sketchnav_schemas::mission::{Mission, NavigatorChoice, Start, Task, WorldSource};
use sketchnav_schemas::robot::Robot;
use sketchnav_sim::ros_map::OccupancyMap;
use sketchnav_sketch::mission::{Aim, SketchMission, SketchTask, WallTone};
use sketchnav_sketch::reading::{DrawnMap, Options};

use crate::error::{EvalError, read};
use crate::experiments::ground::{Ground, departure_deg, length_m};
use crate::experiments::person::{self, Person};
use crate::experiments::suite::{Datum, Folders, Suite};
use crate::experiments::trial::{Sheet, Trial, time_limit_s, wrap_deg};
use matches::{Match, Reading};
use regions::Regions;

const TITLE: &str = "Ten people's drawings of one environment; drives lead from each matched place to each one in another region, by both annotators.";
/// The map of the environment. Its folder also contains the drawings.
const DRAWINGS: Datum = Datum {
    what: "ten people's drawings of one environment (M. Mielle et al., sketch_map_matching)",
    file: "sketches/kth/world.yaml",
};
const EXAM_TITLE: &str = "Six more people's drawings of the environment of the suite `people`, which were not used to choose anything; the pairs of places are chosen alike.";
/// Drawings that may not be used to choose parameters.
const EXAM: Datum = Datum {
    what: "six more people's drawings of the same environment (M. Mielle et al., sketch_map_matching)",
    file: "sketches/kth-validation/10.png",
};
/// Distance that the robot keeps from walls at the start, in metres, in addition to its radius.
const START_CLEARANCE_M: f64 = 0.1;
/// Distance along the path, in metres, of the point that the robot faces at the start.
const LOOK_AHEAD_M: f64 = 1.0;

/// The data that all drawings of a suite share.
struct Place {
    /// The folder of the environment's map.
    folder: PathBuf,
    /// The folder of the drawings and their marks.
    drawings: PathBuf,
    map: OccupancyMap,
    ground: Ground,
    regions: Regions,
    robot: Robot,
    /// Whether a person watches and answers.
    has_onlooker: bool,
}

/// A drawing by a person.
struct AnnotatedDrawing {
    name: String,
    file: String,
    drawing: Arc<DrawnMap>,
    /// The cells of the drawing's largest free region.
    reachable: Vec<bool>,
}

/// Loads the `people` suite.
///
/// # Errors
/// [`EvalError::NoData`] if the drawings are missing, or another [`EvalError`] if a file is malformed.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    ten(folders, false)
}

/// Loads the `people-exam` suite, whose drawings may not be used to choose anything.
///
/// # Errors
/// Any error of [`suite`].
pub fn exam(folders: &Folders) -> Result<Suite, EvalError> {
    six(folders, false)
}

/// Loads the drives of [`suite`], watched by a person who answers.
///
/// # Errors
/// Any error of [`suite`].
pub fn answered(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(with_onlooker(ten(folders, true)?))
}

/// Loads the drives of [`exam`], watched by a person who answers.
///
/// # Errors
/// Any error of [`suite`].
pub fn exam_answered(folders: &Folders) -> Result<Suite, EvalError> {
    Ok(with_onlooker(six(folders, true)?))
}

fn with_onlooker(suite: Suite) -> Suite {
    let title =
        format!("{} A person watches, and answers truthfully when the robot asks where it is.", suite.title);
    Suite { title, sections: Some(person::sections), ..suite }
}

fn ten(folders: &Folders, has_onlooker: bool) -> Result<Suite, EvalError> {
    let mut suite = Suite { title: TITLE.into(), repetitions: 1, ..Suite::default() };
    let place = Place { has_onlooker, ..Place::open(&folders.datum(DRAWINGS)?)? };
    place.add_drawings(0..10, &mut suite)?;
    Ok(suite)
}

fn six(folders: &Folders, has_onlooker: bool) -> Result<Suite, EvalError> {
    let mut suite = Suite { title: EXAM_TITLE.into(), repetitions: 1, ..Suite::default() };
    let first = folders.datum(EXAM)?;
    let drawings = first.parent().map(Path::to_path_buf).unwrap_or_default();
    let place = Place { drawings, has_onlooker, ..Place::open(&folders.datum(DRAWINGS)?)? };
    place.add_drawings(10..16, &mut suite)?;
    Ok(suite)
}

impl Place {
    fn open(world: &Path) -> Result<Self, EvalError> {
        let folder = world.parent().map(Path::to_path_buf).unwrap_or_default();
        let map = sketchnav_sim::files::occupancy_map(world)?;
        let robot = sketchnav_sim::files::robot("robotino")?;
        let ground = Ground::new(&map, robot.radius_m + START_CLEARANCE_M);
        let regions = Regions::shipped()?;
        Ok(Self { drawings: folder.clone(), folder, map, ground, regions, robot, has_onlooker: false })
    }

    fn add_drawings(&self, mut numbers: Range<usize>, suite: &mut Suite) -> Result<(), EvalError> {
        numbers.try_for_each(|number| self.add_drawing(&format!("{number:02}"), suite))
    }

    fn add_drawing(&self, number: &str, suite: &mut Suite) -> Result<(), EvalError> {
        let path = self.drawings.join(format!("{number}.png"));
        let paper = AnnotatedDrawing::read(number, &path)?;
        for annotator in ["a", "b"] {
            let path = self.drawings.join(format!("{number}.annotator-{annotator}.dat"));
            let text = String::from_utf8_lossy(&read(&path)?).into_owned();
            let matches = matches::parse(&text).map_err(|error| error.in_file(&path))?;
            let reading = Reading::new(matches.into_iter().map(|m| self.in_metres(m)).collect());
            self.add_pairs(&paper, annotator, &reading, suite);
        }
        Ok(())
    }

    /// Converts the points of a match in the world to metres in the frame of the map.
    fn in_metres(&self, mut found: Match) -> Match {
        let (_, height) = self.map.raster().size();
        let (resolution, [x, y]) = (self.map.resolution_m(), self.map.origin_m());
        for point in &mut found.world {
            *point = [x + point[0] * resolution, y + (height as f64 - point[1]) * resolution];
        }
        found
    }

    fn add_pairs(&self, paper: &AnnotatedDrawing, annotator: &str, reading: &Reading, suite: &mut Suite) {
        let spots: Vec<_> = (0..reading.matches.len()).map(|i| self.spot(paper, reading, i)).collect();
        for (i, spot) in spots.iter().enumerate() {
            if spot.is_none() {
                let (drawing, number) = (&paper.name, reading.matches[i].number);
                suite.notices.push(format!(
                    "{drawing}/{annotator}: match {number} is left out: no robot can enter it"
                ));
            }
        }
        let pairs = spots.iter().flatten().flat_map(|from| spots.iter().flatten().map(move |to| (from, to)));
        let turn_deg = reading.quarter_turns_deg();
        let differ = pairs.filter(|(from, to)| !to.regions.contains(&from.regions[0]));
        let trials = differ.filter_map(|(from, to)| self.trial(paper, annotator, from, to, turn_deg));
        let matched = |spot: &Spot| {
            (Point::<World>::new(spot.world[0], spot.world[1]), paper.drawing.from_image(spot.sketch))
        };
        let person = || Arc::new(Person::new(spots.iter().flatten().map(matched)));
        let person = self.has_onlooker.then(person);
        suite.trials.extend(trials.map(|trial| Trial { person: person.clone(), ..trial }));
    }

    /// Returns the place of a match, or `None` if robots cannot enter it.
    fn spot(&self, paper: &AnnotatedDrawing, reading: &Reading, index: usize) -> Option<Spot> {
        let found = &reading.matches[index];
        let is_enterable = |at| self.regions.of(at).is_some_and(|region| self.regions.is_enterable(region));
        let (sketch, world) = reading.likeliest_pair(index, is_enterable)?;
        let region = self.regions.of(world)?;
        // The region of `world` comes first, but all of them count as the goal.
        let mut regions = vec![region];
        regions.extend(found.world.iter().filter_map(|&at| self.regions.of(at)).filter(|&r| r != region));
        let within = |at| self.regions.of(at) == Some(region);
        Some(Spot {
            number: found.number,
            world: self.ground.nearest(world, within)?,
            sketch: paper.nearest_free(sketch)?,
            regions,
        })
    }

    fn trial(
        &self,
        paper: &AnnotatedDrawing,
        annotator: &str,
        from: &Spot,
        to: &Spot,
        turn_deg: f64,
    ) -> Option<Trial> {
        let way = self.ground.way(from.world, to.world)?;
        let heading_deg = departure_deg(&way, LOOK_AHEAD_M)?;
        let name = format!("{}/{annotator}/{}-{}", paper.name, from.number, to.number);
        let start = Start { world: from.world, world_heading_deg: heading_deg };
        let task = SketchTask {
            name: format!("{} → {}", self.regions.name(from.regions[0]), self.regions.name(to.regions[0])),
            aim: Aim::Goal(to.sketch),
            time_limit_s: time_limit_s(length_m(&way)),
        };
        let sketch = SketchMission {
            method: None,
            drawing: paper.file.clone(),
            walls: WallTone::Dark,
            start: Some(from.sketch),
            start_heading_deg: Some(wrap_deg(heading_deg + turn_deg)),
            places: Default::default(),
            learned_file: None,
            tasks: Vec::new(),
        };
        let task = task.with_place(self.regions.union(&to.regions, to.world));
        let mission = self.mission(&name, start, sketch.navigator(), task);
        Some(Trial {
            sheet: Some(Sheet::new(paper.drawing.clone())),
            cluster: Some(paper.name.clone()),
            ..Trial::new(name, paper.name.clone(), mission, self.robot.clone())
        })
    }

    fn mission(&self, name: &str, start: Start, navigator: NavigatorChoice, task: Task) -> Mission {
        let map = self.folder.join("world.yaml").to_string_lossy().into_owned();
        Mission {
            name: format!("people/{name}"),
            description: TITLE.into(),
            robot: "robotino".into(),
            navigator,
            world: WorldSource { map: Some(map), ..WorldSource::default() },
            start,
            task: vec![task],
            parameters: Default::default(),
        }
    }
}

/// A matched place that can be used as a start or a goal.
struct Spot {
    /// Number of the match in the annotator's file.
    number: usize,
    /// Position of the robot, in metres: that of the mark, or the nearest position in the region where the robot fits.
    world: [f64; 2],
    /// Position of the mark in the drawing, in image pixels.
    sketch: [f64; 2],
    /// Regions that the place is matched to, beginning with that of `world`.
    regions: Vec<usize>,
}

impl AnnotatedDrawing {
    fn read(name: &str, path: &Path) -> Result<Self, EvalError> {
        let file = path.to_string_lossy().into_owned();
        let options = Options { walls: WallTone::Dark, ..Options::default() };
        let drawing = sketchnav_sketch::reading::read(&read(path)?, &file, &options)?;
        let reachable = largest_free_region(&drawing);
        Ok(Self { name: name.to_owned(), file, drawing: Arc::new(drawing), reachable })
    }

    /// Returns the nearest position that is free in the drawing and connected to most of it, because marks are imprecise.
    fn nearest_free(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        let at = self.drawing.from_image(at);
        let nearest = person::nearest_cell(&self.drawing, &at, |cell| self.reachable[cell])?;
        Some(self.drawing.to_image(&nearest))
    }
}

/// Returns the largest set of free cells that are connected through their sides.
fn largest_free_region(drawing: &DrawnMap) -> Vec<bool> {
    let width = drawing.width_px as usize;
    let mut left: Vec<bool> = drawing.cells.iter().map(|&cell| cell == FREE).collect();
    let mut largest = Vec::new();
    for seed in 0..left.len() {
        let mut found = Vec::new();
        let mut waiting = vec![seed];
        while let Some(i) = waiting.pop() {
            if !std::mem::take(&mut left[i]) {
                continue;
            }
            found.push(i);
            let column = i % width;
            waiting.extend((column > 0).then(|| i - 1));
            waiting.extend((column + 1 < width).then_some(i + 1));
            waiting.extend(i.checked_sub(width));
            waiting.extend(Some(i + width).filter(|&next| next < left.len()));
        }
        if found.len() > largest.len() {
            largest = found;
        }
    }
    let mut cells = vec![false; drawing.cells.len()];
    largest.into_iter().for_each(|i| cells[i] = true);
    cells
}
