//! The localizer for corridors as a stage: says what the markers tell, once a tick.

use serde::Serialize;
use sketchnav_qualitative::argd::Scale;
use sketchnav_schemas::channels::{MARKERS, ODOMETRY};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, MissionError, overlaid};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Instant, Outbox, Stage, StageError};

use crate::error::CorridorError;
use crate::messages::RELATIONS;
use crate::perception::{Parameters, Perception};

/// The longest memory of a marker, seconds.
const MOST_MEMORY_S: f64 = 1e6;

/// The localizer of a run.
pub struct Localizer {
    parameters: Parameters,
    scale: Scale,
    perception: Perception,
}

impl Localizer {
    /// With the parameters of the run's mission.
    ///
    /// # Errors
    /// [`CorridorError`] with the key.
    pub fn new(run: &RunConfig) -> Result<Self, CorridorError> {
        let (parameters, scale) = parameters(&run.mission)?;
        Ok(Self { parameters, scale, perception: Perception::default() })
    }
}

/// The parameters that a mission gives the localizer.
///
/// # Errors
/// [`MissionError`] with the key.
pub fn parameters(mission: &Mission) -> Result<(Parameters, Scale), MissionError> {
    let wrong = |reason: String| MissionError::Key { key: "parameters.localizer".into(), reason };
    let parameters = overlaid(&Parameters::default(), mission.parameters.of(Process::Localizer));
    let parameters = parameters.map_err(|error| wrong(error.message().to_owned()))?;
    if !(0.0..=MOST_MEMORY_S).contains(&parameters.memory_s) {
        return Err(wrong(format!(
            "memory_s: expected 0 to {MOST_MEMORY_S} s, found {}",
            parameters.memory_s
        )));
    }
    let scale = parameters.scale().map_err(|error| wrong(error.to_string()))?;
    Ok((parameters, scale))
}

impl Stage for Localizer {
    const FORM: &'static str = "corridor localizer 1";
    type State = Perception;

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(odometry) = instant.newest(ODOMETRY)? else { return Ok(()) };
        let (robot, stamp_ns) = (odometry.pose(), instant.stamp_ns);
        if let Some(view) = instant.fresh(MARKERS)? {
            self.perception.see(view, &robot, stamp_ns, &self.parameters, &self.scale);
        }
        self.perception.forget(stamp_ns, self.parameters.memory_s);
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
