//! Plots as inline SVG: intervals, endings and curves.

use maud::{Markup, html};

use crate::experiments::outcome::Kind;
use crate::experiments::section::{Form, Mark, Plot};
use crate::experiments::statistics::Tally;
use crate::experiments::suite::Curve;
use crate::experiments::table::percent;

/// Style of published figures. The styles of methods are numbered from 0.
pub const PAPER: usize = 9;

/// A success rate with its interval.
pub struct Dot {
    name: String,
    style: usize,
    tally: Tally,
}

impl Dot {
    /// Creates a dot for the success rate of a method, in the method's style.
    pub fn of(name: &str, style: usize, tally: Tally) -> Self {
        Self { name: name.to_owned(), style, tally }
    }
}

/// The ways in which a group of tasks ended.
pub struct Bar {
    /// Name of the group.
    pub name: String,
    /// Tally of the group.
    pub tally: Tally,
}

/// Draws a legend for the colours of the methods.
pub fn legend(names: &[String]) -> Markup {
    html! {
        p.legend {
            @for (style, name) in names.iter().enumerate() { span { span class={ "key m" (style) } {} (name) } }
        }
    }
}

/// Draws the dots of each group in a row. All rows have the same scale, so that they can be compared down the page.
pub fn intervals(groups: &[(String, Vec<Dot>)]) -> Markup {
    html! {
        div.plot {
            div.row.axis { span.name {} div.scale { @for p in [0, 25, 50, 75, 100] { span { (p) " %" } } } span.value {} }
            @for (group, dots) in groups {
                @for (i, dot) in dots.iter().enumerate() {
                    div.row {
                        span.name { @if i == 0 { (group) } }
                        (interval(dot))
                        span.value { (percent(dot.tally.rate())) " % " small { (dot.tally.reached) "/" (dot.tally.attempts) } }
                    }
                }
            }
        }
    }
}

fn interval(dot: &Dot) -> Markup {
    let [low, high] = dot.tally.interval().map(share);
    let rate = dot.tally.rate().map(share);
    let said = format!("{}: {} %, 95 % interval {low} to {high}", dot.name, percent(dot.tally.rate()));
    html! {
        svg class={ "m" (dot.style) } height="18" role="img" {
            title { (said) }
            @for at in ["0%", "25%", "50%", "75%", "100%"] { line.grid x1=(at) x2=(at) y1="0" y2="18" {} }
            line.whisker x1=(low) x2=(high) y1="9" y2="9" {}
            @if let Some(rate) = rate { circle cx=(rate) cy="9" r="4.5" {} }
        }
    }
}

/// Draws a bar for each group that shows how its tasks ended. The kinds are in the order of [`Kind::ALL`].
pub fn endings(bars: &[Bar]) -> Markup {
    html! {
        p.legend {
            @for kind in Kind::ALL { span { span class={ "key " (class(kind)) } {} (kind.word()) } }
        }
        div.plot {
            @for bar in bars {
                div.row {
                    span.name { (bar.name) }
                    (ending(&bar.tally))
                    span.value {
                        @if let Some(known) = bar.tally.share_that_knows() { (percent(Some(known))) " % " small { "known" } }
                    }
                }
            }
        }
        p.small { "Known: failed tasks that the robot itself ended as lost or blocked, instead of claiming to have arrived." }
    }
}

fn ending(tally: &Tally) -> Markup {
    let mut from = 0;
    let pieces: Vec<_> = Kind::ALL
        .into_iter()
        .map(|kind| {
            let piece = (kind, from, tally.count(kind));
            from += piece.2;
            piece
        })
        .filter(|piece| piece.2 > 0)
        .collect();
    let part = |count: usize| share(count as f64 / tally.attempts.max(1) as f64);
    html! {
        svg height="18" role="img" {
            @for (kind, from, count) in pieces {
                rect class=(class(kind)) x=(part(from)) width=(part(count)) y="2" height="14" {
                    title { (kind.word()) ": " (count) " of " (tally.attempts) }
                }
            }
        }
    }
}

/// Returns the CSS class of a kind, which is its word without spaces.
fn class(kind: Kind) -> String {
    kind.word().replace(' ', "-")
}

fn share(share: f64) -> String {
    format!("{:.2}%", 100.0 * share)
}

/// Width and height of a curve's picture. `RIM` is the space around its plot: left, top, right and bottom.
const SIZE: [f64; 2] = [340.0, 230.0];
const RIM: [f64; 4] = [38.0, 12.0, 14.0, 40.0];

/// Draws success rates against a condition, as one curve for each method.
pub fn curve(curve: &Curve, methods: &[Vec<(f64, Tally)>]) -> Markup {
    let xs: Vec<f64> = curve.points.iter().map(|(x, _)| *x).collect();
    let (low, high) = xs.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let [left, top, right, below] = RIM;
    let x = |value: f64| left + (value - low) / (high - low).max(1e-9) * (SIZE[0] - left - right);
    let y = |share: f64| top + (1.0 - share) * (SIZE[1] - top - below);
    let path = |points: Vec<[f64; 2]>| {
        points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
    };
    html! {
        figure.card {
            figcaption { (curve.title) }
            svg viewBox={ "0 0 " (SIZE[0]) " " (SIZE[1]) } role="img" {
                @for p in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    line.grid x1=(left) x2=(SIZE[0] - right) y1=(y(p)) y2=(y(p)) {}
                    text x=(left - 6.0) y=(y(p) + 4.0) text-anchor="end" { (100.0 * p) }
                }
                @for &at in &xs {
                    text x=(format!("{:.1}", x(at))) y=(SIZE[1] - below + 16.0) text-anchor="middle" { (at) }
                }
                text x=(f64::midpoint(left, SIZE[0] - right)) y=(SIZE[1] - 6.0) text-anchor="middle" { (curve.unit) }
                @for (style, points) in methods.iter().enumerate() {
                    g class={ "m" (style) } {
                        polygon.band points=(path(band(points).map(|(at, share)| [x(at), y(share)]).collect())) {}
                        polyline.curve points=(path(rates(points).map(|(at, share)| [x(at), y(share)]).collect())) {}
                        @for (at, share) in rates(points) {
                            circle cx=(format!("{:.1}", x(at))) cy=(format!("{:.1}", y(share))) r="4" {
                                title { (at) " " (curve.unit) ": " (percent(Some(share))) " %" }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Draws successes and failures as dots or bars over the numbers of a suite's parts.
pub fn marks(plot: &Plot) -> Markup {
    let [left, top, right, below] = RIM;
    let count = plot.marks.iter().map(|mark| mark.x).fold(1.0, f64::max);
    let highest = round_up(plot.marks.iter().map(|mark| mark.y).fold(0.0, f64::max));
    let width = (SIZE[0] - left - right) / count;
    let x = |at: f64| left + (at - 0.5) * width;
    let y = |value: f64| top + (1.0 - value / highest) * (SIZE[1] - top - below);
    let base = SIZE[1] - below;
    // Show only as many numbers as fit.
    let each = (count / 8.0).ceil().max(1.0);
    let numbers = (1..=count as usize).filter(|number| (*number as f64 - 1.0) % each == 0.0);
    let class = |mark: &Mark| if mark.is_success { "m0" } else { "wrong-arrival" };
    let said = |mark: &Mark| format!("{} {}: {:.1} {}", plot.x_unit, mark.x, mark.y, plot.y_unit);
    html! {
        figure.card {
            figcaption { (plot.title) " " small { (plot.y_unit) } }
            svg viewBox={ "0 0 " (SIZE[0]) " " (SIZE[1]) } role="img" {
                @for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    @let value = highest * part;
                    line.grid x1=(left) x2=(SIZE[0] - right) y1=(y(value)) y2=(y(value)) {}
                    text x=(left - 6.0) y=(y(value) + 4.0) text-anchor="end" { (value) }
                }
                @for number in numbers {
                    text x=(format!("{:.1}", x(number as f64))) y=(base + 16.0) text-anchor="middle" { (number) }
                }
                text x=(f64::midpoint(left, SIZE[0] - right)) y=(SIZE[1] - 6.0) text-anchor="middle" { (plot.x_unit) }
                @for mark in &plot.marks {
                    g class=(class(mark)) {
                        @match plot.form {
                            Form::Dots => circle cx=(format!("{:.1}", x(mark.x))) cy=(format!("{:.1}", y(mark.y))) r="4" { title { (said(mark)) } },
                            Form::Bars => rect.bar x=(format!("{:.1}", x(mark.x) - 0.35 * width)) width=(format!("{:.1}", 0.7 * width))
                                y=(format!("{:.1}", y(mark.y))) height=(format!("{:.1}", base - y(mark.y))) { title { (said(mark)) } },
                        }
                    }
                }
            }
        }
    }
}

/// Returns the smallest round number that is not below `value`, and a quarter of which also has few digits.
fn round_up(value: f64) -> f64 {
    let unit = 10_f64.powf(value.max(1e-6).log10().floor());
    [1.0, 2.0, 4.0, 6.0, 8.0, 10.0].into_iter().map(|n| n * unit).find(|top| *top >= value).unwrap_or(value)
}

fn rates(points: &[(f64, Tally)]) -> impl Iterator<Item = (f64, f64)> {
    points.iter().filter_map(|(at, tally)| Some((*at, tally.rate()?)))
}

/// Returns the outline of the band between the ends of the intervals: along the lower ends, then back along the upper ones.
fn band(points: &[(f64, Tally)]) -> impl Iterator<Item = (f64, f64)> {
    let ends = |k: usize| points.iter().map(move |(at, tally)| (*at, tally.interval()[k]));
    ends(0).chain(ends(1).rev())
}
