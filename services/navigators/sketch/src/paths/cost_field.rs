//! The global connectivity planner (Boniardi et al. 2015, III-C), which computes the cost of reaching the
//! goal from every place in the drawing.
//!
//! One run of Dijkstra's algorithm from the goal is enough for the whole drive, because a path is a descent from the robot's
//! current position. Paths near drawn walls cost more, which keeps them in the middle of corridors and doors, and paths through
//! drawn walls cost far more, so they are only used if the drawing shows no other. For a large drawing, the grid is coarser, and a
//! cell is a wall if any of its pixels is.
//!
//! Lengths and costs are in pixels, because the drawing's metric is unknown away from the robot.

use sketchnav_schemas::geometry::{Point, Sketch};

use super::parameters::Parameters;
use crate::sketch::SketchGrid;
use sketchnav_motion::weighted_grid::{Frontier, Weights, chamfer};

/// Maximum number of cells of the planning grid. This keeps the time to solve it below about 50 ms.
const MAX_CELLS: usize = 160_000;
/// Maximum number of points of a path.
pub const MAX_PATH: usize = 8192;

/// A passage in the drawing that turned out to be blocked.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Blockage {
    /// Centre of the blockage.
    pub place: Point<Sketch>,
    /// Radius of the blockage, in pixels.
    pub radius_px: f64,
    /// Minimum cost of a path through the blockage, per unit of length.
    pub weight: f64,
}

/// The cost-to-go of every place of a drawing.
#[derive(Debug, Clone)]
pub struct CostField {
    columns: usize,
    rows: usize,
    pixels_per_cell: usize,
    wall: Vec<bool>,
    clearance_px: Vec<f32>,
    weight: Vec<f32>,
    frontier: Frontier,
    goal: Option<Point<Sketch>>,
}

impl CostField {
    /// Creates a field for a drawing. Every cost is infinite until a goal is set.
    pub fn new(sketch: &SketchGrid) -> Self {
        let pixels = sketch.width() * sketch.height();
        let pixels_per_cell = (1..).find(|k| pixels / (k * k) <= MAX_CELLS).unwrap_or(1);
        let columns = sketch.width().div_ceil(pixels_per_cell) + 2;
        let rows = sketch.height().div_ceil(pixels_per_cell) + 2;
        let mut wall = vec![true; columns * rows];
        for row in 1..rows - 1 {
            for column in 1..columns - 1 {
                wall[row * columns + column] = holds_wall(sketch, column - 1, row - 1, pixels_per_cell);
            }
        }
        let mut clearance_px = vec![0.0; columns * rows];
        chamfer(|cell| wall[cell], columns, pixels_per_cell as f32, f32::MAX, &mut clearance_px);
        let (weight, frontier) = (vec![f32::INFINITY; columns * rows], Frontier::new(columns * rows));
        Self { columns, rows, pixels_per_cell, wall, clearance_px, weight, frontier, goal: None }
    }

    /// Computes the cost-to-go to `goal`, or to the free place nearest to it. `scale_pxpm` converts the parameters' metres to
    /// pixels, and `blocked` lists the passages known to be blocked.
    pub fn solve(
        &mut self,
        goal: Point<Sketch>,
        scale_pxpm: f64,
        blocked: &[Blockage],
        parameters: &Parameters,
    ) {
        self.weigh((parameters.inflation_radius_m * scale_pxpm) as f32, parameters);
        for blockage in blocked {
            self.block(blockage);
        }
        let seed = self.free_cell(goal);
        self.goal = Some(if self.cell(goal) == seed { goal } else { self.middle(seed) });
        let weights = weights(&self.weight, self.columns, self.pixels_per_cell);
        weights.flood(&mut self.frontier, seed, None, f32::INFINITY);
    }

    /// Returns the goal or the free place nearest to it, or `None` before [`Self::solve`].
    pub fn goal(&self) -> Option<Point<Sketch>> {
        self.goal
    }

    /// Returns the cost-to-go from `place`, or from the nearest free place if `place` lies in a wall.
    pub fn cost_px(&self, place: Point<Sketch>) -> f64 {
        f64::from(self.frontier.costs()[self.free_cell(place)])
    }

    /// Returns the cost-to-go from exactly `place`, even if it lies in a wall.
    pub fn raw_cost_px(&self, place: Point<Sketch>) -> f64 {
        f64::from(self.frontier.costs()[self.cell(place)])
    }

    /// Writes the path from `from` to the goal, including both, with one point per cell and at most [`MAX_PATH`] points. If `from`
    /// lies in a wall, the path starts at the nearest free place.
    pub fn descend(&self, from: Point<Sketch>, path: &mut Vec<Point<Sketch>>) {
        path.clear();
        let weights = weights(&self.weight, self.columns, self.pixels_per_cell);
        let mut cell = self.free_cell(from);
        path.push(if self.cell(from) == cell { from } else { self.middle(cell) });
        while let Some(next) = weights.downhill(&self.frontier, cell).filter(|_| path.len() < MAX_PATH - 1) {
            cell = next;
            path.push(self.middle(cell));
        }
        if let Some(goal) = self.goal.filter(|&goal| self.cell(goal) == cell) {
            path.push(goal);
        }
    }

    /// Returns true if the drawing shows a path from `from` to the goal that crosses no wall.
    pub fn is_open(&self, from: Point<Sketch>) -> bool {
        let weights = weights(&self.weight, self.columns, self.pixels_per_cell);
        let mut cell = self.free_cell(from);
        while let Some(next) = weights.downhill(&self.frontier, cell) {
            let beside = [cell, next].map(|c| (c % self.columns, c / self.columns));
            let [(x, y), (u, v)] = beside;
            if self.wall[next] || self.wall[y * self.columns + u] || self.wall[v * self.columns + x] {
                return false;
            }
            cell = next;
        }
        self.goal.is_some_and(|goal| self.free_cell(goal) == cell)
    }

    /// Returns true if no drawn wall lies between the two places. Walls in which the places themselves lie do not count, because a
    /// cell is a wall even if only a corner of it is.
    pub fn sees(&self, from: Point<Sketch>, to: Point<Sketch>) -> bool {
        let steps = (from.distance(&to) / self.pixels_per_cell as f64 * 2.0).ceil().max(1.0) as usize;
        let (mut left_first_wall, last) = (false, self.cell(to));
        (0..=steps).all(|i| {
            let share = i as f64 / steps as f64;
            let place = Point::new(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y));
            let cell = self.cell(place);
            let wall = cell != last && self.wall[cell];
            left_first_wall |= !wall;
            !(wall && left_first_wall)
        })
    }

    /// Returns true if the place lies in a drawn wall. A place outside the drawing counts as the nearest one inside.
    pub fn is_wall(&self, place: Point<Sketch>) -> bool {
        self.wall[self.cell(place)]
    }

    fn weigh(&mut self, comfort_px: f32, parameters: &Parameters) {
        let (near, wall_weight) = (parameters.inflation_weight as f32, parameters.wall_weight as f32);
        for row in 1..self.rows - 1 {
            for cell in row * self.columns + 1..(row + 1) * self.columns - 1 {
                let lack = (1.0 - self.clearance_px[cell] / comfort_px).max(0.0);
                self.weight[cell] = if self.wall[cell] { wall_weight } else { 1.0 + near * lack * lack };
            }
        }
    }

    fn block(&mut self, blockage: &Blockage) {
        for row in 1..self.rows - 1 {
            for cell in row * self.columns + 1..(row + 1) * self.columns - 1 {
                if self.middle(cell).distance(&blockage.place) <= blockage.radius_px {
                    self.weight[cell] = self.weight[cell].max(blockage.weight as f32);
                }
            }
        }
    }

    /// Returns the cell of a place. A place outside counts as the nearest one inside.
    fn cell(&self, place: Point<Sketch>) -> usize {
        let along = |v: f64, count: usize| {
            (v / self.pixels_per_cell as f64).floor().clamp(0.0, (count - 3) as f64) as usize + 1
        };
        along(place.y, self.rows) * self.columns + along(place.x, self.columns)
    }

    fn middle(&self, cell: usize) -> Point<Sketch> {
        let middle = |index: usize| (index as f64 - 0.5) * self.pixels_per_cell as f64;
        Point::new(middle(cell % self.columns), middle(cell / self.columns))
    }

    /// Returns the cell of a place if it is free, or else the nearest free cell. If no cell is free, returns the place's own cell.
    fn free_cell(&self, place: Point<Sketch>) -> usize {
        let own = self.cell(place);
        if !self.wall[own] {
            return own;
        }
        let mut best = (own, f64::INFINITY);
        for ring in 1..self.columns.max(self.rows) {
            if best.1 <= (ring - 1) as f64 * self.pixels_per_cell as f64 {
                break;
            }
            self.search_ring(place, own, ring, &mut best);
        }
        best.0
    }

    fn search_ring(&self, place: Point<Sketch>, own: usize, ring: usize, best: &mut (usize, f64)) {
        let (column, row) = ((own % self.columns) as i64, (own / self.columns) as i64);
        let ring = ring as i64;
        for dy in -ring..=ring {
            let step = if dy.abs() == ring { 1 } else { 2 * ring };
            for dx in (-ring..=ring).step_by(step as usize) {
                let (x, y) = (column + dx, row + dy);
                if (1..self.columns as i64 - 1).contains(&x) && (1..self.rows as i64 - 1).contains(&y) {
                    let cell = y as usize * self.columns + x as usize;
                    let distance = self.middle(cell).distance(&place);
                    if !self.wall[cell] && distance < best.1 {
                        *best = (cell, distance);
                    }
                }
            }
        }
    }
}

fn weights(weight: &[f32], stride: usize, pixels_per_cell: usize) -> Weights<'_> {
    Weights { weight, stride, cell_length: pixels_per_cell as f32 }
}

fn holds_wall(sketch: &SketchGrid, column: usize, row: usize, k: usize) -> bool {
    let pixels = |index: usize, end: usize| index * k..((index + 1) * k).min(end);
    pixels(row, sketch.height())
        .any(|y| pixels(column, sketch.width()).any(|x| sketch.is_wall_cell(x as i64, y as i64)))
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::codes::{FREE, WALL};

    use super::*;

    /// Draws two rooms on 200 × 100 px, joined by a door from y = 60 to y = 80 in the wall at x = 100.
    fn two_rooms() -> SketchGrid {
        let mut cells = vec![FREE; 200 * 100];
        for y in (0..100).filter(|y| !(60..80).contains(y)) {
            cells[y * 200 + 100] = WALL;
        }
        SketchGrid::new(200, 100, &cells, 0.0).unwrap()
    }

    fn solved(sketch: &SketchGrid, goal: Point<Sketch>, blocked: &[Blockage]) -> CostField {
        let mut field = CostField::new(sketch);
        field.solve(goal, 20.0, blocked, &Parameters::default());
        field
    }

    #[test]
    fn the_path_goes_through_the_middle_of_the_door() {
        let goal = Point::new(150.5, 20.5);
        let field = solved(&two_rooms(), goal, &[]);
        let mut path = Vec::new();
        field.descend(Point::new(30.0, 20.0), &mut path);
        assert_eq!((path[0], path[path.len() - 1]), (Point::new(30.0, 20.0), goal));
        let door = path.iter().find(|p| p.x > 100.0).unwrap();
        assert!((door.y - 70.0).abs() < 4.0, "{door:?}");
        assert!(path.iter().all(|&p| !field.is_wall(p)));
    }

    #[test]
    fn a_place_in_a_wall_starts_from_the_nearest_free_one() {
        let field = solved(&two_rooms(), Point::new(150.5, 20.5), &[]);
        let mut path = Vec::new();
        field.descend(Point::new(100.9, 30.0), &mut path);
        assert!((path[0].x - 101.5).abs() < 1e-9, "{:?}", path[0]);
    }

    #[test]
    fn walls_are_prohibitive_but_finite() {
        let mut cells = vec![FREE; 200 * 100];
        (0..100).for_each(|y| cells[y * 200 + 100] = WALL);
        let sketch = SketchGrid::new(200, 100, &cells, 0.0).unwrap();
        let field = solved(&sketch, Point::new(150.5, 20.5), &[]);
        let cost = field.cost_px(Point::new(50.0, 20.0));
        assert!(cost.is_finite() && cost > 1000.0);
        assert!(!field.is_open(Point::new(50.0, 20.0)) && field.is_open(Point::new(120.0, 90.0)));
        assert!(!field.sees(Point::new(50.0, 20.0), Point::new(150.0, 20.0)));
    }

    /// Regression test: since a cell is a wall if a single pixel of it is, the end of a route next to a wall was invisible from
    /// everywhere, and the task ended as blocked.
    #[test]
    fn a_place_beside_a_wall_is_seen_and_one_behind_it_is_not() {
        let (width, height) = (800, 600);
        let cell = |i: usize| if i % width == 403 { WALL } else { FREE };
        let sketch =
            SketchGrid::new(width, height, &(0..width * height).map(cell).collect::<Vec<_>>(), 0.0).unwrap();
        let field = solved(&sketch, Point::new(300.0, 300.0), &[]);
        let beside = Point::new(402.5, 300.0);
        assert!(field.pixels_per_cell > 1 && field.is_wall(beside));
        assert!(field.sees(Point::new(300.0, 300.0), beside));
        assert!(!field.sees(Point::new(300.0, 300.0), Point::new(500.0, 300.0)));
    }

    #[test]
    fn a_blockage_sends_the_path_through_the_other_door() {
        let mut cells = vec![FREE; 200 * 100];
        for y in (0..100).filter(|y| !(60..80).contains(y) && !(5..20).contains(y)) {
            cells[y * 200 + 100] = WALL;
        }
        let sketch = SketchGrid::new(200, 100, &cells, 0.0).unwrap();
        let shut = Blockage { place: Point::new(100.0, 70.0), radius_px: 12.0, weight: 30.0 };
        let field = solved(&sketch, Point::new(150.5, 70.5), &[shut]);
        let mut path = Vec::new();
        field.descend(Point::new(30.0, 70.0), &mut path);
        assert!(path.iter().find(|p| p.x > 100.0).unwrap().y < 20.0);
    }

    #[test]
    fn a_goal_in_a_wall_moves_to_the_nearest_free_place() {
        let field = solved(&two_rooms(), Point::new(100.2, 30.5), &[]);
        assert_eq!(field.goal(), Some(Point::new(99.5, 30.5)));
    }

    #[test]
    fn the_largest_canvas_fits_the_coarser_grid() {
        let sketch = SketchGrid::new(2540, 1252, &vec![FREE; 2540 * 1252], 0.0).unwrap();
        let field = solved(&sketch, Point::new(2000.0, 600.0), &[]);
        assert!(field.wall.len() < MAX_CELLS + 2 * (field.columns + field.rows));
        let straight = field.cost_px(Point::new(1000.0, 600.0));
        assert!((straight - 1000.0).abs() < 10.0, "{straight}");
    }
}
