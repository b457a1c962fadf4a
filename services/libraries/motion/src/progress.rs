//! The progress checker detects that the robot is stuck, and counts how often this happens.
//!
//! A robot is stuck if it does not move, if it keeps driving around in one place, or if it drives around without getting closer to
//! its goal.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Point};

/// Increase of the cost-to-go within one step, in metres, beyond which the pose estimate must have jumped.
const JUMP_M: f64 = 1.0;
/// Minimum decrease of the cost-to-go, in metres, that counts as progress.
const NEARER_M: f64 = 0.1;
/// Minimum distance, in metres, from all earlier positions for a stuck robot to count as stuck at a new place.
const ELSEWHERE_M: f64 = 2.0;
/// The time limits assume this speed limit, in m/s. A robot with a lower limit needs longer for the same distance and gets
/// proportionally more time.
pub const USUAL_MPS: f64 = 0.5;
/// Maximum number of stored positions where the robot was stuck.
const REMEMBERED: usize = 16;

/// Criteria for deciding that the robot is stuck, and limits on how often this may happen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProgressParameters {
    /// Time without motion until the robot counts as stuck, in seconds.
    pub stuck_time_s: f64,
    /// Minimum distance, in metres, that counts as moving.
    pub stuck_radius_m: f64,
    /// Time without progress towards the goal until the robot counts as stuck, in seconds.
    pub no_progress_time_s: f64,
    /// Length of a path, in metres. The robot is stuck when it has stayed around one place for as long as this path takes at its
    /// speed limit.
    pub circling_path_m: f64,
    /// Radius, in metres, within which the robot counts as staying around one place.
    pub circling_radius_m: f64,
    /// Maximum number of recoveries around one place.
    pub recoveries: u32,
    /// Maximum number of recoveries during one task.
    pub recoveries_per_task: u32,
}

/// A position near which the robot has stayed, and when it arrived there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Anchor {
    place: Point<Odom>,
    since_s: f64,
}

impl Anchor {
    /// Returns how long, in seconds, the robot has stayed within `radius_m` of the anchor. If it has left, moves the anchor to
    /// `robot`.
    fn time_about_s(&mut self, now_s: f64, robot: Point<Odom>, radius_m: f64) -> f64 {
        if robot.distance(&self.place) > radius_m {
            *self = Self { place: robot, since_s: now_s };
        }
        now_s - self.since_s
    }
}

/// Watches whether the robot makes progress.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProgressChecker {
    stands: Anchor,
    circles: Anchor,
    best_cost: f64,
    last_cost: f64,
    bettered_s: f64,
}

impl ProgressChecker {
    /// Starts watching a robot at `robot`.
    pub fn new(now_s: f64, robot: Point<Odom>) -> Self {
        let here = Anchor { place: robot, since_s: now_s };
        Self {
            stands: here.clone(),
            circles: here,
            best_cost: f64::INFINITY,
            last_cost: f64::INFINITY,
            bettered_s: now_s,
        }
    }

    /// Returns true if the robot, which is at `robot` and may drive at up to `speed_mps`, is stuck. `cost` is
    /// the cost-to-go, where a metre costs `cost_per_m`.
    pub fn is_stuck(
        &mut self,
        now_s: f64,
        robot: Point<Odom>,
        cost: f64,
        cost_per_m: f64,
        speed_mps: f64,
        parameters: &ProgressParameters,
    ) -> bool {
        let p = parameters;
        let stands_s = self.stands.time_about_s(now_s, robot, p.stuck_radius_m);
        let circles_s = self.circles.time_about_s(now_s, robot, p.circling_radius_m);
        let jumped = cost > self.last_cost + JUMP_M * cost_per_m;
        self.last_cost = cost;
        if cost < self.best_cost - NEARER_M * cost_per_m || jumped {
            (self.best_cost, self.bettered_s) = (cost, now_s);
        }
        let patience = (USUAL_MPS / speed_mps).max(1.0);
        stands_s > p.stuck_time_s * patience
            || circles_s * speed_mps > p.circling_path_m
            || now_s - self.bettered_s > p.no_progress_time_s * patience
    }
}

/// Counts how often the robot was stuck during a task.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StuckCounter {
    /// Count for the whole task.
    pub total: u32,
    /// Count at the last place and at all places connected to it by short distances. These count together
    /// because a robot that tries one spot after another along a wall makes no progress.
    pub here: u32,
    /// The most recent places, as a ring.
    places: [Option<Point<Odom>>; REMEMBERED],
}

impl StuckCounter {
    /// Records that the robot is stuck at `robot`. Returns false if it has been stuck too often.
    pub fn count(&mut self, robot: Point<Odom>, parameters: &ProgressParameters) -> bool {
        let newest = self.total as usize % REMEMBERED;
        self.places[newest] = Some(robot);
        self.here = self.joined_with(newest);
        self.total += 1;
        self.here <= parameters.recoveries && self.total <= parameters.recoveries_per_task
    }

    /// Returns the number of remembered places that are connected to the place `first`, including that place.
    fn joined_with(&self, first: usize) -> u32 {
        let mut joined = [false; REMEMBERED];
        joined[first] = true;
        // Each round reaches places that are one more link away.
        for _ in 0..REMEMBERED {
            for place in 0..REMEMBERED {
                joined[place] |= (0..REMEMBERED).any(|other| joined[other] && self.are_near(place, other));
            }
        }
        joined.iter().filter(|&&it| it).count() as u32
    }

    fn are_near(&self, one: usize, other: usize) -> bool {
        let near = |(a, b): (Point<Odom>, Point<Odom>)| a.distance(&b) <= ELSEWHERE_M;
        self.places[one].zip(self.places[other]).is_some_and(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: ProgressParameters = ProgressParameters {
        stuck_time_s: 7.0,
        stuck_radius_m: 0.3,
        no_progress_time_s: 30.0,
        circling_path_m: 6.5,
        circling_radius_m: 1.5,
        recoveries: 3,
        recoveries_per_task: 8,
    };

    #[test]
    fn a_robot_that_does_not_move_is_stuck() {
        let mut progress = ProgressChecker::new(0.0, Point::new(0.0, 0.0));
        let mut at = |s: f64| progress.is_stuck(s, Point::new(0.1, 0.0), 9.0, 20.0, 0.5, &PARAMETERS);
        assert!(!at(6.9) && at(7.1));
    }

    /// A robot crept through a door at a tenth of a metre per second, because it slows down there. The checker took it to be
    /// standing still, and the robot gave up.
    #[test]
    fn a_slow_robot_is_not_stuck() {
        let mut progress = ProgressChecker::new(0.0, Point::new(0.0, 0.0));
        let ended = (0..600).find(|i| {
            let s = f64::from(*i) * 0.1;
            progress.is_stuck(s, Point::new(0.03 * s, 0.0), 900.0 - 0.6 * s, 20.0, 0.12, &PARAMETERS)
        });
        assert_eq!(ended, None);
        let mut at = |s: f64| progress.is_stuck(s, Point::new(1.8, 0.0), 864.0, 20.0, 0.12, &PARAMETERS);
        assert!(!at(70.0) && at(95.0), "standing still");
    }

    /// Whenever the estimate jumped, the checker used to start over, and the robot drove in circles until its time ran out.
    #[test]
    fn a_robot_circling_in_place_is_stuck_whatever_the_estimate() {
        let mut progress = ProgressChecker::new(0.0, Point::new(0.7, 0.0));
        let ended = (0..400).find(|i| {
            let s = f64::from(*i) * 0.1;
            let place = Point::new(0.7 * s.cos(), 0.7 * s.sin());
            progress.is_stuck(s, place, 900.0 + 50.0 * f64::from(i % 7), 20.0, 0.5, &PARAMETERS)
        });
        let expected = (PARAMETERS.circling_path_m / 0.5 * 10.0) as i32;
        assert!((expected..expected + 5).contains(&ended.unwrap()), "{ended:?}");
    }

    #[test]
    fn a_robot_that_drives_around_is_stuck() {
        let mut progress = ProgressChecker::new(0.0, Point::new(0.0, 0.0));
        let ended = (0..400).find(|i| {
            let s = f64::from(*i) * 0.1;
            let place = Point::new(2.0 * s.cos(), 2.0 * s.sin());
            progress.is_stuck(s, place, 900.0 + 50.0 * s.sin(), 20.0, 0.5, &PARAMETERS)
        });
        assert!((300..390).contains(&ended.unwrap()), "{ended:?}");
    }

    #[test]
    fn being_stuck_elsewhere_resets_the_count() {
        let mut counter = StuckCounter::default();
        let counted: Vec<_> = (0..4).map(|_| counter.count(Point::new(0.0, 0.0), &PARAMETERS)).collect();
        assert_eq!(counted, [true, true, true, false]);
        assert!(counter.count(Point::new(5.0, 0.0), &PARAMETERS));
    }

    /// A robot that tried a closed wall at every metre used to keep going until its time ran out.
    #[test]
    fn being_stuck_along_a_wall_counts_as_one_place() {
        let mut counter = StuckCounter::default();
        let counted: Vec<_> =
            (0..4).map(|x| counter.count(Point::new(f64::from(x), 0.0), &PARAMETERS)).collect();
        assert_eq!(counted, [true, true, true, false]);
    }

    /// A robot that got stuck at two places in turn used to go on forever.
    #[test]
    fn being_stuck_at_two_places_in_turn_counts_at_each() {
        let mut counter = StuckCounter::default();
        let places = [0.0, 3.0].map(|x| Point::new(x, 0.0));
        let counted: Vec<_> =
            places.iter().cycle().take(7).map(|&place| counter.count(place, &PARAMETERS)).collect();
        assert_eq!(counted, [true, true, true, true, true, true, false]);
    }
}
