//! The result of a run, which is read from its recording, judged, drawn and printed.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_files::{Disk, Files};
use sketchnav_lab::judge::log::Log;
use sketchnav_lab::judge::{self, Verdict};
use sketchnav_lab::sections;
use sketchnav_recordings::Recording;
use sketchnav_recordings::info::{Info, info};
use sketchnav_recordings::rejected::{Rejected, Rejections};
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::{Process, TaskState};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;
use sketchnav_stage::doubts::Doubts;
use sketchnav_supervisor::{RecordingFailure, Supervisor};

use crate::doubts;
use crate::failure::{Failure, OrInput};
use crate::output::{self, out};
use crate::recordings::whole::Whole;

/// The figures of a run, printed in this form by `--json`.
#[derive(Debug, Serialize)]
pub struct Report {
    mission: String,
    seed: u64,
    #[serde(flatten)]
    verdict: Verdict,
    #[serde(flatten)]
    doubts: Doubts,
    /// The planner's report of how it drove, if it had to deviate from the method.
    #[serde(skip_serializing_if = "Option::is_none")]
    driven: Option<&'static str>,
    /// Wall-clock duration of the run, in seconds, or `None` if its supervisor was killed at its end.
    wall_seconds: Option<f64>,
    real_time_factor: Option<f64>,
    lost_messages: u64,
    /// The recorded messages that every reader rejects as invalid, by topic and reason.
    rejected: Rejections,
    /// The planned faults that did not happen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outstanding_faults: Vec<OutstandingFault>,
    recording: String,
    /// What is missing from the recording, and why, if its files could not be written.
    #[serde(skip_serializing_if = "Option::is_none")]
    incomplete: Option<String>,
    pictures: Vec<PathBuf>,
    /// The folder with the output of the processes.
    #[serde(skip_serializing_if = "Option::is_none")]
    logs: Option<PathBuf>,
    /// The reason why some of that output is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    logs_incomplete: Option<String>,
    /// The reason why there are fewer pictures than expected.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_drawn: Option<String>,
    processes: Vec<ProcessFigures>,
    /// A hint about what to check first, if there is one.
    #[serde(skip)]
    hint: Option<&'static str>,
}

/// A planned fault that did not happen, because its message was never sent.
#[derive(Debug, Serialize)]
struct OutstandingFault {
    /// The number of the fault in the plan, from 1.
    number: usize,
    words: String,
}

/// The figures that a process reported when it ended.
#[derive(Debug, Serialize)]
struct ProcessFigures {
    process: &'static str,
    restarts: u64,
    steps: u64,
    busy_s: f64,
    step_allocations: u64,
    lost_messages: u64,
    refused_messages: u64,
}

impl Report {
    /// Judges the recording of `run` and draws it into `folder`.
    pub fn new(
        run: &RunConfig,
        supervisor: &Supervisor,
        wall: Duration,
        folder: &Path,
        warnings: Vec<String>,
    ) -> Result<Self, Failure> {
        let recording = run.recording.as_deref().unwrap_or_default();
        let mut report = Self::of(run, &Disk, Some((supervisor, wall)), Path::new(recording), folder)?;
        report.doubts.warnings.extend(warnings);
        Ok(report)
    }

    /// Judges and draws a run whose supervisor was killed after the mission had ended, using only its recording.
    /// Returns `None` if the mission had not ended.
    pub fn of_ended(recording: &Path, folder: &Path) -> Result<Option<Self>, Failure> {
        let whole = Whole::of(recording)?;
        let file = Recording::open(whole.path()).or_input()?;
        let status = Log::read(&file).or_input()?.status;
        let last = status.last().and_then(|status| TaskState::from_code(status.state));
        if !matches!(last, Some(TaskState::Finished | TaskState::Aborted)) {
            return Ok(None);
        }
        let RecordedRun { run, files } = RecordedRun::of(&file).or_input()?;
        Self::of(&run, &files, None, recording, folder).map(Some)
    }

    fn of(
        run: &RunConfig,
        files: &dyn Files,
        live: Option<(&Supervisor, Duration)>,
        recording: &Path,
        folder: &Path,
    ) -> Result<Self, Failure> {
        let whole = Whole::of(recording)?;
        let of_this_run = || format!("{}: the recording of this run", recording.display());
        let file = Recording::open(whole.path()).with_context(of_this_run)?;
        let log = Log::read_all(&file).with_context(of_this_run)?;
        let info = info(whole.path()).with_context(of_this_run)?;
        let supervisor = live.map(|(supervisor, _)| supervisor);
        let incomplete = Gap::of(supervisor.and_then(Supervisor::recording_failure), &info);
        let mut verdict = judge::judge(&run.mission, &log.truth, &log.status, &log.contacts);
        if let (Some(_), Some(supervisor)) = (&incomplete, supervisor) {
            judge::fill_gaps(&mut verdict, &log.truth, &log.status, supervisor.ended_tasks());
        }
        let mut pictures = Vec::new();
        let drawn = draw((run, files), &log, &verdict, folder, &mut pictures);
        // A process that did not run has no report, which is usually the case for the pad.
        let processes = channels::SERVICES.into_iter().chain(channels::EXTRAS);
        let processes: Vec<_> = processes.filter_map(|process| figures(process, supervisor?)).collect();
        let lost: u64 = processes.iter().map(|p| p.lost_messages).sum();
        let outstanding = supervisor.map(Supervisor::outstanding_faults).unwrap_or_default();
        let wall_seconds = live.map(|(_, wall)| wall.as_secs_f64());
        Ok(Self {
            mission: run.mission.name.clone(),
            seed: run.seed,
            // Unreadable files were already reported before the drive.
            doubts: doubts::of(run, files).unwrap_or_default(),
            driven: log.driven(),
            hint: hint(&run.mission, &verdict),
            wall_seconds,
            real_time_factor: wall_seconds.map(|wall_seconds| verdict.sim_seconds / wall_seconds),
            verdict,
            // The recorder also counts its own losses. Any further messages that the file lacks were lost on disk.
            lost_messages: lost.max(info.missing).max(incomplete.as_ref().map_or(0, |gap| gap.missing)),
            rejected: log.rejected,
            outstanding_faults: outstanding
                .iter()
                .map(|(number, fault)| OutstandingFault { number: *number, words: fault.words() })
                .collect(),
            recording: recording.display().to_string(),
            incomplete: incomplete.map(|gap| gap.words),
            pictures,
            logs: supervisor.and_then(Supervisor::logs).map(Path::to_owned),
            logs_incomplete: supervisor.and_then(Supervisor::logs_failure).map(str::to_owned),
            not_drawn: drawn.err().map(|error| format!("{error:#}")),
            processes,
        })
    }

    /// Returns true if every task was reached.
    pub fn success(&self) -> bool {
        self.verdict.success
    }

    /// Describes the gaps of the recording, or returns `None` if it is complete.
    pub fn incomplete(&self) -> Option<&str> {
        self.incomplete.as_deref()
    }

    /// Prints a table or, with `json`, a JSON object.
    pub fn print(&self, json: bool) -> Result<(), Failure> {
        if json {
            out!("{}", serde_json::to_string(self).context("the report as JSON")?)?;
            return Ok(());
        }
        output::lines(self.table())?;
        let tasks = &self.verdict.tasks;
        let reached = tasks.iter().filter(|task| task.reached).count();
        let by_the_clock = self.wall_seconds.zip(self.real_time_factor);
        let by_the_clock =
            by_the_clock.map(|(s, times)| format!(", {s:.1} s on the clock ({times:.0} × real time)"));
        out!(
            "{reached} of {} tasks reached in {:.0} s simulated{}; {} messages lost",
            tasks.len(),
            self.verdict.sim_seconds,
            by_the_clock.unwrap_or_default(),
            self.lost_messages,
        )?;
        if let Some(how) = self.driven {
            out!("method     {how}")?;
        }
        for OutstandingFault { number, words } in &self.outstanding_faults {
            out!("not done   fault {number} of the plan: {words}; its message was never sent")?;
        }
        for rejected in self.rejections() {
            out!("rejected   {rejected}")?;
        }
        out!("recording  {}", self.recording)?;
        if let Some(words) = &self.incomplete {
            out!("incomplete {words}")?;
        }
        for picture in &self.pictures {
            out!("picture    {}", picture.display())?;
        }
        if let Some(logs) = &self.logs {
            out!("logs       {}", logs.display())?;
        }
        if let Some(why) = &self.logs_incomplete {
            out!("not kept   what a process printed: {why}")?;
        }
        if let Some(why) = &self.not_drawn {
            out!("not drawn  {why}")?;
        }
        if let Some(hint) = self.hint {
            out!("hint       {hint}")?;
        }
        Ok(())
    }

    /// Describes the rejected messages: those in the recording with reasons or, if it contains none, those that the
    /// processes counted.
    fn rejections(&self) -> Vec<String> {
        let recorded: Vec<_> = self.rejected.list().iter().map(Rejected::to_string).collect();
        if !recorded.is_empty() {
            return recorded;
        }
        let rejecting = self.processes.iter().filter(|process| process.refused_messages > 0);
        let words = |one: &ProcessFigures| {
            format!("{} messages by the {}; its log names the reasons", one.refused_messages, one.process)
        };
        rejecting.map(words).collect()
    }

    fn table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(UTF8_FULL_CONDENSED);
        table.set_header(Verdict::TASK_COLUMNS);
        table.add_rows(self.verdict.task_rows());
        for column in 2..6 {
            if let Some(column) = table.column_mut(column) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        table
    }
}

/// Returns a hint about what to check first if the mission states the start twice, for the robot and in its drawing, and the robot
/// ended tasks without reaching any. If people or the end of the run stopped it, that says nothing about the start.
fn hint(mission: &Mission, verdict: &Verdict) -> Option<&'static str> {
    let is_given_twice = mission.navigator.given.contains_key("start");
    let is_none_reached = verdict.tasks.iter().all(|task| !task.reached);
    let by_robot = [TaskState::Reached, TaskState::Blocked, TaskState::Lost, TaskState::TimedOut];
    let has_ended = verdict.tasks.iter().any(|task| by_robot.iter().any(|state| state.word() == task.state));
    (is_given_twice && is_none_reached && has_ended).then_some(
        "check that navigator.start and start.world are the same place, and that navigator.start_heading_deg is the robot's \
         heading as seen in the drawing: `sketchnav help missions`",
    )
}

/// The losses of a recording whose files could not be written.
struct Gap {
    words: String,
    missing: u64,
}

impl Gap {
    /// Returns `None` if the disk had space again before anything was lost.
    fn of(failure: Option<&RecordingFailure>, info: &Info) -> Option<Self> {
        let failure = failure?;
        let missing = failure.missing.max(info.missing);
        let words = format!("by {missing} messages: {}", failure.words);
        (missing > 0 || !info.clean_end).then_some(Self { words, missing })
    }
}

fn figures(process: Process, supervisor: &Supervisor) -> Option<ProcessFigures> {
    let health = supervisor.health(process)?;
    Some(ProcessFigures {
        process: process.word(),
        restarts: supervisor.restarts(process),
        steps: health.steps,
        busy_s: seconds(health.busy_ns),
        step_allocations: health.step_allocations,
        lost_messages: health.lost_messages,
        refused_messages: health.refused_messages,
    })
}

fn draw(
    (run, files): (&RunConfig, &dyn Files),
    log: &Log,
    verdict: &Verdict,
    folder: &Path,
    pictures: &mut Vec<PathBuf>,
) -> anyhow::Result<()> {
    if let Some(svg) = sections::believed(run, log, verdict)? {
        pictures.push(write(folder.join("sketch.svg"), &svg)?);
    }
    let (name, svg) = sections::true_ground(run, files, log, verdict)?;
    pictures.push(write(folder.join(name), &svg)?);
    Ok(())
}

fn write(path: PathBuf, svg: &str) -> anyhow::Result<PathBuf> {
    sketchnav_files::write(&path, svg).with_context(|| path.display().to_string())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use sketchnav_lab::judge::TaskVerdict;

    use super::*;

    /// Regression test: with a wrong heading in the drawing, the only output was "0 of 3 tasks reached".
    #[test]
    fn after_a_run_that_reached_nothing_the_starts_are_doubted() {
        let by_drawing =
            Mission::parse(include_str!("../../../sim/missions/laboratory/laboratory-a.toml")).unwrap();
        let task = |reached| TaskVerdict {
            name: "there".to_owned(),
            reached,
            state: TaskState::Lost.word().to_owned(),
            reason: String::new(),
            time_s: 1.0,
            path_m: 1.0,
            final_error_m: None,
            collisions: 0,
        };
        let verdict = |tasks: &[bool]| Verdict {
            success: false,
            tasks: tasks.iter().copied().map(task).collect(),
            sim_seconds: 1.0,
        };
        let said = hint(&by_drawing, &verdict(&[false, false])).unwrap();
        assert!(said.contains("start_heading_deg") && said.contains("sketchnav help missions"), "{said}");
        assert_eq!(hint(&by_drawing, &verdict(&[false, true])), None);
        let mut aborted = verdict(&[false, false]);
        aborted.tasks.iter_mut().for_each(|task| task.state = TaskState::Aborted.word().to_owned());
        assert_eq!(hint(&by_drawing, &aborted), None);
        let without = Mission::parse(include_str!("../../../sim/missions/corridor/corridor-a.toml")).unwrap();
        assert_eq!(hint(&without, &verdict(&[false])), None);
    }
}
