//! Tables of journeys over many worlds: figures 26 and 28, counts of the six kinds, and stated probabilities beside the journeys
//! that arrive.
//!
//! The input of a table is the attempts of all its cases in each world, in the order of the cases.

use sketchnav_schemas::statistics::mean;

use super::{Attempt, Case, Choice, Setting, Table};
use crate::arrival::{Effort, Tally};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Window;
use crate::path::Objective;
use crate::plan::Verify;

/// The effort of the map-maker in comparisons of many methods.
const QUICK: Effort = Effort { trials: 64, trial_journeys: 64, journeys: 128 };
/// Number of journeys over each world in comparisons of methods.
const JOURNEYS: u64 = 5;
/// Number of journeys over each world in checks of stated probabilities.
const CHECKS: u64 = 40;

/// Position errors for which stated probabilities are checked, in millimetres.
const SIGMAS: [f64; 5] = [1.0, 2.0, 3.0, 5.0, 8.0];

/// Names of the methods whose stated probabilities are checked.
const SIMULATED: &str = "simulated";
const BRANCHING: &str = "branching";

/// The outcomes of journeys over many worlds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Success {
    /// The counts of all journeys.
    pub tally: Tally,
    /// Fraction of journeys that arrived, for each world with a plan. Journeys over the same world are not independent trials.
    pub arrived: Vec<f64>,
    /// Number of worlds in which a path of isolated landmarks joins the start and the goal.
    pub worlds: u32,
    /// Number of these worlds for which a plan was found.
    pub planned: u32,
    /// Number of entries of each map or, without a map, of landmarks in the list.
    pub entries: Vec<f64>,
    /// For each world with a plan that states a probability of arrival: that probability, and the journeys over it.
    pub stated: Vec<(f64, Tally)>,
}

impl Success {
    /// Counts the attempts of one case.
    pub fn of<'a>(attempts: impl IntoIterator<Item = &'a Attempt>) -> Self {
        let mut result = Self::default();
        attempts.into_iter().for_each(|attempt| result.add(attempt));
        result
    }

    fn add(&mut self, attempt: &Attempt) {
        self.worlds += u32::from(*attempt != Attempt::Unjoined);
        let Attempt::Tried { entries, stated, tally } = attempt else { return };
        self.planned += 1;
        self.entries.push(*entries as f64);
        self.arrived.push(share_of(tally));
        self.stated.extend(stated.map(|stated| (stated, *tally)));
        self.tally.merge(tally);
    }
}

/// Returns the fraction of journeys that arrived.
fn share_of(tally: &Tally) -> f64 {
    f64::from(tally.arrivals()) / f64::from(tally.journeys().max(1))
}

/// The methods to compare, with their names.
fn methods() -> [(&'static str, Choice); 9] {
    let paper = |objective, verify| Choice::Paper(objective, verify);
    [
        ("shortest", paper(Objective::SHORTEST, Verify::Nothing)),
        ("fewest entries", paper(Objective::FEWEST_ENTRIES, Verify::Nothing)),
        ("most reliable", paper(Objective::MOST_RELIABLE, Verify::Nothing)),
        ("D/R", paper(Objective::Ratio, Verify::Nothing)),
        ("D/R, recovery", paper(Objective::Ratio, Verify::Recoverable)),
        ("D/R, detection", paper(Objective::Ratio, Verify::Detectable)),
        (SIMULATED, Choice::Simulated(QUICK)),
        (BRANCHING, Choice::Branching(QUICK)),
        ("belief", Choice::Belief(QUICK)),
    ]
}

/// Returns the cases that compare all methods by the error of positions, in millimetres.
pub fn costs(sigmas: &[f64], looks: u8) -> Result<Vec<Case>, Error> {
    let mut cases = Vec::new();
    for &sigma in sigmas {
        let setting = Setting { looks, ..Setting::of_sigma(sigma)? };
        cases.extend(methods().map(|(method, choice)| Case {
            name: format!("{sigma} mm, {method}"),
            method,
            choice,
            setting,
            journeys: JOURNEYS,
        }));
    }
    Ok(cases)
}

/// Returns the cases that compare words and windows, for the paper's D/R path without verification.
pub fn words_and_windows(sigma: f64) -> Result<Vec<Case>, Error> {
    use Descriptor::{Isolated, IsolatedPair, Obvious, PlusPair};
    let setting = Setting::of_sigma(sigma)?;
    let choice = Choice::Paper(Objective::Ratio, Verify::Nothing);
    let case = |name: String, setting| Case { name, method: "D/R", choice, setting, journeys: JOURNEYS };
    let all: &'static [Descriptor] = &[Isolated, IsolatedPair, PlusPair];
    let words =
        [("Obvious", &[Obvious][..]), ("Isol", &[Isolated]), ("IsolPair", &[IsolatedPair]), ("all", all)];
    let mut cases: Vec<_> =
        words.map(|(name, words)| case(name.to_owned(), Setting { words, ..setting })).into();
    for side in [70.0, 85.0, 100.0, 125.0, 150.0] {
        let window = Window::new(side, 0.15 * side)?;
        cases.push(case(format!("Isol, window {side} mm"), Setting { window, ..setting }));
    }
    Ok(cases)
}

/// Returns the cases for checks of stated probabilities: the methods that plan maps by simulation, for five position errors, and
/// one of them with all errors at once.
pub fn calibration(effort: Effort) -> Result<Vec<Case>, Error> {
    let mut cases = Vec::new();
    for (method, choice) in [(SIMULATED, Choice::Simulated(effort)), (BRANCHING, Choice::Branching(effort))] {
        for sigma in SIGMAS {
            let name = format!("{sigma} mm, {method}");
            cases.push(Case { name, method, choice, setting: Setting::of_sigma(sigma)?, journeys: CHECKS });
        }
    }
    cases.push(Case {
        name: "all errors, simulated".into(),
        method: "all errors, simulated",
        choice: Choice::Simulated(effort),
        setting: Setting::of_all_errors()?,
        journeys: CHECKS,
    });
    Ok(cases)
}

const HEAD: [&str; 12] = [
    "choice",
    "planned",
    "success",
    "low",
    "high",
    "direct",
    "recovered",
    "unaware",
    "not located",
    "lost",
    "astray",
    "journeys",
];

/// Returns each case with its attempts in all worlds.
pub fn by_case<'a>(cases: &'a [Case], worlds: &[Vec<Attempt>]) -> Vec<(&'a Case, Success)> {
    let of = |number: usize| Success::of(worlds.iter().filter_map(|attempts| attempts.get(number)));
    cases.iter().enumerate().map(|(number, case)| (case, of(number))).collect()
}

/// Returns a table with a row for each case, in percent: the fraction of worlds with a plan, the fraction of journeys that arrive
/// with Student's confidence interval over the worlds, and the fractions of the six kinds.
pub fn success(title: &str, cases: &[(&Case, Success)]) -> Table {
    let mut table = Table::new(title, &HEAD);
    let share = |count: u32, of: u32| 100.0 * f64::from(count) / f64::from(of.max(1));
    for (case, result) in cases {
        let (tally, journeys) = (&result.tally, result.tally.journeys());
        let [arrived, low, high, _] = Table::mean_of(&result.arrived).map(|share| 100.0 * share);
        let mut values = vec![share(result.planned, result.worlds), arrived, low.max(0.0), high.min(100.0)];
        values.extend(tally.counts.map(|count| share(count, journeys)));
        values.push(f64::from(journeys));
        table.row(&case.name, &values);
    }
    table
}

/// Returns a table with a row for each method and tenth of the stated probability, and one for all of a method, in percent: the
/// mean of the stated probabilities, and the fraction of journeys that arrive with its confidence interval over the worlds.
pub fn stated_and_reached(title: &str, cases: &[(&Case, Success)]) -> Table {
    let head = ["choice, stated, %", "mean stated", "reached", "low", "high", "worlds", "journeys"];
    let mut table = Table::new(title, &head);
    let mut methods: Vec<&str> = Vec::new();
    for (case, _) in cases {
        if !methods.contains(&case.method) {
            methods.push(case.method);
        }
    }
    for method in methods {
        let of_method = cases.iter().filter(|(case, _)| case.method == method);
        let all: Vec<_> = of_method.flat_map(|(_, result)| &result.stated).collect();
        let mut row = |name: String, stated: &[&(f64, Tally)]| {
            if stated.is_empty() {
                return;
            }
            let said: Vec<f64> = stated.iter().map(|(said, _)| *said).collect();
            let reached: Vec<f64> = stated.iter().map(|(_, tally)| share_of(tally)).collect();
            let journeys: u32 = stated.iter().map(|(_, tally)| tally.journeys()).sum();
            let [arrived, low, high, worlds] = Table::mean_of(&reached);
            let shares = [mean(&said), arrived, low.max(0.0), high.min(1.0)].map(|share| 100.0 * share);
            table.row(name, &[&shares[..], &[worlds, f64::from(journeys)]].concat());
        };
        for tenth in 0..10 {
            let of_tenth: Vec<_> = all.iter().copied().filter(|(said, _)| tenth_of(*said) == tenth).collect();
            row(format!("{method}, {}-{}", tenth * 10, tenth * 10 + 10), &of_tenth);
        }
        row(format!("{method}, all"), &all);
    }
    table
}

/// Returns the tenth that a probability is in, from 0 to 9.
fn tenth_of(probability: f64) -> usize {
    ((probability * 10.0) as usize).min(9)
}
