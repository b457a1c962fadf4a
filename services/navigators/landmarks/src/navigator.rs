//! The navigator that a mission selects, with its stages and everything that is shown and reported about
//! them.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_stage::Navigator;
use toml::Table;

/// Navigation past landmarks, by landmark states (Chronis 2007) or by a belief.
pub const NAVIGATOR: Navigator = Navigator {
    methods: &crate::mission::METHODS,
    check: |mission, robot| Ok(crate::planner::check(mission, robot)?),
    check_markers: Some(|mission, markers| Ok(crate::planner::check_markers(mission, markers)?)),
    parameters: |mission, _| {
        let parameters = crate::mission::Parameters::of(mission)?;
        Ok(Parameters::in_force([
            (Process::Sketcher, Table::try_from(parameters.extraction)),
            (Process::Localizer, Table::try_from(parameters.localizer)),
            (Process::Planner, Table::try_from(parameters.planner)),
        ])?)
    },
    channels: crate::messages::CHANNELS,
    derived: crate::derived::DERIVED,
    lookout: Some(|run| Box::new(crate::lookout::Lookout::new(&run.robot))),
    canvas: Some(|run, files| Ok(crate::sketcher::canvas(&run.mission, files)?)),
    resumes_at_states: true,
    account: Some(|_| Box::new(crate::account::Account::default())),
    ..Navigator::new(
        crate::mission::KIND,
        "drives along a route that a person sketched past landmarks, or described in words",
        [
            |run, files| Ok(Box::new(crate::sketcher::Sketcher::new(run, files)?)),
            |run, _| Ok(Box::new(crate::localizer::Localizer::new(run)?)),
            |run, _| Ok(Box::new(crate::planner::Planner::new(run)?)),
        ],
    )
};
