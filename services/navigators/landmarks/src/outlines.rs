//! How far places of a drawing are from its outlines: grids, made once.

use crate::plane::{self, At};
use crate::sketch::{Landmark, Sketch};
use sketchnav_schemas::geometry::encloses;

/// The side of a cell, in drawn metres.
const CELL_M: f64 = 0.1;
/// How far the grid goes beyond the drawing.
const MARGIN_M: f64 = 3.0;

/// The nearest outline of every cell, and for objects with markers their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlines {
    low: At,
    size: [usize; 2],
    nearest: Vec<f32>,
    marked: Vec<Vec<f32>>,
}

/// The distance of a place to an outline: below 0 inside of the object.
fn distance(landmark: &Landmark, at: At) -> f32 {
    let edges = plane::edges(&landmark.outline).map(|edge| plane::distance_to_segment(at, edge));
    let distance = edges.fold(f64::INFINITY, f64::min);
    (if encloses(&landmark.outline, at) { -distance } else { distance }) as f32
}

impl Outlines {
    /// The outlines of a sketch, of which the objects with these numbers have markers.
    pub fn of(sketch: &Sketch, marked: &[usize]) -> Self {
        let points = sketch.landmarks.iter().flat_map(|landmark| &landmark.outline).chain(&sketch.route);
        let bound = |axis: usize, start: f64, pick: fn(f64, f64) -> f64| {
            points.clone().map(|at| at[axis]).fold(start, pick)
        };
        let low = [0, 1].map(|axis| bound(axis, f64::INFINITY, f64::min) - MARGIN_M);
        let high = [0, 1].map(|axis| bound(axis, f64::NEG_INFINITY, f64::max) + MARGIN_M);
        let size = [0, 1].map(|axis| ((high[axis] - low[axis]) / CELL_M).ceil() as usize + 1);
        let nearest = |at: At| {
            sketch.landmarks.iter().map(|landmark| distance(landmark, at)).fold(f32::INFINITY, f32::min)
        };
        let cells = (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]]);
        let places = cells.map(|cell| [0, 1].map(|axis| low[axis] + cell[axis] as f64 * CELL_M));
        let of = |object: &usize| places.clone().map(|at| distance(&sketch.landmarks[*object], at)).collect();
        Self {
            low,
            size,
            nearest: places.clone().map(nearest).collect(),
            marked: marked.iter().map(of).collect(),
        }
    }

    /// The distance of a place to the nearest outline, in drawn metres; outside of the grid that of its border.
    pub fn nearest(&self, at: At) -> f64 {
        f64::from(self.nearest[self.cell(at)])
    }

    /// The same to the outline of one of the objects that have markers.
    pub fn marked(&self, object: usize, at: At) -> f64 {
        f64::from(self.marked[object][self.cell(at)])
    }

    fn cell(&self, at: At) -> usize {
        let cell = [0, 1].map(|axis| {
            let cell = ((at[axis] - self.low[axis]) / CELL_M).round();
            cell.clamp(0.0, (self.size[axis] - 1) as f64) as usize
        });
        cell[1] * self.size[0] + cell[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn distances_are_those_of_the_nearest_outline() {
        let square = |x: f64| Landmark {
            name: String::new(),
            outline: vec![[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]],
        };
        let sketch = Sketch {
            landmarks: vec![square(0.0), square(4.0)],
            route: vec![[0.0, 3.0], [5.0, 3.0]],
            metres_per_pixel: 1.0,
        };
        let outlines = Outlines::of(&sketch, &[1]);
        let distance = |at| outlines.nearest(at);
        for (at, expected) in [([2.0, 0.5], 1.0), ([3.5, 0.5], 0.5), ([0.5, 0.5], -0.5), ([0.5, 2.0], 1.0)] {
            assert!((distance(at) - expected).abs() < 0.06, "{at:?}: {}", distance(at));
        }
        assert!(distance([99.0, 99.0]) > 3.0);
        assert!((outlines.marked(0, [1.5, 0.5]) - 2.5).abs() < 0.06, "the first object has no marker");
    }
}
