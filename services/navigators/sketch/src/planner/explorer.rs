//! Locates the goal in the map of what the robot has seen, or decides where to look for it.
//!
//! The explorer maps the whole drive ([`sketchnav_mapping`]) and aligns the outline of the map with that of the drawing. Each piece
//! of the drawing's outline has a share of the goal, its harmonic measure. If these pieces were seen, their places in the map
//! determine that of the goal. If they lie behind a gap, the robot drives to the gap and looks through it. A gap with nothing
//! behind it is shut. Before the explorer accepts an arrival, it computes the best *rival*, the best alignment according to which
//! the goal is elsewhere. If the rival costs hardly more, the robot looks there first. If this does not settle the matter, it asks
//! a person (see `doubt`).
//!
//! An alignment is spread over steps, each with a fixed amount of work. The explorer uses neither clocks nor channels, so equal
//! scans result in equal courses.

mod correspondence;
mod course;
mod doubt;
mod floor;
mod job;
mod known;
mod locate;
mod paper;
mod path_grid;
mod searching;

use std::fmt;

use serde::{Deserialize, Serialize};
use sketchnav_mapping::alignment::{Aligner, Alignment, Forbidden, Partner, Weights};
use sketchnav_mapping::mapper::{self, Mapper};
use sketchnav_mapping::outline::{Place, SeenOutline, Taking, distance};
use sketchnav_mapping::scan::Scan;
use sketchnav_mapping::survey::OFF_FREE_M;
use sketchnav_mapping::{Map, Survey};
use sketchnav_schemas::geometry::{Base, Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::LaserScan;

use crate::filter::Start;
use crate::paths::parameters::Parameters;
use crate::sketch::SketchGrid;
pub use course::Aim;
use course::{Course, Likely};
use doubt::{Doubt, Settled};
use job::Job;
use known::Known;
pub use locate::locate;
use paper::Paper;
use path_grid::{Field, PathGrid};

/// Number of samples of the drawing's outline.
const SAMPLES: usize = 220;
/// Number of steps of the dynamic programme in each step of the explorer.
const WORK: usize = 600_000;
/// Maximum number of pieces of a seen outline.
const MOST_PIECES: usize = 900;
/// Maximum number of places in gaps that are shut.
const MOST_SHUT: usize = 4096;
/// Distance, in metres, after which the outline is aligned again on the way to a gap or the goal.
const ANEW_M: f64 = 0.9;
/// Distance, in metres, after which the openness of the floor is re-evaluated.
const JUDGED_M: f64 = 0.9;
/// Distance from the end of a course, in metres, within which a gap is reached.
const AT_GAP_M: f64 = 0.3;
/// Distance from the end of a course, in metres, within which the goal is reached.
const AT_GOAL_M: f64 = 0.35;
/// Length of the path to where a rival locates the goal, in metres, below which the robot is there already.
const AT_RIVAL_M: f64 = 0.6;
/// Distance, in metres, within which the goals of two rivals count as the same place, which is not looked at again.
const LOOKED_AT_M: f64 = 1.5;
/// Newly seen area, in square metres, below which a look counts as fruitless.
const SHOWS_M2: f64 = 0.08;
/// Distance from the robot, in metres, within which points of a gap are shut.
const SHUT_M: f64 = 0.8;
/// Distance, in metres, by which a point of a gap may be farther from the robot than the gap's middle and still be shut.
const SHUT_BEYOND_M: f64 = 0.3;
/// Speed that a robot can be expected to reach, in m/s.
const USUAL_MPS: f64 = 0.42;
/// Typical ratio of the length of a path to that of the straight line.
const WINDING: f64 = 1.5;
/// Time reserved for the end of a task, in seconds.
const SPARE_S: f64 = 25.0;
/// Share of the goal from which a sample gets the full emphasis.
const WHOLE_SHARE: f64 = 0.05;
/// Minimum share of a goal that must have been seen to locate the goal in the map.
const LEAST_SEEN: f64 = 0.02;

/// The next action for the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advice {
    /// Continue along the course, or wait if there is none.
    Drive,
    /// Turn on the spot, to see everything around.
    Look,
    /// Stop, because the goal is here.
    Arrived(Evidence),
    /// Wait for a person to mark where the robot is.
    Ask,
    /// Stop, because the goal may be here or elsewhere. The start is unknown, and another alignment costs only this much more.
    Alike(f64),
}

/// The evidence for an arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Amount by which the best rival costs more, and the distance, in metres, to where it locates the goal. `None` if there was no
    /// time to compute the rival.
    pub rival: Option<(f64, f64)>,
    /// Difference in direction between the walls around the goal and what was seen, as 1 − cos, weighted by the goal's shares.
    pub misfit: f64,
    /// Whether a person was asked and agreed.
    pub is_confirmed: bool,
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.rival {
            Some((margin, away_m)) => write!(f, "margin {margin:.2} at {away_m:.1} m")?,
            None => f.write_str("no rival asked")?,
        }
        write!(f, ", misfit {:.3}", self.misfit)?;
        if self.is_confirmed { f.write_str(", a person agrees") } else { Ok(()) }
    }
}

/// The best rival of an alignment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Rival {
    margin: f64,
    place: Place,
}

/// The mutable state of the explorer, except for the map.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Exploration {
    /// The goal that the robot is looking for.
    goal: Option<Point<Sketch>>,
    has_looked: bool,
    /// Whether the filter has failed in the task, although the floor consists of rooms.
    has_taken_over: bool,
    /// Openness of the floor (see [`floor::Judge::open_share`]).
    open_share: Option<f64>,
    judged_at: Option<Place>,
    job: Option<Job>,
    course: Option<Course>,
    /// The robot's position when the outline was last extracted.
    taken_at: Option<Place>,
    shut: Vec<Place>,
    /// The places to shut if the current look is fruitless, and the number of free cells before the look.
    looking: Option<(Vec<Place>, u32)>,
    looks: u32,
    /// Places that the robot has looked at because rivals locate the goal there, or behind a gap there.
    looked_at: Vec<Place>,
    rival: Option<Rival>,
    doubt: Option<Doubt>,
    settled: Option<Settled>,
    /// Partners ruled out by a person's answers, because the goal does not lie there.
    denied: Vec<Forbidden>,
    /// What a person has reported about where the robot was.
    told: Option<Known>,
    /// Where the robot was when it arrived without doubt, if neither the drawing nor a person had said where it is.
    found: Option<Known>,
    is_news: bool,
    /// Whether the filter has found out where the robot is.
    is_estimated: bool,
    /// Whether the drawing looks the same after half a turn, so that the filter may never find out where the robot is.
    is_ambiguous: bool,
    /// Whether somebody has carried the robot, so that the mark of the start no longer counts.
    is_kidnapped: bool,
    /// The last alignment and its outline.
    last: Option<(SeenOutline, Alignment)>,
}

/// The explorer's state, as read back from a checkpoint.
#[derive(Debug, Clone, Deserialize)]
pub struct State {
    exploration: Exploration,
    mapper: mapper::State,
}

/// A [`State`] by reference, for writing it without a copy.
#[derive(Debug, Serialize)]
pub struct StateView<'a> {
    exploration: &'a Exploration,
    mapper: &'a mapper::State,
}

/// Finds goals by the outline of what was seen, as the module's documentation describes.
#[derive(Debug)]
pub struct Explorer {
    parameters: Parameters,
    mapping: sketchnav_mapping::Parameters,
    mapper: Mapper,
    survey: Survey,
    /// Whether `survey` is up to date with the map.
    is_surveyed: bool,
    judge: floor::Judge,
    paper: Option<Paper>,
    shares: Vec<f64>,
    /// Weight of each sample of the drawing's outline. Walls around the goal count more, because they contain the most information
    /// about where it is.
    emphasis: Vec<f64>,
    weights: Weights,
    aligner: Aligner,
    field: Option<Field>,
    exploration: Exploration,
}

impl Explorer {
    /// Creates an explorer with an empty map, for a robot whose laser has the given range.
    ///
    /// # Errors
    /// Returns an error if a parameter of the mapper is invalid.
    pub fn new(parameters: &Parameters, range_max_m: f64) -> Result<Self, sketchnav_mapping::Error> {
        let mapping = sketchnav_mapping::Parameters::for_range(range_max_m);
        Ok(Self {
            parameters: parameters.clone(),
            mapping,
            mapper: Mapper::new(mapping)?,
            survey: Survey::with_room(&mapping),
            is_surveyed: false,
            judge: floor::Judge::for_maps(mapping.cells_per_side(), mapping.cell_m),
            paper: None,
            shares: Vec::new(),
            emphasis: Vec::new(),
            weights: Weights { away_m: parameters.rival_away_m, ..Weights::default() },
            aligner: Aligner::default(),
            field: None,
            exploration: Exploration::default(),
        })
    }

    /// Sets the drawing and the start in it. Discards the map, because it belongs to another drawing.
    pub fn on_sketch(&mut self, sketch: &SketchGrid, start: &Start) {
        self.paper = Paper::new(sketch, start, self.parameters.building_size_m);
        self.exploration = Exploration::default();
        self.empty_map();
    }

    /// Returns the explorer's state without copying it.
    pub fn state(&self) -> StateView<'_> {
        StateView { exploration: &self.exploration, mapper: self.mapper.state() }
    }

    /// Restores the state of an explorer with the same drawing and parameters. A state that does not match the parameters is
    /// ignored.
    pub fn restore(&mut self, state: State) {
        if let Ok(mapper) = Mapper::restore(self.mapping, state.mapper) {
            (self.mapper, self.exploration, self.is_surveyed) = (mapper, state.exploration, false);
            self.weigh_goal();
            self.field =
                self.exploration.course.as_ref().and_then(|course| Field::new(&course.grid, course.cell));
            self.prepare_job();
        }
    }

    /// Returns true if goals are located by the outline, which is the case while the floor seen so far is open, for the rest of a
    /// task in which the filter has failed, and while neither a mark, a person nor the filter has placed the robot.
    pub fn is_in_charge(&self) -> bool {
        self.paper.is_some() && (self.is_open() || self.exploration.has_taken_over || !self.is_placed())
    }

    /// Returns true if the floor that was seen is open. It is, until it has been judged.
    fn is_open(&self) -> bool {
        self.exploration.open_share.unwrap_or(1.0) >= self.parameters.least_open_share
    }

    /// Takes charge of the rest of a task in which the filter has failed.
    pub fn take_over(&mut self) {
        (self.exploration.has_taken_over, self.exploration.course) = (true, None);
    }

    /// Returns true if the floor consists of rooms, so that goals are located by the filter.
    pub fn sees_rooms(&self) -> bool {
        self.paper.is_some() && !self.is_in_charge()
    }

    /// Judges the floor on the way to a goal, if the robot has moved some distance since the last time or has looked around.
    fn judge_floor(&mut self) {
        let place = self.place();
        if self.exploration.goal.is_some()
            && self.exploration.judged_at.is_none_or(|at| distance(at, place) > JUDGED_M)
        {
            self.take_survey();
            let share = self.judge.open_share(self.survey.free(), self.mapping.cell_m);
            (self.exploration.judged_at, self.exploration.open_share) = (Some(place), Some(share));
        }
    }

    /// Processes a scan of a robot whose pose by odometry is `robot`.
    pub fn observe(&mut self, robot: Pose<Odom>, base_from_laser: Pose<Base>, scan: &LaserScan) {
        if self.paper.is_none() {
            return;
        }
        // The error for an invalid scan can be ignored, because such a scan changes nothing.
        let _ = self.mapper.update(robot, &Scan::of_message(scan, base_from_laser));
        self.is_surveyed = false;
        self.judge_floor();
    }

    /// Discards the map and all that followed from it, because somebody has carried the robot. The goal
    /// remains.
    pub fn begin_elsewhere(&mut self) {
        let goal = self.exploration.goal;
        self.exploration = Exploration { goal, is_kidnapped: true, ..Exploration::default() };
        self.field = None;
        self.empty_map();
    }

    fn empty_map(&mut self) {
        if let Ok(mapper) = Mapper::new(self.mapping) {
            (self.mapper, self.is_surveyed) = (mapper, false);
        }
    }

    /// Begins looking for a goal.
    pub fn begin(&mut self, goal: Point<Sketch>) {
        self.exploration.goal = Some(goal);
        (self.exploration.job, self.exploration.course, self.exploration.taken_at) = (None, None, None);
        self.exploration.has_taken_over = false;
        (self.exploration.looking, self.exploration.looks, self.field) = (None, 0, None);
        (self.exploration.rival, self.exploration.doubt, self.exploration.settled) = (None, None, None);
        self.exploration.looked_at.clear();
        self.exploration.denied.clear();
        // The goal's weights are only needed when outlines are aligned, which never happens among rooms.
        self.shares.clear();
    }

    fn weigh_goal(&mut self) {
        self.shares = match (&self.paper, self.exploration.goal) {
            (Some(paper), Some(goal)) => paper.shares(goal),
            _ => Vec::new(),
        };
        self.emphasis = emphasis(&self.shares, self.parameters.goal_emphasis);
    }

    /// Performs a step, with `left_s` seconds left for the task.
    pub fn step(&mut self, left_s: f64) -> Advice {
        if !std::mem::replace(&mut self.exploration.has_looked, true) {
            // Slow work is done in a step of its own.
            self.weigh_goal();
            return Advice::Look;
        }
        if let Some(advice) = self.take_settled() {
            return advice;
        }
        if self.asks().is_some() {
            return Advice::Ask;
        }
        if let Some(job) = &mut self.exploration.job {
            if !job.search.advance(&mut self.aligner, WORK) {
                return Advice::Drive;
            }
            if job.turns_again() {
                self.prepare_job();
                return Advice::Drive;
            }
            return match self.exploration.job.take() {
                Some(job) => self.decide(job, left_s),
                None => Advice::Drive,
            };
        }
        if self.is_due() {
            self.begin_job(Vec::new(), None);
        }
        Advice::Drive
    }

    /// Records that a look around has ended, and evaluates it.
    pub fn end_look(&mut self) {
        self.exploration.judged_at = None;
        if let Some((places, before)) = self.exploration.looking.take() {
            let shown = self.free_cells() as f64 - f64::from(before);
            if shown * self.mapping.cell_m.powi(2) < SHOWS_M2 {
                self.shut(&places);
            }
        }
        self.begin_job(Vec::new(), None);
    }

    /// Abandons the course, because the robot is stuck on it.
    pub fn give_way(&mut self) {
        if let Some(course) = self.exploration.course.take() {
            let gap = course.gap.clone();
            self.shut(&gap);
        }
        self.field = None;
        self.begin_job(Vec::new(), None);
    }

    /// Returns the robot's current aim.
    pub fn aim(&self) -> Option<Aim> {
        self.exploration.course.as_ref().map(|course| course.aim)
    }

    /// Returns the number of times that the robot has looked at where a rival locates the goal.
    pub fn looks(&self) -> u32 {
        self.exploration.looks
    }

    /// Returns the end of the course.
    pub fn course_end(&self) -> Option<Place> {
        self.exploration.course.as_ref().map(|course| course.end)
    }

    /// Returns the cost of the path from a place to the end of the course, which is at least the path's length in metres. Infinite
    /// if there is no path.
    pub fn cost_m(&self, place: Point<Map>) -> f64 {
        self.field.as_ref().map_or(f64::INFINITY, |field| field.cost_m([place.x, place.y]))
    }

    /// Writes the path from the robot to the end of the course.
    pub fn descend(&self, path: &mut Vec<Point<Map>>) {
        path.clear();
        if let Some(field) = &self.field {
            let robot = self.mapper.pose();
            field.descend([robot.x, robot.y], path);
        }
    }

    /// Returns the robot's pose in the map.
    pub fn robot(&self) -> Pose<Map> {
        self.mapper.pose()
    }

    fn place(&self) -> Place {
        let pose = self.mapper.pose();
        [pose.x, pose.y]
    }

    /// Surveys the map, unless the map has not changed since the last survey.
    fn take_survey(&mut self) {
        if !std::mem::replace(&mut self.is_surveyed, true) {
            self.survey.take(self.mapper.map(), self.place(), OFF_FREE_M);
        }
    }

    fn free_cells(&mut self) -> usize {
        self.take_survey();
        self.survey.free().count()
    }

    fn is_due(&self) -> bool {
        let Some(course) = &self.exploration.course else { return true };
        let place = self.place();
        let is_there = distance(place, course.end) < course.aim.within_m();
        let has_moved = self.exploration.taken_at.is_none_or(|at| distance(at, place) > ANEW_M);
        is_there || has_moved && course.aim != Aim::Rival
    }

    fn decide(&mut self, mut job: Job, left_s: f64) -> Advice {
        let (Some((_, turn, start)), Some(paper)) = (job.least, &self.paper) else { return Advice::Drive };
        if std::mem::replace(&mut job.turn, turn) != turn {
            self.aligner.set(&self.weights, &job.problem(paper, &self.emphasis));
        }
        let alignment = self.aligner.trace(start);
        match job.best {
            None => {
                self.exploration.is_news = true;
                self.exploration.last = Some((job.seen, alignment));
                self.choose(left_s)
            }
            Some(best) => {
                let margin = alignment.cost - best;
                match self.exploration.doubt.take() {
                    Some(doubt) => self.doubt_on(doubt, &alignment, margin),
                    None => self.weigh_rival(&job.seen, &alignment, margin, left_s),
                }
            }
        }
    }

    /// Sets a course to the goal if it was seen, or else to the gap that leads to it.
    fn choose(&mut self, left_s: f64) -> Advice {
        let Some((seen, alignment)) = self.exploration.last.take() else { return Advice::Drive };
        let likely = Likely::new(&self.shares, &seen, &alignment);
        let advice = self.choose_by(&likely, &seen, &alignment, left_s);
        if self.exploration.last.is_none() {
            self.exploration.last = Some((seen, alignment));
        }
        advice
    }

    fn choose_by(
        &mut self,
        likely: &Likely,
        seen: &SeenOutline,
        alignment: &Alignment,
        left_s: f64,
    ) -> Advice {
        let place = self.place();
        let hurries = likely.place.is_some_and(|goal| {
            likely.seen > LEAST_SEEN && left_s < distance(goal, place) * WINDING / USUAL_MPS + SPARE_S
        });
        if self.searches()
            && !hurries
            && let Some(advice) = self.choose_any_gap(seen)
        {
            return advice;
        }
        let is_seen = likely.hidden < self.parameters.goal_hidden_share || likely.gap.is_none() || hurries;
        match (is_seen, likely.place, likely.gap) {
            (true, Some(goal), _) => {
                let Some(way_m) = self.set_course(Aim::Goal, goal, Vec::new()) else { return Advice::Drive };
                if way_m >= AT_GOAL_M {
                    return Advice::Drive;
                }
                self.exploration.last = Some((seen.clone(), alignment.clone()));
                // Without a start, only the rival shows whether the goal may be elsewhere.
                if hurries && self.knows_a_place() || self.parameters.rival_margin <= 0.0 {
                    return self.arrived(None);
                }
                let forbidden = self.goal_places(alignment);
                self.begin_job(forbidden, Some(alignment.cost));
                Advice::Drive
            }
            (_, _, Some((gap, point))) => {
                let points = seen.gaps[usize::from(gap)].clone();
                match self.set_course(Aim::Gap, point, points.clone()) {
                    Some(way_m) => self.look_through(&points, point, way_m),
                    None => Advice::Drive,
                }
            }
            _ => Advice::Drive,
        }
    }

    /// Returns the partners that determine where the goal is. They have most of the goal's mass on walls, and the heaviest comes
    /// first.
    fn goal_places(&self, alignment: &Alignment) -> Vec<Forbidden> {
        const MOST: f64 = 0.6;
        let mut walls: Vec<_> = alignment
            .partners
            .iter()
            .zip(&self.shares)
            .zip(0_u16..)
            .filter_map(|((partner, share), sample)| match partner {
                Partner::Wall(place) => Some((*share, Forbidden { sample, place: *place })),
                _ => None,
            })
            .collect();
        walls.sort_by(|a, b| b.0.total_cmp(&a.0));
        let whole: f64 = walls.iter().map(|(share, _)| share).sum();
        let mut so_far = 0.0;
        let heaviest = walls.iter().take_while(|(share, _)| {
            let is_in = so_far <= MOST * whole;
            so_far += share;
            is_in
        });
        heaviest.map(|(_, forbidden)| *forbidden).collect()
    }

    /// Decides about an arrival, given the best rival and the amount `margin` by which it costs more.
    fn weigh_rival(&mut self, seen: &SeenOutline, rival: &Alignment, margin: f64, left_s: f64) -> Advice {
        const LIKELY: f64 = 0.3;
        let likely = Likely::new(&self.shares, seen, rival);
        let (target, points) = match (likely.gap, likely.place) {
            (Some((gap, _)), _) if likely.hidden > LIKELY => {
                let points = seen.gaps[usize::from(gap)].clone();
                (points[points.len() / 2], points)
            }
            (_, Some(place)) => (place, Vec::new()),
            _ => return self.arrived(Some(margin)),
        };
        self.exploration.rival = Some(Rival { margin, place: target });
        self.exploration.is_news = true;
        if margin > self.parameters.rival_margin {
            return self.arrived(Some(margin));
        }
        let is_known = self.exploration.looked_at.iter().any(|at| distance(*at, target) < LOOKED_AT_M);
        if is_known || self.exploration.looks >= self.parameters.rival_looks {
            return self.doubt(rival, margin);
        }
        let before = (self.exploration.course.take(), self.field.take());
        let Some(way_m) = self.set_course(Aim::Rival, target, points.clone()) else {
            if self.may_ask() {
                (self.exploration.course, self.field) = before;
            }
            return self.doubt(rival, margin);
        };
        let back_s = 2.0 * way_m / USUAL_MPS + 30.0;
        if way_m < AT_RIVAL_M && !points.is_empty() {
            self.look_at(target);
            let near = self.near_of(&points, target);
            self.shut(&near);
            self.begin_job(Vec::new(), None);
            return Advice::Drive;
        }
        if way_m < AT_RIVAL_M || back_s > left_s {
            (self.exploration.course, self.field) = before;
            return if way_m < AT_RIVAL_M { self.doubt(rival, margin) } else { self.arrived(Some(margin)) };
        }
        self.look_at(target);
        Advice::Drive
    }

    /// Accepts an arrival, unless the start is unknown and a rival, which costs `margin` more, is about as good, or, among rooms, the
    /// filter cannot tell this place from its twin.
    fn arrived(&mut self, margin: Option<f64>) -> Advice {
        if !self.knows_a_place()
            && let Some(margin) = margin
        {
            let is_ambiguous = self.exploration.is_ambiguous && self.searches();
            if margin < self.parameters.alike_margin || is_ambiguous {
                return Advice::Alike(margin);
            }
            if margin > self.parameters.rival_margin {
                self.exploration.found = self.found();
            }
        }
        let misfit = self.exploration.last.as_ref().map_or(0.0, |(_, alignment)| {
            let pairs = self.shares.iter().zip(&alignment.misfits);
            pairs.map(|(share, misfit)| share * f64::from(*misfit)).sum()
        });
        let place = self.place();
        let away_m = |rival: Rival| distance(rival.place, place);
        let rival = margin.map(|margin| (margin, self.exploration.rival.map_or(f64::INFINITY, away_m)));
        Advice::Arrived(Evidence { rival, misfit, is_confirmed: false })
    }

    fn look_at(&mut self, target: Place) {
        self.exploration.looks += 1;
        self.exploration.looked_at.push(target);
    }

    /// Sets a course to the reachable place that is nearest to `target`. Returns the length of the path there, in metres, or `None`
    /// if nothing is reachable.
    fn set_course(&mut self, aim: Aim, target: Place, gap: Vec<Place>) -> Option<f64> {
        let (place, mut grid) = (self.place(), self.path_grid());
        let end = match aim {
            Aim::Gap => grid.end_near(place, target, &gap),
            _ => grid.end_for(place, target),
        };
        let Some((cell, way_m)) = end else {
            (self.exploration.course, self.field) = (None, None);
            return None;
        };
        self.follow(aim, target, gap, grid, cell);
        Some(way_m)
    }

    /// Returns the grid of the space that was seen.
    fn path_grid(&mut self) -> PathGrid {
        self.take_survey();
        let clearance_m = self.parameters.footprint_padding_m + self.parameters.map_clearance_m;
        PathGrid::new(&self.survey, clearance_m)
    }

    /// Sets the course that ends in this cell of the grid.
    fn follow(&mut self, aim: Aim, target: Place, gap: Vec<Place>, grid: PathGrid, cell: usize) {
        let end = grid.middle(cell);
        self.field = Field::new(&grid, cell);
        self.exploration.course = Some(Course { aim, target, end, gap, grid, cell });
    }

    /// Returns the points of a gap near the robot.
    fn near_of(&self, gap: &[Place], middle: Place) -> Vec<Place> {
        let robot = self.place();
        let reach_m = SHUT_M.max(distance(robot, middle) + SHUT_BEYOND_M);
        gap.iter().copied().filter(|place| distance(*place, robot) < reach_m).collect()
    }

    fn shut(&mut self, places: &[Place]) {
        let room = MOST_SHUT.saturating_sub(self.exploration.shut.len());
        self.exploration.shut.extend(places.iter().take(room));
    }
}

impl Paper {
    fn taking(&self) -> Taking {
        Taking {
            piece_m: self.outline.length * self.scale_m / self.outline.places.len().max(1) as f64,
            smoothing_m: 0.12,
            wall_m: 0.15,
            least_gap_m: 0.36,
            least_wall_m: 0.24,
            most_pieces: MOST_PIECES,
        }
    }
}

/// Returns the weight of each sample of the drawing's outline, given the goal's share of each.
fn emphasis(shares: &[f64], goal_emphasis: f64) -> Vec<f64> {
    let more = |share: &f64| 1.0 + goal_emphasis * (share / WHOLE_SHARE).min(1.0);
    shares.iter().map(more).collect()
}
