//! Widens doors to their usual width.
//!
//! People draw doors as gaps in walls. The position of such a gap matters, but its width is only symbolic and, when drawn in haste,
//! often too narrow. If the width were taken literally, the scale of the drawing would seem smaller there than it is, and the robot
//! would drive past the right door. Before the filter uses the drawing, gaps narrower than a door are therefore widened as far as
//! the adjacent walls allow.
//!
//! Some passages stay as drawn:
//!
//! - passages that do not open out on both sides, such as corridors, or doors along a wall that continues past them;
//! - passages through walls that are thicker than about half the gap;
//! - accidental gaps in a line;
//! - gaps within a door's width of a narrower gap.
//!
//! Posts between two gaps are kept as well.

use fearless_simd::{Level, dispatch};
use nalgebra::Vector2;

use crate::sketch::SketchGrid;

/// Share of a door's width below which a gap is considered accidental.
const SLIP: f32 = 0.2;
/// Cosine of the minimum angle between the two sides of a gap, seen from its middle.
const OPPOSITE: f32 = -0.7;
/// Minimum ratio of the clear width beyond a door to that of the door. In a corridor, both are equal.
const OPENS_OUT: f32 = 1.15;
/// Distance from the gap's middle at which the clear width beyond it is checked, in pixels and in addition to half the gap's width.
const BEYOND_PX: f32 = 3.0;
/// Maximum distance by which a wall may be off the gap's line, as a share of the gap.
const BESIDE: f32 = 0.5;
/// Maximum slope at which a wall may lead away from the gap's line.
const SLOPE: f32 = 0.3;
/// Maximum share of an adjacent wall that widening may remove. It is limited because small rooms are drawn with small doors.
const TAKES: f32 = 0.25;

/// Returns `sketch` with the gaps in its walls widened towards `door_px`, or `None` if that changes nothing.
pub fn widened(sketch: &SketchGrid, door_px: f32) -> Option<SketchGrid> {
    let nearest = Nearest::new(sketch, door_px);
    let mut gaps = nearest.gaps(SLIP * door_px..door_px);
    gaps.sort_by(|a, b| a.width_px.total_cmp(&b.width_px));
    let mut cleared = vec![false; sketch.walls().len()];
    let mut near_door = vec![false; sketch.walls().len()];
    for gap in gaps {
        let middle = gap.middle();
        let at = middle[1] as usize * sketch.width() + middle[0] as usize;
        if near_door[at] || !nearest.opens_out(&gap) {
            continue;
        }
        let missing_px = (door_px - gap.width_px) / 2.0;
        for side in gap.sides() {
            side.clear(sketch, side.yields_px(sketch, missing_px), &mut cleared);
        }
        around(sketch, middle, door_px, |place, cell| near_door[cell] |= (place - middle).norm() < door_px);
    }
    cleared.contains(&true).then(|| sketch.cleared(&cleared))
}

/// Calls `visit` with the position and the index of each cell in the square of side 2·`reach_px` around `middle`.
fn around(sketch: &SketchGrid, middle: Vector, reach_px: f32, mut visit: impl FnMut(Vector, usize)) {
    let cells = |axis: usize, size: usize| {
        let cell = |v: f32| v.clamp(0.0, size as f32 - 1.0) as usize;
        cell(middle[axis] - reach_px)..=cell(middle[axis] + reach_px)
    };
    for row in cells(1, sketch.height()) {
        for column in cells(0, sketch.width()) {
            visit(Vector::new(column as f32, row as f32), row * sketch.width() + column);
        }
    }
}

type Vector = Vector2<f32>;

/// A gap between two wall cells.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gap {
    ends: [Vector; 2],
    width_px: f32,
}

/// One end of a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Side {
    end: Vector,
    /// Unit vector away from the gap, in the direction in which its wall runs.
    away: Vector,
    width_px: f32,
}

impl Gap {
    fn between(a: Vector, b: Vector) -> Self {
        Self { ends: [a, b], width_px: (a - b).norm() - 1.0 }
    }

    fn middle(&self) -> Vector {
        let [a, b] = self.ends;
        (a + b) / 2.0
    }

    fn sides(&self) -> [Side; 2] {
        let [a, b] = self.ends;
        let side = |end: Vector, other: Vector| Side {
            end,
            away: (end - other).normalize(),
            width_px: self.width_px,
        };
        [side(a, b), side(b, a)]
    }
}

impl Side {
    /// Returns the maximum distance of the wall from the gap's line, in pixels, at `along` pixels from the gap's end.
    fn band_px(&self, along: f32) -> f32 {
        BESIDE * self.width_px + SLOPE * along.max(0.0)
    }

    /// Returns the position that is `along` pixels along the wall and `beside` pixels off the gap's line.
    fn at(&self, along: f32, beside: f32) -> Vector {
        self.end + self.away * along + turned(self.away) * beside
    }

    /// Returns the length of wall to remove on this side of the gap, in pixels and at most `missing_px`. It is limited to a share
    /// of the wall's length up to its end or the next wall. A wall shorter than the gap's width is a post and stays.
    fn yields_px(&self, sketch: &SketchGrid, missing_px: f32) -> f32 {
        let is_wall = |along: f32, beside: i32| {
            let [x, y] = self.at(along, beside as f32).map(|v| v.round() as i64).into();
            let inside = (0..sketch.width() as i64).contains(&x) && (0..sketch.height() as i64).contains(&y);
            inside && sketch.is_wall_cell(x, y)
        };
        let far = (missing_px / TAKES).max(self.width_px).ceil() as usize;
        for along in (0..=far).map(|along| along as f32) {
            let band = self.band_px(along).ceil() as i32;
            let ends = !(-band..=band).any(|beside| is_wall(along, beside));
            if ends && along < self.width_px {
                return 0.0;
            }
            if ends || is_wall(along, band + 1) || is_wall(along, -band - 1) {
                return missing_px.min(TAKES * along);
            }
        }
        missing_px
    }

    /// Marks the cells of the wall up to `along_px` from the gap.
    fn clear(&self, sketch: &SketchGrid, along_px: f32, cleared: &mut [bool]) {
        if along_px < 1.0 {
            return;
        }
        around(sketch, self.end, along_px + self.band_px(along_px), |place, cell| {
            let from_end = place - self.end;
            let (along, beside) = (from_end.dot(&self.away), from_end.dot(&turned(self.away)));
            let is_along = (-1.0..along_px - 0.5).contains(&along);
            cleared[cell] |= is_along && beside.abs() <= self.band_px(along);
        });
    }
}

/// Column of a vector that leads to no wall. It remains larger than that of any relevant wall, whatever is added to it.
const NONE: i16 = 20_000;
/// Number of cells that are checked together, since most cells are far from walls.
const TOGETHER: usize = 32;

/// The nearest wall cell of each free cell, if it is near enough to be the side of a door.
struct Nearest<'a> {
    sketch: &'a SketchGrid,
    /// Number of cells per row, including a cell without a wall at either end. There is also a row of such cells below and above.
    stride: usize,
    /// Vectors from cells to their walls, in columns and rows. The column is [`NONE`] if there is no wall.
    x: Vec<i16>,
    y: Vec<i16>,
    reach2: i32,
}

/// The nearest wall of each cell of a row, according to the cells of other rows.
struct Known {
    x: Vec<i16>,
    y: Vec<i16>,
    distance2: Vec<i32>,
}

/// Marks the cells whose wall lies roughly opposite to that of the right or upper neighbour.
#[inline(always)]
fn face_away(x: &[i16], y: &[i16], rx: &[i16], ry: &[i16], ux: &[i16], uy: &[i16], maybe: &mut [bool]) {
    let count = maybe.len();
    let (x, y, rx, ry) = (&x[..count], &y[..count], &rx[..count], &ry[..count]);
    let (ux, uy) = (&ux[..count], &uy[..count]);
    for i in 0..count {
        let (x, y) = (i32::from(x[i]), i32::from(y[i]));
        let right = x * i32::from(rx[i]) + y * i32::from(ry[i]);
        let up = x * i32::from(ux[i]) + y * i32::from(uy[i]);
        maybe[i] = (right < 0) | (up < 0);
    }
}

/// The walls of the cells of a row, including a cell without a wall at either end.
struct Row<'a> {
    x: &'a mut [i16],
    y: &'a mut [i16],
    /// Square of the distance up to which walls are relevant, in pixels².
    reach2: i32,
}

impl<'a> Nearest<'a> {
    /// Finds the nearest walls in two passes over the eight neighbours. The cell's nearest wall, or one hardly farther away, is
    /// always that of a neighbour (Danielsson 1980).
    fn new(sketch: &'a SketchGrid, door_px: f32) -> Self {
        let [width, height] = [sketch.width(), sketch.height()];
        let stride = width + 2;
        // Limited by the range of 16-bit vectors.
        let reach_px = (OPENS_OUT * door_px / 2.0 + 2.0).min(16_000.0);
        let cells = stride * (height + 2);
        let reach2 = (reach_px * reach_px) as i32;
        let mut nearest = Self { sketch, stride, x: vec![NONE; cells], y: vec![0; cells], reach2 };
        for (row, walls) in sketch.walls().chunks_exact(width).enumerate() {
            let x = &mut nearest.x[(row + 1) * stride + 1..][..width];
            x.iter_mut().zip(walls).for_each(|(x, &wall)| *x = if wall { 0 } else { NONE });
        }
        let known = || Known { x: vec![0; width], y: vec![0; width], distance2: vec![i32::MAX; width] };
        let (nothing, mut beside, mut merged) = (known(), known(), Merged::new(width));
        for row in 1..=height {
            dispatch!(Level::new(), _simd => beside.ask::<-1>(nearest.row(row - 1)));
            merged.pass::<-1>(nearest.row(row), &beside);
            merged.pass::<1>(nearest.row(row), &nothing);
        }
        for row in (1..=height).rev() {
            dispatch!(Level::new(), _simd => beside.ask::<1>(nearest.row(row + 1)));
            merged.pass::<1>(nearest.row(row), &beside);
            merged.pass::<-1>(nearest.row(row), &nothing);
        }
        nearest
    }

    fn row(&mut self, row: usize) -> Row<'_> {
        let cells = row * self.stride..(row + 1) * self.stride;
        Row { x: &mut self.x[cells.clone()], y: &mut self.y[cells], reach2: self.reach2 }
    }

    fn get(&self, [column, row]: [usize; 2]) -> Option<[i16; 2]> {
        let inside = column < self.sketch.width() && row < self.sketch.height();
        let at = inside.then(|| (row + 1) * self.stride + column + 1)?;
        (self.x[at] != NONE).then(|| [self.x[at], self.y[at]])
    }

    /// Finds gaps in a range of widths. If the nearest walls of two neighbours are on opposite sides, there is a gap between these
    /// walls.
    fn gaps(&self, widths_px: std::ops::Range<f32>) -> Vec<Gap> {
        let mut gaps = Vec::new();
        let mut maybe = vec![false; self.sketch.width()];
        for row in 0..self.sketch.height() {
            dispatch!(Level::new(), _simd => self.face_away(row, &mut maybe));
            for (k, some) in maybe.chunks(TOGETHER).enumerate() {
                if !some.iter().fold(false, |any, &maybe| any | maybe) {
                    continue;
                }
                for column in (0..some.len()).filter(|&i| some[i]).map(|i| k * TOGETHER + i) {
                    let to = |to| self.gap([column, row], to).filter(|gap| widths_px.contains(&gap.width_px));
                    gaps.extend([[1, 0], [0, 1]].into_iter().filter_map(to));
                }
            }
        }
        gaps
    }

    /// Marks the cells of a row whose walls lie roughly opposite to a neighbour's.
    #[inline(always)]
    fn face_away(&self, row: usize, maybe: &mut [bool]) {
        let (first, count) = ((row + 1) * self.stride + 1, maybe.len());
        let at = |first: usize| (&self.x[first..first + count], &self.y[first..first + count]);
        let ((x, y), (rx, ry), (ux, uy)) = (at(first), at(first + 1), at(first + self.stride));
        face_away(x, y, rx, ry, ux, uy, maybe);
    }

    /// Returns the gap between the walls of a cell and of its neighbour at the given offset, if the walls are on opposite sides.
    fn gap(&self, [column, row]: [usize; 2], [dx, dy]: [usize; 2]) -> Option<Gap> {
        let here = vector(self.get([column, row])?);
        let there = vector(self.get([column + dx, row + dy])?);
        let place = Vector::new(column as f32, row as f32);
        let next = Vector::new((column + dx) as f32, (row + dy) as f32);
        let is_opposite = here.dot(&there) < OPPOSITE * here.norm() * there.norm();
        is_opposite.then(|| Gap::between(place + here, next + there))
    }

    /// Returns true if there is more space on both sides of the wall than in the gap itself.
    fn opens_out(&self, gap: &Gap) -> bool {
        let [middle, side] = [gap.middle(), gap.sides()[0].away];
        let step = gap.width_px / 2.0 + BEYOND_PX;
        [step, -step].iter().all(|step| {
            let place = middle + turned(side) * *step;
            let cell = place.map(|v| if v < 0.0 { usize::MAX } else { v.round() as usize });
            let is_wide = |to_wall| vector(to_wall).norm() > OPENS_OUT * gap.width_px / 2.0;
            self.get(cell.into()).is_none_or(is_wide)
        })
    }
}

fn vector(to_wall: [i16; 2]) -> Vector {
    to_wall.map(f32::from).into()
}

/// Turns a vector by a right angle, counter-clockwise.
fn turned(v: Vector) -> Vector {
    Vector::new(-v.y, v.x)
}

impl Known {
    /// Finds the nearest of the walls of the three adjacent cells in the row on the side `SIDE`.
    #[inline(always)]
    fn ask<const SIDE: isize>(&mut self, row: Row<'_>) {
        ask::<SIDE>(row.x, row.y, &mut self.x, &mut self.y, &mut self.distance2);
    }
}

/// Finds, for each cell, the nearest of the walls of the three adjacent cells in the row on the side `SIDE`. On a tie, the first
/// one from that side counts. This function and those below use masks and plain slices so that the compiler can vectorize them.
#[inline(always)]
fn ask<const SIDE: isize>(
    x: &[i16],
    y: &[i16],
    found_x: &mut [i16],
    found_y: &mut [i16],
    found2: &mut [i32],
) {
    let (side, count) = (SIDE as i32, found2.len());
    let (found_x, found_y) = (&mut found_x[..count], &mut found_y[..count]);
    let column = |dx: i32| (&x[(dx + 1) as usize..][..count], &y[(dx + 1) as usize..][..count]);
    let [(ax, ay), (bx, by), (cx, cy)] = [column(side), column(0), column(-side)];
    for i in 0..count {
        let known = |x: i16, y: i16, dx: i32| {
            let (x, y) = (i32::from(x) + dx, i32::from(y) + side);
            (x, y, x * x + y * y)
        };
        let nearer = |a: (i32, i32, i32), b: (i32, i32, i32)| {
            let other = -i32::from(b.2 < a.2);
            (b.0 & other | a.0 & !other, b.1 & other | a.1 & !other, b.2.min(a.2))
        };
        let first = nearer(known(ax[i], ay[i], side), known(bx[i], by[i], 0));
        let best = nearer(first, known(cx[i], cy[i], -side));
        found_x[i] = best.0 as i16;
        found_y[i] = best.1 as i16;
        found2[i] = best.2;
    }
}

/// The cells of a row merged with the walls of other rows, before the pass along the row.
struct Merged {
    x: Vec<i16>,
    y: Vec<i16>,
    /// The squared distances of the cells' own walls, in pixels².
    own2: Vec<i32>,
    /// Whether the previous cell has a nearer wall.
    gains: Vec<bool>,
}

impl Merged {
    fn new(width: usize) -> Self {
        let (x, y) = (vec![NONE; width + 2], vec![0; width + 2]);
        Self { x, y, own2: vec![0; width], gains: vec![false; width] }
    }

    /// Runs along a row, away from the side `SIDE`. Each cell adopts the wall of the previous cell, or the `known` one, if that is
    /// nearer than its own. The cells of a block are processed one by one only if at least one of them gains from the initial wall
    /// of the previous cell, because otherwise none gains at all.
    fn pass<const SIDE: isize>(&mut self, row: Row<'_>, known: &Known) {
        dispatch!(Level::new(), _simd => self.merge::<SIDE>(&row, known));
        let count = self.own2.len();
        for k in 0..count.div_ceil(TOGETHER) {
            let k = if SIDE < 0 { k } else { count.div_ceil(TOGETHER) - 1 - k };
            let some = k * TOGETHER..((k + 1) * TOGETHER).min(count);
            let first = if SIDE < 0 { some.start } else { some.end - 1 };
            let is_quiet = !self.gains[some.clone()].iter().fold(false, |any, gains| any | gains);
            if is_quiet && row.passed::<SIDE>(first).is_none_or(|passed| !self.gains_by(first, passed, known))
            {
                let cells = some.start + 1..some.end + 1;
                row.x[cells.clone()].copy_from_slice(&self.x[cells.clone()]);
                row.y[cells.clone()].copy_from_slice(&self.y[cells]);
                continue;
            }
            for i in 0..some.len() {
                let at = if SIDE < 0 { some.start + i } else { some.end - 1 - i };
                let passed = row.passed::<SIDE>(at).filter(|&passed| self.gains_by(at, passed, known));
                (row.x[at + 1], row.y[at + 1]) = passed.unwrap_or((self.x[at + 1], self.y[at + 1]));
            }
        }
    }

    /// Returns true if a wall is nearer to a cell than its own, and no farther than the one known from other rows.
    fn gains_by(&self, at: usize, (x, y): (i16, i16), known: &Known) -> bool {
        let distance2 = squared([x, y]);
        distance2 < self.own2[at] && distance2 <= known.distance2[at]
    }

    #[inline(always)]
    fn merge<const SIDE: isize>(&mut self, row: &Row<'_>, known: &Known) {
        let count = self.own2.len();
        let (own_x, own_y) = (&row.x[1..][..count], &row.y[1..][..count]);
        let (known_x, known_y, known2) = (&known.x[..count], &known.y[..count], &known.distance2[..count]);
        let (x, y) = (&mut self.x[1..], &mut self.y[1..]);
        merge(own_x, own_y, known_x, known_y, known2, row.reach2, &mut self.own2, x, y);
        let before = (1 + SIDE) as usize;
        gains(SIDE as i32, &self.x[before..], &self.y[before..], &self.own2, known2, &mut self.gains);
    }
}

/// Replaces each cell's wall by the known one if that is nearer. Writes the squared distances of the cells' own walls to `own2`.
#[expect(clippy::too_many_arguments, reason = "plain slices")]
#[inline(always)]
fn merge(
    own_x: &[i16],
    own_y: &[i16],
    known_x: &[i16],
    known_y: &[i16],
    known2: &[i32],
    reach2: i32,
    own2: &mut [i32],
    x: &mut [i16],
    y: &mut [i16],
) {
    let count = own2.len();
    let (own_x, own_y, known_x, known_y) =
        (&own_x[..count], &own_y[..count], &known_x[..count], &known_y[..count]);
    let (known2, x, y) = (&known2[..count], &mut x[..count], &mut y[..count]);
    for i in 0..count {
        let (dx, dy) = (i32::from(own_x[i]), i32::from(own_y[i]));
        let mine = (dx * dx + dy * dy).min(reach2);
        let known = -i16::from(known2[i] < mine);
        x[i] = known_x[i] & known | own_x[i] & !known;
        y[i] = known_y[i] & known | own_y[i] & !known;
        own2[i] = mine;
    }
}

/// Marks the cells for which the wall of the previous cell is nearer than their own, and no farther than the one known from other
/// rows.
#[inline(always)]
fn gains(step: i32, x: &[i16], y: &[i16], own2: &[i32], known2: &[i32], gains: &mut [bool]) {
    let count = gains.len();
    let (x, y, own2, known2) = (&x[..count], &y[..count], &own2[..count], &known2[..count]);
    for i in 0..count {
        let (dx, dy) = (i32::from(x[i]) + step, i32::from(y[i]));
        let distance2 = dx * dx + dy * dy;
        gains[i] = (distance2 < own2[i]) & (distance2 <= known2[i]);
    }
}

impl Row<'_> {
    /// Returns the wall of the neighbour on the side `SIDE` of a cell, relative to the cell.
    fn passed<const SIDE: isize>(&self, at: usize) -> Option<(i16, i16)> {
        let before = (at + 1).wrapping_add_signed(SIDE);
        (self.x[before] != NONE).then(|| (self.x[before] + SIDE as i16, self.y[before]))
    }
}

fn squared([x, y]: [i16; 2]) -> i32 {
    i32::from(x).pow(2) + i32::from(y).pow(2)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sketchnav_schemas::codes::{FREE, WALL};

    use super::*;

    const SIZE: usize = 200;
    const DOOR_PX: f32 = 30.0;

    /// Draws a sheet of 200 × 200 px, with walls in the cells selected by `is_wall`.
    fn sheet(is_wall: impl Fn(usize, usize) -> bool) -> SketchGrid {
        let cell = |i: usize| if is_wall(i % SIZE, i / SIZE) { WALL } else { FREE };
        SketchGrid::new(SIZE, SIZE, &(0..SIZE * SIZE).map(cell).collect::<Vec<u8>>(), 0.0).unwrap()
    }

    /// Returns true for the three rows of a wall along the middle of the sheet.
    fn is_in_wall(row: usize) -> bool {
        (99..=101).contains(&row)
    }

    /// Returns the columns of row 100 that are free.
    fn open(sketch: &SketchGrid) -> Vec<i64> {
        (0..SIZE as i64).filter(|&column| !sketch.is_wall_cell(column, 100)).collect()
    }

    #[test]
    fn a_narrow_door_becomes_as_wide_as_a_door_to_both_sides() {
        let found = widened(&sheet(|x, y| is_in_wall(y) && !(95..105).contains(&x)), DOOR_PX).unwrap();
        assert_eq!(open(&found), (85..115).collect::<Vec<i64>>());
    }

    #[test]
    fn what_is_as_wide_as_a_door_and_a_slip_of_the_pen_stay_as_they_are() {
        let with_gap = |width: usize| sheet(|x, y| is_in_wall(y) && !(100..100 + width).contains(&x));
        for (width, changes) in [(4, false), (7, true), (26, true), (30, false), (40, false)] {
            assert_eq!(widened(&with_gap(width), DOOR_PX).is_some(), changes, "{width} px");
        }
    }

    /// Between the flat ends of two blocks, the gap is as long as the blocks are thick.
    #[test]
    fn a_passage_through_a_thick_wall_does_not_open_out() {
        let thick = |half: usize| {
            let walls = sheet(|x, y| y.abs_diff(100) <= half && !(92..108).contains(&x));
            let gap = Gap::between([91.0, 100.0].into(), [108.0, 100.0].into());
            Nearest::new(&walls, DOOR_PX).opens_out(&gap)
        };
        assert!(thick(2) && !thick(12));
    }

    #[test]
    fn a_narrow_corridor_does_not_open_out() {
        let walls = sheet(|x, y| (20..180).contains(&y) && [90, 91, 110, 111].contains(&x));
        let gap = Gap::between([91.0, 100.0].into(), [110.0, 100.0].into());
        assert!(!Nearest::new(&walls, DOOR_PX).opens_out(&gap));
        assert!(widened(&walls, DOOR_PX).is_none());
    }

    /// A post of 5 px stands between two gaps of 28 px.
    #[test]
    fn posts_stay() {
        let walls = sheet(|x, y| {
            is_in_wall(y) && !(80..141).contains(&x) || is_in_wall(y) && (108..113).contains(&x)
        });
        let found = widened(&walls, DOOR_PX).unwrap();
        assert!((108..113).all(|x| found.is_wall_cell(x, 100)));
    }

    /// The drawing is cut off right next to its outline.
    #[test]
    fn a_door_at_the_edge_of_the_sheet_is_a_door() {
        let found = widened(&sheet(|x, y| y < 3 && !(95..105).contains(&x)), DOOR_PX).unwrap();
        assert!((86..114).all(|x| !found.is_wall_cell(x, 1)));
    }

    /// A wall continues past both sides of the door, so there is no more space beyond the gap than in it.
    #[test]
    fn a_door_along_another_wall_stays_as_it_is() {
        let walls = sheet(|x, y| (88..=90).contains(&x) || is_in_wall(y) && x > 103);
        assert!(widened(&walls, DOOR_PX).is_none());
    }

    /// Two walls are 32 px apart with a door of 17 px between them. This leaves about 8 px of wall on each side, a quarter of which
    /// may be removed.
    #[test]
    fn a_door_takes_no_more_than_its_share_of_the_wall_beside_it() {
        let across = |x: usize, y: usize| y > 100 && [83, 84, 117, 118].contains(&x);
        let found = widened(&sheet(|x, y| across(x, y) || is_in_wall(y) && !(92..109).contains(&x)), DOOR_PX);
        let open = open(&found.unwrap());
        assert!((18..=22).contains(&open.len()) && open.contains(&90) && !open.contains(&87), "{open:?}");
    }

    proptest! {
        /// The wall with the door runs at an arbitrary angle, and the door is more than twice as wide as the pen.
        #[test]
        fn a_door_is_widened_in_a_wall_that_runs_anywhere(
            angle in 0.0_f32..std::f32::consts::PI,
            gap in 12.0_f32..26.0,
            pen in 1.0_f32..2.7,
        ) {
            let (sin, cos) = angle.sin_cos();
            let place = |x: usize, y: usize| {
                let (dx, dy) = (x as f32 - 100.0, y as f32 - 100.0);
                (dx * cos + dy * sin, dy * cos - dx * sin)
            };
            let drawn = sheet(|x, y| {
                let (along, beside) = place(x, y);
                beside.abs() <= pen && along.abs() > gap / 2.0
            });
            let found = widened(&drawn, DOOR_PX).unwrap();
            for (x, y) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
                let (along, beside) = place(x, y);
                let [was, is] = [&drawn, &found].map(|s| s.is_wall_cell(x as i64, y as i64));
                prop_assert!(was || !is, "a wall grew at {x}, {y}");
                if beside.abs() <= pen && along.abs() < DOOR_PX / 2.0 - 3.0 {
                    prop_assert!(!is, "still wall at {along}, {beside}");
                }
                if along.abs() > DOOR_PX / 2.0 + 3.0 {
                    prop_assert!(was == is, "opened too far at {along}, {beside}");
                }
            }
        }

        /// On any drawing, however small, only wall cells next to a gap become free.
        #[test]
        fn walls_give_way_only_beside_what_is_free(
            strokes in prop::collection::vec(prop::array::uniform4(0.0_f32..80.0), 0..12),
            width in 1usize..80,
            height in 1usize..80,
            door_px in 0.001_f32..1e6,
        ) {
            let is_near = |[ax, ay, bx, by]: [f32; 4], x: f32, y: f32| {
                let (dx, dy) = (bx - ax, by - ay);
                let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy).max(1e-6)).clamp(0.0, 1.0);
                (x - ax - t * dx).hypot(y - ay - t * dy) < 2.0
            };
            let cell = |i: usize| {
                let (x, y) = ((i % width) as f32, (i / width) as f32);
                if strokes.iter().any(|&stroke| is_near(stroke, x, y)) { WALL } else { FREE }
            };
            let cells: Vec<u8> = (0..width * height).map(cell).collect();
            let drawn = SketchGrid::new(width, height, &cells, 0.0).unwrap();
            let Some(found) = widened(&drawn, door_px) else { return Ok(()) };
            let near_free = |at: usize| {
                let free = |i: usize| !drawn.walls()[i];
                let near = |i: usize| {
                    let (dx, dy) = ((i % width).abs_diff(at % width), (i / width).abs_diff(at / width));
                    dx.max(dy) as f32 <= door_px
                };
                (0..width * height).any(|i| free(i) && near(i))
            };
            let gave_way = |&at: &usize| drawn.walls()[at] && !found.walls()[at];
            let mut gone = (0..width * height).filter(gave_way).peekable();
            prop_assert!(gone.peek().is_some(), "nothing changed");
            prop_assert!(gone.all(near_free));
        }
    }
}
