//! Where in the drawing the robot is known to be: by a mark, by a person's report or, in a drawing without a start mark, by an arrival
//! without doubt.

use serde::{Deserialize, Serialize};
use sketchnav_mapping::outline::Place;

use super::Explorer;

/// What is known about where the robot was at a moment of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Known {
    /// The robot's position in the drawing and in the map.
    pub places: Option<[Place; 2]>,
    /// Angle from a direction in the map to the same direction in the drawing, in radians.
    pub turn_rad: Option<f64>,
}

impl Explorer {
    /// Returns true if the drawing, a person or the filter has placed the robot.
    pub fn is_placed(&self) -> bool {
        self.exploration.is_estimated || self.is_anchored()
    }

    /// Returns true if the drawing or a person has placed the robot.
    pub(super) fn is_anchored(&self) -> bool {
        self.is_marked() || self.exploration.told.is_some_and(|told| told.places.is_some())
    }

    fn is_marked(&self) -> bool {
        self.marked().places.is_some()
    }

    /// Returns true if somebody has carried the robot, and it has not been found since.
    pub fn is_elsewhere(&self) -> bool {
        self.exploration.is_kidnapped && !self.is_placed()
    }

    /// Returns what the drawing's mark says, unless somebody has carried the robot since.
    fn marked(&self) -> Known {
        let paper = self.paper.as_ref().filter(|_| !self.exploration.is_kidnapped);
        paper.map(|paper| paper.marked).unwrap_or_default()
    }

    /// Records whether the filter knows where the robot is, and otherwise, whether the drawing may prevent it from finding out.
    pub fn on_estimate(&mut self, is_placed: bool, is_ambiguous: bool) {
        (self.exploration.is_estimated, self.exploration.is_ambiguous) = (is_placed, is_ambiguous);
    }

    /// Returns true if the filter knows where the robot is, and the drawing does not mark its start.
    pub fn is_estimated(&self) -> bool {
        self.exploration.is_estimated && !self.is_marked()
    }

    /// Returns true if it is known where the robot was at some moment.
    pub(super) fn knows_a_place(&self) -> bool {
        self.known().places.is_some()
    }

    /// Returns what is known about where the robot was at some moment.
    pub(super) fn known(&self) -> Known {
        let marked = self.marked();
        let known = self.exploration.told.or(self.exploration.found).unwrap_or(marked);
        Known { turn_rad: known.turn_rad.or(marked.turn_rad), ..known }
    }

    /// Returns where the robot is according to the last alignment.
    pub(super) fn found(&self) -> Option<Known> {
        let ((_, alignment), paper) = (self.exploration.last.as_ref()?, self.paper.as_ref()?);
        let at = paper.place_of(&alignment.partners, self.place())?;
        Some(Known { places: Some([[at.x, at.y], self.place()]), turn_rad: Some(alignment.turn_rad) })
    }
}
