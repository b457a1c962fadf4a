//! All parameters of planning: the table `parameters.planner` of a mission.

use crate::method::Method;
use serde::{Deserialize, Serialize};
use sketchnav_motion::progress::ProgressParameters;

/// Parameters of the planner. What a mission leaves out keeps its default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// A goal counts as reached within this distance in the local metric, metres.
    pub arrival_radius_m: f64,
    /// It also counts as reached within this distance, metres, if the robot cannot get any nearer.
    pub near_radius_m: f64,
    /// ρ, the radius of the local window (Boniardi et al. 2015, III-C), metres by the mean local scale.
    pub window_radius_m: f64,
    /// r_L, the radius in which the robot looks for its place on a drawn route (Boniardi et al. 2016, III-A), metres.
    pub route_window_m: f64,
    /// r_H, how far to look ahead on a drawn route (Boniardi et al. 2016, III-A), metres.
    pub route_look_ahead_m: f64,
    /// Time between two local plans, seconds.
    pub plan_period_s: f64,
    /// Within this distance of a drawn wall a path through the drawing costs more, metres.
    pub inflation_radius_m: f64,
    /// How much more it costs right at the wall, per length.
    pub inflation_weight: f64,
    /// What a path through a drawn wall costs, per length.
    pub wall_weight: f64,
    /// Free space that the local planner keeps around the robot's footprint, metres.
    pub footprint_padding_m: f64,
    /// Within this distance beyond the padding a local path costs more, metres.
    pub local_inflation_radius_m: f64,
    /// How long the robot remembers what it no longer sees, seconds.
    pub obstacle_memory_s: f64,
    /// Share of the robot's top speed that is used.
    pub speed_share: f64,
    /// Share of the robot's top turn rate that is used.
    pub turn_share: f64,
    /// A robot that has not moved for this long is stuck, seconds. The time is proportionally longer for a robot that may drive at
    /// less than half a metre per second.
    pub stuck_time_s: f64,
    /// Moving less than this counts as not moving, metres.
    pub stuck_radius_m: f64,
    /// A robot that has not come nearer for this long is stuck, seconds; longer for a slow robot as above.
    pub no_progress_time_s: f64,
    /// A robot that drives around one place for as long as this path takes at its top speed is stuck, whatever the estimate says,
    /// metres.
    pub circling_path_m: f64,
    /// Distances below this from where it started count as around one place, metres.
    pub circling_radius_m: f64,
    /// How often to recover around one place.
    pub recoveries: u32,
    /// How often to recover during one task.
    pub recoveries_per_task: u32,
    /// A robot is lost, and not where the estimate says, if it is under way for longer than this multiple of the time that the
    /// drawn path plus `astray_m` takes. The drawn path is timed at half a metre per second, or at the robot's limit if that is
    /// lower.
    pub astray_factor: f64,
    /// What is added to the drawn path before it is multiplied, metres.
    pub astray_m: f64,
    /// An arrival is doubted by how badly the scans fit: minus the mean log likelihood of a beam, plus half the logarithm of how
    /// often the estimate jumped. Above this the robot looks around before it believes the arrival.
    pub look_above: f64,
    /// Above this, after having looked around, it is lost.
    pub doubt_above: f64,
    /// Whether goals are found from the outline of what was seen.
    pub by_outline: bool,
    /// Only on open floors: if passages as narrow as doors are closed, the largest part of what was seen must keep this share of
    /// the area, whatever the doors' width. Among rooms the robot drives by the filter.
    pub least_open_share: f64,
    /// The size of buildings, metres, from which the outline's proportions start.
    pub building_size_m: f64,
    /// A goal counts as seen if less than this share of the outline around it lies behind gaps.
    pub goal_hidden_share: f64,
    /// How many times more the walls around the goal count in aligning the outlines.
    pub goal_emphasis: f64,
    /// An arrival is believed if the best alignment with the goal elsewhere costs more than the best one by over this amount; 0:
    /// every arrival is believed.
    pub rival_margin: f64,
    /// Elsewhere means farther away than this, metres.
    pub rival_away_m: f64,
    /// How often to look where a rival places the goal.
    pub rival_looks: u32,
    /// A person is asked where the robot is if the best rival costs at most this much more and its place was looked at; 0: no one
    /// is asked. Without a pad there is no one to answer.
    pub ask_margin: f64,
    /// How long the robot waits for the answer before it believes the arrival, seconds.
    pub ask_patience_s: f64,
    /// The distance, beyond the footprint's padding, that paths through the map keep from walls, metres.
    pub map_clearance_m: f64,
    /// A task fails after the localizer was lost for this long, seconds.
    pub lost_s: f64,
}

/// A doubt that is never reached.
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
            least_open_share: 0.82,
            building_size_m: 25.0,
            goal_hidden_share: 0.15,
            goal_emphasis: 2.0,
            rival_margin: 6.0,
            rival_away_m: 2.5,
            rival_looks: 8,
            ask_margin: 3.0,
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
    /// The default parameters of a method.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Beam => Self::default(),
            Method::Outline => Self { by_outline: true, ..Self::default() },
            Method::Boniardi2015 | Method::Boniardi2015FixedScale | Method::Behzadian2015 => Self::paper(),
        }
    }

    /// Planning as Boniardi et al. 2015, III-C, describes it. What the paper leaves open (the radius ρ, the distance from walls,
    /// the speeds) is as in this project's methods, so that the methods differ only in what defines them. Every arrival is
    /// believed.
    pub fn paper() -> Self {
        Self { look_above: NEVER, doubt_above: NEVER, ..Self::default() }
    }

    /// When a robot is stuck, and how often it may be.
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
    /// [`ParameterError`] with the first key that has an invalid value.
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
