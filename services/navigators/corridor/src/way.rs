//! Measures how far a robot has advanced along a corridor. The way into a dead end and out of it again does
//! not count.
//!
//! The bends on the way to the robot's position are remembered. When the robot turns back, it meets them in
//! reverse order. If it drives past the last one, or turns where there was none, it is on new ground, and the
//! distance grows again.

use serde::{Deserialize, Serialize};

use crate::mission::Turn;

/// Maximum number of bends remembered. The oldest is forgotten first.
const MOST_BENDS: usize = 32;
/// Distance beyond a bend, in metres, at which a robot on its way back must have passed it. If the robot were
/// going to turn there, it would already have done so.
const PAST_M: f64 = 2.0;
/// Maximum distance, in metres, at which a turn on the way back is matched with a remembered bend.
const NEAR_M: f64 = 3.0;

/// A change of direction on the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Bend {
    at_m: f64,
    side: Turn,
}

/// Distance covered since a task began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Way {
    metres: f64,
    is_back: bool,
    bends: Vec<Bend>,
    turns: u32,
}

impl Default for Way {
    fn default() -> Self {
        Self { metres: 0.0, is_back: false, bends: Vec::with_capacity(MOST_BENDS), turns: 0 }
    }
}

impl Way {
    /// Returns the distance covered, in metres.
    pub fn metres(&self) -> f64 {
        self.metres
    }

    /// Returns the number of changes of direction.
    pub fn turns(&self) -> u32 {
        self.turns
    }

    /// Adds a distance along the direction of the corridor, in metres.
    pub fn drive(&mut self, along_m: f64) {
        if !self.is_back {
            self.metres += along_m;
            return;
        }
        self.metres -= along_m;
        let last = self.bends.last().copied();
        let (from_m, past_m) = last.map_or((0.0, 0.0), |bend| (bend.at_m, PAST_M));
        if self.metres < from_m - past_m {
            (self.is_back, self.metres) = (false, 2.0 * from_m - self.metres);
            if let (Some(bend), Some(last)) = (last, self.bends.last_mut()) {
                // The robot drove on past the bend, so seen from the other corridor the bend goes to the other side.
                last.side = opposite(bend.side);
            }
        }
    }

    /// Adds a distance covered while the robot rounds a bend, in metres along the new direction and across
    /// it. Along the centre lines of the two corridors, the length is the sum of both. The sum also counts
    /// for a robot that cuts the corner, because it ends up in the same place.
    pub fn round(&mut self, along_m: f64, across_m: f64) {
        let (along_m, across_m) = (along_m.abs(), across_m.abs());
        if !self.is_back
            && let Some(bend) = self.bends.last_mut()
        {
            // The bend is where the middles of the two corridors meet.
            bend.at_m += across_m;
        }
        self.drive(along_m + across_m);
    }

    /// Records that the robot turns to a side, or back if `turn` is [`Turn::Straight`].
    pub fn turn(&mut self, turn: Turn) {
        self.turns = self.turns.saturating_add(1);
        if turn == Turn::Straight {
            self.is_back = !self.is_back;
            return;
        }
        let is_retraced =
            |bend: &Bend| bend.side == opposite(turn) && (self.metres - bend.at_m).abs() < NEAR_M;
        if self.is_back && self.bends.last().is_some_and(is_retraced) {
            self.bends.pop();
            return;
        }
        self.is_back = false;
        if self.bends.len() == MOST_BENDS {
            self.bends.remove(0);
        }
        self.bends.push(Bend { at_m: self.metres, side: turn });
    }
}

fn opposite(turn: Turn) -> Turn {
    match turn {
        Turn::Left => Turn::Right,
        Turn::Right => Turn::Left,
        Turn::Straight => Turn::Straight,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the way after driving several stretches, each with the turn at its end.
    fn after(stretches: &[(f64, Option<Turn>)]) -> Way {
        let mut way = Way::default();
        for (metres, turn) in stretches {
            (0..100).for_each(|_| way.drive(metres / 100.0));
            turn.iter().for_each(|turn| way.turn(*turn));
        }
        way
    }

    fn is(way: &Way, metres: f64) {
        assert!((way.metres() - metres).abs() < 1e-9, "{way:?}: expected {metres} m");
    }

    #[test]
    fn path_length_adds_up_around_bends_and_driving_back_is_subtracted() {
        is(&after(&[(5.0, Some(Turn::Left)), (4.0, Some(Turn::Right)), (3.0, None)]), 12.0);
        let there = [(5.0, Some(Turn::Left)), (4.0, Some(Turn::Straight))];
        is(&after(&[&there[..], &[(3.0, None)]].concat()), 6.0);
        // The robot turns around the same bend, which is to the right on the way back.
        is(&after(&[&there[..], &[(4.0, Some(Turn::Right)), (2.0, None)]].concat()), 3.0);
        // Beyond the start, the robot covers new ground in the other direction.
        is(&after(&[(2.0, Some(Turn::Straight)), (5.0, None)]), 3.0);
    }

    /// Regression test: when a robot drove out of the short arm of a T and straight on into the other arm, that distance was
    /// deducted as if the robot had turned back.
    #[test]
    fn beyond_the_junction_the_distance_counts_again() {
        let arm = [(6.5, Some(Turn::Left)), (3.0, Some(Turn::Straight))];
        is(&after(&[&arm[..], &[(3.0 + 8.5, None)]].concat()), 15.0);
        // The robot drives back from there and turns left into the stem.
        let other =
            [&arm[..], &[(3.0 + 8.5, Some(Turn::Straight)), (8.5, Some(Turn::Left)), (2.0, None)]].concat();
        is(&after(&other), 4.5);
        // A turn where there was no bend is new ground, too.
        is(&after(&[(6.0, Some(Turn::Straight)), (2.0, Some(Turn::Left)), (3.0, None)]), 7.0);
    }

    /// Regression test: a robot turns before it has reached the middle of the new corridor, so two metres per bend were not
    /// counted.
    #[test]
    fn a_bend_counts_along_both_centre_lines() {
        let mut way = after(&[(4.5, Some(Turn::Left))]);
        (0..100).for_each(|_| way.round(0.02, 0.02));
        is(&way, 8.5);
        way.drive(1.0);
        way.turn(Turn::Straight);
        // The robot drives back past the junction, which is at 6.5 m, and three metres farther.
        (0..600).for_each(|_| way.drive(0.01));
        is(&way, 9.5);
    }

    #[test]
    fn the_oldest_bends_are_forgotten() {
        let way = after(&[(1.0, Some(Turn::Left)); 100]);
        assert_eq!((way.bends.len(), way.turns()), (MOST_BENDS, 100));
        is(&way, 100.0);
    }
}
