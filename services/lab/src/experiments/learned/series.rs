//! A series of drives: the first one by a drawing, and the others in the map learned on it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use rand::RngExt;
use serde::{Deserialize, Serialize};
use sketchnav_mapping::{Cell, Map};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::{TaskState, Tracking};
use sketchnav_schemas::geometry::{Point, Pose, World};
use sketchnav_schemas::message::GroundTruth;
use sketchnav_schemas::mission::{Mission, Place, Start, Task};
use sketchnav_schemas::seed;
use sketchnav_schemas::time::seconds;
use sketchnav_sim::SimError;
use sketchnav_sketch::learned::{CELL_M, CELLS_PER_M, DrawingFile, LearnError, Learned, Learner};
use sketchnav_sketch::messages::{ESTIMATE, PoseEstimate};
use sketchnav_sketch::mission::{Aim, SketchMission};
use sketchnav_sketch::reading::{ImageTask, Intent, Options};
use sketchnav_sketch::sketcher;

use super::cause::Cause;
use crate::error::{EvalError, read};
use crate::experiments::ground::{Ground, length_m};
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::run::{self, Driven};
use crate::experiments::trial::{Trial, time_limit_s};
use crate::judge;

/// File name that missions use for a learned map. There is no such file.
pub const LEARNED_FILE: &str = "first.learned";
/// Maximum distance, in metres, from the centre of a goal's place at which free floor must have been seen for the goal to count as
/// seen.
const SEEN_WITHIN_M: f64 = 0.5;
/// Minimum distance, in metres, of a start from where people begin to walk.
const OFF_PEOPLE_M: f64 = 1.0;
/// Distance driven, in metres, between the poses of the first drive that are kept.
const POSE_EVERY_M: f64 = 0.2;
/// Name of the task that leads back to the start of the first drive.
const BACK: &str = "back to the start";
/// Maximum distance, in metres, from the start of the first drive at which that task counts as reached.
const BACK_WITHIN_M: f64 = 0.5;
/// Maximum number of starts to try.
const ATTEMPTS: usize = 10_000;
/// Maximum distance, in metres, between the estimate and the truth for the robot to count as localized.
pub(super) const FOUND_WITHIN_M: f64 = 0.5;

/// A drive of a series.
#[derive(Debug, Clone)]
pub struct Series {
    /// The first drive of the series.
    pub first: Arc<First>,
    /// Number of the drive. 0 is the first drive itself.
    pub drive: usize,
    /// Where the drive begins and what its tasks are. Not used for the first drive.
    pub kind: Later,
}

/// The kind of a later drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Later {
    /// The robot was carried anywhere, with any heading, and drives those tasks of the first drive that it accepts.
    Carried,
    /// The robot stands where the first drive ended, and drives back to where it began.
    Stayed,
}

/// The first drive of a series, by the drawing.
#[derive(Debug)]
pub struct First {
    trial: Trial,
    ground: Arc<Ground>,
    /// Starting points of people, in metres.
    people: Vec<[f64; 2]>,
    /// The first drive as driven last. All drives of a series have the same seed, so it is driven only once.
    made: Mutex<Option<Arc<Made>>>,
}

/// The result of the first drive.
#[derive(Debug)]
struct Made {
    method: String,
    seed: u64,
    outcomes: Vec<TaskOutcome>,
    /// What was learned, or `None` if nothing was.
    learned: Option<Lesson>,
}

/// What was learned on the first drive, with what is needed to compare it with the world.
#[derive(Debug)]
pub(super) struct Lesson {
    pub(super) learned: Learned,
    /// The robot's poses on the first drive, in the world and in the map.
    poses: Vec<(Pose<World>, Pose<Map>)>,
    /// Where the robot believes the goals of those tasks to be that it accepts, by the names of the tasks, in metres of the true
    /// world.
    pub(super) goals: BTreeMap<String, [f64; 2]>,
    /// The task that leads back to the start, if the mission marks the start.
    back: Option<Task>,
    /// The robot's true pose at the end of the first drive.
    end: Option<Pose<World>>,
}

/// What is known about a task as part of a series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct InSeries {
    /// Number of the drive, from 0.
    pub drive: usize,
    /// Length of the shortest path to the goal, in metres, from the previous goal or from the start.
    pub way_m: f64,
    /// Whether the true place of the goal was seen on the first drive.
    pub is_seen: bool,
    /// Whether the robot accepts the task in the learned map.
    pub is_accepted: bool,
    /// The result of localization at the start, or `None` except for the first task of a later drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub search: Option<Search>,
    /// Why the robot failed at the task, or `None` if it did not fail or this is the first drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<Cause>,
}

/// The result of localization without a marked start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Search {
    /// The estimate was right at the end of the task. The search took this time, in seconds.
    Found(f64),
    /// The robot reported that it is lost.
    Lost,
    /// The estimate was wrong, but the robot did not report that it is lost.
    Wrong,
}

impl Trial {
    /// Returns the trial as it is driven with a seed. For a later drive of a series, this drives the first one if necessary.
    ///
    /// # Errors
    /// Any error of the first drive.
    pub fn prepared(&self, method: &str, seed: u64) -> Result<Cow<'_, Self>, EvalError> {
        match &self.series {
            Some(series) if series.drive > 0 => Ok(Cow::Owned(series.prepare(self, method, seed)?)),
            _ => Ok(Cow::Borrowed(self)),
        }
    }
}

impl Series {
    /// Drives one repetition of a trial of the series, and returns how its tasks ended.
    ///
    /// # Errors
    /// Any error of the drive, or of the first drive of the series.
    pub fn run(
        &self,
        trial: &Trial,
        method: &str,
        repetition: u32,
        seed: u64,
    ) -> Result<Vec<TaskOutcome>, EvalError> {
        let made = self.first.made(method, seed)?;
        if self.drive == 0 {
            let name = |ended: &TaskOutcome| TaskOutcome {
                id: format!("{}#{repetition}", trial.name),
                ..ended.clone()
            };
            return Ok(made.outcomes.iter().map(name).collect());
        }
        let prepared = self.prepare(trial, method, seed)?;
        let runs = run::drive(&prepared, method, seed)?;
        let mut outcomes: Vec<_> =
            runs.iter().flat_map(|driven| run::outcomes(&prepared, method, repetition, driven)).collect();
        let drive = (self.drive, &prepared.mission);
        self.first.describe(&mut outcomes, drive, made.learned.as_ref(), runs.first());
        Ok(outcomes)
    }

    /// Returns a trial in the learned map that has those tasks of this drive that the robot accepts. There may be none.
    fn prepare(&self, trial: &Trial, method: &str, seed: u64) -> Result<Trial, EvalError> {
        let made = self.first.made(method, seed)?;
        let mut trial = Trial { series: None, ..trial.clone() };
        let tasks = std::mem::take(&mut trial.mission.task);
        let Some(lesson) = &made.learned else { return Ok(trial) };
        let tasks = match self.kind {
            Later::Carried => tasks,
            Later::Stayed => lesson.back.clone().into_iter().collect(),
        };
        let accepted = tasks.into_iter().filter(|task| lesson.goals.contains_key(&task.name));
        let tasks: Vec<_> = accepted.collect();
        let Some(goal) = tasks.first().map(|task| task.there.middle()) else { return Ok(trial) };
        let start = match self.kind {
            Later::Carried => self.first.start(lesson, goal, seed, self.drive),
            Later::Stayed => lesson
                .end
                .map(|end| Start { world: [end.x, end.y], world_heading_deg: end.yaw_rad.to_degrees() }),
        };
        let Some(start) = start else { return Ok(trial) };
        let ways = self.first.ways(start.world, &tasks);
        let limited = |(task, way_m): (Task, Option<f64>)| Task {
            time_limit_s: way_m.map_or(task.time_limit_s, time_limit_s),
            ..task
        };
        trial.mission.task = tasks.into_iter().zip(ways).map(limited).collect();
        trial.mission.start = start;
        let given = &mut trial.mission.navigator.given;
        given.retain(|key, _| key != "start" && key != "start_heading_deg");
        given.insert("learned_file".to_owned(), LEARNED_FILE.into());
        trial.learned = Some(lesson.learned.to_bytes().into());
        Ok(trial)
    }
}

impl First {
    /// Creates the first drive of a series. `people` are the positions where people begin to walk, in metres.
    pub fn new(trial: Trial, ground: Arc<Ground>, people: Vec<[f64; 2]>) -> Self {
        Self { trial, ground, people, made: Mutex::default() }
    }

    /// Returns the first drive with the given method and seed. Drives it unless it was the last one driven.
    fn made(&self, method: &str, seed: u64) -> Result<Arc<Made>, EvalError> {
        let mut kept = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = kept.as_ref().filter(|made| made.method == method && made.seed == seed) {
            return Ok(made.clone());
        }
        let runs = run::drive(&self.trial, method, seed)?;
        let mut outcomes: Vec<_> =
            runs.iter().flat_map(|driven| run::outcomes(&self.trial, method, 1, driven)).collect();
        let learned = runs.first().map(|driven| self.learn(driven)).transpose()?.flatten();
        self.describe(&mut outcomes, (0, &self.trial.mission), learned.as_ref(), None);
        let made = Arc::new(Made { method: method.to_owned(), seed, outcomes, learned });
        Ok(kept.insert(made).clone())
    }

    /// Returns what can be learned from a drive, or `None` if nothing can.
    fn learn(&self, driven: &Driven) -> Result<Option<Lesson>, EvalError> {
        let Some(Attended { learner, poses }) = &driven.lesson else { return Ok(None) };
        let mission = SketchMission::of(&driven.run.mission).map_err(SimError::from)?;
        let (drawing, places) = sketcher::understand(&driven.run, &sketchnav_navigators::read_file)?;
        let file = DrawingFile::of(&mission.drawing, &read(mission.drawing.as_ref())?);
        let learned = match learner.learned(file, &drawing, &places) {
            Ok(learned) => learned,
            Err(LearnError::Blind | LearnError::NowhereInTheDrawing) => return Ok(None),
            Err(error) => return Err(EvalError::Learn { trial: self.trial.name.clone(), cause: error }),
        };
        let options = Options::of_mission(&driven.run.mission, driven.run.seed)?;
        let back = mission.start.map(|at| self.back(at));
        let mut with_back = driven.run.mission.clone();
        with_back.task.extend(back.clone());
        let tasks =
            Intent::of_mission(&SketchMission::of(&with_back).map_err(SimError::from)?, &drawing)?.tasks;
        let end = driven.log.truth.last().map(GroundTruth::pose);
        let mut lesson = Lesson { learned, poses: poses.clone(), goals: BTreeMap::new(), back, end };
        let names = with_back.task.iter().map(|task| task.name.clone());
        let goals = names.zip(tasks).filter_map(|(name, task)| Some((name, lesson.goal(task, &options)?)));
        lesson.goals = goals.collect();
        Ok(Some(lesson))
    }

    /// Returns the task that leads back to the start, which is at the pixel `at` of the drawing.
    fn back(&self, at: [f64; 2]) -> Task {
        let center = Some(self.trial.mission.start.world);
        Task {
            name: BACK.to_owned(),
            there: Place { center, radius_m: Some(BACK_WITHIN_M), polygon: None },
            time_limit_s: 0.0,
            given: Aim::Goal(at).given(),
        }
    }

    /// Returns a start in the learned map, with any heading, from which there is a path to the goal.
    fn start(&self, lesson: &Lesson, goal: [f64; 2], seed: u64, drive: usize) -> Option<Start> {
        let mut rng = seed::stream(seed, &format!("eval/drive {drive}"));
        let free = lesson.free_places();
        let goal = self.ground.nearest(goal, |_| true)?;
        let is_off_people =
            |at: [f64; 2]| self.people.iter().all(|p| (p[0] - at[0]).hypot(p[1] - at[1]) > OFF_PEOPLE_M);
        (0..ATTEMPTS).find_map(|_| {
            let at = *free.get(rng.random_range(0..free.len().max(1)))?;
            let heading_deg = rng.random_range(-180.0..180.0);
            let is_good = self.ground.fits(at) && is_off_people(at) && self.ground.way(at, goal).is_some();
            is_good.then_some(Start { world: at, world_heading_deg: heading_deg })
        })
    }

    /// Returns the length of the shortest path to each goal, in metres, from the previous goal or from `start`.
    fn ways(&self, start: [f64; 2], tasks: &[Task]) -> Vec<Option<f64>> {
        let standing = |at| self.ground.nearest(at, |_| true);
        let mut from = standing(start);
        let mut way = |task: &Task| {
            let to = standing(task.there.middle());
            let way = from.zip(to).and_then(|(from, to)| self.ground.way(from, to));
            from = to;
            Some(length_m(&way?))
        };
        tasks.iter().map(&mut way).collect()
    }

    /// Adds what is known about the tasks of a drive to their outcomes. `driven` is the drive, unless it is the first one.
    fn describe(
        &self,
        outcomes: &mut [TaskOutcome],
        (drive, mission): (usize, &Mission),
        lesson: Option<&Lesson>,
        driven: Option<&Driven>,
    ) {
        let ways = self.ways(mission.start.world, &mission.task);
        for ((ended, task), way_m) in outcomes.iter_mut().zip(&mission.task).zip(ways) {
            let later = lesson.zip(driven);
            let failed = later.filter(|_| !ended.is_success());
            ended.in_series = Some(InSeries {
                drive,
                way_m: way_m.unwrap_or_default(),
                is_seen: lesson.is_some_and(|lesson| lesson.has_seen(task.there.middle())),
                is_accepted: lesson.is_some_and(|lesson| lesson.goals.contains_key(&task.name)),
                search: later.filter(|_| ended.task_index == 0).map(|(lesson, driven)| lesson.search(driven)),
                cause: failed.and_then(|(lesson, driven)| lesson.cause(driven, task, ended.task_index)),
            });
        }
    }
}

/// Converts a position from one frame to another. The frames are aligned at the pose of the drive that is nearest to the position,
/// because the map drifts.
fn carried<'a, A: 'a, B: 'a>(
    [x, y]: [f64; 2],
    poses: impl Iterator<Item = (&'a Pose<A>, &'a Pose<B>)>,
) -> [f64; 2] {
    let at = Pose::<A>::new(x, y, 0.0);
    let off = |pose: &Pose<A>| pose.position().distance(&at.position());
    let near = poses.min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    near.map_or([x, y], |(from, to)| {
        let there = to.compose(&from.motion_to(&at));
        [there.x, there.y]
    })
}

impl Lesson {
    /// Returns the centres of the map's free cells, in metres of the true world.
    fn free_places(&self) -> Vec<[f64; 2]> {
        let map = &self.learned.map;
        let middle =
            |index: usize| map.of_drawn([index % map.width, index / map.width].map(|cell| cell as f64 + 0.5));
        let free = (0..map.cells.len()).filter(|&index| map.cells[index] == Cell::Free);
        free.map(|index| self.in_world(middle(index))).collect()
    }

    /// Returns where the robot believes a task's goal to be, in metres of the true world, or `None` if it refuses the task.
    fn goal(&self, task: ImageTask, options: &Options) -> Option<[f64; 2]> {
        let intent = Intent { tasks: vec![task], ..Intent::default() };
        let (_, places) = self.learned.place(LEARNED_FILE, &intent, options).ok()?;
        let end = places.tasks.first()?.end();
        Some(self.in_world(self.learned.map.of_drawn([end.x, end.y])))
    }

    fn in_world(&self, at: [f64; 2]) -> [f64; 2] {
        carried(at, self.poses.iter().map(|(truth, seen)| (seen, truth)))
    }

    pub(super) fn in_map(&self, at: [f64; 2]) -> [f64; 2] {
        carried(at, self.poses.iter().map(|(truth, seen)| (truth, seen)))
    }

    /// Returns true if free floor was seen near a position in the true world.
    fn has_seen(&self, at: [f64; 2]) -> bool {
        let [x, y] = self.in_map(at);
        let reach = (SEEN_WITHIN_M * CELLS_PER_M) as i64;
        let around = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx, dy]));
        let near = around.map(|step| step.map(|cells| cells as f64 * CELL_M));
        near.filter(|[dx, dy]| dx.hypot(*dy) <= SEEN_WITHIN_M)
            .any(|[dx, dy]| self.learned.map.at_m([x + dx, y + dy]) == Cell::Free)
    }

    /// Returns the distance between an estimate and the truth, in metres. `truth` contains the true poses during the same task.
    pub(super) fn off_m(&self, estimate: &PoseEstimate, truth: &[GroundTruth]) -> f64 {
        let stamp_ns = estimate.header.stamp_ns;
        let since = truth.partition_point(|truth| truth.header.stamp_ns < stamp_ns);
        let Some(truth) = truth.get(since).or(truth.last()) else { return f64::INFINITY };
        let at = self.in_world(self.learned.map.of_drawn([estimate.pose.x_px, estimate.pose.y_px]));
        truth.pose().position().distance(&Point::new(at[0], at[1]))
    }

    /// Returns the result of localization in the first task of a drive.
    fn search(&self, driven: &Driven) -> Search {
        let spans = judge::spans(driven.run.mission.task.len(), &driven.log.status);
        let Some(span) = spans.first().copied().flatten() else { return Search::Wrong };
        let (estimates, truth) = (span.of(&driven.log.estimates), span.of(&driven.log.truth));
        let is_right = |estimate: &PoseEstimate| self.off_m(estimate, truth) <= FOUND_WITHIN_M;
        let knows =
            |estimate: &PoseEstimate| Tracking::from_code(estimate.tracking) == Some(Tracking::Tracking);
        let wrong = estimates.iter().rposition(|estimate| !is_right(estimate));
        let right = &estimates[wrong.map_or(0, |last| last + 1)..];
        match (right.iter().find(|estimate| knows(estimate)), right.last()) {
            (Some(since), Some(last)) if knows(last) => {
                Search::Found(seconds(since.header.stamp_ns.saturating_sub(span.begin_ns)))
            }
            _ if span.state == TaskState::Lost => Search::Lost,
            _ => Search::Wrong,
        }
    }
}

/// A learner during a drive, and the robot's true poses beside those in its map. Maps drift, by metres along a featureless
/// corridor, so positions in the map and in the world are related by the robot's poses nearby.
#[derive(Debug)]
pub struct Attended {
    learner: Learner,
    poses: Vec<(Pose<World>, Pose<Map>)>,
}

impl Attended {
    /// Creates the learner of a trial, or returns `None` if the robot does not learn from it.
    ///
    /// # Errors
    /// [`LearnError`] if the robot has no laser that is suitable for mapping.
    pub fn of(trial: &Trial) -> Result<Option<Self>, LearnError> {
        let learner = trial.is_learned_from.then(|| Learner::new(&trial.robot)).transpose()?;
        Ok(learner.map(|learner| Self { learner, poses: Vec::new() }))
    }

    /// Processes a message. `truth` is the robot's true pose.
    pub fn see(&mut self, channel: &ChannelSpec, message: &[u8], truth: Option<&GroundTruth>) {
        self.learner.see(channel, message);
        let Some(truth) = truth.filter(|_| ESTIMATE.message(channel, message).is_some()) else { return };
        let (pose, seen) = (truth.pose(), self.learner.pose());
        let is_far =
            |(last, _): &(Pose<World>, Pose<Map>)| last.position().distance(&pose.position()) > POSE_EVERY_M;
        if self.poses.last().is_none_or(is_far) {
            self.poses.push((pose, seen));
        }
    }
}
