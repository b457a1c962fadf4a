//! Drives a trial with the services' own cores and judges it.

use std::collections::BTreeSet;

use sketchnav_files::Disk;
use sketchnav_landmarks::doubts::Doubt;
use sketchnav_landmarks::instructions::Instructions;
use sketchnav_landmarks::mission::{LandmarksMission, Method};
use sketchnav_landmarks::{language, sketcher};
use sketchnav_rehearsal::{Onlooker, RehearsalError, Tap};
use sketchnav_schemas::channels::{ChannelSpec, STATUS};
use sketchnav_schemas::codes::{Process, TaskState};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::{Health, Here};
use sketchnav_schemas::mission::{MissionError, Task};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::time::seconds;
use sketchnav_sketch::mission::SketchMission;

use crate::error::EvalError;
use crate::experiments::cost::{Cost, clearance_m};
use crate::experiments::drawn_task::DrawnTask;
use crate::experiments::learned::series::Attended;
use crate::experiments::outcome::{Kind, TaskOutcome};
use crate::experiments::person::Bystander;
use crate::experiments::trial::{Page, Trial};
use crate::experiments::witnesses::Witness;
use crate::judge::log::Log;
use crate::judge::states::{Said, StateDriven};
use crate::judge::{self, TaskSpan, TaskVerdict};
use crate::sections::directions;

/// Minimum displacement, in metres, for the robot to count as having moved.
const STILL_M: f64 = 0.01;

/// A completed run.
#[derive(Debug)]
pub struct Driven {
    /// The run as it was driven.
    pub run: RunConfig,
    /// The mission as the navigator `sketch` reads it, if it drives by a drawing.
    pub sketch: Option<SketchMission>,
    /// Index within the trial of the run's first task.
    pub first_task: usize,
    /// The messages of the run.
    pub log: Log,
    /// Timestamps of the messages on all channels.
    pub stamps_ns: Vec<u64>,
    /// Wall-clock time that localizer and planner spent computing, in seconds.
    pub busy_s: f64,
    /// Number of times that a person answered the robot.
    pub answers: u32,
    /// Whether the person gave up while the robot was lost.
    pub is_left_lost: bool,
    /// The map of the drive, if it is to be evaluated by regions and doors.
    pub witness: Option<Witness>,
    /// The learner of the drive, if the robot is to learn from it.
    pub lesson: Option<Attended>,
    /// Verdicts on the tasks. If the trial restarts after failures, the last one is the first task that failed.
    pub verdicts: Vec<TaskVerdict>,
}

/// Records a run, and ends it early if the rest would not count: after a failed task if another run continues from there, after a
/// contact if contacts are failures, and when the person gives up.
struct Watcher<'a> {
    log: Log,
    stamps_ns: Vec<u64>,
    tasks: &'a [Task],
    ends_with_contact: bool,
    stops_at_failure: bool,
    failed: bool,
    bystander: Option<Bystander<'a>>,
    witness: Option<Witness>,
    lesson: Option<Attended>,
}

impl Tap for Watcher<'_> {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) {
        self.log.see(spec, message, cells);
        self.stamps_ns.push(erased::header(message).stamp_ns);
        if let Some(bystander) = &mut self.bystander {
            bystander.receive(spec, message, cells);
        }
        if let Some(witness) = &mut self.witness {
            witness.see(spec, message, cells);
        }
        if let Some(lesson) = &mut self.lesson {
            lesson.see(spec, message, self.log.truth.last());
        }
        if *spec == *STATUS.spec {
            self.watch();
        }
    }
}

impl Onlooker for Watcher<'_> {
    fn has_enough(&self) -> bool {
        self.stops_at_failure && self.failed
            || self.ends_with_contact && !self.log.contacts.is_empty()
            || self.bystander.as_ref().is_some_and(Bystander::gives_up)
    }

    fn here(&mut self) -> Option<Here> {
        let truth = self.log.truth.last()?;
        self.bystander.as_mut()?.answer(&truth.pose(), truth.header.stamp_ns)
    }
}

impl Watcher<'_> {
    /// Checks whether the latest status ends a task in failure.
    fn watch(&mut self) {
        let Some(status) = self.log.status.last() else { return };
        let Some(state) = TaskState::from_code(status.state) else { return };
        let Some(task) = self.tasks.get(status.task as usize) else { return };
        if state.is_end() {
            let there = self.log.truth.last().map(|truth| truth.pose());
            let there =
                task.there.is_unknown() || there.is_some_and(|pose| task.there.contains(pose.x, pose.y));
            self.failed |= state != TaskState::Reached || !there;
        }
    }
}

/// Drives one repetition of a trial.
///
/// If the trial has `restarts`, a run ends with the first task that fails, and another run starts at the goal of that task
/// (Boniardi et al. 2015, IV).
///
/// # Errors
/// [`EvalError::Trial`] if the mission cannot start, or an error from creating the page.
pub fn drive(trial: &Trial, method: &str, seed: u64) -> Result<Vec<Driven>, EvalError> {
    let trial = &*trial.prepared(method, seed)?;
    let page = trial.bytes.as_ref().map(Page::bytes).transpose()?;
    let mut runs = Vec::new();
    let mut first_task = 0;
    while first_task < trial.mission.task.len() {
        let driven = drive_from(trial, page.as_deref(), method, seed, first_task)
            .map_err(|cause| EvalError::Trial { trial: trial.name.clone(), cause: Box::new(cause) })?;
        first_task += driven.verdicts.len();
        runs.push(driven);
    }
    Ok(runs)
}

fn drive_from(
    trial: &Trial,
    page: Option<&[u8]>,
    method: &str,
    seed: u64,
    first_task: usize,
) -> Result<Driven, RehearsalError> {
    let wrong = |error: MissionError| RehearsalError::Stage(error.into());
    let run = trial.run(method, seed, first_task).map_err(wrong)?;
    let sheet = trial.sheet.as_ref();
    let sketch = sheet.map(|_| SketchMission::of(&run.mission)).transpose().map_err(wrong)?;
    let regains_pose = sheet.is_some_and(|sheet| !sheet.restarts.is_empty());
    let mut watcher = Watcher {
        log: Log::default(),
        stamps_ns: Vec::new(),
        tasks: &run.mission.task,
        ends_with_contact: trial.ends_with_contact,
        stops_at_failure: regains_pose || trial.tasks_are_one,
        failed: false,
        bystander: trial
            .person
            .as_deref()
            .map(|person| Bystander::new(person, sheet.map(|sheet| &*sheet.paper), &run, seed)),
        witness: trial.asks_rooms.then(|| Witness::new(&run)).flatten(),
        lesson: Attended::of(trial).map_err(|error| RehearsalError::Stage(error.into()))?,
    };
    let busy_s = match &trial.elsewhere {
        Some(simulator) => {
            simulator.drive(trial, &run, &mut watcher).map_err(RehearsalError::Stage)?;
            busy_s(&watcher.log.health)
        }
        None => {
            let rehearsal = trial.rehearsal(&run, page)?;
            let spent = rehearsal.thinking_for(trial.thinking_scans).run(&mut watcher)?;
            (spent.localizer + spent.planner).as_secs_f64()
        }
    };
    let Watcher { log, stamps_ns, bystander, witness, lesson, .. } = watcher;
    let answers = bystander.as_ref().map_or(0, Bystander::answers);
    let is_left_lost = bystander.is_some_and(|bystander| bystander.leaves_it_lost());
    let mut verdicts = judge::judge(&run.mission, &log.truth, &log.status, &log.contacts).tasks;
    if regains_pose {
        let failed = verdicts.iter().position(|verdict| !verdict.reached);
        verdicts.truncate(failed.map_or(verdicts.len(), |failed| failed + 1));
    }
    Ok(Driven {
        run,
        sketch,
        first_task,
        log,
        stamps_ns,
        busy_s,
        answers,
        is_left_lost,
        witness,
        lesson,
        verdicts,
    })
}

/// Returns the time that the processes of localizer and planner spent computing, in seconds, according to their last health
/// reports.
fn busy_s(health: &[Health]) -> f64 {
    let last = |process: Process| health.iter().rfind(|health| health.process == process.code());
    let both = [Process::Localizer, Process::Planner].into_iter().filter_map(last);
    both.map(|health| health.busy_ns as f64 / 1e9).sum()
}

/// Drives one repetition of a trial and returns how its tasks ended.
///
/// # Errors
/// Any error of [`drive`].
pub fn run(trial: &Trial, method: &str, repetition: u32, seed: u64) -> Result<Vec<TaskOutcome>, EvalError> {
    if let Some(series) = &trial.series {
        return series.run(trial, method, repetition, seed);
    }
    let runs = drive(trial, method, seed)?;
    Ok(runs.iter().flat_map(|driven| outcomes(trial, method, repetition, driven)).collect())
}

/// Returns the outcome of task `index` of a run, taking its path into account.
pub fn kind_of(trial: &Trial, driven: &Driven, span: Option<&TaskSpan>, index: usize) -> Kind {
    let verdict = &driven.verdicts[index];
    if trial.ends_with_contact && verdict.collisions > 0 {
        return Kind::Collided;
    }
    let kind = match Kind::of(verdict) {
        Kind::Reached => Kind::Reached,
        _ if trial.is_corridor() && never_moved(driven) => Kind::NeverMoved,
        // If a person is watching, a lost robot waits, so its task does not end.
        Kind::Aborted if driven.is_left_lost => Kind::Lost,
        kind => kind,
    };
    let drawn = || DrawnTask::of(trial, driven, span, index);
    let is_other_way =
        kind == Kind::Reached && drawn().is_some_and(|task| task.is_consistent() == Some(false));
    if is_other_way { Kind::WrongSide } else { kind }
}

/// Returns true if the robot never left its initial position.
fn never_moved(driven: &Driven) -> bool {
    let Some(first) = driven.log.truth.first().map(|truth| truth.pose().position()) else { return true };
    driven.log.truth.iter().all(|truth| truth.pose().position().distance(&first) < STILL_M)
}

/// Returns the cost of a task. Processor time is known only for the run as a whole, so it is divided in proportion to duration.
fn cost(trial: &Trial, driven: &Driven, span: &TaskSpan, time_s: f64) -> Cost {
    let log = &driven.log;
    let whole_s = log.truth.last().map_or(0.0, |truth| seconds(truth.header.stamp_ns));
    let is_within = |stamp_ns: &&u64| (span.begin_ns..=span.end_ns).contains(*stamp_ns);
    // In a map with thousands of faces, this would take longer than the drive.
    let world = trial.ends_with_contact.then(|| sketchnav_sim::files::world(&driven.run.mission.world).ok());
    let half_extents_m = driven.run.robot.half_extents_m();
    let cost = Cost::new(span.of(&log.commands), span.of(&log.truth), time_s, driven.run.robot.mass_kg);
    Cost {
        messages: driven.stamps_ns.iter().filter(is_within).count() as u64,
        clearance_m: world
            .flatten()
            .and_then(|world| clearance_m(span.of(&log.truth), half_extents_m, &world)),
        busy_s: driven.busy_s * time_s / whole_s.max(time_s).max(f64::MIN_POSITIVE),
        ..cost
    }
}

/// Returns the states of a drive by landmark states. There are none for other drives, nor for drives by words, which draw nothing.
fn states(driven: &Driven, is_reached: bool) -> Vec<StateDriven> {
    let log = &driven.log;
    let by_states =
        LandmarksMission::of(&driven.run.mission).is_ok_and(|it| it.method == Method::Chronis2007);
    let instructions = Instructions::read(&log.landmark_route).ok().filter(|_| by_states);
    let Some(Instructions { sketch: Some(sketch), words, .. }) = instructions else { return Vec::new() };
    let Ok(route) = language::read(&words) else { return Vec::new() };
    let said = Said {
        route: &route,
        sketch: &sketch,
        views: &log.landmark_views,
        progress: &log.landmark_progress,
        truth: &log.truth,
    };
    judge::states::states(&driven.run, &said, is_reached)
}

/// Returns the kinds of warnings about the sketch of a drive past landmarks, without duplicates.
fn warnings(driven: &Driven) -> Vec<String> {
    let instructions = Instructions::read(&driven.log.landmark_route).ok();
    let doubts =
        instructions.and_then(|instructions| sketcher::doubts_about(&driven.run, &instructions).ok());
    let kinds = doubts.unwrap_or_default().iter().map(Doubt::kind).collect::<BTreeSet<_>>();
    kinds.into_iter().map(str::to_owned).collect()
}

/// A driven task with its verdict, its time span, and how it ended.
struct Ended {
    verdict: TaskVerdict,
    span: Option<TaskSpan>,
    kind: Kind,
}

/// Returns the outcomes of the tasks of a run, or a single outcome if they count as one.
pub fn outcomes(trial: &Trial, method: &str, repetition: u32, driven: &Driven) -> Vec<TaskOutcome> {
    let spans = judge::spans(driven.run.mission.task.len(), &driven.log.status);
    let each = driven.verdicts.iter().cloned().zip(spans).enumerate().map(|(i, (verdict, span))| Ended {
        verdict,
        span,
        kind: kind_of(trial, driven, span.as_ref(), i),
    });
    let ended = if trial.tasks_are_one {
        each.reduce(Ended::followed_by).into_iter().collect()
    } else {
        each.collect::<Vec<_>>()
    };
    // A world whose files cannot be read has no landmarks to judge by.
    let journeys = directions::verdicts(&driven.run, &Disk, &driven.log).unwrap_or_default();
    let outcome = |(i, Ended { verdict, span, kind }): (usize, Ended)| {
        let end = span.and_then(|span| span.of(&driven.log.truth).last().copied());
        let drawn = DrawnTask::of(trial, driven, span.as_ref(), i);
        TaskOutcome {
            id: format!("{}#{repetition}", trial.name),
            drawing: trial.drawing.clone(),
            method: method.to_owned(),
            seed: driven.run.seed,
            task: verdict.name,
            task_index: driven.first_task + i,
            kind,
            reason: verdict.reason,
            time_s: verdict.time_s,
            path_m: verdict.path_m,
            end: end.map(|truth| truth.pose()).map(|pose| [pose.x, pose.y, pose.yaw_rad.to_degrees()]),
            final_error_m: verdict.final_error_m,
            collisions: verdict.collisions,
            cost: span.map_or_else(Cost::default, |span| cost(trial, driven, &span, verdict.time_s)),
            states: states(driven, kind == Kind::Reached),
            warnings: warnings(driven),
            answers: driven.answers,
            cluster: trial.cluster.clone(),
            on_sketch: trial
                .sheet
                .is_some()
                .then(|| drawn.as_ref().is_some_and(DrawnTask::is_reached_on_sketch)),
            displacement_m: drawn.and_then(|task| task.displacement_m()),
            rooms: driven
                .witness
                .as_ref()
                .map(|witness| witness.said(&driven.log, i, &driven.run.mission.task[i].there)),
            journey: journeys.get(i).cloned(),
            in_series: None,
        }
    };
    ended.into_iter().enumerate().map(outcome).collect()
}

impl Ended {
    /// Combines two tasks into one. The first failure determines the result, and everything after it is left out.
    fn followed_by(self, next: Self) -> Self {
        if self.kind != Kind::Reached {
            return self;
        }
        let begin_ns = self.span.map(|span| span.begin_ns);
        let span = next.span.map(|span| TaskSpan { begin_ns: begin_ns.unwrap_or(span.begin_ns), ..span });
        let verdict = TaskVerdict {
            name: format!("{}, {}", self.verdict.name, next.verdict.name),
            time_s: self.verdict.time_s + next.verdict.time_s,
            path_m: self.verdict.path_m + next.verdict.path_m,
            collisions: self.verdict.collisions + next.verdict.collisions,
            ..next.verdict
        };
        Self { verdict, span: span.or(self.span), kind: next.kind }
    }
}
