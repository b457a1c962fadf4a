//! Places the robot's start and tasks in the drawing. They are given in image pixels, by the mission or by
//! the drawing, and are checked against the drawing and converted to its frame.
//!
//! Every position must be inside the drawing, in free space, and reachable from the start over free cells, as
//! far as the drawing shows. The inner points of a drawn route are an exception: they may brush a wall by a
//! pen's width and are not checked for reachability.

use std::ops::Range;

use crate::mission::{Aim, SketchMission, SketchTask};
use sketchnav_schemas::codes::FREE;
use sketchnav_schemas::geometry::{Point, Pose, Sketch, wrap_angle};
use sketchnav_schemas::message::MAX_ROUTE_POINTS;
use sketchnav_schemas::message::MAX_TASKS;
use sketchnav_schemas::mission::task_key;

use super::Marks;
use super::drawn_map::DrawnMap;
use super::error::SketchError;
use super::located::{Atlas, Located};
use super::settings::Settings;
use crate::filter::Start;
use crate::task::{PERSON_TIME_LIMIT_S, Task};

/// Time limit for a task that is only defined in the drawing, in seconds of simulation time.
const MARKED_TIME_LIMIT_S: f64 = 180.0;

/// The start and tasks requested by a person, in image pixels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Intent {
    /// The robot's start position.
    pub start: Option<[f64; 2]>,
    /// Heading at the start, in degrees counter-clockwise from "to the right".
    pub heading_deg: Option<f64>,
    /// The tasks, in order.
    pub tasks: Vec<ImageTask>,
    /// Whether the robot can find out by itself where it starts, if no start is given.
    pub may_start_anywhere: bool,
}

/// A task in image pixels (column, row; row 0 at the top): a goal if it has a single point, a drawn route if it has more.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageTask {
    /// Human-readable name.
    pub name: String,
    /// The goal, or the points of the route.
    pub points: Vec<[f64; 2]>,
    /// True if the point belongs to a name. A name may be written across a wall, in which case the goal is the nearest free
    /// position, which must be reachable.
    pub is_named: bool,
    /// The room that a relation such as "the room left of the kitchen" refers to, in words. `None` if the goal is no relation.
    pub resolved: Option<String>,
    /// Simulation time after which the task has failed, in seconds.
    pub time_limit_s: f64,
}

/// A start and tasks that are valid in the drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// The robot's start pose.
    pub start: Pose<Sketch>,
    /// Standard deviation of the start position, in pixels.
    pub start_spread_px: f64,
    /// Standard deviation of the start heading, in radians.
    pub start_spread_rad: f64,
    /// The tasks, in order.
    pub tasks: Vec<Task>,
}

impl Places {
    /// Returns true if nobody has marked the start, so that the robot may be anywhere in the drawing.
    pub fn is_anywhere(&self, drawing: &DrawnMap) -> bool {
        self.start().is_anywhere(drawing.size())
    }

    /// Returns the start with its uncertainty.
    pub fn start(&self) -> Start {
        Start { pose: self.start, spread_px: self.start_spread_px, spread_rad: self.start_spread_rad }
    }
}

impl Intent {
    /// Takes the intent from a mission. Goals that are names, or rooms by their position, are looked up in the mission and in the
    /// drawing.
    ///
    /// # Errors
    /// [`SketchError`], with the task, if there is no such place, or if there are several.
    pub fn of_mission(mission: &SketchMission, drawing: &DrawnMap) -> Result<Self, SketchError> {
        let atlas = Atlas::of(mission, drawing);
        let tasks = mission.tasks.iter().enumerate().map(|(i, task)| image_task(i + 1, task, &atlas));
        let tasks = tasks.collect::<Result<_, _>>()?;
        let may_start_anywhere = mission.method_in(drawing.kind.origin()).finds_start();
        Ok(Self { start: mission.start, heading_deg: mission.start_heading_deg, tasks, may_start_anywhere })
    }

    /// Takes the intent from the marks in a strokes file: the goals in order, then the route.
    pub fn of_marks(marks: &Marks) -> Self {
        let goals = marks.goals.iter().enumerate().map(|(i, goal)| {
            let unnamed = goal.name.is_empty();
            let name = if unnamed { format!("goal {}", i + 1) } else { goal.name.clone() };
            ImageTask {
                name,
                points: vec![goal.at],
                is_named: false,
                resolved: None,
                time_limit_s: MARKED_TIME_LIMIT_S,
            }
        });
        let route = marks.route.iter().map(|points| ImageTask {
            name: "route".into(),
            points: points.clone(),
            is_named: false,
            resolved: None,
            time_limit_s: MARKED_TIME_LIMIT_S,
        });
        let start = marks.start.as_ref();
        Self {
            start: start.map(|mark| mark.at),
            heading_deg: start.and_then(|mark| mark.heading_deg),
            tasks: goals.chain(route).collect(),
            may_start_anywhere: false,
        }
    }

    /// Fills in whatever `self` leaves open from `other`: the start, its heading, or the tasks.
    pub fn or(self, other: Self) -> Self {
        // A heading belongs to its start. The heading of another start would be wrong here.
        let (start, heading_deg) = match (self.start, other.start) {
            (None, Some(start)) => (Some(start), self.heading_deg.or(other.heading_deg)),
            (start, _) => (start, self.heading_deg),
        };
        let tasks = if self.tasks.is_empty() { other.tasks } else { self.tasks };
        let may_start_anywhere = self.may_start_anywhere || other.may_start_anywhere;
        Self { start, heading_deg, tasks, may_start_anywhere }
    }

    /// Checks everything against the drawing and converts it to the drawing's frame.
    ///
    /// If no start is given and the first task is a route, the robot starts at the route's first point (Boniardi et al. 2016,
    /// IV). If it is a goal, and the robot can find out where it is, it may start anywhere around that goal.
    ///
    /// # Errors
    /// [`SketchError`] if a position is outside the drawing, inside a wall or unreachable, if the start or its heading is
    /// missing, or if there are too many tasks or points, or none. The error names the start or the task, the position in image
    /// pixels, and what was expected.
    pub fn place(&self, drawing: &DrawnMap, settings: &Settings) -> Result<Places, SketchError> {
        self.check_counts()?;
        let route = self.tasks.first().filter(|task| task.is_route());
        let first_point = route.map(|task| task.points[0]);
        let start = match self.start.or(first_point) {
            Some(at) => Start {
                pose: facing(
                    &free(drawing, "navigator.start", at)?,
                    match self.heading_deg {
                        Some(degrees) => degrees.to_radians(),
                        None => route_heading(drawing, settings, route)?,
                    },
                ),
                spread_px: settings.start_spread_share * drawing.diagonal_px(),
                spread_rad: settings.start_spread_deg.to_radians(),
            },
            None => self.anywhere(drawing, settings)?,
        };
        let reached = Reachable::from(drawing, &start);
        let place = |(i, task): (usize, &ImageTask)| task.place(i + 1, drawing, &reached);
        Ok(Places {
            start: start.pose,
            start_spread_px: start.spread_px,
            start_spread_rad: start.spread_rad,
            tasks: self.tasks.iter().enumerate().map(place).collect::<Result<_, _>>()?,
        })
    }

    /// Returns the start of a robot that may be anywhere around the first goal.
    fn anywhere(&self, drawing: &DrawnMap, settings: &Settings) -> Result<Start, SketchError> {
        let no_start = || SketchError::NoStart { file: drawing.file.clone() };
        let first = self.tasks.first().filter(|_| self.may_start_anywhere).ok_or_else(no_start)?;
        if let Some((i, task)) = self.tasks.iter().enumerate().find(|(_, task)| task.is_route()) {
            return Err(SketchError::RouteWithoutStart { task: task_key(i + 1, &task.name) });
        }
        let (goal, _) = inside(drawing, &first.goal_in_words(1), first.points[0])?;
        let near = nearest_free(drawing, &goal).ok_or_else(no_start)?;
        let anywhere = Start::anywhere(facing(&near, 0.0), drawing.size());
        Ok(match self.heading_deg {
            Some(degrees) => Start {
                pose: facing(&near, degrees.to_radians()),
                spread_rad: settings.start_spread_deg.to_radians(),
                ..anywhere
            },
            None => anywhere,
        })
    }

    fn check_counts(&self) -> Result<(), SketchError> {
        let points = self.tasks.iter().map(|task| task.points.len()).sum();
        let checks =
            [("task", self.tasks.len(), MAX_TASKS), ("points of all tasks", points, MAX_ROUTE_POINTS)];
        for (key, found, most) in checks {
            if !(1..=most).contains(&found) {
                return Err(SketchError::Count { key, expected: format!("1 to {most}"), found });
            }
        }
        let empty = self.tasks.iter().any(|task| task.points.is_empty());
        if empty {
            let expected = "a point or more".into();
            return Err(SketchError::Count { key: "points of a task", expected, found: 0 });
        }
        Ok(())
    }
}

fn image_task(number: usize, task: &SketchTask, atlas: &Atlas) -> Result<ImageTask, SketchError> {
    let located = match &task.aim {
        Aim::Place(text) => Some(atlas.find(&format!("{}.goal", task_key(number, &task.name)), text)?),
        Aim::Goal(_) | Aim::Route(_) => None,
    };
    Ok(ImageTask {
        name: task.name.clone(),
        points: located.as_ref().map_or_else(|| task.aim.points().to_vec(), |located| vec![located.at]),
        is_named: located.is_some(),
        resolved: located.and_then(|located| located.room).map(|room| room.words),
        time_limit_s: task.time_limit_s,
    })
}

impl ImageTask {
    /// Returns true if the task is to follow a drawn route.
    fn is_route(&self) -> bool {
        self.points.len() > 1
    }

    /// Creates the task to go to a place that a person refers to in words. If they refer to a room by its position, the task
    /// has the name of the room or, if it has none, says where the room is.
    ///
    /// # Errors
    /// [`SketchError`] if there is no such place, with the names of places and tasks, or if there are several.
    pub(crate) fn named(
        text: &str,
        mission: &SketchMission,
        drawing: &DrawnMap,
    ) -> Result<Self, SketchError> {
        let Located { at, room } = Atlas::with_tasks(mission, drawing).find("goal", text)?;
        let at_pixel = format!("room at ({:.0}, {:.0})", at[0], at[1]);
        let (name, resolved) = room.map(|room| (room.name.unwrap_or(at_pixel), room.words)).unzip();
        let name = name.unwrap_or_else(|| text.to_owned());
        Ok(Self { name, points: vec![at], is_named: true, resolved, time_limit_s: PERSON_TIME_LIMIT_S })
    }

    fn goal_in_words(&self, number: usize) -> String {
        format!("task {number} ({}): goal", self.name)
    }

    fn place(&self, number: usize, drawing: &DrawnMap, reached: &Reachable) -> Result<Task, SketchError> {
        let last = self.points.len() - 1;
        let place = |(i, &at): (usize, &[f64; 2])| {
            let what = match last {
                0 => self.goal_in_words(number),
                _ => format!("task {number} ({}): route point {}", self.name, i + 1),
            };
            match (i > 0 && i < last, self.is_named) {
                (true, _) => brushing(drawing, &what, at),
                (false, true) => reached.near(&what, at),
                (false, false) => reached.free(&what, at),
            }
        };
        let points = self.points.iter().enumerate().map(place).collect::<Result<_, _>>()?;
        Ok(Task { name: self.name.clone(), points, time_limit_s: self.time_limit_s })
    }
}

fn facing(at: &Point<Sketch>, yaw_rad: f64) -> Pose<Sketch> {
    Pose::new(at.x, at.y, wrap_angle(yaw_rad))
}

/// Converts a position that must be in the drawing. Returns it with the index of its cell.
fn inside(drawing: &DrawnMap, what: &str, at: [f64; 2]) -> Result<(Point<Sketch>, usize), SketchError> {
    let point = drawing.from_image(at);
    let index = drawing.index(&point).ok_or_else(|| SketchError::Outside {
        what: what.to_owned(),
        place: at,
        file: drawing.file.clone(),
        width: (f64::from(drawing.width_px) / drawing.scale).round() as u32,
        height: (f64::from(drawing.height_px) / drawing.scale).round() as u32,
    })?;
    Ok((point, index))
}

/// Converts a position that must be in free space.
fn free(drawing: &DrawnMap, what: &str, at: [f64; 2]) -> Result<Point<Sketch>, SketchError> {
    let (point, index) = inside(drawing, what, at)?;
    if drawing.cells[index] == FREE { Ok(point) } else { Err(in_wall(drawing, what, at)) }
}

/// Converts a position that must be in free space, or in a wall but within a pen's width of free space.
fn brushing(drawing: &DrawnMap, what: &str, at: [f64; 2]) -> Result<Point<Sketch>, SketchError> {
    let (point, index) = inside(drawing, what, at)?;
    let near = |point: &Point<Sketch>| {
        let nearest = nearest_free(drawing, point);
        nearest.is_some_and(|free| free.distance(point) <= drawing.pen_width_px + 1.0)
    };
    if drawing.cells[index] == FREE || near(&point) { Ok(point) } else { Err(in_wall(drawing, what, at)) }
}

fn in_wall(drawing: &DrawnMap, what: &str, at: [f64; 2]) -> SketchError {
    let nearest = nearest_free(drawing, &drawing.from_image(at));
    SketchError::InWall {
        what: what.to_owned(),
        place: at,
        file: drawing.file.clone(),
        nearest: nearest.map_or(at, |point| drawing.to_image(&point)),
    }
}

/// Returns the centre of the nearest free cell.
pub(crate) fn nearest_free(drawing: &DrawnMap, point: &Point<Sketch>) -> Option<Point<Sketch>> {
    nearest(drawing, point, |cell| drawing.cell(cell) == Some(FREE))
}

/// Returns the centre of the nearest cell for which `is_meant` holds, searching in square rings of increasing size around the
/// point.
fn nearest(
    drawing: &DrawnMap,
    point: &Point<Sketch>,
    is_meant: impl Fn(&Point<Sketch>) -> bool,
) -> Option<Point<Sketch>> {
    let (width, height) = (i64::from(drawing.width_px), i64::from(drawing.height_px));
    let (x, y) = (point.x as i64, point.y as i64);
    let mut best: Option<Point<Sketch>> = None;
    for ring in 0..width.max(height) {
        // A corner of this ring may be farther than a side of the next.
        if best.is_some_and(|found| found.distance(point) < ring as f64 - 0.5) {
            break;
        }
        let sides = (-ring..=ring).flat_map(|k| [(k, -ring), (k, ring), (-ring, k), (ring, k)]);
        for (dx, dy) in sides {
            let cell = Point::new((x + dx) as f64 + 0.5, (y + dy) as f64 + 0.5);
            let nearer = best.is_none_or(|found| cell.distance(point) < found.distance(point));
            if nearer && is_meant(&cell) {
                best = Some(cell);
            }
        }
    }
    best
}

/// Returns the heading, in radians, of a robot that starts where a drawn route begins, or `None` if the route never gets far
/// enough.
///
/// The heading is the direction from the route's first point to the first one that is farther away than
/// [`Settings::heading_distance_share`] of the drawing's diagonal, so that a squiggle at the beginning does not count (Boniardi
/// et al. 2016, IV).
pub fn route_heading_rad(
    route: impl IntoIterator<Item = Point<Sketch>>,
    diagonal_px: f64,
    settings: &Settings,
) -> Option<f64> {
    let threshold = settings.heading_distance_share * diagonal_px;
    let mut points = route.into_iter();
    let first = points.next()?;
    let beyond = points.find(|point| point.distance(&first) > threshold)?;
    Some((beyond.y - first.y).atan2(beyond.x - first.x))
}

fn route_heading(
    drawing: &DrawnMap,
    settings: &Settings,
    route: Option<&ImageTask>,
) -> Result<f64, SketchError> {
    let points = route.map_or(&[][..], |task| &task.points);
    let (route, diagonal_px) = (points.iter().map(|&at| drawing.from_image(at)), drawing.diagonal_px());
    let threshold_px = settings.heading_distance_share * diagonal_px / drawing.scale;
    route_heading_rad(route, diagonal_px, settings).ok_or(SketchError::NoHeading { threshold_px })
}

/// The free cells that are connected to the start through cell sides. Corners do not connect cells, because a wall may be a
/// line that climbs pixel by pixel.
struct Reachable<'a> {
    drawing: &'a DrawnMap,
    start: Point<Sketch>,
    /// Whether nobody has marked the start, so that the first goal takes its part.
    is_anywhere: bool,
    cells: Vec<bool>,
}

impl<'a> Reachable<'a> {
    fn from(drawing: &'a DrawnMap, start: &Start) -> Self {
        let at = start.pose.position();
        let is_anywhere = start.is_anywhere(drawing.size());
        Self { drawing, start: at, is_anywhere, cells: flood(drawing, &at) }
    }

    fn contains(&self, point: &Point<Sketch>) -> bool {
        self.drawing.index(point).is_some_and(|index| self.cells[index])
    }

    /// Converts the position of a name. If that is in a wall, the nearest free position counts, which must be reachable.
    fn near(&self, what: &str, at: [f64; 2]) -> Result<Point<Sketch>, SketchError> {
        let (point, index) = inside(self.drawing, what, at)?;
        if self.drawing.cells[index] == FREE {
            return self.free(what, at);
        }
        let beside = nearest_free(self.drawing, &point).unwrap_or(self.start);
        self.free(what, self.drawing.to_image(&beside))
    }

    /// Converts a position that must be free and reachable.
    fn free(&self, what: &str, at: [f64; 2]) -> Result<Point<Sketch>, SketchError> {
        let point = free(self.drawing, what, at)?;
        if self.contains(&point) {
            return Ok(point);
        }
        let start = self.drawing.to_image(&self.start);
        // Metres given instead of pixels put the start into a corner of the page, from where no goal can be reached.
        if !self.is_anywhere
            && touches_edge(self.drawing, &self.cells)
            && !touches_edge(self.drawing, &flood(self.drawing, &point))
        {
            let (file, what) = (self.drawing.file.clone(), what.to_owned());
            return Err(SketchError::StartOutside { start, file, what, place: at });
        }
        let nearest = nearest(self.drawing, &point, |cell| self.contains(cell)).unwrap_or(self.start);
        Err(SketchError::Unreachable {
            nearest: self.drawing.to_image(&nearest),
            what: what.to_owned(),
            place: at,
            file: self.drawing.file.clone(),
            from: if self.is_anywhere { "the first goal" } else { "the start" },
            start,
        })
    }
}

/// Returns true if any of the marked cells is at the edge of the page.
fn touches_edge(drawing: &DrawnMap, marked: &[bool]) -> bool {
    let rows: Vec<_> = marked.chunks_exact(drawing.width_px as usize).collect();
    let is_marked = |row: &&[bool]| row.contains(&true);
    let at_ends = rows.first().is_some_and(is_marked) || rows.last().is_some_and(is_marked);
    at_ends || rows.iter().any(|row| row.first() == Some(&true) || row.last() == Some(&true))
}

/// Returns which cells can be reached from `start`. Whole stretches of free cells are visited at a time.
pub(crate) fn flood(drawing: &DrawnMap, start: &Point<Sketch>) -> Vec<bool> {
    let width = drawing.width_px as usize;
    let rows: Vec<Vec<Range<usize>>> = drawing.cells.chunks_exact(width).map(free_stretches).collect();
    let mut seen: Vec<Vec<bool>> = rows.iter().map(|stretches| vec![false; stretches.len()]).collect();
    let mut reached = vec![false; drawing.cells.len()];
    let first = drawing.index(start).map(|at| (at / width, at % width));
    let holds =
        |(row, column): (usize, usize)| Some((row, rows[row].iter().position(|one| one.contains(&column))?));
    let mut open: Vec<(usize, usize)> = first.and_then(holds).into_iter().collect();
    while let Some((row, k)) = open.pop() {
        if std::mem::replace(&mut seen[row][k], true) {
            continue;
        }
        let stretch = &rows[row][k];
        reached[row * width..][stretch.clone()].fill(true);
        for beside in
            [row.checked_sub(1), Some(row + 1).filter(|&row| row < rows.len())].into_iter().flatten()
        {
            let first = rows[beside].partition_point(|other| other.end <= stretch.start);
            let touching = rows[beside][first..].iter().take_while(|other| other.start < stretch.end).count();
            open.extend((first..first + touching).map(|k| (beside, k)));
        }
    }
    reached
}

/// Returns the stretches of free cells of a row.
fn free_stretches(row: &[u8]) -> Vec<Range<usize>> {
    let mut end = 0;
    let next = || {
        let start = end + row[end..].iter().position(|&cell| cell == FREE)?;
        end = start + row[start..].iter().take_while(|&&cell| cell == FREE).count();
        Some(start..end)
    };
    std::iter::from_fn(next).collect()
}
