//! Checks the contents of messages. [`check`](crate::message::Message::check) calls the function named in the
//! message's declaration, and this file defines those for messages common to all navigators. Although the
//! type of a channel is checked when the channel is opened, its contents are whatever its writer put there,
//! and the writer may be a real robot's driver.
//!
//! Readers reject counts beyond the capacity of a list, numbers that are not finite, and headings that are
//! not a rotation. Every valid message can be recorded. Ranges follow REP 117: +∞ means that nothing
//! returned, −∞ that the object was too near, and NaN that the reading is invalid.

use crate::message::{
    DotView, Header, LaserScan, MAX_DOTS, MAX_MARKERS, MarkerView, Odometry, PoseM, SonarScan, Tick, Twist,
    VelocityCommand,
};

/// Limit for distances, in metres or pixels. No robot drives that far.
pub const FAR: f64 = 1e7;
/// Maximum number of readings of a sensor between two ticks, on average.
const MOST_READINGS: u64 = 1000;
/// Tolerance for the length of a quaternion.
const OFF_UNIT: f64 = 1e-3;

/// The condition that a number is below [`FAR`], in words.
const NEAR: &str = "a number within ±1e7";

/// The first fault found in an invalid message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Invalid {
    /// The field.
    pub field: &'static str,
    /// What was expected.
    pub expected: &'static str,
    /// What was found.
    pub found: f64,
}

impl std::fmt::Display for Invalid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { field, expected, found } = self;
        write!(f, "{field}: expected {expected}, found {found}")
    }
}

/// The result of a check.
pub type Checked = Result<(), Invalid>;

/// Checks a condition.
///
/// # Errors
/// [`Invalid`], which names the field, if the condition is false.
pub fn ensure(holds: bool, field: &'static str, expected: &'static str, found: impl Into<f64>) -> Checked {
    if holds { Ok(()) } else { Err(Invalid { field, expected, found: found.into() }) }
}

/// Checks that a count is within a capacity.
///
/// # Errors
/// [`Invalid`], which names the field, if the count is above the capacity.
pub fn count(field: &'static str, found: u32, capacity: usize) -> Checked {
    ensure(found as usize <= capacity, field, "a count within the capacity", found)
}

/// Checks that numbers are finite and below [`FAR`] in magnitude.
///
/// # Errors
/// [`Invalid`], which gives the field and the first number that is not.
pub fn near(field: &'static str, numbers: impl IntoIterator<Item = impl Into<f64>>) -> Checked {
    numbers.into_iter().map(Into::into).try_for_each(|v: f64| ensure(v.abs() < FAR, field, NEAR, v))
}

/// Checks that a number is in a range.
///
/// # Errors
/// [`Invalid`], which names the field, if the number is outside the range.
pub fn within(
    field: &'static str,
    range: impl std::ops::RangeBounds<f64>,
    expected: &'static str,
    found: impl Into<f64>,
) -> Checked {
    let found = found.into();
    ensure(range.contains(&found), field, expected, found)
}

/// Checks that the number of ranges matches the count, and that the sensor is physically possible.
pub(crate) fn scan(scan: &LaserScan) -> Checked {
    timely(&scan.header)?;
    near("angle_min_rad, angle_max_rad", [scan.angle_min_rad, scan.angle_max_rad])?;
    near("angle_increment_rad", [scan.angle_increment_rad])?;
    near("time_increment_s, scan_time_s", [scan.time_increment_s, scan.scan_time_s])?;
    limits(scan.range_min_m, scan.range_max_m)?;
    near("range_max_m", [scan.range_max_m])?;
    ranges(&scan.ranges_m, scan.beam_count)
}

/// Checks that the number of ranges matches the count, and that the cones are physically possible.
pub(crate) fn sonar(scan: &SonarScan) -> Checked {
    timely(&scan.header)?;
    near("angle_min_rad, angle_increment_rad", [scan.angle_min_rad, scan.angle_increment_rad])?;
    near("scan_time_s", [scan.scan_time_s])?;
    let half = scan.half_opening_rad;
    // π/2 in single precision is greater than in double, so the comparison is made in single precision.
    let is_opening = (0.0..=std::f32::consts::FRAC_PI_2).contains(&half);
    ensure(is_opening, "half_opening_rad", "an angle of 0 to π/2", half)?;
    within("ring_radius_m", 0.0..FAR, "a length, 0 or above", scan.ring_radius_m)?;
    limits(scan.range_min_m, scan.range_max_m)?;
    near("range_max_m", [scan.range_max_m])?;
    ranges(&scan.ranges_m, scan.sonar_count)
}

/// Checks that the markers match the count and are ordered by number, and that the camera is physically possible.
pub(crate) fn markers(view: &MarkerView) -> Checked {
    count("marker_count", view.marker_count, MAX_MARKERS)?;
    timely(&view.header)?;
    near("camera_x_m, camera_y_m, camera_yaw_rad", [view.camera_x_m, view.camera_y_m, view.camera_yaw_rad])?;
    near("frame_time_s", [view.frame_time_s])?;
    near("markers", view.markers().iter().flat_map(|marker| [marker.x_m, marker.y_m, marker.facing_rad]))?;
    let half = view.half_view_rad;
    ensure((0.0..=std::f32::consts::PI).contains(&half), "half_view_rad", "an angle of 0 to π", half)?;
    limits(view.range_min_m, view.range_max_m)?;
    near("range_max_m", [view.range_max_m])?;
    in_order(view.markers().iter().map(|marker| marker.id))
}

/// Checks that the dots match the count, and that the window is physically possible.
pub(crate) fn view(view: &DotView) -> Checked {
    count("dot_count", view.dot_count, MAX_DOTS)?;
    timely(&view.header)?;
    near("frame_time_s", [view.frame_time_s])?;
    near("dots", view.dots().iter().flat_map(|dot| [dot.x_m, dot.y_m]))?;
    ensure(view.side_m > 0.0 && f64::from(view.side_m) < FAR, "side_m", "a length above 0", view.side_m)?;
    within("margin_m", 0.0..FAR, "a length, 0 or above", view.margin_m)
}

/// Checks that a driver can have reached these numbers by this tick. Readers wait for the messages that a
/// tick refers to, so wrong numbers would do harm.
pub(crate) fn tick(tick: &Tick) -> Checked {
    timely(&tick.header)?;
    let most = tick.header.seq.saturating_mul(MOST_READINGS);
    let expected = "at most 1000 readings a tick";
    tick.newest.iter().try_for_each(|&newest| ensure(newest <= most, "newest", expected, newest as f64))
}

/// Checks a pose and a velocity.
pub(crate) fn odometry(odometry: &Odometry) -> Checked {
    timely(&odometry.header)?;
    metres("pose", &odometry.pose)?;
    twist(&odometry.twist)
}

/// Checks a velocity.
pub(crate) fn command(command: &VelocityCommand) -> Checked {
    twist(&command.twist)
}

/// Checks that the timestamp fits into a recorded message.
pub(crate) fn timely(header: &Header) -> Checked {
    let stamp_ns = header.stamp_ns;
    let is_timely = stamp_ns / 1_000_000_000 <= i32::MAX as u64;
    ensure(is_timely, "header.stamp_ns", "less than 2^31 seconds, in nanoseconds", stamp_ns as f64)
}

/// Checks a sensor's shortest and longest range.
fn limits(range_min_m: f32, range_max_m: f32) -> Checked {
    ensure(range_min_m >= 0.0, "range_min_m", "a length, 0 or above", range_min_m)?;
    ensure(range_max_m > range_min_m, "range_max_m", "a length above range_min_m", range_max_m)
}

/// Checks that there is at least one range, that each is a distance or a value of REP 117, and that everything after them is
/// zero.
fn ranges(all: &[f32], counted: u32) -> Checked {
    let split = all.split_at_checked(counted as usize).filter(|_| counted > 0);
    let Some((found, unused)) = split else {
        return Err(Invalid {
            field: "count of ranges",
            expected: "1 up to the capacity",
            found: counted.into(),
        });
    };
    let is_range = |range: f32| !range.is_finite() || (0.0..FAR as f32).contains(&range);
    let expected = "a distance, infinity or NaN";
    found.iter().try_for_each(|&range| ensure(is_range(range), "ranges_m", expected, range))?;
    let expected = "zeros after those that are counted";
    unused.iter().try_for_each(|range| ensure(range.to_bits() == 0, "ranges_m", expected, *range))
}

/// Checks that numbers increase.
///
/// # Errors
/// [`Invalid`], which gives the first number that is not above the one before.
pub fn in_order(ids: impl Iterator<Item = u32> + Clone) -> Checked {
    let mut pairs = ids.clone().zip(ids.skip(1));
    pairs
        .try_for_each(|(before, id)| ensure(before < id, "markers.id", "a number above the previous one", id))
}

/// Checks that the coordinates of a pose, in metres, are not too large, and that its orientation is valid.
///
/// # Errors
/// [`Invalid`] with the field.
pub fn metres(field: &'static str, pose: &PoseM) -> Checked {
    near(field, [pose.x_m, pose.y_m])?;
    rotation(field, [pose.orientation_z, pose.orientation_w])
}

fn twist(twist: &Twist) -> Checked {
    near("twist", [twist.vx_mps, twist.vy_mps, twist.yaw_rate_radps])
}

/// Checks that z and w are those of a unit quaternion.
///
/// # Errors
/// [`Invalid`], which gives the field and the length of the quaternion.
pub fn rotation(field: &'static str, [z, w]: [f64; 2]) -> Checked {
    let length = z.hypot(w);
    ensure((length - 1.0).abs() < OFF_UNIT, field, "an orientation of length 1", length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Message;
    use crate::ros2::Ros2;
    use crate::samples::{Spoil, rejected};
    use bytemuck::Zeroable;

    fn valid_scan() -> LaserScan {
        let mut scan = LaserScan::zeroed();
        (scan.angle_min_rad, scan.angle_max_rad, scan.angle_increment_rad) = (-1.0, 1.0, 0.5);
        (scan.range_max_m, scan.beam_count) = (5.0, 5);
        scan
    }

    #[test]
    fn a_view_has_each_marker_once_and_a_possible_camera() {
        let mut valid = MarkerView::zeroed();
        (valid.half_view_rad, valid.range_min_m, valid.range_max_m) = (0.5, 0.8, 3.5);
        assert!(valid.is_valid(), "no marker is in view");
        valid.marker_count = 2;
        (valid.markers[0].id, valid.markers[1].id, valid.markers[1].x_m) = (3, 7, 2.0);
        rejected(
            valid,
            &[
                |view| view.marker_count = 33,
                |view| view.markers[1].id = 3,
                |view| view.markers[0].y_m = f32::NAN,
                |view| view.markers[1].facing_rad = f32::INFINITY,
                |view| view.half_view_rad = -0.1,
                |view| view.range_max_m = 0.8,
                |view| view.camera_x_m = f32::NAN,
            ],
        );
    }

    #[test]
    fn a_view_of_dots_matches_its_count() {
        let mut valid = DotView::zeroed();
        (valid.side_m, valid.dot_count, valid.dots[1].x_m) = (0.1, 2, -0.05);
        rejected(
            valid,
            &[
                |view| view.dot_count = 65,
                |view| view.side_m = 0.0,
                |view| view.margin_m = -0.1,
                |view| view.dots[1].y_m = f32::NAN,
                |view| view.header.stamp_ns = u64::MAX,
            ],
        );
    }

    #[test]
    fn a_scan_matches_its_count_and_has_a_possible_sensor() {
        let mut valid = valid_scan();
        valid.ranges_m[..4].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 4.9]);
        rejected(
            valid,
            &[
                |scan| scan.beam_count = 0,
                |scan| scan.beam_count = 1441,
                |scan| scan.beam_count = u32::MAX,
                |scan| scan.angle_increment_rad = f32::NAN,
                |scan| scan.angle_min_rad = f32::INFINITY,
                |scan| scan.range_max_m = 0.0,
                |scan| scan.range_min_m = -1.0,
                |scan| scan.ranges_m[4] = -0.5,
                |scan| scan.ranges_m[4] = 1e30,
                |scan| scan.ranges_m[5] = 1.0,
                |scan| scan.header.stamp_ns = u64::MAX,
            ],
        );
    }

    #[test]
    fn a_sonar_ring_matches_its_count_and_has_possible_cones() {
        let mut valid = SonarScan::zeroed();
        (valid.sonar_count, valid.half_opening_rad, valid.range_max_m) = (4, 0.2, 6.0);
        valid.ranges_m[..3].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY, 5.0]);
        rejected(
            valid,
            &[
                |scan| scan.sonar_count = 0,
                |scan| scan.sonar_count = 33,
                |scan| scan.half_opening_rad = 3.0,
                |scan| scan.half_opening_rad = f32::NAN,
                |scan| scan.ring_radius_m = -1.0,
                |scan| scan.angle_increment_rad = f32::INFINITY,
                |scan| scan.range_max_m = 0.0,
                |scan| scan.range_min_m = f32::NAN,
                |scan| scan.ranges_m[3] = -0.5,
                |scan| scan.ranges_m[4] = 1.0,
                |scan| scan.header.stamp_ns = u64::MAX,
            ],
        );
    }

    /// Regression test: a driver left old ranges after those in use. The robot drove well but its scans were missing from the
    /// recording, because the navigators accepted what the recorder rejected.
    #[test]
    fn valid_messages_can_be_recorded() {
        let spoils: [Spoil<LaserScan>; 6] = [
            |_| {},
            |scan| scan.ranges_m[5] = 1.0,
            |scan| scan.ranges_m[1439] = -0.0,
            |scan| scan.beam_count = 4,
            |scan| scan.header.stamp_ns = (1 << 31) * 1_000_000_000 - 1,
            |scan| scan.header.stamp_ns = (1 << 31) * 1_000_000_000,
        ];
        let is_both = spoils.map(|spoil| {
            let mut scan = valid_scan();
            scan.ranges_m[4] = 1.0;
            (scan.header.seq, scan.header.source_seq) = (1, 1);
            spoil(&mut scan);
            let is_recordable = scan.to_cdr(&[], &mut Vec::new()).is_ok();
            assert_eq!(scan.is_valid(), is_recordable);
            is_recordable
        });
        assert_eq!(is_both, [true, false, false, false, true, false]);
    }

    /// Regression test: messages were counted as rejected, but no reason was given.
    #[test]
    fn invalid_messages_have_a_reason() {
        let mut half = Odometry::zeroed();
        half.pose.orientation_w = 0.5;
        assert_eq!(
            half.check().unwrap_err().to_string(),
            "pose: expected an orientation of length 1, found 0.5"
        );
        let mut scan = valid_scan();
        scan.ranges_m[3] = -1.0;
        let reason = scan.check().unwrap_err().to_string();
        assert_eq!(reason, "ranges_m: expected a distance, infinity or NaN, found -1");
        assert_eq!(valid_scan().check(), Ok(()));
    }

    #[test]
    fn a_pose_is_a_place_and_a_rotation() {
        let mut odometry = Odometry::zeroed();
        odometry.pose.orientation_w = -1.0;
        rejected(
            odometry,
            &[
                |odometry| odometry.pose.orientation_w = 0.0,
                |odometry| odometry.pose.orientation_z = f64::NAN,
                |odometry| odometry.pose.x_m = f64::INFINITY,
                |odometry| odometry.pose.y_m = -1e300,
                |odometry| odometry.twist.yaw_rate_radps = f64::NAN,
                |odometry| odometry.header.stamp_ns = u64::MAX,
            ],
        );
        rejected(VelocityCommand::zeroed(), &[|command| command.twist.vx_mps = f64::NAN]);
    }
}
