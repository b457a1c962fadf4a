//! The pen: how wide its strokes are, and what a person with that pen did not mean to draw.
//!
//! A gap narrower than the stroke is a slip of the hand, not a door: a morphological closing with a
//! disc as wide as the stroke fills it. Distances are exact and Euclidean.

use image::imageops::{crop_imm, replace};
use image::{GrayImage, ImageBuffer, Luma};
use imageproc::distance_transform::euclidean_squared_distance_transform;
use imageproc::region_labelling::{Connectivity, connected_components};

/// Squared distances, pixels².
type Distances = ImageBuffer<Luma<f64>, Vec<f64>>;

/// Width of the strokes in a mask, pixels: twice the median distance from a ridge of the distance
/// transform to the paper, within a pixel. `None` where the mask is empty or full.
pub(crate) fn stroke_width(mask: &GrayImage) -> Option<f64> {
    let depth = squared_depths(mask)?;
    let mut ridges = ridge_depths(&depth, mask.width() as usize);
    if ridges.is_empty() {
        return None;
    }
    let middle = ridges.len() / 2;
    let (_, median, _) = ridges.select_nth_unstable_by(middle, f64::total_cmp);
    Some(2.0 * median.sqrt() - 1.0)
}

/// The share of a mask's pixels that are farther than `depth_px` from its edge; 0 for an empty one.
pub(crate) fn share_deeper(mask: &GrayImage, depth_px: f64) -> f64 {
    let Some(depths) = squared_depths(mask) else { return 0.0 };
    let inside = depths.iter().filter(|&&depth| depth > 0.0).count();
    let deeper = depths.iter().filter(|&&depth| depth > depth_px * depth_px).count();
    deeper as f64 / inside.max(1) as f64
}

/// Squared distance of each pixel of a mask to the nearest outside it; `None` where nothing is outside.
fn squared_depths(mask: &GrayImage) -> Option<Vec<f64>> {
    let mut paper = mask.clone();
    paper.iter_mut().for_each(|v| *v = 255 - *v);
    let any = paper.iter().any(|&v| v > 0);
    any.then(|| euclidean_squared_distance_transform(&paper).into_raw())
}

/// Squared depths of the pixels that are as deep as their eight neighbours.
fn ridge_depths(depth: &[f64], width: usize) -> Vec<f64> {
    let around = [-1, 1, -(width as isize) - 1, -(width as isize), 1 - width as isize].into_iter().chain([
        width as isize - 1,
        width as isize,
        width as isize + 1,
    ]);
    let offsets: Vec<isize> = around.collect();
    let deepest = |i: usize| {
        let within = |offset: isize| depth.get(i.checked_add_signed(offset)?);
        offsets.iter().all(|&offset| within(offset).is_none_or(|&d| d <= depth[i]))
    };
    (0..depth.len()).filter(|&i| depth[i] > 0.0 && deepest(i)).map(|i| depth[i]).collect()
}

/// Fills what a disc of diameter `width_px` cannot enter between the walls. `beyond`: whether there are
/// walls beyond the page's edge.
pub(crate) fn close_gaps(walls: &GrayImage, width_px: f64, beyond: bool) -> GrayImage {
    if width_px < 1.0 {
        return walls.clone();
    }
    // A quarter of a pixel more: the middle of an even stroke lies between two rows of cells.
    let reach = width_px / 2.0 + 0.25;
    if !beyond {
        return closed(walls, reach);
    }
    let (width, height, rim) = (walls.width(), walls.height(), reach.ceil() as u32 + 1);
    let mut page = GrayImage::from_pixel(width + 2 * rim, height + 2 * rim, Luma([255]));
    replace(&mut page, walls, rim.into(), rim.into());
    crop_imm(&closed(&page, reach), rim, rim, width, height).to_image()
}

/// The morphological closing with a disc of radius `reach`.
fn closed(walls: &GrayImage, reach: f64) -> GrayImage {
    let (width, height) = walls.dimensions();
    let far = |squared: &Distances, x, y| squared.get_pixel(x, y).0[0] > reach * reach;
    let mask = |inside: bool| Luma([if inside { 255 } else { 0 }]);
    let distance = euclidean_squared_distance_transform(walls);
    let open = GrayImage::from_fn(width, height, |x, y| mask(far(&distance, x, y)));
    let depth = euclidean_squared_distance_transform(&open);
    GrayImage::from_fn(width, height, |x, y| mask(far(&depth, x, y)))
}

/// Drops specks: connected ink of less than four strokes' widths squared.
pub(crate) fn without_speckles(mut walls: GrayImage) -> GrayImage {
    // The grain of the paper is everywhere and would be taken for the pen: the finest goes first.
    drop_smaller(&mut walls, 8);
    if let Some(width) = stroke_width(&walls) {
        drop_smaller(&mut walls, (4.0 * width * width) as u32);
    }
    walls
}

fn drop_smaller(walls: &mut GrayImage, area: u32) {
    let labels = connected_components(&*walls, Connectivity::Eight, Luma([0]));
    let mut areas = vec![0_u32; labels.iter().max().map_or(0, |&label| label as usize + 1)];
    labels.iter().for_each(|&label| areas[label as usize] += 1);
    for (wall, &label) in walls.iter_mut().zip(labels.iter()) {
        if areas[label as usize] < area {
            *wall = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A horizontal stroke through a page of 120 x 60, with a gap in it.
    fn stroke(width: u32, gap: u32) -> GrayImage {
        GrayImage::from_fn(120, 60, |x, y| {
            let ink = (20..20 + width).contains(&y) && !(50..50 + gap).contains(&x);
            Luma([if ink { 255 } else { 0 }])
        })
    }

    fn gap_is_open(walls: &GrayImage) -> bool {
        (0..120).any(|x| (0..60).all(|y| walls.get_pixel(x, y).0[0] == 0))
    }

    #[test]
    fn a_hairline_gap_closes_and_a_door_stays() {
        let width = stroke_width(&stroke(5, 1)).expect("a stroke");
        assert_eq!(width, 5.0);
        assert!(!gap_is_open(&close_gaps(&stroke(5, 1), width, false)));
        let door = close_gaps(&stroke(5, 30), width, false);
        assert_eq!(door, stroke(5, 30));
    }

    #[test]
    fn an_empty_and_a_full_page_have_no_stroke() {
        assert_eq!(stroke_width(&GrayImage::new(20, 10)), None);
        assert_eq!(stroke_width(&GrayImage::from_pixel(20, 10, Luma([255]))), None);
    }

    #[test]
    fn specks_go_and_strokes_stay() {
        let mut walls = stroke(3, 0);
        walls.put_pixel(60, 50, Luma([255]));
        walls.put_pixel(61, 50, Luma([255]));
        assert_eq!(without_speckles(walls), stroke(3, 0));
    }

    proptest! {
        #[test]
        fn gaps_close_below_the_pen_width_and_stay_from_two_widths_on(width in 3_u32..15, gap in 1_u32..30) {
            let measured = stroke_width(&stroke(width, gap)).expect("a stroke");
            prop_assert!((measured - f64::from(width)).abs() <= 1.0, "{measured} for {width}");
            let closed = close_gaps(&stroke(width, gap), f64::from(width), false);
            if gap < width {
                prop_assert!(!gap_is_open(&closed));
            } else if gap >= 2 * width {
                prop_assert!(gap_is_open(&closed));
            }
        }

        #[test]
        fn closing_only_adds_walls(bits in prop::collection::vec(prop::bool::weighted(0.1), 900), width in 1.0..9.0, beyond: bool) {
            let walls = GrayImage::from_fn(30, 30, |x, y| Luma([if bits[(y * 30 + x) as usize] { 255 } else { 0 }]));
            let closed = close_gaps(&walls, width, beyond);
            prop_assert!(walls.iter().zip(closed.iter()).all(|(&before, &after)| after >= before));
        }
    }
}
