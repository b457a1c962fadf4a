//! The beams of a scan that the filter uses, in the robot's axes.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::{LaserScan, MAX_BEAMS};
use sketchnav_schemas::robot::Laser;

/// The pose at which a laser is mounted on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mounting {
    /// Distance forward of the robot's centre, in metres.
    pub x_m: f32,
    /// Distance to the left of the robot's centre, in metres.
    pub y_m: f32,
    /// Direction of the sensor's forward axis, in radians.
    pub yaw_rad: f32,
}

impl From<&Laser> for Mounting {
    fn from(laser: &Laser) -> Self {
        let mount = laser.mount();
        Self { x_m: mount.x as f32, y_m: mount.y as f32, yaw_rad: mount.yaw_rad as f32 }
    }
}

/// Minimum range of a valid reading, in metres.
pub const SHORTEST_M: f32 = 0.05;

/// An even selection of a scan's valid beams, with one array per property.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Beams {
    /// Directions in the robot's axes, in radians.
    pub angle_rad: Vec<f32>,
    /// Forward components of the unit vectors in these directions.
    pub forward: Vec<f32>,
    /// Leftward components of the unit vectors in these directions.
    pub left: Vec<f32>,
    /// Measured ranges, in metres, or the sensor's maximum range if nothing returned.
    pub range_m: Vec<f32>,
    /// Binary logarithms of the ranges in metres.
    pub log2_range: Vec<f32>,
    /// Whether each beam returned.
    pub returned: Vec<bool>,
    /// End points of the beams that returned, as forward and leftward components in the robot's axes, in metres.
    pub end_m: Vec<[f32; 2]>,
    /// Position of the sensor in the robot's axes, in metres.
    pub origin_m: [f32; 2],
    /// Maximum range of the sensor, in metres.
    pub range_max_m: f32,
}

impl Beams {
    /// Creates buffers for `capacity` beams, so that [`Self::select`] does not allocate.
    pub fn with_capacity(capacity: usize) -> Self {
        let room = || Vec::with_capacity(capacity.min(MAX_BEAMS));
        Self {
            angle_rad: room(),
            forward: room(),
            left: room(),
            range_m: room(),
            log2_range: room(),
            returned: Vec::with_capacity(capacity.min(MAX_BEAMS)),
            end_m: Vec::with_capacity(capacity.min(MAX_BEAMS)),
            origin_m: [0.0; 2],
            range_max_m: 0.0,
        }
    }

    /// Returns the number of beams.
    pub fn len(&self) -> usize {
        self.range_m.len()
    }

    /// Returns true if there are no beams.
    pub fn is_empty(&self) -> bool {
        self.range_m.is_empty()
    }

    /// Selects at most `wanted` evenly spread beams of `scan`, and drops invalid ones (NaN, or too near). Beams without return (+∞,
    /// or at least the maximum range) are kept and marked as such.
    pub fn select(&mut self, scan: &LaserScan, mounting: &Mounting, wanted: usize) {
        self.clear();
        self.origin_m = [mounting.x_m, mounting.y_m];
        self.range_max_m = scan.range_max_m.max(SHORTEST_M);
        let (ranges, nearest) = (scan.ranges(), scan.range_min_m.max(SHORTEST_M));
        let wanted = wanted.min(ranges.len());
        for k in 0..wanted {
            let i = (2 * k + 1) * ranges.len() / (2 * wanted);
            if ranges[i] >= nearest {
                self.push(scan.angle_rad(i) + mounting.yaw_rad, ranges[i]);
            }
        }
    }

    pub(super) fn push(&mut self, angle_rad: f32, measured_m: f32) {
        let range_m = measured_m.min(self.range_max_m);
        let (left, forward) = angle_rad.sin_cos();
        self.angle_rad.push(angle_rad);
        self.forward.push(forward);
        self.left.push(left);
        self.range_m.push(range_m);
        self.log2_range.push(range_m.log2());
        self.returned.push(measured_m < self.range_max_m);
        if measured_m < self.range_max_m {
            self.end_m.push([self.origin_m[0] + range_m * forward, self.origin_m[1] + range_m * left]);
        }
    }

    fn clear(&mut self) {
        self.angle_rad.clear();
        self.forward.clear();
        self.left.clear();
        self.range_m.clear();
        self.log2_range.clear();
        self.returned.clear();
        self.end_m.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn scan(ranges: &[f32]) -> LaserScan {
        let mut scan = LaserScan::zeroed();
        scan.beam_count = ranges.len() as u32;
        scan.angle_min_rad = -1.0;
        scan.angle_increment_rad = 2.0 / (ranges.len() - 1) as f32;
        scan.range_min_m = 0.1;
        scan.range_max_m = 5.0;
        scan.ranges_m[..ranges.len()].copy_from_slice(ranges);
        scan
    }

    #[test]
    fn invalid_beams_are_left_out_and_lost_ones_are_not() {
        let mut beams = Beams::with_capacity(8);
        beams.select(&scan(&[1.0, f32::NAN, f32::INFINITY, 0.01, 5.0]), &Mounting::default(), 8);
        assert_eq!(beams.range_m, [1.0, 5.0, 5.0]);
        assert_eq!(beams.returned, [true, false, false]);
        assert!((beams.angle_rad[1]).abs() < 1e-6);
    }

    #[test]
    fn the_selection_is_even() {
        let mut beams = Beams::with_capacity(4);
        beams.select(&scan(&[1.0; 101]), &Mounting { yaw_rad: 0.5, ..Mounting::default() }, 4);
        let steps: Vec<f32> = beams.angle_rad.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps.iter().all(|s| (s - 0.5).abs() < 0.03), "{steps:?}");
        assert!((beams.angle_rad.iter().sum::<f32>() / 4.0 - 0.5).abs() < 0.03);
    }
}
