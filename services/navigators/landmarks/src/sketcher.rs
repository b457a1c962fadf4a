//! The sketcher for landmarks as a stage: reads the sketch or the words of a mission, checks them, and sends them once.

use serde::Serialize;
use sketchnav_schemas::channels::LANDMARK_ROUTE;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Files, Outbox, Stage, StageError};

use crate::error::LandmarksError;
use crate::extraction;
use crate::instructions::Instructions;
use crate::mission::{Given, LandmarksMission, Parameters};

/// Says the route of a run.
pub struct Sketcher {
    cells: Vec<u8>,
    objects: u32,
    states: u32,
    length_m: f64,
}

impl Sketcher {
    /// Reads and checks the route.
    ///
    /// # Errors
    /// [`LandmarksError`] with the file and the place.
    pub fn new(run: &RunConfig, files: &Files<'_>) -> Result<Self, LandmarksError> {
        let mission = LandmarksMission::of(&run.mission)?;
        let (key, file) = match &mission.given {
            Given::Drawing(file, _) => ("navigator.drawing", file.clone()),
            Given::Words(file) => ("navigator.route_file", file.clone()),
        };
        let bytes = files(&file).map_err(|error| LandmarksError::File {
            key,
            file: file.clone(),
            reason: error.to_string(),
        })?;
        let input = |cause| LandmarksError::Input { file: file.clone(), cause };
        let mut parameters = Parameters::of(&run.mission)?.extraction;
        if !run.mission.parameters.of(Process::Sketcher).contains_key("robot_m") {
            parameters = extraction::Parameters { robot_m: 2.0 * run.robot.radius_m, ..parameters };
        }
        let instructions = Instructions::of(&mission, &bytes, &parameters).map_err(input)?;
        let route = instructions.route().map_err(input)?;
        let drawn = instructions.sketch.as_ref().map(|sketch| sketch.landmarks.len());
        let told = route.as_ref().map_or(0, |route| route.objects.len());
        let cells = instructions.write()?;
        let most = LANDMARK_ROUTE.spec.max_cells;
        if cells.len() > most {
            let reason =
                format!("expected at most {most} bytes of outlines and words, found {}", cells.len());
            return Err(LandmarksError::File { key, file, reason });
        }
        Ok(Self {
            cells,
            objects: drawn.unwrap_or(told) as u32,
            states: route.map_or(0, |route| route.states.len()) as u32,
            length_m: instructions.length_m(),
        })
    }
}

impl Stage for Sketcher {
    const FORM: &'static str = "landmarks sketcher 1";
    type State = ();

    fn speak(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.send_with(LANDMARK_ROUTE, self.cells.len(), |route, cells| {
            (route.object_count, route.state_count, route.length_m) =
                (self.objects, self.states, self.length_m);
            cells.copy_from_slice(&self.cells);
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}
