//! The navigator that a mission selects by `kind`: its stages, and what is shown and reported about them.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_stage::Navigator;
use toml::Table;

/// Navigation along corridors (Patil 2019), with this project's own extensions.
pub const NAVIGATOR: Navigator = Navigator {
    methods: &crate::mission::METHODS,
    check: |mission, robot| Ok(crate::planner::check(mission, robot)?),
    check_markers: Some(|mission, markers| Ok(crate::planner::check_markers(mission, markers)?)),
    parameters: |run, _| {
        let mission = &run.mission;
        Ok(Parameters::in_force([
            (Process::Localizer, Table::try_from(crate::localizer::parameters(mission)?)),
            (Process::Planner, Table::try_from(crate::planner::parameters(mission)?)),
        ])?)
    },
    channels: crate::messages::CHANNELS,
    derived: crate::derived::DERIVED,
    lookout: Some(|run| Box::new(crate::lookout::Lookout::new(&run.robot))),
    account: Some(|_| Box::new(crate::account::Account::default())),
    ..Navigator::new(
        crate::mission::KIND,
        "drives along corridors by markers on their walls, by rules or through free space",
        [
            |run, files| Ok(Box::new(crate::sketcher::Sketcher::new(run, files)?)),
            |run, _| Ok(Box::new(crate::localizer::Localizer::new(run)?)),
            |run, _| Ok(Box::new(crate::planner::Planner::new(run)?)),
        ],
    )
};
