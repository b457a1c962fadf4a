//! Finds paths through the space that was seen. Uses a coarse grid of the map, and the cost of the path from each cell to the end
//! of a course.

use serde::{Deserialize, Serialize};
use sketchnav_mapping::outline::{Place, distance};
use sketchnav_mapping::{Map, Survey};
use sketchnav_motion::weighted_grid::{Frontier, Weights, chamfer};
use sketchnav_schemas::geometry::Point;

/// Number of cells of the map along a side of a grid cell.
const COARSE: usize = 2;
/// Kind of a cell that is occupied or unknown.
const CLOSED: u8 = 0;
/// Kind of a free cell that is too close to an obstacle.
const TIGHT: u8 = 1;
/// Kind of a free cell with the least room that the robot needs. Larger kinds have more room.
const OPEN: u8 = 2;
/// Number of steps of room above [`OPEN`].
const ROOM: u8 = 8;
/// Room, in metres, beyond which additional room makes no difference.
const WIDE_M: f64 = 0.35;
/// Extra cost of a cell with the least room, per unit of length.
const NEAR: f32 = 4.0;
/// Cost of a tight cell, per unit of length, for a robot that stands in one.
const ESCAPE: f32 = 15.0;
/// Maximum distance, in metres, that a robot may drive through tight cells.
const ESCAPE_M: f64 = 0.6;
/// Maximum distance from the end of a course to the gap that it leads to, in metres.
const BEFORE_GAP_M: f64 = 0.9;
/// Shortest and longest length of a gap, in metres, that count in the choice of the next gap.
const NARROW_M: f64 = 0.5;
const WIDE_GAP_M: f64 = 2.0;
/// Cost of looking through a gap, as a driving distance in metres.
const LOOK_M: f64 = 2.0;
/// Maximum number of points of a path.
const MAX_PATH: usize = 2048;

/// A grid of how much room there is around each cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PathGrid {
    stride: usize,
    cell_m: f64,
    origin: Place,
    kinds: Vec<u8>,
    /// Cells through which a robot that is too close to an obstacle may escape.
    escape: Vec<u32>,
}

impl PathGrid {
    /// Creates a grid of the part of a map that is free around the robot. The robot's centre keeps `clearance_m` from occupied
    /// cells.
    pub fn new(survey: &Survey, clearance_m: f64) -> Self {
        let grid = survey.grid();
        let (stride, rows) = (grid.width().div_ceil(COARSE) + 2, grid.height().div_ceil(COARSE) + 2);
        let cell_m = grid.cell * COARSE as f64;
        let mut kinds = vec![CLOSED; stride * rows];
        let mut solid = vec![false; stride * rows];
        let coarse = |[column, row]: [usize; 2]| (row / COARSE + 1) * stride + column / COARSE + 1;
        grid.occupied.places().for_each(|place| solid[coarse(place)] = true);
        survey.free().places().for_each(|place| kinds[coarse(place)] = OPEN);
        let mut room_m = vec![0.0; kinds.len()];
        let cap = (clearance_m + WIDE_M + cell_m) as f32;
        chamfer(|k| solid[k], stride, cell_m as f32, cap, &mut room_m);
        for ((kind, room_m), solid) in kinds.iter_mut().zip(&room_m).zip(&solid) {
            let room = (f64::from(*room_m) - cell_m / 2.0 - clearance_m) / WIDE_M;
            if *kind == OPEN {
                *kind = match (*solid, room < 0.0) {
                    (true, _) => CLOSED,
                    (_, true) => TIGHT,
                    _ => OPEN + (room.min(1.0) * f64::from(ROOM)) as u8,
                };
            }
        }
        let origin = grid.origin.map(|at| at - cell_m);
        Self { stride, cell_m, origin, kinds, escape: Vec::new() }
    }

    /// Returns the centre of a cell.
    pub fn middle(&self, cell: usize) -> Place {
        let at = [cell % self.stride, cell / self.stride];
        [0, 1].map(|k| self.origin[k] + (at[k] as f64 + 0.5) * self.cell_m)
    }

    /// Returns the cell of a place, or the nearest inner cell if the place lies outside the grid.
    fn cell(&self, place: Place) -> usize {
        let rows = self.kinds.len() / self.stride;
        let at = |k: usize, count: usize| {
            ((place[k] - self.origin[k]) / self.cell_m).floor().clamp(1.0, count as f64 - 2.0) as usize
        };
        at(1, rows) * self.stride + at(0, self.stride)
    }

    fn weights(&self, of: impl Fn(u8) -> f32) -> Vec<f32> {
        let mut weights: Vec<_> = self.kinds.iter().map(|kind| of(*kind)).collect();
        for &cell in &self.escape {
            weights[cell as usize] = weights[cell as usize].min(ESCAPE);
        }
        weights
    }

    fn flood(&self, weights: &[f32], from: usize) -> Frontier {
        let mut frontier = Frontier::new(weights.len());
        let weights = Weights { weight: weights, stride: self.stride, cell_length: self.cell_m as f32 };
        weights.flood(&mut frontier, from, None, f32::INFINITY);
        frontier
    }

    /// Finds the cells that the robot can reach, with the length of the path to each.
    fn reach(&mut self, robot: Place) -> Frontier {
        let own = self.cell(robot);
        self.escape.clear();
        if self.kinds[own] < OPEN {
            let near = (0..self.kinds.len())
                .filter(|cell| self.kinds[*cell] == TIGHT && distance(self.middle(*cell), robot) < ESCAPE_M);
            let near: Vec<_> = near.map(|cell| cell as u32).collect();
            self.escape = near;
            self.escape.push(own as u32);
        }
        self.flood(&self.weights(with_room), own)
    }

    /// Returns the reachable cell from which the path to `target` through free cells is the shortest. Also returns the length of the
    /// robot's path to this cell, in metres.
    pub fn end_for(&mut self, robot: Place, target: Place) -> Option<(usize, f64)> {
        let reach = self.reach(robot);
        let free = |cell: &usize| self.kinds[*cell] != CLOSED;
        let off = |cell: &usize| distance(self.middle(*cell), target);
        let seed = (0..self.kinds.len()).filter(free).min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let beside = self.flood(&self.weights(|kind| if kind == CLOSED { f32::INFINITY } else { 1.0 }), seed);
        let costs = beside.costs();
        let in_reach =
            (0..costs.len()).filter(|cell| reach.costs()[*cell].is_finite() && costs[*cell].is_finite());
        let cell = in_reach.min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
        Some((cell, f64::from(reach.lengths()[cell])))
    }

    /// Returns the reachable cell before a gap that is nearest to `target`, a point of the gap, and the length of the robot's path
    /// there, in metres. If no cell before the gap is reachable, returns the reachable cell that is nearest to `target`.
    pub fn end_near(&mut self, robot: Place, target: Place, gap: &[Place]) -> Option<(usize, f64)> {
        let reach = self.reach(robot);
        let cell = self.before(&reach, target, gap).or_else(|| self.nearest(&reach, target, &|_| true))?;
        Some((cell, f64::from(reach.lengths()[cell])))
    }

    /// Returns the index of the gap to look through next, the reachable cell before it, and the length of the robot's path there, in
    /// metres. This is the gap with the lowest cost, path and look, per metre of its length. Returns `None` if no gap can be reached.
    pub fn next_gap(&mut self, robot: Place, gaps: &[Vec<Place>]) -> Option<(usize, usize, f64)> {
        let reach = self.reach(robot);
        let ends = gaps.iter().enumerate().filter_map(|(k, gap)| {
            let middle = *gap.get(gap.len() / 2)?;
            let cell = self.before(&reach, middle, gap)?;
            let way_m = f64::from(reach.lengths()[cell]);
            let wide_m = distance(gap[0], gap[gap.len() - 1]).clamp(NARROW_M, WIDE_GAP_M);
            Some((k, cell, way_m, (way_m + LOOK_M) / wide_m))
        });
        let (gap, cell, way_m, _) = ends.min_by(|a, b| a.3.total_cmp(&b.3))?;
        Some((gap, cell, way_m))
    }

    /// Returns the reachable cell before a gap that is nearest to `target`.
    fn before(&self, reach: &Frontier, target: Place, gap: &[Place]) -> Option<usize> {
        let bound = |axis: usize, start: f64, of: fn(f64, f64) -> f64| {
            gap.iter().map(|place| place[axis]).fold(start, of)
        };
        let low = [0, 1].map(|axis| bound(axis, f64::INFINITY, f64::min) - BEFORE_GAP_M);
        let high = [0, 1].map(|axis| bound(axis, f64::NEG_INFINITY, f64::max) + BEFORE_GAP_M);
        let is_before = |cell: usize| {
            let middle = self.middle(cell);
            let is_about = (0..2).all(|axis| low[axis] <= middle[axis] && middle[axis] <= high[axis]);
            is_about && gap.iter().any(|place| distance(*place, middle) < BEFORE_GAP_M)
        };
        self.nearest(reach, target, &is_before)
    }

    /// Returns the reachable cell that is nearest to `target` and satisfies `among`.
    fn nearest(&self, reach: &Frontier, target: Place, among: &dyn Fn(usize) -> bool) -> Option<usize> {
        let mut best = (None, f64::INFINITY);
        for cell in (0..self.kinds.len()).filter(|cell| reach.costs()[*cell].is_finite()) {
            let off_m = distance(self.middle(cell), target);
            // The slow check comes last, since few cells are nearer than the best so far.
            if off_m < best.1 && among(cell) {
                best = (Some(cell), off_m);
            }
        }
        best.0
    }
}

/// Returns the cost of a cell, per unit of length.
fn with_room(kind: u8) -> f32 {
    if kind < OPEN {
        return f32::INFINITY;
    }
    let lack = 1.0 - f32::from(kind - OPEN) / f32::from(ROOM);
    1.0 + NEAR * lack * lack
}

/// The cost of the path to the end of a course, from every cell.
#[derive(Debug)]
pub struct Field {
    stride: usize,
    cell_m: f64,
    origin: Place,
    weights: Vec<f32>,
    frontier: Frontier,
    grid: PathGrid,
}

impl Field {
    /// Computes the cost of paths to the cell `end` of a grid. Returns `None` if the grid has no such cell.
    pub fn new(grid: &PathGrid, end: usize) -> Option<Self> {
        if grid.kinds.len() <= end {
            return None;
        }
        // A course may lead through tight cells at a high cost, because the robot may end up in one when avoiding obstacles.
        let weights = grid.weights(|kind| if kind == TIGHT { 4.0 * ESCAPE } else { with_room(kind) });
        let frontier = grid.flood(&weights, end);
        let PathGrid { stride, cell_m, origin, .. } = *grid;
        Some(Self { stride, cell_m, origin, weights, frontier, grid: grid.clone() })
    }

    /// Returns the cost from a place, which is at least the length of the path in metres.
    pub fn cost_m(&self, place: Place) -> f64 {
        f64::from(self.frontier.costs()[self.grid.cell(place)])
    }

    /// Writes the path from a place, with one point per cell.
    pub fn descend(&self, from: Place, path: &mut Vec<Point<Map>>) {
        let weights = Weights { weight: &self.weights, stride: self.stride, cell_length: self.cell_m as f32 };
        let mut cell = self.grid.cell(from);
        path.push(Point::new(from[0], from[1]));
        while let Some(next) = weights.downhill(&self.frontier, cell).filter(|_| path.len() < MAX_PATH) {
            cell = next;
            let at = [cell % self.stride, cell / self.stride];
            let [x, y] = [0, 1].map(|k| self.origin[k] + (at[k] as f64 + 0.5) * self.cell_m);
            path.push(Point::new(x, y));
        }
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_mapping::{Cell, CellGrid};

    use super::*;

    /// Returns the grid of a hall of 6 × 4 m with a wall across it, which has a door 1 m wide at the upper end.
    fn hall() -> PathGrid {
        let grid = CellGrid::of([124, 84], 0.05, [0.0, 0.0], |k| {
            let (x, y) = (k % 124, k / 124);
            let is_inside = (2..122).contains(&x) && (2..82).contains(&y);
            let is_wall = x == 60 && y < 62;
            if is_inside && !is_wall { Cell::Free } else { Cell::Occupied }
        });
        PathGrid::new(&Survey::of(grid, [1.0, 1.0], 0.5), 0.25)
    }

    #[test]
    fn the_way_leads_through_the_door_and_keeps_off_the_walls() {
        let mut grid = hall();
        let (cell, way_m) = grid.end_for([1.0, 1.0], [5.0, 1.0]).unwrap();
        assert!(distance(grid.middle(cell), [5.0, 1.0]) < 0.15);
        assert!((7.0..9.5).contains(&way_m), "{way_m}");
        let field = Field::new(&grid, cell).unwrap();
        let mut path = Vec::new();
        field.descend([1.0, 1.0], &mut path);
        assert!(path.iter().any(|at| (at.x - 3.0).abs() < 0.2 && at.y > 3.3));
        assert!(path[1..].iter().all(|at| at.x > 0.3 && at.x < 5.9 && at.y > 0.3 && at.y < 3.9));
        assert!(field.cost_m([1.0, 1.0]) > 7.0);
    }

    /// Both targets are so close to a wall that the robot does not fit there.
    #[test]
    fn a_place_where_the_robot_does_not_fit_is_gone_to_as_near_as_can_be() {
        let mut grid = hall();
        let (cell, _) = grid.end_for([1.0, 1.0], [0.12, 2.0]).unwrap();
        assert!(distance(grid.middle(cell), [0.45, 2.0]) < 0.2, "{:?}", grid.middle(cell));
        let gap: Vec<_> = (0..10).map(|k| [5.9, 1.0 + 0.1 * f64::from(k)]).collect();
        let (cell, _) = grid.end_near([1.0, 1.0], [5.9, 1.5], &gap).unwrap();
        assert!(distance(grid.middle(cell), [5.6, 1.5]) < 0.25, "{:?}", grid.middle(cell));
    }

    #[test]
    fn a_robot_that_stands_too_near_to_a_wall_gets_away_from_it() {
        let mut grid = hall();
        assert!(grid.end_for([0.2, 1.0], [2.0, 1.0]).is_some());
    }
}
