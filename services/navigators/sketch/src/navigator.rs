//! The navigator that missions select, with its stages and everything that pages, viewers and reports show
//! about them.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_stage::Navigator;
use toml::Table;

use crate::localizer::{self, Localizer};
use crate::method::Method;
use crate::mission::SketchMission;
use crate::planner::{self, Planner};
use crate::reading::Options;
use crate::sketcher;

const METHODS: [&str; 5] = [
    Method::Outline.word(),
    Method::Beam.word(),
    Method::Boniardi2015.word(),
    Method::Boniardi2015FixedScale.word(),
    Method::Behzadian2015.word(),
];

/// Navigation in drawings (Boniardi et al. 2015, 2016).
pub const NAVIGATOR: Navigator = Navigator {
    methods: &METHODS,
    check: |mission, robot| {
        Options::of_mission(mission, 0)?;
        let origin = SketchMission::of(mission)?.expected_origin();
        localizer::demanded(mission, robot, origin)?;
        planner::parameters(mission, origin)?;
        Ok(())
    },
    parameters: |run, files| {
        let (mission, origin) = (&run.mission, sketcher::origin(run, files)?);
        Ok(Parameters::in_force([
            (Process::Sketcher, Table::try_from(Options::of_mission(mission, 0)?.settings)),
            (Process::Localizer, Table::try_from(localizer::demanded(mission, &run.robot, origin)?.0)),
            (Process::Planner, Table::try_from(planner::parameters(mission, origin)?)),
        ])?)
    },
    channels: crate::messages::CHANNELS,
    derived: crate::derived::DERIVED,
    lookout: Some(|run| Box::new(crate::lookout::Lookout::new(&run.robot))),
    drawn: Some(crate::drawn::DRAWN),
    doubts: Some(|run, files| Ok(sketcher::doubts(run, files)?)),
    canvas: Some(|run, files| Ok(sketcher::canvas(run, files)?)),
    place: Some(|run, files, name| Ok(sketcher::place(run, files, name)?)),
    account: Some(|_| Box::new(crate::account::Account::default())),
    ..Navigator::new(
        crate::mission::KIND,
        "drives to goals and along routes that a person marks in a drawing of the place",
        [
            sketcher::sketcher,
            |run, _| Ok(Box::new(Localizer::new(run)?)),
            |run, _| Ok(Box::new(Planner::new(run)?)),
        ],
    )
};
