//! Distances to the outlines of drawn objects, precomputed in a grid around each object.

use sketchnav_schemas::geometry::{Point, encloses};

use crate::drawn::Drawn;
use crate::plane;
use crate::sketch::{Landmark, Sketch};

/// Side length of a cell, in drawn metres.
const CELL_M: f32 = 0.1;
/// Margin of a grid around its object, in drawn metres.
const MARGIN_M: f32 = 2.0;

/// The outline of an object, as a grid of the distances to it from the points around and inside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    middle: [f32; 2],
    radius: f32,
    /// Lower left corner of the grid, relative to the object's centre.
    low: [f32; 2],
    size: [usize; 2],
    /// For each cell, the distance to the outline (negative inside the object) and the direction in which that distance grows
    /// fastest.
    cells: Vec<(f32, [f32; 2])>,
}

/// Returns the distance from a point to an outline, in drawn metres. It is negative inside the object.
fn distance(landmark: &Landmark, at: Point<Drawn>) -> f32 {
    let edges = plane::edges(&landmark.outline).map(|edge| plane::distance_to_segment(at, edge));
    let distance = edges.fold(f64::INFINITY, f64::min);
    (if encloses(&landmark.outline, at) { -distance } else { distance }) as f32
}

impl Outline {
    fn of(landmark: &Landmark) -> Self {
        let [low, high] = plane::bounds(landmark.outline.iter());
        let middle = Point::new(f64::midpoint(low.x, high.x), f64::midpoint(low.y, high.y));
        let half = [high.x - middle.x, high.y - middle.y].map(|half| half as f32 + MARGIN_M);
        let size = half.map(|half| (2.0 * half / CELL_M).ceil() as usize + 1);
        let low = half.map(|half| -half);
        let at = |column: usize, row: usize| {
            let [x, y] = [low[0] + column as f32 * CELL_M, low[1] + row as f32 * CELL_M];
            Point::new(middle.x + f64::from(x), middle.y + f64::from(y))
        };
        let [columns, rows] = size;
        let distances: Vec<_> =
            (0..columns * rows).map(|i| distance(landmark, at(i % columns, i / columns))).collect();
        let slope = |i: usize, column: usize, row: usize| {
            let [left, right] = [i - usize::from(column > 0), i + usize::from(column + 1 < columns)];
            let [below, above] =
                [if row > 0 { i - columns } else { i }, if row + 1 < rows { i + columns } else { i }];
            let [x, y] = [distances[right] - distances[left], distances[above] - distances[below]];
            let length = x.hypot(y).max(1e-6);
            [x / length, y / length]
        };
        let cells = (0..columns * rows).map(|i| (distances[i], slope(i, i % columns, i / columns))).collect();
        let radius = landmark.outline.iter().map(|at| at.distance(&middle)).fold(0.0, f64::max) as f32;
        Self { middle: [middle.x as f32, middle.y as f32], radius, low, size, cells }
    }

    /// Returns the centre of the drawn object: that of its bounding box.
    pub const fn middle(&self) -> [f32; 2] {
        self.middle
    }

    /// Returns the distance from the centre to the farthest point of the outline.
    pub const fn radius(&self) -> f32 {
        self.radius
    }

    /// Returns the distance to the outline from a point, which is given relative to the centre, and the direction in which that
    /// distance grows fastest. Returns `None` outside the grid.
    pub fn distance(&self, at: [f32; 2]) -> Option<(f32, [f32; 2])> {
        let [column, row] = [0, 1].map(|axis| (at[axis] - self.low[axis]) / CELL_M);
        let [columns, rows] = self.size.map(|size| (size - 1) as f32);
        if !((0.0..=columns).contains(&column) && (0.0..=rows).contains(&row)) {
            return None;
        }
        let [nearest_column, nearest_row] = [column.round(), row.round()];
        let (distance, normal) = self.cells[nearest_row as usize * self.size[0] + nearest_column as usize];
        let [x, y] = [(column - nearest_column) * CELL_M, (row - nearest_row) * CELL_M];
        Some((distance + x * normal[0] + y * normal[1], normal))
    }
}

/// The outlines of all objects of a sketch.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlines(Vec<Outline>);

impl Outlines {
    /// Computes the distances to the outlines of a sketch.
    pub fn of(sketch: &Sketch) -> Self {
        Self(sketch.landmarks.iter().map(Outline::of).collect())
    }

    /// Returns the outlines, in the order in which they were drawn.
    pub fn all(&self) -> &[Outline] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_each_outline() {
        let square = |x: f64| Landmark {
            name: String::new(),
            outline: [[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]].map(Point::from).into(),
        };
        let sketch =
            Sketch { landmarks: vec![square(0.0), square(4.0)], route: Vec::new(), metres_per_pixel: 1.0 };
        let outlines = Outlines::of(&sketch);
        let second = &outlines.all()[1];
        assert_eq!(second.middle(), [4.5, 0.5]);
        for (at, expected, normal) in [
            ([-1.52, 0.0], 1.02, [-1.0, 0.0]),
            ([0.33, 0.0], -0.17, [1.0, 0.0]),
            ([0.0, 1.6], 1.1, [0.0, 1.0]),
        ] {
            let (distance, [x, y]) = second.distance(at).unwrap();
            assert!((distance - expected).abs() < 0.02, "{at:?}: {distance}");
            assert!((x - normal[0]).hypot(y - normal[1]) < 0.05, "{at:?}: {x} {y}");
        }
        assert_eq!(second.distance([-3.0, 0.0]), None);
    }
}
