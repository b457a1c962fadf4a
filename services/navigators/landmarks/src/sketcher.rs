//! The sketcher stage for landmarks, which reads and checks the sketch or the words of a mission and sends
//! them once.

use serde::Serialize;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::doubts::Canvas;
use sketchnav_stage::{Files, Outbox, Stage, StageError};

use crate::drawn::DrawnMetres;
use crate::error::LandmarksError;
use crate::extraction;
use crate::instructions::Instructions;
use crate::messages::LANDMARK_ROUTE;
use crate::mission::{Given, LandmarksMission, Method, Parameters};

/// Publishes the route of a run.
pub struct Sketcher {
    cells: Vec<u8>,
    objects: u32,
    states: u32,
    length: DrawnMetres,
}

/// Reads and checks the route of a mission, given the size of the robot.
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
    let unread = |reason| LandmarksError::File { key, file: file.clone(), reason };
    let bytes = files(&file).map_err(|error| unread(error.to_string()))?;
    let robot_m = 2.0 * robot.radius_m;
    let parameters = extraction::Parameters { robot_m, ..Parameters::of(mission)?.extraction };
    let instructions = Instructions::of(&given, &bytes, &parameters);
    let instructions = instructions.map_err(|cause| LandmarksError::Input { file: file.clone(), cause })?;
    let (most, found) = (LANDMARK_ROUTE.spec.max_cells, instructions.write()?.len());
    if found > most {
        return Err(unread(format!("expected at most {most} bytes of outlines and words, found {found}")));
    }
    Ok(instructions)
}

impl Sketcher {
    /// Reads and checks the route of a run.
    ///
    /// # Errors
    /// See [`understand`].
    pub fn new(run: &RunConfig, files: &Files<'_>) -> Result<Self, LandmarksError> {
        let instructions = understand(&run.mission, &run.robot, files)?;
        let wrong = |cause| LandmarksError::Input { file: "landmark_route".into(), cause };
        let route = instructions.route().map_err(wrong)?;
        let drawn = instructions.sketch.as_ref().map(|sketch| sketch.landmarks.len());
        let told = route.as_ref().map_or(0, |route| route.objects.len());
        Ok(Self {
            cells: instructions.write()?,
            objects: drawn.unwrap_or(told) as u32,
            states: route.map_or(0, |route| route.states.len()) as u32,
            length: instructions.length(),
        })
    }
}

impl Stage for Sketcher {
    const FORM: &'static str = "landmarks sketcher 1";
    type State = ();

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.send_with(LANDMARK_ROUTE, self.cells.len(), |route, cells| {
            (route.object_count, route.state_count, route.length_m) =
                (self.objects, self.states, self.length.0);
            cells.copy_from_slice(&self.cells);
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

/// Returns the canvas of a mission's sketch, or `None` if the robot does not locate itself in it.
///
/// # Errors
/// [`LandmarksError`] if the sketch cannot be read.
pub fn canvas(mission: &Mission, files: &Files<'_>) -> Result<Option<Canvas>, LandmarksError> {
    let given = LandmarksMission::of(mission)?;
    let Given::Drawing(file, _) = given.given else { return Ok(None) };
    if given.method != Method::Belief {
        return Ok(None);
    }
    let unread = |reason| LandmarksError::File { key: "navigator.drawing", file: file.clone(), reason };
    let bytes = files(&file).map_err(|error| unread(error.to_string()))?;
    let drawing = crate::file::read(&bytes).map_err(|error| unread(error.to_string()))?;
    Ok(Some(Canvas { size_px: drawing.canvas, scale: 1.0 }))
}
