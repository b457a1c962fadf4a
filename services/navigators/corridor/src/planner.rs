//! The planner stage of `corridor`, which drives by rules or finds a way ahead through free space.
//!
//! The planner responds to each message of relations with one command and one status. Rules apply while a
//! pair of markers is in view. Between two pairs, the last command stays in force (Patil 2019, 3.2).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use sketchnav_motion::agenda::{Agenda, Due, Standing};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::codes::{Process, TaskState};
use sketchnav_schemas::floor_plan::Marker;
use sketchnav_schemas::geometry::{Base, Odom, Pose, wrap_angle};
use sketchnav_schemas::message::Twist;
use sketchnav_schemas::mission::{Mission, MissionError};
use sketchnav_schemas::robot::{Drive, Robot};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Denied, Incoming, Instant, Outbox, Remains, Stage, StageError};

use crate::course::{self, Course, Next, Reason};
use crate::error::{CorridorError, RulesError};
use crate::messages::{RELATIONS, RULES, Relations};
use crate::mission::{CorridorMission, CorridorTask, Goal, Method, Turn};
use crate::perception::LEAST_HZ;
use crate::rules::Rules;

/// Maximum distance at which a marker can count as passed, in metres.
const PASSED_M: f64 = 4.0;
/// Minimum distance, in metres, at which a marker counts as ahead, because the estimated direction of a corridor varies by a few
/// degrees.
const AHEAD_M: f64 = 0.3;

/// Maximum turn rate while the robot turns around, in radians per second.
const ABOUT_RADPS: f64 = 0.5;
/// Turn rate per radian that remains to be turned, in 1/s.
const ABOUT_PER_S: f64 = 2.0;
/// Remaining angle at which turning around is complete, in radians.
const ABOUT_RAD: f64 = 0.01;

/// Parameters that a mission can set in its table `parameters.planner`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Time, in seconds, after which a robot that drives by rules is lost if it sees no pair of markers. With
    /// 0, it is never lost and keeps driving by its last command, as in Patil 2019.
    pub lost_s: f64,
    /// Top speed of the method `corridor`, in metres per second. Rule files define their own speeds.
    pub speed_mps: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { lost_s: 20.0, speed_mps: 0.4 }
    }
}

/// An attempt at a task.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Attempt {
    start: Pose<Odom>,
    /// Direction that the robot must face before it drives, in radians in the odometry frame. `None` unless
    /// it is turning around.
    about_rad: Option<f64>,
    /// Number of the last pair that the rules were applied to.
    pairs: u64,
    /// Whether the goal marker has been ahead of the robot since the last turn.
    was_ahead: bool,
    /// Number of turns at the last step, used to detect a new turn.
    turns: u32,
    /// The last move that the rules called for. It stays in force until the next one, even while the robot
    /// turns around: without a pair in view "no update to the robot's motion can be made" (Patil 2019, figure
    /// 5.2).
    answer: Velocity,
    command: Velocity,
}

impl Attempt {
    fn new(start: Pose<Odom>, pairs: u64, answer: Velocity) -> Self {
        Self { start, about_rad: None, pairs, was_ahead: false, turns: 0, answer, command: [0.0; 3] }
    }
}

/// A velocity in a checkpoint: forward and left in m/s, turn rate in rad/s.
type Velocity = [f64; 3];

/// Planner of a run.
pub struct Planner {
    method: Method,
    tasks: Vec<CorridorTask>,
    parameters: Parameters,
    base_from_laser: Option<Pose<Base>>,
    rules: Option<Rules>,
    agenda: Agenda,
    attempt: Attempt,
    course: Course,
    remaining_m: f64,
}

/// State that is kept from one step to the next, for a checkpoint. `C` is the state of the course, owned or
/// borrowed.
#[derive(Debug, Serialize, Deserialize)]
pub struct State<C = course::State> {
    agenda: Standing,
    attempt: Attempt,
    course: C,
    remaining_m: f64,
}

/// Checks that a mission and a robot meet the requirements of this navigator.
///
/// # Errors
/// [`CorridorError`], which names the key or the sensor, if they do not.
pub fn check(mission: &Mission, robot: &Robot) -> Result<(), CorridorError> {
    let read = CorridorMission::of(mission)?;
    parameters(mission)?;
    crate::localizer::parameters(mission)?;
    robot.odometry()?;
    if read.needs_markers() {
        robot.camera()?;
    }
    if read.method != Method::Corridor {
        let camera_hz = robot.camera()?.rate_hz;
        for (key, found_hz) in [("camera.rate_hz", camera_hz), ("tick_hz", robot.tick_hz())] {
            if found_hz < LEAST_HZ {
                return Err(CorridorError::Slow { key, least_hz: LEAST_HZ, found_hz });
            }
        }
    }
    if read.method != Method::Corridor && robot.drive == Drive::Differential {
        return Err(CorridorError::Drive { robot: robot.name.clone() });
    }
    if robot.laser.is_none() && robot.camera.is_none() {
        return Err(CorridorError::Blind { robot: robot.name.clone() });
    }
    Ok(())
}

/// Checks that the markers of a floor meet the requirements of a mission.
///
/// # Errors
/// - [`CorridorError::Unmarked`] if the method depends on pairs of markers and the floor has fewer than two.
/// - [`CorridorError::Marker`] if the goal of a task is a marker that does not exist on the floor.
pub fn check_markers(mission: &Mission, markers: &[Marker]) -> Result<(), CorridorError> {
    let read = CorridorMission::of(mission)?;
    // Rules are applied to pairs of markers.
    if read.method != Method::Corridor && markers.len() < 2 {
        return Err(CorridorError::Unmarked { method: read.method.word(), found: markers.len() });
    }
    for (i, task) in read.tasks.iter().enumerate() {
        if let Goal::Marker(found) = task.goal
            && markers.iter().all(|marker| marker.id != found)
        {
            let name = task.name.clone();
            return Err(CorridorError::Marker { task: i + 1, name, found, known: numbers(markers) });
        }
    }
    Ok(())
}

/// Lists the numbers of some markers for an error message.
fn numbers(markers: &[Marker]) -> String {
    let mut numbers: Vec<_> = markers.iter().map(|marker| marker.id).collect();
    numbers.sort_unstable();
    let shown: Vec<_> = numbers.iter().take(20).map(ToString::to_string).collect();
    match (shown.is_empty(), numbers.len() > shown.len()) {
        (true, _) => "none".to_owned(),
        (_, true) => format!("{}, …", shown.join(", ")),
        (_, false) => shown.join(", "),
    }
}

/// Returns the parameters that a mission sets for the planner.
///
/// # Errors
/// [`MissionError::Key`] if a parameter is unknown or out of range.
pub fn parameters(mission: &Mission) -> Result<Parameters, MissionError> {
    let parameters = mission.parameters.over(Process::Planner, &Parameters::default())?;
    let Parameters { lost_s, speed_mps } = parameters;
    for (key, expected, found, range) in
        [("lost_s", "0 to 1e6 s", lost_s, 0.0..=1e6), ("speed_mps", "0.01 to 30 m/s", speed_mps, 0.01..=30.0)]
    {
        if !range.contains(&found) {
            let reason = format!("{key}: expected {expected}, found {found}");
            return Err(MissionError::Key { key: "parameters.planner".into(), reason });
        }
    }
    Ok(parameters)
}

impl Planner {
    /// Creates the planner of a run for its robot and its tasks, with the parameters of its mission.
    ///
    /// # Errors
    /// [`CorridorError`], which names the key or the sensor, if [`check`] fails.
    pub fn new(run: &RunConfig) -> Result<Self, CorridorError> {
        check(&run.mission, &run.robot)?;
        let CorridorMission { method, tasks, .. } = CorridorMission::of(&run.mission)?;
        let attempt = Attempt::new(Pose::new(0.0, 0.0, 0.0), 0, [0.0; 3]);
        let parameters = parameters(&run.mission)?;
        Ok(Self {
            method,
            tasks,
            parameters,
            base_from_laser: run.robot.laser.as_ref().map(|laser| laser.mount()),
            rules: None,
            agenda: Agenda::new(run),
            attempt,
            course: Course::new(&run.robot, parameters.speed_mps),
            remaining_m: 0.0,
        })
    }

    fn missing(&self) -> Option<&'static str> {
        let has_rules = self.method == Method::Corridor || self.rules.is_some();
        (!has_rules).then_some("waiting for the rules")
    }

    fn observe(
        &mut self,
        instant: &Instant<'_>,
        relations: &Relations,
        robot: &Pose<Odom>,
    ) -> Result<(), Denied> {
        if self.method != Method::Corridor {
            return Ok(());
        }
        match (self.base_from_laser, instant.fresh(SCAN)?) {
            (Some(mount), Some(scan)) => self.course.observe(robot, &robot.compose(&mount), scan),
            (Some(_), None) => {}
            (None, _) => self.course.observe_markers(robot, relations.markers()),
        }
        Ok(())
    }

    fn begin(&mut self, relations: &Relations, robot: &Pose<Odom>, answer: Velocity) {
        self.attempt = Attempt::new(*robot, relations.pairs, answer);
        self.course.begin(robot);
    }

    /// Continues to turn around on the spot. Returns true while the robot is still turning.
    fn turns_about(&mut self, relations: &Relations, robot: &Pose<Odom>) -> bool {
        let Some(about_rad) = self.attempt.about_rad else { return false };
        let left_rad = wrap_angle(about_rad - robot.yaw_rad);
        if left_rad.abs() <= ABOUT_RAD {
            self.begin(relations, robot, self.attempt.answer);
            return false;
        }
        let rate_radps = (ABOUT_PER_S * left_rad).clamp(-ABOUT_RADPS, ABOUT_RADPS);
        let may_drive = self.agenda.keep_going("turning about");
        self.attempt.command = if may_drive { [0.0, 0.0, rate_radps] } else { [0.0; 3] };
        true
    }

    fn drive(&mut self, relations: &Relations, robot: &Pose<Odom>, dt_s: f64) {
        let index = self.agenda.task();
        let Some(&CorridorTask { goal, .. }) = self.tasks.get(index) else { return };
        if self.turns_about(relations, robot) {
            return;
        }
        let along_m = self.along_m(robot);
        self.remaining_m = if let Goal::Metres(metres) = goal { (metres - along_m).max(0.0) } else { 0.0 };
        let has_arrived = match goal {
            Goal::Metres(metres) => along_m >= metres,
            Goal::Marker(id) => self.passes(id, relations, robot),
            Goal::End => false,
        };
        if has_arrived {
            self.agenda.end(TaskState::Reached, format_args!("{along_m:.1} m along the corridor"));
            self.stop(dt_s);
        } else if self.method == Method::Corridor {
            self.drive_freely(index, robot, dt_s);
        } else {
            self.drive_by_rules(relations, dt_s);
        }
    }

    /// Returns the distance covered along the corridor since the task began, in metres.
    fn along_m(&self, robot: &Pose<Odom>) -> f64 {
        match self.method {
            Method::Corridor => self.course.way().metres(),
            _ => self.attempt.start.motion_to(robot).x,
        }
    }

    /// Returns true if the robot has passed the marker, that is, if the marker was ahead in the current direction and is now
    /// behind. A turn alone does not count, although a marker may also be behind the robot after it.
    fn passes(&mut self, id: u32, relations: &Relations, robot: &Pose<Odom>) -> bool {
        let way_rad = match self.method {
            Method::Corridor => self.course.way_rad(),
            _ => self.attempt.start.yaw_rad,
        };
        let (sin, cos) = (way_rad - robot.yaw_rad).sin_cos();
        let Some(marker) = relations.markers().iter().find(|marker| marker.id == id) else { return false };
        let [x, y] = [marker.x_m, marker.y_m].map(f64::from);
        let along_m = x * cos + y * sin;
        let turns = self.course.way().turns();
        let has_turned = std::mem::replace(&mut self.attempt.turns, turns) != turns;
        self.attempt.was_ahead = along_m > AHEAD_M || self.attempt.was_ahead && !has_turned;
        self.attempt.was_ahead && along_m < 0.0 && x.hypot(y) < PASSED_M
    }

    fn drive_freely(&mut self, index: usize, robot: &Pose<Odom>, dt_s: f64) {
        let task = &self.tasks[index];
        match self.course.drive(robot, &task.turns, task.goal == Goal::End, dt_s) {
            Next::Driving(reason) => {
                if !self.agenda.keep_going(Words(reason)) {
                    self.stop(dt_s);
                }
            }
            Next::End => self.agenda.end(TaskState::Reached, "the corridor ends here"),
            Next::Blocked => self.agenda.end(TaskState::Blocked, "found no way ahead"),
        }
    }

    fn drive_by_rules(&mut self, relations: &Relations, dt_s: f64) {
        let unseen_s = relations.pair_age_s.min(self.agenda.elapsed_s());
        let lost_s = self.parameters.lost_s;
        if lost_s > 0.0 && unseen_s > lost_s {
            self.agenda.end(TaskState::Lost, format_args!("no pair of markers for {unseen_s:.0} s"));
            self.stop(dt_s);
            return;
        }
        if relations.pairs != self.attempt.pairs {
            self.attempt.pairs = relations.pairs;
            if let Some(answer) = self.rules.as_ref().and_then(|rules| rules.answer(relations)) {
                let Twist { vx_mps, vy_mps, yaw_rate_radps } = answer.twist();
                self.attempt.answer = [vx_mps, vy_mps, yaw_rate_radps];
            }
        }
        self.attempt.command = self.attempt.answer;
        let may_drive = match unseen_s > 1.0 {
            true => self.agenda.keep_going(format_args!("no pair of markers in view")),
            false => self.agenda.keep_going(Pair(relations)),
        };
        if !may_drive {
            self.stop(dt_s);
        }
    }

    fn stop(&mut self, dt_s: f64) {
        self.attempt.command = [0.0; 3];
        self.course.stop(dt_s);
    }

    fn command(&self) -> Twist {
        let [vx_mps, vy_mps, yaw_rate_radps] = self.attempt.command;
        match self.method {
            Method::Corridor if self.attempt.about_rad.is_none() => self.course.command(),
            _ => Twist { vx_mps, vy_mps, yaw_rate_radps },
        }
    }
}

/// What the robot is doing, as display text.
struct Words(Reason);

impl std::fmt::Display for Words {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self.0 {
            Reason::Along => "along the corridor",
            Reason::Waiting => "something closes the corridor",
            Reason::Turning(Turn::Left) => "turning left",
            Reason::Turning(Turn::Right) => "turning right",
            Reason::Turning(Turn::Straight) | Reason::Back => "driving back out of a dead end",
        })
    }
}

/// A pair of markers, as display text.
struct Pair<'a>(&'a Relations);

impl std::fmt::Display for Pair<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Relations { left, right, .. } = self.0;
        if left.distance_class == right.distance_class {
            f.write_str("both markers in one distance class")
        } else {
            f.write_str("markers of two distance classes")
        }
    }
}

impl Stage for Planner {
    const FORM: &'static str = "corridor planner 5";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        if message.on(RULES)?.is_some() && !message.cells().is_empty() {
            let text = std::str::from_utf8(message.cells())?;
            self.rules = Some(Rules::parse(text).map_err(|cause: RulesError| cause)?);
        }
        self.agenda.receive(message)?;
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.agenda.is_ready(self.missing().is_none())
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let (Some(relations), Some(odometry)) = (instant.newest(RELATIONS)?, instant.newest(ODOMETRY)?)
        else {
            return Ok(());
        };
        let robot = relations.odometry();
        let dt_s = self.agenda.begin_step(instant.stamp_ns, odometry);
        self.observe(instant, relations, &robot)?;
        match self.agenda.due(self.missing()) {
            Due::Begin => {
                let is_about = self.tasks.get(self.agenda.task()).is_some_and(|task| task.about);
                self.begin(relations, &robot, if is_about { self.attempt.answer } else { [0.0; 3] });
                self.attempt.about_rad = is_about.then(|| wrap_angle(robot.yaw_rad + PI));
                self.drive(relations, &robot, dt_s);
            }
            Due::Drive => self.drive(relations, &robot, dt_s),
            Due::Stand => self.stop(dt_s),
        }
        self.agenda.send(self.command(), self.remaining_m, out)
    }

    fn state(&self) -> impl Serialize {
        let Self { agenda, attempt, course, remaining_m, .. } = self;
        State {
            agenda: agenda.standing(),
            attempt: *attempt,
            course: course.state(),
            remaining_m: *remaining_m,
        }
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        let State { agenda, attempt, course, remaining_m } = state;
        (self.attempt, self.remaining_m) = (attempt, remaining_m);
        self.agenda.restore(agenda);
        self.course.restore(course);
        Ok(())
    }

    fn recover(&mut self, remains: &dyn Remains) {
        self.agenda.recover(remains);
    }
}
