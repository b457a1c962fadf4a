//! The mapping of motions and beams in metres to the drawing (Boniardi et al. 2015, equations 2 and 3).

/// The direction φ of the frame R_S along whose axes the drawing is stretched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleFrame {
    direction_rad: f32,
    cos: f32,
    sin: f32,
}

impl ScaleFrame {
    /// Creates the frame from the direction of the walls, in radians in the sketch frame.
    pub fn new(wall_direction_rad: f64) -> Self {
        let direction_rad = wall_direction_rad as f32;
        Self { direction_rad, cos: direction_rad.cos(), sin: direction_rad.sin() }
    }

    /// Returns φ, its cosine and its sine.
    pub fn direction(&self) -> [f32; 3] {
        [self.direction_rad, self.cos, self.sin]
    }

    /// Returns R(φ)·diag(a, b)·R(−φ)·R(θ), which converts metres in the robot's axes to pixels.
    #[inline]
    pub fn px_from_base(&self, yaw_rad: f32, a_pxpm: f32, b_pxpm: f32) -> PxFromBase {
        let (sin, cos) = (yaw_rad - self.direction_rad).sin_cos();
        let (ac, as_, bc, bs) = (a_pxpm * cos, a_pxpm * sin, b_pxpm * cos, b_pxpm * sin);
        PxFromBase {
            xx: self.cos * ac - self.sin * bs,
            xy: -self.cos * as_ - self.sin * bc,
            yx: self.sin * ac + self.cos * bs,
            yy: -self.sin * as_ + self.cos * bc,
        }
    }

    /// Returns R(θ − φ)·(x, y), that is, a vector in the robot's axes expressed in those of this frame. Its components are the
    /// projections π_a and π_b of equation (8).
    pub fn frame_from_base(&self, yaw_rad: f32, x: f32, y: f32) -> [f32; 2] {
        let (sin, cos) = (yaw_rad - self.direction_rad).sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Returns R(φ)·diag(a, b), which converts lengths along and across the walls to pixels.
    pub fn px_from_frame(&self, a: f32, b: f32) -> PxFromBase {
        PxFromBase { xx: self.cos * a, xy: -self.sin * b, yx: self.sin * a, yy: self.cos * b }
    }

    /// Returns the squared cosine of the angle between axis a and the direction `yaw_rad`.
    pub fn share_of_a(&self, yaw_rad: f32) -> f32 {
        (yaw_rad - self.direction_rad).cos().powi(2)
    }
}

/// The 2 × 2 matrix from metres in the robot's axes to pixels in the drawing's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PxFromBase {
    xx: f32,
    xy: f32,
    yx: f32,
    yy: f32,
}

impl PxFromBase {
    /// Converts the vector (x, y) from metres to pixels.
    #[inline]
    pub fn apply(&self, x_m: f32, y_m: f32) -> [f32; 2] {
        [self.xx * x_m + self.xy * y_m, self.yx * x_m + self.yy * y_m]
    }
}

/// Wraps an angle to [−π, π), in the single precision of particles. [`super::lanes::wrap`] does this for sixteen angles at once.
#[inline]
pub fn wrap(angle_rad: f32) -> f32 {
    use std::f32::consts::{PI, TAU};
    angle_rad - TAU * floor((angle_rad + PI) / TAU)
}

/// Returns the greatest integer that does not exceed `x`, for |x| below 2³¹. Older processors have no instruction for this, and
/// [`f32::floor`] takes longer than the rest of [`wrap`].
#[inline]
fn floor(x: f32) -> f32 {
    let whole = x as i32 as f32;
    if whole > x { whole - 1.0 } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_that_of_the_library() {
        for x in (-40_000..40_000).map(|i| i as f32 * 0.037).chain([-0.0, 1e9, -1e9, -1.0, 7.0]) {
            assert_eq!(floor(x), x.floor(), "{x}");
        }
    }

    #[test]
    fn scales_act_along_the_walls() {
        let frame = ScaleFrame::new(std::f64::consts::FRAC_PI_6);
        // With the heading along the walls, a step forward is stretched by a, and a step to the left by b.
        let m = frame.px_from_base(std::f32::consts::FRAC_PI_6, 30.0, 10.0);
        let (forward, left) = (m.apply(1.0, 0.0), m.apply(0.0, 1.0));
        assert!((forward[0].hypot(forward[1]) - 30.0).abs() < 1e-4);
        assert!((left[0].hypot(left[1]) - 10.0).abs() < 1e-4);
        assert!((forward[1].atan2(forward[0]) - std::f32::consts::FRAC_PI_6).abs() < 1e-5);
    }
}
