//! The drawing as the explorer uses it, reduced to its outline and its inside.

use sketchnav_mapping::alignment::Partner;
use sketchnav_mapping::harmonic::Interior;
use sketchnav_mapping::outline::{Outline, Place};
use sketchnav_mapping::region::Region;
use sketchnav_schemas::geometry::{Point, Sketch};

use super::{Known, SAMPLES};
use crate::filter::Start;
use crate::filter::outline::closed;
use crate::sketch::SketchGrid;

/// Standard deviation of the smoothing of the outline, in pixels of a drawing that is 512 pixels wide.
const SMOOTHING_PX: f64 = 4.0;
/// Maximum number of cells along the longer side of the reduced drawing.
const MOST_CELLS: usize = 1024;
/// Minimum share of the surroundings of a place in the drawing that must have been seen to locate it in the map.
const LEAST_KNOWN: f64 = 0.3;
/// Number of cells of the grid on which Laplace's equation is solved, along the longer side of the drawing.
const INTERIOR_CELLS: usize = 128;

/// The outline and the inside of a drawing.
#[derive(Debug, Clone)]
pub struct Paper {
    /// Outline of the free space around the start, in pixels.
    pub outline: Outline,
    /// Inside of the outline, in cells of `grain_px` pixels.
    interior: Interior,
    grain_px: f64,
    /// What the drawing says about the robot's start.
    pub marked: Known,
    /// Length of a pixel, in metres, if the building is of typical size.
    pub scale_m: f64,
}

impl Paper {
    /// Prepares a drawing. Returns `None` if there is no free space in it.
    pub fn new(sketch: &SketchGrid, start: &Start, building_size_m: f64) -> Option<Self> {
        let (width, height) = (sketch.width(), sketch.height());
        let size = width.max(height) as f64;
        let closed = closed(sketch, start.pose.position(), building_size_m);
        let walls = closed.as_ref().unwrap_or(sketch).walls();
        let times = width.max(height).div_ceil(MOST_CELLS);
        let mut free = Region::default();
        Region::of(width, height, |k| !walls[k]).coarsen(times, &mut free);
        let grain_px = times as f64;
        let place = [start.pose.x, start.pose.y];
        let at = place.map(|px| px / grain_px);
        let inside = free.connected(free.nearest(at, size)?);
        let mut outline = Outline::of_region(&inside, SAMPLES, SMOOTHING_PX * size / 512.0 / grain_px);
        let interior = Interior::new(&inside, &outline, INTERIOR_CELLS);
        let cell_m = building_size_m / extent(&inside);
        outline.scale(grain_px);
        // The map's origin is where the robot was at its first scan, and its x axis points in the robot's direction then.
        let marked = Known {
            places: (!start.is_anywhere([width, height])).then_some([place, [0.0; 2]]),
            turn_rad: (!start.has_any_heading()).then_some(start.pose.yaw_rad),
        };
        Some(Self { outline, interior, grain_px, marked, scale_m: cell_m / grain_px })
    }

    /// Returns the goal's share of each sample of the outline, which is its harmonic measure.
    pub fn shares(&self, goal: Point<Sketch>) -> Vec<f64> {
        self.interior.measure([goal.x, goal.y].map(|px| px / self.grain_px))
    }

    /// Converts a place of the map to the drawing by an alignment, or returns `None` if too little was seen.
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

/// Returns the longer side of the region's bounding box, which is at least 1.
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
