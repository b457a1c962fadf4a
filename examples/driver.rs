//! A complete robot driver: it takes the place of the simulated world in a system that runs in real time.
//!
//! ```text
//! sketchnav run my-floor.toml --speed 1 --system lab --without world
//! cargo run --example driver -- lab 5
//! ```
//!
//! The robot here is a point in two rooms, exact and without noise. Replace [`Robot`] by your own laser, wheels and
//! clock. `tests/missions/driver.rs` drives a mission with this driver.

use std::time::{Duration, Instant};

use anyhow::Context;
use sketchnav_runtime::{Node, System, Wake};
use sketchnav_schemas::channels::{COMMAND, ODOMETRY, SCAN, TICK};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::{Base, Odom, Pose};
use sketchnav_schemas::message::{Header, LaserScan, Odometry, PoseM, Twist};
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
/// Where the robot is when the driver begins, in metres. This is the origin of its odometry.
const START: [f64; 2] = [1.0, 1.0];
/// If no new command arrives for this long, the robot stops.
const COMMAND_LIMIT: Duration = Duration::from_millis(500);

fn main() -> anyhow::Result<()> {
    let name =
        std::env::args().nth(1).context("expected the name of a system, as `sketchnav ps` lists it")?;
    let node = Node::join(System::open(&name)?, Process::World)?;
    let (mut scans, mut odometry) = (node.writer(SCAN)?, node.writer(ODOMETRY)?);
    let (mut ticks, mut commands) = (node.writer(TICK)?, node.reader(COMMAND)?);
    let run = node.run_config()?;
    let laser = run.robot.laser()?;
    // Wheels are read more often than a laser scans, for example 50 times a second, with a scan and a tick at every
    // fifth reading.
    let readings = std::env::args().nth(2).map_or(Ok(1), |number| number.parse::<u32>());
    let readings = readings.context("expected how many readings of the odometry come with a scan")?.max(1);
    let period = Duration::from_secs_f64(1.0 / laser.rate_hz) / readings;
    // If an earlier driver has died, this one continues its numbers, its clock and its odometry.
    scans.resume_after_history();
    odometry.resume_after_history();
    ticks.resume_after_history();
    let last = odometry.last_sent();
    let clock = last.map_or(Duration::ZERO, |last| Duration::from_nanos(last.header.stamp_ns) + period);
    let pose = last.map_or(Pose::new(0.0, 0.0, 0.0), |last| last.pose());
    let ticks_before = ticks.last_seq();
    let mut robot = Robot { pose, twist: STANDSTILL };
    let (began, mut commanded) = (Instant::now(), Instant::now());
    for reading in 1.. {
        // An instant ends with its tick, which names the messages sent before it. The writers number the messages.
        let stamp_ns = (clock + began.elapsed()).as_nanos() as u64;
        let header = Header { seq: 0, stamp_ns, source_seq: 0 };
        odometry.send(|message| robot.write_odometry(header, message))?;
        if reading % readings == 0 {
            scans.send(|message| robot.write_scan(header, laser, message))?;
            ticks.send(|tick| {
                tick.header.stamp_ns = stamp_ns;
                node.name_readings(tick);
            })?;
        }
        let due = began + period * reading;
        while let Some(left) = due.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
            if node.wait(left) == Wake::Terminate {
                return Ok(());
            }
            while let Some(command) = commands.receive_valid()? {
                if command.last == 1 {
                    return Ok(());
                }
                // An answer to a tick of an earlier driver is obsolete.
                if command.header.source_seq > ticks_before {
                    (robot.twist, commanded) = (command.twist, Instant::now());
                }
            }
        }
        if commanded.elapsed() > COMMAND_LIMIT {
            robot.twist = STANDSTILL;
        }
        robot.drive(period.as_secs_f64());
    }
    Ok(())
}

const STANDSTILL: Twist = Twist { vx_mps: 0.0, vy_mps: 0.0, yaw_rate_radps: 0.0 };

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

    fn write_odometry(&self, header: Header, message: &mut Odometry) {
        *message = Odometry { header, pose: PoseM::new(&self.pose), twist: self.twist };
    }

    /// Writes a scan. Beams run counter-clockwise, and a beam without a return is +∞ (REP 117).
    fn write_scan(&self, header: Header, laser: &Laser, scan: &mut LaserScan) {
        let sensor = self.pose.compose(&laser.mount());
        let field = laser.field_of_view_deg.to_radians();
        let increment = field / f64::from(laser.beams - 1);
        scan.header = header;
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
