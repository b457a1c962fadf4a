//! Locates a goal by treating the floor as regions joined by doors.
//!
//! The free space of the drawing and of the robot's map is divided into regions at narrow passages (`partition`). The outline of a
//! region is a sequence of walls, doors and gaps (`floor`). Regions of the two floors are aligned by dynamic programming, and a
//! pair of doors costs as much as the regions beyond them (`joint`). The order of doors around a region is preserved, lengths have
//! little weight, and forgotten or closed doors incur a cost. Randomly drawn alignments determine the place of the goal and its
//! certainty (`answer`).
//!
//! All results are pure functions of the drawing and the map. Memory is bounded by the size of the two and by a maximum for the
//! alignments.

mod answer;
mod drawn;
mod floor;
mod joint;
mod lattice;
mod pairing;
mod partition;
mod tokens;

#[cfg(test)]
mod tests;

use sketchnav_mapping::Survey;
use sketchnav_mapping::outline::Place;
use sketchnav_mapping::region::Region;
use sketchnav_schemas::geometry::{Pose, Sketch};

pub use answer::{Answer, Doors, Hypothesis, locate};
pub use drawn::{DIRECTIONS, DrawnRooms, Thing};
pub use floor::{Door, Floor, Kind, Room, Token};

use crate::filter::outline::closed;
use crate::sketch::SketchGrid;
use floor::{Frame, Ground};
use partition::{Dividing, Partition};

/// Width of the solid frame around a floor, in cells.
const FRAME: usize = 2;
/// Share of the clearance of the smaller of two regions below which the passage between them is narrow.
const RATIO: f32 = 0.8;
/// Maximum number of cells along the longer side of a drawing.
const MOST_CELLS: usize = 512;
/// Width of a typical door, in metres, which determines the scale of the drawing.
const DOOR_M: f64 = 0.95;
/// Minimum number of doors required to determine the scale of a drawing.
const LEAST_DOORS: usize = 3;
/// Least, usual and largest area of a floor, in square metres.
const AREAS_M2: [f64; 3] = [60.0, 300.0, 2500.0];
/// Length of a piece of wall, in metres.
const PIECE_M: f64 = 0.5;
/// Area, in square metres, below which a region of a drawing, and of a map, is merged with another.
const LEAST_ROOM_M2: [f64; 2] = [1.5, 1.2];
/// Share of the drawing below which a region is merged with another, and below which a hole is a speck.
const LEAST_SHARES: [f64; 2] = [1e-3, 2e-4];
/// Minimum area, in square metres, of a free-standing object that divides a region, in a drawing and in a map.
const LEAST_HOLE_M2: [f64; 2] = [2.0, 4.0];
/// Maximum length of furniture, in metres. A longer free-standing object in a map is not furniture.
const LONGEST_FURNITURE_M: f64 = 2.5;
/// Length of a cell of a map, in metres.
const CELL_M: f64 = 0.1;
/// Half the width, in metres, above which a passage in a map is never narrow.
const WIDEST_M: f64 = 1.5;
/// Maximum length, in metres, of a gap that may be a door.
const NARROW_M: f64 = 1.5;

impl Floor {
    /// Returns the floor of a drawing of a building whose longer side is about `building_size_m` long, or `None` if there is no
    /// free space. The scale is determined from the widths of doors.
    pub fn of_drawing(sketch: &SketchGrid, start: Pose<Sketch>, building_size_m: f64) -> Option<Self> {
        let (width, height) = (sketch.width(), sketch.height());
        let closed = closed(sketch, start.position(), building_size_m);
        let walls = closed.as_ref().unwrap_or(sketch).walls();
        let times = width.max(height).div_ceil(MOST_CELLS).min(64);
        let mut coarse = Region::default();
        Region::of(width, height, |k| !walls[k]).coarsen(times, &mut coarse);
        let cell = times as f64;
        let frame = Frame { cell, origin: [-(FRAME as f64) * cell; 2], unit_m: 1.0, turn_rad: 0.0 };
        let at = frame.to_cells([start.x, start.y]);
        let mut free = framed(&coarse);
        free = free.connected(free.nearest(at, MOST_CELLS as f64)?);
        let area = free.count() as f64;
        fill_holes(&mut free, |hole| (hole.count() as f64) < LEAST_SHARES[1] * area);
        let solid = complement(&free);
        let divided = |least_area: f64| {
            let dividing = Dividing { ratio: RATIO, widest: f32::INFINITY, least_area: least_area as usize };
            Partition::new(&free, &solid, &Region::empty(free.width(), free.height()), &dividing)
        };
        let per_m = cells_per_m(&divided(LEAST_SHARES[0] * area), area);
        let ground = Ground {
            walls: None,
            start: at,
            piece: PIECE_M * per_m,
            least_hole: (LEAST_HOLE_M2[0] * per_m * per_m) as usize,
            narrow: 0.0,
        };
        let least_area = (LEAST_SHARES[0] * area).max(LEAST_ROOM_M2[0] * per_m * per_m);
        let floor = Self::new(divided(least_area), &ground)?;
        Some(floor.in_frame(Frame { unit_m: 1.0 / (per_m * cell), ..frame }))
    }

    /// Returns the floor of a map, rotated such that its walls are parallel to those of the drawing, or `None` if there is no free
    /// space. `turn_rad` is the approximate angle from a direction in the map to the same one in the drawing.
    pub fn of_map(survey: &Survey, start: Place, turn_rad: f64, drawing: &Self) -> Option<Self> {
        let grid = survey.grid();
        let times = ((CELL_M / grid.cell).round() as usize).clamp(1, 64);
        let cell = grid.cell * times as f64;
        let mut coarse = Region::default();
        survey.free().coarsen(times, &mut coarse);
        let mut occupied = Region::empty(coarse.width() + 2 * FRAME, coarse.height() + 2 * FRAME);
        let is_covered = |at: &[usize; 2]| at[0] / times < coarse.width() && at[1] / times < coarse.height();
        for [column, row] in grid.occupied.places().filter(is_covered) {
            occupied.insert((row / times + FRAME) * occupied.width() + column / times + FRAME);
        }
        let origin = grid.origin.map(|at| at - FRAME as f64 * cell);
        let frame = Frame { cell, origin, unit_m: 1.0, turn_rad: 0.0 };
        let at = frame.to_cells(start);
        let mut free = framed(&coarse);
        free = free.connected(free.nearest(at, (free.width() + free.height()) as f64)?);
        let per_m = 1.0 / cell;
        fill_holes(&mut free, |hole| {
            let is_small = (hole.count() as f64) < LEAST_HOLE_M2[1] * per_m * per_m;
            is_small && (extent(hole) as f64) < LONGEST_FURNITURE_M * per_m
        });
        occupied.subtract(&free);
        let mut walls = occupied.clone();
        walls.grow(2);
        let mut open = complement(&free);
        open.subtract(&occupied);
        open.grow(1);
        open.subtract(&walls);
        let dividing = Dividing {
            ratio: RATIO,
            widest: (WIDEST_M * per_m) as f32,
            least_area: (LEAST_ROOM_M2[1] * per_m * per_m) as usize,
        };
        let partition = Partition::new(&free, &occupied, &open, &dividing);
        let ground = Ground {
            walls: Some(&walls),
            start: at,
            piece: PIECE_M * per_m,
            least_hole: (LEAST_HOLE_M2[1] * per_m * per_m) as usize,
            narrow: NARROW_M * per_m,
        };
        let floor = Self::new(partition, &ground)?;
        let turn_rad = match (drawing.wall_direction(), floor.wall_direction()) {
            (Some(drawn), Some(seen)) => parallel(drawn, seen, turn_rad),
            _ => turn_rad,
        };
        Some(floor.in_frame(Frame { turn_rad, ..frame }))
    }
}

/// Returns a region with a frame of empty cells around it.
fn framed(region: &Region) -> Region {
    let mut framed = Region::empty(region.width() + 2 * FRAME, region.height() + 2 * FRAME);
    for [column, row] in region.places() {
        framed.insert((row + FRAME) * framed.width() + column + FRAME);
    }
    framed
}

fn complement(region: &Region) -> Region {
    Region::of(region.width(), region.height(), |cell| !region.contains(cell))
}

/// Adds the holes of a region that are small.
fn fill_holes(region: &mut Region, is_small: impl Fn(&Region) -> bool) {
    let mut rest = complement(region);
    let (mut part, mut waiting) = (Region::default(), Vec::new());
    while let Some(seed) = rest.first() {
        rest.move_connected(seed, &mut part, &mut waiting);
        // The first part is the frame.
        if seed > 0 && is_small(&part) {
            part.iter().for_each(|cell| region.insert(cell));
        }
    }
}

/// Returns the longer side of the region's bounding box, in cells.
fn extent(region: &Region) -> usize {
    let bounds = region.places().fold([usize::MAX, 0, usize::MAX, 0], |[a, b, c, d], [x, y]| {
        [a.min(x), b.max(x + 1), c.min(y), d.max(y + 1)]
    });
    bounds[1].saturating_sub(bounds[0]).max(bounds[3].saturating_sub(bounds[2]))
}

/// Returns the number of a drawing's cells per metre, from the median width of its doors, provided that its `area` in cells then
/// has a plausible size.
fn cells_per_m(partition: &Partition, area: f64) -> f64 {
    let mut widths: Vec<_> = floor::doors(partition).0.iter().map(|door| door.width).collect();
    widths.sort_by(f64::total_cmp);
    let [least, usual, most] = AREAS_M2.map(|area_m2| (area / area_m2).sqrt());
    let by_doors = widths.get(widths.len() / 2).filter(|_| widths.len() >= LEAST_DOORS);
    by_doors.map_or(usual, |width| width / DOOR_M).clamp(most, least)
}

/// Returns the rotation nearest to `guess_rad` that makes the walls of a map parallel to those of a drawing. Both are given by
/// their main direction and the degree to which their walls agree with it.
fn parallel((drawn_rad, drawn): (f64, f64), (seen_rad, seen): (f64, f64), guess_rad: f64) -> f64 {
    const LEAST_COHERENCE: f64 = 0.3;
    let quarter = std::f64::consts::FRAC_PI_2;
    if drawn.min(seen) <= LEAST_COHERENCE {
        return guess_rad;
    }
    let off = drawn_rad - seen_rad - guess_rad;
    guess_rad + off - quarter * (off / quarter).round()
}
