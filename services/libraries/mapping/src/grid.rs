//! Cells that are free, occupied or unknown, as a plain rectangle.

/// What is known about a cell.
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

/// A rectangle of cells; row 0 is the lowest (y up), cells of a row go along x.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CellGrid {
    /// Cells in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Side of a cell, in the unit of the frame (metres in a map, pixels in a drawing).
    pub cell: f64,
    /// The lower left corner of the lower left cell, in the frame of the grid's maker.
    pub origin: [f64; 2],
    /// Row by row.
    pub cells: Vec<Cell>,
}

impl CellGrid {
    /// A grid of unknown cells.
    pub fn unknown(width: usize, height: usize, cell: f64, origin: [f64; 2]) -> Self {
        Self { width, height, cell, origin, cells: vec![Cell::Unknown; width * height] }
    }

    /// The cell in a column and a row; unknown outside the grid.
    pub fn at(&self, column: i64, row: i64) -> Cell {
        self.index(column, row).map_or(Cell::Unknown, |index| self.cells[index])
    }

    /// The index of a cell in `cells`; `None` outside the grid.
    pub fn index(&self, column: i64, row: i64) -> Option<usize> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        (column < self.width && row < self.height).then_some(row * self.width + column)
    }

    /// Column and row of the cell that contains a place; they may lie outside the grid.
    pub fn cell_of(&self, at: [f64; 2]) -> [i64; 2] {
        [0, 1].map(|axis| ((at[axis] - self.origin[axis]) / self.cell).floor() as i64)
    }

    /// The middle of a cell.
    pub fn middle(&self, index: usize) -> [f64; 2] {
        let at = [index % self.width, index / self.width];
        [0, 1].map(|axis| self.origin[axis] + (at[axis] as f64 + 0.5) * self.cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_in_the_cell_whose_middle_is_nearest() {
        let grid = CellGrid::unknown(4, 3, 0.5, [-1.0, 2.0]);
        for index in 0..12 {
            let [column, row] = grid.cell_of(grid.middle(index));
            assert_eq!(grid.index(column, row), Some(index));
        }
        assert_eq!(grid.cell_of([-1.01, 2.0]), [-1, 0]);
        assert_eq!(grid.at(-1, 0), Cell::Unknown);
        assert_eq!(grid.index(4, 0), None);
    }
}
