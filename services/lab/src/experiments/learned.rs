//! The suites `learned-…` drive each series of tasks of another suite three times: first by the drawing, then twice in [what was
//! learned](sketchnav_sketch::learned) on the first drive. The later drives begin anywhere in what the robot saw, with any heading
//! and without a mark, and consist of those tasks that the robot accepts there.
//!
//! - [`series`] drives them, and [`tables`] compares them.

pub mod series;
mod tables;

use std::sync::Arc;

use sketchnav_sim::SimError;

use crate::error::EvalError;
use crate::experiments::ground::Ground;
use crate::experiments::suite::{Folders, Group, Suite};
use crate::experiments::trial::Trial;
use crate::experiments::{people, protocol};
use series::{First, Series};

/// The drives of a series: the word for each in tables, and what it is.
const DRIVES: [(&str, &str); 3] = [
    ("first", "first drives, by the drawing"),
    ("second", "second drives, in what was learned"),
    ("third", "third drives, from other starts"),
];
/// Number of series of each drawing that people made, spread evenly over those of the suite.
const SERIES_OF_DRAWING: usize = 8;

/// Loads the drives of [`protocol::building`].
///
/// # Errors
/// Those of the suite.
pub fn building(folders: &Folders) -> Result<Suite, EvalError> {
    of(protocol::building(folders)?)
}

/// Loads the drives of [`protocol::building_079`].
///
/// # Errors
/// Those of the suite.
pub fn building_079(folders: &Folders) -> Result<Suite, EvalError> {
    of(protocol::building_079(folders)?)
}

/// Loads the drives of [`protocol::laboratory`].
///
/// # Errors
/// Those of the suite.
pub fn laboratory(folders: &Folders) -> Result<Suite, EvalError> {
    of(protocol::laboratory(folders)?)
}

/// Loads some of the drives of [`people::suite`].
///
/// # Errors
/// Those of the suite.
pub fn people(folders: &Folders) -> Result<Suite, EvalError> {
    some_of(people::suite(folders)?)
}

/// Loads some of the drives of [`people::exam`].
///
/// # Errors
/// Those of the suite.
pub fn people_exam(folders: &Folders) -> Result<Suite, EvalError> {
    some_of(people::exam(folders)?)
}

fn some_of(mut suite: Suite) -> Result<Suite, EvalError> {
    suite.sample(SERIES_OF_DRAWING);
    of(suite)
}

/// Returns the suite whose series consist of the trials of `suite`.
fn of(suite: Suite) -> Result<Suite, EvalError> {
    let mut trials = Vec::new();
    let mut ground: Option<(&Trial, Arc<Ground>)> = None;
    for trial in &suite.trials {
        let is_same = |(other, _): &&(&Trial, Arc<Ground>)| {
            (&other.mission.world, other.robot.radius_m) == (&trial.mission.world, trial.robot.radius_m)
        };
        let shared = match ground.as_ref().filter(is_same) {
            Some((_, shared)) => shared.clone(),
            None => Arc::new(ground_of(trial)?),
        };
        ground = Some((trial, shared.clone()));
        trials.extend(series_of(trial, shared)?);
    }
    let lines = |word: &str| suite.drawings().iter().map(|drawing| line(drawing, word)).collect();
    Ok(Suite {
        title: format!(
            "{} Each is driven by the drawing first, and then twice in what was learned, without a mark and from anywhere in it.",
            suite.title
        ),
        notices: suite.notices.clone(),
        trials,
        lines: Some("drawing and drive"),
        groups: DRIVES.map(|(word, name)| Group { name: name.to_owned(), lines: lines(word) }).into(),
        sections: Some(tables::sections),
        repetitions: 1,
        ..Suite::default()
    })
}

fn line(drawing: &str, word: &str) -> String {
    format!("{drawing} {word}")
}

fn ground_of(trial: &Trial) -> Result<Ground, EvalError> {
    let world = sketchnav_sim::files::world(&trial.mission.world)?;
    protocol::ground(&world, &trial.mission, &trial.robot)
}

/// Returns the drives of a series. Its first one is `trial`, in which no pose is given again after a failure.
fn series_of(trial: &Trial, ground: Arc<Ground>) -> Result<Vec<Trial>, EvalError> {
    let world = sketchnav_sim::files::world(&trial.mission.world)
        .map_err(|error: SimError| EvalError::from(error))?;
    let drawing = trial.drawing.clone();
    let named = |word: &str| Trial {
        name: format!("{}/{word}", trial.name),
        drawing: line(&drawing, word),
        variant_of: Some(trial.name.clone()),
        cluster: Some(trial.cluster.clone().unwrap_or_else(|| drawing.clone())),
        ..trial.clone()
    };
    let mut by_drawing = named(DRIVES[0].0);
    by_drawing.is_learned_from = true;
    if let Some(sheet) = &mut by_drawing.sheet {
        sheet.restarts.clear();
    }
    let people = world.people.iter().filter_map(|person| person.waypoints.first().copied()).collect();
    let first = Arc::new(First::new(by_drawing.clone(), ground, people));
    let drive = |(number, (word, _)): (usize, (&str, &str))| {
        let base = if number == 0 { by_drawing.clone() } else { Trial { sheet: None, ..named(word) } };
        Trial { series: Some(Series { first: first.clone(), drive: number }), ..base }
    };
    Ok(DRIVES.into_iter().enumerate().map(drive).collect())
}
