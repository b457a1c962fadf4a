//! Bounds of the numbers in robot, mission and floor files.
//!
//! Messages and physics store many numbers as `f32`. A number within its bounds stays finite in single precision, and nonzero if it
//! must not be 0. Without bounds, numbers far beyond those of any indoor robot have led to invalid messages, panics in the physics,
//! and simulations that never reached the next tick.

/// The minimum and maximum of a number, both inclusive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Minimum.
    pub least: f64,
    /// Maximum.
    pub most: f64,
    /// The range in words with its unit, as used in errors: `0.01 to 10 m`.
    pub words: &'static str,
}

impl Bound {
    /// Returns true if `value` is within the bounds. NaN never is.
    pub fn holds(&self, value: f64) -> bool {
        (self.least..=self.most).contains(&value)
    }
}

/// Formats a number for an error message, in scientific notation if it is very small or very large.
pub fn shown(value: f64) -> String {
    let is_plain = value == 0.0 || !value.is_finite() || (1e-4..1e9).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

macro_rules! bounds {
    ($($(#[doc = $doc:literal])+ $name:ident: $least:literal to $most:literal $unit:literal;)+) => {
        $($(#[doc = $doc])+
        pub const $name: Bound = Bound {
            least: $least as f64,
            most: $most as f64,
            words: concat!($least, " to ", $most, $unit),
        };)+

        #[cfg(test)]
        const ALL: &[Bound] = &[$($name),+];
    };
}

bounds! {
    /// A coordinate of a point in the true world. Farther out, single precision can no longer represent a
    /// millimetre.
    COORDINATE_M: -10000 to 10000 " m";
    /// Radius of a robot.
    ROBOT_RADIUS_M: 0.01 to 10 " m";
    /// Mass of a robot.
    MASS_KG: 0.01 to 10000 " kg";
    /// Speed of a robot or a person.
    SPEED_MPS: 0.001 to 30 " m/s";
    /// Turn rate of a robot.
    YAW_RATE_RADPS: 0.001 to 100 " rad/s";
    /// Acceleration of a robot.
    ACCELERATION_MPS2: 0.001 to 1000 " m/s²";
    /// Angular acceleration of a robot.
    YAW_ACCELERATION_RADPS2: 0.001 to 1000 " rad/s²";
    /// Instants per second. The interval between two instants must be long enough for a physics step.
    TICK_HZ: 0.1 to 1000 " Hz";
    /// Readings of a sensor per second. The interval between two readings must be a whole number of physics steps.
    RATE_HZ: 0.01 to 1000 " Hz";
    /// Maximum range of a sensor.
    RANGE_MAX_M: 0.1 to 1000 " m";
    /// Minimum range of a sensor.
    RANGE_MIN_M: 0 to 1000 " m";
    /// Constant part of the standard deviation of a range.
    RANGE_NOISE_M: 0 to 10 " m";
    /// A fraction, or a relative standard deviation.
    SHARE: 0 to 1 "";
    /// Fraction of the beams that return no range. At least a few must return one.
    DROPOUT: 0 to 0.99 "";
    /// Field of view of a laser.
    FIELD_OF_VIEW_DEG: 1 to 360 " degrees";
    /// Opening angle of a sonar.
    OPENING_DEG: 0.1 to 179 " degrees";
    /// Mounting position of a sensor on a robot, along each axis.
    MOUNT_M: -10 to 10 " m";
    /// Radius of a ring of sonars.
    RING_RADIUS_M: 0 to 10 " m";
    /// Length or width of a robot's footprint.
    FOOTPRINT_M: 0.01 to 20 " m";
    /// Width of a camera image.
    PICTURE_PX: 16 to 100000 " pixels";
    /// Side of a marker.
    MARKER_SIDE_M: 0.001 to 10 " m";
    /// Bits along a marker's side.
    SIDE_BITS: 3 to 100 "";
    /// Minimum width of a marker's bit in an image.
    LEAST_BIT_PX: 0.1 to 1000 " pixels";
    /// Error of a marker's corner in an image.
    CORNER_PX: 0 to 100 " pixels";
    /// Horizontal field of view of a camera. One that sees all around has several lenses or a curved mirror.
    CAMERA_VIEW_DEG: 1 to 360 " degrees";
    /// Horizontal field of view of a camera with a plane image, as a pinhole camera has.
    PINHOLE_VIEW_DEG: 1 to 179 " degrees";
    /// Angle at which a camera sees a marker, measured from the direction that the marker faces. At 90
    /// degrees, the camera sees the marker edge-on.
    SLANT_DEG: 1 to 89 " degrees";
    /// Standard deviation of an angle.
    ANGLE_NOISE_DEG: 0 to 90 " degrees";
    /// A direction. More than a full turn is a mistake, and wrapping a huge angle would take forever.
    ANGLE_DEG: -360 to 360 " degrees";
    /// A coefficient of the velocity motion model.
    MOTION_NOISE: 0 to 100 "";
    /// Drift of the heading in a robot's odometry.
    DRIFT_RADPM: 0 to 10 " rad/m";
    /// Slips of a robot's wheels.
    SLIPS_PER_M: 0 to 100 " a metre";
    /// Time limit of a task.
    TIME_LIMIT_S: 0.001 to 1000000 " s";
    /// Time at which somebody carries the robot.
    CARRY_S: 0 to 1000000 " s";
    /// Pause of a person at a waypoint.
    PAUSE_S: 0 to 1000000 " s";
    /// Radius of the disc around a goal in which the robot counts as having arrived.
    PLACE_RADIUS_M: 0.001 to 10000 " m";
    /// Thickness of the walls. In single precision, thinner walls would have no interior.
    WALL_THICKNESS_M: 0.001 to 10 " m";
    /// Width of a door.
    DOOR_WIDTH_M: 0.01 to 1000 " m";
    /// Length, width or radius of a piece of furniture.
    FURNITURE_SIZE_M: 0.001 to 1000 " m";
    /// Radius of a person.
    PERSON_RADIUS_M: 0.01 to 5 " m";
    /// Side length of the window that a downward-looking camera sees of a plane of dots.
    WINDOW_M: 0.001 to 1000 " m";
    /// Width of the margin that the camera sees beyond each edge of its window.
    WINDOW_MARGIN_M: 0 to 1000 " m";
    /// Average number of false detections in a view of a plane of dots.
    FALSE_DOTS: 0 to 10 "";
    /// Standard deviation of the position after one metre. It grows with the square root of the distance.
    TRANSLATION_NOISE_M: 0 to 10 " m";
    /// Standard deviation of the heading after one metre. It grows with the square root of the distance.
    ROTATION_NOISE_RAD: 0 to 10 " rad";
    /// Side length of a plane of dots, or the spread of a cluster.
    PLANE_SIDE_M: 0.001 to 10000 " m";
    /// Scale of an image.
    PICTURE_PXPM: 0.01 to 1000000 " px/m";
    /// A coordinate of a point in a drawing. A pen may slip off the sheet, but not far.
    COORDINATE_PX: -100000 to 100000 " px";
}

/// Minimum difference between a sensor's maximum and minimum range, in metres. If it were smaller, the two
/// could be equal in single precision.
pub const LEAST_RANGE_SPAN_M: f64 = 0.01;
/// Maximum speed of a robot, in radii per second. The physics takes four steps per radius so that no wall is missed.
pub const MOST_RADII_PER_S: f64 = 250.0;
/// Maximum total number of wall corners on a floor. Each pair of corners becomes a solid.
pub const MOST_WALL_CORNERS: usize = 20_000;
/// Maximum number of pieces that doors divide the walls of a floor into. A door divides every wall that it lies on.
pub const MOST_WALL_PIECES: usize = 25_000;
/// Maximum number of doors of a floor. Each door is compared with every wall.
pub const MOST_DOORS: usize = 1000;
/// Maximum number of pieces of furniture in a world. If they overlap, the physics checks every pair.
pub const MOST_FURNITURE: usize = 2000;
/// Maximum number of people in a world.
pub const MOST_PEOPLE: usize = crate::message::MAX_PEOPLE;
/// Maximum number of markers in a world.
pub const MOST_MARKERS: usize = 1000;
/// Maximum number of corners of a polygon, or of waypoints of a person.
pub const MOST_CORNERS: usize = 1000;
/// Maximum number of dots in a plane. A checkpoint of the world contains all of them.
pub const MOST_PLANE_DOTS: usize = crate::message::MAX_PLANE_DOTS;
/// Maximum number of pixels in a map image: 200 m by 200 m at 5 cm.
pub const MOST_MAP_CELLS: u64 = 16_000_000;
/// Maximum number of solids to split a map image into. A noisy image yields one for every few pixels.
pub const MOST_MAP_SOLIDS: usize = 100_000;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn bounds_reject_nan_and_name_both_ends() {
        for bound in ALL {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
                assert!(!bound.holds(value), "{bound:?} {value}");
            }
            assert!(bound.holds(bound.least) && bound.holds(bound.most) && bound.least < bound.most);
            assert!(bound.words.starts_with(&format!("{} to {}", bound.least, bound.most)), "{bound:?}");
        }
    }

    #[test]
    fn numbers_are_formatted_briefly() {
        let shown = [1e300, 1e-30, 0.5, -3.0, f64::NAN, 0.0].map(shown);
        assert_eq!(shown, ["1e300", "1e-30", "0.5", "-3", "NaN", "0"]);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Regression test: `range_min_m` once rounded to `range_max_m`, and a radius to 0.
        #[test]
        fn numbers_within_bounds_stay_there_in_single_precision(which in 0..ALL.len(), share in 0.0..=1.0_f64) {
            let bound = ALL[which];
            let value = (bound.least + share * (bound.most - bound.least)).clamp(bound.least, bound.most);
            let single = value as f32;
            prop_assert!(single >= bound.least as f32 && single <= bound.most as f32);
            prop_assert!(single != 0.0 || bound.holds(0.0));
        }
    }
}
