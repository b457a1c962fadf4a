//! One process of a system.

use anyhow::Context;
use sketchnav_pad::{Settings, TOKEN_VARIABLE};
use sketchnav_runtime::{HostError, Node, System};
use sketchnav_schemas::codes::Process;

use crate::args::PadSite;
use crate::failure::{Failure, Outcome};

/// Runs `process` in the system until it is asked to end.
pub fn serve(process: Process, system: &str, site: PadSite) -> Result<Outcome, Failure> {
    let system = System::open(system).map_err(|error| Failure::Input(error.into()))?;
    let node = Node::join(system, process).map_err(|error| Failure::Other(error.into()))?;
    let served = match process {
        Process::World => sketchnav_world::run(&node),
        Process::Sketcher | Process::Localizer | Process::Planner => host_stage(&node),
        Process::Recorder => sketchnav_recorder::run(&node),
        Process::Pad => sketchnav_pad::run(&node, settings(site)),
        Process::Supervisor | Process::Observer => Err(anyhow::anyhow!("{process}: not a service")),
    };
    served.map_err(classify)?;
    Ok(Outcome::Success)
}

fn host_stage(node: &Node) -> anyhow::Result<()> {
    let run = node.run_config()?;
    let navigator = sketchnav_navigators::of(&run.mission)?;
    let stage = navigator.stage(node.process(), &run, &sketchnav_navigators::read_file);
    let stage = stage.map_err(HostError::Stage)?;
    let mut stage = stage.with_context(|| format!("{}: hosts no stage", node.process()))?;
    Ok(sketchnav_runtime::host(node, stage.as_mut())?)
}

fn settings(site: PadSite) -> Settings {
    let token = std::env::var(TOKEN_VARIABLE).ok();
    Settings { bind: site.bind, port: site.port, hosts: site.hosts, token, folder: site.save }
}

/// A mission, a drawing or a parameter that a service refuses is the user's to mend.
fn classify(error: anyhow::Error) -> Failure {
    let is_input = error.chain().any(|cause| {
        cause.is::<sketchnav_sim::SimError>()
            || cause.is::<sketchnav_navigators::UnknownNavigator>()
            || matches!(cause.downcast_ref(), Some(HostError::Stage(_)))
            || cause.is::<sketchnav_pad::PadError>()
    });
    if is_input { Failure::Input(error) } else { Failure::Other(error) }
}
