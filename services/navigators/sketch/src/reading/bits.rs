//! A mask with one bit per pixel, so that a disc can be rolled over 64 pixels at once.

use image::GrayImage;

/// Pixels per word.
const WORD: usize = u64::BITS as usize;

/// A mask stored as rows of bits. Each row begins at the first bit of a word; the bits after its last pixel are meaningless.
pub(crate) struct Bits {
    width: usize,
    /// Words per row.
    stride: usize,
    words: Vec<u64>,
}

/// Returns how far a disc reaches to either side in each row, from its middle outwards, in pixels.
pub(crate) fn disc(radius: f64) -> Vec<usize> {
    let is_within = |dx: usize, dy: usize| (dx * dx + dy * dy) as f64 <= radius * radius;
    (0..).map_while(|dy| (0..).take_while(|&dx| is_within(dx, dy)).last()).collect()
}

impl Bits {
    /// Creates a mask of the pixels that are not zero.
    pub fn of(mask: &GrayImage) -> Self {
        let width = mask.width() as usize;
        let word = |pixels: &[u8]| pixels.iter().rev().fold(0, |word, &v| word << 1 | u64::from(v > 0));
        let words = mask.chunks_exact(width).flat_map(|row| row.chunks(WORD)).map(word).collect();
        Self { width, stride: width.div_ceil(WORD), words }
    }

    /// Converts the mask to a picture of 0 and 255.
    pub fn into_mask(self) -> GrayImage {
        let height = self.words.len() / self.stride;
        let mut mask = GrayImage::new(self.width as u32, height as u32);
        let rows = mask.chunks_exact_mut(self.width).flat_map(|row| row.chunks_mut(WORD));
        for (pixels, word) in rows.zip(&self.words) {
            pixels.iter_mut().enumerate().for_each(|(k, v)| *v = if word >> k & 1 > 0 { 255 } else { 0 });
        }
        mask
    }

    /// Inverts the mask within the page.
    pub fn inverted(mut self) -> Self {
        let behind = self.stride * WORD - self.width;
        for row in self.words.chunks_exact_mut(self.stride) {
            row.iter_mut().for_each(|word| *word = !*word);
            row[self.stride - 1] &= u64::MAX >> behind;
        }
        self
    }

    /// Returns a mask of all pixels covered by a [`disc`] around any pixel of this mask.
    pub fn dilated(&self, disc: &[usize]) -> Self {
        let mut grown = vec![0; self.words.len()];
        let height = self.words.len() / self.stride;
        let mut spread = vec![0; self.stride];
        for (y, row) in self.words.chunks_exact(self.stride).enumerate() {
            if row.iter().all(|&word| word == 0) {
                continue;
            }
            spread.copy_from_slice(row);
            let mut reach = 0;
            // From the edge of the disc to its middle, rows only get longer, so `spread` can be widened further instead of
            // starting over.
            for (dy, &half) in disc.iter().enumerate().rev() {
                (reach..half).for_each(|_| widen(&mut spread));
                reach = half;
                for to in [y.checked_sub(dy), (y + dy < height).then_some(y + dy)].into_iter().flatten() {
                    let to = &mut grown[to * self.stride..][..self.stride];
                    to.iter_mut().zip(&spread).for_each(|(to, from)| *to |= from);
                }
            }
        }
        Self { words: grown, ..*self }
    }
}

/// Spreads the bits of a row by one to either side.
fn widen(row: &mut [u64]) {
    let mut before = 0;
    for i in 0..row.len() {
        let (here, after) = (row[i], row.get(i + 1).copied().unwrap_or(0));
        row[i] = here | here << 1 | here >> 1 | before >> (WORD - 1) | after << (WORD - 1);
        before = here;
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_disc_covers_what_is_no_farther_than_its_radius(
            bits in prop::collection::vec(prop::bool::weighted(0.02), 1500), width in 1_u32..150, radius in 0.0..9.0,
        ) {
            let height = 1500 / width;
            let mask = GrayImage::from_fn(width, height, |x, y| {
                Luma([if bits[(y * width + x) as usize] { 255 } else { 0 }])
            });
            let found = Bits::of(&mask).dilated(&disc(radius)).inverted().inverted().into_mask();
            let near = |x: u32, y: u32| mask.enumerate_pixels().any(|(u, v, pixel)| {
                let (dx, dy) = (f64::from(x.abs_diff(u)), f64::from(y.abs_diff(v)));
                pixel.0[0] > 0 && dx * dx + dy * dy <= radius * radius
            });
            prop_assert!(found.enumerate_pixels().all(|(x, y, pixel)| (pixel.0[0] == 255) == near(x, y)));
        }
    }
}
