//! Finds the goal that a person names while a mission runs: a task or, for a navigator that knows places, a place that is no
//! task's goal.

use sketchnav_schemas::named::{self, NameError};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Files, FoundPlace, StageError};

/// What a person's words refer to.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// The task with this index, from 0.
    Task(usize),
    /// A place.
    Place(FoundPlace),
}

/// Returns the task with this name, or else the one whose goal is the place with this name, or else the place itself.
///
/// # Errors
/// [`NameError`] if no task has the name and the navigator knows no places, or if several have it. Otherwise the error of the
/// navigator, which lists the names that there are.
pub fn find(run: &RunConfig, files: &Files<'_>, name: &str) -> Result<Goal, StageError> {
    let place = crate::of(&run.mission)?.place;
    match (named::task(&run.mission, name), place) {
        (Ok(task), _) => Ok(Goal::Task(task)),
        (Err(NameError::Unknown { .. }), Some(place)) => place(run, files, name).map(Goal::Place),
        (Err(error), _) => Err(error.into()),
    }
}
