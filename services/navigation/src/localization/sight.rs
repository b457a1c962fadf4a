//! How far one sees from everywhere in every direction, tabulated: what the visibility model asks
//! thousands of times an update.
//!
//! For each cell of the reduced drawing and each of [`DIRECTIONS`] directions stands the logarithm of
//! the range to the first wall, in a byte. The table is filled by sweeping lines across the drawing,
//! one for each direction and row (or column): a line is followed backwards through every cell that
//! it touches, so no wall, however thin or slanted, is ever slipped through, and each cell takes the
//! range from the point of the line in its middle column (or row). An entry is therefore the exact
//! range from a place in the cell, in a direction at most half a step off.
//!
//! A cell in a wall also has the way through that wall (see [`Grid::cast`]). It knows no scale.

use super::grid::Grid;

/// Directions of the table, evenly around, the first along x.
pub const DIRECTIONS: usize = 64;
/// Most cells of a drawing's table: their ranges fill 32 MB, and the ways out of walls as much again
/// where all is wall. (A table of 200,000 cells, whose walls are thicker and doors narrower, lost the
/// way in 11 of 40 drives through a wobbly drawing in which none was lost with this one.)
pub const SIGHT_CELLS: usize = 500_000;
/// Entries per octave of range.
const PER_OCTAVE: f32 = 16.0;
/// Binary logarithm of the shortest range in the table, cells.
const SHORTEST_LOG2: f32 = -3.0;
/// The row of the ways out of the ring around the drawing: none.
const OUTSIDE: u32 = 1;
/// The code of a wall that is never left.
const NEVER: u8 = u8::MAX;
/// Range codes are looked up by the way along the line in such parts of a cell.
const PARTS: f32 = 16.0;

/// Where lines pass the middle of the drawing, in parts of a cell: nearly in the cells' middle, but so
/// that those at 45° do not run from corner to corner, where rounding would choose the side.
const OFF_CORNERS: f64 = 0.4;
/// Directions that are swept before they are put into the rows.
const TOGETHER: usize = 16;

/// The codes of one cell, by direction.
pub type Row = [u8; DIRECTIONS];

/// The table.
#[derive(Debug, Clone)]
pub struct Sight {
    width: usize,
    height: usize,
    px_per_cell: f32,
    range: Vec<Row>,
    /// The first row is that of all free cells, the second ([`OUTSIDE`]) that of the ring.
    leave: Vec<Row>,
    leave_row: Vec<u32>,
}

impl Sight {
    /// Sweeps over all of `grid`.
    pub fn new(grid: &Grid) -> Self {
        let [width, height] = grid.cells();
        let wall: Vec<bool> = grid.walls().collect();
        let leave_row = leave_rows(&wall, width);
        let rows = leave_row.iter().max().map_or(0, |&last| last as usize + 1).max(2);
        let mut sight = Self {
            width,
            height,
            px_per_cell: grid.px_per_cell(),
            range: vec![[0; DIRECTIONS]; width * height],
            leave: vec![[0; DIRECTIONS]; rows],
            leave_row,
        };
        sight.leave[OUTSIDE as usize].fill(NEVER);
        let mut planes = vec![vec![0; width * height]; TOGETHER];
        for first in (0..DIRECTIONS).step_by(TOGETHER) {
            for (k, plane) in planes.iter_mut().enumerate() {
                sight.sweep(&wall, first + k, plane);
            }
            sight.interleave(first, &planes);
        }
        sight
    }

    /// Columns and rows, the ring around the drawing included.
    pub fn cells(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Pixels along an edge of a cell.
    pub fn px_per_cell(&self) -> f32 {
        self.px_per_cell
    }

    /// Codes of the ranges and of the ways out of a wall from a cell. [`Self::log2_px`] decodes both; a
    /// way of code 0 is none at all.
    #[inline(always)]
    pub fn rows(&self, cell: usize) -> (&Row, &Row) {
        let cell = cell.min(self.range.len() - 1);
        (&self.range[cell], &self.leave[self.leave_row[cell] as usize])
    }

    /// Factor and summand that turn a code into the binary logarithm of a way in pixels.
    pub fn log2_px(&self) -> [f32; 2] {
        [1.0 / PER_OCTAVE, SHORTEST_LOG2 + self.px_per_cell.log2()]
    }

    /// Fills `plane` with the codes of the ranges in one direction, and in the table those of the ways
    /// out of walls.
    fn sweep(&mut self, wall: &[bool], direction: usize, plane: &mut [u8]) {
        let sweep = Sweep::new(direction, self.width, self.height);
        for line in sweep.lines() {
            sweep.follow_back(line, wall, |cell, seen| {
                plane[cell] = sweep.code(seen.range);
                let Some(leave) = seen.leave else { return };
                let row = self.leave_row[cell];
                if row > OUTSIDE {
                    self.leave[row as usize][direction] = sweep.leave_code(leave);
                }
            });
        }
    }

    /// Planes of directions become parts of the cells' rows. (To write each code into its row at once
    /// took three times as long.)
    fn interleave(&mut self, first: usize, planes: &[Vec<u8>]) {
        for (cell, row) in self.range.iter_mut().enumerate() {
            let part = &mut row[first..first + planes.len()];
            part.iter_mut().zip(planes).for_each(|(code, plane)| *code = plane[cell]);
        }
    }
}

/// Parallel lines in one direction. Positions along the *major* axis, the one that the direction is
/// nearer to, count forward in the direction; there is one line for each cell of the *minor* axis.
struct Sweep {
    steps: Vec<Step>,
    /// Whether the cells across grow.
    rises: bool,
    /// Cells across.
    across: i32,
    first_cell: isize,
    major_stride: isize,
    minor_stride: isize,
    /// Codes of ranges, by the way along the major axis in parts of a cell.
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

/// What is seen from a point: ways along the major axis, cells.
struct Seen {
    range: f32,
    /// From within a wall: the way to the last cell of that wall; infinite where it has no end.
    leave: Option<f32>,
}

impl Sweep {
    fn new(direction: usize, width: usize, height: usize) -> Self {
        let angle = direction as f64 / DIRECTIONS as f64 * std::f64::consts::TAU;
        let (dy, dx) = angle.sin_cos();
        let upright = dy.abs() > dx.abs();
        let (major, minor) = if upright { (dy, dx) } else { (dx, dy) };
        let (along, across) = if upright { (height, width) } else { (width, height) };
        let (major_step, minor_stride) = if upright { (width as isize, 1) } else { (1, width as isize) };
        let backward = major < 0.0;
        let slope = minor / major.abs();
        let cells_per_step = 1.0_f64.hypot(slope);
        let code = |parts: usize| code(parts as f64 / f64::from(PARTS) * cells_per_step);
        Self {
            steps: (0..along).map(|position| Step::new(position, along, slope)).collect(),
            rises: slope >= 0.0,
            across: across as i32,
            first_cell: if backward { (along as isize - 1) * major_step } else { 0 },
            major_stride: if backward { -major_step } else { major_step },
            minor_stride,
            codes: (0..(along + 1) * PARTS as usize).map(code).collect(),
        }
    }

    /// All lines that touch the drawing, by where they cross position 0.
    fn lines(&self) -> std::ops::Range<i32> {
        let minors = || self.steps.iter().map(|step| step.minor);
        let (lowest, highest) = (minors().min().unwrap_or(0), minors().max().unwrap_or(0));
        -highest..self.across - lowest
    }

    /// Follows a line against its direction, and says at each position what is seen there.
    fn follow_back(&self, line: i32, wall: &[bool], mut say: impl FnMut(usize, Seen)) {
        let (first, end) = self.within(line);
        let mut view = View::from_outside();
        for position in (first..end).rev() {
            let step = &self.steps[position];
            if let Some(between) = step.between.filter(|_| position + 1 < end) {
                let at = position + usize::from(between.ahead);
                view.enter(wall[self.cell(at, line + between.minor)], between.entry);
            }
            let cell = self.cell(position, line + step.minor);
            let entry = if position > first { self.steps[position - 1].next_entry } else { position as f32 };
            view.enter(wall[cell], entry);
            say(cell, view.from(position as f32 + 0.5));
        }
    }

    /// The positions at which a line is within the drawing: since its cells across only grow or only
    /// shrink, they are in one piece.
    fn within(&self, line: i32) -> (usize, usize) {
        let bound =
            |before: &dyn Fn(i32) -> bool| self.steps.partition_point(|step| before(line + step.minor));
        if self.rises {
            (bound(&|minor| minor < 0), bound(&|minor| minor < self.across))
        } else {
            (bound(&|minor| minor >= self.across), bound(&|minor| minor >= 0))
        }
    }

    fn cell(&self, position: usize, minor: i32) -> usize {
        (self.first_cell + position as isize * self.major_stride + minor as isize * self.minor_stride)
            as usize
    }

    fn code(&self, way: f32) -> u8 {
        self.codes[((way * PARTS) as usize).min(self.codes.len() - 1)]
    }

    fn leave_code(&self, way: f32) -> u8 {
        match way {
            way if way <= 0.0 => 0,
            f32::INFINITY => NEVER,
            way => self.code(way).clamp(1, NEVER - 1),
        }
    }
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

/// What lies ahead on a line that is followed back.
struct View {
    in_wall: bool,
    /// Where the nearest wall ahead begins.
    wall: f32,
    /// In a wall: where its last cell begins, and where the wall behind it does.
    last_cell: f32,
    wall_behind: f32,
}

impl View {
    /// Outside all is wall.
    fn from_outside() -> Self {
        Self { in_wall: true, wall: f32::INFINITY, last_cell: f32::INFINITY, wall_behind: f32::INFINITY }
    }

    #[inline(always)]
    fn enter(&mut self, wall: bool, entry: f32) {
        if wall {
            if !self.in_wall {
                (self.last_cell, self.wall_behind) = (entry, self.wall);
            }
            self.wall = entry;
        }
        self.in_wall = wall;
    }

    #[inline(always)]
    fn from(&self, at: f32) -> Seen {
        if self.in_wall {
            Seen { range: self.wall_behind - at, leave: Some(self.last_cell - at) }
        } else {
            Seen { range: self.wall - at, leave: None }
        }
    }
}

/// For each cell its row in the table of ways out of walls.
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

/// The code of a way of so many cells.
fn code(cells: f64) -> u8 {
    let log2 = cells.log2().max(f64::from(SHORTEST_LOG2));
    ((log2 - f64::from(SHORTEST_LOG2)) * f64::from(PER_OCTAVE)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::Sketch;
    use proptest::prelude::*;
    use sketchnav_schemas::codes::WALL;

    /// Whether a way in cells has the code, to the rounding of both tables.
    fn has_code(way: f32, code: u8) -> bool {
        let found = (f32::from(code) / PER_OCTAVE + SHORTEST_LOG2).exp2();
        (way.max(SHORTEST_LOG2.exp2()) - found).abs() < 0.03 * found + 1.5 / PARTS
    }

    /// The place in `cell` from which direction `direction` was swept, and its unit vector.
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

    fn sketch_strategy() -> impl Strategy<Value = Sketch> {
        (8usize..30, 8usize..30).prop_flat_map(|(w, h)| {
            proptest::collection::vec(prop_oneof![7 => Just(0u8), 1 => Just(WALL)], w * h)
                .prop_map(move |cells| Sketch::new(w, h, &cells, 0.0).unwrap())
        })
    }

    proptest! {
        #[test]
        fn every_entry_is_the_range_of_an_exact_ray(sketch in sketch_strategy(), direction in 0..DIRECTIONS) {
            let grid = Grid::new(&sketch, 1_000_000);
            let (sight, size) = (Sight::new(&grid), grid.cells());
            for row in 1..size[1] - 1 {
                for column in 1..size[0] - 1 {
                    let (place, d) = swept_from([column, row], size, direction);
                    // A ray through a corner may go either way; those beside it tell.
                    let cast = |off: f32| {
                        let from = [place[0] - 1.0 - off * d[1], place[1] - 1.0 + off * d[0]];
                        grid.cast(from, d, 1e6, 1e6)
                    };
                    let code = sight.range[row * size[0] + column][direction];
                    let leave = sight.rows(row * size[0] + column).1[direction];
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
        // Cells that touch at their corners only.
        let cells: Vec<u8> = (0..w * h).map(|i| if i % w == i / w { WALL } else { 0 }).collect();
        let grid = Grid::new(&Sketch::new(w, h, &cells, 0.0).unwrap(), 1_000_000);
        let (sight, [width, _]) = (Sight::new(&grid), grid.cells());
        for (column, row) in [(40, 20), (50, 49), (30, 10), (59, 2)] {
            for direction in 0..DIRECTIONS {
                let (dy, dx) = (direction as f32 / DIRECTIONS as f32 * std::f32::consts::TAU).sin_cos();
                let approach = dy - dx;
                let to_wall = (column - row) as f32 / approach;
                let range = (f32::from(sight.rows(row * width + column).0[direction]) / PER_OCTAVE
                    + SHORTEST_LOG2)
                    .exp2();
                // Half a cell off across, and a cell of wall, along a ray that may come in flat.
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
        let grid = Grid::new(&Sketch::new(w, h, &cells, 0.0).unwrap(), 1_000_000);
        let (sight, [width, _]) = (Sight::new(&grid), grid.cells());
        let at = |column: usize, row: usize| sight.rows((row + 1) * width + column + 1);
        // Along x: off the line at once, and on to the pillar nine and a half cells further.
        let (range, leave) = at(10, 25);
        assert!(leave[0] == 0 && has_code(9.5, range[0]), "{} {}", leave[0], range[0]);
        // In the pillar's middle it is four and a half cells to its last.
        let (_, leave) = at(24, 25);
        assert!(has_code(4.5, leave[0]), "{}", leave[0]);
        // Along the line there is no way out of the wall.
        assert_eq!(at(10, 25).1[DIRECTIONS / 4], NEVER);
    }
}
