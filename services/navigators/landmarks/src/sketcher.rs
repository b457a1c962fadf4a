//! The sketcher stage of `landmarks`, which reads and checks the sketch or the words of a mission and sends them once. If people
//! draw while the mission runs, [`crate::live`] replaces it.

use std::path::Path;

use serde::Serialize;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::doubts::{Canvas, Doubts};
use sketchnav_stage::{Files, Hosted, Outbox, Stage, StageError};

use crate::doubts::{self, Doubt};
use crate::drawn::DrawnMetres;
use crate::error::LandmarksError;
use crate::extraction;
use crate::instructions::Instructions;
use crate::live::LiveSketcher;
use crate::messages::{LANDMARK_ROUTE, LandmarkRoute};
use crate::mission::{Given, LandmarksMission, Method, Parameters};

/// Reads and checks the route of a mission for a robot, whose size the extraction of states depends on.
///
/// # Errors
/// [`LandmarksError`], which names the file and the place of the fault.
pub fn understand(
    mission: &Mission,
    robot: &Robot,
    files: &Files<'_>,
) -> Result<Instructions, LandmarksError> {
    let given = LandmarksMission::of(mission)?;
    let (key, file) = match &given.given {
        Given::Drawing(file, _) => ("navigator.drawing", file.clone()),
        Given::Words(file) => ("navigator.route_file", file.clone()),
    };
    let unread =
        |error: std::io::Error| LandmarksError::File { key, file: file.clone(), reason: error.to_string() };
    let bytes = files(&file).map_err(unread)?;
    let parameters = extraction_of(&Parameters::of(mission)?, robot);
    let instructions = Instructions::of(&given, &bytes, &parameters);
    let instructions = instructions.map_err(|cause| LandmarksError::Input { file: file.clone(), cause })?;
    Ok(instructions)
}

/// Returns the parameters of extraction for a robot of the given size.
pub(crate) fn extraction_of(parameters: &Parameters, robot: &Robot) -> extraction::Parameters {
    extraction::Parameters { robot_m: 2.0 * robot.radius_m, ..parameters.extraction.clone() }
}

/// Creates the sketcher of a run, which reads drawings from the pad if people draw, and the mission's sketch otherwise.
///
/// # Errors
/// See [`understand`].
pub fn sketcher(run: &RunConfig, files: &Files<'_>) -> Result<Box<dyn Hosted>, StageError> {
    if run.pad.draws() {
        return Ok(Box::new(LiveSketcher::new(run)?));
    }
    Ok(Box::new(Sketcher(Announced::of(&understand(&run.mission, &run.robot, files)?)?)))
}

/// Returns the warnings about a sketch or a route in words that a person should read before a robot drives by it. If people draw
/// while the mission runs, there are none yet.
///
/// # Errors
/// See [`understand`], and [`LandmarksError::Instructions`] if the sketch has too many points to be sent.
pub fn doubts(run: &RunConfig, files: &Files<'_>) -> Result<Doubts, LandmarksError> {
    if run.pad.draws() {
        return Ok(Doubts::default());
    }
    let mission = LandmarksMission::of(&run.mission)?;
    let instructions = understand(&run.mission, &run.robot, files)?;
    // Report instructions that are too large to be sent before the run starts, too.
    Announced::of(&instructions)?;
    let found = doubts_about(run, &instructions)?;
    let file = Path::new(mission.given.file()).file_name().unwrap_or_default().display();
    let warnings = found.iter().map(|doubt| format!("{file}: {doubt}")).collect();
    Ok(Doubts { warnings, ..Doubts::default() })
}

/// Returns the doubts about the instructions of a run.
///
/// # Errors
/// [`LandmarksError`] if the mission or a parameter is invalid.
pub fn doubts_about(run: &RunConfig, instructions: &Instructions) -> Result<Vec<Doubt>, LandmarksError> {
    let (mission, parameters) = (LandmarksMission::of(&run.mission)?, Parameters::of(&run.mission)?);
    let extraction = extraction_of(&parameters, &run.robot);
    Ok(doubts::of(instructions, &mission, &parameters, &extraction))
}

/// Instructions in the form in which they are sent.
pub(crate) struct Announced {
    pub(crate) cells: Vec<u8>,
    objects: u32,
    states: u32,
    length: DrawnMetres,
}

impl Announced {
    pub(crate) fn of(instructions: &Instructions) -> Result<Self, LandmarksError> {
        let wrong = |cause| LandmarksError::Input { file: "landmark_route".into(), cause };
        let route = instructions.route().map_err(wrong)?;
        let drawn = instructions.sketch.as_ref().map(|sketch| sketch.landmarks.len());
        let told = route.as_ref().map_or(0, |route| route.objects.len());
        let cells = instructions.write()?;
        let (most, found) = (LANDMARK_ROUTE.spec.max_cells, cells.len());
        if found > most {
            let expected = format!("expected at most {most} bytes of outlines and words, found {found}");
            return Err(LandmarksError::Instructions(expected));
        }
        Ok(Self {
            cells,
            objects: drawn.unwrap_or(told) as u32,
            states: route.map_or(0, |route| route.states.len()) as u32,
            length: instructions.length(),
        })
    }

    fn fill(&self, route: &mut LandmarkRoute, cells: &mut [u8]) {
        (route.object_count, route.state_count, route.length_m) = (self.objects, self.states, self.length.0);
        cells.copy_from_slice(&self.cells);
    }

    pub(crate) fn send(&self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.send_with(LANDMARK_ROUTE, self.cells.len(), |route, cells| self.fill(route, cells)).map(drop)
    }

    /// Sends the last instructions again if the process is resuming.
    pub(crate) fn repeat(&self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.repeat(LANDMARK_ROUTE, self.cells.len(), |route, cells| self.fill(route, cells))
    }
}

/// Sketcher that sends the route of a mission once.
struct Sketcher(Announced);

impl Stage for Sketcher {
    const FORM: &'static str = "landmarks sketcher 1";
    type State = ();

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        self.0.send(out)
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// Returns the canvas of a run's sketch, or `None` if the robot does not locate itself in the sketch or if people draw while the
/// mission runs.
///
/// # Errors
/// [`LandmarksError`] if the sketch cannot be read.
pub fn canvas(run: &RunConfig, files: &Files<'_>) -> Result<Option<Canvas>, LandmarksError> {
    let given = LandmarksMission::of(&run.mission)?;
    let Given::Drawing(file, _) = given.given else { return Ok(None) };
    if given.method != Method::Belief || run.pad.draws() {
        return Ok(None);
    }
    let unread = |reason| LandmarksError::File { key: "navigator.drawing", file: file.clone(), reason };
    let bytes = files(&file).map_err(|error| unread(error.to_string()))?;
    let drawing = crate::file::read(&bytes).map_err(|error| unread(error.to_string()))?;
    Ok(Some(Canvas { size_px: drawing.canvas, scale: 1.0 }))
}
