//! Converts the readings of a ROS 2 robot into messages: its scans, its odometry, its time.
//!
//! Readings are checked here, and errors give what was expected and what was found. Ranges follow REP 117.

use std::collections::BTreeSet;
use std::time::Duration;

use ros2_interfaces_jazzy_serde::builtin_interfaces::msg::Time;
use sketchnav_driver::DriverError;
use sketchnav_schemas::message::{Header, LaserScan, MAX_BEAMS, Message, Odometry};
use sketchnav_schemas::ros2::{Ros2, Ros2Error};
use sketchnav_schemas::time::NS_PER_S;

use crate::participant::PublisherId;

/// The form of `sensor_msgs/msg/LaserScan`.
pub type ScanForm = <LaserScan as Ros2>::Form;
/// The form of `nav_msgs/msg/Odometry`.
pub type OdometryForm = <Odometry as Ros2>::Form;

/// Why a reading was rejected.
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
    /// The timestamp cannot be right.
    #[error(
        "expected a stamp within {LIMIT_S} s of the time that has passed since the previous reading, found one that is {off_s:.1} s \
         off: a clock was set, or another robot publishes in this domain; start the bridge again if it was a clock"
    )]
    Jump {
        /// How much later the timestamp is than it should be, in seconds. Negative if it is earlier.
        off_s: f64,
    },
    /// The driver refused the reading.
    #[error(transparent)]
    Driver(#[from] DriverError),
}

const SECOND_NS: i128 = NS_PER_S as i128;

/// Maximum difference, in seconds, between a timestamp and its time of arrival, relative to the previous reading. Clocks that run
/// at another speed, as in simulators, stay far below this.
const LIMIT_S: i128 = 60;

/// Converts the robot's timestamps to simulation time. The first reading is assigned the current mission time.
#[derive(Debug, Clone, Copy)]
pub struct Timebase {
    begin_ns: u64,
    first_ns: Option<i128>,
    /// The timestamp of the last reading, in nanoseconds, and when it arrived.
    last: Option<(i128, Duration)>,
}

impl Timebase {
    /// Starts at the given simulation time, in nanoseconds.
    pub fn at(begin_ns: u64) -> Self {
        Self { begin_ns, first_ns: None, last: None }
    }

    /// Returns the simulation time of a timestamp that arrived at `now`, in nanoseconds. It is never before the start. `now` is the
    /// time since an arbitrary fixed epoch.
    ///
    /// # Errors
    /// [`ReadingError::Jump`] if the timestamp is too far from the previous one for the time that has passed.
    pub fn of(&mut self, stamp: &Time, now: Duration) -> Result<u64, ReadingError> {
        let found = i128::from(stamp.sec) * SECOND_NS + i128::from(stamp.nanosec);
        if let Some((last, arrived)) = self.last {
            let off_ns = found - last - now.saturating_sub(arrived).as_nanos() as i128;
            if off_ns.abs() > LIMIT_S * SECOND_NS {
                return Err(ReadingError::Jump { off_s: off_ns as f64 / SECOND_NS as f64 });
            }
        }
        self.last = Some((found, now));
        let first = *self.first_ns.get_or_insert(found);
        let since = u64::try_from((found - first).max(0)).unwrap_or(u64::MAX);
        Ok(self.begin_ns.saturating_add(since))
    }
}

/// Converts a scan. If it has more beams than fit into a message, it is thinned evenly.
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

/// Detects whether a topic has more than one publisher.
#[derive(Debug, Default)]
pub struct Publishers {
    first: Option<PublisherId>,
    has_several: bool,
}

impl Publishers {
    /// Records the publisher of a message. Returns true for the first message from a second publisher.
    pub fn is_second(&mut self, publisher: PublisherId) -> bool {
        let is_other = *self.first.get_or_insert(publisher) != publisher;
        is_other && !std::mem::replace(&mut self.has_several, true)
    }
}

/// Returns a notice about a topic on which nothing has arrived, listing other topics of the same type.
/// `option` selects another topic.
pub fn silent(topic: &str, kind: &str, option: &str, known: &BTreeSet<String>) -> String {
    let others: Vec<_> = known.iter().map(String::as_str).filter(|name| *name != topic).collect();
    match others[..] {
        [] => format!("nothing on {topic} yet; no other topic of type {kind} was found in this domain"),
        _ => format!(
            "nothing on {topic} yet; topics of type {kind} here: {} (see {option})",
            others.join(", ")
        ),
    }
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
        let mut of =
            |sec, nanosec, now_s| time.of(&Time { sec, nanosec }, Duration::from_secs(now_s)).unwrap();
        assert_eq!(of(1_700_000_000, 10, 3), 500);
        assert_eq!(of(1_700_000_001, 30, 4), 1_000_000_520);
        assert_eq!(of(1_699_999_999, 0, 4), 500);
    }

    /// Regression test: the timestamps of a second robot with another clock made a mission 56 years older.
    #[test]
    fn a_stamp_that_cannot_be_right_is_rejected() {
        let mut time = Timebase::at(0);
        let mut of = |sec, now_s| time.of(&Time { sec, nanosec: 0 }, Duration::from_secs(now_s));
        of(1_000, 0).unwrap();
        for sec in [1_795_867_289, 1_062, 938, 0] {
            let error = of(sec, 1).unwrap_err();
            assert!(matches!(error, ReadingError::Jump { .. }), "{sec}: {error}");
        }
        assert_eq!(of(1_001, 1).unwrap(), 1_000_000_000);
        // The robot was silent for ten minutes.
        assert_eq!(of(1_601, 601).unwrap(), 601_000_000_000);
    }

    #[test]
    fn a_second_publisher_is_noticed_once() {
        let mut publishers = Publishers::default();
        let seen = [1, 1, 2, 1, 3].map(|publisher| publishers.is_second([publisher; 16]));
        assert_eq!(seen, [false, false, true, false, false]);
    }

    #[test]
    fn a_notice_about_a_silent_topic_names_others_of_its_type() {
        let known = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<BTreeSet<_>>();
        let kind = "nav_msgs/msg/Odometry";
        assert_eq!(
            silent("/odom", kind, "--odom", &known(&["/odom", "/odometry/filtered"])),
            "nothing on /odom yet; topics of type nav_msgs/msg/Odometry here: /odometry/filtered (see --odom)"
        );
        assert_eq!(
            silent("/odom", kind, "--odom", &known(&["/odom"])),
            "nothing on /odom yet; no other topic of type nav_msgs/msg/Odometry was found in this domain"
        );
    }
}
