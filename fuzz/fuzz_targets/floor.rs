//! Parses arbitrary text as a floor plan. If it is valid and has enough space for a robot, the robot moves for two instants.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sketchnav_schemas::geometry::Pose;
use sketchnav_sim::{Floor, Simulation, floor_plan, robots};

fuzz_target!(|text: &str| {
    let Ok(world) = floor_plan::parse(text) else { return };
    let count = world.outline.len().max(1) as f64;
    let middle = |axis: usize| world.outline.iter().map(|[a, _]| a[axis]).sum::<f64>() / count;
    let start = Pose::new(middle(0), middle(1), 0.0);
    let robot = robots::find("turtlebot3").expect("a valid robot").expect("a robot that ships");
    let Ok(mut floor) = Floor::new(world, &robot, start, 1) else { return };
    for _ in 0..2 {
        floor.step(None);
    }
    let pose = floor.robot_pose();
    assert!(pose.x.is_finite() && pose.y.is_finite() && pose.yaw_rad.is_finite());
});
