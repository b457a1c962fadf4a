//! One process of a system.

use sketchnav_pad::{Settings, TOKEN_VARIABLE};
use sketchnav_runtime::{Node, System};
use sketchnav_schemas::codes::Process;

use crate::args::PadSite;
use crate::failure::{Failure, Outcome};

/// Runs `process` in the system until it is asked to end.
pub fn serve(process: Process, system: &str, site: PadSite) -> Result<Outcome, Failure> {
    let system = System::open(system).map_err(|error| Failure::Input(error.into()))?;
    let node = Node::join(system, process).map_err(|error| Failure::Other(error.into()))?;
    let served = match process {
        Process::World => sketchnav_world::run(&node),
        Process::Sketcher => sketchnav_sketcher::run(&node),
        Process::Localizer => sketchnav_localizer::run(&node),
        Process::Planner => sketchnav_planner::run(&node),
        Process::Recorder => sketchnav_recorder::run(&node),
        Process::Pad => sketchnav_pad::run(&node, settings(site)),
        Process::Supervisor | Process::Observer => Err(anyhow::anyhow!("{process}: not a service")),
    };
    served.map_err(classify)?;
    Ok(Outcome::Success)
}

fn settings(site: PadSite) -> Settings {
    let token = std::env::var(TOKEN_VARIABLE).ok();
    Settings { bind: site.bind, port: site.port, token, folder: site.save }
}

/// A mission, a drawing or a parameter that a service refuses is the user's to mend.
fn classify(error: anyhow::Error) -> Failure {
    let is_input = error.chain().any(|cause| {
        cause.is::<sketchnav_sim::SimError>()
            || cause.is::<sketchnav_sketcher::SketchError>()
            || cause.is::<sketchnav_localizer::core::CoreError>()
            || cause.is::<sketchnav_planner::core::PlannerError>()
            || cause.is::<sketchnav_pad::PadError>()
    });
    if is_input { Failure::Input(error) } else { Failure::Other(error) }
}
