//! Fills messages in the memory they are sent from. Their headers are filled in by the sender.

use sketchnav_schemas::message::{PosePx, Text, Understood};

use super::drawn_map::DrawnMap;
use super::places::Places;
use super::walls::Kind;
use crate::messages::SketchMap;

/// Fills a sketch message. Its cells are filled by [`fill_cells`].
pub fn fill_sketch(drawing: &DrawnMap, places: &Places, map: &mut SketchMap) {
    map.width_px = drawing.width_px;
    map.height_px = drawing.height_px;
    map.wall_direction_rad = drawing.wall_direction_rad;
    map.pen_width_px = match drawing.kind {
        Kind::Surveyed => SketchMap::SURVEYED_PX,
        _ => drawing.pen_width_px,
    };
    map.start = PosePx::new(&places.start);
    map.start_spread_px = places.start_spread_px;
    map.start_spread_rad = places.start_spread_rad;
}

/// Fills the answer to a drawing: the current drawing, and either the doubts about it (`Ok`) or the reason
/// why it was rejected (`Err`). The sequence numbers of the messages are filled in by the sender.
pub fn fill_understood(drawing: Option<&DrawnMap>, words: Result<&str, &str>, answer: &mut Understood) {
    answer.accepted = words.is_ok().into();
    if let Some(drawing) = drawing {
        answer.sketch_width_px = drawing.width_px;
        answer.sketch_height_px = drawing.height_px;
        answer.scale = drawing.scale;
        answer.wall_direction_rad = drawing.wall_direction_rad;
    }
    answer.words = Text::new(words.unwrap_or_else(|refusal| refusal));
}

/// Fills the cells of a sketch message, row 0 at the bottom. `cells` must have as many entries as the drawing.
pub fn fill_cells(drawing: &DrawnMap, cells: &mut [u8]) {
    cells.copy_from_slice(&drawing.cells);
}
