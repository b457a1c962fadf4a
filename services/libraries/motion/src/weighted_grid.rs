//! Dijkstra's algorithm on a grid of weighted cells with eight neighbours (E. W. Dijkstra, 1959).
//!
//! A grid is a slice of weights in rows of `stride` cells. A weight is the cost per unit of length, and a cell of infinite weight
//! is impassable. The outermost cells must be impassable, so that no neighbour's index leaves the grid. Ties are broken by index,
//! so equal inputs give bit-identical results.

use super::buckets::Buckets;

/// The tentative costs of all cells, and the queue of cells that are not yet settled.
#[derive(Debug, Clone)]
pub struct Frontier {
    cost: Vec<f32>,
    length: Vec<f32>,
    buckets: Buckets,
}

impl Frontier {
    /// Creates the frontier of a grid of `cells` cells. All costs are infinite.
    pub fn new(cells: usize) -> Self {
        Self { cost: vec![f32::INFINITY; cells], length: vec![0.0; cells], buckets: Buckets::new(cells) }
    }

    /// Returns the cost of every cell, or infinity if no path to the cell has been found.
    pub fn costs(&self) -> &[f32] {
        &self.cost
    }

    /// Returns the length of the cheapest path to every cell of finite cost. If several paths are the cheapest, this is the length
    /// of the shortest of them.
    pub fn lengths(&self) -> &[f32] {
        &self.length
    }

    /// Lowers the cost of a cell to that of a new path, unless the cell already has a better one.
    #[inline(always)]
    fn lower(&mut self, cell: usize, cost: f32, length: f32) {
        let before = self.cost[cell];
        // Most candidates are no better, or impassable.
        if cost > before || cost == f32::INFINITY {
            return;
        }
        if cost < before || length < self.length[cell] {
            self.cost[cell] = cost;
            self.length[cell] = length;
            self.buckets.put(cell, cost);
        }
    }
}

/// A grid of weights and the length of a cell's side.
#[derive(Debug, Clone, Copy)]
pub struct Weights<'a> {
    /// Weights of the cells, row by row. Infinite on the border and in impassable cells.
    pub weight: &'a [f32],
    /// Number of cells per row.
    pub stride: usize,
    /// Side length of a cell, in the unit of lengths.
    pub cell_length: f32,
}

impl Weights<'_> {
    /// Returns the cost of the step from `cell` to each neighbour, straight neighbours first. A diagonal step
    /// touches two more cells, so its cost uses the mean weight of all four, and a path never slips between
    /// two walls.
    fn edges(&self, cell: usize) -> [(usize, f32); 8] {
        let (w, s) = (self.weight, self.stride);
        let (half, quarter) = (self.cell_length / 2.0, self.cell_length * std::f32::consts::SQRT_2 / 4.0);
        let (east, west, north, south) = (cell + 1, cell - 1, cell + s, cell - s);
        let straight = |to: usize| (to, half * (w[cell] + w[to]));
        let diagonal = |to: usize, a: usize, b: usize| (to, quarter * (w[cell] + w[to] + w[a] + w[b]));
        [
            straight(east),
            straight(north),
            straight(west),
            straight(south),
            diagonal(north + 1, north, east),
            diagonal(north - 1, north, west),
            diagonal(south - 1, south, west),
            diagonal(south + 1, south, east),
        ]
    }

    /// Finds the cost of the cheapest path from `seed` to every cell. The search may end once all cells as close as `stop`, or all
    /// cells up to the cost `limit`, are settled. The seed must not lie on the border.
    pub fn flood(&self, frontier: &mut Frontier, seed: usize, stop: Option<usize>, limit: f32) {
        let [least, most] = self.steps();
        frontier.cost.fill(f32::INFINITY);
        frontier.buckets.reset(least, most);
        frontier.lower(seed, 0.0, 0.0);
        let mut last_bucket = u32::MAX;
        while let Some(cell) = frontier.buckets.pop().filter(|_| frontier.buckets.current() <= last_bucket) {
            if Some(cell) == stop {
                last_bucket = frontier.buckets.current();
            }
            if frontier.cost[cell] <= limit {
                self.relax(frontier, cell);
            }
        }
    }

    /// Lowers the costs of a cell's neighbours where the path through the cell is cheaper, straight neighbours first.
    #[inline(always)]
    fn relax(&self, frontier: &mut Frontier, cell: usize) {
        let (half, quarter) = (self.cell_length / 2.0, self.cell_length * std::f32::consts::SQRT_2 / 4.0);
        let (cost, length) = (frontier.cost[cell], frontier.length[cell]);
        let straight = length + self.cell_length;
        let diagonal = length + self.cell_length * std::f32::consts::SQRT_2;
        let (south, north) = (cell - self.stride, cell + self.stride);
        let three = |row: usize| [self.weight[row - 1], self.weight[row], self.weight[row + 1]];
        let ([sw, s, se], [w, own, e], [nw, n, ne]) = (three(south), three(cell), three(north));
        frontier.lower(cell + 1, cost + half * (own + e), straight);
        frontier.lower(north, cost + half * (own + n), straight);
        frontier.lower(cell - 1, cost + half * (own + w), straight);
        frontier.lower(south, cost + half * (own + s), straight);
        frontier.lower(north + 1, cost + quarter * (own + ne + n + e), diagonal);
        frontier.lower(north - 1, cost + quarter * (own + nw + n + w), diagonal);
        frontier.lower(south - 1, cost + quarter * (own + sw + s + w), diagonal);
        frontier.lower(south + 1, cost + quarter * (own + se + s + e), diagonal);
    }

    /// Returns the costs of the cheapest and of the costliest possible step.
    fn steps(&self) -> [f32; 2] {
        // Weights are not negative, so comparing their bits as integers gives the same order.
        const IMPASSABLE: u32 = f32::INFINITY.to_bits();
        let bits = |w: &f32| w.to_bits();
        let least = self.weight.iter().map(bits).fold(IMPASSABLE, u32::min);
        let passable = |bits: u32| if bits < IMPASSABLE { bits } else { 0 };
        let most = self.weight.iter().map(bits).map(passable).fold(0, u32::max);
        let [least, most] = [least, most].map(f32::from_bits);
        [least * self.cell_length, most * self.cell_length * std::f32::consts::SQRT_2]
    }

    /// Returns the next cell on the cheapest path from `cell` back to the seed, or `None` at the seed or if no path was found.
    pub fn downhill(&self, frontier: &Frontier, cell: usize) -> Option<usize> {
        let costs = &frontier.cost;
        let mut best = (cell, f32::INFINITY);
        for (to, step) in self.edges(cell) {
            if costs[to] + step < best.1 {
                best = (to, costs[to] + step);
            }
        }
        (costs[best.0] < costs[cell]).then_some(best.0)
    }
}

/// Computes the distance, from centre to centre, of every cell to the nearest solid cell, capped at `cap`. Two passes of the
/// chamfer (0.955, 1.369) (G. Borgefors, 1986) give an error of at most 4.5 %. Cells on the border are not updated: their distance
/// is zero if they are solid, and `cap` otherwise.
pub fn chamfer(solid: impl Fn(usize) -> bool, stride: usize, cell_length: f32, cap: f32, out: &mut [f32]) {
    for (cell, distance) in out.iter_mut().enumerate() {
        *distance = if solid(cell) { 0.0 } else { cap };
    }
    let (side, corner) = (0.955 * cell_length, 1.369 * cell_length);
    let rows = out.len() / stride;
    for row in 1..rows - 1 {
        let (below, here) = out[(row - 1) * stride..(row + 1) * stride].split_at_mut(stride);
        pass_row(below, here, side, corner);
        for first in (1..stride - 1).step_by(TOGETHER) {
            let last = (first + TOGETHER).min(stride - 1);
            if is_passed(&here[first - 1..last - 1], &here[first..last], side) {
                (first..last).for_each(|column| here[column] = lesser(here[column], here[column - 1] + side));
            }
        }
    }
    for row in (1..rows - 1).rev() {
        let (here, above) = out[row * stride..(row + 2) * stride].split_at_mut(stride);
        pass_row(above, here, side, corner);
        for last in (2..stride).rev().step_by(TOGETHER) {
            let first = last.saturating_sub(TOGETHER).max(1);
            if is_passed(&here[first + 1..last + 1], &here[first..last], side) {
                (first..last)
                    .rev()
                    .for_each(|column| here[column] = lesser(here[column], here[column + 1] + side));
            }
        }
    }
}

/// Number of cells of a row that are processed together.
const TOGETHER: usize = 8;

/// Propagates the distances of a row to the adjacent row.
fn pass_row(from: &[f32], to: &mut [f32], side: f32, corner: f32) {
    let inner = to.len() - 2;
    for (to, from) in to[1..=inner].iter_mut().zip(from.windows(3)) {
        let corners = lesser(from[0], from[2]) + corner;
        *to = lesser(*to, lesser(from[1] + side, corners));
    }
}

/// Returns true if the distance of any cell is shorter through its neighbour in the row.
fn is_passed(beside: &[f32], cells: &[f32], side: f32) -> bool {
    beside.iter().zip(cells).fold(false, |any, (beside, cell)| any | (beside + side < *cell))
}

/// Returns the lesser of two numbers. Unlike [`f32::min`], this does not handle NaN.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SIDE: usize = 9;

    fn open_grid(inner: &[f32]) -> Vec<f32> {
        let mut weight = vec![f32::INFINITY; SIDE * SIDE];
        for row in 1..SIDE - 1 {
            for column in 1..SIDE - 1 {
                weight[row * SIDE + column] = inner[(row - 1) * (SIDE - 2) + column - 1];
            }
        }
        weight
    }

    /// The Bellman-Ford algorithm, which is slow but too simple to be wrong.
    fn relax_until_stable(weights: &Weights, seed: usize) -> Vec<f32> {
        let mut cost = vec![f32::INFINITY; weights.weight.len()];
        cost[seed] = 0.0;
        loop {
            let before = cost.clone();
            for cell in (0..cost.len()).filter(|&c| before[c].is_finite()) {
                for (to, step) in weights.edges(cell) {
                    cost[to] = cost[to].min(before[cell] + step);
                }
            }
            if cost == before {
                return cost;
            }
        }
    }

    proptest! {
        #[test]
        fn flood_finds_the_cheapest_paths(inner in prop::collection::vec(prop_oneof![1.0f32..9.0, Just(1.0), Just(9e4), Just(f32::INFINITY)], 49)) {
            let mut weight = open_grid(&inner);
            let seed = 4 * SIDE + 4;
            weight[seed] = 1.0;
            let weights = Weights { weight: &weight, stride: SIDE, cell_length: 0.5 };
            let mut frontier = Frontier::new(weight.len());
            weights.flood(&mut frontier, seed, None, f32::INFINITY);
            prop_assert_eq!(frontier.costs(), relax_until_stable(&weights, seed));
        }

        #[test]
        fn downhill_leads_to_the_seed(inner in prop::collection::vec(1.0f32..9.0, 49), from in 0usize..49) {
            let weight = open_grid(&inner);
            let seed = 2 * SIDE + 3;
            let weights = Weights { weight: &weight, stride: SIDE, cell_length: 1.0 };
            let mut frontier = Frontier::new(weight.len());
            weights.flood(&mut frontier, seed, None, f32::INFINITY);
            let mut cell = (from / 7 + 1) * SIDE + from % 7 + 1;
            let mut steps = 0;
            while let Some(next) = weights.downhill(&frontier, cell) {
                cell = next;
                steps += 1;
                prop_assert!(steps < 49);
            }
            prop_assert_eq!(cell, seed);
        }
    }

    #[test]
    fn no_path_leads_diagonally_between_two_walls() {
        let mut inner = vec![1.0; 49];
        (0..7).for_each(|i| inner[i * 7 + i] = f32::INFINITY);
        let weight = open_grid(&inner);
        let mut frontier = Frontier::new(weight.len());
        Weights { weight: &weight, stride: SIDE, cell_length: 1.0 }.flood(
            &mut frontier,
            SIDE + 7,
            None,
            f32::INFINITY,
        );
        assert!(frontier.costs()[7 * SIDE + 1].is_infinite());
    }

    #[test]
    fn chamfer_measures_straight_and_diagonal_distances() {
        let mut out = vec![0.0; SIDE * SIDE];
        chamfer(|cell| cell == 4 * SIDE + 4, SIDE, 0.5, 10.0, &mut out);
        for (column, row, exact) in [(6, 4, 1.0), (6, 6, 2f32.sqrt()), (6, 5, 1.25f32.sqrt())] {
            assert!((out[row * SIDE + column] / exact - 1.0).abs() < 0.046);
        }
    }
}
