//! Judges the outcome of a mission by the robot's true poses rather than by the planner's own report.
//!
//! A task is reached if the planner reported so *and* the robot actually was in the task's place. (Boniardi et al. 2015, IV,
//! "considered a task successful if … the robot is able to access them".) The [`on_sketch`] module judges by the robot's own
//! estimate instead, as the authors do. For a real robot, whose true poses are not known, its own report counts.
//!
//! This module is pure: messages and the mission go in, and a [`Verdict`] or [`figures::Figures`] comes out. It does not print
//! anything. Only [`log::Log`], which collects the messages that the judge needs, reads recordings.

pub mod anchors;
pub mod directions;
pub mod drawing;
pub mod figures;
pub mod homotopy;
pub mod log;
pub mod on_sketch;
pub mod rooms;
pub mod states;
pub mod tables;
pub mod trajectory;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::message::{Contact, GroundTruth, Message, MissionStatus};
use sketchnav_schemas::mission::{Mission, Task};
use sketchnav_schemas::time::seconds;

/// The outcome of a mission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Whether every task was reached.
    pub success: bool,
    /// The verdicts on the tasks, in the order of the mission.
    pub tasks: Vec<TaskVerdict>,
    /// Simulation time of the last message, in seconds.
    pub sim_seconds: f64,
}

/// The outcome of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskVerdict {
    /// Name of the task.
    pub name: String,
    /// Whether the planner reported the goal as reached and the robot actually was there.
    pub reached: bool,
    /// The last state that the planner reported, in the words of [`TaskState`], or `not begun` if it did not
    /// report any. If this says `reached` but the field `reached` is false, the robot stopped in the wrong
    /// place.
    pub state: String,
    /// The reason that the planner reported.
    pub reason: String,
    /// Simulation time from the start of the task to its end, in seconds.
    pub time_s: f64,
    /// Length of the true path or, if no true pose was recorded, of the path according to the odometry, in metres.
    pub path_m: f64,
    /// Distance, in metres, from the true position at the end of the task to the centre of its place. `None` if the task never
    /// began, if its place is not known, or if the true position is missing.
    pub final_error_m: Option<f64>,
    /// Number of times that the robot began to touch something.
    pub collisions: u32,
}

impl Verdict {
    /// The column headings for [`Verdict::task_rows`].
    pub const TASK_COLUMNS: [&'static str; 7] =
        ["task", "reached", "time", "path", "final error", "collisions", "the planner said"];

    /// Returns a human-readable row for each task.
    pub fn task_rows(&self) -> impl Iterator<Item = [String; 7]> {
        self.tasks.iter().map(|task| {
            [
                task.name.clone(),
                if task.reached { "yes" } else { "no" }.to_owned(),
                format!("{:.1} s", task.time_s),
                format!("{:.1} m", task.path_m),
                task.final_error_m.map_or("–".to_owned(), |error| format!("{error:.2} m")),
                task.collisions.to_string(),
                if task.reason.is_empty() {
                    task.state.clone()
                } else {
                    format!("{}: {}", task.state, task.reason)
                },
            ]
        })
    }
}

/// The time span in which a task was driven, and its last state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaskSpan {
    /// Simulation time of the task's first status message with a state other than `waiting`.
    pub begin_ns: u64,
    /// Simulation time of the status message that ended the task, or of its last one.
    pub end_ns: u64,
    /// The state in the status message sent at `end_ns`.
    pub state: TaskState,
}

impl TaskSpan {
    /// Returns the messages within the span. `messages` must be sorted by their timestamps.
    pub fn of<'a, T: Message>(&self, messages: &'a [T]) -> &'a [T] {
        let first = messages.partition_point(|m| m.header().stamp_ns < self.begin_ns);
        let end = messages.partition_point(|m| m.header().stamp_ns <= self.end_ns);
        &messages[first.min(end)..end]
    }
}

/// Returns the span of each of the `task_count` tasks, or `None` for a task that never began.
///
/// `status` is the whole channel, in order. `Finished` refers to the mission as a whole and not to a task.
pub fn spans(task_count: usize, status: &[MissionStatus]) -> Vec<Option<TaskSpan>> {
    let mut spans: Vec<Option<TaskSpan>> = vec![None; task_count];
    for message in status {
        let Some(state) = TaskState::from_code(message.state) else { continue };
        let Some(span) = spans.get_mut(message.task as usize) else { continue };
        if matches!(state, TaskState::Waiting | TaskState::Finished) {
            continue;
        }
        let now_ns = message.header.stamp_ns;
        let span = span.get_or_insert(TaskSpan { begin_ns: now_ns, end_ns: now_ns, state });
        // An aborted task may have been resumed.
        if !span.state.is_end() || span.state == TaskState::Aborted {
            (span.end_ns, span.state) = (now_ns, state);
        }
    }
    spans
}

/// Judges a mission by the channels `truth`, `status` and `contact`, which must be complete and in order.
pub fn judge(
    mission: &Mission,
    truth: &[GroundTruth],
    status: &[MissionStatus],
    contacts: &[Contact],
) -> Verdict {
    let spans = spans(mission.task.len(), status);
    let judged = mission.task.iter().zip(&spans).enumerate().map(|(index, (task, span))| match span {
        Some(span) => judge_task(task, span, truth, contacts, last_of(index, span, status)),
        None => not_begun(task),
    });
    let tasks: Vec<_> = judged.collect();
    let last_truth = truth.last().map_or(0, |m| m.header.stamp_ns);
    let last_status = status.last().map_or(0, |m| m.header.stamp_ns);
    Verdict {
        success: tasks.iter().all(|task| task.reached),
        tasks,
        sim_seconds: seconds(last_truth.max(last_status)),
    }
}

/// Maximum age of a true pose at the end of a task, in nanoseconds. Since a true pose is sent at each instant, an older one
/// indicates a gap in the recording.
const FRESH_NS: u64 = 1_000_000_000;

/// Judges tasks that end in a gap of the recording by the last status that they reported while the mission ran. Such a task is
/// reached if the planner reported so, and its reason mentions that its end is not in the recording.
pub fn fill_gaps<'a>(
    verdict: &mut Verdict,
    truth: &[GroundTruth],
    status: &[MissionStatus],
    reported: impl IntoIterator<Item = &'a MissionStatus>,
) {
    let spans = spans(verdict.tasks.len(), status);
    let is_seen = |span: &TaskSpan| {
        let newest = truth_at(truth, span.end_ns).map(|truth| truth.header.stamp_ns);
        span.state.is_end() && newest.is_some_and(|at_ns| at_ns + FRESH_NS >= span.end_ns)
    };
    for said in reported {
        let (Some(task), Some(span)) =
            (verdict.tasks.get_mut(said.task as usize), spans.get(said.task as usize))
        else {
            continue;
        };
        if !span.as_ref().is_some_and(is_seen) {
            *task = by_reports(&task.name, said);
        }
        verdict.sim_seconds = verdict.sim_seconds.max(seconds(said.header.stamp_ns));
    }
    verdict.success = verdict.tasks.iter().all(|task| task.reached);
}

fn by_reports(name: &str, said: &MissionStatus) -> TaskVerdict {
    let state = TaskState::from_code(said.state);
    let separator = if said.reason.as_str().is_empty() { "" } else { "; " };
    TaskVerdict {
        name: name.to_owned(),
        reached: state == Some(TaskState::Reached),
        state: state.map_or("unknown", TaskState::word).to_owned(),
        reason: format!(
            "{}{separator}according to the robot only: not in the recording",
            said.reason.as_str()
        ),
        time_s: said.task_time_s,
        path_m: said.task_path_m,
        final_error_m: None,
        collisions: 0,
    }
}

fn judge_task(
    task: &Task,
    span: &TaskSpan,
    truth: &[GroundTruth],
    contacts: &[Contact],
    said: Option<&MissionStatus>,
) -> TaskVerdict {
    let reason = said.map_or("", |said| said.reason.as_str());
    let at_end = truth_at(truth, span.end_ns).map(|m| m.pose());
    let there = at_end.is_some_and(|pose| task.there.contains(pose.x, pose.y));
    let [x, y] = task.there.middle();
    // For a real robot, the true position is not known.
    let is_real = truth.is_empty();
    let is_unknown = task.there.is_unknown() || is_real;
    let reason = if is_unknown { by_its_word(reason) } else { reason.to_owned() };
    let by_odometry_m = said.map_or(0.0, |said| said.task_path_m);
    TaskVerdict {
        name: task.name.clone(),
        reached: span.state == TaskState::Reached && (there || is_unknown),
        state: span.state.word().to_owned(),
        reason,
        time_s: seconds(span.end_ns - span.begin_ns),
        path_m: if is_real { by_odometry_m } else { path_length_m(span.of(truth)) },
        final_error_m: at_end.filter(|_| !is_unknown).map(|pose| (pose.x - x).hypot(pose.y - y)),
        collisions: span.of(contacts).iter().filter(|contact| contact.begins == 1).count() as u32,
    }
}

/// Adds to the reason that only the robot's own report counts, because the mission names no place in the true world, or because no
/// true pose was recorded.
fn by_its_word(reason: &str) -> String {
    let separator = if reason.is_empty() { "" } else { "; " };
    format!("{reason}{separator}according to the robot only")
}

fn not_begun(task: &Task) -> TaskVerdict {
    TaskVerdict {
        name: task.name.clone(),
        reached: false,
        state: "not begun".to_owned(),
        reason: String::new(),
        time_s: 0.0,
        path_m: 0.0,
        final_error_m: None,
        collisions: 0,
    }
}

/// Returns the last status of a task.
fn last_of<'a>(index: usize, span: &TaskSpan, status: &'a [MissionStatus]) -> Option<&'a MissionStatus> {
    span.of(status).iter().rev().find(|m| m.task as usize == index)
}

/// Returns the true pose at `stamp_ns`, or the last one before it if none was sent at that instant.
fn truth_at(truth: &[GroundTruth], stamp_ns: u64) -> Option<&GroundTruth> {
    let after = truth.partition_point(|m| m.header.stamp_ns <= stamp_ns);
    truth[..after].last()
}

fn path_length_m(truth: &[GroundTruth]) -> f64 {
    let ways = truth.windows(2).map(|pair| pair[0].pose().position().distance(&pair[1].pose().position()));
    // The sum of no floats is minus zero, so fold from 0 instead.
    ways.fold(0.0, |sum, way| sum + way)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::{Pose, World};
    use sketchnav_schemas::message::{Header, PoseM, Text};

    const MISSION: &str = r#"
        name = "two rooms"
        robot = "robotino"
        world = { floor_plan = "floor.toml" }
        start = { world = [0, 0], world_heading_deg = 0 }
        navigator = { kind = "sketch", drawing = "sketch.svg" }
        [[task]]
        name = "a"
        goal = [1, 1]
        there = { center = [2, 0], radius_m = 0.5 }
        [[task]]
        name = "b"
        goal = [2, 2]
        there = { polygon = [[4, -1], [6, -1], [6, 1], [4, 1]] }
    "#;

    fn header(step: u64) -> Header {
        Header { seq: step, stamp_ns: step * 100_000_000, source_seq: step }
    }

    /// Returns one pose for each step. In each step, the robot moves 0.1 m to the right.
    fn drive(steps: u64) -> Vec<GroundTruth> {
        let pose = |k: u64| PoseM::new(&Pose::<World>::new(k as f64 * 0.1, 0.0, 0.0));
        (0..steps).map(|k| GroundTruth { header: header(k), pose: pose(k), ..Zeroable::zeroed() }).collect()
    }

    fn say(step: u64, task: u32, state: TaskState) -> MissionStatus {
        let (header, reason) = (header(step), Text::new("because"));
        MissionStatus { header, task, task_count: 2, state: state.code(), reason, ..Zeroable::zeroed() }
    }

    fn touch(step: u64, begins: u32) -> Contact {
        Contact { header: header(step), begins, ..Zeroable::zeroed() }
    }

    fn mission() -> Mission {
        Mission::parse(MISSION).unwrap()
    }

    #[test]
    fn a_mission_whose_tasks_all_end_in_their_places_succeeds() {
        let status = [
            say(0, 0, TaskState::Waiting),
            say(1, 0, TaskState::Driving),
            say(20, 0, TaskState::Reached),
            say(21, 1, TaskState::Driving),
            say(50, 1, TaskState::Reached),
            say(51, 1, TaskState::Finished),
        ];
        let contacts = [touch(20, 1), touch(22, 0), touch(30, 1), touch(40, 1)];
        let verdict = judge(&mission(), &drive(52), &status, &contacts);
        assert!(verdict.success);
        assert!((verdict.sim_seconds - 5.1).abs() < 1e-9);
        let [a, b] = &verdict.tasks[..] else { panic!("{verdict:?}") };
        assert!((a.time_s - 1.9).abs() < 1e-9 && (a.path_m - 1.9).abs() < 1e-9, "{a:?}");
        assert!(a.final_error_m.unwrap() < 1e-9 && b.final_error_m.unwrap() < 1e-9);
        assert_eq!((a.collisions, b.collisions), (1, 2));
        assert_eq!((a.state.as_str(), a.reason.as_str()), ("reached", "because"));
    }

    #[test]
    fn a_robot_that_stops_in_the_wrong_place_has_not_reached_it() {
        let status =
            [say(1, 0, TaskState::Driving), say(10, 0, TaskState::Reached), say(45, 1, TaskState::Reached)];
        let verdict = judge(&mission(), &drive(50), &status, &[]);
        assert!(!verdict.success && !verdict.tasks[0].reached && verdict.tasks[1].reached);
        assert_eq!(verdict.tasks[0].state, "reached");
        assert!((verdict.tasks[0].final_error_m.unwrap() - 1.0).abs() < 1e-9);
    }

    /// Regression test: the tasks of a real robot were judged by a place that nobody could check, so they were never reached.
    #[test]
    fn a_real_robot_is_judged_by_its_own_report() {
        let status = [
            say(1, 0, TaskState::Driving),
            MissionStatus { task_path_m: 1.5, ..say(20, 0, TaskState::Reached) },
            say(21, 1, TaskState::Driving),
            say(50, 1, TaskState::Lost),
        ];
        let verdict = judge(&mission(), &[], &status, &[]);
        let [a, b] = &verdict.tasks[..] else { panic!("{verdict:?}") };
        assert_eq!((a.reached, a.path_m, a.final_error_m), (true, 1.5, None));
        assert_eq!(a.reason, "because; according to the robot only");
        assert!(!b.reached && !verdict.success, "{b:?}");
    }

    #[test]
    fn a_robot_at_the_goal_that_does_not_know_it_has_not_reached_it() {
        let status = [say(1, 0, TaskState::Driving), say(20, 0, TaskState::TimedOut)];
        let verdict = judge(&mission(), &drive(21), &status, &[]);
        assert!(!verdict.tasks[0].reached);
        assert_eq!(verdict.tasks[0].state, "timed out");
    }

    #[test]
    fn events_after_a_tasks_end_do_not_change_its_verdict() {
        let status = [
            say(1, 0, TaskState::Driving),
            say(9, 0, TaskState::Lost),
            say(20, 0, TaskState::Reached),
            say(21, 9, TaskState::Driving),
        ];
        let spans = spans(2, &status);
        let lost = TaskSpan { begin_ns: 100_000_000, end_ns: 900_000_000, state: TaskState::Lost };
        assert_eq!(spans, [Some(lost), None]);
    }

    #[test]
    fn a_mission_cut_short_is_judged_as_far_as_it_went() {
        let status = [say(1, 0, TaskState::Driving), say(12, 0, TaskState::Driving)];
        let verdict = judge(&mission(), &drive(13), &status, &[]);
        let [a, b] = &verdict.tasks[..] else { panic!("{verdict:?}") };
        assert_eq!((a.state.as_str(), b.state.as_str()), ("driving", "not begun"));
        let said: Vec<_> = verdict.task_rows().map(|[.., said]| said).collect();
        assert_eq!(said[1], "not begun");
        assert!((a.time_s - 1.1).abs() < 1e-9 && b.final_error_m.is_none());
        let empty = judge(&mission(), &[], &[], &[]);
        assert!(!empty.success && empty.tasks.len() == 2 && empty.sim_seconds == 0.0);
    }

    /// Regression test: a disk that was full for a short time turned a mission whose tasks were all reached into "3 of 9 reached".
    #[test]
    fn a_gap_in_the_recording_changes_no_verdict() {
        let ends = [say(20, 0, TaskState::Reached), say(50, 1, TaskState::Reached)];
        let recorded = [say(1, 0, TaskState::Driving), ends[0], say(21, 1, TaskState::Driving)];
        let judged = |truth: &[GroundTruth], status: &[MissionStatus], reported: &[MissionStatus]| {
            let mut verdict = judge(&mission(), truth, status, &[]);
            fill_gaps(&mut verdict, truth, status, reported);
            verdict
        };
        // The end of the second task is missing.
        let verdict = judged(&drive(30), &recorded, &ends);
        assert!(verdict.success && verdict.sim_seconds == 5.0, "{verdict:?}");
        let [a, b] = &verdict.tasks[..] else { panic!("{verdict:?}") };
        assert!(a.final_error_m.is_some() && a.reason == "because", "{a:?}");
        assert!(b.final_error_m.is_none() && b.reason.ends_with("not in the recording"), "{b:?}");
        // The status of the second task is in the recording, but the robot's pose is not.
        let status = [recorded.as_slice(), &[ends[1]]].concat();
        assert!(judged(&drive(30), &status, &ends).success);
        assert!(judged(&[], &[], &ends).success);
        // The recording counts, regardless of the report.
        let early = [say(10, 0, TaskState::Reached)];
        assert!(!judged(&drive(100), &early, &early).tasks[0].reached);
        let lost = [ends[0], say(50, 1, TaskState::Lost)];
        assert!(!judged(&drive(30), &recorded, &lost).success);
    }

    #[test]
    fn a_verdict_survives_json() {
        let status = [say(1, 0, TaskState::Driving), say(20, 0, TaskState::Reached)];
        let verdict = judge(&mission(), &drive(30), &status, &[]);
        let text = serde_json::to_string(&verdict).unwrap();
        assert_eq!(serde_json::from_str::<Verdict>(&text).unwrap(), verdict);
    }
}
