//! Tests that a step never allocates.

use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};
use sketchnav_schemas::channels::{self, STATUS};
use sketchnav_schemas::codes::Process;
use sketchnav_sketch::planner::ROOMS;
use sketchnav_stage::{Put, Sink};

use crate::exploring;
use crate::support::*;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Makes the host reserve memory for the latest and the next message of each channel before the first step.
fn make_room(drive: &mut Drive) {
    for spec in channels::written_by(Process::Planner, "sketch") {
        for _ in 0..2 {
            let put = Put { spec, cells: 0, is_repeated: true, fill: &mut |_, _| Ok(()) };
            drive.sent.put(put).unwrap();
        }
    }
}

/// A goal behind a shut door leads to plans, being stuck, recovery, blockages, the next task and the end of the run.
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
    make_room(&mut drive);
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

/// Among rooms, the map keeps growing, the floor is judged repeatedly, and the next task begins.
#[test]
fn a_step_among_rooms_allocates_nothing_either() {
    let scene = Scene::faithful(exploring::rooms(), [13.0, 5.0], [1.5, 2.4, 0.0]);
    let by_outline = config(ROBOTINO, "by_outline = true");
    let mut drive = Drive::with(scene, by_outline, &[&[[11.0, 2.0]], &[[1.5, 2.4]]], 240.0);
    make_room(&mut drive);
    let (mut among, mut is_last) = (0, false);
    while !is_last {
        drive.sense();
        let before = allocations_of_this_thread();
        let command = drive.think();
        let allocations = allocations_of_this_thread() - before;
        if among > 0 {
            assert_eq!(allocations, 0, "step {among} among rooms");
        }
        let is_among = drive.said(STATUS).unwrap().reason.as_str() == ROOMS;
        among += usize::from(among > 0 || is_among);
        is_last = command.last == 1;
        drive.act(command.twist);
        assert!(among < 4000);
    }
    assert!(among > 200, "{among}");
}
