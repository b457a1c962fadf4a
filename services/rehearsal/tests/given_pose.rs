//! An onlooker gives the pose of the robot, which reaches the localizer and the planner before the next instant.

use std::path::Path;

use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::{ChannelSpec, MISSION, STATUS};
use sketchnav_schemas::codes::{Order, Process, TaskState};
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::message::{Here, MissionCommand, MissionStatus};
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_sketch::messages::{ESTIMATE, PoseEstimate};

/// Maximum number of instants that a drive may take.
const MOST: usize = 200;

/// Gives the pose of the robot once, as soon as `is_time` is true.
struct Witness {
    is_time: fn(&Self) -> bool,
    at: fn(&Self) -> Point<Sketch>,
    estimates: Vec<PoseEstimate>,
    status: Vec<MissionStatus>,
    orders: Vec<MissionCommand>,
    /// Number of instants before the pose was given, or `None` if it has not been given yet.
    given_after: Option<usize>,
}

impl Witness {
    fn new(is_time: fn(&Self) -> bool, at: fn(&Self) -> Point<Sketch>) -> Self {
        let (estimates, status, orders) = Default::default();
        Self { is_time, at, estimates, status, orders, given_after: None }
    }

    fn believed(&self, instant: usize) -> Point<Sketch> {
        self.estimates[instant].pose.pose().position()
    }

    fn state(&self, instant: usize) -> TaskState {
        TaskState::from_code(self.status[instant].state).unwrap()
    }

    fn drives(mut self, parameters: &[(&str, f64)]) -> Self {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/laboratory/laboratory-a.toml");
        let (mut mission, robot) = sketchnav_sim::mission_file::load(&path).unwrap();
        // With `outline`, a robot that is lost among rooms continues by the outline.
        mission.navigator.given.insert("method".into(), "beam".into());
        for (key, value) in parameters {
            mission.parameters.of_mut(Process::Planner).insert((*key).into(), (*value).into());
        }
        let run = RunConfig { pad: Pad::Watches, ..RunConfig::lockstep("rehearsal", mission, robot, 1) };
        Rehearsal::new(&run).unwrap().run(&mut self).unwrap();
        self
    }
}

impl Tap for Witness {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], _cells: &[u8]) {
        self.estimates.extend(ESTIMATE.message(spec, message));
        self.status.extend(STATUS.message(spec, message));
        self.orders.extend(MISSION.message(spec, message));
    }
}

impl Onlooker for Witness {
    fn has_enough(&self) -> bool {
        self.estimates.len() == MOST
            || self.given_after.is_some_and(|given_after| self.estimates.len() > given_after)
    }

    fn here(&mut self) -> Option<Here> {
        if self.given_after.is_some() || !(self.is_time)(self) {
            return None;
        }
        self.given_after = Some(self.estimates.len());
        Some(Here { at: (self.at)(self), yaw_rad: None })
    }
}

#[test]
fn the_localizer_continues_from_a_given_pose() {
    // At the second goal.
    let far = |_: &Witness| Point::new(1103.0, 293.0);
    let witness = Witness::new(|it| it.estimates.len() == 30, far).drives(&[]);
    let orders: Vec<_> = witness.orders.iter().map(|order| Order::from_code(order.order).unwrap()).collect();
    assert_eq!(orders, [Order::Start, Order::Here]);
    assert_eq!(witness.orders[1].header.stamp_ns, witness.estimates[29].header.stamp_ns);
    let [before, after] = [29, 30].map(|instant| witness.believed(instant).distance(&far(&witness)));
    assert!(before > 300.0 && after < 100.0, "{before} px, then {after}");
}

#[test]
fn a_lost_robot_continues_once_its_pose_is_given() {
    let is_lost = |it: &Witness| it.status.last().is_some_and(|s| s.state == TaskState::Paused.code());
    let where_it_believes = |it: &Witness| it.believed(it.estimates.len() - 1);
    // These parameters make the robot so impatient that it considers itself lost after a few instants.
    let witness =
        Witness::new(is_lost, where_it_believes).drives(&[("astray_factor", 0.1), ("astray_m", 0.1)]);
    let given_after = witness.given_after.unwrap();
    assert_eq!(
        [given_after - 1, given_after].map(|instant| witness.state(instant)),
        [TaskState::Paused, TaskState::Driving]
    );
}
