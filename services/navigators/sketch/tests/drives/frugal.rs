//! A step allocates nothing, whatever happens in it.

use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};
use sketchnav_schemas::channels;
use sketchnav_schemas::codes::Process;
use sketchnav_stage::{Put, Sink};

use crate::support::*;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// A goal behind a shut door: plans, being stuck, recovery, blockages, the next task, the end.
#[test]
fn a_step_allocates_nothing() {
    let walls = vec![
        [0.0, 0.0, 8.0, 0.0],
        [8.0, 0.0, 8.0, 4.0],
        [8.0, 4.0, 0.0, 4.0],
        [0.0, 4.0, 0.0, 0.0],
        [4.0, 0.0, 4.0, 1.5],
        [4.0, 2.5, 4.0, 4.0],
    ];
    let mut scene = Scene::faithful(walls, [8.0, 4.0], [1.0, 1.0, 0.0]);
    scene.walls.push([4.0, 1.0, 4.0, 3.0]);
    let line = [[2.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
    let mut drive = Drive::new(scene, ROBOTINO, &[&[[6.0, 2.0]], &line, &[[1.0, 1.0]]], 180.0);
    // The host has room for outgoing messages before the first step.
    for spec in channels::written_by(Process::Planner, "sketch") {
        let put = Put { spec, cells: 0, is_repeated: true, fill: &mut |_, _| {} };
        drive.sent.put(put).unwrap();
    }
    let mut steps = 0;
    loop {
        drive.sense();
        let before = allocations_of_this_thread();
        let command = drive.think();
        assert_eq!(allocations_of_this_thread() - before, 0, "step {steps}");
        if command.last == 1 {
            break;
        }
        drive.act(command.twist);
        steps += 1;
        assert!(steps < 4000);
    }
    assert!(steps > 200);
}
