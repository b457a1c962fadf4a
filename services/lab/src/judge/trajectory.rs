//! Measures how far one trajectory is from another, using the absolute and relative errors of evo and the TUM benchmark
//! (Sturm et al., *A Benchmark for the Evaluation of RGB-D SLAM Systems*, IROS 2012).
//!
//! This module is pure. Both trajectories must have the same length, and poses with the same index correspond.

use serde::{Serialize, Serializer};
use sketchnav_schemas::geometry::Pose;

/// Minimum number of poses for alignment. Any three poses can be mapped onto any other three by an affine map.
const FEWEST_POSES: usize = 4;
/// Minimum extent of a path for alignment, in metres. Errors of this size are ordinary, and alignment would remove them.
const SHORTEST_SPAN_M: f64 = 0.5;
/// Minimum extent of an estimated path, as a share of the extent of the true one. A shorter path has collapsed.
const LEAST_SHARE: f64 = 0.1;

/// Why a trajectory is not aligned with the true one. Without these checks, anything could be fitted to a single point.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NotAligned {
    /// There are estimates, but the recording has no true poses.
    #[error("there are no true poses to compare {estimates} estimates with")]
    NoTruth {
        /// Number of estimates.
        estimates: usize,
    },
    /// Nobody has marked where the robot is in the drawing.
    #[error("nobody has marked where the robot is in the drawing, so there are no estimates to compare")]
    Unplaced,
    /// There are too few poses.
    #[error("the path is too short to align: expected {FEWEST_POSES} estimates or more, found {found}")]
    Few {
        /// Number of poses.
        found: usize,
    },
    /// The robot hardly moved.
    #[error(
        "the path is too short to align: expected true poses that span {SHORTEST_SPAN_M} m or more, found {span_m:.3} m"
    )]
    TrueSpan {
        /// Extent of the true path, in metres.
        span_m: f64,
    },
    /// The estimate hardly moved.
    #[error(
        "the estimated path is too short to align: expected estimates that span {least_m:.2} m or more, found {span_m:.3} m"
    )]
    EstimatedSpan {
        /// Minimum extent of this estimate, in metres.
        least_m: f64,
        /// Actual extent of the estimate, in metres.
        span_m: f64,
    },
}

impl Serialize for NotAligned {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Returns why two trajectories in metres cannot be aligned, or `None` if they can.
pub fn not_aligned<F>(truth: &[Pose<F>], estimate: &[Pose<F>]) -> Option<NotAligned> {
    let (true_m, estimated_m) = (span(truth), span(estimate));
    let least_m = SHORTEST_SPAN_M.max(LEAST_SHARE * true_m);
    if truth.len() < FEWEST_POSES {
        Some(NotAligned::Few { found: truth.len() })
    } else if true_m < SHORTEST_SPAN_M {
        Some(NotAligned::TrueSpan { span_m: true_m })
    } else if estimated_m.is_nan() || estimated_m < least_m {
        Some(NotAligned::EstimatedSpan { least_m, span_m: estimated_m })
    } else {
        None
    }
}

/// Returns the diagonal of the bounding box of the positions.
fn span<F>(poses: &[Pose<F>]) -> f64 {
    let extent = |of: fn(&Pose<F>) -> f64| {
        let (least, most) = poses
            .iter()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| (least.min(v), most.max(v)));
        // Positions that are not finite have no extent.
        if least <= most { most - least } else { f64::NAN }
    };
    if poses.is_empty() { 0.0 } else { extent(|pose| pose.x).hypot(extent(|pose| pose.y)) }
}

/// Summary statistics of a list of errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of errors.
    pub count: usize,
    /// Root mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median, which is the mean of the middle two for an even number of errors.
    pub median: f64,
    /// Standard deviation of the population, as opposed to that of a sample.
    pub std: f64,
    /// 95 % quantile by the nearest-rank method.
    pub p95: f64,
    /// 99 % quantile by the nearest-rank method.
    pub p99: f64,
    /// Smallest error.
    pub min: f64,
    /// Largest error.
    pub max: f64,
}

impl Statistics {
    /// Returns the statistics of the errors, or `None` if there are none.
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = errors.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len();
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let n = count as f64;
        let mean = sorted.iter().sum::<f64>() / n;
        let square = |value: &f64| value * value;
        let std = (sorted.iter().map(|e| square(&(e - mean))).sum::<f64>() / n).sqrt();
        let rank = |share: f64| sorted[((share * n).ceil() as usize).clamp(1, count) - 1];
        let median = (sorted[(count - 1) / 2] + sorted[count / 2]) / 2.0;
        let rmse = (sorted.iter().map(square).sum::<f64>() / n).sqrt();
        Some(Self { count, rmse, mean, median, std, p95: rank(0.95), p99: rank(0.99), min, max })
    }
}

/// Returns the rotation and translation that minimize the squared distances between the positions of `moved` and `fixed` (Umeyama
/// 1991, without scale, in the plane). Returns the identity if there are no poses.
pub fn alignment<F>(fixed: &[Pose<F>], moved: &[Pose<F>]) -> Pose<F> {
    let n = fixed.len().max(1) as f64;
    let middle = |poses: &[Pose<F>]| {
        [poses.iter().map(|p| p.x).sum::<f64>() / n, poses.iter().map(|p| p.y).sum::<f64>() / n]
    };
    let ([fx, fy], [mx, my]) = (middle(fixed), middle(moved));
    let (mut along, mut across) = (0.0, 0.0);
    for (f, m) in fixed.iter().zip(moved) {
        let (f, m) = ([f.x - fx, f.y - fy], [m.x - mx, m.y - my]);
        along += m[0] * f[0] + m[1] * f[1];
        across += m[0] * f[1] - m[1] * f[0];
    }
    let yaw = across.atan2(along);
    let (sin, cos) = yaw.sin_cos();
    Pose::new(fx - (cos * mx - sin * my), fy - (sin * mx + cos * my), yaw)
}

/// Returns the poses in `moved` after applying the rotation and translation `by`.
pub fn aligned<F>(by: &Pose<F>, moved: &[Pose<F>]) -> Vec<Pose<F>> {
    let (sin, cos) = by.yaw_rad.sin_cos();
    let place = |p: &Pose<F>| {
        Pose::new(by.x + cos * p.x - sin * p.y, by.y + sin * p.x + cos * p.y, by.yaw_rad + p.yaw_rad)
    };
    moved.iter().map(place).collect()
}

/// Returns the distance between the positions of each pair of poses.
pub fn absolute<'a, F>(truth: &'a [Pose<F>], estimate: &'a [Pose<F>]) -> impl Iterator<Item = f64> + 'a {
    truth.iter().zip(estimate).map(|(t, e)| (t.x - e.x).hypot(t.y - e.y))
}

/// Returns the differences between corresponding motions over `delta` poses: from pose 0 to `delta`, from there to 2 `delta`, and
/// so on. Each is the translation of (Q⁻¹ᵢ Qᵢ₊δ)⁻¹ (P⁻¹ᵢ Pᵢ₊δ).
pub fn relative<'a, F>(
    truth: &'a [Pose<F>],
    estimate: &'a [Pose<F>],
    delta: usize,
) -> impl Iterator<Item = f64> + 'a {
    let ends = (0..truth.len().min(estimate.len())).step_by(delta.max(1));
    ends.clone().zip(ends.skip(1)).map(|(from, to)| {
        let (q, p) = (way(&truth[from], &truth[to]), way(&estimate[from], &estimate[to]));
        (q[0] - p[0]).hypot(q[1] - p[1])
    })
}

/// Returns the position of `to` in the frame of `from`.
fn way<F>(from: &Pose<F>, to: &Pose<F>) -> [f64; 2] {
    let (sin, cos) = from.yaw_rad.sin_cos();
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    [cos * dx + sin * dy, -sin * dx + cos * dy]
}

/// Returns the two rows of the affine map from `from` to `to` that minimizes the squared distances, or `None` if the points lie on
/// a line.
pub fn affine(from: &[[f64; 2]], to: &[[f64; 2]]) -> Option<[[f64; 3]; 2]> {
    let n = from.len() as f64;
    let middle = |points: &[[f64; 2]], i: usize| points.iter().map(|p| p[i]).sum::<f64>() / n;
    let (f, t) = ([0, 1].map(|i| middle(from, i)), [0, 1].map(|i| middle(to, i)));
    let (mut square, mut mixed) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    for (a, b) in from.iter().zip(to) {
        let (a, b) = ([a[0] - f[0], a[1] - f[1]], [b[0] - t[0], b[1] - t[1]]);
        for i in 0..2 {
            for j in 0..2 {
                square[i][j] += a[i] * a[j];
                mixed[i][j] += b[i] * a[j];
            }
        }
    }
    let [[p, q], [_, r]] = square;
    let determinant = p * r - q * q;
    let is_sound = determinant > 1e-9 * (p + r) * (p + r);
    is_sound.then(|| {
        [0, 1].map(|i| {
            let [u, v] = mixed[i];
            let row = [(u * r - v * q) / determinant, (v * p - u * q) / determinant];
            [row[0], row[1], t[i] - row[0] * f[0] - row[1] * f[1]]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sketchnav_schemas::geometry::World;

    fn bend(count: usize) -> Vec<Pose<World>> {
        (0..count).map(|i| i as f64 / 10.0).map(|t| Pose::new(t, (t / 3.0).sin(), t.cos())).collect()
    }

    #[test]
    fn a_moved_trajectory_is_aligned_again() {
        let truth = bend(60);
        let moved = aligned(&Pose::new(3.0, -7.0, 2.1), &truth);
        let back = aligned(&alignment(&truth, &moved), &moved);
        let worst = absolute(&truth, &back).fold(0.0, f64::max);
        assert!(worst < 1e-12, "{worst}");
        let worst = relative(&truth, &moved, 5).fold(0.0, f64::max);
        assert!(worst < 1e-12, "a relative error knows no frame: {worst}");
    }

    /// Regression test: a robot that never moved according to its odometry was reported with an error of "0.000 m".
    #[test]
    fn a_trajectory_that_collapses_to_a_point_is_not_aligned() {
        let truth = bend(60);
        assert_eq!(not_aligned(&truth, &truth), None);
        let point = vec![truth[0]; 60];
        let collapsed = not_aligned(&truth, &point).unwrap();
        assert!(matches!(collapsed, NotAligned::EstimatedSpan { span_m: 0.0, .. }), "{collapsed:?}");
        assert_eq!(not_aligned(&point, &truth), Some(NotAligned::TrueSpan { span_m: 0.0 }));
        assert_eq!(not_aligned(&truth[..3], &truth[..3]), Some(NotAligned::Few { found: 3 }));
        assert!(
            not_aligned(&point, &truth).is_some_and(|why| why.to_string().contains("too short to align"))
        );
        let nowhere = vec![Pose::new(f64::NAN, f64::NAN, 0.0); 60];
        assert!(not_aligned(&truth, &nowhere).is_some());
    }

    #[test]
    fn statistics_by_hand() {
        let found = Statistics::of([3.0, 1.0, 2.0, 4.0]).unwrap();
        assert_eq!((found.count, found.mean, found.median, found.min, found.max), (4, 2.5, 2.5, 1.0, 4.0));
        assert_eq!((found.rmse, found.std), (7.5_f64.sqrt(), 1.25_f64.sqrt()));
        assert_eq!(Statistics::of([]), None);
    }

    #[test]
    fn an_affine_map_is_recovered_and_collinear_points_are_refused() {
        let from: Vec<_> = bend(40).iter().map(|p| [p.x, p.y]).collect();
        let map = |p: &[f64; 2]| [20.0 * p[0] - 3.0 * p[1] + 100.0, 5.0 * p[0] + 40.0 * p[1] - 7.0];
        let found = affine(&from, &from.iter().map(map).collect::<Vec<_>>()).unwrap();
        let expected = [[20.0, -3.0, 100.0], [5.0, 40.0, -7.0]];
        let worst = found.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
        assert!(worst.fold(0.0, f64::max) < 1e-9);
        let line: Vec<_> = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(affine(&line, &line), None);
    }
}
