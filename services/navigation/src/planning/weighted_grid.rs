//! Dijkstra's algorithm on a grid of weighted cells with eight neighbours (E. W. Dijkstra, 1959).
//!
//! A grid is a slice of weights in rows of `stride` cells, the cost of a cell's length of way each;
//! an infinite weight is impassable. The outermost cells must be impassable: then no neighbour's
//! index leaves the grid. Ties are broken by index, so equal inputs give equal bits.

use serde::{Deserialize, Serialize};

const NONE: u32 = u32::MAX;

/// The tentative costs of all cells and, among them, a binary heap of the cells yet to be settled.
///
/// A cell is in the heap at most once, so its room is known beforehand and nothing is allocated.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Frontier {
    cost: Vec<f32>,
    length: Vec<f32>,
    heap: Vec<u32>,
    place: Vec<u32>,
}

impl Frontier {
    /// For a grid of `cells` cells; all costs infinite.
    pub fn new(cells: usize) -> Self {
        Self {
            cost: vec![f32::INFINITY; cells],
            length: vec![0.0; cells],
            heap: Vec::with_capacity(cells),
            place: vec![NONE; cells],
        }
    }

    /// The cost of every cell: infinite where no way was found yet.
    pub fn costs(&self) -> &[f32] {
        &self.cost
    }

    /// The length of the cheapest way to every cell that has a finite cost.
    pub fn lengths(&self) -> &[f32] {
        &self.length
    }

    fn reset(&mut self) {
        self.cost.fill(f32::INFINITY);
        self.place.fill(NONE);
        self.heap.clear();
    }

    /// Lowers the cell's cost to `cost` where that is less, by a way of this length.
    fn lower(&mut self, cell: usize, cost: f32, length: f32) {
        if cost < self.cost[cell] {
            self.cost[cell] = cost;
            self.length[cell] = length;
            if self.place[cell] == NONE {
                self.place[cell] = self.heap.len() as u32;
                self.heap.push(cell as u32);
            }
            self.rise(self.place[cell] as usize);
        }
    }

    /// Takes the cheapest cell out of the heap.
    fn pop(&mut self) -> Option<usize> {
        let first = *self.heap.first()?;
        let last = self.heap.pop()?;
        self.place[first as usize] = NONE;
        if last != first {
            self.heap[0] = last;
            self.place[last as usize] = 0;
            self.sink();
        }
        Some(first as usize)
    }

    fn before(&self, a: u32, b: u32) -> bool {
        let (cost_a, cost_b) = (self.cost[a as usize], self.cost[b as usize]);
        cost_a < cost_b || (cost_a == cost_b && a < b)
    }

    fn put(&mut self, at: usize, cell: u32) {
        self.heap[at] = cell;
        self.place[cell as usize] = at as u32;
    }

    fn rise(&mut self, mut at: usize) {
        let cell = self.heap[at];
        while at > 0 && self.before(cell, self.heap[(at - 1) / 2]) {
            self.put(at, self.heap[(at - 1) / 2]);
            at = (at - 1) / 2;
        }
        self.put(at, cell);
    }

    fn sink(&mut self) {
        let (cell, len) = (self.heap[0], self.heap.len());
        let mut at = 0;
        while 2 * at + 1 < len {
            let left = 2 * at + 1;
            let right = left + 1;
            let right_first = right < len && self.before(self.heap[right], self.heap[left]);
            let child = if right_first { right } else { left };
            if !self.before(self.heap[child], cell) {
                break;
            }
            self.put(at, self.heap[child]);
            at = child;
        }
        self.put(at, cell);
    }
}

/// A grid of weights and the length of a cell's side.
#[derive(Debug, Clone, Copy)]
pub struct Weights<'a> {
    /// Row by row; infinite on the border and where nobody can pass.
    pub weight: &'a [f32],
    /// Cells a row.
    pub stride: usize,
    /// Length of a cell's side, in the unit of way.
    pub cell_length: f32,
}

impl Weights<'_> {
    /// The cost of the step from `cell` to each neighbour, the four straight ones first. A diagonal step brushes the two cells
    /// beside it, so it costs the mean of all four: it never slips between two walls.
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

    /// Finds the cost of the cheapest way from `seed` to every cell, or until `stop` is settled, or
    /// until every way up to `limit` is known. The seed must not lie on the border.
    pub fn flood(&self, frontier: &mut Frontier, seed: usize, stop: Option<usize>, limit: f32) {
        frontier.reset();
        frontier.lower(seed, 0.0, 0.0);
        let (straight, diagonal) = (self.cell_length, self.cell_length * std::f32::consts::SQRT_2);
        while let Some(cell) = frontier.pop() {
            let cost = frontier.cost[cell];
            if Some(cell) == stop || cost > limit {
                break;
            }
            let length = frontier.length[cell];
            for (i, (to, step)) in self.edges(cell).into_iter().enumerate() {
                frontier.lower(to, cost + step, length + if i < 4 { straight } else { diagonal });
            }
        }
    }

    /// The next cell on the cheapest way from `cell` back to the seed; `None` at the seed and where
    /// no way was found.
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

/// The distance of every cell to the nearest cell of `solid`, between the cells' middles, at most
/// `cap`; by two passes of the chamfer (0.955, 1.369) (G. Borgefors, 1986), which errs by 4.5 % at most.
/// Cells on the border keep what `solid` says of them.
pub fn chamfer(solid: impl Fn(usize) -> bool, stride: usize, cell_length: f32, cap: f32, out: &mut [f32]) {
    for (cell, distance) in out.iter_mut().enumerate() {
        *distance = if solid(cell) { 0.0 } else { cap };
    }
    let (side, corner) = (0.955 * cell_length, 1.369 * cell_length);
    let rows = out.len() / stride;
    for row in 1..rows - 1 {
        for cell in row * stride + 1..(row + 1) * stride - 1 {
            let below = cell - stride;
            let near = (out[cell - 1] + side).min(out[below] + side);
            let far = (out[below - 1] + corner).min(out[below + 1] + corner);
            out[cell] = out[cell].min(near).min(far);
        }
    }
    for row in (1..rows - 1).rev() {
        for cell in (row * stride + 1..(row + 1) * stride - 1).rev() {
            let above = cell + stride;
            let near = (out[cell + 1] + side).min(out[above] + side);
            let far = (out[above + 1] + corner).min(out[above - 1] + corner);
            out[cell] = out[cell].min(near).min(far);
        }
    }
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

    /// Bellman and Ford's algorithm: slow, and too simple to be wrong.
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
        fn flood_finds_the_cheapest_ways(inner in prop::collection::vec(prop_oneof![1.0f32..9.0, Just(f32::INFINITY)], 49)) {
            let mut weight = open_grid(&inner);
            let seed = 4 * SIDE + 4;
            weight[seed] = 1.0;
            let weights = Weights { weight: &weight, stride: SIDE, cell_length: 0.5 };
            let mut frontier = Frontier::new(weight.len());
            weights.flood(&mut frontier, seed, None, f32::INFINITY);
            let expected = relax_until_stable(&weights, seed);
            for (cell, (a, b)) in frontier.costs().iter().zip(&expected).enumerate() {
                prop_assert!(a == b || (a - b).abs() < 1e-4, "cell {cell}: {a} {b}");
            }
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
    fn no_way_leads_diagonally_between_two_walls() {
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
