//! A navigator: the stages that a mission names.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::floor_plan::Marker;
use sketchnav_schemas::mission::{Mission, Parameters};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;

use crate::{Hosted, StageError};

/// Reads the files that a mission names; the path is as the mission has it.
pub type Files<'a> = dyn Fn(&str) -> std::io::Result<Vec<u8>> + 'a;

/// Makes a stage for a run.
pub type Make = fn(&RunConfig, &Files<'_>) -> Result<Box<dyn Hosted>, StageError>;

/// Checks a mission against the markers of its floor.
pub type CheckMarkers = fn(&Mission, &[Marker]) -> Result<(), StageError>;

/// Tells the parameters of a mission's stages.
pub type InForce = fn(&Mission, &Robot) -> Result<Parameters, StageError>;

/// Three stages under the name by which a mission chooses them.
#[derive(Debug, Clone, Copy)]
pub struct Navigator {
    /// The word: `[navigator] kind = "sketch"`.
    pub kind: &'static str,
    /// What a person gives it, and what it drives by, in a sentence.
    pub about: &'static str,
    /// What its `[navigator] method` can be, the default first; none where there is nothing to choose.
    pub methods: &'static [&'static str],
    /// What it demands of mission and robot, before anything starts. The files that a mission names are the loader's:
    /// see [`Mission::navigator_files_mut`].
    pub check: fn(&Mission, &Robot) -> Result<(), StageError>,
    /// What it demands of the markers of a floor; `None` for a navigator that needs none.
    pub check_markers: Option<CheckMarkers>,
    /// Every parameter of its stages as it is in force in a mission, the defaults too.
    pub parameters: InForce,
    /// Takes in what a person gives.
    pub sketcher: Make,
    /// Says in what situation the robot is.
    pub localizer: Make,
    /// Drives.
    pub planner: Make,
}

impl Navigator {
    /// The stage that `process` hosts; `None` for a process that hosts none.
    ///
    /// # Errors
    /// What the run's mission or robot lacks for it.
    pub fn stage(
        &self,
        process: Process,
        run: &RunConfig,
        files: &Files<'_>,
    ) -> Result<Option<Box<dyn Hosted>>, StageError> {
        let make = match process {
            Process::Sketcher => self.sketcher,
            Process::Localizer => self.localizer,
            Process::Planner => self.planner,
            _ => return Ok(None),
        };
        make(run, files).map(Some)
    }
}
