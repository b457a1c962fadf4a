//! Parameters of local mapping. One set serves all robots and buildings.

use sketchnav_schemas::message::MAX_BEAMS;

use crate::Error;
use crate::occupancy::TILE;

/// How far odometry may be off, one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryNoise {
    /// Metres per metre driven.
    pub position_per_m: f64,
    /// Radians per metre driven.
    pub yaw_per_m: f64,
    /// Radians per radian turned.
    pub yaw_per_rad: f64,
    /// Metres, whatever was driven.
    pub position_floor_m: f64,
    /// Radians, whatever was driven.
    pub yaw_floor_rad: f64,
}

/// Parameters of the mapper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Side of a cell.
    pub cell_m: f64,
    /// The map reaches half of this in each direction from its origin. Farther cells are not entered.
    pub extent_m: f64,
    /// Most tiles of 32 by 32 cells, which bounds the map's memory: 1 KiB per tile.
    pub max_tiles: usize,
    /// Beams change the map up to this range.
    pub mapping_range_m: f64,
    /// Beams without a return show free space up to this range; 0 if a lost return says nothing.
    pub open_range_m: f64,
    /// Beams up to this range are matched.
    pub matching_range_m: f64,
    /// Most points of a scan that are matched.
    pub max_points: usize,
    /// How far odometry may be off.
    pub odometry: OdometryNoise,
    /// The search window in standard deviations of the odometry.
    pub window_sigmas: f64,
    /// Half the side of the largest search window.
    pub window_max_m: f64,
    /// Half the angle of the largest search window.
    pub window_max_rad: f64,
    /// Standard deviation of a reading about a wall.
    pub blur_m: f64,
    /// The logarithm of the odds of a scan that fits completely against one that does not fit. Beams are not independent; this
    /// says how many of them count.
    pub evidence: f64,
    /// A scan is matched after this many metres.
    pub match_m: f64,
    /// A scan is matched after this many radians.
    pub match_rad: f64,
    /// A scan is entered into the map after this many metres.
    pub enter_m: f64,
    /// A scan is entered into the map after this many radians.
    pub enter_rad: f64,
    /// A standing robot enters one in this many scans, so that people who leave are forgotten.
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
    /// The largest number of cells along a side of a map.
    pub fn cells_per_side(&self) -> usize {
        self.tiles_per_side() * TILE
    }

    /// The largest number of tiles along a side of a map.
    pub(crate) fn tiles_per_side(&self) -> usize {
        (self.extent_m / (self.cell_m * TILE as f64)).ceil() as usize
    }

    /// Checks bounds; memory and work follow from them.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is out of bounds.
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
