//! Parallel lines, swept over a drawing: how far one sees from every cell in one direction.
//!
//! There is one line for each cell across. All are followed backwards at once, through every cell that
//! they touch, so no wall, however thin or slanted, is ever slipped through; each cell takes what is
//! seen from the point of its line in the middle column (or row). It knows no scale.

use std::ops::Range;

use fearless_simd::{Level, dispatch};

use super::sight::{DIRECTIONS, code};

/// Codes of ways are looked up by the way along the line in such parts of a cell.
pub const PARTS: f32 = 16.0;

/// Where lines pass the middle of the drawing, in parts of a cell: nearly in the cells' middle, but so
/// that those at 45° do not run from corner to corner, where rounding would choose the side.
pub const OFF_CORNERS: f64 = 0.4;

/// What is wall, row by row and column by column: lines take whichever they cross.
pub struct Walls {
    by_row: Vec<bool>,
    by_column: Vec<bool>,
}

impl Walls {
    /// Of cells in rows of `width`.
    pub fn new(by_row: Vec<bool>, width: usize) -> Self {
        let mut by_column = vec![false; by_row.len()];
        transpose(&by_row, width, &mut by_column);
        Self { by_row, by_column }
    }
}

/// The cells of rows of `width`, column by column.
pub fn transpose<T: Copy>(from: &[T], width: usize, to: &mut [T]) {
    /// Squares of so many cells stay in the nearest cache.
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

/// The lines in one direction. Positions along the *major* axis, the one that the direction is nearer
/// to, count forward in the direction; cells across lie on the *minor* axis.
pub struct Sweep {
    steps: Vec<Step>,
    /// Whether the major axis is y.
    upright: bool,
    /// Whether positions count down the axis.
    backward: bool,
    /// Cells across.
    across: usize,
    /// The greatest minor of all steps: line 0's there is the first of all lines' that is in the drawing.
    highest: i32,
    codes: Vec<u8>,
}

/// Where line 0 runs at one position of the major axis, and how it goes on to the next.
#[derive(Clone, Copy)]
struct Step {
    /// The cell on the minor axis at the middle.
    minor: i32,
    /// The cell between this one and the next, where the line touches a third.
    between: Option<Between>,
    /// Where the next position's cell begins.
    next_entry: f32,
}

#[derive(Clone, Copy)]
struct Between {
    /// Whether it lies at the next position already.
    ahead: bool,
    minor: i32,
    entry: f32,
}

impl Sweep {
    /// In one of [`DIRECTIONS`], over a drawing of `size` columns and rows.
    pub fn new(direction: usize, [width, height]: [usize; 2]) -> Self {
        let angle = direction as f64 / DIRECTIONS as f64 * std::f64::consts::TAU;
        let (dy, dx) = angle.sin_cos();
        let upright = dy.abs() > dx.abs();
        let (major, minor) = if upright { (dy, dx) } else { (dx, dy) };
        let (along, across) = if upright { (height, width) } else { (width, height) };
        let slope = minor / major.abs();
        let cells_per_step = 1.0_f64.hypot(slope);
        let code = |parts: usize| code(parts as f64 / f64::from(PARTS) * cells_per_step);
        let steps: Vec<Step> = (0..along).map(|position| Step::new(position, along, slope)).collect();
        Self {
            highest: steps.iter().map(|step| step.minor).max().unwrap_or(0),
            steps,
            upright,
            backward: major < 0.0,
            across,
            codes: (0..(along + 1) * PARTS as usize).map(code).collect(),
        }
    }

    /// Whether its planes lie row by row; else column by column.
    pub fn is_upright(&self) -> bool {
        self.upright
    }

    /// Writes into `plane` the code of the range from each cell, and tells `leave` the codes of the ways
    /// out of the wall from each cell in one (row by row).
    pub fn run(&self, walls: &Walls, views: &mut Views, plane: &mut [u8], leave: &mut impl FnMut(usize, u8)) {
        let wall = if self.upright { &walls.by_row } else { &walls.by_column };
        for position in (0..self.steps.len()).rev() {
            dispatch!(Level::new(), _simd => self.pass(position, wall, views));
            let (at, row) = (position as f32 + 0.5, self.row(position));
            let lines = self.lines(position);
            let out = &mut plane[row * self.across..][..self.across];
            dispatch!(Level::new(), _simd => views.ranges(lines.clone(), at, &self.codes, out));
            self.tell_leaves(row, lines, at, views, leave);
        }
    }

    /// Tells `leave` the codes of the ways out of walls from the cells of a row (or column).
    fn tell_leaves(
        &self,
        row: usize,
        lines: Range<usize>,
        at: f32,
        views: &Views,
        leave: &mut impl FnMut(usize, u8),
    ) {
        /// Most cells are free: so many at a time are looked at together.
        const TOGETHER: usize = 64;
        let (in_wall, last_cell) = (&views.in_wall[lines.clone()], &views.last_cell[lines]);
        for (k, in_wall) in in_wall.chunks(TOGETHER).enumerate() {
            if !in_wall.iter().fold(false, |any, &in_wall| any | in_wall) {
                continue;
            }
            for lane in (0..in_wall.len()).filter(|&lane| in_wall[lane]) {
                let minor = k * TOGETHER + lane;
                let cell =
                    if self.upright { row * self.across + minor } else { minor * self.steps.len() + row };
                leave(cell, self.leave_code(last_cell[minor] - at));
            }
        }
    }

    /// Takes the lines on, backwards, into the cells at a position.
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
        let entry = position.checked_sub(1).map_or(0.0, |before| self.steps[before].next_entry);
        let edge = position as f32;
        for (part, entry) in
            [(lines.start..behind.start, edge), (behind.clone(), entry), (behind.end..lines.end, edge)]
        {
            let cells = part.start - lines.start..part.end - lines.start;
            views.enter(part, &row(position)[cells], entry);
        }
    }

    /// The lines that are within the drawing at a position, counted from the first that ever is. There are
    /// as many everywhere.
    fn lines(&self, position: usize) -> Range<usize> {
        let first = (self.highest - self.steps[position].minor) as usize;
        first..first + self.across
    }

    /// Those of `lines` that are within the drawing at another position, too; none where that is outside.
    fn common(&self, lines: &Range<usize>, position: usize) -> Range<usize> {
        if position >= self.steps.len() {
            return lines.end..lines.end;
        }
        let other = self.lines(position);
        lines.start.max(other.start)..lines.end.min(other.end)
    }

    /// The row, or column, at a position.
    fn row(&self, position: usize) -> usize {
        if self.backward { self.steps.len() - 1 - position } else { position }
    }

    fn leave_code(&self, way: f32) -> u8 {
        match way {
            way if way <= 0.0 => 0,
            f32::INFINITY => super::sight::NEVER,
            way => code_of(&self.codes, way).clamp(1, super::sight::NEVER - 1),
        }
    }
}

#[inline(always)]
fn code_of(codes: &[u8], way: f32) -> u8 {
    codes[((way * PARTS) as usize).min(codes.len() - 1)]
}

impl Step {
    /// The line near the middle of the cell at half of `along`, with `slope` cells a position.
    fn new(position: usize, along: usize, slope: f64) -> Self {
        let middle = (along / 2) as f64 + 0.5;
        let height = |at: f64| OFF_CORNERS + slope * (at - middle);
        let minor = |at: f64| height(at).floor() as i32;
        let (here, border, there) =
            (minor(position as f64 + 0.5), minor(position as f64 + 1.0), minor(position as f64 + 1.5));
        let border_at = position as f64 + 1.0;
        if here == there {
            return Self { minor: here, between: None, next_entry: border_at as f32 };
        }
        let crossing = (middle + (f64::from(here.max(there)) - OFF_CORNERS) / slope) as f32;
        let ahead = border == here;
        let (entry, next_entry) =
            if ahead { (border_at as f32, crossing) } else { (crossing, border_at as f32) };
        let minor = if ahead { here } else { there };
        Self { minor: here, between: Some(Between { ahead, minor, entry }), next_entry }
    }
}

/// What lies ahead on each of the lines that are followed back.
pub struct Views {
    in_wall: Vec<bool>,
    /// Where the nearest wall ahead begins.
    wall: Vec<f32>,
    /// In a wall: where its last cell begins, ...
    last_cell: Vec<f32>,
    /// ... and where the wall behind it does.
    wall_behind: Vec<f32>,
}

impl Views {
    /// Room for a drawing of `size` columns and rows.
    pub fn new([width, height]: [usize; 2]) -> Self {
        // Lines at 45° begin at every cell of both sides.
        let lines = width + height + 1;
        let far = || vec![f32::INFINITY; lines];
        Self { in_wall: vec![true; lines], wall: far(), last_cell: far(), wall_behind: far() }
    }

    /// Some lines come from outside, where all is wall.
    fn begin(&mut self, lines: Range<usize>) {
        self.in_wall[lines.clone()].fill(true);
        for column in [&mut self.wall, &mut self.last_cell, &mut self.wall_behind] {
            column[lines.clone()].fill(f32::INFINITY);
        }
    }

    /// The lines enter their next cells, at `entry`.
    #[inline(always)]
    fn enter(&mut self, lines: Range<usize>, cells: &[bool], entry: f32) {
        let count = cells.len();
        let lines = lines.start..lines.start + count;
        let in_wall = &mut self.in_wall[lines.clone()][..count];
        let wall = &mut self.wall[lines.clone()][..count];
        let last_cell = &mut self.last_cell[lines.clone()][..count];
        let wall_behind = &mut self.wall_behind[lines][..count];
        for i in 0..count {
            let is_new = cells[i] & !in_wall[i];
            last_cell[i] = if is_new { entry } else { last_cell[i] };
            wall_behind[i] = if is_new { wall[i] } else { wall_behind[i] };
            wall[i] = if cells[i] { entry } else { wall[i] };
            in_wall[i] = cells[i];
        }
    }

    /// The codes of the ways to the next walls.
    #[inline(always)]
    fn ranges(&self, lines: Range<usize>, at: f32, codes: &[u8], out: &mut [u8]) {
        let (in_wall, wall) = (&self.in_wall[lines.clone()], &self.wall[lines.clone()]);
        let seen = in_wall.iter().zip(wall).zip(&self.wall_behind[lines]);
        for (out, ((&in_wall, &wall), &behind)) in out.iter_mut().zip(seen) {
            *out = code_of(codes, if in_wall { behind } else { wall } - at);
        }
    }
}
