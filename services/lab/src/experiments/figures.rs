//! The stored results of experiments, and the markers in pages that are filled in from them.
//!
//! A marker is a pair of HTML comments, which readers of the page do not see. The first one specifies the text between them: the
//! experiment, the method, the form, and, unless the marker shows the whole experiment, the lines of the experiment's table.
//!
//! ```text
//! <!--= people outline share-->97.5 % (95 to 99) of 320<!--=-->
//! <!--= deformed outline percent 0.5; 1-->100 %, 82.1 %<!--=-->
//! <!--= directions-success 1 percent success: 5 mm, D/R-->28.0 % (25.1 to 31.0) of 925<!--=-->
//! <!--= directions-paths 1 number value: 15: D of the D/R path over the shortest-->1.03 (1.01 to 1.05) of 30<!--=-->
//! <!--= directions-calibration 1 table--> … the first table of the study … <!--=-->
//! <!--= experiments--> … a table of all experiments with their commands … <!--=-->
//! <!--= corridor-unknowns lines--> … a table with a row for each line of the experiment's own … <!--=-->
//! <!--= corridor-published verdicts--> … its conditions beside those of the thesis … <!--=-->
//! <!--= corridor-published notices--> … what the reader of its figures must know … <!--=-->
//! <!--= routes boniardi-2015 share-on-sketch-->60.0 % (42 to 78 over 25 drawings) of 100<!--=-->
//! <!--= routes groups--> … a table with a row for each group of the experiment's lines … <!--=-->
//! <!--= witnesses section 1-->… the first section that the suite reports in addition to its tables …<!--=-->
//! <!--= building@mujoco outline of a; b-->90 of 90, 90 of 90<!--=-->
//! ```
//!
//! If its experiment has not been driven, or not by that method, or if the stored results do not include the figure yet, the old
//! value stays and gets a dagger. This module does not drive anything or read files.

mod forms;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::iter;

use serde::{Deserialize, Serialize};

use crate::error::EvalError;
use crate::experiments::elsewhere::{SIMULATORS, suite_in};
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::statistics::Tally;
use crate::experiments::studies::Table;
use crate::experiments::suite::{Group, Suite};
use crate::experiments::table;
use crate::experiments::{corridor_published, studies, suites};
use forms::{FORMS, Form, Shown, WHOLE_FORMS, Whole};

const BEGIN: &str = "<!--= ";
const OPEN: &str = "-->";
const END: &str = "<!--=-->";
/// Text for a study in the table of all experiments, since studies do not drive missions.
const STUDIED: &str = "tables and curves";
/// Suffix of a figure that was not driven again with this version.
const EARLIER: &str = "†";
/// Marker of the table of all experiments.
const EXPERIMENTS: &str = "experiments";

/// The results of experiments.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// Results by name, for both suites and studies.
    pub experiments: BTreeMap<String, Experiment>,
}

/// The results of one experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Command that reproduces the figures.
    pub command: String,
    /// The version of the program that drove the experiment.
    pub program: String,
    /// Results of each method. Empty for a study.
    pub methods: Vec<Method>,
    /// Notes for readers of the figures.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
    /// Tables of a study.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<Table>,
    /// Tables of the sections that a suite reports in addition to its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<table::Table>,
}

/// The results of all drives by one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Name of the method.
    pub method: String,
    /// Tally of all tasks that count.
    pub total: Tally,
    /// Tally of each line of the suite's table.
    pub lines: BTreeMap<String, Tally>,
    /// Tally of each group of lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<(String, Tally)>,
}

impl Method {
    /// Counts the outcomes of a suite by one method.
    pub fn of(suite: &Suite, method: &str, outcomes: &[TaskOutcome]) -> Self {
        let counted = || outcomes.iter().filter(|ended| ended.method == method && suite.counts(ended));
        let line = |line: String| {
            let tally = Tally::of(counted().filter(|ended| ended.drawing == line));
            (line, tally)
        };
        let lines = suite.drawings().into_iter().map(line).collect();
        let group =
            |group: &Group| (group.name.clone(), Tally::of(counted().filter(|ended| group.counts(ended))));
        let groups = suite.groups.iter().map(group).collect();
        Self { method: method.to_owned(), total: Tally::of(counted()), lines, groups }
    }

    /// Returns the share of reached tasks in words, for example ``"`outline` 97.5 % (95 to 99) of 320"``.
    pub fn words(&self) -> String {
        format!("`{}` {}", self.method, Form::SHARE.of(self.total).unwrap_or_default())
    }
}

/// A page with its markers filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Filled {
    /// Text of the page.
    pub page: String,
    /// Names of experiments on the page for which there are no figures.
    pub not_driven: BTreeSet<String>,
}

impl Figures {
    /// Fills in the markers of a page. Filling a page twice has the same result as filling it once.
    ///
    /// # Errors
    /// [`EvalError::Marker`] if a marker has no end, or if it names an unknown experiment, method, form or line.
    pub fn fill(&self, page: &str) -> Result<Filled, EvalError> {
        let mut filled = Filled { page: String::with_capacity(page.len()), not_driven: BTreeSet::new() };
        let mut rest = page;
        while let Some((before, marked)) = rest.split_once(BEGIN) {
            let line = page[..page.len() - rest.len() + before.len()].matches('\n').count() + 1;
            let wrong = |(expected, found)| EvalError::Marker { line, expected, found };
            let (words, text) = split(marked, OPEN).map_err(wrong)?;
            let (old, after) = split(text, END).map_err(wrong)?;
            let marker = Marker::read(words).map_err(wrong)?;
            let new = self.text(&marker, &mut filled.not_driven).map_err(wrong)?;
            let new = new.unwrap_or_else(|| earlier(old));
            let _ = write!(filled.page, "{before}{BEGIN}{words}{OPEN}{new}{END}");
            rest = after;
        }
        filled.page += rest;
        Ok(filled)
    }

    /// Returns the text for a marker, or `None` if its experiment was not driven.
    fn text(&self, marker: &Marker<'_>, not_driven: &mut BTreeSet<String>) -> Result<Option<String>, Wrong> {
        let experiment = match marker {
            Marker::Experiments => return Ok(Some(self.table())),
            Marker::Whole { experiment, .. }
            | Marker::Figure { experiment, .. }
            | Marker::Section { experiment, .. }
            | Marker::Study { experiment, .. } => *experiment,
        };
        let Some(found) = self.experiments.get(experiment) else {
            not_driven.insert(experiment.to_owned());
            return Ok(None);
        };
        let text = match marker {
            Marker::Figure { method, form, lines, .. } => found.figure((experiment, method), *form, lines)?,
            Marker::Whole { form, .. } => found.whole(*form),
            Marker::Section { number, .. } => found.section(number)?,
            Marker::Study { table, shown, .. } => found.study(table, shown)?,
            Marker::Experiments => Some(self.table()),
        };
        not_driven.extend(text.is_none().then(|| experiment.to_owned()));
        Ok(text)
    }

    /// Returns the table of all experiments.
    fn table(&self) -> String {
        let mut text = "\n\n| experiment | command | tasks reached |\n|---|---|---|\n".to_owned();
        let in_simulators = |name| {
            SIMULATORS.map(|it| suite_in(name, it)).into_iter().filter(|it| self.experiments.contains_key(it))
        };
        let names = suites::names().chain(studies::names());
        for name in names.flat_map(|name| iter::once(name.to_owned()).chain(in_simulators(name))) {
            let row = self.experiments.get(&name).map(|found| {
                let reached: Vec<_> = found.methods.iter().map(Method::words).collect();
                let reached = if reached.is_empty() { STUDIED.into() } else { reached.join("<br>") };
                format!("`{}` | {reached}", found.command)
            });
            let row = row.unwrap_or_else(|| format!("`sketchnav eval {name}` | not driven {EARLIER}"));
            let _ = writeln!(text, "| `{name}` | {row} |");
        }
        text + "\n"
    }
}

impl Experiment {
    /// Returns a figure of one method, or a list of figures if several lines are given. Returns `None` if the figure is not stored,
    /// or if the method is one of those to compare but has not been driven yet.
    fn figure(
        &self,
        (experiment, method): (&str, &str),
        form: Form,
        lines: &str,
    ) -> Result<Option<String>, Wrong> {
        let known = || self.methods.iter().map(|found| found.method.as_str()).collect::<Vec<_>>().join(", ");
        let Some(of_method) = self.methods.iter().find(|found| found.method == method) else {
            let is_to_come = suites::compared(experiment).contains(&method);
            return if is_to_come { Ok(None) } else { Err(one_of(&known(), method)) };
        };
        if lines.is_empty() {
            return Ok(form.of_method(of_method));
        }
        let known = || of_method.lines.keys().map(String::as_str).collect::<Vec<_>>().join("; ");
        let figure = |line: &str| match of_method.lines.get(line) {
            Some(tally) => Ok(form.of(*tally)),
            None => Err(one_of(&known(), line)),
        };
        let figures = lines.split("; ").map(figure).collect::<Result<Option<Vec<_>>, _>>()?;
        Ok(figures.map(|figures| figures.join(", ")))
    }

    /// Returns the text about the experiment as a whole, or `None` if it is not stored.
    fn whole(&self, form: Whole) -> Option<String> {
        let tally = |method: &str, line: &str| {
            let found = self.methods.iter().find(|found| found.method == method);
            found.and_then(|found| found.lines.get(line)).copied().unwrap_or_default()
        };
        let methods: Vec<_> = self.methods.iter().map(|found| found.method.as_str()).collect();
        let table = match form {
            Whole::Notices => return Some(self.notices.join(" ")),
            Whole::Verdicts => corridor_published::verdicts(&methods, tally),
            Whole::Groups => self.groups()?,
            Whole::Lines => {
                let lines: BTreeSet<_> = self.methods.iter().flat_map(|found| found.lines.keys()).collect();
                let row = |line: &String| {
                    let figures = methods.iter().filter_map(|method| Form::RATED.of(tally(method, line)));
                    [line.clone()].into_iter().chain(figures).collect()
                };
                let header =
                    [String::new()].into_iter().chain(methods.iter().map(|method| format!("`{method}`")));
                table::Table { header: header.collect(), rows: lines.into_iter().map(row).collect() }
            }
        };
        Some(format!("\n\n{}", table.markdown()))
    }

    /// Returns the table of groups of lines, by the true pose and on the sketch, or `None` if they are not stored.
    fn groups(&self) -> Option<table::Table> {
        let names = self.methods.first()?.groups.iter().map(|(name, _)| name);
        let head = |method: &Method| {
            [format!("`{0}`", method.method), format!("`{0}`, on the sketch", method.method)]
        };
        let cells = |method: &Method, row: usize| {
            let tally = method.groups.get(row)?.1;
            let cells = [Form::RATED, Form::RATED_ON_SKETCH].map(|form| form.of(tally));
            Some(cells.map(|cell| cell.unwrap_or("–".into())))
        };
        let row = |(i, name): (usize, &String)| {
            let cells = self.methods.iter().map(|method| cells(method, i)).collect::<Option<Vec<_>>>()?;
            Some([name.clone()].into_iter().chain(cells.into_iter().flatten()).collect())
        };
        let rows = names.enumerate().map(row).collect::<Option<Vec<_>>>().filter(|rows| !rows.is_empty())?;
        let header = [String::new()].into_iter().chain(self.methods.iter().flat_map(head)).collect();
        Some(table::Table { header, rows })
    }

    /// Returns the text for a marker of a study, or `None` if the tables of the study are not stored.
    fn study(&self, number: &str, shown: &Shown) -> Result<Option<String>, Wrong> {
        numbered(&self.tables, number)?.map(|table| shown.of(table)).transpose()
    }

    /// Returns the table of a suite's section, or `None` if the sections of the suite are not stored.
    fn section(&self, number: &str) -> Result<Option<String>, Wrong> {
        Ok(numbered(&self.sections, number)?.map(|table| format!("\n\n{}", table.markdown())))
    }
}

/// Returns the table with the given number, counted from 1, or `None` if there are no tables.
fn numbered<'a, T>(tables: &'a [T], number: &str) -> Result<Option<&'a T>, Wrong> {
    let known = || (1..=tables.len()).map(|number| number.to_string()).collect::<Vec<_>>().join(", ");
    let index = number.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
    match index.and_then(|index| tables.get(index)) {
        None if !tables.is_empty() => Err(one_of(&known(), number)),
        found => Ok(found),
    }
}

/// Returns the text for a figure that was not driven again: its old value with a dagger, or only the dagger.
fn earlier(old: &str) -> String {
    let value = old.trim_end_matches(EARLIER).trim_end_matches(' ');
    let separator = if value.is_empty() { "" } else { " " };
    format!("{value}{separator}{EARLIER}")
}

/// A description of what was expected, and what was found instead.
type Wrong = (String, String);

fn one_of(known: &str, found: &str) -> Wrong {
    (format!("one of {known}"), found.to_owned())
}

fn split<'a>(text: &'a str, end: &str) -> Result<(&'a str, &'a str), Wrong> {
    let begin = || text.lines().next().unwrap_or_default().to_owned();
    text.split_once(end).ok_or_else(|| (format!("a marker that ends with {end}"), begin()))
}

enum Marker<'a> {
    Experiments,
    Whole { experiment: &'a str, form: Whole },
    Figure { experiment: &'a str, method: &'a str, form: Form, lines: String },
    Section { experiment: &'a str, number: &'a str },
    Study { experiment: &'a str, table: &'a str, shown: Shown },
}

impl<'a> Marker<'a> {
    fn read(words: &'a str) -> Result<Self, Wrong> {
        let all: Vec<_> = words.split_whitespace().collect();
        match all[..] {
            [EXPERIMENTS] => Ok(Self::Experiments),
            [experiment, form] => {
                is_suite(experiment)?;
                let form = Whole::read(form).ok_or_else(|| one_of(WHOLE_FORMS, form))?;
                Ok(Self::Whole { experiment, form })
            }
            [experiment, table, form, ref words @ ..] if studies::find(experiment).is_some() => {
                let shown = Shown::read(form, &words.join(" "))?;
                Ok(Self::Study { experiment, table, shown })
            }
            [experiment, "section", number] => {
                is_suite(experiment)?;
                Ok(Self::Section { experiment, number })
            }
            [experiment, method, form, ref lines @ ..] => {
                is_suite(experiment)?;
                let form = Form::read(form).ok_or_else(|| one_of(FORMS, form))?;
                Ok(Self::Figure { experiment, method, form, lines: lines.join(" ") })
            }
            _ => Err(("experiment, method and form".to_owned(), words.to_owned())),
        }
    }
}

fn is_suite(experiment: &str) -> Result<(), Wrong> {
    let suite = match experiment.split_once('@') {
        Some((suite, simulator)) if SIMULATORS.contains(&simulator) => suite,
        _ => experiment,
    };
    let is_known = suites::names().any(|known| known == suite);
    let known = || suites::names().chain(studies::names()).collect::<Vec<_>>().join(", ");
    let wrong = || one_of(&known(), experiment);
    is_known.then_some(()).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::statistics::{OverDrawings, Score};

    fn figures() -> Figures {
        let tally = |reached, lost, attempts| Tally { reached, lost, attempts, ..Tally::default() };
        let lines = [("hall 1".to_owned(), tally(7, 3, 10)), ("yard".to_owned(), tally(2, 0, 2))].into();
        let (total, groups) = (tally(312, 4, 320), Vec::new());
        let outline = Method { method: "outline".into(), total, lines, groups };
        let (command, program) = ("sketchnav eval people --seed 1".to_owned(), "0.1.0 7".to_owned());
        let notices = vec!["One house.".to_owned(), "Ten people.".to_owned()];
        let (header, row) = (vec!["agree".to_owned(), "right".into()], vec!["all".to_owned(), "9".into()]);
        let sections = vec![table::Table { header, rows: vec![row] }];
        let (methods, tables) = (vec![outline], Vec::new());
        let people = Experiment { command, program, methods, notices, tables, sections };
        let table = Table {
            title: "Success".to_owned(),
            head: ["plan", "D", "low", "high", "journeys", "lost"].map(str::to_owned).to_vec(),
            rows: vec![("5 mm, D/R".to_owned(), vec![28.04, 25.1, 31.0, 925.0, 1.5])],
        };
        let success = Experiment { methods: Vec::new(), tables: vec![table], ..people.clone() };
        let over = |low, high| Some(OverDrawings { drawings: 25, low, high });
        let total = Tally {
            wrong_side: 10,
            with_collision: 2,
            over_drawings: over(0.18, 0.52),
            on_sketch: Some(Score { reached: 60, over_drawings: over(0.42, 0.78) }),
            by_place: Some(Score { reached: 44, over_drawings: over(0.26, 0.62) }),
            displacement_m: Some(0.214),
            ..tally(34, 0, 100)
        };
        let groups = vec![("portrait".to_owned(), total)];
        let paper = Method { method: "boniardi-2015".into(), total, lines: BTreeMap::new(), groups };
        let routes = Experiment { methods: vec![paper], ..people.clone() };
        let simulated =
            Experiment { command: "sketchnav eval people --world mujoco".into(), ..people.clone() };
        let all = [
            ("people", people),
            ("people@mujoco", simulated),
            ("directions-success", success),
            ("routes", routes),
        ];
        Figures { experiments: all.map(|(name, experiment)| (name.to_owned(), experiment)).into() }
    }

    fn filled(page: &str) -> String {
        let filled = figures().fill(page).unwrap();
        assert_eq!(figures().fill(&filled.page).unwrap(), filled, "filling twice changes something");
        filled.page
    }

    fn error(page: &str) -> String {
        figures().fill(page).unwrap_err().to_string()
    }

    #[test]
    fn markers_are_filled_and_the_rest_of_the_page_is_unchanged() {
        for (marker, figure) in [
            ("people outline share", "97.5 % (95 to 99) of 320"),
            ("people outline percent", "97.5 %"),
            ("people outline of", "312 of 320"),
            ("people outline rated hall 1", "7 of 10 (70 %; 40 to 89)"),
            ("people outline attempts", "320"),
            ("people outline reached", "312"),
            ("people outline known hall 1", "100 %"),
            ("people outline wrong-arrival", "0"),
            ("people outline of hall 1; yard", "7 of 10, 2 of 2"),
            ("directions-success 1 percent D: 5 mm, D/R", "28.0 % (25.1 to 31.0) of 925"),
            ("directions-success 1 number D: 5 mm, D/R", "28.0 (25.1 to 31) of 925"),
            ("directions-success 1 number lost: 5 mm, D/R", "1.500"),
            ("people outline majority", "2 of 2"),
            ("people@mujoco outline of yard", "2 of 2"),
            ("people notices", "One house. Ten people."),
            ("people section 1", "\n\n| agree | right |\n|---|---|\n| all | 9 |\n\n"),
            ("routes boniardi-2015 share", "34.0 % (18 to 52 over 25 drawings) of 100"),
            ("routes boniardi-2015 share-on-sketch", "60.0 % (42 to 78 over 25 drawings) of 100"),
            ("routes boniardi-2015 of-by-place", "44 of 100"),
            ("routes boniardi-2015 displacement", "0.21 m"),
            ("routes boniardi-2015 touched", "2 of 100"),
            (
                "routes groups",
                "\n\n|  | `boniardi-2015` | `boniardi-2015`, on the sketch |\n|---|---|---|\n| portrait | 34 of 100 (34 %; 18 to 52 over 25 drawings) | 60 of 100 (60 %; 42 to 78 over 25 drawings) |\n\n",
            ),
            (
                "people lines",
                "\n\n|  | `outline` |\n|---|---|\n| hall 1 | 7 of 10 (70 %; 40 to 89) |\n| yard | 2 of 2 (100 %; 34 to 100) |\n\n",
            ),
        ] {
            let page = format!("| a | <!--= {marker}-->old<!--=--> | b |\nend\n");
            assert_eq!(filled(&page), format!("| a | <!--= {marker}-->{figure}<!--=--> | b |\nend\n"));
        }
        assert_eq!(filled("no marker\n"), "no marker\n");
        let table = filled("<!--= directions-success 1 table--><!--=-->");
        assert!(table.contains("| 5 mm, D/R | 28.0 | 25.1 | 31 | 925 | 1.500 |\n\n<!--=-->"), "{table}");
    }

    /// Regression test: the figures of the page used to be copied by hand, and nothing showed which of them matched the current
    /// code.
    #[test]
    fn a_figure_from_an_earlier_run_gets_one_dagger() {
        for (marker, old, new, experiment) in [
            ("deformed outline share", "95.0 %", "95.0 % †", "deformed"),
            ("deformed outline share", "", "†", "deformed"),
            ("deformed outline share", "†", "†", "deformed"),
            // Figures that are not in the stored results yet: those of a method to compare, of a judgement, and of groups.
            ("people beam share", "78.8 %", "78.8 % †", "people"),
            ("people outline share-on-sketch", "", "†", "people"),
            ("people groups", "", "†", "people"),
        ] {
            let page = |figure: &str| format!("<!--= {marker}-->{figure}<!--=-->");
            let filled = figures().fill(&page(old)).unwrap();
            assert_eq!(filled.page, page(new));
            assert_eq!(filled.not_driven, BTreeSet::from([experiment.to_owned()]));
            assert_eq!(figures().fill(&filled.page).unwrap(), filled);
        }
    }

    #[test]
    fn the_table_of_experiments_is_complete() {
        let page = filled("<!--= experiments--><!--=-->");
        assert!(suites::names().chain(studies::names()).all(|name| page.contains(&format!("| `{name}` |"))));
        assert!(page.contains("| `sketchnav eval people --seed 1` | `outline` 97.5 % (95 to 99) of 320 |"));
        assert!(page.contains("`sketchnav eval deformed` | not driven †"));
        let mujoco = "| `people@mujoco` | `sketchnav eval people --world mujoco` | `outline` 97.5 %";
        assert!(page.contains(mujoco) && !page.contains("irsim"), "{page}");
    }

    #[test]
    fn an_unknown_marker_is_an_error_with_its_line() {
        for (page, words) in [
            ("\n<!--= peopl outline share-->x<!--=-->", "line 2: expected one of ablation,"),
            ("<!--= people@gazebo outline share-->x<!--=-->", "found \"people@gazebo\""),
            ("<!--= people team share-->x<!--=-->", "line 1: expected one of outline, found \"team\""),
            ("<!--= people outline shares-->x<!--=-->", "expected one of share, percent"),
            ("<!--= people outline known-on-sketch-->x<!--=-->", "expected one of share, percent"),
            ("<!--= people outline share hall-->x<!--=-->", "expected one of hall 1; yard, found \"hall\""),
            ("<!--= people outlines-->x<!--=-->", "expected one of lines, verdicts, notices or groups"),
            ("<!--= people-->x<!--=-->", "expected experiment, method and form, found \"people\""),
            ("<!--= people outline share-->x\n", "expected a marker that ends with <!--=-->"),
            ("<!--= people outline", "expected a marker that ends with -->"),
            ("<!--= directions-success 2 table-->x<!--=-->", "expected one of 1, found \"2\""),
            ("<!--= directions-success 1 share-->x<!--=-->", "expected one of table, percent, number"),
            ("<!--= directions-success 1 number D-->x<!--=-->", "expected COLUMN: ROW, found \"D\""),
            (
                "<!--= directions-success 1 number E: x-->x<!--=-->",
                "expected one of D; low; high; journeys; lost, found \"E\"",
            ),
            ("<!--= directions-success 1 number D: x-->x<!--=-->", "expected one of 5 mm, D/R, found \"x\""),
        ] {
            assert!(error(page).contains(words), "{}", error(page));
        }
    }
}
