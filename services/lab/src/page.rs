//! Self-contained HTML pages: their frame and style, tables, and curves over time. Pages work in light and dark mode and fit the
//! screen of a phone.
//!
//! This module is pure: the same content yields the same page.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use sketchnav_schemas::shown;

/// Maximum length, in characters, of a cell that is laid out as a value. Longer cells are text, so they are left-aligned
/// and may wrap.
const LONGEST_IN_A_LINE: usize = 32;
const STYLE: &str = include_str!("page/style.css");

/// Returns a complete page. Since names may come from anywhere, hidden characters in the content are made visible, as on a
/// terminal.
pub fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (body) } }
        }
    };
    shown::lines(page.into_string())
}

/// Returns a table. The first cell of each row is its heading.
pub fn table(header: &[String], rows: &[Vec<String>]) -> Markup {
    html! {
        div.scroll {
            table {
                @if !header.is_empty() { thead { tr { @for cell in header { th scope="col" { (cell) } } } } }
                tbody {
                    @for row in rows {
                        tr {
                            @for (i, cell) in row.iter().enumerate() {
                                @let is_text = cell.chars().count() > LONGEST_IN_A_LINE;
                                @if i == 0 { th scope="row" { (cell) } } @else { td.text[is_text] { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A curve of a value over time, or over another quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name of the value.
    pub name: String,
    /// Points of the curve: the position along the horizontal axis, mostly in seconds, and the value. Points that are not finite
    /// are left out.
    pub points: Vec<[f64; 2]>,
}

/// A chart of values over time, or over another quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart<'a> {
    /// Heading of the chart.
    pub title: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// The curves.
    pub series: &'a [Series],
    /// Unit of the horizontal axis, for example `s` for time.
    pub x_unit: &'a str,
    /// First and last position along the horizontal axis, mostly in seconds.
    pub span: [f64; 2],
    /// Positions at which tasks began.
    pub marks: &'a [f64],
    /// Positions at which processes died.
    pub faults: &'a [f64],
}

/// Width and height of a chart. `RIM` is the space around its plot: left, top, right and bottom.
const SIZE: [f64; 2] = [340.0, 210.0];
const RIM: [f64; 4] = [40.0, 10.0, 10.0, 30.0];
/// Maximum number of points in a curve. More would be closer together than pixels.
const MOST_POINTS: usize = 320;
const LINES: usize = 4;

impl Chart<'_> {
    /// Returns the chart with its heading and legend.
    pub fn figure(&self) -> Markup {
        let top = self.top();
        let [left, rim_top, right, below] = RIM;
        let [begin, end] = self.span;
        let x = |s: f64| left + (s - begin) / (end - begin).max(1e-9) * (SIZE[0] - left - right);
        let y = |value: f64| rim_top + (1.0 - (value / top).clamp(0.0, 1.0)) * (SIZE[1] - rim_top - below);
        let path = |series: &Series| {
            let place = |[s, value]: [f64; 2]| format!("{:.1},{:.1}", x(s), y(value));
            thinned(&series.points).into_iter().map(place).collect::<Vec<_>>().join(" ")
        };
        let (low, high) = (SIZE[1] - below, rim_top);
        html! {
            figure.card {
                figcaption { (self.title) " " small { (self.unit) } }
                svg viewBox={ "0 0 " (SIZE[0]) " " (SIZE[1]) } role="img" {
                    title { (self.title) " over " (self.x_unit) }
                    @for i in 0..=LINES {
                        @let value = top * i as f64 / LINES as f64;
                        line.grid x1=(left) x2=(SIZE[0] - right) y1=(y(value)) y2=(y(value)) {}
                        text x=(left - 5.0) y=(y(value) + 4.0) text-anchor="end" { (short(value)) }
                    }
                    @for &s in self.marks { line.mark x1=(fixed(x(s))) x2=(fixed(x(s))) y1=(high) y2=(low) {} }
                    @for i in 0..=LINES {
                        @let s = begin + (end - begin) * i as f64 / LINES as f64;
                        text x=(fixed(x(s))) y=(SIZE[1] - 12.0) text-anchor=(anchor(i)) { (short(s)) @if i == LINES { " " (self.x_unit) } }
                    }
                    @for (style, series) in self.series.iter().enumerate() {
                        g class={ "m" (style % 5) } { polyline.curve points=(path(series)) {} }
                    }
                    @for &s in self.faults { line.fault x1=(fixed(x(s))) x2=(fixed(x(s))) y1=(high) y2=(low) {} }
                }
                @if self.series.len() > 1 {
                    p.legend {
                        @for (style, series) in self.series.iter().enumerate() {
                            span { span class={ "key m" (style % 5) } {} (series.name) }
                        }
                    }
                }
            }
        }
    }

    /// Returns the value at the upper edge of the chart, which is a round number.
    fn top(&self) -> f64 {
        let values = self.series.iter().flat_map(|series| series.points.iter().map(|point| point[1]));
        let largest = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
        let unit = 10_f64.powf((largest.max(1e-6)).log10().floor());
        [1.0, 2.0, 4.0, 6.0, 8.0, 10.0]
            .into_iter()
            .map(|n| n * unit)
            .find(|top| *top >= largest)
            .unwrap_or(largest)
    }
}

fn anchor(i: usize) -> &'static str {
    if i == LINES { "end" } else { "middle" }
}

fn fixed(value: f64) -> String {
    format!("{value:.1}")
}

/// Formats a value with about three significant digits, since more cannot be read off a chart.
fn short(value: f64) -> String {
    let text = match value.abs() {
        v if v >= 100.0 || v == 0.0 => format!("{value:.0}"),
        v if v >= 1.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    };
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Keeps the largest of every few points, so that no peak is lost.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let finite: Vec<_> = points.iter().copied().filter(|p| p[0].is_finite() && p[1].is_finite()).collect();
    let each = finite.len().div_ceil(MOST_POINTS).max(1);
    let peak = |piece: &[[f64; 2]]| piece.iter().copied().max_by(|a, b| a[1].total_cmp(&b[1]));
    finite.chunks(each).filter_map(peak).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_self_contained_and_escapes_its_text() {
        let points = (0..1000).map(|i| [f64::from(i), f64::from(i % 7)]).collect();
        let series = [Series { name: "<a>".into(), points }, Series { name: "b".into(), points: vec![] }];
        let chart = Chart {
            title: "t & u",
            unit: "m",
            series: &series,
            x_unit: "s",
            span: [0.0, 999.0],
            marks: &[5.0],
            faults: &[9.0],
        };
        let rows = [vec!["<row>".to_owned(), "1".to_owned()]];
        let page = document("x < y", &html! { (chart.figure()) (table(&["h".to_owned()], &rows)) });
        for word in ["x &lt; y", "t &amp; u", "&lt;a&gt;", "&lt;row&gt;", "class=\"fault\""] {
            assert!(page.contains(word), "{word}");
        }
        for reference in ["http", "src=", "@import", "url("] {
            assert!(!page.contains(reference), "{reference}");
        }
    }

    #[test]
    fn a_chart_keeps_peaks_and_draws_nothing_for_empty_series() {
        let mut points: Vec<[f64; 2]> = (0..5000).map(|i| [f64::from(i), 0.1]).collect();
        points[1234][1] = 9.0;
        points[77][1] = f64::NAN;
        let thin = thinned(&points);
        assert!(thin.len() <= MOST_POINTS && thin.iter().any(|p| p[1] == 9.0));
        assert!(thinned(&[]).is_empty());
        assert_eq!((short(0.25), short(12.0), short(1500.0)), ("0.25".into(), "12".into(), "1500".into()));
    }
}
