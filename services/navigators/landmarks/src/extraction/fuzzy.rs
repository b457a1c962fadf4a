//! Rates the significance of an event for a change of the command, by the rules of Chronis 2007, figure 4.8.
//!
//! The membership functions of figure 4.9 are lost, so these are ours (degree over the input, linear between the points):
//!
//! ```text
//! timing, in steps        0   2   4          main direction, in sixteenths off the front   0   2   4   6   8
//!   very close            1   0   0          front                                         1   1   0   0   0
//!   close                 0   1   0          left, right                                   0   0   1   1   0
//!   far                   0   0   1          rear                                          0   0   0   0   1
//! ```
//!
//! Their flat parts are required by the examples: state 6 of figure 4.29 has the directions 1, 0 and 14 with "an equal score
//! for all three", and the state at step 10 of figure 4.7 has 5, 6 and 12.
//!
//! An output is a number: very high 1, high 0.8, good 0.6, poor 0.2. The significance is the mean of the outputs of all rules,
//! weighted by the degrees of their inputs (Sugeno's inference). An unchanged status fires no rule.

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::hof::Surround;

use crate::route::{DIRECTIONS, Place, between};

/// Status of an object at a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// The object has come into view.
    New,
    /// The object stays in view.
    Unchanged,
    /// The object is seen for the last time.
    Disappeared,
}

const VERY_HIGH: f64 = 1.0;
const HIGH: f64 = 0.8;
const GOOD: f64 = 0.6;
const POOR: f64 = 0.2;

/// Evaluates a piecewise linear function, given its corners.
fn linear(x: f64, corners: &[(f64, f64)]) -> f64 {
    let (first, last) = (corners[0], corners[corners.len() - 1]);
    let pair = corners.windows(2).find(|pair| x <= pair[1].0);
    match pair {
        _ if x <= first.0 => first.1,
        Some(pair) => pair[0].1 + (x - pair[0].0) / (pair[1].0 - pair[0].0) * (pair[1].1 - pair[0].1),
        None => last.1,
    }
}

/// Returns the significance, from 0 to 1, of an event that is `steps_off` steps from the change of the command.
pub fn significance(steps_off: usize, place: Place, status: Status) -> f64 {
    let timing = steps_off as f64;
    let off = f64::from(off_front(place));
    let rules = [
        (linear(timing, &[(0.0, 1.0), (2.0, 0.0)]), VERY_HIGH),
        (linear(timing, &[(0.0, 0.0), (2.0, 1.0), (4.0, 0.0)]), GOOD),
        (linear(timing, &[(2.0, 0.0), (4.0, 1.0)]), POOR),
        (linear(off, &[(2.0, 1.0), (4.0, 0.0)]), VERY_HIGH),
        (linear(off, &[(2.0, 0.0), (4.0, 1.0), (6.0, 1.0), (8.0, 0.0)]), HIGH),
        (linear(off, &[(6.0, 0.0), (8.0, 1.0)]), POOR),
        (f64::from(status == Status::New), VERY_HIGH),
        (f64::from(status == Status::Disappeared), GOOD),
    ];
    let sum: f64 = rules.iter().map(|(degree, output)| degree * output).sum();
    sum / rules.iter().map(|(degree, _)| degree).sum::<f64>()
}

/// Returns the angle of a place from the front, in sixteenths of a turn. Objects that surround the robot have a main direction,
/// too.
fn off_front(place: Place) -> u8 {
    match place {
        Place::Direction(direction) => between(direction, 0),
        Place::Surrounds(Surround::From(main)) => between(main as u8, 0),
        Place::Surrounds(Surround::OpeningAt(opening)) => {
            between((opening as u8 + DIRECTIONS / 2) % DIRECTIONS, 0)
        }
        Place::Surrounds(Surround::Completely) => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(steps_off: usize, direction: u8, status: Status) -> f64 {
        significance(steps_off, Place::Direction(direction), status)
    }

    #[test]
    fn rules_fire_as_in_figure_4_8() {
        let is = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found}, {expected}");
        is(rate(0, 0, Status::Unchanged), 1.0);
        is(rate(0, 0, Status::New), 1.0);
        is(rate(0, 4, Status::Unchanged), (1.0 + 0.8) / 2.0);
        is(rate(0, 12, Status::Unchanged), (1.0 + 0.8) / 2.0);
        is(rate(0, 8, Status::Unchanged), (1.0 + 0.2) / 2.0);
        is(rate(2, 0, Status::Disappeared), (0.6 + 1.0 + 0.6) / 3.0);
        is(rate(4, 8, Status::Unchanged), 0.2);
        is(rate(1, 3, Status::New), (0.5 + 0.5 * 0.6 + (0.5 + 0.5 * 0.8) + 1.0) / 3.0);
    }

    #[test]
    fn what_the_examples_call_equal_is_equal() {
        // Chronis 2007, figure 4.29, state 6; figure 4.7, step 10.
        for directions in [[1, 0, 14], [5, 6, 12]] {
            let [one, other, third] = directions.map(|direction| rate(0, direction, Status::Unchanged));
            assert!((one - other).abs() < 1e-12 && (one - third).abs() < 1e-12, "{directions:?}");
        }
        assert!(rate(0, 2, Status::Unchanged) > rate(0, 5, Status::Unchanged));
    }

    #[test]
    fn near_events_in_front_that_are_new_count_most() {
        for direction in 0..16 {
            for steps in 0..6 {
                assert!(
                    rate(steps, direction, Status::Unchanged)
                        >= rate(steps + 1, direction, Status::Unchanged)
                );
                assert!(rate(steps, direction, Status::New) >= rate(steps, direction, Status::Disappeared));
                assert!(rate(steps, 0, Status::New) >= rate(steps, direction, Status::New));
            }
        }
    }
}
