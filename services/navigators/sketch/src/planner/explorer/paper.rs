//! The drawing as the explorer sees it: its outline and its inside.

use sketchnav_mapping::alignment::Partner;
use sketchnav_mapping::harmonic::Interior;
use sketchnav_mapping::outline::{Outline, Place};
use sketchnav_mapping::region::Region;
use sketchnav_schemas::geometry::{Point, Pose, Sketch};

use super::SAMPLES;
use crate::localization::outline::enclosed;
use crate::localization::parameters::Parameters;
use crate::sketch::SketchGrid;

/// The outline is smoothed over as many pixels where the drawing is 512 pixels large.
const SMOOTHING_PX: f64 = 4.0;
/// Widths of passages that are shut, as shares of the drawing's longer side: nobody knows how wide its doors are.
const NARROW: [f64; 5] = [0.05, 0.08, 0.125, 0.175, 0.2];
/// Most cells along the longer side of the drawing as its passages are shut.
const SHUT_CELLS: usize = 256;
/// Most cells along the longer side of the drawing as it is looked at.
const MOST_CELLS: usize = 1024;
/// A place of the drawing has a place in the map where this share of its surroundings was seen.
const LEAST_KNOWN: f64 = 0.3;
/// Cells of the grid on which Laplace's equation is solved, along the drawing's longer side.
const INTERIOR_CELLS: usize = 128;

/// See the module.
#[derive(Debug, Clone)]
pub struct Paper {
    /// The outline of what is free around the start, pixels.
    pub outline: Outline,
    /// Its inside, in cells of `grain_px` pixels.
    interior: Interior,
    grain_px: f64,
    /// The start.
    pub start: Pose<Sketch>,
    /// The share of its largest part where passages up to some width are shut, for the worst width: about 1 for an open floor.
    pub open_share: f64,
    /// Metres a pixel, were the building as large as buildings are.
    pub scale_m: f64,
}

impl Paper {
    /// `None` where nothing is free around the start.
    pub fn new(sketch: &SketchGrid, start: Pose<Sketch>, building_size_m: f64) -> Option<Self> {
        let (width, height) = (sketch.width(), sketch.height());
        let size = width.max(height) as f64;
        let gap_px = f64::from(Parameters::default().outline_gap_m) * size / building_size_m;
        let is_inside = (0.0..width as f64).contains(&start.x) && (0.0..height as f64).contains(&start.y);
        let closed = is_inside.then(|| enclosed(sketch, start.position(), gap_px as f32)).flatten();
        let walls = closed.as_ref().unwrap_or(sketch).walls();
        let times = width.max(height).div_ceil(MOST_CELLS);
        let free = Region::of(width, height, |k| !walls[k]).coarser(times);
        let grain_px = times as f64;
        let at = [start.x, start.y].map(|px| px / grain_px);
        let inside = free.connected(free.nearest(at, size)?);
        let mut outline = Outline::of_region(&inside, SAMPLES, SMOOTHING_PX * size / 512.0 / grain_px);
        let interior = Interior::new(&inside, &outline, INTERIOR_CELLS);
        let cell_m = building_size_m / extent(&inside);
        let open_share = least_open_share(&inside);
        outline.scale(grain_px);
        Some(Self { outline, interior, grain_px, start, open_share, scale_m: cell_m / grain_px })
    }

    /// The goal's share of each sample of the outline: its harmonic measure.
    pub fn shares(&self, goal: Point<Sketch>) -> Vec<f64> {
        self.interior.measure([goal.x, goal.y].map(|px| px / self.grain_px))
    }

    /// Where in the drawing a place of the map lies by an alignment; `None` where hardly anything was seen.
    pub fn place_of(&self, partners: &[Partner], place: Place) -> Option<Point<Sketch>> {
        let image = |partner: &Partner| match partner {
            Partner::Wall(place) => Some(*place),
            Partner::Nothing | Partner::Gap(_) => None,
        };
        let images: Vec<_> = partners.iter().map(image).collect();
        let [x, y] = self.interior.place_of(&images, place, LEAST_KNOWN)?;
        Some(Point::new(x * self.grain_px, y * self.grain_px))
    }
}

/// The least share over all widths.
fn least_open_share(inside: &Region) -> f64 {
    let coarse = inside.coarser(inside.width.max(inside.height).div_ceil(SHUT_CELLS));
    let extent = extent(&coarse);
    NARROW.iter().map(|narrow| open_share(&coarse, narrow * extent)).fold(1.0, f64::min)
}

/// The share of the largest part of a region that is left when passages narrower than `width` cells are shut; each part counts by
/// what of it is farther than half of that from walls.
fn open_share(region: &Region, width: f64) -> f64 {
    let mut left = region.shrunk((width / 2.0).round() as usize);
    let (mut largest, mut whole) = (0, 0);
    while let Some(seed) = left.cells.iter().position(|cell| *cell) {
        let part = left.connected(seed);
        left.cells.iter_mut().zip(&part.cells).for_each(|(cell, taken)| *cell &= !taken);
        let count = part.count();
        (largest, whole) = (largest.max(count), whole + count);
    }
    if whole > 0 { largest as f64 / whole as f64 } else { 1.0 }
}

/// The longer side of the region's bounding box, at least 1.
fn extent(region: &Region) -> f64 {
    let columns =
        (0..region.width).filter(|x| (0..region.height).any(|y| region.cells[y * region.width + x]));
    let rows = region.cells.chunks(region.width).enumerate().filter(|(_, row)| row.contains(&true));
    let span = |first: Option<usize>, last: Option<usize>| {
        first.zip(last).map_or(1, |(first, last)| last - first + 1)
    };
    let columns: Vec<_> = columns.collect();
    let rows: Vec<_> = rows.map(|(y, _)| y).collect();
    let across = span(columns.first().copied(), columns.last().copied());
    across.max(span(rows.first().copied(), rows.last().copied())) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 × 60 cells, parted by a wall with a passage of so many cells.
    fn parted(passage: usize) -> Region {
        Region::of(104, 64, |k| {
            let (x, y) = (k % 104, k / 104);
            let is_inside = (2..102).contains(&x) && (2..62).contains(&y);
            is_inside && (x != 60 || (30..30 + passage).contains(&y))
        })
    }

    #[test]
    fn doors_part_a_floor_and_wide_passages_do_not() {
        assert!((0.55..0.65).contains(&open_share(&parted(4), 6.0)));
        assert!(open_share(&parted(12), 6.0) > 0.99);
        assert_eq!(open_share(&parted(4), 200.0), 1.0, "nothing is left that could fall apart");
        assert!(least_open_share(&parted(5)) < 0.65 && least_open_share(&parted(60)) > 0.99);
    }
}
