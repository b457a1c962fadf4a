//! Drives guided by the outline of what was seen.

use sketchnav_schemas::codes::TaskState::{Finished, Lost, Reached};
use sketchnav_schemas::codes::Tracking;
use sketchnav_stage::Stage;

use crate::support::*;

/// Returns the walls of a U, which is a hall with two arms upwards, of 10.5 × 8.5 m.
fn arms() -> Vec<Line> {
    let corners =
        [[0.5, 0.5], [10.5, 0.5], [10.5, 8.0], [8.0, 8.0], [8.0, 3.0], [3.0, 3.0], [3.0, 8.5], [0.5, 8.5]];
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| [a[0], a[1], b[0], b[1]]).collect()
}

/// Draws the U as a person might, with a hall that is twice as high as it should be in proportion to the arms.
pub fn bent(x: f64, y: f64) -> ([f64; 2], [f64; 2]) {
    let (x, a) = if x < 5.5 { (30.0 * x, 30.0) } else { (165.0 + 26.0 * (x - 5.5), 26.0) };
    let (y, b) = if y < 3.0 { (45.0 * y, 45.0) } else { (135.0 + 22.0 * (y - 3.0), 22.0) };
    ([20.0 + x, 20.0 + y], [a, b])
}

pub fn scene() -> Scene {
    Scene { warp: bent, ..Scene::faithful(arms(), [11.0, 9.0], [1.7, 7.5, -1.57]) }
}

fn drive() -> Drive {
    let by_outline = config(ROBOTINO, "by_outline = true");
    Drive::with(scene(), by_outline, &[&[[9.2, 7.0]], &[[1.8, 6.5]]], 240.0)
}

/// The estimate does not help, because the goal lies behind walls that the explorer has to look around.
#[test]
fn it_finds_the_arms_of_a_bent_drawing() {
    let outcome = drive().run(400.0);
    assert_eq!(outcome.states(), [Reached, Reached, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[0].1.starts_with("the walls seen put the goal here"), "{:?}", outcome.ends);
    assert!(outcome.closest_m > 0.0);
    let nearest_m = |x: f64, y: f64| {
        outcome.way.iter().map(|at| (at[0] - x).hypot(at[1] - y)).fold(f64::INFINITY, f64::min)
    };
    assert!(nearest_m(9.2, 7.0) < 1.2, "{}", nearest_m(9.2, 7.0));
}

/// Returns the walls of three rooms in a row, 4 × 4 m each, joined by doors of 0.9 m.
pub fn rooms() -> Vec<Line> {
    let mut walls =
        vec![[0.5, 0.5, 12.5, 0.5], [12.5, 0.5, 12.5, 4.5], [12.5, 4.5, 0.5, 4.5], [0.5, 4.5, 0.5, 0.5]];
    for x in [4.5, 8.5] {
        walls.extend([[x, 0.5, x, 2.0], [x, 2.9, x, 4.5]]);
    }
    walls
}

/// The method used to be chosen beforehand from the drawing, and the choice was wrong for drawings that people had made of an open
/// floor. Now the robot always starts by the outline, and decides from what it sees.
#[test]
fn a_robot_that_has_seen_rooms_drives_by_the_filter() {
    let scene = Scene::faithful(rooms(), [13.0, 5.0], [1.5, 2.4, 0.0]);
    let by_outline = config(ROBOTINO, "by_outline = true");
    let outcome = Drive::with(scene, by_outline, &[&[[11.0, 2.0]]], 240.0).run(300.0);
    assert_eq!(outcome.states(), [Reached, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[0].1.ends_with("m from the goal"), "{:?}", outcome.ends);
}

/// A robot among rooms used to end a task as soon as the filter had failed, even if the map of its drive showed the goal.
#[test]
fn the_outline_takes_over_when_the_filter_has_lost_its_way_among_rooms() {
    let scene = Scene::faithful(rooms(), [13.0, 5.0], [1.5, 2.4, 0.0]);
    let by_outline = config(ROBOTINO, "by_outline = true");
    let mut drive = Drive::with(scene, by_outline, &[&[[11.0, 2.0]]], 240.0);
    drive.tracking = Tracking::Lost;
    let outcome = drive.run(300.0);
    assert_eq!(outcome.states(), [Reached, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[0].1.starts_with("the walls seen put the goal here"), "{:?}", outcome.ends);
}

/// Nobody has marked the start, and the filter never finds the robot.
fn unmarked_drive() -> Drive {
    let scene = Scene::faithful(rooms(), [13.0, 5.0], [1.5, 2.4, 0.0]);
    let by_outline = config(ROBOTINO, "by_outline = true");
    let mut drive = Drive::with(Scene { is_marked: false, ..scene }, by_outline, &[&[[11.0, 2.0]]], 240.0);
    (drive.tracking, drive.is_placed) = (Tracking::Lost, false);
    drive
}

/// The goal is in the third room. The robot used to follow the outline's guess, and went back and forth between two rooms.
#[test]
fn an_unmarked_robot_among_rooms_looks_into_all_of_them_before_it_goes_by_the_outline() {
    let outcome = unmarked_drive().run(300.0);
    let farthest_m = outcome.way.iter().map(|at| at[0]).fold(0.0, f64::max);
    assert!(farthest_m > 7.5, "{farthest_m}, {:?}", outcome.ends);
}

/// The estimate of a robot that nobody has placed means nothing, even if the localizer only doubts it.
#[test]
fn an_unmarked_robot_whose_drawing_looks_the_same_after_half_a_turn_is_lost() {
    let mut drive = unmarked_drive();
    drive.tracking = Tracking::Doubtful;
    let outcome = drive.run(300.0);
    assert_eq!(outcome.states(), [Lost, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[0].1.contains("where the drawing looks alike"), "{:?}", outcome.ends);
}

#[test]
fn an_unmarked_robot_that_the_filter_finds_on_the_way_drives_by_the_filter() {
    let mut drive = unmarked_drive();
    let is_in_next_room = (0..3000).any(|_| {
        drive.step();
        drive.place()[0] > 4.0
    });
    assert!(is_in_next_room, "{:?}", drive.place());
    (drive.tracking, drive.is_placed) = (Tracking::Tracking, true);
    let outcome = drive.run(300.0);
    assert_eq!(outcome.states(), [Reached, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[0].1.ends_with("m from the goal"), "{:?}", outcome.ends);
}

/// Among rooms, the robot drives by the filter, which checks arrivals by looking around. Such a look used to be mistaken for one of
/// the explorer's looks. Since the explorer had not mapped anything, the planner crashed.
#[test]
fn a_look_of_the_filters_is_none_of_the_explorers() {
    let planner = "by_outline = true\nleast_open_share = 2.0\nlook_above = 0.1";
    let mut drive = Drive::with(scene(), config(ROBOTINO, planner), &[&[[9.2, 7.0]]], 240.0);
    drive.fit = -1.0;
    let outcome = drive.run(300.0);
    assert_eq!(outcome.states(), [Reached, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[0].1.ends_with("m from the goal"), "{:?}", outcome.ends);
}

/// A planner that is stored and restored repeatedly sends the same commands.
#[test]
fn what_a_checkpoint_holds_is_all_that_there_is() {
    let (mut whole, mut broken) = (drive(), drive());
    for step in 0..900 {
        let commands = [&mut whole, &mut broken].map(|drive| {
            drive.sense();
            let command = drive.think();
            drive.act(command.twist);
            command
        });
        assert_eq!(bytemuck::bytes_of(&commands[0]), bytemuck::bytes_of(&commands[1]), "step {step}");
        if step % 37 == 5 {
            let stored = postcard::to_stdvec(&broken.planner.state()).unwrap();
            broken.planner = drive().planner;
            broken.planner.restore(postcard::from_bytes(&stored).unwrap()).unwrap();
        }
    }
}

const CARRIED: &str = "somebody has carried it elsewhere: everything it sees has changed";

/// The robot is carried from one arm of the U to the other, where it begins a new map. The mark of the start no longer counts.
#[test]
fn a_robot_that_is_carried_on_an_open_floor_goes_on_by_a_new_map() {
    let by_outline = config(ROBOTINO, "by_outline = true");
    let mut drive = Drive::with(scene(), by_outline, &[&[[9.2, 7.0]]], 400.0);
    let started = drive.place();
    let is_far = |drive: &Drive| (drive.place()[1] - started[1]).abs() > 2.0;
    while !is_far(&drive) {
        drive.step();
    }
    drive.carry(6.0, 1.8, 2.0);
    drive.until("noticing it", |status| status.reason.as_str() == CARRIED);
    let outcome = drive.run(400.0);
    assert_eq!(outcome.states(), [Reached, Finished], "{:?}", outcome.ends);
    let [x, y] = *outcome.way.last().unwrap();
    assert!((x - 9.2).hypot(y - 7.0) < 1.2, "({x}, {y})");
}

/// Drawn routes begin elsewhere, also the one after it, because the robot has not been found by then.
#[test]
fn a_robot_that_is_carried_off_its_route_is_lost() {
    let by_outline = config(ROBOTINO, "by_outline = true");
    let route: &[[f64; 2]] = &[[1.7, 7.0], [1.7, 4.0], [5.0, 1.7], [9.2, 1.7]];
    let mut drive = Drive::with(scene(), by_outline, &[route, route], 400.0);
    drive.until("on its way", |status| status.header.stamp_ns > 4_000_000_000);
    drive.carry(9.2, 7.0, 0.5);
    (drive.tracking, drive.is_placed) = (Tracking::Lost, false);
    let outcome = drive.run(60.0);
    assert_eq!(outcome.states(), [Lost, Lost, Finished], "{:?}", outcome.ends);
    assert!(outcome.ends[..2].iter().all(|(_, reason)| reason == CARRIED), "{:?}", outcome.ends);
}
