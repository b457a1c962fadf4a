//! Tables of journeys on land: the share that arrives compared with the map-maker's probability, and the failures of the others.

use sketchnav_schemas::statistics::{mean, wilson};

use crate::experiments::outcome::{Kind, TaskOutcome};
use crate::experiments::section::Section;
use crate::experiments::table::Table;
use crate::judge::directions::JourneyVerdict;

/// Number of bins for stated probabilities.
const BINS: usize = 10;

/// Returns both tables.
pub fn sections(outcomes: &[TaskOutcome]) -> Vec<Section> {
    vec![
        Section {
            title: "Stated and reached".into(),
            table: stated_and_reached(outcomes),
            words: vec!["The probability of arrival that the map-maker states, and the share of these journeys that arrive.".into()],
            plots: Vec::new(),
        },
        Section {
            title: "How journeys failed".into(),
            table: failures(outcomes),
            words: vec![
                "A landmark is right if it is the one that the map refers to. A failure is known if the robot reports it.".into(),
            ],
            plots: Vec::new(),
        },
    ]
}

fn table(header: &[&str], rows: Vec<Vec<String>>) -> Table {
    Table { header: header.iter().map(|&name| name.to_owned()).collect(), rows }
}

/// Returns a row for each tenth of the stated probability that has journeys, and one for all of them.
fn stated_and_reached(outcomes: &[TaskOutcome]) -> Table {
    let stated: Vec<(f64, bool)> = outcomes
        .iter()
        .filter_map(|ended| Some((ended.journey.as_ref()?.stated?, ended.is_success())))
        .collect();
    let row = |name: String, journeys: &[(f64, bool)]| {
        let said: Vec<f64> = journeys.iter().map(|(stated, _)| *stated).collect();
        let reached = journeys.iter().filter(|(_, reached)| *reached).count();
        let [low, high] = wilson(reached, said.len()).map(|share| 100.0 * share);
        let share = 100.0 * reached as f64 / said.len() as f64;
        let arrived = format!("{share:.1} % ({low:.0} to {high:.0})");
        vec![name, format!("{:.1} %", 100.0 * mean(&said)), arrived, said.len().to_string()]
    };
    let tenth = |(stated, _): &(f64, bool)| ((stated * BINS as f64) as usize).min(BINS - 1);
    let mut rows = Vec::new();
    for bin in 0..BINS {
        let journeys: Vec<_> = stated.iter().copied().filter(|journey| tenth(journey) == bin).collect();
        let name = || format!("{} to {} %", 10 * bin, 10 * bin + 10);
        rows.extend((!journeys.is_empty()).then(|| row(name(), &journeys)));
    }
    rows.extend((!stated.is_empty()).then(|| row("all".into(), &stated)));
    table(&["stated", "mean", "reached", "journeys"], rows)
}

/// Returns a row for each kind of failure, beginning with the most frequent.
fn failures(outcomes: &[TaskOutcome]) -> Table {
    let mut counts: Vec<(String, bool, usize)> = Vec::new();
    for ended in outcomes.iter().filter(|ended| !ended.is_success()) {
        let (way, known) = (way(ended), is_known(ended.kind));
        match counts.iter_mut().find(|(name, ..)| *name == way) {
            Some((.., count)) => *count += 1,
            None => counts.push((way, known, 1)),
        }
    }
    counts.sort_by(|a, b| b.2.cmp(&a.2).then_with(|| a.0.cmp(&b.0)));
    let all: usize = counts.iter().map(|(.., count)| count).sum();
    let known: usize = counts.iter().filter(|(_, known, _)| *known).map(|(.., count)| count).sum();
    let mut rows: Vec<_> = counts
        .into_iter()
        .map(|(way, known, count)| vec![way, if known { "yes" } else { "no" }.into(), count.to_string()])
        .collect();
    rows.extend((all > 0).then(|| vec!["all".into(), format!("{known} of {all}"), all.to_string()]));
    table(&["failure", "known", "journeys"], rows)
}

/// Returns true if the robot reports failures of this kind itself, as in `Tally::share_that_knows`. A robot that runs out of time
/// has not noticed anything.
fn is_known(kind: Kind) -> bool {
    matches!(kind, Kind::Lost | Kind::Blocked)
}

/// Describes how a journey failed, and whether all landmarks before that were the right ones.
fn way(ended: &TaskOutcome) -> String {
    let said = ended.journey.as_ref().and_then(|journey| journey.kind).filter(|kind| !kind.is_success());
    let end = said.map_or(ended.kind.word(), |kind| kind.word());
    let is_right = |journey: &JourneyVerdict| journey.right == journey.accepted;
    match ended.journey.as_ref().map(is_right) {
        Some(true) => format!("{end}; all landmarks right until then"),
        Some(false) => format!("{end}, after a wrong landmark"),
        None => end.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_directions::traversal::Kind as End;

    use super::*;

    fn journey(kind: Kind, end: Option<End>, stated: f64, right: u32) -> TaskOutcome {
        let verdict = JourneyVerdict {
            task: "to the pole".into(),
            kind: end,
            accepted: 5,
            right,
            recoveries: 0,
            stated: Some(stated),
            attained: Vec::new(),
            kinds: Vec::new(),
        };
        TaskOutcome { journey: Some(verdict), ..TaskOutcome::sample("a#1", kind) }
    }

    #[test]
    fn journeys_are_counted_by_what_was_stated_and_failures_by_how_they_ended() {
        let outcomes = [
            journey(Kind::Reached, Some(End::Direct), 0.97, 5),
            journey(Kind::Reached, Some(End::Unaware), 1.0, 4),
            journey(Kind::Lost, Some(End::CannotLocate), 0.91, 5),
            journey(Kind::WrongArrival, Some(End::Astray), 0.55, 4),
            journey(Kind::Lost, Some(End::CannotLocate), 0.52, 5),
            journey(Kind::Collided, None, 0.53, 5),
        ];
        let [stated, failed] = &sections(&outcomes)[..] else { panic!("two tables") };
        let rows = [
            ["50 to 60 %", "53.3 %", "0.0 % (0 to 56)", "3"],
            ["90 to 100 %", "96.0 %", "66.7 % (21 to 94)", "3"],
            ["all", "74.7 %", "33.3 % (10 to 70)", "6"],
        ];
        assert_eq!(stated.table.rows, rows);
        let rows = [
            ["cannot locate; all landmarks right until then", "yes", "2"],
            ["astray, after a wrong landmark", "no", "1"],
            ["collided; all landmarks right until then", "no", "1"],
            ["all", "2 of 4", "4"],
        ];
        assert_eq!(failed.table.rows, rows);
    }

    /// The parts of an experiment are stored as JSON and merged.
    #[test]
    fn a_journey_is_read_back_from_json() {
        let ended = journey(Kind::Lost, Some(End::CannotLocate), 0.91, 5);
        let text = serde_json::to_string(&ended).unwrap();
        assert!(text.contains(r#""kind":"cannot locate""#) && text.contains(r#""stated":0.91"#), "{text}");
        assert_eq!(serde_json::from_str::<TaskOutcome>(&text).unwrap(), ended);
    }
}
