//! The sketcher stage, which reads the mission's drawing, or the drawings that people send while the mission
//! runs.

use crate::messages::{Origin, ROUTE, Route, SKETCH, SketchMap};
use crate::mission::SketchMission;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{DRAWING, UNDERSTOOD};
use sketchnav_schemas::codes::DrawingKind;
use sketchnav_schemas::message::{Header, MAX_TASKS, NamedPlace, Text};
use sketchnav_schemas::mission::task_key;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::doubts::{Canvas, Doubts};
use sketchnav_stage::{Files, FoundPlace, Hosted, Incoming, Outbox, Stage, StageError};

use crate::learned::{DrawingFile, Learned};
use crate::reading::desk::{self, Change, Desk};
use crate::reading::{
    self, DrawnMap, ImageTask, Intent, Options, Places, SketchError, fill_cells, fill_sketch,
    fill_understood, read,
};
use crate::task::fill_route;

/// Notice about a robot whose start nobody has marked.
const NO_MARK: &str = "no start is marked: the robot finds out where it is";
/// Number of failed attempts after which a drawing that crashes the sketcher is refused.
const MAX_ATTEMPTS: u32 = 3;

/// Creates the sketcher of a run. It reads the pad's drawings if people draw, and the mission's drawing
/// otherwise.
///
/// # Errors
/// [`SketchError`] if a parameter is invalid, or if the drawing cannot be opened.
pub fn sketcher(run: &RunConfig, files: &Files<'_>) -> Result<Box<dyn Hosted>, StageError> {
    if run.pad.draws() {
        return Ok(Box::new(LiveSketcher { desk: Desk::new(run)?, answer: None }));
    }
    let options = Options::of_mission(&run.mission, run.seed)?;
    let mission = SketchMission::of(&run.mission)?;
    Ok(Box::new(FileSketcher { given: Given::load(&mission, files)?, mission, options }))
}

/// Reads the drawing of a run and places its start and tasks in it. The mission takes precedence over marks
/// in the drawing itself.
///
/// # Errors
/// [`SketchError`] if the drawing is missing, or if [`read`] or [`Intent::place`] rejects it.
pub fn understand(run: &RunConfig, files: &Files<'_>) -> Result<(DrawnMap, Places), SketchError> {
    let options = Options::of_mission(&run.mission, run.seed)?;
    let mission = SketchMission::of(&run.mission)?;
    Given::load(&mission, files)?.understand(&mission, &options)
}

/// The map learned before a run, with the drawing and the tasks in it.
#[derive(Debug)]
pub struct Before {
    /// The learned map.
    pub learned: Learned,
    /// The drawing that it belongs to.
    pub drawing: DrawnMap,
    /// The run's tasks, in pixels of the drawing's file.
    pub intent: Intent,
}

/// Reads the map learned before a run, or returns `None` if the run is by the drawing.
///
/// # Errors
/// Same as [`understand`].
pub fn learned_before(run: &RunConfig, files: &Files<'_>) -> Result<Option<Before>, SketchError> {
    let options = Options::of_mission(&run.mission, run.seed)?;
    let mission = SketchMission::of(&run.mission)?;
    Given::load(&mission, files)?.before(&mission, &options)
}

/// Returns warnings about a drawing before a robot drives by it. Empty if people draw while the mission runs.
///
/// # Errors
/// [`SketchError`] if the drawing cannot be read, or if [`reading::doubts::hopeless`] rejects it.
pub fn doubts(run: &RunConfig, files: &Files<'_>) -> Result<Doubts, SketchError> {
    if run.pad.draws() {
        return Ok(Doubts::default());
    }
    let options = Options::of_mission(&run.mission, run.seed)?;
    let mission = SketchMission::of(&run.mission)?;
    let given = Given::load(&mission, files)?;
    let (drawing, intent) = given.read(&mission, &options)?;
    let resolved = |(i, task): (usize, &ImageTask)| {
        Some(format!("{}.goal: {}", task_key(i + 1, &task.name), task.resolved.as_ref()?))
    };
    let mut resolved: Vec<_> = intent.tasks.iter().enumerate().filter_map(resolved).collect();
    let (drawing, places) = given.place(&mission, drawing, &intent, &options)?;
    if !mission.is_learned() && places.is_anywhere(&drawing) {
        resolved.push(NO_MARK.to_owned());
    }
    if mission.is_learned() {
        // Doubts about a hand drawing do not apply to a map made by laser.
        return Ok(Doubts { resolved, ..Doubts::default() });
    }
    let range_max_m = run.robot.laser.as_ref().map(|laser| laser.range_max_m);
    let found = reading::doubts::doubts(&drawing, &places, range_max_m);
    reading::doubts::hopeless(&drawing, &places, &found)?;
    let left_out = drawing.left_out.iter().filter(|what| !what.is_doubtful());
    let file = Path::new(&drawing.file).file_name().unwrap_or_default().display();
    Ok(Doubts {
        warnings: found.iter().map(|doubt| format!("{file}: {doubt}")).collect(),
        left_out: left_out.map(|what| format!("{file}: {what}")).collect(),
        resolved,
    })
}

/// Returns the size and the scale of the grid made from a run's drawing, or `None` if people draw while the
/// mission runs.
///
/// # Errors
/// [`SketchError`] if the drawing cannot be read.
pub fn canvas(run: &RunConfig, files: &Files<'_>) -> Result<Option<Canvas>, SketchError> {
    if run.pad.draws() {
        return Ok(None);
    }
    let (drawing, _) = understand(run, files)?;
    let size_px = [drawing.width_px, drawing.height_px].map(f64::from);
    Ok(Some(Canvas { size_px, scale: drawing.scale }))
}

/// Returns where the sketch of a run comes from. If people draw while the mission runs, this is a person's drawing, even though
/// somebody may later send the picture of a surveyed map.
///
/// # Errors
/// [`SketchError`] if the drawing cannot be read.
pub fn origin(run: &RunConfig, files: &Files<'_>) -> Result<Origin, SketchError> {
    let mission = SketchMission::of(&run.mission)?;
    if run.pad.draws() || mission.is_learned() {
        return Ok(mission.expected_origin());
    }
    let (drawing, _) =
        Given::load(&mission, files)?.read(&mission, &Options::of_mission(&run.mission, run.seed)?)?;
    Ok(drawing.kind.origin())
}

/// Finds a place that is named on a run's drawing or in its mission, or a room by its position, and checks that the robot can get
/// there.
///
/// # Errors
/// [`SketchError`] if people draw while the mission runs, if there is no such place or several, or if the robot cannot get there.
/// If there is none, the error lists the names of places and tasks.
pub fn place(run: &RunConfig, files: &Files<'_>, name: &str) -> Result<FoundPlace, SketchError> {
    if run.pad.draws() {
        return Err(SketchError::NamesOnPad { name: name.to_owned() });
    }
    let options = Options::of_mission(&run.mission, run.seed)?;
    let mission = SketchMission::of(&run.mission)?;
    let given = Given::load(&mission, files)?;
    let (drawing, mut intent) = given.read(&mission, &options)?;
    let named = ImageTask::named(name, &mission, &drawing)?;
    // As on the planner's agenda, the place follows the mission's tasks.
    intent.tasks.truncate(MAX_TASKS - 1);
    let (name, resolved) = (Text::new(&named.name), named.resolved.clone());
    intent.tasks.push(named);
    let (_, places) = given.place(&mission, drawing, &intent, &options)?;
    let place = NamedPlace { name, at: places.tasks[intent.tasks.len() - 1].end() };
    Ok(FoundPlace { place, resolved })
}

/// The contents of the files that a mission names.
struct Given {
    drawing: Vec<u8>,
    learned: Option<Vec<u8>>,
}

impl Given {
    fn load(mission: &SketchMission, files: &Files<'_>) -> Result<Self, SketchError> {
        let load = |file: &String| {
            files(file).map_err(|error| SketchError::File { file: file.clone(), reason: error.to_string() })
        };
        let learned = mission.learned_file.as_ref().map(load).transpose()?;
        Ok(Self { drawing: load(&mission.drawing)?, learned })
    }

    fn understand(
        &self,
        mission: &SketchMission,
        options: &Options,
    ) -> Result<(DrawnMap, Places), SketchError> {
        let (drawing, intent) = self.read(mission, options)?;
        self.place(mission, drawing, &intent, options)
    }

    /// Places tasks in the drawing or, if there is one, in the learned map.
    fn place(
        &self,
        mission: &SketchMission,
        drawing: DrawnMap,
        intent: &Intent,
        options: &Options,
    ) -> Result<(DrawnMap, Places), SketchError> {
        if let Some((learned, file)) = self.learned(mission)? {
            return learned.place(file, intent, options);
        }
        let places = intent.place(&drawing, &options.settings)?;
        Ok((drawing, places))
    }

    fn before(&self, mission: &SketchMission, options: &Options) -> Result<Option<Before>, SketchError> {
        let Some((learned, _)) = self.learned(mission)? else { return Ok(None) };
        let (drawing, intent) = self.read(mission, options)?;
        Ok(Some(Before { learned, drawing, intent }))
    }

    /// Reads the drawing, with the tasks in it.
    fn read(&self, mission: &SketchMission, options: &Options) -> Result<(DrawnMap, Intent), SketchError> {
        let mut drawing = read(&self.drawing, &mission.drawing, options)?;
        if let Some((learned, _)) = self.learned(mission)? {
            drawing.known_goals = learned.known_goals();
        }
        let intent = Intent::of_mission(mission, &drawing)?.or(Intent::of_marks(&drawing.marks));
        Ok((drawing, intent))
    }

    /// Reads the learned map, with the name of its file.
    fn learned<'a>(&self, mission: &'a SketchMission) -> Result<Option<(Learned, &'a str)>, SketchError> {
        let (Some(learned), Some(file)) = (&self.learned, &mission.learned_file) else { return Ok(None) };
        let learned =
            Learned::parse(learned).map_err(|reason| SketchError::Learned { file: file.clone(), reason })?;
        if !learned.drawing.is_same(&DrawingFile::of(&mission.drawing, &self.drawing)) {
            let (file, of, drawing) = (file.clone(), learned.drawing.file, mission.drawing.clone());
            return Err(SketchError::LearnedByAnother { file, of, drawing });
        }
        Ok(Some((learned, file)))
    }
}

/// Sends the sketch and the route of the mission's drawing once. It has no state: after a crash, it reads the drawing again.
struct FileSketcher {
    mission: SketchMission,
    options: Options,
    given: Given,
}

impl Stage for FileSketcher {
    const FORM: &'static str = "sketch sketcher 2";
    type State = ();

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let (drawing, places) = self.given.understand(&self.mission, &self.options)?;
        out.send_with(SKETCH, drawing.cells.len(), |map, cells| write_sketch(&drawing, &places, map, cells))?;
        out.send(ROUTE, |route: &mut Route| fill_route(&places.tasks, route))?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

fn write_sketch(drawing: &DrawnMap, places: &Places, map: &mut SketchMap, cells: &mut [u8]) {
    fill_sketch(drawing, places, map);
    fill_cells(drawing, cells);
}

/// Answers each drawing from the pad with one message, after sending the sketch and the route that follow from it.
///
/// The state contains the drawings accepted so far, which the pad no longer has, and the answer to the last
/// one. A restarted sketcher needs both.
struct LiveSketcher {
    desk: Desk,
    answer: Option<Answer>,
}

/// The answer to a drawing.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Answer {
    kind: u32,
    /// The change that the drawing made, or the reason for rejecting it.
    outcome: Result<Change, String>,
}

/// The state of the sketcher if people draw. `D` and `A` are the desk's state and the last answer, or references to them.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct State<D = desk::State, A = Option<Answer>> {
    desk: D,
    answer: A,
}

impl Stage for LiveSketcher {
    const FORM: &'static str = "sketch live sketcher 2";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        let Some(about) = message.on(DRAWING)? else { return Ok(()) };
        let read = match DrawingKind::from_code(about.kind) {
            Some(_) if message.attempts >= MAX_ATTEMPTS => {
                Err(SketchError::Fatal { attempts: message.attempts })
            }
            Some(kind) => self.desk.take(kind, message.cells()),
            None => Err(SketchError::Kind { found: about.kind }),
        };
        let outcome = read.map_err(|error| error.to_string());
        self.answer = Some(Answer { kind: about.kind, outcome });
        Ok(())
    }

    /// Sends the sketch, the route and the answer. The `source_seq` of the route identifies the sketch in which its tasks are
    /// placed.
    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(Answer { kind, outcome }) = &self.answer else { return Ok(()) };
        if let Some((drawing, places)) = self.desk.placed() {
            let length = drawing.cells.len();
            let write = |map: &mut SketchMap, cells: &mut [u8]| write_sketch(drawing, places, map, cells);
            match outcome {
                Ok(Change::Start) => drop(out.send_with(SKETCH, length, write)?),
                _ => out.repeat(SKETCH, length, write)?,
            }
            if matches!(outcome, Ok(Change::Start | Change::Tasks)) {
                let source_seq = out.last(SKETCH)?;
                out.send(ROUTE, |route: &mut Route| {
                    route.header = Header { source_seq, ..route.header };
                    fill_route(&places.tasks, route);
                })?;
            }
        }
        let (sketch_seq, route_seq) = (out.last(SKETCH)?, out.last(ROUTE)?);
        out.send(UNDERSTOOD, |answer| {
            (answer.kind, answer.sketch_seq, answer.route_seq) = (*kind, sketch_seq, route_seq);
            let words = outcome.as_ref().map(|_| self.desk.doubts()).map_err(String::as_str);
            fill_understood(self.desk.drawing(), words, answer);
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        State { desk: self.desk.state(), answer: &self.answer }
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        self.desk.restore(&state.desk)?;
        self.answer = state.answer;
        Ok(())
    }
}
