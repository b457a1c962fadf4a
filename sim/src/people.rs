//! People, modelled as discs that walk back and forth along their waypoints. They pause at each waypoint, and wait if a robot is in
//! their way.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::floor_plan::Person;

use crate::sensors::Disc;

/// Distance between a person and a robot, rim to rim, below which the person waits, in metres.
const PERSONAL_SPACE_M: f64 = 0.3;

/// A person who walks around.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Walker {
    person: Person,
    at: Vector2<f64>,
    next: usize,
    backwards: bool,
    pause_left_s: f64,
}

impl Walker {
    /// Creates a walker at the first waypoint of `person`, beginning with the pause there. `person` must have
    /// at least one waypoint.
    pub fn new(person: &Person) -> Self {
        let at = person.waypoints[0].into();
        Self { at, next: 0, backwards: false, pause_left_s: person.pause_s, person: person.clone() }
    }

    /// Returns the position of the person, in metres, in frame `World`.
    pub fn position(&self) -> Vector2<f64> {
        self.at
    }

    /// Returns the position and the radius of the person, in metres.
    pub fn disc(&self) -> Disc {
        (self.at.into(), self.person.radius_m)
    }

    /// Keeps walking for `dt_s` seconds, unless the step would bring the person too close to `robot`.
    pub fn step(&mut self, dt_s: f64, robot: Vector2<f64>, robot_radius_m: f64) {
        if self.pause_left_s > 0.0 {
            self.pause_left_s -= dt_s;
            return;
        }
        let to_next = Vector2::from(self.person.waypoints[self.next]) - self.at;
        let step = to_next.cap_magnitude(self.person.speed_mps * dt_s);
        let (before, after) = ((robot - self.at).norm(), (robot - self.at - step).norm());
        if after < before && after < robot_radius_m + self.person.radius_m + PERSONAL_SPACE_M {
            return;
        }
        self.at += step;
        if step == to_next {
            self.arrive();
        }
    }

    fn arrive(&mut self) {
        self.pause_left_s = self.person.pause_s;
        let last = self.person.waypoints.len() - 1;
        self.backwards = if self.backwards { self.next > 0 } else { self.next == last };
        self.next = if self.backwards { self.next.saturating_sub(1) } else { (self.next + 1).min(last) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker() -> Walker {
        let waypoints = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        Walker::new(&Person { waypoints, speed_mps: 1.0, radius_m: 0.25, pause_s: 0.5 })
    }

    #[test]
    fn people_walk_back_and_forth() {
        let (mut walker, far) = (walker(), Vector2::new(99.0, 99.0));
        let mut visited = vec![walker.next];
        for _ in 0..1000 {
            walker.step(0.01, far, 0.2);
            if visited.last() != Some(&walker.next) {
                visited.push(walker.next);
            }
        }
        assert_eq!(visited, [0, 1, 2, 1, 0, 1, 2, 1]);
    }

    #[test]
    fn people_wait_for_a_robot_in_the_way() {
        let (mut walker, robot) = (walker(), Vector2::new(0.9, 0.0));
        for _ in 0..500 {
            walker.step(0.01, robot, 0.2);
        }
        let gap = (robot - walker.position()).norm() - 0.2 - 0.25;
        assert!((0.3..0.32).contains(&gap), "{gap}");
    }
}
