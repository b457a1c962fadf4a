//! The metric local planner (Boniardi et al. 2015, III-C), which runs Dijkstra's algorithm on a grid of recent laser readings.
//!
//! A cell is impassable if it is closer to an obstacle than the robot's radius plus a margin. Cells within
//! the inflation radius and cells that the laser has not seen cost more. A robot that stands too close to an
//! obstacle, because it was pushed or its odometry drifted, may escape through any nearby cell that is
//! farther from obstacles.

use fearless_simd::{Level, dispatch};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point};

use super::obstacles::{CELL_M, Cell, Obstacles, SIDE};
use super::weighted_grid::{Frontier, Weights, chamfer};

/// Maximum number of points on a local path.
pub const MAX_PATH: usize = 512;
/// Maximum cost of a path, in metres on open floor that the laser has seen. The search goes no further.
const MOST_COST_M: f32 = 30.0;
/// Extra cost of an unseen cell, per unit of length.
const UNSEEN: f32 = 0.5;
/// Maximum extra cost of coming near an obstacle, per unit of length.
const NEAR: f32 = 8.0;
/// Cost of escaping from the neighbourhood of an obstacle, per unit of length.
const ESCAPE: f32 = 15.0;
/// Maximum distance of an escape, in metres.
const ESCAPE_M: f64 = 0.5;

/// The clearance that the robot needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// Minimum distance from the robot's centre to an obstacle, in metres.
    pub hard_m: f64,
    /// Distance from the robot's centre, in metres, beyond which obstacles no longer matter.
    pub soft_m: f64,
}

/// The local planner's grid, with the cost of the path from the robot to each cell.
#[derive(Debug, Clone)]
pub struct LocalPlanner {
    corner: Cell,
    clearance_m: Vec<f32>,
    weight: Vec<f32>,
    frontier: Frontier,
}

/// State of a local planner that is kept from one plan to the next: the weights, which tell where the robot fits. Read back from a
/// checkpoint.
#[derive(Debug, Clone, Deserialize)]
pub struct State {
    corner: Cell,
    weight: Vec<f32>,
}

/// A [`State`] by reference, which is written to a checkpoint without copying. It has the same fields in the same order, so it
/// serializes identically.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct StateView<'a> {
    corner: Cell,
    weight: &'a [f32],
}

impl Default for LocalPlanner {
    fn default() -> Self {
        let cells = SIDE * SIDE;
        Self {
            corner: Cell { x: 0, y: 0 },
            clearance_m: vec![0.0; cells],
            weight: vec![f32::INFINITY; cells],
            frontier: Frontier::new(cells),
        }
    }
}

impl LocalPlanner {
    /// Returns the planner's state without copying it.
    pub fn state(&self) -> StateView<'_> {
        StateView { corner: self.corner, weight: &self.weight }
    }

    /// Restores a state from a checkpoint. Paths must be searched for again.
    pub fn restore(&mut self, state: State) {
        self.corner = state.corner;
        for (weight, remembered) in self.weight.iter_mut().zip(state.weight) {
            *weight = remembered;
        }
    }

    /// Computes the weights of the grid from the obstacles around the robot, which is at `robot`.
    pub fn prepare(&mut self, obstacles: &Obstacles, robot: Point<Odom>, room: Room) {
        self.corner = obstacles.corner();
        let occupied = obstacles.occupied();
        chamfer(
            |index| occupied[index],
            SIDE,
            CELL_M as f32,
            room.soft_m as f32 + 0.1,
            &mut self.clearance_m,
        );
        for row in 1..SIDE - 1 {
            dispatch!(Level::new(), _simd => self.weigh(row, obstacles.known(), room));
        }
        let own = index_of(self.corner, robot).map_or(0.0, |index| self.beside_m(index));
        if own < room.hard_m {
            self.let_escape(robot, room, (own - CELL_M / 2.0).max(0.0));
        }
    }

    /// Returns the free space around a cell's centre, in metres.
    fn beside_m(&self, index: usize) -> f64 {
        beside_m(self.clearance_m[index])
    }

    /// Searches for paths from `robot`. The search ends at `target` if that is given and can be reached; otherwise it finds a path
    /// to every cell.
    pub fn search(&mut self, robot: Point<Odom>, target: Option<Point<Odom>>) {
        let weights = Weights { weight: &self.weight, stride: SIDE, cell_length: CELL_M as f32 };
        let stop = target.and_then(|place| index_of(self.corner, place));
        if let Some(seed) = index_of(self.corner, robot) {
            weights.flood(&mut self.frontier, seed, stop, MOST_COST_M);
        }
    }

    /// Returns true if `place` lies in the grid and the robot fits there.
    pub fn is_free(&self, place: Point<Odom>) -> bool {
        index_of(self.corner, place).is_some_and(|index| self.weight[index] < ESCAPE)
    }

    /// Returns true if `place` lies in the grid.
    pub fn contains(&self, place: Point<Odom>) -> bool {
        index_of(self.corner, place).is_some()
    }

    /// Returns the reachable cell that minimizes `share` times the length of the cheapest path to the cell
    /// plus `rest_m`, the remaining distance from there in metres. The first of several equal cells wins. The
    /// sum uses lengths rather than costs so that a narrow passage does not keep the robot from making
    /// progress.
    pub fn best(&self, share: f64, mut rest_m: impl FnMut(Point<Odom>) -> f64) -> Option<Point<Odom>> {
        let mut best = (None, f64::INFINITY);
        let (costs, lengths) = (self.frontier.costs(), self.frontier.lengths());
        for index in 0..costs.len() {
            if costs[index].is_finite() && self.weight[index] < ESCAPE {
                let place = cell_at(self.corner, index).middle();
                let sum = share * f64::from(lengths[index]) + rest_m(place);
                if sum < best.1 {
                    best = (Some(place), sum);
                }
            }
        }
        best.0
    }

    /// Returns the length of the cheapest path to `place`, in metres, or `None` if there is no path.
    pub fn length_m(&self, place: Point<Odom>) -> Option<f64> {
        let index = index_of(self.corner, place)?;
        self.frontier.costs()[index].is_finite().then(|| f64::from(self.frontier.lengths()[index]))
    }

    /// Writes the cheapest path from the robot to `target`, one point per cell with both ends included.
    /// Leaves `path` empty if no path exists.
    pub fn path(&self, target: Point<Odom>, path: &mut Vec<Point<Odom>>) {
        path.clear();
        let Some(mut index) = index_of(self.corner, target) else { return };
        if self.frontier.costs()[index].is_infinite() {
            return;
        }
        let weights = Weights { weight: &self.weight, stride: SIDE, cell_length: CELL_M as f32 };
        path.push(target);
        while let Some(next) = weights.downhill(&self.frontier, index).filter(|_| path.len() < MAX_PATH) {
            index = next;
            path.push(cell_at(self.corner, index).middle());
        }
        path.reverse();
    }

    /// Sets the weights of a row's cells according to the clearance of each cell.
    #[inline(always)]
    fn weigh(&mut self, row: usize, known: &[bool], room: Room) {
        let inner = row * SIDE + 1..(row + 1) * SIDE - 1;
        let cells =
            self.weight[inner.clone()].iter_mut().zip(&self.clearance_m[inner.clone()]).zip(&known[inner]);
        for ((weight, &clearance_m), &known) in cells {
            let clearance = beside_m(clearance_m);
            let lack = (1.0 - (clearance - room.hard_m) / (room.soft_m - room.hard_m)).max(0.0) as f32;
            let unseen = if known { 0.0 } else { UNSEEN };
            let open = 1.0 + unseen + NEAR * lack * lack;
            *weight = if clearance < room.hard_m { f32::INFINITY } else { open };
        }
    }

    /// If the robot stands too close to an obstacle, makes nearby cells passable whose clearance exceeds `least_m`, which is about
    /// the robot's current clearance.
    fn let_escape(&mut self, robot: Point<Odom>, room: Room, least_m: f64) {
        for index in (1..SIDE - 1).flat_map(|row| row * SIDE + 1..(row + 1) * SIDE - 1) {
            let clearance = self.beside_m(index);
            let is_narrow = clearance < room.hard_m && clearance > least_m;
            if is_narrow && cell_at(self.corner, index).middle().distance(&robot) < ESCAPE_M {
                self.weight[index] = ESCAPE;
            }
        }
    }
}

/// Returns the free space around a cell's centre, in metres, given the distance to the centre of the nearest occupied cell. An
/// obstacle fills its cell, so it reaches half a cell closer.
#[inline(always)]
fn beside_m(clearance_m: f32) -> f64 {
    f64::from(clearance_m) - CELL_M / 2.0
}

fn cell_at(corner: Cell, index: usize) -> Cell {
    Cell { x: corner.x + (index % SIDE) as i32, y: corner.y + (index / SIDE) as i32 }
}

/// Returns the index of the cell that contains `place`, or `None` if that cell lies outside the grid or on its border.
fn index_of(corner: Cell, place: Point<Odom>) -> Option<usize> {
    let cell = Cell::of(place);
    let (x, y) = (cell.x - corner.x, cell.y - corner.y);
    let inside = 1..SIDE as i32 - 1;
    (inside.contains(&x) && inside.contains(&y)).then(|| y as usize * SIDE + x as usize)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::Pose;
    use sketchnav_schemas::message::LaserScan;

    use super::*;

    const ROOM: Room = Room { hard_m: 0.25, soft_m: 0.6 };

    /// Returns the obstacles seen by the laser: a wall at x = 1.5 m with a gap `width_m` wide around y = 1 m.
    fn wall_with_gap(width_m: f64) -> Obstacles {
        let mut obstacles = Obstacles::new(10.0);
        let mut scan = LaserScan {
            angle_min_rad: -2.0,
            angle_increment_rad: 0.004,
            range_min_m: 0.05,
            range_max_m: 5.6,
            beam_count: 1001,
            ..Zeroable::zeroed()
        };
        for i in 0..1001 {
            let angle = f64::from(scan.angle_rad(i));
            let y = 1.5 * angle.tan();
            let hits = angle.cos() > 0.3 && (y - 1.0).abs() > width_m / 2.0;
            scan.ranges_m[i] = if hits { (1.5 / angle.cos()) as f32 } else { f32::INFINITY };
        }
        let robot = Pose::new(0.0, 0.0, 0.0);
        obstacles.observe(&robot, 0.2, &robot, &scan);
        obstacles
    }

    fn plan(obstacles: &Obstacles, target: Point<Odom>) -> LocalPlanner {
        let mut planner = LocalPlanner::default();
        planner.prepare(obstacles, Point::new(0.0, 0.0), ROOM);
        planner.search(Point::new(0.0, 0.0), Some(target));
        planner
    }

    #[test]
    fn the_local_plan_leads_through_the_gap() {
        let target = Point::new(2.5, 0.0);
        let planner = plan(&wall_with_gap(0.9), target);
        let mut path = Vec::new();
        planner.path(target, &mut path);
        let gap = path.iter().find(|p| p.x > 1.5).unwrap();
        assert!((gap.y - 1.0).abs() < 0.12, "{gap:?}");
        assert!(path[0].distance(&Point::new(0.0, 0.0)) < CELL_M && path[path.len() - 1] == target);
    }

    #[test]
    fn a_gap_narrower_than_the_robot_is_closed() {
        let target = Point::new(2.5, 0.0);
        let mut path = Vec::new();
        plan(&wall_with_gap(0.45), target).path(target, &mut path);
        assert!(path.iter().all(|p| p.x < 1.5 || (p.y - 1.0).abs() > 1.0), "{path:?}");
    }

    #[test]
    fn if_the_target_is_unreachable_the_best_cell_is_in_front_of_the_wall() {
        let planner = plan(&wall_with_gap(0.0), Point::new(2.5, 0.0));
        let goal = Point::new(3.0, 0.0);
        let best = planner.best(1.0, |place| 20.0 * place.distance(&goal).min(3.0)).unwrap();
        assert!(planner.is_free(best) && !planner.is_free(Point::new(1.5, 0.0)));
    }
}
