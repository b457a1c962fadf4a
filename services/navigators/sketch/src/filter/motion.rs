//! The evolution of the state (Boniardi et al. 2015, equation 6), which applies odometry through the local
//! metric and Gamma noise to the scales.
//!
//! Noise that grows with the distance travelled depends on the drive. An omnidirectional drive has independent errors ahead, to the
//! left and in its heading. A differential drive, which cannot slide sideways, turns, rolls and turns again, with an error in each
//! (Thrun, Burgard and Fox, *Probabilistic Robotics*, table 5.6).

use rand::RngExt;
use rand_distr::{Distribution, Gamma, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::robot::Drive;

use super::grid::Grid;
use super::metric::{ScaleFrame, wrap};
use super::parameters::{Parameters, Scales};
use super::particles::ParticleSet;

/// The robot's motion between two updates according to the odometry, in the robot's axes at the first update.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Displacement forward, in metres.
    pub forward_m: f32,
    /// Displacement to the left, in metres.
    pub left_m: f32,
    /// Turn, in radians.
    pub turn_rad: f32,
    /// Length of the path, in metres.
    pub distance_m: f32,
    /// Sum of the absolute values of all turns, in radians.
    pub turned_rad: f32,
}

/// The surroundings in which the particles move.
#[derive(Debug, Clone, Copy)]
pub struct Terrain<'a> {
    /// The drawing.
    pub grid: &'a Grid,
    /// The axes along which the drawing is stretched.
    pub frame: &'a ScaleFrame,
    /// Proportions of the drawing as a whole.
    pub proportions: Proportions,
}

/// The proportions of the drawing as a whole, as suggested by the first scan.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Proportions {
    /// Mean scales of the drawing, as (ln a, ln b).
    pub mean_ln_scales: [f32; 2],
    /// Half the logarithm of the ratio of scale a to scale b in the first scan.
    pub first_anisotropy: f32,
}

impl Proportions {
    /// Returns the geometric mean of the two mean scales, in pixels per metre.
    pub fn mean_scale_pxpm(&self) -> f32 {
        let [ln_a, ln_b] = self.mean_ln_scales;
        ((ln_a + ln_b) / 2.0).exp()
    }

    /// Returns the mean scales, as (ln a, ln b), of a drawing that is stretched by `anisotropy` as a whole.
    pub(super) fn mean_ln_scales_by(&self, anisotropy: f32) -> [f32; 2] {
        let [mean_a, mean_b] = self.mean_ln_scales;
        [mean_a + anisotropy, mean_b - anisotropy]
    }

    /// Draws a particle's assumption about the stretch of the whole drawing. Most particles assume none, since most drawings are in
    /// proportion except in a few places. But some drawings are stretched from end to end, so a share of `anisotropic_share`
    /// assumes a part of the stretch that the first scan shows.
    pub(super) fn anisotropy(&self, p: &Parameters, rng: &mut Pcg64Mcg) -> f32 {
        let is_anisotropic = p.anisotropic_share > 0.0 && rng.random::<f32>() < p.anisotropic_share;
        if is_anisotropic { self.first_anisotropy * rng.random::<f32>() } else { 0.0 }
    }
}

/// Standard deviations of one propagation.
struct Spread {
    forward_m: f32,
    left_m: f32,
    /// Standard deviation of the heading before the motion.
    first_yaw_rad: f32,
    /// Standard deviation of the heading after the motion.
    yaw_rad: f32,
    /// Distribution Γ(σ⁻², σ²) of the factor on the scales, whose mean is one. `None` if the scales do not change.
    scale: Option<Gamma<f32>>,
    /// Share of its deviation by which a scale returns to the mean.
    reversion: f32,
}

impl Spread {
    fn new(motion: &Motion, drive: Drive, p: &Parameters) -> Self {
        let yaw_variance =
            p.yaw_variance_per_m * motion.distance_m + p.yaw_variance_per_rad * motion.turned_rad;
        let scale_variance = p.step_scale_noise.powi(2) + p.scale_noise.powi(2) * motion.distance_m;
        let (step_variance, step_yaw_variance) = (p.step_noise_m.powi(2), p.step_noise_rad.powi(2));
        let way_variance = p.position_noise.powi(2) * motion.distance_m;
        let (left_share, first_share) = match drive {
            Drive::Omnidirectional => (1.0, 0.0),
            Drive::Differential => (0.0, 0.5),
        };
        Self {
            forward_m: (step_variance + way_variance).sqrt(),
            left_m: (step_variance + left_share * way_variance).sqrt(),
            first_yaw_rad: (first_share * yaw_variance).sqrt(),
            yaw_rad: (step_yaw_variance + (1.0 - first_share) * yaw_variance).sqrt(),
            scale: Gamma::new(1.0 / scale_variance.max(1e-9), scale_variance.max(1e-9))
                .ok()
                .filter(|_| scale_variance > 1e-9),
            reversion: 1.0 - (-p.scale_reversion_per_m * motion.distance_m).exp(),
        }
    }

    /// Returns the logarithm of a scale after the motion, which draws the scale back to `mean`, multiplies it by Gamma noise and
    /// clamps it to within `limit` of `mean`.
    fn evolve(&self, ln_scale: f32, mean: f32, limit: f32, rng: &mut Pcg64Mcg) -> f32 {
        let noise = self.scale.as_ref().map_or(0.0, |gamma| gamma.sample(rng).max(1e-3).ln());
        let drawn_back = ln_scale - self.reversion * (ln_scale - mean);
        (drawn_back + noise).clamp(mean - limit, mean + limit)
    }
}

/// Moves every particle by `motion` and noise, converted by the particle's scales before the motion. Reduces the weight of
/// particles that cross a drawn wall.
pub fn propagate(
    set: &mut ParticleSet,
    motion: &Motion,
    drive: Drive,
    terrain: &Terrain<'_>,
    parameters: &Parameters,
    rng: &mut Pcg64Mcg,
) {
    let spread = Spread::new(motion, drive, parameters);
    let crossing = parameters.wall_crossing_factor.ln();
    for i in 0..set.len() {
        let yaw_rad = set.yaw_rad[i] + spread.first_yaw_rad * normal(rng);
        let metric = terrain.frame.px_from_base(yaw_rad, set.ln_a[i].exp(), set.ln_b[i].exp());
        let forward = motion.forward_m + spread.forward_m * normal(rng);
        let left = motion.left_m + spread.left_m * normal(rng);
        let step = metric.apply(forward, left);
        let from = [set.x_px[i], set.y_px[i]];
        let to = [from[0] + step[0], from[1] + step[1]];
        if crossing != 0.0 && terrain.grid.crosses_wall(from, to) {
            set.log_weight[i] += crossing;
        }
        (set.x_px[i], set.y_px[i]) = (to[0], to[1]);
        set.yaw_rad[i] = wrap(yaw_rad + motion.turn_rad + spread.yaw_rad * normal(rng));
        let [mean_a, mean_b] = terrain.proportions.mean_ln_scales_by(set.anisotropy[i]);
        set.ln_a[i] = spread.evolve(set.ln_a[i], mean_a, parameters.scale_limit, rng);
        set.ln_b[i] = match parameters.scales {
            Scales::Two => spread.evolve(set.ln_b[i], mean_b, parameters.scale_limit, rng),
            Scales::One => set.ln_a[i],
        };
    }
}

/// Perturbs each particle with probability `share`. Position, heading and scales get wide noise, so that the set can return to a
/// pose that it had abandoned. No particle is moved into a wall.
pub fn perturb(
    set: &mut ParticleSet,
    share: f32,
    terrain: &Terrain<'_>,
    parameters: &Parameters,
    rng: &mut Pcg64Mcg,
) {
    let p = parameters;
    let bounded = |ln: f32, mean: f32| ln.clamp(mean - p.scale_limit, mean + p.scale_limit);
    for i in 0..set.len() {
        if rng.random::<f32>() >= share {
            continue;
        }
        let metric = terrain.frame.px_from_base(set.yaw_rad[i], set.ln_a[i].exp(), set.ln_b[i].exp());
        let step = metric.apply(p.perturbation_m * normal(rng), p.perturbation_m * normal(rng));
        let (x, y) = (set.x_px[i] + step[0], set.y_px[i] + step[1]);
        if !terrain.grid.is_wall(x, y) {
            (set.x_px[i], set.y_px[i]) = (x, y);
        }
        set.yaw_rad[i] = wrap(set.yaw_rad[i] + p.perturbation_rad * normal(rng));
        set.anisotropy[i] = terrain.proportions.anisotropy(p, rng);
        let [mean_a, mean_b] = terrain.proportions.mean_ln_scales_by(set.anisotropy[i]);
        set.ln_a[i] = bounded(set.ln_a[i] + p.perturbation_log_scale * normal(rng), mean_a);
        set.ln_b[i] = match p.scales {
            Scales::Two => bounded(set.ln_b[i] + p.perturbation_log_scale * normal(rng), mean_b),
            Scales::One => set.ln_a[i],
        };
    }
}

/// Returns a random free position in the drawing, or `None` if a hundred attempts find none.
pub(super) fn free_place_anywhere(terrain: &Terrain<'_>, rng: &mut Pcg64Mcg) -> Option<[f32; 2]> {
    let mut place = || terrain.grid.size_px().map(|size| size * rng.random::<f32>());
    std::iter::repeat_with(&mut place).take(100).find(|&[x, y]| !terrain.grid.is_wall(x, y))
}

/// Draws scales, as (ln a, ln b), around their mean. Part of the error is common to both axes, and the rest is independent.
pub fn scales_about(mean_ln_scales: [f32; 2], parameters: &Parameters, rng: &mut Pcg64Mcg) -> [f32; 2] {
    let shared = 0.6 * normal(rng);
    let mut error = || parameters.start_log_scale_spread * (shared + 0.8 * normal(rng));
    let ln_a = mean_ln_scales[0] + error();
    match parameters.scales {
        Scales::Two => [ln_a, mean_ln_scales[1] + error()],
        Scales::One => [ln_a; 2],
    }
}

/// Draws from the standard normal distribution.
pub fn normal(rng: &mut Pcg64Mcg) -> f32 {
    StandardNormal.sample(rng)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sketch::SketchGrid;
    use sketchnav_schemas::seed;

    const OMNI: Drive = Drive::Omnidirectional;

    fn open_floor() -> Grid {
        Grid::new(&SketchGrid::new(400, 400, &vec![0; 160_000], 0.0).unwrap(), 1_000_000)
    }

    fn terrain<'a>(grid: &'a Grid, frame: &'a ScaleFrame) -> Terrain<'a> {
        Terrain {
            grid,
            frame,
            proportions: Proportions { mean_ln_scales: [3.0, 3.0], first_anisotropy: 0.0 },
        }
    }

    /// Returns twenty thousand particles that began at the same position, with the scales 30 and 10 px/m, after a motion.
    fn moved(motion: &Motion, parameters: &Parameters) -> ParticleSet {
        let (grid, frame) = (open_floor(), ScaleFrame::new(0.0));
        let mut set = ParticleSet::new(20_000);
        set.ln_a.fill(30.0_f32.ln());
        set.ln_b.fill(10.0_f32.ln());
        let mut rng = seed::stream(1, "test");
        propagate(&mut set, motion, OMNI, &terrain(&grid, &frame), parameters, &mut rng);
        set
    }

    /// Regression test: particles were perturbed along the axes of the picture, although a drawing is stretched along its walls. In
    /// a drawing tilted by 45°, they moved equally far along and across a corridor drawn nine times too long.
    #[test]
    fn a_perturbation_is_stretched_along_the_walls() {
        let (grid, frame) = (open_floor(), ScaleFrame::new(std::f64::consts::FRAC_PI_4));
        let mut set = ParticleSet::new(20_000);
        set.x_px.fill(200.0);
        set.y_px.fill(200.0);
        set.ln_a.fill(45.0_f32.ln());
        set.ln_b.fill(5.0_f32.ln());
        let parameters = Parameters { perturbation_m: 1.0, ..Parameters::default() };
        perturb(&mut set, 1.0, &terrain(&grid, &frame), &parameters, &mut seed::stream(1, "test"));
        // In the axes of the walls, u = (x + y)/√2 and v = (y − x)/√2, the standard deviations are 45 and 5 px.
        let spread = |sign: f32| {
            let along = |(x, y): (&f32, &f32)| ((y - 200.0) + sign * (x - 200.0)) / 2.0_f32.sqrt();
            (set.x_px.iter().zip(&set.y_px).map(|p| along(p).powi(2)).sum::<f32>() / 20_000.0).sqrt()
        };
        assert!(
            (spread(1.0) - 45.0).abs() < 1.0 && (spread(-1.0) - 5.0).abs() < 0.2,
            "{} {}",
            spread(1.0),
            spread(-1.0)
        );
    }

    fn sample(of: impl Iterator<Item = f32> + Clone) -> (f64, f64) {
        let n = of.clone().count() as f64;
        let mean = of.clone().map(f64::from).sum::<f64>() / n;
        let variance = of.map(|v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n;
        (mean, variance.sqrt())
    }

    /// In equation (6), η and ζ are drawn independently from Γ(σ⁻², σ²), with the mean σ⁻²·σ² = 1 and the variance σ⁻²·σ⁴ = σ². The
    /// mean scales remain 30 and 10 in any case.
    #[test]
    fn the_scales_are_martingales() {
        for (parameters, motion) in [
            (Parameters { step_scale_noise: 0.15, ..Parameters::paper() }, Motion::default()),
            // The same noise as a function of distance, 0.1/√m over 2.25 m.
            (
                Parameters { step_scale_noise: 0.0, scale_noise: 0.1, ..Parameters::paper() },
                Motion { distance_m: 2.25, ..Motion::default() },
            ),
        ] {
            let set = moved(&motion, &parameters);
            let (mean_a, deviation_a) = sample(set.ln_a.iter().map(|ln| ln.exp()));
            let (mean_b, deviation_b) = sample(set.ln_b.iter().map(|ln| ln.exp()));
            assert!((mean_a - 30.0).abs() < 0.1 && (mean_b - 10.0).abs() < 0.05, "{mean_a} {mean_b}");
            assert!((deviation_a - 4.5).abs() < 0.1 && (deviation_b - 1.5).abs() < 0.05, "{deviation_a}");
            let together = set.ln_a.iter().zip(&set.ln_b).map(|(a, b)| (a.exp() - 30.0) * (b.exp() - 10.0));
            assert!(sample(together).0.abs() < 0.2, "they hang together");
        }
    }

    /// After 1 m ahead with 0.1/√m, an omnidirectional robot is off by 0.1 m to either side. A differential robot is off to the
    /// side only because of its initial heading error, by √(0.04/2) rad or 0.141 m.
    #[test]
    fn who_cannot_slide_is_off_to_the_side_by_its_heading_alone() {
        let (grid, frame) = (open_floor(), ScaleFrame::new(0.0));
        let sideways = |drive, yaw_variance_per_m| {
            let noise = Parameters { position_noise: 0.1, yaw_variance_per_m, ..Parameters::default() };
            let motion = Motion { forward_m: 1.0, distance_m: 1.0, ..Motion::default() };
            let mut set = ParticleSet::new(20_000);
            propagate(
                &mut set,
                &motion,
                drive,
                &terrain(&grid, &frame),
                &noise,
                &mut seed::stream(1, "test"),
            );
            let heading = sample(set.yaw_rad.iter().copied()).1;
            assert!((heading - f64::from(yaw_variance_per_m).sqrt()).abs() < 0.005, "{heading}");
            sample(set.y_px.iter().copied()).1
        };
        assert!((sideways(Drive::Omnidirectional, 0.04) - 0.1).abs() < 0.003);
        assert_eq!(sideways(Drive::Differential, 0.0), 0.0);
        assert!((sideways(Drive::Differential, 0.04) - 0.141).abs() < 0.005);
    }

    /// Regression test: the scales of all particles were drawn back to the same mean along and across the walls. In some drawings
    /// one scale is nine times the other from end to end, and hardly one of three thousand particles fitted such a drawing.
    #[test]
    fn some_believe_that_the_whole_is_drawn_as_the_first_scan_has_it() {
        let (grid, frame) = (open_floor(), ScaleFrame::new(0.0));
        let mut terrain = terrain(&grid, &frame);
        terrain.proportions.first_anisotropy = 1.1;
        let parameters = Parameters { scale_noise: 0.0, position_noise: 0.0, ..Parameters::default() };
        let mut rng = seed::stream(1, "test");
        let mut set = ParticleSet::new(20_000);
        perturb(&mut set, 1.0, &terrain, &parameters, &mut rng);
        let believers: Vec<f32> = set.anisotropy.iter().copied().filter(|&part| part != 0.0).collect();
        assert!((3800..4200).contains(&believers.len()), "a fifth of them: {}", believers.len());
        // Each assumes its own part of the stretch, uniform from 0 to 1.1.
        let (mean, deviation) = sample(believers.iter().copied());
        assert!((mean - 0.55).abs() < 0.02 && (deviation - 1.1 / 12.0_f64.sqrt()).abs() < 0.02);
        assert!(believers.iter().all(|part| (0.0..=1.1).contains(part)));
        // After a long drive, each has the scales of the drawing that it assumes.
        let far = Motion { distance_m: 100.0, ..Motion::default() };
        propagate(&mut set, &far, OMNI, &terrain, &parameters, &mut rng);
        for i in 0..set.len() {
            let off = [set.ln_a[i] - 3.0 - set.anisotropy[i], set.ln_b[i] - 3.0 + set.anisotropy[i]];
            assert!(off.iter().all(|off| off.abs() < 1e-3), "{off:?}");
        }
    }

    #[test]
    fn one_scale_stays_one() {
        let (grid, frame) = (open_floor(), ScaleFrame::new(0.3));
        let mut set = ParticleSet::new(100);
        let parameters = Parameters { perturbation_log_scale: 0.3, ..Parameters::one_scale() };
        let mut rng = seed::stream(1, "test");
        propagate(&mut set, &Motion::default(), OMNI, &terrain(&grid, &frame), &parameters, &mut rng);
        perturb(&mut set, 1.0, &terrain(&grid, &frame), &parameters, &mut rng);
        assert_eq!(set.ln_a, set.ln_b);
        assert!(sample(set.ln_a.iter().copied()).1 > 0.1);
    }

    /// The noise ε of equation (6) is in metres. With the scales 30 and 10, σ₁ = σ₂ = 0.1 m corresponds to 3 px along the walls and
    /// 1 px across. In addition, σ₃ = 0.2 rad.
    #[test]
    fn the_noise_of_a_step_goes_through_the_scales() {
        let parameters = Parameters { step_noise_m: 0.1, step_noise_rad: 0.2, ..Parameters::paper() };
        let set = moved(&Motion::default(), &parameters);
        for (column, deviation) in [(&set.x_px, 3.0), (&set.y_px, 1.0), (&set.yaw_rad, 0.2)] {
            let found = sample(column.iter().copied());
            assert!(
                found.0.abs() < 0.03 * deviation && (found.1 / deviation - 1.0).abs() < 0.03,
                "{found:?}"
            );
        }
    }

    /// By equation (6), with the scales 30 along the walls and 10 across, 0.5 m ahead are 15 px along the walls and 5 px across.
    #[test]
    fn a_step_is_stretched_by_each_particle_own_scales() {
        let (grid, frame) = (open_floor(), ScaleFrame::new(0.0));
        let quiet = Parameters { step_noise_m: 0.0, step_noise_rad: 0.0, ..Parameters::paper() };
        let mut set = ParticleSet::new(16);
        set.ln_a.fill(30.0_f32.ln());
        set.ln_b.fill(10.0_f32.ln());
        set.x_px.fill(100.0);
        set.y_px.fill(100.0);
        set.yaw_rad[1] = std::f32::consts::FRAC_PI_2;
        let motion = Motion { forward_m: 0.5, left_m: 0.0, turn_rad: 0.1, distance_m: 0.5, turned_rad: 0.1 };
        propagate(&mut set, &motion, OMNI, &terrain(&grid, &frame), &quiet, &mut seed::stream(1, "test"));
        assert!((set.x_px[0] - 115.0).abs() < 1e-3 && (set.y_px[0] - 100.0).abs() < 1e-3);
        assert!((set.x_px[1] - 100.0).abs() < 1e-3 && (set.y_px[1] - 105.0).abs() < 1e-3);
    }
}
