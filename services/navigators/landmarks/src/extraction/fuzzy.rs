//! How significant an event is for a change of the command: the rules of Chronis 2007, figure 4.8.
//!
//! The membership functions of figure 4.9 are lost. These are ours (degree over the input, linear between the places):
//!
//! ```text
//! timing, in steps        0   1   3   5          main direction, in sixteenths off the front   0   4   8
//!   very close            1   1   0   0          front                                         1   0   0
//!   close                 0   0   1   0          left, right                                   0   1   0
//!   far                   0   0   0   1          rear                                          0   0   1
//! ```
//!
//! An output is a number: very high 1, high 0.8, good 0.6, poor 0.2. The significance is the mean of the outputs of all
//! rules, weighted by the degrees of their inputs (Sugeno's inference). An unchanged status fires no rule.

use serde::{Deserialize, Serialize};
use sketchnav_qualitative::hof::Surround;

use crate::route::{DIRECTIONS, Place, between};

/// What became of an object at a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// It came in view.
    New,
    /// It stays in view.
    Unchanged,
    /// It was seen for the last time.
    Disappeared,
}

const VERY_HIGH: f64 = 1.0;
const HIGH: f64 = 0.8;
const GOOD: f64 = 0.6;
const POOR: f64 = 0.2;

/// A piecewise linear function by its corners.
fn linear(x: f64, corners: &[(f64, f64)]) -> f64 {
    let (first, last) = (corners[0], corners[corners.len() - 1]);
    let pair = corners.windows(2).find(|pair| x <= pair[1].0);
    match pair {
        _ if x <= first.0 => first.1,
        Some(pair) => pair[0].1 + (x - pair[0].0) / (pair[1].0 - pair[0].0) * (pair[1].1 - pair[0].1),
        None => last.1,
    }
}

/// The significance of an event, from 0 to 1.
pub fn significance(steps_off: usize, place: Place, status: Status) -> f64 {
    let timing = steps_off as f64;
    let off = f64::from(off_front(place));
    let rules = [
        (linear(timing, &[(1.0, 1.0), (3.0, 0.0)]), VERY_HIGH),
        (linear(timing, &[(1.0, 0.0), (3.0, 1.0), (5.0, 0.0)]), GOOD),
        (linear(timing, &[(3.0, 0.0), (5.0, 1.0)]), POOR),
        (linear(off, &[(0.0, 1.0), (4.0, 0.0)]), VERY_HIGH),
        (linear(off, &[(0.0, 0.0), (4.0, 1.0), (8.0, 0.0)]), HIGH),
        (linear(off, &[(4.0, 0.0), (8.0, 1.0)]), POOR),
        (f64::from(status == Status::New), VERY_HIGH),
        (f64::from(status == Status::Disappeared), GOOD),
    ];
    let sum: f64 = rules.iter().map(|(degree, output)| degree * output).sum();
    sum / rules.iter().map(|(degree, _)| degree).sum::<f64>()
}

/// How far a place is off the front, in sixteenths of a turn. What surrounds the robot is in front, too.
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
        is(rate(3, 0, Status::Disappeared), (0.6 + 1.0 + 0.6) / 3.0);
        is(rate(5, 8, Status::Unchanged), 0.2);
        is(rate(2, 1, Status::New), (0.5 + 0.5 * 0.6 + (0.75 + 0.25 * 0.8) + 1.0) / 3.0);
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
