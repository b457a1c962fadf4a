//! The navigators that a mission can choose from, by the word of its `[navigator] kind`.
//!
//! A program that has navigators of its own adds them by [`register`], the first thing that it does.

use std::sync::OnceLock;

use sketchnav_corridor as corridor;
use sketchnav_directions::arrival::Effort;
use sketchnav_directions::stages as directions;
use sketchnav_directions::stages::mission::{PlannerParameters, SketcherParameters};
use sketchnav_landmarks as landmarks;
use sketchnav_schemas::channels::{self, ChannelSpec, RegisterError};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::method::Method;
use sketchnav_schemas::mission::{Mission, Parameters};
use sketchnav_schemas::robot::Robot;
use sketchnav_sketch::localizer::{self, Localizer};
use sketchnav_sketch::planner::{self, Planner};
use sketchnav_sketch::reading::Options;
use sketchnav_sketch::sketcher::sketcher;
use sketchnav_stage::{Navigator, StageError};
use toml::Table;

fn in_force(
    tables: impl IntoIterator<Item = (Process, Result<Table, toml::ser::Error>)>,
) -> Result<Parameters, StageError> {
    Ok(Parameters::in_force(tables)?)
}

fn map_maker(mission: &Mission) -> Result<SketcherParameters, StageError> {
    let Effort { trials, trial_journeys, journeys } = directions::mission::effort(mission)?;
    Ok(SketcherParameters { trials, trial_journeys, journeys })
}

fn pilot(mission: &Mission, robot: &Robot) -> Result<PlannerParameters, StageError> {
    let settings = directions::mission::settings(mission, robot)?;
    Ok(PlannerParameters {
        looks: settings.looks,
        patience: settings.patience,
        most_recoveries: settings.most_recoveries,
        longest_entry_s: settings.longest_entry_s,
        gain: settings.gain,
        weight: settings.weight,
    })
}

const METHODS: [&str; 5] = [
    Method::Outline.word(),
    Method::Beam.word(),
    Method::Boniardi2015.word(),
    Method::Boniardi2015FixedScale.word(),
    Method::Behzadian2015.word(),
];

/// Navigation in drawings (Boniardi et al. 2015, 2016).
pub const SKETCH: Navigator = Navigator {
    kind: "sketch",
    about: "drives to goals and along routes that a person marks in a drawing of the place",
    methods: &METHODS,
    check: |mission, robot| {
        Options::of_mission(mission, 0)?;
        localizer::core::demanded(mission, robot)?;
        planner::core::parameters(mission)?;
        Ok(())
    },
    check_markers: None,
    parameters: |mission, robot| {
        in_force([
            (Process::Sketcher, Table::try_from(Options::of_mission(mission, 0)?.settings)),
            (Process::Localizer, Table::try_from(localizer::core::demanded(mission, robot)?.0)),
            (Process::Planner, Table::try_from(planner::core::parameters(mission)?)),
        ])
    },
    sketcher,
    localizer: |run, _| Ok(Box::new(Localizer::new(run)?)),
    planner: |run, _| Ok(Box::new(Planner::new(run)?)),
};

/// Navigation along corridors (Patil 2019), and past its limits.
pub const CORRIDOR: Navigator = Navigator {
    kind: corridor::mission::KIND,
    about: "drives along corridors by markers on their walls, by rules or through free space",
    methods: &corridor::mission::METHODS,
    check: |mission, robot| Ok(corridor::planner::check(mission, robot)?),
    check_markers: Some(|mission, markers| Ok(corridor::planner::check_markers(mission, markers)?)),
    parameters: |mission, _| {
        in_force([
            (Process::Localizer, Table::try_from(corridor::localizer::parameters(mission)?.0)),
            (Process::Planner, Table::try_from(corridor::planner::parameters(mission)?)),
        ])
    },
    sketcher: |run, files| Ok(Box::new(corridor::sketcher::Sketcher::new(run, files)?)),
    localizer: |run, _| Ok(Box::new(corridor::localizer::Localizer::new(run)?)),
    planner: |run, _| Ok(Box::new(corridor::planner::Planner::new(run)?)),
};

/// Navigation past landmarks (Chronis 2007), and by a belief.
pub const LANDMARKS: Navigator = Navigator {
    kind: landmarks::mission::KIND,
    about: "drives along a route that a person sketched past landmarks, or described in words",
    methods: &landmarks::mission::METHODS,
    check: |mission, robot| Ok(landmarks::planner::check(mission, robot)?),
    check_markers: Some(|mission, markers| Ok(landmarks::planner::check_markers(mission, markers)?)),
    parameters: |mission, _| {
        let parameters = landmarks::mission::Parameters::of(mission)?;
        in_force([
            (Process::Sketcher, Table::try_from(parameters.extraction)),
            (Process::Localizer, Table::try_from(parameters.localizer)),
            (Process::Planner, Table::try_from(parameters.planner)),
        ])
    },
    sketcher: |run, files| Ok(Box::new(landmarks::sketcher::Sketcher::new(run, files)?)),
    localizer: |run, _| Ok(Box::new(landmarks::localizer::Localizer::new(run)?)),
    planner: |run, _| Ok(Box::new(landmarks::planner::Planner::new(run)?)),
};

/// Directions from landmark to landmark (Park and Kender 1995).
pub const DIRECTIONS: Navigator = Navigator {
    kind: directions::mission::KIND,
    about: "flies over a plane of identical dots by a custom map: which landmark to seek, and how to notice a wrong one",
    methods: &directions::mission::METHODS,
    check: |mission, robot| Ok(directions::mission::check(mission, robot)?),
    check_markers: None,
    parameters: |mission, robot| {
        in_force([
            (Process::Sketcher, Table::try_from(map_maker(mission)?)),
            (Process::Planner, Table::try_from(pilot(mission, robot)?)),
        ])
    },
    sketcher: |run, files| Ok(Box::new(directions::sketcher::Sketcher::new(run, files)?)),
    localizer: |run, _| Ok(Box::new(directions::localizer::Localizer::new(run)?)),
    planner: |run, _| Ok(Box::new(directions::planner::Planner::new(run)?)),
};

/// The navigators of this project.
const NAVIGATORS: [Navigator; 4] = [SKETCH, CORRIDOR, LANDMARKS, DIRECTIONS];

static REGISTERED: OnceLock<&'static [Navigator]> = OnceLock::new();

/// No navigator has that name.
#[derive(Debug, thiserror::Error)]
#[error("navigator.kind: expected one of {known}, found {found:?}")]
pub struct UnknownNavigator {
    /// The names that there are.
    pub known: String,
    /// The mission's.
    pub found: String,
}

/// Adds foreign navigators and the channels that they have beside those of all: once, before anything else.
///
/// # Errors
/// [`RegisterError`].
pub fn register(
    navigators: &'static [Navigator],
    channels: &'static [&'static ChannelSpec],
) -> Result<(), RegisterError> {
    channels::register(navigators.iter().map(|navigator| navigator.kind), channels)?;
    REGISTERED.set(navigators).map_err(|_| RegisterError::Again)
}

/// Every navigator; registered ones come last.
pub fn all() -> impl Iterator<Item = &'static Navigator> {
    NAVIGATORS.iter().chain(*REGISTERED.get_or_init(|| &[]))
}

/// The navigator that a mission names.
///
/// # Errors
/// [`UnknownNavigator`].
pub fn of(mission: &Mission) -> Result<&'static Navigator, UnknownNavigator> {
    let found = mission.navigator_kind();
    let known = || all().map(|navigator| navigator.kind).collect::<Vec<_>>().join(", ");
    let unknown = || UnknownNavigator { known: known(), found: found.to_owned() };
    all().find(|navigator| navigator.kind == found).ok_or_else(unknown)
}

/// Reads a file as a mission names it: what stages are given at their start.
///
/// # Errors
/// As [`sketchnav_files::read`]: a file that is too large is refused before it is read.
pub fn read_file(path: &str) -> std::io::Result<Vec<u8>> {
    sketchnav_files::read(path, sketchnav_files::DRAWING)
}
