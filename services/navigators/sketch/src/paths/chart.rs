//! The chart that relates the drawing to the metres around the robot (Boniardi et al. 2015, equations 2 and
//! 3).
//!
//! Near the estimated pose, the drawing is an affine image of the floor, turned by the heading and stretched
//! by a along the walls' direction φ and by b across it. The chart is only valid for a few metres around the
//! robot, because the drawing has a different scale farther away.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch};

use crate::messages::PoseEstimate;

/// Converts places in the drawing to the odometry frame and back.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Chart {
    robot_px: Pose<Sketch>,
    robot_m: Pose<Odom>,
    scales_pxpm: [f64; 2],
    /// R(φ)·diag(a, b)⁻¹·R(−φ), which converts pixels to metres along the drawing's axes.
    metres_from_pixels: [[f64; 2]; 2],
    /// The inverse of `metres_from_pixels`.
    pixels_from_metres: [[f64; 2]; 2],
    /// Cosine and sine of the angle from the drawing's axes to those of the odometry frame.
    turn: [f64; 2],
}

impl Chart {
    /// Creates a chart from an estimate and the walls' direction, in radians. The estimate's own odometry gives the robot's pose in
    /// the odometry frame. Returns `None` if a number is not finite or a scale is not positive.
    pub fn new(estimate: &PoseEstimate, wall_direction_rad: f64) -> Option<Self> {
        let (robot_px, robot_m) = (estimate.pose.pose(), estimate.odometry());
        let [a, b] = [estimate.scale_a_pxpm, estimate.scale_b_pxpm];
        let numbers = [robot_px.x, robot_px.y, robot_px.yaw_rad, robot_m.x, robot_m.y, robot_m.yaw_rad, a, b];
        if numbers.iter().any(|v| !v.is_finite()) || a <= 0.0 || b <= 0.0 {
            return None;
        }
        let (sin, cos) = (robot_m.yaw_rad - robot_px.yaw_rad).sin_cos();
        Some(Self {
            robot_px,
            robot_m,
            scales_pxpm: [a, b],
            metres_from_pixels: stretch(wall_direction_rad, 1.0 / a, 1.0 / b),
            pixels_from_metres: stretch(wall_direction_rad, a, b),
            turn: [cos, sin],
        })
    }

    /// Returns the robot's pose in the drawing.
    pub fn robot_px(&self) -> Pose<Sketch> {
        self.robot_px
    }

    /// Returns the robot's pose in the odometry frame.
    pub fn robot_m(&self) -> Pose<Odom> {
        self.robot_m
    }

    /// Returns the geometric mean of the two scales, in pixels per metre.
    pub fn mean_scale_pxpm(&self) -> f64 {
        (self.scales_pxpm[0] * self.scales_pxpm[1]).sqrt()
    }

    /// Returns the smaller of the two scales, in pixels per metre. A length in pixels divided by this scale is an upper bound on
    /// the length in metres.
    pub fn least_scale_pxpm(&self) -> f64 {
        self.scales_pxpm[0].min(self.scales_pxpm[1])
    }

    /// Converts a place in the drawing to the odometry frame.
    pub fn to_odom(&self, place: Point<Sketch>) -> Point<Odom> {
        let offset = [place.x - self.robot_px.x, place.y - self.robot_px.y];
        let [x, y] = apply(&self.metres_from_pixels, offset);
        let [cos, sin] = self.turn;
        Point::new(self.robot_m.x + cos * x - sin * y, self.robot_m.y + sin * x + cos * y)
    }

    /// Converts a place in the odometry frame to the drawing.
    pub fn to_sketch(&self, place: Point<Odom>) -> Point<Sketch> {
        let offset = [place.x - self.robot_m.x, place.y - self.robot_m.y];
        let [cos, sin] = self.turn;
        let turned = [cos * offset[0] + sin * offset[1], cos * offset[1] - sin * offset[0]];
        let [x, y] = apply(&self.pixels_from_metres, turned);
        Point::new(self.robot_px.x + x, self.robot_px.y + y)
    }

    /// Returns the distance between two places in the local metric ‖·‖_S of the drawing, in metres.
    pub fn distance_m(&self, from: Point<Sketch>, to: Point<Sketch>) -> f64 {
        let [x, y] = apply(&self.metres_from_pixels, [to.x - from.x, to.y - from.y]);
        x.hypot(y)
    }
}

fn stretch(direction_rad: f64, along: f64, across: f64) -> [[f64; 2]; 2] {
    let (sin, cos) = direction_rad.sin_cos();
    let mixed = (along - across) * sin * cos;
    [[along * cos * cos + across * sin * sin, mixed], [mixed, along * sin * sin + across * cos * cos]]
}

fn apply(matrix: &[[f64; 2]; 2], v: [f64; 2]) -> [f64; 2] {
    [matrix[0][0] * v[0] + matrix[0][1] * v[1], matrix[1][0] * v[0] + matrix[1][1] * v[1]]
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use proptest::prelude::*;
    use sketchnav_schemas::message::{PoseM, PosePx};

    use super::*;

    fn estimate(px: Pose<Sketch>, m: Pose<Odom>, a: f64, b: f64) -> PoseEstimate {
        PoseEstimate {
            pose: PosePx::new(&px),
            odometry: PoseM::new(&m),
            scale_a_pxpm: a,
            scale_b_pxpm: b,
            ..Zeroable::zeroed()
        }
    }

    proptest! {
        #[test]
        fn there_and_back_is_where_it_was(
            yaw_px in -3.0..3.0, yaw_m in -3.0..3.0, a in 5.0..80.0, b in 5.0..80.0, phi in -0.7..0.7,
            x in -90.0..90.0, y in -90.0..90.0,
        ) {
            let e = estimate(Pose::new(10.0, -20.0, yaw_px), Pose::new(1.0, 2.0, yaw_m), a, b);
            let chart = Chart::new(&e, phi).unwrap();
            let back = chart.to_sketch(chart.to_odom(Point::new(x, y)));
            prop_assert!((back.x - x).abs() < 1e-9 && (back.y - y).abs() < 1e-9);
        }

        /// A step of the motion model, x += R(φ)·diag(a, b)·R(−φ)·R(θ)·u, agrees with the chart.
        #[test]
        fn the_chart_is_the_motion_model(yaw in -3.0..3.0, phi in -0.7..0.7, ux in -1.0..1.0, uy in -1.0..1.0) {
            let (a, b) = (20.0, 35.0);
            let odom = Pose::new(1.0, 2.0, 0.4);
            let chart = Chart::new(&estimate(Pose::new(0.0, 0.0, yaw), odom, a, b), phi).unwrap();
            let moved: Pose<Odom> = odom.compose(&Pose::<Odom>::new(ux, uy, 0.0));
            let world = [yaw.cos() * ux - yaw.sin() * uy, yaw.sin() * ux + yaw.cos() * uy];
            let expected = apply(&stretch(phi, a, b), world);
            let found = chart.to_sketch(moved.position());
            prop_assert!((found.x - expected[0]).abs() < 1e-9 && (found.y - expected[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn no_chart_without_a_scale() {
        let bad = estimate(Pose::new(0.0, 0.0, 0.0), Pose::new(0.0, 0.0, 0.0), 0.0, 20.0);
        assert!(Chart::new(&bad, 0.0).is_none());
    }
}
