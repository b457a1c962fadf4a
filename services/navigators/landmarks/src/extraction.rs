//! Extraction: from a sketch to a route of landmark states (Chronis 2007, 4.3, 4.6.1, 4.6.2, figure 4.11).
//!
//! 1. [`track`] walks along the drawn route. At each step it notes the heading, the turning rate, the command, and
//!    each object in view: where it is, how far and how wide.
//! 2. [`events`] rates what happens around each change of the command by fuzzy rules.
//! 3. [`states`] chooses the events that define each state, and adds states in the middle of long turns.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::numbers;
use crate::route::{INCH_M, Route};
use crate::sketch::Sketch;

pub mod events;
pub mod fuzzy;
pub mod states;
pub mod track;

/// How routes are extracted. All lengths are of the real world: the thesis takes a sketch as drawn to scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How far an object may be to be in view, in metres: "the radius of the sensor range" (4.3), 255 inches (4.2). The 150
    /// inches of figure 4.27 are those of the reactive controller: figure 4.29 has relations at 160 and at 295 inches.
    pub sensor_radius_m: f64,
    /// The side of the box that stands for the robot, in metres: the Nomad's diameter of 20 inches. The robot's own: no
    /// key of a mission.
    #[serde(skip)]
    pub robot_m: f64,
    /// A proximity is known to plus or minus this, in metres: 22 inches (4.3.2).
    pub proximity_tolerance_m: f64,
    /// A width is known to plus or minus this, of 180 (4.3.3).
    pub width_tolerance: f64,
    /// What a state demands of its objects after the most significant one.
    pub other_objects: OtherObjects,
    /// The robot turns where the turning rate is above this, in degrees per [`Self::turn_unit_m`]. The text has "0.7
    /// normalized units" and not their definition (4.3.4); see [`track`].
    pub turn_threshold: f64,
    /// The length by which turning rates are normalized, in metres: a pixel of the PDA, 5 inches.
    pub turn_unit_m: f64,
    /// Commands that hold for fewer steps are spurious (4.3.4 filters them, and does not say how).
    pub least_steps: usize,
    /// Turns by less than this are spurious, in radians.
    pub least_turn_rad: f64,
    /// Events up to so many steps before or after a change of the command belong to it (figure 4.9 is lost).
    pub event_steps: usize,
    /// Consecutive states differ by a direction of at least so many sixteenths of a turn: 45° (4.6.1).
    pub distinct_directions: u8,
    /// Whether states are added in the middle of turns above 90° and 180° (4.6.2).
    pub additional_states: bool,
}

/// What a state demands of its objects after the most significant one. The thesis prints both; in both, all objects have
/// to match.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OtherObjects {
    /// Direction, proximity and width, as for the first: the general form of a state (figure 4.23), and all states
    /// printed in 4.6.1, 4.9, 5.1 (from version 3 on) and figures 5.11 and 5.12.
    Strict,
    /// The direction alone: the second object of state 3 in table 4.1 and figure 4.10.
    DirectionOnly,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            sensor_radius_m: 255.0 * INCH_M,
            robot_m: 20.0 * INCH_M,
            proximity_tolerance_m: 22.0 * INCH_M,
            width_tolerance: 30.0,
            other_objects: OtherObjects::Strict,
            turn_threshold: 0.7,
            turn_unit_m: 5.0 * INCH_M,
            least_steps: 2,
            least_turn_rad: 0.35,
            event_steps: 4,
            distinct_directions: 2,
            additional_states: true,
        }
    }
}

impl Parameters {
    /// `Ok` where all numbers are in their ranges.
    ///
    /// # Errors
    /// [`Error::Number`].
    pub fn check(&self) -> Result<(), Error> {
        let Self { sensor_radius_m, robot_m, proximity_tolerance_m, width_tolerance, .. } = *self;
        let Self { turn_threshold, turn_unit_m, least_turn_rad, .. } = *self;
        let Self { least_steps, event_steps, distinct_directions, .. } = *self;
        numbers::above_0(&[
            ("sensor_radius_m", sensor_radius_m),
            ("robot_m", robot_m),
            ("proximity_tolerance_m", proximity_tolerance_m),
            ("width_tolerance", width_tolerance),
            ("turn_threshold", turn_threshold),
            ("turn_unit_m", turn_unit_m),
            ("least_turn_rad", least_turn_rad),
        ])?;
        numbers::from_0_on(&[
            ("least_steps", least_steps as f64),
            ("event_steps", event_steps as f64),
            ("distinct_directions", distinct_directions.into()),
        ])
    }
}

/// The route of a sketch.
///
/// # Errors
/// [`Error::Number`], and [`Error::NothingInView`] where the robot has to turn and no object is in view.
pub fn extract(sketch: &Sketch, parameters: &Parameters) -> Result<Route, Error> {
    parameters.check()?;
    let track = track::Track::of(sketch, parameters)?;
    let route = states::route(&track, parameters, sketch)?;
    route.check()?;
    Ok(route)
}

#[cfg(test)]
mod tests;
