//! The walls as interpreted by the robot, as a picture that the page lays over its canvas.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use sketchnav_schemas::codes::WALL;
use sketchnav_stage::drawn::UNSEEN;
use sketchnav_stage::lookout::Walls;

/// Gray and alpha of a wall, of space that was seen to be free, and of everything else.
const SOLID: [u8; 2] = [0, 255];
const VEILED: [u8; 2] = [0, 64];
const CLEAR: [u8; 2] = [0, 0];

/// Returns an image of walls, which are black on a transparent background, or `None` if the cells do not form a grid of the given
/// size.
pub fn png(walls: &Walls) -> Option<Vec<u8>> {
    painted(walls, |cell| if cell == WALL { SOLID } else { CLEAR })
}

/// Returns an image of the map, in which walls are black, free space is a veil, and the rest is transparent. `None` as for [`png`].
pub fn seen_png(seen: &Walls) -> Option<Vec<u8>> {
    painted(seen, |cell| match cell {
        WALL => SOLID,
        UNSEEN => CLEAR,
        _ => VEILED,
    })
}

fn painted(
    Walls { size_px: [width_px, height_px], cells }: &Walls,
    paint: impl Fn(u8) -> [u8; 2],
) -> Option<Vec<u8>> {
    let (width_px, height_px) = (*width_px, *height_px);
    let row = width_px as usize;
    if row == 0 || cells.len() != row * height_px as usize {
        return None;
    }
    let rows = cells.chunks_exact(row).rev();
    let pixels: Vec<u8> = rows.flatten().flat_map(|&cell| paint(cell)).collect();
    let mut out = Vec::new();
    let encoder = PngEncoder::new(&mut out);
    encoder.write_image(&pixels, width_px, height_px, ExtendedColorType::La8).ok()?;
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_black_and_row_0_is_at_the_bottom() {
        let walls = |size_px, cells: &[u8]| Walls { size_px, cells: cells.to_vec() };
        let picture = png(&walls([2, 2], &[WALL, 0, 0, 0])).unwrap();
        let picture = image::load_from_memory(&picture).unwrap().to_luma_alpha8();
        let alpha: Vec<_> = picture.pixels().map(|pixel| pixel.0[1]).collect();
        assert_eq!(alpha, [0, 0, 255, 0]);
        let seen = seen_png(&walls([3, 1], &[WALL, 0, UNSEEN])).unwrap();
        let seen = image::load_from_memory(&seen).unwrap().to_luma_alpha8();
        assert_eq!(seen.pixels().map(|pixel| pixel.0[1]).collect::<Vec<_>>(), [255, 64, 0]);
        assert_eq!((png(&walls([2, 2], &[0])), png(&walls([0, 0], &[]))), (None, None));
    }
}
