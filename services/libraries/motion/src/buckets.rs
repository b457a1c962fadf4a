//! An approximate priority queue of cells by cost. It is a ring of buckets (R. B. Dial, 1969), and each bucket is a list linked
//! through its cells.
//!
//! Cells within a bucket are in no particular order. If a bucket is no wider than the cheapest step, none of its cells can make
//! another one cheaper, and a search that empties one bucket after another settles every cell once. If a bucket is wider, a cell
//! that became cheaper is popped again. Either way the final costs are those of Dijkstra's algorithm. Every cell is in the queue at
//! most once, so the memory needed is known beforehand and searching does not allocate.

/// Number of buckets in the ring.
const RING: usize = 4096;
/// Maximum spread of the costs in the queue, in buckets. It is a little smaller than the ring, so that rounding cannot make the
/// ring overlap itself.
const SPREAD: f32 = (RING - 4) as f32;
const NONE: u32 = u32::MAX;
/// Bit that marks a [`Link::before`] as the index of a bucket rather than of a cell.
const BUCKET: u32 = 1 << 31;

/// A cell's neighbours in the list of its bucket.
#[derive(Debug, Clone, Copy)]
struct Link {
    next: u32,
    /// The previous cell, or the bucket for the first cell of a list, or [`NONE`] for a cell that is in no list.
    before: u32,
}

const UNLINKED: Link = Link { next: NONE, before: NONE };

/// A queue that yields the cells of a grid roughly in the order of their costs.
#[derive(Debug, Clone)]
pub struct Buckets {
    first: Vec<u32>,
    links: Vec<Link>,
    count: usize,
    current: u32,
    per_cost: f32,
}

impl Buckets {
    /// Creates a queue for a grid of `cells` cells, which must be fewer than 2³¹.
    pub fn new(cells: usize) -> Self {
        Self { first: vec![NONE; RING], links: vec![UNLINKED; cells], count: 0, current: 0, per_cost: 1.0 }
    }

    /// Empties the queue for a search whose steps cost from `least` to `most`.
    pub fn reset(&mut self, least: f32, most: f32) {
        if self.count > 0 {
            self.first.fill(NONE);
            self.links.fill(UNLINKED);
        }
        (self.count, self.current) = (0, 0);
        self.per_cost = 1.0 / least.max(most / SPREAD);
    }

    /// Returns the number of the bucket that is being emptied. Numbers keep increasing as the ring wraps around.
    pub fn current(&self) -> u32 {
        self.current
    }

    /// Moves a cell to the bucket of its cost. The cost must be finite and at least that of the cell popped last, and may exceed it
    /// by no more than the costliest step.
    pub fn put(&mut self, cell: usize, cost: f32) {
        debug_assert!(cost.is_finite(), "cell {cell}: {cost}");
        self.unlink(cell);
        let bucket = ((cost * self.per_cost) as u32).max(self.current) as usize % RING;
        let next = std::mem::replace(&mut self.first[bucket], cell as u32);
        self.links[cell] = Link { next, before: BUCKET | bucket as u32 };
        if next != NONE {
            self.links[next as usize].before = cell as u32;
        }
        self.count += 1;
    }

    /// Removes and returns a cell of the first bucket that is not empty, or returns `None` if the queue is empty.
    pub fn pop(&mut self) -> Option<usize> {
        if self.count == 0 {
            return None;
        }
        while self.first[self.current as usize % RING] == NONE {
            self.current += 1;
        }
        let cell = self.first[self.current as usize % RING] as usize;
        self.unlink(cell);
        Some(cell)
    }

    fn unlink(&mut self, cell: usize) {
        let Link { next, before } = std::mem::replace(&mut self.links[cell], UNLINKED);
        match before {
            NONE => return,
            bucket if bucket & BUCKET != 0 => self.first[(bucket & !BUCKET) as usize] = next,
            before => self.links[before as usize].next = next,
        }
        if next != NONE {
            self.links[next as usize].before = before;
        }
        self.count -= 1;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Every cell that is put in, possibly again at a lower cost, is popped once, cheapest bucket first.
        #[test]
        fn cells_are_popped_in_order_of_cost(puts in prop::collection::vec((0usize..40, 0.0f32..5000.0), 1..120)) {
            let mut buckets = Buckets::new(40);
            buckets.reset(1.0, 5000.0);
            let mut costs = [f32::INFINITY; 40];
            for (cell, cost) in puts {
                if cost < costs[cell] {
                    costs[cell] = cost;
                    buckets.put(cell, cost);
                }
            }
            let found: Vec<usize> = std::iter::from_fn(|| buckets.pop()).collect();
            prop_assert_eq!(found.len(), costs.iter().filter(|c| c.is_finite()).count());
            let width = 5000.0 / SPREAD;
            prop_assert!(found.windows(2).all(|w| costs[w[0]] < costs[w[1]] + width));
        }
    }

    #[test]
    fn the_ring_wraps_around() {
        let mut buckets = Buckets::new(3);
        buckets.reset(0.5, 100.0);
        buckets.put(0, 0.0);
        let mut cost = 0.0;
        for round in 0..1000 {
            assert_eq!(buckets.pop(), Some(round % 2));
            buckets.put(2, cost + 100.0);
            cost += 99.0;
            buckets.put((round + 1) % 2, cost);
        }
        buckets.reset(1.0, 1.0);
        assert_eq!(buckets.pop(), None);
    }
}
