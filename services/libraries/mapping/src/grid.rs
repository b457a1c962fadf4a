//! A rectangular grid of cells that are free, occupied or unknown.

use crate::region::Region;

/// The state of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum Cell {
    /// The cell was never seen, or its observations contradict each other.
    #[default]
    Unknown,
    /// Beams pass through the cell.
    Free,
    /// Beams end in the cell.
    Occupied,
}

/// Returns the largest integer not above `at`, saturating. This avoids [`f64::floor`], which is a function call on baseline x86-64.
#[inline]
pub(crate) fn floor(at: f64) -> i32 {
    let towards_zero = at as i32;
    towards_zero.saturating_sub(i32::from(at < f64::from(towards_zero)))
}

/// A rectangle of cells. Rows run along x, and row 0 is the lowest (y up).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CellGrid {
    /// Length of a cell's side, in the unit of the frame (metres in a map, pixels in a drawing).
    pub cell: f64,
    /// The lower left corner of the lower left cell, in the grid's original frame.
    pub origin: [f64; 2],
    /// Cells that beams pass through.
    pub free: Region,
    /// Cells that beams end in. This region has the same size as `free` and is disjoint from it.
    pub occupied: Region,
}

impl CellGrid {
    /// Creates a grid of `size` columns and rows. `what` returns the state of the cell at an index.
    pub fn of(size: [usize; 2], cell: f64, origin: [f64; 2], what: impl Fn(usize) -> Cell) -> Self {
        let region = |is: Cell| Region::of(size[0], size[1], |index| what(index) == is);
        Self { cell, origin, free: region(Cell::Free), occupied: region(Cell::Occupied) }
    }

    /// Resets this to a grid of unknown cells with the given number of columns and rows, reusing its memory.
    pub fn reset(&mut self, [width, height]: [usize; 2], cell: f64, origin: [f64; 2]) {
        (self.cell, self.origin) = (cell, origin);
        self.free.reset(width, height);
        self.occupied.reset(width, height);
    }

    /// Returns the number of cells in a row.
    pub fn width(&self) -> usize {
        self.free.width()
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.free.height()
    }

    /// Returns the state of the cell in a column and a row, which is unknown outside the grid.
    pub fn at(&self, column: i64, row: i64) -> Cell {
        match (self.free.holds([column, row]), self.occupied.holds([column, row])) {
            (true, _) => Cell::Free,
            (_, true) => Cell::Occupied,
            _ => Cell::Unknown,
        }
    }

    /// Returns the column and the row of the cell that contains a point. They may lie outside the grid.
    pub fn cell_of(&self, at: [f64; 2]) -> [i64; 2] {
        [0, 1].map(|axis| ((at[axis] - self.origin[axis]) / self.cell).floor() as i64)
    }

    /// Returns the centre of a cell.
    pub fn middle(&self, index: usize) -> [f64; 2] {
        let at = self.free.at(index);
        [0, 1].map(|axis| self.origin[axis] + (at[axis] as f64 + 0.5) * self.cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_coordinates_are_rounded_down() {
        for at in [0.0, -0.0, 0.9, 1.0, -0.1, -1.0, -1.1, 1e9 + 0.5, 1e30, -1e30, f64::INFINITY] {
            assert_eq!(floor(at), at.floor() as i32, "{at}");
        }
    }

    #[test]
    fn a_place_belongs_to_the_cell_with_the_nearest_centre() {
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
