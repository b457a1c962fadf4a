//! `sketchnav pad` runs a whole system in real time, which people drive by drawing.

use std::path::Path;
use std::time::Duration;

use anyhow::{anyhow, ensure};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_supervisor::{Error as SystemError, Progress, Supervisor};

use crate::args::PadOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::folder::{RunFolder, create, plain_name};
use crate::launch::{classify, configure, grace, lines, load};
use crate::link::Link;
use crate::mission::{is_demo, load_demo};
use crate::notify::Manager;
use crate::output::{self, say};
use crate::study;

/// Interval at which to check for dead processes and for the end.
const REFRESH: Duration = Duration::from_millis(100);

/// Serves the page, and drives by the drawings that people make on it, until a person ends the system.
pub fn pad(options: &PadOptions) -> Result<Outcome, Failure> {
    match &options.study {
        Some(folder) if options.report => study::report(folder),
        Some(folder) => study::run(folder, options),
        None => {
            let link = Link::new(&options.site, options.token.clone()).or_input()?;
            let place = place(options)?;
            host(options, &link, place, &mut || false).map(|ended| ended.outcome)
        }
    }
}

/// How a system with a page ended.
#[derive(Debug, Clone, Copy)]
pub struct Ended {
    /// Whether the recording is complete.
    pub outcome: Outcome,
    /// Whether a person ended the system.
    pub by_person: bool,
}

/// What a page needs to start a system: the folder for the results, the mission that provides the world, and the robot.
pub type Stage = (RunFolder, Mission, Robot);

/// Runs the system until a person ends it or `is_over` returns true.
pub fn host(
    options: &PadOptions,
    link: &Link,
    (folder, mission, robot): Stage,
    is_over: &mut dyn FnMut() -> bool,
) -> Result<Ended, Failure> {
    let run = run_config(options, &folder, mission, robot).or_input().inspect_err(|_| folder.discard())?;
    let started =
        lines(&run, Some(link)).and_then(|lines| Supervisor::start(&run, lines, grace(&options.system)));
    let mut supervisor = started.map_err(|error| {
        folder.discard();
        classify(error)
    })?;
    let watched = watch(&mut supervisor, link, is_over);
    let ended = supervisor.shut_down();
    let by_person = match watched {
        Ok(by_person) => by_person,
        Err(error) => {
            if supervisor.status().is_none() {
                folder.discard();
            }
            return Err(classify(error));
        }
    };
    say!("the recording: {}", run.recording.as_deref().unwrap_or_default());
    ended.map_err(|error| Failure::Reported(error.into()))?;
    let Some(gap) = supervisor.recording_failure().filter(|failure| failure.missing > 0) else {
        return Ok(Ended { outcome: Outcome::Success, by_person });
    };
    say!("the recording is incomplete by {} messages: {}", gap.missing, gap.words);
    Ok(Ended { outcome: Outcome::Incomplete, by_person })
}

/// Reads the mission and creates the folder for its results.
pub fn place(options: &PadOptions) -> Result<Stage, Failure> {
    match options.mission.as_ref().filter(|path| !is_demo(path)) {
        Some(path) => {
            let (mission, robot) = load(path, &options.system)?;
            check_kind(&mission).map_err(|error| anyhow!("{}: {error}", path.display())).or_input()?;
            let folder = create(&options.system.out, &plain_name(&mission.name)).or_input()?;
            Ok((folder, mission, robot))
        }
        None => {
            let folder = create(&options.system.out, "pad").or_input()?;
            let (mission, robot) = load_demo(&folder, &options.system).inspect_err(|_| folder.discard())?;
            Ok((folder, mission, robot))
        }
    }
}

/// Checks that the mission's navigator drives by people's drawings.
fn check_kind(mission: &Mission) -> anyhow::Result<()> {
    let navigator = sketchnav_navigators::of(mission)?;
    let drawn = sketchnav_navigators::all().filter(|navigator| navigator.drawn.is_some());
    let known: Vec<_> = drawn.map(|navigator| format!("{:?}", navigator.kind)).collect();
    ensure!(
        navigator.drawn.is_some(),
        "navigator.kind: expected a mission of kind {}, because people draw on the page; found kind {:?}. To watch \
         it: sketchnav run MISSION --pad",
        known.join(" or "),
        navigator.kind
    );
    Ok(())
}

/// Configures a run with the mission's world, robot and true start, but without its keys for a drawing.
fn run_config(
    options: &PadOptions,
    folder: &Path,
    mut mission: Mission,
    robot: Robot,
) -> anyhow::Result<RunConfig> {
    let drawn = sketchnav_navigators::of(&mission)?.drawn;
    drawn.map_or(Ok(()), |drawn| (drawn.blank)(&mut mission)).map_err(|error| anyhow!("{error}"))?;
    configure(&options.system, folder, mission, robot, (options.speed, Pad::Draws))
}

/// Waits until a person ends the system, in which case it returns true, or until `is_over` returns true.
fn watch(
    supervisor: &mut Supervisor,
    link: &Link,
    is_over: &mut dyn FnMut() -> bool,
) -> Result<bool, SystemError> {
    let (mut is_announced, mut mourned) = (false, 0);
    let mut manager = Manager::of_environment();
    let by_person = loop {
        if supervisor.poll(REFRESH)? == Progress::Interrupted {
            break true;
        }
        if is_over() {
            break false;
        }
        manager.ping_if_due();
        if !is_announced && link.is_up() {
            // If standard output is closed, the user may know the link already.
            let _ = output::lines(link.text());
            is_announced = true;
            // The status omits the link, since that contains the secret token.
            manager.ready("serving the page");
        }
        for death in &supervisor.survived()[mourned..] {
            say!("  {}; restarted", death.how());
            mourned += 1;
        }
    };
    if by_person {
        manager.stopping();
    }
    Ok(by_person)
}
