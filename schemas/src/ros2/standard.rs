//! Messages that are standard ROS 2 messages, mapped by hand. Nothing is recomputed, so every number keeps
//! its bits.

use bytemuck::Zeroable;
use ros2_interfaces_jazzy_serde::{
    geometry_msgs::msg::{Pose, PoseWithCovariance, Twist as TwistForm, TwistWithCovariance},
    nav_msgs::msg::Odometry as OdometryForm,
    sensor_msgs::msg::LaserScan as LaserScanForm,
    std_msgs::msg::Header as HeaderForm,
};

use super::parts::{fill, header, list, no_cells, reading_form, string};
use super::{Field, Ros2, Ros2Error};
use crate::message::{GroundTruth, LaserScan, Odometry, PoseM, Twist};

/// The result of reading a message: the message and its slice, which is empty here.
type Read<T> = Result<(T, Vec<u8>), Ros2Error>;

fn alone<T>(message: T) -> Read<T> {
    Ok((message, Vec::new()))
}

impl Ros2 for LaserScan {
    type Form = LaserScanForm;
    const TYPE: &'static str = "sensor_msgs/msg/LaserScan";

    fn to_ros2_in(&self, cells: &[u8], spare: LaserScanForm) -> Result<LaserScanForm, Ros2Error> {
        no_cells(cells)?;
        Ok(LaserScanForm {
            header: reading_form(&self.header, "laser", spare.header)?,
            angle_min: self.angle_min_rad,
            angle_max: self.angle_max_rad,
            angle_increment: self.angle_increment_rad,
            time_increment: self.time_increment_s,
            scan_time: self.scan_time_s,
            range_min: self.range_min_m,
            range_max: self.range_max_m,
            ranges: list("ranges_m", &self.ranges_m, self.beam_count, spare.ranges)?,
            intensities: Vec::new(),
        })
    }

    fn from_ros2(form: LaserScanForm, seq: u64) -> Read<Self> {
        let mut scan = Self {
            header: header(&form.header, seq, seq)?,
            angle_min_rad: form.angle_min,
            angle_max_rad: form.angle_max,
            angle_increment_rad: form.angle_increment,
            time_increment_s: form.time_increment,
            scan_time_s: form.scan_time,
            range_min_m: form.range_min,
            range_max_m: form.range_max,
            ..Self::zeroed()
        };
        scan.beam_count = fill("ranges_m", &mut scan.ranges_m, &form.ranges)?;
        alone(scan)
    }
}

fn odometry_form(header: HeaderForm, child_frame_id: String, pose: Pose, twist: TwistForm) -> OdometryForm {
    OdometryForm {
        header,
        child_frame_id,
        pose: PoseWithCovariance { pose, covariance: [0.0; 36] },
        twist: TwistWithCovariance { twist, covariance: [0.0; 36] },
    }
}

macro_rules! odometry {
    ($message:ident, $frame:literal) => {
        impl Ros2 for $message {
            type Form = OdometryForm;
            const TYPE: &'static str = "nav_msgs/msg/Odometry";

            fn to_ros2_in(&self, cells: &[u8], spare: OdometryForm) -> Result<OdometryForm, Ros2Error> {
                no_cells(cells)?;
                let header = reading_form(&self.header, $frame, spare.header)?;
                let child = string("base_link", spare.child_frame_id);
                let pose = self.pose.to_form_in("pose", Pose::default())?;
                let twist = self.twist.to_form_in("twist", TwistForm::default())?;
                Ok(odometry_form(header, child, pose, twist))
            }

            fn from_ros2(form: OdometryForm, seq: u64) -> Read<Self> {
                let header = header(&form.header, seq, seq)?;
                let pose = PoseM::from_form(&form.pose.pose)?;
                alone(Self { header, pose, twist: Twist::from_form(&form.twist.twist)? })
            }
        }
    };
}

odometry!(Odometry, "odom");
odometry!(GroundTruth, "world");
