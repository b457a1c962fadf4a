//! `sketchnav chaos`: runs a mission twice, killing its processes during the second run, and compares the two.
//!
//! Both runs are separate programs, so chaos tests exactly what users run.

mod injector;
mod recoveries;
mod safety;
mod schedule;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use anyhow::{Context, anyhow};
use serde::Serialize;
use serde_json::Value;
use sketchnav_recordings::{diff, info};
use sketchnav_runtime::System;
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::Pace;

use crate::args::{ChaosOptions, KillSignal};
use crate::failure::{Failure, OrInput, Outcome};
use crate::folder::create;
use crate::output::out;
use injector::{Hit, Injector, Plan};
use recoveries::{Recoveries, recoveries};
use safety::{Safety, safety};

/// The result of both runs, printed as it is by `--json`.
#[derive(Debug, Serialize)]
struct Report {
    kills: usize,
    /// The number of kills that the user asked for. If the mission ends early, fewer of them happen, and the result is less
    /// conclusive.
    asked: u32,
    /// Number of kills that starved a process of the processor for a while instead of ending it.
    starvations: usize,
    by_process: BTreeMap<&'static str, Recoveries>,
    /// Whether every task was reached in the run with kills.
    success: bool,
    undisturbed_success: bool,
    /// Whether every message equals that of the undisturbed run. `None` in real time, where no two runs are identical.
    identical: Option<bool>,
    lost_messages: u64,
    /// Whether the robot remained safe. `None` in lockstep, where the world waits for its navigators.
    safety: Option<Safety>,
    orphans: usize,
    leftover_files: Vec<PathBuf>,
    recording: PathBuf,
    /// The schedule that `--schedule` repeats.
    schedule: PathBuf,
}

impl Report {
    /// Returns true if the kills changed nothing. This is also the case for a mission that fails without
    /// kills, and for one that ends before the last kill.
    fn is_good(&self) -> bool {
        let is_safe = |safety: &Safety| safety.unstopped == 0 && safety.wall_contacts == 0;
        (self.success || !self.undisturbed_success)
            && self.identical != Some(false)
            && self.lost_messages == 0
            && self.safety.as_ref().is_none_or(is_safe)
            && self.orphans == 0
            && self.leftover_files.is_empty()
    }
}

/// Runs the mission in the file `mission` twice, first undisturbed and then disturbed.
pub fn chaos(mission: &Path, options: &ChaosOptions) -> Result<Outcome, Failure> {
    if options.signal.contains(&KillSignal::Starve) && !options.at_messages {
        let error = anyhow!("--signal starve: expected --at-messages, found kills at random times");
        return Err(Failure::Input(error));
    }
    let given = schedule::given(options, mission)?;
    let folder = create(&options.out, "chaos").or_input()?;
    let undisturbed = start(mission, options, &folder.join("undisturbed"), "calm", None).and_then(report);
    let undisturbed = undisturbed.inspect_err(|_| folder.discard_if_empty())?;
    let reference = recording(&undisturbed)?;
    let path = folder.join("schedule.toml");
    let drawn = if given.is_none() { schedule::drawn(options, &reference)? } else { None };
    let report = match given.or(drawn) {
        Some(plan) => {
            schedule::write(&path, &plan)?;
            let run = start(mission, options, &folder.join("disturbed"), "chaos", Some(&path))?;
            let disturbed = report(run).map_err(|failure| schedule::with_repetition(failure, &path))?;
            let kills = schedule::kills(&recording(&disturbed)?)?;
            judge(options, &kills, plan.fault.len() as u32, &reference, &disturbed, &path)?
        }
        None => by_lot(mission, options, &folder, &reference, &path)?,
    };
    let report = Report { undisturbed_success: undisturbed["success"] == true, ..report };
    print(&report, options.json)?;
    let good = report.is_good();
    Ok(if good { Outcome::Success } else { Outcome::Short })
}

/// Kills processes at random times, and writes what happened to the file `schedule`.
fn by_lot(
    mission: &Path,
    options: &ChaosOptions,
    folder: &Path,
    reference: &Path,
    schedule: &Path,
) -> Result<Report, Failure> {
    let out = folder.join("disturbed");
    let mut run = start(mission, options, &out, "chaos", None)?;
    let plan = Plan { steps: world_messages(reference)?, supervisor: run.id(), system: system("chaos") };
    let hits = Injector::new(options, plan).disturb(&mut run).context("watching the run")?;
    let disturbed = report(run);
    // Written even after a failure, since a run that failed usually has a recording, too.
    let is_written = schedule::write_happened(schedule, &out);
    let disturbed = disturbed.map_err(|failure| schedule::with_repetition(failure, schedule))?;
    is_written?;
    judge(
        options,
        &hits.iter().map(Kill::of).collect::<Vec<_>>(),
        options.kills,
        reference,
        &disturbed,
        schedule,
    )
}

/// A kill, and how long its process took to recover.
struct Kill {
    process: Process,
    recovered_ms: Option<f64>,
    /// Whether the process was only starved of the processor, in which case there is nothing to recover from.
    is_starved: bool,
}

impl Kill {
    fn of(hit: &Hit) -> Self {
        let recovered_ms = hit.recovered.map(|time| time.as_secs_f64() * 1e3);
        Self { process: hit.process, recovered_ms, is_starved: false }
    }

    /// Returns true if the process has yet to recover.
    fn is_open(&self) -> bool {
        self.recovered_ms.is_none() && !self.is_starved
    }
}

fn system(word: &str) -> String {
    format!("{word}-{}", std::process::id())
}

fn start(
    mission: &Path,
    options: &ChaosOptions,
    out: &Path,
    word: &str,
    faults: Option<&Path>,
) -> Result<Child, Failure> {
    let speed = match options.speed {
        Pace::Lockstep => "max".to_owned(),
        Pace::RealTime { speed } => speed.to_string(),
    };
    let mut command = sketchnav_supervisor::this_program().context("path of this program")?;
    command.arg("run").arg(mission).arg("--out").arg(out).args(["--json", "--speed", &speed]);
    command.args(["--seed", &options.seed.to_string(), "--system", &system(word)]);
    command.args(faults.iter().flat_map(|path| [Path::new("--faults"), path]));
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    Ok(command.spawn().context("starting the mission")?)
}

/// Waits for a run to end and returns the report that it prints.
fn report(run: Child) -> Result<Value, Failure> {
    let output = run.wait_with_output().context("waiting for the mission")?;
    let object: Value = serde_json::from_slice(&output.stdout).context("the mission's report")?;
    match object.get("error").and_then(Value::as_str) {
        Some(error) if output.status.code() == Some(2) => Err(Failure::Input(anyhow!("{error}"))),
        Some(error) => Err(Failure::Other(anyhow!("{error}"))),
        None => Ok(object),
    }
}

fn recording(report: &Value) -> Result<PathBuf, Failure> {
    let path = report["recording"].as_str().context("the mission's report names no recording")?;
    Ok(path.into())
}

/// Returns the number of messages that the world sends in the whole mission, against which its progress is measured.
fn world_messages(recording: &Path) -> Result<u32, Failure> {
    let info = info::info(recording).context("the undisturbed recording")?;
    let is_worlds =
        |topic: &str| channels::of_topic(topic).is_some_and(|spec| spec.writer == Some(Process::World));
    let topics = info.topics.iter().filter(|topic| is_worlds(&topic.topic));
    Ok(topics.map(|topic| topic.messages).sum::<u64>() as u32)
}

fn judge(
    options: &ChaosOptions,
    kills: &[Kill],
    asked: u32,
    reference: &Path,
    disturbed: &Value,
    schedule: &Path,
) -> Result<Report, Failure> {
    let recording = recording(disturbed)?;
    let identical = match options.speed {
        Pace::Lockstep => Some(diff::diff(reference, &recording).context("comparing")?.is_none()),
        Pace::RealTime { .. } => None,
    };
    let safety = match options.speed {
        Pace::Lockstep => None,
        Pace::RealTime { .. } => Some(safety(&recording).context("judging its safety")?),
    };
    Ok(Report {
        safety,
        kills: kills.len(),
        asked,
        starvations: kills.iter().filter(|kill| kill.is_starved).count(),
        by_process: recoveries(kills),
        success: disturbed["success"] == true,
        undisturbed_success: true,
        identical,
        lost_messages: disturbed["lost_messages"].as_u64().unwrap_or_default(),
        orphans: injector::orphans(&system("chaos")),
        leftover_files: System::leftovers(&system("chaos")).context("looking for leftovers")?,
        recording,
        schedule: schedule.to_owned(),
    })
}

fn print(report: &Report, json: bool) -> Result<(), Failure> {
    if json {
        out!("{}", serde_json::to_string(report).context("the report as JSON")?)?;
        return Ok(());
    }
    let Report { kills, asked, starvations, lost_messages, orphans, .. } = report;
    let same = match report.identical {
        Some(true) => "every message identical to the undisturbed run",
        Some(false) => "messages differ from the undisturbed run's",
        None => "in real time, where no two runs agree",
    };
    let end = match (report.success, report.undisturbed_success) {
        (true, _) => "every task reached",
        (false, true) => "not every task reached, although all were without kills",
        (false, false) => "not every task reached, with kills or without",
    };
    let what = match (starvations, asked) {
        (0, 1) => "kill",
        (0, _) => "kills",
        (count, 1) if count == kills => "starvation",
        (count, _) if count == kills => "starvations",
        _ => "kills and starvations",
    };
    out!("{kills} of {asked} {what}: {end}; {same}; {lost_messages} messages lost")?;
    if *kills < *asked as usize {
        out!("the mission ended before the other {}", *asked as usize - kills)?;
    }
    for (process, recoveries) in &report.by_process {
        out!("{process:<10} {recoveries}")?;
    }
    if let Some(Safety { wall_contacts, outages, unstopped, longest_stop_s }) = &report.safety {
        out!(
            "{wall_contacts} contacts with walls after a death; {outages} longer outages of navigators: the robot stood still \
             after {longest_stop_s:.2} s at most, and did not stop {unstopped} times"
        )?;
    }
    out!("{orphans} orphans, {} files left", report.leftover_files.len())?;
    out!("recording  {}", report.recording.display())?;
    out!("schedule   {}", report.schedule.display())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        Report {
            kills: 5,
            asked: 5,
            starvations: 0,
            by_process: BTreeMap::new(),
            success: true,
            undisturbed_success: true,
            identical: Some(true),
            lost_messages: 0,
            safety: None,
            orphans: 0,
            leftover_files: Vec::new(),
            recording: PathBuf::new(),
            schedule: PathBuf::new(),
        }
    }

    /// Regression test: a run that was identical down to the byte was once called bad because its mission fails even without
    /// kills, or ends early.
    #[test]
    fn an_undisturbed_run_passes_if_it_is_identical() {
        assert!(report().is_good());
        assert!(Report { success: false, undisturbed_success: false, ..report() }.is_good());
        assert!(Report { kills: 2, ..report() }.is_good());
        assert!(!Report { success: false, identical: None, ..report() }.is_good());
        assert!(!Report { identical: Some(false), ..report() }.is_good());
        assert!(!Report { lost_messages: 1, ..report() }.is_good());
        assert!(!Report { orphans: 1, ..report() }.is_good());
    }
}
