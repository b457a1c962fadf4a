//! Judges a motion between two maps by what both of them show.

use super::{LEAST_OVERLAP_M2, LEAST_SHARE, LEAST_WALLS_M, Motion, Walls};
use crate::grid::CellGrid;

/// Maximum distance, in metres, between the same wall in both maps. Maps of long drives are slightly bent.
const SAME_WALL_M: f64 = 0.2;

/// How well two maps agree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Agreement {
    /// Area that both maps show as free, in square metres.
    pub floor_m2: f64,
    /// Length of the walls that both maps show, in metres.
    pub wall_m: f64,
    /// Length of the walls that only one of them shows, and that stand in free space of the other, in metres.
    pub against_m: f64,
    /// Root mean square of the distances between the walls that both maps show, in metres.
    pub residual_m: f64,
}

/// Number of wall cells of a map that the other map shows, does not show, and the sum of their squared distances, in square cells.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    shown: usize,
    against: usize,
    squares: f64,
}

impl Agreement {
    /// Judges a motion. `moved` are the walls of the other map.
    pub(super) fn of(first: &CellGrid, other: &CellGrid, moved: &Walls, motion: &Motion) -> Self {
        let to_first = motion.apply();
        let to_middle = Motion { middle: [0.0; 2], yaw_rad: -motion.yaw_rad }.apply();
        let within = SAME_WALL_M / first.cell;
        let on_first = moved.points.iter().map(|point| to_first(*point).map(|at| at / first.cell));
        let in_first = count(first, on_first, within);
        let on_other = first.occupied.places().map(|at| {
            let at = [0, 1].map(|axis| (at[axis] as f64 + 0.5) * first.cell - motion.middle[axis]);
            let point = to_middle(at);
            [0, 1].map(|axis| (point[axis] + moved.middle[axis] - other.origin[axis]) / other.cell)
        });
        let in_other = count(other, on_other, within);
        let is_free = |index: usize| {
            let middle = other.middle(index);
            let at = to_first([0, 1].map(|axis| middle[axis] - moved.middle[axis]));
            first.free.holds(at.map(|at| (at / first.cell).floor() as i64))
        };
        let floor = other.free.iter().filter(|&index| is_free(index)).count();
        // Each wall is counted in both maps.
        let shown = in_first.shown + in_other.shown;
        Self {
            floor_m2: floor as f64 * first.cell * first.cell,
            wall_m: 0.5 * shown as f64 * first.cell,
            against_m: (in_first.against + in_other.against) as f64 * first.cell,
            residual_m: ((in_first.squares + in_other.squares) / shown.max(1) as f64).sqrt() * first.cell,
        }
    }

    /// Returns the share of the walls in the overlap that both maps show, from 0 to 1.
    pub fn share(&self) -> f64 {
        let all = self.wall_m + self.against_m;
        if all > 0.0 { self.wall_m / all } else { 0.0 }
    }

    /// Returns true if the maps have enough in common, and agree well enough there.
    pub(super) fn is_enough(&self) -> bool {
        self.floor_m2 >= LEAST_OVERLAP_M2 && self.wall_m >= LEAST_WALLS_M && self.share() >= LEAST_SHARE
    }

    /// Returns the length of the walls in favour of the motion, less that of the walls against it, in metres.
    pub(super) fn score_m(&self) -> f64 {
        self.wall_m - self.against_m
    }
}

/// Counts walls, which are places in cells of the map's grid.
fn count(map: &CellGrid, walls: impl Iterator<Item = [f64; 2]>, within: f64) -> Count {
    let mut count = Count::default();
    for at in walls {
        if let Some(wall) = map.occupied.nearest(at, within) {
            let [column, row] = map.occupied.at(wall).map(|at| at as f64 + 0.5);
            count.shown += 1;
            count.squares += (column - at[0]).powi(2) + (row - at[1]).powi(2);
        } else if map.free.holds(at.map(|at| at.floor() as i64)) {
            count.against += 1;
        }
    }
    count
}
