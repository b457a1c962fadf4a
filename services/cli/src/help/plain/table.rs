//! Tables of a page, in aligned columns without borders.

use comfy_table::{ContentArrangement, LineStyle, TableStyle};

/// Empty columns after a cell. The library adds one between two columns.
const GAP_COLUMNS: u16 = 1;
/// A line below the header. If cells take several lines, rows are separated by empty lines.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// A table while it is read. The first row is the header.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
    row: Vec<String>,
}

impl Table {
    /// Adds a cell to the current row.
    pub fn add_cell(&mut self, text: String) {
        self.row.push(text);
    }

    /// Ends the current row.
    pub fn end_row(&mut self) {
        self.rows.push(std::mem::take(&mut self.row));
    }

    /// Returns the lines of the table. A header without any text is left out.
    pub fn lines(&self, columns: usize) -> Vec<String> {
        let mut table = comfy_table::Table::new();
        table.set_content_arrangement(ContentArrangement::Dynamic);
        table.set_width(columns.try_into().unwrap_or(u16::MAX));
        let (header, rows) =
            self.rows.split_first().map_or((None, &[][..]), |(header, rows)| (Some(header), rows));
        let header = header.filter(|header| header.iter().any(|cell| !cell.is_empty()));
        if let Some(header) = header {
            table.set_header(header);
        }
        table.add_rows(rows);
        for column in table.column_iter_mut() {
            column.set_padding((0, GAP_COLUMNS));
        }
        table.load_style(STYLE);
        let header_lines = if header.is_some() { 2 } else { 0 };
        if table.lines().count() > rows.len() + header_lines {
            table.load_style(STYLE.row_separator(LineStyle::none().fill(' ').junction(' ')));
        }
        table.lines().collect()
    }
}
