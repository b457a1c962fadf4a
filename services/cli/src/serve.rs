//! Runs one process of a system.

use std::path::PathBuf;

use anyhow::Context;
use sketchnav_pad::study::StudyError;
use sketchnav_pad::{PadError, Settings, token};
use sketchnav_recordings::sources;
use sketchnav_runtime::{HostError, Node, System};
use sketchnav_schemas::codes::Process;

use crate::args::PadSite;
use crate::failure::{Failure, Outcome};

/// Runs `process` in the system until it is asked to end. For the pad, `page` specifies where to serve the page and for which
/// study.
pub fn serve(process: Process, system: &str, page: (PadSite, Option<PathBuf>)) -> Result<Outcome, Failure> {
    let system = System::open(system).map_err(|error| Failure::Input(error.into()))?;
    let node = Node::join(system, process).map_err(|error| Failure::Other(error.into()))?;
    let served = match process {
        Process::World => serve_world(&node),
        Process::Sketcher | Process::Localizer | Process::Planner => host_stage(&node),
        Process::Recorder => sketchnav_recorder::run(&node),
        Process::Pad => serve_pad(&node, page),
        Process::Supervisor | Process::Observer => Err(anyhow::anyhow!("{process}: not a service")),
    };
    served.map_err(classify)?;
    Ok(Outcome::Success)
}

fn serve_world(node: &Node) -> anyhow::Result<()> {
    let files = sources::of_run(&node.run_config()?)?;
    sketchnav_world::run(node, &*files)
}

fn host_stage(node: &Node) -> anyhow::Result<()> {
    let run = node.run_config()?;
    let navigator = sketchnav_navigators::of(&run.mission)?;
    let files = sources::of_run(&run)?;
    let stage = navigator.stage(node.process(), &run, &sketchnav_navigators::read_from(&*files));
    let stage = stage.map_err(HostError::Stage)?;
    let mut stage = stage.with_context(|| format!("{}: hosts no stage", node.process()))?;
    Ok(sketchnav_runtime::host(node, stage.as_mut())?)
}

fn serve_pad(node: &Node, page: (PadSite, Option<PathBuf>)) -> anyhow::Result<()> {
    let settings = settings(page)?;
    let navigator = sketchnav_navigators::of(&node.run_config()?.mission)?;
    sketchnav_pad::run(node, navigator, settings)
}

fn settings((site, study): (PadSite, Option<PathBuf>)) -> Result<Settings, PadError> {
    let PadSite { port, bind, hosts, save } = site;
    Ok(Settings { bind, port, hosts, token: token::given()?, folder: save, study })
}

/// Classifies an error as bad input if a service rejected a mission, a drawing or a parameter, which the user can
/// correct.
fn classify(error: anyhow::Error) -> Failure {
    let is_input = error.chain().any(|cause| {
        cause.is::<sketchnav_sim::SimError>()
            || cause.is::<sketchnav_navigators::UnknownNavigator>()
            || matches!(cause.downcast_ref(), Some(HostError::Stage(_)))
            || cause.is::<PadError>()
            || cause.is::<StudyError>()
    });
    let is_incomplete = error.is::<sketchnav_recorder::Incomplete>();
    match (is_input, is_incomplete) {
        (true, _) => Failure::Input(error),
        (_, true) => Failure::Incomplete(error),
        _ => Failure::Other(error),
    }
}
