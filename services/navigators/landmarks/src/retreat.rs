//! The way back. The robot drops breadcrumbs along its path by odometry, which lead it back to a place where it was sure of its
//! pose.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::wrap_angle;

use crate::drawn::DrawnMetres;
use crate::reckoning::Reckoning;

/// Minimum distance between crumbs, in metres.
const APART_M: f64 = 0.3;
/// Maximum number of crumbs. If there are more, the oldest ones are removed, except for the first.
const CRUMBS: usize = 512;
/// Look-ahead distance on the way back, in metres.
const AHEAD_M: f64 = 0.8;
/// The robot has reached a place if it is within this distance of it, and turned within this angle of its heading there.
const THERE_M: f64 = 0.25;
const FACING_RAD: f64 = 0.15;
/// The robot gives up if the way back exceeds the way there by this factor, plus this length in metres.
const MOST_WAY: f64 = 1.5;
const MORE_M: f64 = 3.0;

/// A pose on the robot's path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Crumb {
    robot: Reckoning,
    /// Position along the drawn route.
    along: DrawnMetres,
    is_sure: bool,
}

/// The way back to a crumb.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Back {
    /// Index of the crumb that the robot drives back to, and of the next crumb on the way there.
    target: usize,
    next: usize,
    /// Distance that the robot had covered when it turned back, in metres.
    begun_m: f64,
}

/// What a robot on its way back has to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Drive in a direction, in radians from the heading.
    Towards(f64),
    /// Turn on the spot by an angle, in radians.
    Turn(f64),
    /// Resume the drive: the robot is back, with the same heading as before, at this position along the route.
    There(DrawnMetres),
    /// Give up: the robot cannot find the way back.
    Failed,
}

/// The path of a robot and, while it drives back, its way back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trail {
    robot: Reckoning,
    crumbs: Vec<Crumb>,
    back: Option<Back>,
}

impl Default for Trail {
    fn default() -> Self {
        Self { robot: Reckoning::default(), crumbs: Vec::with_capacity(CRUMBS), back: None }
    }
}

impl Trail {
    /// Reserves the memory for all crumbs. Call this after reading a checkpoint, which stores values but no spare capacity.
    pub fn reserve(&mut self) {
        self.crumbs.reserve_exact(CRUMBS.saturating_sub(self.crumbs.len()));
    }

    /// Returns true if the robot is on its way back.
    pub const fn is_going_back(&self) -> bool {
        self.back.is_some()
    }

    /// Gives up the way back, if the robot is on one.
    pub const fn forget_way_back(&mut self) {
        self.back = None;
    }

    /// Moves the robot by a distance in metres and an angle in radians, positive to the left.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        self.robot.moved(moved_m, turned_rad);
    }

    /// Drops a crumb if the last one is far enough away or if the robot is sure of its pose.
    pub fn drop_crumb(&mut self, along: DrawnMetres, is_sure: bool) {
        let is_far = |last: &Crumb| last.robot.at.distance(&self.robot.at) >= APART_M;
        if is_sure || self.crumbs.last().is_none_or(is_far) {
            if self.crumbs.len() == CRUMBS {
                self.crumbs.remove(1);
            }
            self.crumbs.push(Crumb { robot: self.robot, along, is_sure });
        }
    }

    /// Begins the way back to the last place where the robot was sure. If it has already turned back `before` times, it skips that
    /// many such places. A robot that is already on its way back continues from there, and does not return to where that way began.
    /// Returns false if there is no place to drive back to.
    pub fn turn_back(&mut self, before: u32) -> bool {
        let next = self.back.map_or(self.crumbs.len().saturating_sub(1), |back| back.next);
        let sure = (0..self.crumbs.len().min(next + 1)).rev().filter(|&i| self.crumbs[i].is_sure);
        let far = |i: &usize| self.crumbs[*i].robot.at.distance(&self.robot.at) > THERE_M + APART_M;
        let target = sure.filter(far).nth(before as usize).unwrap_or(0);
        let is_possible = next > target;
        self.back = is_possible.then_some(Back { target, next, begun_m: self.robot.gone_m });
        is_possible
    }

    /// Returns the next step on the way back, or `None` if the robot is not on one.
    pub fn step(&mut self) -> Option<Step> {
        let Self { robot, crumbs, back } = self;
        let way = back.as_mut()?;
        let target = crumbs[way.target];
        let there_m =
            crumbs[way.target..].windows(2).map(|pair| pair[0].robot.at.distance(&pair[1].robot.at));
        if robot.gone_m - way.begun_m > MOST_WAY * there_m.sum::<f64>() + MORE_M {
            *back = None;
            return Some(Step::Failed);
        }
        while way.next > way.target && crumbs[way.next].robot.at.distance(&robot.at) < AHEAD_M {
            way.next -= 1;
        }
        let aim = crumbs[way.next].robot.at;
        let is_there = way.next == way.target && aim.distance(&robot.at) < THERE_M;
        if !is_there {
            return Some(Step::Towards(wrap_angle(robot.at.direction_rad(&aim) - robot.heading_rad)));
        }
        let off = wrap_angle(target.robot.heading_rad - robot.heading_rad);
        if off.abs() > FACING_RAD {
            return Some(Step::Turn(off));
        }
        crumbs.truncate(way.target + 1);
        *back = None;
        Some(Step::There(target.along))
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::geometry::Point;

    use super::*;

    /// Returns a trail with one corner, with the robot at its end. The robot was sure at 2 m.
    fn driven() -> Trail {
        let mut trail = Trail::default();
        for i in 0..60 {
            trail.drop_crumb(DrawnMetres(0.1 * f64::from(i)), i == 20);
            trail.moved(0.1, if i == 30 { 1.5 } else { 0.0 });
        }
        trail
    }

    fn drive_back(trail: &mut Trail) -> Step {
        for _ in 0..400 {
            match trail.step().unwrap() {
                Step::Towards(off) => trail.moved(0.05 * off.cos().max(0.0), off.clamp(-0.2, 0.2)),
                Step::Turn(off) => trail.moved(0.0, off.clamp(-0.2, 0.2)),
                end => return end,
            }
        }
        panic!("it drives back for ever: {trail:?}")
    }

    #[test]
    fn a_lost_robot_drives_back_to_where_it_was_sure() {
        let mut trail = driven();
        assert_eq!(trail.step(), None);
        assert!(trail.turn_back(0) && trail.is_going_back());
        let Step::There(along) = drive_back(&mut trail) else { panic!("{trail:?}") };
        assert!((along.0 - 2.0).abs() < 1e-9, "{along:?}");
        assert!(trail.robot.at.distance(&Point::new(2.0, 0.0)) < THERE_M, "{trail:?}");
        assert!(wrap_angle(trail.robot.heading_rad).abs() <= FACING_RAD);
        assert!(!trail.is_going_back());
        // The robot was sure nowhere before that place, so the next way back leads to the start.
        for _ in 0..30 {
            trail.moved(0.1, 0.0);
            trail.drop_crumb(DrawnMetres(3.0), false);
        }
        assert!(trail.turn_back(1));
        let Step::There(along) = drive_back(&mut trail) else { panic!("{trail:?}") };
        assert_eq!(along, DrawnMetres(0.0));
        assert!(!trail.turn_back(0), "it stands at the start");
    }

    /// A robot that was blocked on its way back used to begin again at the last crumb, so it drove forward first.
    #[test]
    fn a_robot_that_is_blocked_on_its_way_back_goes_on_from_there() {
        let mut trail = driven();
        assert!(trail.turn_back(0));
        while trail.robot.at.distance(&Point::new(3.0, 1.0)) > 0.3 {
            let Some(Step::Towards(off)) = trail.step() else { panic!("{trail:?}") };
            trail.moved(0.05 * off.cos().max(0.0), off.clamp(-0.2, 0.2));
        }
        assert!(trail.turn_back(1));
        let Some(Step::Towards(off)) = trail.step() else { panic!("{trail:?}") };
        assert!(off.abs() < 0.5, "it is still on its way back, and does not turn round: {off}");
        let Step::There(along) = drive_back(&mut trail) else { panic!("{trail:?}") };
        assert_eq!(along, DrawnMetres(0.0), "it was sure nowhere before 2 m");
    }

    #[test]
    fn a_robot_that_cannot_get_back_says_so() {
        let mut trail = driven();
        trail.turn_back(0);
        let failed = (0..1000).find_map(|_| {
            trail.moved(0.1, 0.3);
            trail.step().filter(|step| *step == Step::Failed)
        });
        assert_eq!(failed, Some(Step::Failed));
        assert_eq!(trail.step(), None);
    }
}
