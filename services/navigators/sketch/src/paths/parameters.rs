//! All that can be tuned about planning: the table `parameters.planner` of a mission.

use crate::method::Method;
use serde::{Deserialize, Serialize};
use sketchnav_motion::progress::ProgressParameters;

/// Parameters of the planner. What a mission leaves out keeps its default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// A goal counts as reached within this distance by the local metric, metres.
    pub arrival_radius_m: f64,
    /// It also does within this distance, metres, where the robot cannot get any nearer.
    pub near_radius_m: f64,
    /// ρ, the radius of the local window (Boniardi et al. 2015, III-C), metres by the mean local scale.
    pub window_radius_m: f64,
    /// r_L, the radius in which the robot looks for its place on a drawn route (Boniardi et al. 2016, III-A), metres.
    pub route_window_m: f64,
    /// r_H, how far to look ahead on a drawn route (Boniardi et al. 2016, III-A), metres.
    pub route_look_ahead_m: f64,
    /// Time between two local plans, seconds.
    pub plan_period_s: f64,
    /// Within this distance of a drawn wall a way through the drawing costs more, metres.
    pub inflation_radius_m: f64,
    /// How much more it costs right at the wall, times the length.
    pub inflation_weight: f64,
    /// What a way through a drawn wall costs, times the length.
    pub wall_weight: f64,
    /// Free space that the local planner keeps around the robot's footprint, metres.
    pub footprint_padding_m: f64,
    /// Within this distance beyond the padding a local path costs more, metres.
    pub local_inflation_radius_m: f64,
    /// How long the robot remembers what it does not see any more, seconds.
    pub obstacle_memory_s: f64,
    /// Share of the robot's top speed that is used.
    pub speed_share: f64,
    /// Share of the robot's top turn rate that is used.
    pub turn_share: f64,
    /// A robot that has not moved for this long is stuck, seconds. One that may drive less than half a metre a second
    /// gets as much longer as it is slower.
    pub stuck_time_s: f64,
    /// Less than this is no way, metres.
    pub stuck_radius_m: f64,
    /// A robot that has not come nearer for this long is stuck, seconds; longer as above.
    pub no_progress_time_s: f64,
    /// A robot that drives about one place for as long as this path takes at its top speed is stuck, whatever the
    /// estimate says, metres.
    pub circling_path_m: f64,
    /// Less than this from where it began is about one place, metres.
    pub circling_radius_m: f64,
    /// How often to recover at about one place.
    pub recoveries: u32,
    /// How often to recover during one task.
    pub recoveries_per_task: u32,
    /// A robot is lost when it is on the way for longer than so many times what the drawn way and `astray_m` take. It
    /// is not where the estimate says. The drawn way is timed at half a metre a second, or at the robot's limit where
    /// that is less.
    pub astray_factor: f64,
    /// What is added to the drawn way before it is multiplied, metres.
    pub astray_m: f64,
    /// An arrival is doubted by how badly the scans fit: minus the mean log likelihood of a beam. Half the logarithm
    /// of how often the estimate jumped is added. Above this the robot looks around before it believes.
    pub look_above: f64,
    /// Above this, having looked around, it is lost.
    pub doubt_above: f64,
    /// Whether goals are found by the outline of what was seen.
    pub by_outline: bool,
    /// Only on open floors: where passages as narrow as doors are shut, the largest part of what was seen keeps this share of
    /// the area, whatever the doors' width. Among rooms the robot drives by the filter.
    pub least_open_share: f64,
    /// How large buildings are, metres: what the outline's proportions begin with.
    pub building_size_m: f64,
    /// A goal has been seen where less than this share of the outline around it lies behind gaps.
    pub goal_hidden_share: f64,
    /// So many times more count the walls around the goal where the outlines are aligned.
    pub goal_emphasis: f64,
    /// An arrival is believed where the best alignment that has the goal elsewhere costs more than this in addition; 0: every
    /// arrival is.
    pub rival_margin: f64,
    /// Elsewhere is farther than this, metres.
    pub rival_away_m: f64,
    /// How often to look where a rival has the goal.
    pub rival_looks: u32,
    /// A person is asked where the robot is if the best rival costs at most this in addition and was looked at; 0: nobody
    /// is. Without a pad nobody could answer.
    pub ask_margin: f64,
    /// So long the robot waits for the answer before it believes the arrival, seconds.
    pub ask_patience_s: f64,
    /// Room beside the footprint's padding that ways through the map keep from walls, metres.
    pub map_clearance_m: f64,
    /// A task has failed after the localizer was lost for this long, seconds.
    pub lost_s: f64,
}

/// More doubt than there can be.
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
    /// What would be right.
    pub expected: &'static str,
    /// What stands there.
    pub found: f64,
}

impl Parameters {
    /// The set that a method begins with.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Beam => Self::default(),
            Method::Outline => Self { by_outline: true, ..Self::default() },
            Method::Boniardi2015 | Method::Boniardi2015FixedScale | Method::Behzadian2015 => Self::paper(),
        }
    }

    /// Planning as Boniardi et al. 2015, III-C, describes it. What it leaves open (the radius ρ, the distance from
    /// walls, the speeds) is as in ours. So the methods differ only in what defines them. It believes every arrival.
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
    /// [`ParameterError`] with the first key that holds an invalid value.
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
