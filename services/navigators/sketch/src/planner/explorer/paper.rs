//! The drawing as the explorer sees it: its outline and its inside.

use sketchnav_mapping::harmonic::Interior;
use sketchnav_mapping::outline::Outline;
use sketchnav_mapping::region::Region;
use sketchnav_schemas::geometry::{Pose, Sketch};

use super::SAMPLES;
use crate::localization::outline::enclosed;
use crate::localization::parameters::Parameters;
use crate::sketch::SketchGrid;

/// The outline is smoothed over as many pixels where the drawing is 512 pixels large.
const SMOOTHING_PX: f64 = 4.0;
/// Cells of the grid on which Laplace's equation is solved, along the drawing's longer side.
const INTERIOR_CELLS: usize = 128;

/// See the module.
#[derive(Debug, Clone)]
pub struct Paper {
    /// The outline of what is free around the start, pixels.
    pub outline: Outline,
    /// Its inside.
    pub interior: Interior,
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
        let free = Region::of(width, height, |k| !walls[k]);
        let inside = free.connected(free.nearest([start.x, start.y], size)?);
        let outline = Outline::of_region(&inside, SAMPLES, SMOOTHING_PX * size / 512.0);
        let interior = Interior::new(&inside, &outline, INTERIOR_CELLS);
        let scale_m = building_size_m / extent(&inside);
        Some(Self { outline, interior, start, scale_m })
    }
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
