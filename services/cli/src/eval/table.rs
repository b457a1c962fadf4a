//! Tables of outcomes for the terminal.

use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use sketchnav_eval::statistics::Tally;
use sketchnav_eval::{Kind, Outcome, Suite};

/// The suite's own table: after the paper, where there is one, else by drawing.
pub fn of_suite(suite: &Suite, outcomes: &[&Outcome]) -> String {
    let counted: Vec<_> = outcomes.iter().copied().filter(|ended| suite.counts(ended)).collect();
    let kinds = by_drawing(suite, &counted);
    if suite.legs.is_empty() {
        return kinds.to_string();
    }
    let others = Tally::of(outcomes.iter().copied().filter(|ended| !suite.counts(ended)));
    let note = match others.attempts {
        0 => String::new(),
        n => format!("\nConnecting legs, not counted: {} of {n} reached.", others.reached),
    };
    format!("{}\n{kinds}{note}", by_leg(suite, &counted))
}

/// The paper's table beside ours: a line for each leg, a column for each drawing.
fn by_leg(suite: &Suite, outcomes: &[&Outcome]) -> Table {
    let drawings = suite.drawings();
    let papers = suite.legs.iter().map(|leg| leg.paper.len()).max().unwrap_or_default();
    let mut table = empty();
    let mut header = vec!["path".to_owned(), "length".into()];
    header.extend(drawings.iter().map(|drawing| format!("here {drawing}")));
    header.push("paper: length".into());
    header.extend((0..papers).map(|i| format!("paper {}", char::from(b'A' + i as u8))));
    table.set_header(header);
    for leg in &suite.legs {
        let tally = |drawing: &String| {
            Tally::of(outcomes.iter().copied().filter(|e| e.task == leg.name && e.drawing == *drawing))
        };
        let length = leg.length_m.map_or("–".into(), |length| format!("{length:.1} m"));
        let mut cells = vec![leg.name.clone(), length];
        cells.extend(drawings.iter().map(tally).map(|tally| format!("{}/{}", tally.reached, tally.attempts)));
        cells.push(format!("{:.1} m", leg.paper_length_m));
        cells.extend(leg.paper.iter().map(|(reached, attempts)| format!("{reached}/{attempts}")));
        table.add_row(cells);
    }
    let mut cells = vec!["all, %".to_owned(), String::new()];
    cells.extend(drawings.iter().map(|drawing| {
        percent(Tally::of(outcomes.iter().copied().filter(|ended| ended.drawing == *drawing)).rate())
    }));
    cells.push(String::new());
    cells.extend((0..papers).map(|i| percent(paper_rate(suite, i))));
    table.add_row(cells);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Of all attempts in a column of the paper's table.
fn paper_rate(suite: &Suite, column: usize) -> Option<f64> {
    let cells = suite.legs.iter().filter_map(|leg| leg.paper.get(column));
    let (reached, attempts) = cells.fold((0, 0), |(r, a), (reached, attempts)| (r + reached, a + attempts));
    (attempts > 0).then(|| f64::from(reached) / f64::from(attempts))
}

/// A line for each drawing, and one for all.
fn by_drawing(suite: &Suite, outcomes: &[&Outcome]) -> Table {
    let mut table = empty();
    let mut header =
        vec![suite.lines.unwrap_or("drawing").to_owned(), "reached".into(), "%".into(), "95 %".into()];
    header.extend(Kind::ALL[1..].iter().map(|kind| kind.word().to_owned()));
    header.extend(["with collision".into(), "failures known".into()]);
    table.set_header(header);
    for drawing in suite.drawings() {
        let of_drawing = outcomes.iter().filter(|ended| ended.drawing == drawing);
        table.add_row(line(&drawing, Tally::of(of_drawing.copied())));
    }
    table.add_row(line("all", Tally::of(outcomes.iter().copied())));
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn line(name: &str, tally: Tally) -> Vec<String> {
    let [low, high] = tally.interval();
    let mut cells = vec![
        name.to_owned(),
        format!("{}/{}", tally.reached, tally.attempts),
        percent(tally.rate()),
        format!("{:.0}–{:.0}", 100.0 * low, 100.0 * high),
    ];
    cells.extend(Kind::ALL[1..].iter().map(|&kind| tally.count(kind).to_string()));
    cells.extend([tally.with_collision.to_string(), percent(tally.share_that_knows())]);
    cells
}

/// A share as a figure; a dash where there is none.
fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |share| format!("{:.1}", 100.0 * share))
}

/// A table in the style of all others.
fn empty() -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table
}
