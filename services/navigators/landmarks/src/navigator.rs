//! The navigator that a mission selects by `kind`: its stages, and what is shown and reported about them.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::Parameters;
use sketchnav_stage::Navigator;
use toml::Table;

/// Navigation past landmarks, by landmark states (Chronis 2007) or by a belief.
pub const NAVIGATOR: Navigator = Navigator {
    methods: &crate::mission::METHODS,
    check: |mission, robot| Ok(crate::planner::check(mission, robot)?),
    check_markers: Some(|mission, markers| Ok(crate::planner::check_markers(mission, markers)?)),
    parameters: |run, _| {
        let parameters = crate::mission::Parameters::of(&run.mission)?;
        Ok(Parameters::in_force([
            (Process::Sketcher, Table::try_from(parameters.extraction)),
            (Process::Localizer, Table::try_from(parameters.localizer)),
            (Process::Planner, Table::try_from(parameters.planner)),
        ])?)
    },
    channels: crate::messages::CHANNELS,
    derived: crate::derived::DERIVED,
    lookout: Some(|run| {
        let mission = crate::mission::LandmarksMission::of(&run.mission);
        let is_by_position = mission.is_ok_and(|mission| mission.method == crate::mission::Method::Belief);
        let parameters = crate::mission::Parameters::of(&run.mission).ok().filter(|_| is_by_position);
        let by_position = parameters.map(|parameters| parameters.localizer.belief);
        Box::new(crate::lookout::Lookout::new(&run.robot, by_position))
    }),
    canvas: Some(|run, files| Ok(crate::sketcher::canvas(run, files)?)),
    drawn: Some(crate::live::DRAWN),
    doubts: Some(|run, files| Ok(crate::sketcher::doubts(run, files)?)),
    resumes_at_states: true,
    account: Some(|_| Box::new(crate::account::Account::default())),
    ..Navigator::new(
        crate::mission::KIND,
        "drives along a route that a person sketched past landmarks, or described in words",
        [
            crate::sketcher::sketcher,
            |run, _| Ok(Box::new(crate::localizer::Localizer::new(run)?)),
            |run, _| Ok(Box::new(crate::planner::Planner::new(run)?)),
        ],
    )
};
