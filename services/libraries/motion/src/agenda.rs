//! An agenda keeps track of a planner's current task, of orders from people and of time limits, and reports
//! on all of them.
//!
//! All planners of this project use an agenda, although a planner can do without one. The agenda receives
//! orders, decides in each step what is due, and sends the command and the status of the step. It does not
//! depend on the kind of task or on how the robot moves.

use std::fmt::Display;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{COMMAND, STATUS};
use sketchnav_schemas::codes::{Order, TaskState};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::{MissionCommand, MissionStatus, Odometry, Text, Twist};
use sketchnav_schemas::mission::Task;
use sketchnav_schemas::run::{Pace, Pad, RunConfig};
use sketchnav_stage::{Denied, Incoming, Outbox, Remains, StageError};

/// Phase of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Phase {
    /// The mission has not begun, or the next task waits to begin.
    #[default]
    Waiting,
    /// A task is under way.
    Driving,
    /// A task has ended, and its end has been reported. The next step begins the next task.
    Ended,
    /// No task is left.
    Over,
}

/// Why the robot is held although there are tasks left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hold {
    /// A person stopped the robot.
    Paused,
    /// The link to the driver was lost.
    Unattended,
    /// A person aborted the mission, but can still resume it.
    Aborted,
    /// The robot is lost and waits for a person to help.
    Lost,
    /// The robot has asked a person a question.
    Asks,
}

impl Hold {
    /// Returns the state and the reason for a status, or `None` if the reason was already given when the robot was held.
    fn status(self) -> Option<(TaskState, &'static str)> {
        match self {
            Self::Paused => Some((TaskState::Paused, "stopped by a person")),
            Self::Unattended => {
                Some((TaskState::Paused, "stopped: the link to the page that drives was lost"))
            }
            Self::Aborted => Some((TaskState::Aborted, ABORTED)),
            Self::Lost | Self::Asks => None,
        }
    }
}

const ABORTED: &str = "given up by a person";

/// The part of a task that every status reports, regardless of the kind of task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskInfo {
    /// Display name of the task.
    pub name: Text<32>,
    /// Time limit, in seconds of simulation time.
    pub time_limit_s: f64,
}

impl From<&Task> for TaskInfo {
    fn from(task: &Task) -> Self {
        Self { name: Text::new(&task.name), time_limit_s: task.time_limit_s }
    }
}

/// What the planner has to do in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Due {
    /// Begin [`Agenda::task`], and drive.
    Begin,
    /// Keep driving.
    Drive,
    /// Stop. The status gives the reason.
    Stand,
}

/// Source of information about a robot's motion.
#[derive(Debug, Clone, Copy)]
pub enum Motion<'a> {
    /// The robot's odometry.
    Odometry(&'a Odometry),
    /// The commands, if the robot has no odometry.
    Commanded {
        /// Speed commanded since the last step, in m/s.
        speed_mps: f64,
    },
}

impl<'a> From<&'a Odometry> for Motion<'a> {
    fn from(odometry: &'a Odometry) -> Self {
        Self::Odometry(odometry)
    }
}

/// Progress through an agenda, as stored in a checkpoint.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Standing {
    phase: Phase,
    held: Option<Hold>,
    ordered: bool,
    task: usize,
    reached: u32,
    /// State for the next status, as the code of a [`TaskState`].
    state: u32,
    reason: Text<96>,
    elapsed_s: f64,
    path_m: f64,
    last_stamp_ns: Option<u64>,
    last_odometry: Option<Pose<Odom>>,
    speed_mps: f64,
}

/// The tasks of a mission, in order.
#[derive(Debug)]
pub struct Agenda {
    pad: Pad,
    waits_for_order: bool,
    nominal_dt_s: f64,
    tasks: Vec<TaskInfo>,
    now: Standing,
}

impl Agenda {
    /// Creates the agenda of a mission. Some orders have different effects if people take part in the run.
    pub fn new(run: &RunConfig) -> Self {
        Self { tasks: run.mission.task.iter().map(TaskInfo::from).collect(), ..Self::empty(run) }
    }

    /// Creates an agenda whose tasks are not yet known.
    pub fn empty(run: &RunConfig) -> Self {
        Self {
            pad: run.pad,
            waits_for_order: run.pace == Pace::Lockstep,
            nominal_dt_s: 1.0 / run.robot.tick_hz(),
            tasks: Vec::new(),
            now: Standing::default(),
        }
    }

    /// Replaces the tasks.
    pub fn set_tasks(&mut self, tasks: impl IntoIterator<Item = TaskInfo>) {
        self.tasks.clear();
        self.tasks.extend(tasks);
    }

    /// Returns the progress to store in a checkpoint.
    pub fn standing(&self) -> Standing {
        self.now
    }

    /// Restores progress from a checkpoint.
    pub fn restore(&mut self, standing: Standing) {
        self.now = standing;
    }

    /// Resumes without a checkpoint, at the task of the last status sent before the restart. If a person had paused or aborted the
    /// mission, it stays paused or aborted until the order to resume arrives.
    pub fn recover(&mut self, remains: &dyn Remains) {
        let Some(last) = remains.of(STATUS) else { return };
        let state = TaskState::from_code(last.state);
        self.now.held = match state {
            Some(TaskState::Paused) => Some(Hold::Paused),
            Some(TaskState::Aborted) if !self.pad.is_absent() => Some(Hold::Aborted),
            _ => None,
        };
        let has_ended = self.now.held.is_none() && state.is_some_and(TaskState::is_end);
        self.now.task = last.task as usize + usize::from(has_ended);
        self.now.reached = last.reached_count;
    }

    /// Returns true if the planner can take a step. In lockstep, this requires its instructions, as reported by `has_instructions`,
    /// and the order to start. In real time, a planner always takes its steps, and the robot remains stationary until everything
    /// has arrived.
    pub fn is_ready(&self, has_instructions: bool) -> bool {
        self.now.ordered && has_instructions || !self.waits_for_order
    }

    /// Returns the phase of the mission.
    pub fn phase(&self) -> Phase {
        self.now.phase
    }

    /// Returns the index, from 0, of the current task or, if none is under way, of the next one.
    pub fn task(&self) -> usize {
        self.now.task
    }

    /// Returns the time spent on the task so far, in seconds. The clock stops while the robot is held.
    pub fn elapsed_s(&self) -> f64 {
        self.now.elapsed_s
    }

    /// Returns true if the order to start has arrived.
    pub fn is_ordered(&self) -> bool {
        self.now.ordered
    }

    /// Returns true if the robot is driving or about to drive.
    pub fn is_driving(&self) -> bool {
        self.now.ordered && self.now.held.is_none() && self.now.phase != Phase::Over
    }

    /// Returns true if the mission is over for good, because nobody can give it new tasks.
    fn is_last(&self) -> bool {
        self.now.phase == Phase::Over && !self.pad.draws()
    }

    /// Discards all progress. The robot then remains stationary until the start is ordered again.
    pub fn begin_again(&mut self) {
        let now = &mut self.now;
        (now.phase, now.held, now.ordered) = (Phase::Waiting, None, false);
        (now.task, now.reached) = (0, 0);
        (now.elapsed_s, now.path_m) = (0.0, 0.0);
    }

    /// Carries out and returns the order in a message, or returns `None` if the message is not an order.
    /// Unknown orders and orders about unknown tasks have no effect.
    ///
    /// # Errors
    /// Any error of [`Incoming::order`].
    pub fn receive<'a>(&mut self, message: &Incoming<'a>) -> Result<Option<&'a MissionCommand>, Denied> {
        let Some(order) = message.order()? else { return Ok(None) };
        let task = order.task as usize;
        match Order::from_code(order.order) {
            Some(Order::Goal) if task < self.tasks.len() => self.go_to(task),
            Some(order) => self.obey(order),
            None => {}
        }
        Ok(Some(order))
    }

    /// Switches from the current task to another one, and releases the robot if it is held. Has no effect if the mission is over
    /// for good.
    pub fn go_to(&mut self, task: usize) {
        if !self.is_last() {
            self.wait_for(task);
            (self.now.held, self.now.ordered) = (None, true);
        }
    }

    fn wait_for(&mut self, task: usize) {
        (self.now.phase, self.now.task) = (Phase::Waiting, task);
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Start
                if self.pad.draws() && (self.now.held.is_some() || self.now.phase == Phase::Over) =>
            {
                self.begin_again();
                self.now.ordered = true;
            }
            Order::Start => self.now.ordered = true,
            Order::Abort if self.now.phase == Phase::Over => {}
            Order::Abort if self.pad.is_absent() => {
                (self.now.phase, self.now.held) = (Phase::Over, None);
                self.report(TaskState::Aborted, ABORTED);
            }
            // The supervisor's order to start may arrive after the abort. The person's order on the pad takes precedence.
            Order::Abort if self.pad == Pad::Watches => self.now.held = Some(Hold::Aborted),
            Order::Abort => self.hold(Hold::Aborted),
            Order::Pause => self.hold(Hold::Paused),
            Order::Unattended => self.hold(Hold::Unattended),
            Order::Resume => self.now.held = None,
            // The navigator itself handles goals that are not tasks, and positions of the robot.
            Order::Goal | Order::Here => {}
        }
    }

    /// Holds the robot if the mission is under way. A pause does not replace an abort.
    fn hold(&mut self, hold: Hold) {
        let is_under_way = self.now.ordered && self.now.phase != Phase::Over;
        if is_under_way && self.now.held != Some(Hold::Aborted) {
            self.now.held = Some(hold);
        }
    }

    /// Records the time and the motion of a step. Returns the time since the last step, in seconds. For the first step, this is the
    /// nominal time between two ticks.
    pub fn begin_step<'a>(&mut self, stamp_ns: u64, motion: impl Into<Motion<'a>>) -> f64 {
        let since = self.now.last_stamp_ns.map(|last| stamp_ns.saturating_sub(last) as f64 * 1e-9);
        let dt_s = since.unwrap_or(self.nominal_dt_s);
        let way = match motion.into() {
            Motion::Odometry(odometry) => self.way_to(odometry),
            Motion::Commanded { speed_mps } => {
                self.now.speed_mps = speed_mps;
                speed_mps * since.unwrap_or(0.0)
            }
        };
        if self.now.phase == Phase::Driving && self.now.held.is_none() {
            self.now.elapsed_s += dt_s;
            self.now.path_m += way;
        }
        self.now.last_stamp_ns = Some(stamp_ns);
        dt_s
    }

    /// Records the odometry and returns the distance travelled since the previous odometry, in metres.
    fn way_to(&mut self, odometry: &Odometry) -> f64 {
        let robot = odometry.pose();
        self.now.speed_mps = odometry.twist.vx_mps.hypot(odometry.twist.vy_mps);
        let last = self.now.last_odometry.replace(robot);
        last.map_or(0.0, |last| last.position().distance(&robot.position()))
    }

    /// Decides what to do in this step. The first task begins once the start is ordered and nothing is
    /// `missing`. Each later task begins in the step after its predecessor has ended. If the robot is held,
    /// the status gives the reason.
    pub fn due(&mut self, missing: Option<impl Display>) -> Due {
        if self.is_held() {
            return Due::Stand;
        }
        let next = match self.now.phase {
            Phase::Driving => return Due::Drive,
            Phase::Over => return Due::Stand,
            Phase::Waiting => self.now.task,
            Phase::Ended => self.now.task + 1,
        };
        let is_ready = self.now.ordered && missing.is_none() || self.now.phase == Phase::Ended;
        if is_ready && next >= self.tasks.len() {
            return self.finish();
        }
        self.wait_for(next);
        match missing {
            Some(missing) => self.stand(missing),
            None if self.now.ordered => self.begin(),
            None => self.stand("waiting for the order to start"),
        }
    }

    fn begin(&mut self) -> Due {
        self.now.phase = Phase::Driving;
        (self.now.elapsed_s, self.now.path_m) = (0.0, 0.0);
        Due::Begin
    }

    fn stand(&mut self, why: impl Display) -> Due {
        self.report(TaskState::Waiting, why);
        Due::Stand
    }

    fn finish(&mut self) -> Due {
        self.now.phase = Phase::Over;
        let (reached, count) = (self.now.reached, self.tasks.len());
        self.report(TaskState::Finished, format_args!("{reached} of {count} tasks reached"));
        Due::Stand
    }

    /// Returns true if the robot is held. The status then gives the reason.
    fn is_held(&mut self) -> bool {
        let Some(hold) = self.now.held else { return false };
        if let Some((state, reason)) = hold.status() {
            self.report(state, reason);
        }
        true
    }

    /// Continues the task and returns true. If the time limit has passed, ends the task and returns false
    /// instead.
    pub fn keep_going(&mut self, reason: impl Display) -> bool {
        let limit_s = self.tasks.get(self.now.task).map_or(f64::INFINITY, |task| task.time_limit_s);
        let is_in_time = self.now.elapsed_s < limit_s;
        if is_in_time {
            self.report(TaskState::Driving, reason);
        } else {
            self.end(TaskState::TimedOut, format_args!("the time limit of {limit_s:.0} s passed"));
        }
        is_in_time
    }

    /// Ends the task under way.
    pub fn end(&mut self, state: TaskState, reason: impl Display) {
        self.now.phase = Phase::Ended;
        self.now.reached += u32::from(state == TaskState::Reached);
        self.report(state, reason);
    }

    /// Reports that the robot is lost. If people take part, the robot remains stationary until one of them orders it to resume.
    /// Otherwise the task ends.
    pub fn lose(&mut self, reason: impl Display) {
        if self.pad.is_absent() {
            self.end(TaskState::Lost, reason);
        } else {
            self.now.held = Some(Hold::Lost);
            self.report(TaskState::Paused, format_args!("lost, waiting for help: {reason}"));
        }
    }

    /// Holds the robot until a person has answered or [`Agenda::find`] releases it. Must not be called in a
    /// mission without people, because there would be nobody to answer.
    pub fn ask(&mut self, question: impl Display) {
        self.now.held = Some(Hold::Asks);
        self.report(TaskState::Paused, question);
    }

    /// Returns the reason why the robot is held, or `None` if it is not.
    pub fn held(&self) -> Option<Hold> {
        self.now.held
    }

    /// Releases a robot that was lost or was waiting for an answer, now that the answer is known.
    pub fn find(&mut self) {
        self.now.held.take_if(|held| matches!(held, Hold::Lost | Hold::Asks));
    }

    /// Sets the state and the reason for the next status. A reason that is too long is truncated.
    pub fn report(&mut self, state: TaskState, reason: impl Display) {
        (self.now.state, self.now.reason) = (state.code(), Text::of(reason));
    }

    /// Sends the command of the step, followed by its status. `remaining_m` is the distance left in the task,
    /// in metres.
    ///
    /// # Errors
    /// Any error of [`Outbox::send`].
    pub fn send(&self, twist: Twist, remaining_m: f64, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.send(COMMAND, |command| (command.twist, command.last) = (twist, self.is_last().into()))?;
        out.send(STATUS, |status| self.write_status(remaining_m, status))?;
        Ok(())
    }

    fn write_status(&self, remaining_m: f64, status: &mut MissionStatus) {
        let task = self.tasks.get(self.now.task);
        *status = MissionStatus {
            header: status.header,
            task: self.now.task as u32,
            task_count: self.tasks.len() as u32,
            state: self.now.state,
            reached_count: self.now.reached,
            task_time_s: self.now.elapsed_s,
            task_path_m: self.now.path_m,
            remaining_m,
            speed_mps: self.now.speed_mps,
            name: task.map_or(Text::default(), |task| task.name),
            reason: self.now.reason,
        };
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::channels::ORDERS;
    use sketchnav_schemas::codes::Process;
    use sketchnav_stage::Access;

    use super::*;

    const NOTHING: Option<&str> = None;

    /// Returns an agenda of four tasks with a time limit of nine seconds each.
    fn waiting(pad: Pad) -> Agenda {
        let tasks = vec![TaskInfo { name: Text::new("far"), time_limit_s: 9.0 }; 4];
        Agenda { pad, waits_for_order: true, nominal_dt_s: 0.1, tasks, now: Standing::default() }
    }

    /// Returns an agenda whose third task is under way.
    fn driving(pad: Pad) -> Agenda {
        let now = Standing { ordered: true, task: 2, ..Standing::default() };
        let mut agenda = Agenda { now, ..waiting(pad) };
        assert_eq!(agenda.due(NOTHING), Due::Begin);
        agenda
    }

    /// An agenda that was paused and then aborted used to remain paused, and its system ran forever.
    #[test]
    fn aborting_a_paused_mission_ends_it() {
        for hold in [Order::Pause, Order::Unattended] {
            let mut agenda = driving(Pad::Absent);
            agenda.obey(hold);
            assert!(agenda.is_held());
            agenda.obey(Order::Abort);
            assert!(agenda.is_last() && !agenda.is_held());
            agenda.obey(Order::Pause);
            assert!(!agenda.is_held(), "what is over is not paused");
        }
    }

    #[test]
    fn without_a_pad_an_abort_ends_the_mission() {
        let mut agenda = driving(Pad::Absent);
        agenda.obey(Order::Abort);
        assert_eq!((agenda.now.phase, agenda.now.state), (Phase::Over, TaskState::Aborted.code()));
        agenda.obey(Order::Resume);
        assert_eq!(agenda.now.phase, Phase::Over);
    }

    #[test]
    fn with_a_pad_an_aborted_mission_can_be_resumed() {
        for pad in [Pad::Watches, Pad::Draws] {
            let mut agenda = driving(pad);
            agenda.obey(Order::Abort);
            assert_eq!((agenda.now.held, agenda.is_driving()), (Some(Hold::Aborted), false));
            // If the link breaks while the robot is held, the person's order stays in force.
            agenda.obey(Order::Unattended);
            assert_eq!(agenda.now.held, Some(Hold::Aborted));
            agenda.obey(Order::Resume);
            assert_eq!((agenda.now.phase, agenda.now.task, agenda.is_driving()), (Phase::Driving, 2, true));
        }
    }

    #[test]
    fn a_lost_robot_waits_for_help_if_people_take_part() {
        let mut agenda = driving(Pad::Watches);
        agenda.lose("no door");
        assert!(agenda.is_held() && agenda.now.reason.as_str() == "lost, waiting for help: no door");
        assert_eq!((agenda.now.phase, agenda.now.state), (Phase::Driving, TaskState::Paused.code()));
        agenda.obey(Order::Resume);
        assert!(agenda.is_driving() && !agenda.is_held());
        agenda.lose("no door");
        agenda.find();
        assert!(agenda.is_driving() && !agenda.is_held());
        agenda.obey(Order::Pause);
        agenda.find();
        assert!(agenda.is_held(), "a robot that a person stopped is not lost");
        agenda.obey(Order::Resume);
        let mut alone = driving(Pad::Absent);
        alone.lose("no door");
        assert_eq!((alone.now.phase, alone.now.state), (Phase::Ended, TaskState::Lost.code()));
    }

    #[test]
    fn after_an_abort_the_mission_can_restart_from_the_first_task() {
        let mut agenda = driving(Pad::Draws);
        agenda.obey(Order::Start);
        assert_eq!((agenda.now.phase, agenda.now.task), (Phase::Driving, 2), "it drives already");
        agenda.obey(Order::Abort);
        agenda.obey(Order::Start);
        assert_eq!((agenda.now.phase, agenda.now.task, agenda.is_driving()), (Phase::Waiting, 0, true));
    }

    /// The planner reads the pad's messages before those of the supervisor. With a mission from a file, it used to forget an abort
    /// that came before the supervisor's order to start, and drove off.
    #[test]
    fn a_mission_from_a_file_can_be_aborted_before_it_starts() {
        let mut agenda = waiting(Pad::Watches);
        agenda.obey(Order::Abort);
        agenda.obey(Order::Start);
        assert_eq!((agenda.now.held, agenda.is_driving()), (Some(Hold::Aborted), false));
        agenda.obey(Order::Resume);
        assert!(agenda.is_driving());
    }

    #[test]
    fn only_a_task_under_way_can_be_paused() {
        let mut agenda = waiting(Pad::Draws);
        agenda.obey(Order::Pause);
        agenda.obey(Order::Abort);
        assert_eq!(agenda.now.held, None);
        let mut agenda = driving(Pad::Draws);
        agenda.now.phase = Phase::Over;
        agenda.obey(Order::Unattended);
        assert_eq!(agenda.now.held, None);
    }

    #[test]
    fn after_the_last_task_the_mission_is_over() {
        let mut agenda = driving(Pad::Absent);
        agenda.end(TaskState::Reached, "there");
        agenda.tasks.pop();
        assert_eq!(agenda.due(NOTHING), Due::Stand);
        assert_eq!((agenda.now.phase, agenda.now.reason.as_str()), (Phase::Over, "1 of 3 tasks reached"));
    }

    #[test]
    fn a_task_ends_at_its_time_limit() {
        let mut agenda = driving(Pad::Absent);
        agenda.now.elapsed_s = 8.9;
        assert!(agenda.keep_going(""));
        agenda.now.elapsed_s = 9.0;
        assert!(!agenda.keep_going(""));
        assert_eq!((agenda.now.phase, agenda.now.state), (Phase::Ended, TaskState::TimedOut.code()));
        assert_eq!(agenda.now.reason.as_str(), "the time limit of 9 s passed");
    }

    fn go_to(agenda: &mut Agenda, task: u32) {
        let order = MissionCommand { order: Order::Goal.code(), task, ..bytemuck::Zeroable::zeroed() };
        let access = Access::new(Process::Planner, "sketch");
        let incoming = Incoming::new(&access, ORDERS.spec, bytemuck::bytes_of(&order), &[]);
        assert_eq!(agenda.receive(&incoming), Ok(Some(&order)));
    }

    #[test]
    fn a_goal_replaces_the_task_under_way() {
        let mut agenda = driving(Pad::Absent);
        go_to(&mut agenda, 0);
        assert_eq!((agenda.is_driving(), agenda.due(NOTHING), agenda.task()), (true, Due::Begin, 0));
        agenda.end(TaskState::Reached, "there");
        assert_eq!((agenda.due(NOTHING), agenda.task()), (Due::Begin, 1), "those after it follow");
    }

    #[test]
    fn a_goal_ends_a_pause() {
        let mut agenda = driving(Pad::Absent);
        agenda.obey(Order::Pause);
        go_to(&mut agenda, 3);
        assert!(!agenda.is_held());
        assert_eq!((agenda.due(NOTHING), agenda.task()), (Due::Begin, 3));
    }

    #[test]
    fn an_unknown_goal_and_one_after_the_end_change_nothing() {
        let mut agenda = driving(Pad::Absent);
        go_to(&mut agenda, 4);
        assert_eq!((agenda.phase(), agenda.task()), (Phase::Driving, 2));
        agenda.obey(Order::Abort);
        go_to(&mut agenda, 1);
        assert_eq!(agenda.phase(), Phase::Over);
    }

    #[test]
    fn a_robot_standing_still_reports_what_it_waits_for() {
        let mut agenda = waiting(Pad::Absent);
        let mut reported = |missing: Option<&str>| {
            assert_eq!(agenda.due(missing), Due::Stand);
            agenda.now.reason
        };
        assert_eq!(reported(Some("waiting for the route")).as_str(), "waiting for the route");
        assert_eq!(reported(None).as_str(), "waiting for the order to start");
        agenda.obey(Order::Start);
        assert_eq!((agenda.due(Some("waiting for the pose")), agenda.task()), (Due::Stand, 0));
        assert_eq!((agenda.due(NOTHING), agenda.due(NOTHING)), (Due::Begin, Due::Drive));
        agenda.end(TaskState::Reached, "there");
        assert_eq!((agenda.due(Some("waiting for the pose")), agenda.task()), (Due::Stand, 1));
        assert_eq!((agenda.due(NOTHING), agenda.task()), (Due::Begin, 1));
    }
}
