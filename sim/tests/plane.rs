//! Tests the plane of dots as a whole, as far as navigators rely on it.

mod support;

use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_schemas::message::Message;
use sketchnav_schemas::robot::{MotionNoise, Robot};
use sketchnav_sim::plane_file::{PlaneDescription, PlaneFile};
use sketchnav_sim::{DotPlane, Floor, Simulation, floor_plan, robots};
use support::{Readings, command};

fn helicopter() -> Robot {
    robots::find("helicopter").unwrap().unwrap()
}

fn hundred() -> PlaneDescription {
    PlaneFile::parse("random = { dots = 100, side_m = 1.0, seed = 4 }").unwrap().describe(&[]).unwrap()
}

fn plane(robot: &Robot, seed: u64) -> DotPlane {
    DotPlane::new(hundred(), robot, Pose::<WorldFrame>::new(0.5, 0.5, 0.0), seed).unwrap()
}

fn fly(plane: &mut DotPlane, steps: usize, vx: f64, vy: f64) -> Vec<u8> {
    let mut readings = Readings::with_bytes();
    for _ in 0..steps {
        let command = command(plane, vx, vy, 0.0);
        plane.step(Some(&command));
        readings.take(plane);
    }
    readings.bytes.unwrap()
}

#[test]
fn a_plane_has_views_and_the_truth_and_neither_odometry_nor_contacts() {
    let mut plane = plane(&helicopter(), 1);
    let mut readings = Readings::new();
    readings.take(&plane);
    fly(&mut plane, 10, 0.05, 0.0);
    readings.take(&plane);
    let names: Vec<_> = readings.log.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["truth", "view", "truth", "view"]);
    assert!(readings.view.is_valid() && readings.view.dot_count > 0);
    assert_eq!(readings.log[3].1, 1_000_000_000);
}

#[test]
fn the_helicopter_follows_commands_with_the_stated_error() {
    let straight = Robot { motion_noise: None, ..helicopter() };
    let mut still = plane(&straight, 1);
    fly(&mut still, 50, 0.04, 0.03);
    let at = still.robot_pose();
    assert!((at.x - 0.7).abs() < 1e-3 && (at.y - 0.65).abs() < 1e-3 && at.yaw_rad == 0.0, "{at:?}");
    // The robot flies one metre, 400 times.
    let noise = MotionNoise { translation_m: 0.02, rotation_rad: 0.05 };
    let noisy = Robot { motion_noise: Some(noise), ..helicopter() };
    let ends = (0..400).map(|seed| {
        let mut plane = plane(&noisy, seed);
        fly(&mut plane, 100, 0.1, 0.0);
        plane.robot_pose()
    });
    let ends: Vec<_> = ends.collect();
    let spread = (ends.iter().map(|end| end.yaw_rad.powi(2)).sum::<f64>() / 400.0).sqrt();
    assert!((spread - 0.05).abs() < 0.006, "{spread}");
    let along = (ends.iter().map(|end| (end.x - 1.5).powi(2)).sum::<f64>() / 400.0).sqrt();
    assert!((along - 0.02).abs() < 0.004, "{along}");
}

#[test]
fn an_old_command_stops_it() {
    let mut plane = plane(&Robot { motion_noise: None, ..helicopter() }, 1);
    let first = command(&plane, 0.1, 0.0, 0.0);
    plane.step(Some(&first));
    (0..20).for_each(|_| plane.step(None));
    let stopped = plane.robot_pose();
    assert!((stopped.x - 0.55).abs() < 0.02, "{stopped:?}");
    plane.step(None);
    assert_eq!(plane.robot_pose(), stopped);
}

#[test]
fn a_restored_plane_continues_with_the_same_bytes() {
    let mut plane = plane(&helicopter(), 7);
    fly(&mut plane, 13, 0.1, 0.02);
    let stored = postcard::to_allocvec(&plane).unwrap();
    let mut restored: DotPlane = postcard::from_bytes(&stored).unwrap();
    assert_eq!(fly(&mut restored, 29, -0.03, 0.1), fly(&mut plane, 29, -0.03, 0.1));
    assert_eq!(postcard::to_allocvec(&restored).unwrap(), postcard::to_allocvec(&plane).unwrap());
}

#[test]
fn each_world_rejects_robots_with_unsupported_sensors() {
    let robotino = robots::find("robotino").unwrap().unwrap();
    let start = Pose::<WorldFrame>::new(0.5, 0.5, 0.0);
    let error = DotPlane::new(hundred(), &robotino, start, 1).unwrap_err().to_string();
    assert!(
        error.contains("\"robotino\": [laser]: expected a robot without that table over a plane"),
        "{error}"
    );
    let room = "name='room'\nwall_thickness_m=0.2\n[[wall]]\nclosed=true\npoints=[[0,0],[4,0],[4,4],[0,4]]\n";
    let room = floor_plan::parse(room).unwrap();
    let error = Floor::new(room, &helicopter(), Pose::new(2.0, 2.0, 0.0), 1).err().unwrap().to_string();
    assert!(
        error.contains("\"helicopter\": [view]: expected a robot without that table on a floor"),
        "{error}"
    );
}
