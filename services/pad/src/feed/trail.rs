//! The robot's trail, which is thinned as it grows.

use std::collections::VecDeque;

/// Maximum number of points.
const MAX_POINTS: usize = 2000;
/// The distance between points at first, pixels of the canvas.
const FIRST_STEP_PX: f64 = 2.0;

/// The robot's past positions.
#[derive(Debug, Clone)]
pub struct Trail {
    points: VecDeque<[f64; 2]>,
    step_px: f64,
}

impl Default for Trail {
    fn default() -> Self {
        Self { points: VecDeque::new(), step_px: FIRST_STEP_PX }
    }
}

impl Trail {
    /// Adds the robot's current position. If the trail grows too long, every second point is removed.
    pub fn go_to(&mut self, place: [f64; 2]) {
        let far = |last: &[f64; 2]| (last[0] - place[0]).hypot(last[1] - place[1]) >= self.step_px;
        if self.points.back().is_none_or(far) {
            self.points.push_back(place);
        }
        if self.points.len() > MAX_POINTS {
            self.points = self.points.iter().step_by(2).copied().collect();
            self.step_px *= 2.0;
        }
    }

    /// All points, oldest first.
    pub fn points(&self) -> Vec<[f64; 2]> {
        self.points.iter().copied().collect()
    }

    /// The latest point.
    pub fn last(&self) -> Option<[f64; 2]> {
        self.points.back().copied()
    }
}
