//! A recording as one page: the drawing and the floor, some moments, errors, scales and health over time, and
//! the table of figures.

pub mod directions;
pub mod landmarks;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Context;
use maud::{Markup, PreEscaped, html};
use sketchnav_evaluation::judge::figures::local_errors_m;
use sketchnav_evaluation::judge::log::Log;
use sketchnav_evaluation::judge::{self as verdicts, TaskSpan, Verdict};
use sketchnav_evaluation::page::{self, Chart, Series};
use sketchnav_evaluation::picture::{self, Moment};
use sketchnav_recordings::faults::FaultInfo;
use sketchnav_recordings::reader::{RawMessage, Selection};
use sketchnav_recordings::writer::topic_name;
use sketchnav_recordings::{Recording, import::LOG_SYSTEM};
use sketchnav_rehearsal::rerun;
use sketchnav_schemas::channels::PLAN;
use sketchnav_schemas::codes::{Process, Trend};
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::message::{PairedMarker, Plan, Relations};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;
use sketchnav_sketch::planner::ROOMS;

use super::judge::{self, Judged};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::report::{cloud, ground_picture, sketch_picture};
use landmarks::Landmarks;

/// Moments that are shown.
const MOMENTS: usize = 4;

/// Writes the page.
pub fn report(file: &Path, output: &Path, rooms: Option<&Path>, json: bool) -> Result<Outcome, Failure> {
    let rooms = rooms.map(judge::rooms).transpose()?;
    super::refuse_to_overwrite(file, output)?;
    let recording = super::open(file)?;
    let log = Log::with_particles(&recording).or_input()?;
    let judged = judge::of_log(&recording, log, rooms.as_ref())?;
    let folder = tempfile::tempdir().context("a folder for the files of the run")?;
    let run = judged.log.with_drawn_tasks(rerun::run_of(&recording, folder.path()).or_input()?);
    let landmarks = Landmarks::of(&recording).with_context(|| file.display().to_string()).or_input()?;
    let page = Page { recording: &recording, run: &run, judged: &judged, log: &judged.log, landmarks };
    let html = page.html().with_context(|| file.display().to_string())?;
    std::fs::write(output, html).with_context(|| output.display().to_string()).or_input()?;
    if judged.cut_off {
        super::tell_cut_off(file.display());
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
    judged: &'a Judged,
    log: &'a Log,
    landmarks: Option<Landmarks>,
}

impl Page<'_> {
    fn html(&self) -> anyhow::Result<String> {
        let body = html! {
            (self.head())
            (self.tasks())
            (directions::section(self.run, self.log, &self.judged.journeys))
            (self.pictures()?)
            (self.moments()?)
            @if let Some(landmarks) = &self.landmarks { (landmarks.section(self.run, &self.log.truth)) }
            (self.correspondences()?)
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
        // A mission that chooses no method is driven by the first.
        let by_default = || sketchnav_navigators::of(&self.run.mission).ok()?.methods.first().copied();
        let fact = |key: &str| match self.recording.fact("sketchnav", key) {
            Some("") if key == "method" => by_default().unwrap_or("–").to_owned(),
            found => found.unwrap_or("–").to_owned(),
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
            @if self.judged.cut_off { p.notice { "The recording is cut off: what follows is told of a part of the run." } }
            @if !self.run.mission.description.is_empty() { p.lead { (self.run.mission.description) } }
            p.facts {
                span { "recording " b { (file) } }
                @for key in ["seed", "method", "pace", "robot", "version"] { span { (key) " " b { (fact(key)) } } }
            }
            @if self.log.drove_by_rooms() { p.notice { "The planner said: " (ROOMS) "." } }
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
        let sketch = sketch_picture(self.run, self.log, verdict)?;
        // The map may be neither in the recording nor where it was.
        let floor = ground_picture(self.run, self.log, verdict).ok().map(|(_, svg)| svg);
        Ok(html! {
            h2 { "Where the robot believed to be, and where it was" }
            div.pictures {
                @for svg in sketch.iter().chain(&floor) { figure { (PreEscaped(svg)) } }
            }
        })
    }

    /// Spread over the way: where it can be read best, at the beginning, and later on.
    fn moments(&self) -> anyhow::Result<Markup> {
        let (Some((map, cells)), particles) = (&self.log.sketch, &self.log.particles) else {
            return Ok(html! {});
        };
        if particles.is_empty() {
            return Ok(html! {});
        }
        let last = particles.len() - 1;
        let mut shown: Vec<usize> = (0..MOMENTS).map(|i| i * last / (MOMENTS - 1).max(1)).collect();
        shown.dedup();
        let mut figures = Vec::new();
        for index in shown {
            let cloud_of = &particles[index];
            let until = cloud_of.header.stamp_ns;
            let end = self.log.estimates.partition_point(|e| e.header.stamp_ns <= until);
            let Some(estimate) = self.log.estimates[..end].last() else { continue };
            let trail: Vec<_> = self.log.estimates[..end].iter().map(|e| e.pose.pose().position()).collect();
            figures.push(picture::moment(&Moment {
                title: &format!("{:.0} s: particles, the way so far, the plan", seconds(until)),
                width_px: map.width_px,
                height_px: map.height_px,
                cells,
                pose: estimate.pose.pose(),
                trail: &trail,
                particles: &cloud(cloud_of),
                plan: &self.plan_at(until)?,
            })?);
        }
        Ok(html! {
            h2 { "Moments" }
            div.pictures { @for svg in &figures { figure { (PreEscaped(svg)) } } }
        })
    }

    /// What of the drawing corresponded to what was seen, along the way and in the end.
    fn correspondences(&self) -> anyhow::Result<Markup> {
        let (Some((map, cells)), Some(last)) =
            (&self.log.sketch, self.log.correspondences.len().checked_sub(1))
        else {
            return Ok(html! {});
        };
        let shapes = sketchnav_sim::files::world(&self.run.mission.world);
        let shapes = shapes.map(|world| picture::FloorShapes::of(&world)).unwrap_or_default();
        let mut shown = vec![last / 3, 2 * last / 3, last];
        shown.dedup();
        let mut figures = Vec::new();
        for found in shown.into_iter().map(|index| &self.log.correspondences[index]) {
            let until = found.header.stamp_ns;
            let origin = picture::origin_of(found, &self.log.truth);
            let seen = self.log.truth.iter().take_while(|truth| truth.header.stamp_ns <= until);
            let trail: Vec<_> = seen.map(|truth| truth.pose().position()).collect();
            let goal = self.log.goal_at(until);
            figures.push(picture::drawn_outline(&picture::DrawnOutline {
                title: &format!("{:.0} s: the sketch's outline", seconds(until)),
                width_px: map.width_px,
                height_px: map.height_px,
                cells,
                start: map.start.pose(),
                goal: goal.unwrap_or(Point::new(0.0, 0.0)),
                found,
            })?);
            figures.push(picture::seen_outline(&picture::SeenOutline {
                title: &format!("{:.0} s: its partners in what was seen", seconds(until)),
                shapes: &shapes,
                origin,
                trail: &trail,
                found,
            }));
        }
        Ok(html! {
            h2 { "What of the drawing corresponds to what was seen" }
            p { "A piece of the drawing's outline and its partner have one colour. Green cross: the goal. Red cross: where the best rival has it." }
            div.pictures { @for svg in &figures { figure { (PreEscaped(svg)) } } }
        })
    }

    /// The plan that held at that time: the last of the minute before it.
    fn plan_at(&self, stamp_ns: u64) -> anyhow::Result<Vec<Point<Sketch>>> {
        const LOOK_BACK_NS: u64 = 60_000_000_000;
        let times = stamp_ns.saturating_sub(LOOK_BACK_NS)..stamp_ns + 1;
        let selection = Selection::of_topics([topic_name(PLAN.spec.name)]).between(times);
        let mut last: Option<RawMessage> = None;
        for plan in self.recording.select(selection)? {
            last = Some(plan?);
        }
        let Some(last) = last else { return Ok(Vec::new()) };
        let (plan, _) = last.typed::<Plan>()?;
        let count = (plan.global_count as usize).min(plan.global_px.len());
        Ok(plan.global_px[..count].iter().map(|p| Point::new(p[0].into(), p[1].into())).collect())
    }

    fn span_s(&self) -> [f64; 2] {
        let stamps = || self.log.truth.iter().map(|truth| seconds(truth.header.stamp_ns));
        [stamps().next().unwrap_or(0.0), stamps().next_back().unwrap_or(1.0)]
    }

    /// When tasks began.
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
        let header = ["time", "process", "what", "lasted", "what there is to say"];
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
        let estimates = self.of_estimates();
        let relations = self.of_relations();
        let landmarks = self.landmarks.as_ref().map_or(Vec::new(), Landmarks::charts);
        let journeys = directions::over_time(self.log);
        if [&estimates, &relations, &landmarks, &journeys].iter().all(|charts| charts.is_empty())
            && !has_speed
        {
            return html! {};
        }
        html! {
            h2 { "Over time" }
            @if !marks.is_empty() || !faults.is_empty() { p.small {
                @if !marks.is_empty() { "Dashed: a task begins." } @if !faults.is_empty() { " Red: a process died or fell silent." }
            } }
            div.cards {
                @for (title, unit, series) in estimates.iter().chain(&relations).chain(&landmarks).chain(&journeys) { (chart(title, unit, series)) }
                @if has_speed { (chart("True speed", "m/s", &speed)) }
            }
        }
    }

    /// What the localizer in drawings said.
    fn of_estimates(&self) -> Vec<(&'static str, &'static str, Vec<Series>)> {
        let log = self.log;
        if log.instants.is_empty() {
            return Vec::new();
        }
        let errors = log.map().map(|sketch| local_errors_m(&log.instants, sketch)).unwrap_or_default();
        let of = |name: &str, value: &dyn Fn(usize) -> f64| Series {
            name: name.to_owned(),
            points: (0..log.instants.len()).map(|i| [seconds(log.instants[i].stamp_ns), value(i)]).collect(),
        };
        let error = of("error", &|i| errors.get(i).copied().unwrap_or(f64::NAN));
        let scales = [
            of("a, along the walls", &|i| log.instants[i].scales_pxpm[0]),
            of("b, across", &|i| log.instants[i].scales_pxpm[1]),
        ];
        let size = of("effective", &|i| log.instants[i].effective_sample_size);
        let misfit = of("misfit", &|i| -log.instants[i].fit);
        vec![
            ("Error in local metres", "m", vec![error]),
            ("Local scales", "px/m", scales.into()),
            ("Effective sample size", "particles", vec![size]),
            ("Misfit of the scan", "−ln p, mean beam", vec![misfit]),
        ]
    }

    /// What the localizer of corridors said, where it saw a pair of markers.
    fn of_relations(&self) -> Vec<(&'static str, &'static str, Vec<Series>)> {
        if self.log.relations.is_empty() {
            return Vec::new();
        }
        let of = |name: &str, value: &dyn Fn(&Relations) -> f64| Series {
            name: name.to_owned(),
            points: (self.log.relations.iter())
                .map(|said| {
                    [
                        seconds(said.header.stamp_ns),
                        if said.pair_age_s == 0.0 { value(said) } else { f64::NAN },
                    ]
                })
                .collect(),
        };
        let sign = |marker: &PairedMarker| match marker.marker_trend() {
            Trend::Towards => 0.0,
            Trend::Stable => 1.0,
            Trend::Away => 2.0,
            Trend::Unknown => f64::NAN,
        };
        let distance = |marker: &PairedMarker| marker.x_m.hypot(marker.y_m);
        let distances =
            [of("left", &|said| distance(&said.left)), of("right", &|said| distance(&said.right))];
        let trends = [of("left", &|said| sign(&said.left)), of("right", &|said| sign(&said.right))];
        let known = Series {
            name: "remembered".to_owned(),
            points: (self.log.relations.iter())
                .map(|said| [seconds(said.header.stamp_ns), f64::from(said.marker_count)])
                .collect(),
        };
        vec![
            ("Distance of the pair", "m, robot to marker", distances.into()),
            ("QTC of the pair", "0 towards, 1 stable, 2 away", trends.into()),
            ("Markers in memory", "markers", vec![known]),
        ]
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
        let header = ["process", "steps", "mean step", "longest a report, median", "longest of all"];
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
