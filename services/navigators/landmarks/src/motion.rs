//! How far a robot moved and turned between two readings of its odometry.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Pose};

/// The last reading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Motion {
    last: Option<Pose<Odom>>,
}

impl Motion {
    /// By how much it moved, in metres, backwards negative, and turned, in radians, left positive.
    pub(crate) fn to(&mut self, now: &Pose<Odom>) -> [f64; 2] {
        let last = self.last.replace(*now).unwrap_or(*now);
        let step = last.motion_to(now);
        [step.x.hypot(step.y).copysign(step.x), step.yaw_rad]
    }
}
