//! Drives to a goal or along a drawn route by computing velocities from the chart of the estimate.
//!
//! A step tracks the drawn route, checks whether the task has ended or the robot is stuck, plans if that is due, and follows the
//! local path.

mod exploring;
mod finding;
mod recovering;
mod state;
mod way;

use crate::filter::Start;
use crate::paths::chart::Chart;
use crate::paths::cost_field::{self, Blockage, CostField};
use crate::paths::parameters::Parameters;
use crate::paths::route::DrawnRoute;
use crate::sketch::SketchGrid;
use crate::task::Task;
use serde::{Deserialize, Serialize};
use sketchnav_mapping::Map;
use sketchnav_motion::local::{self, LocalPlanner, Room};
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::progress::{ProgressChecker, StuckCounter};
use sketchnav_motion::pursuit::{Body, Pursuit};
use sketchnav_motion::recovery::Recovery;
use sketchnav_schemas::codes::{TaskState, Tracking};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::{LaserScan, Twist};
use sketchnav_schemas::robot::{Laser, Robot};

use super::arrival::{Arrival, Belief};
use super::explorer::Explorer;
use super::pace::Pace;
use super::reason::Reason;
use finding::Finding;
pub use state::State;

/// Maximum number of blockages remembered during a task.
const MAX_BLOCKAGES: usize = 16;
/// Distance between the waypoints of a drawn route, in metres by the scale where the robot begins the route.
const WAYPOINT_M: f64 = 0.05;
/// Share of the speed at which a lost robot continues, to collect further views.
const LOST_SHARE: f64 = 0.5;
/// The current source of the robot's path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Guide {
    /// The cost field guides the robot to the goal.
    Goal,
    /// The cost field guides the robot to the first point of the drawn route.
    ToRoute,
    /// The robot follows the drawn route.
    Route,
    /// The explorer guides the robot to where the goal lies in the explorer's map.
    Outline,
}

/// Status of a task after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TaskStatus {
    /// The task continues.
    Driving(Reason),
    /// The robot waits for a person to mark where it is.
    Asks(Reason),
    /// The task has ended.
    Ended(TaskState, Reason),
}

/// An attempt at a task: the driver's state from the beginning to the end of the task.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Attempt {
    guide: Guide,
    goal: Point<Sketch>,
    progress: ProgressChecker,
    pace: Pace,
    arrival: Arrival,
    stuck: StuckCounter,
    recovery: Option<Recovery>,
    blocked: Vec<Blockage>,
    /// Whether the drawing shows a path to the goal.
    drawn: bool,
    lost_s: f64,
    /// Whether somebody has carried the robot, so that the attempt has to start over.
    is_kidnapped: bool,
    limit_s: f64,
    plan_due_s: f64,
    planned_s: f64,
    detour: bool,
    remaining_m: f64,
    target_px: Point<Sketch>,
}

/// The goal and the scale for which the cost field was last solved, in addition to the attempt's blockages.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Solved {
    goal: Point<Sketch>,
    scale_pxpm: f64,
}

/// Drives the robot to a goal or along a drawn route.
#[derive(Debug)]
pub struct Driver {
    parameters: Parameters,
    room: Room,
    /// Maximum speed of the robot, in m/s.
    speed_mps: f64,
    turn_rate_radps: f64,
    radius_m: f64,
    field: Option<CostField>,
    solved: Option<Solved>,
    obstacles: Obstacles,
    local: LocalPlanner,
    pursuit: Pursuit,
    route: DrawnRoute,
    attempt: Attempt,
    global_path: Vec<Point<Sketch>>,
    local_path: Vec<Point<Odom>>,
    chart: Option<Chart>,
    planned: bool,
    explorer: Option<Explorer>,
    field_of_view_rad: f64,
    map_path: Vec<Point<Map>>,
    course_path: Vec<Point<Odom>>,
    /// The search for the robot's pose, if one is under way.
    finding: Option<Finding>,
}

impl Driver {
    /// Creates a driver at rest, without a drawing.
    ///
    /// # Errors
    /// Returns an error if the robot's laser is not suitable for mapping.
    pub fn new(
        parameters: Parameters,
        robot: &Robot,
        laser: &Laser,
    ) -> Result<Self, sketchnav_mapping::Error> {
        let mut limits = robot.limits;
        limits.yaw_rate_radps *= parameters.turn_share;
        let hard_m = robot.radius_m + parameters.footprint_padding_m;
        let nowhere = Point::new(0.0, 0.0);
        let explorer = || Explorer::new(&parameters, laser.range_max_m);
        let explorer = parameters.by_outline.then(explorer).transpose()?;
        Ok(Self {
            room: Room { hard_m, soft_m: hard_m + parameters.local_inflation_radius_m },
            speed_mps: limits.speed_mps * parameters.speed_share,
            turn_rate_radps: limits.yaw_rate_radps,
            radius_m: robot.radius_m,
            field: None,
            solved: None,
            obstacles: Obstacles::new(parameters.obstacle_memory_s),
            local: LocalPlanner::default(),
            pursuit: Pursuit::new(Body { radius_m: robot.radius_m, drive: robot.drive, limits }),
            route: DrawnRoute::default(),
            attempt: Attempt::new(
                Guide::Goal,
                nowhere,
                Point::new(0.0, 0.0),
                Vec::with_capacity(MAX_BLOCKAGES),
            ),
            global_path: Vec::with_capacity(cost_field::MAX_PATH),
            local_path: Vec::with_capacity(local::MAX_PATH + 1),
            chart: None,
            planned: false,
            explorer,
            field_of_view_rad: laser.field_of_view_deg.to_radians(),
            map_path: Vec::new(),
            course_path: Vec::new(),
            finding: None,
            parameters,
        })
    }

    /// Sets the drawing, and the start in it.
    pub fn on_sketch(&mut self, sketch: &SketchGrid, start: &Start) {
        self.field = Some(CostField::new(sketch));
        self.finding = self.parameters.finds_itself.then(Finding::default);
        if let Some(explorer) = &mut self.explorer {
            explorer.on_sketch(sketch, start);
        }
    }

    /// Discards the attempt and its paths, because they belong to another drawing.
    pub fn forget(&mut self) {
        self.solved = None;
        self.route = DrawnRoute::default();
        self.global_path.clear();
        self.local_path.clear();
        let nowhere = Point::new(0.0, 0.0);
        let blocked = std::mem::take(&mut self.attempt.blocked);
        self.attempt = Attempt::new(Guide::Goal, nowhere, Point::new(0.0, 0.0), blocked);
    }

    /// Returns true if the driver has a drawing.
    pub fn has_sketch(&self) -> bool {
        self.field.is_some()
    }

    /// Begins a step, without planning yet.
    pub fn begin_step(&mut self) {
        self.planned = false;
    }

    /// Processes a scan made at `sensor` by a robot at `robot`.
    pub fn observe(&mut self, robot: &Pose<Odom>, sensor: &Pose<Odom>, scan: &LaserScan) {
        self.obstacles.observe(robot, self.radius_m, sensor, scan);
        if let Some(explorer) = &mut self.explorer {
            explorer.observe(*robot, robot.motion_to(sensor), scan);
        }
    }

    /// Forgets everything that was seen, because somebody has carried the robot. The attempt starts over with the next step.
    pub fn begin_elsewhere(&mut self) {
        if let Some(explorer) = &mut self.explorer {
            explorer.begin_elsewhere();
            self.attempt.is_kidnapped = true;
            self.obstacles.clear();
        }
    }

    /// Begins a task from the robot's current position, which is that of `chart`.
    pub fn begin(&mut self, task: &Task, chart: &Chart) {
        let start = task.points.first().copied().unwrap_or(task.end());
        // A search that is under way starts over, because times are relative to the beginning of the task.
        self.finding = self.finding.map(|_| Finding::default());
        let far = chart.distance_m(chart.robot_px().position(), start) > self.parameters.route_window_m;
        let guide = match (task.is_route(), far) {
            (false, _) if self.explorer.as_ref().is_some_and(Explorer::is_in_charge) => Guide::Outline,
            (false, _) => Guide::Goal,
            (true, true) => Guide::ToRoute,
            (true, false) => Guide::Route,
        };
        if task.is_route() {
            self.route.begin(task.points.iter().copied(), WAYPOINT_M * chart.mean_scale_pxpm());
        }
        let goal = if guide == Guide::ToRoute { start } else { task.end() };
        let blocked = std::mem::take(&mut self.attempt.blocked);
        let is_elsewhere = self.explorer.as_ref().is_some_and(Explorer::is_elsewhere);
        self.attempt = Attempt::new(guide, goal, chart.robot_m().position(), blocked);
        self.attempt.is_kidnapped = is_elsewhere;
        self.attempt.limit_s = task.time_limit_s;
        if let Some(explorer) = self.explorer.as_mut().filter(|_| !task.is_route()) {
            explorer.begin(goal);
        }
        self.set_off(chart);
    }

    /// Solves the cost field, and checks whether the drawing shows a path from where the robot is.
    fn set_off(&mut self, chart: &Chart) {
        self.solve(chart);
        let robot = chart.robot_px().position();
        self.attempt.drawn = self.field.as_ref().is_some_and(|field| field.is_open(robot));
    }

    /// Brakes as hard as the limits allow.
    pub fn stop(&mut self, dt_s: f64) {
        self.pursuit.stop(dt_s);
    }

    /// Continues to drive for `dt_s` seconds. `chart` is that of the estimate, `fit` is the estimate's mean log likelihood of a
    /// beam, `tracking` is the localizer's confidence in it, and `now_s` is the time since the task began.
    pub fn drive(
        &mut self,
        chart: &Chart,
        fit: f64,
        tracking: Tracking,
        is_placed: bool,
        now_s: f64,
        dt_s: f64,
    ) -> TaskStatus {
        self.chart = Some(*chart);
        if let Some(explorer) = &mut self.explorer {
            explorer.on_estimate(is_placed, !is_placed && tracking == Tracking::Doubtful);
        }
        let lost = tracking == Tracking::Lost || !is_placed;
        self.attempt.lost_s = if lost { self.attempt.lost_s + dt_s } else { 0.0 };
        self.attempt.arrival.follow(chart, fit, dt_s);
        if std::mem::take(&mut self.attempt.is_kidnapped) {
            return self.start_over(chart, now_s, dt_s);
        }
        self.find_if_lost(now_s);
        if let Some(status) = self.find(chart, tracking, now_s, dt_s) {
            return status;
        }
        self.go_by_the_floor(chart, now_s);
        if self.attempt.guide == Guide::Outline {
            return self.explore(chart, now_s, dt_s);
        }
        if self.attempt.guide != Guide::Goal {
            self.keep_to_route(chart, now_s);
        }
        if let Some((state, reason)) = self.lost_for_good(lost, now_s).filter(|_| self.finding.is_none()) {
            return self.give_up(state, reason, chart, now_s, dt_s);
        }
        if let Some(off_m) = self.arrives(chart, lost) {
            return self.arrive(Reason::Arrived(off_m), chart, now_s, dt_s);
        }
        if self.attempt.recovery.is_some() {
            return self.recover(chart, now_s, dt_s);
        }
        self.plan_when_due(chart, now_s);
        if self.is_stuck(chart, now_s) {
            return self.begin_recovery(chart, now_s, dt_s);
        }
        let share = self.parameters.speed_share * if lost { LOST_SHARE } else { 1.0 };
        self.pursuit.follow(&self.local_path, &chart.robot_m(), &self.obstacles, share, dt_s);
        TaskStatus::Driving(match (self.attempt.detour, self.attempt.guide) {
            (true, _) => Reason::Detour,
            (false, Guide::Goal) if self.explorer.as_ref().is_some_and(Explorer::sees_rooms) => Reason::Rooms,
            (false, _) => Reason::None,
        })
    }

    /// Starts the attempt over after somebody has carried the robot. Drawn routes cannot be followed from elsewhere.
    fn start_over(&mut self, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        if self.follows_route() {
            return TaskStatus::Ended(TaskState::Lost, Reason::Kidnapped);
        }
        self.attempt.look_again(now_s, Some(chart));
        (self.attempt.stuck, self.attempt.guide) = (StuckCounter::default(), Guide::Outline);
        TaskStatus::Driving(Reason::Kidnapped)
    }

    /// Returns the last command.
    pub fn command(&self) -> Twist {
        self.pursuit.last()
    }

    /// Returns true if a path was planned in this step.
    pub fn planned(&self) -> bool {
        self.planned
    }

    /// Returns true if the task follows a drawn route.
    pub fn follows_route(&self) -> bool {
        matches!(self.attempt.guide, Guide::Route | Guide::ToRoute)
    }

    /// Returns the end of the local path in the drawing.
    pub fn target_px(&self) -> Point<Sketch> {
        self.attempt.target_px
    }

    /// Returns the remaining distance, in metres by the local scale.
    pub fn remaining_m(&self) -> f64 {
        self.attempt.remaining_m
    }

    /// Returns the path through the drawing, or the remaining part of the drawn route.
    pub fn global_path(&self) -> &[Point<Sketch>] {
        if self.attempt.guide == Guide::Route { self.route.remaining() } else { &self.global_path }
    }

    /// Returns the local path, converted to the drawing.
    pub fn local_path_px(&self) -> impl ExactSizeIterator<Item = Point<Sketch>> + '_ {
        let is_placed = self.explorer.as_ref().is_none_or(Explorer::is_placed);
        let chart = self.chart.filter(|_| is_placed || self.attempt.guide != Guide::Outline);
        let path = if chart.is_some() { self.local_path.as_slice() } else { &[] };
        path.iter().map(move |&place| chart.map_or(Point::new(0.0, 0.0), |chart| chart.to_sketch(place)))
    }

    /// Tracks the robot's progress along the drawn route, once the robot has reached its first point.
    fn keep_to_route(&mut self, chart: &Chart, now_s: f64) {
        let (robot, window_m) = (chart.robot_px().position(), self.parameters.route_window_m);
        let near_start =
            self.route.start().is_none_or(|start| chart.distance_m(robot, start) < 0.6 * window_m);
        if self.attempt.guide == Guide::ToRoute && near_start {
            self.attempt.guide = Guide::Route;
            self.attempt.goal = self.route.end().unwrap_or(robot);
            self.attempt.plan_due_s = now_s;
            self.attempt.progress = ProgressChecker::new(now_s, chart.robot_m().position());
            self.attempt.pace = Pace::new(now_s);
        }
        if self.attempt.guide == Guide::Route {
            self.route.track(chart, window_m);
        }
    }

    fn lost_for_good(&self, lost: bool, now_s: f64) -> Option<(TaskState, Reason)> {
        if lost {
            let too_long = self.attempt.lost_s >= self.parameters.lost_s;
            return too_long.then_some((TaskState::Lost, Reason::Lost(self.attempt.lost_s)));
        }
        let (on_way_s, drawn_m) = self.attempt.pace.astray(now_s, self.speed_mps, &self.parameters)?;
        Some((TaskState::Lost, Reason::Astray(on_way_s, drawn_m)))
    }

    /// Returns the distance to the end of the task, in metres, if the robot has arrived there and is not looking around.
    fn arrives(&self, chart: &Chart, lost: bool) -> Option<f64> {
        let may = !lost && self.finding.is_none() && !self.attempt.arrival.is_looking();
        may.then(|| self.goal_within(chart, self.parameters.arrival_radius_m)).flatten()
    }

    /// Ends the task, or begins to look around if the arrival is in doubt and the robot has not looked around yet.
    fn arrive(&mut self, reason: Reason, chart: &Chart, now_s: f64, dt_s: f64) -> TaskStatus {
        self.stop(dt_s);
        match self.attempt.arrival.judge(&self.parameters) {
            Belief::Reached => TaskStatus::Ended(TaskState::Reached, reason),
            Belief::Doubted(jumps, fit) => {
                self.give_up(TaskState::Lost, Reason::Doubted(jumps, fit), chart, now_s, dt_s)
            }
            Belief::Look => {
                self.attempt.arrival.begin_look();
                let turn = Recovery::look_around(now_s, &chart.robot_m(), self.turn_rate_radps);
                self.attempt.recovery = Some(turn);
                TaskStatus::Driving(Reason::LookingAround)
            }
        }
    }

    /// Returns the distance to the end of the task, in metres, if it is within `radius_m` and there is no drawn wall in between.
    fn goal_within(&self, chart: &Chart, radius_m: f64) -> Option<f64> {
        let on_last_piece = match self.attempt.guide {
            Guide::Goal | Guide::Outline => true,
            Guide::ToRoute => false,
            Guide::Route => self.route.is_last_piece(chart, self.parameters.route_window_m.max(radius_m)),
        };
        let (field, robot) = (self.field.as_ref()?, chart.robot_px().position());
        let goal = if self.attempt.guide == Guide::Goal { field.goal()? } else { self.attempt.goal };
        let off_m = chart.distance_m(robot, goal);
        (on_last_piece && off_m <= radius_m && field.sees(robot, goal)).then_some(off_m)
    }

    /// Solves the cost field for the attempt's goal and the passages found to be shut.
    fn solve(&mut self, chart: &Chart) {
        self.solved = Some(Solved { goal: self.attempt.goal, scale_pxpm: chart.mean_scale_pxpm() });
        self.solve_again();
    }

    fn solve_again(&mut self) {
        if let (Some(field), Some(Solved { goal, scale_pxpm })) = (&mut self.field, self.solved) {
            field.solve(goal, scale_pxpm, &self.attempt.blocked, &self.parameters);
        }
    }
}

impl Attempt {
    /// Resets all doubt about the robot's pose, because a person has helped or has not answered.
    fn look_again(&mut self, now_s: f64, chart: Option<&Chart>) {
        (self.arrival, self.pace) = (Arrival::default(), Pace::new(now_s));
        (self.recovery, self.lost_s, self.plan_due_s) = (None, 0.0, now_s);
        if let Some(chart) = chart {
            self.progress = ProgressChecker::new(now_s, chart.robot_m().position());
        }
    }

    /// Creates an attempt. The memory of `blocked` is reused after clearing it, so that driving does not allocate.
    fn new(guide: Guide, goal: Point<Sketch>, robot: Point<Odom>, mut blocked: Vec<Blockage>) -> Self {
        blocked.clear();
        Self {
            guide,
            goal,
            progress: ProgressChecker::new(0.0, robot),
            pace: Pace::new(0.0),
            arrival: Arrival::default(),
            stuck: StuckCounter::default(),
            recovery: None,
            blocked,
            drawn: false,
            lost_s: 0.0,
            is_kidnapped: false,
            limit_s: f64::INFINITY,
            plan_due_s: 0.0,
            planned_s: 0.0,
            detour: false,
            remaining_m: 0.0,
            target_px: goal,
        }
    }
}
