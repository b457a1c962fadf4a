//! How far a mission has come: which task is under way, what people order, time limits, and the status of it all.
//!
//! Every navigator drives its tasks by it. It knows neither what a task is about nor how the robot gets there.

use std::fmt::Display;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::{Order, TaskState};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::{Header, MissionCommand, MissionStatus, Odometry, Text};
use sketchnav_schemas::run::Pad;

/// How far the mission has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// Not begun, or waiting to begin the next task.
    Waiting,
    /// A task is under way.
    Driving,
    /// A task has ended and was reported; the next step begins the next one.
    Ended,
    /// Nothing is left to do.
    Over,
}

/// Why the robot stands although there is something left to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hold {
    /// A person stopped it.
    Paused,
    /// The link to the driver was lost.
    Unattended,
    /// A person aborted the mission, and may go on with it.
    Aborted,
    /// It does not know where it is, and waits for a person's help.
    Lost,
    /// It asks a person something.
    Asks,
}

impl Hold {
    /// What a status says; `None` where the reason was said when it was held.
    fn status(self) -> Option<(TaskState, &'static str)> {
        match self {
            Self::Paused => Some((TaskState::Paused, "stopped by a person")),
            Self::Unattended => Some((TaskState::Paused, "stopped: the link to whoever drives was lost")),
            Self::Aborted => Some((TaskState::Aborted, ABORTED)),
            Self::Lost | Self::Asks => None,
        }
    }
}

const ABORTED: &str = "given up by a person";

/// What a status says of a task, whatever the task is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskInfo {
    /// Name, for people.
    pub name: Text<32>,
    /// Time limit, seconds of simulation time.
    pub time_limit_s: f64,
}

/// What is known of a robot's motion.
#[derive(Debug, Clone, Copy)]
pub enum Motion<'a> {
    /// By its odometry.
    Odometry(&'a Odometry),
    /// By its commands: a robot without odometry.
    Commanded {
        /// Its speed since the last step, m/s.
        speed_mps: f64,
    },
}

impl<'a> From<&'a Odometry> for Motion<'a> {
    fn from(odometry: &'a Odometry) -> Self {
        Self::Odometry(odometry)
    }
}

/// The course of a mission. It is part of a planner's state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Mission {
    pad: Pad,
    phase: Phase,
    held: Option<Hold>,
    ordered: bool,
    task: usize,
    reached: u32,
    state: u32,
    reason: Text<96>,
    elapsed_s: f64,
    path_m: f64,
    last_stamp_ns: Option<u64>,
    last_odometry: Option<Pose<Odom>>,
    speed_mps: f64,
    stamp_ns: u64,
    source_seq: u64,
}

impl Mission {
    /// Before its first task. `pad`: whether people take part in it, which decides what an order means.
    pub fn new(pad: Pad) -> Self {
        Self {
            pad,
            phase: Phase::Waiting,
            held: None,
            ordered: false,
            task: 0,
            reached: 0,
            state: TaskState::Waiting.code(),
            reason: Text::default(),
            elapsed_s: 0.0,
            path_m: 0.0,
            last_stamp_ns: None,
            last_odometry: None,
            speed_mps: 0.0,
            stamp_ns: 0,
            source_seq: 0,
        }
    }

    /// How far it has come.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The number of the task that is under way or waited for, from 0.
    pub fn task(&self) -> usize {
        self.task
    }

    /// The time that the task has taken, seconds. The clock stands while the robot is held.
    pub fn elapsed_s(&self) -> f64 {
        self.elapsed_s
    }

    /// Whether the start was ordered.
    pub fn is_ordered(&self) -> bool {
        self.ordered
    }

    /// Whether the robot drives, or is about to.
    pub fn is_driving(&self) -> bool {
        self.ordered && self.held.is_none() && self.phase != Phase::Over
    }

    /// Whether it is over for good: no person can give it new tasks.
    pub fn is_last(&self) -> bool {
        self.phase == Phase::Over && !self.pad.draws()
    }

    /// Forgets what it was about; the robot stands until the start is ordered again.
    pub fn begin_anew(&mut self) {
        (self.phase, self.held, self.ordered) = (Phase::Waiting, None, false);
        (self.task, self.reached) = (0, 0);
        (self.elapsed_s, self.path_m) = (0.0, 0.0);
    }

    /// Does what a person orders in a mission of `count` tasks. Unknown orders are ignored, and so are unknown tasks.
    pub fn on_order(&mut self, order: &MissionCommand, count: usize) {
        let task = order.task as usize;
        match Order::from_code(order.order) {
            Some(Order::Goal) if task < count => self.go_to(task),
            Some(order) => self.obey(order),
            None => {}
        }
    }

    /// Begins a task instead of the one that is under way, and lets go of a robot that is held.
    fn go_to(&mut self, task: usize) {
        if !self.is_last() {
            self.wait_for(task);
            (self.held, self.ordered) = (None, true);
        }
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Start if self.pad.draws() && (self.held.is_some() || self.phase == Phase::Over) => {
                self.begin_anew();
                self.ordered = true;
            }
            Order::Start => self.ordered = true,
            Order::Abort if self.phase == Phase::Over => {}
            Order::Abort if self.pad.is_absent() => {
                (self.phase, self.held) = (Phase::Over, None);
                self.report(TaskState::Aborted, ABORTED);
            }
            // The supervisor's order to start may come after it: what a person says at the pad goes before.
            Order::Abort if self.pad == Pad::Watches => self.held = Some(Hold::Aborted),
            Order::Abort => self.hold(Hold::Aborted),
            Order::Pause => self.hold(Hold::Paused),
            Order::Unattended => self.hold(Hold::Unattended),
            Order::Resume => self.held = None,
            // Of a task that there is not; and where the robot is, which is for those who navigate to take in.
            Order::Goal | Order::Here => {}
        }
    }

    /// What was aborted is not merely paused.
    fn hold(&mut self, hold: Hold) {
        let is_under_way = self.ordered && self.phase != Phase::Over;
        if is_under_way && self.held != Some(Hold::Aborted) {
            self.held = Some(hold);
        }
    }

    /// Begins, without a checkpoint, with the task that a predecessor's last status was about. A person's
    /// pause or abort stays in force until the order to resume.
    pub fn resume_behind(&mut self, last: &MissionStatus) {
        let state = TaskState::from_code(last.state);
        self.held = match state {
            Some(TaskState::Paused) => Some(Hold::Paused),
            Some(TaskState::Aborted) if !self.pad.is_absent() => Some(Hold::Aborted),
            _ => None,
        };
        let has_ended = self.held.is_none() && state.is_some_and(TaskState::is_end);
        self.task = last.task as usize + usize::from(has_ended);
        self.reached = last.reached_count;
    }

    /// Takes over the time and the motion of a step that `cause` belongs to. Returns the time since the last
    /// step, seconds; at the first one `nominal_dt_s`.
    pub fn begin_step<'a>(
        &mut self,
        cause: &Header,
        motion: impl Into<Motion<'a>>,
        nominal_dt_s: f64,
    ) -> f64 {
        let since = self.last_stamp_ns.map(|last| cause.stamp_ns.saturating_sub(last) as f64 * 1e-9);
        let dt_s = since.unwrap_or(nominal_dt_s);
        let way = match motion.into() {
            Motion::Odometry(odometry) => self.way_to(odometry),
            Motion::Commanded { speed_mps } => {
                self.speed_mps = speed_mps;
                speed_mps * since.unwrap_or(0.0)
            }
        };
        if self.phase == Phase::Driving && self.held.is_none() {
            self.elapsed_s += dt_s;
            self.path_m += way;
        }
        self.last_stamp_ns = Some(cause.stamp_ns);
        (self.stamp_ns, self.source_seq) = (cause.stamp_ns, cause.source_seq);
        dt_s
    }

    /// Takes over the odometry; the way since the last one.
    fn way_to(&mut self, odometry: &Odometry) -> f64 {
        let robot = odometry.pose();
        self.speed_mps = odometry.twist.vx_mps.hypot(odometry.twist.vy_mps);
        let last = self.last_odometry.replace(robot);
        last.map_or(0.0, |last| last.position().distance(&robot.position()))
    }

    /// Whether a person or a lost link holds the robot; the status says so.
    pub fn is_held(&mut self) -> bool {
        let Some(hold) = self.held else { return false };
        if let Some((state, reason)) = hold.status() {
            self.report(state, reason);
        }
        true
    }

    /// The task that is to begin now, where one is: the first once all `is_ready`, the next where one has ended.
    /// After the last of `count` tasks the mission is over.
    pub fn due(&mut self, is_ready: bool, count: usize) -> Option<usize> {
        let next = match self.phase {
            Phase::Waiting if is_ready => self.task,
            Phase::Ended => self.task + 1,
            _ => return None,
        };
        if next < count {
            return Some(next);
        }
        self.phase = Phase::Over;
        let reached = self.reached;
        self.report(TaskState::Finished, format_args!("{reached} of {count} tasks reached"));
        None
    }

    /// Begins a task.
    pub fn begin(&mut self, task: usize) {
        (self.phase, self.task) = (Phase::Driving, task);
        (self.elapsed_s, self.path_m) = (0.0, 0.0);
    }

    /// Waits to begin a task.
    pub fn wait_for(&mut self, task: usize) {
        (self.phase, self.task) = (Phase::Waiting, task);
    }

    /// The task goes on, unless its time is over. Returns whether it goes on.
    pub fn go_on(&mut self, task: &TaskInfo, reason: impl Display) -> bool {
        let is_in_time = self.elapsed_s < task.time_limit_s;
        if is_in_time {
            self.report(TaskState::Driving, reason);
        } else {
            let limit_s = task.time_limit_s;
            self.end(TaskState::TimedOut, format_args!("the time limit of {limit_s:.0} s passed"));
        }
        is_in_time
    }

    /// Ends the task that is under way.
    pub fn end(&mut self, state: TaskState, reason: impl Display) {
        self.phase = Phase::Ended;
        self.reached += u32::from(state == TaskState::Reached);
        self.report(state, reason);
    }

    /// The robot does not know where it is. Where people take part it stands until one of them has it resume; else the
    /// task ends.
    pub fn lose(&mut self, reason: impl Display) {
        if self.pad.is_absent() {
            self.end(TaskState::Lost, reason);
        } else {
            self.held = Some(Hold::Lost);
            self.report(TaskState::Paused, format_args!("lost, waits for help: {reason}"));
        }
    }

    /// Stands until a person has answered, or [`Mission::find`] lets it go on. A mission in which nobody takes part never
    /// asks.
    pub fn ask(&mut self, question: impl Display) {
        self.held = Some(Hold::Asks);
        self.report(TaskState::Paused, question);
    }

    /// Why it stands.
    pub fn held(&self) -> Option<Hold> {
        self.held
    }

    /// A robot that is lost, or asks, has its answer: it goes on.
    pub fn find(&mut self) {
        self.held.take_if(|held| matches!(held, Hold::Lost | Hold::Asks));
    }

    /// Sets what the next status says. A reason that is too long is cut.
    pub fn report(&mut self, state: TaskState, reason: impl Display) {
        (self.state, self.reason) = (state.code(), Text::of(reason));
    }

    /// The header of what the step sends; the sender sets `seq`.
    pub fn header(&self) -> Header {
        Header { seq: 0, stamp_ns: self.stamp_ns, source_seq: self.source_seq }
    }

    /// Writes the status of the step. `task` is the one at hand, `remaining_m` the way that is left of it.
    pub fn write_status(
        &self,
        task: Option<&TaskInfo>,
        count: usize,
        remaining_m: f64,
        status: &mut MissionStatus,
    ) {
        *status = MissionStatus {
            header: self.header(),
            task: self.task as u32,
            task_count: count as u32,
            state: self.state,
            reached_count: self.reached,
            task_time_s: self.elapsed_s,
            task_path_m: self.path_m,
            remaining_m,
            speed_mps: self.speed_mps,
            name: task.map_or(Text::default(), |task| task.name),
            reason: self.reason,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driving(pad: Pad) -> Mission {
        let mut mission = Mission { ordered: true, ..Mission::new(pad) };
        mission.begin(2);
        mission
    }

    /// A mission that was paused and then aborted stayed paused, and its system ran for ever.
    #[test]
    fn what_is_aborted_while_it_is_held_is_over() {
        for hold in [Order::Pause, Order::Unattended] {
            let mut mission = driving(Pad::Absent);
            mission.obey(hold);
            assert!(mission.is_held());
            mission.obey(Order::Abort);
            assert!(mission.is_last() && !mission.is_held());
            mission.obey(Order::Pause);
            assert!(!mission.is_held(), "what is over is not paused");
        }
    }

    #[test]
    fn without_a_pad_what_is_aborted_is_over() {
        let mut mission = driving(Pad::Absent);
        mission.obey(Order::Abort);
        assert_eq!((mission.phase, mission.state), (Phase::Over, TaskState::Aborted.code()));
        mission.obey(Order::Resume);
        assert_eq!(mission.phase, Phase::Over);
    }

    #[test]
    fn with_a_pad_what_is_aborted_can_be_gone_on_with() {
        for pad in [Pad::Watches, Pad::Draws] {
            let mut mission = driving(pad);
            mission.obey(Order::Abort);
            assert_eq!((mission.held, mission.is_driving()), (Some(Hold::Aborted), false));
            // The link breaks while it stands: it stays what a person said of it.
            mission.obey(Order::Unattended);
            assert_eq!(mission.held, Some(Hold::Aborted));
            mission.obey(Order::Resume);
            assert_eq!((mission.phase, mission.task, mission.is_driving()), (Phase::Driving, 2, true));
        }
    }

    #[test]
    fn a_robot_that_is_lost_waits_for_help_where_there_are_people() {
        let mut mission = driving(Pad::Watches);
        mission.lose("no door");
        assert!(mission.is_held() && mission.reason.as_str() == "lost, waits for help: no door");
        assert_eq!((mission.phase, mission.state), (Phase::Driving, TaskState::Paused.code()));
        mission.obey(Order::Resume);
        assert!(mission.is_driving() && !mission.is_held());
        mission.lose("no door");
        mission.find();
        assert!(mission.is_driving() && !mission.is_held());
        mission.obey(Order::Pause);
        mission.find();
        assert!(mission.is_held(), "who was stopped by a person is not lost");
        mission.obey(Order::Resume);
        let mut alone = driving(Pad::Absent);
        alone.lose("no door");
        assert_eq!((alone.phase, alone.state), (Phase::Ended, TaskState::Lost.code()));
    }

    #[test]
    fn who_has_aborted_can_start_again_with_the_first_task() {
        let mut mission = driving(Pad::Draws);
        mission.obey(Order::Start);
        assert_eq!((mission.phase, mission.task), (Phase::Driving, 2), "it drives already");
        mission.obey(Order::Abort);
        mission.obey(Order::Start);
        assert_eq!((mission.phase, mission.task, mission.is_driving()), (Phase::Waiting, 0, true));
    }

    /// The planner reads what comes from the pad first. Of a mission from a file it once forgot an abort that came
    /// before the supervisor's order to start, and drove off.
    #[test]
    fn a_mission_from_a_file_can_be_aborted_before_it_is_started() {
        let mut mission = Mission::new(Pad::Watches);
        mission.obey(Order::Abort);
        mission.obey(Order::Start);
        assert_eq!((mission.held, mission.is_driving()), (Some(Hold::Aborted), false));
        mission.obey(Order::Resume);
        assert!(mission.is_driving());
    }

    #[test]
    fn only_what_is_under_way_can_be_held() {
        let mut mission = Mission::new(Pad::Draws);
        mission.obey(Order::Pause);
        mission.obey(Order::Abort);
        assert_eq!(mission.held, None);
        let mut mission = Mission { phase: Phase::Over, ..driving(Pad::Draws) };
        mission.obey(Order::Unattended);
        assert_eq!(mission.held, None);
    }

    #[test]
    fn after_the_last_task_the_mission_is_over() {
        let mut mission = driving(Pad::Absent);
        mission.end(TaskState::Reached, "there");
        assert_eq!(mission.due(true, 4), Some(3));
        assert_eq!(mission.due(true, 3), None);
        assert_eq!((mission.phase, mission.reason.as_str()), (Phase::Over, "1 of 3 tasks reached"));
    }

    #[test]
    fn a_task_ends_with_its_time() {
        let task = TaskInfo { name: Text::new("far"), time_limit_s: 9.0 };
        let mut mission = Mission { elapsed_s: 8.9, ..driving(Pad::Absent) };
        assert!(mission.go_on(&task, ""));
        mission.elapsed_s = 9.0;
        assert!(!mission.go_on(&task, ""));
        assert_eq!((mission.phase, mission.state), (Phase::Ended, TaskState::TimedOut.code()));
        assert_eq!(mission.reason.as_str(), "the time limit of 9 s passed");
    }

    fn goal(task: u32) -> MissionCommand {
        let header = Header { seq: 1, stamp_ns: 0, source_seq: 0 };
        MissionCommand { header, order: Order::Goal.code(), task, ..bytemuck::Zeroable::zeroed() }
    }

    #[test]
    fn a_goal_takes_the_place_of_the_task_that_is_under_way() {
        let mut mission = driving(Pad::Absent);
        mission.on_order(&goal(0), 4);
        assert_eq!((mission.is_driving(), mission.due(true, 4)), (true, Some(0)));
        mission.begin(0);
        mission.end(TaskState::Reached, "there");
        assert_eq!(mission.due(true, 4), Some(1), "those behind it follow");
    }

    #[test]
    fn a_goal_lets_go_of_a_robot_that_is_held() {
        let mut mission = driving(Pad::Absent);
        mission.obey(Order::Pause);
        mission.on_order(&goal(3), 4);
        assert!(!mission.is_held());
        assert_eq!(mission.due(true, 4), Some(3));
    }

    #[test]
    fn a_goal_that_there_is_not_and_one_behind_the_end_change_nothing() {
        let mut mission = driving(Pad::Absent);
        mission.on_order(&goal(4), 4);
        assert_eq!((mission.phase(), mission.task()), (Phase::Driving, 2));
        mission.obey(Order::Abort);
        mission.on_order(&goal(1), 4);
        assert_eq!(mission.phase(), Phase::Over);
    }
}
