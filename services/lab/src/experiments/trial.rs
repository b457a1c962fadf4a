//! Trials: a mission, the poses that are set after failures, and the precision with which a person marks the start.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::EvalError;
use crate::experiments::elsewhere::Elsewhere;
use crate::experiments::learned::series::{LEARNED_FILE, Series};
use crate::experiments::person::Person;
use crate::judge::homotopy::Correspondence;
use rand::RngExt;
use rand_distr::{Distribution, Normal};
use sketchnav_navigators::read_file;
use sketchnav_rehearsal::{Rehearsal, RehearsalError};
use sketchnav_schemas::codes::FREE;
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::mission::{Mission, MissionError, Start};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_schemas::seed;
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::reading::DrawnMap;

/// Returns the time limit for a task, in seconds of simulation time, given the length of the shortest path to its place. The limit
/// is generous: a robot that drives there directly never fails for lack of time, and one that searches for its path may drive five
/// times as far.
pub fn time_limit_s(shortest_way_m: f64) -> f64 {
    60.0 + 10.0 * shortest_way_m
}

/// How precisely a person marks the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartError {
    /// Standard deviation of the mark along each axis, as a share of the diagonal of the drawing.
    pub spread_share: f64,
    /// Standard deviation of the heading, in degrees.
    pub heading_deg: f64,
}

impl StartError {
    /// The errors that the sketcher expects of people (`start_spread_share` and `start_spread_deg`).
    pub const OF_PEOPLE: Self = Self { spread_share: 0.01, heading_deg: 5.0 };
}

/// A pose that is set after a failure.
#[derive(Debug, Clone, PartialEq)]
pub struct Restart {
    /// True pose of the robot.
    pub start: Start,
    /// Position of the robot that the person marks, in image pixels.
    pub marked: Option<[f64; 2]>,
    /// Heading that the person gives for the robot, in degrees.
    pub marked_heading_deg: f64,
}

/// A single experiment: a series of tasks.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Name within the suite, without spaces, for example `00/a/2-5`.
    pub name: String,
    /// The line of the table that the trial counts for, which is its drawing or whatever else the lines stand for.
    pub drawing: String,
    /// The drawing, if other drives of the suite share it, or `None` for independent trials. Drives by the same drawing mostly have
    /// the same outcome, so intervals are computed over drawings.
    pub cluster: Option<String>,
    /// World, drawing and tasks, with absolute paths.
    pub mission: Mission,
    /// The robot named by the mission.
    pub robot: Robot,
    /// The drawing and how people handle it, or `None` for other navigators.
    pub sheet: Option<Sheet>,
    /// The method of this trial, if it is driven by a particular one, whatever the methods of other trials.
    pub method: Option<String>,
    /// Whether the first contact ends the drive as a failure.
    pub ends_with_contact: bool,
    /// Whether the tasks count as one, which is reached if all of them are, and which ends with the first that is not.
    pub tasks_are_one: bool,
    /// Duration of a step of the cores in scan periods, which simulates a slow machine in real time. 0 for lockstep.
    pub thinking_scans: u32,
    /// Name of the trial that this one is a variant of. Both get the same seeds.
    pub variant_of: Option<String>,
    /// A page provided by a person, if it is not in a file. If this is `None`, the mission names the file.
    pub bytes: Option<Page>,
    /// The person who watches and answers the robot's questions. If this is `None`, the robot does not ask.
    pub person: Option<Arc<Person>>,
    /// Whether regions joined by doors are asked about the goal when a task ends.
    pub asks_rooms: bool,
    /// The simulator that runs the trial. If this is `None`, it is driven in the project's own world.
    pub elsewhere: Option<Elsewhere>,
    /// Whether the robot learns from the drive.
    pub is_learned_from: bool,
    /// The map learned on an earlier drive, which the mission names [`LEARNED_FILE`].
    pub learned: Option<Arc<[u8]>>,
    /// The series of drives that the trial is part of, if later drives depend on the first one.
    pub series: Option<Series>,
}

impl Trial {
    /// Creates a trial without a drawing, driven by the suite's method. Contacts do not end the drive, and no person watches.
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
            asks_rooms: false,
            elsewhere: None,
            is_learned_from: false,
            learned: None,
            series: None,
        }
    }
}

/// A page provided by a person that is not in a file.
#[derive(Debug, Clone)]
pub enum Page {
    /// A page given as bytes.
    Drawn(Arc<[u8]>),
    /// A page that is created once, when it is first needed. Creating it may take a drive.
    Made(Arc<Recipe>),
}

/// Instructions for creating a page.
pub struct Recipe {
    /// A description of everything that determines the page's bytes.
    words: String,
    make: Box<dyn Fn() -> Result<Arc<[u8]>, EvalError> + Send + Sync>,
    made: Mutex<Option<Arc<[u8]>>>,
}

impl Recipe {
    /// Returns true if the page has been created.
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
    /// Creates a page that `make` creates when it is needed. `words` must describe everything that determines its bytes.
    pub fn made(
        words: String,
        make: impl Fn() -> Result<Arc<[u8]>, EvalError> + Send + Sync + 'static,
    ) -> Self {
        Self::Made(Arc::new(Recipe { words, make: Box::new(make), made: Mutex::default() }))
    }

    /// Returns the bytes of the page, and creates it first if necessary.
    ///
    /// # Errors
    /// Any error from creating the page.
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

    /// Returns the data that determine the page, for use in fingerprints. This does not create the page.
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
    /// Poses to set if a task fails: after task k fails, the robot continues with task k + 1 from `restarts[k]`. If this is empty,
    /// the tasks after a failed one are driven without a new pose.
    pub restarts: Vec<Restart>,
    /// Error of every start mark, or `None` if marks are exactly as in the mission.
    pub start_error: Option<StartError>,
    /// The drawing as read by the sketcher. It is needed because people do not mark the robot inside a wall.
    pub paper: Arc<DrawnMap>,
    /// The correspondence between drawing and floor. If given, paths must also be consistent with the drawing. If `None`, any path
    /// is accepted.
    pub correspondence: Option<Arc<Correspondence>>,
}

impl Trial {
    /// Returns true if the trial is driven by the navigator `corridor`.
    pub fn is_corridor(&self) -> bool {
        self.mission.navigator.kind == sketchnav_corridor::mission::KIND
    }

    /// Returns the run of the trial that begins with `first_task`.
    ///
    /// `seed` is the seed of the repetition. If the trial has restarts, each run gets a seed derived from it.
    ///
    /// # Errors
    /// [`MissionError`] if the navigator's parameters are invalid.
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

    /// Creates the rehearsal of a run of the trial. `page` is the trial's page, if it is not in a file.
    ///
    /// # Errors
    /// [`RehearsalError`] if the run cannot start.
    pub fn rehearsal(&self, run: &RunConfig, page: Option<&[u8]>) -> Result<Rehearsal, RehearsalError> {
        Rehearsal::by(run, &|name| match (&self.learned, page) {
            (Some(learned), _) if name == LEARNED_FILE => Ok(learned.to_vec()),
            (_, Some(page)) => Ok(page.to_vec()),
            _ => read_file(name),
        })
    }
}

impl Sheet {
    /// Creates the sheet for a drawing in a file that the mission names. The start is marked once, with the errors that people
    /// make.
    pub fn new(paper: Arc<DrawnMap>) -> Self {
        let start_error = Some(StartError::OF_PEOPLE);
        Self { restarts: Vec::new(), start_error, paper, correspondence: None }
    }

    /// Marks the start of a run that begins with `first_task`, as a person would.
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

    /// Moves and turns the start mark at random. If the mark would fall into a wall, the error is drawn again, since a person would
    /// not put the robot there.
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
    /// Returns where a person would mark a point of the drawing, given draws from the standard normal distribution. The mark is
    /// near the point, with no wall in between. Returns `None` if no such position is found.
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

/// Returns true if no wall is on the straight line between two points of the drawing.
fn sees(paper: &DrawnMap, a: &Point<Sketch>, b: &Point<Sketch>) -> bool {
    let steps = (a.distance(b) * 2.0).ceil().max(1.0);
    (0..=steps as usize).all(|k| {
        let t = k as f64 / steps;
        paper.cell(&Point::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y))) == Some(FREE)
    })
}

/// Derives a separate seed for each name.
pub fn derived(seed: u64, name: &str) -> u64 {
    // Seeds have 32 bits so that they can be copied from a report by hand.
    u64::from(seed::stream(seed, name).random::<u32>())
}

/// Wraps an angle in degrees to (−180, 180].
pub(crate) fn wrap_deg(degrees: f64) -> f64 {
    sketchnav_schemas::geometry::wrap_angle(degrees.to_radians()).to_degrees()
}
