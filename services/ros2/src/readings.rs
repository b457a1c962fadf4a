//! Converts the readings of a ROS 2 robot into messages: its scans, its odometry, its time.
//!
//! Readings are checked here, and errors say what was expected and what was found. Ranges follow REP 117.

use ros2_interfaces_jazzy_serde::builtin_interfaces::msg::Time;
use sketchnav_driver::DriverError;
use sketchnav_schemas::message::{Header, LaserScan, MAX_BEAMS, Message, Odometry};
use sketchnav_schemas::ros2::{Ros2, Ros2Error};

/// The form of `sensor_msgs/msg/LaserScan`.
pub type ScanForm = <LaserScan as Ros2>::Form;
/// The form of `nav_msgs/msg/Odometry`.
pub type OdometryForm = <Odometry as Ros2>::Form;

/// Reasons why a reading was rejected.
#[derive(Debug, thiserror::Error)]
pub enum ReadingError {
    /// The reading does not fit into a message.
    #[error(transparent)]
    Form(#[from] Ros2Error),
    /// The scan contains a number that no sensor can measure.
    #[error(
        "expected finite numbers, range_min below range_max and ranges according to REP 117, found others"
    )]
    Scan,
    /// The pose or the velocity is impossible.
    #[error("expected a finite pose with a heading, and a finite velocity, found others")]
    Odometry,
    /// The driver refused the reading.
    #[error(transparent)]
    Driver(#[from] DriverError),
}

/// Converts the robot's stamps to simulation time. The first reading gets the current time of the mission.
#[derive(Debug, Clone, Copy)]
pub struct Timebase {
    begin_ns: u64,
    first_ns: Option<i128>,
}

impl Timebase {
    /// Starts at this simulation time, in nanoseconds.
    pub fn at(begin_ns: u64) -> Self {
        Self { begin_ns, first_ns: None }
    }

    /// Returns the simulation time of a stamp, in nanoseconds. It is never before the start.
    pub fn of(&mut self, stamp: &Time) -> u64 {
        let found = i128::from(stamp.sec) * 1_000_000_000 + i128::from(stamp.nanosec);
        let first = *self.first_ns.get_or_insert(found);
        let since = u64::try_from((found - first).max(0)).unwrap_or(u64::MAX);
        self.begin_ns.saturating_add(since)
    }
}

/// Converts a scan. If it has more beams than a message can hold, it is thinned evenly.
///
/// # Errors
/// [`ReadingError`] if the scan does not fit into a message or is invalid.
pub fn scan(mut form: ScanForm, stamp_ns: u64) -> Result<LaserScan, ReadingError> {
    let stride = form.ranges.len().div_ceil(MAX_BEAMS).max(1);
    if stride > 1 {
        form.ranges = form.ranges.into_iter().step_by(stride).collect();
        form.angle_increment *= stride as f32;
        form.angle_max = form.angle_min + form.angle_increment * (form.ranges.len() - 1) as f32;
        form.time_increment *= stride as f32;
    }
    form.header.stamp = Time::default();
    let (mut scan, _) = LaserScan::from_ros2(form, 1)?;
    scan.header = Header { seq: 0, stamp_ns, source_seq: 0 };
    if scan.is_valid() { Ok(scan) } else { Err(ReadingError::Scan) }
}

/// Converts an odometry reading. If the orientation is tilted, only the rotation about the vertical axis is kept.
///
/// # Errors
/// [`ReadingError`] if the reading does not fit into a message or is invalid.
pub fn odometry(mut form: OdometryForm, stamp_ns: u64) -> Result<Odometry, ReadingError> {
    form.header.stamp = Time::default();
    let turn = &mut form.pose.pose.orientation;
    let length = turn.z.hypot(turn.w);
    (turn.z, turn.w) = (turn.z / length, turn.w / length);
    let (mut odometry, _) = Odometry::from_ros2(form, 1)?;
    odometry.header = Header { seq: 0, stamp_ns, source_seq: 0 };
    if odometry.is_valid() { Ok(odometry) } else { Err(ReadingError::Odometry) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranges(count: usize) -> ScanForm {
        ScanForm {
            angle_min: -1.0,
            angle_max: 1.0,
            angle_increment: 2.0 / (count - 1) as f32,
            range_min: 0.1,
            range_max: 10.0,
            ranges: (0..count).map(|beam| 1.0 + beam as f32 * 1e-3).collect(),
            ..ScanForm::default()
        }
    }

    #[test]
    fn a_scan_keeps_its_beams_and_gets_mission_time() {
        let found = scan(ranges(181), 7).unwrap();
        assert_eq!((found.beam_count, found.header.stamp_ns), (181, 7));
        assert_eq!(found.ranges_m[180], 1.0 + 180.0 * 1e-3);
    }

    #[test]
    fn a_scan_with_too_many_beams_is_thinned_and_keeps_its_directions() {
        let form = ranges(3600);
        let (step, ranges_before) = (form.angle_increment, form.ranges.clone());
        let found = scan(form, 7).unwrap();
        assert_eq!(found.beam_count, 1200);
        for beam in [0, 1, 700, 1199] {
            assert_eq!(found.ranges_m[beam], ranges_before[3 * beam]);
        }
        assert!((found.angle_increment_rad - 3.0 * step).abs() < 1e-7);
        assert!((found.angle_max_rad - (-1.0 + 1199.0 * 3.0 * step)).abs() < 1e-4);
    }

    #[test]
    fn an_impossible_scan_is_refused() {
        let spoils: [fn(&mut ScanForm); 4] = [
            |form| form.range_max = 0.0,
            |form| form.angle_min = f32::NAN,
            |form| form.ranges[3] = -1.0,
            |form| form.angle_increment = f32::INFINITY,
        ];
        for spoil in spoils {
            let mut form = ranges(10);
            spoil(&mut form);
            assert!(matches!(scan(form, 7), Err(ReadingError::Scan)));
        }
        let silent = ScanForm { ranges: vec![f32::INFINITY, f32::NAN, f32::NEG_INFINITY], ..ranges(3) };
        assert!(scan(silent, 7).is_ok());
    }

    #[test]
    fn the_heading_of_a_tilted_robot_is_its_yaw() {
        let mut form = OdometryForm::default();
        let turn = &mut form.pose.pose.orientation;
        (turn.x, turn.y, turn.z, turn.w) = (0.1, 0.0, 0.6 * 0.99, 0.8 * 0.99);
        let found = odometry(form, 7).unwrap();
        assert!((found.pose().yaw_rad - 2.0 * 0.6f64.atan2(0.8)).abs() < 1e-9);
        let mut flat = OdometryForm::default();
        let turn = &mut flat.pose.pose.orientation;
        (turn.x, turn.y, turn.z, turn.w) = (0.0, 0.0, 0.0, 0.0);
        assert!(matches!(odometry(flat, 7), Err(ReadingError::Odometry)));
    }

    #[test]
    fn the_robots_clock_is_mapped_to_mission_time() {
        let mut time = Timebase::at(500);
        let stamp = |sec, nanosec| Time { sec, nanosec };
        assert_eq!(time.of(&stamp(1_700_000_000, 10)), 500);
        assert_eq!(time.of(&stamp(1_700_000_001, 30)), 1_000_000_520);
        assert_eq!(time.of(&stamp(-5, 0)), 500);
    }
}
