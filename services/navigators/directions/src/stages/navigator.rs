//! The navigator `directions`, with its stages, views and reports.

use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, Parameters};
use sketchnav_schemas::robot::Robot;
use sketchnav_stage::doubts::Doubts;
use sketchnav_stage::{Navigator, StageError};
use toml::Table;

use super::mission::{self, DirectionsMission, Method};
use super::settings::{self, PlannerParameters, SketcherParameters};
use super::{account, localizer, lookout, planner, sketcher};
use crate::arrival::Effort;
use crate::belief::policy::Policy;
use crate::custom_map::CustomMap;

/// Directions from landmark to landmark (Park and Kender 1995).
pub const NAVIGATOR: Navigator = Navigator {
    methods: &mission::METHODS,
    check: |mission, robot| Ok(mission::check(mission, robot)?),
    parameters: |run, _| {
        Ok(Parameters::in_force([
            (Process::Sketcher, Table::try_from(map_maker(&run.mission)?)),
            (Process::Planner, Table::try_from(pilot(&run.mission, &run.robot)?)),
        ])?)
    },
    channels: crate::messages::CHANNELS,
    lookout: Some(|run| {
        let read = DirectionsMission::of(&run.mission);
        let kinds = read.map(|read| read.markers.into_keys().collect()).unwrap_or_default();
        Box::new(lookout::Lookout::new(&run.robot, kinds))
    }),
    doubts: Some(|run, files| {
        // The stages themselves report unreadable files.
        let warnings = sketcher::notices(run, files).unwrap_or_default();
        Ok(Doubts { warnings, ..Doubts::default() })
    }),
    planned: Some(sketcher::PLANNED),
    account: Some(|_| Box::new(account::Account::default())),
    ..Navigator::new(
        mission::KIND,
        "flies over a plane of identical dots by a custom map: which landmark to seek, and how to notice a wrong one",
        [
            |run, files| Ok(Box::new(sketcher::Sketcher::new(run, files)?)),
            |run, _| Ok(Box::new(localizer::Localizer::new(run)?)),
            |run, _| {
                Ok(match mission::DirectionsMission::of(&run.mission)?.method {
                    Method::Belief => Box::new(planner::Planner::<Policy>::new(run)?),
                    _ => Box::new(planner::Planner::<CustomMap>::new(run)?),
                })
            },
        ],
    )
};

fn map_maker(mission: &Mission) -> Result<SketcherParameters, StageError> {
    let Effort { trials, trial_journeys, journeys } = settings::effort(mission)?;
    Ok(SketcherParameters { trials, trial_journeys, journeys })
}

fn pilot(mission: &Mission, robot: &Robot) -> Result<PlannerParameters, StageError> {
    let settings = settings::settings(mission, robot)?;
    Ok(PlannerParameters {
        looks: settings.looks,
        patience: settings.patience,
        most_recoveries: settings.most_recoveries,
        longest_entry_s: settings.longest_entry_s,
        gain: settings.gain,
        weight: settings.weight,
    })
}
