//! The planner drives the robot to its goals in a drawing.
//!
//! The planner responds to every estimate with a plan if one is due, a command and, last, a status. In lockstep, the response to
//! the first estimate waits for the sketch, the route and the order to start. In real time, the robot stands still until these have
//! arrived. Orders come from the supervisor and the pad.
//!
//! The module `driving` computes velocities from estimates, and the [`Agenda`] is responsible for the order of tasks, people's
//! orders and time limits. Memory is only allocated when a sketch, a route or an order to go to a place arrives.

mod arrival;
mod driving;
mod explorer;
mod pace;
mod reason;

use crate::messages::{
    CORRESPONDENCE, ESTIMATE, Origin, PLAN, Plan, PoseEstimate, QUESTION, QuestionKind, ROUTE, Route, SKETCH,
    SketchMap,
};
use crate::mission::SketchMission;
use serde::{Deserialize, Serialize};
use sketchnav_mapping::{KidnapDetector, Scan};
use sketchnav_motion::agenda::{Agenda, Due, Hold, Phase, Standing, TaskInfo};
use sketchnav_schemas::channels::{ODOMETRY, SCAN, STATUS};
use sketchnav_schemas::codes::{Order, Process, TaskState, Tracking};
use sketchnav_schemas::geometry::{Base, Point, Pose, Sketch};
use sketchnav_schemas::message::{MissionCommand, NamedPlace, Odometry};
use sketchnav_schemas::mission::{Mission, MissionError};
use sketchnav_schemas::robot::RobotError;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_stage::{Incoming, Instant, Outbox, Remains, Stage, StageError};

use self::driving::{Driver, TaskStatus};
pub use self::explorer::locate as locate_by_outline;
pub use self::reason::ROOMS;
use self::reason::{Help, Reason};
use crate::paths::chart::Chart;
use crate::paths::parameters::{ParameterError, Parameters};
use crate::sketch::{CellsError, SketchGrid};
use crate::task::Task;

/// An error that prevents the planner from working.
#[derive(Debug, thiserror::Error)]
pub enum PlannerError {
    /// An error in the mission keys of this navigator.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The robot lacks the laser or the odometry.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A parameter is invalid.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The robot's laser is not suitable for mapping.
    #[error(transparent)]
    Mapping(#[from] sketchnav_mapping::Error),
    /// The sketch's cells do not match its size.
    #[error(transparent)]
    Cells(#[from] CellsError),
}

/// The state that changes from step to step, for checkpoints, without the sketch and the route. `D` is the driver's state, or a
/// view of it for writing, and `K` is the detector, or a reference to it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct State<D = driving::State, K = KidnapDetector> {
    agenda: Standing,
    place: Option<NamedPlace>,
    drawing: DrawingSeq,
    asking: Asking,
    kidnapping: K,
    driver: D,
}

/// The state of questions to a person.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Asking {
    /// Time for which the current question has been open, in seconds.
    for_s: f64,
    /// Kind of the last question sent, as the code of a [`QuestionKind`].
    sent: u32,
}

/// Sequence numbers of the latest sketch and the latest route, or 0 before the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
struct DrawingSeq {
    sketch: u64,
    route: u64,
}

/// The planner of a run.
#[derive(Debug)]
pub struct Planner {
    base_from_laser: Pose<Base>,
    wall_direction_rad: f64,
    pad: Pad,
    tasks: Option<Vec<Task>>,
    /// A place that a person gave as the goal by its name. It follows the last task on the agenda.
    place: Option<NamedPlace>,
    /// Sequence number of the sketch that the tasks refer to, if the route states it.
    tasks_sketch: u64,
    /// Width and height of the drawing, in pixels.
    size_px: [f64; 2],
    ask_patience_s: f64,
    asking: Asking,
    /// Time, in nanoseconds, up to which people's reports of the robot's place are too old to use.
    too_old_ns: Option<u64>,
    driver: Driver,
    /// Notices that somebody has carried the robot. The localizer has one as well.
    kidnapping: KidnapDetector,
    /// Where the sketch comes from.
    origin: Origin,
    run: RunConfig,
    agenda: Agenda,
    drawing: DrawingSeq,
}

impl Planner {
    /// Creates the planner of a run for its robot and mission parameters.
    ///
    /// # Errors
    /// [`PlannerError`] if the mission's table `parameters.planner` is invalid or the robot lacks a sensor.
    pub fn new(run: &RunConfig) -> Result<Self, PlannerError> {
        let origin = SketchMission::of(&run.mission)?.expected_origin();
        let parameters = of_run(run, origin)?;
        let robot = &run.robot;
        robot.odometry()?;
        let laser = robot.laser()?;
        Ok(Self {
            base_from_laser: laser.mount(),
            wall_direction_rad: 0.0,
            pad: run.pad,
            tasks: None,
            place: None,
            tasks_sketch: 0,
            size_px: [0.0; 2],
            ask_patience_s: parameters.ask_patience_s,
            asking: Asking::default(),
            too_old_ns: None,
            driver: Driver::new(parameters, robot, laser)?,
            kidnapping: KidnapDetector::default(),
            origin,
            run: run.clone(),
            agenda: Agenda::empty(run),
            drawing: DrawingSeq::default(),
        })
    }

    /// Accepts a drawing and its cells. If people draw during the run, a new drawing ends the task under way and discards all tasks
    /// that belong to the previous drawing.
    fn on_sketch(&mut self, map: &SketchMap, cells: &[u8]) -> Result<(), PlannerError> {
        let sketch = SketchGrid::of_map(map, cells)?;
        if map.origin() != self.origin {
            self.origin = map.origin();
            let parameters = of_run(&self.run, self.origin)?;
            self.driver = Driver::new(parameters, &self.run.robot, self.run.robot.laser()?)?;
        }
        self.wall_direction_rad = map.wall_direction_rad;
        self.size_px = [map.width_px, map.height_px].map(f64::from);
        let before = std::mem::replace(&mut self.drawing.sketch, map.header.seq);
        if self.pad.draws() && before != 0 && before != map.header.seq {
            self.driver.forget();
            self.begin_again();
            if self.tasks_sketch != map.header.seq {
                self.set_tasks(None);
            }
        }
        self.driver.on_sketch(&sketch, &map.start());
        self.kidnapping = KidnapDetector::default();
        Ok(())
    }

    /// Accepts the tasks of a route, unless the first task has begun. If people draw during the run, new tasks are accepted
    /// whenever the robot is not driving.
    fn on_route(&mut self, route: &Route) {
        let is_open = match self.pad.draws() {
            true => !self.agenda.is_driving(),
            false => self.agenda.phase() == Phase::Waiting,
        };
        if !is_open {
            return;
        }
        let before = std::mem::replace(&mut self.drawing.route, route.header.seq);
        if self.pad.draws() && before != 0 && before != route.header.seq {
            self.begin_again();
        }
        self.set_tasks(Some(Task::of_route(route)));
        self.tasks_sketch = route.header.source_seq;
    }

    fn set_tasks(&mut self, tasks: Option<Vec<Task>>) {
        self.tasks = tasks;
        self.list_tasks();
    }

    fn set_place(&mut self, place: Option<NamedPlace>) {
        self.place = place;
        self.list_tasks();
    }

    /// Puts the tasks on the agenda, and the place after them.
    fn list_tasks(&mut self) {
        let place = self.place.as_ref().map(Task::from);
        self.agenda.set_tasks(self.tasks.iter().flatten().chain(&place).map(TaskInfo::from));
    }

    fn begin_again(&mut self) {
        self.agenda.begin_again();
        self.set_place(None);
    }

    /// Handles a person's order. `held` is the reason why the robot was held before the order, if any.
    fn on_order(&mut self, order: &MissionCommand, held: Option<Hold>) {
        match Order::from_code(order.order) {
            Some(Order::Goal) => self.on_goal(order),
            Some(Order::Start) if self.agenda.task() == 0 => self.set_place(None),
            _ => {}
        }
        let now_s = self.agenda.elapsed_s();
        if let Some(here) = order.here().filter(|here| self.is_told(order, &here.at)) {
            self.driver.tell(&here, now_s);
            self.agenda.find();
        } else if matches!(held, Some(Hold::Lost | Hold::Asks)) && self.agenda.held().is_none() {
            self.driver.go_on_alone(now_s);
        }
    }

    /// Goes to the place of an order. If the order names a task instead, the agenda has already switched to it, and an earlier place
    /// no longer follows the tasks.
    fn on_goal(&mut self, order: &MissionCommand) {
        let Some(count) = self.tasks.as_ref().map(Vec::len) else { return };
        if let Some(place) = order.place().filter(|place| self.is_told(order, &place.at)) {
            self.set_place(Some(place));
            self.agenda.go_to(count);
        } else if (order.task as usize) < count {
            self.set_place(None);
        }
    }

    /// Returns true if the place reported by a person is in the drawing, and the report is newer than the start of the planner.
    fn is_told(&self, order: &MissionCommand, at: &Point<Sketch>) -> bool {
        let is_old = self.too_old_ns.is_some_and(|old_ns| order.header.stamp_ns <= old_ns);
        let [width, height] = self.size_px;
        !is_old && (0.0..width).contains(&at.x) && (0.0..height).contains(&at.y)
    }

    /// Returns the missing part of the drawing, if any.
    fn missing(&self) -> Option<Reason> {
        match (self.driver.has_sketch(), &self.tasks) {
            (false, _) => Some(Reason::NoSketch),
            (true, None) => Some(Reason::NoRoute),
            (true, Some(_)) => None,
        }
    }

    fn keep_going(&mut self, estimate: &PoseEstimate, dt_s: f64) {
        let known = Tracking::from_code(estimate.tracking).is_some_and(|t| t != Tracking::Waiting);
        let chart = Chart::new(estimate, self.wall_direction_rad).filter(|_| known);
        let no_pose = (self.agenda.is_ordered() && chart.is_none()).then_some(Reason::NoPose);
        match (self.agenda.due(self.missing().or(no_pose)), chart) {
            (Due::Stand, _) => {
                self.driver.stop(dt_s);
                self.await_answer(dt_s);
            }
            (Due::Begin | Due::Drive, None) => {
                self.agenda.report(TaskState::Driving, Reason::NoPose);
                self.driver.stop(dt_s);
            }
            (due, Some(chart)) => {
                if due == Due::Begin {
                    self.begin(&chart);
                }
                self.drive(&chart, estimate, dt_s);
            }
        }
    }

    /// Ends a question that nobody has answered in time.
    fn await_answer(&mut self, dt_s: f64) {
        if self.agenda.held() != Some(Hold::Asks) {
            return;
        }
        self.asking.for_s += dt_s;
        if self.asking.for_s >= self.ask_patience_s {
            self.driver.go_on_alone(self.agenda.elapsed_s());
            self.agenda.find();
        }
    }

    fn begin(&mut self, chart: &Chart) {
        let place = self.place.as_ref().map(Task::from);
        if let Some(task) = self.tasks.iter().flatten().chain(&place).nth(self.agenda.task()) {
            self.driver.begin(task, chart);
        }
    }

    fn drive(&mut self, chart: &Chart, estimate: &PoseEstimate, dt_s: f64) {
        let tracking = Tracking::from_code(estimate.tracking).unwrap_or(Tracking::Lost);
        match self.driver.drive(
            chart,
            estimate.fit,
            tracking,
            estimate.is_placed(),
            self.agenda.elapsed_s(),
            dt_s,
        ) {
            TaskStatus::Asks(question) => {
                self.asking.for_s = 0.0;
                self.agenda.ask(question);
            }
            TaskStatus::Ended(TaskState::Lost, reason) if !self.pad.is_absent() => {
                self.agenda.lose(Help(reason));
            }
            TaskStatus::Ended(state, reason) => self.agenda.end(state, reason),
            TaskStatus::Driving(reason) => {
                if !self.agenda.keep_going(reason) {
                    self.driver.stop(dt_s);
                }
            }
        }
    }

    fn write_plan(&self, plan: &mut Plan) {
        plan.task = self.agenda.task() as u32;
        plan.follows_route = self.driver.follows_route().into();
        let target = self.driver.target_px();
        plan.target_px = [target.x, target.y];
        let global = self.driver.global_path().iter().map(|p| [p.x as f32, p.y as f32]);
        plan.global_count = thin(global, &mut plan.global_px) as u32;
        let local = self.driver.local_path_px().map(|p| [p.x as f32, p.y as f32]);
        plan.local_count = thin(local, &mut plan.local_px) as u32;
    }

    /// Sends a question if it differs from the last one, or reports that the last one is over.
    fn ask(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let kind = match self.agenda.held() {
            Some(Hold::Asks) => QuestionKind::Which,
            Some(Hold::Lost) => QuestionKind::Where,
            _ => QuestionKind::Nothing,
        };
        if std::mem::replace(&mut self.asking.sent, kind.code()) == kind.code() {
            return Ok(());
        }
        out.send(QUESTION, |question| {
            question.kind = kind.code();
            if kind == QuestionKind::Which {
                self.driver.write_question(question);
            }
        })?;
        Ok(())
    }

    fn send(&mut self, odometry: &Odometry, out: &mut Outbox<'_>) -> Result<(), StageError> {
        if self.driver.planned() {
            out.send(PLAN, |plan| self.write_plan(plan))?;
        }
        if self.driver.has_news() {
            out.send(CORRESPONDENCE, |found| {
                found.odometry = odometry.pose;
                self.driver.write_correspondence(found);
            })?;
        }
        self.ask(out)?;
        self.agenda.send(self.driver.command(), self.driver.remaining_m(), out)
    }
}

impl Stage for Planner {
    const FORM: &'static str = "sketch planner 16";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        let held = self.agenda.held();
        if let Some(sketch) = message.on(SKETCH)? {
            self.on_sketch(sketch, message.cells())?;
        } else if let Some(route) = message.on(ROUTE)? {
            self.on_route(route);
        } else if let Some(order) = self.agenda.receive(message)? {
            self.on_order(order, held);
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.agenda.is_ready(self.missing().is_none())
    }

    /// Before the first scan and odometry, there is no response to an instant. This is safe because the world stops a robot without
    /// commands.
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let (Some(estimate), Some(odometry), Some(_)) =
            (instant.newest(ESTIMATE)?, instant.newest(ODOMETRY)?, instant.newest(SCAN)?)
        else {
            return Ok(());
        };
        let dt_s = self.agenda.begin_step(instant.stamp_ns, odometry);
        self.driver.begin_step();
        if let Some(scan) = instant.fresh(SCAN)? {
            let robot = odometry.pose();
            if self.kidnapping.observe(robot, &Scan::of_message(scan, self.base_from_laser)) {
                self.driver.begin_elsewhere();
            }
            self.driver.observe(&robot, &robot.compose(&self.base_from_laser), scan);
        }
        self.keep_going(estimate, dt_s);
        self.send(odometry, out)
    }

    fn state(&self) -> impl Serialize {
        let (agenda, driver) = (self.agenda.standing(), self.driver.state());
        let (place, drawing, asking) = (self.place, self.drawing, self.asking);
        State { agenda, place, drawing, asking, kidnapping: &self.kidnapping, driver }
    }

    /// The sketch and the route of the state must have arrived again. If people draw during the run, newer ones may have arrived
    /// instead. The planner then waits for the order to start.
    fn restore(&mut self, state: State) -> Result<(), StageError> {
        self.agenda.restore(state.agenda);
        self.asking = state.asking;
        if state.drawing == self.drawing || !self.pad.draws() {
            self.set_place(state.place);
            self.driver.restore(state.driver);
            self.drawing = state.drawing;
            self.kidnapping = state.kidnapping;
        } else {
            self.begin_again();
        }
        Ok(())
    }

    fn recover(&mut self, remains: &dyn Remains) {
        self.agenda.recover(remains);
        self.too_old_ns = remains.of(STATUS).map(|last| last.header.stamp_ns);
    }
}

/// Returns the planner's parameters for a run, in a sketch of this origin.
fn of_run(run: &RunConfig, origin: Origin) -> Result<Parameters, PlannerError> {
    let mut parameters = parameters(&run.mission, origin)?;
    if run.pad.is_absent() {
        // Without a pad, nobody can answer.
        parameters.ask_margin = 0.0;
    }
    Ok(parameters)
}

/// Returns the planner's parameters in a mission, in a sketch of this origin.
///
/// # Errors
/// [`PlannerError`] with the key of the mission.
pub fn parameters(mission: &Mission, origin: Origin) -> Result<Parameters, PlannerError> {
    let usual = SketchMission::of(mission)?.usual(origin, Parameters::of, Parameters::learned);
    let parameters = mission.parameters.over(Process::Planner, &usual)?;
    parameters.check()?;
    Ok(parameters)
}

/// Writes `points` to `out` and returns the number written. If there are too many, they are thinned evenly, always keeping the last
/// one. The rest of `out` is zero.
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
