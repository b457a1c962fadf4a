//! Finds suites by name.
//!
//! Some suites need data that are not part of the repository. Without the data, loading them fails with an error that names the
//! missing data. If a suite can do without a part of its data, it leaves that part out with a notice.

use sketchnav_corridor::mission::METHODS;
use sketchnav_sketch::method::Method;

use crate::error::EvalError;
use crate::experiments::suite::{Folders, Suite};
use crate::experiments::{
    ablation, calibration, corridor, corridor_cost, corridor_published, deformed, kidnapped, land, landmarks,
    learned, look_ahead, people, protocol, routes, sensitivity, studies, unmarked, witnesses,
};

/// A function that loads a suite.
type Loader = fn(&Folders) -> Result<Suite, EvalError>;

const OUTLINE: &str = Method::Outline.word();
const BEAM: &str = Method::Beam.word();
/// Methods that rely on pairs of markers. The rate of pairs only affects these.
const BY_PAIRS: [&str; 4] = [METHODS[1], METHODS[2], METHODS[3], METHODS[4]];
/// Methods of the thesis, and our own method that uses its rules.
const RULES: [&str; 3] = [METHODS[1], METHODS[2], METHODS[4]];
const PAPER: &str = Method::Boniardi2015.word();

/// All suites with their loaders. To add one, add a line here and a module for it. The last column lists methods for suites that
/// compare several, or that use a method other than the first of their navigator, when all suites are driven.
const SUITES: [(&str, Loader, &[&str]); 50] = [
    ("ablation", ablation::suite, &[]),
    ("building-079", protocol::building_079, &[OUTLINE, PAPER]),
    ("building-079-kidnapped", |folders| kidnapped::of(protocol::building_079(folders)?), &[]),
    ("building-079-unmarked", |folders| unmarked::of(protocol::building_079(folders)?), &[]),
    ("building", protocol::building, &[OUTLINE, PAPER]),
    ("building-kidnapped", |folders| kidnapped::of(protocol::building(folders)?), &[]),
    ("building-unmarked", |folders| unmarked::of(protocol::building(folders)?), &[]),
    ("calibrate-boniardi-2015", calibration::boniardi_2015, &[]),
    ("corridor", corridor::suite, &METHODS),
    ("corridor-cost", corridor_cost::suite, &[]),
    ("corridor-person", corridor::person, &[]),
    ("corridor-published", corridor_published::suite, &METHODS),
    ("corridor-published-10hz", corridor_published::at_10_hz, &BY_PAIRS),
    ("corridor-turns", corridor::turns, &[]),
    ("corridor-unknowns", corridor_published::unknowns, &RULES),
    ("deformed", deformed::suite, &[OUTLINE, BEAM, PAPER]),
    ("directions-buildings", land::buildings::suite, &[]),
    ("directions-choice", land::buildings::choice, &[]),
    ("directions-land", land::suite, &[]),
    ("floors-unmarked", |folders| unmarked::of(witnesses::floors(folders)?), &[]),
    ("laboratory", protocol::laboratory, &[OUTLINE, PAPER]),
    ("laboratory-unmarked", |folders| unmarked::of(protocol::laboratory(folders)?), &[]),
    ("landmark-answers", landmarks::answered, &[]),
    ("landmark-choice", landmarks::choice, &[]),
    ("landmark-deformed", landmarks::deformed, &[]),
    ("landmark-features", landmarks::features, &[]),
    ("landmark-isolation", landmarks::isolation::suite, &[]),
    ("landmark-labels", landmarks::labels, &[]),
    ("landmark-published", landmarks::thesis::suite, &[]),
    ("landmark-published-degrees", landmarks::thesis::degrees, &[]),
    ("landmark-scenes", landmarks::scenes, &[]),
    ("landmark-sites", landmarks::sites, &[]),
    ("landmark-unknowns", landmarks::unknowns::suite, &[]),
    ("learned-building", |folders| learned::of(protocol::building(folders)?), &[]),
    ("learned-building-079", |folders| learned::of(protocol::building_079(folders)?), &[]),
    ("learned-laboratory", |folders| learned::of(protocol::laboratory(folders)?), &[]),
    ("learned-people", |folders| learned::some_of(people::suite(folders)?), &[]),
    ("learned-people-exam", |folders| learned::some_of(people::exam(folders)?), &[]),
    ("people", people::suite, &[OUTLINE, BEAM, PAPER]),
    ("people-answers", people::answered, &[]),
    ("people-exam", people::exam, &[OUTLINE, BEAM, PAPER]),
    ("people-exam-answers", people::exam_answered, &[]),
    ("people-exam-kidnapped", |folders| kidnapped::of(people::exam(folders)?), &[]),
    ("people-exam-unmarked", |folders| unmarked::of(people::exam(folders)?), &[]),
    ("people-kidnapped", |folders| kidnapped::of(people::suite(folders)?), &[]),
    ("people-unmarked", |folders| unmarked::of(people::suite(folders)?), &[]),
    ("routes", routes::suite, &[OUTLINE, PAPER]),
    ("routes-look-ahead", look_ahead::suite, &[OUTLINE, PAPER]),
    ("sensitivity", sensitivity::suite, &[BEAM]),
    ("witnesses", witnesses::suite, &[OUTLINE]),
];

/// Returns the names of all suites.
pub fn names() -> impl Iterator<Item = &'static str> {
    SUITES.iter().map(|(name, ..)| *name)
}

/// Returns the methods to use for a suite when all suites are driven, or none if the first method of its navigator is enough.
pub fn compared(name: &str) -> &'static [&'static str] {
    SUITES.iter().find(|(known, ..)| *known == name).map_or(&[], |(_, _, methods)| *methods)
}

/// Loads the suite with the given name.
///
/// # Errors
/// [`EvalError`] if the name is unknown, if data are missing, or if a file cannot be read.
pub fn load(name: &str, folders: &Folders) -> Result<Suite, EvalError> {
    let Some((name, load, _)) = SUITES.iter().find(|(known, ..)| *known == name) else {
        let known = names().chain(studies::names()).collect::<Vec<_>>().join(", ");
        return Err(EvalError::Suite { found: name.to_owned(), known });
    };
    let suite = load(&Folders { suite: name, ..folders.clone() })?;
    Ok(Suite { name: (*name).to_owned(), ..suite })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::deformed;

    /// Returns a suite with four trials for each of two drawings.
    fn suite() -> Suite {
        let site = deformed::shipped(&Folders::of_checkout()).unwrap().remove(1);
        let drawings = [0.0, 0.5].map(|degree| site.trials(degree, 1).unwrap());
        Suite { trials: drawings.concat(), ..Suite::default() }
    }

    fn names(suite: &Suite) -> Vec<String> {
        suite.trials.iter().map(|trial| trial.name.clone()).collect()
    }

    #[test]
    fn a_sample_is_spread_over_the_drawings_and_reproducible() {
        let all = names(&suite());
        assert_eq!(all.len(), 8);
        for (count, kept) in [
            (0, vec![]),
            (1, vec![2, 6]),
            (2, vec![1, 3, 5, 7]),
            (4, (0..8).collect::<Vec<_>>()),
            (99, (0..8).collect()),
        ] {
            let mut sampled = suite();
            sampled.sample(count);
            let kept: Vec<_> = kept.into_iter().map(|i: usize| all[i].clone()).collect();
            assert_eq!(names(&sampled), kept, "{count}");
        }
    }

    #[test]
    fn the_error_for_an_unknown_suite_lists_all_suites() {
        let error = load("poeple", &Folders::of_checkout()).unwrap_err().to_string();
        assert!(super::names().all(|name| error.contains(name)), "{error}");
    }

    #[test]
    fn the_columns_of_a_published_table_are_added_up() {
        let table = protocol::laboratory(&Folders::of_checkout()).unwrap().papers();
        let found: Vec<_> = table.iter().map(|p| (p.name.as_str(), p.reached, p.attempts)).collect();
        assert_eq!(found, [("paper A", 55, 70), ("paper B", 57, 70)]);
    }
}
