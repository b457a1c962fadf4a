//! Repeats trials with separate processes and compares every message with the one-process run, on which the
//! suites' figures are based.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use anyhow::{Context, anyhow};
use serde::Serialize;
use sketchnav_lab::experiments::jobs::Job;
use sketchnav_lab::experiments::learned::series::LEARNED_FILE;
use sketchnav_lab::experiments::trial::{Page, Trial};
use sketchnav_recordings::diff::{Difference, diff};
use sketchnav_recordings::{RecordingError, Writer};
use sketchnav_rehearsal::{Onlooker, Tap};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;

use crate::failure::Failure;
use crate::output::say;

/// The result of comparing trials that were driven both ways.
#[derive(Debug, Default, Serialize)]
pub struct Check {
    /// Number of trials that were also driven with separate processes.
    pub checked: usize,
    /// Number of trials with identical messages.
    pub identical: usize,
    /// The trials with different messages, with the first such message.
    pub different: Vec<(String, Difference)>,
    /// The folder with the recordings of the trials that differed, if any.
    pub folder: Option<PathBuf>,
}

/// Writes the messages of a rehearsal to a file as the recorder would.
struct Recorder {
    writer: Writer<BufWriter<File>>,
    failed: Option<RecordingError>,
}

impl Tap for Recorder {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) {
        if self.failed.is_none() {
            self.failed = self.writer.write_bytes(spec, message, cells).err();
        }
    }
}

impl Onlooker for Recorder {
    fn has_enough(&self) -> bool {
        self.failed.is_some()
    }
}

/// Checks the first run of `count` of the jobs, spread evenly over all of them. Jobs that may think for
/// longer than the period of a scan are left out, because they do not run in lockstep, so no two runs of
/// separate processes would agree. Jobs in which a person answers are left out as well, because there is no
/// such person in a run of separate processes.
pub fn check(jobs: &[Job<'_>], count: usize) -> Result<Check, Failure> {
    let folder = std::env::temp_dir().join(format!("sketchnav-eval-{}", std::process::id()));
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut check = check_in(&folder, jobs, count);
    match &mut check {
        Ok(Check { different, folder: kept, .. }) if !different.is_empty() => *kept = Some(folder),
        _ => std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?,
    }
    check
}

fn check_in(folder: &Path, jobs: &[Job<'_>], count: usize) -> Result<Check, Failure> {
    let is_alike = |job: &&Job<'_>| job.trial.thinking_scans == 0 && job.trial.person.is_none();
    let jobs: Vec<_> = jobs.iter().filter(is_alike).collect();
    if jobs.is_empty() {
        let expected = "--check-processes: expected drives that processes repeat, found none";
        return Err(Failure::Input(anyhow!(
            "{expected}: in all of them a person answers, or a core takes longer than a scan"
        )));
    }
    let chosen = (0..count.min(jobs.len())).map(|k| jobs[k * jobs.len() / count.min(jobs.len())]);
    let mut found = Check::default();
    for (k, job) in chosen.enumerate() {
        let place = folder.join(k.to_string());
        std::fs::create_dir_all(&place).with_context(|| place.display().to_string())?;
        let id = format!("{}#{}", job.trial.name, job.repetition);
        found.checked += 1;
        match compare(job, &place).with_context(|| id.clone())? {
            None => found.identical += 1,
            Some(difference) => {
                say!("different  {id}: {difference}, in {}", place.display());
                found.different.push((id, difference));
            }
        }
    }
    Ok(found)
}

fn compare(job: &Job<'_>, place: &Path) -> anyhow::Result<Option<Difference>> {
    let trial = &*job.trial.prepared(job.method, job.seed)?;
    let run = trial.run(job.method, job.seed, 0)?;
    let rehearsed = place.join("rehearsed.mcap");
    rehearse(trial, &run, &rehearsed)?;
    let mission = write_mission(trial, &run, place)?;
    let by_processes = by_processes(&mission, run.seed, place)?;
    Ok(diff(&by_processes, &rehearsed)?)
}

fn rehearse(trial: &Trial, run: &RunConfig, path: &Path) -> anyhow::Result<()> {
    let page = trial.bytes.as_ref().map(Page::bytes).transpose()?;
    let rehearsal = trial.rehearsal(run, page.as_deref())?;
    let sink = BufWriter::new(File::create(path)?);
    let mut recorder = Recorder { writer: Writer::create(sink, run)?, failed: None };
    rehearsal.run(&mut recorder)?;
    recorder.failed.map_or(Ok(()), Err)?;
    recorder.writer.finish()?;
    Ok(())
}

/// Writes the trial as a user would, with files for the mission, the robot and the drawing.
pub fn write_mission(trial: &Trial, run: &RunConfig, place: &Path) -> anyhow::Result<PathBuf> {
    let mut mission = Mission { robot: "robot.toml".into(), ..run.mission.clone() };
    std::fs::write(place.join("robot.toml"), toml::to_string(&run.robot)?)?;
    if let Some(page) = &trial.bytes {
        for (_, file) in mission.navigator_files_mut() {
            *file = "drawing".into();
        }
        std::fs::write(place.join("drawing"), page.bytes()?)?;
    }
    if let Some(learned) = &trial.learned {
        std::fs::write(place.join(LEARNED_FILE), learned)?;
    }
    let path = place.join("mission.toml");
    std::fs::write(&path, toml::to_string(&mission)?)?;
    Ok(path)
}

/// Runs the system in lockstep and returns its recording.
fn by_processes(mission: &Path, seed: u64, place: &Path) -> anyhow::Result<PathBuf> {
    let system = format!("eval-{}", std::process::id());
    let output = command(mission, seed, place, &system)?.output().context("starting the mission")?;
    recording(&output)
}

/// Returns the command that runs a mission in lockstep, as a system of this name.
pub fn command(mission: &Path, seed: u64, place: &Path, system: &str) -> anyhow::Result<Command> {
    let mut command = sketchnav_supervisor::this_program().context("path of this program")?;
    command.arg("run").arg(mission).args(["--json", "--seed", &seed.to_string(), "--out"]).arg(place);
    command.args(["--system", system]).stdin(Stdio::null());
    Ok(command)
}

/// Finds the recording of a finished mission in its output.
pub fn recording(output: &Output) -> anyhow::Result<PathBuf> {
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).context("the mission's report")?;
    let Some(recording) = report["recording"].as_str() else {
        let said =
            report["error"].as_str().map_or_else(|| String::from_utf8_lossy(&output.stderr), Into::into);
        return Err(anyhow!(
            "the run by processes left no recording ({}): {}",
            output.status,
            said.trim_end()
        ));
    };
    Ok(recording.into())
}
