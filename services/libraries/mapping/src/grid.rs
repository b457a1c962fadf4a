//! Cells that are free, occupied or unknown, as a plain rectangle.

use crate::region::Region;

/// What is known of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum Cell {
    /// Never seen, or the readings contradict each other.
    #[default]
    Unknown,
    /// Beams pass.
    Free,
    /// Beams end here.
    Occupied,
}

/// The largest whole number up to this; the least or the largest there is, where it is beyond.
#[inline]
pub(crate) fn floor(at: f64) -> i32 {
    let towards_zero = at as i32;
    towards_zero.saturating_sub(i32::from(at < f64::from(towards_zero)))
}

/// A rectangle of cells; row 0 is the lowest (y up), cells of a row go along x.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CellGrid {
    /// Side of a cell, in the unit of the frame (metres in a map, pixels in a drawing).
    pub cell: f64,
    /// The lower left corner of the lower left cell, in the frame of the grid's maker.
    pub origin: [f64; 2],
    /// Where beams pass.
    pub free: Region,
    /// Where beams end: as large as `free`, and apart from it.
    pub occupied: Region,
}

impl CellGrid {
    /// A grid of so many cells a row and so many rows; `what` is known of each.
    pub fn of(size: [usize; 2], cell: f64, origin: [f64; 2], what: impl Fn(usize) -> Cell) -> Self {
        let region = |is: Cell| Region::of(size[0], size[1], |index| what(index) == is);
        Self { cell, origin, free: region(Cell::Free), occupied: region(Cell::Occupied) }
    }

    /// Becomes a grid of unknown cells, so many in a row and so many rows. Memory is used again.
    pub fn reset(&mut self, [width, height]: [usize; 2], cell: f64, origin: [f64; 2]) {
        (self.cell, self.origin) = (cell, origin);
        self.free.reset(width, height);
        self.occupied.reset(width, height);
    }

    /// Cells in a row.
    pub fn width(&self) -> usize {
        self.free.width()
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.free.height()
    }

    /// What is known of the cell in a column and a row; nothing beside the grid.
    pub fn at(&self, column: i64, row: i64) -> Cell {
        match (self.free.holds([column, row]), self.occupied.holds([column, row])) {
            (true, _) => Cell::Free,
            (_, true) => Cell::Occupied,
            _ => Cell::Unknown,
        }
    }

    /// Column and row of the cell that contains a place; they may lie outside the grid.
    pub fn cell_of(&self, at: [f64; 2]) -> [i64; 2] {
        [0, 1].map(|axis| ((at[axis] - self.origin[axis]) / self.cell).floor() as i64)
    }

    /// The middle of a cell.
    pub fn middle(&self, index: usize) -> [f64; 2] {
        let at = self.free.at(index);
        [0, 1].map(|axis| self.origin[axis] + (at[axis] as f64 + 0.5) * self.cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_below_zero_is_rounded_down_too() {
        for at in [0.0, -0.0, 0.9, 1.0, -0.1, -1.0, -1.1, 1e9 + 0.5, 1e30, -1e30, f64::INFINITY] {
            assert_eq!(floor(at), at.floor() as i32, "{at}");
        }
    }

    #[test]
    fn a_place_is_in_the_cell_whose_middle_is_nearest() {
        let grid = CellGrid::of([4, 3], 0.5, [-1.0, 2.0], |_| Cell::Free);
        for index in 0..12 {
            let [column, row] = grid.cell_of(grid.middle(index));
            assert_eq!(grid.free.index([column, row]), Some(index));
        }
        assert_eq!(grid.cell_of([-1.01, 2.0]), [-1, 0]);
        assert_eq!(
            (grid.at(-1, 0), grid.at(4, 0), grid.at(3, 2)),
            (Cell::Unknown, Cell::Unknown, Cell::Free)
        );
    }
}
