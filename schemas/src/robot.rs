//! Robot files: footprint, limits and sensors.

use serde::{Deserialize, Serialize};

use crate::bounds::{self, Bound, LEAST_RANGE_SPAN_M, MOST_RADII_PER_S};
use crate::channels::{Channel, MARKERS, ODOMETRY, SCAN, SONAR, VIEW};
use crate::geometry::{Base, Pose};
use crate::message::MAX_BEAMS;

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
    /// The rectangular footprint. A robot without one is round.
    pub footprint: Option<Footprint>,
    /// Mass, in kilograms.
    pub mass_kg: f64,
    /// The directions in which the robot can move.
    pub drive: Drive,
    /// Instants per second as given in the file. Use [`Robot::tick_hz`] for the rate in force.
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
    /// How the robot strays from its commands over a plane of dots.
    pub motion_noise: Option<MotionNoise>,
    /// The errors of the odometry, if the robot has one.
    pub odometry: Option<OdometryNoise>,
    /// How the wheels slip on a floor. A robot without this moves exactly as commanded.
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

/// A planar laser range finder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laser {
    /// Model name.
    pub model: String,
    /// Field of view centred on the sensor's forward axis, in degrees.
    pub field_of_view_deg: f64,
    /// Number of beams, at most [`crate::message::MAX_BEAMS`].
    pub beams: u32,
    /// Shortest range, in metres.
    pub range_min_m: f64,
    /// Longest range, in metres.
    pub range_max_m: f64,
    /// Scans per second.
    pub rate_hz: f64,
    /// Constant part of the standard deviation of a range, in metres.
    pub noise_m: f64,
    /// Part of the standard deviation of a range that grows with the range, in metres per metre.
    pub noise_per_m: f64,
    /// Share of the beams that are lost.
    pub dropout: f64,
    /// Mounting position forward of the robot's centre, in metres.
    #[serde(default)]
    pub mount_x_m: f64,
    /// Mounting position to the left of the robot's centre, in metres.
    #[serde(default)]
    pub mount_y_m: f64,
    /// Direction of the sensor's forward axis, in degrees counter-clockwise from the robot's.
    #[serde(default)]
    pub mount_yaw_deg: f64,
}

impl Laser {
    /// The pose of the sensor on the robot.
    pub fn mount(&self) -> Pose<Base> {
        Pose::new(self.mount_x_m, self.mount_y_m, self.mount_yaw_deg.to_radians())
    }
}

/// A ring of identical sonars at equal angles around the robot's centre. Sonar 0 looks forward, and the numbers increase
/// counter-clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sonar {
    /// Model name.
    pub model: String,
    /// Number of sonars, at most [`crate::message::MAX_SONARS`].
    pub sonars: u32,
    /// Opening angle of a sonar's cone, in degrees.
    pub opening_deg: f64,
    /// Radius of the ring, in metres.
    pub ring_radius_m: f64,
    /// Shortest range, in metres.
    pub range_min_m: f64,
    /// Longest range, in metres.
    pub range_max_m: f64,
    /// Readings of the whole ring per second.
    pub rate_hz: f64,
    /// Standard deviation of a range, as a share of the range.
    pub noise_per_m: f64,
}

/// A camera that finds fiducial markers and measures their poses, as OpenCV does with ArUco markers.
///
/// The pose of a marker comes from its four corners in the picture. The errors of its distance and of its facing direction
/// grow with the distance, and the error of the distance also grows with the slant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerCamera {
    /// Model name.
    pub model: String,
    /// Horizontal field of view centred on the optical axis, in degrees.
    pub field_of_view_deg: f64,
    /// Shortest distance at which the camera finds a marker, in metres.
    pub range_min_m: f64,
    /// Longest distance at which the camera finds a marker, in metres.
    pub range_max_m: f64,
    /// Largest angle, in degrees, between the direction that a marker faces and the line from the marker to the camera.
    pub slant_max_deg: f64,
    /// Pictures per second.
    pub rate_hz: f64,
    /// Standard deviation of the distance of a marker that faces the camera, in metres per metre. The error due to the
    /// pixels is added to this one.
    pub noise_per_m: f64,
    /// Standard deviation of the direction in which the camera sees a marker, in degrees.
    pub bearing_noise_deg: f64,
    /// Standard deviation of the direction that a marker faces, in degrees per metre of distance.
    pub facing_noise_deg_per_m: f64,
    /// Share of the markers in view that the camera misses in a picture at its shortest range. At its longest range it
    /// misses twice as many.
    pub miss: f64,
    /// The camera's pixels, if they determine which of the markers within range are detected. Without them a slant makes no
    /// marker too narrow to be read, but it does increase the error of the distance.
    pub pixels: Option<Pixels>,
    /// Mounting position forward of the robot's centre, in metres.
    #[serde(default)]
    pub mount_x_m: f64,
    /// Mounting position to the left of the robot's centre, in metres.
    #[serde(default)]
    pub mount_y_m: f64,
    /// Direction of the optical axis, in degrees counter-clockwise from the robot's forward axis.
    #[serde(default)]
    pub mount_yaw_deg: f64,
}

/// The size at which a marker must appear to be detected. A bit narrower than about two pixels cannot be read, since by the
/// sampling theorem the smallest part needs two samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pixels {
    /// Width of the picture, in pixels.
    pub width_px: f64,
    /// Side of a marker including its black border, in metres.
    pub marker_side_m: f64,
    /// Bits along a side including the border: 8 for ArUco's 6 × 6 dictionaries.
    pub side_bits: f64,
    /// Minimum width of a bit that can be read, in pixels.
    pub least_bit_px: f64,
    /// Standard deviation of a corner's position along each axis, in pixels: 1/√12 if corners are located to whole pixels.
    pub corner_px: f64,
}

impl MarkerCamera {
    /// The pose of the camera on the robot.
    pub fn mount(&self) -> Pose<Base> {
        Pose::new(self.mount_x_m, self.mount_y_m, self.mount_yaw_deg.to_radians())
    }

    /// Returns true if a marker at this distance appears large enough to be detected. In the pinhole model a side of s
    /// metres seen at this slant covers f s cos(slant) / distance pixels, where the focal length f follows from the field
    /// of view.
    pub fn resolves(&self, distance_m: f64, slant_rad: f64) -> bool {
        self.pixels.is_none_or(|pixels| {
            let width_px = self.side_px(&pixels, distance_m) * slant_rad.cos();
            width_px >= pixels.side_bits * pixels.least_bit_px
        })
    }

    /// Standard deviation of the measured distance of a marker, as a share of the distance.
    ///
    /// The distance is the focal length times a marker's side, divided by the length of that side in the picture. With pixels,
    /// that length is the mean of the two upright sides, which no slant shortens. This mean depends on four corners, and its
    /// standard deviation equals that of a single corner.
    pub fn distance_error(&self, distance_m: f64, slant_rad: f64) -> f64 {
        match &self.pixels {
            None => self.noise_per_m / slant_rad.cos().max(0.1),
            Some(pixels) => self.noise_per_m.hypot(pixels.corner_px / self.side_px(pixels, distance_m)),
        }
    }

    /// The length of a marker's side in the picture, in pixels.
    fn side_px(&self, pixels: &Pixels, distance_m: f64) -> f64 {
        let focal_px = pixels.width_px / 2.0 / (self.field_of_view_deg.to_radians() / 2.0).tan();
        focal_px * pixels.marker_side_m / distance_m
    }

    fn check(&self) -> Result<(), RobotError> {
        self.pixels.map_or(Ok(()), |pixels| pixels.check())?;
        within(&[
            ("camera.field_of_view_deg", self.field_of_view_deg, bounds::CAMERA_VIEW_DEG),
            ("camera.range_max_m", self.range_max_m, bounds::RANGE_MAX_M),
            ("camera.range_min_m", self.range_min_m, bounds::RANGE_MIN_M),
            ("camera.slant_max_deg", self.slant_max_deg, bounds::SLANT_DEG),
            ("camera.rate_hz", self.rate_hz, bounds::RATE_HZ),
            ("camera.noise_per_m", self.noise_per_m, bounds::SHARE),
            ("camera.bearing_noise_deg", self.bearing_noise_deg, bounds::ANGLE_NOISE_DEG),
            ("camera.facing_noise_deg_per_m", self.facing_noise_deg_per_m, bounds::ANGLE_NOISE_DEG),
            ("camera.miss", self.miss, bounds::DROPOUT),
            ("camera.mount_x_m", self.mount_x_m, bounds::MOUNT_M),
            ("camera.mount_y_m", self.mount_y_m, bounds::MOUNT_M),
            ("camera.mount_yaw_deg", self.mount_yaw_deg, bounds::ANGLE_DEG),
        ])?;
        span("camera.range_min_m", self.range_min_m, self.range_max_m)
    }
}

impl Pixels {
    fn check(self) -> Result<(), RobotError> {
        within(&[
            ("camera.pixels.width_px", self.width_px, bounds::PICTURE_PX),
            ("camera.pixels.marker_side_m", self.marker_side_m, bounds::MARKER_SIDE_M),
            ("camera.pixels.side_bits", self.side_bits, bounds::SIDE_BITS),
            ("camera.pixels.least_bit_px", self.least_bit_px, bounds::LEAST_BIT_PX),
            ("camera.pixels.corner_px", self.corner_px, bounds::CORNER_PX),
        ])
    }
}

/// A camera that looks straight down on a plane of dots (Park and Kender 1995, 3.1). It sees a square window and a margin
/// around it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DotCamera {
    /// Model name.
    pub model: String,
    /// Side of the window, in metres.
    pub side_m: f64,
    /// Distance that the camera sees beyond each edge of the window, in metres.
    pub margin_m: f64,
    /// Views per second.
    pub rate_hz: f64,
    /// Standard deviation of a dot's position along each axis, in metres.
    pub noise_m: f64,
    /// Share of the dots in view that the camera misses.
    pub miss: f64,
    /// Average number of dots in a view that do not exist in the plane.
    pub false_dots: f64,
}

impl DotCamera {
    fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("view.side_m", self.side_m, bounds::WINDOW_M),
            ("view.margin_m", self.margin_m, bounds::WINDOW_MARGIN_M),
            ("view.rate_hz", self.rate_hz, bounds::RATE_HZ),
            ("view.noise_m", self.noise_m, bounds::RANGE_NOISE_M),
            ("view.miss", self.miss, bounds::DROPOUT),
            ("view.false_dots", self.false_dots, bounds::FALSE_DOTS),
        ])
    }
}

/// How a robot strays from its commands. The errors are random and grow with the square root of the distance travelled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionNoise {
    /// Standard deviation of the position after one metre, along each axis, in metres.
    pub translation_m: f64,
    /// Standard deviation of the heading after one metre, in radians.
    pub rotation_rad: f64,
}

impl MotionNoise {
    fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("motion_noise.translation_m", self.translation_m, bounds::TRANSLATION_NOISE_M),
            ("motion_noise.rotation_rad", self.rotation_rad, bounds::ROTATION_NOISE_RAD),
        ])
    }
}

/// Noise of dead reckoning: the velocity motion model of Thrun, Burgard and Fox (*Probabilistic Robotics*, table 5.3) plus a
/// drift and wheel slips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryNoise {
    /// Readings per second. If missing, there is one for each tick.
    pub rate_hz: Option<f64>,
    /// Variance of the speed due to the speed, in (m/s)² per (m/s)² and second.
    pub alpha_speed_speed: f64,
    /// Variance of the speed due to the turn rate.
    pub alpha_speed_turn: f64,
    /// Variance of the turn rate due to the speed.
    pub alpha_turn_speed: f64,
    /// Variance of the turn rate due to the turn rate.
    pub alpha_turn_turn: f64,
    /// Standard deviation of the error of the distance travelled, as a share. The error is constant during a run.
    pub drift_distance: f64,
    /// Standard deviation of the heading drift, in radians per metre. The drift is constant during a run.
    pub drift_yaw_radpm: f64,
    /// Slips per metre. In a slip, part of a step is lost.
    pub slips_per_m: f64,
}

/// How far a robot on wheels strays from its commands. Each value is the standard deviation of an error that is drawn at the
/// start of a run and constant during it. The errors are shares of the motion, or an angle per metre driven. Mecanum wheels
/// also roll sideways.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelSlip {
    /// Error of the distance driven, as a share of the commanded distance.
    pub distance: f64,
    /// Slide to the left or right of the direction of motion, as a share of the motion.
    pub sideways: f64,
    /// Turn that was not commanded, in radians per metre.
    pub yaw_radpm: f64,
}

impl WheelSlip {
    fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("slip.distance", self.distance, bounds::SHARE),
            ("slip.sideways", self.sideways, bounds::SHARE),
            ("slip.yaw_radpm", self.yaw_radpm, bounds::DRIFT_RADPM),
        ])
    }
}

/// Reasons why a robot file is invalid.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
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

/// A key, its number and the bound of that number.
type Bounded = (&'static str, f64, Bound);

impl Robot {
    /// Parses a robot file and checks it.
    ///
    /// # Errors
    /// [`RobotError`] with the key and what was expected.
    pub fn parse(text: &str) -> Result<Self, RobotError> {
        let robot: Self = toml::from_str(text)?;
        robot.check_numbers()?;
        robot.check_rates()?;
        Ok(robot)
    }

    /// Instants per second: `tick_hz` if the file gives it, otherwise the rate of the laser, otherwise 10.
    pub fn tick_hz(&self) -> f64 {
        self.tick_hz.or(self.laser.as_ref().map(|laser| laser.rate_hz)).unwrap_or(TICK_HZ)
    }

    /// Returns the laser, or an error for callers that cannot do without one.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no laser.
    pub fn laser(&self) -> Result<&Laser, RobotError> {
        self.laser.as_ref().ok_or_else(|| self.lacks("laser"))
    }

    /// Returns the ring of sonars, or an error for callers that cannot do without one.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no sonars.
    pub fn sonar(&self) -> Result<&Sonar, RobotError> {
        self.sonar.as_ref().ok_or_else(|| self.lacks("sonar"))
    }

    /// Returns the marker camera, or an error for callers that cannot do without one.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no marker camera.
    pub fn camera(&self) -> Result<&MarkerCamera, RobotError> {
        self.camera.as_ref().ok_or_else(|| self.lacks("camera"))
    }

    /// Half the length and half the width of the footprint's bounding box, in metres.
    pub fn half_extents_m(&self) -> [f64; 2] {
        let round = [self.radius_m; 2];
        self.footprint.map_or(round, |Footprint { length_m, width_m }| [length_m / 2.0, width_m / 2.0])
    }

    /// Returns the odometry, or an error for callers that cannot do without one.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no odometry.
    pub fn odometry(&self) -> Result<&OdometryNoise, RobotError> {
        self.odometry.as_ref().ok_or_else(|| self.lacks("odometry"))
    }

    /// Returns the camera that looks down on a plane of dots, or an error for callers that cannot do without one.
    ///
    /// # Errors
    /// [`RobotError::Lacks`] if the robot has no such camera.
    pub fn view(&self) -> Result<&DotCamera, RobotError> {
        self.view.as_ref().ok_or_else(|| self.lacks("view"))
    }

    fn lacks(&self, key: &'static str) -> RobotError {
        RobotError::Lacks { robot: self.name.clone(), key }
    }

    /// Checks that every number is within its bounds. [`Robot::parse`] does this already, so only a robot from elsewhere
    /// needs the check.
    ///
    /// # Errors
    /// [`RobotError::Value`] with the key and what was expected.
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

    /// Checks the rates of the sensors, since a channel holds a limited number of readings per tick.
    fn check_rates(&self) -> Result<(), RobotError> {
        let [laser, sonar, camera, view] = [
            self.laser.as_ref().map(|laser| laser.rate_hz),
            self.sonar.as_ref().map(|sonar| sonar.rate_hz),
            self.camera.as_ref().map(|camera| camera.rate_hz),
            self.view.as_ref().map(|view| view.rate_hz),
        ];
        let odometry = self.odometry.and_then(|odometry| odometry.rate_hz);
        self.check_rate("laser.rate_hz", laser, SCAN)?;
        self.check_rate("sonar.rate_hz", sonar, SONAR)?;
        self.check_rate("camera.rate_hz", camera, MARKERS)?;
        self.check_rate("view.rate_hz", view, VIEW)?;
        self.check_rate("odometry.rate_hz", odometry, ODOMETRY)
    }

    fn check_rate<T>(
        &self,
        key: &'static str,
        hz: Option<f64>,
        channel: Channel<T>,
    ) -> Result<(), RobotError> {
        let most = channel.spec.per_tick as f64 * self.tick_hz();
        let found = hz.unwrap_or_default();
        expect(key, "no more readings per tick than its channel holds", found, found <= most)
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

impl Laser {
    fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("laser.range_max_m", self.range_max_m, bounds::RANGE_MAX_M),
            ("laser.range_min_m", self.range_min_m, bounds::RANGE_MIN_M),
            ("laser.field_of_view_deg", self.field_of_view_deg, bounds::FIELD_OF_VIEW_DEG),
            ("laser.noise_m", self.noise_m, bounds::RANGE_NOISE_M),
            ("laser.noise_per_m", self.noise_per_m, bounds::SHARE),
            ("laser.rate_hz", self.rate_hz, bounds::RATE_HZ),
            ("laser.dropout", self.dropout, bounds::DROPOUT),
            ("laser.mount_x_m", self.mount_x_m, bounds::MOUNT_M),
            ("laser.mount_y_m", self.mount_y_m, bounds::MOUNT_M),
            ("laser.mount_yaw_deg", self.mount_yaw_deg, bounds::ANGLE_DEG),
        ])?;
        let beams = self.beams;
        expect("laser.beams", "2 to 1440", beams.into(), (2..=MAX_BEAMS).contains(&(beams as usize)))?;
        span("laser.range_min_m", self.range_min_m, self.range_max_m)
    }
}

impl Sonar {
    fn check(&self) -> Result<(), RobotError> {
        within(&[
            ("sonar.opening_deg", self.opening_deg, bounds::OPENING_DEG),
            ("sonar.range_max_m", self.range_max_m, bounds::RANGE_MAX_M),
            ("sonar.range_min_m", self.range_min_m, bounds::RANGE_MIN_M),
            ("sonar.ring_radius_m", self.ring_radius_m, bounds::RING_RADIUS_M),
            ("sonar.noise_per_m", self.noise_per_m, bounds::SHARE),
            ("sonar.rate_hz", self.rate_hz, bounds::RATE_HZ),
        ])?;
        let sonars = self.sonars;
        expect("sonar.sonars", "1 to 32", sonars.into(), (1..=32).contains(&sonars))?;
        span("sonar.range_min_m", self.range_min_m, self.range_max_m)
    }
}

impl OdometryNoise {
    fn check(&self) -> Result<(), RobotError> {
        self.rate_hz.map_or(Ok(()), |hz| within(&[("odometry.rate_hz", hz, bounds::RATE_HZ)]))?;
        within(&[
            ("odometry.alpha_speed_speed", self.alpha_speed_speed, bounds::MOTION_NOISE),
            ("odometry.alpha_speed_turn", self.alpha_speed_turn, bounds::MOTION_NOISE),
            ("odometry.alpha_turn_speed", self.alpha_turn_speed, bounds::MOTION_NOISE),
            ("odometry.alpha_turn_turn", self.alpha_turn_turn, bounds::MOTION_NOISE),
            ("odometry.drift_distance", self.drift_distance, bounds::SHARE),
            ("odometry.drift_yaw_radpm", self.drift_yaw_radpm, bounds::DRIFT_RADPM),
            ("odometry.slips_per_m", self.slips_per_m, bounds::SLIPS_PER_M),
        ])
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
    fn a_robot_needs_no_sensors_and_whoever_needs_one_hears_which_is_missing() {
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

    /// Every finite number above 0 was accepted. A range of 1e9 m led to scans that readers rejected, and so did a
    /// range_min_m that equals range_max_m in single precision. A rate of 1e-12 Hz overflowed the schedule, and noise of
    /// 1e300 m led to NaN. 1e6 m/s with a radius of 1e-6 m took millions of physics steps per instant, and a mount of NaN
    /// moved every beam.
    #[test]
    fn numbers_that_no_robot_has_are_refused_with_their_keys() {
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

        /// Whichever number follows whichever key, a robot that is accepted has only numbers within their bounds.
        #[test]
        fn what_is_parsed_is_within_its_bounds(line in 0..40_usize, number in proptest::num::f64::ANY) {
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
