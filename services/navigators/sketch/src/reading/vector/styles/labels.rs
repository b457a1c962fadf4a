//! Texts, which name places. Fonts are not loaded, so the area of a text is estimated from its size and its
//! number of characters, and the text names the place at the middle of the area. Lines of a text belong
//! together, whether they are in one element or, as Excalidraw writes them, in elements one below the other.

use std::collections::BTreeMap;

use resvg::usvg::roxmltree::{Node, NodeId};

use super::syntax::without_comments;
use super::{Scope, Walk, is_svg};
use crate::reading::error::SketchError;
use crate::reading::labels::MOST_LABELS;

/// Width of a character and height of a capital letter, in font sizes.
const CHARACTER_EM: f64 = 0.55;
const CAPITAL_EM: f64 = 0.7;
/// Distance between two lines of a text, in font sizes.
const LINE_EM: std::ops::Range<f64> = 0.8..2.0;
/// Units of length, in pixels. Lengths in font sizes are separate.
const UNITS_PX: [(&str, f64); 7] = [
    ("px", 1.0),
    ("pt", 96.0 / 72.0),
    ("pc", 16.0),
    ("mm", 96.0 / 25.4),
    ("cm", 96.0 / 2.54),
    ("in", 96.0),
    ("", 1.0),
];

/// The properties of a font that determine how much space a text takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Font {
    size: f64,
    /// Share of a line that is to the left of its position.
    left_share: f64,
}

impl Default for Font {
    fn default() -> Self {
        Self { size: 16.0, left_share: 0.0 }
    }
}

impl Font {
    /// Returns the font of an element with these properties inside an element with this font.
    pub fn of(self, properties: &BTreeMap<String, String>) -> Self {
        let size = properties.get("font-size").and_then(|size| length(size, self.size));
        let left_share = properties.get("text-anchor").and_then(|anchor| match anchor.trim() {
            "start" => Some(0.0),
            "middle" => Some(0.5),
            "end" => Some(1.0),
            _ => None,
        });
        Self {
            size: size.filter(|size| *size > 0.0).unwrap_or(self.size),
            left_share: left_share.unwrap_or(self.left_share),
        }
    }
}

/// The last line of the last text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LastLine {
    group: Option<NodeId>,
    at: [f64; 2],
}

/// A line of a text.
struct Line {
    text: String,
    at: [f64; 2],
}

impl Walk<'_, '_> {
    /// Writes an invisible frame in place of a text and records the text, or counts it if it does not name a place.
    pub(super) fn label(&mut self, label: Node, scope: &Scope) -> Result<(), SketchError> {
        // For programs that cannot show HTML, draw.io offers a text as the other case of a switch.
        let is_case = label.parent().is_some_and(|parent| parent.tag_name().name() == "switch");
        let mut others = label.next_siblings().filter(|_| is_case);
        let text = others.find(|node| is_svg(*node) && node.tag_name().name() == "text");
        let text = if label.tag_name().name() == "text" { Some(label) } else { text };
        let on_path = |text: &Node| text.descendants().any(|node| node.tag_name().name() == "textPath");
        let named = text.filter(|text| !scope.is_template && !on_path(text));
        match named {
            Some(text) => self.named(text, scope),
            None => {
                self.nameless += 1;
                Ok(())
            }
        }
    }

    fn named(&mut self, text: Node, scope: &Scope) -> Result<(), SketchError> {
        let properties = self.of_text(text, scope)?;
        if properties.get("display").is_some_and(|display| display == "none") {
            return Ok(());
        }
        let font = scope.font.of(&properties);
        let lines = lines(text, font.size);
        let Some(last) = lines.last() else { return Ok(()) };
        let place = LastLine { group: text.parent().map(|group| group.id()), at: last.at };
        let before = self.last_line.replace(place);
        let words = lines.iter().map(|line| line.text.as_str()).collect::<Vec<_>>().join(" ");
        let is_continued = before.is_some_and(|before| before.is_above(&lines[0], place.group, font));
        let transform = properties.get("transform");
        if let Some((_, label)) = self.labels.last_mut().filter(|_| is_continued && transform.is_none()) {
            label.push(' ');
            label.push_str(&words);
        } else if self.labels.len() < MOST_LABELS {
            let frame = format!("{} <text>", self.out.len());
            self.frame(&frame, &lines, font, transform)?;
            self.labels.push((frame, words));
        } else {
            self.nameless += 1;
        }
        Ok(())
    }

    /// Returns the properties that position a text. Properties that cannot be read are ignored, because a text is not a wall.
    fn of_text(&self, text: Node, scope: &Scope) -> Result<BTreeMap<String, String>, SketchError> {
        let style = without_comments(text.attribute("style").unwrap_or(""));
        let declared = self.styles.declared(text, &style)?;
        let value = |property: &str| {
            let candidates = declared.properties.get(property)?;
            let value = self.styles.settled(text, (property, candidates), scope).ok().flatten()?;
            Some((property.to_owned(), value))
        };
        Ok(["display", "font-size", "text-anchor", "transform"].into_iter().filter_map(value).collect())
    }

    /// Writes an invisible shape that covers some lines.
    fn frame(
        &mut self,
        id: &str,
        lines: &[Line],
        font: Font,
        transform: Option<&String>,
    ) -> Result<(), SketchError> {
        let mut sides = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for Line { text, at: [x, y] } in lines {
            let width = CHARACTER_EM * font.size * text.trim().chars().count().max(1) as f64;
            let left = x - font.left_share * width;
            let area = [left, y - CAPITAL_EM * font.size, left + width, *y];
            sides =
                [sides[0].min(area[0]), sides[1].min(area[1]), sides[2].max(area[2]), sides[3].max(area[3])];
        }
        let [left, top, right, bottom] = sides;
        self.write(format_args!("<path"))?;
        self.attribute("id", id)?;
        transform.map_or(Ok(()), |transform| self.attribute("transform", transform))?;
        self.write(format_args!(
            " d=\"M{left} {top}H{right}V{bottom}H{left}z\" fill=\"none\" stroke=\"none\" marker-start=\"none\" \
             marker-mid=\"none\" marker-end=\"none\"/>"
        ))
    }
}

impl LastLine {
    /// Returns true if `line`, in `group`, is the next line of the same text.
    fn is_above(&self, line: &Line, group: Option<NodeId>, font: Font) -> bool {
        let distance = line.at[1] - self.at[1];
        let is_next = (LINE_EM.start * font.size..LINE_EM.end * font.size).contains(&distance);
        self.group == group && self.at[0] == line.at[0] && is_next
    }
}

/// Returns the lines of a text, each with its own start position.
fn lines(text: Node, size: f64) -> Vec<Line> {
    let mut lines = Vec::new();
    let mut pen = [0.0; 2];
    collect(text, size, &mut pen, &mut lines);
    lines.retain(|line: &Line| !line.text.trim().is_empty());
    lines
}

fn collect(node: Node, size: f64, pen: &mut [f64; 2], lines: &mut Vec<Line>) {
    let value = |key: &str| {
        let first = node.attribute(key)?.split([' ', ',']).find(|word| !word.is_empty())?;
        length(first, size)
    };
    let moved = [value("x"), value("y")];
    for (axis, at) in moved.into_iter().enumerate() {
        pen[axis] = at.unwrap_or(pen[axis]);
    }
    pen[0] += value("dx").unwrap_or(0.0);
    pen[1] += value("dy").unwrap_or(0.0);
    if lines.is_empty() || moved != [None, None] {
        lines.push(Line { text: String::new(), at: *pen });
    }
    for child in node.children() {
        if child.is_text() {
            let text = child.text().unwrap_or("");
            lines.last_mut().into_iter().for_each(|line| line.text.push_str(text));
        } else if is_svg(child) && matches!(child.tag_name().name(), "tspan" | "a") {
            collect(child, size, pen, lines);
        }
    }
}

/// Returns a length in pixels. `em` is the font size that relative lengths refer to.
fn length(text: &str, em: f64) -> Option<f64> {
    let text = text.trim();
    let units = [("rem", Font::default().size), ("em", em), ("%", em / 100.0)].into_iter().chain(UNITS_PX);
    let px = units.filter_map(|(unit, px)| Some(px * text.strip_suffix(unit)?.trim().parse::<f64>().ok()?));
    px.into_iter().find(|px| px.is_finite())
}
