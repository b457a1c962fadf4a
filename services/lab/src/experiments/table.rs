//! Formats the figures of a suite as text tables, both for the terminal and for reports.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::statistics::wilson;

use crate::experiments::cost;
use crate::experiments::outcome::{Kind, TaskOutcome};
use crate::experiments::statistics::Tally;
use crate::experiments::suite::{Group, Leg, Suite};
use crate::experiments::trial::Trial;

/// A table whose first column names the line, and whose other columns are figures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Column headings.
    pub header: Vec<String>,
    /// Rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Returns the table in Markdown, followed by an empty line.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<_> =
                cells.iter().map(|cell| cell.replace('|', "\\|").replace('\n', " ")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = format!("|{}\n", "---|".repeat(self.header.len()));
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        line(&self.header) + &rule + &rows + "\n"
    }
}

/// Returns the tables for one method: first the paper's table beside ours, if there is one, then a table with a line for each
/// drawing and columns for how the tasks ended, and finally the costs, if the suite shows them.
pub fn of_suite(suite: &Suite, outcomes: &[&TaskOutcome]) -> Vec<Table> {
    let counted: Vec<_> = outcomes.iter().copied().filter(|ended| suite.counts(ended)).collect();
    let kinds = by_drawing(suite, &counted);
    let legs = (!suite.legs.is_empty()).then(|| by_leg(suite, &counted));
    let costs = suite.shows_costs.then(|| cost::table(&suite.drawings(), &counted));
    legs.into_iter().chain([kinds]).chain(costs).collect()
}

/// Returns a note on how the tasks that do not count ended, or `None` if there are no such tasks.
pub fn note(suite: &Suite, outcomes: &[&TaskOutcome]) -> Option<String> {
    let others = Tally::of(outcomes.iter().copied().filter(|ended| !suite.counts(ended)));
    let said = format!("Connecting legs, not counted: {} of {} reached.", others.reached, others.attempts);
    (others.attempts > 0).then_some(said)
}

/// Returns the paper's table next to ours, with a line for each leg and a column for each drawing.
fn by_leg(suite: &Suite, outcomes: &[&TaskOutcome]) -> Table {
    let drawings = suite.drawings();
    let papers = suite.papers();
    let mut header = vec!["path".to_owned(), "length".into()];
    header.extend(drawings.iter().map(|drawing| format!("here {drawing}")));
    header.push("paper: length".into());
    header.extend(papers.iter().map(|paper| paper.name.clone()));
    let leg = |leg: &Leg| {
        let tally = |drawing: &String| {
            Tally::of(outcomes.iter().copied().filter(|e| e.task == leg.name && e.drawing == *drawing))
        };
        let length = leg.length_m.map_or("–".into(), |length| format!("{length:.1} m"));
        let mut cells = vec![leg.name.clone(), length];
        cells.extend(drawings.iter().map(tally).map(|tally| format!("{}/{}", tally.reached, tally.attempts)));
        cells.push(format!("{:.1} m", leg.paper_length_m));
        cells.extend(leg.paper.iter().map(|(reached, attempts)| format!("{reached}/{attempts}")));
        cells
    };
    let mut rows: Vec<_> = suite.legs.iter().map(leg).collect();
    let mut all = vec!["all, %".to_owned(), String::new()];
    all.extend(drawings.iter().map(|drawing| {
        percent(Tally::of(outcomes.iter().copied().filter(|ended| ended.drawing == *drawing)).rate())
    }));
    all.push(String::new());
    all.extend(papers.iter().map(|paper| percent(paper.rate())));
    rows.push(all);
    Table { header, rows }
}

/// Returns a table with a line for each drawing, a line for all drawings, a line for each group, and the paper's lines.
fn by_drawing(suite: &Suite, outcomes: &[&TaskOutcome]) -> Table {
    let all = Tally::of(outcomes.iter().copied());
    let judged = Judged::of(&all);
    let mut header = vec![suite.lines.unwrap_or("drawing").to_owned(), "reached".into()];
    header.extend(["%".into(), "95 %".into()]);
    header.extend(judged.header());
    header.extend(failures(suite).map(|kind| kind.word().to_owned()));
    header.extend(["with collision".into(), "failures known".into()]);
    let line = |name: &str, tally| line(suite, judged, name, tally);
    let of_drawing = |drawing: String| {
        line(&drawing, Tally::of(outcomes.iter().copied().filter(|ended| ended.drawing == drawing)))
    };
    let of_group = |group: &Group| {
        line(&group.name, Tally::of(outcomes.iter().copied().filter(|ended| group.counts(ended))))
    };
    // Skip the lines of other methods, for which this one has no attempts.
    let is_driven = |drawing: &String| outcomes.iter().any(|ended| ended.drawing == *drawing);
    let mut rows: Vec<_> = suite.drawings().into_iter().filter(is_driven).map(of_drawing).collect();
    rows.push(line("all", all));
    rows.extend(suite.groups.iter().map(of_group));
    if !suite.remarks.is_empty() {
        header.extend(["most failures".into(), "published".into()]);
        for row in &mut rows {
            row.extend([reason(outcomes, &row[0]), remark(suite, outcomes, &row[0])]);
        }
    }
    rows.extend(suite.papers().into_iter().map(|paper| {
        let [reached, attempts] = [paper.reached, paper.attempts].map(|count| count as usize);
        let mut cells = head(&paper.name, reached, attempts);
        cells.resize(header.len(), "–".into());
        cells
    }));
    Table { header, rows }
}

/// Which optional columns a table has. This depends on what else is known about its tasks.
#[derive(Clone, Copy)]
struct Judged {
    over_drawings: bool,
    on_sketch: bool,
    displacement: bool,
}

impl Judged {
    fn of(all: &Tally) -> Self {
        Self {
            over_drawings: all.over_drawings.is_some(),
            on_sketch: all.on_sketch.is_some(),
            displacement: all.displacement_m.is_some(),
        }
    }

    fn columns<T>(self, columns: [T; 4]) -> impl Iterator<Item = T> {
        let shown = [self.over_drawings, self.on_sketch, self.on_sketch, self.displacement];
        columns.into_iter().zip(shown).filter(|(_, is_shown)| *is_shown).map(|(column, _)| column)
    }

    fn header(self) -> impl Iterator<Item = String> {
        let words = ["95 % over drawings", "on the sketch", "on the sketch, %", "from the route"];
        self.columns(words).map(str::to_owned)
    }

    fn cells(self, tally: &Tally) -> impl Iterator<Item = String> {
        let over = tally.over_drawings.filter(|over| over.drawings > 1);
        let on_sketch = tally.on_sketch.map(|score| tally.judged(score));
        self.columns([
            over.map_or("–".into(), |over| {
                format!("{} ({})", interval([over.low, over.high]), over.drawings)
            }),
            on_sketch.map_or("–".into(), |tally| format!("{}/{}", tally.reached, tally.attempts)),
            percent(on_sketch.and_then(|tally| tally.rate())),
            tally.displacement_m.map_or("–".into(), |metres| format!("{metres:.2} m")),
        ])
    }
}

/// Returns the reason that the robot reported most often for the failures of a line.
fn reason(outcomes: &[&TaskOutcome], line: &str) -> String {
    let failed = outcomes.iter().filter(|ended| ended.drawing == line && !ended.is_success());
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for ended in failed {
        let reason = ended.reason.split(';').next().unwrap_or_default();
        match counts.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, count)) => *count += 1,
            None => counts.push((reason, 1)),
        }
    }
    counts
        .into_iter()
        .rev()
        .max_by_key(|(_, count)| *count)
        .map_or(String::new(), |(reason, _)| reason.to_owned())
}

/// Returns the published remark on a line, for the method that was driven, or an empty string if there is none.
fn remark(suite: &Suite, outcomes: &[&TaskOutcome], line: &str) -> String {
    let method = outcomes.first().map_or("", |ended| ended.method.as_str());
    let published = suite.remarks.iter().find(|remark| remark.method == method && remark.line == line);
    published.map_or(String::new(), |remark| remark.words.to_owned())
}

/// Returns the ways in which tasks of a suite may fail. A robot that never moved is only counted separately in corridors.
fn failures(suite: &Suite) -> impl Iterator<Item = Kind> {
    let is_corridor = suite.trials.iter().any(Trial::is_corridor);
    Kind::ALL.into_iter().skip(1).filter(move |kind| *kind != Kind::NeverMoved || is_corridor)
}

fn line(suite: &Suite, judged: Judged, name: &str, tally: Tally) -> Vec<String> {
    let mut cells = head(name, tally.reached, tally.attempts);
    cells.extend(judged.cells(&tally));
    cells.extend(failures(suite).map(|kind| tally.count(kind).to_string()));
    cells.extend([tally.with_collision.to_string(), percent(tally.share_that_knows())]);
    cells
}

fn head(name: &str, reached: usize, attempts: usize) -> Vec<String> {
    let rate = (attempts > 0).then(|| reached as f64 / attempts as f64);
    let interval = interval(wilson(reached, attempts));
    vec![name.to_owned(), format!("{reached}/{attempts}"), percent(rate), interval]
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{:.0}–{:.0}", 100.0 * low, 100.0 * high)
}

/// Formats a share as a percentage, or as a dash if there is none.
pub(crate) fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |share| format!("{:.1}", 100.0 * share))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two drawings are driven twice each. One goal is always reached. With the other drawing, the robot always arrives at a wrong
    /// place that it takes for its goal.
    #[test]
    fn both_verdicts_and_both_intervals_are_in_one_row() {
        let outcome = |drawing: &str, kind| TaskOutcome {
            drawing: drawing.into(),
            cluster: Some(drawing.into()),
            on_sketch: Some(true),
            displacement_m: Some(0.25),
            ..TaskOutcome::sample(&format!("{drawing}#1"), kind)
        };
        let driven = ["a", "a", "b", "b"]
            .map(|drawing| outcome(drawing, if drawing == "a" { Kind::Reached } else { Kind::WrongArrival }));
        let trials = ["a", "b"].map(|drawing| {
            let mission = sketchnav_schemas::mission::Mission::parse(MISSION).unwrap();
            let robot = sketchnav_sim::files::robot("robotino").unwrap();
            Trial::new(drawing.into(), drawing.into(), mission, robot)
        });
        let groups = vec![Group { name: "upright".into(), lines: vec!["b".into()] }];
        let suite = Suite { trials: trials.into(), groups, ..Suite::default() };
        let table = &of_suite(&suite, &driven.iter().collect::<Vec<_>>())[0];
        let expected = [
            "drawing, reached, %, 95 %, 95 % over drawings, on the sketch, on the sketch, %, from the route",
            "a, 2/2, 100.0, 34–100, –, 2/2, 100.0, 0.25 m",
            "b, 0/2, 0.0, 0–66, –, 2/2, 100.0, –",
            "all, 2/4, 50.0, 15–85, 0–100 (2), 4/4, 100.0, 0.25 m",
            "upright, 0/2, 0.0, 0–66, –, 2/2, 100.0, –",
        ];
        let found = [&table.header].into_iter().chain(&table.rows).map(|row| row[..8].join(", "));
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }

    const MISSION: &str = r#"
        name = "a hall"
        robot = "robotino"
        world = { floor_plan = "hall.floor.toml" }
        start = { world = [0, 0], world_heading_deg = 0 }
        navigator = { kind = "sketch", drawing = "sketch.svg" }
        [[task]]
        name = "there"
        goal = [1, 1]
        there = { center = [2, 0], radius_m = 0.5 }
    "#;
}
