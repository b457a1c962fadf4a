//! Decides whether to accept an arrival at a goal.
//!
//! Rooms look alike, so a wrong estimate can arrive at the goal just like a right one. Two signs reveal many wrong arrivals: the
//! scans fit worse than at the true goal, and the estimate has jumped from one place in the drawing to another on the way. If an
//! arrival is in doubt, the robot first looks around, once per task, because a full turn shows parts that the laser missed on the
//! way in. If the arrival is still in doubt, the robot reports that it is lost.

use crate::paths::chart::Chart;
use crate::paths::parameters::Parameters;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Sketch};

/// Time over which the fit is averaged, in seconds.
const FIT_S: f64 = 4.0;
/// Distance, in metres, by which an estimate must move farther than the robot to count as a jump.
const JUMP_M: f64 = 1.0;
/// Weight of the logarithm of the number of jumps relative to the fit, from a logistic regression over wrong and right arrivals.
const JUMP_WEIGHT: f64 = 0.5;

/// The history of the estimate on the way to the goal.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Arrival {
    fit: Option<f64>,
    jumps: u32,
    last: Option<(Point<Sketch>, Point<Odom>)>,
    look: Look,
}

/// State of the look around.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Look {
    /// The look has not been needed yet.
    #[default]
    Ahead,
    /// The robot is looking around.
    UnderWay,
    /// The robot has looked around.
    Done,
}

/// The decision about an arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Belief {
    /// Accept that this is the goal.
    Reached,
    /// Look around before deciding.
    Look,
    /// Reject the arrival, with the number of jumps and the fit of the estimate (mean log likelihood of a beam).
    Doubted(u32, f64),
}

impl Arrival {
    /// Updates the history with the estimate of a step, given by its chart, and with `fit`, its mean log likelihood of a beam.
    pub fn follow(&mut self, chart: &Chart, fit: f64, dt_s: f64) {
        let before = self.fit.unwrap_or(fit);
        self.fit = Some(before + (dt_s / FIT_S).min(1.0) * (fit - before));
        let (place, odom) = (chart.robot_px().position(), chart.robot_m().position());
        if let Some((from, from_odom)) = self.last.replace((place, odom)) {
            let beyond_m = place.distance(&from) / chart.mean_scale_pxpm() - odom.distance(&from_odom);
            self.jumps += u32::from(beyond_m > JUMP_M);
        }
    }

    /// Decides about an arrival now.
    pub fn judge(&self, parameters: &Parameters) -> Belief {
        let fit = self.fit.unwrap_or_default();
        let doubt = JUMP_WEIGHT * f64::from(self.jumps).ln_1p() - fit;
        match self.look {
            Look::Ahead if doubt > parameters.look_above => Belief::Look,
            Look::Done if doubt > parameters.doubt_above => Belief::Doubted(self.jumps, fit),
            _ => Belief::Reached,
        }
    }

    /// Records that the look around begins.
    pub fn begin_look(&mut self) {
        self.look = Look::UnderWay;
    }

    /// Returns true if the robot is looking around.
    pub fn is_looking(&self) -> bool {
        self.look == Look::UnderWay
    }

    /// Records that a recovery behaviour has ended, which may have been the look around.
    pub fn end_look(&mut self) {
        if self.is_looking() {
            self.look = Look::Done;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::messages::PoseEstimate;
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::Pose;
    use sketchnav_schemas::message::{PoseM, PosePx};

    use super::*;

    /// Returns the chart of an estimate at `x_px` with the odometry at `x_m`, at 20 px/m.
    fn chart(x_px: f64, x_m: f64) -> Chart {
        let estimate = PoseEstimate {
            pose: PosePx::new(&Pose::<Sketch>::new(x_px, 0.0, 0.0)),
            odometry: PoseM::new(&Pose::<Odom>::new(x_m, 0.0, 0.0)),
            scale_a_pxpm: 20.0,
            scale_b_pxpm: 20.0,
            ..Zeroable::zeroed()
        };
        Chart::new(&estimate, 0.0).unwrap()
    }

    /// Returns the state after a minute's drive, given the fit of the scans and the number of jumps.
    fn after(fit: f64, jumps: u32) -> Arrival {
        let mut arrival = Arrival::default();
        for i in 0..600 {
            let aside = if i <= jumps && i % 2 == 1 { 25.0 } else { 0.0 };
            arrival.follow(&chart(f64::from(i) + aside, f64::from(i) * 0.05), fit, 0.1);
        }
        arrival
    }

    #[test]
    fn who_fits_well_and_came_steadily_is_believed_at_once() {
        assert_eq!(after(-0.3, 0).judge(&Parameters::default()), Belief::Reached);
    }

    #[test]
    fn who_doubts_looks_around_once_and_then_says_so() {
        let p = Parameters::default();
        for (fit, jumps) in [(-p.doubt_above - 0.1, 0), (-0.6, 8)] {
            let mut arrival = after(fit, jumps);
            assert_eq!((arrival.jumps, arrival.judge(&p)), (jumps, Belief::Look));
            arrival.begin_look();
            assert!(arrival.is_looking());
            arrival.end_look();
            assert!(
                matches!(arrival.judge(&p), Belief::Doubted(n, f) if n == jumps && (f - fit).abs() < 1e-6)
            );
        }
    }

    #[test]
    fn a_look_around_may_dispel_the_doubt() {
        let p = Parameters::default();
        let mut arrival = after(-p.look_above - 0.1, 0);
        assert_eq!(arrival.judge(&p), Belief::Look);
        arrival.begin_look();
        (0..100).for_each(|_| arrival.follow(&chart(0.0, 0.0), -0.2, 0.1));
        arrival.end_look();
        assert_eq!(arrival.judge(&p), Belief::Reached);
    }

    #[test]
    fn no_other_recovery_counts_as_the_look() {
        let p = Parameters::default();
        let mut arrival = after(-p.doubt_above - 0.1, 0);
        arrival.end_look();
        assert_eq!(arrival.judge(&p), Belief::Look);
    }
}
