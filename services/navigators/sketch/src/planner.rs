//! The planner in drawings as a stage: drives the robot to its goals.
//!
//! It answers every estimate with a plan where one is due, one command and, last, one status. In lockstep the first
//! estimate waits for the sketch, the route and the order to start. In real time the robot stands still until they
//! have come. Orders come from the supervisor and from the pad.

mod arrival;
pub mod core;
mod driving;
mod explorer;
mod journey;
mod reason;

use serde::Serialize;
use sketchnav_schemas::channels::{
    COMMAND, CORRESPONDENCE, ESTIMATE, MISSION, ODOMETRY, ORDERS, PLAN, QUESTION, ROUTE, SCAN, SKETCH, STATUS,
};
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_stage::{Heard, Instant, Outbox, Remains, Stage, StageError};

use self::core::{Core, PlannerError, State};
pub use self::reason::ROOMS;

/// The planner of a run.
pub struct Planner {
    core: Core,
    waits_for_order: bool,
}

impl Planner {
    /// For a run: its robot and the parameters of its mission.
    ///
    /// # Errors
    /// [`PlannerError`] with the key.
    pub fn new(run: &RunConfig) -> Result<Self, PlannerError> {
        Ok(Self { core: Core::new(run)?, waits_for_order: run.pace == Pace::Lockstep })
    }
}

impl Stage for Planner {
    const FORM: &'static str = "sketch planner 9";
    type State = State;

    fn hear(&mut self, message: &Heard<'_>) -> Result<(), StageError> {
        if let Some(sketch) = message.on(SKETCH) {
            self.core.on_sketch(sketch, message.cells())?;
        } else if let Some(route) = message.on(ROUTE) {
            self.core.on_route(route);
        } else if let Some(order) = message.on(MISSION).or(message.on(ORDERS)) {
            self.core.on_order(order);
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.core.is_ready() || !self.waits_for_order
    }

    /// An instant has no answer before the first scan and odometry: the world stops a robot without commands.
    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let core = &mut self.core;
        let (Some(estimate), Some(odometry)) = (instant.newest(ESTIMATE), instant.newest(ODOMETRY)) else {
            return Ok(());
        };
        if instant.newest(SCAN).is_none() {
            return Ok(());
        }
        if core.step(estimate, instant.fresh(SCAN), odometry).planned {
            out.send(PLAN, |plan| core.write_plan(plan))?;
        }
        if core.has_news() {
            out.send(CORRESPONDENCE, |found| core.write_correspondence(odometry, found))?;
        }
        if core.has_question() {
            out.send(QUESTION, |question| core.write_question(question))?;
        }
        out.send(COMMAND, |command| core.write_command(command))?;
        out.send(STATUS, |status| core.write_status(status))?;
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
        if let Some(last) = remains.of(STATUS) {
            self.core.resume_behind(&last);
        }
    }
}
