//! Compares the later drives of each series with the first one.

use sketchnav_schemas::statistics::{median, wilson};

use super::cause::Cause;
use super::series::{InSeries, Search};
use super::{BACK, DRIVES};
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::section::Section;
use crate::experiments::table::Table;

/// The outcome of a task that was driven as part of a series.
#[derive(Clone, Copy)]
struct Ended<'a> {
    outcome: &'a TaskOutcome,
    known: InSeries,
}

impl<'a> Ended<'a> {
    /// Returns the key that identifies a task across all drives of its series.
    fn task(&self) -> (&'a str, &'a str, &'a str, u64) {
        let outcome = self.outcome;
        let of_series = outcome.id.rsplit_once('/').map_or("", |(series, _)| series);
        (&outcome.method, of_series, &outcome.task, outcome.seed)
    }
}

/// Returns all tables for the given outcomes.
pub fn sections(outcomes: &[TaskOutcome]) -> Vec<Section> {
    let all: Vec<_> =
        outcomes.iter().filter_map(|outcome| Some(Ended { outcome, known: outcome.in_series? })).collect();
    vec![drives(&all), searches(&all), causes(&all)]
}

fn of_drive<'a>(all: &[Ended<'a>], drive: usize) -> Vec<Ended<'a>> {
    all.iter().copied().filter(|ended| ended.known.drive == drive).collect()
}

/// Returns `some` as a share of `all`, in per cent, with Wilson's 95 % interval.
fn share(some: usize, all: usize) -> String {
    if all == 0 {
        return "–".into();
    }
    let [low, high] = wilson(some, all).map(|bound| (100.0 * bound).round());
    format!("{:.1} % ({low} to {high}) of {all}", 100.0 * some as f64 / all as f64)
}

fn drives(all: &[Ended<'_>]) -> Section {
    let first = of_drive(all, 0);
    let count = |counts: fn(&InSeries) -> bool| first.iter().filter(|ended| counts(&ended.known)).count();
    let seen = count(|known| known.is_seen);
    let refused = count(|known| known.is_seen && !known.is_accepted);
    let header = [
        "drive",
        "reached, of the accepted tasks",
        "reached, of the tasks whose goal was seen",
        "of the first drive's time",
        "of its time per metre",
    ];
    let row = |drive: usize| {
        let driven = of_drive(all, drive);
        let reached: Vec<_> = driven.iter().filter(|ended| ended.outcome.is_success()).collect();
        let reached_seen = reached.iter().filter(|ended| ended.known.is_seen).count();
        let pairs: Vec<_> = reached
            .iter()
            .filter_map(|later| {
                let is_same = |first: &&Ended<'_>| first.task() == later.task() && first.outcome.is_success();
                Some((*first.iter().find(is_same)?, **later))
            })
            .collect();
        let time_s = |of: &dyn Fn(&(Ended<'_>, Ended<'_>)) -> f64| pairs.iter().map(of).sum::<f64>();
        let ratio = time_s(&|(_, later)| later.outcome.time_s) / time_s(&|(first, _)| first.outcome.time_s);
        let ways = time_s(&|(first, _)| first.known.way_m) / time_s(&|(_, later)| later.known.way_m);
        let words = |ratio: f64| if ratio.is_finite() { format!("{ratio:.2}") } else { "–".into() };
        vec![
            DRIVES[drive].0.to_owned(),
            share(reached.len(), driven.len()),
            if drive == BACK { "–".into() } else { share(reached_seen, seen) },
            words(ratio),
            words(ratio * ways),
        ]
    };
    let words = format!(
        "Of the {} tasks of the first drives, {seen} have a goal whose place was actually seen, which the robot refuses for {refused} of \
         them. Times are those of tasks that were reached on both drives; per metre means per metre of the shortest path, \
         since later drives begin elsewhere. The drive back is a task of its own.",
        first.len()
    );
    Section {
        title: "Drives in what was learned".into(),
        table: Table { header: header.map(str::to_owned).into(), rows: (1..DRIVES.len()).map(row).collect() },
        words: vec![words],
        plots: Vec::new(),
    }
}

fn searches(all: &[Ended<'_>]) -> Section {
    let header = ["drive", "found its place", "lost", "wrong", "median time", "longest time"];
    let row = |drive: usize| {
        let searches: Vec<_> = of_drive(all, drive).iter().filter_map(|ended| ended.known.search).collect();
        let times_s: Vec<_> = searches
            .iter()
            .filter_map(|search| if let Search::Found(time_s) = search { Some(*time_s) } else { None })
            .collect();
        let count = |kind: Search| searches.iter().filter(|search| **search == kind).count().to_string();
        let longest_s = times_s.iter().copied().reduce(f64::max);
        let time = |time_s: Option<f64>| time_s.map_or("–".into(), |time_s| format!("{time_s:.0} s"));
        vec![
            DRIVES[drive].0.to_owned(),
            share(times_s.len(), searches.len()),
            count(Search::Lost),
            count(Search::Wrong),
            time(median(&times_s)),
            time(longest_s),
        ]
    };
    Section {
        title: "Starts without a mark".into(),
        table: Table { header: header.map(str::to_owned).into(), rows: (1..DRIVES.len()).map(row).collect() },
        words: vec![
            "A place counts as found if the robot is sure of it and right within half a metre when the first task ends. The time is that \
             after which it was never wrong again and sure for the first time."
                .into(),
        ],
        plots: Vec::new(),
    }
}

fn causes(all: &[Ended<'_>]) -> Section {
    let counts = |drive: usize| {
        let driven = of_drive(all, drive);
        Cause::ALL.map(|cause| driven.iter().filter(|ended| ended.known.cause == Some(cause)).count())
    };
    let row = |drive: usize| {
        let counts = counts(drive).map(|count| count.to_string());
        std::iter::once(DRIVES[drive].0.to_owned()).chain(counts).collect()
    };
    let header = std::iter::once("drive").chain(Cause::ALL.map(Cause::words)).map(str::to_owned);
    Section {
        title: "Why later drives fail".into(),
        table: Table { header: header.collect(), rows: (1..DRIVES.len()).map(row).collect() },
        words: vec![
            "Failures count in the first column that applies. A wrong arrival or correspondence on the first drive puts the goal at \
             another place in the map. A map counts as drifted if the distance between start and goal differs by more than 1 m. The \
             last three are about where the robot believes it is when the task ends."
                .into(),
        ],
        plots: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::Kind;

    fn ended(
        drive: usize,
        task: &str,
        kind: Kind,
        [time_s, way_m]: [f64; 2],
        search: Option<Search>,
    ) -> TaskOutcome {
        let is_accepted = task != "refused";
        let cause = (drive > 0 && kind == Kind::Lost).then_some(Cause::Unsure);
        TaskOutcome {
            task: task.to_owned(),
            time_s,
            in_series: Some(InSeries { drive, way_m, is_seen: true, is_accepted, search, cause }),
            ..TaskOutcome::sample(&format!("a/{}#1", DRIVES[drive].0), kind)
        }
    }

    #[test]
    fn times_are_those_of_tasks_that_were_reached_on_both_drives() {
        let all = [
            ended(0, "near", Kind::Reached, [20.0, 5.0], None),
            ended(0, "far", Kind::Reached, [80.0, 20.0], None),
            ended(0, "late", Kind::TimedOut, [300.0, 5.0], None),
            ended(0, "refused", Kind::Reached, [10.0, 5.0], None),
            ended(1, "near", Kind::Reached, [30.0, 10.0], Some(Search::Found(12.0))),
            ended(1, "far", Kind::Lost, [90.0, 20.0], None),
            ended(1, "late", Kind::Reached, [10.0, 5.0], None),
        ];
        let [drives, searches, causes] = &sections(&all)[..] else { panic!() };
        let found: Vec<_> = drives.table.rows[0].iter().map(String::as_str).collect();
        let expected = ["second", "66.7 % (21 to 94) of 3", "50.0 % (15 to 85) of 4", "1.50", "0.75"];
        assert_eq!(found, expected);
        assert!(drives.words[0].starts_with("Of the 4 tasks of the first drives, 4 have a goal whose place was actually seen, which the robot refuses for 1"));
        assert_eq!(searches.table.rows[0], ["second", "100.0 % (21 to 100) of 1", "0", "0", "12 s", "12 s"]);
        assert_eq!(causes.table.rows[0], ["second", "0", "0", "0", "0", "1", "0"]);
        assert_eq!(drives.table.rows[1], ["third", "–", "0.0 % (0 to 49) of 4", "–", "–"]);
        assert_eq!(drives.table.rows[2], ["back", "–", "–", "–", "–"]);
    }
}
