//! Which wall a ray hits first: line segments in a uniform grid of cells.
//!
//! A ray walks from cell to cell (Amanatides and Woo, *A Fast Voxel Traversal Algorithm for Ray
//! Tracing*, 1987) and stops at the first cell in which something is hit. The grid lies flat in
//! memory; a cast allocates nothing. Metres, frame `World`.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::convex::Segment;

/// Edge of a cell, metres; larger in worlds that would need too many cells.
const CELL_M: f64 = 0.5;
/// Most cells along a side.
const MAX_CELLS: f64 = 512.0;
/// Slack for segments on the border of two cells, metres.
const BORDER_M: f64 = 1e-6;

/// Line segments, sorted into cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SegmentGrid {
    segments: Vec<Segment>,
    origin: Vector2<f64>,
    cell_m: f64,
    size: [i64; 2],
    /// Cell i holds `members[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl SegmentGrid {
    /// Sorts `segments` into a grid that covers them all.
    pub fn new(segments: Vec<Segment>) -> Self {
        let (low, high) = bounds(&segments);
        let extent = high - low;
        let cell_m = CELL_M.max(extent.max() / MAX_CELLS);
        let size = [0, 1].map(|axis| (extent[axis] / cell_m).floor() as i64 + 1);
        let mut grid = Self { segments, origin: low, cell_m, size, starts: vec![0], members: Vec::new() };
        grid.sort_in();
        grid
    }

    fn sort_in(&mut self) {
        let mut cells = vec![Vec::new(); (self.size[0] * self.size[1]) as usize];
        for (i, segment) in self.segments.iter().enumerate() {
            let (low, high) = bounds(std::slice::from_ref(segment));
            let ([x0, y0], [x1, y1]) = (self.cell_of(low), self.cell_of(high));
            for (x, y) in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| (x, y))) {
                if self.touches(segment, x, y) {
                    cells[(y * self.size[0] + x) as usize].push(i as u32);
                }
            }
        }
        for cell in cells {
            self.members.extend(cell);
            self.starts.push(self.members.len() as u32);
        }
    }

    fn cell_of(&self, point: Vector2<f64>) -> [i64; 2] {
        let cell = (point - self.origin) / self.cell_m;
        [0, 1].map(|axis| (cell[axis].floor() as i64).clamp(0, self.size[axis] - 1))
    }

    /// Whether a segment, whose bounding box meets the cell, meets the cell itself: all four corners
    /// on one side of its line mean that it does not.
    fn touches(&self, [a, b]: &Segment, x: i64, y: i64) -> bool {
        let (a, b) = (Vector2::from(*a), Vector2::from(*b));
        let normal = Vector2::new(a.y - b.y, b.x - a.x).normalize();
        let half = self.cell_m / 2.0;
        let middle = self.origin + Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * self.cell_m;
        (middle - a).dot(&normal).abs() <= half * (normal.x.abs() + normal.y.abs()) + BORDER_M
    }

    /// How far along `direction` (a unit vector) a ray from `from` goes until it hits a segment;
    /// `None` where there is none within `max_m`.
    pub fn cast(&self, from: Vector2<f64>, direction: Vector2<f64>, max_m: f64) -> Option<f64> {
        let enter_m = self.enter(from, direction, max_m)?;
        let mut cell = self.cell_of(from + direction * enter_m);
        let step = [0, 1].map(|axis| if direction[axis] < 0.0 { -1 } else { 1 });
        let delta_m = [0, 1].map(|axis| (self.cell_m / direction[axis]).abs());
        let mut exit_m = [0, 1].map(|axis| {
            let border = (cell[axis] + (step[axis] + 1) / 2) as f64 * self.cell_m + self.origin[axis];
            if direction[axis] == 0.0 { f64::INFINITY } else { (border - from[axis]) / direction[axis] }
        });
        let mut nearest_m = f64::INFINITY;
        loop {
            for &i in self.members(cell) {
                nearest_m = nearest_m.min(hit(&self.segments[i as usize], from, direction));
            }
            let axis = usize::from(exit_m[1] < exit_m[0]);
            let reached_m = exit_m[axis].min(max_m);
            if nearest_m <= reached_m {
                return Some(nearest_m);
            }
            cell[axis] += step[axis];
            if reached_m >= max_m || !(0..self.size[axis]).contains(&cell[axis]) {
                return (nearest_m <= max_m).then_some(nearest_m);
            }
            exit_m[axis] += delta_m[axis];
        }
    }

    fn members(&self, [x, y]: [i64; 2]) -> &[u32] {
        let cell = (y * self.size[0] + x) as usize;
        &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Where the ray comes into the grid: 0 inside, `None` where it never does.
    fn enter(&self, from: Vector2<f64>, direction: Vector2<f64>, max_m: f64) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, max_m);
        for axis in [0, 1] {
            let low = self.origin[axis] - from[axis];
            let high = low + self.size[axis] as f64 * self.cell_m;
            if direction[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
            } else {
                let (a, b) = (low / direction[axis], high / direction[axis]);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        (enter <= leave).then_some(enter)
    }
}

fn bounds(segments: &[Segment]) -> (Vector2<f64>, Vector2<f64>) {
    let mut points = segments.iter().flatten().map(|p| Vector2::from(*p));
    let first = points.next().unwrap_or_default();
    points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)))
}

/// How far along the ray it meets the segment; +∞ where it does not.
fn hit([a, b]: &Segment, from: Vector2<f64>, direction: Vector2<f64>) -> f64 {
    let (offset, along) = ([a[0] - from.x, a[1] - from.y], [b[0] - a[0], b[1] - a[1]]);
    let cross = direction.x * along[1] - direction.y * along[0];
    let t = (offset[0] * along[1] - offset[1] * along[0]) / cross;
    let u = (offset[0] * direction.y - offset[1] * direction.x) / cross;
    // A hair beyond both ends, so that no ray slips through where two walls meet. Parallel: NaN or ∞.
    if t >= 0.0 && (-1e-9..=1.0 + 1e-9).contains(&u) { t } else { f64::INFINITY }
}

/// How far along the ray it meets a disc; +∞ where it does not, 0 where it starts inside.
pub fn hit_disc(center: Vector2<f64>, radius_m: f64, from: Vector2<f64>, direction: Vector2<f64>) -> f64 {
    let to_center = center - from;
    let along = to_center.dot(&direction);
    let beside_squared = to_center.norm_squared() - along * along;
    let half_chord_squared = radius_m * radius_m - beside_squared;
    if to_center.norm_squared() <= radius_m * radius_m {
        0.0
    } else if half_chord_squared < 0.0 || along < 0.0 {
        f64::INFINITY
    } else {
        along - half_chord_squared.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        -6.0..6.0
    }

    proptest! {
        /// The grid only leaves out segments that the ray cannot hit.
        #[test]
        fn the_grid_finds_what_a_search_through_all_segments_finds(
            ends in prop::collection::vec((number(), number(), number(), number()), 1..40),
            (x, y, angle, max_m) in (-9.0..9.0, -9.0..9.0, -4.0..4.0, 0.1..20.0),
        ) {
            let segments: Vec<Segment> = ends.iter().map(|e| [[e.0, e.1], [e.2, e.3]]).collect();
            let (from, direction) = (Vector2::new(x, y), Vector2::new(f64::cos(angle), f64::sin(angle)));
            let nearest = segments.iter().map(|s| hit(s, from, direction)).fold(f64::INFINITY, f64::min);
            let expected = (nearest <= max_m).then_some(nearest);
            prop_assert_eq!(SegmentGrid::new(segments).cast(from, direction, max_m), expected);
        }

        /// Axis-parallel walls on cell borders and axis-parallel rays are what buildings are made of.
        #[test]
        fn rays_along_the_axes_hit_walls_on_cell_borders(x in -2.4..2.4, y in -2.4..2.4) {
            let corners = [[-2.5, -2.5], [2.5, -2.5], [2.5, 2.5], [-2.5, 2.5]];
            let walls = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect();
            let grid = SegmentGrid::new(walls);
            for (direction, range) in [((1.0, 0.0), 2.5 - x), ((-1.0, 0.0), x + 2.5), ((0.0, 1.0), 2.5 - y)] {
                let hit = grid.cast(Vector2::new(x, y), Vector2::new(direction.0, direction.1), 9.0);
                prop_assert!((hit.unwrap() - range).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn discs_are_hit_from_outside_and_touched_from_inside() {
        let (right, origin) = (Vector2::x(), Vector2::zeros());
        assert_eq!(hit_disc(Vector2::new(3.0, 0.0), 1.0, origin, right), 2.0);
        assert_eq!(hit_disc(Vector2::new(-3.0, 0.0), 1.0, origin, right), f64::INFINITY);
        assert_eq!(hit_disc(Vector2::new(3.0, 1.5), 1.0, origin, right), f64::INFINITY);
        assert_eq!(hit_disc(Vector2::new(0.5, 0.0), 1.0, origin, right), 0.0);
    }
}
