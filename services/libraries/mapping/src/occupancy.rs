//! An occupancy map of log odds (Moravec and Elfes 1985; Thrun, Burgard and Fox 2005, 9.2), stored in tiles.
//!
//! A tile is created when a beam first reaches it. The number of tiles is bounded: once all of them are in
//! use, changes outside them are counted but otherwise dropped. A scan changes each cell at most once, no
//! matter how many beams pass through it.
//!
//! People who walk by do not leave walls in the map, because a beam that ends deep in free space has little
//! weight and later beams clear the cell again.
//!
//! In addition to the log odds, bits record whether each cell is free or occupied, so that whole rows of a tile can be read at
//! once.

use serde::{Deserialize, Serialize};

use crate::grid::{Cell, CellGrid, floor};
use crate::{Error, Parameters};

/// Number of cells along a side of a tile.
pub const TILE: usize = 32;
const TILE_CELLS: usize = TILE * TILE;
// A row of a tile fits into one word.
const _: () = assert!(TILE == u32::BITS as usize);
const NO_TILE: u16 = u16::MAX;

/// Level of even odds. A cell's level is this plus its log odds in steps of 0.05, or zero if the cell was never seen.
const EVEN: u8 = 64;
const HIT: u8 = 18;
const HIT_IN_FREE: u8 = 7;
const MISS: u8 = 8;
const LEAST: u8 = 1;
const MOST: u8 = 127;
/// Level below which a cell has been seen free so often that a beam ending there has probably hit a person.
const DEEPLY_FREE: u8 = 16;
const FREE_UP_TO: u8 = 60;
const OCCUPIED_FROM: u8 = 68;
/// Bit that marks a cell as already changed by the scan being entered.
const TOUCHED: u8 = 128;

/// The occupancy map. Cells are addressed by their distances from the origin, in whole cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Occupancy {
    cell_m: f64,
    tiles_per_side: usize,
    max_tiles: usize,
    /// Index of the tile at each position in the map, or [`NO_TILE`].
    slots: Vec<u16>,
    #[serde(with = "serde_bytes")]
    levels: Vec<u8>,
    /// The signs of each row of each tile, derived from the levels.
    #[serde(skip)]
    signs: Vec<Signs>,
    /// Number of changes dropped because no tile was left or the cell was beyond the extent.
    left_out: u64,
}

/// The free and the occupied cells of a tile's row, as one bit per cell each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Signs {
    free: u32,
    occupied: u32,
}

impl Signs {
    /// Returns the signs of a row, given its levels.
    fn of(levels: &[u8]) -> Self {
        let mut signs = Self::default();
        levels.iter().enumerate().for_each(|(column, level)| signs.set(column, *level));
        signs
    }

    fn set(&mut self, column: usize, level: u8) {
        let cell = classify(level);
        let with = |bits: u32, is_set: bool| bits & !(1 << column) | u32::from(is_set) << column;
        self.free = with(self.free, cell == Cell::Free);
        self.occupied = with(self.occupied, cell == Cell::Occupied);
    }
}

impl Occupancy {
    /// Creates an empty map and reserves memory for all tiles.
    pub fn new(parameters: &Parameters) -> Self {
        let tiles_per_side = parameters.tiles_per_side();
        Self {
            cell_m: parameters.cell_m,
            tiles_per_side,
            max_tiles: parameters.max_tiles,
            slots: vec![NO_TILE; tiles_per_side * tiles_per_side],
            levels: Vec::with_capacity(parameters.max_tiles * TILE_CELLS),
            signs: Vec::with_capacity(parameters.max_tiles * TILE),
            left_out: 0,
        }
    }

    /// Checks that a saved map matches the parameters, and reserves its memory.
    ///
    /// # Errors
    /// [`Error::State`] if the map does not match the parameters or is damaged.
    pub fn restored(mut self, parameters: &Parameters) -> Result<Self, Error> {
        let new = Self::new(parameters);
        let wrong = |expected, found: String| Err(Error::State { expected, found });
        if self.cell_m != new.cell_m || self.tiles_per_side != new.tiles_per_side {
            return wrong("cell and extent of the parameters", format!("{} m", self.cell_m));
        }
        let tiles = self.levels.len() / TILE_CELLS;
        let is_whole = self.levels.len() == tiles * TILE_CELLS && tiles <= new.max_tiles;
        let used = self.slots.iter().filter(|&&slot| slot != NO_TILE);
        if !is_whole || self.slots.len() != new.slots.len() || used.clone().count() != tiles {
            return wrong("as many tiles as there are slots", tiles.to_string());
        }
        let mut seen = vec![false; tiles];
        if used
            .into_iter()
            .any(|&slot| seen.get_mut(usize::from(slot)).is_none_or(|seen| std::mem::replace(seen, true)))
        {
            return wrong("each tile once", tiles.to_string());
        }
        if self.levels.iter().any(|level| level & TOUCHED != 0) {
            return wrong("levels below 128", "a larger one".to_owned());
        }
        self.max_tiles = new.max_tiles;
        self.levels.reserve_exact(new.max_tiles * TILE_CELLS - self.levels.len());
        self.signs = new.signs;
        self.signs.extend(self.levels.chunks(TILE).map(Signs::of));
        Ok(self)
    }

    /// Returns the length of a cell's side, in metres.
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Returns the number of tiles in use.
    pub fn tiles(&self) -> usize {
        self.levels.len() / TILE_CELLS
    }

    /// Returns the number of changes that were lost because the map was full or did not extend far enough.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Returns the state of a cell.
    pub fn at(&self, cell: [i32; 2]) -> Cell {
        classify(self.level(cell))
    }

    fn level(&self, cell: [i32; 2]) -> u8 {
        self.find(cell).map_or(0, |index| self.levels[index])
    }

    /// Returns the index of the tile's slot and the index of the cell within the tile, or `None` if the cell is beyond the extent.
    fn split(&self, cell: [i32; 2]) -> Option<(usize, usize)> {
        let half = self.tiles_per_side * TILE / 2;
        // A cell below the extent wraps around to a very large number, which is also beyond the extent.
        let [x, y] = cell.map(|at| at.wrapping_add(half as i32) as u32 as usize);
        let (column, row) = (x / TILE, y / TILE);
        let is_within = column < self.tiles_per_side && row < self.tiles_per_side;
        is_within.then(|| (row * self.tiles_per_side + column, y % TILE * TILE + x % TILE))
    }

    fn find(&self, cell: [i32; 2]) -> Option<usize> {
        let (slot, within) = self.split(cell)?;
        let tile = self.slots[slot];
        (tile != NO_TILE).then(|| usize::from(tile) * TILE_CELLS + within)
    }

    /// Returns the index of the first cell of a slot's tile. Creates the tile if it is missing, or returns `None` if all slots are
    /// taken.
    fn find_or_make(&mut self, slot: usize) -> Option<usize> {
        if self.slots[slot] == NO_TILE {
            if self.tiles() >= self.max_tiles {
                return None;
            }
            self.slots[slot] = self.tiles() as u16;
            self.levels.resize(self.levels.len() + TILE_CELLS, 0);
            self.signs.resize(self.levels.len() / TILE, Signs::default());
        }
        Some(usize::from(self.slots[slot]) * TILE_CELLS)
    }

    /// Begins to enter a scan. `touched` is working memory. If its capacity covers all cells in range, entering the scan does not
    /// allocate.
    pub(crate) fn scan<'a>(&'a mut self, touched: &'a mut Vec<u32>) -> Entering<'a> {
        touched.clear();
        Entering { map: self, touched, tile: None }
    }

    /// Calls `visit` with each occupied cell of a rectangle, tile by tile. The rectangle includes both corners.
    pub(crate) fn occupied_within(&self, low: [i32; 2], high: [i32; 2], mut visit: impl FnMut([i32; 2])) {
        let half = (self.tiles_per_side * TILE / 2) as i32;
        let tile = |at: i32| (at + half).div_euclid(TILE as i32).clamp(0, self.tiles_per_side as i32 - 1);
        for row in tile(low[1])..=tile(high[1]) {
            for column in tile(low[0])..=tile(high[0]) {
                let slot = self.slots[row as usize * self.tiles_per_side + column as usize];
                if slot == NO_TILE {
                    continue;
                }
                let signs = &self.signs[usize::from(slot) * TILE..][..TILE];
                let corner = [column, row].map(|at| at * TILE as i32 - half);
                for (y, signs) in (corner[1]..).zip(signs).filter(|(y, _)| (low[1]..=high[1]).contains(y)) {
                    let mut left = signs.occupied;
                    while left != 0 {
                        let x = corner[0] + left.trailing_zeros() as i32;
                        if (low[0]..=high[0]).contains(&x) {
                            visit([x, y]);
                        }
                        left &= left - 1;
                    }
                }
            }
        }
    }

    /// Writes the map to a grid, which becomes the rectangle around all tiles in use.
    pub fn write(&self, grid: &mut CellGrid) {
        let half = (self.tiles_per_side * TILE / 2) as i32;
        let used = self.slots.iter().enumerate().filter(|(_, slot)| **slot != NO_TILE);
        let places = used.map(|(k, slot)| ([k % self.tiles_per_side, k / self.tiles_per_side], *slot));
        let low = places.clone().fold([usize::MAX; 2], |low, (at, _)| [low[0].min(at[0]), low[1].min(at[1])]);
        let high =
            places.clone().fold([0; 2], |high, (at, _)| [high[0].max(at[0] + 1), high[1].max(at[1] + 1)]);
        if self.levels.is_empty() {
            return grid.reset([0; 2], self.cell_m, [0.0; 2]);
        }
        let origin = low.map(|at| f64::from((at * TILE) as i32 - half) * self.cell_m);
        grid.reset([0, 1].map(|axis| (high[axis] - low[axis]) * TILE), self.cell_m, origin);
        for (at, slot) in places {
            let [column, row] = [0, 1].map(|axis| (at[axis] - low[axis]) * TILE);
            let signs = &self.signs[usize::from(slot) * TILE..][..TILE];
            for (row, signs) in (row..).zip(signs) {
                grid.free.insert_bits(column, row, signs.free);
                grid.occupied.insert_bits(column, row, signs.occupied);
            }
        }
    }
}

fn classify(level: u8) -> Cell {
    match level & !TOUCHED {
        0 => Cell::Unknown,
        level if level <= FREE_UP_TO => Cell::Free,
        level if level >= OCCUPIED_FROM => Cell::Occupied,
        _ => Cell::Unknown,
    }
}

/// A scan that is being entered. The ends of all beams come first and the beams themselves second, so that a cell in which a beam
/// ends counts as occupied even if other beams pass through it.
pub(crate) struct Entering<'a> {
    map: &'a mut Occupancy,
    touched: &'a mut Vec<u32>,
    /// The last slot and the first cell of its tile, cached because successive cells of a beam are mostly in the same tile.
    tile: Option<(usize, usize)>,
}

impl Entering<'_> {
    /// Records that a beam ends in a cell.
    pub fn hit(&mut self, cell: [i32; 2]) {
        self.change(cell, |level| {
            let step = if level < DEEPLY_FREE { HIT_IN_FREE } else { HIT };
            (level + step).min(MOST)
        });
    }

    /// Records a beam from one point to another, in cells. Cells along the beam count as free, up to `clear` cells before its end.
    pub fn pass(&mut self, from: [f64; 2], to: [f64; 2], clear: f64) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]) - clear;
        if length > 0.0 {
            let norm = along[0].hypot(along[1]);
            traverse(from, along.map(|part| part / norm), length, |cell| {
                self.change(cell, |level| level.saturating_sub(MISS).max(LEAST));
            });
        }
    }

    #[inline]
    fn change(&mut self, cell: [i32; 2], by: impl Fn(u8) -> u8) {
        let Some(index) = self.find(cell) else {
            self.map.left_out += 1;
            return;
        };
        let level = &mut self.map.levels[index];
        if *level & TOUCHED == 0 {
            let after = by(if *level == 0 { EVEN } else { *level });
            *level = after | TOUCHED;
            self.map.signs[index / TILE].set(index % TILE, after);
            self.touched.push(index as u32);
        }
    }

    #[inline]
    fn find(&mut self, cell: [i32; 2]) -> Option<usize> {
        let (slot, within) = self.map.split(cell)?;
        if let Some((_, first)) = self.tile.filter(|(known, _)| *known == slot) {
            return Some(first + within);
        }
        let first = self.map.find_or_make(slot)?;
        self.tile = Some((slot, first));
        Some(first + within)
    }
}

impl Drop for Entering<'_> {
    fn drop(&mut self) {
        for &index in self.touched.iter() {
            self.map.levels[index as usize] &= !TOUCHED;
        }
    }
}

/// Visits the cells along a ray (Amanatides and Woo 1987). Points and lengths are in cells.
pub(crate) fn traverse(from: [f64; 2], direction: [f64; 2], length: f64, mut visit: impl FnMut([i32; 2])) {
    let mut cell = from.map(floor);
    let step = direction.map(|part| if part < 0.0 { -1 } else { 1 });
    let per_cell = direction.map(|part| if part == 0.0 { f64::INFINITY } else { 1.0 / part.abs() });
    let mut next = [0, 1].map(|axis| {
        let side = f64::from(cell[axis]) + if step[axis] > 0 { 1.0 } else { 0.0 };
        if direction[axis] == 0.0 { f64::INFINITY } else { (side - from[axis]) / direction[axis] }
    });
    loop {
        visit(cell);
        let axis = usize::from(next[1] < next[0]);
        if next[axis] >= length {
            return;
        }
        cell[axis] += step[axis];
        next[axis] += per_cell[axis];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn map() -> Occupancy {
        Occupancy::new(&Parameters { max_tiles: 4, extent_m: 10.0, ..Parameters::default() })
    }

    fn see(map: &mut Occupancy, from: [f64; 2], end: [f64; 2]) {
        let mut touched = Vec::new();
        let mut scan = map.scan(&mut touched);
        scan.hit(end.map(|at| at.floor() as i32));
        scan.pass(from, end, 1.0);
    }

    #[test]
    fn beams_mark_free_and_occupied_cells() {
        let mut map = map();
        for _ in 0..2 {
            see(&mut map, [0.5, 0.5], [20.5, 0.5]);
        }
        let row: Vec<_> = [0, 10, 18, 20, 21].map(|x| map.at([x, 0])).to_vec();
        use Cell::{Free, Occupied, Unknown};
        assert_eq!(row, [Free, Free, Free, Occupied, Unknown]);
        let mut grid = CellGrid::default();
        map.write(&mut grid);
        let [x, y] = grid.cell_of([20.5 * 0.05, 0.5 * 0.05]);
        assert_eq!(grid.at(x, y), Occupied);
        let mut seen = Vec::new();
        map.occupied_within([-5, -5], [30, 30], |cell| seen.push(cell));
        assert_eq!(seen, [[20, 0]]);
    }

    /// A person stands in the corridor for three scans, after the robot has looked through that spot ten times.
    #[test]
    fn a_passing_person_leaves_no_wall() {
        let mut map = map();
        (0..10).for_each(|_| see(&mut map, [0.5, 0.5], [30.5, 0.5]));
        (0..3).for_each(|_| see(&mut map, [0.5, 0.5], [12.5, 0.5]));
        assert_ne!(map.at([12, 0]), Cell::Occupied);
        (0..3).for_each(|_| see(&mut map, [0.5, 0.5], [30.5, 0.5]));
        assert_eq!(map.at([12, 0]), Cell::Free);
        assert_eq!(map.at([30, 0]), Cell::Occupied);
    }

    #[test]
    fn a_door_that_is_closed_eventually_becomes_a_wall() {
        let mut map = map();
        (0..10).for_each(|_| see(&mut map, [0.5, 0.5], [30.5, 0.5]));
        (0..10).for_each(|_| see(&mut map, [0.5, 0.5], [12.5, 0.5]));
        assert_eq!(map.at([12, 0]), Cell::Occupied);
    }

    #[test]
    fn a_full_map_reports_what_it_omits() {
        let mut map = map();
        for x in 0..8 {
            see(&mut map, [f64::from(x * 32 - 96), 0.5], [f64::from(x * 32 - 96), 20.5]);
        }
        assert_eq!(map.tiles(), 4);
        assert!(map.left_out() > 0);
        let slots = map.clone();
        map.signs.clear();
        assert_eq!(
            map.restored(&Parameters { max_tiles: 4, extent_m: 10.0, ..Parameters::default() }),
            Ok(slots)
        );
    }

    #[test]
    fn a_saved_map_of_other_parameters_is_rejected() {
        assert!(map().restored(&Parameters::default()).is_err());
        let parameters = Parameters { max_tiles: 4, extent_m: 10.0, ..Parameters::default() };
        let mut damaged = map();
        see(&mut damaged, [0.5, 0.5], [9.5, 0.5]);
        damaged.slots[0] = 3;
        assert!(damaged.restored(&parameters).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// Each step leads to a neighbouring cell, and the last cell contains the end of the ray.
        #[test]
        fn a_ray_visits_a_chain_of_cells(x in -9.0..9.0, y in -9.0..9.0, angle in 0.0..6.3f64, length in 0.0..40.0f64) {
            let direction = [angle.cos(), angle.sin()];
            let mut cells = Vec::new();
            traverse([x, y], direction, length, |cell| cells.push(cell));
            prop_assert_eq!(cells[0], [x, y].map(|at: f64| at.floor() as i32));
            for pair in cells.windows(2) {
                prop_assert_eq!((pair[0][0] - pair[1][0]).abs() + (pair[0][1] - pair[1][1]).abs(), 1);
            }
            let last = cells.last().unwrap();
            let end = [x + direction[0] * length, y + direction[1] * length];
            for axis in 0..2 {
                let low = f64::from(last[axis]);
                prop_assert!(low - 1e-6 <= end[axis] && end[axis] <= low + 1.0 + 1e-6);
            }
        }
    }
}
