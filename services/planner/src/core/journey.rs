//! How far the robot has driven, against the way that the drawing showed at first.
//!
//! Who drives past the right door comes to places that look like others, and may go on among them for long: each
//! step seems to lead nearer. That the way is far longer than the drawn one gives it away.

use serde::{Deserialize, Serialize};
use sketchnav_navigation::planning::parameters::Parameters;
use sketchnav_schemas::geometry::{Odom, Point};

/// The way of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Journey {
    drawn_m: Option<f64>,
    driven_m: f64,
    at: Point<Odom>,
}

impl Journey {
    /// Begins at a place.
    pub fn new(at: Point<Odom>) -> Self {
        Self { drawn_m: None, driven_m: 0.0, at }
    }

    /// The robot has come to `at`.
    pub fn drive(&mut self, at: Point<Odom>) {
        self.driven_m += self.at.distance(&at);
        self.at = at;
    }

    /// The drawing shows a way of `drawn_m` from here; the first word counts.
    pub fn plan(&mut self, drawn_m: f64) {
        self.drawn_m.get_or_insert(drawn_m);
    }

    /// The ways driven and drawn, metres, where the first is out of all proportion.
    pub fn astray_m(&self, parameters: &Parameters) -> Option<(f64, f64)> {
        let drawn_m = self.drawn_m?;
        let most_m = parameters.astray_factor * (drawn_m + parameters.astray_m);
        (self.driven_m > most_m).then_some((self.driven_m, drawn_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_drives_far_more_than_is_drawn_is_astray() {
        let parameters = Parameters { astray_factor: 3.0, astray_m: 5.0, ..Parameters::default() };
        let mut journey = Journey::new(Point::new(0.0, 0.0));
        let drive = |journey: &mut Journey, metres: u32| {
            for i in 1..=metres {
                journey.drive(Point::new(f64::from(i % 2), 0.0));
            }
        };
        drive(&mut journey, 100);
        assert_eq!(journey.astray_m(&parameters), None, "nothing is drawn yet");
        let mut journey = Journey::new(Point::new(0.0, 0.0));
        journey.plan(10.0);
        journey.plan(1000.0);
        drive(&mut journey, 44);
        assert_eq!(journey.astray_m(&parameters), None);
        drive(&mut journey, 2);
        assert_eq!(journey.astray_m(&parameters), Some((46.0, 10.0)), "the first plan counts");
    }
}
