//! Turns the options of `sketchnav run` and `sketchnav pad` into a configured run and the command lines of its
//! processes.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow};
use sketchnav_files::FAULT_PLAN;
use sketchnav_schemas::channels::SERVICES;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::fault_plan::FaultPlan;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pace, Pad, RunConfig};
use sketchnav_supervisor::{Error as SystemError, Grace, ProcessLine};

use crate::args::SystemOptions;
use crate::failure::{Failure, OrInput};
use crate::folder::plain_name;
use crate::link::Link;
use crate::output::say;

/// Reads a mission and its robot, and checks the requirements of its navigator. A method given on the command
/// line takes precedence over the mission's.
///
/// # Errors
/// If a file or a value in it is invalid. The error names the file, the key, and what was expected.
pub fn load(path: &Path, options: &SystemOptions) -> Result<(Mission, Robot), Failure> {
    let (mut mission, robot) = sketchnav_sim::mission_file::load(path).or_input()?;
    if let Some(method) = &options.method {
        mission.navigator.given.insert("method".to_owned(), method.as_str().into());
    }
    check(&mission, &robot).map_err(|error| anyhow!("{}: {error}", path.display())).or_input()?;
    Ok((mission, robot))
}

/// Changes the mission so that it is driven in the learned map `learned`.
///
/// # Errors
/// If the path is not UTF-8, or if the mission's navigator or method does not support learned maps.
pub fn drive_in_learned(learned: &Path, mission: &mut Mission, robot: &Robot) -> Result<(), Failure> {
    let named = || learned.display().to_string();
    let path = std::path::absolute(learned).with_context(named).or_input()?.into_os_string().into_string();
    let path = path.map_err(|_| anyhow!("{}: expected a path in UTF-8", named())).or_input()?;
    mission.navigator.given.insert("learned_file".to_owned(), path.into());
    check(mission, robot).map_err(|error| anyhow!("--learned: {error}")).or_input()
}

/// Checks the requirements of the mission's navigator for the mission, the robot and the world's markers.
fn check(mission: &Mission, robot: &Robot) -> Result<(), Box<dyn Error + Send + Sync>> {
    let navigator = sketchnav_navigators::of(mission)?;
    (navigator.check)(mission, robot)?;
    match navigator.check_markers {
        Some(check) => check(mission, &sketchnav_sim::files::world(&mission.world)?.markers),
        None => Ok(()),
    }
}

/// Configures a run of `mission` with `robot`, to be recorded in `folder`.
///
/// # Errors
/// If the folder's path is not UTF-8.
pub fn configure(
    options: &SystemOptions,
    folder: &Path,
    mission: Mission,
    robot: Robot,
    (pace, pad): (Pace, Pad),
) -> anyhow::Result<RunConfig> {
    let name = plain_name(&mission.name);
    let recording = folder.join(format!("{name}.mcap")).into_os_string().into_string();
    let recording =
        recording.map_err(|path| anyhow!("{}: expected a path in UTF-8", PathBuf::from(path).display()))?;
    let faults = match &options.faults {
        Some(path) => fault_plan(path, mission.navigator_kind())?.fault,
        None => Vec::new(),
    };
    Ok(RunConfig {
        system: options.system.clone().unwrap_or_else(|| format!("{name}-{}", std::process::id())),
        method: sketchnav_navigators::method(&mission).to_owned(),
        mission,
        files_of: None,
        robot,
        seed: options.seed,
        pace,
        recording: Some(recording),
        split: options.split.of(),
        pad,
        without: options.without.clone(),
        faults,
    })
}

/// Reads a fault plan for a run of this kind of navigator.
///
/// # Errors
/// If the plan is invalid. The error names the file, the fault, the key, and what was expected.
pub fn fault_plan(path: &Path, kind: &str) -> anyhow::Result<FaultPlan> {
    let named = || path.display().to_string();
    let text = sketchnav_files::read_to_string(path, FAULT_PLAN).with_context(named)?;
    FaultPlan::parse(&text, kind).with_context(named)
}

/// Returns the command lines of the processes of `run`, except for those that the user runs by hand. If there is a
/// page, they include that of the pad.
///
/// # Errors
/// Those of [`ProcessLine::serve`].
pub fn lines(run: &RunConfig, link: Option<&Link>) -> Result<Vec<ProcessLine>, SystemError> {
    for process in &run.without {
        let robot = match (process, run.pace) {
            (Process::World, Pace::Lockstep) => {
                ", or start the driver of a simulator; a robot needs --speed 1 here, because its time does not wait"
            }
            (Process::World, _) => ", or start your driver or `sketchnav bridge ros2 --drive`",
            _ => "",
        };
        say!("waiting for {process}: sketchnav serve {process} --system {}{robot}", run.system);
    }
    let services = SERVICES.into_iter().filter(|process| !run.without.contains(process));
    let services = services.map(|process| ProcessLine::serve(process, &run.system));
    services.chain(link.map(|link| link.line(&run.system))).collect()
}

/// Returns the maximum time that processes may go without a sign of life.
pub fn grace(options: &SystemOptions) -> Grace {
    Grace { stopped: Duration::from_secs_f64(options.stopped_limit), ..Grace::default() }
}

/// Classifies an error as bad input if the user can correct it.
pub fn classify(error: SystemError) -> Failure {
    match &error {
        // The user needs the service's report about its input, but not the information that it came from the process of a service.
        SystemError::Died(death) if error.is_bad_input() => {
            // What comes before the error, such as a traceback, is in the process's log.
            let last = death.last_lines.rsplit_once("\nerror: ").map(|(_, last)| last);
            let words = last.unwrap_or(death.last_lines.trim_start_matches("error: "));
            Failure::Input(anyhow!("{}: {words}", death.process))
        }
        SystemError::Runtime(cause) if cause.concerns_the_name() || cause.has_nothing_to_resume() => {
            Failure::Input(error.into())
        }
        _ => Failure::Other(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::{Args, FromArgMatches};
    use sketchnav_recordings::Recording;
    use sketchnav_recordings::writer::Writer;

    use super::*;
    use crate::recordings::judge;

    fn options(words: &[&str]) -> SystemOptions {
        let line = SystemOptions::augment_args(clap::Command::new("run").no_binary_name(true));
        SystemOptions::from_arg_matches(&line.get_matches_from(words)).unwrap()
    }

    fn run(mission: &str, words: &[&str]) -> RunConfig {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("sim/missions/{mission}.toml"));
        let (mission, robot) = load(&path, &options(words)).unwrap();
        configure(&options(words), Path::new("out"), mission, robot, (Pace::Lockstep, Pad::Absent)).unwrap()
    }

    /// Returns the method that `judge` reports for a recording of this run.
    fn judged(run: &RunConfig) -> String {
        let file = tempfile::NamedTempFile::new().unwrap();
        Writer::create(file.reopen().unwrap(), run).unwrap().finish().unwrap();
        assert_eq!(Recording::open(file.path()).unwrap().run().unwrap(), *run);
        let judged = judge::of_file(file.path(), None).unwrap();
        serde_json::to_value(judged).unwrap()["method"].as_str().unwrap().to_owned()
    }

    /// Regression test: the method was once missing from the recordings of all kinds of navigators but one.
    #[test]
    fn the_method_of_a_run_is_known_for_every_navigator() {
        let mut kinds = BTreeSet::new();
        for mission in
            ["laboratory/laboratory-a", "corridor/corridor-a", "landmarks/scene-a", "directions/hundred"]
        {
            let run = run(mission, &[]);
            let navigator = sketchnav_navigators::of(&run.mission).unwrap();
            assert_eq!(Some(&run.method.as_str()), navigator.methods.first(), "{mission}");
            assert_eq!(judged(&run), run.method, "{mission}");
            // Earlier versions recorded no method.
            assert_eq!(judged(&RunConfig { method: String::new(), ..run.clone() }), run.method, "{mission}");
            kinds.insert(navigator.kind);
        }
        assert_eq!(kinds, sketchnav_navigators::all().map(|navigator| navigator.kind).collect());
    }

    #[test]
    fn the_method_of_a_run_is_the_requested_one() {
        assert_eq!(run("laboratory/laboratory-a", &["--method", "beam"]).method, "beam");
        assert_eq!(run("corridor/corridor-qtc", &[]).method, "qtc-b");
    }
}
