//! A navigator: the stages that a mission names.

use sketchnav_schemas::channels::{ChannelSpec, NAVIGATORS};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::floor_plan::Marker;
use sketchnav_schemas::mission::{Mission, Parameters};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::ros2::derived::Derived;
use sketchnav_schemas::run::RunConfig;

use crate::account::Account;
use crate::doubts::{Canvas, Doubts, Planned};
use crate::drawn::Drawn;
use crate::lookout::Lookout;
use crate::{Hosted, StageError};

/// Reads the files that a mission names; the path is as the mission has it.
pub type Files<'a> = dyn Fn(&str) -> std::io::Result<Vec<u8>> + 'a;

/// Makes a stage for a run.
pub type Make = fn(&RunConfig, &Files<'_>) -> Result<Box<dyn Hosted>, StageError>;

/// Makes what a page shows of a run.
pub type Watch = fn(&RunConfig) -> Box<dyn Lookout>;

/// Makes what is said of a run when it is over.
pub type Review = fn(&RunConfig) -> Box<dyn Account>;

/// Says what is doubted about the files of a run.
pub type Doubt = fn(&RunConfig, &Files<'_>) -> Result<Doubts, StageError>;

/// Finds the drawing in which a robot believes it is somewhere; `None` in a run without.
pub type FindCanvas = fn(&RunConfig, &Files<'_>) -> Result<Option<Canvas>, StageError>;

/// Checks a mission against the markers of its floor.
pub type CheckMarkers = fn(&Mission, &[Marker]) -> Result<(), StageError>;

/// Tells the parameters of a mission's stages.
pub type InForce = fn(&Mission, &Robot) -> Result<Parameters, StageError>;

/// Three stages under the name by which a mission chooses them, and all that others show and say of them.
///
/// [`Navigator::new`] has the stages; whatever else a navigator has stands before it:
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
    /// The word: `[navigator] kind = "sketch"`.
    pub kind: &'static str,
    /// What a person gives it, and what it drives by, in a sentence.
    pub about: &'static str,
    /// What its `[navigator] method` can be, the default first; none if there is nothing to choose.
    pub methods: &'static [&'static str],
    /// What it demands of mission and robot, before anything starts. The files that a mission names are the loader's:
    /// see [`Mission::navigator_files_mut`].
    pub check: fn(&Mission, &Robot) -> Result<(), StageError>,
    /// What it demands of the markers of a floor; `None` for a navigator that needs none.
    pub check_markers: Option<CheckMarkers>,
    /// Every parameter of its stages as it is in force in a mission, the defaults too.
    pub parameters: InForce,
    /// The channels that it has beside those of all navigators, see
    /// [`channels!`](sketchnav_schemas::declare::channels).
    pub channels: &'static [&'static ChannelSpec],
    /// What viewers get of its channels: topics of standard messages, see
    /// [`derived!`](sketchnav_schemas::ros2::derived::derived).
    pub derived: &'static [Derived],
    /// The stages: the sketcher takes in what a person gives, the localizer says in what situation the robot is, the
    /// planner drives.
    pub stages: [Make; 3],
    /// What a page shows of it while it drives; `None` if the robot's sensors are enough.
    pub lookout: Option<Watch>,
    /// What it makes of what people draw on that page; `None` for a navigator that they only watch.
    pub drawn: Option<Drawn>,
    /// Warnings about the mission's files, given before the start; `None` if it has none to give.
    pub doubts: Option<Doubt>,
    /// Warnings about its plan, given before the start; `None` if it plans nothing beforehand.
    pub planned: Option<Planned>,
    /// The drawing in which the robot believes it is somewhere, for the order `here`; `None` if it has none.
    pub canvas: Option<FindCanvas>,
    /// Whether an order to resume can name a state of the route, from which the robot goes on.
    pub resumes_at_states: bool,
    /// What is said of a run when it is over; `None` if what is said of every run is enough.
    pub account: Option<Review>,
}

impl Navigator {
    /// These stages, for sketcher, localizer and planner, and nothing beside.
    pub const fn new(kind: &'static str, about: &'static str, stages: [Make; 3]) -> Self {
        Self {
            kind,
            about,
            methods: &[],
            check: |_, _| Ok(()),
            check_markers: None,
            parameters: |mission, _| Ok(mission.parameters.clone()),
            channels: &[],
            derived: &[],
            stages,
            lookout: None,
            drawn: None,
            doubts: None,
            planned: None,
            canvas: None,
            resumes_at_states: false,
            account: None,
        }
    }

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
        let index = NAVIGATORS.iter().position(|host| *host == process);
        index.map(|index| self.stages[index](run, files)).transpose()
    }
}
