//! Encloses the drawn building. A robot that starts inside stays inside, so particles are kept inside as well, however well the
//! scan would fit elsewhere.
//!
//! People leave outlines open, for an entrance or in haste. Outside therefore means everything that a square brush can reach from
//! beyond the edge of the sheet (a morphological opening of the surroundings). The brush is as wide as the widest opening that
//! counts as closed.

use std::ops::Range;

use sketchnav_schemas::geometry::{Point, Sketch};

use super::bits::Bits;
use super::parameters::Parameters;
use crate::sketch::SketchGrid;

/// Returns the drawing with everything outside the building turned into wall, assuming that the building's
/// longer side is `building_size_m` long. Returns `None` if its outline is open, or if `inside` lies outside
/// the sheet.
pub fn closed(sketch: &SketchGrid, inside: Point<Sketch>, building_size_m: f64) -> Option<SketchGrid> {
    let [width, height] = [sketch.width(), sketch.height()].map(|px| px as f64);
    let gap_px = f64::from(Parameters::default().outline_gap_m) * width.max(height) / building_size_m;
    let is_on_sheet = (0.0..width).contains(&inside.x) && (0.0..height).contains(&inside.y);
    is_on_sheet.then(|| enclosed(sketch, inside, gap_px as f32)).flatten()
}

/// Returns the drawing with everything outside the building turned into wall. Openings of up to `gap_px`
/// count as closed. Returns `None` if `inside` turns out to be outside, which means that the outline is open.
pub fn enclosed(sketch: &SketchGrid, inside: Point<Sketch>, gap_px: f32) -> Option<SketchGrid> {
    let outside = outside(sketch, gap_px);
    let (column, row) = (inside.x.floor() as usize, inside.y.floor() as usize);
    (!outside[row * sketch.width() + column]).then(|| sketch.walled(&outside))
}

/// Returns, for each cell of the sheet, whether the brush reaches it. The brush starts beyond the edge of the sheet, so there is
/// room for it even if the drawing fills the sheet.
fn outside(sketch: &SketchGrid, gap_px: f32) -> Vec<bool> {
    // The brush is 2·radius − 1 cells wide.
    let radius = ((gap_px + 1.0) / 2.0).ceil().clamp(1.0, 250.0) as usize;
    let blocked = Bits::framed(sketch.walls(), sketch.width(), radius).spread(radius - 1);
    reached(&blocked).spread(radius - 1).inner(radius)
}

/// Returns the cells that the centre of the brush reaches from the corner through the sides of cells, without entering `blocked`
/// ones.
fn reached(blocked: &Bits) -> Bits {
    let rows: Vec<Vec<Range<usize>>> = (0..blocked.height()).map(|row| blocked.free(row).collect()).collect();
    let mut is_reached: Vec<Vec<bool>> = rows.iter().map(|stretches| vec![false; stretches.len()]).collect();
    let mut reached = blocked.blank();
    let mut open: Vec<(usize, usize)> = rows[0].first().map(|_| (0, 0)).into_iter().collect();
    while let Some((row, k)) = open.pop() {
        if std::mem::replace(&mut is_reached[row][k], true) {
            continue;
        }
        let stretch = &rows[row][k];
        reached.fill(row, stretch.clone());
        for beside in
            [row.checked_sub(1), Some(row + 1).filter(|&row| row < rows.len())].into_iter().flatten()
        {
            let first = rows[beside].partition_point(|other| other.end <= stretch.start);
            let touching = rows[beside][first..].iter().take_while(|other| other.start < stretch.end).count();
            open.extend((first..first + touching).map(|k| (beside, k)));
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sketchnav_schemas::codes::{FREE, WALL};

    use super::*;

    const SIZE: usize = 100;

    /// Draws a sheet of 100 × 100 px with a room from (20, 20) to (80, 80). The upper wall is open for `gap` px from its middle on.
    fn room(gap: usize) -> SketchGrid {
        let cell = |i: usize| {
            let (column, row) = (i % SIZE, i / SIZE);
            let within = |k: usize| (20..=80).contains(&k);
            let side = (column == 20 || column == 80) && within(row);
            let end = (row == 20 || row == 80) && within(column);
            let door = row == 80 && (50..50 + gap).contains(&column);
            if (side || end) && !door { WALL } else { FREE }
        };
        let cells: Vec<u8> = (0..SIZE * SIZE).map(cell).collect();
        SketchGrid::new(SIZE, SIZE, &cells, 0.0).unwrap()
    }

    #[test]
    fn around_a_closed_room_all_is_wall() {
        let found = enclosed(&room(0), Point::new(50.0, 50.0), 6.0).unwrap();
        let free = |column, row| !found.is_wall_cell(column, row);
        assert!(free(50, 50) && free(21, 21) && free(79, 79));
        assert!(!free(10, 50) && !free(50, 90) && !free(0, 0) && !free(99, 99));
    }

    /// Regression test for drawings that fill the sheet: the brush was assumed to fit at every cell along the edge of the sheet,
    /// and so reached into the rooms behind the outer walls by its own width.
    #[test]
    fn a_room_that_fills_its_sheet_stays_whole() {
        for margin in [0, 1, 3, 8] {
            let (low, high) = (margin, SIZE - 1 - margin);
            let cell = |i: usize| {
                let (column, row) = (i % SIZE, i / SIZE);
                let within = |k: usize| (low..=high).contains(&k);
                let side = (column == low || column == high) && within(row);
                let end = (row == low || row == high) && within(column);
                if side || end { WALL } else { FREE }
            };
            let cells: Vec<u8> = (0..SIZE * SIZE).map(cell).collect();
            let sketch = SketchGrid::new(SIZE, SIZE, &cells, 0.0).unwrap();
            let found = enclosed(&sketch, Point::new(50.0, 50.0), 40.0).unwrap();
            let inside = low + 1..high;
            for (column, row) in (0..SIZE).flat_map(|row| (0..SIZE).map(move |column| (column, row))) {
                let is_room = inside.contains(&column) && inside.contains(&row);
                assert_eq!(found.walls()[row * SIZE + column], !is_room, "{margin}: ({column}, {row})");
            }
        }
    }

    #[test]
    fn a_robot_that_starts_outside_may_be_there() {
        assert!(enclosed(&room(0), Point::new(10.0, 50.0), 6.0).is_none());
    }

    proptest! {
        #[test]
        fn an_opening_narrower_than_the_gap_is_closed(gap in 0usize..25, limit in 2u32..24) {
            let found = enclosed(&room(gap), Point::new(50.0, 30.0), limit as f32);
            // The brush may be one cell wider than the limit, because it needs a centre cell.
            if (gap as u32) < limit {
                prop_assert!(found.is_some_and(|sketch| !sketch.is_wall_cell(50, 50)));
            } else if gap as u32 > limit + 1 {
                prop_assert!(found.is_none());
            }
        }
    }
}
