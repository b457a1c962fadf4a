//! Tests of orders to go to a place that is written on the drawing and is no task's goal.

use sketchnav_schemas::codes::{Order, TaskState};
use sketchnav_schemas::message::MissionStatus;
use sketchnav_stage::Stage;

use crate::support::*;

const KITCHEN: [f64; 2] = [7.0, 1.5];

/// Returns a drive through a hall of 8 m by 3 m, with two tasks on the left. The kitchen is at the right end.
fn hall() -> Drive {
    let walls = vec![[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 3.0], [8.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]];
    let scene = Scene::faithful(walls, [8.0, 3.0], [1.0, 1.5, 0.0]);
    Drive::new(scene, ROBOTINO, &[&[[3.0, 1.5]], &[[1.0, 1.5]]], 100.0)
}

fn to_kitchen(drive: &mut Drive) {
    drive.send_to("kitchen", stretched(KITCHEN[0], KITCHEN[1]).0);
}

fn is_in_kitchen(drive: &Drive) -> bool {
    let [x, y] = drive.place();
    (x - KITCHEN[0]).hypot(y - KITCHEN[1]) < 0.5
}

fn has_ended(status: &MissionStatus) -> bool {
    status.state >= TaskState::Reached.code()
}

/// `sketchnav send goal kitchen` used to be refused unless a task of the mission led there.
#[test]
fn a_place_that_is_no_tasks_goal_ends_the_mission() {
    let mut drive = hall();
    drive.until("on the way", |status| status.state == TaskState::Driving.code());
    to_kitchen(&mut drive);
    let status = drive.until("to the kitchen", |status| status.name.as_str() == "kitchen");
    assert_eq!((status.task, status.task_count, status.state), (2, 3, TaskState::Driving.code()));
    let status = drive.until("there", has_ended);
    assert_eq!((status.state, is_in_kitchen(&drive)), (TaskState::Reached.code(), true));
    let status = drive.until("the end", |status| status.state == TaskState::Finished.code());
    assert_eq!((status.reached_count, is_in_kitchen(&drive)), (1, true));
}

#[test]
fn a_task_that_is_ordered_later_takes_the_place_of_the_place() {
    let mut drive = hall();
    to_kitchen(&mut drive);
    drive.until("to the kitchen", |status| status.name.as_str() == "kitchen");
    drive.order(Order::Goal);
    let status = drive.until("the first task", |status| status.task == 0);
    assert_eq!(status.task_count, 2);
    let status = drive.until("the end", |status| status.state == TaskState::Finished.code());
    assert_eq!((status.reached_count, is_in_kitchen(&drive)), (2, false));
}

#[test]
fn a_place_outside_the_drawing_changes_nothing() {
    let mut drive = hall();
    drive.until("on the way", |status| status.state == TaskState::Driving.code());
    drive.send_to("moon", [-1.0, 5.0]);
    drive.send_to("sun", [f64::NAN, 5.0]);
    assert_eq!((drive.step().task, drive.step().task_count), (0, 2));
}

/// A planner that was killed right after the order, or on the way, goes on to the same place.
#[test]
fn a_restarted_planner_still_goes_to_the_place() {
    for steps in [0, 20] {
        let (mut whole, mut broken) = (hall(), hall());
        for drive in [&mut whole, &mut broken] {
            drive.until("on the way", |status| status.state == TaskState::Driving.code());
            to_kitchen(drive);
            for _ in 0..steps {
                drive.step();
            }
        }
        let stored = postcard::to_stdvec(&broken.planner.state()).unwrap();
        broken.planner = hall().planner;
        broken.planner.restore(postcard::from_bytes(&stored).unwrap()).unwrap();
        for _ in 0..50 {
            let (a, b) = (whole.step(), broken.step());
            assert_eq!((a.name.as_str(), bytemuck::bytes_of(&a)), ("kitchen", bytemuck::bytes_of(&b)));
        }
    }
}
