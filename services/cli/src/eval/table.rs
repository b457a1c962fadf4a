//! Tables of outcomes for the terminal.

use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use sketchnav_eval::statistics::Tally;
use sketchnav_eval::{Kind, Outcome, Suite};

/// A line for each drawing, and one for all.
pub fn by_drawing(suite: &Suite, outcomes: &[&Outcome]) -> Table {
    let mut table = empty();
    let mut header = vec!["drawing".to_owned(), "reached".into(), "%".into(), "95 %".into()];
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
pub fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |share| format!("{:.1}", 100.0 * share))
}

/// A table in the style of all others.
pub fn empty() -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table
}
