//! Parameters of local mapping. The same set is used for all robots and buildings.

use sketchnav_schemas::message::MAX_BEAMS;

use crate::Error;
use crate::occupancy::TILE;

/// Standard deviations of the odometry's errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryNoise {
    /// Position error in metres per metre driven.
    pub position_per_m: f64,
    /// Heading error in radians per metre driven.
    pub yaw_per_m: f64,
    /// Heading error in radians per radian turned.
    pub yaw_per_rad: f64,
    /// Constant part of the position error, in metres.
    pub position_floor_m: f64,
    /// Constant part of the heading error, in radians.
    pub yaw_floor_rad: f64,
}

/// Parameters of the mapper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Length of a cell's side, in metres.
    pub cell_m: f64,
    /// Side length of the square that the map covers, centred on its origin, in metres. Cells outside are dropped.
    pub extent_m: f64,
    /// Maximum number of tiles of 32 by 32 cells. This bounds the map's memory, at 1.25 KiB per tile.
    pub max_tiles: usize,
    /// Maximum range of beams that change the map, in metres.
    pub mapping_range_m: f64,
    /// Maximum range at which a beam without a return clears free space, in metres. Zero if such beams are ignored.
    pub open_range_m: f64,
    /// Maximum range of beams that are matched, in metres.
    pub matching_range_m: f64,
    /// Maximum number of points of a scan that are matched.
    pub max_points: usize,
    /// Uncertainty of the odometry.
    pub odometry: OdometryNoise,
    /// Half the side and half the angle of the search window, in standard deviations of the odometry's errors.
    pub window_sigmas: f64,
    /// Half the side of the largest search window, in metres.
    pub window_max_m: f64,
    /// Half the angle of the largest search window, in radians.
    pub window_max_rad: f64,
    /// Standard deviation of range readings from a wall, in metres.
    pub blur_m: f64,
    /// Log odds of a scan that fits perfectly versus one that does not fit at all. Since the beams of a scan
    /// are not independent, this also reflects how many of them effectively count.
    pub evidence: f64,
    /// Distance travelled between matched scans, in metres.
    pub match_m: f64,
    /// Angle turned between matched scans, in radians.
    pub match_rad: f64,
    /// Distance travelled between scans that are entered into the map, in metres.
    pub enter_m: f64,
    /// Angle turned between scans that are entered into the map, in radians.
    pub enter_rad: f64,
    /// Number of scans after which a stationary robot enters another one, so that people who have left disappear from the map.
    pub enter_scans: u32,
}

impl Default for Parameters {
    fn default() -> Self {
        let odometry = OdometryNoise {
            position_per_m: 0.15,
            yaw_per_m: 0.12,
            yaw_per_rad: 0.1,
            position_floor_m: 0.02,
            yaw_floor_rad: 0.01,
        };
        Self {
            cell_m: 0.05,
            extent_m: 102.4,
            max_tiles: 1024,
            mapping_range_m: 8.0,
            open_range_m: 0.0,
            matching_range_m: 12.0,
            max_points: 180,
            odometry,
            window_sigmas: 3.0,
            window_max_m: 0.6,
            window_max_rad: 0.5,
            blur_m: 0.08,
            evidence: 400.0,
            match_m: 0.1,
            match_rad: 0.1,
            enter_m: 0.2,
            enter_rad: 0.2,
            enter_scans: 50,
        }
    }
}

impl Parameters {
    /// Returns the default parameters for a laser with the given range.
    pub fn for_range(range_max_m: f64) -> Self {
        let usual = Self::default();
        Self {
            open_range_m: range_max_m.min(usual.mapping_range_m),
            matching_range_m: range_max_m.min(usual.matching_range_m),
            ..usual
        }
    }

    /// Returns the maximum number of cells along a side of a map.
    pub fn cells_per_side(&self) -> usize {
        self.tiles_per_side() * TILE
    }

    /// Returns the maximum number of tiles along a side of a map.
    pub(crate) fn tiles_per_side(&self) -> usize {
        (self.extent_m / (self.cell_m * TILE as f64)).ceil() as usize
    }

    /// Checks that all parameters are within bounds. These limit the memory and the work of the mapper.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first parameter that is out of bounds.
    pub fn check(&self) -> Result<(), Error> {
        let noise = &self.odometry;
        let bounds = [
            ("cell_m", self.cell_m, 0.02, 0.5, "0.02 to 0.5"),
            ("extent_m", self.extent_m, 1.0, 1000.0, "1 to 1000"),
            ("max_tiles", self.max_tiles as f64, 1.0, 65_000.0, "1 to 65000"),
            ("mapping_range_m", self.mapping_range_m, 0.5, 30.0, "0.5 to 30"),
            ("open_range_m", self.open_range_m, 0.0, self.mapping_range_m, "0 to mapping_range_m"),
            ("matching_range_m", self.matching_range_m, 0.5, 30.0, "0.5 to 30"),
            ("max_points", self.max_points as f64, 10.0, MAX_BEAMS as f64, "10 to 1440"),
            ("odometry.position_per_m", noise.position_per_m, 0.0, 2.0, "0 to 2"),
            ("odometry.yaw_per_m", noise.yaw_per_m, 0.0, 2.0, "0 to 2"),
            ("odometry.yaw_per_rad", noise.yaw_per_rad, 0.0, 2.0, "0 to 2"),
            ("odometry.position_floor_m", noise.position_floor_m, 0.001, 1.0, "0.001 to 1"),
            ("odometry.yaw_floor_rad", noise.yaw_floor_rad, 0.001, 1.0, "0.001 to 1"),
            ("window_sigmas", self.window_sigmas, 0.5, 10.0, "0.5 to 10"),
            ("window_max_m", self.window_max_m, 0.0, 2.0, "0 to 2"),
            ("window_max_rad", self.window_max_rad, 0.0, 1.0, "0 to 1"),
            ("blur_m", self.blur_m, 0.5 * self.cell_m, 4.0 * self.cell_m, "half a cell to 4 cells"),
            ("evidence", self.evidence, 0.1, 10_000.0, "0.1 to 10000"),
            ("match_m", self.match_m, 0.0, 10.0, "0 to 10"),
            ("match_rad", self.match_rad, 0.0, 7.0, "0 to 7"),
            ("enter_m", self.enter_m, 0.0, 10.0, "0 to 10"),
            ("enter_rad", self.enter_rad, 0.0, 7.0, "0 to 7"),
        ];
        let is_within = |&(_, found, low, high, _): &(_, f64, f64, f64, _)| low <= found && found <= high;
        match bounds.iter().find(|bound| !is_within(bound)) {
            Some(&(name, found, _, _, expected)) => Err(Error::Parameter { name, expected, found }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_out_of_bounds_is_named() {
        assert_eq!(Parameters::default().check(), Ok(()));
        let wrong = Parameters { cell_m: f64::NAN, ..Parameters::default() };
        assert_eq!(
            wrong.check().unwrap_err().to_string(),
            "parameter cell_m: expected 0.02 to 0.5, found NaN"
        );
        let wrong = Parameters { max_tiles: 0, ..Parameters::default() };
        assert!(wrong.check().unwrap_err().to_string().contains("max_tiles"));
    }
}
