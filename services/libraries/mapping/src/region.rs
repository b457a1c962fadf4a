//! Regions of cells, with operations on their connected components, neighbourhoods and borders.
//!
//! A region stores one bit per cell, and most operations work on whole words.

/// Number of bits in a word.
const WORD: usize = 64;

/// A set of cells in a rectangle. Rows run along x, and row 0 is the lowest.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Region {
    width: usize,
    height: usize,
    /// The rows in order. Each is a whole number of words, and unused bits are 0.
    words: Vec<u64>,
}

/// A run of adjacent cells in a row. `end` is the column after the last one.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    row: usize,
    first: usize,
    end: usize,
}

/// Steps to the eight neighbours, counter-clockwise from x.
const AROUND: [[i64; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

impl Region {
    /// Creates the region of all cells whose index satisfies `holds`.
    pub fn of(width: usize, height: usize, mut holds: impl FnMut(usize) -> bool) -> Self {
        let mut region = Self::empty(width, height);
        for index in 0..width * height {
            if holds(index) {
                region.insert(index);
            }
        }
        region
    }

    /// Creates a region that contains no cells.
    pub fn empty(width: usize, height: usize) -> Self {
        let mut region = Self::default();
        region.reset(width, height);
        region
    }

    /// Creates a region of size zero with memory reserved for the given number of columns and rows.
    pub fn with_room(width: usize, height: usize) -> Self {
        Self { words: Vec::with_capacity(width.div_ceil(WORD) * height), ..Self::default() }
    }

    /// Resizes the region and removes all cells, reusing its memory.
    pub fn reset(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.words.clear();
        self.words.resize(width.div_ceil(WORD) * height, 0);
    }

    /// Copies `other` into this region, reusing its memory.
    pub fn copy_from(&mut self, other: &Self) {
        (self.width, self.height) = (other.width, other.height);
        self.words.clone_from(&other.words);
    }

    /// Returns the number of cells in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the number of cells in the rectangle.
    pub fn cells(&self) -> usize {
        self.width * self.height
    }

    /// Returns the number of words in a row.
    fn stride(&self) -> usize {
        self.width.div_ceil(WORD)
    }

    /// Returns the index of a cell, counted row by row, or `None` outside the rectangle.
    pub fn index(&self, at: [i64; 2]) -> Option<usize> {
        let is_within = (0..self.width as i64).contains(&at[0]) && (0..self.height as i64).contains(&at[1]);
        is_within.then(|| at[1] as usize * self.width + at[0] as usize)
    }

    /// Returns the column and row of a cell.
    pub fn at(&self, index: usize) -> [i64; 2] {
        [(index % self.width) as i64, (index / self.width) as i64]
    }

    /// Returns true if the region contains this cell, which may lie outside the rectangle.
    #[inline]
    pub fn holds(&self, at: [i64; 2]) -> bool {
        let (column, row) = (at[0] as usize, at[1] as usize);
        column < self.width && row < self.height && self.has(column, row)
    }

    #[inline]
    fn has(&self, column: usize, row: usize) -> bool {
        self.words[row * self.stride() + column / WORD] >> (column % WORD) & 1 == 1
    }

    /// Returns true if the region contains the cell with the given index.
    pub fn contains(&self, index: usize) -> bool {
        self.has(index % self.width, index / self.width)
    }

    /// Adds a cell.
    pub fn insert(&mut self, index: usize) {
        let (column, row) = (index % self.width, index / self.width);
        let stride = self.stride();
        self.words[row * stride + column / WORD] |= 1 << (column % WORD);
    }

    /// Adds the cells of a row whose bits are set, where the lowest bit is the cell at `column`.
    pub(crate) fn insert_bits(&mut self, column: usize, row: usize, bits: u32) {
        let stride = self.stride();
        let (word, shift) = (row * stride + column / WORD, column % WORD);
        let bits = u64::from(bits);
        self.words[word] |= bits << shift;
        if shift + 32 > WORD && bits >> (WORD - shift) > 0 {
            self.words[word + 1] |= bits >> (WORD - shift);
        }
    }

    /// Returns the number of cells in the region.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Returns the indices of the region's cells, in order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.places().map(|[column, row]| row * self.width + column)
    }

    /// Returns the columns and rows of the region's cells, in the order of their indices.
    pub fn places(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let stride = self.stride().max(1);
        self.words.iter().enumerate().filter(|(_, word)| **word != 0).flat_map(move |(k, word)| {
            let (row, first) = (k / stride, k % stride * WORD);
            bits(*word).map(move |bit| [first + bit, row])
        })
    }

    /// Returns the index of the first cell.
    pub fn first(&self) -> Option<usize> {
        self.iter().next()
    }

    /// Removes the cells of `other`, which must have the same size.
    pub fn subtract(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(word, other)| *word &= !other);
    }

    /// Returns the cells connected to `seed` through their sides. Empty if the region does not contain the
    /// seed.
    pub fn connected(&self, seed: usize) -> Self {
        let (mut rest, mut found) = (self.clone(), Self::default());
        rest.move_connected(seed, &mut found, &mut Vec::new());
        found
    }

    /// Moves the cells connected to `seed` through their sides to `found`, replacing its contents and size.
    /// `waiting` is working memory.
    pub fn move_connected(&mut self, seed: usize, found: &mut Self, waiting: &mut Vec<usize>) {
        found.reset(self.width, self.height);
        self.take_stretches(seed, waiting, |stretch| found.fill(stretch));
    }

    /// Removes the cells connected to `seed` through their sides and returns their number. `waiting` is
    /// working memory.
    pub fn take_connected(&mut self, seed: usize, waiting: &mut Vec<usize>) -> usize {
        let mut count = 0;
        self.take_stretches(seed, waiting, |stretch| count += stretch.end - stretch.first);
        count
    }

    /// Removes all cells and returns the size of the largest connected component. `waiting` is working
    /// memory.
    pub fn take_parts(&mut self, waiting: &mut Vec<usize>) -> usize {
        let (mut largest, stride) = (0, self.stride());
        for word in 0..self.words.len() {
            while self.words[word] != 0 {
                let column = word % stride * WORD + self.words[word].trailing_zeros() as usize;
                largest = largest.max(self.take_connected(word / stride * self.width + column, waiting));
            }
        }
        largest
    }

    /// Removes the cells connected to `seed`, and passes each stretch of them to `taken`.
    fn take_stretches(&mut self, seed: usize, waiting: &mut Vec<usize>, mut taken: impl FnMut(Stretch)) {
        waiting.clear();
        waiting.extend(Some(seed).filter(|seed| *seed < self.cells()));
        while let Some(index) = waiting.pop() {
            let (column, row) = (index % self.width, index / self.width);
            if !self.has(column, row) {
                continue;
            }
            let stretch = Stretch { row, first: self.first_of(column, row), end: self.end_of(column, row) };
            self.clear(stretch);
            taken(stretch);
            let beside = [row.checked_sub(1), Some(row + 1).filter(|row| *row < self.height)];
            for row in beside.into_iter().flatten() {
                self.wait_beside(Stretch { row, ..stretch }, waiting);
            }
        }
    }

    /// Adds one cell of each overlap between this stretch and the region to the waiting cells.
    fn wait_beside(&self, Stretch { row, first, end }: Stretch, waiting: &mut Vec<usize>) {
        let mut before = 0;
        for word in first / WORD..=(end - 1) / WORD {
            let held = self.words[row * self.stride() + word] & mask(word, first, end);
            let begins = held & !(held << 1 | before);
            waiting.extend(bits(begins).map(|bit| row * self.width + word * WORD + bit));
            before = held >> (WORD - 1);
        }
    }

    /// Returns the first column of the stretch that contains the given cell.
    fn first_of(&self, column: usize, row: usize) -> usize {
        let words = &self.words[row * self.stride()..][..self.stride()];
        let mut word = column / WORD;
        let mut free = !words[word] & (u64::MAX >> (WORD - 1 - column % WORD));
        while free == 0 && word > 0 {
            word -= 1;
            free = !words[word];
        }
        if free == 0 { 0 } else { (word + 1) * WORD - free.leading_zeros() as usize }
    }

    /// Returns the column after the last one of the stretch that contains the given cell.
    fn end_of(&self, column: usize, row: usize) -> usize {
        let words = &self.words[row * self.stride()..][..self.stride()];
        let mut word = column / WORD;
        let mut free = !words[word] & (u64::MAX << (column % WORD));
        while free == 0 && word + 1 < words.len() {
            word += 1;
            free = !words[word];
        }
        if free == 0 { self.width } else { word * WORD + free.trailing_zeros() as usize }
    }

    fn fill(&mut self, stretch: Stretch) {
        self.change(stretch, |word, mask| word | mask);
    }

    fn clear(&mut self, stretch: Stretch) {
        self.change(stretch, |word, mask| word & !mask);
    }

    fn change(&mut self, Stretch { row, first, end }: Stretch, to: impl Fn(u64, u64) -> u64) {
        let start = row * self.stride();
        for word in first / WORD..=(end - 1) / WORD {
            let here = &mut self.words[start + word];
            *here = to(*here, mask(word, first, end));
        }
    }

    /// Returns the cell nearest to `at` within a distance, both in cells. If several are equally near, returns the first.
    pub fn nearest(&self, at: [f64; 2], within: f64) -> Option<usize> {
        let [low, high] = [-1.0, 1.0].map(|side| [0, 1].map(|k| (at[k] + side * within).floor() as i64));
        let mut best = (None, within * within);
        for row in low[1].max(0)..=high[1].min(self.height as i64 - 1) {
            for column in low[0].max(0)..=high[0].min(self.width as i64 - 1) {
                if !self.has(column as usize, row as usize) {
                    continue;
                }
                let off = [column as f64 + 0.5 - at[0], row as f64 + 0.5 - at[1]];
                let square = off[0] * off[0] + off[1] * off[1];
                if square < best.1 || best.0.is_none() && square <= best.1 {
                    best = (Some(row as usize * self.width + column as usize), square);
                }
            }
        }
        best.0
    }

    /// Adds every cell within `radius` columns and rows of a contained one.
    pub fn grow(&mut self, radius: usize) {
        for _ in 0..radius {
            self.grow_along();
            self.grow_across();
        }
        self.clear_beside();
    }

    /// Removes every cell within `radius` columns and rows of a cell that is not in the region. Cells outside the rectangle count
    /// as part of the region.
    pub fn shrink(&mut self, radius: usize) {
        self.invert();
        self.grow(radius);
        self.invert();
    }

    /// Grows by one cell to the left and to the right. Unused bits are not cleared.
    fn grow_along(&mut self) {
        let stride = self.stride().max(1);
        for row in self.words.chunks_mut(stride) {
            let mut before = 0;
            for k in 0..row.len() {
                let (here, after) = (row[k], row.get(k + 1).copied().unwrap_or_default());
                row[k] = here | here << 1 | here >> 1 | before >> (WORD - 1) | after << (WORD - 1);
                before = here;
            }
        }
    }

    /// Grows by one cell down and up.
    fn grow_across(&mut self) {
        let stride = self.stride();
        for column in 0..stride {
            let mut before = 0;
            let mut here = self.words.get(column).copied().unwrap_or_default();
            for k in (column..self.words.len()).step_by(stride) {
                let after = self.words.get(k + stride).copied().unwrap_or_default();
                self.words[k] = before | here | after;
                (before, here) = (here, after);
            }
        }
    }

    fn invert(&mut self) {
        self.words.iter_mut().for_each(|word| *word = !*word);
        self.clear_beside();
    }

    fn clear_beside(&mut self) {
        let (stride, left) = (self.stride(), self.width % WORD);
        if left > 0 {
            self.words.iter_mut().skip(stride - 1).step_by(stride).for_each(|word| *word &= (1 << left) - 1);
        }
    }

    /// Writes the region to `coarse`, in cells that are `times` as long, where `times` is at most 64. A
    /// coarse cell is contained if all of its cells are, and a remainder at the ends is dropped.
    pub fn coarsen(&self, times: usize, coarse: &mut Self) {
        coarse.reset(self.width / times, self.height / times);
        let (stride, together) = (coarse.stride(), WORD / times);
        for row in 0..coarse.height {
            for first in (0..coarse.width).step_by(together) {
                let rows = (row * times..(row + 1) * times).map(|row| self.word_from(first * times, row));
                let held = rows.fold(u64::MAX, |held, row| held & row);
                let held = (1..times).fold(held, |whole, k| whole & held >> k);
                for k in (0..together.min(coarse.width - first)).filter(|k| held >> (k * times) & 1 == 1) {
                    let column = first + k;
                    coarse.words[row * stride + column / WORD] |= 1 << (column % WORD);
                }
            }
        }
    }

    /// Returns the next 64 bits of a row, starting at a column.
    fn word_from(&self, column: usize, row: usize) -> u64 {
        let words = &self.words[row * self.stride()..][..self.stride()];
        let (word, shift) = (column / WORD, column % WORD);
        let next = words.get(word + 1).filter(|_| shift > 0).map_or(0, |next| next << (WORD - shift));
        words[word] >> shift | next
    }

    /// Returns the cells of the outer border, counter-clockwise, beginning with the first cell of the lowest row (Moore neighbour
    /// tracing). The region is assumed to be connected. Holes are not part of the border.
    pub fn border(&self) -> Vec<[i64; 2]> {
        let Some(first) = self.first() else { return Vec::new() };
        let start = self.at(first);
        let (mut chain, mut heading) = (vec![start], 6);
        let most = 4 * self.cells() + 8;
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

/// Returns the positions of the set bits, in order.
fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        word &= word.wrapping_sub(1);
        (bit < WORD).then_some(bit)
    })
}

/// Returns a mask of those bits of a row's word whose columns are in the range from `first` up to but excluding `end`.
fn mask(word: usize, first: usize, end: usize) -> u64 {
    let low = first.saturating_sub(word * WORD).min(WORD);
    let high = end.saturating_sub(word * WORD).min(WORD);
    let below = |bit: usize| if bit < WORD { (1 << bit) - 1 } else { u64::MAX };
    below(high) & !below(low)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn drawn(rows: &[&str]) -> Region {
        let (width, height) = (rows[0].len(), rows.len());
        Region::of(width, height, |i| rows[height - 1 - i / width].as_bytes()[i % width] == b'#')
    }

    #[test]
    fn the_border_runs_counter_clockwise() {
        let region = drawn(&[".....", ".##..", ".###.", "....."]);
        assert_eq!(region.border(), [[1, 1], [2, 1], [3, 1], [2, 2], [1, 2]]);
    }

    /// The trace goes along both sides of the spur, so the cells in its middle appear twice.
    #[test]
    fn the_border_follows_both_sides_of_a_spur_one_cell_wide() {
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
        let mut coarse = Region::default();
        region.coarsen(2, &mut coarse);
        assert_eq!(coarse, drawn(&["#.", "##"]));
    }

    #[test]
    fn growing_and_shrinking_closes_gaps() {
        let frame = ".........";
        let mut region = drawn(&[frame, frame, "..##.##..", "..##.##..", frame, frame]);
        assert_eq!(region.nearest([4.4, 2.2], 3.0), region.index([3, 2]));
        assert_eq!(region.nearest([30.0, 2.2], 3.0), None);
        region.grow(1);
        region.shrink(1);
        assert_eq!(region, drawn(&[frame, frame, "..#####..", "..#####..", frame, frame]));
    }

    /// Computes an operation cell by cell. This is too simple to be wrong.
    fn plain(region: &Region, holds: impl Fn([i64; 2]) -> bool) -> Region {
        Region::of(region.width(), region.height(), |k| holds(region.at(k)))
    }

    fn near(region: &Region, at: [i64; 2], radius: i64) -> impl Iterator<Item = [i64; 2]> + '_ {
        let within = move |near: &[i64; 2]| region.index(*near).is_some();
        let side = -radius..=radius;
        side.clone().flat_map(move |y| side.clone().map(move |x| [at[0] + x, at[1] + y])).filter(within)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(3), ..ProptestConfig::default() })]

        #[test]
        fn operations_on_words_agree_with_those_on_cells(
            width in 1..150_usize, height in 1..9_usize, held in 1..8_u32, radius in 0..4_usize, times in 1..5_usize, seed: u64,
        ) {
            let mut random = seed;
            let region = Region::of(width, height, |_| {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (random >> 33) % 8 < u64::from(held)
            });
            let reach = radius as i64;
            let (mut grown, mut shrunk, mut coarse) = (region.clone(), region.clone(), Region::default());
            grown.grow(radius);
            prop_assert_eq!(&grown, &plain(&region, |at| near(&region, at, reach).any(|at| region.holds(at))));
            shrunk.shrink(radius);
            prop_assert_eq!(&shrunk, &plain(&region, |at| near(&region, at, reach).all(|at| region.holds(at))));
            region.coarsen(times, &mut coarse);
            let is_whole = |at: [i64; 2]| {
                let side = 0..times as i64;
                let cell = |x, y| [at[0] * times as i64 + x, at[1] * times as i64 + y];
                side.clone().all(|y| side.clone().all(|x| region.holds(cell(x, y))))
            };
            prop_assert_eq!(&coarse, &plain(&coarse, is_whole));
            let cells: Vec<_> = (0..region.cells()).filter(|k| region.contains(*k)).collect();
            prop_assert_eq!(region.iter().collect::<Vec<_>>(), cells.clone());
            prop_assert_eq!(region.count(), cells.len());
        }

        /// Compares connected components with those found by a flood fill from cell to cell.
        #[test]
        fn connected_components_agree_with_a_flood_fill(
            width in 1..150_usize, height in 1..9_usize, held in 4..8_u32, seed: u64, at: prop::sample::Index,
        ) {
            let mut random = seed;
            let region = Region::of(width, height, |_| {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (random >> 33) % 8 < u64::from(held)
            });
            let first = at.index(region.cells());
            let (mut reached, mut waiting) = (vec![false; region.cells()], vec![region.at(first)]);
            while let Some([x, y]) = waiting.pop() {
                let index = region.index([x, y]).filter(|index| region.contains(*index));
                if index.is_some_and(|index| !std::mem::replace(&mut reached[index], true)) {
                    waiting.extend([[x + 1, y], [x - 1, y], [x, y + 1], [x, y - 1]]);
                }
            }
            let found = region.connected(first);
            prop_assert_eq!(&found, &Region::of(width, height, |k| reached[k]));
            let (mut rest, mut waiting) = (region.clone(), Vec::new());
            prop_assert_eq!(rest.take_connected(first, &mut waiting), found.count());
            let mut without = region.clone();
            without.subtract(&found);
            prop_assert_eq!(rest, without);
            let largest = (0..region.cells()).map(|k| region.connected(k).count()).max();
            prop_assert_eq!(region.clone().take_parts(&mut waiting), largest.unwrap());
        }
    }
}
