//! Simulators by others, which replace the world in trials.

use std::fmt;
use std::sync::Arc;

use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{StageError, Tap};

use crate::experiments::suite::Suite;
use crate::experiments::trial::Trial;

/// The simulators, by their names on the command line.
pub const SIMULATORS: [&str; 2] = ["irsim", "mujoco"];

/// Returns the name of a suite that is driven in a simulator, for example `building@mujoco`.
pub fn suite_in(suite: &str, simulator: &str) -> String {
    format!("{suite}@{simulator}")
}

/// Drives a run of a trial, and shows all its messages in order.
type Drive = dyn Fn(&Trial, &RunConfig, &mut dyn Tap) -> Result<(), StageError> + Send + Sync;

/// A simulator in which trials are driven instead of this project's own world.
#[derive(Clone)]
pub struct Elsewhere {
    simulator: &'static str,
    driver: u32,
    drive: Arc<Drive>,
}

impl Elsewhere {
    /// Creates the world of a simulator listed in [`SIMULATORS`], in which `drive` drives. `driver` is a
    /// checksum of the driver, which determines the outcomes as much as the trials do.
    pub fn new(
        simulator: &'static str,
        driver: u32,
        drive: impl Fn(&Trial, &RunConfig, &mut dyn Tap) -> Result<(), StageError> + Send + Sync + 'static,
    ) -> Self {
        Self { simulator, driver, drive: Arc::new(drive) }
    }

    /// Drives a run of a trial, and shows all its messages to `tap`.
    ///
    /// # Errors
    /// Those of the drive.
    pub fn drive(&self, trial: &Trial, run: &RunConfig, tap: &mut dyn Tap) -> Result<(), StageError> {
        (self.drive)(trial, run, tap)
    }

    /// Sets all trials of a suite to be driven in the simulator.
    ///
    /// # Errors
    /// A description of the first trial that needs something that the simulator lacks.
    pub fn take(&self, suite: &mut Suite) -> Result<(), String> {
        if let Some((trial, what)) = suite.trials.iter().find_map(|trial| Some((trial, lacks(trial)?))) {
            let simulator = self.simulator;
            return Err(format!("trial {}: expected no {what} in {simulator}, found one", trial.name));
        }
        for trial in &mut suite.trials {
            trial.elsewhere = Some(self.clone());
        }
        suite.name = suite_in(&suite.name, self.simulator);
        suite.notices.push(format!("Driven in {}, without the floor's people.", self.simulator));
        Ok(())
    }
}

impl fmt::Debug for Elsewhere {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:08x}", self.simulator, self.driver)
    }
}

/// Returns what a trial needs and only the project's own world provides. People and markers that a trial adds
/// to its floor are essential to it, whereas those of the floor can be left out.
fn lacks(trial: &Trial) -> Option<&'static str> {
    let world = &trial.mission.world;
    [
        (trial.person.is_some(), "person who answers the robot"),
        (trial.thinking_scans > 0, "core that takes longer than a scan"),
        (trial.asks_rooms, "map of the drive"),
        (trial.series.is_some(), "drive that others are learned from"),
        (world.plane.is_some(), "plane of dots"),
        (!world.person.is_empty(), "person who walks"),
        (!world.marker.is_empty(), "marker"),
    ]
    .into_iter()
    .find_map(|(needs, what)| needs.then_some(what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::suite::Folders;
    use crate::experiments::{run, suites};

    fn building() -> Suite {
        let mut suite = suites::load("building", &Folders::of_checkout()).unwrap();
        suite.trials.truncate(1);
        suite
    }

    #[test]
    fn trials_that_need_what_simulators_lack_are_refused_with_the_reason() {
        let simulator = Elsewhere::new("mujoco", 7, |_, _, _| Ok(()));
        let mut suite = building();
        simulator.take(&mut suite).unwrap();
        assert_eq!(suite.name, "building@mujoco");
        assert!(suite.trials.iter().all(|trial| trial.elsewhere.is_some()));
        let mut slow = building();
        slow.trials[0].thinking_scans = 2;
        let why = simulator.take(&mut slow).unwrap_err();
        assert!(
            why.ends_with("expected no core that takes longer than a scan in mujoco, found one"),
            "{why}"
        );
        assert!(slow.trials[0].elsewhere.is_none());
    }

    /// A driver that fails is not a robot that fails.
    #[test]
    fn an_error_of_the_simulator_ends_the_experiment() {
        let broken = Elsewhere::new("mujoco", 7, |_, _, _| Err("no such geom".into()));
        let mut suite = building();
        broken.take(&mut suite).unwrap();
        let error = run::drive(&suite.trials[0], "outline", 1).unwrap_err().to_string();
        assert!(error.contains(&suite.trials[0].name) && error.contains("no such geom"), "{error}");
    }
}
