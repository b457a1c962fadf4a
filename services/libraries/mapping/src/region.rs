//! Regions of cells: connectivity, neighbourhoods, and the border around a region.

/// A set of cells of a rectangle; row 0 is the lowest, cells of a row go along x.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Region {
    /// Cells in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row.
    pub cells: Vec<bool>,
}

/// Steps to the eight neighbours, counter-clockwise from x.
const AROUND: [[i64; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

impl Region {
    /// The cells for which `holds` is true.
    pub fn of(width: usize, height: usize, holds: impl FnMut(usize) -> bool) -> Self {
        Self { width, height, cells: (0..width * height).map(holds).collect() }
    }

    /// The index of a cell in `cells`; `None` outside the rectangle.
    pub fn index(&self, at: [i64; 2]) -> Option<usize> {
        let is_within = (0..self.width as i64).contains(&at[0]) && (0..self.height as i64).contains(&at[1]);
        is_within.then(|| at[1] as usize * self.width + at[0] as usize)
    }

    /// Whether it contains a cell; no cell outside the rectangle.
    pub fn holds(&self, at: [i64; 2]) -> bool {
        self.index(at).is_some_and(|index| self.cells[index])
    }

    /// How many cells it contains.
    pub fn count(&self) -> usize {
        self.cells.iter().filter(|cell| **cell).count()
    }

    /// Column and row of a cell.
    pub fn at(&self, index: usize) -> [i64; 2] {
        [(index % self.width) as i64, (index / self.width) as i64]
    }

    /// The cells connected to `seed` by their sides; none if the region does not contain the seed.
    pub fn connected(&self, seed: usize) -> Self {
        let mut found = Self { cells: vec![false; self.cells.len()], ..*self };
        let mut waiting = Vec::new();
        if self.cells.get(seed) == Some(&true) {
            found.cells[seed] = true;
            waiting.push(seed);
        }
        while let Some(index) = waiting.pop() {
            for next in self.beside(index) {
                if self.cells[next] && !std::mem::replace(&mut found.cells[next], true) {
                    waiting.push(next);
                }
            }
        }
        found
    }

    /// Removes the cells connected to `seed` by their sides and returns how many they were. `waiting` is memory to be reused.
    pub fn take_connected(&mut self, seed: usize, waiting: &mut Vec<usize>) -> usize {
        let mut count = 0;
        if std::mem::take(&mut self.cells[seed]) {
            waiting.push(seed);
        }
        while let Some(index) = waiting.pop() {
            count += 1;
            for next in self.beside(index) {
                if std::mem::take(&mut self.cells[next]) {
                    waiting.push(next);
                }
            }
        }
        count
    }

    /// The neighbours of a cell at its sides.
    fn beside(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let column = index % self.width;
        let beside = [
            (column > 0).then(|| index - 1),
            (column + 1 < self.width).then_some(index + 1),
            index.checked_sub(self.width),
            Some(index + self.width).filter(|next| *next < self.cells.len()),
        ];
        beside.into_iter().flatten()
    }

    /// The cell nearest to `at` within a distance in cells; the first of several that are equally near.
    pub fn nearest(&self, at: [f64; 2], within: f64) -> Option<usize> {
        let [low, high] = [-1.0, 1.0].map(|side| [0, 1].map(|k| (at[k] + side * within).floor() as i64));
        let mut best = (None, within * within);
        for row in low[1].max(0)..=high[1].min(self.height as i64 - 1) {
            for column in low[0].max(0)..=high[0].min(self.width as i64 - 1) {
                let off = [column as f64 + 0.5 - at[0], row as f64 + 0.5 - at[1]];
                let square = off[0] * off[0] + off[1] * off[1];
                let index = row as usize * self.width + column as usize;
                if self.cells[index] && (square < best.1 || best.0.is_none() && square <= best.1) {
                    best = (Some(index), square);
                }
            }
        }
        best.0
    }

    /// The region plus every cell at most `radius` columns and rows away.
    pub fn grown(&self, radius: usize) -> Self {
        if self.cells.is_empty() {
            return self.clone();
        }
        let mut along = self.cells.clone();
        for (row, out) in self.cells.chunks(self.width).zip(along.chunks_mut(self.width)) {
            for shift in 1..=radius.min(self.width - 1) {
                out[shift..].iter_mut().zip(row).for_each(|(cell, near)| *cell |= near);
                out.iter_mut().zip(&row[shift..]).for_each(|(cell, near)| *cell |= near);
            }
        }
        let mut grown = along.clone();
        for shift in (1..=radius.min(self.height - 1)).map(|rows| rows * self.width) {
            grown[shift..].iter_mut().zip(&along).for_each(|(cell, near)| *cell |= near);
            grown.iter_mut().zip(&along[shift..]).for_each(|(cell, near)| *cell |= near);
        }
        Self { cells: grown, ..*self }
    }

    /// The same in cells `times` as long, each contained if all of its cells are. What remains at the ends is left out.
    pub fn coarser(&self, times: usize) -> Self {
        let (width, height) = (self.width / times, self.height / times);
        Self::of(width, height, |k| {
            let (column, row) = (k % width * times, k / width * times);
            (row..row + times)
                .all(|y| self.cells[y * self.width + column..][..times].iter().all(|cell| *cell))
        })
    }

    /// The region without every cell at most `radius` columns and rows from one that it does not contain. Cells outside the
    /// rectangle count as contained.
    pub fn shrunk(&self, radius: usize) -> Self {
        let inverse = Self { cells: self.cells.iter().map(|cell| !cell).collect(), ..*self };
        let grown = inverse.grown(radius);
        Self { cells: grown.cells.iter().map(|cell| !cell).collect(), ..*self }
    }

    /// The cells of the outer border, counter-clockwise, beginning with the first cell of the lowest row (Moore's neighbour
    /// tracing). The region is assumed to be connected; holes have no part in it.
    pub fn border(&self) -> Vec<[i64; 2]> {
        let Some(first) = self.cells.iter().position(|cell| *cell) else { return Vec::new() };
        let start = self.at(first);
        let (mut chain, mut heading) = (vec![start], 6);
        let most = 4 * self.cells.len() + 8;
        while chain.len() < most {
            let here = chain[chain.len() - 1];
            let from = if heading % 2 == 0 { heading + 7 } else { heading + 6 };
            let turns = (from..from + 8).map(|turn| turn % 8);
            let step = |turn: usize| [here[0] + AROUND[turn][0], here[1] + AROUND[turn][1]];
            let Some(turn) = turns.into_iter().find(|turn| self.holds(step(*turn))) else { return chain };
            let next = step(turn);
            if chain.len() > 2 && here == start && next == chain[1] {
                chain.pop();
                return chain;
            }
            chain.push(next);
            heading = turn;
        }
        chain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(rows: &[&str]) -> Region {
        let (width, height) = (rows[0].len(), rows.len());
        Region::of(width, height, |i| rows[height - 1 - i / width].as_bytes()[i % width] == b'#')
    }

    #[test]
    fn the_border_goes_round_counter_clockwise() {
        let region = drawn(&[".....", ".##..", ".###.", "....."]);
        assert_eq!(region.border(), [[1, 1], [2, 1], [3, 1], [2, 2], [1, 2]]);
    }

    /// A spur is walked along on both sides, and does not end the walk.
    #[test]
    fn a_spur_one_cell_wide_is_walked_there_and_back() {
        let region = drawn(&["......", ".####.", ".#....", "......"]);
        assert_eq!(region.border(), [[1, 1], [2, 2], [3, 2], [4, 2], [3, 2], [2, 2], [1, 2]]);
    }

    #[test]
    fn a_hole_is_no_part_of_the_border() {
        let region = drawn(&["#####", "#...#", "#.#.#", "#...#", "#####"]);
        let whole = region.connected(0);
        assert_eq!(whole.count(), 16);
        assert_eq!(whole.border().len(), 16);
        assert_eq!(drawn(&["..", "#."]).border(), [[0, 0]]);
    }

    #[test]
    fn a_coarser_region_keeps_thin_walls() {
        let region = drawn(&["####.", "##.#.", "####.", "####."]);
        assert_eq!(region.coarser(2), drawn(&["#.", "##"]));
    }

    #[test]
    fn what_grows_and_shrinks_again_has_its_gaps_closed() {
        let frame = ".........";
        let region = drawn(&[frame, frame, "..##.##..", "..##.##..", frame, frame]);
        let closed = region.grown(1).shrunk(1);
        assert_eq!(closed, drawn(&[frame, frame, "..#####..", "..#####..", frame, frame]));
        assert_eq!(region.nearest([4.4, 2.2], 3.0), region.index([3, 2]));
        assert_eq!(region.nearest([30.0, 2.2], 3.0), None);
    }
}
