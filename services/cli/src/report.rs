//! What a run came to: read from its recording, judged, drawn, printed.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use serde::Serialize;
use sketchnav_evaluation::judge::log::Log;
use sketchnav_evaluation::judge::{self, TaskSpan, TaskVerdict, Verdict};
use sketchnav_evaluation::picture::{self, FloorPicture, FloorShapes, SketchPicture, TaskMark, TaskPicture};
use sketchnav_recordings::Recording;
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::{Base, Point, Pose, Sketch, World};
use sketchnav_schemas::message::{MarkerView, Particles, People};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;
use sketchnav_sketch::planner::ROOMS;
use sketchnav_supervisor::Supervisor;

use crate::failure::Failure;
use crate::output::out;
use crate::recordings::report::directions::plane_picture;
use crate::recordings::report::landmarks::Landmarks;
use crate::recordings::whole::Whole;

/// A run's figures; `--json` prints just this.
#[derive(Debug, Serialize)]
pub struct Report {
    mission: String,
    seed: u64,
    #[serde(flatten)]
    verdict: Verdict,
    /// How the method drove instead, and why, where it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    driven: Option<&'static str>,
    wall_seconds: f64,
    real_time_factor: f64,
    lost_messages: u64,
    /// The planned faults that did not happen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outstanding_faults: Vec<OutstandingFault>,
    recording: String,
    pictures: Vec<PathBuf>,
    processes: Vec<ProcessFigures>,
}

/// A planned fault that did not happen: its message never came.
#[derive(Debug, Serialize)]
struct OutstandingFault {
    /// In the plan, from 1.
    number: usize,
    words: String,
}

/// What a process said about itself at its end.
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
    /// Reads the recording of `run`, judges it, and draws it into `folder`.
    pub fn new(
        run: &RunConfig,
        supervisor: &Supervisor,
        wall: Duration,
        folder: &Path,
    ) -> Result<Self, Failure> {
        let recording = run.recording.as_deref().unwrap_or_default();
        let whole = Whole::of(Path::new(recording))?;
        let of_this_run = || format!("{recording}: the recording of this run");
        let file = Recording::open(whole.path()).with_context(of_this_run)?;
        let log = Log::with_particles(&file).with_context(of_this_run)?;
        let verdict = judge::judge(&run.mission, &log.truth, &log.status, &log.contacts);
        let missing = sketchnav_recordings::info::info(whole.path()).context(recording.to_owned())?.missing;
        let pictures = draw(run, &file, &log, &verdict, folder)?;
        // Who did not run has said nothing: mostly the pad.
        let processes = channels::SERVICES.into_iter().chain(channels::EXTRAS);
        let processes: Vec<_> = processes.filter_map(|process| figures(process, supervisor)).collect();
        let lost: u64 = processes.iter().map(|p| p.lost_messages).sum();
        Ok(Self {
            mission: run.mission.name.clone(),
            seed: run.seed,
            driven: log.drove_by_rooms().then_some(ROOMS),
            wall_seconds: wall.as_secs_f64(),
            real_time_factor: verdict.sim_seconds / wall.as_secs_f64(),
            verdict,
            // The recorder counts its own losses too; a file that lacks more has lost them on disk.
            lost_messages: lost.max(missing),
            outstanding_faults: supervisor
                .outstanding_faults()
                .iter()
                .map(|(number, fault)| OutstandingFault { number: *number, words: fault.words() })
                .collect(),
            recording: recording.to_owned(),
            pictures,
            processes,
        })
    }

    /// Whether every task was reached.
    pub fn success(&self) -> bool {
        self.verdict.success
    }

    /// Prints the table, or one JSON object.
    pub fn print(&self, json: bool) -> Result<(), Failure> {
        if json {
            out!("{}", serde_json::to_string(self).context("the report as JSON")?)?;
            return Ok(());
        }
        out!("{}", self.table())?;
        let tasks = &self.verdict.tasks;
        let reached = tasks.iter().filter(|task| task.reached).count();
        out!(
            "{reached} of {} tasks reached in {:.0} s simulated, {:.1} s on the clock ({:.0} × real time); {} messages lost",
            tasks.len(),
            self.verdict.sim_seconds,
            self.wall_seconds,
            self.real_time_factor,
            self.lost_messages,
        )?;
        if let Some(how) = self.driven {
            out!("method     {how}")?;
        }
        for OutstandingFault { number, words } in &self.outstanding_faults {
            out!("not done   fault {number} of the plan: {words}; its message never came")?;
        }
        out!("recording  {}", self.recording)?;
        for picture in &self.pictures {
            out!("picture    {}", picture.display())?;
        }
        Ok(())
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
    run: &RunConfig,
    recording: &Recording,
    log: &Log,
    verdict: &Verdict,
    folder: &Path,
) -> anyhow::Result<Vec<PathBuf>> {
    let mut pictures = Vec::new();
    let sketch = match sketch_picture(run, log, verdict)? {
        None => Landmarks::of(recording)?.and_then(|landmarks| landmarks.sketch_picture()),
        svg => svg,
    };
    if let Some(svg) = sketch {
        pictures.push(write(folder.join("sketch.svg"), &svg)?);
    }
    let (name, svg) = ground_picture(run, log, verdict)?;
    pictures.push(write(folder.join(name), &svg)?);
    Ok(pictures)
}

/// The drawing with the estimated trajectory; `None` where the recording has no drawing.
pub fn sketch_picture(run: &RunConfig, log: &Log, verdict: &Verdict) -> anyhow::Result<Option<String>> {
    let Some((map, cells)) = &log.sketch else { return Ok(None) };
    let spans = judge::spans(run.mission.task.len(), &log.status);
    let tasks = sketch_tasks(run, log, verdict, &spans);
    let svg = picture::sketch(&SketchPicture {
        title: &format!(
            "{}, seed {}: the sketch, and where the localizer believed the robot to be",
            run.mission.name, run.seed
        ),
        width_px: map.width_px,
        height_px: map.height_px,
        cells,
        start: map.start.pose(),
        tasks: &tasks,
    })?;
    Ok(Some(svg))
}

/// The true floor with the true trajectory, or the plane of dots; and the name of a file for it.
pub fn ground_picture(
    run: &RunConfig,
    log: &Log,
    verdict: &Verdict,
) -> anyhow::Result<(&'static str, String)> {
    if let Some(svg) = plane_picture(run, log, verdict)? {
        return Ok(("plane.svg", svg));
    }
    let svg = floor(run, log, verdict, &judge::spans(run.mission.task.len(), &log.status))?;
    Ok(("floor.svg", svg))
}

fn write(path: PathBuf, svg: &str) -> anyhow::Result<PathBuf> {
    std::fs::write(&path, svg).with_context(|| path.display().to_string())?;
    Ok(path)
}

fn sketch_tasks(
    run: &RunConfig,
    log: &Log,
    verdict: &Verdict,
    spans: &[Option<TaskSpan>],
) -> Vec<TaskPicture<Sketch>> {
    let task = |i: usize| {
        let route = log.route.as_deref();
        let marks = route.and_then(|route| Some(route.points(route.tasks().get(i)?).collect()));
        let particles = of(&spans[i], &log.particles).last().map(cloud);
        TaskPicture {
            name: verdict.tasks[i].name.clone(),
            marks: marks.unwrap_or_default(),
            place: Vec::new(),
            trail: of(&spans[i], &log.estimates).iter().map(|e| e.pose.pose().position()).collect(),
            particles: particles.unwrap_or_default(),
            outcome: outcome(&spans[i], &verdict.tasks[i]),
        }
    };
    (0..run.mission.task.len()).map(task).collect()
}

/// The places of particles.
pub fn cloud(particles: &Particles) -> Vec<Point<Sketch>> {
    let count = (particles.count as usize).min(particles.particles.len());
    particles.particles[..count].iter().map(|p| Point::new(p.x_px.into(), p.y_px.into())).collect()
}

fn of<'a, T: sketchnav_schemas::message::Message>(span: &Option<TaskSpan>, messages: &'a [T]) -> &'a [T] {
    span.as_ref().map_or(&[], |span| span.of(messages))
}

/// How a task ended, as a picture shows it.
pub fn outcome(span: &Option<TaskSpan>, verdict: &TaskVerdict) -> TaskMark {
    match (span, verdict.reached) {
        (None, _) => TaskMark::NotBegun,
        (Some(_), true) => TaskMark::Reached,
        (Some(_), false) => TaskMark::Failed,
    }
}

/// The ways of the people.
fn ways(people: &[People]) -> Vec<Vec<Point<World>>> {
    let count = people.iter().map(|all| all.people().len()).max().unwrap_or_default();
    let way = |person: usize| {
        let places = people.iter().filter_map(|all| all.people().get(person));
        places.map(|walking| Point::new(walking.x_m, walking.y_m)).collect()
    };
    (0..count).map(way).collect()
}

/// Moments at which the camera's view is shown.
const VIEWS: usize = 5;

/// What the camera had in view at some moments spread over the run, as polygons.
fn views(log: &Log) -> Vec<Vec<Point<World>>> {
    let step = (log.markers.len() / VIEWS).max(1);
    let shown = log.markers.iter().step_by(step).take(VIEWS);
    shown.filter_map(|view| Some(sector(view, &log.pose_at(view.header.stamp_ns)?))).collect()
}

/// The field of view between the camera's shortest and longest range.
fn sector(view: &MarkerView, robot: &Pose<World>) -> Vec<Point<World>> {
    const STEPS: i32 = 12;
    let [x, y, yaw_rad] = [view.camera_x_m, view.camera_y_m, view.camera_yaw_rad].map(f64::from);
    let camera = robot.compose(&Pose::<Base>::new(x, y, yaw_rad));
    let half_rad = f64::from(view.half_view_rad);
    let at = |range_m: f32, k: i32| {
        let (sin, cos) = (camera.yaw_rad + half_rad * f64::from(k) / f64::from(STEPS)).sin_cos();
        Point::new(camera.x + f64::from(range_m) * cos, camera.y + f64::from(range_m) * sin)
    };
    let far = (-STEPS..=STEPS).map(|k| at(view.range_max_m, k));
    far.chain((-STEPS..=STEPS).rev().map(|k| at(view.range_min_m, k))).collect()
}

fn floor(
    run: &RunConfig,
    log: &Log,
    verdict: &Verdict,
    spans: &[Option<TaskSpan>],
) -> anyhow::Result<String> {
    let description = sketchnav_sim::files::world(&run.mission.world)?;
    let point = |p: &[f64; 2]| Point::<World>::new(p[0], p[1]);
    let tasks = run.mission.task.iter().enumerate().map(|(i, task)| TaskPicture {
        name: task.name.clone(),
        marks: (!task.there.is_unknown()).then(|| point(&task.there.middle())).into_iter().collect(),
        place: picture::place_outline(&task.there),
        trail: of(&spans[i], &log.truth).iter().map(|t| t.pose().position()).collect(),
        particles: Vec::new(),
        outcome: outcome(&spans[i], &verdict.tasks[i]),
    });
    let began = log.contacts.iter().filter(|contact| contact.begins == 1);
    let contacts: Vec<_> =
        began.map(|contact| Point::new(contact.position_m[0], contact.position_m[1])).collect();
    let start = &run.mission.start;
    Ok(picture::floor(&FloorPicture {
        title: &format!(
            "{}, seed {}: the true floor, and where the robot truly was",
            run.mission.name, run.seed
        ),
        shapes: &FloorShapes::of(&description),
        people: &ways(&log.people),
        views: &views(log),
        start: Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians()),
        tasks: &tasks.collect::<Vec<_>>(),
        contacts: &contacts,
    }))
}
