//! Finds the translations by which the walls of two maps coincide, for a few given rotations. This is the branch and bound search of
//! Hess, Kohler, Rapp and Andor (2016, algorithm 2), but with penalties for walls that stand in the other map's free space, and with
//! several results. Blocks of translations are visited in the order of their bounds, so that translations come out in the order of
//! their scores.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use super::Motion;
use crate::grid::CellGrid;

/// Length of a cell, as a multiple of those of the maps.
const COARSE: usize = 2;
/// Number of levels. A block of the coarsest level has 2⁵ cells along a side.
const LEVELS: usize = 6;
/// Maximum number of points of the other map's walls.
const POINTS: usize = 1000;
/// Value of a wall that is on or beside a wall of the first map, near one, or in free space.
const BESIDE: i8 = 10;
const NEAR: i8 = 5;
const IN_FREE: i8 = -5;
/// Minimum score of a result, relative to the best one.
const LEAST: f64 = 0.5;

/// The value of a wall in each cell of the first map, and the maxima over blocks. A cell's block begins at that cell and extends to
/// the right and up.
struct Values {
    /// Number of columns and rows, including a margin on each side.
    size: [usize; 2],
    levels: Vec<Vec<i8>>,
}

/// Width of the margin, which is the side of the largest block.
const MARGIN: usize = 1 << (LEVELS - 1);

impl Values {
    fn of(map: &CellGrid) -> Self {
        let inner = [map.width(), map.height()].map(|cells| cells.div_ceil(COARSE) + 1);
        let size = inner.map(|cells| cells + 2 * MARGIN);
        let mut cells = vec![0; size[0] * size[1]];
        let (mut beside, mut near) = (map.occupied.clone(), map.occupied.clone());
        beside.grow(COARSE);
        near.grow(2 * COARSE);
        for (region, value) in [(&map.free, IN_FREE), (&near, NEAR), (&beside, BESIDE)] {
            for at in region.places() {
                let [x, y] = at.map(|at| at / COARSE + MARGIN);
                cells[y * size[0] + x] = value;
            }
        }
        let mut levels = vec![cells];
        for level in 1..LEVELS {
            levels.push(doubled(&levels[level - 1], size, 1 << (level - 1)));
        }
        Self { size, levels }
    }

    /// Returns the largest value in a block, or 0 outside the map.
    #[inline]
    fn block(&self, level: usize, at: [i32; 2]) -> i32 {
        let [x, y] = at.map(|at| at.wrapping_add(MARGIN as i32) as u32 as usize);
        let is_inside = x < self.size[0] && y < self.size[1];
        if is_inside { i32::from(self.levels[level][y * self.size[0] + x]) } else { 0 }
    }
}

/// Returns the maxima over blocks twice as large. Cells outside are 0.
fn doubled(finer: &[i8], size: [usize; 2], block: usize) -> Vec<i8> {
    let at = |x: usize, y: usize| if x < size[0] && y < size[1] { finer[y * size[0] + x] } else { 0 };
    let value = |x: usize, y: usize| {
        at(x, y).max(at(x + block, y)).max(at(x, y + block)).max(at(x + block, y + block))
    };
    (0..size[0] * size[1]).map(|index| value(index % size[0], index / size[0])).collect()
}

/// A block of translations at one rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Node {
    bound: i32,
    level: usize,
    turn: usize,
    shift: [i32; 2],
}

impl Ord for Node {
    /// The node with the larger bound comes first, and of those with the same bound the smaller block, which is nearer to a result.
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |node: &Self| (node.bound, Reverse((node.level, node.turn, node.shift)));
        key(self).cmp(&key(other))
    }
}

impl PartialOrd for Node {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Returns the best motions that differ from each other, the best one first, at most `most` of them. `points` are those of the other
/// map's walls, in metres around their middle, and `turns` the rotations to try, in radians.
pub fn best(map: &CellGrid, points: &[[f64; 2]], turns: &[f64], most: usize) -> Vec<Motion> {
    let values = Values::of(map);
    let cell_m = COARSE as f64 * map.cell;
    let step = points.len().div_ceil(POINTS).max(1);
    let turned: Vec<Vec<[i32; 2]>> = turns
        .iter()
        .map(|turn| {
            let turned = Motion { middle: [0.0; 2], yaw_rad: *turn }.apply();
            let cell = |point: &[f64; 2]| turned(*point).map(|at| (at / cell_m).floor() as i32);
            points.iter().step_by(step).map(cell).collect()
        })
        .collect();
    let node = |turn: usize, shift: [i32; 2], level: usize| {
        let value = |[x, y]: &[i32; 2]| values.block(level, [x + shift[0], y + shift[1]]);
        Node { bound: turned[turn].iter().map(value).sum(), level, turn, shift }
    };
    let motion = |node: &Node| Motion {
        middle: node.shift.map(|cells| f64::from(cells) * cell_m),
        yaw_rad: turns[node.turn],
    };
    let mut open: BinaryHeap<Node> = BinaryHeap::new();
    for (turn, cells) in turned.iter().enumerate() {
        let [columns, rows] = [0, 1].map(|axis| {
            let side = values.size[axis] as i32 - 2 * MARGIN as i32;
            let reach = |of: fn(i32, i32) -> i32| cells.iter().map(|cell| cell[axis]).reduce(of).unwrap_or(0);
            -reach(i32::max)..side - reach(i32::min)
        });
        for y in rows.step_by(MARGIN) {
            open.extend(columns.clone().step_by(MARGIN).map(|x| node(turn, [x, y], LEVELS - 1)));
        }
    }
    let mut found: Vec<(Motion, i32)> = Vec::new();
    while let Some(next) = open.pop() {
        let least = found.first().map_or(0, |(_, best)| (LEAST * f64::from(*best)) as i32);
        if found.len() == most || next.bound <= least {
            break;
        }
        if next.level == 0 {
            let motion = motion(&next);
            if found.iter().all(|(known, _)| !known.is_same(&motion)) {
                found.push((motion, next.bound));
            }
            continue;
        }
        let half = 1 << (next.level - 1);
        for [x, y] in [[0, 0], [half, 0], [0, half], [half, half]] {
            open.push(node(next.turn, [next.shift[0] + x, next.shift[1] + y], next.level - 1));
        }
    }
    found.into_iter().map(|(motion, _)| motion).collect()
}
