//! The way that the robot came, thinned as it grows.

use std::collections::VecDeque;

/// Most points that are kept.
const MAX_POINTS: usize = 2000;
/// Points are this far apart at first, pixels of the canvas.
const FIRST_STEP_PX: f64 = 2.0;

/// Where the robot has been.
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
    /// The robot is here now. Where the trail grows too long every second point goes.
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

    /// All of it, oldest first.
    pub fn points(&self) -> Vec<[f64; 2]> {
        self.points.iter().copied().collect()
    }

    /// Its newest point.
    pub fn last(&self) -> Option<[f64; 2]> {
        self.points.back().copied()
    }
}
