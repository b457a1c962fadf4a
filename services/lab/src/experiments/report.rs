//! Renders the outcomes of a suite as a single self-contained HTML page, with tables next to the paper's,
//! intervals, causes of failures, some tasks as pictures, and the command that generated the page.
//!
//! This module is pure: the same outcomes yield the same page. Pages work in light and dark mode and fit the screen of a
//! phone.

mod chart;
mod examples;

use crate::page;
use maud::{Markup, PreEscaped, html};

use crate::experiments::outcome::TaskOutcome;
use crate::experiments::section::Section;
use crate::experiments::statistics::Tally;
use crate::experiments::suite::{Curve, Suite};
use crate::experiments::table::{self, Table};
use chart::{Bar, Dot};
pub use examples::{Example, examples};

/// The content of a page.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// The suite that was driven.
    pub suite: &'a Suite,
    /// Names of the methods, in the order of the tables.
    pub methods: &'a [String],
    /// All outcomes.
    pub outcomes: &'a [TaskOutcome],
    /// Some of the tasks as pictures.
    pub examples: &'a [Example],
    /// Command line that generated the page.
    pub command: &'a str,
}

impl Report<'_> {
    /// Renders the page.
    pub fn page(&self) -> String {
        page::document(&format!("{} · sketchnav eval", self.suite.name), &self.body())
    }

    fn body(&self) -> Markup {
        html! {
            h1 { (self.suite.name) }
            p.lead { (self.suite.title) }
            @for notice in &self.suite.notices { p.notice { (notice) } }
            pre { code { (self.command) } }
            @if self.outcomes.is_empty() {
                p { "Nothing was driven." }
            } @else {
                (self.rates())
                (self.curves())
                @for (i, method) in self.methods.iter().enumerate() { (self.figures(i, method)) }
                @for section in &self.suite.sections(self.outcomes) { (section_markup(section)) }
                (self.failures())
                (self.pictures())
            }
        }
    }

    /// Returns the outcomes of a method that count.
    fn counted(&self, method: &str) -> impl Iterator<Item = &TaskOutcome> {
        self.outcomes.iter().filter(move |ended| ended.method == method && self.suite.counts(ended))
    }

    fn tally(&self, method: &str, line: &str) -> Tally {
        Tally::of(self.counted(method).filter(|ended| ended.drawing == line))
    }

    fn rates(&self) -> Markup {
        let mut groups: Vec<(String, Vec<Dot>)> = Vec::new();
        for line in self.suite.drawings() {
            let dot = |(style, method): (usize, &String)| Dot::of(method, style, self.tally(method, &line));
            groups.push((line.clone(), self.methods.iter().enumerate().map(dot).collect()));
        }
        let all = |(style, method): (usize, &String)| Dot::of(method, style, Tally::of(self.counted(method)));
        groups.push(("all".into(), self.methods.iter().enumerate().map(all).collect()));
        groups.extend(self.suite.papers().into_iter().map(|paper| {
            let tally = Tally {
                attempts: paper.attempts as usize,
                reached: paper.reached as usize,
                ..Tally::default()
            };
            (paper.name, vec![Dot::of("published", chart::PAPER, tally)])
        }));
        html! {
            h2 { "Tasks reached" }
            p { "Share of tasks reached, with Wilson's 95 % interval, by "
                (self.suite.lines.unwrap_or("drawing")) ". Drives by one drawing mostly end alike; where drawings repeat, the "
                "tables also give the intervals over drawings." }
            @if self.methods.len() > 1 { (chart::legend(&self.names())) }
            (chart::intervals(&groups))
        }
    }

    fn names(&self) -> Vec<String> {
        self.methods.to_vec()
    }

    fn curves(&self) -> Markup {
        let curve = |curve: &Curve| {
            let points = |method: &String| {
                let point = |(x, line): &(f64, String)| (*x, self.tally(method, line));
                curve.points.iter().map(point).collect::<Vec<_>>()
            };
            chart::curve(curve, &self.methods.iter().map(points).collect::<Vec<_>>())
        };
        html! {
            @if !self.suite.curves.is_empty() {
                h2 { "Curves" }
                p { "The same shares, each against one condition; the bands are the intervals." }
                div.cards { @for one in &self.suite.curves { (curve(one)) } }
            }
        }
    }

    fn figures(&self, style: usize, method: &str) -> Markup {
        let outcomes: Vec<_> = self.outcomes.iter().filter(|ended| ended.method == method).collect();
        html! {
            h2 { span class={ "key m" (style) } {} "Method " (method) }
            @for one in table::of_suite(self.suite, &outcomes) { (drawn(&one)) }
            @if let Some(note) = table::note(self.suite, &outcomes) { p { (note) } }
        }
    }

    fn failures(&self) -> Markup {
        let bars = self.methods.iter().flat_map(|method| {
            let name = move |line: &str| match self.methods.len() {
                1 => line.to_owned(),
                _ => format!("{line}, {method}"),
            };
            let lines = self.suite.drawings().into_iter();
            let lines = lines.map(move |line| Bar { name: name(&line), tally: self.tally(method, &line) });
            lines.chain([Bar { name: name("all"), tally: Tally::of(self.counted(method)) }])
        });
        html! {
            h2 { "How tasks ended" }
            (chart::endings(&bars.collect::<Vec<_>>()))
        }
    }

    fn pictures(&self) -> Markup {
        html! {
            @if !self.examples.is_empty() { h2 { "Some of them" } }
            @for example in self.examples {
                section.example {
                    h3 { (example.title) }
                    p { (example.text) }
                    div.pictures {
                        @for picture in &example.pictures { figure { (PreEscaped(picture)) } }
                    }
                }
            }
        }
    }
}

fn section_markup(section: &Section) -> Markup {
    html! {
        h2 { (section.title) }
        (drawn(&section.table))
        @for words in &section.words { p { (words) } }
        @if !section.plots.is_empty() {
            p.legend {
                span { span class="key m0" {} "succeeds" }
                span { span class="key wrong-arrival" {} "fails" }
            }
            div.cards { @for plot in &section.plots { (chart::marks(plot)) } }
        }
    }
}

fn drawn(table: &Table) -> Markup {
    page::table(&table.header, &table.rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::outcome::Kind;
    use crate::experiments::suite::{Leg, Published};

    fn outcome(drawing: &str, kind: Kind) -> TaskOutcome {
        TaskOutcome {
            drawing: drawing.into(),
            method: "beam".into(),
            task: "0 → 1".into(),
            reason: "a <b> & c".into(),
            ..TaskOutcome::sample(&format!("{drawing}#1"), kind)
        }
    }

    fn page(suite: &Suite, outcomes: &[TaskOutcome]) -> String {
        let example =
            Example { title: "<i>".into(), text: "a & b".into(), pictures: vec!["<svg></svg>".into()] };
        let methods = ["beam".to_owned()];
        let command = "sketchnav eval some --only 'a<b'";
        Report { suite, methods: &methods, outcomes, examples: &[example], command }.page()
    }

    #[test]
    fn the_page_has_both_sets_of_figures_and_is_self_contained() {
        let leg = Leg {
            name: "0 → 1".into(),
            paper_length_m: 6.4,
            paper: vec![(7, 10), (9, 10)],
            length_m: Some(6.0),
        };
        let suite = Suite { name: "some".into(), legs: vec![leg], ..Suite::default() };
        let found = page(&suite, &[outcome("a", Kind::Reached), outcome("a", Kind::Lost)]);
        for word in ["paper B", "7/10", "9/10", "1/2", "a&lt;b", "&lt;i&gt;", "a &amp; b", "<svg></svg>"] {
            assert!(found.contains(word), "{word}");
        }
        for reference in ["http", "src=", "href=", "@import", "url("] {
            assert!(!found.contains(reference), "{reference}");
        }
        assert_eq!(found, page(&suite, &[outcome("a", Kind::Reached), outcome("a", Kind::Lost)]));
    }

    #[test]
    fn a_suite_without_trials_says_why() {
        let suite = Suite { notices: vec!["skipped: no <map>".into()], ..Suite::default() };
        let found = page(&suite, &[]);
        assert!(found.contains("skipped: no &lt;map&gt;") && found.contains("Nothing was driven"));
    }

    #[test]
    fn published_results_are_below_the_drawings() {
        let paper = vec![Published { name: "paper".into(), reached: 17, attempts: 25 }];
        let suite = Suite { paper, ..Suite::default() };
        let found = page(&suite, &[outcome("a", Kind::Reached)]);
        assert!(found.contains("17/25") && found.contains("48–83"), "as the paper's interval is");
    }
}
