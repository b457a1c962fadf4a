//! Style sheets. Finds the rules that apply to a drawing on a light page, in order of precedence. Selectors
//! are parsed by simplecss.

use std::cell::Cell;
use std::cmp::Reverse;

use resvg::usvg::roxmltree::Node;
use simplecss::{AttributeOperator, Element, PseudoClass, Selector};

use super::syntax::{Block, Declaration, blocks, declarations, find, function, split, without_comments};

/// Maximum nesting depth of blocks of rules.
const MOST_DEPTH: usize = 8;
/// Attribute that replaces `:root`, which simplecss does not support.
const ROOT: &str = "sketchnav-root";
/// States that an element of a still picture is never in.
const DYNAMIC: [&str; 14] = [
    ":hover",
    ":active",
    ":focus",
    ":visited",
    ":link",
    ":target",
    ":checked",
    ":disabled",
    ":enabled",
    ":any-link",
    ":fullscreen",
    ":autofill",
    ":current",
    ":modal",
];

/// The rules as they are written.
#[derive(Debug, Default)]
pub(super) struct Written {
    rules: Vec<WrittenRule>,
    /// Rules that are left out because it is not known whether they apply.
    pub left_out: Vec<String>,
}

#[derive(Debug)]
struct WrittenRule {
    selector: String,
    body: String,
    /// True if the rule is in a layer. It then has lower precedence than all rules outside layers.
    in_layer: bool,
}

impl Written {
    /// Adds a style sheet. `media` is the attribute of the element that contains it.
    pub fn add(&mut self, sheet: &str, media: &str) {
        if media.trim().is_empty() || self.is_shown(media) {
            self.blocks(&without_comments(sheet), false, 0);
        }
    }

    fn blocks(&mut self, sheet: &str, in_layer: bool, depth: usize) {
        for Block { prelude, body } in blocks(sheet) {
            if let Some(at_rule) = prelude.strip_prefix('@') {
                self.at_rule(at_rule, body, in_layer, depth);
                continue;
            }
            let Some(body) = body else { continue };
            let root = format!("[{ROOT}]");
            for selector in split(prelude, b',') {
                let selector = selector.replace(":root", &root);
                self.rules.push(WrittenRule { selector, body: body.to_owned(), in_layer });
            }
        }
    }

    fn at_rule(&mut self, at_rule: &str, body: Option<&str>, in_layer: bool, depth: usize) {
        let name_end =
            at_rule.find(|c: char| !c.is_ascii_alphanumeric() && c != '-').unwrap_or(at_rule.len());
        let (name, condition) = (at_rule[..name_end].to_ascii_lowercase(), at_rule[name_end..].trim());
        let holds = match name.as_str() {
            "media" => self.is_shown(condition),
            "supports" => !condition.to_ascii_lowercase().starts_with("not"),
            "layer" => true,
            "property" => {
                self.initial(condition, body.unwrap_or(""));
                return;
            }
            "import" | "container" | "scope" => {
                self.left_out.push(format!("@{name} {condition}"));
                return;
            }
            // Fonts, animations and printed pages do not affect the drawing.
            _ => return,
        };
        match body {
            Some(_) if depth == MOST_DEPTH => self.left_out.push(format!("@{name} {condition}")),
            Some(body) if holds => self.blocks(body, in_layer || name == "layer", depth + 1),
            _ => {}
        }
    }

    /// Adds the initial value of a registered custom property, as a rule of the lowest precedence.
    fn initial(&mut self, name: &str, body: &str) {
        let value = declarations(body).find(|one| one.name.eq_ignore_ascii_case("initial-value"));
        if let Some(value) = value {
            let body = format!("{name}: {}", value.value);
            self.rules.insert(0, WrittenRule { selector: format!("[{ROOT}]"), body, in_layer: true });
        }
    }

    /// Returns true if a list of media queries matches a light screen of any size. If that depends on the screen, the list is
    /// recorded as left out.
    fn is_shown(&mut self, queries: &str) -> bool {
        let shown: Vec<_> = split(queries, b',').map(is_shown).collect();
        let known = shown.contains(&Some(true));
        if !known && shown.contains(&None) {
            self.left_out.push(format!("@media {queries}"));
        }
        known
    }

    /// Returns the rules with their selectors, in order of increasing precedence.
    pub fn rules(&self) -> Vec<Rule<'_>> {
        let mut rules: Vec<_> = self.rules.iter().filter_map(WrittenRule::rule).collect();
        rules.sort_by_key(|rule| {
            (Reverse(rule.in_layer), rule.selector.as_ref().map_or([0; 3], Selector::specificity))
        });
        rules
    }
}

/// Returns true if a media query matches, or `None` if that depends on the screen.
fn is_shown(query: &str) -> Option<bool> {
    let query = query.to_ascii_lowercase();
    let (inverted, query) = query.strip_prefix("not ").map_or((false, query.as_str()), |rest| (true, rest));
    let query = query.strip_prefix("only ").unwrap_or(query);
    let parts: Vec<_> =
        query.split(" and ").map(|part| part.split_whitespace().collect::<String>()).collect();
    let holds = |part: &String| match part.as_str() {
        "all" | "screen" | "(prefers-color-scheme:light)" | "(color)" => Some(true),
        "print" | "speech" | "(prefers-color-scheme:dark)" | "(monochrome)" => Some(false),
        _ => None,
    };
    let parts: Vec<_> = parts.iter().map(holds).collect();
    let all = if parts.contains(&Some(false)) {
        Some(false)
    } else if parts.contains(&None) {
        None
    } else {
        Some(true)
    };
    all.map(|holds| holds != inverted)
}

/// A rule with its selector, or with the selector's text if it cannot be read.
pub(super) struct Rule<'a> {
    pub selector: Result<Selector<'a>, &'a str>,
    pub declarations: Vec<Declaration<'a>>,
    in_layer: bool,
}

impl WrittenRule {
    fn rule(&self) -> Option<Rule<'_>> {
        let text = self.selector.as_str();
        // Skips pseudo-elements, and states that a picture is never in.
        if text.contains("::") || DYNAMIC.iter().any(|state| holds_state(text, state)) {
            return None;
        }
        // Nested blocks are for other elements, so the selector of such a rule counts as unreadable.
        let is_nested = find(&self.body, b"{") < self.body.len();
        let selector = if is_nested { None } else { Selector::parse(text) };
        let blocks = self.body.split(['{', '}']).filter(|_| is_nested);
        let declarations = declarations(&self.body).chain(blocks.flat_map(declarations)).collect();
        Some(Rule { selector: selector.ok_or(text), declarations, in_layer: self.in_layer })
    }
}

/// Returns true if a compound selector asks for a state, other than inside `:not()` and the like.
fn holds_state(selector: &str, state: &str) -> bool {
    let end = find(selector, b"(");
    let plain = &selector[..end];
    plain.contains(state) && function(selector).is_none()
}

/// An element as selectors see it. Steps from element to element are counted, because a chain of ten ancestors can be matched
/// in many ways.
pub(super) struct Seen<'a, 'input, 'count> {
    pub node: Node<'a, 'input>,
    pub steps: &'count Cell<u64>,
}

impl<'a, 'input, 'count> Seen<'a, 'input, 'count> {
    fn step(&self, node: Option<Node<'a, 'input>>) -> Option<Self> {
        self.steps.set(self.steps.get().checked_sub(1)?);
        node.map(|node| Self { node, steps: self.steps })
    }
}

impl Element for Seen<'_, '_, '_> {
    fn parent_element(&self) -> Option<Self> {
        self.step(self.node.parent_element())
    }

    fn prev_sibling_element(&self) -> Option<Self> {
        self.step(self.node.prev_sibling_element())
    }

    fn has_local_name(&self, name: &str) -> bool {
        self.node.tag_name().name() == name
    }

    fn attribute_matches(&self, name: &str, operator: AttributeOperator<'_>) -> bool {
        if name == ROOT {
            return self.node.parent_element().is_none();
        }
        self.node.attribute(name).is_some_and(|value| operator.matches(value))
    }

    fn pseudo_class_matches(&self, class: PseudoClass<'_>) -> bool {
        class == PseudoClass::FirstChild && self.node.prev_sibling_element().is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn selectors(sheet: &str) -> Vec<String> {
        let mut written = Written::default();
        written.add(sheet, "");
        let rules = written.rules();
        rules
            .iter()
            .map(|rule| match &rule.selector {
                Ok(selector) => selector.to_string(),
                Err(text) => format!("? {text}"),
            })
            .collect()
    }

    #[test]
    fn rules_are_in_the_order_of_their_weight() {
        let sheet = "#a{x:1} .b{x:1} path{x:1} .c, g > path{x:1} @layer base { #d{x:1} }";
        assert_eq!(
            selectors(sheet),
            ["*[id='d']", "path", "g > path", "*[class~='b']", "*[class~='c']", "*[id='a']"]
        );
    }

    #[test]
    fn rules_for_paper_and_for_the_dark_do_not_hold() {
        let sheet = "@media print {a{x:1}} @media (prefers-color-scheme: dark) {b{x:1}}
            @media screen and (prefers-color-scheme: light) {c{x:1}} @media not print {d{x:1}}
            @supports (color: oklch(0 0 0)) {e{x:1}} @font-face {src: url(a)} a:hover {x:1} text::selection {x:1}";
        assert_eq!(selectors(sheet), ["c", "d", "e"]);
        let mut written = Written::default();
        written.add("@media (min-width: 600px) {a{x:1}} @import 'b.css';", "");
        assert_eq!(written.left_out, ["@media (min-width: 600px)", "@import 'b.css'"]);
        written.add("f{x:1}", "(prefers-color-scheme: dark)");
        assert_eq!(written.rules().len(), 0);
    }

    #[test]
    fn selectors_that_cannot_be_read_are_kept_as_such() {
        assert_eq!(selectors("a ~ b{x:1} a:nth-child(2){x:1} a{&.b{x:1}}").len(), 3);
        assert!(selectors("a ~ b{x:1} a:nth-child(2){x:1}").iter().all(|text| text.starts_with('?')));
    }
}
