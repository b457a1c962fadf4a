//! The world as a whole: what a navigator can rely on.

use sketchnav_schemas::codes::BodyKind;
use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_schemas::message::{Contact, GroundTruth, Header, LaserScan, Odometry, Twist, VelocityCommand};
use sketchnav_schemas::robot::Robot;
use sketchnav_sim::{SimError, World, floor_plan, robots};

const ROOM: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[4,0],[4,4],[0,4]]\n";

fn robotino() -> Robot {
    robots::find("robotino").unwrap().unwrap()
}

/// A robot without any noise.
fn perfect() -> Robot {
    let mut robot = robotino();
    (robot.laser.noise_m, robot.laser.noise_per_m, robot.laser.dropout) = (0.0, 0.0, 0.0);
    robot.laser.mount_x_m = 0.0;
    let noise = &mut robot.odometry;
    (noise.alpha_speed_speed, noise.alpha_speed_turn) = (0.0, 0.0);
    (noise.alpha_turn_speed, noise.alpha_turn_turn) = (0.0, 0.0);
    (noise.drift_distance, noise.drift_yaw_radpm, noise.slips_per_m) = (0.0, 0.0, 0.0);
    robot
}

fn world(extra: &str, robot: &Robot, start: (f64, f64, f64), seed: u64) -> Result<World, SimError> {
    let description = floor_plan::parse(&format!("{ROOM}{extra}"))?;
    World::new(description, robot, Pose::<WorldFrame>::new(start.0, start.1, start.2), seed)
}

fn command(world: &World, vx_mps: f64, vy_mps: f64, yaw_rate_radps: f64) -> VelocityCommand {
    let header = Header { seq: world.steps() + 1, stamp_ns: world.stamp_ns(), source_seq: world.steps() + 1 };
    VelocityCommand { header, twist: Twist { vx_mps, vy_mps, yaw_rate_radps }, last: 0, reserved: 0 }
}

fn drive(world: &mut World, steps: usize, vx: f64, vy: f64, yaw_rate: f64) -> Vec<Contact> {
    let mut contacts = Vec::new();
    for _ in 0..steps {
        let command = command(world, vx, vy, yaw_rate);
        world.step(Some(&command));
        contacts.extend(world.contacts());
    }
    contacts
}

fn scan(world: &World) -> LaserScan {
    let mut scan: LaserScan = bytemuck::Zeroable::zeroed();
    world.fill_scan(&mut scan);
    scan
}

/// Everything that the sensors say, as bytes.
fn observation(world: &World) -> Vec<u8> {
    let (mut odometry, mut truth): (Odometry, GroundTruth) =
        (bytemuck::Zeroable::zeroed(), bytemuck::Zeroable::zeroed());
    world.fill_odometry(&mut odometry);
    world.fill_truth(&mut truth);
    let mut bytes = bytemuck::bytes_of(&scan(world)).to_vec();
    bytes.extend(bytemuck::bytes_of(&odometry));
    bytes.extend(bytemuck::bytes_of(&truth));
    world.contacts().for_each(|contact| bytes.extend(bytemuck::bytes_of(&contact)));
    bytes
}

#[test]
fn the_robot_stops_at_a_wall_and_reports_one_contact() {
    let mut world = world("", &perfect(), (2.0, 2.0, 0.0), 1).unwrap();
    let contacts = drive(&mut world, 100, 0.5, 0.0, 0.0);
    let pose = world.robot_pose();
    assert!((pose.x - (3.9 - 0.225)).abs() < 0.005, "{pose:?}");
    assert_eq!(contacts.len(), 1, "{contacts:?}");
    let contact = contacts[0];
    assert_eq!((contact.begins, contact.body_kind), (1, BodyKind::Wall.code()));
    assert!((contact.x_m - 3.9).abs() < 0.01 && (contact.y_m - 2.0).abs() < 0.01, "{contact:?}");
    // 22.5 kg at 0.5 m/s, and the drive's push on top.
    assert!((5.0..16.0).contains(&contact.impulse_ns), "{contact:?}");
    let ends = drive(&mut world, 10, -0.5, 0.0, 0.0);
    assert_eq!(ends.iter().map(|c| c.begins).collect::<Vec<_>>(), [0]);
}

#[test]
fn a_slide_along_furniture_of_many_faces_is_one_contact() {
    let pillar = "[[furniture]]\ncenter=[3,2.2]\nradius_m=0.3\n";
    let mut world = world(pillar, &perfect(), (1.5, 2.0, 0.0), 1).unwrap();
    let contacts = drive(&mut world, 60, 0.5, 0.0, 0.0);
    let kinds: Vec<_> = contacts.iter().map(|c| (c.begins, c.body_kind)).collect();
    let furniture = BodyKind::Furniture.code();
    assert_eq!(kinds, [(1, furniture), (0, furniture), (1, BodyKind::Wall.code())]);
}
