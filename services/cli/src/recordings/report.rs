//! Shows a recording as one page, with the drawing and the floor, snapshots, errors, scales and health over time, and a table of
//! figures.

mod foreign;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Context;
use maud::{Markup, PreEscaped, html};
use sketchnav_lab::judge::figures::local_errors_m;
use sketchnav_lab::judge::log::{Instant, Log};
use sketchnav_lab::judge::{self as verdicts, TaskSpan, Verdict};
use sketchnav_lab::page::{self, Chart, Series};
use sketchnav_lab::sections;
use sketchnav_recordings::faults::FaultInfo;
use sketchnav_recordings::sources::{RecordedFiles, RecordedRun};
use sketchnav_recordings::{Recording, import::LOG_SYSTEM};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;
use sketchnav_stage::account;
use sketchnav_stage::doubts::Doubts;

use super::judge::{self, Judged};
use super::whole::Whole;
use crate::doubts;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::warnings;

/// Writes the page.
pub fn report(whole: &Whole, output: &Path, rooms: Option<&Path>, json: bool) -> Result<Outcome, Failure> {
    let rooms = rooms.map(judge::rooms).transpose()?;
    let recording = super::open(whole.path())?;
    if !recording.has_run() {
        return foreign::report(whole, &recording, output, json);
    }
    let log = Log::read_all(&recording).or_input()?;
    let judged = judge::of_log(&recording, log, rooms.as_ref())?.named_by(whole);
    let RecordedRun { run, files } = RecordedRun::of(&recording).or_input()?;
    let run = judged.log.with_drawn_tasks(run);
    let planned = warnings::of_recording(&recording, &run).or_input()?;
    let page = Page {
        recording: &recording,
        run: &run,
        files: &files,
        judged: &judged,
        log: &judged.log,
        planned: &planned,
    };
    let html = page.html().with_context(|| whole.name().display().to_string())?;
    sketchnav_files::write(output, html).with_context(|| output.display().to_string()).or_input()?;
    if judged.cut_off && whole.lacks().cut_off.is_empty() {
        super::tell_cut_off(whole.name().display());
    }
    let output = output.display().to_string();
    if json {
        out!("{}", serde_json::json!({ "page": output, "cut_off": judged.cut_off }))?;
    } else {
        out!("page       {output}")?;
    }
    Ok(Outcome::Success)
}

struct Page<'a> {
    recording: &'a Recording,
    run: &'a RunConfig,
    files: &'a RecordedFiles,
    judged: &'a Judged,
    log: &'a Log,
    /// The doubts about the plan that the navigator made before the start.
    planned: &'a [String],
}

impl Page<'_> {
    fn html(&self) -> anyhow::Result<String> {
        let body = html! {
            (self.head())
            (self.tasks())
            (self.pictures()?)
            (sections::of(self.recording, (self.run, self.files), self.log, &self.judged.journeys)?)
            (self.over_time())
            (self.health())
            (self.faults())
            h2 { "Figures" }
            (page::table(&[], &judge::rows(self.judged).into_iter().map(|(name, value)| vec![name, value]).collect::<Vec<_>>()))
            p.small { "What each figure means: recordings/README.md of the project." }
        };
        Ok(page::document(&format!("{} · sketchnav report", self.run.mission.name), &body))
    }

    fn verdict(&self) -> Option<&Verdict> {
        self.judged.figures.verdict.as_ref()
    }

    fn head(&self) -> Markup {
        let fact = |key: &str| match key {
            "method" => self.log.driven().unwrap_or_else(|| self.log.method(self.run)),
            _ => self.recording.fact("sketchnav", key).unwrap_or("–"),
        };
        let file = self.recording.path().file_name().unwrap_or_default().to_string_lossy();
        html! {
            h1 {
                (self.run.mission.name)
                @if let Some(verdict) = self.verdict() {
                    @let reached = verdict.tasks.iter().filter(|task| task.reached).count();
                    span class={ "badge" @if !verdict.success { " short" } } {
                        (reached) " of " (verdict.tasks.len()) " tasks reached"
                    }
                }
            }
            @if self.judged.cut_off { p.notice { "The recording is cut off: the following covers only part of the run." } }
            @if !self.run.mission.description.is_empty() { p.lead { (self.run.mission.description) } }
            p.facts {
                span { "recording " b { (file) } }
                @for key in ["seed", "method", "pace", "robot", "version"] { span { (key) " " b { (fact(key)) } } }
            }
            @let Doubts { warnings, left_out, resolved } = doubts::of(self.run, self.files).unwrap_or_default();
            @for warning in warnings.iter().chain(self.planned) { p.notice { "Doubted before the start: " (warning) "." } }
            @for what in &resolved { p.facts { (what) "." } }
            @for what in &left_out { p.facts { "Left out of the drawing: " (what) "." } }
        }
    }

    fn tasks(&self) -> Markup {
        let Some(verdict) = self.verdict() else { return html! {} };
        let rows: Vec<_> = verdict.task_rows().map(Vec::from).collect();
        html! {
            h2 { "Tasks" }
            (page::table(&Verdict::TASK_COLUMNS.map(str::to_owned), &rows))
        }
    }

    fn pictures(&self) -> anyhow::Result<Markup> {
        let Some(verdict) = self.verdict() else { return Ok(html! {}) };
        let sketch = sections::believed(self.run, self.log, verdict)?;
        let floor = sections::true_ground(self.run, self.files, self.log, verdict).map(|(_, svg)| svg);
        Ok(html! {
            h2 { "Estimated and true position" }
            div.pictures {
                @for svg in sketch.iter().chain(&floor) { figure { (PreEscaped(svg)) } }
            }
            @if let Err(error) = &floor { p.notice { "The world is not drawn: " (format!("{error:#}")) } }
        })
    }

    fn span_s(&self) -> [f64; 2] {
        let stamps = || self.log.truth.iter().map(|truth| seconds(truth.header.stamp_ns));
        [stamps().next().unwrap_or(0.0), stamps().next_back().unwrap_or(1.0)]
    }

    /// Returns the start times of the tasks, in seconds.
    fn marks_s(&self) -> Vec<f64> {
        if self.run.system == LOG_SYSTEM {
            return Vec::new();
        }
        let spans = verdicts::spans(self.run.mission.task.len(), &self.log.status);
        spans.iter().flatten().map(|span: &TaskSpan| seconds(span.begin_ns)).collect()
    }

    fn faults_s(&self) -> Vec<f64> {
        let is_blow = |fault: &&FaultInfo| matches!(fault.kind, "died" | "unresponsive" | "given up");
        self.judged.faults.iter().filter(is_blow).map(|fault| fault.stamp_s).collect()
    }

    fn faults(&self) -> Markup {
        let header = ["time", "process", "what", "lasted", "details"];
        let row = |fault: &FaultInfo| {
            let lasted =
                if fault.duration_ms > 0.0 { format!("{:.0} ms", fault.duration_ms) } else { "–".into() };
            let (process, kind) = (fault.process.to_owned(), fault.kind.to_owned());
            vec![format!("{:.1} s", fault.stamp_s), process, kind, lasted, fault.words.clone()]
        };
        html! {
            @if !self.judged.faults.is_empty() {
                h2 { "Faults and orders" }
                (page::table(&header.map(str::to_owned), &self.judged.faults.iter().map(row).collect::<Vec<_>>()))
            }
        }
    }

    fn over_time(&self) -> Markup {
        let (marks, faults, span_s) = (self.marks_s(), self.faults_s(), self.span_s());
        let chart = |title, unit, series: &[Series]| {
            Chart { title, unit, x_unit: "s", series, span: span_s, marks: &marks, faults: &faults }.figure()
        };
        let speed = [Series {
            name: "speed".to_owned(),
            points: (self.log.truth.iter())
                .map(|m| [seconds(m.header.stamp_ns), m.twist.vx_mps.hypot(m.twist.vy_mps)])
                .collect(),
        }];
        let has_speed = self.run.system != LOG_SYSTEM && !self.log.truth.is_empty();
        let errors = self.errors();
        if errors.is_none() && self.judged.summary.charts.is_empty() && !has_speed {
            return html! {};
        }
        html! {
            h2 { "Over time" }
            @if !marks.is_empty() || !faults.is_empty() { p.small {
                @if !marks.is_empty() { "Dashed: a task begins." } @if !faults.is_empty() { " Red: a process died or fell silent." }
            } }
            div.cards {
                @if let Some(errors) = errors { (chart("Error in local metres", "m", &[errors])) }
                @for plot in &self.judged.summary.charts { (chart(plot.title, plot.unit, &series(plot))) }
                @if has_speed { (chart("True speed", "m/s", &speed)) }
            }
        }
    }

    /// Returns the distances of the estimates from the truth over time, in metres, or `None` if the run has no instants.
    fn errors(&self) -> Option<Series> {
        let log = self.log;
        let errors = local_errors_m(log);
        let point = |(i, instant): (usize, &Instant)| {
            [seconds(instant.stamp_ns), errors.get(i).copied().unwrap_or(f64::NAN)]
        };
        let points: Vec<_> = log.instants.iter().enumerate().map(point).collect();
        (!points.is_empty()).then(|| Series { name: "error".to_owned(), points })
    }

    fn health(&self) -> Markup {
        let log = self.log;
        let mut by_process: BTreeMap<u32, Vec<[f64; 2]>> = BTreeMap::new();
        for message in &log.health {
            let at = [seconds(message.header.stamp_ns), message.step_max_ns as f64 / 1e6];
            by_process.entry(message.process).or_default().push(at);
        }
        let name = |code: u32| Process::from_code(code).map_or("?", Process::word).to_owned();
        let series: Vec<_> = by_process
            .into_iter()
            .filter(|(code, _)| {
                matches!(
                    Process::from_code(*code),
                    Some(Process::Localizer | Process::Planner | Process::World | Process::Recorder)
                )
            })
            .map(|(code, points)| Series { name: name(code), points })
            .collect();
        let (marks, faults) = (self.marks_s(), self.faults_s());
        let stages = self.judged.figures.stages.iter().map(|stage| {
            vec![
                stage.process.to_owned(),
                stage.steps.to_string(),
                format!("{:.2} ms", stage.mean_ms),
                format!("{:.2} ms", stage.median_of_longest_ms),
                format!("{:.2} ms", stage.max_ms),
            ]
        });
        let latencies = self.judged.figures.latency_ms.iter().map(|(stage, ms)| {
            let figures = [ms.median, ms.p99, ms.max].map(|ms| format!("{ms:.2} ms"));
            [&[(*stage).to_owned(), ms.count.to_string()], &figures[..]].concat()
        });
        let of_latencies = ["from … to …", "scans", "median", "99 %", "longest"].map(str::to_owned);
        let header = ["process", "steps", "mean step", "longest per report, median", "longest of all"];
        html! {
            @if !log.health.is_empty() {
                h2 { "Latency and health" }
                @if !log.latencies.is_empty() { (page::table(&of_latencies, &latencies.collect::<Vec<_>>())) }
                (page::table(&header.map(str::to_owned), &stages.collect::<Vec<_>>()))
                div.cards {
                    (Chart { title: "Longest step", unit: "ms, by the clock", x_unit: "s", series: &series, span: self.span_s(), marks: &marks, faults: &faults }.figure())
                }
            }
        }
    }
}

/// Converts the curves of a chart to the format of the page.
fn series(plot: &account::Chart) -> Vec<Series> {
    let curve = |curve: &account::Curve| Series { name: curve.name.to_owned(), points: curve.points.clone() };
    plot.curves.iter().map(curve).collect()
}
