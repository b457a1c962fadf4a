//! Derives the window, the errors, the navigator's settings and the amount of simulation from a mission's parameters and its robot.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, MissionError};
use sketchnav_schemas::robot::{Drive, Laser, MarkerCamera, Robot};

use super::error::DirectionsError;
use super::mission::{DirectionsMission, wrong};
use crate::arrival::{Effort, Pilot};
use crate::description::Vocabulary;
use crate::error::Error;
use crate::geometry::{Land, Window};
use crate::navigator::{Settings, Turning};
use crate::pillars::Finder;
use crate::traversal::Noise;
use crate::walls::Body;

/// The settings of the navigator that a mission can override in its table `parameters.planner`. See [`Settings`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerParameters {
    /// Number of views that the navigator takes at rest before each decision.
    pub looks: u8,
    /// Number of times that the navigator looks again for a landmark that it cannot locate.
    pub patience: u8,
    /// Maximum number of recoveries within one entry.
    pub most_recoveries: u8,
    /// Time after which the navigator gives up on an entry, in seconds.
    pub longest_entry_s: f64,
    /// Rate at which the navigator removes a position error, per second.
    pub gain: f64,
    /// Weight of a dot's new position while the window moves, from 0 to 1.
    pub weight: f64,
}

/// The settings of the map-maker that a mission can override in its table `parameters.sketcher`. See [`Effort`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SketcherParameters {
    /// Number of simulations of each transition.
    pub trials: u32,
    /// Number of simulated journeys for each candidate.
    pub trial_journeys: u32,
    /// Number of simulated journeys for the stated probability.
    pub journeys: u32,
}

/// Maximum number of simulations of each kind.
const MOST_SIMULATIONS: u32 = 100_000;

/// Returns the amount of simulation for the map-maker.
///
/// # Errors
/// [`MissionError`] with the invalid key.
pub fn effort(mission: &Mission) -> Result<Effort, MissionError> {
    let Effort { trials, trial_journeys, journeys } = Effort::USUAL;
    let usual = SketcherParameters { trials, trial_journeys, journeys };
    let SketcherParameters { trials, trial_journeys, journeys } =
        mission.parameters.over(Process::Sketcher, &usual)?;
    for (key, count) in [("trials", trials), ("trial_journeys", trial_journeys), ("journeys", journeys)] {
        if !(1..=MOST_SIMULATIONS).contains(&count) {
            return Err(wrong(&format!("parameters.sketcher.{key}"), "1 to 100000", &count.to_string()));
        }
    }
    Ok(Effort { trials, trial_journeys, journeys })
}

/// Gap between the robot's body and a landmark or wall, in metres.
const BERTH_M: f64 = 0.15;
/// Additional gap when the robot stands beside a landmark, in metres.
const BESIDE_M: f64 = 0.25;

/// Distance for which position errors are stated, as a fraction of the robot's range. A typical landmark is this far away.
const USUAL_SHARE: f64 = 0.62;

/// Returns the window of a mission's robot, and the standard deviation of a position in it, in metres.
///
/// # Errors
/// [`DirectionsError::Robot`] if the robot has no view or, on land, no laser, or if it
/// has to turn and has no odometry. [`DirectionsError::Settings`] if the window is
/// invalid or, on land, the laser doesn't look all around.
pub fn sight(mission: &Mission, robot: &Robot) -> Result<(Window, f64), DirectionsError> {
    let Some(land) = DirectionsMission::of(mission)?.land else {
        let view = robot.view()?;
        let window = Window::new(view.side_m, view.margin_m).map_err(DirectionsError::Settings)?;
        return Ok((window, view.noise_m));
    };
    let laser = robot.laser()?;
    let unfit =
        |what, expected, found| Err(DirectionsError::Settings(Error::Parameter { what, expected, found }));
    if laser.field_of_view_deg < 359.0 {
        return unfit("laser.field_of_view_deg", "359 and more on land", laser.field_of_view_deg);
    }
    if robot.drive == Drive::Differential {
        robot.require("odometry")?;
    }
    let clearance = land.radius_m + robot.radius_m + BERTH_M;
    let range = land.range_m.map_or(laser.range_max_m, |range_m| range_m.min(laser.range_max_m));
    let body = Land { radius: land.radius_m, range, stand_off: clearance + BESIDE_M, clearance };
    let window = Window::on_land(body).map_err(DirectionsError::Settings)?;
    Ok((window, position_noise_m(laser, land.radius_m, USUAL_SHARE * range)))
}

/// Returns the standard deviation of a landmark's position at a distance, on each axis. Along the beams, the landmark's returns
/// are averaged. Across the beams, each edge lies somewhere between two of them.
fn position_noise_m(laser: &Laser, radius_m: f64, distance_m: f64) -> f64 {
    let beam_rad = laser.field_of_view_deg.to_radians() / f64::from(laser.beams.max(1));
    let returns = (2.0 * radius_m / distance_m / beam_rad).max(1.0);
    let along_m = (laser.noise_m + laser.noise_per_m * distance_m) / returns.sqrt();
    along_m.hypot(distance_m * beam_rad / 12.0_f64.sqrt())
}

/// Returns the finder of landmarks in the laser scans of a robot on land, or `None` above a plane.
///
/// # Errors
/// Returns the errors of [`sight`].
pub fn finder(mission: &Mission, robot: &Robot) -> Result<Option<Finder>, DirectionsError> {
    let (window, _) = sight(mission, robot)?;
    let Some(land) = window.land else { return Ok(None) };
    let laser = robot.laser()?;
    let noise_m = laser.noise_m + laser.noise_per_m * land.range;
    Ok(Some(Finder { radius_m: land.radius, range_m: land.range, noise_m, mount: laser.mount() }))
}

/// Returns the camera that sees the markers on landmarks, or `None` if the mission has none.
///
/// # Errors
/// [`DirectionsError::Robot`] if the mission has markers but the robot has no camera for them.
pub fn camera<'a>(mission: &Mission, robot: &'a Robot) -> Result<Option<&'a MarkerCamera>, DirectionsError> {
    let has_markers = !DirectionsMission::of(mission)?.markers.is_empty();
    Ok(has_markers.then(|| robot.camera()).transpose()?)
}

/// Returns the size and the clearance of a robot on land for the walls of its floor.
///
/// # Errors
/// Returns the errors of [`sight`].
pub fn body(mission: &Mission, robot: &Robot) -> Result<Body, DirectionsError> {
    let merges = finder(mission, robot)?.map_or(0.0, |finder| finder.jump_m());
    Ok(Body { radius: robot.radius_m, keeps: robot.radius_m + BERTH_M, merges })
}

/// Returns the standard deviation of the change of the heading error of a robot that turns over one metre, in radians, and its
/// turns. `None` if the robot need not turn.
///
/// The odometry drifts steadily. A random walk that is as wrong after the robot's range stands for that drift. The noise of the turn
/// rate has the variance (α₃ v² + α₄ ω²)/dt (Thrun, Burgard and Fox, *Probabilistic Robotics*, table 5.3), which adds up to α₃ v over
/// one metre and to α₄ ω over one radian. The robot turns at up to its maximum rate.
fn turning(robot: &Robot, window: &Window, speed: f64) -> Option<(f64, Turning)> {
    let (Drive::Differential, Some(odometry), Some(land)) = (robot.drive, robot.odometry, window.land) else {
        return None;
    };
    let rate_radps = robot.limits.yaw_rate_radps;
    let steady_rad = odometry.drift_yaw_radpm * land.range.sqrt();
    let drift_rad = steady_rad.hypot((odometry.alpha_turn_speed * speed).sqrt());
    Some((drift_rad, Turning { rate_radps, drift_rad: (odometry.alpha_turn_turn * rate_radps).sqrt() }))
}

/// Returns the settings of a mission's navigator.
///
/// # Errors
/// Returns the errors of [`sight`], and [`DirectionsError::Settings`] if a setting is out of range.
pub fn settings(mission: &Mission, robot: &Robot) -> Result<Settings, DirectionsError> {
    let (window, noise_m) = sight(mission, robot)?;
    let usual = Settings::new(window, noise_m);
    let defaults = PlannerParameters {
        looks: usual.looks,
        patience: usual.patience,
        most_recoveries: usual.most_recoveries,
        longest_entry_s: usual.longest_entry_s,
        gain: usual.gain,
        weight: usual.weight,
    };
    let PlannerParameters { looks, patience, most_recoveries, longest_entry_s, gain, weight } =
        mission.parameters.over(Process::Planner, &defaults)?;
    let DirectionsMission { words, heading_noise_deg, heading_unknown, .. } = DirectionsMission::of(mission)?;
    // A step lasts one tick, so this keeps the window from moving further per step than the view allows.
    let speed = usual.speed.min(robot.limits.speed_mps);
    let turning = turning(robot, &window, speed);
    let settings = Settings {
        vocabulary: Vocabulary::of(&words),
        heading_rad: heading_noise_deg.to_radians(),
        heading_drift_rad: turning.map_or(0.0, |(drift_rad, _)| drift_rad),
        turning: turning.map(|(_, turning)| turning),
        heading_unknown,
        speed,
        looks,
        patience,
        most_recoveries,
        longest_entry_s,
        gain,
        weight,
        ..usual
    };
    settings.check().map_err(DirectionsError::Settings)
}

/// Returns the navigator's settings together with the errors of the navigator and the map-maker, for the map-maker's plans.
///
/// # Errors
/// Returns the errors of [`settings`].
pub fn pilot(mission: &Mission, robot: &Robot, map_noise_m: f64) -> Result<Pilot, DirectionsError> {
    let (_, sigma) = sight(mission, robot)?;
    let settings = settings(mission, robot)?;
    let read = DirectionsMission::of(mission)?;
    let heading_rad = read.heading_noise_deg.to_radians();
    let errors = Noise { sigma, map_sigma: map_noise_m, heading_rad, ..Noise::NONE };
    if read.land.is_some() {
        let noise = Noise { rotation_rad: settings.heading_drift_rad, ..errors };
        return Ok(Pilot { settings, noise });
    }
    let (view, motion) = (robot.view()?, robot.motion_noise.unwrap_or_default());
    let noise = Noise {
        misses: view.miss,
        false_dots: view.false_dots,
        translation: motion.translation_m,
        rotation_rad: motion.rotation_rad,
        ..errors
    };
    Ok(Pilot { settings, noise })
}
