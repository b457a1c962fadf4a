//! Third-party simulators, which can replace this project's world in trials.

use std::fmt;
use std::sync::Arc;

use sketchnav_corridor::mission::{CorridorMission, Method};
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

/// Drives a run of a trial, and passes all its messages to a [`Tap`], in order.
type Drive = dyn Fn(&Trial, &RunConfig, &mut dyn Tap) -> Result<(), StageError> + Send + Sync;

/// A simulator that runs trials instead of this project's own world.
#[derive(Clone)]
pub struct Elsewhere {
    simulator: &'static str,
    driver: u32,
    drive: Arc<Drive>,
}

impl Elsewhere {
    /// Creates an entry for a simulator listed in [`SIMULATORS`], in which `drive` drives. `driver` is a checksum of its driver,
    /// which determines the outcomes as much as the trials do.
    pub fn new(
        simulator: &'static str,
        driver: u32,
        drive: impl Fn(&Trial, &RunConfig, &mut dyn Tap) -> Result<(), StageError> + Send + Sync + 'static,
    ) -> Self {
        Self { simulator, driver, drive: Arc::new(drive) }
    }

    /// Drives a run of a trial, and passes all its messages to `tap`.
    ///
    /// # Errors
    /// Any error of the drive.
    pub fn drive(&self, trial: &Trial, run: &RunConfig, tap: &mut dyn Tap) -> Result<(), StageError> {
        (self.drive)(trial, run, tap)
    }

    /// Prepares all trials of a suite to be driven by these methods in the simulator.
    ///
    /// # Errors
    /// A description of the first trial that needs something the simulator lacks.
    pub fn take(&self, suite: &mut Suite, methods: &[String]) -> Result<(), String> {
        if let Some((trial, what)) =
            suite.trials.iter().find_map(|trial| Some((trial, lacks(trial, methods)?)))
        {
            let (name, simulator) = (&trial.name, self.simulator);
            return Err(format!(
                "trial {name}: expected only what {simulator} simulates (walls, furniture, a laser, odometry), found {what}"
            ));
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

/// Returns something that the trial requires and only the project's own world has, if there is such a thing. People and markers
/// that a trial adds to its floor are essential to it, whereas those of the floor can be left out, unless the robot drives by them.
fn lacks(trial: &Trial, methods: &[String]) -> Option<String> {
    let world = &trial.mission.world;
    [
        (trial.person.is_some(), "a person who answers the robot"),
        (trial.thinking_scans > 0, "a core that takes longer than a scan"),
        (trial.asks_rooms, "a map of the drive"),
        (trial.series.is_some(), "a drive that others are learned from"),
        (trial.robot.laser.is_none(), "a robot without a laser"),
        (world.plane.is_some(), "a plane of dots"),
        (!world.person.is_empty(), "a person who walks"),
        (!world.carry.is_empty(), "somebody who carries the robot"),
        (!world.marker.is_empty(), "markers on the walls"),
    ]
    .into_iter()
    .find_map(|(needs, what)| needs.then(|| what.to_owned()))
    .or_else(|| methods.iter().find_map(|method| needs_markers(trial, method)))
}

/// Returns why a drive requires the markers of a corridor, if it does.
fn needs_markers(trial: &Trial, method: &str) -> Option<String> {
    let run = trial.is_corridor().then(|| trial.run(method, 1, 0).ok()).flatten()?;
    let mission = CorridorMission::of(&run.mission).ok().filter(CorridorMission::needs_markers)?;
    Some(match mission.method {
        Method::Corridor => "a task that ends at a marker".to_owned(),
        method => format!("the method {}, which drives by markers", method.word()),
    })
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

    fn methods(words: &[&str]) -> Vec<String> {
        words.iter().map(|&word| word.to_owned()).collect()
    }

    #[test]
    fn trials_that_need_what_simulators_lack_are_refused_with_the_reason() {
        let simulator = Elsewhere::new("mujoco", 7, |_, _, _| Ok(()));
        let mut suite = building();
        simulator.take(&mut suite, &methods(&["outline"])).unwrap();
        assert_eq!(suite.name, "building@mujoco");
        assert!(suite.trials.iter().all(|trial| trial.elsewhere.is_some()));
        let mut slow = building();
        slow.trials[0].thinking_scans = 2;
        let why = simulator.take(&mut slow, &methods(&["outline"])).unwrap_err();
        let expected = "expected only what mujoco simulates (walls, furniture, a laser, odometry)";
        assert!(why.ends_with(&format!("{expected}, found a core that takes longer than a scan")), "{why}");
        assert!(slow.trials[0].elsewhere.is_none());
        // Without being carried, every robot would arrive.
        let mut kidnapped = suites::load("building-kidnapped", &Folders::of_checkout()).unwrap();
        let why = simulator.take(&mut kidnapped, &methods(&["outline"])).unwrap_err();
        assert!(why.ends_with("found somebody who carries the robot"), "{why}");
    }

    /// Regression test: a robot that waited for markers that the simulator does not provide ended as lost.
    #[test]
    fn in_corridors_only_what_drives_by_the_laser_is_driven() {
        let simulator = Elsewhere::new("irsim", 7, |_, _, _| Ok(()));
        let load = |name| suites::load(name, &Folders::of_checkout()).unwrap();
        simulator.take(&mut load("corridor"), &methods(&["corridor"])).unwrap();
        for (suite, by, found) in [
            ("corridor", ["corridor", "qtc-b"], "the method qtc-b, which drives by markers"),
            ("corridor-turns", ["corridor"; 2], "a task that ends at a marker"),
            ("corridor-published", ["corridor"; 2], "a robot without a laser"),
            ("landmark-scenes", ["chronis-2007"; 2], "a robot without a laser"),
        ] {
            let why = simulator.take(&mut load(suite), &methods(&by)).unwrap_err();
            assert!(why.ends_with(&format!("found {found}")), "{suite}: {why}");
        }
    }

    /// An error in the driver does not count as a failure of the robot.
    #[test]
    fn an_error_of_the_simulator_ends_the_experiment() {
        let broken = Elsewhere::new("mujoco", 7, |_, _, _| Err("no such geom".into()));
        let mut suite = building();
        broken.take(&mut suite, &methods(&["outline"])).unwrap();
        let error = run::drive(&suite.trials[0], "outline", 1).unwrap_err().to_string();
        assert!(error.contains(&suite.trials[0].name) && error.contains("no such geom"), "{error}");
    }
}
