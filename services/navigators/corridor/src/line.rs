//! Trends from many sightings: the slope of a straight line fitted to a marker's distances by least squares.
//! The weight of a distance decays exponentially with its age, to 1/e after one window. A line can show a
//! trend even if two successive sightings do not, because their errors exceed the marker's motion.

use serde::{Deserialize, Serialize};

use crate::messages::Trend;

/// Sums from which the line is computed. Times are relative to the latest distance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Line {
    weight: f64,
    times: f64,
    distances: f64,
    squares: f64,
    products: f64,
    /// Time since the first distance, in seconds.
    span_s: f64,
}

impl Line {
    /// Adds a distance measured `age_s` after the last one. After a gap longer than the window, the line
    /// starts over.
    pub fn add(&mut self, age_s: f64, distance_m: f64, window_s: f64) {
        let Self { weight, times, distances, squares, products, span_s } =
            if age_s > window_s { Self::default() } else { *self };
        let fade = (-age_s / window_s).exp();
        *self = Self {
            weight: fade * weight + 1.0,
            times: fade * (times - age_s * weight),
            distances: fade * distances + distance_m,
            squares: fade * (squares - 2.0 * age_s * times + age_s * age_s * weight),
            products: fade * (products - age_s * distances),
            span_s: if weight > 0.0 { span_s + age_s } else { 0.0 },
        };
    }

    /// Returns the growth rate of the distance, in m/s.
    fn slope_mps(&self) -> f64 {
        let Self { weight, times, distances, squares, products, .. } = self;
        (weight * products - times * distances) / (weight * squares - times * times)
    }

    /// Returns the trend, or `None` until the line spans a whole window. A slope of up to `quantum_mps` counts as
    /// [`Trend::Stable`].
    pub fn trend(&self, window_s: f64, quantum_mps: f64) -> Option<Trend> {
        let slope_mps = self.slope_mps();
        (self.span_s >= window_s).then_some(if slope_mps.abs() <= quantum_mps {
            Trend::Stable
        } else if slope_mps < 0.0 {
            Trend::Towards
        } else {
            Trend::Away
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line through exact distances has their slope, regardless of the weights.
    #[test]
    fn a_marker_approaching_at_ten_centimetres_per_second_has_that_slope() {
        let mut line = Line::default();
        for (age_s, distance_m) in [(0.0, 3.0), (0.2, 2.98), (0.1, 2.97), (0.4, 2.93), (0.3, 2.9)] {
            line.add(age_s, distance_m, 0.5);
        }
        assert!((line.slope_mps() + 0.1).abs() < 1e-9 && (line.span_s - 1.0).abs() < 1e-9, "{line:?}");
        assert_eq!([0.05, 0.2].map(|mps| line.trend(0.5, mps)), [Some(Trend::Towards), Some(Trend::Stable)]);
        line.add(0.6, 5.0, 0.5);
        assert_eq!((line.weight, line.span_s, line.trend(0.5, 0.05)), (1.0, 0.0, None), "after a gap");
    }
}
