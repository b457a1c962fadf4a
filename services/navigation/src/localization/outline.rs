//! The outline of the drawn building. A robot that starts inside stays inside: what lies around the
//! building is no place for a particle, however well the scan would fit there.
//!
//! People leave their outlines open, for an entrance or by a hasty hand. So outside is what a square
//! brush reaches from the sheet's edge that is as wide as the widest opening that counts as closed (a
//! morphological opening of the sheet around the building).

use sketchnav_schemas::geometry::{Point, Sketch as SketchFrame};

use super::grid::chessboard_distance;
use crate::sketch::Sketch;

/// The drawing with everything outside the building as wall; openings up to `gap_px` count as closed.
/// `None` where `inside` is outside by that measure: then the outline is open.
pub fn enclosed(sketch: &Sketch, inside: Point<SketchFrame>, gap_px: f32) -> Option<Sketch> {
    let outside = outside(sketch, gap_px);
    let (column, row) = (inside.x.floor() as usize, inside.y.floor() as usize);
    (!outside[row * sketch.width() + column]).then(|| sketch.walled(&outside))
}

/// Which cells the brush reaches.
fn outside(sketch: &Sketch, gap_px: f32) -> Vec<bool> {
    let [width, height] = [sketch.width(), sketch.height()];
    // The brush is 2·radius − 1 cells wide.
    let radius = ((gap_px + 1.0) / 2.0).ceil().clamp(1.0, 250.0) as u8;
    let room = chessboard_distance(sketch.walls(), width, height);
    let near: Vec<bool> = reached(&room, radius, width, height);
    let away = chessboard_distance(&near, width, height);
    away.iter().map(|&away| away < radius).collect()
}

/// The cells that the brush's middle reaches from the sheet's edge.
fn reached(room: &[u8], radius: u8, width: usize, height: usize) -> Vec<bool> {
    let mut reached = vec![false; room.len()];
    let columns = (0..width).flat_map(|column| [column, (height - 1) * width + column]);
    let rows = (0..height).flat_map(|row| [row * width, row * width + width - 1]);
    let mut open: Vec<usize> = columns.chain(rows).collect();
    while let Some(at) = open.pop() {
        if room[at] < radius || std::mem::replace(&mut reached[at], true) {
            continue;
        }
        let (column, row) = (at % width, at / width);
        open.extend((column > 0).then(|| at - 1));
        open.extend((column + 1 < width).then(|| at + 1));
        open.extend((row > 0).then(|| at - width));
        open.extend((row + 1 < height).then(|| at + width));
    }
    reached
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sketchnav_schemas::codes::{FREE, WALL};

    use super::*;

    const SIZE: usize = 100;

    /// A sheet of 100 × 100 px with a room from (20, 20) to (80, 80), whose upper wall is open for `gap`
    /// px from its middle on.
    fn room(gap: usize) -> Sketch {
        let cell = |i: usize| {
            let (column, row) = (i % SIZE, i / SIZE);
            let within = |k: usize| (20..=80).contains(&k);
            let side = (column == 20 || column == 80) && within(row);
            let end = (row == 20 || row == 80) && within(column);
            let door = row == 80 && (50..50 + gap).contains(&column);
            if (side || end) && !door { WALL } else { FREE }
        };
        let cells: Vec<u8> = (0..SIZE * SIZE).map(cell).collect();
        Sketch::new(SIZE, SIZE, &cells, 0.0).unwrap()
    }

    #[test]
    fn around_a_closed_room_all_is_wall() {
        let found = enclosed(&room(0), Point::new(50.0, 50.0), 6.0).unwrap();
        let free = |column, row| !found.is_wall_cell(column, row);
        assert!(free(50, 50) && free(21, 21) && free(79, 79));
        assert!(!free(10, 50) && !free(50, 90) && !free(0, 0) && !free(99, 99));
    }

    #[test]
    fn a_robot_that_starts_outside_may_be_there() {
        assert!(enclosed(&room(0), Point::new(10.0, 50.0), 6.0).is_none());
    }

    proptest! {
        #[test]
        fn an_opening_narrower_than_the_gap_is_closed(gap in 0usize..25, limit in 2u32..24) {
            let found = enclosed(&room(gap), Point::new(50.0, 30.0), limit as f32);
            // The brush may be a cell wider: it has a middle.
            if (gap as u32) < limit {
                prop_assert!(found.is_some_and(|sketch| !sketch.is_wall_cell(50, 50)));
            } else if gap as u32 > limit + 1 {
                prop_assert!(found.is_none());
            }
        }
    }
}
