//! The `learned-…` suites drive each series of tasks of another suite by the drawing, and then in the [map
//! learned](sketchnav_sketch::learned) on that drive, without marking the start. Two drives begin anywhere in the map, with any
//! heading, and consist of those tasks that the robot accepts there. In the last drive, the robot has not been carried: it stands
//! where the first drive ended, and drives back to where that one began. [`series`] drives them.

pub mod cause;
pub mod series;
mod tables;

use std::sync::Arc;

use sketchnav_sim::SimError;

use crate::error::EvalError;
use crate::experiments::ground::Ground;
use crate::experiments::protocol;
use crate::experiments::suite::{Group, Suite};
use crate::experiments::trial::Trial;
use series::{First, Later, Series};

/// The drives of a series, each with its name in tables and a description.
const DRIVES: [(&str, &str); 4] = [
    ("first", "first drives, by the drawing"),
    ("second", "second drives, in what was learned"),
    ("third", "third drives, from other starts"),
    ("back", "drives back, from where the first ones ended"),
];
/// Number of the drive back.
const BACK: usize = 3;
/// Number of series for each drawing by people, spread evenly over those of the suite.
const SERIES_OF_DRAWING: usize = 8;

/// Returns the suite whose series consist of some of the trials of `suite`, spread evenly over its drawings.
///
/// # Errors
/// Same as [`of`].
pub fn some_of(mut suite: Suite) -> Result<Suite, EvalError> {
    suite.sample(SERIES_OF_DRAWING);
    of(suite)
}

/// Returns the suite whose series consist of the trials of `suite`.
///
/// # Errors
/// [`EvalError`] if a mission of the suite is invalid, or if its world cannot be read.
pub fn of(suite: Suite) -> Result<Suite, EvalError> {
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
            "{} Each is driven by the drawing first, then twice in what was learned, without a mark and from anywhere in it, and \
             then back from where the first drive ended.",
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

/// Returns the drives of a series. The first one is `trial`, except that no pose is set again after a failure.
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
        let kind = if number == BACK { Later::Stayed } else { Later::Carried };
        Trial { series: Some(Series { first: first.clone(), drive: number, kind }), ..base }
    };
    Ok(DRIVES.into_iter().enumerate().map(drive).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::Kind;
    use crate::experiments::run;
    use crate::experiments::suite::Folders;
    use series::Search;

    /// Returns the drives of a series with two tasks in the laboratory. The first drive has no time for the second task, whose goal
    /// is in another room.
    fn drives() -> Vec<Trial> {
        let mut trial = protocol::laboratory(&Folders::of_checkout()).unwrap().trials.swap_remove(0);
        trial.mission.task.truncate(2);
        trial.mission.task[1].time_limit_s = 0.5;
        let ground = Arc::new(ground_of(&trial).unwrap());
        series_of(&trial, ground).unwrap()
    }

    #[test]
    fn later_drives_start_elsewhere_and_have_the_tasks_that_the_robot_accepts() {
        let trials = drives();
        let [first, second, third] = [0, 1, 2].map(|k: usize| run::run(&trials[k], "outline", 1, 7).unwrap());
        let kinds = |outcomes: &[crate::experiments::TaskOutcome]| {
            outcomes.iter().map(|ended| ended.kind).collect::<Vec<_>>()
        };
        assert_eq!(kinds(&first), [Kind::Reached, Kind::TimedOut], "{first:?}");
        let known: Vec<_> = first.iter().map(|ended| ended.in_series.unwrap()).collect();
        assert!(known[0].is_seen && known[0].is_accepted && known[0].search.is_none(), "{known:?}");
        for later in [&second, &third] {
            let accepted = known.iter().filter(|known| known.is_accepted).count();
            assert_eq!(later.len(), accepted, "{later:?}");
            assert_eq!(later[0].kind, Kind::Reached, "{later:?}");
            assert!(matches!(later[0].in_series.unwrap().search, Some(Search::Found(_))), "{later:?}");
        }
        let start = |k: usize| trials[k].prepared("outline", 7).unwrap().mission.start.clone();
        assert!(start(1) != start(2) && start(1) == start(1));
        let back = run::run(&trials[3], "outline", 1, 7).unwrap();
        assert_eq!(kinds(&back), [Kind::Reached], "{back:?}");
        let (began, sought) =
            (start(3), trials[3].prepared("outline", 7).unwrap().mission.task[0].there.middle());
        assert_eq!(sought, trials[0].mission.start.world);
        assert!((began.world[0] - sought[0]).hypot(began.world[1] - sought[1]) > 1.0, "{began:?}");
        assert!(trials[1].prepared("outline", 7).unwrap().mission.navigator.given.get("start").is_none());
        let all = [first, second, third].concat();
        let sections = tables::sections(&all);
        assert!(sections[0].table.rows[0][1].starts_with("100.0 %"), "{sections:?}");
    }

    #[test]
    fn each_drawing_has_a_line_for_each_drive() {
        let suite = of(protocol::laboratory(&Folders::of_checkout()).unwrap()).unwrap();
        assert_eq!(
            suite.drawings(),
            ["a first", "a second", "a third", "a back", "b first", "b second", "b third", "b back"]
        );
        assert_eq!(suite.groups[1].lines, ["a second", "b second"]);
    }
}
