//! Turns a sketch into a route of landmark states (Chronis 2007, 4.3, 4.6.1, 4.6.2, figure 4.11).
//!
//! 1. [`track`] walks along the drawn route. At each step, it records the heading, the turning rate, the command, and the position,
//!    distance and width of each object in view.
//! 2. [`events`] uses fuzzy rules to rate the significance of what happens around each change of the command.
//! 3. [`states`] selects the events that define each state, and adds states in the middle of long turns.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::numbers;
use crate::route::{INCH_M, Route};
use crate::sketch::Sketch;

pub mod events;
pub mod fuzzy;
pub mod states;
pub mod track;

/// Parameters of extraction. All lengths are those of the real world, since the thesis treats sketches as
/// drawn to scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// Maximum distance of an object in view, in metres: "the radius of the sensor range" (4.3), 255 inches (4.2). The 150 inches
    /// of figure 4.27 apply only to the reactive controller, since figure 4.29 has relations at 160 and at 295 inches.
    pub sensor_radius_m: f64,
    /// Side length of the box that represents the robot, in metres: the Nomad's diameter of 20 inches. It is
    /// taken from the robot rather than from a key of the mission.
    #[serde(skip)]
    pub robot_m: f64,
    /// Tolerance of a proximity, in metres: 22 inches to either side (4.3.2).
    pub proximity_tolerance_m: f64,
    /// Tolerance of a width to either side, on the scale from 0 to 180 (4.3.3).
    pub width_tolerance: f64,
    /// Conditions that a state imposes on its objects other than the most significant one.
    pub other_objects: OtherObjects,
    /// Turning rate above which the robot counts as turning, in degrees per [`Self::turn_unit_m`]. The thesis gives "0.7
    /// normalized units", but not their definition (4.3.4); see [`track`].
    pub turn_threshold: f64,
    /// Length by which turning rates are normalized, in metres: a pixel of the PDA, 5 inches.
    pub turn_unit_m: f64,
    /// Minimum number of steps of a command. Shorter commands are spurious (4.3.4 filters them, but does not say how).
    pub least_steps: usize,
    /// Minimum angle of a turn, in radians. Smaller turns are spurious.
    pub least_turn_rad: f64,
    /// Number of steps before and after a change of the command within which events count towards it (figure 4.9 is lost).
    pub event_steps: usize,
    /// Minimum difference between directions of consecutive states, in sixteenths of a turn: 45° (4.6.1).
    pub distinct_directions: u8,
    /// Whether states are added in the middle of turns of more than 90° and 180° (4.6.2).
    pub additional_states: bool,
}

/// Conditions that a state imposes on its objects other than the most significant one. The thesis prints both variants. In both,
/// every object has to match.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OtherObjects {
    /// Direction, proximity and width, as for the first object. This is the general form of a state (figure 4.23), and that of
    /// all states printed in 4.6.1, 4.9, 5.1 (from version 3 on) and figures 5.11 and 5.12.
    Strict,
    /// Only the direction, as for the second object of state 3 in table 4.1 and figure 4.10.
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
    /// Checks that all numbers are within their ranges.
    ///
    /// # Errors
    /// [`Error::Number`], which names the first number that is out of range.
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

/// Extracts the route of a sketch.
///
/// # Errors
/// - [`Error::Number`] if a parameter is out of range, or an outline has no area.
/// - [`Error::NothingInView`] if the robot has to turn where no object is in view.
/// - [`Error::States`] if the route cannot be driven.
pub fn extract(sketch: &Sketch, parameters: &Parameters) -> Result<Route, Error> {
    parameters.check()?;
    let track = track::Track::of(sketch, parameters)?;
    let route = states::route(&track, parameters, sketch)?;
    route.check()?;
    Ok(route)
}

#[cfg(test)]
mod tests;
