//! Recognizes landmarks by the markers on them, for a robot that drives by landmark states. Chronis 2007, 6.3, proposes object
//! recognition as future work. The method `belief` uses markers as well, but in its hypotheses: see [`crate::belief`].
//!
//! A camera may only see what is ahead, whereas a landmark state refers to objects on all sides. The robot therefore remembers, by
//! its odometry, where it last saw each marker.

use std::f64::consts::FRAC_PI_8;

use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Base, Odom, Point};

use crate::control::Sectors;
use crate::instructions::Marked;
use crate::perception::{Perceiving, Seen};
use crate::reckoning::Reckoning;
use crate::route::DIRECTIONS;

/// Where the robot last saw each marker.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Labels {
    robot: Reckoning,
    /// Last known position of each marker, or `None` if it has not been seen.
    places: Vec<Option<Point<Odom>>>,
}

impl Labels {
    /// Creates labels for this number of markers, none of which has been seen yet.
    pub fn new(markers: usize) -> Self {
        Self { robot: Reckoning::default(), places: vec![None; markers] }
    }

    /// Moves the robot by a distance in metres and an angle in radians, positive to the left.
    pub fn moved(&mut self, moved_m: f64, turned_rad: f64) {
        self.robot.moved(moved_m, turned_rad);
    }

    /// Records that a marker is seen at `at`. `marker` is its index among the known ones.
    pub fn see(&mut self, marker: usize, at: Point<Base>) {
        if let Some(place) = self.places.get_mut(marker) {
            *place = Some(self.robot.odom_from_base(at));
        }
    }

    /// Returns the index of the landmark that an object in view is, or `None` if the object has not been recognized. `markers` are
    /// the known markers.
    ///
    /// A marker is on an object if it lies in the direction of one of the object's beams, no farther from the end of that beam than
    /// the thickness of objects. If there are several, the one nearest to the end of its beam counts.
    pub fn landmark(
        &self,
        seen: &Seen,
        sectors: &Sectors,
        markers: &[Marked],
        settings: &Perceiving,
    ) -> Option<usize> {
        let [first, count] = seen.beams.map(usize::from);
        let off_m = |place: Point<Odom>| {
            let at = self.robot.base_from_odom(place);
            let sector = (at.y.atan2(at.x) / FRAC_PI_8).round().rem_euclid(f64::from(DIRECTIONS)) as usize;
            let sector = sector % sectors.len();
            let is_in_beam = (sector + sectors.len() - first) % sectors.len() < count;
            let off_m = (at.x.hypot(at.y) - settings.ring_m - sectors[sector]).abs();
            Some(off_m).filter(|off_m| is_in_beam && *off_m <= settings.thickness_m)
        };
        let near = self.places.iter().zip(markers).filter_map(|(place, marked)| {
            let off_m = off_m((*place)?)?;
            Some((off_m, marked.landmark))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, landmark)| landmark)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::Perception;

    const MARKERS: [Marked; 2] = [Marked { marker: 7, landmark: 4 }, Marked { marker: 8, landmark: 2 }];

    /// Returns the landmark that each object in view is recognized as, given ranges in metres in some directions.
    fn landmarks(labels: &Labels, ranges: &[(usize, f64)]) -> Vec<Option<usize>> {
        let mut sectors = [f64::INFINITY; 16];
        for (direction, range_m) in ranges {
            sectors[*direction] = *range_m;
        }
        let mut perception = Perception::nomad(Perceiving::default()).unwrap();
        let seen = perception.see(&sectors).unwrap().to_vec();
        let landmark = |one: &Seen| labels.landmark(one, &sectors, &MARKERS, perception.settings());
        seen.iter().map(landmark).collect()
    }

    #[test]
    fn an_object_is_known_by_a_marker_that_was_seen_before() {
        let mut labels = Labels::new(2);
        assert_eq!(landmarks(&labels, &[(0, 2.6)]), [None]);
        labels.see(1, Point::new(3.0, 0.0));
        assert_eq!(landmarks(&labels, &[(0, 2.6), (4, 2.6)]), [Some(2), None]);
        assert_eq!(landmarks(&labels, &[(0, 1.5)]), [None], "something in front of it");
        // The robot turns right, so the marker is on its left, out of the camera's view.
        labels.moved(0.0, -std::f64::consts::FRAC_PI_2);
        assert_eq!(landmarks(&labels, &[(0, 2.6), (4, 2.6)]), [None, Some(2)]);
        // The robot drives past the marker.
        labels.moved(3.0, 0.0);
        assert_eq!(landmarks(&labels, &[(4, 2.6), (6, 3.9)]), [None, Some(2)]);
    }

    #[test]
    fn of_two_markers_on_an_object_the_nearer_one_counts() {
        let mut labels = Labels::new(2);
        labels.see(0, Point::new(2.4, 0.1));
        labels.see(1, Point::new(2.9, 0.0));
        assert_eq!(landmarks(&labels, &[(0, 2.6)]), [Some(2)]);
        assert_eq!(landmarks(&labels, &[(0, 2.2)]), [Some(4)]);
    }
}
