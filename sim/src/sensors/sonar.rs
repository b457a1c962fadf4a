//! A ring of sonars, each of which reports the nearest echo in its cone (exact, see [`crate::raycast::cone`]). Every surface
//! returns an echo, however oblique. All sonars are read at the same time, and none receives the echo of another. Ranges are measured from the
//! ring. Ranges that are not measurements follow REP 117: +∞ if nothing is within range, and −∞ if something is too near.

use nalgebra::Vector2;
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::SonarScan;
use sketchnav_schemas::robot::Sonar;

use super::{DRAWS_PER_READING, Scene, within};
use crate::raycast::cone::Cone;

/// A ring of sonars, ready to measure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SonarRing {
    model: Sonar,
    stream: Pcg64Mcg,
}

impl SonarRing {
    /// Creates the ring `model`. Its noise comes from `stream`.
    pub fn new(model: &Sonar, stream: Pcg64Mcg) -> Self {
        Self { model: model.clone(), stream }
    }

    /// Fills in reading number `number`, except for the header. The same arguments give the same reading.
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

    /// Returns the distance to the nearest echo of sonar `i`, in metres. The distance is 0 if there is a wall between the
    /// robot's centre and the sonar, which happens if the robot has been pushed into the wall.
    fn echo(&self, scene: &Scene<'_>, i: usize) -> f64 {
        let (robot, ring_m) = (scene.robot, self.model.ring_radius_m);
        let axis_rad = robot.yaw_rad + i as f64 * self.increment_rad();
        let (center, outwards) = (robot.position().coords(), Vector2::new(axis_rad.cos(), axis_rad.sin()));
        if scene.faces.cast(center, outwards, ring_m).is_some() {
            return 0.0;
        }
        // Noise may bring something that is just out of range into range.
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
