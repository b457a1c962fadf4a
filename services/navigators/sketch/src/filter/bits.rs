//! Cells stored as bits, 64 to a word, so that whole words can be processed at once.

use std::ops::Range;

const WORD: usize = u64::BITS as usize;

/// Rows of bits. Each row starts at the first bit of a word, and the bits after its last cell are meaningless.
#[derive(Debug, Clone)]
pub struct Bits {
    width: usize,
    /// Number of words per row.
    stride: usize,
    words: Vec<u64>,
}

impl Bits {
    /// Creates bits from cells in rows of `width`, surrounded by a frame of `margin` cells that are not set.
    pub fn framed(cells: &[bool], width: usize, margin: usize) -> Self {
        let framed = width + 2 * margin;
        let (stride, height) = (framed.div_ceil(WORD), cells.len() / width + 2 * margin);
        let mut bits = Self { width: framed, stride, words: vec![0; stride * height] };
        for (row, cells) in cells.chunks_exact(width).enumerate() {
            let words = &mut bits.words[(row + margin) * stride..][..stride];
            for (k, eight) in cells.chunks(8).enumerate() {
                let (at, byte) = (margin + 8 * k, packed(eight));
                words[at / WORD] |= byte << (at % WORD);
                if at % WORD > WORD - 8 && byte >> (WORD - at % WORD) > 0 {
                    words[at / WORD + 1] |= byte >> (WORD - at % WORD);
                }
            }
        }
        bits
    }

    /// Returns bits of the same size, of which none is set.
    pub fn blank(&self) -> Self {
        Self { words: vec![0; self.words.len()], ..*self }
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.words.len() / self.stride
    }

    /// Returns the cells inside a frame of `margin` cells, row by row.
    pub fn inner(&self, margin: usize) -> Vec<bool> {
        let width = self.width - 2 * margin;
        let mut cells = vec![false; width * (self.height() - 2 * margin)];
        for (row, cells) in cells.chunks_exact_mut(width).enumerate() {
            let words = &self.words[(row + margin) * self.stride..][..self.stride];
            for (k, cells) in cells.chunks_mut(WORD).enumerate() {
                let at = margin + k * WORD;
                let next = words.get(at / WORD + 1).map_or(0, |next| next << 1 << (WORD - 1 - at % WORD));
                let word = words[at / WORD] >> (at % WORD) | next;
                cells.iter_mut().enumerate().for_each(|(i, cell)| *cell = word >> i & 1 > 0);
            }
        }
        cells
    }

    /// Sets the cells of a row in these columns.
    pub fn fill(&mut self, row: usize, columns: Range<usize>) {
        let words = &mut self.words[row * self.stride..][..self.stride];
        for (k, word) in
            words.iter_mut().enumerate().take(columns.end.div_ceil(WORD)).skip(columns.start / WORD)
        {
            let from = columns.start.saturating_sub(k * WORD);
            let behind = ((k + 1) * WORD).saturating_sub(columns.end);
            *word |= u64::MAX << from & u64::MAX >> behind;
        }
    }

    /// Returns the ranges of columns in which a row is not set.
    pub fn free(&self, row: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let words = &self.words[row * self.stride..][..self.stride];
        let mut end = 0;
        std::iter::from_fn(move || {
            let start = next(words, end, u64::MAX);
            end = next(words, start, 0).min(self.width);
            (start < self.width).then_some(start..end)
        })
    }

    /// Sets every cell within `reach` columns and rows of one that is set.
    pub fn spread(mut self, reach: usize) -> Self {
        for row in self.words.chunks_exact_mut(self.stride) {
            let mut down = row.to_vec();
            doubling(reach, |step| shift_up(row, step));
            doubling(reach, |step| shift_down(&mut down, step));
            row.iter_mut().zip(down).for_each(|(word, down)| *word |= down);
        }
        let mut down = self.words.clone();
        doubling(reach, |step| rows_up(&mut self.words, self.stride, step));
        doubling(reach, |step| rows_down(&mut down, self.stride, step));
        self.words.iter_mut().zip(down).for_each(|(word, down)| *word |= down);
        self
    }
}

/// Packs up to eight cells into bits, the first cell into the lowest bit.
fn packed(cells: &[bool]) -> u64 {
    let Ok(eight) = <[bool; 8]>::try_from(cells) else {
        return cells.iter().rev().fold(0, |bits, &cell| bits << 1 | u64::from(cell));
    };
    // The factor has one bit for each byte, which shifts the lowest bit of byte k to bit 56 + k.
    u64::from_le_bytes(eight.map(u8::from)).wrapping_mul(0x0102_0408_1020_4080) >> 56
}

/// Returns the first cell from `from` on whose bit differs from those of `skipped`, or a cell past the end if there is none.
fn next(words: &[u64], from: usize, skipped: u64) -> usize {
    let first = u64::MAX << (from % WORD);
    for (k, word) in words.iter().enumerate().skip(from / WORD) {
        let found = (word ^ skipped) & if k == from / WORD { first } else { u64::MAX };
        if found > 0 {
            return k * WORD + found.trailing_zeros() as usize;
        }
    }
    words.len() * WORD
}

/// Calls `smear` with a sequence of steps. If a set is merged with a copy of itself shifted by each step in turn, it spreads by
/// `reach` cells in total.
fn doubling(reach: usize, mut smear: impl FnMut(usize)) {
    let mut covered = 1;
    while covered <= reach {
        let step = covered.min(reach + 1 - covered);
        smear(step);
        covered += step;
    }
}

fn shift_up(row: &mut [u64], step: usize) {
    let (words, bits) = (step / WORD, step % WORD);
    for i in (words..row.len()).rev() {
        let below = if i > words { row[i - words - 1] >> 1 >> (WORD - 1 - bits) } else { 0 };
        row[i] |= row[i - words] << bits | below;
    }
}

fn shift_down(row: &mut [u64], step: usize) {
    let (words, bits) = (step / WORD, step % WORD);
    for i in 0..row.len().saturating_sub(words) {
        let above = row.get(i + words + 1).map_or(0, |above| above << 1 << (WORD - 1 - bits));
        row[i] |= row[i + words] >> bits | above;
    }
}

fn rows_up(words: &mut [u64], stride: usize, step: usize) {
    for row in (step..words.len() / stride).rev() {
        let (below, here) = words.split_at_mut(row * stride);
        join(&mut here[..stride], &below[(row - step) * stride..][..stride]);
    }
}

fn rows_down(words: &mut [u64], stride: usize, step: usize) {
    for row in step..words.len() / stride {
        let (here, above) = words.split_at_mut(row * stride);
        join(&mut here[(row - step) * stride..][..stride], &above[..stride]);
    }
}

fn join(row: &mut [u64], with: &[u64]) {
    row.iter_mut().zip(with).for_each(|(word, with)| *word |= with);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_is_set_spreads_to_all_sides(
            cells in prop::collection::vec(prop::bool::weighted(0.01), 2000),
            width in 1usize..200, margin in 0usize..70, reach in 0usize..70,
        ) {
            let height = 2000 / width;
            let cells = &cells[..width * height];
            let bits = Bits::framed(cells, width, margin);
            prop_assert_eq!(&bits.inner(margin), cells);
            let near = |at: usize| (0..cells.len()).any(|other| {
                let away = (at % width).abs_diff(other % width).max((at / width).abs_diff(other / width));
                cells[other] && away <= reach
            });
            let expected: Vec<bool> = (0..cells.len()).map(near).collect();
            prop_assert_eq!(bits.spread(reach).inner(margin), expected);
        }

        #[test]
        fn free_stretches_are_what_is_not_set(
            cells in prop::collection::vec(prop::bool::weighted(0.3), 1..300), margin in 0usize..70,
        ) {
            let bits = Bits::framed(&cells, cells.len(), margin);
            let mut found = Bits::framed(&vec![false; cells.len()], cells.len(), margin);
            bits.free(margin).for_each(|stretch| found.fill(margin, stretch));
            let free: Vec<bool> = cells.iter().map(|cell| !cell).collect();
            prop_assert_eq!(found.inner(margin), free);
        }
    }
}
