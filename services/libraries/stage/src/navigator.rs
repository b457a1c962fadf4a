//! A navigator is the set of stages that a mission selects by name.

use sketchnav_schemas::channels::{ChannelSpec, NAVIGATORS};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::floor_plan::Marker;
use sketchnav_schemas::message::NamedPlace;
use sketchnav_schemas::mission::{Mission, Parameters};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::ros2::derived::Derived;
use sketchnav_schemas::run::RunConfig;

use crate::account::Account;
use crate::doubts::{Canvas, Doubts, Planned};
use crate::drawn::Drawn;
use crate::lookout::Lookout;
use crate::{Hosted, StageError};

/// Reads the files that a mission names, by the paths in the mission.
pub type Files<'a> = dyn Fn(&str) -> std::io::Result<Vec<u8>> + 'a;

/// Creates a stage for a run.
pub type Make = fn(&RunConfig, &Files<'_>) -> Result<Box<dyn Hosted>, StageError>;

/// Creates the view of a run that a page shows.
pub type Watch = fn(&RunConfig) -> Box<dyn Lookout>;

/// Creates the account of a finished run.
pub type Review = fn(&RunConfig) -> Box<dyn Account>;

/// Finds doubts about the files of a run.
pub type Doubt = fn(&RunConfig, &Files<'_>) -> Result<Doubts, StageError>;

/// Finds the drawing that the robot is localized in, if the run has one.
pub type FindCanvas = fn(&RunConfig, &Files<'_>) -> Result<Option<Canvas>, StageError>;

/// Finds the place that a person refers to in words, in a run that is under way.
pub type FindPlace = fn(&RunConfig, &Files<'_>, &str) -> Result<FoundPlace, StageError>;

/// A place that a person refers to.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundPlace {
    /// The place.
    pub place: NamedPlace,
    /// Which place the person's words refer to, for them to check. `None` if they are its name.
    pub resolved: Option<String>,
}

/// Checks a mission against the markers of its floor.
pub type CheckMarkers = fn(&Mission, &[Marker]) -> Result<(), StageError>;

/// Returns the value of every parameter of a run's stages.
pub type InForce = fn(&RunConfig, &Files<'_>) -> Result<Parameters, StageError>;

/// Three stages under the name that a mission selects them with, plus the functions for displaying and reporting on them.
///
/// [`Navigator::new`] takes the stages. Everything else is set by struct update syntax:
///
/// ```
/// # use sketchnav_stage::{Navigator, StageError};
/// # use sketchnav_stage::Make;
/// # const STAGE: Make = |_, _| Err(StageError::from("an example"));
/// const NAVIGATOR: Navigator = Navigator {
///     check: |_, robot| Ok(robot.odometry().map(drop)?),
///     ..Navigator::new("example", "drives as an example", [STAGE; 3])
/// };
/// assert_eq!(NAVIGATOR.kind, "example");
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Navigator {
    /// Name of the navigator in a mission, as in `[navigator] kind = "sketch"`.
    pub kind: &'static str,
    /// Describes what a person provides and how the robot navigates by it, in one sentence.
    pub about: &'static str,
    /// Possible values of `[navigator] method`, the default first. Empty if there is no choice.
    pub methods: &'static [&'static str],
    /// Checks the navigator's requirements for the mission and the robot before anything starts. The loader checks the files that a
    /// mission names, see [`Mission::navigator_files_mut`].
    pub check: fn(&Mission, &Robot) -> Result<(), StageError>,
    /// Checks the navigator's requirements for the markers of a floor. `None` if the navigator does not use markers.
    pub check_markers: Option<CheckMarkers>,
    /// Returns the value of every parameter of the stages in a run, including defaults.
    pub parameters: InForce,
    /// Channels that the navigator adds to those of all navigators, see
    /// [`channels!`](sketchnav_schemas::declare::channels).
    pub channels: &'static [&'static ChannelSpec],
    /// Topics with standard messages that are derived from the navigator's channels for viewers, see
    /// [`derived!`](sketchnav_schemas::ros2::derived::derived).
    pub derived: &'static [Derived],
    /// The stages, in the order sketcher, localizer and planner.
    pub stages: [Make; 3],
    /// Creates the view that a page shows of the navigator while it drives. `None` if the robot's sensors are
    /// enough.
    pub lookout: Option<Watch>,
    /// Interprets drawings made on that page. `None` for a navigator that people can only watch.
    pub drawn: Option<Drawn>,
    /// Finds warnings about the mission's files before the start. `None` if the navigator never has any.
    pub doubts: Option<Doubt>,
    /// Finds warnings about the navigator's plan before the start. `None` if it does not plan ahead.
    pub planned: Option<Planned>,
    /// Finds the drawing that the robot is localized in, for the order `here`. `None` if the navigator uses no drawing.
    pub canvas: Option<FindCanvas>,
    /// Finds a place that is the goal of no task, for the order `goal`. `None` if the navigator only drives to tasks.
    pub place: Option<FindPlace>,
    /// Whether an order to resume may name the state of the route to continue from.
    pub resumes_at_states: bool,
    /// Creates the navigator's report about a finished run. `None` if the general report is enough.
    pub account: Option<Review>,
}

impl Navigator {
    /// Creates a navigator with the given stages (sketcher, localizer, planner) and without any of the optional parts.
    pub const fn new(kind: &'static str, about: &'static str, stages: [Make; 3]) -> Self {
        Self {
            kind,
            about,
            methods: &[],
            check: |_, _| Ok(()),
            check_markers: None,
            parameters: |run, _| Ok(run.mission.parameters.clone()),
            channels: &[],
            derived: &[],
            stages,
            lookout: None,
            drawn: None,
            doubts: None,
            planned: None,
            canvas: None,
            place: None,
            resumes_at_states: false,
            account: None,
        }
    }

    /// Creates the stage that `process` hosts, or returns `None` if the process does not host one.
    ///
    /// # Errors
    /// Returns an error if the mission or the robot of the run lacks something that this stage needs.
    pub fn stage(
        &self,
        process: Process,
        run: &RunConfig,
        files: &Files<'_>,
    ) -> Result<Option<Box<dyn Hosted>>, StageError> {
        let index = NAVIGATORS.iter().position(|host| *host == process);
        index.map(|index| self.stages[index](run, files)).transpose()
    }
}
