//! The figures of a study: those that Boniardi et al. 2016, V, report, next to the same figures of the
//! participants here. Figures without any data yet are shown as a dash.
//!
//! The paper does not define its ±, and reports neither strokes nor the rotation of drawings. In the paper, a drive counts as
//! successful if the robot's path in the drawing is homotopic to the drawn one and ends near the goal. Here, it counts if the robot
//! reports that it has arrived and, if the goal is known, is in fact there.
//!
//! This module is pure: it takes records and returns text.

use sketchnav_schemas::statistics::{incomplete_beta, interval_of_mean, mean, variance, wilson};

use super::record::{Kept, Measures, Orientation, Outcome, SCALE, STATEMENTS, Statement};

/// A table whose first column names the line.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What it shows.
    pub title: &'static str,
    /// The headings of the columns.
    pub header: Vec<String>,
    /// Lines, each as long as the header.
    pub rows: Vec<Vec<String>>,
    /// A note about it.
    pub note: &'static str,
}

const NONE: &str = "–";
/// The successful drives of the paper, and all of them.
const PUBLISHED: [usize; 2] = [17, 25];
/// The limits of the groups of drawing times, minutes.
const MINUTES: [f64; 3] = [1.0, 2.0, 4.0];

/// Returns all tables, in the order of the page.
pub fn tables(all: &[Kept]) -> [Table; 5] {
    [overview(all), by_time(all), by_sheet(all), by_rotation(all), answers(all)]
}

/// The measures and outcomes of the drives that have been judged.
fn drives(all: &[Kept]) -> Vec<(&Kept, &Measures, &Outcome)> {
    all.iter()
        .filter_map(|kept| Some((kept, &kept.drive.as_ref()?.measures, kept.outcome.as_ref()?)))
        .collect()
}

fn overview(all: &[Kept]) -> Table {
    let measured: Vec<_> = all.iter().filter_map(|kept| Some(kept.drive.as_ref()?.measures)).collect();
    let of = |figure: fn(&Measures) -> f64| measured.iter().map(figure).collect::<Vec<_>>();
    let minutes = of(|measures| measures.drawing_s / 60.0);
    let ages: Vec<_> = all.iter().filter_map(|kept| kept.participant.age.map(f64::from)).collect();
    let drives = drives(all);
    let outcomes: Vec<_> = drives.iter().map(|(_, _, outcome)| outcome.success).collect();
    let row = |name: &str, published: &str, here: String| vec![name.to_owned(), published.to_owned(), here];
    let answered = all.iter().filter(|kept| kept.answers.is_some()).count();
    let [reached, attempts] = PUBLISHED;
    let rows = vec![
        row("participants", "13", count(all.len())),
        row("of these, finished", "13", count(answered)),
        row("age, years", "22 to 32", range(&ages, 0)),
        row("drawing time, minutes: mean ± standard deviation", "2.38 ± 1.42", spread(&minutes, 2)),
        row("its 95 % interval", NONE, interval(&minutes)),
        row("its range", "27 s to more than 6 minutes", range(&minutes, 2)),
        row("time for the path, minutes", NONE, spread(&of(|measures| measures.path_s / 60.0), 2)),
        row("strokes", NONE, spread(&of(|measures| measures.strokes.into()), 1)),
        row("undone steps", NONE, spread(&of(|measures| measures.undone.into()), 1)),
        row("uses of the eraser", NONE, spread(&of(|measures| measures.erased.into()), 1)),
        row("successful drives", &success(reached, attempts), success_of(&outcomes)),
        row("correlation of drawing time and success", "none significant", correlation_of(&drives)),
    ];
    let header = ["", "Boniardi et al. 2016", "here"].map(str::to_owned).to_vec();
    let note = "The paper's 25 drives are those of its 13 participants and 12 more in a second place. It does not say what \
         its ± is.";
    Table { title: "The study", header, rows, note }
}

fn by_time(all: &[Kept]) -> Table {
    let drives = drives(all);
    let limits = [&[0.0], &MINUTES[..], &[f64::INFINITY]].concat();
    let row = |pair: &[f64]| {
        let (from, to) = (pair[0], pair[1]);
        let name = if to.is_finite() {
            format!("{from} to {to} minutes")
        } else {
            format!("{from} minutes or more")
        };
        let within =
            drives.iter().filter(|(_, measures, _)| (from..to).contains(&(measures.drawing_s / 60.0)));
        shares(name, &within.map(|(_, _, outcome)| outcome.success).collect::<Vec<_>>())
    };
    Table {
        title: "Success by drawing time",
        header: header("drawing time"),
        rows: limits.windows(2).map(row).collect(),
        note: "The paper observed no significant correlation and gives no figures.",
    }
}

fn by_sheet(all: &[Kept]) -> Table {
    let drives = drives(all);
    let row = |sheet: Orientation| {
        let of_sheet: Vec<_> = drives.iter().filter(|(kept, ..)| kept.participant.sheet == sheet).collect();
        let mut cells = shares(
            sheet.word().to_owned(),
            &of_sheet.iter().map(|(_, _, outcome)| outcome.success).collect::<Vec<_>>(),
        );
        let minutes: Vec<_> = of_sheet.iter().map(|(_, measures, _)| measures.drawing_s / 60.0).collect();
        let held = of_sheet.iter().filter(|(_, measures, _)| measures.screen == sheet).count();
        cells.extend([spread(&minutes, 2), count_of(held, of_sheet.len())]);
        cells.push(if sheet == Orientation::Portrait { "higher" } else { "lower" }.into());
        cells
    };
    let mut header = header("sheet");
    header.extend(["minutes", "screen held the same way", "success in the paper"].map(str::to_owned));
    let note = "The paper's two groups held the tablet in these ways. It gives no figures for them.";
    Table { title: "Orientation of the sheet", header, rows: Orientation::ALL.map(row).to_vec(), note }
}

/// The rotation of drawings relative to the floor, to the nearest of four quarter turns.
fn by_rotation(all: &[Kept]) -> Table {
    const TURNS: [&str; 4] =
        ["as the floor", "a quarter turn to the left", "upside down", "a quarter turn to the right"];
    let drives = drives(all);
    let row = |(turn, name): (usize, &&str)| {
        let of_turn = drives.iter().filter(|(_, _, outcome)| quarter(outcome.rotation_deg) == turn);
        shares((*name).to_owned(), &of_turn.map(|(_, _, outcome)| outcome.success).collect::<Vec<_>>())
    };
    Table {
        title: "Orientation of the drawing against the floor",
        header: header("the drawing lies"),
        rows: TURNS.iter().enumerate().map(row).collect(),
        note: "By the direction in which the path begins, against the robot's true heading at the start. Not in the paper.",
    }
}

/// Quarter turns to the left, 0 to 3.
fn quarter(rotation_deg: f64) -> usize {
    (rotation_deg / 90.0).round().rem_euclid(4.0) as usize
}

fn answers(all: &[Kept]) -> Table {
    let row = |statement: &Statement| {
        let given = all.iter().filter_map(|kept| kept.answers.as_ref()?.ratings.get(statement.key).copied());
        let ratings: Vec<f64> = given.map(f64::from).collect();
        let mut cells = vec![statement.text.to_owned()];
        let with = |rating: usize| ratings.iter().filter(|&&given| given as usize == rating).count();
        cells.extend(
            (1..=SCALE.len())
                .map(|rating| if ratings.is_empty() { NONE.into() } else { with(rating).to_string() }),
        );
        let agree = ratings.iter().filter(|&&rating| rating > 3.0).count();
        cells.extend([spread(&ratings, 2), success(agree, ratings.len()), statement.published.to_owned()]);
        cells
    };
    let mut header = vec!["statement".to_owned()];
    header.extend(SCALE.iter().zip(1..).map(|(word, rating)| format!("{rating}: {}", word.to_lowercase())));
    header
        .extend(["mean ± standard deviation", "agree or strongly agree", "in the paper"].map(str::to_owned));
    let note = "The wording of the statements is ours; they ask about what the text of the paper reports of its questionnaire.";
    Table { title: "Answers", header, rows: STATEMENTS.iter().map(row).collect(), note }
}

// ---------------------------------------------------------------------------- participants

/// Returns `participants.csv`, with a header and a line for each participant.
pub fn participants(all: &[Kept]) -> (Vec<String>, Vec<Vec<String>>) {
    let known = ["code", "age", "sheet", "screen", "drawing_s", "path_s", "strokes", "undone", "erased"];
    let judged = ["success", "state", "time_s", "path_m", "final_error_m", "rotation_deg"];
    let asked = STATEMENTS.map(|statement| statement.key);
    let header = [&known[..], &judged, &asked, &["suggestions"]].concat();
    (header.into_iter().map(str::to_owned).collect(), all.iter().map(line).collect())
}

fn line(kept: &Kept) -> Vec<String> {
    let text = |value: Option<String>| value.unwrap_or_default();
    let measures = kept.drive.as_ref().map(|drive| drive.measures);
    let (outcome, answers) = (kept.outcome.as_ref(), kept.answers.as_ref());
    let mut cells = vec![
        kept.participant.code.clone(),
        text(kept.participant.age.map(|age| age.to_string())),
        kept.participant.sheet.word().to_owned(),
        text(measures.map(|measures| measures.screen.word().to_owned())),
        text(measures.map(|measures| measures.drawing_s.to_string())),
        text(measures.map(|measures| measures.path_s.to_string())),
        text(measures.map(|measures| measures.strokes.to_string())),
        text(measures.map(|measures| measures.undone.to_string())),
        text(measures.map(|measures| measures.erased.to_string())),
        text(outcome.map(|outcome| outcome.success.to_string())),
        text(outcome.map(|outcome| outcome.state.clone())),
        text(outcome.map(|outcome| outcome.time_s.to_string())),
        text(outcome.map(|outcome| outcome.path_m.to_string())),
        text(outcome.and_then(|outcome| outcome.final_error_m).map(|error| error.to_string())),
        text(outcome.map(|outcome| outcome.rotation_deg.to_string())),
    ];
    cells.extend(STATEMENTS.iter().map(|Statement { key, .. }| {
        text(answers.and_then(|answers| answers.ratings.get(*key)).map(u8::to_string))
    }));
    cells.push(text(answers.map(|answers| answers.suggestions.clone())));
    cells
}

/// Returns the participants as a table of comma-separated values (RFC 4180), in the order of their codes.
///
/// # Errors
/// Never: it is written to memory.
pub fn csv(all: &[Kept]) -> csv::Result<Vec<u8>> {
    let (header, rows) = participants(all);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header)?;
    rows.iter().try_for_each(|row| writer.write_record(row))?;
    writer.into_inner().map_err(|error| error.into_error().into())
}

// ---------------------------------------------------------------------------- figures as text

fn header(first: &str) -> Vec<String> {
    [first, "drives", "successful", "%", "95 %"].map(str::to_owned).to_vec()
}

/// A line of [`header`].
fn shares(name: String, outcomes: &[bool]) -> Vec<String> {
    let (reached, attempts) = (outcomes.iter().filter(|success| **success).count(), outcomes.len());
    if attempts == 0 {
        return [name].into_iter().chain([(); 4].map(|()| NONE.to_owned())).collect();
    }
    let [low, high] = wilson(reached, attempts).map(|share| 100.0 * share);
    let percent = 100.0 * reached as f64 / attempts as f64;
    vec![
        name,
        attempts.to_string(),
        reached.to_string(),
        format!("{percent:.1}"),
        format!("{low:.0} to {high:.0}"),
    ]
}

/// A share with Wilson's interval.
fn success(reached: usize, attempts: usize) -> String {
    if attempts == 0 {
        return NONE.into();
    }
    let [low, high] = wilson(reached, attempts).map(|share| 100.0 * share);
    let percent = 100.0 * reached as f64 / attempts as f64;
    format!("{percent:.1} % ({low:.0} to {high:.0}) of {attempts}")
}

fn success_of(outcomes: &[bool]) -> String {
    success(outcomes.iter().filter(|success| **success).count(), outcomes.len())
}

fn count(number: usize) -> String {
    if number == 0 { NONE.into() } else { number.to_string() }
}

fn count_of(number: usize, all: usize) -> String {
    if all == 0 { NONE.into() } else { format!("{number} of {all}") }
}

/// Mean ± standard deviation.
fn spread(numbers: &[f64], digits: usize) -> String {
    match variance(numbers) {
        Some(variance) => format!("{:.digits$} ± {:.digits$}", mean(numbers), variance.sqrt()),
        None => numbers.first().map_or(NONE.into(), |only| format!("{only:.digits$}")),
    }
}

fn interval(numbers: &[f64]) -> String {
    interval_of_mean(numbers).map_or(NONE.into(), |[low, high]| format!("{low:.2} to {high:.2}"))
}

fn range(numbers: &[f64], digits: usize) -> String {
    let low = numbers.iter().copied().reduce(f64::min);
    let high = numbers.iter().copied().reduce(f64::max);
    low.zip(high).map_or(NONE.into(), |(low, high)| format!("{low:.digits$} to {high:.digits$}"))
}

fn correlation_of(drives: &[(&Kept, &Measures, &Outcome)]) -> String {
    let pairs: Vec<_> = (drives.iter())
        .map(|(_, measures, outcome)| [measures.drawing_s, f64::from(u8::from(outcome.success))])
        .collect();
    correlation(&pairs).map_or(NONE.into(), |[r, p]| format!("r = {r:.2}, p = {p:.2}"))
}

/// Returns Pearson's correlation and the probability of one at least as strong by chance (Student's t).
/// Returns `None` if there are fewer than three pairs, or if one of the two never varies.
fn correlation(pairs: &[[f64; 2]]) -> Option<[f64; 2]> {
    let column = |k: usize| pairs.iter().map(|pair| pair[k]).collect::<Vec<_>>();
    let [a, b] = [0, 1].map(column);
    let freedom = pairs.len().checked_sub(2).filter(|freedom| *freedom > 0)? as f64;
    let spread = (variance(&a)? * variance(&b)?).sqrt();
    let products: f64 = pairs.iter().map(|pair| (pair[0] - mean(&a)) * (pair[1] - mean(&b))).sum();
    let r = (products / (freedom + 1.0) / spread).clamp(-1.0, 1.0);
    // ν / (ν + t²) = 1 − r².
    (spread > 0.0).then(|| [r, incomplete_beta(freedom / 2.0, 0.5, 1.0 - r * r)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::record::tests::{answers as rated, any_kept, measures};
    use super::super::record::{Drive, Participant};
    use super::*;

    fn kept(code: &str, sheet: Orientation, drawing_s: f64, success: bool, rotation_deg: f64) -> Kept {
        let drive = Drive {
            drawing: String::new(),
            path: String::new(),
            recording: String::new(),
            measures: measures(drawing_s),
        };
        let outcome = Outcome {
            success,
            state: "reached".into(),
            reason: String::new(),
            time_s: 20.0,
            path_m: 8.0,
            final_error_m: Some(0.25),
            rotation_deg,
        };
        Kept {
            participant: Participant { code: code.into(), age: Some(27), sheet },
            drive: Some(drive),
            answers: Some(rated(if success { 5 } else { 2 }, "")),
            outcome: Some(outcome),
        }
    }

    fn row<'a>(table: &'a Table, name: &str) -> Vec<&'a str> {
        let row = table.rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("{name}: {table:?}"));
        row.iter().map(String::as_str).collect()
    }

    /// Without participants, their column must be empty.
    #[test]
    fn without_participants_only_the_paper_has_figures() {
        for table in tables(&[]) {
            let published =
                table.header.iter().position(|name| name.contains("paper") || name.contains("2016"));
            for cells in &table.rows {
                assert_eq!(cells.len(), table.header.len(), "{cells:?}");
                let ours = cells.iter().enumerate().skip(1).filter(|(i, _)| Some(*i) != published);
                assert!(ours.clone().all(|(_, cell)| cell == NONE), "{}: {cells:?}", table.title);
            }
        }
        let overview = &tables(&[])[0];
        assert_eq!(
            row(overview, "successful drives"),
            ["successful drives", "68.0 % (48 to 83) of 25", NONE]
        );
        assert_eq!(row(overview, "drawing time, minutes: mean ± standard deviation")[1], "2.38 ± 1.42");
        assert_eq!(csv(&[]).unwrap().iter().filter(|byte| **byte == b'\n').count(), 1);
    }

    #[test]
    fn participants_are_counted_beside_the_paper() {
        let all = [
            kept("a", Orientation::Landscape, 30.0, false, 2.0),
            kept("b", Orientation::Portrait, 90.0, true, -88.0),
            kept("c", Orientation::Landscape, 150.0, true, 178.0),
            kept("d", Orientation::Portrait, 210.0, true, -179.0),
        ];
        let [overview, by_time, by_sheet, by_rotation, answers] = tables(&all);
        assert_eq!(row(&overview, "participants")[2], "4");
        assert_eq!(row(&overview, "age, years")[2], "27 to 27");
        assert_eq!(row(&overview, "drawing time, minutes: mean ± standard deviation")[2], "2.00 ± 1.29");
        assert_eq!(row(&overview, "its range")[2], "0.50 to 3.50");
        assert_eq!(row(&overview, "successful drives")[2], "75.0 % (30 to 95) of 4");
        assert_eq!(row(&overview, "correlation of drawing time and success")[2], "r = 0.77, p = 0.23");
        assert_eq!(row(&by_time, "0 to 1 minutes")[1..], ["1", "0", "0.0", "0 to 79"]);
        assert_eq!(row(&by_time, "2 to 4 minutes")[1..4], ["2", "2", "100.0"]);
        assert_eq!(row(&by_time, "4 minutes or more")[1], NONE);
        assert_eq!(row(&by_sheet, "portrait")[1..4], ["2", "2", "100.0"]);
        assert_eq!(row(&by_sheet, "landscape")[6], "2 of 2");
        let turns: Vec<_> = by_rotation.rows.iter().map(|row| row[1].as_str()).collect();
        assert_eq!(turns, ["1", NONE, "2", "1"]);
        let first = row(&answers, STATEMENTS[0].text);
        assert_eq!(
            first[1..],
            ["0", "1", "0", "0", "3", "4.25 ± 1.50", "75.0 % (30 to 95) of 4", "mean 4.09"]
        );
    }

    /// A participant who left before the drive is counted as a participant, but in no other figure.
    #[test]
    fn who_has_not_finished_counts_as_far_as_they_came() {
        let half = Kept {
            drive: None,
            answers: None,
            outcome: None,
            ..kept("a", Orientation::Portrait, 1.0, true, 0.0)
        };
        let [overview, ..] = tables(std::slice::from_ref(&half));
        assert_eq!(row(&overview, "participants")[2], "1");
        assert_eq!((row(&overview, "of these, finished")[2], row(&overview, "strokes")[2]), (NONE, NONE));
        let (header, rows) = participants(&[half]);
        assert_eq!(rows[0].len(), header.len());
        assert_eq!(rows[0].iter().filter(|cell| !cell.is_empty()).count(), 3);
    }

    /// R's cor.test(c(1, 2, 3, 4, 5), c(2, 1, 4, 3, 5)): r = 0.8, t = 2.3094 on 3 degrees of freedom, p = 0.1041.
    #[test]
    fn a_correlation_is_that_of_the_books() {
        let [r, p] = correlation(&[[1.0, 2.0], [2.0, 1.0], [3.0, 4.0], [4.0, 3.0], [5.0, 5.0]]).unwrap();
        assert!((r - 0.8).abs() < 1e-9 && (p - 0.1041).abs() < 1e-4, "{r} {p}");
        assert_eq!(correlation(&[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]]), None);
        assert_eq!(correlation(&[[1.0, 1.0], [2.0, 2.0]]), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Tests arbitrary text in the suggestions.
        #[test]
        fn a_table_in_csv_is_read_as_it_was_written(all in prop::collection::vec(any_kept(), 0..4)) {
            let text = csv(&all).unwrap();
            let mut reader = csv::Reader::from_reader(text.as_slice());
            let (header, rows) = participants(&all);
            prop_assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>(), header);
            let read: Vec<Vec<String>> =
                reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
            prop_assert_eq!(&read, &rows);
            for (row, kept) in read.iter().zip(&all) {
                let measures = kept.drive.as_ref().unwrap().measures;
                prop_assert_eq!(row[4].parse::<f64>(), Ok(measures.drawing_s));
            }
        }
    }
}
