//! A planar laser range finder: rays, noise and lost beams. Ranges that are not measurements follow REP 117: +∞ if nothing is
//! within range, −∞ if something is too near, and NaN if the beam is lost.

use nalgebra::{Rotation2, Vector2};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::robot::Laser;

use super::{DRAWS_PER_READING, Scene, within};
use crate::raycast::cast_disc;
use crate::raycast::sweep::Rays;

/// A laser with precomputed beams.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scanner {
    model: Laser,
    /// Direction of each beam in the sensor's frame.
    beams: Vec<Vector2<f64>>,
    increment_rad: f64,
    stream: Pcg64Mcg,
}

impl Scanner {
    /// Creates the laser `model`. Its noise comes from `stream`.
    pub fn new(model: &Laser, stream: Pcg64Mcg) -> Self {
        let field = model.field_of_view_deg.to_radians();
        // With a full turn, the last beam would coincide with the first.
        let steps = if model.field_of_view_deg >= 360.0 { model.beams } else { model.beams - 1 };
        let increment_rad = field / f64::from(steps);
        let beam = |i| {
            let angle = -field / 2.0 + f64::from(i) * increment_rad;
            Vector2::new(angle.cos(), angle.sin())
        };
        Self { model: model.clone(), beams: (0..model.beams).map(beam).collect(), increment_rad, stream }
    }

    /// Fills in scan number `number`, except for the header. The same arguments give the same scan.
    pub fn fill(&self, scene: &Scene<'_>, number: u64, scan: &mut LaserScan) {
        self.fill_geometry(scan);
        let (ranges_m, unused) = scan.ranges_m.split_at_mut(self.beams.len());
        unused.fill(0.0);
        self.true_ranges(scene, ranges_m);
        let mut stream = self.stream.clone();
        stream.advance(u128::from(number) * DRAWS_PER_READING);
        for range_m in ranges_m {
            *range_m = self.measure(f64::from(*range_m), &mut stream) as f32;
        }
    }

    fn true_ranges(&self, scene: &Scene<'_>, ranges_m: &mut [f32]) {
        let sensor = scene.robot.compose(&self.model.mount());
        let (from, turn) = (sensor.position().coords(), Rotation2::new(sensor.yaw_rad));
        let first_rad = sensor.yaw_rad - self.model.field_of_view_deg.to_radians() / 2.0;
        let rays = Rays::new(first_rad, self.increment_rad, self.beams.iter().map(|beam| turn * beam));
        // Noise may bring something that is just out of range into range.
        let reach_m = self.model.range_max_m * 1.25;
        scene.faces.sweep(from, &rays, reach_m, ranges_m);
        for (center, radius_m) in scene.people {
            let center = Vector2::from(*center);
            for i in rays.towards_disc(center - from, *radius_m).into_iter().flatten() {
                if let Some(range_m) = cast_disc(center, *radius_m, from, rays.direction(i), reach_m) {
                    ranges_m[i] = ranges_m[i].min(range_m as f32);
                }
            }
        }
    }

    fn fill_geometry(&self, scan: &mut LaserScan) {
        let (beams, scan_time_s) = (self.beams.len(), 1.0 / self.model.rate_hz);
        let angle_min = -self.model.field_of_view_deg.to_radians() / 2.0;
        scan.angle_min_rad = angle_min as f32;
        scan.angle_increment_rad = self.increment_rad as f32;
        scan.angle_max_rad = (angle_min + (beams - 1) as f64 * self.increment_rad) as f32;
        // All beams are taken at the scan's time, since the simulated robot stands still during a sweep.
        scan.time_increment_s = 0.0;
        scan.scan_time_s = scan_time_s as f32;
        scan.range_min_m = self.model.range_min_m as f32;
        scan.range_max_m = self.model.range_max_m as f32;
        scan.beam_count = beams as u32;
    }

    /// Returns the reported range for a true range, with Gaussian noise that has a constant and a proportional part.
    fn measure(&self, true_m: f64, stream: &mut Pcg64Mcg) -> f64 {
        let lost = stream.random::<f64>() < self.model.dropout;
        let noise: f64 = stream.sample(StandardNormal);
        let range_m = true_m + noise * (self.model.noise_m + self.model.noise_per_m * true_m.min(1e6));
        if lost { f64::NAN } else { within(range_m, self.model.range_min_m, self.model.range_max_m) }
    }
}
