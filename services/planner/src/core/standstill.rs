//! When the robot gets no farther, and what to do about it.
//!
//! A standstill is a robot that has not moved, one that drives about one place, or one that drives
//! around without coming nearer to its goal. The way out: back up, forget what the laser saw, turn
//! and look anew.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use sketchnav_navigation::planning::parameters::Parameters;
use sketchnav_schemas::geometry::{Odom, Point, Pose, wrap_angle};
use sketchnav_schemas::message::Twist;

/// How far to back up, metres.
const BACK_M: f64 = 0.35;
/// How fast, m/s.
const BACK_MPS: f64 = 0.12;
/// For how long at most, seconds.
const BACK_S: f64 = 4.0;
/// How far to turn, radians.
const TURN_RAD: f64 = 2.2;
/// For how long at most, seconds.
const TURN_S: f64 = 8.0;
/// A cost-to-go that grows by more than this in one step comes from an estimate that jumped, metres.
const JUMP_M: f64 = 1.0;
/// Coming nearer by less than this is none, metres.
const NEARER_M: f64 = 0.1;
/// A standstill this far from another one is elsewhere, metres.
const ELSEWHERE_M: f64 = 2.0;
/// A robot that may only drive slower than this needs longer for the same way, and is waited for as much longer, m/s.
pub(super) const USUAL_MPS: f64 = 0.5;
/// The places of so many standstills are remembered.
const REMEMBERED: usize = 16;

/// Where the robot was when it last was elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Anchor {
    place: Point<Odom>,
    since_s: f64,
}

impl Anchor {
    /// For how long the robot, now at `robot`, has been within `radius_m` of one place.
    fn time_about_s(&mut self, now_s: f64, robot: Point<Odom>, radius_m: f64) -> f64 {
        if robot.distance(&self.place) > radius_m {
            *self = Self { place: robot, since_s: now_s };
        }
        now_s - self.since_s
    }
}

/// Watches whether the robot gets on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    stands: Anchor,
    circles: Anchor,
    best_px: f64,
    last_px: f64,
    bettered_s: f64,
}

impl Progress {
    /// Begins to watch.
    pub fn new(now_s: f64, robot: Point<Odom>) -> Self {
        let here = Anchor { place: robot, since_s: now_s };
        Self {
            stands: here.clone(),
            circles: here,
            best_px: f64::INFINITY,
            last_px: f64::INFINITY,
            bettered_s: now_s,
        }
    }

    /// Whether the robot, at `robot` with the cost-to-go `cost_px` and the most that it may drive, is at a standstill.
    pub fn is_standstill(
        &mut self,
        now_s: f64,
        robot: Point<Odom>,
        cost_px: f64,
        scale_pxpm: f64,
        speed_mps: f64,
        parameters: &Parameters,
    ) -> bool {
        let p = parameters;
        let stands_s = self.stands.time_about_s(now_s, robot, p.stall_distance_m);
        let circles_s = self.circles.time_about_s(now_s, robot, p.circling_distance_m);
        let jumped = cost_px > self.last_px + JUMP_M * scale_pxpm;
        self.last_px = cost_px;
        if cost_px < self.best_px - NEARER_M * scale_pxpm || jumped {
            (self.best_px, self.bettered_s) = (cost_px, now_s);
        }
        let patience = (USUAL_MPS / speed_mps).max(1.0);
        stands_s > p.stall_s * patience
            || circles_s * speed_mps > p.circling_way_m
            || now_s - self.bettered_s > p.detour_s * patience
    }
}

/// A way out of a standstill.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Maneuver {
    /// Drive backwards.
    BackUp {
        /// From here.
        from: Point<Odom>,
        /// At the latest until then, seconds.
        until_s: f64,
    },
    /// Turn on the spot.
    Turn {
        /// So far yet, radians, counter-clockwise.
        left_rad: f64,
        /// The last heading, radians.
        yaw_rad: f64,
        /// At the latest until then, seconds.
        until_s: f64,
    },
}

/// What a maneuver wants next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Next {
    /// Drive like this.
    Drive(Twist),
    /// Forget what the laser saw, and turn.
    LookAnew(Maneuver),
    /// Go on to the goal.
    Done,
}

impl Maneuver {
    /// Begins with backing up.
    pub fn begin(now_s: f64, robot: Point<Odom>) -> Self {
        Self::BackUp { from: robot, until_s: now_s + BACK_S }
    }

    /// A full turn on the spot, to see what is all around.
    pub fn look_around(now_s: f64, robot: &Pose<Odom>, turn_rate_radps: f64) -> Self {
        Self::Turn { left_rad: TAU, yaw_rad: robot.yaw_rad, until_s: now_s + 2.0 * TAU / turn_rate_radps }
    }

    /// Takes a step; `count` says which way to turn.
    pub fn step(&mut self, now_s: f64, robot: &Pose<Odom>, count: u32, turn_rate_radps: f64) -> Next {
        match self {
            Self::BackUp { from, until_s } => {
                if now_s < *until_s && robot.position().distance(from) < BACK_M {
                    return Next::Drive(Twist { vx_mps: -BACK_MPS, vy_mps: 0.0, yaw_rate_radps: 0.0 });
                }
                let left_rad = if count % 2 == 1 { TURN_RAD } else { -TURN_RAD };
                Next::LookAnew(Self::Turn { left_rad, yaw_rad: robot.yaw_rad, until_s: now_s + TURN_S })
            }
            Self::Turn { left_rad, yaw_rad, until_s } => {
                let side = left_rad.signum();
                *left_rad -= wrap_angle(robot.yaw_rad - *yaw_rad);
                *yaw_rad = robot.yaw_rad;
                if now_s < *until_s && *left_rad * side > 0.1 {
                    return Next::Drive(Twist {
                        vx_mps: 0.0,
                        vy_mps: 0.0,
                        yaw_rate_radps: side * turn_rate_radps,
                    });
                }
                Next::Done
            }
        }
    }
}

/// Counts the standstills of a task.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Standstills {
    /// Of the whole task.
    pub total: u32,
    /// At about the last place, from one to the next: a robot that tries a wall all along gets no farther.
    pub here: u32,
    /// Of the last ones, in turn.
    places: [Option<Point<Odom>>; REMEMBERED],
}

impl Standstills {
    /// Counts one; false where there were too many.
    pub fn count(&mut self, robot: Point<Odom>, parameters: &Parameters) -> bool {
        let newest = self.total as usize % REMEMBERED;
        self.places[newest] = Some(robot);
        self.here = self.joined_with(newest);
        self.total += 1;
        self.here <= parameters.recoveries && self.total <= parameters.recoveries_per_task
    }

    /// How many of the remembered places hang together with one of them, it included.
    fn joined_with(&self, first: usize) -> u32 {
        let mut joined = [false; REMEMBERED];
        joined[first] = true;
        // What is joined by the last of several is found in as many rounds.
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

    #[test]
    fn a_robot_that_does_not_move_is_at_a_standstill() {
        let parameters = Parameters::default();
        let mut progress = Progress::new(0.0, Point::new(0.0, 0.0));
        let mut at = |s: f64| progress.is_standstill(s, Point::new(0.1, 0.0), 9.0, 20.0, 0.5, &parameters);
        assert!(!at(6.9) && at(7.1));
    }

    /// One that creeps through a door at a tenth of a metre a second, as it slows down there, once was taken for one
    /// that stands still, and gave up.
    #[test]
    fn a_slow_robot_is_waited_for() {
        let parameters = Parameters::default();
        let mut progress = Progress::new(0.0, Point::new(0.0, 0.0));
        let ended = (0..600).find(|i| {
            let s = f64::from(*i) * 0.1;
            progress.is_standstill(s, Point::new(0.03 * s, 0.0), 900.0 - 0.6 * s, 20.0, 0.12, &parameters)
        });
        assert_eq!(ended, None);
        let mut at = |s: f64| progress.is_standstill(s, Point::new(1.8, 0.0), 864.0, 20.0, 0.12, &parameters);
        assert!(!at(70.0) && at(95.0), "standing still");
    }

    /// It once was not: whenever the estimate jumped, the watch began anew, and the robot drove in circles
    /// until the time was over.
    #[test]
    fn a_robot_that_circles_about_one_place_is_at_a_standstill_whatever_the_estimate_says() {
        let parameters = Parameters::default();
        let mut progress = Progress::new(0.0, Point::new(0.7, 0.0));
        let ended = (0..400).find(|i| {
            let s = f64::from(*i) * 0.1;
            let place = Point::new(0.7 * s.cos(), 0.7 * s.sin());
            progress.is_standstill(s, place, 900.0 + 50.0 * f64::from(i % 7), 20.0, 0.5, &parameters)
        });
        let expected = (parameters.circling_way_m / 0.5 * 10.0) as i32;
        assert!((expected..expected + 5).contains(&ended.unwrap()), "{ended:?}");
    }

    #[test]
    fn a_robot_that_drives_around_is_at_a_standstill() {
        let parameters = Parameters::default();
        let mut progress = Progress::new(0.0, Point::new(0.0, 0.0));
        let ended = (0..400).find(|i| {
            let s = f64::from(*i) * 0.1;
            let place = Point::new(2.0 * s.cos(), 2.0 * s.sin());
            progress.is_standstill(s, place, 900.0 + 50.0 * s.sin(), 20.0, 0.5, &parameters)
        });
        assert!((300..390).contains(&ended.unwrap()), "{ended:?}");
    }

    #[test]
    fn standstills_at_another_place_count_anew() {
        let parameters = Parameters::default();
        let mut standstills = Standstills::default();
        let counted: Vec<_> = (0..4).map(|_| standstills.count(Point::new(0.0, 0.0), &parameters)).collect();
        assert_eq!(counted, [true, true, true, false]);
        assert!(standstills.count(Point::new(5.0, 0.0), &parameters));
    }

    /// A robot that tried a shut wall every metre once tried it until its time was over.
    #[test]
    fn standstills_along_a_wall_are_at_one_place() {
        let parameters = Parameters::default();
        let mut standstills = Standstills::default();
        let counted: Vec<_> =
            (0..4).map(|x| standstills.count(Point::new(f64::from(x), 0.0), &parameters)).collect();
        assert_eq!(counted, [true, true, true, false]);
    }

    /// A robot that stood still at two places in turn once never gave up.
    #[test]
    fn standstills_at_two_places_in_turn_count_at_each() {
        let parameters = Parameters::default();
        let mut standstills = Standstills::default();
        let places = [0.0, 3.0].map(|x| Point::new(x, 0.0));
        let counted: Vec<_> =
            places.iter().cycle().take(7).map(|&place| standstills.count(place, &parameters)).collect();
        assert_eq!(counted, [true, true, true, true, true, true, false]);
    }
}
