//! Finds content of a drawing that may be missed: anything that is left out, refers to nothing, or may be
//! silently dropped by the renderer.

use std::collections::BTreeMap;

use resvg::usvg::roxmltree::Node;

use super::syntax::words;
use super::values::url;
use super::{SHOWN, STROKED, Scope, Walk, XLINK, escaped, is_svg, located};
use crate::reading::error::SketchError;
use crate::reading::left_out::LeftOut;
use crate::reading::vector::references::name;

/// Elements that paint nothing. Their content is left out without a report.
const SILENT: [&str; 13] = [
    "animate",
    "animateColor",
    "animateMotion",
    "animateTransform",
    "desc",
    "discard",
    "metadata",
    "mpath",
    "script",
    "set",
    "style",
    "title",
    "view",
];
/// Elements whose effects are watched, in addition to [`STROKED`].
const AFFECTED: [&str; 3] = ["g", "image", "use"];
/// Properties that can make an element vanish.
const EFFECTS: [&str; 3] = ["clip-path", "filter", "mask"];
/// Elements whose content is drawn elsewhere, or not at all.
pub(super) const TEMPLATES: [&str; 7] = ["clipPath", "defs", "filter", "marker", "mask", "pattern", "symbol"];
/// Maximum number of characters of unreadable shape data in a warning.
const SHOWN_POINTS: usize = 16;

impl Walk<'_, '_> {
    /// Returns true if an element is not drawn at all, and records it if a person may miss it.
    ///
    /// # Errors
    /// [`SketchError`] if the drawing gets too large.
    pub(super) fn is_left_out(&mut self, node: Node, tag: &str, scope: &Scope) -> Result<bool, SketchError> {
        let is_label = |node: Node| matches!(node.tag_name().name(), "text" | "foreignObject");
        // A browser shows the first part of a `<switch>` that it supports, and HTML is supported. Extensions are private to
        // programs, and none is supported here.
        let is_extended = |child: &Node| child.attribute("requiredExtensions").is_some();
        if node.parent_element().is_some_and(|parent| parent.tag_name().name() == "switch")
            && is_extended(&node)
        {
            return Ok(true);
        }
        let first = || node.children().find(|child| is_svg(*child) && !is_extended(child));
        let shown = if tag == "switch" { first() } else { Some(node) };
        let Some(label) = shown.filter(|shown| is_label(*shown)) else { return Ok(SILENT.contains(&tag)) };
        let is_shape = |inside: Node| is_svg(inside) && STROKED.contains(&inside.tag_name().name());
        if !scope.is_hidden && label.descendants().any(is_shape) {
            self.miss(LeftOut::Foreign(name(label)));
        } else if !scope.is_hidden {
            self.label(label, scope)?;
        }
        Ok(true)
    }

    /// Remembers an element that the renderer may silently draw differently, and gives it an id if it has none.
    pub(super) fn watch(
        &mut self,
        node: Node,
        settled: &BTreeMap<String, String>,
        scope: &Scope,
        at: usize,
    ) -> Result<(), SketchError> {
        if scope.is_hidden || scope.is_template {
            return Ok(());
        }
        let is_stroked = STROKED.contains(&node.tag_name().name());
        let (is_served, is_affected) = (self.is_served(node, scope), self.is_affected(node, settled)?);
        let is_unscaled = is_stroked && scope.keeps_width;
        if !(is_served || is_affected || is_unscaled) {
            return Ok(());
        }
        let id = node.attribute("id").map_or_else(|| format!("{at} {}", located(node)), str::to_owned);
        if node.attribute("id").is_none() {
            self.out.insert_str(at, &format!(" id=\"{}\"", escaped(&id)));
        }
        let lists = [
            (is_served, &mut self.served),
            (is_affected, &mut self.affected),
            (is_unscaled, &mut self.unscaled),
        ];
        for (_, list) in lists.into_iter().filter(|(holds, _)| *holds) {
            list.insert(id.clone(), located(node));
        }
        Ok(())
    }

    /// Returns true if a shape's stroke is painted by a gradient or a pattern and has no fallback.
    fn is_served(&self, node: Node, scope: &Scope) -> bool {
        let mut parts = words(scope.stroke.as_deref().unwrap_or(""));
        let (server, fallback) = (parts.next().and_then(url), parts.next());
        let is_known = server.is_some_and(|server| self.is_known(server));
        is_known && fallback.is_none() && STROKED.contains(&node.tag_name().name())
    }

    /// Returns true if an element shows something and has a filter, a mask or a clip path. A `<use>` counts, too, if it refers
    /// to an element with one of these or a gradient.
    fn is_affected(&self, node: Node, settled: &BTreeMap<String, String>) -> Result<bool, SketchError> {
        let mut values = EFFECTS.iter().filter_map(|property| settled.get(*property));
        if values.any(|value| words(value).any(|word| url(word).is_some_and(|link| self.is_known(link)))) {
            let is_watched = is_one_of(node, &STROKED) || is_one_of(node, &AFFECTED);
            return Ok(is_watched && self.has(node, is_shown)?);
        }
        if !is_one_of(node, &["use"]) {
            return Ok(false);
        }
        let link = node.attribute("href").or_else(|| node.attribute((XLINK, "href"))).unwrap_or("");
        let Some(target) = link.trim().strip_prefix('#').and_then(|id| self.ids.get(id)) else {
            return Ok(false);
        };
        Ok(self.has(*target, has_url)? && self.has(*target, is_shown)?)
    }

    /// Returns true if `is_such` holds for an element or for one inside it.
    fn has(&self, node: Node, is_such: impl Fn(Node) -> bool) -> Result<bool, SketchError> {
        let mut looked = 0;
        let found = node.descendants().inspect(|_| looked += 1).any(is_such);
        self.styles.take(looked)?;
        Ok(found)
    }

    /// Records references that do not work. If a paint or filter is missing from the drawing, nothing is visible, and if a clip
    /// path or mask is missing, nothing is hidden.
    pub(super) fn check_reference(&mut self, node: Node, property: &str, value: &str, scope: &Scope) {
        let all: Vec<_> = words(value).collect();
        let is_own = |word: &&str| url(word).is_some() || ["none", "inherit"].contains(word);
        if ["clip-path", "mask"].contains(&property) && !all.iter().all(is_own) && !scope.is_hidden {
            let found = format!("{property}: {value}").chars().take(SHOWN).collect();
            self.miss(LeftOut::Clip { element: name(node), found });
        }
        let servers: &[&str] = match (property, &all[..]) {
            ("fill" | "stroke", [_]) | ("filter", _) => &all,
            _ => &[],
        };
        for server in servers.iter().filter_map(|word| url(word)) {
            if !scope.is_hidden && !self.is_known(server) {
                let found = format!("{property} url({server})").chars().take(SHOWN).collect();
                self.miss(LeftOut::Reference { element: name(node), found });
            }
        }
    }

    /// Records shape data that becomes unreadable, because the renderer ends the shape there.
    pub(super) fn check_points(&mut self, node: Node, key: &str, value: &str, scope: &Scope) {
        let commands = match (node.tag_name().name(), key) {
            ("path", "d") if value.trim() != "none" => "MmZzLlHhVvCcSsQqTtAa",
            ("polygon" | "polyline", "points") => "",
            _ => return,
        };
        let is_read = |c: char| {
            c.is_ascii_digit() || c.is_ascii_whitespace() || "eE.,+-".contains(c) || commands.contains(c)
        };
        let data = value.trim_start();
        let begins = key == "points" || data.is_empty() || data.starts_with(['M', 'm']);
        let wrong = if begins { data.find(|c| !is_read(c)) } else { Some(0) };
        if let Some(at) = wrong.filter(|_| !scope.is_hidden) {
            let found = data[at..].chars().take(SHOWN_POINTS).collect();
            self.miss(LeftOut::Points { element: located(node), found });
        }
    }
}

fn is_one_of(node: Node, tags: &[&str]) -> bool {
    is_svg(node) && tags.contains(&node.tag_name().name())
}

/// Returns true if an element shows something by itself.
fn is_shown(node: Node) -> bool {
    is_one_of(node, &STROKED) || is_one_of(node, &["image", "use"])
}

/// Returns true if any attribute of an element, including `style`, refers to a gradient, a filter or the like.
fn has_url(node: Node) -> bool {
    node.attributes().any(|attribute| attribute.value().to_ascii_lowercase().contains("url("))
}
