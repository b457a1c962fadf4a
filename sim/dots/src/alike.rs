//! Distinguishes the dots of a picture from other spots, such as a frame, a logo or dirt.
//!
//! All dots look alike. A spot that covers far more or far less of the plane than a typical one is not a dot,
//! and neither is a spot with a different shape. Two or three dots that touch still count as one spot.

use std::fmt;

use crate::picture::Spot;

/// Minimum ratio of the sizes of a typical dot and of a spot that is too large or too small to be one.
const FAR: f64 = 6.0;
/// Minimum compactness of a dot, relative to the typical one.
const LEAST_COMPACTNESS: f64 = 0.7;
/// Minimum number of pixels of a spot for its shape to be meaningful.
const SHAPED_PIXELS: usize = 30;

/// Why a spot is not a dot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unlike {
    /// The spot is far larger than the others.
    Larger,
    /// The spot is far smaller than the others.
    Smaller,
    /// The spot has a different shape.
    Shape,
}

/// A spot that is not a dot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odd {
    /// The spot.
    pub spot: Spot,
    /// Why the spot is not a dot.
    pub why: Unlike,
    /// Size of the spot, relative to the typical one.
    pub sizes: f64,
}

impl fmt::Display for Odd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { spot: Spot { at: [x, y], .. }, why, sizes } = self;
        write!(f, "one around pixel ({x:.0}, {y:.0}) ")?;
        match why {
            Unlike::Larger => write!(f, "is {sizes:.0} times as large as the others"),
            Unlike::Smaller => write!(f, "has {:.0} % of the size of the others", 100.0 * sizes),
            Unlike::Shape => write!(f, "has another shape than the others"),
        }
    }
}

/// Separates dots from other spots. `area` returns the area of the plane that a pixel covers at a point of the picture, in any
/// unit.
pub fn alike(spots: Vec<Spot>, area: impl Fn([f64; 2]) -> f64) -> (Vec<Spot>, Vec<Odd>) {
    let size = |spot: &Spot| spot.pixels as f64 * area(spot.at);
    let (usual, compact) =
        (median(spots.iter().map(size)), median(spots.iter().map(|spot| spot.compactness)));
    let (mut dots, mut odd) = (Vec::with_capacity(spots.len()), Vec::new());
    for spot in spots {
        let sizes = size(&spot) / usual;
        let has_shape = spot.pixels < SHAPED_PIXELS || spot.compactness >= LEAST_COMPACTNESS * compact;
        let why = if sizes > FAR {
            Unlike::Larger
        } else if sizes * FAR < 1.0 {
            Unlike::Smaller
        } else if !has_shape {
            Unlike::Shape
        } else {
            dots.push(spot);
            continue;
        };
        odd.push(Odd { spot, why, sizes });
    }
    (dots, odd)
}

/// Returns the median. For an even number of values, this is the lower of the two in the middle.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::*;
    use crate::camera::{Camera, Known};
    use crate::picture::{draw, read_levels};

    fn camera() -> Camera {
        let known = |pixel, place| Known { pixel, place };
        Camera::calibrated(&[
            known([40.0, 560.0], [0.0, 0.0]),
            known([760.0, 560.0], [1.0, 0.0]),
            known([560.0, 60.0], [1.0, 1.0]),
            known([240.0, 60.0], [0.0, 1.0]),
        ])
        .unwrap()
    }

    fn dots() -> Vec<[f64; 2]> {
        let at = |i: usize| [0.1 + 0.2 * (i % 5) as f64, 0.06 + 0.2 * (i / 5) as f64];
        (0..25).map(at).collect()
    }

    fn picture() -> GrayImage {
        draw([800, 600], &camera(), &dots(), 0.012)
    }

    fn sorted(picture: &GrayImage) -> (Vec<Spot>, Vec<Odd>) {
        alike(read_levels(picture).unwrap().spots, |at| camera().area(at).unwrap_or(1.0))
    }

    fn fill(picture: &mut GrayImage, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) {
        rows.for_each(|y| columns.clone().for_each(|x| picture.put_pixel(x, y, Luma([20]))));
    }

    #[test]
    fn a_frame_is_not_a_dot() {
        let mut picture = picture();
        for (columns, rows) in [(0..800, 0..6), (0..800, 594..600), (0..6, 0..600), (794..800, 0..600)] {
            fill(&mut picture, columns, rows);
        }
        let (dots, odd) = sorted(&picture);
        assert_eq!((dots.len(), odd.len(), odd[0].why), (25, 1, Unlike::Larger));
        assert!(odd[0].to_string().contains("times as large as the others"), "{}", odd[0]);
    }

    #[test]
    fn letters_and_dirt_are_not_dots_and_touching_dots_are_one() {
        let mut picture = picture();
        // An L with strokes of 3 pixels, a speck, and something the size of a dot that touches a dot.
        fill(&mut picture, 20..23, 20..44);
        fill(&mut picture, 23..38, 41..44);
        fill(&mut picture, 770..772, 580..582);
        let [x, y] = camera().pixel(dots()[12]).unwrap();
        fill(&mut picture, x as u32 + 4..x as u32 + 14, y as u32 - 4..y as u32 + 4);
        let (dots, odd) = sorted(&picture);
        let why: Vec<_> = odd.iter().map(|odd| odd.why).collect();
        assert_eq!((dots.len(), why), (25, vec![Unlike::Shape, Unlike::Smaller]), "{odd:?}");
    }

    /// The nearest dots cover seven times as many pixels as the most distant ones.
    #[test]
    fn near_and_far_dots_are_alike_on_the_plane() {
        let found = read_levels(&picture()).unwrap().spots;
        let pixels = || found.iter().map(|spot| spot.pixels);
        assert!(pixels().max().unwrap() > 6 * pixels().min().unwrap());
        assert_eq!(sorted(&picture()).1, []);
    }

    #[test]
    fn without_spots_there_are_no_dots() {
        assert_eq!(alike(Vec::new(), |_| 1.0), (Vec::new(), Vec::new()));
    }
}
