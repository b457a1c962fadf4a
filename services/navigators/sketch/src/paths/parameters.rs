//! All parameters of planning, from the table `parameters.planner` of a mission.

use crate::method::Method;
use serde::{Deserialize, Serialize};
use sketchnav_motion::progress::ProgressParameters;

/// Parameters of the planner. Parameters missing from a mission keep their defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Distance in the local metric, in metres, within which a goal counts as reached.
    pub arrival_radius_m: f64,
    /// Distance, in metres, within which a goal counts as reached if the robot cannot get any closer.
    pub near_radius_m: f64,
    /// Radius ρ of the local window (Boniardi et al. 2015, III-C), in metres by the mean local scale.
    pub window_radius_m: f64,
    /// Radius r_L, in metres, within which the robot's place on a drawn route is searched (Boniardi et al. 2016, III-A).
    pub route_window_m: f64,
    /// Look-ahead distance r_H on a drawn route, in metres (Boniardi et al. 2016, III-A).
    pub route_look_ahead_m: f64,
    /// Time between two local plans, in seconds.
    pub plan_period_s: f64,
    /// Distance from a drawn wall, in metres, within which a path through the drawing costs more.
    pub inflation_radius_m: f64,
    /// Extra cost of a path right at a drawn wall, per unit of length.
    pub inflation_weight: f64,
    /// Cost of a path through a drawn wall, per unit of length.
    pub wall_weight: f64,
    /// Free space, in metres, that the local planner keeps around the robot's footprint.
    pub footprint_padding_m: f64,
    /// Distance beyond the padding, in metres, within which a local path costs more.
    pub local_inflation_radius_m: f64,
    /// Time, in seconds, for which the robot remembers obstacles that it no longer sees.
    pub obstacle_memory_s: f64,
    /// Share of the robot's top speed to use.
    pub speed_share: f64,
    /// Share of the robot's top turn rate to use.
    pub turn_share: f64,
    /// Time without moving, in seconds, after which the robot is stuck. It is proportionally longer for a robot whose speed limit
    /// is below half a metre per second.
    pub stuck_time_s: f64,
    /// Minimum distance, in metres, that counts as moving.
    pub stuck_radius_m: f64,
    /// Time without getting closer to the goal, in seconds, after which the robot is stuck. It is longer for a slow robot, like
    /// `stuck_time_s`.
    pub no_progress_time_s: f64,
    /// Length of a path, in metres. A robot counts as stuck, regardless of the estimate, if it has driven around one place for as
    /// long as this path takes at its top speed.
    pub circling_path_m: f64,
    /// Distance from where it started, in metres, within which the robot counts as driving around one place.
    pub circling_radius_m: f64,
    /// Maximum number of recoveries around one place.
    pub recoveries: u32,
    /// Maximum number of recoveries during one task.
    pub recoveries_per_task: u32,
    /// Multiple of the time for the drawn path plus `astray_m`, at half a metre per second or the robot's speed limit if that is
    /// lower. After this time, the robot counts as lost, because its estimate must be wrong.
    pub astray_factor: f64,
    /// Length, in metres, that is added to that of the drawn path before the multiplication by `astray_factor`.
    pub astray_m: f64,
    /// Doubt about an arrival above which the robot looks around before it accepts the arrival. The doubt is
    /// minus the mean log likelihood of a beam, plus half the logarithm of one plus the number of times that
    /// the estimate jumped.
    pub look_above: f64,
    /// Doubt about an arrival above which the robot counts as lost even after it has looked around.
    pub doubt_above: f64,
    /// True if goals are located by the outline of what was seen.
    pub by_outline: bool,
    /// True if the robot may be anywhere in a map and has to localize itself before it drives to a goal and whenever it is lost.
    pub finds_itself: bool,
    /// Minimum share of the seen area in its largest part once passages as narrow as doors are closed, for each assumed width of
    /// doors. Below this share, the floor consists of rooms, and the robot drives by the filter instead of by the outline.
    pub least_open_share: f64,
    /// Typical size of a building, in metres, which determines the initial scale of the drawing's outline.
    pub building_size_m: f64,
    /// Share of a goal's outline hidden behind gaps, below which the goal counts as seen.
    pub goal_hidden_share: f64,
    /// Additional weight of the walls around the goal when outlines are aligned, as a multiple of the ordinary weight.
    pub goal_emphasis: f64,
    /// Minimum additional cost of the best alignment with the goal elsewhere, compared with the best alignment, for an arrival to
    /// be accepted. With 0, every arrival is accepted.
    pub rival_margin: f64,
    /// Minimum distance, in metres, at which a goal counts as elsewhere.
    pub rival_away_m: f64,
    /// Maximum number of times to look at the place where a rival locates the goal.
    pub rival_looks: u32,
    /// Maximum additional cost of the best rival at which the robot asks a person where it is, once it has looked at the rival's
    /// place. With 0, or without a pad, it does not ask.
    pub ask_margin: f64,
    /// Minimum additional cost of the best rival for an arrival to be accepted if nobody has marked the start. With less, the robot
    /// is lost, because the drawing looks alike elsewhere.
    pub alike_margin: f64,
    /// Time, in seconds, that the robot waits for an answer before it decides about the arrival on its own evidence.
    pub ask_patience_s: f64,
    /// Distance beyond the footprint's padding, in metres, that paths through the map keep from walls.
    pub map_clearance_m: f64,
    /// Time, in seconds, after which a task fails if the localizer is lost.
    pub lost_s: f64,
}

/// A limit above any doubt.
const NEVER: f64 = 100.0;

impl Default for Parameters {
    fn default() -> Self {
        Self {
            arrival_radius_m: 0.35,
            near_radius_m: 1.0,
            window_radius_m: 2.5,
            route_window_m: 1.0,
            route_look_ahead_m: 1.2,
            plan_period_s: 0.4,
            inflation_radius_m: 0.8,
            inflation_weight: 4.0,
            wall_weight: 1000.0,
            footprint_padding_m: 0.05,
            local_inflation_radius_m: 0.35,
            obstacle_memory_s: 20.0,
            speed_share: 1.0,
            turn_share: 0.8,
            stuck_time_s: 7.0,
            stuck_radius_m: 0.3,
            no_progress_time_s: 30.0,
            circling_path_m: 6.5,
            circling_radius_m: 1.5,
            recoveries: 3,
            recoveries_per_task: 8,
            astray_factor: 3.0,
            astray_m: 5.0,
            look_above: 0.6,
            doubt_above: 1.5,
            by_outline: false,
            finds_itself: false,
            least_open_share: 0.82,
            building_size_m: 25.0,
            goal_hidden_share: 0.15,
            goal_emphasis: 2.0,
            rival_margin: 6.0,
            rival_away_m: 2.5,
            rival_looks: 8,
            ask_margin: 3.0,
            alike_margin: 1.0,
            ask_patience_s: 120.0,
            map_clearance_m: 0.2,
            lost_s: 20.0,
        }
    }
}

/// An invalid parameter.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameters.planner.{key}: expected {expected}, found {found}")]
pub struct ParameterError {
    /// The key.
    pub key: &'static str,
    /// What was expected.
    pub expected: &'static str,
    /// What was found.
    pub found: f64,
}

impl Parameters {
    /// Returns the default parameters of a method.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Beam => Self::default(),
            Method::Outline => Self { by_outline: true, ..Self::default() },
            Method::Boniardi2015 | Method::Boniardi2015FixedScale | Method::Behzadian2015 => Self::paper(),
        }
    }

    /// Returns the parameters for a map that was learned on an earlier drive.
    pub fn learned() -> Self {
        Self { finds_itself: true, ..Self::default() }
    }

    /// Returns parameters for planning as described in Boniardi et al. 2015, III-C. Values that the paper
    /// leaves open (the radius ρ, the distance from walls, the speeds) are those of this project's methods,
    /// so that the methods differ only in what defines them. Every arrival is accepted.
    pub fn paper() -> Self {
        Self { look_above: NEVER, doubt_above: NEVER, ..Self::default() }
    }

    /// Returns the criteria for the robot to be stuck, and the limits on how often it may be.
    pub fn progress(&self) -> ProgressParameters {
        ProgressParameters {
            stuck_time_s: self.stuck_time_s,
            stuck_radius_m: self.stuck_radius_m,
            no_progress_time_s: self.no_progress_time_s,
            circling_path_m: self.circling_path_m,
            circling_radius_m: self.circling_radius_m,
            recoveries: self.recoveries,
            recoveries_per_task: self.recoveries_per_task,
        }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`ParameterError`], which names the first key with an invalid value.
    pub fn check(&self) -> Result<(), ParameterError> {
        let positive = [
            ("arrival_radius_m", self.arrival_radius_m),
            ("near_radius_m", self.near_radius_m),
            ("window_radius_m", self.window_radius_m),
            ("route_window_m", self.route_window_m),
            ("route_look_ahead_m", self.route_look_ahead_m),
            ("plan_period_s", self.plan_period_s),
            ("inflation_radius_m", self.inflation_radius_m),
            ("local_inflation_radius_m", self.local_inflation_radius_m),
            ("obstacle_memory_s", self.obstacle_memory_s),
            ("stuck_time_s", self.stuck_time_s),
            ("stuck_radius_m", self.stuck_radius_m),
            ("no_progress_time_s", self.no_progress_time_s),
            ("circling_path_m", self.circling_path_m),
            ("circling_radius_m", self.circling_radius_m),
            ("astray_factor", self.astray_factor),
            ("astray_m", self.astray_m),
            ("look_above", self.look_above),
            ("doubt_above", self.doubt_above),
            ("lost_s", self.lost_s),
            ("building_size_m", self.building_size_m),
            ("rival_away_m", self.rival_away_m),
            ("ask_patience_s", self.ask_patience_s),
        ];
        let not_negative = [
            ("inflation_weight", self.inflation_weight),
            ("footprint_padding_m", self.footprint_padding_m),
            ("least_open_share", self.least_open_share),
            ("goal_hidden_share", self.goal_hidden_share),
            ("goal_emphasis", self.goal_emphasis),
            ("rival_margin", self.rival_margin),
            ("ask_margin", self.ask_margin),
            ("alike_margin", self.alike_margin),
            ("map_clearance_m", self.map_clearance_m),
        ];
        let shares = [("speed_share", self.speed_share), ("turn_share", self.turn_share)];
        for (key, found) in positive {
            expect(key, "a number above 0", found, found > 0.0)?;
        }
        for (key, found) in not_negative {
            expect(key, "a number of 0 or more", found, found >= 0.0)?;
        }
        for (key, found) in shares {
            expect(key, "a share above 0, at most 1", found, found > 0.0 && found <= 1.0)?;
        }
        expect("wall_weight", "a number above 1", self.wall_weight, self.wall_weight > 1.0)
    }
}

fn expect(key: &'static str, expected: &'static str, found: f64, holds: bool) -> Result<(), ParameterError> {
    if holds && found.is_finite() { Ok(()) } else { Err(ParameterError { key, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_hold() {
        assert_eq!(Parameters::default().check(), Ok(()));
    }

    #[test]
    fn a_bad_value_is_named() {
        let bad = Parameters { speed_share: 1.5, ..Default::default() };
        let text = bad.check().unwrap_err().to_string();
        assert_eq!(text, "parameters.planner.speed_share: expected a share above 0, at most 1, found 1.5");
    }
}
