//! The localizer stage of `corridor`, which publishes the robot's relations with the markers once per tick.

use serde::Serialize;
use sketchnav_qualitative::argd::Scale;
use sketchnav_schemas::channels::{MARKERS, ODOMETRY};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, MissionError};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Instant, Outbox, Stage, StageError};

use crate::error::CorridorError;
use crate::messages::RELATIONS;
use crate::mission::{CorridorMission, Method};
use crate::perception::{LEAST_HZ, Parameters, Perception, Terms};

/// Localizer of a run.
pub struct Localizer {
    terms: Terms,
    perception: Perception,
}

impl Localizer {
    /// Creates a localizer with the parameters of the run's mission.
    ///
    /// # Errors
    /// [`CorridorError`], which names the key, if a parameter is invalid.
    pub fn new(run: &RunConfig) -> Result<Self, CorridorError> {
        let parameters = parameters(&run.mission)?;
        let scale = scale(&parameters)?;
        let is_steady = CorridorMission::of(&run.mission)?.method == Method::QtcBSteady;
        Ok(Self { terms: Terms { parameters, scale, is_steady }, perception: Perception::default() })
    }
}

/// Returns the parameters that a mission sets for the localizer.
///
/// # Errors
/// [`MissionError`], which names the key, if a parameter is invalid.
pub fn parameters(mission: &Mission) -> Result<Parameters, MissionError> {
    let parameters = mission.parameters.over(Process::Localizer, &Parameters::default())?;
    let Parameters { memory_s, pair_rate_hz, hold_s, window_s, quantum_mps, .. } = parameters;
    // Two pictures farther apart than the limit for two sightings would never yield a trend.
    let is_rate = pair_rate_hz == 0.0 || (LEAST_HZ..=1000.0).contains(&pair_rate_hz);
    for (key, expected, found, holds) in [
        ("memory_s", "0 to 1e6 s", memory_s, (0.0..=1e6).contains(&memory_s)),
        ("pair_rate_hz", "0, or 4 to 1000 Hz", pair_rate_hz, is_rate),
        ("hold_s", "0 to 60 s", hold_s, (0.0..=60.0).contains(&hold_s)),
        ("window_s", "0.3 to 60 s", window_s, (0.3..=60.0).contains(&window_s)),
        ("quantum_mps", "0 to 1 m/s", quantum_mps, (0.0..=1.0).contains(&quantum_mps)),
    ] {
        if !holds {
            return Err(wrong(&format!("{key}: expected {expected}, found {found}")));
        }
    }
    scale(&parameters)?;
    Ok(parameters)
}

fn scale(parameters: &Parameters) -> Result<Scale, MissionError> {
    parameters.scale().map_err(|error| wrong(&error.to_string()))
}

fn wrong(reason: &str) -> MissionError {
    MissionError::Key { key: "parameters.localizer".into(), reason: reason.to_owned() }
}

impl Stage for Localizer {
    const FORM: &'static str = "corridor localizer 2";
    type State = Perception;

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(odometry) = instant.newest(ODOMETRY)? else { return Ok(()) };
        let (robot, stamp_ns) = (odometry.pose(), instant.stamp_ns);
        if let Some(view) = instant.fresh(MARKERS)? {
            self.perception.see(view, &robot, stamp_ns, &self.terms);
        }
        self.perception.forget(stamp_ns, self.terms.parameters.memory_s);
        out.send(RELATIONS, |relations| self.perception.write(&robot, stamp_ns, relations))?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        &self.perception
    }

    fn restore(&mut self, state: Perception) -> Result<(), StageError> {
        self.perception = state;
        Ok(())
    }
}
