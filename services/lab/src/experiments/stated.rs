//! How often arrivals are right, by the probability that the robot states.

use crate::experiments::section::Section;
use crate::experiments::statistics::{BINS, Tally};
use crate::experiments::table::Table;

const WORDS: &str = "The probability of being right that the robot states with each arrival, in ten bins, and how many of these arrivals are right. Arrivals without a stated probability do not count.";

/// Returns the table, or `None` if no probability was stated.
pub fn section(tally: &Tally) -> Option<Section> {
    let bins = tally.stated?;
    let row = |(bin, [arrivals, right]): (usize, &[usize; 2])| {
        let [low, high] = [bin, bin + 1].map(|k| 100 * k / BINS);
        let share = (*arrivals > 0).then(|| format!("{:.0} %", 100.0 * *right as f64 / *arrivals as f64));
        vec![
            format!("{low} to {high} %"),
            arrivals.to_string(),
            right.to_string(),
            share.unwrap_or_else(|| "–".to_owned()),
        ]
    };
    let header = ["stated", "arrivals", "right", "share right"].map(str::to_owned).to_vec();
    let rows = bins.iter().enumerate().map(row).collect();
    let doubted = format!(
        "The robot doubts {} of the arrivals that are right, and {} of the {} wrong ones.",
        tally.doubtful_reached, tally.doubtful, tally.wrong_arrival
    );
    Some(Section {
        title: "Stated and kept".to_owned(),
        table: Table { header, rows },
        words: vec![WORDS.to_owned(), doubted],
        plots: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::{Kind, TaskOutcome};

    fn outcome(kind: Kind, stated: Option<f64>) -> TaskOutcome {
        TaskOutcome { stated, ..TaskOutcome::sample("a#1", kind) }
    }

    #[test]
    fn arrivals_are_counted_by_tenths_and_a_doubtful_failure_is_known() {
        let driven = [
            outcome(Kind::Reached, Some(0.97)),
            outcome(Kind::Reached, Some(1.0)),
            outcome(Kind::WrongArrival, Some(0.91)),
            outcome(Kind::WrongArrival, Some(0.12)),
            outcome(Kind::Reached, Some(0.13)),
            outcome(Kind::Lost, None),
        ];
        let tally = Tally::of(&driven);
        assert_eq!(tally.share_that_knows(), Some(2.0 / 3.0));
        let section = section(&tally).unwrap();
        assert_eq!(section.table.rows[1], ["10 to 20 %", "2", "1", "50 %"]);
        assert_eq!(section.table.rows[9], ["90 to 100 %", "3", "2", "67 %"]);
        assert_eq!(section.table.rows[5], ["50 to 60 %", "0", "0", "–"]);
        assert!(
            section.words[1].contains("doubts 1 of the arrivals that are right, and 1 of the 2 wrong ones")
        );
    }

    #[test]
    fn drives_without_stated_probabilities_have_no_table() {
        assert_eq!(section(&Tally::of(&[outcome(Kind::Reached, None)])), None);
    }
}
