//! Tables about how the witnesses judge arrivals.

use crate::experiments::logistic::{Logistic, area_under_curve, losses};
use crate::experiments::outcome::{Kind, TaskOutcome};
use crate::experiments::section::Section;
use crate::experiments::table::Table;
use crate::experiments::witnesses::{AGREE_M, Claim, RoomsSaid};

/// Maximum margin that is taken into account. Larger ones do not make a difference.
const MOST_MARGIN: f64 = 15.0;
/// Number of bins for stated probabilities.
const BINS: usize = 5;

/// An arrival, and what the witnesses say about it.
struct Arrival<'a> {
    outcome: &'a TaskOutcome,
    rooms: RoomsSaid,
    /// Margin and misfit of the outline, if the robot arrived by the outline.
    outline: Option<[f64; 2]>,
}

/// Signs by which right arrivals may be distinguished from wrong ones.
struct Signs {
    name: &'static str,
    of: fn(&Arrival<'_>) -> Vec<f64>,
}

const COMBINATIONS: [Signs; 6] = [
    Signs { name: "none: the share of right arrivals", of: |_| Vec::new() },
    Signs {
        name: "margin and misfit of the outline, and whether the arrival is by it",
        of: |a| {
            a.outline.map_or(vec![0.0; 3], |[margin, misfit]| {
                vec![margin.min(MOST_MARGIN) / MOST_MARGIN, misfit, 1.0]
            })
        },
    },
    Signs { name: "whether regions and doors agree", of: |a| vec![a.agreement()] },
    Signs { name: "share of their alignments with the goal here", of: |a| vec![a.share_here()] },
    Signs {
        name: "share of all doors that have a partner",
        of: |a| vec![if a.rooms.has_answer { a.rooms.doors_matched } else { 0.5 }],
    },
    Signs {
        name: "agreement, share, whether the arrival is by the outline, and the margin of regions and doors, negative if they disagree",
        of: |a| {
            vec![a.agreement(), a.share_here(), a.signed_margin(), f64::from(u8::from(a.outline.is_some()))]
        },
    },
];

impl Arrival<'_> {
    fn is_right(&self) -> bool {
        self.outcome.kind == Kind::Reached
    }

    /// Returns 1 if regions and doors agree with the arrival, 0 if they do not, and 0.5 if they have no answer.
    fn agreement(&self) -> f64 {
        if self.rooms.has_answer { f64::from(u8::from(self.rooms.agrees())) } else { 0.5 }
    }

    fn share_here(&self) -> f64 {
        if self.rooms.has_answer { self.rooms.share_here } else { 0.5 }
    }

    fn signed_margin(&self) -> f64 {
        let margin = self.rooms.margin.unwrap_or_default().clamp(0.0, MOST_MARGIN) / MOST_MARGIN;
        if self.rooms.agrees() { margin } else { -margin }
    }
}

/// Returns true if combinations are fitted to this outcome, which is the case for the first floor of each kind.
fn is_fitted(outcome: &TaskOutcome) -> bool {
    let floor = outcome.cluster.as_deref().and_then(|cluster| cluster.split('/').next());
    floor.is_some_and(|floor| floor.ends_with("-1"))
}

/// Returns the margin and the misfit in the reason that was reported for an arrival by the outline.
fn of_outline(reason: &str) -> Option<[f64; 2]> {
    let after = |word: &str| {
        let rest = &reason[reason.find(word)? + word.len()..];
        rest.split([' ', ',']).next()?.parse::<f64>().ok()
    };
    Some([after("margin ").unwrap_or_default(), after("misfit ")?])
}

/// Returns all tables.
pub fn sections(outcomes: &[TaskOutcome]) -> Vec<Section> {
    let arrival =
        |outcome| Some(Arrival { outcome, rooms: outcome.rooms?, outline: of_outline(&outcome.reason) });
    let arrivals: Vec<_> = outcomes
        .iter()
        .filter(|outcome: &&TaskOutcome| matches!(outcome.kind, Kind::Reached | Kind::WrongArrival))
        .filter_map(arrival)
        .collect();
    let checked: Vec<_> = outcomes.iter().filter(|outcome| !is_fitted(outcome)).collect();
    let rest: Vec<_> = arrivals.iter().filter(|arrival| !is_fitted(arrival.outcome)).collect();
    vec![together(&checked), disagreement(&rest), combinations(&arrivals), bins(&arrivals)]
}

fn section(title: &str, header: &[&str], rows: Vec<Vec<String>>, words: &str) -> Section {
    let header = header.iter().map(|name| (*name).to_owned()).collect();
    let words = vec![words.to_owned()];
    Section { title: title.to_owned(), table: Table { header, rows }, words, plots: Vec::new() }
}

/// Names of the witnesses, in the order of [`RoomsSaid::claims`].
const NAMES: [&str; 3] = ["filter", "outline", "rooms and doors"];
/// Upper ends of the curve's bins: distances, in metres, between an arrival and where regions and doors locate the goal.
const BIN_ENDS_M: [f64; 5] = [1.0, AGREE_M, 5.0, 10.0, f64::INFINITY];

/// Returns true if two witnesses locate the goal at about the same position.
fn agree(a: &Claim, b: &Claim) -> bool {
    (a.at[0] - b.at[0]).hypot(a.at[1] - b.at[1]) <= AGREE_M
}

/// Counts how often each witness, each pair and all three are right about the goal.
fn together(outcomes: &[&TaskOutcome]) -> Section {
    let claims: Vec<_> = outcomes.iter().filter_map(|outcome| Some(outcome.rooms?.claims)).collect();
    let row = |members: &[usize]| {
        let of = |all: &[Option<Claim>; 3]| members.iter().map(|k| all[*k]).collect::<Option<Vec<_>>>();
        let (same, apart): (Vec<_>, Vec<_>) =
            claims.iter().filter_map(of).partition(|own| own.iter().all(|claim| agree(&own[0], claim)));
        let right = |group: &[Vec<Claim>], is: &dyn Fn(&[Claim]) -> bool| {
            group.iter().filter(|own| is(own)).count().to_string()
        };
        let names: Vec<_> = members.iter().map(|k| NAMES[*k]).collect();
        let mut cells = vec![
            names.join(", "),
            same.len().to_string(),
            right(&same, &|own| own[0].is_right),
            share(same.iter().filter(|own| own[0].is_right).count(), same.len()),
        ];
        let apart_cells = match members.len() {
            1 => [(); 4].map(|()| "–".to_owned()),
            _ => [
                apart.len().to_string(),
                right(&apart, &|own| own[0].is_right),
                right(&apart, &|own| own[1..].iter().any(|claim| claim.is_right) && !own[0].is_right),
                right(&apart, &|own| !own.iter().any(|claim| claim.is_right)),
            ],
        };
        cells.extend(apart_cells);
        cells
    };
    let groups: [&[usize]; 7] = [&[0], &[1], &[2], &[0, 1], &[0, 2], &[1, 2], &[0, 1, 2]];
    section(
        "Each witness, each pair, and all three",
        &[
            "witnesses",
            "agree",
            "right",
            "share right",
            "disagree",
            "the first is right",
            "only another is right",
            "none is right",
        ],
        groups.into_iter().map(row).collect(),
        "Where the witnesses have the goal when the drive ends, whether or not the robot arrived. They agree if all have it within 2.5 m of where the first one has it, and are right if the first one has it in the goal's region. A witness that has it nowhere, for example because it lies behind a gap, is not counted. Floors with the numbers 2 and 3.",
    )
}

/// Counts right arrivals by how far away regions and doors locate the goal.
fn disagreement(arrivals: &[&Arrival<'_>]) -> Section {
    let row = |name: String, is: &dyn Fn(&RoomsSaid) -> bool| {
        let own: Vec<_> = arrivals.iter().filter(|arrival| is(&arrival.rooms)).collect();
        let right = own.iter().filter(|arrival| arrival.is_right()).count();
        vec![name, own.len().to_string(), right.to_string(), share(right, own.len())]
    };
    let begins = [0.0].into_iter().chain(BIN_ENDS_M);
    let mut rows: Vec<_> = begins
        .zip(BIN_ENDS_M)
        .map(|(begin, end)| {
            let name = match end.is_finite() {
                true => format!("{begin} to {end} m away"),
                false => format!("over {begin} m away"),
            };
            row(name, &|rooms| rooms.away_m.is_some_and(|away_m| away_m >= begin && away_m < end))
        })
        .collect();
    rows.push(row("beyond a gap".to_owned(), &|rooms| rooms.has_answer && rooms.away_m.is_none()));
    rows.push(row("nowhere".to_owned(), &|rooms| !rooms.has_answer));
    section(
        "What a disagreement says",
        &["rooms and doors have the goal", "arrivals", "right", "share right"],
        rows,
        "Arrivals by how far from the robot regions and doors have the goal. Floors with the numbers 2 and 3.",
    )
}

fn share(count: usize, whole: usize) -> String {
    if whole == 0 { "–".to_owned() } else { format!("{:.0} %", 100.0 * count as f64 / whole as f64) }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"))
}

/// Fits a regression on signs to the first floor of each kind. Returns its predictions for the other floors, and its coefficients.
fn checked(signs: &Signs, arrivals: &[Arrival<'_>]) -> (Vec<(f64, bool)>, Logistic) {
    let example = |arrival: &Arrival<'_>| ((signs.of)(arrival), arrival.is_right());
    let (fitted, rest): (Vec<_>, Vec<_>) = arrivals.iter().partition(|arrival| is_fitted(arrival.outcome));
    let model = Logistic::fit(&fitted.into_iter().map(example).collect::<Vec<_>>());
    let stated =
        rest.into_iter().map(example).map(|(features, is_right)| (model.probability(&features), is_right));
    (stated.collect(), model)
}

fn combinations(arrivals: &[Arrival<'_>]) -> Section {
    let row = |signs: &Signs| {
        let (stated, model) = checked(signs, arrivals);
        let [log, brier] = losses(&stated).map(|loss| format!("{loss:.3}"));
        let coefficients: Vec<_> = model.coefficients.iter().map(|b| format!("{b:.2}")).collect();
        vec![signs.name.to_owned(), number(area_under_curve(&stated)), log, brier, coefficients.join(", ")]
    };
    section(
        "What tells right arrivals from wrong ones",
        &["signs", "area under the curve", "logarithmic loss", "squared error", "coefficients"],
        COMBINATIONS.iter().map(row).collect(),
        "Logistic regressions, fitted to the floors with the number 1 and checked on those with the numbers 2 and 3. The area is the probability that a right arrival gets a higher probability than a wrong one, and 0.5 is chance. Smaller losses are better.",
    )
}

/// Returns the share of right arrivals for each range of their stated probability.
fn bins(arrivals: &[Arrival<'_>]) -> Section {
    let (stated, _) = checked(&COMBINATIONS[COMBINATIONS.len() - 1], arrivals);
    let row = |bin: usize| {
        let [low, high] = [bin, bin + 1].map(|k| k as f64 / BINS as f64);
        let is_in = |(p, _): &&(f64, bool)| *p >= low && (*p < high || bin + 1 == BINS);
        let own: Vec<_> = stated.iter().filter(is_in).collect();
        let right = own.iter().filter(|(_, is_right)| *is_right).count();
        let mean = own.iter().map(|(p, _)| p).sum::<f64>() / own.len().max(1) as f64;
        let percent =
            |share: f64| if own.is_empty() { "–".to_owned() } else { format!("{:.0} %", 100.0 * share) };
        vec![
            format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high),
            own.len().to_string(),
            percent(mean),
            percent(right as f64 / own.len().max(1) as f64),
        ]
    };
    section(
        "Stated and actual shares on other floors",
        &["stated", "arrivals", "mean stated", "right"],
        (0..BINS).map(row).collect(),
        "The probability of a right arrival by all signs, fitted to the floors with the number 1, on those with the numbers 2 and 3.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(floor: u32, kind: Kind, away_m: f64, margin: f64) -> TaskOutcome {
        let claim = |at: f64| Some(Claim { at: [at, 0.0], is_right: at < 1.0 });
        let rooms = RoomsSaid {
            has_answer: true,
            claims: [claim(0.0), None, claim(away_m)],
            away_m: Some(away_m),
            is_same_room: false,
            share_here: if away_m < 1.0 { 0.9 } else { 0.1 },
            margin: Some(margin),
            doors_matched: 0.8,
        };
        TaskOutcome {
            cluster: Some(format!("ring-{floor}/1/7")),
            rooms: Some(rooms),
            reason: "the walls seen put the goal here: margin 9.21 at 7.2 m, misfit 0.034, a person agrees"
                .into(),
            ..TaskOutcome::sample("ring/1/7/1#1", kind)
        }
    }

    #[test]
    fn the_outline_s_own_figures_are_in_its_reason() {
        assert_eq!(of_outline(&outcome(1, Kind::Reached, 0.0, 0.0).reason), Some([9.21, 0.034]));
        assert_eq!(of_outline("0.20 m from the goal"), None);
    }

    /// Uses regions that disagree with every wrong arrival and with no right one, so that they separate the two perfectly.
    #[test]
    fn witnesses_who_know_the_failures_are_seen_to() {
        let right = (0..30).map(|k| outcome(1 + k % 2, Kind::Reached, 0.3, 8.0));
        let wrong = (0..10).map(|k| outcome(1 + k % 2, Kind::WrongArrival, 6.0, 4.0));
        let outcomes: Vec<_> = right.chain(wrong).collect();
        let [together, disagreement, combined, bins] = &sections(&outcomes)[..] else { panic!() };
        assert_eq!(together.table.rows[2][1..4], ["20", "15", "75 %"]);
        assert_eq!(together.table.rows[4][1..], ["15", "15", "100 %", "5", "5", "0", "0"]);
        assert_eq!(disagreement.table.rows[0][1..], ["15", "15", "100 %"]);
        assert_eq!(disagreement.table.rows[3][1..], ["5", "0", "0 %"]);
        assert_eq!(
            (combined.table.rows[1][1].as_str(), combined.table.rows[5][1].as_str()),
            ("0.50", "1.00")
        );
        assert!(combined.table.rows[5][2] < combined.table.rows[0][2]);
        let kept: Vec<_> = bins.table.rows.iter().map(|row| row[1].parse::<usize>().unwrap()).collect();
        assert_eq!(kept.iter().sum::<usize>(), 20);
        assert_eq!((bins.table.rows[0][3].as_str(), bins.table.rows[4][3].as_str()), ("0 %", "100 %"));
    }
}
