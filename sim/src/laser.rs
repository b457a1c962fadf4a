//! A planar laser range finder: rays, noise, lost beams. Ranges that are no measurement follow REP 117:
//! +∞ nothing within reach, −∞ something too near, NaN a beam that got lost.

use nalgebra::{Rotation2, Vector2};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Pose, World};
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::robot::Laser;

use crate::raycast::{Faces, cast_disc};

/// Random numbers between the first of one scan and the first of the next: more than any scan draws,
/// and odd, so that no bits of the generator's state stay the same from scan to scan.
const DRAWS_PER_SCAN: u128 = 1_000_003;

/// A disc that moves: a person, by place and radius in metres.
pub type Disc = ([f64; 2], f64);

/// A laser with its beams worked out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scanner {
    model: Laser,
    /// Direction of each beam in the sensor's frame.
    beams: Vec<Vector2<f64>>,
    increment_rad: f64,
    stream: Pcg64Mcg,
}

impl Scanner {
    /// The laser `model`; `stream` is where its noise comes from.
    pub fn new(model: &Laser, stream: Pcg64Mcg) -> Self {
        let field = model.field_of_view_deg.to_radians();
        // All around, the last beam would fall onto the first.
        let steps = if model.field_of_view_deg >= 360.0 { model.beams } else { model.beams - 1 };
        let increment_rad = field / f64::from(steps);
        let beam = |i| {
            let angle = -field / 2.0 + f64::from(i) * increment_rad;
            Vector2::new(angle.cos(), angle.sin())
        };
        Self { model: model.clone(), beams: (0..model.beams).map(beam).collect(), increment_rad, stream }
    }

    /// Writes the scan number `index` that a robot at `robot` takes; all but the header.
    /// The same arguments give the same scan.
    pub fn fill(
        &self,
        robot: &Pose<World>,
        faces: &Faces,
        discs: impl Iterator<Item = Disc> + Clone,
        index: u64,
        scan: &mut LaserScan,
    ) {
        self.fill_geometry(scan);
        let mut stream = self.stream.clone();
        stream.advance(u128::from(index) * DRAWS_PER_SCAN);
        let sensor = robot.compose(&self.model.mount());
        let (from, turn) = (sensor.position().coords(), Rotation2::new(sensor.yaw_rad));
        // Noise may bring what lies just out of range into it.
        let reach_m = self.model.range_max_m * 1.25;
        for (range_m, beam) in scan.ranges_m.iter_mut().zip(&self.beams) {
            let direction = turn * beam;
            let disc_m =
                |(center, radius_m): Disc| cast_disc(center.into(), radius_m, from, direction, reach_m);
            let moving = discs.clone().filter_map(disc_m);
            let true_m = moving.chain(faces.cast(from, direction, reach_m)).fold(f64::INFINITY, f64::min);
            *range_m = self.measure(true_m, &mut stream) as f32;
        }
        scan.ranges_m[self.beams.len()..].fill(0.0);
    }

    fn fill_geometry(&self, scan: &mut LaserScan) {
        let (beams, scan_time_s) = (self.beams.len(), 1.0 / self.model.rate_hz);
        let angle_min = -self.model.field_of_view_deg.to_radians() / 2.0;
        scan.angle_min_rad = angle_min as f32;
        scan.angle_increment_rad = self.increment_rad as f32;
        scan.angle_max_rad = (angle_min + (beams - 1) as f64 * self.increment_rad) as f32;
        // All beams are taken at the scan's time: the simulated robot stands still during a sweep.
        scan.time_increment_s = 0.0;
        scan.scan_time_s = scan_time_s as f32;
        scan.range_min_m = self.model.range_min_m as f32;
        scan.range_max_m = self.model.range_max_m as f32;
        scan.beam_count = beams as u32;
    }

    /// What the sensor says of a true range: Gaussian noise with a constant and a proportional part.
    fn measure(&self, true_m: f64, stream: &mut Pcg64Mcg) -> f64 {
        let lost = stream.random::<f64>() < self.model.dropout;
        let noise: f64 = stream.sample(StandardNormal);
        let range_m = true_m + noise * (self.model.noise_m + self.model.noise_per_m * true_m.min(1e6));
        if lost {
            f64::NAN
        } else if range_m > self.model.range_max_m {
            f64::INFINITY
        } else if range_m < self.model.range_min_m {
            f64::NEG_INFINITY
        } else {
            range_m
        }
    }
}
