//! The page of a study: its tables, its curves, and shares with their intervals.

use maud::{Markup, html};

use super::{Drawn, Figure, Study, Table};
use crate::experiments::table;
use crate::page::{self, Chart, Series};

/// Renders the page of a study.
pub fn page(study: &Study, figures: &[Figure], command: &str) -> String {
    let body = html! {
        h1 { (study.name) }
        p.lead { (study.title) }
        pre { code { (command) } }
        @for figure in figures {
            h2 { (figure.table.title) }
            (drawn(figure))
            @let words = words(&figure.table);
            (page::table(&words.header, &words.rows))
        }
    };
    page::document(&format!("{} · sketchnav eval", study.name), &body)
}

/// Returns the table with its numbers formatted as text.
pub fn words(table: &Table) -> table::Table {
    let row = |(name, values): &(String, Vec<f64>)| {
        std::iter::once(name.clone()).chain(values.iter().map(|value| number(*value))).collect()
    };
    table::Table { header: table.head.clone(), rows: table.rows.iter().map(row).collect() }
}

/// Formats a number with as many digits as are meaningful.
pub fn number(value: f64) -> String {
    match value.abs() {
        size if value.fract() == 0.0 && size < 1e9 => format!("{value:.0}"),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

fn drawn(figure: &Figure) -> Markup {
    match &figure.drawn {
        Drawn::Nothing => html! {},
        Drawn::Curves { x_unit, unit, columns } => curves(figure, x_unit, unit, columns),
        Drawn::Shares(columns) => shares(figure, *columns),
    }
}

fn curves(figure: &Figure, x_unit: &str, unit: &str, columns: &[usize]) -> Markup {
    let xs: Vec<f64> = figure.table.rows.iter().filter_map(|(name, _)| name.parse().ok()).collect();
    let series = columns.iter().map(|&column| Series {
        name: figure.table.head[column + 1].clone(),
        points: xs.iter().copied().zip(figure.table.column(column)).map(|(x, y)| [x, y]).collect(),
    });
    let series: Vec<_> = series.collect();
    let end = xs.iter().copied().fold(0.0, f64::max);
    let chart = Chart { title: "", unit, x_unit, series: &series, span: [0.0, end], marks: &[], faults: &[] };
    html! { div.cards { (chart.figure()) } }
}

fn shares(figure: &Figure, [share, low, high]: [usize; 3]) -> Markup {
    let percent = |value: f64| format!("{value:.2}%");
    html! {
        div.plot {
            div.row.axis { span.name {} div.scale { @for p in [0, 25, 50, 75, 100] { span { (p) " %" } } } span.value {} }
            @for (name, values) in &figure.table.rows {
                div.row {
                    span.name { (name) }
                    svg.m0 height="18" role="img" {
                        title { (format!("{name}: {:.1} %, 95 % interval {:.1} to {:.1}", values[share], values[low], values[high])) }
                        @for at in ["0%", "25%", "50%", "75%", "100%"] { line.grid x1=(at) x2=(at) y1="0" y2="18" {} }
                        line.whisker x1=(percent(values[low])) x2=(percent(values[high])) y1="9" y2="9" {}
                        circle cx=(percent(values[share])) cy="9" r="4.5" {}
                    }
                    span.value { (format!("{:.1} %", values[share])) }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::studies::{Size, find};
    use crate::experiments::suite::Folders;

    #[test]
    fn the_page_has_curves_and_numbers() {
        let study = find("directions-components").unwrap();
        let figures = study.run(&Folders::of_checkout(), Size { worlds: 1, seed: 1 }, 1).unwrap();
        let page = page(study, &figures, "sketchnav eval directions-components");
        for words in ["polyline", "trajectories", "450", "sketchnav eval directions-components"] {
            assert!(page.contains(words), "{words}");
        }
        assert_eq!([3.0, 0.125, 12.25, 1234.5].map(number), ["3", "0.125", "12.2", "1234"]);
    }
}
