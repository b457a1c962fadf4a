//! Tables of outcomes for the terminal.

use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use sketchnav_lab::experiments::{Suite, TaskOutcome, table};

/// Formats the outcomes of a suite's tasks driven by one method.
pub fn of_suite(suite: &Suite, outcomes: &[&TaskOutcome]) -> String {
    let tables = table::of_suite(suite, outcomes).into_iter().map(|table| drawn(table).to_string());
    tables.chain(table::note(suite, outcomes)).collect::<Vec<_>>().join("\n")
}

/// Formats a table of words.
pub fn of_words(table: &table::Table) -> String {
    drawn(table.clone()).to_string()
}

/// Draws a table in the style that all tables share.
fn drawn(words: table::Table) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table.set_header(words.header);
    table.add_rows(words.rows);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
