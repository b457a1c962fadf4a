//! The `witnesses` suite asks two witnesses where the goal is when the robot ends a task: the robot itself, which drives by the
//! outline or by the filter, and the [regions joined by doors](sketchnav_sketch::rooms). Its tables show how often each is
//! right, and whether their disagreement knows which arrivals are wrong.
//!
//! The drawings are the lesson drawings of `people` and drawings made by `sketchnav deform` whose numbers no other suite
//! uses, the latter also driven by the outline alone, which gives more wrong arrivals. Every other drawing fits the
//! combination of the witnesses, and the rest check it.

mod tables;

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sketchnav_mapping::{Mapper, Parameters, Scan, Survey};
use sketchnav_rehearsal::Tap;
use sketchnav_schemas::channels::{ChannelSpec, ODOMETRY, SCAN};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::{Base, Pose};
use sketchnav_schemas::message::{LaserScan, Odometry};
use sketchnav_schemas::mission::Place;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::paths;
use sketchnav_sketch::planner::certainty::{AGREE_M, Said};
use sketchnav_sketch::rooms::{Floor, locate};
use sketchnav_sketch::sketch::SketchGrid;

use crate::error::EvalError;
use crate::experiments::deformed::{self, DRAWINGS};
use crate::experiments::people;
use crate::experiments::sensitivity::variant;
use crate::experiments::suite::{Folders, Suite};
use crate::experiments::trial::Trial;
use crate::judge::log::Log;

const TITLE: &str = "What regions joined by doors say about the goal at the end of each drive, beside the robot's own decision: lesson drawings, and drawings by sketchnav deform that no other suite uses.";
/// Degrees of deformation.
const DEGREES: [f64; 2] = [1.0, 1.5];
/// Numbers of the drawings of each floor at each degree. Those up to 11 are used by `deformed` and by `calibrate-boniardi-2015`.
const NUMBERS: std::ops::RangeInclusive<u64> = DRAWINGS + 5..=DRAWINGS + 12;
/// Maximum distance of the robot from the free part of its map, in metres.
const OFF_FREE_M: f64 = 0.6;

/// Loads the suite.
///
/// # Errors
/// [`EvalError`] if a file is malformed. Drawings and floors whose data are missing are left out with a notice.
pub fn suite(folders: &Folders) -> Result<Suite, EvalError> {
    let mut suite = Suite {
        title: TITLE.into(),
        repetitions: 1,
        lines: Some("drawings"),
        sections: Some(tables::sections),
        ..Suite::default()
    };
    let sites = deformed::sites(folders, &mut suite.notices)?;
    for degree in DEGREES {
        for site in &sites {
            for number in NUMBERS {
                suite.trials.extend(
                    site.trials(degree, number)?
                        .into_iter()
                        .map(|trial| Trial { drawing: format!("degree {degree}"), ..trial }),
                );
            }
        }
    }
    let by_outline: Vec<_> = suite.trials.iter().map(by_outline).collect();
    suite.trials.extend(by_outline);
    match people::suite(folders) {
        Ok(people) => {
            suite
                .trials
                .extend(people.trials.into_iter().map(|trial| Trial { drawing: "people".into(), ..trial }));
        }
        Err(EvalError::NoData { .. }) => suite.notices.push("skipped: the lesson drawings of people".into()),
        Err(error) => return Err(error),
    }
    suite.trials.iter_mut().for_each(|trial| trial.asks_rooms = true);
    Ok(suite)
}

/// Returns a variant of the trial that is driven by the outline even among rooms.
fn by_outline(trial: &Trial) -> Trial {
    let mut by_outline = variant(trial, &format!("{}, by the outline", trial.drawing));
    let table = by_outline.mission.parameters.of_mut(Process::Planner);
    table.insert("least_open_share".to_owned(), 0.0.into());
    Trial { name: format!("outline/{}", trial.name), ..by_outline }
}

/// What regions and doors say at the end of a task.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RoomsSaid {
    /// False if they have no answer, in which case everything else is 0. They have none if no doors of the drawing lead to the goal,
    /// or if those that do have no partners.
    pub has_answer: bool,
    /// True if the goal truly is where they have it.
    pub is_right: bool,
    /// Distance from the robot to where they have the goal, in metres, or `None` if they have it nowhere.
    pub away_m: Option<f64>,
    /// True if they have the goal in the region in which the robot is.
    pub is_same_room: bool,
    /// Share of their alignments that have the goal within 2.5 m of the robot.
    pub share_here: f64,
    /// Amount by which the best alignment that has the goal elsewhere costs more.
    pub margin: Option<f64>,
    /// Share of all doors seen or drawn that have a partner.
    pub doors_matched: f64,
}

impl RoomsSaid {
    /// Returns true if the goal is about where the robot is.
    pub fn agrees(&self) -> bool {
        self.is_same_room || self.away_m.is_some_and(|away_m| away_m <= AGREE_M)
    }

    /// Returns what they say in the form in which the planner uses it, or `None` if they have no answer.
    pub fn said(&self) -> Option<Said> {
        self.has_answer.then(|| Said {
            agrees: self.agrees(),
            margin: self.margin.unwrap_or_default(),
            share_here: self.share_here,
            doors_matched: self.doors_matched,
        })
    }
}

/// Maps what a robot sees, as the planner does, and asks regions and doors about it in the end.
#[derive(Debug)]
pub struct Witness {
    mount: Pose<Base>,
    parameters: Parameters,
    building_size_m: f64,
    mapper: Mapper,
    odometry: Option<Odometry>,
    scan: Option<Box<LaserScan>>,
}

impl Witness {
    /// Creates the witness of a run with a single task. Returns `None` if its robot has no laser that is suitable for mapping.
    pub fn new(run: &RunConfig) -> Option<Self> {
        let laser = run.robot.laser().ok()?;
        let parameters = Parameters::for_range(laser.range_max_m);
        Some(Self {
            mount: laser.mount(),
            parameters,
            building_size_m: paths::parameters::Parameters::default().building_size_m,
            mapper: Mapper::new(parameters).ok()?,
            odometry: None,
            scan: None,
        })
    }

    /// Returns what regions and doors say about the task `index`, whose place in the true world is `there`.
    pub fn said(&self, log: &Log, index: usize, there: &Place) -> RoomsSaid {
        self.answer(log, index, there).unwrap_or_default()
    }

    fn answer(&self, log: &Log, index: usize, there: &Place) -> Option<RoomsSaid> {
        let (message, cells) = log.sketch.as_ref()?;
        let sketch = SketchGrid::of_map(message, cells).ok()?;
        let route = log.route.as_ref()?;
        let goal = route.points(route.tasks().get(index)?).last()?;
        let start = message.start.pose();
        let (robot, truth) = (self.mapper.pose(), log.truth.last()?.pose());
        let mut survey = Survey::with_room(&self.parameters);
        survey.take(self.mapper.map(), [robot.x, robot.y], OFF_FREE_M);
        let drawing = Arc::new(Floor::of_drawing(&sketch, start, self.building_size_m)?);
        let map = Arc::new(Floor::of_map(&survey, [0.0; 2], start.yaw_rad, &drawing)?);
        let answer = locate(&drawing, &map, [goal.x, goal.y])?;
        let best = answer.hypotheses.first()?;
        let in_world = |[x, y]: [f64; 2]| truth.compose(&robot.motion_to(&Pose::new(x, y, 0.0)));
        let is_right = best.place.map(in_world).is_some_and(|at| there.contains(at.x, at.y));
        Some(RoomsSaid {
            has_answer: true,
            is_right,
            away_m: best.place.map(|[x, y]| (x - robot.x).hypot(y - robot.y)),
            is_same_room: best.place.is_some() && map.room_at([robot.x, robot.y]) == Some(best.room),
            share_here: answer.share_near([robot.x, robot.y], AGREE_M),
            margin: answer.margin,
            doors_matched: answer.doors.share_matched(),
        })
    }

    /// Enters the newest scan if the odometry of the same instant is known.
    fn enter(&mut self) {
        let (Some(odometry), Some(scan)) = (&self.odometry, &self.scan) else { return };
        if odometry.header.stamp_ns == scan.header.stamp_ns {
            // An invalid scan returns an error, which can be ignored because nothing changes then.
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
    use super::*;
    use crate::experiments::outcome::Kind;
    use crate::experiments::run;

    /// The witness maps the drive itself, and must agree with a robot that has arrived where a traced floor says.
    #[test]
    fn rooms_know_the_goal_of_a_floor_that_was_traced() {
        let sites = deformed::shipped(&Folders::of_checkout()).unwrap();
        let trial = Trial { asks_rooms: true, ..sites[1].trials(0.0, 1).unwrap().remove(0) };
        let outcomes = run::run(&trial, "outline", 1, 7).unwrap();
        assert_eq!(outcomes[0].kind, Kind::Reached);
        let said = outcomes[0].rooms.unwrap();
        assert!(said.is_right && said.agrees() && said.share_here > 0.5, "{said:?}");
        let unasked = Trial { asks_rooms: false, ..trial };
        assert_eq!(run::run(&unasked, "outline", 1, 7).unwrap()[0].rooms, None);
    }

    /// By a drawing with bent proportions, the filter arrives in the room beside the goal's. Regions and doors disagree, and the robot
    /// looks where they have the goal.
    #[test]
    fn rooms_mend_a_wrong_arrival_in_a_deformed_drawing() {
        let sites = deformed::shipped(&Folders::of_checkout()).unwrap();
        let trials = sites.iter().flat_map(|site| site.trials(1.0, 19).unwrap());
        let trial = trials.into_iter().find(|trial| trial.name == "laboratory/1/19/1").unwrap();
        let asks = |asks: bool| {
            let mut trial = variant(&trial, "asked");
            trial.mission.parameters.of_mut(Process::Planner).insert("asks_rooms".to_owned(), asks.into());
            run::run(&trial, "outline", 1, 766_341_398).unwrap().remove(0)
        };
        let (alone, mended) = (asks(false), asks(true));
        assert_eq!((alone.kind, mended.kind), (Kind::WrongArrival, Kind::Reached), "{mended:?}");
        assert!(mended.reason.starts_with("rooms and doors put the goal here"), "{}", mended.reason);
    }

    #[test]
    fn drawings_are_not_those_of_other_suites_and_fit_or_check() {
        let suite = suite(&Folders::of_checkout()).unwrap();
        assert_eq!(
            suite.drawings(),
            ["1", "1.5", "1, by the outline", "1.5, by the outline"].map(|d| format!("degree {d}"))
        );
        let other = deformed::suite(&Folders::of_checkout()).unwrap();
        let of = |suite: &Suite| {
            suite
                .trials
                .iter()
                .filter_map(|trial| trial.cluster.clone())
                .collect::<std::collections::BTreeSet<_>>()
        };
        assert!(of(&suite).is_disjoint(&of(&other)));
        assert!(suite.trials.iter().all(|trial| trial.asks_rooms));
    }
}
