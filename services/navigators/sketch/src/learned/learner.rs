//! Learns from the messages of a drive by a drawing or in a learned map, whether they come from a recording or from a running
//! mission.
//!
//! The planner's own map is not part of any message, but follows from the scans and the odometry: the learner runs the same mapper
//! on the same readings. Where the drawing corresponds to the map follows from the outline if the robot drove by it, and otherwise
//! from the estimates along the way.

use sketchnav_mapping::mapper::Mapper;
use sketchnav_mapping::outline::{Place, distance};
use sketchnav_mapping::survey::OFF_FREE_M;
use sketchnav_mapping::{Cell, CellGrid, KidnapDetector, Map, Scan, Survey};
use sketchnav_schemas::channels::{ChannelSpec, ODOMETRY, SCAN, STATUS};
use sketchnav_schemas::codes::{TaskState, Tracking};
use sketchnav_schemas::geometry::{Base, Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::{LaserScan, MissionStatus};
use sketchnav_schemas::robot::{Robot, RobotError};

use super::{
    DrawingFile, Goal, Learned, LearnedEnd, LearnedMap, LearnedStart, MAX_PAIRS, VERSION, merge, rounded,
};
use crate::messages::{
    CORRESPONDENCE, Correspondence, ESTIMATE, MAX_SKETCH_CELLS, PartnerKind, PoseEstimate,
};
use crate::paths::chart::Chart;
use crate::planner::ROOMS;
use crate::reading::{DrawnMap, Intent, Places};
use crate::task::Task;

/// Distance, in metres, between the places of the way that are paired with the drawing.
const PAIR_EVERY_M: f64 = 0.5;
/// Maximum distance, in metres, of a goal from where the robot reported that it had arrived.
const GOAL_WITHIN_M: f64 = 1.0;
/// Margin around what was seen, in cells.
const MARGIN: i64 = 2;

/// Why nothing can be learned from a drive.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// The robot has no laser.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The robot's laser is not suitable for mapping.
    #[error(transparent)]
    Mapping(#[from] sketchnav_mapping::Error),
    /// There were no scans.
    #[error("expected scans and odometry of a drive, found none")]
    Blind,
    /// There were no estimates.
    #[error("expected estimates of where the robot is in the drawing, found fewer than two places")]
    NowhereInTheDrawing,
    /// The robot was not certain of its place in the earlier map.
    #[error(
        "expected a drive on which the robot found its place in what was learned before, found fewer than two places"
    )]
    NowhereInTheMap,
    /// The area seen is larger than a map may be.
    #[error("expected a map of at most {MAX_SKETCH_CELLS} cells of 0.05 m, found {0}")]
    TooLarge(usize),
}

/// Learns from the messages of one drive.
#[derive(Debug)]
pub struct Learner {
    mapping: sketchnav_mapping::Parameters,
    mapper: Mapper,
    base_from_laser: Pose<Base>,
    radius_m: f64,
    odometry: Option<Pose<Odom>>,
    scan: Option<Box<LaserScan>>,
    /// The robot's positions at the scans that were added or matched. They are free, although the laser does not see them.
    way: Vec<Place>,
    /// Poses in the drawing, or in the earlier map, and in the new map, along the way.
    driven: Vec<(Pose<Sketch>, Pose<Map>)>,
    /// The same for the outline, from the last alignment, which also locates the goal.
    aligned: Vec<(Place, Place)>,
    aligned_goal: Option<Place>,
    /// The alignment that led to the last arrival by the outline.
    believed: Vec<(Place, Place)>,
    is_among_rooms: bool,
    estimate: Option<PoseEstimate>,
    arrived: Vec<Arrived>,
    kidnapping: KidnapDetector,
}

/// An arrival, as the robot reported it.
#[derive(Debug)]
struct Arrived {
    /// Number of the task.
    task: u32,
    robot: Pose<Map>,
    estimate: Option<PoseEstimate>,
    /// Where the outline locates the goal, if the robot drove by it.
    goal: Option<Place>,
}

impl Learner {
    /// Creates a learner for a drive of this robot.
    ///
    /// # Errors
    /// [`LearnError`] if the robot has no laser, or one that is not suitable for mapping.
    pub fn new(robot: &Robot) -> Result<Self, LearnError> {
        let laser = robot.laser()?;
        let mapping = sketchnav_mapping::Parameters::for_range(laser.range_max_m);
        Ok(Self {
            mapping,
            mapper: Mapper::new(mapping)?,
            base_from_laser: laser.mount(),
            radius_m: robot.radius_m,
            odometry: None,
            scan: None,
            way: Vec::new(),
            driven: Vec::new(),
            aligned: Vec::new(),
            aligned_goal: None,
            believed: Vec::new(),
            is_among_rooms: false,
            estimate: None,
            arrived: Vec::new(),
            kidnapping: KidnapDetector::default(),
        })
    }

    /// Processes a message that the planner has received or sent, and ignores all others. The messages of an instant must arrive in
    /// the order of the table of channels.
    pub fn see(&mut self, channel: &ChannelSpec, message: &[u8]) {
        if let Some(odometry) = ODOMETRY.message(channel, message) {
            self.odometry = Some(odometry.pose());
        } else if let Some(scan) = SCAN.message(channel, message) {
            self.scan = Some(Box::new(*scan));
        } else if let Some(estimate) = ESTIMATE.message(channel, message) {
            self.map();
            self.follow(estimate);
        } else if let Some(found) = CORRESPONDENCE.message(channel, message) {
            self.align(found);
        } else if let Some(status) = STATUS.message(channel, message) {
            self.on_status(status);
        }
    }

    /// Adds the instant's scan, as the explorer does when the planner answers an estimate.
    fn map(&mut self) {
        let (Some(robot), Some(scan)) = (self.odometry, self.scan.take()) else { return };
        let base_from_laser = robot.motion_to(&robot.compose(&self.base_from_laser));
        if self.kidnapping.observe(robot, &Scan::of_message(&scan, self.base_from_laser)) {
            self.begin_elsewhere();
        }
        // An invalid scan returns an error, which can be ignored because nothing changes then.
        let _ = self.mapper.update(robot, &Scan::of_message(&scan, base_from_laser));
        let at = self.place();
        if self.way.last().is_none_or(|last| distance(*last, at) > super::CELL_M) {
            self.way.push(at);
        }
    }

    /// Forgets what was seen before somebody carried the robot. The explorer does the same.
    fn begin_elsewhere(&mut self) {
        if let Ok(mapper) = Mapper::new(self.mapping) {
            self.mapper = mapper;
        }
        self.way.clear();
        self.driven.clear();
        self.arrived.clear();
        self.believed.clear();
        self.forget_alignment();
    }

    /// Returns the robot's pose in the map.
    pub fn pose(&self) -> Pose<Map> {
        self.mapper.pose()
    }

    fn place(&self) -> Place {
        let pose = self.pose();
        [pose.x, pose.y]
    }

    fn follow(&mut self, estimate: &PoseEstimate) {
        self.estimate = Some(*estimate);
        let is_known = Tracking::from_code(estimate.tracking) == Some(Tracking::Tracking);
        let is_far = self
            .driven
            .last()
            .is_none_or(|(_, last)| last.position().distance(&self.mapper.pose().position()) > PAIR_EVERY_M);
        if is_known && is_far && !self.way.is_empty() {
            self.driven.push((estimate.pose.pose(), self.mapper.pose()));
        }
    }

    fn align(&mut self, found: &Correspondence) {
        let walls = found.samples().iter().filter(|sample| sample.partner == PartnerKind::Wall.code());
        let pair =
            |[x_px, y_px, x_m, y_m]: [f32; 4]| ([x_px, y_px].map(f64::from), [x_m, y_m].map(f64::from));
        self.aligned_goal = Some(found.goal_m);
        self.aligned.clear();
        self.aligned.extend(walls.map(|s| pair([s.x_px, s.y_px, s.x_m, s.y_m])));
    }

    fn on_status(&mut self, status: &MissionStatus) {
        match TaskState::from_code(status.state) {
            Some(TaskState::Driving) => match status.reason.as_str() {
                ROOMS => self.is_among_rooms = true,
                "" => self.is_among_rooms = false,
                // Detours and recoveries do not show how the robot finds its way.
                _ => {}
            },
            Some(TaskState::Reached) if self.arrived.iter().all(|arrived| arrived.task != status.task) => {
                let is_by_outline = !self.is_among_rooms && !self.aligned.is_empty();
                if is_by_outline {
                    self.believed.clone_from(&self.aligned);
                }
                self.arrived.push(Arrived {
                    task: status.task,
                    robot: self.mapper.pose(),
                    estimate: self.estimate,
                    goal: self.aligned_goal.filter(|_| is_by_outline),
                });
                self.forget_alignment();
            }
            Some(TaskState::Blocked | TaskState::Lost | TaskState::TimedOut) => self.forget_alignment(),
            _ => {}
        }
    }

    /// Forgets what belongs to the task that has ended.
    fn forget_alignment(&mut self) {
        self.aligned.clear();
        (self.aligned_goal, self.is_among_rooms) = (None, false);
    }

    /// Begins other tasks in the same drawing. From then on, their goals are learned.
    pub fn begin_tasks(&mut self) {
        self.arrived.clear();
        self.forget_alignment();
    }

    /// Returns what was learned. `drawing` is the drawing of the drive with the places marked in it, and `file` describes its file.
    ///
    /// # Errors
    /// [`LearnError`] if nothing was seen, or if it could not be located in the drawing.
    pub fn learned(
        &self,
        file: DrawingFile,
        drawing: &DrawnMap,
        places: &Places,
    ) -> Result<Learned, LearnError> {
        let map = self.map_of_free_space()?;
        let in_file = |at: Point<Sketch>| drawing.to_image(&at).map(|px| rounded(px, 100.0));
        let goal = |(number, task): (u32, &Task)| {
            let arrived = self.arrived.iter().find(|arrived| arrived.task == number);
            let at_m =
                arrived.map(|arrived| arrived.goal_m(task.end(), drawing, &map).map(|m| rounded(m, 1e3)));
            Goal { task: task.name.clone(), at: in_file(task.end()), at_m, reached: at_m.is_some() }
        };
        let goals: Vec<Goal> = (0..).zip(&places.tasks).map(goal).collect();
        let driven = self.driven.iter().map(|(drawn, seen)| ([drawn.x, drawn.y], [seen.x, seen.y]));
        let walls = if self.believed.is_empty() { driven.collect() } else { self.believed.clone() };
        let is_marked = !places.is_anywhere(drawing);
        let start = if is_marked {
            in_file(places.start.position())
        } else {
            // Nobody has marked the start. It is near what was nearest to it in the map.
            let nearest = walls.iter().min_by(|a, b| norm(a.1).total_cmp(&norm(b.1)));
            in_file(nearest.map(|([x, y], _)| Point::new(*x, *y)).ok_or(LearnError::NowhereInTheDrawing)?)
        };
        let reached = goals.iter().filter_map(|goal| Some((goal.at, goal.at_m?)));
        let seen =
            walls.iter().map(|([x, y], seen)| (in_file(Point::new(*x, *y)), seen.map(|m| rounded(m, 1e3))));
        let marked = is_marked.then_some((start, [0.0; 2]));
        let pairs = marked.into_iter().chain(reached).chain(seen).take(MAX_PAIRS);
        let pairs: Vec<_> = pairs.map(|([column, row], [x, y])| [column, row, x, y]).collect();
        if pairs.len() < 2 {
            return Err(LearnError::NowhereInTheDrawing);
        }
        let heading_deg = rounded(places.start.yaw_rad.to_degrees(), 100.0);
        Ok(Learned {
            learned: VERSION,
            drawing: file,
            map,
            start: LearnedStart { at: start, heading_deg },
            goals,
            pairs,
            end: Some(LearnedEnd::new(&self.pose())),
        })
    }

    /// Returns the earlier map that was used on this drive, updated by what was seen on the drive. `intent` contains the tasks in
    /// pixels of the drawing's file, and `places` those in the map.
    ///
    /// # Errors
    /// [`LearnError`] if nothing was seen, or if the robot was not localized in the earlier map.
    pub fn merged(&self, before: &Learned, intent: &Intent, places: &Places) -> Result<Learned, LearnError> {
        let in_m = |at: Point<Sketch>| before.map.of_drawn([at.x, at.y]);
        let pairs = self.driven.iter().map(|(known, seen)| {
            let [x, y] = in_m(known.position());
            (*seen, Pose::new(x, y, known.yaw_rad))
        });
        let known_from_seen = merge::motion(&pairs.collect::<Vec<_>>()).ok_or(LearnError::NowhereInTheMap)?;
        let map = before.map.updated_by(&self.map_of_free_space()?, &known_from_seen)?;
        let arrived = |number: u32| self.arrived.iter().any(|arrived| arrived.task == number);
        let goals = (0..).zip(intent.tasks.iter().zip(&places.tasks)).map(|(number, (asked, task))| {
            let at = asked.points.last().copied().unwrap_or_default().map(|px| rounded(px, 100.0));
            let at_m = arrived(number).then(|| in_m(task.end()).map(|m| rounded(m, 1e3)));
            Goal { task: task.name.clone(), at, at_m, reached: at_m.is_some() }
        });
        let end = Some(LearnedEnd::new(&known_from_seen.compose(&self.pose())));
        Ok(Learned { end, ..before.with(map, goals) })
    }

    /// Returns the map, cropped to what was seen. Only space that is connected to the robot's path counts as free. Slits between
    /// beams are filled, and the ground that the robot has covered is free.
    fn map_of_free_space(&self) -> Result<LearnedMap, LearnError> {
        if self.way.is_empty() {
            return Err(LearnError::Blind);
        }
        let mut survey = Survey::default();
        survey.take(self.mapper.map(), self.place(), OFF_FREE_M);
        let (grid, free) = (survey.grid(), survey.free());
        let mut covered = free.clone();
        for at in &self.way {
            cover(grid, *at, self.radius_m, |index| covered.insert(index));
        }
        covered.subtract(&grid.occupied);
        let what = |index: usize| match (covered.contains(index), grid.occupied.contains(index)) {
            (true, _) => Cell::Free,
            (_, true) => Cell::Occupied,
            _ => Cell::Unknown,
        };
        let known = || (0..grid.free.cells()).filter(|&index| what(index) != Cell::Unknown);
        let bounds = |axis: usize| {
            let at = |index: usize| grid.free.at(index)[axis];
            let (least, most) = (known().map(at).min().unwrap_or(0), known().map(at).max().unwrap_or(0));
            [least - MARGIN, most + MARGIN]
        };
        let ([left, right], [low, high]) = (bounds(0), bounds(1));
        let (width, height) = ((right - left + 1) as usize, (high - low + 1) as usize);
        if width * height > MAX_SKETCH_CELLS {
            return Err(LearnError::TooLarge(width * height));
        }
        let cell = |row: i64, column: i64| grid.free.index([column, row]).map_or(Cell::Unknown, what);
        let cells = (low..=high).flat_map(|row| (left..=right).map(move |column| cell(row, column)));
        let origin_m = [0, 1].map(|k| rounded(grid.origin[k] + [left, low][k] as f64 * grid.cell, 1e3));
        Ok(LearnedMap { origin_m, width, cells: cells.collect() })
    }
}

impl Arrived {
    /// Returns where the goal is in the map, as estimated by the robot when it arrived. If there is no free floor nearby, the
    /// robot's own position is used, because the robot could drive there.
    fn goal_m(&self, goal: Point<Sketch>, drawing: &DrawnMap, map: &LearnedMap) -> Place {
        let by_estimate = || {
            let estimate = self.estimate.as_ref().filter(|estimate| estimate.is_placed())?;
            let goal = Chart::new(estimate, drawing.wall_direction_rad)?.to_odom(goal);
            let ahead = estimate.odometry().motion_to(&Pose::new(goal.x, goal.y, 0.0));
            let there = self.robot.compose(&ahead);
            Some([there.x, there.y])
        };
        let here = [self.robot.x, self.robot.y];
        let is_good = |at: &Place| distance(*at, here) <= GOAL_WITHIN_M && map.at_m(*at) == Cell::Free;
        self.goal.filter(is_good).or_else(|| by_estimate().filter(is_good)).unwrap_or(here)
    }
}

fn norm([x, y]: Place) -> f64 {
    x.hypot(y)
}

/// Visits the cells that a disc covers.
fn cover(grid: &CellGrid, at: Place, radius_m: f64, mut visit: impl FnMut(usize)) {
    let [column, row] = grid.cell_of(at);
    let reach = (radius_m / grid.cell).ceil() as i64;
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            if (dx as f64).hypot(dy as f64) * grid.cell <= radius_m
                && let Some(index) = grid.free.index([column + dx, row + dy])
            {
                visit(index);
            }
        }
    }
}
