//! Virtual measurements of the two scales (paper 001, equation 8): what the scales would have to be
//! for the ray-traced end points to be those of the scan.

use super::beams::Beams;
use super::grid::Grid;
use super::metric::ScaleFrame;
use super::observation::expected_range;

/// A pose with scales, as a particle has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaledPose {
    /// Position, pixels.
    pub x_px: f32,
    /// Position, pixels, upwards.
    pub y_px: f32,
    /// Heading, radians.
    pub yaw_rad: f32,
    /// Scale along the wall direction, pixels a metre.
    pub a_pxpm: f32,
    /// Scale across, pixels a metre.
    pub b_pxpm: f32,
}

/// Scales that ray tracing suggests; `None` along an axis that no beam looks along.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VirtualScales {
    /// a′ of equation (8), pixels a metre.
    pub a_pxpm: Option<f32>,
    /// b′ of equation (8), pixels a metre.
    pub b_pxpm: Option<f32>,
}

/// Beams further than this from an axis say nothing of its scale: squared cosine.
const LOOKS_ALONG: f32 = 0.5;
/// Sum of squared cosines below which an axis is not observed.
const OBSERVED: f32 = 2.0;
/// Logarithms of ratios further than this from their mean are outliers: a door, a piece of furniture.
const OUTLIER: f32 = 0.5;
/// Rounds of averaging without the outliers.
const ROUNDS: usize = 3;

/// Solves equation (8) at `pose`: along each axis the mean, in the logarithm, of the ratio of the
/// ray-traced to the measured projection. Along a beam, whose direction `pose`'s own scales give, the
/// ratio of the projections is that of the lengths, times the scale; the mean is taken again without
/// the outliers.
pub fn virtual_scales(grid: &Grid, frame: &ScaleFrame, beams: &Beams, pose: &ScaledPose) -> VirtualScales {
    let metric = frame.px_from_base(pose.yaw_rad, pose.a_pxpm, pose.b_pxpm);
    let expected = |i: usize| expected_range(grid, beams, i, [pose.x_px, pose.y_px], &metric);
    // Inside a wall nothing can be traced.
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

/// Scales at the start, from the first scan: equation (8) solved again and again, since the
/// direction of a beam in the drawing depends on the scales. An axis that is not observed takes the
/// other's scale; `guess_pxpm` where neither is. The result stays within a factor of eight of the guess.
pub fn initial_scales(
    grid: &Grid,
    frame: &ScaleFrame,
    beams: &Beams,
    start: [f32; 3],
    guess_pxpm: f32,
) -> [f32; 2] {
    let [x_px, y_px, yaw_rad] = start;
    let mut pose = ScaledPose { x_px, y_px, yaw_rad, a_pxpm: guess_pxpm, b_pxpm: guess_pxpm };
    for _ in 0..6 {
        let found = virtual_scales(grid, frame, beams, &pose);
        let bounded = |scale: f32| scale.clamp(guess_pxpm / 8.0, guess_pxpm * 8.0);
        let (a, b) = (found.a_pxpm.map(bounded), found.b_pxpm.map(bounded));
        pose.a_pxpm = a.or(b).unwrap_or(guess_pxpm);
        pose.b_pxpm = b.or(a).unwrap_or(guess_pxpm);
    }
    [pose.a_pxpm, pose.b_pxpm]
}
