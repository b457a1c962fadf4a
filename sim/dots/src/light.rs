//! Levels uneven light, such as a lamp on one side, a shadow across the picture, or dark corners.
//!
//! For dark dots, the ground is what remains after a morphological closing, which fills everything dark that is narrower than a
//! certain square. The square is larger than the dots. The edges of shadows stay in place. For light dots, an opening does the
//! same. Each pixel is then replaced by its contrast with the ground around it.

use image::{GrayImage, Luma};

/// Divisor that gives half the side of the square from a picture's shorter side.
const REACH: u32 = 12;
/// Minimum half side of the square, in pixels.
const LEAST_REACH: u32 = 7;
/// Level of the darkest ground that is levelled completely, as a fraction of the lightest ground. Amplifying darker ground
/// would reveal noise.
const DARKEST: f64 = 0.25;
/// Minimum level of ground that is levelled completely.
const BLACK: f64 = 8.0;
/// Minimum level of the dark ground in even light, as a fraction of the level of the light ground.
const EVEN: f64 = 0.7;
/// Fraction of the ground that counts as its darkest and as its lightest part.
const ENDS: f64 = 0.05;

/// The kind of dots in a picture, dark or light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dots {
    /// Darker than their ground.
    Dark,
    /// Lighter than their ground.
    Light,
}

/// The light on the ground of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Level that separates the darkest 5 % of the ground from the rest, from 0 to 255.
    pub darkest: u8,
    /// Level that separates the lightest 5 % of the ground from the rest, from 0 to 255.
    pub lightest: u8,
    /// Fraction of the ground that is too dark for dots to be distinguished from it.
    pub dark: f64,
}

impl Light {
    /// Returns true if the light is so even that it does not have to be levelled.
    pub fn is_even(&self) -> bool {
        f64::from(self.darkest).max(BLACK) >= EVEN * f64::from(self.lightest)
    }
}

/// Returns the light on a picture's ground, and the picture in even light.
pub fn level(picture: &GrayImage, dots: Dots) -> (Light, GrayImage) {
    let reach = (picture.width().min(picture.height()) / REACH).max(LEAST_REACH) as usize;
    let ground = ground(picture, dots, reach);
    let light = light(&ground);
    let top = f64::from(light.lightest);
    let least = (DARKEST * top).max(BLACK);
    let levelled = |x, y| {
        let ([ground], [own]) = (ground.get_pixel(x, y).0, picture.get_pixel(x, y).0);
        let contrast = (f64::from(own) - f64::from(ground)) * top / f64::from(ground).max(least);
        Luma([(top + contrast).round().clamp(0.0, 255.0) as u8])
    };
    let (width, height) = picture.dimensions();
    (light, GrayImage::from_fn(width, height, levelled))
}

fn light(ground: &GrayImage) -> Light {
    let mut histogram = [0_u64; 256];
    ground.pixels().for_each(|pixel| histogram[usize::from(pixel.0[0])] += 1);
    let all: u64 = histogram.iter().sum();
    let below = |share: f64| {
        let mut count = 0;
        let level = histogram.iter().position(|more| {
            count += more;
            count as f64 > share * all as f64
        });
        level.unwrap_or(255) as u8
    };
    let lightest = below(1.0 - ENDS);
    let dark = (0..256).filter(|level| (*level as f64).max(BLACK) < DARKEST * f64::from(lightest));
    let dark: u64 = dark.map(|level| histogram[level]).sum();
    Light { darkest: below(ENDS), lightest, dark: dark as f64 / all.max(1) as f64 }
}

/// Returns the ground. For dark dots, this is the minimum over a square of the maxima over squares, where squares extend by
/// `reach` to each side. Squares may extend beyond the edge of the picture, where pixels are ignored.
fn ground(picture: &GrayImage, dots: Dots, reach: usize) -> GrayImage {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let order: fn(u8) -> u8 = if dots == Dots::Dark { |level| level } else { |level| 255 - level };
    let mut levels = Levels { width, levels: picture.as_raw().iter().map(|&level| order(level)).collect() };
    for _ in 0..2 {
        levels = levels.lines_by(|line, out| greatest(line, reach, 2 * reach, out)).transposed();
    }
    levels.invert();
    for _ in 0..2 {
        levels = levels.lines_by(|line, out| greatest(line, reach, 0, out)).transposed();
    }
    levels.invert();
    let levels = levels.levels.into_iter().map(order).collect();
    GrayImage::from_raw(width as u32, height as u32, levels).unwrap_or_else(|| picture.clone())
}

/// The levels of a picture, row by row.
struct Levels {
    width: usize,
    levels: Vec<u8>,
}

impl Levels {
    fn lines_by(&self, mut filter: impl FnMut(&[u8], &mut Vec<u8>)) -> Self {
        let mut levels = Vec::with_capacity(self.levels.len());
        self.levels.chunks_exact(self.width).for_each(|line| filter(line, &mut levels));
        Self { width: levels.len() * self.width / self.levels.len(), levels }
    }

    fn transposed(&self) -> Self {
        let height = self.levels.len() / self.width;
        let columns = 0..self.width;
        let levels =
            columns.flat_map(|x| (0..height).map(move |y| self.levels[y * self.width + x])).collect();
        Self { width: height, levels }
    }

    fn invert(&mut self) {
        self.levels.iter_mut().for_each(|level| *level = 255 - *level);
    }
}

/// Appends the maximum of each window of `2 * reach + 1` values in a line that is extended by `beyond` values at either end.
/// Blocks are traversed from both ends (van Herk 1992), which takes linear time.
fn greatest(line: &[u8], reach: usize, beyond: usize, out: &mut Vec<u8>) {
    let window = 2 * reach + 1;
    let count = line.len() + 2 * beyond;
    let value = |at: usize| at.checked_sub(beyond).and_then(|at| line.get(at)).copied().unwrap_or(0);
    let (mut ahead, mut back) = (vec![0; count], vec![0; count]);
    for at in 0..count {
        ahead[at] = if at % window == 0 { value(at) } else { value(at).max(ahead[at - 1]) };
    }
    for at in (0..count).rev() {
        let is_last = at + 1 == count || (at + 1) % window == 0;
        back[at] = if is_last { value(at) } else { value(at).max(back[at + 1]) };
    }
    out.extend((0..(count + 1).saturating_sub(window)).map(|at| back[at].max(ahead[at + window - 1])));
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_evenly_lit_picture_is_unchanged() {
        let mut picture = GrayImage::from_pixel(120, 90, Luma([235]));
        for (x, y) in [(20, 20), (21, 20), (20, 21), (60, 50), (61, 50)] {
            picture.put_pixel(x, y, Luma([30]));
        }
        let (light, levelled) = level(&picture, Dots::Dark);
        assert!(light.is_even() && light.dark == 0.0, "{light:?}");
        assert_eq!(levelled, picture);
    }

    #[test]
    fn levelling_evens_the_ground_and_keeps_the_dots() {
        // Light from the left, and a shadow with a hard edge.
        let lit = |x: u32, y: u32| {
            let lamp = 80.0 + 150.0 * f64::from(x) / 240.0;
            if y > 100 { 0.5 * lamp } else { lamp }
        };
        let mut picture = GrayImage::from_fn(240, 180, |x, y| Luma([lit(x, y) as u8]));
        let dots = [(30, 40), (30, 150), (120, 90), (210, 30), (200, 160)];
        for (x, y) in dots.into_iter().flat_map(|(x, y)| (0..16).map(move |i| (x + i % 4, y + i / 4))) {
            picture.put_pixel(x, y, Luma([(0.1 * lit(x, y)) as u8]));
        }
        let (light, levelled) = level(&picture, Dots::Dark);
        assert!(!light.is_even(), "{light:?}");
        let is_dot = |x: u32, y: u32| {
            dots.iter().any(|dot| (dot.0..dot.0 + 4).contains(&x) && (dot.1..dot.1 + 4).contains(&y))
        };
        for (x, y, pixel) in levelled.enumerate_pixels() {
            let share = f64::from(pixel.0[0]) / f64::from(light.lightest);
            assert!(if is_dot(x, y) { share < 0.3 } else { share > 0.8 }, "({x}, {y}): {share}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_sliding_maximum_equals_a_plain_search(
            line in prop::collection::vec(any::<u8>(), 1..60), reach in 1_usize..20,
        ) {
            let mut grown = Vec::new();
            greatest(&line, reach, 2 * reach, &mut grown);
            let near = |middle: usize| line[middle.saturating_sub(2 * reach).min(line.len())..(middle + 1).min(line.len())].iter().max();
            let plain: Vec<u8> = (0..line.len() + 2 * reach).map(|at| *near(at).unwrap()).collect();
            prop_assert_eq!(&grown, &plain);
            let mut shrunk = Vec::new();
            greatest(&grown, reach, 0, &mut shrunk);
            prop_assert_eq!(shrunk.len(), line.len());
        }
    }
}
