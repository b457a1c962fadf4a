//! A trial: a mission, where its poses are given again, and how well the person marks the start.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::EvalError;
use crate::experiments::person::Person;
use crate::judge::homotopy::Correspondence;
use rand::RngExt;
use rand_distr::{Distribution, Normal};
use sketchnav_schemas::codes::FREE;
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::mission::{Mission, MissionError, Start};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_schemas::seed;
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::reading::DrawnMap;

/// Time for a task, seconds of simulation, by the shortest path to its place. No robot that drives there fails for lack of time,
/// and one that searches for its path may drive five times as far.
pub fn time_limit_s(shortest_way_m: f64) -> f64 {
    60.0 + 10.0 * shortest_way_m
}

/// How far from the truth a person marks the robot's start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartError {
    /// Standard deviation of the mark along each axis, as a share of the drawing's diagonal.
    pub spread_share: f64,
    /// Standard deviation of the heading, degrees.
    pub heading_deg: f64,
}

impl StartError {
    /// What the sketcher assumes of people (its `start_spread_share` and `start_spread_deg`).
    pub const OF_PEOPLE: Self = Self { spread_share: 0.01, heading_deg: 5.0 };
}

/// A pose that is given again.
#[derive(Debug, Clone, PartialEq)]
pub struct Restart {
    /// Where the robot truly stands.
    pub start: Start,
    /// Where the person marks it, image pixels.
    pub marked: Option<[f64; 2]>,
    /// The direction in which the person says that it faces, degrees.
    pub marked_heading_deg: f64,
}

/// One experiment: tasks in a row.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Its name within the suite, without spaces: `00/a/2-5`.
    pub name: String,
    /// The line of the table that it counts for: its drawing, or whatever else the lines are about.
    pub drawing: String,
    /// Its drawing, if other drives of the suite are by the same one: they mostly end alike, and intervals are over drawings. `None`
    /// for independent trials.
    pub cluster: Option<String>,
    /// World, drawing, tasks; paths absolute.
    pub mission: Mission,
    /// The robot that the mission names.
    pub robot: Robot,
    /// The drawing and what belongs to it; `None` for the other kinds of navigators.
    pub sheet: Option<Sheet>,
    /// The method by which it is driven, regardless of the methods of other trials.
    pub method: Option<String>,
    /// Whether the first touch ends the drive as a failure.
    pub ends_with_contact: bool,
    /// Whether its tasks count as one: it is reached if all of them are, and ends with the first that is not.
    pub tasks_are_one: bool,
    /// Duration of a step of the cores in scan periods, as on a slow machine in real time. 0: lockstep.
    pub thinking_scans: u32,
    /// The trial of which this one is a variant: both get the same seeds.
    pub variant_of: Option<String>,
    /// What a person gives, if it is not in a folder; `None`: the mission names the file.
    pub bytes: Option<Page>,
    /// The person who looks on and answers the robot's questions; `None`: there is no person, and the robot asks nothing.
    pub person: Option<Arc<Person>>,
}

impl Trial {
    /// A drive without a drawing, by the suite's method. Touches do not end it, and no person looks on.
    pub fn new(name: String, line: String, mission: Mission, robot: Robot) -> Self {
        Self {
            name,
            drawing: line,
            cluster: None,
            mission,
            robot,
            sheet: None,
            method: None,
            ends_with_contact: false,
            tasks_are_one: false,
            thinking_scans: 0,
            variant_of: None,
            bytes: None,
            person: None,
        }
    }
}

/// What a person gives, if it is not in a folder.
#[derive(Debug, Clone)]
pub enum Page {
    /// Given as bytes.
    Drawn(Arc<[u8]>),
    /// Made once, when it is needed, which may take a drive.
    Made(Arc<Recipe>),
}

/// How a page is made.
pub struct Recipe {
    /// Everything that determines its bytes.
    words: String,
    make: Box<dyn Fn() -> Result<Arc<[u8]>, EvalError> + Send + Sync>,
    made: Mutex<Option<Arc<[u8]>>>,
}

impl Recipe {
    /// Whether it has been made.
    pub fn is_made(&self) -> bool {
        self.made.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }
}

impl std::fmt::Debug for Recipe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recipe").field("words", &self.words).finish_non_exhaustive()
    }
}

impl Page {
    /// A page that is made by `make`; `words` say everything that determines its bytes.
    pub fn made(
        words: String,
        make: impl Fn() -> Result<Arc<[u8]>, EvalError> + Send + Sync + 'static,
    ) -> Self {
        Self::Made(Arc::new(Recipe { words, make: Box::new(make), made: Mutex::default() }))
    }

    /// The page's bytes.
    ///
    /// # Errors
    /// What went wrong in making it.
    pub fn bytes(&self) -> Result<Arc<[u8]>, EvalError> {
        match self {
            Self::Drawn(bytes) => Ok(bytes.clone()),
            Self::Made(recipe) => {
                let mut made = recipe.made.lock().unwrap_or_else(PoisonError::into_inner);
                match &*made {
                    Some(bytes) => Ok(bytes.clone()),
                    None => Ok(made.insert((recipe.make)()?).clone()),
                }
            }
        }
    }

    /// What determines the page, for fingerprints; nothing is made for it.
    pub fn origin(&self) -> &[u8] {
        match self {
            Self::Drawn(bytes) => bytes,
            Self::Made(recipe) => recipe.words.as_bytes(),
        }
    }
}

impl From<Vec<u8>> for Page {
    fn from(bytes: Vec<u8>) -> Self {
        Self::Drawn(bytes.into())
    }
}

/// The drawing of a trial, and how people handle it.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Where the pose is given again to continue with task k + 1 if task k fails (`restarts[k]`). Empty if that is not done: the
    /// tasks after a failed one are then driven all the same.
    pub restarts: Vec<Restart>,
    /// Error of every start mark that is given; `None`: exactly as the mission says.
    pub start_error: Option<StartError>,
    /// The drawing as the sketcher reads it: a mark that falls into a wall is drawn again.
    pub paper: Arc<DrawnMap>,
    /// Which places of the drawing correspond to which places of the floor; the path must then be consistent with the drawing, too.
    /// `None` if any path will do.
    pub correspondence: Option<Arc<Correspondence>>,
}

impl Trial {
    /// Whether it is driven by the navigator `corridor`.
    pub fn is_corridor(&self) -> bool {
        self.mission.navigator.kind == sketchnav_corridor::mission::KIND
    }

    /// The run of the trial from `first_task` on.
    ///
    /// `seed` is the repetition's seed; each run of a trial with restarts gets one of its own.
    ///
    /// # Errors
    /// A method that the mission's kind of navigator does not have.
    pub fn run(&self, method: &str, seed: u64, first_task: usize) -> Result<RunConfig, MissionError> {
        let mut mission = self.mission.clone();
        mission.task.drain(..first_task);
        let method = self.method.as_deref().unwrap_or(method);
        mission.navigator.given.insert("method".to_owned(), method.into());
        let seed = if first_task == 0 { seed } else { derived(seed, &format!("eval/restart {first_task}")) };
        if let Some(sheet) = &self.sheet {
            sheet.mark(&mut mission, seed, first_task)?;
        }
        let pad = if self.person.is_some() { Pad::Watches } else { Pad::Absent };
        let method = method.to_owned();
        Ok(RunConfig { method, pad, ..RunConfig::lockstep("eval", mission, self.robot.clone(), seed) })
    }
}

impl Sheet {
    /// A drawing in a file that the mission names; poses are given once, with people's errors.
    pub fn new(paper: Arc<DrawnMap>) -> Self {
        let start_error = Some(StartError::OF_PEOPLE);
        Self { restarts: Vec::new(), start_error, paper, correspondence: None }
    }

    /// Marks the start of a run that begins with `first_task` as a person would.
    fn mark(&self, mission: &mut Mission, seed: u64, first_task: usize) -> Result<(), MissionError> {
        let mut sketch = SketchMission::of(mission)?;
        if first_task > 0 {
            let restart = &self.restarts[first_task - 1];
            mission.start = restart.start.clone();
            (sketch.start, sketch.start_heading_deg) = (restart.marked, Some(restart.marked_heading_deg));
        }
        if let Some(error) = self.start_error {
            self.disturb(&mut sketch, error, seed);
        }
        sketch.write_to(mission);
        Ok(())
    }

    /// Moves and turns the start mark. A mark that would fall into a wall is drawn again, as a person would not put the robot into
    /// one.
    fn disturb(&self, sketch: &mut SketchMission, error: StartError, seed: u64) {
        let mut rng = seed::stream(seed, "eval/start");
        let Ok(normal) = Normal::new(0.0, 1.0) else { return };
        let mut draw = || normal.sample(&mut rng);
        if let Some(heading) = &mut sketch.start_heading_deg {
            *heading = wrap_deg(*heading + error.heading_deg * draw());
        }
        let Some(at) = sketch.start else { return };
        let mark = error.mark(&self.paper, &self.paper.from_image(at), draw);
        sketch.start = Some(mark.map_or(at, |mark| self.paper.to_image(&mark)));
    }
}

impl StartError {
    /// Where a person marks a place of the drawing, by draws from the standard normal distribution: near it, with no wall in
    /// between. `None` if there is no such place.
    pub fn mark(
        &self,
        paper: &DrawnMap,
        from: &Point<Sketch>,
        mut draw: impl FnMut() -> f64,
    ) -> Option<Point<Sketch>> {
        const ATTEMPTS: usize = 100;
        let spread_px = self.spread_share * paper.diagonal_px();
        let mut marks =
            (0..ATTEMPTS).map(|_| Point::new(from.x + spread_px * draw(), from.y + spread_px * draw()));
        marks.find(|mark| sees(paper, from, mark))
    }
}

/// Whether the straight line between two points of the drawing is free.
fn sees(paper: &DrawnMap, a: &Point<Sketch>, b: &Point<Sketch>) -> bool {
    let steps = (a.distance(b) * 2.0).ceil().max(1.0);
    (0..=steps as usize).all(|k| {
        let t = k as f64 / steps;
        paper.cell(&Point::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y))) == Some(FREE)
    })
}

/// A seed of its own for everything that has a name.
pub fn derived(seed: u64, name: &str) -> u64 {
    // 32 bits can be read off a report and typed in again.
    u64::from(seed::stream(seed, name).random::<u32>())
}

/// Degrees in (−180, 180].
pub(crate) fn wrap_deg(degrees: f64) -> f64 {
    sketchnav_schemas::geometry::wrap_angle(degrees.to_radians()).to_degrees()
}
