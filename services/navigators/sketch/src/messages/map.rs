//! The ROS 2 form of the drawing. It is mapped by hand because it contains a `nav_msgs/OccupancyGrid`.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::PosePx;
use sketchnav_schemas::ros2::forms::{
    builtin_interfaces::msg::Time,
    geometry_msgs::msg::Pose,
    nav_msgs::msg::{MapMetaData, OccupancyGrid},
    std_msgs::msg::Header as HeaderForm,
};
use sketchnav_schemas::ros2::parts::{expect, header, header_form};
use sketchnav_schemas::ros2::{Definition, Field, Ros2, Ros2Error, pose};

use super::SketchMap;
use crate::filter::Start;

/// The ROS 2 message `sketchnav_msgs/msg/SketchMap`.
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

/// The `.msg` text. Its fields match those of [`SketchMapForm`].
const SKETCH_MAP: &str = include_str!("SketchMap.msg");

/// Where a sketch comes from, which determines by what means a robot drives in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A person drew it.
    Drawn,
    /// It is a picture of a map with the tones of map_server, so its proportions are exact. Its scale is unknown.
    Surveyed,
    /// It is a map learned by a robot. It has [`CELLS_PER_M`](crate::learned::CELLS_PER_M) pixels per metre, and the robot may start
    /// anywhere in it.
    Learned,
}

impl SketchMap {
    /// Pen width that marks a sketch as [`Origin::Learned`].
    pub const NO_PEN_PX: f64 = -1.0;
    /// Pen width that marks a sketch as [`Origin::Surveyed`].
    pub const SURVEYED_PX: f64 = -2.0;

    /// Returns where the sketch comes from.
    pub fn origin(&self) -> Origin {
        match self.pen_width_px {
            pen_px if pen_px <= Self::SURVEYED_PX => Origin::Surveyed,
            pen_px if pen_px < 0.0 => Origin::Learned,
            _ => Origin::Drawn,
        }
    }

    /// Returns the start with its uncertainty, which shows whether the robot may be anywhere.
    pub fn start(&self) -> Start {
        Start { pose: self.start.pose(), spread_px: self.start_spread_px, spread_rad: self.start_spread_rad }
    }

    /// Returns true if the sketch is a map that a robot has learned.
    pub fn is_learned(&self) -> bool {
        self.origin() == Origin::Learned
    }

    /// Returns the cells as an occupancy grid, reusing the memory of `spare`.
    ///
    /// # Errors
    /// [`Ros2Error`] if the number of cells is not width × height, or if the header cannot be converted.
    pub fn grid(&self, cells: &[u8], spare: OccupancyGrid) -> Result<OccupancyGrid, Ros2Error> {
        let size = u64::from(self.width_px) * u64::from(self.height_px);
        let count = cells.len() as u64;
        expect(size == count, "cells", "width_px × height_px cells after the message", count)?;
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

    fn from_ros2(form: SketchMapForm, seq: u64) -> Result<(Self, Vec<u8>), Ros2Error> {
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
