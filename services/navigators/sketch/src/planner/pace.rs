//! Compares the time under way with the length of the path in the drawing.
//!
//! A robot that misses the right door comes to places that look like others. It may wander among them for a long time, since each
//! step seems to lead closer to the goal. This can be detected when the time is out of all proportion to the drawn path. The time
//! is used rather than the distance travelled, because a robot that has gone astray also stands still, backs up and looks around.

use crate::paths::parameters::Parameters;
use serde::{Deserialize, Serialize};

use sketchnav_motion::progress::USUAL_MPS;

/// The time and the drawn path of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    began_s: f64,
    drawn_m: Option<f64>,
    /// Whether the length of the next plan's path will be recorded.
    counts: bool,
}

impl Pace {
    /// Begins to watch the pace.
    pub fn new(now_s: f64) -> Self {
        Self { began_s: now_s, drawn_m: None, counts: true }
    }

    /// Records the length `drawn_m` of the path in the drawing. Only the first call counts, and the first call after each
    /// [`Pace::go_around`].
    pub fn plan(&mut self, drawn_m: f64) {
        if std::mem::take(&mut self.counts) {
            self.drawn_m = Some(self.drawn_m.map_or(drawn_m, |known_m| known_m.max(drawn_m)));
        }
    }

    /// Records that the path is shut. The length of the next plan's path, around the blockage, then counts if it is longer.
    pub fn go_around(&mut self) {
        self.counts = true;
    }

    /// Returns the time under way, in seconds, and the length of the drawn path, in metres, if the time is out of proportion for a
    /// robot that may drive at up to `speed_mps`.
    pub fn astray(&self, now_s: f64, speed_mps: f64, parameters: &Parameters) -> Option<(f64, f64)> {
        let (on_way_s, drawn_m) = (now_s - self.began_s, self.drawn_m?);
        let most_m = parameters.astray_factor * (drawn_m + parameters.astray_m);
        (on_way_s * speed_mps.min(USUAL_MPS) > most_m).then_some((on_way_s, drawn_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> Parameters {
        Parameters { astray_factor: 3.0, astray_m: 5.0, ..Parameters::default() }
    }

    /// 3·(10 + 5) m take 90 s at half a metre per second, and 450 s at a tenth.
    #[test]
    fn whoever_is_far_longer_on_the_way_than_is_drawn_is_astray() {
        let mut pace = Pace::new(100.0);
        let at = |pace: &Pace, s: f64, mps: f64| pace.astray(100.0 + s, mps, &parameters());
        assert_eq!(at(&pace, 1000.0, 0.5), None, "nothing is drawn yet");
        pace.plan(10.0);
        pace.plan(1000.0);
        assert_eq!(at(&pace, 89.0, 0.5), None);
        assert_eq!(at(&pace, 91.0, 0.5), Some((91.0, 10.0)), "the first plan counts");
        assert_eq!(at(&pace, 89.0, 3.0), None, "in a building nobody drives at top speed");
        assert_eq!(at(&pace, 449.0, 0.1), None);
        assert_eq!(at(&pace, 451.0, 0.1), Some((451.0, 10.0)));
    }

    /// Regression test: the watch started over whenever a place was found to be shut. A robot that was elsewhere found one such
    /// place after another, and kept going until its time ran out.
    #[test]
    fn a_way_around_gets_the_time_that_it_takes_and_no_more() {
        let mut pace = Pace::new(0.0);
        pace.plan(10.0);
        pace.go_around();
        pace.plan(8.0);
        assert!(pace.astray(91.0, 0.5, &parameters()).is_some(), "as long as before");
        pace.go_around();
        pace.plan(30.0);
        assert_eq!(pace.astray(209.0, 0.5, &parameters()), None, "3·(30 + 5) m are 210 s");
        assert_eq!(pace.astray(211.0, 0.5, &parameters()), Some((211.0, 30.0)));
    }
}
