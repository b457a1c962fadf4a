//! The parameters of the localization. The defaults were found in closed-loop drives.

use crate::method::Method;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::MAX_BEAMS;

/// The method by which the likelihood of a scan is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Likelihood {
    /// Equation (7) of Boniardi et al. 2015, with the scaled end points in a likelihood field and Laplace
    /// terms on the virtual scales of equation (8).
    Field,
    /// A beam model that compares measured ranges with ray-cast ones by the logarithm of their ratio. Beams
    /// without return count as well.
    Beam,
}

/// The number of local scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scales {
    /// Two independent scales, along the walls and across them (Boniardi et al. 2015, equation 3).
    Two,
    /// One scale for both directions, as in the predecessor of the paper, its reference 1.
    One,
}

/// The method by which the scales are estimated from the first scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartScales {
    /// Least squares by equation (8).
    LeastSquares,
    /// Means of the logarithms without outliers, such as objects that stand in front of the walls.
    TrimmedMean,
}

/// Parameters of the localization, from the table `parameters.localizer` of a mission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Maximum number of particles, 16 to 100 000.
    pub particles: usize,
    /// Minimum number of particles if their number adapts to the belief (Fox 2003). With 0, the number is
    /// always `particles`.
    pub least_particles: usize,
    /// Maximum Kullback-Leibler divergence ε of the particles' distribution from the belief.
    pub kld_error: f32,
    /// Width of the bins by which the spread of the belief is measured, in metres.
    pub bin_m: f32,
    /// Number of beams of a scan that are used, 4 to 1440, evenly spread.
    pub beams: usize,
    /// Method by which the likelihood of a scan is computed.
    pub likelihood: Likelihood,
    /// Effective number of independent beams of a scan in a hand drawing, since the beams of a scan are not independent. In a more
    /// accurate drawing, the number is higher by the square root of the ratio of the widths.
    pub independent_beams: f32,
    /// Distance travelled after which a scan is used, in metres.
    pub update_distance_m: f64,
    /// Angle turned after which a scan is used, in radians.
    pub update_turn_rad: f64,
    /// Share of effective particles below which the set is resampled.
    pub resample_below: f64,
    /// Maximum number of cells of the grid that the filter works on. A larger drawing is reduced.
    pub grid_cells: usize,

    /// Number of local scales.
    pub scales: Scales,
    /// Standard deviation of ε along each of the robot's axes, in metres per update (σ₁ and σ₂ of equation 6).
    pub step_noise_m: f32,
    /// Standard deviation of ε in the heading, in radians per update (σ₃ of equation 6).
    pub step_noise_rad: f32,
    /// Standard deviation of the Gamma noise η and ζ of the scales, per update (σ of Γ in equation 6).
    pub step_scale_noise: f32,
    /// Variance of the heading per metre travelled, in rad²/m.
    pub yaw_variance_per_m: f32,
    /// Variance of the heading per radian turned, in rad²/rad.
    pub yaw_variance_per_rad: f32,
    /// Standard deviation of the position along each axis after a metre, in m/√m.
    pub position_noise: f32,
    /// Standard deviation of the multiplicative Gamma noise of the scales after a metre, in 1/√m.
    pub scale_noise: f32,
    /// Rate at which a scale is drawn back to the drawing's mean scale, in 1/m. With 0, the scales are martingales as in the paper.
    pub scale_reversion_per_m: f32,
    /// Maximum distance of the logarithm of a scale from the drawing's mean.
    pub scale_limit: f32,
    /// Factor on the weight of a particle that crosses a drawn wall. With 1, walls have no effect.
    pub wall_crossing_factor: f32,
    /// Maximum opening, in metres by the drawing's extent, up to which the drawn outline counts as closed. The robot stays within a
    /// closed outline. With 0, it may always leave.
    pub outline_gap_m: f32,
    /// Width of a door, in metres by the drawing's extent, towards which narrower gaps in walls are widened.
    /// With 0, no gap is widened. Must be less than `outline_gap_m`, because otherwise a widened door would
    /// open the outline.
    pub door_width_m: f32,

    /// Number of particles while the robot may be anywhere in a drawing, 16 to 100 000. It is at least `particles`.
    pub anywhere_particles: usize,
    /// Effective number of independent beams of a scan while the robot may be anywhere in a drawing.
    pub anywhere_independent_beams: f32,
    /// Share of these particles that resampling scatters over the drawing again.
    pub fresh_share: f32,
    /// Share of the weight near the estimate above which particles that were scattered over a drawing agree on a place.
    pub placed_share: f64,
    /// Distance over which they must agree until the robot counts as placed, in metres.
    pub placed_after_m: f32,
    /// Whether the robot searches the whole map for its pose when it may be anywhere or is lost. This requires a map whose scale is
    /// known.
    pub searches: bool,

    /// Minimum spread of the start position, in metres.
    pub start_spread_m: f32,
    /// Minimum spread of the start heading, in radians.
    pub start_spread_rad: f32,
    /// Spread of the logarithms of the scales at the start.
    pub start_log_scale_spread: f32,
    /// Method by which the scales are estimated from the first scan.
    pub start_scales: StartScales,
    /// Share of the difference between the two scales in the first scan that is accepted, from 0 to 1.
    pub start_anisotropy: f32,
    /// Share of the particles that assume the whole drawing to be stretched, each by a different part of the stretch that the first
    /// scan shows. The others assume that the drawing as a whole is in proportion.
    pub anisotropic_share: f32,
    /// Extent of a typical building, in metres. Together with the extent of the drawing, it gives a guess of the scale. Not used in
    /// a learned map, whose scale is known.
    pub building_size_m: f32,
    /// Share of the drawing's mean scale that comes from `building_size_m` rather than from the first scan,
    /// from 0 to 1 (geometric mean). The first scan alone is not reliable, because it samples a single place
    /// and people draw places at very different scales. If the first scan sees nothing, the scale comes from
    /// `building_size_m` alone.
    pub start_size_share: f32,

    /// Standard deviation of the likelihood field, in metres.
    pub field_sigma_m: f32,
    /// Share of readings that are not explained by the drawing.
    pub field_random: f32,
    /// Width of the Laplace terms on the virtual scales, as a share of the mean scale (λ and ν of equation 7). With 0, there are no
    /// such terms.
    pub field_scale_width: f32,

    /// Width of the Laplace distribution of ln(measured / expected) for a hand drawing.
    pub hit_width: f32,
    /// Width of that distribution for a surveyed map. The width for the current drawing is between the two
    /// and is learned while driving.
    pub least_hit_width: f32,
    /// Share of readings at the expected range.
    pub z_hit: f32,
    /// Share of readings short of the expected range, from objects that are not drawn. It sets the minimum of the density there.
    pub z_short: f32,
    /// Share of readings that occur at any range.
    pub z_rand: f32,
    /// Maximum error of a bearing in the drawing, in radians. With 0, bearings are exact.
    pub bearing_error_rad: f32,
    /// Width of the Laplace distribution of the error of a bearing, in radians.
    pub bearing_width_rad: f32,

    /// Share of particles that resampling perturbs.
    pub perturbed_share: f32,
    /// Additional share of particles to perturb if the scans fit worse than before. It is multiplied by how much worse they fit,
    /// from 0 to 1.
    pub perturbed_share_lost: f32,
    /// Standard deviation of a perturbation of the position, in metres.
    pub perturbation_m: f32,
    /// Standard deviation of a perturbation of the heading, in radians.
    pub perturbation_rad: f32,
    /// Standard deviation of a perturbation of the logarithms of the scales.
    pub perturbation_log_scale: f32,

    /// Radius of the kernel that finds the densest pose, in metres.
    pub mode_radius_m: f32,
    /// Radius of the kernel in heading, in radians.
    pub mode_radius_rad: f32,
    /// Factor on the density near the last estimate, which the density near a rival has to exceed.
    pub mode_hysteresis: f32,

    /// Share of the weight near the estimate below which the estimate is doubtful, because other poses are plausible as well.
    pub one_place_share: f64,
    /// Mean log likelihood of a beam below which the estimate is doubtful.
    pub doubtful_below: f32,
    /// Mean log likelihood of a beam below which the robot is lost.
    pub lost_below: f32,
    /// Amount by which the fit must exceed `doubtful_below` or `lost_below` for the estimate to be trusted again.
    pub hysteresis: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            particles: 3000,
            least_particles: 0,
            kld_error: 0.05,
            bin_m: 0.5,
            beams: 48,
            likelihood: Likelihood::Beam,
            independent_beams: 2.2,
            update_distance_m: 0.2,
            update_turn_rad: 0.35,
            resample_below: 0.5,
            grid_cells: 500_000,
            scales: Scales::Two,
            step_noise_m: 0.0,
            step_noise_rad: 0.0,
            step_scale_noise: 0.0,
            yaw_variance_per_m: 0.01,
            yaw_variance_per_rad: 0.01,
            position_noise: 0.05,
            scale_noise: 0.4,
            scale_reversion_per_m: 0.5,
            scale_limit: 1.6,
            wall_crossing_factor: 0.3,
            outline_gap_m: 1.5,
            door_width_m: 0.7,
            anywhere_particles: 30_000,
            anywhere_independent_beams: 1.0,
            fresh_share: 0.1,
            placed_share: 0.8,
            placed_after_m: 4.0,
            searches: false,
            start_spread_m: 0.4,
            start_spread_rad: 0.08,
            start_log_scale_spread: 0.45,
            start_scales: StartScales::TrimmedMean,
            start_anisotropy: 0.0,
            anisotropic_share: 0.2,
            building_size_m: 25.0,
            start_size_share: 0.5,
            field_sigma_m: 0.25,
            field_random: 0.1,
            field_scale_width: 0.3,
            hit_width: 0.25,
            least_hit_width: 0.08,
            z_hit: 0.65,
            z_short: 0.09,
            z_rand: 0.26,
            bearing_error_rad: 0.35,
            bearing_width_rad: 0.87,
            perturbed_share: 0.05,
            perturbed_share_lost: 0.3,
            perturbation_m: 0.4,
            perturbation_rad: 0.15,
            perturbation_log_scale: 0.3,
            mode_radius_m: 0.6,
            mode_radius_rad: 0.35,
            mode_hysteresis: 1.3,
            one_place_share: 0.3,
            doubtful_below: -1.2,
            lost_below: -1.9,
            hysteresis: 0.2,
        }
    }
}

impl Parameters {
    /// Returns the default parameters of a method.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Beam | Method::Outline => Self::default(),
            Method::Boniardi2015 => Self::paper(),
            Method::Boniardi2015FixedScale => Self::fixed_scale(),
            Method::Behzadian2015 => Self::one_scale(),
        }
    }

    /// Returns the parameters for a map recorded by laser, in which the robot may be anywhere. The scale is known and the same
    /// everywhere. Once the search has found the robot, few particles are enough (Fox 2003).
    pub fn learned() -> Self {
        Self {
            least_particles: 1500,
            scale_noise: 0.0,
            scale_limit: 1e-4,
            start_log_scale_spread: 0.0,
            start_size_share: 1.0,
            anisotropic_share: 0.0,
            perturbation_log_scale: 0.0,
            outline_gap_m: 0.0,
            door_width_m: 0.0,
            bearing_error_rad: 0.1,
            searches: true,
            one_place_share: 0.7,
            ..Self::default()
        }
    }

    /// Returns parameters that follow equations 2 to 8 of Boniardi et al. 2015 as written. Values not given in the paper were
    /// chosen as its authors describe (Boniardi et al. 2016, V-B): those of odometry and sensor with the true floor plan as the
    /// drawing, and the variances of the scales as a compromise between following the drawing and avoiding false matches.
    pub fn paper() -> Self {
        Self {
            // Not given.
            particles: 2000,
            // N of equation (7), not given.
            beams: 48,
            // Equation (7) is a product over all beams, which therefore count as independent.
            independent_beams: MAX_BEAMS as f32,
            likelihood: Likelihood::Field,
            // III-A: "finally resampled", in each iteration.
            resample_below: 1.0,
            // Noise of equation (6), independent of the distance driven: σ₁ = σ₂, σ₃ and Γ(σ⁻², σ²). Not given.
            step_noise_m: 0.03,
            step_noise_rad: 0.05,
            step_scale_noise: 0.07,
            position_noise: 0.0,
            yaw_variance_per_m: 0.0,
            yaw_variance_per_rad: 0.0,
            scale_noise: 0.0,
            // The scales of equation (6) are martingales on all of ℝ₊. The limit of e⁴ only keeps the arithmetic in bounds.
            scale_reversion_per_m: 0.0,
            scale_limit: 4.0,
            // Drawn walls do not stop a particle.
            wall_crossing_factor: 1.0,
            outline_gap_m: 0.0,
            door_width_m: 0.0,
            // IV: "estimated … applying the least-square approximation".
            start_scales: StartScales::LeastSquares,
            start_anisotropy: 1.0,
            anisotropic_share: 0.0,
            start_size_share: 0.0,
            start_log_scale_spread: 0.15,
            // σ, λ and ν of equation (7), not given.
            field_sigma_m: 0.25,
            field_random: 0.1,
            field_scale_width: 0.3,
            // The fit of a scan is judged by a plain comparison of ranges, without learning.
            z_hit: 0.75,
            z_short: 0.15,
            z_rand: 0.1,
            least_hit_width: 0.25,
            bearing_error_rad: 0.0,
            // The paper has no recovery.
            perturbed_share: 0.0,
            perturbed_share_lost: 0.0,
            ..Self::default()
        }
    }

    /// Returns the parameters of the paper's special case of one scale, which is derived from the first scan and never changes.
    pub fn fixed_scale() -> Self {
        Self {
            scales: Scales::One,
            step_scale_noise: 0.0,
            start_log_scale_spread: 0.0,
            field_scale_width: 0.0,
            ..Self::paper()
        }
    }

    /// Returns the parameters of the paper's special case of a single tracked local scale, as in the predecessor of the paper, its
    /// reference 1.
    pub fn one_scale() -> Self {
        Self { scales: Scales::One, ..Self::paper() }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`ParameterError`] for the first invalid parameter, which gives the key, what was expected and what
    /// was found.
    pub fn check(&self) -> Result<(), ParameterError> {
        let counts = [
            ("particles", "16 to 100000", self.particles, 16..=100_000),
            ("anywhere_particles", "16 to 100000", self.anywhere_particles, 16..=100_000),
            ("least_particles", "0 to 100000", self.least_particles, 0..=100_000),
            ("beams", "4 to 1440", self.beams, 4..=MAX_BEAMS),
            ("grid_cells", "1000 to 4000000", self.grid_cells, 1000..=4_000_000),
        ];
        for (key, expected, found, range) in counts {
            expect(key, expected, found as f64, range.contains(&found))?;
        }
        for (key, found) in self.positive() {
            expect(key, "a number above 0", found, found.is_finite() && found > 0.0)?;
        }
        for (key, found) in self.not_negative() {
            expect(key, "a number of 0 or more", found, found.is_finite() && found >= 0.0)?;
        }
        let widths = [("hit_width", self.hit_width), ("least_hit_width", self.least_hit_width)];
        for (key, found) in widths {
            expect(key, "a width from 0.05 to 10", found.into(), (0.05..=10.0).contains(&found))?;
        }
        let below = self.least_hit_width <= self.hit_width;
        let found = self.least_hit_width.into();
        expect("least_hit_width", "no more than hit_width", found, below)?;
        let below = self.outline_gap_m == 0.0 || self.door_width_m < self.outline_gap_m;
        expect("door_width_m", "less than outline_gap_m", self.door_width_m.into(), below)?;
        for (key, found) in self.shares() {
            expect(key, "a share from 0 to 1", found, (0.0..=1.0).contains(&found))?;
        }
        for (key, found) in [("doubtful_below", self.doubtful_below), ("lost_below", self.lost_below)] {
            expect(key, "a finite number", found.into(), found.is_finite())?;
        }
        let below = self.lost_below <= self.doubtful_below;
        expect("lost_below", "no more than doubtful_below", self.lost_below.into(), below)
    }

    fn positive(&self) -> [(&'static str, f64); 15] {
        [
            ("kld_error", self.kld_error.into()),
            ("bin_m", self.bin_m.into()),
            ("independent_beams", self.independent_beams.into()),
            ("anywhere_independent_beams", self.anywhere_independent_beams.into()),
            ("placed_after_m", self.placed_after_m.into()),
            ("update_distance_m", self.update_distance_m),
            ("update_turn_rad", self.update_turn_rad),
            ("scale_limit", self.scale_limit.into()),
            ("wall_crossing_factor", self.wall_crossing_factor.into()),
            ("building_size_m", self.building_size_m.into()),
            ("field_sigma_m", self.field_sigma_m.into()),
            ("bearing_width_rad", self.bearing_width_rad.into()),
            ("mode_radius_m", self.mode_radius_m.into()),
            ("mode_radius_rad", self.mode_radius_rad.into()),
            ("mode_hysteresis", self.mode_hysteresis.into()),
        ]
    }

    fn not_negative(&self) -> [(&'static str, f64); 19] {
        [
            ("outline_gap_m", self.outline_gap_m.into()),
            ("door_width_m", self.door_width_m.into()),
            ("step_noise_m", self.step_noise_m.into()),
            ("step_noise_rad", self.step_noise_rad.into()),
            ("step_scale_noise", self.step_scale_noise.into()),
            ("yaw_variance_per_m", self.yaw_variance_per_m.into()),
            ("yaw_variance_per_rad", self.yaw_variance_per_rad.into()),
            ("position_noise", self.position_noise.into()),
            ("scale_noise", self.scale_noise.into()),
            ("scale_reversion_per_m", self.scale_reversion_per_m.into()),
            ("start_spread_m", self.start_spread_m.into()),
            ("start_spread_rad", self.start_spread_rad.into()),
            ("start_log_scale_spread", self.start_log_scale_spread.into()),
            ("field_scale_width", self.field_scale_width.into()),
            ("perturbation_m", self.perturbation_m.into()),
            ("perturbation_rad", self.perturbation_rad.into()),
            ("perturbation_log_scale", self.perturbation_log_scale.into()),
            ("bearing_error_rad", self.bearing_error_rad.into()),
            ("hysteresis", self.hysteresis.into()),
        ]
    }

    fn shares(&self) -> [(&'static str, f64); 13] {
        [
            ("fresh_share", self.fresh_share.into()),
            ("placed_share", self.placed_share),
            ("one_place_share", self.one_place_share),
            ("resample_below", self.resample_below),
            ("start_anisotropy", self.start_anisotropy.into()),
            ("anisotropic_share", self.anisotropic_share.into()),
            ("start_size_share", self.start_size_share.into()),
            ("field_random", self.field_random.into()),
            ("z_hit", self.z_hit.into()),
            ("z_short", self.z_short.into()),
            ("z_rand", self.z_rand.into()),
            ("perturbed_share", self.perturbed_share.into()),
            ("perturbed_share_lost", self.perturbed_share_lost.into()),
        ]
    }
}

/// An invalid parameter.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameters.localizer.{key}: expected {expected}, found {found}")]
pub struct ParameterError {
    /// The key.
    pub key: &'static str,
    /// What was expected.
    pub expected: &'static str,
    /// What was found.
    pub found: f64,
}

fn expect(key: &'static str, expected: &'static str, found: f64, holds: bool) -> Result<(), ParameterError> {
    if holds { Ok(()) } else { Err(ParameterError { key, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_hold() {
        for method in Method::ALL {
            assert_eq!(Parameters::of(method).check(), Ok(()), "{method}");
        }
    }

    #[test]
    fn an_error_names_the_key() {
        let wrong = Parameters { beams: 1, ..Parameters::default() };
        let error = wrong.check().unwrap_err().to_string();
        assert_eq!(error, "parameters.localizer.beams: expected 4 to 1440, found 1");
        let wrong = Parameters { scale_noise: f32::NAN, ..Parameters::default() };
        assert_eq!(wrong.check().unwrap_err().key, "scale_noise");
    }
}
