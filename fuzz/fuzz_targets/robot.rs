//! Parses arbitrary text as a robot file. If it is valid, the robot moves and measures for two instants.
#![no_main]

use std::convert::Infallible;

use libfuzzer_sys::fuzz_target;
use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_sim::{Floor, Senses, Simulation, floor_plan};

const ROOM: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[40,0],[40,40],[0,40]]\n";

struct Valid;

impl Senses for Valid {
    type Error = Infallible;

    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), Infallible> {
        let mut message = T::zeroed();
        fill(&mut message);
        message.header_mut().seq = 1;
        message.header_mut().stamp_ns = stamp_ns;
        assert!(message.is_valid(), "{}", channel.spec.name);
        Ok(())
    }
}

fuzz_target!(|text: &str| {
    let Ok(robot) = Robot::parse(text) else { return };
    // The sensors that only exist above a plane of dots are removed.
    let robot = Robot { view: None, motion_noise: None, ..robot };
    let room = floor_plan::parse(ROOM).expect("a room");
    let mut floor = Floor::new(room, &robot, Pose::new(20.0, 20.0, 0.0), 1).expect("room for every robot");
    for _ in 0..2 {
        let Ok(()) = floor.sense(&mut Valid);
        floor.step(None);
    }
});
