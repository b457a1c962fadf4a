//! The shift of an object: a Gaussian estimate of how its true position, size and orientation differ from the drawing, updated by a
//! Kalman filter (Thrun, Burgard and Fox 2005, table 3.3, for one measurement).
//!
//! People draw objects out of position, too large or too small, and turned. A point q on the outline of a drawn object with centre
//! c therefore stands for c + d + e^s R(t) (q − c). The state is (d, s, t).

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::Point;

use crate::drawn::Drawn;
use crate::outlines::Outline;

/// Number of values in the state.
const SIZE: usize = 4;

/// Standard deviations of the shift of an object that has not been seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Standard deviation of the position along each axis, in drawn metres.
    pub shift: f32,
    /// Standard deviation of the logarithm of the size.
    pub size: f32,
    /// Standard deviation of the turn, in radians.
    pub turn_rad: f32,
}

/// A Gaussian estimate of how an object differs from how it was drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Shift {
    /// Mean: position in drawn metres, logarithm of the size, and turn in radians.
    mean: [f32; SIZE],
    /// Lower triangle of the covariance, row by row.
    covariance: [f32; SIZE * (SIZE + 1) / 2],
}

/// How far a point is off the outline of an object at its estimated position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Off {
    /// Distance, in drawn metres, negative inside.
    pub distance: f32,
    /// Direction in which the distance grows fastest.
    pub normal: [f32; 2],
    /// Derivatives of the distance with respect to the state.
    slope: [f32; SIZE],
}

const fn entry(row: usize, column: usize) -> usize {
    if row >= column { row * (row + 1) / 2 + column } else { column * (column + 1) / 2 + row }
}

impl Shift {
    /// Returns the estimate for an object that has not been seen.
    pub fn unseen(prior: Prior) -> Self {
        let Prior { shift, size, turn_rad } = prior;
        let mut covariance = [0.0; SIZE * (SIZE + 1) / 2];
        for (i, sd) in [shift, shift, size, turn_rad].into_iter().enumerate() {
            covariance[entry(i, i)] = sd * sd;
        }
        Self { mean: [0.0; SIZE], covariance }
    }

    /// Returns the estimated centre of the object.
    pub fn middle(&self, outline: &Outline) -> [f32; 2] {
        let middle = outline.middle();
        [middle[0] + self.mean[0], middle[1] + self.mean[1]]
    }

    /// Returns the estimated ratio of the object's true size to its drawn one.
    pub fn size(&self) -> f32 {
        self.mean[2].exp()
    }

    /// Returns how far a point is off the object's outline at its estimated position, or `None` if it is too far away to matter.
    pub fn off(&self, outline: &Outline, at: Point<Drawn>) -> Option<Off> {
        let ([middle_x, middle_y], size) = (self.middle(outline), self.size());
        let (sin, cos) = self.mean[3].sin_cos();
        let [x, y] = [at.x as f32 - middle_x, at.y as f32 - middle_y];
        let (distance, [nx, ny]) =
            outline.distance([(x * cos + y * sin) / size, (y * cos - x * sin) / size])?;
        let distance = distance * size;
        let normal = [nx * cos - ny * sin, nx * sin + ny * cos];
        // The nearest point of the outline, relative to the centre.
        let [x, y] = [x - distance * normal[0], y - distance * normal[1]];
        let slope = [-normal[0], -normal[1], -(normal[0] * x + normal[1] * y), normal[0] * y - normal[1] * x];
        Some(Off { distance, normal, slope })
    }

    /// Returns the variance of a distance that results from the uncertainty of the estimate, in square drawn metres.
    pub fn variance(&self, off: &Off) -> f32 {
        let through = self.through(off);
        (0..SIZE).map(|i| off.slope[i] * through[i]).sum()
    }

    fn through(&self, off: &Off) -> [f32; SIZE] {
        std::array::from_fn(|i| (0..SIZE).map(|j| self.covariance[entry(i, j)] * off.slope[j]).sum())
    }

    /// Updates the estimate by an echo from the object's outline, given how far it is off and the variance of that distance.
    pub fn touch(&mut self, off: &Off, variance: f32) {
        let through = self.through(off);
        let innovation: f32 = (0..SIZE).map(|i| off.slope[i] * through[i]).sum::<f32>() + variance;
        for i in 0..SIZE {
            self.mean[i] -= through[i] / innovation * off.distance;
            for j in 0..=i {
                self.covariance[entry(i, j)] -= through[i] * through[j] / innovation;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outlines::Outlines;
    use crate::sketch::{Landmark, Sketch};

    const PRIOR: Prior = Prior { shift: 0.5, size: 0.2, turn_rad: 0.2 };

    fn square() -> Outlines {
        let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(Point::from).into();
        let landmarks = vec![Landmark { name: String::new(), outline }];
        Outlines::of(&Sketch { landmarks, route: Vec::new(), metres_per_pixel: 1.0 })
    }

    /// The actual square is 0.4 m farther to the right, and its sides are 2.4 m long.
    #[test]
    fn a_shift_and_a_size_are_learned_from_echoes_on_three_sides() {
        let outlines = square();
        let outline = &outlines.all()[0];
        let mut shift = Shift::unseen(PRIOR);
        for i in 0..60 {
            let along = f64::from(i % 5) / 5.0 * 2.0;
            let at = [[0.2, along], [2.6, along], [0.4 + along, -0.2]][i as usize % 3];
            let off = shift.off(outline, at.into()).unwrap();
            shift.touch(&off, 0.01);
        }
        let [x, y] = shift.middle(outline);
        assert!((x - 1.4).abs() < 0.05 && (y - 1.0).abs() < 0.05, "{x} {y}");
        assert!((shift.size() - 1.2).abs() < 0.05, "{}", shift.size());
        let off = shift.off(outline, Point::new(2.6, 1.0)).unwrap();
        assert!(shift.variance(&off) < 0.01 && off.distance.abs() < 0.05, "{off:?}");
    }

    #[test]
    fn derivatives_are_those_of_the_distance() {
        let outlines = square();
        let outline = &outlines.all()[0];
        let shift = Shift { mean: [0.1, -0.2, 0.1, 0.15], ..Shift::unseen(PRIOR) };
        for at in [[-0.6, 0.9], [2.8, 1.2], [0.7, -0.9], [1.2, 2.6]].map(Point::from) {
            let off = shift.off(outline, at).unwrap();
            for i in 0..SIZE {
                const STEP: f32 = 0.02;
                let moved = |by: f32| {
                    let mut moved = shift;
                    moved.mean[i] += by;
                    moved.off(outline, at).unwrap().distance
                };
                let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                assert!((slope - off.slope[i]).abs() < 0.03, "{at:?}, {i}: {slope}, {}", off.slope[i]);
            }
        }
    }
}
