//! The sensors of a robot file: laser, sonars, cameras.

use serde::{Deserialize, Serialize};

use super::{RobotError, expect, span, within};
use crate::bounds;
use crate::geometry::{Base, Pose};
use crate::message::MAX_BEAMS;

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
    /// Returns the pose of the sensor on the robot.
    pub fn mount(&self) -> Pose<Base> {
        Pose::new(self.mount_x_m, self.mount_y_m, self.mount_yaw_deg.to_radians())
    }

    pub(super) fn check(&self) -> Result<(), RobotError> {
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

/// A ring of identical sonars at equal angles around the robot's centre. Sonar 0 faces forward, and the
/// numbers increase counter-clockwise.
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

impl Sonar {
    pub(super) fn check(&self) -> Result<(), RobotError> {
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

/// A camera that finds fiducial markers and measures their poses, as OpenCV does with ArUco markers.
///
/// The pose of a marker is computed from its four corners in the image. The errors of the distance and of the
/// direction that the marker faces grow with the distance, and the error of the distance also grows with the
/// slant.
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
    /// Standard deviation of the distance of a marker that faces the camera, in metres per metre, in addition
    /// to the error due to the pixels.
    pub noise_per_m: f64,
    /// Standard deviation of the direction in which the camera sees a marker, in degrees.
    pub bearing_noise_deg: f64,
    /// Standard deviation of the direction that a marker faces, in degrees per metre of distance.
    pub facing_noise_deg_per_m: f64,
    /// Share of the markers in view that the camera misses in an image at its shortest range. At its longest
    /// range, it misses twice as many.
    pub miss: f64,
    /// The camera's pixels, if they determine which of the markers within range are detected. Without them,
    /// no slant makes a marker too narrow to be read, but a slant still increases the error of the distance.
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

impl MarkerCamera {
    /// Returns the pose of the camera on the robot.
    pub fn mount(&self) -> Pose<Base> {
        Pose::new(self.mount_x_m, self.mount_y_m, self.mount_yaw_deg.to_radians())
    }

    /// Returns true if the camera sees a marker at the given distance and bearing from its optical axis, if nothing hides the
    /// marker. The slant is the angle between the direction that the marker faces and the line to the camera.
    pub fn sees(&self, distance_m: f64, bearing_rad: f64, slant_rad: f64) -> bool {
        (self.range_min_m..=self.range_max_m).contains(&distance_m)
            && self.resolves(distance_m, slant_rad)
            && bearing_rad.abs() <= self.field_of_view_deg.to_radians() / 2.0
            && slant_rad <= self.slant_max_deg.to_radians()
    }

    /// Returns the probability that the camera misses a marker that it could see at the given distance.
    pub fn missed(&self, distance_m: f64) -> f64 {
        let span_m = self.range_max_m - self.range_min_m;
        self.miss * (1.0 + (distance_m - self.range_min_m) / span_m)
    }

    /// Returns true if a marker at the given distance appears large enough to be detected. In the pinhole model, a side of s metres
    /// seen at this slant covers f s cos(slant) / distance pixels, where the focal length f follows from the field of view.
    pub fn resolves(&self, distance_m: f64, slant_rad: f64) -> bool {
        self.pixels.is_none_or(|pixels| {
            let width_px = self.side_px(&pixels, distance_m) * slant_rad.cos();
            width_px >= pixels.side_bits * pixels.least_bit_px
        })
    }

    /// Returns the standard deviation of the measured distance of a marker, as a share of the distance.
    ///
    /// The distance is the focal length times a marker's side, divided by the length of that side in the
    /// image. With pixels, that length is the mean of the two upright sides, which a slant does not shorten.
    /// This mean depends on four corners, and its standard deviation equals that of a single corner.
    pub fn distance_error(&self, distance_m: f64, slant_rad: f64) -> f64 {
        match &self.pixels {
            None => self.noise_per_m / slant_rad.cos().max(0.1),
            Some(pixels) => self.noise_per_m.hypot(pixels.corner_px / self.side_px(pixels, distance_m)),
        }
    }

    /// Returns the length of a marker's side in the picture, in pixels.
    fn side_px(&self, pixels: &Pixels, distance_m: f64) -> f64 {
        let focal_px = pixels.width_px / 2.0 / (self.field_of_view_deg.to_radians() / 2.0).tan();
        focal_px * pixels.marker_side_m / distance_m
    }

    pub(super) fn check(&self) -> Result<(), RobotError> {
        self.pixels.map_or(Ok(()), |pixels| pixels.check())?;
        let view_deg = self.pixels.map_or(bounds::CAMERA_VIEW_DEG, |_| bounds::PINHOLE_VIEW_DEG);
        within(&[
            ("camera.field_of_view_deg", self.field_of_view_deg, view_deg),
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

/// The minimum apparent size at which a marker is detected. Bits of a marker that are narrower than about two pixels in the
/// image cannot be read, since the sampling theorem requires two samples for the smallest detail.
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

impl Pixels {
    pub(super) fn check(self) -> Result<(), RobotError> {
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
    pub(super) fn check(&self) -> Result<(), RobotError> {
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
