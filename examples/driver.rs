//! A complete robot driver, which takes the place of the simulated world in a system that runs in real time.
//!
//! ```text
//! sketchnav run my-floor.toml --speed 1 --system lab --without world
//! cargo run --example driver -- lab 5
//! ```
//!
//! The robot in this example is a point in two rooms, exact and without noise. Replace [`Robot`] with your
//! own laser, wheels and clock. `tests/missions/driver.rs` drives a mission with this driver.

use std::time::{Duration, Instant};

use anyhow::Context;
use sketchnav_driver::{Clock, Driver, STANDSTILL};
use sketchnav_schemas::channels::{ODOMETRY, SCAN};
use sketchnav_schemas::geometry::{Base, Odom, Pose};
use sketchnav_schemas::message::{LaserScan, Twist};
use sketchnav_schemas::robot::Laser;

/// The walls of two rooms of 3 × 4 m with a door of 1.2 m between them, each from x, y to x, y, in metres.
const WALLS: [[f64; 4]; 6] = [
    [0.0, 0.0, 6.0, 0.0],
    [6.0, 0.0, 6.0, 4.0],
    [6.0, 4.0, 0.0, 4.0],
    [0.0, 4.0, 0.0, 0.0],
    [3.0, 0.0, 3.0, 1.4],
    [3.0, 2.6, 3.0, 4.0],
];
/// Position of the robot when the driver begins, in metres, which is the origin of its odometry.
const START: [f64; 2] = [1.0, 1.0];

fn main() -> anyhow::Result<()> {
    let name =
        std::env::args().nth(1).context("expected the name of a system, as `sketchnav ps` lists it")?;
    let mut driver = Driver::join(&name, Clock::Robot)?;
    let laser = driver.run().robot.laser()?.clone();
    // Wheels are read more often than a laser scans, for example 50 times a second, with a scan and a tick at every
    // fifth reading.
    let readings = std::env::args().nth(2).map_or(Ok(1), |number| number.parse::<u32>());
    let readings = readings.context("expected how many readings of the odometry come with a scan")?.max(1);
    let period = Duration::from_secs_f64(1.0 / laser.rate_hz) / readings;
    // If an earlier driver has died, the robot is where that one left it.
    let pose = driver.last_of(ODOMETRY)?.map_or(Pose::new(0.0, 0.0, 0.0), |last| last.pose());
    let mut robot = Robot { pose, twist: STANDSTILL };
    let began = Instant::now();
    for reading in 1.. {
        let now_ns = driver.now_ns();
        driver.odometry(now_ns, &robot.pose, robot.twist)?;
        if reading % readings == 0 {
            driver.send(SCAN, now_ns, |scan| robot.write_scan(&laser, scan))?;
            driver.tick(now_ns)?;
        }
        // The laser of this robot scans when it is due, and the wheels follow the latest command.
        let due = began + period * reading;
        let Some(twist) = driver.command(due.saturating_duration_since(Instant::now()))? else { break };
        // A command arrives before the next reading is due.
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        robot.twist = twist;
        robot.drive(period.as_secs_f64());
    }
    Ok(())
}

struct Robot {
    pose: Pose<Odom>,
    twist: Twist,
}

impl Robot {
    fn drive(&mut self, seconds: f64) {
        let Twist { vx_mps, vy_mps, yaw_rate_radps } = self.twist;
        let step: Pose<Base> = Pose::new(vx_mps * seconds, vy_mps * seconds, yaw_rate_radps * seconds);
        self.pose = self.pose.compose(&step);
    }

    /// Writes a scan. Beams run counter-clockwise, and a beam without a return is +∞ (REP 117).
    fn write_scan(&self, laser: &Laser, scan: &mut LaserScan) {
        let sensor = self.pose.compose(&laser.mount());
        let field = laser.field_of_view_deg.to_radians();
        let increment = field / f64::from(laser.beams - 1);
        (scan.angle_min_rad, scan.angle_max_rad) = (-field as f32 / 2.0, field as f32 / 2.0);
        scan.angle_increment_rad = increment as f32;
        (scan.time_increment_s, scan.scan_time_s) = (0.0, 1.0 / laser.rate_hz as f32);
        (scan.range_min_m, scan.range_max_m) = (laser.range_min_m as f32, laser.range_max_m as f32);
        scan.beam_count = laser.beams;
        let eye = [START[0] + sensor.x, START[1] + sensor.y];
        for (beam, range) in scan.ranges_m.iter_mut().enumerate() {
            let direction = sensor.yaw_rad - field / 2.0 + beam as f64 * increment;
            let far = if beam < laser.beams as usize { nearest_wall_m(eye, direction) } else { 0.0 };
            *range = if far <= laser.range_max_m { far as f32 } else { f32::INFINITY };
        }
    }
}

/// Returns the distance from `eye` to the nearest wall in a direction, in metres, or +∞ if there is none.
fn nearest_wall_m(eye: [f64; 2], direction_rad: f64) -> f64 {
    let (sin, cos) = direction_rad.sin_cos();
    let hits = WALLS.iter().filter_map(|&[ax, ay, bx, by]| {
        let (wall, to) = ([bx - ax, by - ay], [ax - eye[0], ay - eye[1]]);
        let across = cos * wall[1] - sin * wall[0];
        let along_ray = (to[0] * wall[1] - to[1] * wall[0]) / across;
        let along_wall = (to[0] * sin - to[1] * cos) / across;
        (along_ray > 0.0 && (0.0..=1.0).contains(&along_wall)).then_some(along_ray)
    });
    hits.fold(f64::INFINITY, f64::min)
}
