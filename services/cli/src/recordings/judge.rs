//! Reports the outcomes of missions and the errors of the estimates.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Context;
use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_files::TABLE;
use sketchnav_lab::judge::anchors::Anchors;
use sketchnav_lab::judge::directions::JourneyVerdict;
use sketchnav_lab::judge::drawing;
use sketchnav_lab::judge::figures::{Figures, MetricMap, figures};
use sketchnav_lab::judge::log::Log;
use sketchnav_lab::judge::rooms::Rooms;
use sketchnav_lab::judge::tables;
use sketchnav_lab::judge::trajectory::Statistics;
use sketchnav_lab::sections::directions;
use sketchnav_navigators::read_from;
use sketchnav_recordings::Recording;
use sketchnav_recordings::faults::FaultInfo;
use sketchnav_recordings::import::LOG_SYSTEM;
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::codes::FaultKind;
use sketchnav_stage::account::Summary;

use super::account;
use super::args::JudgeOptions;
use super::whole::Whole;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out, say};

/// The kinds of reports on the channel `faults` that are failures. The others are their causes, recoveries and orders.
const FAILURES: [FaultKind; 5] = [
    FaultKind::Died,
    FaultKind::Unresponsive,
    FaultKind::GivenUp,
    FaultKind::StateRefused,
    FaultKind::RecordingFailed,
];

/// The figures of a recording, and which recording they belong to.
#[derive(Debug, Serialize)]
pub struct Judged {
    #[serde(serialize_with = "as_text")]
    recording: PathBuf,
    /// The file that contains the recording, which may be temporary.
    #[serde(skip)]
    file: PathBuf,
    mission: Option<String>,
    seed: Option<u64>,
    method: Option<String>,
    /// Whether the file ends before its writer had finished.
    pub cut_off: bool,
    missing: u64,
    /// The messages that every reader rejects as invalid, by topic and reason.
    rejected: Rejections,
    restarts: u64,
    /// Faults of processes, and recoveries from faults.
    pub faults: Vec<FaultInfo>,
    /// For each task with a drawn route, whether the robot's path was homotopic to the route. `None` if there is no
    /// anchors file.
    homotopic: Option<BTreeMap<String, bool>>,
    /// How journeys with custom maps ended. Empty for all other kinds of navigators.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) journeys: Vec<JourneyVerdict>,
    /// The navigator's own account of the run.
    #[serde(rename = "account", serialize_with = "figures_of", skip_serializing_if = "has_no_figures")]
    pub(super) summary: Summary,
    #[serde(flatten)]
    pub figures: Figures,
    #[serde(skip)]
    pub log: Log,
    #[serde(skip)]
    map: Option<MetricMap>,
}

impl Judged {
    /// Replaces the recording's name by the one that the user knows, and marks the recording as cut off if one of its
    /// files is.
    pub(super) fn named_by(self, whole: &Whole) -> Self {
        let cut_off = self.cut_off || !whole.lacks().cut_off.is_empty();
        Self { recording: whole.name().to_owned(), cut_off, ..self }
    }
}

/// Serializes a path as it is displayed, since it need not be UTF-8.
fn as_text<S: serde::Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.display())
}

/// Serializes the figures of a navigator, each with its value as it is displayed.
fn figures_of<S: serde::Serializer>(summary: &Summary, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(summary.figures.iter().map(|(name, value)| (name, value)))
}

fn has_no_figures(summary: &Summary) -> bool {
    summary.figures.is_empty()
}

/// Judges recordings.
pub fn judge(wholes: &[Whole], options: &JudgeOptions) -> Result<Outcome, Failure> {
    let rooms = options.rooms.as_deref().map(rooms).transpose()?;
    let judged: Result<Vec<_>, _> = wholes.iter().map(|whole| of_whole(whole, rooms.as_ref())).collect();
    let mut judged = judged?;
    if let Some(anchors) = &options.anchors {
        let text = sketchnav_files::read_to_string(anchors, TABLE)
            .with_context(|| anchors.display().to_string())
            .or_input()?;
        let anchors = Anchors::parse(&text).with_context(|| anchors.display().to_string()).or_input()?;
        for one in &mut judged {
            one.homotopic = Some(homotopic(one, &anchors).or_input()?);
        }
    }
    write_tables(&judged, options)?;
    for (one, whole) in judged.iter().zip(wholes) {
        if one.cut_off && whole.lacks().cut_off.is_empty() {
            super::tell_cut_off(one.recording.display());
        }
    }
    for one in &judged {
        let name = one.recording.display();
        one.rejected.list().iter().for_each(|rejected| say!("notice: {name}: rejected {rejected}"));
    }
    if options.json {
        out!("{}", serde_json::to_string(&judged).context("the figures as JSON")?)?;
    } else {
        output::lines(table(&judged.iter().collect::<Vec<_>>()))?;
    }
    let reached = |judged: &Judged| judged.figures.verdict.as_ref().is_none_or(|verdict| verdict.success);
    Ok(if judged.iter().all(reached) { Outcome::Success } else { Outcome::Short })
}

/// Reads the file that maps rooms of the floor to rooms of the drawing.
pub fn rooms(path: &Path) -> Result<Rooms, Failure> {
    let text = sketchnav_files::read_to_string(path, TABLE)
        .with_context(|| path.display().to_string())
        .or_input()?;
    Rooms::parse(&text).with_context(|| path.display().to_string()).or_input()
}

/// Judges a recording that the user named.
pub fn of_whole(whole: &Whole, rooms: Option<&Rooms>) -> Result<Judged, Failure> {
    Ok(of_file(whole.path(), rooms)?.named_by(whole))
}

/// Judges a recording.
pub fn of_file(path: &Path, rooms: Option<&Rooms>) -> Result<Judged, Failure> {
    let recording = super::open(path)?;
    recording.must_be_ours().or_input()?;
    let log = Log::read(&recording).or_input()?;
    of_log(&recording, log, rooms)
}

/// Judges a recording from a log that was already read from it.
pub fn of_log(recording: &Recording, log: Log, rooms: Option<&Rooms>) -> Result<Judged, Failure> {
    let path = recording.path();
    let info = sketchnav_recordings::info::info(path).or_input()?;
    let run = recording.run().ok().map(|run| log.with_drawn_tasks(run));
    let map = run.as_ref().and_then(|run| drawing::map_of(recording, run));
    let mission = run.as_ref().filter(|run| run.system != LOG_SYSTEM).map(|run| &run.mission);
    Ok(Judged {
        recording: path.to_owned(),
        file: path.to_owned(),
        mission: run.as_ref().map(|run| run.mission.name.clone()),
        seed: run.as_ref().map(|run| run.seed),
        method: run.as_ref().map(|run| log.method(run).to_owned()),
        cut_off: !info.clean_end,
        missing: info.missing,
        rejected: log.rejected.clone(),
        homotopic: None,
        journeys: directions::verdicts_of(recording, &log).or_input()?,
        summary: run.as_ref().map_or(Ok(Summary::default()), |run| account::of(recording, run)).or_input()?,
        faults: log.told_faults(),
        restarts: info.all_restarts(),
        figures: figures(&log, mission, map, rooms),
        log,
        map,
    })
}

/// Returns, for each task with a drawn route, whether the robot's path was homotopic to the route.
fn homotopic(judged: &Judged, anchors: &Anchors) -> anyhow::Result<BTreeMap<String, bool>> {
    let recording = Recording::open(&judged.file)?;
    let RecordedRun { run, files } = RecordedRun::of(&recording)?;
    drawing::homotopic(&run, &read_from(&files), &judged.log, anchors)
}

fn write_tables(judged: &[Judged], options: &JudgeOptions) -> Result<(), Failure> {
    let write = |path: &Path, text: &str| {
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        sketchnav_files::write(path, text)
    };
    let names = names(&judged.iter().collect::<Vec<_>>());
    for (one, name) in judged.iter().zip(names) {
        if let Some(csv) = &options.csv {
            let path = if judged.len() == 1 { csv.clone() } else { csv.join(format!("{name}.csv")) };
            write(&path, &tables::csv(&one.log)).with_context(|| path.display().to_string()).or_input()?;
        }
        if let Some(folder) = &options.tum {
            let (truth, estimate) = tables::tum_pair(&one.log, one.map);
            for (what, text) in [("truth", truth), ("estimate", estimate)] {
                let path = folder.join(format!("{name}.{what}.tum"));
                write(&path, &text).with_context(|| path.display().to_string()).or_input()?;
            }
        }
    }
    Ok(())
}

/// Returns a unique name for each recording, which is its own name if possible. If several recordings have the same
/// name, the name of the folder is prepended. If that is not enough either, a number is appended.
fn names(judged: &[&Judged]) -> Vec<String> {
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let in_folder = |path: &Path| {
        let folder = std::path::absolute(path).ok()?.parent()?.file_name()?.to_string_lossy().into_owned();
        Some(format!("{folder}-{}", stem(path)))
    };
    let paths: Vec<&Path> = judged.iter().map(|one| one.file.as_path()).collect();
    let mut names: Vec<String> = paths.iter().map(|path| stem(path)).collect();
    if has_twins(&names) {
        names = paths.iter().map(|path| in_folder(path).unwrap_or_else(|| stem(path))).collect();
    }
    if has_twins(&names) {
        names = names.iter().zip(1..).map(|(name, number)| format!("{name}-{number}")).collect();
    }
    names
}

fn has_twins(names: &[String]) -> bool {
    names.iter().collect::<BTreeSet<_>>().len() < names.len()
}

/// Makes a table with a column per recording.
pub fn table(judged: &[&Judged]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(std::iter::once("figure".to_owned()).chain(names(judged)));
    let rows: Vec<Vec<(String, String)>> = judged.iter().map(|one| rows(one)).collect();
    let mut names: Vec<String> = Vec::new();
    for (name, _) in rows.iter().flatten() {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    for name in names {
        let value = |rows: &Vec<(String, String)>| {
            rows.iter().find(|(known, _)| *known == name).map_or("–".to_owned(), |(_, value)| value.clone())
        };
        table.add_row(std::iter::once(name.clone()).chain(rows.iter().map(value)));
    }
    for column in 1..=judged.len() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// Returns the names and values of a recording's figures.
pub fn rows(judged: &Judged) -> Vec<(String, String)> {
    let figures = &judged.figures;
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    if judged.cut_off {
        row("the recording", "cut off".to_owned());
    }
    if let Some(verdict) = &figures.verdict {
        let reached = verdict.tasks.iter().filter(|task| task.reached).count();
        row("tasks reached", format!("{reached} of {}", verdict.tasks.len()));
        let errors = Statistics::of(verdict.tasks.iter().filter_map(|task| task.final_error_m));
        row("final error, mean", errors.map_or("–".into(), |e| format!("{:.2} m", e.mean)));
        row("collisions", figures.collisions.to_string());
    }
    for (name, value) in directions::rows(&judged.journeys).chain(judged.summary.figures.iter().cloned()) {
        row(&name, value);
    }
    if let Some(ways) = &judged.homotopic {
        let right = ways.values().filter(|homotopic| **homotopic).count();
        row("paths homotopic to the drawn ones", format!("{right} of {}", ways.len()));
    }
    row("estimates", figures.estimates.to_string());
    if let Some(why) = figures.not_aligned {
        row("aligned", format!("no: {why}"));
    }
    for (name, errors) in [
        ("absolute error", figures.absolute_m),
        ("absolute error, not aligned", figures.unaligned_m),
        ("relative error, 10 steps", figures.relative_m),
        ("error in local metres", figures.local_m),
    ] {
        let Some(e) = errors else { continue };
        row(&format!("{name}: rmse"), format!("{:.3} m", e.rmse));
        row(&format!("{name}: median, p95"), format!("{:.3}, {:.3} m", e.median, e.p95));
    }
    if let Some(rooms) = figures.rooms {
        row("in the right room", format!("{:.1} % of {}", 100.0 * rooms.share, rooms.judged));
    }
    if let (Some(a), Some(b)) = (figures.scale_a_pxpm, figures.scale_b_pxpm) {
        row("scale a: mean, range", format!("{:.1}, {:.1} to {:.1} px/m", a.mean, a.min, a.max));
        row("scale b: mean, range", format!("{:.1}, {:.1} to {:.1} px/m", b.mean, b.min, b.max));
    }
    if let Some(size) = figures.effective_sample_size {
        row("effective sample size: median, min", format!("{:.0}, {:.0}", size.median, size.min));
    }
    for (word, share) in &figures.tracking {
        row(&format!("share {word}"), format!("{:.1} %", 100.0 * share));
    }
    for (stage, ms) in &figures.latency_ms {
        row(
            &format!("{stage}: median, p99, max"),
            format!("{:.2}, {:.2}, {:.2} ms", ms.median, ms.p99, ms.max),
        );
    }
    for stage in &figures.stages {
        let value = format!("{:.2}, {:.2} ms", stage.mean_ms, stage.max_ms);
        row(&format!("a step of the {}: mean, max", stage.process), value);
    }
    row("scans without a command", figures.unanswered_scans.to_string());
    row("messages missing", judged.missing.to_string());
    row("messages rejected as invalid", judged.rejected.messages().to_string());
    row("restarts", judged.restarts.to_string());
    let reported = |kinds: &[FaultKind]| {
        let is_one = |fault: &&FaultInfo| kinds.iter().any(|kind| kind.word() == fault.kind);
        judged.faults.iter().filter(is_one).count()
    };
    row(
        "faults injected, failures",
        format!("{}, {}", reported(&[FaultKind::Injected]), reported(&FAILURES)),
    );
    rows
}
