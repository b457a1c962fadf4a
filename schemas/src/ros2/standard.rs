//! Messages that are, or hold, standard ROS 2 messages, mapped by hand. No computation: every number keeps
//! its bits.

use bytemuck::Zeroable;
use ros2_interfaces_jazzy_serde::{
    builtin_interfaces::msg::Time,
    geometry_msgs::msg::{Pose, PoseWithCovariance, Twist as TwistForm, TwistWithCovariance},
    nav_msgs::msg::{MapMetaData, OccupancyGrid, Odometry as OdometryForm},
    sensor_msgs::msg::LaserScan as LaserScanForm,
    std_msgs::msg::Header as HeaderForm,
};
use serde::{Deserialize, Serialize};

use super::fields::pose;
use super::parts::{expect, fill, header, header_form, list, no_cells, reading_form, string};
use super::{Definition, Field, Ros2, Ros2Error};
use crate::message::{GroundTruth, LaserScan, Odometry, PoseM, PosePx, SketchMap, Twist};

/// A message and no slice behind it.
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

/// `sketchnav_msgs/msg/SketchMap`.
#[derive(Default, Serialize, Deserialize)]
pub struct SketchMapForm {
    header: HeaderForm,
    source_seq: u64,
    grid: OccupancyGrid,
    wall_direction_rad: f64,
    pen_width_px: f64,
    start: Pose,
    start_spread_px: f64,
    start_spread_rad: f64,
}

/// Field for field [`SketchMapForm`].
const SKETCH_MAP: &str = include_str!("../../msg/sketchnav_msgs/SketchMap.msg");

impl SketchMap {
    /// The cells alone.
    pub(super) fn grid(&self, cells: &[u8], spare: OccupancyGrid) -> Result<OccupancyGrid, Ros2Error> {
        let size = u64::from(self.width_px) * u64::from(self.height_px);
        let count = cells.len() as u64;
        expect(size == count, "cells", "width_px × height_px cells behind the message", count)?;
        let info = MapMetaData {
            map_load_time: Time { sec: 0, nanosec: 0 },
            resolution: 1.0,
            width: self.width_px,
            height: self.height_px,
            origin: pose(0.0, 0.0, 0.0, 1.0),
        };
        let header = header_form(&self.header, "sketch", spare.header)?;
        let mut data = spare.data;
        data.clear();
        data.extend_from_slice(bytemuck::cast_slice(cells));
        Ok(OccupancyGrid { header, info, data })
    }
}

impl Ros2 for SketchMap {
    type Form = SketchMapForm;
    const TYPE: &'static str = "sketchnav_msgs/msg/SketchMap";

    fn definitions() -> Vec<Definition> {
        vec![Definition { name: "sketchnav_msgs/SketchMap", text: SKETCH_MAP.to_owned() }]
    }

    fn to_ros2_in(&self, cells: &[u8], spare: SketchMapForm) -> Result<SketchMapForm, Ros2Error> {
        Ok(SketchMapForm {
            header: header_form(&self.header, "sketch", spare.header)?,
            grid: self.grid(cells, spare.grid)?,
            source_seq: self.header.source_seq,
            wall_direction_rad: self.wall_direction_rad,
            pen_width_px: self.pen_width_px,
            start: self.start.to_form_in("start", spare.start)?,
            start_spread_px: self.start_spread_px,
            start_spread_rad: self.start_spread_rad,
        })
    }

    fn from_ros2(form: SketchMapForm, seq: u64) -> Read<Self> {
        let sketch = Self {
            header: header(&form.header, seq, form.source_seq)?,
            width_px: form.grid.info.width,
            height_px: form.grid.info.height,
            wall_direction_rad: form.wall_direction_rad,
            pen_width_px: form.pen_width_px,
            start: PosePx::from_form(&form.start)?,
            start_spread_px: form.start_spread_px,
            start_spread_rad: form.start_spread_rad,
        };
        Ok((sketch, bytemuck::cast_slice(&form.grid.data).to_vec()))
    }
}
