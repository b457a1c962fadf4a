//! The world of a mission in either of its two forms, as hosts store it. The table `[world]` of the mission determines the form.

use serde::{Deserialize, Serialize};
use sketchnav_files::Files;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::{GroundTruth, VelocityCommand};
use sketchnav_schemas::mission::carry_key;
use sketchnav_schemas::run::RunConfig;

use crate::error::SimError;
use crate::files;
use crate::floor::Floor;
use crate::plane::DotPlane;
use crate::simulation::{Senses, Simulation};

/// A simulated world.
#[derive(Serialize, Deserialize)]
pub enum World {
    /// A floor with walls.
    Floor(Box<Floor>),
    /// A plane of dots.
    Plane(Box<DotPlane>),
}

impl World {
    /// Creates the world that a run describes, before its first instant. Its files are read from `files`.
    ///
    /// # Errors
    /// [`SimError`], which gives the file, the key or the position.
    pub fn of_run(run: &RunConfig, files: &dyn Files) -> Result<Self, SimError> {
        let (source, start) = (&run.mission.world, &run.mission.start);
        let pose = Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians());
        if let Some(plane) = &source.plane {
            let description = files::plane_in(files, plane.as_ref())?;
            let plane = DotPlane::new(description, &run.robot, pose, run.seed)?;
            return Ok(Self::Plane(Box::new(plane)));
        }
        let description = files::world_in(files, source)?;
        description.check_places(&run.mission.task)?;
        for (number, carry) in (1..).zip(&source.carry) {
            description.check_within(&format!("{}.to", carry_key(number)), carry.to)?;
        }
        let mut floor = Floor::new(description, &run.robot, pose, run.seed)?;
        floor.carry(&source.carry, &run.robot)?;
        Ok(Self::Floor(Box::new(floor)))
    }
}

/// Evaluates the same expression for either form.
macro_rules! either {
    ($world:expr, $form:ident => $does:expr) => {
        match $world {
            World::Floor($form) => $does,
            World::Plane($form) => $does,
        }
    };
}

impl Simulation for World {
    fn step(&mut self, command: Option<&VelocityCommand>) {
        either!(self, form => form.step(command));
    }

    fn sense<S: Senses>(&self, senses: &mut S) -> Result<(), S::Error> {
        either!(self, form => form.sense(senses))
    }

    fn fill_truth(&self, truth: &mut GroundTruth) {
        either!(self, form => form.fill_truth(truth));
    }

    fn steps(&self) -> u64 {
        either!(self, form => form.steps())
    }

    fn period_ns(&self) -> u64 {
        either!(self, form => form.period_ns())
    }
}
