//! Virtual measurements of the scales (Boniardi et al. 2015, equation 8), which are the scales at which the ray-traced end points
//! would coincide with those of the scan. Equation 7 uses them to compute the likelihood of a particle's scales.

use super::beam_model::expected_range;
use super::beams::Beams;
use super::grid::Grid;
use super::metric::ScaleFrame;
use super::parameters::Scales;
use serde::{Deserialize, Serialize};

/// A pose with the two local scales, like that of a particle.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ScaledPose {
    /// Position along x, in pixels.
    pub x_px: f32,
    /// Position along y, upwards, in pixels.
    pub y_px: f32,
    /// Heading, in radians.
    pub yaw_rad: f32,
    /// Scale along the wall direction, in pixels per metre.
    pub a_pxpm: f32,
    /// Scale across the wall direction, in pixels per metre.
    pub b_pxpm: f32,
}

/// The scales that ray tracing suggests. A scale is `None` if no beam looks along its axis. If there is only one scale, it is
/// `a_pxpm`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VirtualScales {
    /// Scale a′ of equation (8), in pixels per metre.
    pub a_pxpm: Option<f32>,
    /// Scale b′ of equation (8), in pixels per metre.
    pub b_pxpm: Option<f32>,
}

/// Sum of squared projections of the end points, in m², up to which an axis does not count as observed.
const SEEN_M2: f32 = 1.0;

/// Solves equation (8) at `pose`, which minimizes Σ [π_a(pᵢ − A zᵢ)]² + [π_b(pᵢ − B zᵢ)]² over A and B. Hence A = Σ π_a(pᵢ) π_a(zᵢ)
/// / Σ π_a(zᵢ)², and B likewise, where zᵢ are the measured end points around the robot, in metres, and pᵢ the ray-traced ones, in
/// pixels. With a single scale, the sums of both axes are added.
///
/// A ray has the direction of its beam, turned by the pose. If the pose's scales distorted the direction as well, rays would extend
/// farther along an axis with an overestimated scale, and a wrong scale would confirm itself.
///
/// The paper goes on to call the average of the ratios π_a(pᵢ)/π_a(zᵢ) the solution. That is a different estimate, which is
/// unbounded for a beam across the axis, so the code follows the equation.
pub fn least_squares(
    grid: &Grid,
    frame: &ScaleFrame,
    beams: &Beams,
    pose: &ScaledPose,
    scales: Scales,
) -> VirtualScales {
    let scale_pxpm = (pose.a_pxpm * pose.b_pxpm).sqrt();
    let metric = frame.px_from_base(pose.yaw_rad, scale_pxpm, scale_pxpm);
    let (mut products, mut squares) = ([0.0; 2], [0.0; 2]);
    for i in (0..beams.len()).filter(|&i| beams.returned[i]) {
        let traced_m = expected_range(grid, beams, i, [pose.x_px, pose.y_px], &metric);
        if traced_m <= 0.0 {
            // Rays cannot be traced from inside a wall.
            continue;
        }
        let end = |range_m: f32| {
            let forward = beams.origin_m[0] + range_m * beams.forward[i];
            frame.frame_from_base(pose.yaw_rad, forward, beams.origin_m[1] + range_m * beams.left[i])
        };
        let ([p_a, p_b], [z_a, z_b]) = (end(traced_m), end(beams.range_m[i]));
        products = [products[0] + scale_pxpm * p_a * z_a, products[1] + scale_pxpm * p_b * z_b];
        squares = [squares[0] + z_a * z_a, squares[1] + z_b * z_b];
    }
    let ratio = |product: f32, square: f32| (square > SEEN_M2).then(|| product / square);
    match scales {
        Scales::Two => {
            let [a_pxpm, b_pxpm] = [0, 1].map(|axis| ratio(products[axis], squares[axis]));
            VirtualScales { a_pxpm, b_pxpm }
        }
        Scales::One => {
            let one = ratio(products[0] + products[1], squares[0] + squares[1]);
            VirtualScales { a_pxpm: one, b_pxpm: None }
        }
    }
}

impl VirtualScales {
    /// Returns ln L_λ,a(a′) + ln L_ν,b(b′) of equation (7), up to a constant. These are Laplace distributions around a particle's
    /// scales, which are given as (ln a, ln b), with the widths λ and ν in pixels per metre.
    pub fn log_likelihood(&self, ln_scales: [f32; 2], widths_pxpm: [f32; 2]) -> f32 {
        let term = |found: Option<f32>, axis: usize| {
            found.map_or(0.0, |scale| -(scale - ln_scales[axis].exp()).abs() / widths_pxpm[axis])
        };
        term(self.a_pxpm, 0) + term(self.b_pxpm, 1)
    }
}

/// Squared cosine of the angle from an axis beyond which a beam contains no information about the axis's scale.
const LOOKS_ALONG: f32 = 0.5;
/// Sum of squared cosines below which an axis is not observed.
const OBSERVED: f32 = 2.0;
/// Distance from the mean beyond which the logarithm of a ratio is an outlier, such as a door or a piece of furniture.
const OUTLIER: f32 = 0.5;
/// Number of rounds of averaging, of which all but the first leave out outliers.
const ROUNDS: usize = 3;

/// Computes a robust relative of equation (8). Each scale is the logarithmic mean of the ratio of the ray-traced to the measured
/// projections along its axis. Since the direction of a traced beam follows from `pose`'s own scales, the ratio of the projections
/// is the ratio of the lengths times the scale. The mean is recomputed without outliers.
pub fn trimmed_means(grid: &Grid, frame: &ScaleFrame, beams: &Beams, pose: &ScaledPose) -> VirtualScales {
    let metric = frame.px_from_base(pose.yaw_rad, pose.a_pxpm, pose.b_pxpm);
    let expected = |i: usize| expected_range(grid, beams, i, [pose.x_px, pose.y_px], &metric);
    // Rays cannot be traced from inside a wall.
    let ratio = |i: usize| Some(expected(i) / beams.range_m[i]).filter(|&r| r > 0.0).map(f32::ln);
    let along_a = |i: usize| frame.share_of_a(pose.yaw_rad + beams.angle_rad[i]);
    let a = trimmed_mean(beams, ratio, along_a);
    let b = trimmed_mean(beams, ratio, |i| 1.0 - along_a(i));
    VirtualScales { a_pxpm: a.map(|ln| pose.a_pxpm * ln.exp()), b_pxpm: b.map(|ln| pose.b_pxpm * ln.exp()) }
}

fn trimmed_mean(
    beams: &Beams,
    value: impl Fn(usize) -> Option<f32>,
    share: impl Fn(usize) -> f32,
) -> Option<f32> {
    let mut mean = None;
    for _ in 0..ROUNDS {
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in (0..beams.len()).filter(|&i| beams.returned[i] && share(i) > LOOKS_ALONG) {
            if let Some(v) = value(i).filter(|v| mean.is_none_or(|m: f32| (v - m).abs() < OUTLIER)) {
                sum += share(i) * v;
                weights += share(i);
            }
        }
        if weights < OBSERVED {
            return mean;
        }
        mean = Some(sum / weights);
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::SketchGrid;
    use sketchnav_schemas::codes::WALL;

    /// Draws a room whose inside is from (10, 10) to (70, 50) px, on a sheet of 80 × 60 px.
    fn room() -> Grid {
        let inside = |i: usize| (10..70).contains(&(i % 80)) && (10..50).contains(&(i / 80));
        let cells: Vec<u8> = (0..80 * 60).map(|i| if inside(i) { 0 } else { WALL }).collect();
        Grid::new(&SketchGrid::new(80, 60, &cells, 0.0).unwrap(), 1_000_000)
    }

    fn beams(of: &[(f32, f32)]) -> Beams {
        let mut beams = Beams { range_max_m: 10.0, ..Beams::with_capacity(of.len()) };
        of.iter().for_each(|&(angle_rad, range_m)| beams.push(angle_rad, range_m));
        beams
    }

    const POSE: ScaledPose = ScaledPose { x_px: 40.0, y_px: 30.0, yaw_rad: 0.0, a_pxpm: 10.0, b_pxpm: 10.0 };

    /// From the middle, (40, 30), the wall ahead is drawn at 30 px and measured at 2 m, the one behind at 30 px and 1 m, and the
    /// one to the left at 20 px and 4 m. Hence A = (30·2 + 30·1)/(2² + 1²) = 18 and B = 20·4/4² = 5, or with a single scale (30·2 +
    /// 30·1 + 20·4)/(2² + 1² + 4²) = 170/21. The average of the ratios would be (15 + 30)/2.
    #[test]
    fn equation_8_by_hand() {
        use std::f32::consts::{FRAC_PI_2, PI};
        let seen = beams(&[(0.0, 2.0), (PI, 1.0), (FRAC_PI_2, 4.0)]);
        let solve = |scales| least_squares(&room(), &ScaleFrame::new(0.0), &seen, &POSE, scales);
        let two = solve(Scales::Two);
        assert!(
            (two.a_pxpm.unwrap() - 18.0).abs() < 1e-3 && (two.b_pxpm.unwrap() - 5.0).abs() < 1e-3,
            "{two:?}"
        );
        let one = solve(Scales::One);
        assert!((one.a_pxpm.unwrap() - 170.0 / 21.0).abs() < 1e-3 && one.b_pxpm.is_none(), "{one:?}");
    }

    /// A beam to the left contains no information about the scale along the robot's heading.
    #[test]
    fn an_axis_that_no_beam_looks_along_is_not_observed() {
        let seen = beams(&[(std::f32::consts::FRAC_PI_2, 4.0)]);
        let found = least_squares(&room(), &ScaleFrame::new(0.0), &seen, &POSE, Scales::Two);
        assert!(found.a_pxpm.is_none() && found.b_pxpm.is_some());
    }

    /// For a′ = 18 and b′ = 5 against a = 12 and b = 6, with λ = 3 and ν = 2: −|18 − 12|/3 − |5 − 6|/2 = −2.5.
    #[test]
    fn the_laplace_terms_of_equation_7_by_hand() {
        let found = VirtualScales { a_pxpm: Some(18.0), b_pxpm: Some(5.0) };
        let ln = [12.0_f32.ln(), 6.0_f32.ln()];
        assert!((found.log_likelihood(ln, [3.0, 2.0]) + 2.5).abs() < 1e-5);
        let one = VirtualScales { a_pxpm: Some(18.0), b_pxpm: None };
        assert!((one.log_likelihood(ln, [3.0, 2.0]) + 2.0).abs() < 1e-5);
    }
}
