//! The walls as the robot understands them, as a picture that the page lays over its canvas.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::reading::{Options, desk};

/// Gray and alpha of a wall, and of free space.
const SOLID: [u8; 2] = [0, 255];
const CLEAR: [u8; 2] = [0, 0];

/// A picture of cells, row 0 at the bottom: walls black, all else transparent. `None` where they are no grid of
/// this size.
pub fn png(width_px: u32, height_px: u32, cells: &[u8]) -> Option<Vec<u8>> {
    let row = width_px as usize;
    if row == 0 || cells.len() != row * height_px as usize {
        return None;
    }
    let rows = cells.chunks_exact(row).rev();
    let pixels: Vec<u8> = rows.flatten().flat_map(|&cell| if cell == WALL { SOLID } else { CLEAR }).collect();
    let mut out = Vec::new();
    let encoder = PngEncoder::new(&mut out);
    encoder.write_image(&pixels, width_px, height_px, ExtendedColorType::La8).ok()?;
    Some(out)
}

/// The same of a drawing that was sent, by the sketcher's own code. `None` where that refuses it.
pub fn of_drawing(run: &RunConfig, bytes: &[u8]) -> Option<Vec<u8>> {
    let options = Options::of_mission(&run.mission, run.seed).ok()?;
    let drawing = sketchnav_sketch::reading::read(bytes, desk::NAME, &options).ok()?;
    png(drawing.width_px, drawing.height_px, &drawing.cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_black_and_row_0_is_at_the_bottom() {
        let picture =
            image::load_from_memory(&png(2, 2, &[WALL, 0, 0, 0]).unwrap()).unwrap().to_luma_alpha8();
        let alpha: Vec<_> = picture.pixels().map(|pixel| pixel.0[1]).collect();
        assert_eq!(alpha, [0, 0, 255, 0]);
        assert_eq!((png(2, 2, &[0]), png(0, 0, &[])), (None, None));
    }
}
