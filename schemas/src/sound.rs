//! Whether a message can be what it says. A channel's type is checked when it is opened; its contents are
//! whatever its writer put there, a real robot's driver among them.
//!
//! What is refused here, nobody has to fear behind the reader: counts beyond the list, numbers that are none,
//! headings that are no rotation. What passes can be recorded, too. Ranges follow REP 117: +∞ no return, −∞ too near, NaN invalid.

use crate::message::{
    Header, LaserScan, Message, Odometry, PoseEstimate, PoseM, PosePx, SonarScan, Twist, VelocityCommand,
};

/// Farther than any robot drives, metres or pixels.
const FAR: f64 = 1e7;
/// What a quaternion's length may be off by.
const OFF_UNIT: f64 = 1e-3;

/// A message whose contents can be checked.
pub trait Sound: Message {
    /// Whether the message can be what it says.
    fn is_sound(&self) -> bool;
}

impl Sound for LaserScan {
    fn is_sound(&self) -> bool {
        let Some((counted, behind)) = self.ranges_m.split_at_checked(self.beam_count as usize) else {
            return false;
        };
        let numbers = [
            self.angle_min_rad,
            self.angle_max_rad,
            self.angle_increment_rad,
            self.time_increment_s,
            self.scan_time_s,
            self.range_min_m,
            self.range_max_m,
        ];
        timely(&self.header)
            && numbers.iter().all(|v| v.abs() < FAR as f32)
            && self.range_min_m >= 0.0
            && self.range_max_m > self.range_min_m
            && ranges(counted, behind)
    }
}

impl Sound for SonarScan {
    fn is_sound(&self) -> bool {
        let Some((counted, behind)) = self.ranges_m.split_at_checked(self.sonar_count as usize) else {
            return false;
        };
        let numbers = [self.angle_min_rad, self.angle_increment_rad, self.scan_time_s, self.range_max_m];
        timely(&self.header)
            && numbers.iter().all(|v| v.abs() < FAR as f32)
            && (0.0..=std::f32::consts::FRAC_PI_2).contains(&self.half_opening_rad)
            && (0.0..FAR as f32).contains(&self.ring_radius_m)
            && self.range_min_m >= 0.0
            && self.range_max_m > self.range_min_m
            && ranges(counted, behind)
    }
}

impl Sound for Odometry {
    fn is_sound(&self) -> bool {
        timely(&self.header) && metres(&self.pose) && twist(&self.twist)
    }
}

impl Sound for PoseEstimate {
    fn is_sound(&self) -> bool {
        let scales = [self.scale_a_pxpm, self.scale_b_pxpm];
        pixels(&self.pose) && metres(&self.odometry) && scales.iter().all(|scale| (0.0..FAR).contains(scale))
    }
}

impl Sound for VelocityCommand {
    fn is_sound(&self) -> bool {
        twist(&self.twist)
    }
}

/// Whether the stamp has room in a recorded message.
fn timely(header: &Header) -> bool {
    header.stamp_ns / 1_000_000_000 <= i32::MAX as u64
}

/// Whether there are ranges, each a distance or what REP 117 says, and nothing behind them.
fn ranges(counted: &[f32], behind: &[f32]) -> bool {
    let is_range = |range: &f32| !range.is_finite() || (0.0..FAR as f32).contains(range);
    !counted.is_empty() && counted.iter().all(is_range) && behind.iter().all(|range| range.to_bits() == 0)
}

fn metres(pose: &PoseM) -> bool {
    near([pose.x_m, pose.y_m]) && rotation([pose.orientation_z, pose.orientation_w])
}

fn pixels(pose: &PosePx) -> bool {
    near([pose.x_px, pose.y_px]) && rotation([pose.orientation_z, pose.orientation_w])
}

fn twist(twist: &Twist) -> bool {
    near([twist.vx_mps, twist.vy_mps]) && twist.yaw_rate_radps.abs() < FAR
}

/// False for NaN too.
fn near(numbers: [f64; 2]) -> bool {
    numbers.iter().all(|v| v.abs() < FAR)
}

fn rotation([z, w]: [f64; 2]) -> bool {
    (z.hypot(w) - 1.0).abs() < OFF_UNIT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::Ros2;
    use bytemuck::Zeroable;

    fn scan() -> LaserScan {
        let mut scan = LaserScan::zeroed();
        (scan.angle_min_rad, scan.angle_max_rad, scan.angle_increment_rad) = (-1.0, 1.0, 0.5);
        (scan.range_max_m, scan.beam_count) = (5.0, 5);
        scan
    }

    /// A way to spoil a message.
    type Spoil<T> = fn(&mut T);

    fn refused<T: Sound>(sound: T, spoils: &[Spoil<T>]) {
        assert!(sound.is_sound());
        for (i, spoil) in spoils.iter().enumerate() {
            let mut spoilt = sound;
            spoil(&mut spoilt);
            assert!(!spoilt.is_sound(), "{} {i}", T::NAME);
        }
    }

    #[test]
    fn a_scan_has_as_many_ranges_as_it_says_and_a_sensor_that_can_be() {
        let mut sound = scan();
        sound.ranges_m[..4].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 4.9]);
        refused(
            sound,
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
    fn a_sonar_ring_has_as_many_ranges_as_it_says_and_cones_that_can_be() {
        let mut sound = SonarScan::zeroed();
        (sound.sonar_count, sound.half_opening_rad, sound.range_max_m) = (4, 0.2, 6.0);
        sound.ranges_m[..3].copy_from_slice(&[f32::INFINITY, f32::NEG_INFINITY, 5.0]);
        refused(
            sound,
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

    /// A driver that left old ranges behind those that count drove well and had no scan in its recording: the
    /// navigators took what the recorder refused.
    #[test]
    fn what_is_sound_can_be_recorded() {
        let spoils: [Spoil<LaserScan>; 6] = [
            |_| {},
            |scan| scan.ranges_m[5] = 1.0,
            |scan| scan.ranges_m[1439] = -0.0,
            |scan| scan.beam_count = 4,
            |scan| scan.header.stamp_ns = (1 << 31) * 1_000_000_000 - 1,
            |scan| scan.header.stamp_ns = (1 << 31) * 1_000_000_000,
        ];
        let is_both = spoils.map(|spoil| {
            let mut scan = scan();
            scan.ranges_m[4] = 1.0;
            (scan.header.seq, scan.header.source_seq) = (1, 1);
            spoil(&mut scan);
            let is_recordable = scan.to_cdr(&[], &mut Vec::new()).is_ok();
            assert_eq!(scan.is_sound(), is_recordable);
            is_recordable
        });
        assert_eq!(is_both, [true, false, false, false, true, false]);
    }

    #[test]
    fn a_pose_is_a_place_and_a_rotation() {
        let mut odometry = Odometry::zeroed();
        odometry.pose.orientation_w = -1.0;
        refused(
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
        let mut estimate = PoseEstimate::zeroed();
        (estimate.pose.orientation_w, estimate.odometry.orientation_z) = (1.0, 1.0);
        refused(
            estimate,
            &[
                |estimate| estimate.pose.x_px = f64::NAN,
                |estimate| estimate.scale_a_pxpm = -1.0,
                |estimate| estimate.scale_b_pxpm = f64::NAN,
                |estimate| estimate.odometry.orientation_z = 0.5,
            ],
        );
        refused(VelocityCommand::zeroed(), &[|command| command.twist.vx_mps = f64::NAN]);
    }
}
