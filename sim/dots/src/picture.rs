//! Pictures of planes: the centroids of their spots, and pictures to be made.
//!
//! Dots are darker than their ground, or lighter. The threshold between them is Otsu's (1979). Pixels that touch, corners
//! included, are one spot. Its centroid weights each pixel by its contrast.

use image::{GrayImage, Luma};

use crate::camera::Camera;
use crate::error::DotsError;

/// Most pixels of a picture.
pub const MOST_PIXELS: u64 = 64_000_000;
/// Most spots of a picture.
pub const MOST_SPOTS: usize = 20_000;
/// Spots of fewer pixels are dust.
const LEAST_PIXELS: usize = 3;
/// The least difference between dots and ground, of 255.
const LEAST_CONTRAST: f64 = 40.0;

/// A spot of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Its centroid: column and row from the upper left corner, where the middle of the first pixel is (0.5, 0.5).
    pub at: [f64; 2],
    /// How many pixels it has.
    pub pixels: usize,
}

/// The spots of a picture file, from its top to its bottom, and how many rows of pixels it has.
///
/// # Errors
/// [`DotsError::Picture`], [`DotsError::Size`], [`DotsError::NoDots`], [`DotsError::TooManyDots`].
pub fn read(bytes: &[u8]) -> Result<(Vec<Spot>, u32), DotsError> {
    let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes))
        .with_guessed_format()
        .map_err(image::ImageError::IoError)?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(8 * MOST_PIXELS);
    reader.limits(limits);
    let picture = reader.decode()?.into_luma8();
    Ok((spots(&picture)?, picture.height()))
}

/// The spots of a picture.
///
/// # Errors
/// As [`read`].
pub fn spots(picture: &GrayImage) -> Result<Vec<Spot>, DotsError> {
    let (width, height) = picture.dimensions();
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(DotsError::Size { limit: MOST_PIXELS, width, height });
    }
    let none = DotsError::NoDots { width, height };
    let Some(Levels { ground, threshold }) = levels(picture) else { return Err(none) };
    // Contrast against the ground; pixels on the ground's side of the threshold have none.
    let contrast = |level: u8| {
        let is_spot = (f64::from(level) > threshold) != (ground > threshold);
        if is_spot { (f64::from(level) - ground).abs() } else { 0.0 }
    };
    let found = components(picture, contrast);
    match found.len() {
        0 => Err(none),
        found if found > MOST_SPOTS => Err(DotsError::TooManyDots { limit: MOST_SPOTS, found }),
        _ => Ok(found),
    }
}

/// What divides spots from their ground.
struct Levels {
    ground: f64,
    threshold: f64,
}

/// None where the picture has one level, or nearly so.
fn levels(picture: &GrayImage) -> Option<Levels> {
    let mut histogram = [0_u64; 256];
    picture.pixels().for_each(|pixel| histogram[usize::from(pixel.0[0])] += 1);
    let moments = |range: std::ops::Range<usize>| {
        let counts = range.map(|level| (level as f64, histogram[level] as f64));
        counts.fold((0.0, 0.0), |(count, sum), (level, more)| (count + more, sum + level * more))
    };
    let divided = (1..256).filter_map(|first| {
        let ((below, dark), (above, light)) = (moments(0..first), moments(first..256));
        let (low, high) = (dark / below, light / above);
        // The ground has more pixels than the dots.
        let ground = if below > above { low } else { high };
        let levels = Levels { ground, threshold: first as f64 - 0.5 };
        let is_plain = high - low >= LEAST_CONTRAST;
        (below > 0.0 && above > 0.0 && is_plain).then(|| (below * above * (high - low).powi(2), levels))
    });
    divided.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, levels)| levels)
}

fn components(picture: &GrayImage, contrast: impl Fn(u8) -> f64) -> Vec<Spot> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let level = |x: usize, y: usize| contrast(picture.get_pixel(x as u32, y as u32).0[0]);
    let mut seen = vec![false; width * height];
    let (mut spots, mut open) = (Vec::new(), Vec::new());
    for start in 0..width * height {
        if seen[start] || level(start % width, start / width) == 0.0 {
            continue;
        }
        let (mut weight, mut sum, mut pixels) = (0.0, [0.0; 2], 0);
        seen[start] = true;
        open.push(start);
        while let Some(at) = open.pop() {
            let (x, y) = (at % width, at / width);
            let own = level(x, y);
            weight += own;
            sum = [sum[0] + own * (x as f64 + 0.5), sum[1] + own * (y as f64 + 0.5)];
            pixels += 1;
            for (x, y) in around(x, y, width, height) {
                let next = y * width + x;
                if !seen[next] && level(x, y) > 0.0 {
                    seen[next] = true;
                    open.push(next);
                }
            }
        }
        if pixels >= LEAST_PIXELS {
            spots.push(Spot { at: sum.map(|sum| sum / weight), pixels });
        }
    }
    spots
}

fn around(x: usize, y: usize, width: usize, height: usize) -> impl Iterator<Item = (usize, usize)> {
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| (x, y)))
}

/// A picture of a plane with dark dots of this radius, as a camera sees it. Each pixel has five by five samples.
pub fn draw(size: [u32; 2], camera: &Camera, dots: &[[f64; 2]], radius: f64) -> GrayImage {
    const SAMPLES: i32 = 5;
    let mut picture = GrayImage::from_pixel(size[0], size[1], Luma([235]));
    for &dot in dots {
        let rim = [[radius, 0.0], [-radius, 0.0], [0.0, radius], [0.0, -radius]];
        let seen = rim.iter().filter_map(|[x, y]| camera.pixel([dot[0] + 1.5 * x, dot[1] + 1.5 * y]));
        let (low, high) = seen.fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), at| {
            ([0, 1].map(|i| at[i].min(low[i])), [0, 1].map(|i| at[i].max(high[i])))
        });
        let range = |axis: usize| {
            (low[axis].floor().max(0.0) as u32)..((high[axis].ceil().max(0.0) as u32).min(size[axis]))
        };
        for (x, y) in range(1).flat_map(|y| range(0).map(move |x| (x, y))) {
            let covers = |i: i32, j: i32| {
                let sample = |at: u32, k: i32| f64::from(at) + (f64::from(k) + 0.5) / f64::from(SAMPLES);
                let place = camera.place([sample(x, i), sample(y, j)]);
                place.is_ok_and(|[px, py]| (px - dot[0]).hypot(py - dot[1]) <= radius)
            };
            let samples = (0..SAMPLES).flat_map(|j| (0..SAMPLES).map(move |i| (i, j)));
            let covered = samples.filter(|&(i, j)| covers(i, j)).count() as u32;
            let pixel = &mut picture.get_pixel_mut(x, y).0[0];
            *pixel = pixel.saturating_sub((covered * 210 / (SAMPLES * SAMPLES) as u32) as u8);
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Known;

    fn camera() -> Camera {
        let known = |pixel, place| Known { pixel, place };
        Camera::calibrated(&[
            known([40.0, 560.0], [0.0, 0.0]),
            known([760.0, 560.0], [1.0, 0.0]),
            known([640.0, 60.0], [1.0, 1.0]),
            known([160.0, 60.0], [0.0, 1.0]),
        ])
        .unwrap()
    }

    #[test]
    fn spots_lie_where_the_camera_sees_the_dots() {
        let dots = [[0.2, 0.3], [0.8, 0.9], [0.5, 0.52]];
        let found = spots(&draw([800, 600], &camera(), &dots, 0.01)).unwrap();
        assert_eq!(found.len(), 3);
        for dot in dots {
            let nearest = found.iter().map(|spot| camera().place(spot.at).unwrap());
            let off = nearest.map(|at| (at[0] - dot[0]).hypot(at[1] - dot[1])).fold(f64::MAX, f64::min);
            assert!(off < 5e-4, "{off}");
        }
    }

    #[test]
    fn light_dots_on_a_dark_ground_are_found_and_dust_is_not() {
        let mut picture = draw([800, 600], &camera(), &[[0.2, 0.3], [0.8, 0.9]], 0.01);
        picture.put_pixel(5, 5, Luma([0]));
        image::imageops::invert(&mut picture);
        assert_eq!(spots(&picture).unwrap().len(), 2);
    }

    #[test]
    fn a_picture_without_dots_is_rejected() {
        let plain = GrayImage::from_pixel(80, 60, Luma([200]));
        let error = spots(&plain).unwrap_err().to_string();
        assert_eq!(error, "expected dots on a plain ground, found none in 80 × 60 pixels");
        let faint = GrayImage::from_fn(80, 60, |x, _| Luma([if x < 4 { 190 } else { 200 }]));
        assert!(spots(&faint).is_err());
        assert!(matches!(read(b"no picture"), Err(DotsError::Picture(_))));
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..400)) {
            let _ = read(&bytes);
        }
    }
}
