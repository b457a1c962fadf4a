//! The `witnesses` suite compares three witnesses, that is, three ways of estimating where the goal is at the end of each task: the
//! particle filter, the outline of what was seen, and [regions joined by doors](sketchnav_sketch::rooms). Its tables show how often
//! each witness is right, alone and together with the others, and how well their answers distinguish right arrivals from wrong
//! ones.
//!
//! The drawings are made by `sketchnav deform` from invented floors of seven kinds. The first floor of each kind is used for all
//! fitting, and the other two serve as a check.

mod tables;

use serde::{Deserialize, Serialize};
use sketchnav_mapping::survey::OFF_FREE_M;
use sketchnav_mapping::{Mapper, Parameters, Scan, Survey};
use sketchnav_rehearsal::Tap;
use sketchnav_schemas::channels::{ChannelSpec, ODOMETRY, SCAN};
use sketchnav_schemas::geometry::{Base, Point, Pose, Sketch, World};
use sketchnav_schemas::message::{LaserScan, Odometry};
use sketchnav_schemas::mission::Place;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::paths::{self, chart::Chart};
use sketchnav_sketch::planner::locate_by_outline;
use sketchnav_sketch::rooms::{Answer, Floor, locate};
use sketchnav_sketch::sketch::SketchGrid;

use crate::error::EvalError;
use crate::experiments::deformed::Site;
use crate::experiments::suite::{Folders, Suite};
use crate::judge::log::Log;

const TITLE: &str = "What three witnesses say about the goal at the end of each drive: the particle filter, the outline of what was seen, and regions joined by doors. Drawings by sketchnav deform of invented floors that no other suite uses.";
/// The kinds of floors.
pub(super) const KINDS: [&str; 7] = ["straight", "l", "t", "ring", "double", "hall", "open"];
/// Number of floors of each kind. The first one is used for fitting, and the others for checking.
const FLOORS: u64 = 3;
/// Degrees of deformation.
const DEGREES: [f64; 2] = [1.0, 1.5];
/// Number of drawings of each floor at each degree.
const DRAWINGS_OF_FLOOR: u64 = 4;
/// Number of the first drawing of the first floor, and the difference between the first numbers of successive floors. No other
/// suite uses drawings with such numbers, and no two floors share one, because drawings with the same number are deformed in the
/// same way.
const FIRST_DRAWING: [u64; 2] = [104, 8];
/// Number of the drawing of the first floor, and degrees of deformation, for drives without a start mark.
const CAREFUL_DRAWING: u64 = 404;
const CAREFUL_DEGREES: [f64; 2] = [0.5, 1.0];
/// Maximum distance, in metres, between the goals of two witnesses that agree with each other.
const AGREE_M: f64 = 2.5;

/// Loads the `witnesses` suite.
///
/// # Errors
/// [`EvalError`] if a file is malformed.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite {
        title: TITLE.into(),
        repetitions: 1,
        lines: Some("degree"),
        sections: Some(tables::sections),
        ..Suite::default()
    };
    let names = KINDS.iter().flat_map(|kind| (1..=FLOORS).map(move |k| format!("{kind}-{k}")));
    for (name, k) in names.zip(0..) {
        let path = folders.project.join(format!("sim/missions/floors/{name}.floor.toml"));
        let site = Site::of_plan(name, &path)?;
        let first = FIRST_DRAWING[0] + k * FIRST_DRAWING[1];
        for number in first..first + DRAWINGS_OF_FLOOR {
            for degree in DEGREES {
                suite.trials.extend(site.trials(degree, number)?);
            }
        }
    }
    suite.trials.iter_mut().for_each(|trial| trial.asks_rooms = true);
    Ok(suite)
}

/// Returns the same floors drawn by more careful people, for drives without a start mark.
///
/// # Errors
/// [`EvalError`] if a file is malformed.
pub fn floors(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite {
        title: "Drawings of invented floors of seven kinds by sketchnav deform.".into(),
        repetitions: 1,
        lines: Some("degree"),
        ..Suite::default()
    };
    let names = KINDS.iter().flat_map(|kind| (1..=FLOORS).map(move |k| format!("{kind}-{k}")));
    for (name, number) in names.zip(CAREFUL_DRAWING..) {
        let path = folders.project.join(format!("sim/missions/floors/{name}.floor.toml"));
        let site = Site::of_plan(name, &path)?;
        for degree in CAREFUL_DEGREES {
            suite.trials.extend(site.trials(degree, number)?);
        }
    }
    Ok(suite)
}

/// Where a witness locates the goal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// The position, in metres, in frame [`sketchnav_schemas::geometry::World`].
    pub at: [f64; 2],
    /// Whether the position lies in the true region of the goal.
    pub is_right: bool,
}

/// What regions and doors say about the goal at the end of a task.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RoomsSaid {
    /// Whether they have an answer. If not, everything else is 0. They have none if no doors of the drawing lead to the goal, or if
    /// those that do have no partners in the map.
    pub has_answer: bool,
    /// Where the filter, the outline, and regions and doors locate the goal, in this order. `None` for those that do not locate it
    /// yet.
    pub claims: [Option<Claim>; 3],
    /// Distance from the robot to where regions and doors locate the goal, in metres, or `None` if they do not locate it.
    pub away_m: Option<f64>,
    /// Whether regions and doors locate the goal in the robot's region.
    pub is_same_room: bool,
    /// Share of the alignments of regions and doors that locate the goal within 2.5 m of the robot.
    pub share_here: f64,
    /// Additional cost of the best alignment that locates the goal elsewhere.
    pub margin: Option<f64>,
    /// Share of all doors seen or drawn that have a partner.
    pub doors_matched: f64,
}

impl RoomsSaid {
    /// Returns true if regions and doors locate the goal near the robot.
    pub fn agrees(&self) -> bool {
        self.is_same_room || self.away_m.is_some_and(|away_m| away_m <= AGREE_M)
    }
}

/// What regions and doors say about the goal, with the floors to which the answer refers.
#[derive(Debug, Clone)]
pub struct Rooms {
    /// The drawing.
    pub drawing: Floor,
    /// The robot's map.
    pub map: Floor,
    /// Where the goal is, with at least one hypothesis.
    pub answer: Answer,
}

/// The answers of the three witnesses in a task.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The goal in the drawing.
    pub goal: Point<Sketch>,
    /// Position of the robot in its map, in metres.
    pub robot: [f64; 2],
    /// True pose of the map's origin.
    pub origin: Pose<World>,
    /// Where the filter, the outline, and regions and doors locate the goal, in this order. `None` for those that do not locate it
    /// yet.
    pub claims: [Option<Point<World>>; 3],
    /// The answer of regions and doors, if they have one.
    pub rooms: Option<Rooms>,
}

impl Asked {
    /// Compares the answers with the true place of the goal.
    fn said(&self, there: &Place) -> RoomsSaid {
        let claim = |at: Point<World>| Claim { at: [at.x, at.y], is_right: there.contains(at.x, at.y) };
        let claims = self.claims.map(|at| at.map(claim));
        let Some(Rooms { map, answer, .. }) = &self.rooms else {
            return RoomsSaid { claims, ..RoomsSaid::default() };
        };
        let best = &answer.hypotheses[0];
        RoomsSaid {
            has_answer: true,
            claims,
            away_m: best.place.map(|[x, y]| (x - self.robot[0]).hypot(y - self.robot[1])),
            is_same_room: best.place.is_some() && map.room_at(self.robot) == Some(best.room),
            share_here: answer.share_near(self.robot, AGREE_M),
            margin: answer.margin,
            doors_matched: answer.doors.share_matched(),
        }
    }
}

/// Maps the robot's surroundings as the planner does, so that regions and doors can be evaluated at the end.
#[derive(Debug)]
pub struct Witness {
    mount: Pose<Base>,
    parameters: Parameters,
    /// Parameters of the planner.
    planner: paths::parameters::Parameters,
    mapper: Mapper,
    odometry: Option<Odometry>,
    scan: Option<Box<LaserScan>>,
}

impl Witness {
    /// Creates the witness of a run with a single task, or returns `None` if the robot has no laser that is suitable for mapping.
    pub fn new(run: &RunConfig) -> Option<Self> {
        let laser = run.robot.laser().ok()?;
        let parameters = Parameters::for_range(laser.range_max_m);
        Some(Self {
            mount: laser.mount(),
            parameters,
            planner: paths::parameters::Parameters::default(),
            mapper: Mapper::new(parameters).ok()?,
            odometry: None,
            scan: None,
        })
    }

    /// Returns what regions and doors say about task `index`, whose place in the true world is `there`.
    pub fn said(&self, log: &Log, index: usize, there: &Place) -> RoomsSaid {
        self.ask(log, index).map(|asked| asked.said(there)).unwrap_or_default()
    }

    /// Asks all witnesses about task `index`. Returns `None` if there is no drawing, or no goal in it.
    pub fn ask(&self, log: &Log, index: usize) -> Option<Asked> {
        let (message, cells) = log.sketch.as_ref()?;
        let sketch = SketchGrid::of_map(message, cells).ok()?;
        let route = log.route.as_ref()?;
        let goal = route.points(route.tasks().get(index)?).last()?;
        let (robot, truth) = (self.mapper.pose(), log.truth.last()?.pose());
        let origin = truth.compose(&robot.motion_to(&Pose::new(0.0, 0.0, 0.0)));
        let of_map = |[x, y]: [f64; 2]| origin.compose(&Pose::<World>::new(x, y, 0.0)).position();
        let of_filter = || {
            let chart = Chart::new(log.estimates.last()?, message.wall_direction_rad)?;
            let at = chart.to_odom(goal);
            let ahead = chart.robot_m().motion_to(&Pose::new(at.x, at.y, 0.0));
            Some(truth.compose(&ahead).position())
        };
        let mut survey = Survey::with_room(&self.parameters);
        survey.take(self.mapper.map(), [robot.x, robot.y], OFF_FREE_M);
        let start = message.start.pose();
        let outline = locate_by_outline(&sketch, start, goal, &survey, &self.planner);
        let rooms = self.rooms(&sketch, start, goal, &survey);
        let by_rooms = || rooms.as_ref()?.answer.hypotheses.first()?.place;
        let claims = [of_filter(), outline.map(of_map), by_rooms().map(of_map)];
        Some(Asked { goal, robot: [robot.x, robot.y], origin, claims, rooms })
    }

    /// Evaluates the drive by regions and doors.
    fn rooms(
        &self,
        sketch: &SketchGrid,
        start: Pose<Sketch>,
        goal: Point<Sketch>,
        survey: &Survey,
    ) -> Option<Rooms> {
        let drawing = Floor::of_drawing(sketch, start, self.planner.building_size_m)?;
        let map = Floor::of_map(survey, [0.0; 2], start.yaw_rad, &drawing)?;
        let answer = locate(&drawing, &map, [goal.x, goal.y])?;
        (!answer.hypotheses.is_empty()).then_some(Rooms { drawing, map, answer })
    }

    /// Enters the latest scan into the map if the odometry of the same instant is known.
    fn enter(&mut self) {
        let (Some(odometry), Some(scan)) = (&self.odometry, &self.scan) else { return };
        if odometry.header.stamp_ns == scan.header.stamp_ns {
            // An invalid scan causes an error, which can be ignored because the map remains unchanged.
            let _ = self.mapper.update(odometry.pose(), &Scan::of_message(scan, self.mount));
            self.scan = None;
        }
    }
}

impl Tap for Witness {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], _cells: &[u8]) {
        if let Some(odometry) = ODOMETRY.message(spec, message) {
            self.odometry = Some(*odometry);
            self.enter();
        } else if let Some(scan) = SCAN.message(spec, message) {
            self.scan = Some(Box::new(*scan));
            self.enter();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::experiments::outcome::Kind;
    use crate::experiments::trial::Trial;
    use crate::experiments::{deformed, run};

    /// The witness maps the drive itself. It must agree with the arrival of a robot that drives by a traced floor.
    #[test]
    fn rooms_know_the_goal_of_a_floor_that_was_traced() {
        let sites = deformed::shipped(&Folders::of_checkout()).unwrap();
        let trial = Trial { asks_rooms: true, ..sites[1].trials(0.0, 1).unwrap().remove(0) };
        let outcomes = run::run(&trial, "outline", 1, 7).unwrap();
        assert_eq!(outcomes[0].kind, Kind::Reached);
        let said = outcomes[0].rooms.unwrap();
        let knows = said.claims.map(|claim| claim.is_some_and(|claim| claim.is_right));
        assert_eq!(knows, [true; 3], "{said:?}");
        assert!(said.agrees() && said.share_here > 0.5, "{said:?}");
        let unasked = Trial { asks_rooms: false, ..trial };
        assert_eq!(run::run(&unasked, "outline", 1, 7).unwrap()[0].rooms, None);
    }

    #[test]
    fn every_floor_has_drawings_of_its_own() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert_eq!(suite.drawings(), DEGREES.map(|degree| degree.to_string()));
        assert!(suite.trials.iter().all(|trial| trial.asks_rooms));
        let clusters: BTreeSet<_> =
            suite.trials.iter().filter_map(|trial| trial.cluster.as_deref()).collect();
        let part = |k: usize| move |cluster: &&str| cluster.split('/').nth(k).unwrap().to_owned();
        let floors: BTreeSet<_> = clusters.iter().map(part(0)).collect();
        let numbers: BTreeSet<_> = clusters.iter().map(part(2)).collect();
        assert_eq!(floors.len(), KINDS.len() * FLOORS as usize);
        assert_eq!(numbers.len(), floors.len() * DRAWINGS_OF_FLOOR as usize);
    }
}
