//! The drawing as a grid, which the filter queries for the distance to the nearest wall and for the range along a beam.
//!
//! A drawing of millions of pixels is reduced until it fits into a cache. A cell is a wall if any of its pixels is, so walls never
//! get holes. A free cell whose nearest wall is `r` cells away (chessboard distance) lies at the centre of a square of free cells
//! with a side of `2r − 1`, so a ray can jump straight to the edge of that square. Jumps are exact, and the result equals that of
//! walking from cell to cell.
//!
//! The grid is independent of the drawing's scale. Results are in units of the direction vector's length.

use crate::sketch::SketchGrid;

/// Number of steps of the stored Euclidean distance per cell.
const STEPS_PER_CELL: f32 = 2.0;

/// The reduced drawing, with distances, surrounded by a ring of wall.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Width and height of the drawing, in pixels.
    size_px: [f32; 2],
    width: usize,
    height: usize,
    px_per_cell: f32,
    /// Chessboard distance to the nearest wall cell, in cells, at most 255. Zero in a wall.
    free_radius: Vec<u8>,
    /// Euclidean distance to the nearest surface cell of a wall, in half cells, at most 255.
    distance: Vec<u8>,
}

impl Grid {
    /// Reduces `sketch` to at most `max_cells` cells, not counting the ring.
    pub fn new(sketch: &SketchGrid, max_cells: usize) -> Self {
        let reduction = reduction(sketch, max_cells);
        let width = sketch.width().div_ceil(reduction) + 2;
        let height = sketch.height().div_ceil(reduction) + 2;
        let wall = reduced_walls(sketch, reduction, width, height);
        let free_radius = chessboard_distance(&wall, width, height);
        let distance = euclidean_distance(&surface(&wall, width, height), width, height);
        let size_px = [sketch.width() as f32, sketch.height() as f32];
        Self { size_px, width, height, px_per_cell: reduction as f32, free_radius, distance }
    }

    /// Returns the width and the height of the drawing, in pixels.
    pub fn size_px(&self) -> [f32; 2] {
        self.size_px
    }

    /// Returns the numbers of columns and rows, including the ring.
    pub fn cells(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Iterates over all cells, including the ring, row by row from the bottom. Wall cells are true.
    pub fn walls(&self) -> impl Iterator<Item = bool> + '_ {
        self.free_radius.iter().map(|&radius| radius == 0)
    }

    /// Returns the distance from each cell to the nearest surface of a wall, in steps of half a cell, row by
    /// row from the bottom and including the ring. Within a wall the distance grows again, because a laser
    /// measures the surface of a pillar rather than its inside.
    pub fn distance_steps(&self) -> &[u8] {
        &self.distance
    }

    /// Returns the length of a cell's side, in pixels.
    pub fn px_per_cell(&self) -> f32 {
        self.px_per_cell
    }

    /// Converts a distance from steps to pixels.
    pub fn distance_px(&self, step: u8) -> f32 {
        f32::from(step) / STEPS_PER_CELL * self.px_per_cell
    }

    /// Returns the distance of a position from the nearest surface of a wall, in pixels. Infinite outside the drawing.
    pub fn surface_px(&self, [x_px, y_px]: [f32; 2]) -> f32 {
        let [width_px, height_px] = self.size_px;
        if !(0.0..width_px).contains(&x_px) || !(0.0..height_px).contains(&y_px) {
            return f32::INFINITY;
        }
        let inv = 1.0 / self.px_per_cell;
        let at = self.index(self.cell(x_px * inv, self.width), self.cell(y_px * inv, self.height));
        self.distance_px(self.distance[at])
    }

    /// Returns true if a position, in pixels, is in a wall or outside the drawing.
    #[inline]
    pub fn is_wall(&self, x_px: f32, y_px: f32) -> bool {
        let inv = 1.0 / self.px_per_cell;
        let at = self.index(self.cell(x_px * inv, self.width), self.cell(y_px * inv, self.height));
        self.free_radius[at] == 0
    }

    /// Returns the t, at most `t_max`, at which the ray (x, y) + t·(dx, dy), all in pixels, enters a wall. A ray that starts in a
    /// wall first leaves it if that is possible by `t_leave`. Otherwise, the result is 0. Lines are only as accurate as the hand
    /// that drew them, so a robot whose estimate lies on a line can look into the adjacent rooms, whereas a robot can never be
    /// inside a pillar.
    #[inline]
    pub fn cast(&self, from_px: [f32; 2], direction_px: [f32; 2], t_leave: f32, t_max: f32) -> f32 {
        let ([x_px, y_px], [dx_px, dy_px]) = (from_px, direction_px);
        let inv = 1.0 / self.px_per_cell;
        let (dx, dy) = (dx_px * inv, dy_px * inv);
        let mut ray = Ray {
            x: x_px * inv + 1.0,
            y: y_px * inv + 1.0,
            dx,
            dy,
            inv_dx: reciprocal(dx),
            inv_dy: reciprocal(dy),
            column: self.cell(x_px * inv, self.width),
            row: self.cell(y_px * inv, self.height),
            t: 0.0,
        };
        if !self.leave_wall(&mut ray, t_leave.min(t_max)) {
            return 0.0;
        }
        while ray.t < t_max {
            match self.free_radius[self.index(ray.column, ray.row)] {
                0 => return ray.t,
                radius => ray.leave_box(i32::from(radius)),
            }
        }
        t_max
    }

    /// Returns true if the straight line from one position to another, in pixels, enters a wall or ends in one.
    pub fn crosses_wall(&self, from: [f32; 2], to: [f32; 2]) -> bool {
        self.is_wall(to[0], to[1]) || self.cast(from, [to[0] - from[0], to[1] - from[1]], 1.0, 1.0) < 1.0
    }

    /// Moves the ray out of the wall that it starts in, if any. Returns false if it does not get out by `t_leave`.
    fn leave_wall(&self, ray: &mut Ray, t_leave: f32) -> bool {
        while self.free_radius[self.index(ray.column, ray.row)] == 0 {
            if ray.t >= t_leave || !self.within(ray) {
                return false;
            }
            ray.leave_box(1);
        }
        true
    }

    fn within(&self, ray: &Ray) -> bool {
        (1..self.width as i32 - 1).contains(&ray.column) && (1..self.height as i32 - 1).contains(&ray.row)
    }

    /// Returns the index of a cell along an axis, given a coordinate in cells. A coordinate outside the drawing gives a cell of the
    /// ring.
    #[inline]
    fn cell(&self, coordinate: f32, size: usize) -> i32 {
        ((coordinate + 1.0) as i32).clamp(0, size as i32 - 1)
    }

    #[inline]
    fn index(&self, column: i32, row: i32) -> usize {
        row as usize * self.width + column as usize
    }
}

/// A ray in progress, in cells (including the ring).
struct Ray {
    x: f32,
    y: f32,
    dx: f32,
    dy: f32,
    inv_dx: f32,
    inv_dy: f32,
    column: i32,
    row: i32,
    t: f32,
}

impl Ray {
    /// Moves to the cell beyond the edge of the square with sides of `2·radius − 1` cells around the current cell. Cell indices are
    /// integers, so rounding cannot stop the ray or let it slip through a wall. A version without the branch took a fifth longer.
    #[inline]
    fn leave_box(&mut self, radius: i32) {
        let (forward, up) = (self.dx >= 0.0, self.dy >= 0.0);
        let edge_x = self.column + if forward { radius } else { 1 - radius };
        let edge_y = self.row + if up { radius } else { 1 - radius };
        let t_x = (edge_x as f32 - self.x) * self.inv_dx;
        let t_y = (edge_y as f32 - self.y) * self.inv_dy;
        if t_x < t_y {
            self.t = t_x.max(self.t);
            let row = (self.y + t_x * self.dy) as i32;
            self.row = row.clamp(self.row + 1 - radius, self.row + radius - 1);
            self.column = if forward { edge_x } else { edge_x - 1 };
        } else {
            self.t = t_y.max(self.t);
            let column = (self.x + t_y * self.dx) as i32;
            self.column = column.clamp(self.column + 1 - radius, self.column + radius - 1);
            self.row = if up { edge_y } else { edge_y - 1 };
        }
    }
}

/// Returns 1 / d, or +∞ for both zeros, because an axis along which the ray does not move never limits a jump.
#[inline]
fn reciprocal(d: f32) -> f32 {
    if d == 0.0 { f32::INFINITY } else { 1.0 / d }
}

/// Returns the number of pixels along a cell's side.
fn reduction(sketch: &SketchGrid, max_cells: usize) -> usize {
    let cells = |k: &usize| sketch.width().div_ceil(*k) * sketch.height().div_ceil(*k);
    (1..).find(|k| cells(k) <= max_cells.max(1)).unwrap_or(1)
}

fn reduced_walls(sketch: &SketchGrid, reduction: usize, width: usize, height: usize) -> Vec<bool> {
    let mut wall = vec![false; width * height];
    for row in 0..height {
        for column in [0, width - 1] {
            wall[row * width + column] = true;
        }
    }
    for column in 0..width {
        wall[column] = true;
        wall[(height - 1) * width + column] = true;
    }
    let mut joined = vec![false; sketch.width()];
    for (row, pixels) in sketch.walls().chunks(reduction * sketch.width()).enumerate() {
        joined.fill(false);
        for pixels in pixels.chunks_exact(sketch.width()) {
            joined.iter_mut().zip(pixels).for_each(|(any, pixel)| *any |= pixel);
        }
        let cells = &mut wall[(row + 1) * width + 1..];
        for (cell, block) in cells.iter_mut().zip(joined.chunks(reduction)) {
            *cell = block.iter().fold(false, |any, pixel| any | pixel);
        }
    }
    wall
}

/// Returns the wall cells that are next to a free cell.
fn surface(wall: &[bool], width: usize, height: usize) -> Vec<bool> {
    let mut surface = vec![false; wall.len()];
    let row = |row: usize| &wall[row * width..][..width];
    for (at, out) in surface.chunks_exact_mut(width).enumerate() {
        let (below, here, above) = (row(at.saturating_sub(1)), row(at), row((at + 1).min(height - 1)));
        for column in 0..width {
            let beside = here[column.saturating_sub(1)] & here[(column + 1).min(width - 1)];
            out[column] = here[column] & !(beside & below[column] & above[column]);
        }
    }
    surface
}

/// Computes the chessboard distance to the nearest wall. Two passes over the eight neighbours make it exact (Rosenfeld and Pfaltz
/// 1966).
fn chessboard_distance(wall: &[bool], width: usize, height: usize) -> Vec<u8> {
    let mut distance: Vec<u8> = wall.iter().map(|&w| if w { 0 } else { u8::MAX }).collect();
    for row in 1..height - 1 {
        let (beside, here) = distance.split_at_mut(row * width);
        pass_row(&beside[(row - 1) * width..], &mut here[..width]);
        for column in 1..width - 1 {
            here[column] = here[column].min(here[column - 1].saturating_add(1));
        }
    }
    for row in (1..height - 1).rev() {
        let (here, beside) = distance.split_at_mut((row + 1) * width);
        let here = &mut here[row * width..];
        pass_row(&beside[..width], here);
        for column in (1..width - 1).rev() {
            here[column] = here[column].min(here[column + 1].saturating_add(1));
        }
    }
    distance
}

/// Propagates the distances of a row to the adjacent row.
fn pass_row(from: &[u8], to: &mut [u8]) {
    let inner = to.len() - 1;
    for (to, from) in to[1..inner].iter_mut().zip(from.windows(3)) {
        *to = (*to).min(from[0].min(from[1]).min(from[2]).saturating_add(1));
    }
}

/// Computes the exact Euclidean distance to the nearest wall, rounded down to half cells, from the distances in the columns and
/// then, row by row, the lower envelope of parabolas (Meijster, Roerdink and Hesselink 2000).
fn euclidean_distance(wall: &[bool], width: usize, height: usize) -> Vec<u8> {
    let mut distance = column_distance(wall, width);
    let farthest = (width * width + height * height) as i64;
    let (mut envelope, mut squared) = (Envelope::default(), vec![0; width]);
    for row in distance.chunks_exact_mut(width) {
        squared.fill(farthest);
        envelope.write(row, &mut squared);
        row.iter_mut().zip(&squared).for_each(|(out, &s)| *out = ((s as f32).sqrt() * STEPS_PER_CELL) as u8);
    }
    distance
}

/// Returns the distance to the nearest wall in the same column, in cells, or 255 if that is farther or there is none.
fn column_distance(wall: &[bool], width: usize) -> Vec<u8> {
    let mut distance: Vec<u8> = wall.iter().map(|&w| if w { 0 } else { u8::MAX }).collect();
    let mut passed = vec![u8::MAX; width];
    let mut pass = |row: &mut [u8]| {
        for (distance, passed) in row.iter_mut().zip(&mut passed) {
            *passed = passed.saturating_add(1).min(*distance);
            *distance = *passed;
        }
    };
    distance.chunks_exact_mut(width).for_each(&mut pass);
    distance.chunks_exact_mut(width).rev().for_each(&mut pass);
    distance
}

/// The lower envelope of the parabolas over one row. Each parabola is given by its apex, its height there, and the position from
/// which on it is the lowest.
#[derive(Default)]
struct Envelope {
    parabolas: Vec<[i64; 3]>,
}

impl Envelope {
    /// Computes the squared distances from the distances in the columns. Writes nothing if no column has a wall.
    fn write(&mut self, columns: &[u8], squared: &mut [i64]) {
        self.build(columns);
        let mut until = squared.len();
        for &[apex, height, from] in self.parabolas.iter().rev() {
            for (at, squared) in (from..).zip(&mut squared[from as usize..until]) {
                *squared = (at - apex) * (at - apex) + height;
            }
            until = from as usize;
        }
    }

    fn build(&mut self, columns: &[u8]) {
        self.parabolas.clear();
        for (at, &distance) in (0..).zip(columns).filter(|&(_, &distance)| distance < u8::MAX) {
            let height = i64::from(distance).pow(2);
            let mut from = 0;
            while let Some(&[apex, below, begins]) = self.parabolas.last() {
                let (rise, run) = (at * at + height - apex * apex - below, 2 * (at - apex));
                from = rise.div_euclid(run) + i64::from(rise.rem_euclid(run) > 0);
                if from > begins {
                    break;
                }
                self.parabolas.pop();
                from = 0;
            }
            if from < columns.len() as i64 {
                self.parabolas.push([at, height, from]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sketchnav_schemas::codes::WALL;

    fn sketch_strategy() -> impl Strategy<Value = SketchGrid> {
        (8usize..40, 8usize..40).prop_flat_map(|(w, h)| {
            proptest::collection::vec(prop_oneof![9 => Just(0u8), 1 => Just(WALL)], w * h)
                .prop_map(move |cells| SketchGrid::new(w, h, &cells, 0.0).unwrap())
        })
    }

    /// Casts a ray by walking from cell to cell (Amanatides and Woo 1987), in double precision.
    fn brute_force(sketch: &SketchGrid, x: f64, y: f64, dx: f64, dy: f64, t_max: f64) -> f64 {
        let (mut column, mut row, mut t) = (x.floor() as i64, y.floor() as i64, 0.0);
        let mut left_wall = !sketch.is_wall_cell(column, row);
        while t < t_max {
            let inside =
                column >= 0 && row >= 0 && column < sketch.width() as i64 && row < sketch.height() as i64;
            let wall = sketch.is_wall_cell(column, row);
            if wall && (left_wall || !inside) {
                return if left_wall { t } else { 0.0 };
            }
            left_wall |= !wall;
            let t_x = ((column + i64::from(dx > 0.0)) as f64 - x) / dx;
            let t_y = ((row + i64::from(dy > 0.0)) as f64 - y) / dy;
            t = t_x.min(t_y);
            if t_x < t_y { column += dx.signum() as i64 } else { row += dy.signum() as i64 }
        }
        t_max
    }

    proptest! {
        #[test]
        fn rays_end_where_a_walk_cell_by_cell_ends(
            sketch in sketch_strategy(), fx in 0.02f64..0.98, fy in 0.02f64..0.98, angle in 0.01f64..6.27,
        ) {
            let grid = Grid::new(&sketch, 1_000_000);
            // The start is off the grid's lines, so single and double precision agree about the cells.
            let (x, y) = ((fx * sketch.width() as f64).floor() + 0.37, (fy * sketch.height() as f64).floor() + 0.61);
            let (dy, dx) = angle.sin_cos();
            let found = f64::from(grid.cast([x as f32, y as f32], [dx as f32, dy as f32], 1e3, 1e3));
            let expected = brute_force(&sketch, x, y, dx, dy, 1e3);
            // A ray through a corner may pass on either side, so the two directions next to it are accepted as well.
            let beside = [-1e-4, 1e-4].map(|d: f64| brute_force(&sketch, x, y, (angle + d).cos(), (angle + d).sin(), 1e3));
            let near = |t: f64| (found - t).abs() < 0.02;
            prop_assert!(near(expected) || beside.into_iter().any(near), "{found} {expected} {beside:?}");
        }

        #[test]
        fn distances_are_those_of_a_search_through_all_walls(sketch in sketch_strategy()) {
            let grid = Grid::new(&sketch, 1_000_000);
            let (w, h) = (sketch.width() as i64, sketch.height() as i64);
            let beside = |column: i64, row: i64| {
                [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().any(|(c, r)| !sketch.is_wall_cell(column + c, row + r))
            };
            let walls: Vec<(i64, i64)> = (-1..=h)
                .flat_map(|row| (-1..=w).map(move |column| (column, row)))
                .filter(|&(column, row)| sketch.is_wall_cell(column, row) && beside(column, row))
                .collect();
            for row in 0..h {
                for column in 0..w {
                    let squared = walls.iter().map(|(c, r)| (c - column).pow(2) + (r - row).pow(2)).min().unwrap();
                    let expected = ((squared as f32).sqrt() * STEPS_PER_CELL) as u8;
                    let at = (row + 1) as usize * grid.cells()[0] + (column + 1) as usize;
                    let found = grid.distance_steps()[at];
                    prop_assert_eq!(found, expected, "at {} {}", column, row);
                }
            }
        }
    }

    #[test]
    fn a_reduced_drawing_keeps_its_walls() {
        let (w, h) = (600, 300);
        let cells: Vec<u8> = (0..w * h).map(|i| if i % w == 301 { WALL } else { 0 }).collect();
        let sketch = SketchGrid::new(w, h, &cells, 0.0).unwrap();
        let grid = Grid::new(&sketch, 20_000);
        assert_eq!(grid.px_per_cell(), 3.0);
        for row in 0..h {
            for zero in [0.0, -0.0] {
                let t = grid.cast([10.0, row as f32 + 0.5], [1.0, zero], 0.0, 1e3);
                assert!((t - 290.0).abs() <= 3.0, "row {row}: {t}");
            }
        }
    }
}
