//! Distances from points of a drawing to its outlines, precomputed as grids.

use sketchnav_schemas::geometry::{Point, encloses};

use crate::drawn::{Drawn, DrawnMetres};
use crate::plane;
use crate::sketch::{Landmark, Sketch};

/// Side length of a cell, in drawn metres.
const CELL_M: f64 = 0.1;
/// Margin of the grid around the drawing, in drawn metres.
const MARGIN_M: f64 = 3.0;

/// Distance from each cell to the nearest outline and, for each object with a marker, to the outline of that
/// object.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlines {
    low: Point<Drawn>,
    size: [usize; 2],
    nearest: Vec<f32>,
    marked: Vec<Vec<f32>>,
}

/// Returns the distance from a point to an outline, negative inside the object.
fn distance(landmark: &Landmark, at: Point<Drawn>) -> f32 {
    let edges = plane::edges(&landmark.outline).map(|edge| plane::distance_to_segment(at, edge));
    let distance = edges.fold(f64::INFINITY, f64::min);
    (if encloses(&landmark.outline, at) { -distance } else { distance }) as f32
}

impl Outlines {
    /// Computes the distances to the outlines of a sketch. `marked` are the indices of the objects that have markers.
    pub fn of(sketch: &Sketch, marked: &[usize]) -> Self {
        let points = sketch.landmarks.iter().flat_map(|landmark| &landmark.outline).chain(&sketch.route);
        let [low, high] = plane::bounds(points);
        let low = Point::new(low.x - MARGIN_M, low.y - MARGIN_M);
        let extent = [high.x + MARGIN_M - low.x, high.y + MARGIN_M - low.y];
        let size = extent.map(|side| (side / CELL_M).ceil() as usize + 1);
        let nearest = |at: Point<Drawn>| {
            sketch.landmarks.iter().map(|landmark| distance(landmark, at)).fold(f32::INFINITY, f32::min)
        };
        let cells = (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]]);
        let place = |[column, row]: [usize; 2]| {
            Point::new(low.x + column as f64 * CELL_M, low.y + row as f64 * CELL_M)
        };
        let places = cells.map(place);
        let of = |object: &usize| places.clone().map(|at| distance(&sketch.landmarks[*object], at)).collect();
        Self {
            low,
            size,
            nearest: places.clone().map(nearest).collect(),
            marked: marked.iter().map(of).collect(),
        }
    }

    /// Returns the distance from a point to the nearest outline. For a point outside the grid, this is the distance at the
    /// grid's border.
    pub fn nearest(&self, at: Point<Drawn>) -> DrawnMetres {
        DrawnMetres(f64::from(self.nearest[self.cell(at)]))
    }

    /// Like [`Self::nearest`], but for the outline of one object, given by its index among the objects with markers.
    pub fn marked(&self, object: usize, at: Point<Drawn>) -> DrawnMetres {
        DrawnMetres(f64::from(self.marked[object][self.cell(at)]))
    }

    fn cell(&self, at: Point<Drawn>) -> usize {
        let cell = |off: f64, size: usize| (off / CELL_M).round().clamp(0.0, (size - 1) as f64) as usize;
        let [columns, rows] = self.size;
        cell(at.y - self.low.y, rows) * columns + cell(at.x - self.low.x, columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_nearest_outline() {
        let square = |x: f64| Landmark {
            name: String::new(),
            outline: [[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]].map(Point::from).into(),
        };
        let sketch = Sketch {
            landmarks: vec![square(0.0), square(4.0)],
            route: vec![Point::new(0.0, 3.0), Point::new(5.0, 3.0)],
            metres_per_pixel: 1.0,
        };
        let outlines = Outlines::of(&sketch, &[1]);
        let distance = |at: [f64; 2]| outlines.nearest(at.into()).0;
        for (at, expected) in [([2.0, 0.5], 1.0), ([3.5, 0.5], 0.5), ([0.5, 0.5], -0.5), ([0.5, 2.0], 1.0)] {
            assert!((distance(at) - expected).abs() < 0.06, "{at:?}: {}", distance(at));
        }
        assert!(distance([99.0, 99.0]) > 3.0);
        assert!(
            (outlines.marked(0, Point::new(1.5, 0.5)).0 - 2.5).abs() < 0.06,
            "the first object has no marker"
        );
    }
}
