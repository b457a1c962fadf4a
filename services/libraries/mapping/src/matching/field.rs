//! A raster around the robot that stores how close each cell is to a wall of the map, along with the maxima over blocks of cells.

use crate::grid::floor;
use crate::occupancy::Occupancy;

/// Side lengths of the blocks of each level, in cells. A cell's block begins at that cell and extends to the right and up.
pub const BLOCKS: [usize; 4] = [1, 2, 4, 8];
/// Number of cells in a row of the kernel that are drawn at once.
const TOGETHER: usize = 16;

/// A square of cells whose values are 255 · exp(−d² / 2σ²), where d is the distance to the nearest occupied cell.
#[derive(Debug)]
pub struct Field {
    /// The lower left cell, as a cell of the map.
    low: [i32; 2],
    side: usize,
    cell_m: f64,
    /// The rows of the kernel, which extend `reach` cells to each side and are padded with zeros to a multiple of [`TOGETHER`].
    kernel: Vec<[u8; TOGETHER]>,
    reach: usize,
    levels: [Vec<u8>; 4],
}

impl Field {
    /// Creates a field of zeros that is complete up to `half_m` from its centre.
    pub fn new(cell_m: f64, half_m: f64, blur_m: f64) -> Self {
        let blur = blur_m / cell_m;
        let reach = (2.5 * blur).ceil() as usize;
        let width = (2 * reach + 1).next_multiple_of(TOGETHER);
        // The margin leaves room for the padded rows of the kernel and for blocks that extend beyond a place.
        let side = 2 * ((half_m / cell_m).ceil() as usize + width + BLOCKS[BLOCKS.len() - 1]);
        let value = |k: usize| {
            let [x, y] = [k % width, k / width].map(|at| at as f64 - reach as f64);
            let value = (255.0 * (-0.5 * (x * x + y * y) / (blur * blur)).exp()).round() as u8;
            if k % width <= 2 * reach { value } else { 0 }
        };
        let values: Vec<_> = (0..width * (2 * reach + 1)).map(value).collect();
        let kernel = values.as_chunks().0.to_vec();
        let levels = std::array::from_fn(|_| vec![0; side * side]);
        Self { low: [0, 0], side, cell_m, kernel, reach, levels }
    }

    /// Returns the length of a cell's side, in metres.
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Returns the lower left cell, as a cell of the map.
    pub fn low(&self) -> [i32; 2] {
        self.low
    }

    /// Returns the number of cells in a row, which is also the number of rows.
    pub fn side(&self) -> usize {
        self.side
    }

    /// Redraws the field from the walls around a cell of the map.
    pub fn rebuild(&mut self, map: &Occupancy, middle: [i32; 2]) {
        self.clear_around(middle);
        map.occupied_within(self.low, self.low.map(|at| at + self.side as i32 - 1), |cell| self.draw(cell));
        self.finish();
    }

    /// Redraws the field from occupied cells. `middle` is the cell at its centre.
    pub(crate) fn rebuild_of(&mut self, occupied: impl Iterator<Item = [i32; 2]>, middle: [i32; 2]) {
        self.clear_around(middle);
        occupied.for_each(|cell| self.draw(cell));
        self.finish();
    }

    fn clear_around(&mut self, middle: [i32; 2]) {
        let half = (self.side / 2) as i32;
        self.low = middle.map(|at| at - half);
        self.levels[0].fill(0);
    }

    /// Draws the kernel around an occupied cell, unless part of the kernel would be outside the field.
    #[inline]
    fn draw(&mut self, cell: [i32; 2]) {
        let (side, reach) = (self.side, self.reach);
        let chunks = self.kernel.len() / (2 * reach + 1);
        let [x, y] = [0, 1].map(|axis| (cell[axis] - self.low[axis]) as usize);
        if x.max(y) >= side || x.min(y) < reach || x - reach + chunks * TOGETHER > side || y + reach >= side {
            return;
        }
        for (row, values) in self.kernel.chunks(chunks).enumerate() {
            let start = (y + row - reach) * side + x - reach;
            for (cells, values) in self.levels[0][start..].as_chunks_mut().0.iter_mut().zip(values) {
                *cells = std::array::from_fn::<_, TOGETHER, _>(|k| u8::max(cells[k], values[k]));
            }
        }
    }

    /// Computes the maxima over blocks.
    fn finish(&mut self) {
        for k in 1..BLOCKS.len() {
            let (finer, coarser) = self.levels.split_at_mut(k);
            double(&finer[k - 1], &mut coarser[0], self.side, BLOCKS[k - 1]);
        }
    }

    /// Returns the largest value in a block, or 0 outside the field. `level` is an index into [`BLOCKS`], and `at` counts from
    /// [`Self::low`].
    #[inline]
    pub(crate) fn block(&self, level: usize, at: [i32; 2]) -> u8 {
        let (x, y) = (at[0] as usize, at[1] as usize);
        if x < self.side && y < self.side { self.levels[level][y * self.side + x] } else { 0 }
    }

    /// Returns the value at a place in the map, in metres. Values are from 0 to 1 and smooth, interpolated by a quadratic B-spline
    /// over nine cells.
    #[inline]
    pub(crate) fn sample(&self, at: [f64; 2]) -> f64 {
        let cells = [0, 1].map(|axis| at[axis] / self.cell_m - f64::from(self.low[axis]));
        let [x, y] = cells.map(floor);
        let Some(near) = self.around(x, y) else { return 0.0 };
        let (across, up) = (spline(cells[0] - f64::from(x)), spline(cells[1] - f64::from(y)));
        let row = |values: [u8; 3]| {
            let [left, middle, right] = values.map(f64::from);
            across[0] * left + across[1] * middle + across[2] * right
        };
        let [below, here, above] = near.map(row);
        (up[0] * below + up[1] * here + up[2] * above) / 255.0
    }

    /// Returns the values of a cell and its eight neighbours, row by row, or `None` if one of them lies outside the field.
    #[inline]
    fn around(&self, x: i32, y: i32) -> Option<[[u8; 3]; 3]> {
        let (x, y) = (usize::try_from(x).ok()?.checked_sub(1)?, usize::try_from(y).ok()?.checked_sub(1)?);
        let level = &self.levels[0][..];
        if x + 2 >= self.side || y + 2 >= self.side {
            return None;
        }
        let row = |row: usize| level[(y + row) * self.side + x..].first_chunk().copied().unwrap_or_default();
        Some([row(0), row(1), row(2)])
    }
}

/// Returns the spline's weights of a cell's left neighbour, the cell itself and its right neighbour, at a position from 0 to 1 in
/// the cell.
fn spline(at: f64) -> [f64; 3] {
    let right = 0.5 * at * at;
    let left = 0.5 * (1.0 - at) * (1.0 - at);
    [left, 1.0 - left - right, right]
}

/// Computes the maxima over blocks twice as large, each from four blocks of the finer level.
fn double(finer: &[u8], coarser: &mut [u8], side: usize, block: usize) {
    for y in 0..side {
        let upper = (y + block).min(side - 1);
        let (lower, upper) = (&finer[y * side..][..side], &finer[upper * side..][..side]);
        let row = &mut coarser[y * side..][..side];
        for x in 0..side - block {
            let left = lower[x].max(upper[x]);
            row[x] = left.max(lower[x + block]).max(upper[x + block]);
        }
        for x in side - block..side {
            row[x] = lower[x].max(upper[x]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameters;

    #[test]
    fn blocks_have_the_maximum_of_their_cells() {
        let mut map = Occupancy::new(&Parameters { max_tiles: 16, extent_m: 10.0, ..Parameters::default() });
        let mut touched = Vec::new();
        let mut scan = map.scan(&mut touched);
        (0..40).for_each(|k| scan.hit([(k * 7) % 31 - 15, (k * 11) % 29 - 14]));
        drop(scan);
        let mut field = Field::new(0.05, 1.5, 0.08);
        field.rebuild(&map, [0, 0]);
        let cells = |x: i32, y: i32, side: i32| {
            (0..side * side).map(|k| field.block(0, [x + k % side, y + k / side])).max().unwrap()
        };
        for (level, block) in BLOCKS.iter().enumerate() {
            for (x, y) in (0..50).flat_map(|x| (0..50).map(move |y| (x, y))) {
                assert_eq!(field.block(level, [x, y]), cells(x, y, *block as i32), "{x} {y} of {block}");
            }
        }
    }

    #[test]
    fn samples_increase_towards_a_wall() {
        let mut map = Occupancy::new(&Parameters { max_tiles: 16, extent_m: 10.0, ..Parameters::default() });
        let mut touched = Vec::new();
        let mut scan = map.scan(&mut touched);
        (-10..10).for_each(|y| scan.hit([10, y]));
        drop(scan);
        let mut field = Field::new(0.05, 1.5, 0.08);
        field.rebuild(&map, [0, 0]);
        let (on, before, far) =
            (field.sample([0.525, 0.0]), field.sample([0.45, 0.0]), field.sample([0.0, 0.0]));
        assert!(on > 0.9 && (0.3..0.9).contains(&before) && far == 0.0, "{on} {before} {far}");
        assert_eq!(field.sample([100.0, 1e30]), 0.0);
    }
}
