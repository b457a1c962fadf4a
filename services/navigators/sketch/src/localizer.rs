//! The localizer in drawings as a stage: says where the robot is in the drawing.
//!
//! It answers every tick with one estimate, and once a simulated second with a sample of the particles before it.
//! Instants wait for the sketch; where people draw while it runs, nothing waits, and with each new sketch the filter
//! begins anew. By an order `here` it begins anew where a person says that the robot is.

pub mod core;

use serde::Serialize;
use sketchnav_schemas::channels::{ESTIMATE, MISSION, ODOMETRY, ORDERS, PARTICLES, SCAN, SKETCH};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Heard, Instant, Outbox, Remains, Stage, StageError};

use self::core::{Core, CoreError, State};

/// The localizer of a run.
pub struct Localizer {
    core: Core,
    waits_for_sketch: bool,
}

impl Localizer {
    /// Reads the parameters out of the mission.
    ///
    /// # Errors
    /// [`CoreError`] with the key.
    pub fn new(run: &RunConfig) -> Result<Self, CoreError> {
        Ok(Self { core: Core::new(run)?, waits_for_sketch: !run.pad.draws() })
    }
}

impl Stage for Localizer {
    const FORM: &'static str = "sketch localizer 5";
    type State = State;

    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        if let Some(sketch) = message.on(SKETCH) {
            self.core.on_sketch(sketch, message.cells())?;
        } else if let Some(order) = message.on(MISSION).or(message.on(ORDERS)) {
            self.core.on_order(order);
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.core.has_sketch() || !self.waits_for_sketch
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let (core, stamp_ns) = (&mut self.core, instant.stamp_ns);
        let Some(odometry) = instant.newest(ODOMETRY) else { return Ok(()) };
        core.step(odometry, instant.fresh(SCAN));
        if core.particles_due(stamp_ns) {
            out.send(PARTICLES, |particles| core.write_particles(stamp_ns, particles))?;
        }
        out.send(ESTIMATE, |estimate| core.write_estimate(estimate))?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        self.core.state()
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        self.core.restore(state);
        Ok(())
    }

    fn recover(&mut self, remains: &dyn Remains) {
        if let Some(last) = remains.of(ESTIMATE) {
            self.core.begin_at(&last);
        }
    }
}
