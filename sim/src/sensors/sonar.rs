//! A ring of sonars: the nearest echo in each cone ([`crate::raycast::cone`], exact). Every surface returns an echo, however
//! oblique; all sonars are read at the same time, and none hears another. Ranges begin at the ring. Out of range follows REP
//! 117: +∞ nothing within reach, −∞ something too near.

use nalgebra::Vector2;
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::SonarScan;
use sketchnav_schemas::robot::Sonar;

use super::{DRAWS_PER_READING, Scene, within};
use crate::raycast::cone::Cone;

/// A ring of sonars that measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SonarRing {
    model: Sonar,
    stream: Pcg64Mcg,
}

impl SonarRing {
    /// The ring `model`; `stream` is where its noise comes from.
    pub fn new(model: &Sonar, stream: Pcg64Mcg) -> Self {
        Self { model: model.clone(), stream }
    }

    /// Writes reading number `number`, except for the header. The same arguments give the same reading.
    pub fn fill(&self, scene: &Scene<'_>, number: u64, scan: &mut SonarScan) {
        self.fill_geometry(scan);
        let mut stream = self.stream.clone();
        stream.advance(u128::from(number) * DRAWS_PER_READING);
        let count = self.model.sonars as usize;
        for (i, range_m) in scan.ranges_m[..count].iter_mut().enumerate() {
            let noise: f64 = stream.sample(StandardNormal);
            let true_m = self.echo(scene, i);
            let range_m_ = true_m + noise * self.model.noise_per_m * true_m.min(1e6);
            *range_m = within(range_m_, self.model.range_min_m, self.model.range_max_m) as f32;
        }
        scan.ranges_m[count..].fill(0.0);
    }

    /// Distance to the nearest echo of sonar `i`, metres. It is 0 if there is a wall between the robot's centre and the sonar,
    /// because the robot was pushed into that wall.
    fn echo(&self, scene: &Scene<'_>, i: usize) -> f64 {
        let (robot, ring_m) = (scene.robot, self.model.ring_radius_m);
        let axis_rad = robot.yaw_rad + i as f64 * self.increment_rad();
        let (center, outwards) = (robot.position().coords(), Vector2::new(axis_rad.cos(), axis_rad.sin()));
        if scene.faces.cast(center, outwards, ring_m).is_some() {
            return 0.0;
        }
        // Noise may bring what is just out of range into it.
        let (apex, reach_m) = (center + outwards * ring_m, self.model.range_max_m * 1.25);
        Cone::new(apex, axis_rad, self.half_opening_rad()).nearest(scene.faces, scene.people, reach_m)
    }

    fn increment_rad(&self) -> f64 {
        std::f64::consts::TAU / f64::from(self.model.sonars)
    }

    fn half_opening_rad(&self) -> f64 {
        self.model.opening_deg.to_radians() / 2.0
    }

    fn fill_geometry(&self, scan: &mut SonarScan) {
        scan.angle_min_rad = 0.0;
        scan.angle_increment_rad = self.increment_rad() as f32;
        scan.half_opening_rad = self.half_opening_rad() as f32;
        scan.ring_radius_m = self.model.ring_radius_m as f32;
        scan.scan_time_s = (1.0 / self.model.rate_hz) as f32;
        scan.range_min_m = self.model.range_min_m as f32;
        scan.range_max_m = self.model.range_max_m as f32;
        scan.sonar_count = self.model.sonars;
    }
}
