//! Whether the robot is lost (Chronis 2007, 4.8): it has not matched the next state in twice the time that it should take.

use serde::{Deserialize, Serialize};

use crate::drawn::{DrawnMetres, Stretch};
use crate::error::Error;
use crate::numbers;

/// How patient the robot is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Patience {
    /// After so many times the expected time the robot is lost: 2.
    pub factor: f64,
    /// The expected time where nobody drew how far it is, in seconds (ours).
    pub unknown_s: f64,
    /// The least expected time, in seconds: short legs end where the robot turned by 30° (ours: 3 s at 10° a second).
    pub least_s: f64,
    /// A leg that took longer makes the next one longer by at most this factor (ours). A leg that took less time does
    /// not make it shorter. Its state was met from afar, and the way that was saved is still to go.
    pub most_stretch: f64,
}

impl Default for Patience {
    fn default() -> Self {
        Self { factor: 2.0, unknown_s: 30.0, least_s: 3.0, most_stretch: 2.0 }
    }
}

impl Patience {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`] with the key.
    pub fn check(&self) -> Result<(), Error> {
        let Self { factor, unknown_s, least_s, most_stretch } = *self;
        let numbers = [
            ("factor", factor),
            ("unknown_s", unknown_s),
            ("least_s", least_s),
            ("most_stretch", most_stretch),
        ];
        numbers::from_0_on(&numbers)
    }
}

/// How long the robot waits for the next state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Waiting {
    /// The time since the last state, in seconds.
    since_s: f64,
    /// How long the way between the last two states took, by the time that it should have taken.
    stretch: f64,
}

impl Default for Waiting {
    fn default() -> Self {
        Self { since_s: 0.0, stretch: 1.0 }
    }
}

impl Waiting {
    /// The time passes. Whether the robot is lost on a leg of this length at this speed.
    pub fn pass(
        &mut self,
        time_s: f64,
        leg: Option<DrawnMetres>,
        speed_mps: f64,
        patience: &Patience,
    ) -> bool {
        self.since_s += time_s;
        self.since_s > patience.factor * self.expected_s(leg, speed_mps, patience)
    }

    /// The expected time of a leg, by the one before.
    pub fn expected_s(&self, leg: Option<DrawnMetres>, speed_mps: f64, patience: &Patience) -> f64 {
        leg.map_or(patience.unknown_s, |leg| drawn_s(leg, speed_mps) * self.stretch).max(patience.least_s)
    }

    /// The state at the end of a leg is matched.
    pub fn matched(&mut self, leg: Option<DrawnMetres>, speed_mps: f64, patience: &Patience) {
        if let Some(leg) = leg.filter(|leg| *leg > DrawnMetres::default()) {
            let stretch = self.since_s / drawn_s(leg, speed_mps);
            self.stretch = stretch.clamp(1.0, patience.most_stretch.max(1.0));
        }
        self.since_s = 0.0;
    }
}

/// How long the robot goes for a length, were the drawing to scale ("after scaling the sketched path", 4.8).
fn drawn_s(leg: DrawnMetres, speed_mps: f64) -> f64 {
    Stretch::NONE.driven_m(leg) / speed_mps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metres(leg: f64) -> Option<DrawnMetres> {
        Some(DrawnMetres(leg))
    }

    #[test]
    fn the_robot_is_lost_after_twice_the_expected_time() {
        let patience = Patience::default();
        let mut waiting = Waiting::default();
        // 10 m at 0.5 m/s take 20 s.
        assert!(!waiting.pass(39.9, metres(10.0), 0.5, &patience));
        assert!(waiting.pass(0.2, metres(10.0), 0.5, &patience));
    }

    #[test]
    fn a_leg_that_took_longer_makes_the_next_one_longer() {
        let patience = Patience::default();
        let mut waiting = Waiting::default();
        waiting.pass(30.0, metres(10.0), 0.5, &patience);
        waiting.matched(metres(10.0), 0.5, &patience);
        assert!((waiting.expected_s(metres(4.0), 0.5, &patience) - 12.0).abs() < 1e-12);
        assert!(!waiting.pass(23.9, metres(4.0), 0.5, &patience));
        assert!(waiting.pass(0.2, metres(4.0), 0.5, &patience));
        // A short leg does not shorten the next one; an accident is bounded.
        let mut quick = Waiting::default();
        quick.pass(5.0, None, 0.5, &patience);
        quick.matched(metres(10.0), 0.5, &patience);
        assert!((quick.expected_s(metres(4.0), 0.5, &patience) - 8.0).abs() < 1e-12);
        waiting.matched(metres(0.1), 0.5, &patience);
        assert!((waiting.expected_s(metres(4.0), 0.5, &patience) - 16.0).abs() < 1e-12);
    }

    #[test]
    fn a_leg_of_unknown_length_has_a_time_of_its_own() {
        let patience = Patience::default();
        let mut waiting = Waiting::default();
        assert!(!waiting.pass(59.0, None, 0.5, &patience) && waiting.pass(2.0, None, 0.5, &patience));
        waiting.matched(None, 0.5, &patience);
        assert_eq!(waiting.expected_s(metres(0.2), 0.5, &patience), 3.0);
    }
}
