//! Sweeps parallel lines over a drawing to find the visible range from every cell in one direction.
//!
//! There is one line for each cell across. All lines are followed backwards at once, through every cell that they touch, so they
//! never slip through a wall, however thin or slanted. The range of a cell is measured from the point of its line at the middle of
//! the cell's column (or row), in cells.

use std::ops::Range;

use fearless_simd::{Level, dispatch, prelude::*, u8x16};

use super::range_code::{DIRECTIONS, NEVER, code};

/// Number of parts of a cell, in which distances along a line are measured to look up their codes.
pub const PARTS: f32 = 16.0;

/// A place along the lines, as twice the number of whole parts of a cell, plus one if the place lies between two parts. Look-ups
/// use whole parts, but whether a cell begins exactly at a place must remain distinguishable.
type Place = u32;

/// Mask of a line in a wall, with all bits set.
const IN_WALL: u32 = u32::MAX;

/// A place beyond every wall.
const FAR: Place = Place::MAX;

/// Returns the place at a number of cells along the lines.
fn place(cells: f32) -> Place {
    let parts = cells * PARTS;
    2 * parts as Place + Place::from(parts.fract() > 0.0)
}

/// Where lines pass through a cell at the middle of the drawing, as a fraction of the cell. This is nearly the middle of the cell,
/// but lines at 45° must not run from corner to corner, where rounding would choose the side.
pub const OFF_CORNERS: f64 = 0.4;

/// The wall cells, both row by row and column by column, for lines in either direction.
pub struct Walls {
    by_row: Vec<bool>,
    by_column: Vec<bool>,
}

impl Walls {
    /// Creates the walls from cells in rows of `width`.
    pub fn new(by_row: Vec<bool>, width: usize) -> Self {
        let mut by_column = vec![false; by_row.len()];
        transpose(&by_row, width, &mut by_column);
        Self { by_row, by_column }
    }
}

/// Transposes cells in rows of `width` to columns.
pub fn transpose<T: Copy>(from: &[T], width: usize, to: &mut [T]) {
    /// Side of squares that fit into the first-level cache.
    const SIDE: usize = 32;
    let height = from.len() / width;
    for top in (0..height).step_by(SIDE) {
        for left in (0..width).step_by(SIDE) {
            for column in left..(left + SIDE).min(width) {
                for row in top..(top + SIDE).min(height) {
                    to[column * height + row] = from[row * width + column];
                }
            }
        }
    }
}

/// Transposes bytes in rows of `width` to columns.
pub fn transpose_bytes(from: &[u8], width: usize, to: &mut [u8]) {
    dispatch!(Level::new(), simd => transpose_bytes_by(simd, from, width, to));
}

#[inline(always)]
fn transpose_bytes_by<S: Simd>(simd: S, from: &[u8], width: usize, to: &mut [u8]) {
    let height = from.len() / width;
    for top in (0..height - height % SQUARE).step_by(SQUARE) {
        for left in (0..width - width % SQUARE).step_by(SQUARE) {
            let rows =
                std::array::from_fn(|k| u8x16::from_slice(simd, &from[(top + k) * width + left..][..SQUARE]));
            for (k, column) in transposed(rows).into_iter().enumerate() {
                column.store_slice(&mut to[(left + k) * height + top..][..SQUARE]);
            }
        }
    }
    let rest = |row: usize| if row < height - height % SQUARE { width - width % SQUARE } else { 0 };
    for (row, column) in (0..height).flat_map(|row| (rest(row)..width).map(move |column| (row, column))) {
        to[column * height + row] = from[row * width + column];
    }
}

/// Number of bytes along a side of a square that is transposed at once.
pub const SQUARE: usize = 16;

/// Transposes a square of bytes from rows to columns. The bytes of the first half of the rows are interleaved with those of the
/// second half, four times.
#[inline(always)]
pub fn transposed<S: Simd>(mut rows: [u8x16<S>; SQUARE]) -> [u8x16<S>; SQUARE] {
    for _ in 0..SQUARE.ilog2() {
        rows = std::array::from_fn(|k| {
            let (low, high) = (rows[k / 2], rows[k / 2 + SQUARE / 2]);
            if k % 2 == 0 { low.zip_low(high) } else { low.zip_high(high) }
        });
    }
    rows
}

/// The lines in one direction. Positions count forward in that direction along the *major* axis, which is the axis that the
/// direction is nearer to. Cells across lie along the *minor* axis.
pub struct Sweep {
    steps: Vec<Step>,
    /// True if the major axis is y.
    upright: bool,
    /// True if positions count down the axis.
    backward: bool,
    /// Number of cells across.
    across: usize,
    /// The greatest `minor` of all steps. At that step, line 0 is the first line within the drawing.
    highest: i32,
    /// The codes of ranges, by whole parts of a cell.
    codes: Vec<u8>,
    /// The codes of distances out of walls, by differences of places. The last code is for walls without a way out.
    leave_codes: Vec<u8>,
}

/// The cell of line 0 at one position of the major axis, and the continuation of the line to the next position.
#[derive(Clone, Copy)]
struct Step {
    /// The cell on the minor axis, at the middle of the position.
    minor: i32,
    /// The cell between this one and that of the next position, if the line touches such a cell.
    between: Option<Between>,
    /// The place where the next position's cell begins.
    next_entry: Place,
}

#[derive(Clone, Copy)]
struct Between {
    /// True if the cell lies at the next position already.
    ahead: bool,
    minor: i32,
    entry: Place,
}

impl Sweep {
    /// Creates the sweep in one of [`DIRECTIONS`] directions over a drawing of the given size in columns and rows.
    pub fn new(direction: usize, [width, height]: [usize; 2]) -> Self {
        let angle = direction as f64 / DIRECTIONS as f64 * std::f64::consts::TAU;
        let (dy, dx) = angle.sin_cos();
        let upright = dy.abs() > dx.abs();
        let (major, minor) = if upright { (dy, dx) } else { (dx, dy) };
        let (along, across) = if upright { (height, width) } else { (width, height) };
        let slope = minor / major.abs();
        let cells_per_step = 1.0_f64.hypot(slope);
        let steps: Vec<Step> = (0..along).map(|position| Step::new(position, along, slope)).collect();
        let codes = codes((along + 1) * PARTS as usize, cells_per_step);
        Self {
            highest: steps.iter().map(|step| step.minor).max().unwrap_or(0),
            steps,
            upright,
            backward: major < 0.0,
            across,
            leave_codes: leave_codes(&codes),
            codes,
        }
    }

    /// Returns true if the sweep writes planes row by row, and false if it writes them column by column.
    pub fn is_upright(&self) -> bool {
        self.upright
    }

    /// Writes the code of the range from each cell to `plane`, and the code of the distance out of the wall to `leave` for each
    /// cell in a wall.
    pub fn run(&self, walls: &Walls, views: &mut Views, plane: &mut [u8], leave: &mut [u8]) {
        dispatch!(Level::new(), _simd => self.run_through(walls, views, plane, leave));
    }

    #[inline(always)]
    fn run_through(&self, walls: &Walls, views: &mut Views, plane: &mut [u8], leave: &mut [u8]) {
        let wall = if self.upright { &walls.by_row } else { &walls.by_column };
        for position in (0..self.steps.len()).rev() {
            self.pass(position, wall, views);
            let (at, cells) = (place(position as f32 + 0.5), self.row(position) * self.across);
            let cells = cells..cells + self.across;
            views.ranges(self.lines(position), at, &self.codes, &mut plane[cells.clone()]);
            views.leaves(self.lines(position), at, &self.leave_codes, &mut leave[cells]);
        }
    }

    /// Continues the lines backwards into the cells at a position.
    #[inline(always)]
    fn pass(&self, position: usize, wall: &[bool], views: &mut Views) {
        let (step, lines) = (&self.steps[position], self.lines(position));
        let row = |position: usize| &wall[self.row(position) * self.across..][..self.across];
        let ahead = self.common(&lines, position + 1);
        views.begin(lines.start..ahead.start);
        views.begin(ahead.end..lines.end);
        if let Some(between) = step.between {
            let first = (ahead.start as i32 - self.highest + between.minor) as usize;
            let at = position + usize::from(between.ahead && !ahead.is_empty());
            let cells = row(at).get(first..first + ahead.len()).unwrap_or_default();
            views.enter(ahead, cells, between.entry);
        }
        let behind = self.common(&lines, position.wrapping_sub(1));
        let entry = position.checked_sub(1).map_or(0, |before| self.steps[before].next_entry);
        let edge = place(position as f32);
        for (part, entry) in
            [(lines.start..behind.start, edge), (behind.clone(), entry), (behind.end..lines.end, edge)]
        {
            let cells = part.start - lines.start..part.end - lines.start;
            views.enter(part, &row(position)[cells], entry);
        }
    }

    /// Returns the lines within the drawing at a position, counted from the first line of the sweep. Their number is the same at
    /// every position.
    fn lines(&self, position: usize) -> Range<usize> {
        let first = (self.highest - self.steps[position].minor) as usize;
        first..first + self.across
    }

    /// Returns those of `lines` that are within the drawing at another position as well. The result is empty if that position is
    /// outside.
    fn common(&self, lines: &Range<usize>, position: usize) -> Range<usize> {
        if position >= self.steps.len() {
            return lines.end..lines.end;
        }
        let other = self.lines(position);
        lines.start.max(other.start)..lines.end.min(other.end)
    }

    /// Returns the row, or column, at a position.
    fn row(&self, position: usize) -> usize {
        if self.backward { self.steps.len() - 1 - position } else { position }
    }
}

/// Returns the codes of the first `count` distances in parts of a cell, with `cells_per_step` cells of distance per position. Codes
/// never decrease, so the start of the next code is found by bisection.
fn codes(count: usize, cells_per_step: f64) -> Vec<u8> {
    let code = |parts: usize| code(parts as f64 / f64::from(PARTS) * cells_per_step);
    let mut codes = Vec::with_capacity(count);
    while codes.len() < count {
        let this = code(codes.len());
        let (mut same, mut other) = (codes.len(), count);
        while other - same > 1 {
            let middle = same.midpoint(other);
            if code(middle) == this { same = middle } else { other = middle }
        }
        codes.resize(other, this);
    }
    codes
}

impl Step {
    /// Creates the step at `position` of the line with a slope of `slope` cells per position that passes the middle of the drawing.
    fn new(position: usize, along: usize, slope: f64) -> Self {
        let middle = (along / 2) as f64 + 0.5;
        let height = |at: f64| OFF_CORNERS + slope * (at - middle);
        let minor = |at: f64| height(at).floor() as i32;
        let (here, border, there) =
            (minor(position as f64 + 0.5), minor(position as f64 + 1.0), minor(position as f64 + 1.5));
        let border_at = position as f64 + 1.0;
        if here == there {
            return Self { minor: here, between: None, next_entry: place(border_at as f32) };
        }
        let crossing = (middle + (f64::from(here.max(there)) - OFF_CORNERS) / slope) as f32;
        let ahead = border == here;
        let (border_at, crossing) = (place(border_at as f32), place(crossing));
        let (entry, next_entry) = if ahead { (border_at, crossing) } else { (crossing, border_at) };
        let minor = if ahead { here } else { there };
        Self { minor: here, between: Some(Between { ahead, minor, entry }), next_entry }
    }
}

/// Returns the codes of the distances out of walls by differences of places, given the `codes` of whole parts of a cell.
fn leave_codes(codes: &[u8]) -> Vec<u8> {
    let mut leave: Vec<u8> = codes.iter().flat_map(|&code| [code.clamp(1, NEVER - 1); 2]).collect();
    leave[0] = 0;
    leave.push(NEVER);
    leave
}

/// What lies ahead on each line while the lines are followed backwards.
pub struct Views {
    /// Masks with all bits set in a wall, and none outside.
    in_wall: Vec<u32>,
    /// The place where the nearest wall ahead begins.
    wall: Vec<Place>,
    /// For lines in a wall, the place where the wall's last cell begins.
    last_cell: Vec<Place>,
    /// For lines in a wall, the place where the next wall after it begins.
    wall_behind: Vec<Place>,
    /// Distances along the lines at a position, in parts of a cell or as differences of places.
    ways: Vec<u32>,
}

impl Views {
    /// Creates buffers for a drawing of the given size in columns and rows.
    pub fn new([width, height]: [usize; 2]) -> Self {
        // Lines at 45° begin at every cell of both sides.
        let lines = width + height + 1;
        let far = || vec![FAR; lines];
        Self {
            in_wall: vec![IN_WALL; lines],
            wall: far(),
            last_cell: far(),
            wall_behind: far(),
            ways: vec![0; lines],
        }
    }

    /// Begins lines that come from outside, where everything is wall.
    fn begin(&mut self, lines: Range<usize>) {
        self.in_wall[lines.clone()].fill(IN_WALL);
        for column in [&mut self.wall, &mut self.last_cell, &mut self.wall_behind] {
            column[lines.clone()].fill(FAR);
        }
    }

    /// Advances the lines into their next cells, which begin at `entry`.
    #[inline(always)]
    fn enter(&mut self, lines: Range<usize>, cells: &[bool], entry: Place) {
        let lines = lines.start..lines.start + cells.len();
        let (in_wall, wall) = (&mut self.in_wall[lines.clone()], &mut self.wall[lines.clone()]);
        let (last_cell, behind) = (&mut self.last_cell[lines.clone()], &mut self.wall_behind[lines]);
        enter(in_wall, wall, last_cell, behind, cells, entry);
    }

    /// Writes the codes of the distances to the next walls.
    #[inline(always)]
    fn ranges(&mut self, lines: Range<usize>, at: Place, codes: &[u8], out: &mut [u8]) {
        let ways = &mut self.ways[..out.len()];
        let (in_wall, wall) = (&self.in_wall[lines.clone()], &self.wall[lines.clone()]);
        ways_ahead(in_wall, wall, &self.wall_behind[lines], at, codes.len() as u32 - 1, ways);
        out.iter_mut().zip(ways).for_each(|(out, way)| *out = codes[*way as usize]);
    }

    /// Writes the codes of the distances out of walls, for the cells in a wall.
    #[inline(always)]
    fn leaves(&mut self, lines: Range<usize>, at: Place, codes: &[u8], out: &mut [u8]) {
        /// Number of cells that are checked together, since many cells are free.
        const TOGETHER: usize = 32;
        let ways = &mut self.ways[..out.len()];
        ways_out(&self.last_cell[lines.clone()], at, codes.len() as u32 - 1, ways);
        let cells =
            self.in_wall[lines].chunks(TOGETHER).zip(ways.chunks(TOGETHER)).zip(out.chunks_mut(TOGETHER));
        for ((in_wall, ways), out) in cells {
            if in_wall.iter().fold(0, |any, one| any | one) > 0 {
                out.iter_mut().zip(ways).for_each(|(out, way)| *out = codes[*way as usize]);
            }
        }
    }
}

/// Advances lines into their next cells, which begin at `entry`. It uses masks because conditional writes were not vectorized.
#[inline(always)]
fn enter(
    in_wall: &mut [u32],
    wall: &mut [Place],
    last_cell: &mut [Place],
    wall_behind: &mut [Place],
    cells: &[bool],
    entry: Place,
) {
    let count = cells.len();
    let (in_wall, wall) = (&mut in_wall[..count], &mut wall[..count]);
    let (last_cell, wall_behind) = (&mut last_cell[..count], &mut wall_behind[..count]);
    for i in 0..count {
        let cell = if cells[i] { IN_WALL } else { 0 };
        let is_new = cell & !in_wall[i];
        last_cell[i] = entry & is_new | last_cell[i] & !is_new;
        wall_behind[i] = wall[i] & is_new | wall_behind[i] & !is_new;
        wall[i] = entry & cell | wall[i] & !cell;
        in_wall[i] = cell;
    }
}

/// Computes the distances to the next walls, in whole parts of a cell and at most `last`.
#[inline(always)]
fn ways_ahead(in_wall: &[u32], wall: &[Place], behind: &[Place], at: Place, last: u32, ways: &mut [u32]) {
    let count = ways.len();
    let (in_wall, wall, behind) = (&in_wall[..count], &wall[..count], &behind[..count]);
    for i in 0..count {
        let wall = behind[i] & in_wall[i] | wall[i] & !in_wall[i];
        let way = wall.saturating_sub(at) / 2;
        ways[i] = if wall == FAR { last } else { way.min(last) };
    }
}

/// Computes the distances to the last cells of walls, as differences of places. They are less than `never`, which stands for walls
/// without a way out.
#[inline(always)]
fn ways_out(last_cell: &[Place], at: Place, never: u32, ways: &mut [u32]) {
    let last_cell = &last_cell[..ways.len()];
    for i in 0..last_cell.len() {
        let way = last_cell[i].saturating_sub(at).min(never - 1);
        ways[i] = if last_cell[i] == FAR { never } else { way };
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn bytes_are_turned_over_as_other_cells_are(width in 1usize..70, height in 1usize..70) {
            let from: Vec<u8> = (0..width * height).map(|i| (i * 31 % 251) as u8).collect();
            let (mut bytes, mut cells) = (vec![0; from.len()], vec![0; from.len()]);
            transpose_bytes(&from, width, &mut bytes);
            transpose(&from, width, &mut cells);
            prop_assert_eq!(bytes, cells);
        }

        #[test]
        fn codes_are_those_of_each_way(count in 1usize..4000, cells_per_step in 1.0..1.5) {
            let each = |parts: usize| code(parts as f64 / f64::from(PARTS) * cells_per_step);
            prop_assert_eq!(codes(count, cells_per_step), (0..count).map(each).collect::<Vec<u8>>());
        }
    }
}
