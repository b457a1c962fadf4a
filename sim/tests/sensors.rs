//! Each robot has some of the sensors, each with its own rate.

mod support;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::message::{MarkerView, SeenMarker};
use sketchnav_schemas::robot::Robot;
use sketchnav_sim::convex::Convex;
use sketchnav_sim::corridors::{Corridor, Shape};
use sketchnav_sim::raycast::{Faces, cast_disc};
use sketchnav_sim::{Floor, Simulation, WorldDescription, floor_plan, robots};
use support::{Readings, command};

const FLOOR: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[6,0],[6,4],[0,4]]\n[[wall]]\npoints=[[3,0],[3,1.2]]\n\
    [[furniture]]\ncenter=[4.5,1.2]\nradius_m=0.3\n[[furniture]]\ncenter=[1.2,3]\nsize=[0.8,0.4]\nyaw_deg=30\n\
    [[person]]\nwaypoints=[[5.2,3.2],[0.6,3.2]]\nspeed_mps=0.8\n";

fn plan() -> WorldDescription {
    floor_plan::parse(FLOOR).unwrap()
}

fn robot(name: &str) -> Robot {
    robots::find(name).unwrap().unwrap()
}

fn floor(robot: &Robot) -> Floor {
    Floor::new(plan(), robot, Pose::new(2.0, 2.0, 0.3), 1).unwrap()
}

/// Returns the readings of a robot that drives for `steps` instants, including the first.
fn driven(robot: &Robot, steps: usize) -> Readings {
    let (mut floor, mut readings) = (floor(robot), Readings::with_bytes());
    readings.take(&floor);
    for _ in 0..steps {
        floor.step(Some(&command(&floor, 0.2, 0.0, 0.4)));
        readings.take(&floor);
    }
    readings
}

fn stamps(period_ms: u64, count: u64) -> Vec<u64> {
    (0..count).map(|i| i * period_ms * 1_000_000).collect()
}

#[test]
fn odometry_of_50_hz_and_scans_of_10_hz_at_ticks_of_10_hz() {
    let mut robot = robot("robotino");
    robot.odometry.as_mut().unwrap().rate_hz = Some(50.0);
    let readings = driven(&robot, 20);
    assert_eq!(readings.stamps("odometry"), stamps(20, 101));
    assert_eq!(readings.stamps("scan"), stamps(100, 21));
    assert_eq!(readings.stamps("truth"), stamps(100, 21));
    // An instant consists of the truth, the people, five odometry readings, and the scan.
    let channels: Vec<_> = readings.log[4..12].iter().map(|(channel, _)| *channel).collect();
    assert_eq!(
        channels,
        ["truth", "people", "odometry", "odometry", "odometry", "odometry", "odometry", "scan"]
    );
}

#[test]
fn a_slow_laser_reports_at_the_first_tick_at_or_after_its_time() {
    let mut robot = robot("robotino");
    robot.tick_hz = Some(10.0);
    robot.laser.as_mut().unwrap().rate_hz = 4.0;
    let readings = driven(&robot, 10);
    let due = [0, 300, 500, 800, 1000].map(|ms| ms * 1_000_000);
    assert_eq!(readings.stamps("scan"), due);
    assert_eq!(readings.stamps("odometry"), stamps(100, 11));
}

/// With two scans per tick, each scan shows the world at its own time, with the walker where it is at that time.
#[test]
fn a_fast_laser_reads_between_the_ticks() {
    let mut slow = robot("robotino");
    slow.laser.as_mut().unwrap().rate_hz = 20.0;
    let mut fast = slow.clone();
    (slow.tick_hz, fast.tick_hz) = (Some(10.0), Some(20.0));
    let between_ticks = driven(&slow, 10);
    assert_eq!(between_ticks.stamps("scan"), stamps(50, 21));
    // While the robot is at rest, only the walker moves, so a world with a faster tick sees the same.
    let scans = |robot: &Robot, steps: usize| {
        let (mut floor, mut readings) = (floor(robot), Readings::new());
        (0..steps).for_each(|_| floor.step(None));
        readings.take(&floor);
        readings.scan
    };
    assert!(bytemuck::bytes_of(&*scans(&slow, 10)) == bytemuck::bytes_of(&*scans(&fast, 20)));
}

#[test]
fn a_robot_reports_only_the_sensors_that_it_has() {
    let mut blind = robot("nomad200");
    let readings = driven(&blind, 5);
    assert_eq!((readings.stamps("scan").len(), readings.stamps("sonar").len()), (0, 6));
    (blind.sonar, blind.odometry) = (None, None);
    let readings = driven(&blind, 5);
    assert!(
        readings.log.iter().all(|(channel, _)| ["truth", "people"].contains(channel)),
        "{:?}",
        readings.log
    );
    assert_eq!(floor(&blind).period_ns(), 100_000_000);
}

/// After a restart from a checkpoint in the middle of a drive, the sonar measures the same, too.
#[test]
fn a_restored_floor_with_a_sonar_ring_continues_with_the_same_bytes() {
    let mut robot = robot("nomad200");
    robot.odometry.as_mut().unwrap().rate_hz = Some(35.0);
    let mut floor = floor(&robot);
    for _ in 0..5 {
        (0..13).for_each(|_| floor.step(Some(&command(&floor, 0.3, 0.0, 0.2))));
        let mut restored: Floor = postcard::from_bytes(&postcard::to_allocvec(&floor).unwrap()).unwrap();
        for _ in 0..13 {
            let (mut one, mut other) = (Readings::with_bytes(), Readings::with_bytes());
            one.take(&floor);
            other.take(&restored);
            assert!(one.bytes == other.bytes && one.log == other.log);
            let command = command(&floor, 0.3, 0.0, -0.2);
            floor.step(Some(&command));
            restored.step(Some(&command));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// At any rate, there are as many readings as the time allows, in order, and none is later than its instant.
    #[test]
    fn every_sensor_keeps_its_rate(tick in 2.0..40.0_f64, odometry in 0.5..150.0_f64, sonar in 0.5..60.0_f64) {
        let mut robot = robot("nomad200");
        robot.tick_hz = Some(tick);
        robot.odometry.as_mut().unwrap().rate_hz = Some(odometry);
        robot.sonar.as_mut().unwrap().rate_hz = sonar;
        let (mut floor, mut readings) = (floor(&robot), Readings::new());
        for _ in 0..40 {
            let before = readings.log.len();
            readings.take(&floor);
            prop_assert!(readings.log[before..].iter().all(|(_, stamp_ns)| *stamp_ns <= floor.stamp_ns()));
            floor.step(None);
        }
        let span_s = 39.0 / tick;
        for (channel, rate) in [("odometry", odometry), ("sonar", sonar)] {
            let stamps = readings.stamps(channel);
            prop_assert!(stamps.is_sorted_by(|a, b| a < b), "{} {:?}", channel, stamps);
            let expected = (span_s * rate).floor() + 1.0;
            prop_assert!((stamps.len() as f64 - expected).abs() <= 1.0, "{} {} {}", channel, stamps.len(), expected);
        }
    }

    /// Wherever the robot stands, the ranges of the ring equal those of a fan of rays in each cone.
    #[test]
    fn the_ring_measures_the_nearest_of_many_rays(x in 0.4..5.6, y in 0.4..3.6, yaw in -3.1..3.1) {
        let mut robot = robot("nomad200");
        let sonar = robot.sonar.as_mut().unwrap();
        (sonar.noise_per_m, sonar.range_min_m) = (0.0, 0.0);
        let Ok(floor) = Floor::new(plan(), &robot, Pose::<World>::new(x, y, yaw), 1) else { return Ok(()) };
        let faces = floor.outline().iter().copied().chain(floor.furniture().iter().flat_map(Convex::edges));
        let (faces, people) = (Faces::new(faces.collect()), floor.people().collect::<Vec<_>>());
        let scan = Readings::of(&floor).sonar;
        prop_assert_eq!(scan.ranges().len(), 16);
        let half = f64::from(scan.half_opening_rad);
        for (i, range) in scan.ranges().iter().enumerate() {
            let axis = floor.robot_pose().yaw_rad + f64::from(scan.angle_rad(i));
            let along = |angle: f64| nalgebra::Vector2::new(angle.cos(), angle.sin());
            let apex = floor.robot_pose().position().coords() + along(axis) * 0.23;
            let ray = |j: i32| {
                let direction = along(axis + half * f64::from(j) / 400.0);
                let discs = people.iter().filter_map(|(at, r)| cast_disc((*at).into(), *r, apex, direction, 9.0));
                discs.chain(faces.cast(apex, direction, 9.0)).fold(f64::INFINITY, f64::min)
            };
            let fan = (-400..=400).map(ray).fold(f64::INFINITY, f64::min);
            let expected = if fan > 6.477 { f64::INFINITY } else { fan };
            prop_assert!(
                f64::from(*range) == expected || (f64::from(*range) - expected).abs() < 0.01,
                "sonar {}: {} {}", i, range, expected
            );
        }
    }
}

#[test]
fn the_noise_of_a_sonar_is_a_share_of_its_range() {
    let mut robot = robot("nomad200");
    robot.sonar.as_mut().unwrap().noise_per_m = 0.02;
    let plain =
        "name='room'\nwall_thickness_m=0.2\n[[wall]]\nclosed=true\npoints=[[0,0],[8,0],[8,8],[0,8]]\n";
    let mut floor =
        Floor::new(floor_plan::parse(plain).unwrap(), &robot, Pose::new(4.0, 4.0, 0.0), 3).unwrap();
    let mut ranges = Vec::new();
    for _ in 0..2000 {
        ranges.push(f64::from(Readings::of(&floor).sonar.ranges()[0]));
        floor.step(None);
    }
    let mean = ranges.iter().sum::<f64>() / 2000.0;
    let spread = (ranges.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
    // The distance from the ring to the wall is 4 − 0.1 − 0.23 m.
    assert!((mean - 3.67).abs() < 0.006 && (spread - 0.0734).abs() < 0.005, "{mean} {spread}");
}

#[test]
fn a_sonar_follows_rep_117_even_when_pushed_into_a_wall() {
    let mut robot = robot("nomad200");
    robot.sonar.as_mut().unwrap().noise_per_m = 0.0;
    robot.limits.speed_mps = 2.0;
    let hall =
        "name='hall'\nwall_thickness_m=0.2\n[[wall]]\nclosed=true\npoints=[[0,0],[20,0],[20,20],[0,20]]\n";
    let mut floor =
        Floor::new(floor_plan::parse(hall).unwrap(), &robot, Pose::new(10.0, 10.0, 0.0), 1).unwrap();
    assert!(Readings::of(&floor).sonar.ranges().iter().all(|range| *range == f32::INFINITY));
    for _ in 0..120 {
        floor.step(Some(&command(&floor, 2.0, 0.0, 0.0)));
    }
    let sonar = Readings::of(&floor).sonar;
    assert_eq!(sonar.ranges()[0], f32::NEG_INFINITY, "{:?}", floor.robot_pose());
}

/// The camera of a youBot takes three pictures per instant, and markers come nearer as the robot drives.
#[test]
fn a_marker_camera_of_30_hz_follows_the_markers_of_a_corridor() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    let world = floor_plan::describe(&corridor.plan()).unwrap();
    let (robot, start) = (robot("youbot"), corridor.drives()[0].start);
    let mut floor = Floor::new(world, &robot, start, 1).unwrap();
    let mut readings = Readings::new();
    readings.take(&floor);
    let first = readings.markers;
    for _ in 0..10 {
        floor.step(Some(&command(&floor, 0.5, 0.0, 0.0)));
        readings.take(&floor);
    }
    assert_eq!(readings.stamps("markers").len(), 31);
    let both = |view: &MarkerView| [1.0, -1.0].map(|side| view.markers().iter().any(|m| m.y_m * side > 0.5));
    assert_eq!((both(&first), both(&readings.markers)), ([true; 2], [true; 2]));
    let (before, after) = (first.markers(), readings.markers.markers());
    let nearer = |m: &SeenMarker| after.iter().find(|now| now.id == m.id).map(|now| m.x_m - now.x_m);
    let driven: Vec<f32> = before.iter().filter_map(nearer).collect();
    // Half a second of acceleration and half a second at full speed. The distance of a slanted marker is off by centimetres.
    let mean = driven.iter().sum::<f32>() / driven.len() as f32;
    assert!(driven.len() >= 3 && (0.2..0.5).contains(&mean), "{driven:?}");
}
