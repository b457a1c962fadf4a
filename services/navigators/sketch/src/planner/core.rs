//! The planner without its process: a pure function from messages to messages, and its state.
//!
//! Each estimate, with the scan that caused it, is a step. [`Core::step`] decides. Then [`Core::write_plan`] (where
//! the step planned), [`Core::write_command`] and [`Core::write_status`] write the messages of the step. They write
//! straight into the memory from which these are sent. The sender sets the `seq` of their headers.
//!
//! Knows no clock, file, thread or channel; draws no random numbers; allocates only when a sketch,
//! a route or a configuration arrives.
//!
//! `driving` goes from the estimate to the velocity. Task order, orders and time limits are
//! [`sketchnav_motion::mission`]'s.

use crate::planning::chart::Chart;
use crate::planning::parameters::{ParameterError, Parameters};
use crate::sketch::{CellsError, SketchGrid};
use crate::task::Task;
use serde::{Deserialize, Serialize};
use sketchnav_motion::mission::{Hold, Mission, Phase, TaskInfo};
use sketchnav_schemas::codes::{Process, QuestionKind, TaskState, Tracking};
use sketchnav_schemas::geometry::{Base, Pose};
use sketchnav_schemas::message::{
    Correspondence, Here, LaserScan, MissionCommand, MissionStatus, Odometry, Plan, PoseEstimate, Question,
    Route, SketchMap, Text, VelocityCommand,
};
use sketchnav_schemas::mission::{self as missions, MissionError, overlaid};
use sketchnav_schemas::robot::RobotError;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_schemas::sketch_mission::SketchMission;

use super::driving::{Driver, Memory, MemoryView, TaskStatus};
use super::reason::{Help, Reason};

/// What the planner cannot work with.
#[derive(Debug, thiserror::Error)]
pub enum PlannerError {
    /// The mission's part for this navigator.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The mission's table `parameters.planner` has a key that is not known or a value of the wrong type.
    #[error("parameters.planner: {0}")]
    Table(String),
    /// The robot lacks the laser or the odometry.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// An invalid parameter.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The robot's laser cannot be mapped with.
    #[error(transparent)]
    Mapping(#[from] sketchnav_mapping::Error),
    /// The sketch does not hold what it says.
    #[error(transparent)]
    Cells(#[from] CellsError),
}

/// What a step made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Whether there is a new plan to send.
    pub planned: bool,
    /// Whether the mission is over: the command says so.
    pub last: bool,
}

/// The planner's state, as it is read back from a checkpoint.
#[derive(Debug, Clone, Deserialize)]
pub struct State {
    mission: Mission,
    drawing: DrawingSeq,
    asking: Asking,
    driver: Memory,
}

/// What a person is asked.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Asking {
    /// For so long, seconds.
    for_s: f64,
    /// The kind of question that was sent last: a number of [`QuestionKind`].
    sent: u32,
}

/// The numbers of the sketch and of the route that have come last; 0 before the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
struct DrawingSeq {
    sketch: u64,
    route: u64,
}

/// The same where it lies, to be written: field by field a [`State`].
#[derive(Debug, Serialize)]
pub struct StateView<'a> {
    mission: &'a Mission,
    drawing: DrawingSeq,
    asking: Asking,
    driver: MemoryView<'a>,
}

/// The planner's core.
#[derive(Debug)]
pub struct Core {
    nominal_dt_s: f64,
    base_from_laser: Pose<Base>,
    wall_direction_rad: f64,
    pad: Pad,
    tasks: Option<Vec<Task>>,
    /// The sketch that the tasks are places of, where the route says so.
    tasks_sketch: u64,
    /// Width and height of the drawing.
    size_px: [f64; 2],
    ask_patience_s: f64,
    asking: Asking,
    /// Places that were told up to this time are too old, nanoseconds.
    too_old_ns: Option<u64>,
    driver: Driver,
    mission: Mission,
    drawing: DrawingSeq,
}

impl Core {
    /// For a run: its robot and the parameters of its mission.
    ///
    /// # Errors
    /// [`PlannerError`] where the mission's table `parameters.planner` is not as it should be, or the robot lacks a
    /// sensor.
    pub fn new(config: &RunConfig) -> Result<Self, PlannerError> {
        let mut parameters = parameters(&config.mission)?;
        if config.pad.is_absent() {
            // Nobody could answer.
            parameters.ask_margin = 0.0;
        }
        let robot = &config.robot;
        robot.odometry()?;
        let laser = robot.laser()?;
        Ok(Self {
            nominal_dt_s: 1.0 / robot.tick_hz(),
            base_from_laser: laser.mount(),
            wall_direction_rad: 0.0,
            pad: config.pad,
            tasks: None,
            tasks_sketch: 0,
            size_px: [0.0; 2],
            ask_patience_s: parameters.ask_patience_s,
            asking: Asking::default(),
            too_old_ns: None,
            driver: Driver::new(parameters, robot, laser)?,
            mission: Mission::new(config.pad),
            drawing: DrawingSeq::default(),
        })
    }

    /// Takes over a drawing and its cells. Where people draw while the robot runs, another drawing than
    /// before ends whatever was under way, and tasks that belong to the one before.
    ///
    /// # Errors
    /// [`PlannerError::Cells`] where the cells are not as many as the message says.
    pub fn on_sketch(&mut self, map: &SketchMap, cells: &[u8]) -> Result<(), PlannerError> {
        let sketch = SketchGrid::of_map(map, cells)?;
        self.wall_direction_rad = map.wall_direction_rad;
        self.size_px = [map.width_px, map.height_px].map(f64::from);
        let before = std::mem::replace(&mut self.drawing.sketch, map.header.seq);
        if self.pad.draws() && before != 0 && before != map.header.seq {
            self.driver.forget();
            self.mission.begin_anew();
            self.tasks.take_if(|_| self.tasks_sketch != map.header.seq);
        }
        self.driver.on_sketch(&sketch, map.start.pose());
        Ok(())
    }

    /// Takes over the tasks, until the first has begun; then they stand. Where people draw while the robot runs,
    /// others take their place whenever it does not drive.
    pub fn on_route(&mut self, route: &Route) {
        let is_open = match self.pad.draws() {
            true => !self.mission.is_driving(),
            false => self.mission.phase() == Phase::Waiting,
        };
        if !is_open {
            return;
        }
        let before = std::mem::replace(&mut self.drawing.route, route.header.seq);
        if self.pad.draws() && before != 0 && before != route.header.seq {
            self.mission.begin_anew();
        }
        (self.tasks, self.tasks_sketch) = (Some(Task::of_route(route)), route.header.source_seq);
    }

    /// Does what a person orders; an order that is not known is ignored.
    pub fn on_order(&mut self, order: &MissionCommand) {
        let (held, count) = (self.mission.held(), self.tasks().len());
        self.mission.on_order(order, count);
        let now_s = self.mission.elapsed_s();
        if let Some(here) = order.here().filter(|here| self.is_told(order, here)) {
            self.driver.tell(&here, now_s);
            self.mission.find();
        } else if matches!(held, Some(Hold::Lost | Hold::Asks)) && self.mission.held().is_none() {
            self.driver.go_on_alone(now_s);
        }
    }

    /// Whether a place that a person tells is one of the drawing, and newer than what was known at the beginning.
    fn is_told(&self, order: &MissionCommand, here: &Here) -> bool {
        let is_old = self.too_old_ns.is_some_and(|old_ns| order.header.stamp_ns <= old_ns);
        let [width, height] = self.size_px;
        !is_old && (0.0..width).contains(&here.at.x) && (0.0..height).contains(&here.at.y)
    }

    /// The whole changing state, for a checkpoint; the sketch and the route are not in it.
    pub fn state(&self) -> StateView<'_> {
        StateView {
            mission: &self.mission,
            drawing: self.drawing,
            asking: self.asking,
            driver: self.driver.memory(),
        }
    }

    /// Goes on from a checkpoint. Its sketch and its route must have come again. Where people draw while the robot
    /// runs, newer ones may have: then it waits for the order to start.
    pub fn restore(&mut self, state: State) {
        (self.mission, self.asking) = (state.mission, state.asking);
        if state.drawing == self.drawing || !self.pad.draws() {
            self.driver.restore(state.driver);
            self.drawing = state.drawing;
        } else {
            self.mission.begin_anew();
        }
    }

    /// Begins, without a checkpoint, with the task that a predecessor's last status was about.
    pub fn resume_behind(&mut self, last: &MissionStatus) {
        self.mission.resume_behind(last);
        self.too_old_ns = Some(last.header.stamp_ns);
    }

    /// Whether the sketch and the route have come.
    pub fn has_drawing(&self) -> bool {
        self.tasks.is_some() && self.driver.has_sketch()
    }

    /// Whether the sketch, the route and the order to start have come.
    pub fn is_ready(&self) -> bool {
        self.mission.is_ordered() && self.has_drawing()
    }

    /// Takes a step: the estimate, the scan of that time where there is a new one, and the odometry.
    pub fn step(&mut self, estimate: &PoseEstimate, scan: Option<&LaserScan>, odometry: &Odometry) -> Step {
        let dt_s = self.mission.begin_step(&estimate.header, odometry, self.nominal_dt_s);
        let robot = odometry.pose();
        self.driver.begin_step();
        if let Some(scan) = scan {
            self.driver.observe(&robot, &robot.compose(&self.base_from_laser), scan);
        }
        let known = Tracking::from_code(estimate.tracking).is_some_and(|t| t != Tracking::Waiting);
        let chart = Chart::new(estimate, self.wall_direction_rad).filter(|_| known);
        if self.mission.is_held() {
            self.driver.stop(dt_s);
            self.await_answer(dt_s);
        } else {
            self.go_on(chart.as_ref(), estimate, dt_s);
        }
        Step { planned: self.driver.planned(), last: self.mission.is_last() }
    }

    /// A question that nobody answers in time is none any more.
    fn await_answer(&mut self, dt_s: f64) {
        if self.mission.held() != Some(Hold::Asks) {
            return;
        }
        self.asking.for_s += dt_s;
        if self.asking.for_s >= self.ask_patience_s {
            self.driver.go_on_alone(self.mission.elapsed_s());
            self.mission.find();
        }
    }

    /// With a chart where there is a pose.
    fn go_on(&mut self, chart: Option<&Chart>, estimate: &PoseEstimate, dt_s: f64) {
        self.begin_what_is_due(chart);
        match (self.mission.phase(), chart) {
            (Phase::Driving, Some(chart)) => self.drive(chart, estimate, dt_s),
            (Phase::Driving, None) => self.wait(TaskState::Driving, Reason::NoPose, dt_s),
            (Phase::Waiting, _) => self.wait(TaskState::Waiting, self.missing(), dt_s),
            (Phase::Ended | Phase::Over, _) => self.driver.stop(dt_s),
        }
    }

    /// Writes the plan of the step that planned.
    pub fn write_plan(&self, plan: &mut Plan) {
        plan.header = self.mission.header();
        plan.task = self.mission.task() as u32;
        plan.follows_route = self.driver.follows_route().into();
        let target = self.driver.target_px();
        plan.target_px = [target.x, target.y];
        let global = self.driver.global_path().iter().map(|p| [p.x as f32, p.y as f32]);
        plan.global_count = thin(global, &mut plan.global_px) as u32;
        let local = self.driver.local_path_px().map(|p| [p.x as f32, p.y as f32]);
        plan.local_count = thin(local, &mut plan.local_px) as u32;
    }

    /// Whether there is something new of what corresponds to what; once.
    pub fn has_news(&mut self) -> bool {
        self.driver.has_news()
    }

    /// Writes what of the drawing corresponds to what was seen, except for its header.
    pub fn write_correspondence(&self, odometry: &Odometry, out: &mut Correspondence) {
        out.odometry = odometry.pose;
        self.driver.write_correspondence(out);
    }

    /// Whether there is a new question to send, or the last one is over; once.
    pub fn has_question(&mut self) -> bool {
        let kind = self.question().code();
        std::mem::replace(&mut self.asking.sent, kind) != kind
    }

    fn question(&self) -> QuestionKind {
        match self.mission.held() {
            Some(Hold::Asks) => QuestionKind::Which,
            Some(Hold::Lost) => QuestionKind::Where,
            _ => QuestionKind::Nothing,
        }
    }

    /// Writes what a person is asked, except for its header.
    pub fn write_question(&self, out: &mut Question) {
        out.kind = self.question().code();
        if self.question() == QuestionKind::Which {
            self.driver.write_question(out);
        }
    }

    /// Writes the step's command.
    pub fn write_command(&self, command: &mut VelocityCommand) {
        let last = self.mission.is_last().into();
        *command = VelocityCommand {
            header: self.mission.header(),
            twist: self.driver.command(),
            last,
            reserved: 0,
        };
    }

    /// Writes how the mission stands after the step.
    pub fn write_status(&self, status: &mut MissionStatus) {
        let info = self.task_info();
        self.mission.write_status(info.as_ref(), self.tasks().len(), self.driver.remaining_m(), status);
    }

    fn tasks(&self) -> &[Task] {
        self.tasks.as_deref().unwrap_or_default()
    }

    fn task_info(&self) -> Option<TaskInfo> {
        let task = self.tasks().get(self.mission.task())?;
        Some(TaskInfo { name: Text::new(&task.name), time_limit_s: task.time_limit_s })
    }

    fn missing(&self) -> Reason {
        match (self.driver.has_sketch(), &self.tasks, self.mission.is_ordered()) {
            (false, ..) => Reason::NoSketch,
            (_, None, _) => Reason::NoRoute,
            (_, _, false) => Reason::NoOrder,
            _ => Reason::NoPose,
        }
    }

    fn wait(&mut self, state: TaskState, reason: Reason, dt_s: f64) {
        self.mission.report(state, reason);
        self.driver.stop(dt_s);
    }

    /// Begins the task that is due, as soon as there is a pose.
    fn begin_what_is_due(&mut self, chart: Option<&Chart>) {
        let Some(next) = self.mission.due(self.is_ready(), self.tasks().len()) else { return };
        match chart {
            Some(chart) => {
                self.driver.begin(&self.tasks.as_deref().unwrap_or_default()[next], chart);
                self.mission.begin(next);
            }
            None => self.mission.wait_for(next),
        }
    }

    fn drive(&mut self, chart: &Chart, estimate: &PoseEstimate, dt_s: f64) {
        let Some(task) = self.task_info() else { return };
        let lost = Tracking::from_code(estimate.tracking) == Some(Tracking::Lost);
        match self.driver.drive(chart, estimate.fit, lost, self.mission.elapsed_s(), dt_s) {
            TaskStatus::Asks(question) => {
                self.asking.for_s = 0.0;
                self.mission.ask(question);
            }
            TaskStatus::Ended(TaskState::Lost, reason) if !self.pad.is_absent() => {
                self.mission.lose(Help(reason));
            }
            TaskStatus::Ended(state, reason) => self.mission.end(state, reason),
            TaskStatus::Driving(reason) => {
                if !self.mission.go_on(&task, reason) {
                    self.driver.stop(dt_s);
                }
            }
        }
    }
}

/// The parameters that a mission gives the planner.
///
/// # Errors
/// [`PlannerError`] with the key of the mission.
pub fn parameters(mission: &missions::Mission) -> Result<Parameters, PlannerError> {
    let method = SketchMission::of(mission)?.method;
    let parameters = overlaid(&Parameters::of(method), mission.parameters.of(Process::Planner))
        .map_err(|error| PlannerError::Table(error.message().to_owned()))?;
    parameters.check()?;
    Ok(parameters)
}

/// Writes `points` into `out`, evenly thinned where there are too many, the last one always in;
/// what lies behind is zero. Returns how many were written.
fn thin<const N: usize>(points: impl ExactSizeIterator<Item = [f32; 2]>, out: &mut [[f32; 2]; N]) -> usize {
    *out = [[0.0; 2]; N];
    let (len, count) = (points.len(), points.len().min(N));
    let mut written = 0;
    for (i, point) in points.enumerate() {
        let due = if count > 1 { written * (len - 1) / (count - 1) } else { 0 };
        if written < count && i == due {
            out[written] = point;
            written += 1;
        }
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_both_ends() {
        let mut out = [[9.0; 2]; 4];
        let points = (0..10).map(|i| [i as f32, 0.0]);
        assert_eq!(thin(points, &mut out), 4);
        assert_eq!(out.map(|p| p[0]), [0.0, 3.0, 6.0, 9.0]);
        assert_eq!(thin((0..2).map(|i| [i as f32, 0.0]), &mut out), 2);
        assert_eq!(out.map(|p| p[0]), [0.0, 1.0, 0.0, 0.0]);
    }
}
