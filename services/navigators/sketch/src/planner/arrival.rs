//! Whether to believe that the goal is here.
//!
//! Rooms look alike: an estimate that is wrong arrives all the same. Two things give many wrong arrivals away. The
//! scans fit worse than at a goal that is truly reached. On the way, the estimate jumped from one place of the drawing
//! to another. Who doubts an arrival looks around first, once a task: a full turn shows what the laser did not see on
//! its way in. Who still doubts then says so.

use crate::paths::chart::Chart;
use crate::paths::parameters::Parameters;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point, Sketch};

/// The fit is averaged over about this time, seconds.
const FIT_S: f64 = 4.0;
/// An estimate that moves by so much more than the robot has jumped, metres.
const JUMP_M: f64 = 1.0;
/// What the logarithm of the jumps counts for against the fit: as a logistic regression over wrong and right
/// arrivals has it, half as much.
const JUMP_WEIGHT: f64 = 0.5;

/// How the estimate came here.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Arrival {
    fit: Option<f64>,
    jumps: u32,
    last: Option<(Point<Sketch>, Point<Odom>)>,
    look: Look,
}

/// The look around.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Look {
    /// Not yet needed.
    #[default]
    Ahead,
    /// Under way.
    UnderWay,
    /// Done.
    Done,
}

/// What to do about an arrival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Belief {
    /// It is the goal.
    Reached,
    /// Look around first.
    Look,
    /// It is not: the estimate jumped so often and fits so badly, in the mean log likelihood of a beam.
    Doubted(u32, f64),
}

impl Arrival {
    /// The estimate is `chart` now, and fits so well: the mean log likelihood of a beam.
    pub fn follow(&mut self, chart: &Chart, fit: f64, dt_s: f64) {
        let before = self.fit.unwrap_or(fit);
        self.fit = Some(before + (dt_s / FIT_S).min(1.0) * (fit - before));
        let (place, odom) = (chart.robot_px().position(), chart.robot_m().position());
        if let Some((from, from_odom)) = self.last.replace((place, odom)) {
            let beyond_m = place.distance(&from) / chart.mean_scale_pxpm() - odom.distance(&from_odom);
            self.jumps += u32::from(beyond_m > JUMP_M);
        }
    }

    /// What to do about arriving now.
    pub fn judge(&self, parameters: &Parameters) -> Belief {
        let fit = self.fit.unwrap_or_default();
        let doubt = JUMP_WEIGHT * f64::from(self.jumps).ln_1p() - fit;
        match self.look {
            Look::Ahead if doubt > parameters.look_above => Belief::Look,
            Look::Done if doubt > parameters.doubt_above => Belief::Doubted(self.jumps, fit),
            _ => Belief::Reached,
        }
    }

    /// The look begins.
    pub fn begin_look(&mut self) {
        self.look = Look::UnderWay;
    }

    /// Whether the robot is looking around.
    pub fn is_looking(&self) -> bool {
        self.look == Look::UnderWay
    }

    /// A recovery behaviour has ended; it may have been the look.
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

    /// The estimate at x px where the odometry says x m, at 20 px/m.
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

    /// After a minute's drive in which the scans fit so well and the estimate jumped so often.
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
