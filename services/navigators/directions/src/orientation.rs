//! Finds the heading of a robot that may face any direction at the start. The paper has no counterpart of this.
//!
//! The first map of such a robot lists the bearings of the landmarks around the start, from the nearest to the farthest. The robot
//! looks for the turn after which the landmarks that it sees lie at these bearings. Because distances only determine the order of
//! the landmarks, and one may be hidden, a landmark may be one place further ahead or back in that order, and landmarks at nearly
//! the same distance may follow each other in any order.

use std::f64::consts::PI;

use arrayvec::ArrayVec;
use sketchnav_schemas::geometry::wrap_angle;

use crate::custom_map::FULL_TURN_DEG;
use crate::description::MOST_CANDIDATES;
use crate::error::Error;
use crate::geometry::{Land, Point};
use crate::navigator::heading::bearing_deg;
use crate::plane::Plane;
use crate::sight::{Eye, is_seen};

/// Minimum and maximum number of bearings of a list.
pub const LEAST_AROUND: usize = 3;
/// See [`LEAST_AROUND`].
pub const MOST_AROUND: usize = 8;
/// Maximum difference between a stated and an observed bearing, in radians.
const NEAR_RAD: f64 = 4.0 * PI / 180.0;
/// Difference of distances, in metres, up to which the order of two landmarks is uncertain.
const SAME_M: f64 = 0.3;
/// Number of landmarks by which the best turn must be ahead of every other.
const AHEAD: usize = 2;
/// Number of stated landmarks that may be out of sight.
const HIDDEN: usize = 2;
/// Standard deviation of a heading that was found, in radians.
pub const FOUND_RAD: f64 = 2.0 * PI / 180.0;

/// The bearings of the landmarks around the start, in degrees clockwise from north, from the nearest landmark to the farthest.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct Around(ArrayVec<u16, MOST_AROUND>);

/// A turn of the robot, with the number of landmarks that then lie where the list says.
#[derive(Debug, Clone, Copy)]
struct Turn {
    by_rad: f64,
    fits: usize,
    /// Sum of the squared differences of these bearings.
    off: f64,
}

impl Around {
    /// Creates a list, or returns `None` if a bearing is not below 360 or the number of bearings is out of range.
    pub fn new(bearings: &[u16]) -> Option<Self> {
        let is_valid =
            bearings.len() >= LEAST_AROUND && bearings.iter().all(|&bearing| bearing < FULL_TURN_DEG);
        ArrayVec::try_from(bearings).ok().filter(|_| is_valid).map(Self)
    }

    /// Returns the list of a robot that starts at this position. Rejects a start with too few landmarks in view, and one around which
    /// the landmarks look nearly the same after a turn.
    pub fn at(plane: &Plane, land: Land, start: Point) -> Result<Self, Error> {
        let eye = Eye { at: start, walls: plane.walls() };
        let near = || plane.around(start, land.range);
        let is_seen = |dot, at: Point| {
            is_seen(
                land,
                eye,
                at - start,
                near().filter(|&(other, _)| other != dot).map(|(_, at)| at - start),
            )
        };
        let mut ways: Vec<Point> = near()
            .filter(|&(dot, at)| is_seen(dot, at))
            .map(|(_, at)| at - start)
            .take(MOST_CANDIDATES)
            .collect();
        ways.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        let bearings: Vec<u16> = ways.iter().take(MOST_AROUND).map(|&way| bearing_deg(way)).collect();
        let around = Self::new(&bearings).ok_or(Error::FewAround { found: ways.len() })?;
        let [best, other] = around.best(&ways);
        match best.fits >= other.fits + AHEAD {
            true => Ok(around),
            false => {
                Err(Error::SameAround { degrees: other.by_rad.to_degrees().round().rem_euclid(360.0) as u16 })
            }
        }
    }

    /// Returns the bearings.
    pub fn bearings(&self) -> &[u16] {
        &self.0
    }

    /// Returns true if the map does not list the landmarks around the start.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the angle from the map's axes to those of a robot that sees landmarks at these positions, counter-clockwise, in
    /// radians. Returns `None` if too few landmarks fit, or nearly as many fit after another turn.
    pub fn turned_rad(&self, ways: &[Point]) -> Option<f64> {
        let mut sorted: ArrayVec<Point, MOST_CANDIDATES> =
            ways.iter().copied().take(MOST_CANDIDATES).collect();
        sorted.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        let [best, other] = self.best(&sorted);
        let least = self.0.len().saturating_sub(HIDDEN).max(LEAST_AROUND);
        (best.fits >= least && best.fits >= other.fits + AHEAD).then_some(best.by_rad)
    }

    /// Returns the turn that fits best, and the best of those that differ clearly from it. Positions are sorted by distance.
    fn best(&self, ways: &[Point]) -> [Turn; 2] {
        let none = Turn { by_rad: 0.0, fits: 0, off: f64::INFINITY };
        let better = |a: Turn, b: Turn| if (b.fits, -b.off) > (a.fits, -a.off) { b } else { a };
        let turns = || {
            let pairs =
                self.0.iter().flat_map(|&stated| ways.iter().map(move |&way| off_rad(stated, way, 0.0)));
            pairs.map(|by_rad| self.fitted(by_rad, ways))
        };
        let best = turns().fold(none, better);
        let is_other = |turn: &Turn| wrap_angle(turn.by_rad - best.by_rad).abs() > 2.0 * NEAR_RAD;
        [best, turns().filter(is_other).fold(none, better)]
    }

    /// Counts the landmarks that lie where the list says after a turn, and corrects the turn by their mean difference.
    fn fitted(&self, by_rad: f64, ways: &[Point]) -> Turn {
        let (mut fits, mut sum, mut squares) = (0, 0.0, 0.0);
        for (place, &stated) in self.0.iter().enumerate() {
            let off = candidates(place, ways).map(|way| off_rad(stated, way, by_rad));
            let Some(off) = off.min_by(|a, b| a.abs().total_cmp(&b.abs())) else { continue };
            if off.abs() <= NEAR_RAD {
                (fits, sum, squares) = (fits + 1, sum + off, squares + off * off);
            }
        }
        let mean = if fits > 0 { sum / fits as f64 } else { 0.0 };
        Turn { by_rad: wrap_angle(by_rad + mean), fits, off: squares }
    }
}

/// Returns the landmarks that may be the one at this place of the list: those at most one place further ahead or back, and others at
/// nearly the same distances.
fn candidates(place: usize, ways: &[Point]) -> impl Iterator<Item = Point> {
    let last = ways.len().saturating_sub(1);
    let distance = |place: usize| ways.get(place).map_or(f64::NAN, |way| way.norm());
    let range = distance(place.saturating_sub(1)) - SAME_M..=distance((place + 1).min(last)) + SAME_M;
    ways.iter().copied().filter(move |way| range.contains(&way.norm()))
}

/// Returns the angle by which a way that has been turned by `by_rad` must be turned further to lie at a bearing, in radians.
fn off_rad(stated_deg: u16, way: Point, by_rad: f64) -> f64 {
    wrap_angle(way.x.atan2(way.y) - f64::from(stated_deg).to_radians() - by_rad)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{config, plane};

    const LAND: Land = Land { radius: 0.15, range: 8.0, stand_off: 0.9, clearance: 0.5 };
    const POLES: [(f64, f64); 6] =
        [(1.0, 0.5), (-2.0, 1.5), (0.5, -3.0), (4.0, 1.0), (-3.0, -4.0), (2.0, 6.0)];

    fn around() -> Around {
        Around::at(&plane(&POLES), LAND, Point::default()).unwrap()
    }

    #[test]
    fn the_landmarks_around_the_start_are_listed_from_the_nearest_to_the_farthest() {
        assert_eq!(around().bearings(), [63, 307, 171, 76, 217, 18]);
    }

    #[test]
    fn too_few_landmarks_and_those_that_look_alike_after_a_turn_are_rejected() {
        let at = |dots: &[(f64, f64)]| Around::at(&plane(dots), LAND, Point::default()).unwrap_err();
        assert_eq!(at(&POLES[..2]), Error::FewAround { found: 2 });
        let square = [(2.0, 2.1), (2.1, -2.0), (-2.0, -2.1), (-2.1, 2.0)];
        assert!(matches!(at(&square), Error::SameAround { degrees: 90 | 180 | 270 }), "{:?}", at(&square));
    }

    #[test]
    fn what_is_not_around_the_start_gives_no_heading() {
        let ways = [(3.0, 3.0), (-3.0, 2.9), (1.0, -5.0), (0.0, 2.0)].map(|(x, y)| Point::new(x, y));
        assert_eq!(around().turned_rad(&ways), None);
        assert_eq!(around().turned_rad(&[]), None);
        assert_eq!(Around::default().turned_rad(&ways), None);
    }

    proptest! {
        #![proptest_config(config(256))]

        /// Whatever the heading, it is found, even if a landmark is hidden and another object looks like one.
        #[test]
        fn any_heading_is_found(
            turned_rad in -PI..PI,
            hidden in prop::option::of(0_usize..6),
            other in prop::option::of((-7.0..7.0_f64, -7.0..7.0_f64)),
            errors in prop::array::uniform12(-0.03..0.03_f64),
        ) {
            let seen = POLES.iter().enumerate().filter(|(pole, _)| Some(*pole) != hidden);
            let seen = seen.map(|(pole, &(x, y))| Point::new(x + errors[2 * pole], y + errors[2 * pole + 1]));
            let other = other.filter(|_| hidden.is_none()).map(|(x, y)| Point::new(x, y));
            let ways: Vec<_> = seen.chain(other).map(|way| way.turned(-turned_rad)).collect();
            let found = around().turned_rad(&ways);
            let is_right = found.is_some_and(|found| wrap_angle(found - turned_rad).abs() < 0.03);
            // A near object that is none of the landmarks moves all others in their order.
            prop_assert!(is_right || other.is_some() && found.is_none(), "{:?}", found);
        }
    }
}
