//! The sensors of the robot, with one module per sensor. The parameters of a sensor come from the robot file
//! and its noise from its own random stream, and it fills in its own message. A [`Schedule`] determines when
//! it takes readings.

pub mod camera;
pub mod dots;
pub mod laser;
pub mod odometry;
pub mod sonar;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Pose, World};

use crate::raycast::Faces;

/// Number of random numbers set aside for each reading of a sensor, which is more than any reading draws. It is odd, so that no
/// bits of the generator's state stay the same from one reading to the next.
const DRAWS_PER_READING: u128 = 1_000_003;

/// A moving disc, such as a person: position and radius, in metres.
pub type Disc = ([f64; 2], f64);

/// The world at the time of a ranging sensor's reading.
pub struct Scene<'a> {
    /// True pose of the robot.
    pub robot: Pose<World>,
    /// Everything static.
    pub faces: &'a Faces,
    /// People walking around.
    pub people: &'a [Disc],
}

/// When a sensor takes readings. Reading k (from 0) is due at k / rate after the start. A sensor that is not faster than the tick
/// takes it at the first tick at or after that time. A faster sensor takes it at the end of the first physics step at or after that
/// time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// Number of physics steps between two possible readings of the sensor.
    grain: u64,
    /// Number of such intervals between two readings.
    spacing: f64,
    taken: u64,
}

impl Schedule {
    /// Creates a schedule with `substeps` physics steps per tick.
    pub fn new(rate_hz: f64, tick_hz: f64, substeps: u32) -> Self {
        let ticks = tick_hz / rate_hz;
        let (grain, spacing) =
            if ticks >= 1.0 { (substeps.into(), ticks) } else { (1, ticks * f64::from(substeps)) };
        Self { grain, spacing, taken: 0 }
    }

    /// Returns the number of the reading that is due after the given number of physics steps since the start, if any. Each number
    /// is returned once. It must be called after every physics step, and once before the first.
    pub fn take(&mut self, physics_steps: u64) -> Option<u64> {
        // A value that falls short of a whole number only because of rounding counts as that number.
        let moments = (self.taken as f64 * self.spacing - 1e-6).ceil();
        (physics_steps >= moments as u64 * self.grain).then(|| {
            self.taken += 1;
            self.taken - 1
        })
    }
}

/// Converts a measured range to the one that a sensor reports: +∞ above its maximum range, −∞ below its minimum (REP 117).
fn within(range_m: f64, range_min_m: f64, range_max_m: f64) -> f64 {
    if range_m > range_max_m {
        f64::INFINITY
    } else if range_m < range_min_m {
        f64::NEG_INFINITY
    } else {
        range_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// Returns the physics steps after which readings are taken, within `ticks` ticks.
    fn moments(rate_hz: f64, tick_hz: f64, substeps: u32, ticks: u64) -> Vec<u64> {
        let mut schedule = Schedule::new(rate_hz, tick_hz, substeps);
        (0..=ticks * u64::from(substeps)).filter(|step| schedule.take(*step).is_some()).collect()
    }

    #[test]
    fn a_sensor_reads_at_ticks_or_between_them() {
        assert_eq!(moments(10.0, 10.0, 10, 3), [0, 10, 20, 30]);
        assert_eq!(moments(50.0, 10.0, 10, 1), [0, 2, 4, 6, 8, 10]);
        assert_eq!(moments(4.0, 10.0, 10, 10), [0, 30, 50, 80, 100]);
        assert_eq!(moments(15.0, 10.0, 10, 2), [0, 7, 14, 20]);
        // `period_ns` loses a third of a nanosecond per tick, but no reading is lost.
        assert_eq!(moments(1.0, 3.0, 1, 3000).len(), 1001);
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn readings_keep_the_rate_and_are_late_by_less_than_a_step(
            rate in 0.5..100.0_f64, tick in 1.0..100.0_f64,
        ) {
            let substeps = (100.0_f64.max(rate) / tick).ceil() as u32;
            let step_hz = tick * f64::from(substeps);
            for (k, step) in moments(rate, tick, substeps, 200).into_iter().enumerate() {
                let late_s = step as f64 / step_hz - k as f64 / rate;
                let moment_s = if rate > tick { 1.0 / step_hz } else { 1.0 / tick };
                prop_assert!(late_s > -1e-6 && late_s < moment_s, "reading {}: {} s late", k, late_s);
            }
        }
    }
}
