//! Measures how far a robot moved and turned between two odometry readings.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Pose};

/// The last odometry reading, from which motion is measured.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Motion {
    last: Option<Pose<Odom>>,
}

impl Motion {
    /// Returns the distance that the robot has moved since the last reading, in metres, negative if backwards, and the angle that
    /// it has turned, in radians, positive to the left.
    pub(crate) fn to(&mut self, now: &Pose<Odom>) -> [f64; 2] {
        let last = self.last.replace(*now).unwrap_or(*now);
        let step = last.motion_to(now);
        [step.x.hypot(step.y).copysign(step.x), step.yaw_rad]
    }
}
