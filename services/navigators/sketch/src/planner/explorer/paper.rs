//! The drawing as the explorer sees it: its outline and its inside.

use sketchnav_mapping::alignment::Partner;
use sketchnav_mapping::harmonic::Interior;
use sketchnav_mapping::outline::{Outline, Place};
use sketchnav_mapping::region::Region;
use sketchnav_schemas::geometry::{Point, Pose, Sketch};

use super::SAMPLES;
use crate::filter::outline::enclosed;
use crate::filter::parameters::Parameters;
use crate::sketch::SketchGrid;

/// The outline is smoothed over as many pixels where the drawing is 512 pixels large.
const SMOOTHING_PX: f64 = 4.0;
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
        let mut free = Region::default();
        Region::of(width, height, |k| !walls[k]).coarsen(times, &mut free);
        let grain_px = times as f64;
        let at = [start.x, start.y].map(|px| px / grain_px);
        let inside = free.connected(free.nearest(at, size)?);
        let mut outline = Outline::of_region(&inside, SAMPLES, SMOOTHING_PX * size / 512.0 / grain_px);
        let interior = Interior::new(&inside, &outline, INTERIOR_CELLS);
        let cell_m = building_size_m / extent(&inside);
        outline.scale(grain_px);
        Some(Self { outline, interior, grain_px, start, scale_m: cell_m / grain_px })
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

/// The longer side of the region's bounding box, at least 1.
fn extent(region: &Region) -> f64 {
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for place in region.places() {
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis] + 1);
        }
    }
    [0, 1].map(|axis| high[axis].saturating_sub(low[axis])).into_iter().fold(1, usize::max) as f64
}
