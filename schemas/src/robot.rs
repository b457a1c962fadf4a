//! Robot files: footprint, limits and sensors.

use serde::{Deserialize, Serialize};

use crate::bounds::{self, Bound, LEAST_RANGE_SPAN_M, MOST_RADII_PER_S};
use crate::channels::{ChannelSpec, MARKERS, ODOMETRY, SCAN, SONAR, VIEW};
use crate::toml_text::{self, TomlError};

mod noise;
mod sensors;

pub use noise::{MotionNoise, OdometryNoise, WheelSlip};
pub use sensors::{DotCamera, Laser, MarkerCamera, Pixels, Sonar};

/// Ticks per second of a robot without a laser whose file does not give them.
const TICK_HZ: f64 = 10.0;
/// Maximum amount by which `radius_m` may exceed half the diagonal of a rectangular footprint, in metres.
const RADIUS_SLACK_M: f64 = 0.05;

/// A robot's footprint, limits and sensors. Parsed from TOML by [`Robot::parse`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Name, shown to people.
    pub name: String,
    /// Radius of the round footprint, or of the circle around a rectangular one, in metres.
    pub radius_m: f64,
    /// The rectangular footprint, or `None` if the robot is round.
    pub footprint: Option<Footprint>,
    /// Mass, in kilograms.
    pub mass_kg: f64,
    /// The directions in which the robot can move.
    pub drive: Drive,
    /// Instants per second as given in the file. Use [`Robot::tick_hz`] for the effective rate.
    pub tick_hz: Option<f64>,
    /// Maximum velocities and accelerations.
    pub limits: Limits,
    /// The laser range finder, if the robot has one.
    pub laser: Option<Laser>,
    /// The ring of sonars, if the robot has one.
    pub sonar: Option<Sonar>,
    /// The camera that finds markers, if the robot has one.
    pub camera: Option<MarkerCamera>,
    /// The camera that looks down on a plane of dots, if the robot has one.
    pub view: Option<DotCamera>,
    /// Deviations of the robot from its commands over a plane of dots.
    pub motion_noise: Option<MotionNoise>,
    /// The errors of the odometry, or `None` if the robot has no odometry.
    pub odometry: Option<OdometryNoise>,
    /// How the wheels slip on a floor. Without this, the robot moves exactly as commanded.
    pub slip: Option<WheelSlip>,
}

/// A rectangular footprint around the robot's centre.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Footprint {
    /// Length from front to back, in metres.
    pub length_m: f64,
    /// Width from left to right, in metres.
    pub width_m: f64,
}

/// The directions in which a robot can move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// The robot moves in any direction.
    Omnidirectional,
    /// The robot drives forward and turns. Its vy is ignored.
    Differential,
}

/// Maximum velocities and accelerations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Speed, in m/s.
    pub speed_mps: f64,
    /// Turn rate, in rad/s.
    pub yaw_rate_radps: f64,
    /// Acceleration and braking, in m/s².
    pub acceleration_mps2: f64,
    /// Angular acceleration, in rad/s².
    pub yaw_acceleration_radps2: f64,
}

/// The reason why a robot file is invalid.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// The text is not TOML, or has an unknown key or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// An invalid value.
    #[error("{key}: expected {expected}, found {}", bounds::shown(*found))]
    Value {
        /// The key.
        key: &'static str,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: f64,
    },
    /// The robot lacks a sensor that is needed.
    #[error("robot {robot:?}: expected the sensor [{key}] in its file, found none")]
    Lacks {
        /// The robot's name.
        robot: String,
        /// The missing table of the robot file.
        key: &'static str,
    },
}

/// The tables of sensors in a robot file.
pub const SENSORS: [&str; 5] = ["laser", "sonar", "camera", "view", "odometry"];

/// A sensor that a robot has.
#[derive(Debug, Clone, Copy)]
pub struct Fitted {
    /// The sensor's table in the robot file.
    pub table: &'static str,
    /// The key of its rate.
    rate_key: &'static str,
    /// Readings per second.
    pub rate_hz: f64,
    /// The channel of its readings.
    pub channel: &'static ChannelSpec,
}

/// A key, its number and the bound of that number.
type Bounded = (&'static str, f64, Bound);

impl Robot {
    /// Creates a round robot without sensors that moves exactly as commanded.
    pub fn bare(name: &str, radius_m: f64, mass_kg: f64, drive: Drive, limits: Limits) -> Self {
        Self {
            name: name.to_owned(),
            radius_m,
            footprint: None,
            mass_kg,
            drive,
            tick_hz: None,
            limits,
            laser: None,
            sonar: None,
            camera: None,
            view: None,
            motion_noise: None,
            odometry: None,
            slip: None,
        }
    }

    /// Parses a robot file and checks it.
    ///
    /// # Errors
    /// [`RobotError`], which names the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, RobotError> {
        let robot: Self = toml_text::read(text)?;
        robot.check_numbers()?;
        robot.check_rates()?;
        Ok(robot)
    }

    /// Returns the number of instants per second: `tick_hz` if the file sets it, otherwise the rate of the laser, otherwise 10.
    pub fn tick_hz(&self) -> f64 {
        self.tick_hz.or(self.laser.as_ref().map(|laser| laser.rate_hz)).unwrap_or(TICK_HZ)
    }

    /// Returns the sensors that the robot has.
    pub fn sensors(&self) -> impl Iterator<Item = Fitted> {
        let tick_hz = self.tick_hz();
        let sensors = [
            (self.laser.as_ref().map(|laser| laser.rate_hz), "laser.rate_hz", SCAN.spec),
            (self.sonar.as_ref().map(|sonar| sonar.rate_hz), "sonar.rate_hz", SONAR.spec),
            (self.camera.as_ref().map(|camera| camera.rate_hz), "camera.rate_hz", MARKERS.spec),
            (self.view.as_ref().map(|view| view.rate_hz), "view.rate_hz", VIEW.spec),
            (
                self.odometry.map(|odometry| odometry.rate_hz.unwrap_or(tick_hz)),
                "odometry.rate_hz",
                ODOMETRY.spec,
            ),
        ];
        SENSORS.into_iter().zip(sensors).filter_map(|(table, (rate_hz, rate_key, channel))| {
            rate_hz.map(|rate_hz| Fitted { table, rate_key, rate_hz, channel })
        })
    }

    /// Checks that the robot has the sensor that is described by this table of the robot file.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot does not have the sensor.
    pub fn require(&self, table: &'static str) -> Result<(), RobotError> {
        let is_fitted = self.sensors().any(|sensor| sensor.table == table);
        if is_fitted { Ok(()) } else { Err(self.lacks(table)) }
    }

    /// Returns the laser, or an error if the robot has none.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no laser.
    pub fn laser(&self) -> Result<&Laser, RobotError> {
        self.laser.as_ref().ok_or_else(|| self.lacks("laser"))
    }

    /// Returns the ring of sonars, or an error if the robot has none.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no sonars.
    pub fn sonar(&self) -> Result<&Sonar, RobotError> {
        self.sonar.as_ref().ok_or_else(|| self.lacks("sonar"))
    }

    /// Returns the marker camera, or an error if the robot has none.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no marker camera.
    pub fn camera(&self) -> Result<&MarkerCamera, RobotError> {
        self.camera.as_ref().ok_or_else(|| self.lacks("camera"))
    }

    /// Returns half the length and half the width of the footprint's bounding box, in metres.
    pub fn half_extents_m(&self) -> [f64; 2] {
        let round = [self.radius_m; 2];
        self.footprint.map_or(round, |Footprint { length_m, width_m }| [length_m / 2.0, width_m / 2.0])
    }

    /// Returns the odometry, or an error if the robot has none.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no odometry.
    pub fn odometry(&self) -> Result<&OdometryNoise, RobotError> {
        self.odometry.as_ref().ok_or_else(|| self.lacks("odometry"))
    }

    /// Returns the camera that looks down on a plane of dots, or an error if the robot has none.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no such camera.
    pub fn view(&self) -> Result<&DotCamera, RobotError> {
        self.view.as_ref().ok_or_else(|| self.lacks("view"))
    }

    fn lacks(&self, key: &'static str) -> RobotError {
        RobotError::Lacks { robot: self.name.clone(), key }
    }

    /// Checks that every number is within its bounds. [`Robot::parse`] already does this, so the check is
    /// only needed for robots created in other ways.
    ///
    /// # Errors
    /// [`RobotError::Value`], which names the key and what was expected.
    pub fn check_numbers(&self) -> Result<(), RobotError> {
        let limits = &self.limits;
        within(&[
            ("radius_m", self.radius_m, bounds::ROBOT_RADIUS_M),
            ("mass_kg", self.mass_kg, bounds::MASS_KG),
            ("limits.speed_mps", limits.speed_mps, bounds::SPEED_MPS),
            ("limits.yaw_rate_radps", limits.yaw_rate_radps, bounds::YAW_RATE_RADPS),
            ("limits.acceleration_mps2", limits.acceleration_mps2, bounds::ACCELERATION_MPS2),
            (
                "limits.yaw_acceleration_radps2",
                limits.yaw_acceleration_radps2,
                bounds::YAW_ACCELERATION_RADPS2,
            ),
        ])?;
        let is_slow = limits.speed_mps <= MOST_RADII_PER_S * self.radius_m;
        expect("limits.speed_mps", "at most 250 times radius_m", limits.speed_mps, is_slow)?;
        self.tick_hz.map_or(Ok(()), |hz| within(&[("tick_hz", hz, bounds::TICK_HZ)]))?;
        self.laser.as_ref().map_or(Ok(()), Laser::check)?;
        self.sonar.as_ref().map_or(Ok(()), Sonar::check)?;
        self.camera.as_ref().map_or(Ok(()), MarkerCamera::check)?;
        self.view.as_ref().map_or(Ok(()), DotCamera::check)?;
        self.motion_noise.as_ref().map_or(Ok(()), MotionNoise::check)?;
        self.footprint.map_or(Ok(()), |footprint| footprint.check(self.radius_m))?;
        self.odometry.as_ref().map_or(Ok(()), OdometryNoise::check)?;
        self.slip.as_ref().map_or(Ok(()), WheelSlip::check)?;
        within(&[("tick_hz, by laser.rate_hz", self.tick_hz(), bounds::TICK_HZ)])
    }

    /// Checks the rates of the sensors, since the capacity of a channel per tick is limited.
    fn check_rates(&self) -> Result<(), RobotError> {
        self.sensors().try_for_each(|sensor| {
            let (rate_hz, most) = (sensor.rate_hz, sensor.channel.per_tick as f64 * self.tick_hz());
            let expected = "no more readings per tick than its channel holds";
            expect(sensor.rate_key, expected, rate_hz, rate_hz <= most)
        })
    }
}

impl Footprint {
    fn check(&self, radius_m: f64) -> Result<(), RobotError> {
        within(&[
            ("footprint.length_m", self.length_m, bounds::FOOTPRINT_M),
            ("footprint.width_m", self.width_m, bounds::FOOTPRINT_M),
        ])?;
        let half_diagonal_m = self.length_m.hypot(self.width_m) / 2.0;
        let is_around = (half_diagonal_m..=half_diagonal_m + RADIUS_SLACK_M).contains(&radius_m);
        expect("radius_m", "between half the diagonal of the footprint and 0.05 m more", radius_m, is_around)
    }
}

fn within(numbers: &[Bounded]) -> Result<(), RobotError> {
    let mut numbers = numbers.iter();
    numbers.try_for_each(|(key, number, bound)| expect(key, bound.words, *number, bound.holds(*number)))
}

fn span(key: &'static str, min_m: f64, max_m: f64) -> Result<(), RobotError> {
    expect(key, "at least 0.01 m less than range_max_m", min_m, min_m + LEAST_RANGE_SPAN_M <= max_m)
}

fn expect(key: &'static str, expected: &'static str, found: f64, holds: bool) -> Result<(), RobotError> {
    if holds { Ok(()) } else { Err(RobotError::Value { key, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BARE: &str = "name='bare'\nradius_m=0.2\nmass_kg=10\ndrive='differential'\n[limits]\nspeed_mps=1\n\
        yaw_rate_radps=1\nacceleration_mps2=1\nyaw_acceleration_radps2=1\n";

    #[test]
    fn the_error_for_a_missing_sensor_names_it() {
        let robot = Robot::parse(BARE).unwrap();
        assert_eq!((robot.tick_hz(), robot.laser.is_none(), robot.odometry.is_none()), (10.0, true, true));
        let error = robot.laser().unwrap_err().to_string();
        assert_eq!(error, "robot \"bare\": expected the sensor [laser] in its file, found none");
        assert!(robot.odometry().unwrap_err().to_string().contains("[odometry]"));
    }

    const SENSORS: &str = "[laser]\nmodel='l'\nfield_of_view_deg=180\nbeams=181\nrange_min_m=0.1\nrange_max_m=8\n\
        rate_hz=10\nnoise_m=0.01\nnoise_per_m=0.01\ndropout=0.01\nmount_x_m=0\n\
        [sonar]\nmodel='s'\nsonars=16\nopening_deg=25\nring_radius_m=0.2\nrange_min_m=0.1\nrange_max_m=6\nrate_hz=10\n\
        noise_per_m=0.01\n[odometry]\nalpha_speed_speed=0.01\nalpha_speed_turn=0\nalpha_turn_speed=0\n\
        alpha_turn_turn=0\ndrift_distance=0.01\ndrift_yaw_radpm=0\nslips_per_m=0\n";

    /// Regression test: every finite number above 0 was accepted. A range of 1e9 m led to scans that readers rejected, and so
    /// did a range_min_m that equals range_max_m in single precision. A rate of 1e-12 Hz overflowed the schedule, and noise of
    /// 1e300 m led to NaN. 1e6 m/s with a radius of 1e-6 m took millions of physics steps per instant, and a mount of NaN moved
    /// every beam.
    #[test]
    fn impossible_numbers_are_refused_with_their_keys() {
        let text = format!("{BARE}{SENSORS}");
        assert!(Robot::parse(&text).is_ok(), "{:?}", Robot::parse(&text));
        for (from, to, message) in [
            ("range_max_m=8", "range_max_m=1e9", "laser.range_max_m: expected 0.1 to 1000 m, found 1e9"),
            (
                "range_min_m=0.1\nrange_max_m=8",
                "range_min_m=7.99999999\nrange_max_m=8",
                "laser.range_min_m: expected at least 0.01 m less than range_max_m, found 7.99999999",
            ),
            ("rate_hz=10\nnoise_m", "rate_hz=1e-12\nnoise_m", "laser.rate_hz: expected 0.01 to 1000 Hz"),
            ("noise_m=0.01", "noise_m=1e300", "laser.noise_m: expected 0 to 10 m, found 1e300"),
            ("speed_mps=1", "speed_mps=1e6", "limits.speed_mps: expected 0.001 to 30 m/s, found 1000000"),
            ("radius_m=0.2\nmass", "radius_m=1e-6\nmass", "radius_m: expected 0.01 to 10 m, found 1e-6"),
            ("radius_m=0.2\nmass", "radius_m=0.01\nmass", ""),
            ("mount_x_m=0", "mount_x_m=nan", "laser.mount_x_m: expected -10 to 10 m, found NaN"),
            ("slips_per_m=0", "slips_per_m=inf", "odometry.slips_per_m"),
            ("opening_deg=25", "opening_deg=180", "sonar.opening_deg"),
            (
                "rate_hz=10\nnoise_m",
                "rate_hz=0.05\nnoise_m",
                "tick_hz, by laser.rate_hz: expected 0.1 to 1000 Hz",
            ),
        ] {
            assert!(text.contains(from), "{from}");
            let parsed = Robot::parse(&text.replace(from, to));
            match message {
                "" => assert!(parsed.is_ok(), "{parsed:?}"),
                _ => assert!(parsed.unwrap_err().to_string().contains(message), "{to}"),
            }
        }
        let fast = text
            .replace("radius_m=0.2\nmass", "radius_m=0.01\nmass")
            .replace("speed_mps=1\n", "speed_mps=3\n");
        let error = Robot::parse(&fast).unwrap_err().to_string();
        assert_eq!(error, "limits.speed_mps: expected at most 250 times radius_m, found 3");
    }

    #[test]
    fn rates_must_be_possible() {
        for (line, key) in [("tick_hz=0", "tick_hz"), ("tick_hz=nan", "tick_hz"), ("tick_hz=1e6", "tick_hz")]
        {
            let error = Robot::parse(&format!("{line}\n{BARE}")).unwrap_err().to_string();
            assert!(error.starts_with(key), "{error}");
        }
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

        #[test]
        fn no_text_makes_it_panic(text in ".*") {
            let _ = Robot::parse(&text);
        }

        /// Whatever the numbers in a robot file are, a robot that is accepted has only numbers within their bounds.
        #[test]
        fn parsed_numbers_are_within_bounds(line in 0..40_usize, number in proptest::num::f64::ANY) {
            let text = format!("{BARE}{SENSORS}");
            let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
            let at = line % lines.len();
            if let Some((key, _)) = lines[at].clone().split_once('=') {
                lines[at] = format!("{key}={number:?}").replace("NaN", "nan");
            }
            if let Ok(robot) = Robot::parse(&lines.join("\n")) {
                proptest::prop_assert!((robot.radius_m as f32).is_normal() && robot.limits.speed_mps <= 30.0);
                let laser = robot.laser.unwrap();
                proptest::prop_assert!((laser.range_min_m as f32) < laser.range_max_m as f32);
                proptest::prop_assert!(laser.mount().x.is_finite() && laser.noise_m <= 10.0);
            }
        }
    }
}
