//! Figures 5.3 to 5.6 of Chronis 2007, computed from drives without additional states. They show what decides whether a turn, a
//! sketch or a state succeeds.

use crate::experiments::landmarks::tables::{Driven, Row};
use crate::experiments::section::{Form, Mark, Plot, Section};
use crate::experiments::table::Table;
use crate::judge::states::StateDriven;
use sketchnav_schemas::statistics::wilson;

/// Minimum number of successful runs out of five for a sketch or a state to count as successful (5.2.1).
const MOST_RUNS: usize = 3;
/// Range of the angles of turns that succeed according to the thesis, in degrees.
const GOOD_ANGLES_DEG: [f64; 2] = [60.0, 90.0];
/// Minimum number of steps that counts as many (5.2.1).
const MANY_STEPS: f64 = 10.0;

/// Returns the sections of all figures.
pub fn sections(base: &[Driven<'_>; 2], extended: &[Driven<'_>; 2]) -> Vec<Section> {
    let [a, b] = base;
    vec![turns(a, b), states_of_sketches(base, extended), steps_of_sketches(a), all_steps(a)]
}

/// A state that runs drove to: its sketch and number, its objects as drawn, and the number of runs that matched it.
struct Reached<'a> {
    sketch: usize,
    state: usize,
    drawn: &'a StateDriven,
    correct: usize,
    runs: usize,
}

/// Returns every state of each sketch except the first one, which the thesis leaves out as well.
fn states<'a>(driven: &'a Driven<'a>) -> impl Iterator<Item = Reached<'a>> {
    driven.rows().flat_map(|(sketch, row): (usize, &'a Row<'a>)| {
        let drawn = row.runs[0].states.iter().enumerate().skip(1);
        drawn.map(move |(state, drawn)| Reached {
            sketch,
            state,
            drawn,
            correct: row.correct(state),
            runs: row.runs.len(),
        })
    })
}

impl Reached<'_> {
    fn is_mostly_matched(&self) -> bool {
        self.correct >= MOST_RUNS
    }
}

fn plot(
    title: String,
    [x_unit, y_unit]: [&str; 2],
    form: Form,
    marks: impl Iterator<Item = (f64, bool)>,
) -> Plot {
    let marks = marks.enumerate().map(|(i, (y, is_success))| Mark { x: i as f64 + 1.0, y, is_success });
    Plot { title, x_unit: x_unit.into(), y_unit: y_unit.into(), form, marks: marks.collect() }
}

/// Returns a row of a table with the number of successes among the outcomes.
fn count(name: &str, outcomes: impl Iterator<Item = bool>) -> Vec<String> {
    let outcomes: Vec<bool> = outcomes.collect();
    let good = outcomes.iter().filter(|good| **good).count();
    let [low, high] = wilson(good, outcomes.len()).map(|share| 100.0 * share);
    let interval = if outcomes.is_empty() { "–".into() } else { format!("{low:.0}–{high:.0}") };
    vec![name.to_owned(), format!("{good}/{}", outcomes.len()), interval]
}

fn table(what: &str, rows: Vec<Vec<String>>) -> Table {
    Table { header: vec![what.to_owned(), "succeed".into(), "95 %".into()], rows }
}

/// Figure 5.3: turning rates in scene A, and turning angles in both scenes.
fn turns(a: &Driven<'_>, b: &Driven<'_>) -> Section {
    let of = |driven| states(driven).filter(|state| state.drawn.ends_turn);
    let rate = |state: &Reached<'_>| state.drawn.turned_deg / state.drawn.steps.max(1e-9);
    let [low, high] = GOOD_ANGLES_DEG;
    let within = |low: f64, high: f64| {
        let is_within = move |state: &Reached<'_>| (low..high).contains(&state.drawn.turned_deg);
        of(a).chain(of(b)).filter(is_within).map(|state| state.is_mostly_matched())
    };
    let angle = |driven, scene: &str| {
        let marks = of(driven).map(|state| (state.drawn.turned_deg, state.is_mostly_matched()));
        plot(format!("Turning angles, scene {scene}"), ["turn", "degrees"], Form::Dots, marks)
    };
    let rates = of(a).map(|state| (rate(&state), state.is_mostly_matched()));
    Section {
        title: "Figure 5.3: turns".into(),
        table: table(
            "turns, both scenes",
            vec![
                count(&format!("below {low}°"), within(0.0, low)),
                count(&format!("{low}° to {high}°"), within(low, high)),
                count(&format!("above {high}°"), within(high, f64::INFINITY)),
            ],
        ),
        words: vec![format!(
            "A turn succeeds if the state at its end is matched correctly in {MOST_RUNS} or more of the runs. According to the published text, the rate matters little, and successful turns are between {low}° and {high}°."
        )],
        plots: vec![
            plot("Turning rates, scene A".into(), ["turn", "degrees a step"], Form::Dots, rates),
            angle(a, "A"),
            angle(b, "B"),
        ],
    }
}

/// Figure 5.4: extracted states and success, before and after adding states.
fn states_of_sketches(base: &[Driven<'_>; 2], extended: &[Driven<'_>; 2]) -> Section {
    let is_good = |row: &Row<'_>| row.reached() >= MOST_RUNS;
    let of = |scenes: &[Driven<'_>; 2], is_in: &dyn Fn(usize, usize) -> bool| {
        let rows =
            scenes.iter().flat_map(|driven| driven.rows().map(move |(_, row)| (driven.scene.possible, row)));
        rows.filter(|(possible, row)| is_in(row.extracted(), *possible))
            .map(|(_, row)| is_good(row))
            .collect::<Vec<_>>()
    };
    let line =
        |name: &str, scenes, is_in: &dyn Fn(usize, usize) -> bool| count(name, of(scenes, is_in).into_iter());
    let rows = vec![
        line("fewer states than possible", base, &|found, possible| found < possible),
        line("as many or more", base, &|found, possible| found >= possible),
        line("additional: fewer than possible", extended, &|found, possible| found < possible),
        line("additional: as many or more", extended, &|found, possible| found >= possible),
    ];
    let drawn = |driven: &Driven<'_>, when: &str| {
        let marks = driven.rows().map(|(_, row)| (row.extracted() as f64, is_good(row)));
        plot(
            format!("Scene {}, {when}", driven.scene.word.to_uppercase()),
            ["sketch", "states"],
            Form::Dots,
            marks,
        )
    };
    Section {
        title: "Figure 5.4: extracted states and success".into(),
        table: table("sketches, both scenes", rows),
        words: vec![format!(
            "A sketch succeeds if {MOST_RUNS} or more runs reach the goal. According to the published text, sketches with few extracted states fail."
        )],
        plots: vec![
            drawn(&base[0], "before additional states"),
            drawn(&extended[0], "with additional states"),
            drawn(&base[1], "before additional states"),
        ],
    }
}

/// Figure 5.5: steps between states, for each sketch of scene A.
fn steps_of_sketches(a: &Driven<'_>) -> Section {
    let plots = a.rows().map(|(number, _)| {
        let of_sketch = states(a).filter(|state| state.sketch == number);
        let marks = of_sketch.map(|state| (state.drawn.steps, state.is_mostly_matched()));
        plot(format!("Sketch {number}"), ["state", "steps"], Form::Bars, marks)
    });
    let first = states(a).filter(|state| state.state == 1);
    let later = states(a).filter(|state| state.state > 1);
    Section {
        title: "Figure 5.5: steps between states, scene A".into(),
        table: table(
            "states that are matched in most runs",
            vec![
                count("the first after the start", first.map(|state| state.is_mostly_matched())),
                count("later ones", later.map(|state| state.is_mostly_matched())),
            ],
        ),
        words: vec![format!(
            "A state succeeds if {MOST_RUNS} or more runs match it correctly. A run that is lost at a state reaches none of the later ones. According to the published text, there is no direct relation to the number of steps."
        )],
        plots: plots.collect(),
    }
}

/// Figure 5.6: all steps of scene A together.
fn all_steps(a: &Driven<'_>) -> Section {
    let marks = || states(a).map(|state| (state.drawn.steps, state.correct == state.runs));
    let within = |is_in: &dyn Fn(f64) -> bool| {
        marks().filter(|(steps, _)| is_in(*steps)).map(|(_, good)| good).collect::<Vec<_>>()
    };
    Section {
        title: "Figure 5.6: steps between all states, scene A".into(),
        table: table("states that are matched in all runs", vec![
            count(&format!("{MANY_STEPS} steps or fewer"), within(&|steps| steps <= MANY_STEPS).into_iter()),
            count("more", within(&|steps| steps > MANY_STEPS).into_iter()),
        ]),
        words: vec!["A state succeeds if all runs match it correctly. According to the published text, states more than ten steps apart fail, and are wide turns. The density of the thesis's steps is not known.".into()],
        plots: vec![plot("All states".into(), ["state", "steps"], Form::Bars, marks())],
    }
}
