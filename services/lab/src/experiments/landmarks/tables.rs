//! Tables 5.2 to 5.6 of Chronis 2007 and its F test, computed from our drives and shown next to the published values.

use sketchnav_schemas::statistics::{interval_of_mean, mean, variance};

use crate::experiments::landmarks::figures;
use crate::experiments::landmarks::published::{F_TEST, P_OF_BOTH, SCENES, Scene, Sketch};
use crate::experiments::outcome::TaskOutcome;
use crate::experiments::section::Section;
use crate::experiments::statistics::Tally;
use crate::experiments::table::{Table, percent};
use crate::experiments::variance::{FTest, f_test};

/// Suffix of the names of trials without additional states.
pub const BASE: &str = "/base";

/// An interpretation of a state's conditions on the objects other than the most significant one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Suffix of the names of trials with this reading, before [`BASE`].
    pub suffix: &'static str,
    /// Words for this reading in titles.
    words: &'static str,
}

/// Every object has its ranges (figure 4.23).
pub const STRICT: Reading = Reading { suffix: "", words: "" };
/// Objects other than the most significant one have only a direction (table 4.1).
pub const DIRECTION_ONLY: Reading =
    Reading { suffix: "/direction-only", words: ", objects after the first by direction alone" };
/// Stands in tables for a number that does not exist.
const NONE: &str = "–";

/// Returns the measure P of a run: the share of states that were matched correctly, with more weight on earlier ones (5.2.1).
pub fn performance(correct: &[bool]) -> f64 {
    let m = correct.len();
    let weights = correct.iter().enumerate().filter(|(_, correct)| **correct).map(|(i, _)| m - i);
    2.0 * weights.sum::<usize>() as f64 / (m * (m + 1)).max(1) as f64
}

/// The runs of one sketch.
pub struct Row<'a> {
    /// The runs in order.
    pub runs: Vec<&'a TaskOutcome>,
    /// Published results of the sketch with the same number.
    pub published: &'static Sketch,
}

impl Row<'_> {
    /// Returns the number of extracted states.
    pub fn extracted(&self) -> usize {
        self.runs.first().map_or(0, |run| run.states.len())
    }

    /// Returns the number of states that each run matched correctly.
    pub fn matched(&self) -> Vec<usize> {
        self.runs.iter().map(|run| run.states.iter().filter(|state| state.correct).count()).collect()
    }

    /// Returns the number of runs that matched a state correctly.
    pub fn correct(&self, state: usize) -> usize {
        self.runs.iter().filter(|run| run.states.get(state).is_some_and(|state| state.correct)).count()
    }

    fn p(&self) -> f64 {
        let of_run = |run: &&TaskOutcome| {
            performance(&run.states.iter().map(|state| state.correct).collect::<Vec<_>>())
        };
        mean(&self.runs.iter().map(of_run).collect::<Vec<_>>())
    }

    /// Returns the number of runs that reached the goal.
    pub fn reached(&self) -> usize {
        self.runs.iter().filter(|run| run.is_success()).count()
    }

    fn deviation(&self) -> f64 {
        deviation(&self.matched())
    }
}

fn deviation(counts: &[usize]) -> f64 {
    let counts: Vec<f64> = counts.iter().map(|count| *count as f64).collect();
    variance(&counts).unwrap_or(0.0).sqrt()
}

/// The runs of one scene that were driven by states, either with or without additional ones.
pub struct Driven<'a> {
    /// Published results of the scene.
    pub scene: &'static Scene,
    /// The sketches. Those that were not driven have no runs.
    pub rows: Vec<Row<'a>>,
}

impl<'a> Driven<'a> {
    fn of(outcomes: &'a [TaskOutcome], scene: &'static Scene, reading: Reading, is_base: bool) -> Self {
        let row = |(i, published): (usize, &'static Sketch)| {
            let suffix = if is_base { BASE } else { "" };
            let name = format!("{}/{:02}{}{suffix}", scene.word, i + 1, reading.suffix);
            let is_run = |run: &&TaskOutcome| {
                !run.states.is_empty() && run.id.rsplit_once('#').is_some_and(|(trial, _)| trial == name)
            };
            Row { runs: outcomes.iter().filter(is_run).collect(), published }
        };
        let rows: Vec<_> = scene.sketches.iter().enumerate().map(row).collect();
        Self { scene, rows }
    }

    /// Returns the sketches that were driven, each with its number from 1.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &Row<'a>)> {
        self.rows.iter().enumerate().filter(|(_, row)| !row.runs.is_empty()).map(|(i, row)| (i + 1, row))
    }

    fn tally(&self) -> Tally {
        Tally::of(self.rows.iter().flat_map(|row| row.runs.iter().copied()))
    }

    fn p(&self) -> Vec<f64> {
        self.rows().map(|(_, row)| row.p()).collect()
    }

    /// Returns the number of correctly matched states of each run, as a share of the possible states.
    fn shares(&self) -> Vec<f64> {
        let counts = self.rows.iter().flat_map(Row::matched);
        counts.map(|count| count as f64 / self.scene.possible as f64).collect()
    }

    fn letter(&self) -> String {
        self.scene.word.to_uppercase()
    }
}

/// Returns the sections of all tables for each reading, or no sections if nothing was driven by states.
pub fn sections(outcomes: &[TaskOutcome]) -> Vec<Section> {
    let of = |reading: Reading| {
        let sections = sections_of(outcomes, reading).into_iter();
        sections.map(move |section| Section { title: section.title + reading.words, ..section })
    };
    [STRICT, DIRECTION_ONLY].into_iter().flat_map(of).collect()
}

fn sections_of(outcomes: &[TaskOutcome], reading: Reading) -> Vec<Section> {
    let of = |is_base| SCENES.each_ref().map(|scene| Driven::of(outcomes, scene, reading, is_base));
    let (base, extended) = (of(true), of(false));
    let is_driven = |scenes: &[Driven<'_>]| scenes.iter().any(|scene| scene.rows().next().is_some());
    if !is_driven(&base) {
        return Vec::new();
    }
    let mut sections: Vec<_> =
        base.iter().zip(["5.2", "5.3"]).map(|(scene, number)| runs(scene, number)).collect();
    if is_driven(&extended) {
        let pairs = base.iter().zip(&extended).zip(["5.4", "5.5"]);
        sections.extend(pairs.map(|((base, extended), number)| additional(base, extended, number)));
        sections.push(cumulative(&base, &extended));
    }
    sections.push(fisher(&base, &extended));
    sections.extend(figures::sections(&base, &extended));
    sections
}

fn words(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|cell| (*cell).to_owned()).collect()
}

fn listed(counts: &[usize]) -> String {
    counts.iter().map(usize::to_string).collect::<Vec<_>>().join(",")
}

/// Formats a mean with Student's interval over the sketches.
fn with_interval(numbers: &[f64]) -> String {
    let interval = interval_of_mean(numbers);
    let interval = interval.map_or(String::new(), |[low, high]| format!(" ({low:.2} to {high:.2})"));
    format!("{:.2}{interval}", mean(numbers))
}

/// Formats a rate with Wilson's interval.
fn rate(tally: &Tally) -> String {
    let [low, high] = tally.interval().map(|share| 100.0 * share);
    format!("{} % ({low:.0} to {high:.0})", percent(tally.rate()))
}

/// Returns table 5.2 or 5.3.
fn runs(driven: &Driven<'_>, number: &str) -> Section {
    let header = [
        "sketch",
        "extracted of possible",
        "correctly matched, each run",
        "reached",
        "P",
        "deviation",
        "published: extracted",
        "matched",
        "reached",
        "P",
        "deviation",
    ];
    let possible = driven.scene.possible;
    let row = |(number, row): (usize, &Row<'_>)| {
        let Sketch { extracted, matched, reached, p, .. } = row.published;
        vec![
            number.to_string(),
            format!("{}/{possible}", row.extracted()),
            listed(&row.matched()),
            format!("{}/{}", row.reached(), row.runs.len()),
            format!("{:.2}", row.p()),
            format!("{:.2}", row.deviation()),
            format!("{extracted}/{possible}"),
            listed(matched),
            format!("{reached}/5"),
            format!("{p:.2}"),
            format!("{:.2}", deviation(matched)),
        ]
    };
    let mut rows: Vec<_> = driven.rows().map(row).collect();
    let deviations: Vec<f64> = driven.rows().map(|(_, row)| row.deviation()).collect();
    let tally = driven.tally();
    rows.push(vec![
        "all".into(),
        NONE.into(),
        NONE.into(),
        format!("{}/{}, {}", tally.reached, tally.attempts, rate(&tally)),
        with_interval(&driven.p()),
        format!("{:.2}", mean(&deviations)),
        NONE.into(),
        NONE.into(),
        format!("{}/{}", driven.scene.reached[0], 5 * driven.scene.sketches.len()),
        format!("{:.2}", driven.scene.p[0]),
        format!("{:.2}", driven.scene.deviation),
    ]);
    Section {
        title: format!("Table {number}: scene {}, without additional states", driven.letter()),
        table: Table { header: words(&header), rows },
        words: vec![said_of_runs(driven)],
        plots: Vec::new(),
    }
}

/// Summarizes table 5.2 or 5.3, and how the results here differ from it.
fn said_of_runs(driven: &Driven<'_>) -> String {
    let published = driven.scene.sketches;
    let of = |counts: &dyn Fn(&Row<'_>) -> f64| {
        mean(&driven.rows().map(|(_, row)| counts(row)).collect::<Vec<_>>())
    };
    let extracted = of(&|row| row.extracted() as f64);
    let there = mean(&published.iter().map(|sketch| sketch.extracted as f64).collect::<Vec<_>>());
    let all = || driven.rows.iter().flat_map(|row| row.runs.iter()).flat_map(|run| &run.states);
    let matched = all().filter(|state| state.matched).count();
    let wrong = all().filter(|state| state.matched && !state.correct).count();
    let tally = driven.tally();
    let failed = tally.attempts - tally.reached;
    format!(
        "Sketches with the same number are different drawings here and in the thesis, so only the last line can be compared. A sketch gives {extracted:.1} states on average, in the thesis {there:.1}. {wrong} of {matched} matches are by objects other than the drawn ones. In {} of {failed} failures the robot reports that it is lost, because a state is never matched.",
        tally.lost
    )
}

/// Returns table 5.4 or 5.5.
fn additional(base: &Driven<'_>, extended: &Driven<'_>, number: &str) -> Section {
    let header = [
        "sketch",
        "states",
        "with additional",
        "reached",
        "with additional",
        "P",
        "with additional",
        "published: P",
        "with additional",
    ];
    let two = |p: Option<f64>| p.map_or(NONE.to_owned(), |p| format!("{p:.2}"));
    let pairs = || {
        base.rows().filter_map(|(number, row)| {
            let with = &extended.rows[number - 1];
            (!with.runs.is_empty()).then_some((number, row, with))
        })
    };
    let row = |(number, row, with): (usize, &Row<'_>, &Row<'_>)| {
        vec![
            number.to_string(),
            row.extracted().to_string(),
            with.extracted().to_string(),
            format!("{}/{}", row.reached(), row.runs.len()),
            format!("{}/{}", with.reached(), with.runs.len()),
            two(Some(row.p())),
            two(Some(with.p())),
            two(Some(row.published.p)),
            two(row.published.p_additional),
        ]
    };
    let [more, better, worse] = [
        pairs().filter(|(_, row, with)| with.extracted() > row.extracted()).count(),
        pairs().filter(|(_, row, with)| with.p() > row.p() + 1e-9).count(),
        pairs().filter(|(_, row, with)| with.p() < row.p() - 1e-9).count(),
    ];
    let there = match base.scene.word {
        "a" => "In the thesis, five of eleven sketches needed additional states, and six have a greater P.",
        _ => "In the thesis, no sketch of this scene got an additional state.",
    };
    Section {
        title: format!("Table {number}: scene {}, with additional states", base.letter()),
        table: Table { header: words(&header), rows: pairs().map(row).collect() },
        words: vec![format!(
            "{more} of {} sketches get additional states; P is greater in {better} and less in {worse}. {there} P is a share of all extracted states, so an additional state that is missed lowers it.",
            pairs().count()
        )],
        plots: Vec::new(),
    }
}

/// Returns table 5.6.
fn cumulative(base: &[Driven<'_>; 2], extended: &[Driven<'_>; 2]) -> Section {
    let header = [
        "",
        "P",
        "published",
        "P, additional",
        "published",
        "reached",
        "published",
        "reached, additional",
        "published",
    ];
    let both = |scenes: &[Driven<'_>; 2]| {
        let p = scenes.iter().flat_map(Driven::p).collect::<Vec<_>>();
        let runs = scenes.iter().flat_map(|scene| scene.rows.iter().flat_map(|row| row.runs.iter().copied()));
        (p, Tally::of(runs))
    };
    let row = |name: &str, ours: [(Vec<f64>, Tally); 2], p: [f64; 2], reached: [usize; 2], of: usize| {
        let published = |count: usize| format!("{:.0} %", 100.0 * count as f64 / of as f64);
        let [(base_p, base), (extended_p, extended)] = ours;
        vec![
            name.to_owned(),
            with_interval(&base_p),
            format!("{:.2}", p[0]),
            with_interval(&extended_p),
            format!("{:.2}", p[1]),
            rate(&base),
            published(reached[0]),
            rate(&extended),
            published(reached[1]),
        ]
    };
    let scenes = base.iter().zip(extended).map(|(base, extended)| {
        let ours = [base, extended].map(|driven| (driven.p(), driven.tally()));
        let runs = 5 * base.scene.sketches.len();
        row(&format!("scene {}", base.letter()), ours, base.scene.p, base.scene.reached, runs)
    });
    let mut rows: Vec<_> = scenes.collect();
    let reached = [0, 1].map(|i| SCENES.iter().map(|scene| scene.reached[i]).sum());
    rows.push(row("both", [both(base), both(extended)], P_OF_BOTH, reached, 100));
    Section {
        title: "Table 5.6: both scenes".into(),
        table: Table { header: words(&header), rows },
        words: vec![
            "Intervals of P are Student's over the sketches, those of runs Wilson's. The five runs of a sketch are alike, so the latter are too narrow for other sketches.".into(),
            "Fewer runs reach the goal than in the thesis, whose sketches and scenes are lost, so its tuning cannot be repeated. By exact routes, the same program reaches the goal as often as the thesis does (`landmark-isolation`). States therefore do not tolerate the errors of the sketches: a state requires each of its objects in its sixteenth of a turn, within 22 inches and 30 units of width, and a state that is never matched ends the run.".into(),
        ],
        plots: Vec::new(),
    }
}

/// Returns the F test of 5.4.
fn fisher(base: &[Driven<'_>; 2], extended: &[Driven<'_>; 2]) -> Section {
    let header = [
        "matched states, as a share of the possible ones",
        "variance of A",
        "variance of B",
        "F = B / A",
        "degrees",
        "p",
    ];
    let row = |name: &str, scenes: &[Driven<'_>; 2]| {
        let [a, b] = scenes.each_ref().map(Driven::shares);
        let FTest { f, freedom, p } = f_test(&b, &a)?;
        let [var_a, var_b] = [&a, &b].map(|shares| variance(shares).unwrap_or(0.0));
        Some(vec![
            name.to_owned(),
            format!("{var_a:.3}"),
            format!("{var_b:.3}"),
            format!("{f:.2}"),
            format!("{}, {}", freedom[0], freedom[1]),
            format!("{p:.3}"),
        ])
    };
    let mut rows: Vec<_> = [row("without additional states", base), row("with additional states", extended)]
        .into_iter()
        .flatten()
        .collect();
    let [a, b] = SCENES.each_ref().map(|scene| format!("{:.3}", scene.variance));
    let [f, critical] = F_TEST;
    rows.push(vec![
        "published".into(),
        a,
        b,
        format!("{f}"),
        "44, 54".into(),
        format!("critical value {critical}"),
    ]);
    Section {
        title: "F test: are the scenes alike? (5.4)".into(),
        table: Table { header: words(&header), rows },
        words: vec![
            "The test is two-sided: p is the probability of a ratio this far from 1 if the variances are equal. The thesis compares with the upper 5 % point, and does not reject equality.".into(),
            "The published variance of B is that of table 5.3. The published variance of A is not that of table 5.2, whose counts give 0.068 and F = 0.82.".into(),
        ],
        plots: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::Kind;
    use crate::judge::states::StateDriven;

    /// Returns a run of sketch 1 of scene A with a number of states, some of which were matched correctly.
    fn run(trial: &str, repetition: u32, states: usize, correct: usize) -> TaskOutcome {
        let state = |i: usize| StateDriven {
            matched: i < correct,
            correct: i < correct,
            ends_turn: i == 2,
            steps: if i == 0 { 0.0 } else { 4.0 },
            turned_deg: 80.0,
        };
        let kind = if correct == states { Kind::Reached } else { Kind::Lost };
        TaskOutcome {
            method: "chronis-2007".into(),
            states: (0..states).map(state).collect(),
            ..TaskOutcome::sample(&format!("{trial}#{repetition}"), kind)
        }
    }

    #[test]
    fn a_sketch_has_a_line_beside_the_published_one() {
        let base = [5, 3, 5, 5, 1].into_iter().zip(1..).map(|(correct, n)| run("a/01/base", n, 5, correct));
        let more = (1..=5).map(|n| run("a/01", n, 6, 6));
        let sections = sections(&base.chain(more).collect::<Vec<_>>());
        let titles: Vec<_> = sections.iter().map(|section| &section.title[..10]).collect();
        let expected = [
            "Table 5.2:",
            "Table 5.3:",
            "Table 5.4:",
            "Table 5.5:",
            "Table 5.6:",
            "F test: ar",
            "Figure 5.3",
            "Figure 5.4",
            "Figure 5.5",
            "Figure 5.6",
        ];
        assert_eq!(titles, expected);
        // P is (3 + 12/15 + 5/15) / 5.
        let line =
            ["1", "5/8", "5,3,5,5,1", "3/5", "0.83", "1.79", "7/8", "7,6,6,7,7", "5/5", "0.98", "0.55"];
        assert_eq!(sections[0].table.rows[0], line);
        let line = ["1", "5", "6", "3/5", "5/5", "0.83", "1.00", "0.98", "0.98"];
        assert_eq!(sections[2].table.rows[0], line);
        // Of the five states, all except the start are plotted. The third one ends the turn, and four runs matched it.
        let [figure, .., last] = &sections[6..] else { panic!() };
        assert_eq!((figure.plots[1].marks.len(), last.plots[0].marks.len()), (1, 4));
        assert!(figure.plots[1].marks[0].is_success && !last.plots[0].marks[3].is_success);
        assert!(
            sections.iter().all(|section| {
                section.table.rows.iter().all(|row| row.len() == section.table.header.len())
            })
        );
    }

    #[test]
    fn drives_by_other_methods_have_no_section() {
        assert!(sections(&[]).is_empty());
        let by_belief = TaskOutcome { states: Vec::new(), ..run("a/01", 1, 5, 5) };
        assert!(sections(&[by_belief]).is_empty());
    }

    #[test]
    fn earlier_states_weigh_more() {
        assert_eq!(performance(&[true; 7]), 1.0);
        assert_eq!(performance(&[false; 3]), 0.0);
        // 5 + 4 + 3 of 15.
        assert_eq!(performance(&[true, true, true, false, false]), 0.8);
        assert_eq!(performance(&[true, false, false]), 0.5);
        assert_eq!(performance(&[false, false, true]), 1.0 / 6.0);
        assert_eq!(performance(&[]), 0.0);
    }
}
