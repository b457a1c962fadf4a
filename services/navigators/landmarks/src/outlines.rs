//! How far places of a drawing are from its outlines: a grid, made once.

use crate::plane::{self, At};
use crate::sketch::Sketch;
use sketchnav_schemas::geometry::encloses;

/// The side of a cell, in drawn metres.
const CELL_M: f64 = 0.1;
/// How far the grid goes beyond the drawing.
const MARGIN_M: f64 = 3.0;

/// Distances to the nearest outline: below 0 inside of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlines {
    low: At,
    size: [usize; 2],
    distances: Vec<f32>,
}

impl Outlines {
    /// The outlines of a sketch.
    pub fn of(sketch: &Sketch) -> Self {
        let points = sketch.landmarks.iter().flat_map(|landmark| &landmark.outline).chain(&sketch.route);
        let bound = |axis: usize, start: f64, pick: fn(f64, f64) -> f64| {
            points.clone().map(|at| at[axis]).fold(start, pick)
        };
        let low = [0, 1].map(|axis| bound(axis, f64::INFINITY, f64::min) - MARGIN_M);
        let high = [0, 1].map(|axis| bound(axis, f64::NEG_INFINITY, f64::max) + MARGIN_M);
        let size = [0, 1].map(|axis| ((high[axis] - low[axis]) / CELL_M).ceil() as usize + 1);
        let distance = |at: At| {
            let of = sketch.landmarks.iter().map(|landmark| {
                let edges = plane::edges(&landmark.outline).map(|edge| plane::distance_to_segment(at, edge));
                let distance = edges.fold(f64::INFINITY, f64::min);
                if encloses(&landmark.outline, at) { -distance } else { distance }
            });
            of.fold(f64::INFINITY, f64::min)
        };
        let cells = (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]]);
        let place = |cell: [usize; 2]| [0, 1].map(|axis| low[axis] + cell[axis] as f64 * CELL_M);
        Self { low, size, distances: cells.map(|cell| distance(place(cell)) as f32).collect() }
    }

    /// The distance of a place to the nearest outline, in drawn metres; outside of the grid that of its border.
    pub fn distance(&self, at: At) -> f64 {
        let cell = [0, 1].map(|axis| {
            let cell = ((at[axis] - self.low[axis]) / CELL_M).round();
            cell.clamp(0.0, (self.size[axis] - 1) as f64) as usize
        });
        f64::from(self.distances[cell[1] * self.size[0] + cell[0]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::Landmark;

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
        let outlines = Outlines::of(&sketch);
        for (at, expected) in [([2.0, 0.5], 1.0), ([3.5, 0.5], 0.5), ([0.5, 0.5], -0.5), ([0.5, 2.0], 1.0)] {
            assert!((outlines.distance(at) - expected).abs() < 0.06, "{at:?}: {}", outlines.distance(at));
        }
        assert!(outlines.distance([99.0, 99.0]) > 3.0);
    }
}
