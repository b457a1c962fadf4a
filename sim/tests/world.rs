//! Tests the world as a whole, as far as navigators rely on it.

mod support;

use sketchnav_schemas::codes::BodyKind;
use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_schemas::message::{Contact, LaserScan, Odometry};
use sketchnav_schemas::mission::Carry;
use sketchnav_schemas::robot::Robot;
use sketchnav_sim::{Floor, SimError, Simulation, floor_plan, robots};
use support::{Readings, command};

const ROOM: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[4,0],[4,4],[0,4]]\n";

fn robotino() -> Robot {
    robots::find("robotino").unwrap().unwrap()
}

/// Returns a robot without any noise.
fn perfect() -> Robot {
    let mut robot = robotino();
    let laser = robot.laser.as_mut().unwrap();
    (laser.noise_m, laser.noise_per_m, laser.dropout, laser.mount_x_m) = (0.0, 0.0, 0.0, 0.0);
    let noise = robot.odometry.as_mut().unwrap();
    (noise.alpha_speed_speed, noise.alpha_speed_turn) = (0.0, 0.0);
    (noise.alpha_turn_speed, noise.alpha_turn_turn) = (0.0, 0.0);
    (noise.drift_distance, noise.drift_yaw_radpm, noise.slips_per_m) = (0.0, 0.0, 0.0);
    robot
}

fn world(extra: &str, robot: &Robot, start: (f64, f64, f64), seed: u64) -> Result<Floor, SimError> {
    let description = floor_plan::parse(&format!("{ROOM}{extra}"))?;
    Floor::new(description, robot, Pose::<WorldFrame>::new(start.0, start.1, start.2), seed)
}

fn drive(floor: &mut Floor, steps: usize, vx: f64, vy: f64, yaw_rate: f64) -> Vec<Contact> {
    let mut contacts = Vec::new();
    for _ in 0..steps {
        floor.step(Some(&command(floor, vx, vy, yaw_rate)));
        contacts.extend(Readings::of(floor).contacts);
    }
    contacts
}

fn scan(floor: &Floor) -> LaserScan {
    *Readings::of(floor).scan
}

fn odometry(floor: &Floor) -> Odometry {
    Readings::of(floor).odometry
}

/// Returns everything that the sensors report, as bytes.
fn observation(floor: &Floor) -> Vec<u8> {
    let mut readings = Readings::with_bytes();
    readings.take(floor);
    readings.bytes.unwrap()
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
    assert!(
        (contact.position_m[0] - 3.9).abs() < 0.01 && (contact.position_m[1] - 2.0).abs() < 0.01,
        "{contact:?}"
    );
    // The impulse stops 22.5 kg at 0.5 m/s, and includes the push of the drive.
    assert!((5.0..16.0).contains(&contact.impulse_ns), "{contact:?}");
    let ends = drive(&mut world, 10, -0.5, 0.0, 0.0);
    assert_eq!(ends.iter().map(|c| c.begins).collect::<Vec<_>>(), [0]);
}

#[test]
fn a_slide_along_furniture_of_many_faces_is_one_contact() {
    let pillar = "[[furniture]]\ncenter=[3,2.2]\nradius_m=0.3\n";
    let mut world = world(pillar, &perfect(), (1.5, 2.0, 0.0), 1).unwrap();
    let contacts = drive(&mut world, 200, 0.5, 0.0, 0.0);
    let kinds: Vec<_> = contacts.iter().map(|c| (c.begins, c.body_kind)).collect();
    let furniture = BodyKind::Furniture.code();
    assert_eq!(kinds, [(1, furniture), (0, furniture), (1, BodyKind::Wall.code())]);
}

#[test]
fn nothing_gets_through_walls_or_furniture_at_full_speed() {
    let desk = "[[furniture]]\npolygon=[[2.2,2.2],[3,2.2],[3,2.25],[2.2,2.25]]\n";
    let mut robot = perfect();
    robot.limits.acceleration_mps2 = 20.0;
    robot.limits.speed_mps = 2.0;
    let mut world = world(desk, &robot, (1.0, 1.0, 0.0), 1).unwrap();
    let mut random = sketchnav_schemas::seed::stream(7, "commands");
    for _ in 0..10_000 {
        use rand::RngExt;
        let [vx, vy, yaw_rate] = [(); 3].map(|()| 2.0 * f64::from(random.random_range(-1..=1_i32)));
        drive(&mut world, 1, vx, vy, yaw_rate);
        let at = world.robot_pose();
        let inside = 0.1 + 0.225 - 0.03..=3.9 - 0.225 + 0.03;
        assert!(inside.contains(&at.x) && inside.contains(&at.y), "{at:?}");
        let (dx, dy) = (at.x - at.x.clamp(2.2, 3.0), at.y - at.y.clamp(2.2, 2.25));
        assert!(dx.hypot(dy) > 0.225 - 0.03, "{at:?}");
    }
}

#[test]
fn ranges_in_an_empty_room_are_the_distances_to_its_walls() {
    let world = world("", &perfect(), (1.3, 2.4, 0.4), 1).unwrap();
    let scan = scan(&world);
    assert_eq!(scan.beam_count, 683);
    for (i, &range) in scan.ranges().iter().enumerate() {
        let angle = 0.4 + f64::from(scan.angle_rad(i));
        let to = |at: f64, direction: f64| {
            let wall = if direction > 0.0 { 3.9 } else { 0.1 };
            (wall - at) / direction
        };
        let expected = to(1.3, angle.cos()).min(to(2.4, angle.sin()));
        assert!(
            (f64::from(range) - expected).abs() < 1e-5 * expected.max(1.0),
            "beam {i}: {range} {expected}"
        );
    }
}

#[test]
fn ranges_without_a_measurement_follow_rep_117() {
    let mut robot = perfect();
    let laser = robot.laser.as_mut().unwrap();
    (laser.range_min_m, laser.range_max_m, laser.dropout) = (2.0, 2.2, 0.25);
    let scan = scan(&world("", &robot, (2.0, 2.0, 0.0), 1).unwrap());
    let count = |is: fn(f32) -> bool| scan.ranges().iter().filter(|r| is(**r)).count();
    let (near, far, lost) =
        (count(|r| r == f32::NEG_INFINITY), count(|r| r == f32::INFINITY), count(f32::is_nan));
    let measured = count(|r| (2.0..=2.2).contains(&r));
    assert_eq!(near + far + lost + measured, 683);
    assert!(near > 50 && far > 100 && measured > 50, "{near} {far} {measured}");
    assert!((120..220).contains(&lost), "{lost}");
}

#[test]
fn the_noise_of_the_laser_has_its_mean_and_spread() {
    let mut robot = perfect();
    let laser = robot.laser.as_mut().unwrap();
    (laser.noise_m, laser.noise_per_m) = (0.01, 0.02);
    let mut world = world("", &robot, (2.0, 2.0, 0.0), 3).unwrap();
    // The beam straight ahead measures 1.9 m, so its spread is 0.048 m.
    let mut ranges = Vec::new();
    for _ in 0..2000 {
        ranges.push(f64::from(scan(&world).ranges()[341]));
        world.step(None);
    }
    let mean = ranges.iter().sum::<f64>() / 2000.0;
    let spread = (ranges.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
    assert!((mean - 1.9).abs() < 0.004, "{mean}");
    assert!((spread - 0.048).abs() < 0.003, "{spread}");
}

#[test]
fn a_scan_can_be_repeated() {
    let mut world = world("", &robotino(), (2.0, 2.0, 0.0), 3).unwrap();
    assert_eq!(bytemuck::bytes_of(&scan(&world)), bytemuck::bytes_of(&scan(&world)));
    let before = scan(&world);
    world.step(None);
    assert_ne!(bytemuck::bytes_of(&before), bytemuck::bytes_of(&scan(&world)));
}

#[test]
fn noiseless_odometry_is_the_motion_since_the_start() {
    let mut world = world("", &perfect(), (1.0, 1.0, 0.5), 1).unwrap();
    let start = world.robot_pose();
    drive(&mut world, 40, 0.4, 0.1, 0.3);
    let odometry = odometry(&world);
    let (measured, true_way) = (odometry.pose(), start.motion_to(&world.robot_pose()));
    assert!(
        (measured.x - true_way.x).abs() < 1e-9 && (measured.y - true_way.y).abs() < 1e-9,
        "{measured:?} {true_way:?}"
    );
    assert!((odometry.twist.vx_mps - 0.4).abs() < 0.01 && (odometry.twist.yaw_rate_radps - 0.3).abs() < 1e-3);
}

/// The drift is constant within a run and has the given spread over runs. The noise grows with the square root of time.
#[test]
fn odometry_errors_match_the_parameters() {
    use sketchnav_schemas::geometry::{Base, Pose};
    use sketchnav_sim::sensors::odometry::DeadReckoning;
    let mut robot = perfect();
    let noise = robot.odometry.as_mut().unwrap();
    (noise.drift_distance, noise.alpha_speed_speed) = (0.02, 0.004);
    let errors: Vec<f64> = (0..2000)
        .map(|seed| {
            let stream = sketchnav_schemas::seed::stream(seed, "test");
            let mut count = DeadReckoning::new(robot.odometry().unwrap(), robot.drive, stream);
            (0..100).for_each(|_| count.step(&Pose::<Base>::new(0.05, 0.0, 0.0), 0.1));
            count.pose().x - 5.0
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / 2000.0;
    let spread = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
    // Drift: 2 % of 5 m. Noise: 0.004 · (0.5 m/s)² per second for 10 s.
    let expected = (0.1_f64.powi(2) + 0.004 * 0.25 * 10.0).sqrt();
    assert!(mean.abs() < 0.01, "{mean}");
    assert!((spread / expected - 1.0).abs() < 0.05, "{spread} {expected}");
}

#[test]
fn a_robot_at_rest_accumulates_no_odometry() {
    let mut world = world("", &robotino(), (2.0, 2.0, 0.0), 1).unwrap();
    (0..50).for_each(|_| world.step(None));
    let odometry = odometry(&world);
    assert_eq!((odometry.pose.x_m, odometry.pose.y_m, odometry.pose.orientation_z), (0.0, 0.0, 0.0));
}

#[test]
fn a_stale_command_stops_the_robot_within_its_limits() {
    let robot = perfect();
    let mut world = world("", &robot, (0.5, 2.0, 0.0), 1).unwrap();
    drive(&mut world, 10, 0.5, 0.0, 0.0);
    assert!((world.robot_twist().vx_mps - 0.5).abs() < 1e-3);
    // The last command stays in force for half a second, of which its own step was one tenth of a second.
    (0..4).for_each(|_| world.step(None));
    assert!((world.robot_twist().vx_mps - 0.5).abs() < 1e-3);
    let mut speed = 0.5;
    for _ in 0..10 {
        world.step(None);
        let slower = world.robot_twist().vx_mps;
        assert!(speed - slower <= robot.limits.acceleration_mps2 * 0.1 + 1e-4);
        speed = slower;
    }
    assert!(speed.abs() < 1e-6, "{speed}");
}

#[test]
fn invalid_or_future_commands_do_not_keep_the_robot_driving() {
    let mut world = world("", &perfect(), (1.0, 2.0, 0.0), 1).unwrap();
    let mut future = command(&world, 0.5, 0.0, 0.0);
    future.header.stamp_ns = u64::MAX;
    world.step(Some(&future));
    (0..20).for_each(|_| world.step(None));
    assert!(world.robot_twist().vx_mps.abs() < 1e-6);
    drive(&mut world, 5, f64::NAN, f64::INFINITY, 0.0);
    assert!(world.robot_pose().x.is_finite() && world.robot_twist().vx_mps.abs() < 1e-6);
}

#[test]
fn people_block_the_laser_and_wait_for_the_robot() {
    let walker = "[[person]]\nwaypoints=[[3.5,2],[0.5,2]]\nspeed_mps=1.0\n";
    let mut world = world(walker, &perfect(), (1.5, 2.0, 0.0), 1).unwrap();
    assert!((scan(&world).ranges()[341] - 1.75).abs() < 1e-3);
    let mut contacts = 0;
    for _ in 0..50 {
        world.step(None);
        contacts += Readings::of(&world).contacts.len();
    }
    let range = scan(&world).ranges()[341];
    assert!((0.525..0.545).contains(&range), "{range}");
    assert_eq!(contacts, 0);
    let touched = drive(&mut world, 20, 0.5, 0.0, 0.0);
    assert_eq!(touched.iter().map(|c| c.body_kind).collect::<Vec<_>>(), [BodyKind::Person.code()]);
}

#[test]
fn a_start_too_narrow_for_the_robot_is_refused_with_its_place() {
    let desk = "[[furniture]]\nname='desk'\ncenter=[2,2]\nsize=[1,1]\n";
    for (x, y, found) in [
        (2.0, 2.0, "found a furniture 0.000 m away"),
        (3.8, 3.0, "found a wall 0.100 m away"),
        // Robots outside the walls used to keep driving until their time was up.
        (9.0, 9.0, "found (9, 9) m, outside the walls"),
    ] {
        let error = world(desk, &robotino(), (x, y, 0.0), 1).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(found), "{error}");
    }
}

/// Returns a busy world: furniture, a person, every kind of noise, and walls that the robot hits.
fn busy(seed: u64) -> Floor {
    let extra = "[[furniture]]\ncenter=[2.8,1.2]\nradius_m=0.3\n[[person]]\nwaypoints=[[3.2,3.2],[0.6,3.2]]\nspeed_mps=0.8\n";
    world(extra, &robotino(), (1.0, 1.0, 0.3), seed).unwrap()
}

fn run(world: &mut Floor, steps: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for _ in 0..steps {
        let phase = world.steps() as f64;
        drive(world, 1, 0.4, 0.2 * (phase / 20.0).sin(), 0.5 * (phase / 30.0).cos());
        bytes.extend(observation(world));
    }
    bytes
}

#[test]
fn the_bytes_of_a_run_depend_only_on_the_seed() {
    let first = run(&mut busy(5), 300);
    assert!(first == run(&mut busy(5), 300));
    assert!(first != run(&mut busy(6), 300));
}

#[test]
fn a_restored_world_continues_with_the_same_bytes() {
    let mut world = busy(5);
    for _ in 0..6 {
        run(&mut world, 41);
        let stored = postcard::to_allocvec(&world).unwrap();
        let mut restored: Floor = postcard::from_bytes(&stored).unwrap();
        assert!(run(&mut restored, 41) == run(&mut world, 41));
        assert!(postcard::to_allocvec(&restored).unwrap() == postcard::to_allocvec(&world).unwrap());
    }
}

/// The floor of Building 079, with furniture drawn in grey: the robot fits into the corridor, but not onto the outline of a
/// cupboard.
#[test]
fn a_real_map_becomes_a_world() {
    let data = needs::data().join("maps");
    let path = data.join("Freiburg79_scan_furnitures.yaml");
    if !path.exists() {
        return needs::skipped("data", format_args!("{} is not there", path.display()));
    }
    let floor = sketchnav_sim::files::map_file(&path).unwrap();
    let start = |column: f64, row: f64| {
        let pose = Pose::<WorldFrame>::new(column * 0.0605, (544.0 - row) * 0.0605, 0.0);
        Floor::new(floor.clone(), &robotino(), pose, 1)
    };
    let world = start(400.0, 312.0).unwrap();
    let seen = scan(&world).ranges().iter().filter(|r| r.is_finite()).count();
    assert!(seen > 400, "{seen}");
    let cupboard = start(448.0, 355.0).map(|_| ()).unwrap_err().to_string();
    assert!(
        cupboard.contains("expected a free place, found (27.104, 11.4345) m, in an occupied"),
        "{cupboard}"
    );
}

#[test]
fn errors_of_files_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let yaml = folder.path().join("floor.yaml");
    let text =
        "image: gone.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.2\n";
    std::fs::write(&yaml, text).unwrap();
    let error = sketchnav_sim::files::map_file(&yaml).unwrap_err().to_string();
    assert!(
        error.contains("floor.yaml") && error.contains("image: expected a file, found none at "),
        "{error}"
    );
    std::fs::write(folder.path().join("gone.pgm"), b"P5\n4 4\n255\n").unwrap();
    let error = sketchnav_sim::files::map_file(&yaml).unwrap_err().to_string();
    assert!(error.contains("gone.pgm: expected a picture, PGM, PNG or BMP"), "{error}");
    let error = sketchnav_sim::files::robot("nobody.toml").unwrap_err().to_string();
    assert!(error.starts_with("nobody.toml: expected a robot, found no such file"), "{error}");
}

/// Somebody carries the robot while it drives. Its wheels do not notice, and it stands still where it is set down.
#[test]
fn a_robot_that_is_carried_goes_on_elsewhere() {
    let robot = perfect();
    let mut world = world("", &robot, (1.0, 2.0, 0.0), 1).unwrap();
    let carry = |at_s: f64, to: [f64; 2], heading_deg: f64| Carry { at_s, to, heading_deg };
    // The order in the file does not matter.
    world.carry(&[carry(2.0, [3.0, 1.0], 90.0), carry(1.0, [1.0, 3.0], 180.0)], &robot).unwrap();
    drive(&mut world, 10, 0.2, 0.0, 0.0);
    let before = odometry(&world).pose();
    assert!((world.robot_pose().y - 2.0).abs() < 1e-3, "not yet: {:?}", world.robot_pose());
    drive(&mut world, 1, 0.0, 0.0, 0.0);
    let at = world.robot_pose();
    assert!((at.x - 1.0).abs() < 0.03 && (at.y - 3.0).abs() < 1e-3 && at.yaw_rad.abs() > 3.1, "{at:?}");
    let moved = before.motion_to(&odometry(&world).pose());
    assert!(moved.x.hypot(moved.y) < 0.03, "{moved:?}");
    drive(&mut world, 10, 0.0, 0.0, 0.0);
    let at = world.robot_pose();
    assert!((at.x - 3.0).abs() < 0.03 && (at.y - 1.0).abs() < 0.03, "{at:?}");

    let refused = world.carry(&[carry(1.0, [2.0, 2.0], 0.0), carry(1.0, [2.0, 3.8], 0.0)], &robot);
    let words = "world.carry 2: expected free floor around `to`, found a wall 0.1";
    assert!(refused.unwrap_err().to_string().starts_with(words));
}
