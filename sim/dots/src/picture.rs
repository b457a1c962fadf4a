//! Finds the spots of a picture and their centroids, and draws pictures of planes.
//!
//! Dots may be darker or lighter than their ground. Uneven light is levelled first. The threshold between dots and ground is
//! that of Otsu (1979). Pixels that touch, even if only at their corners, belong to the same spot. A spot's centroid weights
//! each pixel by its contrast.

use std::fmt;

use image::{GrayImage, Luma};

use crate::camera::Camera;
use crate::error::DotsError;
use crate::light::{Dots, Light, level};

/// Maximum number of pixels of a picture.
pub const MOST_PIXELS: u64 = 64_000_000;
/// Maximum number of spots of a picture.
pub const MOST_SPOTS: usize = 20_000;
/// Minimum number of pixels of a spot. Smaller ones are dust.
const LEAST_PIXELS: usize = 3;
/// Minimum difference between the levels of dots and ground, which range from 0 to 255.
const LEAST_CONTRAST: f64 = 40.0;

/// A spot of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Column and row of the centroid, measured from the upper left corner. The centre of the first pixel is (0.5, 0.5).
    pub at: [f64; 2],
    /// Number of pixels.
    pub pixels: usize,
    /// Area of the spot relative to that of the ellipse with the same moments: 1 for a disc seen at any angle, 0.95 for a
    /// square, 0.5 for a letter.
    pub compactness: f64,
}

/// The contents of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The spots, from top to bottom.
    pub spots: Vec<Spot>,
    /// Number of rows of pixels.
    pub height: u32,
    /// The light on the ground, if it was uneven and had to be levelled.
    pub uneven: Option<Light>,
    /// Number of spots with fewer than three pixels, which are considered dust.
    pub dust: usize,
}

/// Finds the spots of a picture file.
///
/// # Errors
/// [`DotsError::Picture`] if the file cannot be decoded, [`DotsError::Size`] if it has too many pixels, [`DotsError::NoDots`]
/// or [`DotsError::TooManyDots`] if the number of spots is out of range, and [`DotsError::Light`] instead of these two if the
/// light is uneven.
pub fn read(bytes: &[u8]) -> Result<Reading, DotsError> {
    let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes))
        .with_guessed_format()
        .map_err(image::ImageError::IoError)?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(8 * MOST_PIXELS);
    reader.limits(limits);
    read_levels(&reader.decode()?.into_luma8())
}

/// Finds the spots of a decoded picture.
///
/// # Errors
/// [`DotsError::Size`], [`DotsError::NoDots`], [`DotsError::TooManyDots`] and [`DotsError::Light`], under the same conditions
/// as for [`read`].
pub fn read_levels(picture: &GrayImage) -> Result<Reading, DotsError> {
    let (width, height) = picture.dimensions();
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(DotsError::Size { limit: MOST_PIXELS, width, height });
    }
    let none = DotsError::NoDots { width, height };
    let lit = levelled(picture);
    let uneven = lit.as_ref().map(|lit| lit.light);
    let found = lit.as_ref().map_or_else(|| spots(picture), |lit| spots(&lit.picture));
    let unreadable = |found: String| match uneven {
        Some(Light { darkest, lightest, .. }) => DotsError::Light { darkest, lightest, found },
        None => none,
    };
    match found {
        Some(found) if found.spots.len() > MOST_SPOTS => Err(match uneven {
            Some(_) => unreadable(format!("{} dots are seen", found.spots.len())),
            None => DotsError::TooManyDots { limit: MOST_SPOTS, found: found.spots.len() },
        }),
        Some(Found { spots, dust }) if !spots.is_empty() => Ok(Reading { spots, height, uneven, dust }),
        _ => Err(unreadable("no dots are seen".to_owned())),
    }
}

/// A picture after levelling its light.
struct Lit {
    light: Light,
    picture: GrayImage,
}

/// Separation above which two levels are certainly those of dots and ground, however large the dots are.
const SEPARATED: f64 = 0.85;

/// Returns the picture in even light, or `None` if its light is already even.
fn levelled(picture: &GrayImage) -> Option<Lit> {
    let of = |dots: Dots| {
        let (light, picture) = level(picture, dots);
        let found = levels(&picture).filter(|found| (found.ground > found.threshold) == (dots == Dots::Dark));
        (found.map_or(1.0, |found| found.marked), Lit { light, picture })
    };
    // Dots are assumed to be dark or light, whichever leaves more of the picture to the ground.
    let (dark, light) = (of(Dots::Dark), of(Dots::Light));
    let (marked, lit) = if dark.0 <= light.0 { dark } else { light };
    let has_dots_as_it_is = || levels(picture).is_some_and(|levels| levels.separation > SEPARATED);
    (!lit.light.is_even() && (marked < 1.0 || !has_dots_as_it_is())).then_some(lit)
}

/// The spots of a picture in even light, and the number of dust specks.
struct Found {
    spots: Vec<Spot>,
    dust: usize,
}

/// Returns the spots, or `None` if the picture has only one level, or nearly so.
fn spots(picture: &GrayImage) -> Option<Found> {
    let Levels { ground, threshold, .. } = levels(picture)?;
    // Returns the contrast of a level with the ground, which is 0 for pixels on the ground's side of the threshold.
    let contrast = |level: u8| {
        let is_spot = (f64::from(level) > threshold) != (ground > threshold);
        if is_spot { (f64::from(level) - ground).abs() } else { 0.0 }
    };
    let (spots, dust) =
        components(picture, contrast).into_iter().partition::<Vec<_>, _>(|spot| spot.pixels >= LEAST_PIXELS);
    Some(Found { spots, dust: dust.len() })
}

/// The levels that separate spots from the ground.
struct Levels {
    ground: f64,
    threshold: f64,
    /// Fraction of the picture that is not ground.
    marked: f64,
    /// Fraction of the variance that lies between dots and ground: 1 for two distinct levels, 0.75 for a uniform slope between
    /// them.
    separation: f64,
}

/// Returns the levels of a picture, or `None` if it has only one level, or nearly so.
fn levels(picture: &GrayImage) -> Option<Levels> {
    let mut histogram = [0_u64; 256];
    picture.pixels().for_each(|pixel| histogram[usize::from(pixel.0[0])] += 1);
    let moments = |range: std::ops::Range<usize>| {
        let counts = range.map(|level| (level as f64, histogram[level] as f64));
        counts.fold((0.0, 0.0), |(count, sum), (level, more)| (count + more, sum + level * more))
    };
    let (count, sum) = moments(0..256);
    let off = |level: usize| histogram[level] as f64 * (level as f64 - sum / count).powi(2);
    let variance = (0..256).map(off).sum::<f64>() / count;
    let divided = (1..256).filter_map(|first| {
        let ((below, dark), (above, light)) = (moments(0..first), moments(first..256));
        let (low, high) = (dark / below, light / above);
        // There are more pixels of ground than of dots.
        let ground = if below > above { low } else { high };
        let marked = below.min(above) / (below + above);
        let between = below * above * (high - low).powi(2);
        let separation = between / (variance * (below + above).powi(2));
        let levels = Levels { ground, threshold: first as f64 - 0.5, marked, separation };
        let is_plain = high - low >= LEAST_CONTRAST;
        (below > 0.0 && above > 0.0 && is_plain).then_some((between, levels))
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
        let mut moments = Moments::default();
        seen[start] = true;
        open.push(start);
        while let Some(at) = open.pop() {
            let (x, y) = (at % width, at / width);
            moments.add([x as f64 + 0.5, y as f64 + 0.5], level(x, y));
            for (x, y) in around(x, y, width, height) {
                let next = y * width + x;
                if !seen[next] && level(x, y) > 0.0 {
                    seen[next] = true;
                    open.push(next);
                }
            }
        }
        spots.push(moments.spot());
    }
    spots
}

/// Sums over the pixels of a spot.
#[derive(Default)]
struct Moments {
    weight: f64,
    weighted: [f64; 2],
    pixels: f64,
    sum: [f64; 2],
    /// Sums of x², y² and xy.
    squares: [f64; 3],
}

impl Moments {
    fn add(&mut self, [x, y]: [f64; 2], weight: f64) {
        self.weight += weight;
        self.weighted = [self.weighted[0] + weight * x, self.weighted[1] + weight * y];
        self.pixels += 1.0;
        self.sum = [self.sum[0] + x, self.sum[1] + y];
        let [xx, yy, xy] = self.squares;
        self.squares = [xx + x * x, yy + y * y, xy + x * y];
    }

    fn spot(&self) -> Spot {
        let n = self.pixels;
        let [x, y] = self.sum.map(|sum| sum / n);
        // Each pixel is a square, which has its own moments.
        let [xx, yy] = [self.squares[0] / n - x * x, self.squares[1] / n - y * y].map(|own| own + 1.0 / 12.0);
        let xy = self.squares[2] / n - x * y;
        let ellipse = 4.0 * std::f64::consts::PI * (xx * yy - xy * xy).max(0.0).sqrt();
        let at = self.weighted.map(|sum| sum / self.weight);
        Spot { at, pixels: n as usize, compactness: n / ellipse.max(f64::MIN_POSITIVE) }
    }
}

/// Describes the light that was levelled, for people.
impl fmt::Display for Light {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { darkest, lightest, dark } = self;
        write!(
            f,
            "the light is uneven, its ground goes from {darkest} to {lightest} of 255, and was levelled"
        )?;
        if *dark >= 0.005 {
            write!(f, "; {:.0} % of the picture is too dark for dots to be seen", 100.0 * dark)?;
        }
        Ok(())
    }
}

fn around(x: usize, y: usize, width: usize, height: usize) -> impl Iterator<Item = (usize, usize)> {
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| (x, y)))
}

/// Draws the picture that a camera sees of a plane with dark dots of the given radius. Each pixel is averaged from 5 × 5 samples.
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
        let found = read_levels(&draw([800, 600], &camera(), &dots, 0.01)).unwrap().spots;
        assert_eq!(found.len(), 3);
        for dot in dots {
            let nearest = found.iter().map(|spot| camera().place(spot.at).unwrap());
            let off = nearest.map(|at| (at[0] - dot[0]).hypot(at[1] - dot[1])).fold(f64::MAX, f64::min);
            assert!(off < 5e-4, "{off}");
        }
    }

    #[test]
    fn light_dots_on_dark_ground_are_found_without_dust() {
        let mut picture = draw([800, 600], &camera(), &[[0.2, 0.3], [0.8, 0.9]], 0.01);
        picture.put_pixel(5, 5, Luma([0]));
        image::imageops::invert(&mut picture);
        let reading = read_levels(&picture).unwrap();
        assert_eq!((reading.spots.len(), reading.dust, reading.uneven), (2, 1, None));
    }

    #[test]
    fn a_picture_without_dots_is_rejected() {
        let plain = GrayImage::from_pixel(80, 60, Luma([200]));
        let error = read_levels(&plain).unwrap_err().to_string();
        assert_eq!(error, "expected dots on a plain ground, found none in 80 × 60 pixels");
        let faint = GrayImage::from_fn(80, 60, |x, _| Luma([if x < 4 { 190 } else { 200 }]));
        assert!(read_levels(&faint).is_err());
        assert!(matches!(read(b"no picture"), Err(DotsError::Picture(_))));
    }

    /// Draws twenty dots under uneven light, and reads them. `light` is the brightness at a point of the picture.
    fn lit(light: impl Fn(f64, f64) -> f64, is_light_on_dark: bool) -> Result<Reading, DotsError> {
        let dots: Vec<_> =
            (0..20).map(|i| [0.1 + 0.2 * f64::from(i % 5), 0.1 + 0.25 * f64::from(i / 5)]).collect();
        let mut picture = draw([800, 600], &camera(), &dots, 0.01);
        if is_light_on_dark {
            image::imageops::invert(&mut picture);
        }
        picture.enumerate_pixels_mut().for_each(|(x, y, pixel)| {
            let share = light(f64::from(x) / 800.0, f64::from(y) / 600.0);
            pixel.0[0] = (f64::from(pixel.0[0]) * share) as u8;
        });
        let reading = read_levels(&picture)?;
        assert_eq!(reading.spots.len(), 20, "{:?}", reading.uneven);
        for dot in dots {
            let nearest = reading.spots.iter().map(|spot| camera().place(spot.at).unwrap());
            let off = nearest.map(|at| (at[0] - dot[0]).hypot(at[1] - dot[1])).fold(f64::MAX, f64::min);
            // The edge of a shadow across a dot moves its centroid by a pixel.
            assert!(off < 2e-3, "{off}");
        }
        Ok(reading)
    }

    #[test]
    fn dots_are_found_under_a_lamp_and_in_shadows() {
        let lamps: [fn(f64, f64) -> f64; 7] = [
            |x, _| 0.3 + 0.7 * x,
            |x, _| 1.0 - 0.7 * x,
            |_, y| 0.25 + 0.75 * y,
            |x, y| 1.0 - 0.35 * (x + y),
            |x, y| 1.0 - 1.3 * ((x - 0.5).powi(2) + (y - 0.5).powi(2)),
            |x, _| if x < 0.4 { 0.4 } else { 1.0 },
            |x, y| if x + y < 0.9 { 0.45 } else { 0.8 + 0.2 * y },
        ];
        for (number, lamp) in lamps.into_iter().enumerate() {
            let reading = lit(lamp, false).unwrap();
            let light = reading.uneven.unwrap_or_else(|| panic!("lamp {number}: even"));
            assert!(light.to_string().starts_with("the light is uneven"), "{light}");
            lit(lamp, true).unwrap();
        }
        assert_eq!(lit(|_, _| 1.0, false).unwrap().uneven, None);
    }

    #[test]
    fn a_partly_dark_picture_is_reported() {
        let mut picture = draw([800, 600], &camera(), &[[0.3, 0.3], [0.9, 0.3], [0.7, 0.7]], 0.01);
        let darken = |picture: &mut GrayImage| {
            picture
                .enumerate_pixels_mut()
                .filter(|(x, ..)| *x < 300)
                .for_each(|(_, _, pixel)| pixel.0[0] /= 25);
        };
        darken(&mut picture);
        let reading = read_levels(&picture).unwrap();
        assert_eq!(reading.spots.len(), 2);
        let words = reading.uneven.unwrap().to_string();
        assert!(words.ends_with("; 38 % of the picture is too dark for dots to be seen"), "{words}");
        let mut faint = GrayImage::from_fn(800, 600, |x, _| Luma([(60 + x / 5) as u8]));
        faint
            .enumerate_pixels_mut()
            .filter(|(x, y, _)| x % 90 < 5 && y % 90 < 5)
            .for_each(|(_, _, pixel)| pixel.0[0] -= 6);
        let error = read_levels(&faint).unwrap_err().to_string();
        assert!(error.starts_with("expected even light, found a ground from "), "{error}");
        assert!(error.contains("no dots are seen: photograph it in even light"), "{error}");
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..400)) {
            let _ = read(&bytes);
        }
    }
}
