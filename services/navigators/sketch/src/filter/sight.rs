//! The likelihood of a scan at a pose in a map of what a laser has seen, computed by look-ups alone.
//!
//! This is the beam model ([`super::beam_model`]) with two simplifications and one addition. Ranges are compared as codes of the
//! [table of ranges](super::range_table), so that the likelihood of each difference can be tabulated. The bearing may be off by one
//! direction of the table. In addition, what was not seen on earlier drives is unknown rather than a wall: a beam that leaves what
//! was seen may return from anywhere beyond.

use super::beams::Beams;
use super::grid::Grid;
use super::parameters::Parameters;
use super::range_code::{DIRECTIONS, code};
use super::range_table::RangeTable;
use crate::sketch::SketchGrid;

/// Number of possible differences of two codes.
const DIFFERENCES: usize = 511;
/// Number of possible codes.
const CODES: usize = 256;
/// Difference of the logarithms of two successive codes' ranges, ln 2 / 16.
const LN_PER_CODE: f32 = std::f32::consts::LN_2 / 16.0;
/// Shares of the bearings: one direction less, as measured, and one direction more.
const SHARES: [f32; 3] = [0.2, 0.6, 0.2];
/// Density over e of a reading from beyond what was seen.
const BEYOND: f32 = 0.5;
/// Probabilities of no return, made comparable with densities of a return: for what the map explains, for what occurs anywhere, and
/// for a beam that leaves what was seen within the sensor's range.
const NO_RETURN: f32 = 1.08;
const NO_RETURN_ANYWHERE: f32 = 0.036;
const NO_RETURN_BEYOND: f32 = 0.5;
/// Densities over e of readings anywhere and of readings short of the map's range, before they are multiplied by `z_rand` and
/// `z_short`.
const ANYWHERE: f32 = 0.25;
const SHORT: f32 = 0.3;
/// Number of readings whose likelihoods are multiplied before a logarithm is taken.
const PER_LOGARITHM: usize = 4;

/// What is visible in a map.
#[derive(Debug, Clone)]
pub struct Sight {
    /// For each cell of the table, one bit per direction, which is set if the view ends where nothing was seen.
    unseen: Vec<u64>,
}

/// The likelihoods of readings, given a typical error of ranges.
#[derive(Debug, Clone)]
pub struct Densities {
    /// Likelihoods of a return, by the difference of the codes of the measured range and the map's: if the view ends at a wall, and
    /// if it ends where nothing was seen.
    returned: [Vec<f32>; 2],
    /// Likelihoods of no return in the same two cases, by the code of the map's range.
    not_returned: [Vec<f32>; 2],
}

/// A beam, in the form in which it is looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Direction in the robot's axes, in steps of the table's directions.
    turn: f32,
    /// Code of the measured range, or `None` if nothing returned.
    code: Option<u8>,
}

impl Sight {
    /// Finds out where the views in the map end at what was not seen.
    pub fn new(sketch: &SketchGrid, grid: &Grid, table: &RangeTable) -> Self {
        let ([width, height], side_px) = (table.cells(), table.px_per_cell());
        let mut unseen = vec![0; width * height];
        for (cell, bits) in unseen.iter_mut().enumerate() {
            let at_px = [cell % width, cell / width].map(|k| (k as f32 - 0.5) * side_px);
            if sketch.is_unseen(at_px) {
                *bits = u64::MAX;
            } else if !grid.is_wall(at_px[0], at_px[1]) {
                for direction in 0..DIRECTIONS {
                    let (sin, cos) = (std::f32::consts::TAU * direction as f32 / DIRECTIONS as f32).sin_cos();
                    let t = grid.cast(at_px, [cos, sin], 0.0, f32::MAX) + 0.5 * grid.px_per_cell();
                    *bits |=
                        u64::from(sketch.is_unseen([at_px[0] + t * cos, at_px[1] + t * sin])) << direction;
                }
            }
        }
        Self { unseen }
    }

    /// Returns Σ ln p over the readings of a sensor at a position, in pixels, on a robot with the heading `yaw_rad`.
    pub fn log_likelihood(
        &self,
        table: &RangeTable,
        densities: &Densities,
        readings: &[Reading],
        [x_px, y_px]: [f32; 2],
        yaw_rad: f32,
    ) -> f32 {
        let [width, height] = table.cells();
        let inverse = 1.0 / table.px_per_cell();
        let index = |at_px: f32, most: usize| ((at_px * inverse + 1.0) as usize).min(most - 1);
        let cell = index(y_px, height) * width + index(x_px, width);
        let (unseen, row) = (self.unseen[cell], table.rows(cell).range);
        // Adds two turns, since the conversion truncates towards zero.
        let heading = yaw_rad * (DIRECTIONS as f32 / std::f32::consts::TAU) + (2 * DIRECTIONS) as f32 + 0.5;
        let mut sum = 0.0;
        for readings in readings.chunks(PER_LOGARITHM) {
            let mut product = 1.0;
            for reading in readings {
                let middle = (heading + reading.turn) as usize + DIRECTIONS - 1;
                let mut p = 0.0;
                for (k, share) in SHARES.iter().enumerate() {
                    let direction = (middle + k) % DIRECTIONS;
                    let expected = usize::from(row[direction]);
                    let is_unseen = (unseen >> direction & 1) as usize;
                    p += share
                        * match reading.code {
                            Some(code) => {
                                densities.returned[is_unseen][usize::from(code) + CODES - 1 - expected]
                            }
                            None => densities.not_returned[is_unseen][expected],
                        };
                }
                product *= p;
            }
            sum += product.ln();
        }
        sum
    }
}

impl Densities {
    /// Tabulates the likelihoods for `error`, a typical error of ranges as |ln(measured / expected)|. `scale_pxpm` is the map's
    /// scale.
    pub fn new(p: &Parameters, error: f32, table: &RangeTable, scale_pxpm: f32, range_max_m: f32) -> Self {
        let random = p.z_rand * ANYWHERE;
        let short = p.z_short * SHORT;
        let returned = |at: f32, is_unseen: bool| {
            let off = at * LN_PER_CODE;
            let farther = if is_unseen { BEYOND } else { 0.5 / error * (-off / error).exp() };
            let peak = if is_unseen { BEYOND } else { 0.5 / error };
            let p_hit =
                if off < 0.0 { (p.z_hit * peak * (off / error).exp()).max(short) } else { p.z_hit * farther };
            p_hit + random
        };
        let most = code(f64::from(range_max_m * scale_pxpm / table.px_per_cell()));
        let not_returned = |expected: usize, is_unseen: bool| {
            let off = (expected as f32 - f32::from(most)) * LN_PER_CODE / error;
            let beyond = if off > 0.0 { 1.0 - 0.5 * (-off).exp() } else { 0.5 * off.exp() };
            let seen = NO_RETURN * beyond + NO_RETURN_ANYWHERE;
            if is_unseen { seen.max(NO_RETURN_BEYOND) } else { seen }
        };
        let by_difference = |is_unseen: bool| {
            (0..DIFFERENCES).map(|i| returned(i as f32 - (CODES - 1) as f32, is_unseen)).collect()
        };
        let by_code =
            |is_unseen: bool| (0..CODES).map(|expected| not_returned(expected, is_unseen)).collect();
        Self { returned: [false, true].map(by_difference), not_returned: [false, true].map(by_code) }
    }
}

/// Converts the beams of a scan into `readings`.
pub fn read(beams: &Beams, table: &RangeTable, scale_pxpm: f32, readings: &mut Vec<Reading>) {
    readings.clear();
    let cells = f64::from(scale_pxpm / table.px_per_cell());
    readings.extend((0..beams.len()).map(|i| Reading {
        turn: beams.angle_rad[i] * (DIRECTIONS as f32 / std::f32::consts::TAU),
        code: beams.returned[i].then(|| code(f64::from(beams.range_m[i]) * cells)),
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::beams::SHORTEST_M;
    use sketchnav_schemas::codes::WALL;
    use sketchnav_stage::drawn::UNSEEN;

    /// Returns the log likelihood of a reading straight ahead, in the middle of a corridor of 12 m at 20 px/m, of which the farther
    /// end is `end`, 3 m ahead.
    fn ahead(end: u8, range_m: f32) -> f32 {
        let cell = |i: usize| {
            let [column, row] = [i % 240, i / 240];
            match (column, row) {
                (_, 0..=9 | 50..) => WALL,
                (180.., _) => end,
                _ => 0,
            }
        };
        let sketch = SketchGrid::new(240, 60, &(0..240 * 60).map(cell).collect::<Vec<u8>>(), 0.0).unwrap();
        let grid = Grid::new(&sketch, 100_000);
        let table = RangeTable::new(&grid);
        let sight = Sight::new(&sketch, &grid, &table);
        let densities = Densities::new(&Parameters::learned(), 0.15, &table, 20.0, 5.6);
        let mut beams = Beams { range_max_m: 5.6, ..Beams::with_capacity(1) };
        beams.push(0.0, range_m.max(SHORTEST_M));
        let mut readings = Vec::new();
        read(&beams, &table, 20.0, &mut readings);
        sight.log_likelihood(&table, &densities, &readings, [120.5, 30.5], 0.0)
    }

    #[test]
    fn a_reading_at_a_wall_fits_and_one_beyond_does_not() {
        assert!(ahead(WALL, 3.0) > 0.5, "{}", ahead(WALL, 3.0));
        assert!(ahead(WALL, 4.5) < -1.5 && ahead(WALL, 1.5) < -1.5 && ahead(WALL, 6.0) < -1.5);
    }

    /// Whatever lies beyond what was seen fits equally well, but a return from where the floor was seen to be free does not.
    #[test]
    fn a_reading_beyond_what_was_seen_says_nothing() {
        let [near, far, none] = [3.2, 5.0, 6.0].map(|range_m| ahead(UNSEEN, range_m));
        assert!((near - far).abs() < 0.1 && (near - none).abs() < 0.6, "{near} {far} {none}");
        assert!(ahead(UNSEEN, 1.5) < near - 0.8, "{}", ahead(UNSEEN, 1.5));
    }
}
