//! Checks whether walls enclose a position. A wide disc rolls in from beyond the page, as water would:
//! everything it reaches is open, and everything beyond openings too narrow for it is enclosed. A coarse grid
//! is enough, since openings are as wide as a door.

use image::{GrayImage, Luma};
use imageproc::region_labelling::{Connectivity, connected_components};
use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::geometry::{Point, Sketch};

use super::drawn_map::DrawnMap;
use super::pen;

/// Minimum width of the disc in cells of the coarse grid. A disc that is narrower than this in pixels keeps the grid of the
/// drawing.
const DISC_CELLS: f64 = 32.0;

/// Returns true if the walls keep a disc of diameter `opening_px` that comes from beyond the page away from a position.
pub(super) fn encloses(drawing: &DrawnMap, place: &Point<Sketch>, opening_px: f64) -> bool {
    let cell_px = (opening_px / DISC_CELLS).floor().max(1.0) as u32;
    let radius = opening_px / f64::from(2 * cell_px);
    let rim = radius.ceil() as u32 + 1;
    let page = free_page(drawing, cell_px, rim);
    let Some(depths) = pen::squared_depths(&page) else { return false };
    let mut middles = GrayImage::new(page.width(), page.height());
    for (middle, &depth) in middles.iter_mut().zip(&depths) {
        *middle = if f64::from(depth) > radius * radius { 255 } else { 0 };
    }
    let labels = connected_components(&middles, Connectivity::Four, Luma([0]));
    let beyond = labels.get_pixel(0, 0);
    let cell = |at: f64| (at / f64::from(cell_px)).floor() + f64::from(rim);
    let (x, y) = (cell(place.x), cell(place.y));
    !labels.enumerate_pixels().any(|(column, row, label)| {
        label == beyond && (f64::from(column) - x).hypot(f64::from(row) - y) <= radius
    })
}

/// Returns the coarse grid with a rim of free cells around the page. Cells that contain no wall are 255.
fn free_page(drawing: &DrawnMap, cell_px: u32, rim: u32) -> GrayImage {
    let [width, height] = [drawing.width_px, drawing.height_px].map(|side| side.div_ceil(cell_px) + 2 * rim);
    let mut page = GrayImage::from_pixel(width, height, Luma([255]));
    for (row, cells) in (0..).zip(drawing.cells.chunks_exact(drawing.width_px as usize)) {
        for (column, _) in (0..).zip(cells).filter(|&(_, &cell)| cell == WALL) {
            page.put_pixel(column / cell_px + rim, row / cell_px + rim, Luma([0]));
        }
    }
    page
}
