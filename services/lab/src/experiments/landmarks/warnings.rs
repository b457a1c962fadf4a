//! Compares the warnings about sketches before the start with the outcomes of the drives.

use crate::experiments::outcome::TaskOutcome;
use crate::experiments::section::Section;
use crate::experiments::table::Table;

/// Returns the table, or nothing if there were no warnings about any sketch.
pub fn sections(outcomes: &[TaskOutcome]) -> Vec<Section> {
    let table = table(outcomes);
    if table.rows.is_empty() {
        return Vec::new();
    }
    vec![Section {
        title: "Warnings before the start".into(),
        table,
        words: vec![
            "How many drives failed by sketches with and without a warning. A warning is worth reading if more of the former do."
                .into(),
        ],
        plots: Vec::new(),
    }]
}

/// Returns a row for each kind of warning, and one for all of them.
fn table(outcomes: &[TaskOutcome]) -> Table {
    let mut kinds: Vec<&str> =
        outcomes.iter().flat_map(|ended| &ended.warnings).map(String::as_str).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let row = |name: &str, is_warned: &dyn Fn(&TaskOutcome) -> bool| {
        let (with, without): (Vec<_>, Vec<_>) = outcomes.iter().partition(|ended| is_warned(ended));
        vec![name.to_owned(), failed(&with), failed(&without)]
    };
    let mut rows: Vec<_> = kinds
        .iter()
        .map(|kind| row(kind, &|ended| ended.warnings.iter().any(|warning| warning == kind)))
        .collect();
    if !rows.is_empty() {
        rows.push(row("any", &|ended| !ended.warnings.is_empty()));
    }
    let header = ["warning", "failed with it", "failed without it"].map(str::to_owned).to_vec();
    Table { header, rows }
}

fn failed(outcomes: &[&TaskOutcome]) -> String {
    let (failed, all) = (outcomes.iter().filter(|ended| !ended.is_success()).count(), outcomes.len());
    if all == 0 {
        return "–".into();
    }
    format!("{failed} of {all} ({:.1} %)", 100.0 * failed as f64 / all as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::Kind;

    #[test]
    fn failures_are_counted_with_and_without_each_warning() {
        let ended = |kind, warnings: &[&str]| TaskOutcome {
            warnings: warnings.iter().map(|&warning| warning.to_owned()).collect(),
            ..TaskOutcome::sample("a#1", kind)
        };
        let mut outcomes = vec![
            ended(Kind::Reached, &[]),
            ended(Kind::Reached, &[]),
            ended(Kind::Lost, &[]),
            ended(Kind::Reached, &["winding"]),
            ended(Kind::WrongArrival, &["alike", "winding"]),
        ];
        let [section] = &sections(&outcomes)[..] else { panic!("one table") };
        let rows = [
            ["alike", "1 of 1 (100.0 %)", "1 of 4 (25.0 %)"],
            ["winding", "1 of 2 (50.0 %)", "1 of 3 (33.3 %)"],
            ["any", "1 of 2 (50.0 %)", "1 of 3 (33.3 %)"],
        ];
        assert_eq!(section.table.rows, rows);
        outcomes.truncate(3);
        assert_eq!(sections(&outcomes), []);
    }
}
