//! Reruns a service on the recorded inputs.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use sketchnav_files::draft::{Draft, Sink};
use sketchnav_navigators::method_of;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::sources::{self, RecordedRun};
use sketchnav_recordings::writer::{Writer, topic_name};
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_rehearsal::rerun::{self, Rerun, RerunError, StepTimes};
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;

use super::args::RerunOptions;
use super::guard::Guard;
use super::judge;
use super::whole::Whole;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out};

/// Runs a service's core again.
pub fn rerun(whole: &Whole, options: &RerunOptions) -> Result<Outcome, Failure> {
    let (file, guard) = (whole.path(), Guard::of(whole.sources().to_vec()));
    let recording = super::open(file)?;
    let is_cut_off = recording.index().or_input()?.is_cut_off();
    if is_cut_off {
        super::tell_cut_off(whole.name().display());
    }
    let cut_off = is_cut_off || !whole.lacks().cut_off.is_empty();
    let folder = tempfile::tempdir().context("a folder for temporary files")?;
    let mut recorded = RecordedRun::of(&recording).or_input()?;
    let set = options.parameters().map_err(|text| Failure::Input(anyhow!(text)))?;
    recorded.run.mission.parameters.extend(&set);
    // If parameters were changed, both the recorded run and the new one are judged.
    let asks_what_if = !options.set.is_empty() && options.process != Process::Sketcher;
    let copy = options.output.clone().or_else(|| asks_what_if.then(|| folder.path().join("now.mcap")));
    // The recording is judged first, since the copy may replace it.
    let mut judged: Vec<_> =
        asks_what_if.then(|| judge::of_whole(whole, None)).transpose()?.into_iter().collect();
    let outcome = execute(&recording, &recorded, options, copy.as_deref(), &guard)?;
    if outcome.recorded + outcome.sent == 0 {
        let (process, file) = (options.process, whole.name().display());
        let why = silence(&recording, &recorded, options, &outcome).or_input()?;
        return Err(Failure::Input(anyhow!(
            "{file}: expected messages of the {process}, found none: there is nothing to execute again{why}"
        )));
    }
    if let (Some(copy), true) = (&copy, asks_what_if) {
        judged.push(judge::of_file(copy, None)?);
    }
    if options.json {
        out!("{}", json(&outcome, options, cut_off, &judged))?;
    } else {
        print(&outcome, options)?;
        if let [recorded, now] = judged.as_slice() {
            output::lines(judge::table(&[recorded, now]))?;
        }
    }
    let is_new = outcome.recorded == 0;
    Ok(if outcome.difference.is_none() || is_new { Outcome::Success } else { Outcome::Short })
}

/// Explains why a process may have had nothing to answer.
fn silence(
    recording: &Recording,
    recorded: &RecordedRun,
    options: &RerunOptions,
    outcome: &Rerun,
) -> Result<String, RecordingError> {
    let mut why = String::new();
    let mut absent = Vec::new();
    for spec in channels::read_by(options.process, recorded.run.mission.navigator_kind()) {
        if recording.select(Selection::of_topics([topic_name(spec.name)]))?.next().is_none() {
            absent.push(spec.name);
        }
    }
    if !absent.is_empty() {
        why = format!("; the recording has no messages of {}, which it reads", absent.join(", "));
    }
    for rejected in outcome.rejected.list() {
        why = format!("{why}; rejected {rejected}");
    }
    Ok(why)
}

fn execute(
    recording: &Recording,
    recorded: &RecordedRun,
    options: &RerunOptions,
    copy: Option<&Path>,
    guard: &Guard,
) -> Result<Rerun, Failure> {
    let (draft, mut writer) = copy.map(|path| create(path, recording)).transpose()?.unzip();
    let tolerances = options.tolerances.iter().cloned().collect();
    let outcome = rerun::rerun(recording, options.process, recorded, tolerances, writer.as_mut());
    let outcome = outcome.map_err(failure)?;
    if let (Some(draft), Some(writer)) = (draft, writer) {
        let messages = writer.message_count();
        writer.finish().context("the new recording")?;
        guard.place(draft, messages)?;
    }
    Ok(outcome)
}

/// Classifies an error: it concerns either the recording or the request, which are input, or the copy.
fn failure(error: RerunError) -> Failure {
    match error {
        RerunError::Recording(RecordingError::Write(_)) => Failure::Other(error.into()),
        _ => Failure::Input(error.into()),
    }
}

fn create(path: &Path, recording: &Recording) -> Result<(Draft, Writer<Sink>), Failure> {
    let (draft, sink) = Draft::begin(path).with_context(|| path.display().to_string()).or_input()?;
    let files: Vec<_> = sources::of_recording(recording).cloned().collect();
    let mut run = recording.run().or_input()?;
    run.method = method_of(&run).to_owned();
    let writer = Writer::create_with(sink, &run, &files);
    Ok((draft, writer.with_context(|| path.display().to_string())?))
}

fn print(outcome: &Rerun, options: &RerunOptions) -> anyhow::Result<()> {
    let Rerun { same, sent, recorded, simulated_s, core, wall, .. } = outcome;
    match &outcome.difference {
        None => out!("identical: {same} messages of the {}, byte for byte", options.process)?,
        Some(_) if *recorded == 0 => {
            out!("new: {sent} messages; the recording has none of the {}", options.process)?
        }
        Some(difference) => out!("different after {same} messages: {difference}")?,
    }
    out!(
        "{simulated_s:.1} s recorded; took {:.2} s ({:.0} × real time), of which the core {:.2} s ({:.0} ×)",
        wall.as_secs_f64(),
        simulated_s / wall.as_secs_f64().max(1e-9),
        core.as_secs_f64(),
        simulated_s / core.as_secs_f64().max(1e-9),
    )?;
    let milliseconds = |time: std::time::Duration| time.as_secs_f64() * 1e3;
    let StepTimes { count, mean, within_99, longest } = outcome.steps;
    out!(
        "{count} steps: {:.2} ms on average, 99 % within {:.2} ms, the longest {:.2} ms",
        milliseconds(mean),
        milliseconds(within_99),
        milliseconds(longest),
    )?;
    for rejected in outcome.rejected.list() {
        out!("rejected   {rejected}")?;
    }
    options.output.as_ref().map_or(Ok(()), |path: &PathBuf| out!("recording  {}", path.display()))
}

fn json(
    outcome: &Rerun,
    options: &RerunOptions,
    cut_off: bool,
    judged: &[judge::Judged],
) -> serde_json::Value {
    serde_json::json!({
        "process": options.process.word(),
        "cut_off": cut_off,
        "identical": outcome.difference.is_none(),
        "difference": outcome.difference,
        "same": outcome.same,
        "sent": outcome.sent,
        "recorded": outcome.recorded,
        "rejected": outcome.rejected,
        "simulated_s": outcome.simulated_s,
        "wall_s": outcome.wall.as_secs_f64(),
        "core_s": outcome.core.as_secs_f64(),
        "steps": outcome.steps.count,
        "step_mean_s": outcome.steps.mean.as_secs_f64(),
        "step_99_s": outcome.steps.within_99.as_secs_f64(),
        "step_longest_s": outcome.steps.longest.as_secs_f64(),
        "judged": judged,
    })
}
