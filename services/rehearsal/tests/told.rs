//! Somebody who looks on says where the robot is: that counts from the next instant on.

use std::path::Path;

use sketchnav_rehearsal::{Rehearsal, Tap};
use sketchnav_schemas::channels::{ChannelSpec, ESTIMATE, MISSION};
use sketchnav_schemas::codes::Order;
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::message::{Here, MissionCommand, PoseEstimate};
use sketchnav_schemas::run::{Pad, RunConfig};

/// Instants before somebody says something.
const BEFORE: usize = 30;
/// How far from the estimate the place is that is said, pixels.
const OFF_PX: f64 = 40.0;

#[derive(Default)]
struct Onlooker {
    speaks: bool,
    estimates: Vec<PoseEstimate>,
    orders: Vec<MissionCommand>,
}

impl Onlooker {
    /// A place ahead of where the robot believes to be.
    fn ahead(&self) -> Here {
        let robot = self.estimates[BEFORE - 1].pose.pose();
        let (sin, cos) = robot.yaw_rad.sin_cos();
        Here { at: Point::new(robot.x + OFF_PX * cos, robot.y + OFF_PX * sin), yaw_rad: None }
    }
}

impl Tap for Onlooker {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], _cells: &[u8]) {
        self.estimates.extend(ESTIMATE.message(spec, message));
        self.orders.extend(MISSION.message(spec, message));
    }

    fn has_enough(&self) -> bool {
        self.estimates.len() > BEFORE
    }

    fn here(&mut self) -> Option<Here> {
        (self.speaks && self.estimates.len() == BEFORE).then(|| self.ahead())
    }
}

fn driven(speaks: bool) -> Onlooker {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/laboratory/laboratory-a.toml");
    let (mission, robot) = sketchnav_sim::mission_file::load(&path).unwrap();
    let run = RunConfig { pad: Pad::Watches, ..RunConfig::lockstep("rehearsal", mission, robot, 1) };
    let mut onlooker = Onlooker { speaks, ..Onlooker::default() };
    Rehearsal::new(&run).unwrap().run(&mut onlooker).unwrap();
    onlooker
}

#[test]
fn the_localizer_begins_anew_where_somebody_said() {
    let [silent, told] = [false, true].map(driven);
    let orders = |drive: &Onlooker| -> Vec<_> {
        drive.orders.iter().map(|order| Order::from_code(order.order).unwrap()).collect()
    };
    assert_eq!((orders(&silent), orders(&told)), (vec![Order::Start], vec![Order::Start, Order::Here]));
    assert_eq!(told.orders[1].here(), Some(told.ahead()));
    assert_eq!(told.orders[1].header.stamp_ns, told.estimates[BEFORE - 1].header.stamp_ns);
    assert_eq!(silent.estimates[..BEFORE], told.estimates[..BEFORE]);
    assert_ne!(silent.estimates[BEFORE], told.estimates[BEFORE]);
}
