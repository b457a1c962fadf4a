//! A table of the visible range from every cell in every direction, for the thousands of look-ups of the beam model in each update.
//!
//! For each cell of the reduced drawing and each of [`DIRECTIONS`] directions, an entry contains the logarithm of the range to the
//! first wall, in a byte. Parallel lines that sweep over the drawing fill the table (`sweep.rs`). An entry is the exact range from
//! a point in the cell, in a direction that is off by at most half a step.
//!
//! For a cell in a wall, the table also contains the distance out of that wall (see [`Grid::cast`]). The table is independent of
//! the drawing's scale.

use std::ops::Range;

use super::grid::Grid;
use super::range_code::{DIRECTIONS, NEVER, PER_OCTAVE, SHORTEST_LOG2};
use super::sweep::{SQUARE, Sweep, Views, Walls, transpose_bytes, transposed};
use fearless_simd::{Level, dispatch, prelude::*, u8x16};

/// Maximum number of cells in the table of a drawing. The ranges fill 32 MB, and the distances out of walls as much again if
/// everything is wall. In a table of 200,000 cells, walls are thicker and doors narrower, and the filter got lost in 11 of 40
/// drives through a wobbly drawing, as opposed to none with this size.
pub const RANGE_TABLE_CELLS: usize = 500_000;
/// Row of distances for the ring around the drawing. There is no way out of the ring.
const OUTSIDE: u32 = 1;
/// Number of directions that are swept before they are written to the rows.
const TOGETHER: usize = SQUARE;

/// The codes of all cells for one direction. The first plane contains the ranges and the second one, for cells in walls, the
/// distances out of them.
type Planes = [Vec<u8>; 2];

/// The codes of one cell, by direction.
pub type Row = [u8; DIRECTIONS];

/// The codes of one cell. [`RangeTable::log2_px`] says how to decode both kinds.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// Codes of the ranges to the first wall.
    pub range: &'a Row,
    /// Codes of the distances out of the wall, for a cell in a wall. Code 0 means that no wall has to be left.
    pub leave: Option<&'a Row>,
}

/// The table of ranges.
#[derive(Debug, Clone)]
pub struct RangeTable {
    width: usize,
    height: usize,
    px_per_cell: f32,
    range: Vec<Row>,
    /// Rows of distances out of walls. The first row is for all free cells, and the second ([`OUTSIDE`]) for the ring.
    leave: Vec<Row>,
    leave_row: Vec<u32>,
}

impl RangeTable {
    /// Computes the table by sweeps over all of `grid`.
    pub fn new(grid: &Grid) -> Self {
        let [width, height] = grid.cells();
        let wall: Vec<bool> = grid.walls().collect();
        let leave_row = leave_rows(&wall, width);
        let rows = leave_row.iter().max().map_or(0, |&last| last as usize + 1).max(2);
        let mut table = Self {
            width,
            height,
            px_per_cell: grid.px_per_cell(),
            range: vec![[0; DIRECTIONS]; width * height],
            leave: vec![[0; DIRECTIONS]; rows],
            leave_row,
        };
        table.leave[OUTSIDE as usize].fill(NEVER);
        let walls = Walls::new(wall, width);
        let mut views = Views::new([width, height]);
        let plane = || [vec![0; width * height], vec![0; width * height]];
        let mut planes: [Planes; TOGETHER] = std::array::from_fn(|_| plane());
        let mut by_column = plane();
        for first in (0..DIRECTIONS).step_by(TOGETHER) {
            for (k, plane) in planes.iter_mut().enumerate() {
                table.sweep(first + k, &walls, &mut views, plane, &mut by_column);
            }
            dispatch!(Level::new(), simd => table.interleave(simd, first, &planes));
        }
        table
    }

    /// Returns the numbers of columns and rows, including the ring around the drawing.
    pub fn cells(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Returns the length of a cell's side, in pixels.
    pub fn px_per_cell(&self) -> f32 {
        self.px_per_cell
    }

    /// Returns the codes of the ranges visible from a cell.
    #[inline(always)]
    pub fn rows(&self, cell: usize) -> Rows<'_> {
        let cell = cell.min(self.range.len() - 1);
        let row = self.leave_row[cell] as usize;
        Rows { range: &self.range[cell], leave: (row > 0).then(|| &self.leave[row]) }
    }

    /// Returns the factor and the summand that convert a code to the binary logarithm of a distance in pixels.
    pub fn log2_px(&self) -> [f32; 2] {
        [1.0 / PER_OCTAVE, SHORTEST_LOG2 + self.px_per_cell.log2()]
    }

    /// Fills `planes` with the codes of one direction.
    fn sweep(
        &self,
        direction: usize,
        walls: &Walls,
        views: &mut Views,
        planes: &mut Planes,
        by_column: &mut Planes,
    ) {
        let sweep = Sweep::new(direction, [self.width, self.height]);
        if sweep.is_upright() {
            let [range, leave] = planes;
            sweep.run(walls, views, range, leave);
        } else {
            let [range, leave] = by_column;
            sweep.run(walls, views, range, leave);
            planes.iter_mut().zip(by_column).for_each(|(to, from)| transpose_bytes(from, self.height, to));
        }
    }

    /// Copies the planes of some directions into the cells' rows. Writing each code directly into its row took three times as long.
    #[inline(always)]
    fn interleave<S: Simd>(&mut self, simd: S, first: usize, planes: &[Planes; TOGETHER]) {
        let Self { range, leave, leave_row, .. } = self;
        for (square, (range, leave_row)) in range.chunks_mut(SQUARE).zip(leave_row.chunks(SQUARE)).enumerate()
        {
            let cells = square * SQUARE..square * SQUARE + range.len();
            let codes = |kind: usize| codes(simd, cells.clone(), |k| &planes[k][kind]);
            for (row, codes) in range.iter_mut().zip(codes(0)) {
                row[first..first + TOGETHER].copy_from_slice(&codes);
            }
            if leave_row.iter().all(|&row| row <= OUTSIDE) {
                continue;
            }
            for (&row, codes) in leave_row.iter().zip(codes(1)).filter(|&(&row, _)| row > OUTSIDE) {
                leave[row as usize][first..first + TOGETHER].copy_from_slice(&codes);
            }
        }
    }
}

/// Returns the codes of some cells, each with its codes from one plane after the other.
#[inline(always)]
fn codes<'a, S: Simd>(
    simd: S,
    cells: Range<usize>,
    plane: impl Fn(usize) -> &'a Vec<u8>,
) -> [[u8; TOGETHER]; SQUARE] {
    if cells.len() < SQUARE {
        return std::array::from_fn(|i| {
            std::array::from_fn(|k| plane(k).get(cells.start + i).copied().unwrap_or(0))
        });
    }
    transposed(std::array::from_fn(|k| u8x16::from_slice(simd, &plane(k)[cells.clone()]))).map(Into::into)
}

/// Returns, for each cell, its row in the table of distances out of walls.
fn leave_rows(wall: &[bool], width: usize) -> Vec<u32> {
    let height = wall.len() / width;
    let ring = |at: usize| [0, width - 1].contains(&(at % width)) || [0, height - 1].contains(&(at / width));
    let mut last = OUTSIDE;
    let mut row = |(at, &wall): (usize, &bool)| match wall {
        true if ring(at) => OUTSIDE,
        true => {
            last += 1;
            last
        }
        false => 0,
    };
    wall.iter().enumerate().map(&mut row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::sweep::{OFF_CORNERS, PARTS};
    use crate::sketch::SketchGrid;
    use proptest::prelude::*;
    use sketchnav_schemas::codes::WALL;

    /// Returns the code of the distance out of a cell's wall, or 0 if there is no wall to leave.
    fn leave(table: &RangeTable, cell: usize, direction: usize) -> u8 {
        table.rows(cell).leave.map_or(0, |row| row[direction])
    }

    /// Returns true if a distance in cells has the code, up to the rounding of both tables.
    fn has_code(way: f32, code: u8) -> bool {
        let found = (f32::from(code) / PER_OCTAVE + SHORTEST_LOG2).exp2();
        (way.max(SHORTEST_LOG2.exp2()) - found).abs() < 0.03 * found + 1.5 / PARTS
    }

    /// Returns the point of `cell` from which a direction was swept, and the unit vector of that direction.
    fn swept_from(cell: [usize; 2], size: [usize; 2], direction: usize) -> ([f32; 2], [f32; 2]) {
        let (dy, dx) = (direction as f64 / DIRECTIONS as f64 * std::f64::consts::TAU).sin_cos();
        let major = usize::from(dy.abs() > dx.abs());
        let d = [dx, dy];
        let position = if d[major] < 0.0 { size[major] - 1 - cell[major] } else { cell[major] };
        let height =
            OFF_CORNERS + d[1 - major] / d[major].abs() * (position as f64 - (size[major] / 2) as f64);
        let mut place = cell.map(|c| c as f32 + 0.5);
        place[1 - major] = cell[1 - major] as f32 + (height - height.floor()) as f32;
        (place, [dx as f32, dy as f32])
    }

    fn sketch_strategy() -> impl Strategy<Value = SketchGrid> {
        (8usize..30, 8usize..30).prop_flat_map(|(w, h)| {
            proptest::collection::vec(prop_oneof![7 => Just(0u8), 1 => Just(WALL)], w * h)
                .prop_map(move |cells| SketchGrid::new(w, h, &cells, 0.0).unwrap())
        })
    }

    proptest! {
        #[test]
        fn every_entry_is_the_range_of_an_exact_ray(sketch in sketch_strategy(), direction in 0..DIRECTIONS) {
            let grid = Grid::new(&sketch, 1_000_000);
            let (table, size) = (RangeTable::new(&grid), grid.cells());
            for row in 1..size[1] - 1 {
                for column in 1..size[0] - 1 {
                    let (place, d) = swept_from([column, row], size, direction);
                    // A ray through a corner may pass on either side, so the rays next to it are accepted as well.
                    let cast = |off: f32| {
                        let from = [place[0] - 1.0 - off * d[1], place[1] - 1.0 + off * d[0]];
                        grid.cast(from, d, 1e6, 1e6)
                    };
                    let code = table.range[row * size[0] + column][direction];
                    let leave = leave(&table, row * size[0] + column, direction);
                    let fits = |t: f32| if leave == NEVER { t == 0.0 } else { has_code(t, code) };
                    prop_assert!([0.0, 1e-3, -1e-3].iter().any(|&off| fits(cast(off))),
                        "cell {column}, {row}: {} in the table ({leave}), {} by ray", f32::from(code) / PER_OCTAVE, cast(0.0));
                }
            }
        }
    }

    #[test]
    fn a_thin_slanted_wall_is_never_seen_through() {
        let (w, h) = (60, 60);
        // The cells of the wall touch only at their corners.
        let cells: Vec<u8> = (0..w * h).map(|i| if i % w == i / w { WALL } else { 0 }).collect();
        let grid = Grid::new(&SketchGrid::new(w, h, &cells, 0.0).unwrap(), 1_000_000);
        let (table, [width, _]) = (RangeTable::new(&grid), grid.cells());
        for (column, row) in [(40, 20), (50, 49), (30, 10), (59, 2)] {
            for direction in 0..DIRECTIONS {
                let (dy, dx) = (direction as f32 / DIRECTIONS as f32 * std::f32::consts::TAU).sin_cos();
                let approach = dy - dx;
                let to_wall = (column - row) as f32 / approach;
                let range = (f32::from(table.rows(row * width + column).range[direction]) / PER_OCTAVE
                    + SHORTEST_LOG2)
                    .exp2();
                // Allows for half a cell across and a cell of wall, along a ray that may hit the wall at a shallow angle.
                let slack = 2.0 / approach.abs();
                assert!(
                    approach <= 0.0 || range < (to_wall + slack) * 1.04,
                    "{column}, {row}, {direction}: {range} {to_wall}"
                );
            }
        }
    }

    #[test]
    fn who_stands_on_a_line_sees_out_of_it_and_who_stands_in_a_pillar_does_not() {
        let (w, h) = (40, 40);
        let wall =
            |column: usize, row: usize| column == 10 || (20..30).contains(&column) && (20..30).contains(&row);
        let cells: Vec<u8> = (0..w * h).map(|i| if wall(i % w, i / w) { WALL } else { 0 }).collect();
        let grid = Grid::new(&SketchGrid::new(w, h, &cells, 0.0).unwrap(), 1_000_000);
        let (table, [width, _]) = (RangeTable::new(&grid), grid.cells());
        let cell = |column: usize, row: usize| (row + 1) * width + column + 1;
        // Along x, the ray leaves the line at once and goes nine and a half cells to the pillar.
        let range = table.rows(cell(10, 25)).range[0];
        assert!(leave(&table, cell(10, 25), 0) == 0 && has_code(9.5, range), "{range}");
        // From the middle of the pillar, the ray goes four and a half cells to the pillar's last cell.
        let way = leave(&table, cell(24, 25), 0);
        assert!(has_code(4.5, way), "{way}");
        // Along the line, there is no way out of the wall.
        assert_eq!(leave(&table, cell(10, 25), DIRECTIONS / 4), NEVER);
    }
}
