//! Decides whether the robot is lost (Chronis 2007, 4.8), which is the case if it has not matched the next state within twice
//! the expected time.

use serde::{Deserialize, Serialize};

use crate::drawn::{DrawnMetres, Stretch};
use crate::error::Error;
use crate::numbers;

/// Parameters that determine when the robot gives up waiting for a state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Patience {
    /// Multiple of the expected time after which the robot is lost. The thesis uses 2.
    pub factor: f64,
    /// Expected time for a leg of unknown length, in seconds (ours).
    pub unknown_s: f64,
    /// Maximum factor, in both directions, by which the time taken for one leg changes the estimate for the next. The estimate is
    /// "updated depending on the amount of time it took the robot to travel between the previous two QLS's" (4.8), but the bound is
    /// ours.
    pub most_stretch: f64,
}

impl Default for Patience {
    fn default() -> Self {
        Self { factor: 2.0, unknown_s: 30.0, most_stretch: 2.0 }
    }
}

impl Patience {
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let Self { factor, unknown_s, most_stretch } = *self;
        numbers::from_0_on(&[("factor", factor), ("unknown_s", unknown_s)])?;
        if !(1.0..=1e6).contains(&most_stretch) {
            let (what, expected) = ("most_stretch".into(), "1 to 1000000");
            return Err(Error::Number { what, expected, found: most_stretch });
        }
        Ok(())
    }
}

/// Measures how long the robot has been waiting for the next state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Waiting {
    /// Time since the last state, in seconds.
    since_s: f64,
    /// Ratio of the actual to the expected time for the leg between the last two states.
    stretch: f64,
}

impl Default for Waiting {
    fn default() -> Self {
        Self { since_s: 0.0, stretch: 1.0 }
    }
}

/// The leg between two states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Length of the leg, or `None` if it was neither drawn nor stated.
    pub length: Option<DrawnMetres>,
    /// Speed of the robot, in metres per second.
    pub speed_mps: f64,
    /// Time that the minimum turn or distance before the next match takes (4.7), in seconds. With a shorter estimate, the robot
    /// would be declared lost before it was allowed to match.
    pub least_s: f64,
}

impl Leg {
    /// Returns the duration of the leg if the drawing is to scale ("after scaling the sketched path", 4.8), in seconds.
    fn drawn_s(&self) -> Option<f64> {
        self.length.map(|length| Stretch::NONE.driven_m(length) / self.speed_mps)
    }
}

impl Waiting {
    /// Advances the time. Returns true if the robot is lost on this leg.
    pub fn pass(&mut self, time_s: f64, leg: &Leg, patience: &Patience) -> bool {
        self.since_s += time_s;
        self.since_s > patience.factor * self.expected_s(leg, patience)
    }

    /// Returns the expected time for a leg, in seconds, adjusted by the time that the previous leg took.
    pub fn expected_s(&self, leg: &Leg, patience: &Patience) -> f64 {
        leg.drawn_s().map_or(patience.unknown_s, |drawn_s| drawn_s * self.stretch).max(leg.least_s)
    }

    /// Records that the state at the end of a leg has been matched.
    pub fn matched(&mut self, leg: &Leg, patience: &Patience) {
        if let Some(drawn_s) = leg.drawn_s().filter(|drawn_s| *drawn_s > 0.0) {
            let stretch = self.since_s / drawn_s;
            self.stretch = stretch.clamp(1.0 / patience.most_stretch, patience.most_stretch);
        }
        self.since_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a leg of the given length, driven at 0.5 m/s.
    fn metres(length: f64) -> Leg {
        Leg { length: Some(DrawnMetres(length)), speed_mps: 0.5, least_s: 3.0 }
    }

    #[test]
    fn the_robot_is_lost_after_twice_the_expected_time() {
        let patience = Patience::default();
        let mut waiting = Waiting::default();
        // 10 m take 20 s.
        assert!(!waiting.pass(39.9, &metres(10.0), &patience));
        assert!(waiting.pass(0.2, &metres(10.0), &patience));
    }

    #[test]
    fn the_next_leg_is_expected_to_take_as_much_longer_or_shorter_as_the_last_one_did() {
        let patience = Patience::default();
        let expected_s = |took_s: f64| {
            let mut waiting = Waiting::default();
            waiting.pass(took_s, &metres(10.0), &patience);
            waiting.matched(&metres(10.0), &patience);
            waiting.expected_s(&metres(5.0), &patience)
        };
        // The previous leg should have taken 20 s, and the next one 10 s. The effect of an outlier is limited to a factor of two.
        for (took_s, expected) in [(20.0, 10.0), (30.0, 15.0), (16.0, 8.0), (99.0, 20.0), (1.0, 5.0)] {
            assert!((expected_s(took_s) - expected).abs() < 1e-12, "{took_s}: {}", expected_s(took_s));
        }
    }

    #[test]
    fn no_leg_is_expected_to_take_less_than_the_robot_takes_to_match_again() {
        let waiting = Waiting::default();
        assert_eq!(waiting.expected_s(&metres(0.2), &Patience::default()), 3.0);
        let at_once = Leg { least_s: 0.0, ..metres(0.2) };
        assert_eq!(waiting.expected_s(&at_once, &Patience::default()), 0.4);
    }

    #[test]
    fn a_leg_of_unknown_length_has_a_time_of_its_own() {
        let patience = Patience::default();
        let unknown = Leg { length: None, ..metres(0.0) };
        let mut waiting = Waiting::default();
        assert!(!waiting.pass(59.0, &unknown, &patience) && waiting.pass(2.0, &unknown, &patience));
        waiting.matched(&unknown, &patience);
        assert_eq!(waiting.expected_s(&metres(4.0), &patience), 8.0);
    }
}
