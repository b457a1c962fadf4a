//! Plays a recording into the channels of a system of its own.
//!
//! The player sends the recorded messages again, in the name of the processes that sent them and with the
//! same numbers. Processes that are started live receive these messages and respond to them. At `--rate max`,
//! the player waits for the responses to each scan, as a world in lockstep does.

mod clock;
mod keys;
mod plan;
mod player;
mod ports;

use std::path::Path;

use anyhow::{Context, anyhow};
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_schemas::channels::{self, Role, STATUS};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::{Pace, RunConfig, Split};
use sketchnav_supervisor::{Grace, ProcessLine, Supervisor};

use super::args::{Rate, ReplayOptions};
use crate::failure::{Failure, OrInput, Outcome};
use crate::folder::plain_name;
use crate::output::say;
use plan::Plan;
use player::{End, Player};

/// Plays a recording.
pub fn replay(file: &Path, options: &ReplayOptions) -> Result<Outcome, Failure> {
    let recording = super::open(file)?;
    let run = run(&recording, options)?;
    let plan = Plan::new(&recording, options).with_context(|| file.display().to_string()).or_input()?;
    let live = &options.live;
    let lines: Result<Vec<_>, _> =
        live.iter().map(|process| ProcessLine::serve(*process, &run.system)).collect();
    let lines = lines.context("starting processes")?;
    let mut supervisor = Supervisor::start_for_player(&run, lines, Grace::default(), plan.ceded)
        .context("starting the system")?;
    if live.is_empty() {
        let channel = to_look_at(run.mission.navigator_kind());
        say!("playing in the system {}; look at it with: sketchnav echo {channel} --system {0}", run.system);
    }
    let played = Player::new(&recording, &run, options, &plan, &supervisor)
        .and_then(|mut player| player.play(&mut supervisor));
    let ended = supervisor.shut_down();
    let end = played.map_err(|error| failure(error, file))?;
    ended.context("ending the system")?;
    match end {
        End::Played => Ok(Outcome::Success),
        End::Interrupted => Err(Failure::Other(anyhow!("interrupted before the end"))),
    }
}

/// Returns the channel that is most worth watching in a run of this kind of navigator, which is the one with the situations.
fn to_look_at(kind: &str) -> &'static str {
    let situation = channels::of_kind(kind).find(|spec| spec.role == Role::Situation);
    situation.map_or(STATUS.spec.name, |spec| spec.name)
}

/// Classifies an error: either the recording, which the error names, is invalid, or the system failed.
fn failure(error: anyhow::Error, file: &Path) -> Failure {
    if error.downcast_ref::<RecordingError>().is_some() {
        return Failure::Input(error);
    }
    Failure::Other(error.context(file.display().to_string()))
}

/// Turns the recorded run into a new one, whose processes read their files from the recording.
fn run(recording: &Recording, options: &ReplayOptions) -> Result<RunConfig, Failure> {
    if options.live.contains(&Process::World) {
        return Err(Failure::Input(anyhow!(
            "--live world: expected other processes; a live world needs no recording, see `sketchnav run`"
        )));
    }
    if options.live.contains(&Process::Recorder) != options.record.is_some() {
        return Err(Failure::Input(anyhow!("--live recorder and --record belong together")));
    }
    if let Some(record) = &options.record {
        super::refuse_to_overwrite([&recording.path().to_owned()], record)?;
        if record.exists() && !record.is_file() {
            return Err(Failure::Input(anyhow!(
                "--record {}: expected the name of a file",
                record.display()
            )));
        }
    }
    let recorded = RecordedRun::of(recording).or_input()?;
    if !options.live.is_empty() {
        recorded.check_files().or_input()?;
    }
    let mut run = recorded.run;
    run.files_of = Some(absolute(recording.path(), "the recording")?);
    run.system = match &options.system {
        Some(name) => name.clone(),
        None => plain_name(&format!("replay-{}-{}", std::process::id(), run.mission.name)),
    };
    // The recorded faults are not injected again, since the recorded messages already show their effects.
    run.faults.clear();
    run.pace = match options.rate {
        Rate::Max => Pace::Lockstep,
        Rate::Times(speed) => Pace::RealTime { speed },
    };
    run.recording = options.record.as_ref().map(|record| absolute(record, "--record")).transpose()?;
    run.split = Split::default();
    Ok(run)
}

/// Makes a path absolute, so that processes in other folders can use it.
fn absolute(path: &Path, what: &'static str) -> Result<String, Failure> {
    let path = std::path::absolute(path).context(what).or_input()?.into_os_string().into_string();
    let wrong = |path| anyhow!("{what}: expected a path in UTF-8, found {}", Path::new(&path).display());
    path.map_err(wrong).or_input()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: every replay once suggested the channel `estimate`, which most kinds of navigators do not have.
    #[test]
    fn the_channel_to_look_at_is_one_of_the_navigator() {
        for navigator in sketchnav_navigators::all() {
            let channel = to_look_at(navigator.kind);
            assert!(channels::of_kind(navigator.kind).any(|spec| spec.name == channel), "{channel}");
        }
        assert_eq!((to_look_at("sketch"), to_look_at("unknown")), ("estimate", "status"));
    }
}
