//! Measures the width of the pen, and repairs small slips of the hand.
//!
//! A gap narrower than the stroke is a slip of the hand rather than a door and is therefore filled by a morphological closing with
//! a disc as wide as the stroke. Distances are Euclidean and exact.

use std::ops::Range;

use image::imageops::{crop_imm, replace};
use image::{GrayImage, Luma};
use imageproc::region_labelling::{Connectivity, connected_components};

use super::bits::{Bits, disc};

/// The depth of a pixel whose column has no pixel outside the mask.
const FAR: u16 = u16::MAX;

/// Returns the width of the strokes in a mask, in pixels, or `None` if the mask is empty or full. This is twice the median
/// distance from a ridge of the distance transform to the paper, which is accurate to within a pixel.
pub(crate) fn stroke_width(mask: &GrayImage) -> Option<f64> {
    let depth = squared_depths(mask)?;
    let mut ridges = ridge_depths(mask, &depth);
    if ridges.is_empty() {
        return None;
    }
    let middle = ridges.len() / 2;
    let (_, median, _) = ridges.select_nth_unstable(middle);
    Some(2.0 * f64::from(*median).sqrt() - 1.0)
}

/// Returns the share of a mask's pixels that are farther than `depth_px` from its edge: 0 for an empty mask, 1 for a full one.
pub(crate) fn share_deeper(mask: &GrayImage, depth_px: f64) -> f64 {
    let Some(depths) = squared_depths(mask) else { return 1.0 };
    let (mut inside, mut deeper) = (0_u64, 0_u64);
    for (at, _) in mask.iter().enumerate().filter(|&(_, &v)| v > 0) {
        inside += 1;
        deeper += u64::from(f64::from(depths[at]) > depth_px * depth_px);
    }
    deeper as f64 / inside.max(1) as f64
}

/// Returns the squared distance, in pixels², from each pixel of a mask to the nearest pixel outside it, or `None` if no pixel
/// is outside. For pixels outside, the distance is 0.
///
/// The result is exact. Distances are first found within columns and then combined row by row, by the lower envelope of
/// parabolas (Meijster, Roerdink and Hesselink 2000). Each stretch of the mask in a row can be handled separately, since no
/// pixel beyond its ends is nearer.
pub(crate) fn squared_depths(mask: &GrayImage) -> Option<Vec<u32>> {
    if mask.iter().all(|&v| v > 0) {
        return None;
    }
    let width = mask.width() as usize;
    let columns = column_depths(mask);
    let mut depths = vec![0; mask.len()];
    let mut envelope = Envelope::default();
    let rows = mask.chunks_exact(width).zip(columns.chunks_exact(width)).zip(depths.chunks_exact_mut(width));
    for ((row, columns), depths) in rows {
        for stretch in stretches(row) {
            let with_ends = stretch.start.saturating_sub(1)..(stretch.end + 1).min(width);
            envelope.fill(&columns[with_ends.clone()], &mut depths[with_ends]);
        }
    }
    Some(depths)
}

/// Returns the stretches of a row that belong to the mask.
fn stretches(row: &[u8]) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    std::iter::from_fn(move || {
        let start = end + row[end..].iter().position(|&v| v > 0)?;
        end = start + row[start..].iter().take_while(|&&v| v > 0).count();
        Some(start..end)
    })
}

/// Returns the distance, in pixels, from each pixel to the nearest one outside the mask in its column, or [`FAR`] if there is
/// none.
fn column_depths(mask: &GrayImage) -> Vec<u16> {
    let width = mask.width() as usize;
    let mut depths = vec![0; mask.len()];
    let mut passed = vec![FAR; width];
    for (row, depths) in mask.chunks_exact(width).zip(depths.chunks_exact_mut(width)) {
        for ((depth, passed), &v) in depths.iter_mut().zip(&mut passed).zip(row) {
            *passed = if v > 0 { passed.saturating_add(1) } else { 0 };
            *depth = *passed;
        }
    }
    passed.fill(FAR);
    for depths in depths.chunks_exact_mut(width).rev() {
        for (depth, passed) in depths.iter_mut().zip(&mut passed) {
            *passed = passed.saturating_add(1).min(*depth);
            *depth = *passed;
        }
    }
    depths
}

/// The lower envelope of the parabolas over one stretch. Each parabola is stored with its apex, the height there, and the position
/// from which it is the lowest.
#[derive(Default)]
struct Envelope {
    parabolas: Vec<[i32; 3]>,
}

impl Envelope {
    fn fill(&mut self, columns: &[u16], out: &mut [u32]) {
        self.build(columns);
        let mut until = out.len();
        for &[apex, height, from] in self.parabolas.iter().rev() {
            for (at, out) in (from..).zip(&mut out[from as usize..until]) {
                *out = ((at - apex) * (at - apex) + height) as u32;
            }
            until = from as usize;
        }
    }

    fn build(&mut self, columns: &[u16]) {
        self.parabolas.clear();
        for (at, &depth) in (0..).zip(columns).filter(|&(_, &depth)| depth != FAR) {
            let height = i32::from(depth).pow(2);
            let mut from = 0;
            while let Some(&[apex, below, begins]) = self.parabolas.last() {
                let (rise, run) = (at * at + height - apex * apex - below, 2 * (at - apex));
                from = rise.div_euclid(run) + i32::from(rise.rem_euclid(run) > 0);
                if from > begins {
                    break;
                }
                self.parabolas.pop();
                from = 0;
            }
            if from < columns.len() as i32 {
                self.parabolas.push([at, height, from]);
            }
        }
    }
}

/// Returns the squared depths of the pixels that are at least as deep as their eight neighbours.
fn ridge_depths(mask: &GrayImage, depth: &[u32]) -> Vec<u32> {
    let width = mask.width() as isize;
    let around = [-1, 1, -width - 1, -width, 1 - width, width - 1, width, width + 1];
    let deepest = |i: usize| {
        let within = |offset: isize| depth.get(i.checked_add_signed(offset)?);
        around.iter().all(|&offset| within(offset).is_none_or(|&d| d <= depth[i]))
    };
    let inside = mask.iter().enumerate().filter(|&(_, &v)| v > 0).map(|(i, _)| i);
    inside.filter(|&i| deepest(i)).map(|i| depth[i]).collect()
}

/// Fills the gaps between walls that a disc of diameter `width_px` cannot enter. If `beyond` is true, everything beyond the
/// page's edge counts as wall.
pub(crate) fn close_gaps(walls: &GrayImage, width_px: f64, beyond: bool) -> GrayImage {
    if width_px < 1.0 {
        return walls.clone();
    }
    // The extra quarter of a pixel is needed because the middle of an even stroke lies between two rows of cells.
    let reach = width_px / 2.0 + 0.25;
    if !beyond {
        return closed(walls, reach);
    }
    let (width, height, rim) = (walls.width(), walls.height(), reach.ceil() as u32 + 1);
    let mut page = GrayImage::from_pixel(width + 2 * rim, height + 2 * rim, Luma([255]));
    replace(&mut page, walls, rim.into(), rim.into());
    crop_imm(&closed(&page, reach), rim, rim, width, height).to_image()
}

/// Returns the morphological closing with a disc of radius `reach`.
fn closed(walls: &GrayImage, reach: f64) -> GrayImage {
    let disc = disc(reach);
    let open = Bits::of(walls).dilated(&disc).inverted();
    open.dilated(&disc).inverted().into_mask()
}

/// Removes specks, that is, connected pieces of ink with an area below four times the squared stroke width.
pub(crate) fn without_speckles(mut walls: GrayImage) -> GrayImage {
    // The grain of the paper is everywhere and would be mistaken for the pen, so the finest specks have to go first.
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
