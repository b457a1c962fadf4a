//! Computes the styles of an SVG before it is rendered. This is necessary because the renderer only supports the colours of CSS 3,
//! and silently drops every line whose colour it cannot read. The result is the same drawing with plain attributes only, without
//! style sheets, `var()` or colour functions.
//!
//! As in CSS, the valid declaration with the highest precedence wins. An invalid declaration is ignored in favour of the next one
//! or the attribute. A declaration that may be valid but cannot be computed is ignored as well, as in a browser that does not
//! support it yet. If none is left, the drawing is rejected with an error that names the element, the property and the value.
//!
//! Scripts, animations and descriptions are left out, and anything that may be missed is reported. A text is replaced by an
//! invisible frame around it, which marks its position for the renderer. Sources: CSS Cascading and Inheritance Level 4; SVG 2, 6.

mod colours;
mod labels;
mod missed;
mod sheet;
mod syntax;
mod values;
mod variables;

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::sync::Arc;

use resvg::usvg::roxmltree::{Document, Node};

use self::colours::in_dark;
use self::labels::{Font, LastLine};
use self::missed::TEMPLATES;
use self::sheet::{Rule, Seen, Written};
use self::syntax::{Declaration, declarations, function, without_comments, words};
use self::values::{Checked, Kind, check, initial, is_inherited, kind};
use self::variables::{Variables, refers};
use super::pictures::Pictures;
use super::references::name;
use crate::reading::budget::MOST_DEPTH;
use crate::reading::error::{Broken, SketchError};
use crate::reading::labels::tidied;
use crate::reading::left_out::LeftOut;

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";
/// Maximum number of steps for all styles of a drawing. A step is a byte of a value, or a move from one element to another.
const MOST_STEPS: u64 = 100_000_000;
/// Maximum size of the drawing with plain attributes, in bytes.
const MOST_BYTES: usize = 64 << 20;
/// Maximum number of characters of a value in an error message.
const SHOWN: usize = 80;

/// CSS properties that become geometry attributes, except on `svg` elements.
const GEOMETRY: [&str; 9] = ["x", "y", "cx", "cy", "r", "rx", "ry", "width", "height"];
/// Length attributes of shapes, and the shapes that have them.
const LENGTHS: [&str; 13] =
    ["x", "y", "cx", "cy", "r", "rx", "ry", "width", "height", "x1", "y1", "x2", "y2"];
const SHAPES: [&str; 6] = ["circle", "ellipse", "image", "line", "rect", "use"];
/// Shapes, which can be drawn by a stroke.
const STROKED: [&str; 7] = ["circle", "ellipse", "line", "path", "polygon", "polyline", "rect"];
/// Properties that the renderer honours only in a `style` attribute.
const STYLE_ONLY: [&str; 3] = ["mix-blend-mode", "isolation", "image-rendering"];

/// A drawing with plain attributes only.
pub(crate) struct Flat {
    /// The SVG.
    pub text: String,
    /// The pictures in the drawing, as PNG. An `<image>` refers to them by the references that [`Pictures::add`] returned.
    pub pictures: Vec<Arc<Vec<u8>>>,
    /// Content that is left out and that a person may miss.
    pub left_out: Vec<LeftOut>,
    /// The texts, each with the id of its frame.
    pub labels: Vec<(String, String)>,
    /// The ids of shapes whose strokes are painted by a gradient or a pattern, with their names for error messages.
    pub served: BTreeMap<String, String>,
    /// The ids of elements seen through a filter, a mask or a clip path, with their names for error messages.
    pub affected: BTreeMap<String, String>,
    /// The ids of shapes whose strokes should keep their width at every scale, with their names for error messages.
    pub unscaled: BTreeMap<String, String>,
}

/// Computes all styles of a drawing.
///
/// # Errors
/// [`SketchError`] if a colour or another value cannot be read, if there is too much of anything, or if an embedded picture is
/// broken.
pub(crate) fn flatten(document: &Document, broken: &Broken) -> Result<Flat, SketchError> {
    let mut written = Written::default();
    for node in document.descendants().filter(|node| is_svg(*node) && node.tag_name().name() == "style") {
        if matches!(node.attribute("type"), None | Some("" | "text/css")) {
            let text: String = node.children().filter_map(|child| child.text()).collect();
            written.add(&text, node.attribute("media").unwrap_or(""));
        }
    }
    let others = document.root().children().filter_map(|node| node.pi());
    let sheets = others.filter(|other| other.target == "xml-stylesheet");
    written.left_out.extend(sheets.map(|sheet| format!("<?xml-stylesheet {}?>", sheet.value.unwrap_or(""))));
    let styles = Styles { rules: written.rules(), steps: Cell::new(MOST_STEPS), broken };
    styles.check_selectors()?;
    let mut walk = Walk {
        styles: &styles,
        ids: document.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect(),
        pictures: Pictures::default(),
        out: String::new(),
        left_out: written.left_out.iter().cloned().map(LeftOut::Rules).collect(),
        served: BTreeMap::new(),
        affected: BTreeMap::new(),
        unscaled: BTreeMap::new(),
        labels: Vec::new(),
        last_line: None,
        nameless: 0,
    };
    walk.element(document.root_element(), &Scope::default(), 0)?;
    let Walk { pictures, out, mut left_out, served, affected, unscaled, labels, nameless, .. } = walk;
    let (labels, remarks): (Vec<_>, Vec<_>) =
        labels.into_iter().map(|(frame, text)| (frame, tidied(&text))).partition(|(_, name)| name.is_some());
    let nameless = nameless + remarks.len();
    let labels = labels.into_iter().filter_map(|(frame, name)| Some((frame, name?))).collect();
    left_out.extend((nameless > 0).then_some(LeftOut::Labels(nameless)));
    Ok(Flat { text: out, pictures: pictures.files, left_out, labels, served, affected, unscaled })
}

fn is_svg(node: Node) -> bool {
    node.is_element() && matches!(node.tag_name().namespace(), None | Some(SVG))
}

/// Everything that an element inherits.
#[derive(Clone, Default)]
struct Scope {
    variables: Variables,
    /// Colour properties that an enclosing element declares.
    declared: BTreeSet<String>,
    /// The value of the property `stroke`.
    stroke: Option<String>,
    /// True if the colour scheme is dark, with no other allowed.
    is_dark: bool,
    /// True if the element is not shown, in which case nothing in it can be missed.
    is_hidden: bool,
    /// True if the element is drawn elsewhere, or not at all.
    is_template: bool,
    /// True if strokes keep their width at every scale.
    keeps_width: bool,
    font: Font,
}

/// A value that is declared for a property of an element.
struct Candidate<'a> {
    value: &'a str,
    is_attribute: bool,
}

/// The properties of an element, each with its declared values in order of increasing precedence, and its custom properties.
#[derive(Default)]
struct Declared<'a> {
    properties: BTreeMap<String, Vec<Candidate<'a>>>,
    custom: BTreeMap<&'a str, &'a str>,
}

impl<'a> Declared<'a> {
    fn add(&mut self, name: &str, value: &'a str, is_attribute: bool) {
        self.properties.entry(name.to_owned()).or_default().push(Candidate { value, is_attribute });
    }

    fn add_declaration(&mut self, Declaration { name, value, .. }: Declaration<'a>) {
        if name.starts_with("--") {
            self.custom.insert(name, value);
            return;
        }
        let name = name.to_ascii_lowercase();
        let longhands: &[&str] = match name.as_str() {
            "marker" => &["marker-start", "marker-mid", "marker-end"],
            "background" => &["background-color"],
            name => &[name],
        };
        longhands.iter().for_each(|name| self.add(name, value, false));
    }

    /// Returns true if the colour scheme is dark and no other is allowed. Returns `None` if no colour scheme is declared.
    fn is_dark(&self, variables: &Variables) -> Option<bool> {
        let value = self.properties.get("color-scheme")?.last()?.value;
        let value = variables.resolve(value).ok()?.to_ascii_lowercase();
        let has = |scheme: &str| words(&value).any(|word| word == scheme);
        (has("dark") || has("light") || has("normal")).then(|| has("dark") && !has("light"))
    }
}

/// The style sheets of a drawing.
struct Styles<'a> {
    rules: Vec<Rule<'a>>,
    /// Number of steps left.
    steps: Cell<u64>,
    broken: &'a Broken<'a>,
}

impl<'a> Styles<'a> {
    fn take(&self, steps: usize) -> Result<(), SketchError> {
        let left = self.steps.get().checked_sub(steps as u64 + 1);
        self.steps.set(left.unwrap_or(0));
        let limit = || format!("{} million steps for styles", MOST_STEPS / 1_000_000);
        left.map(drop).ok_or_else(|| self.broken.too_large(limit(), "more".into()))
    }

    /// Refuses rules whose selectors cannot be read. If such a rule affects what is seen, it may be the one that makes the
    /// walls visible.
    fn check_selectors(&self) -> Result<(), SketchError> {
        for Rule { selector, declarations, .. } in &self.rules {
            let Err(text) = selector else { continue };
            let matters = |one: &&Declaration| one.name.starts_with("--") || is_visible(one.name);
            if let Some(declaration) = declarations.iter().find(matters) {
                let reason =
                    "expected a selector by tags, classes, ids, attributes, parents or the sibling before";
                return Err(self.unreadable(
                    format!("the rule {text:?} of a style sheet"),
                    declaration.name,
                    declaration.value,
                    reason,
                ));
            }
        }
        Ok(())
    }

    /// Returns the value of an attribute. The length of a shape is returned in the form that the renderer reads. An unreadable
    /// length is an error, because the renderer would leave out its shape.
    fn length<'v>(
        &self,
        node: Node,
        key: &str,
        value: &'v str,
        scope: &Scope,
    ) -> Result<Cow<'v, str>, SketchError> {
        if scope.is_hidden || !LENGTHS.contains(&key) || !SHAPES.contains(&node.tag_name().name()) {
            return Ok(Cow::Borrowed(value));
        }
        match check(Kind::Distance, value.trim()) {
            Checked::Valid(text) => Ok(Cow::Owned(text)),
            Checked::Invalid => Ok(Cow::Borrowed(value)),
            Checked::Unreadable(reason) => Err(self.unreadable(located(node), key, value, &reason)),
        }
    }

    fn unreadable(&self, element: String, property: &str, value: &str, reason: &str) -> SketchError {
        SketchError::Unreadable {
            file: self.broken.file(),
            element,
            property: property.to_owned(),
            value: value.chars().take(SHOWN).collect(),
            reason: reason.to_owned(),
        }
    }

    /// Returns all declarations for an element. `style` is the element's `style` attribute without comments.
    fn declared<'n>(&self, node: Node<'n, '_>, style: &'n str) -> Result<Declared<'n>, SketchError>
    where
        'a: 'n,
    {
        let mut declared = Declared::default();
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            if is_presentation(attribute.name()) {
                declared.add(attribute.name(), attribute.value(), true);
            }
        }
        let seen = Seen { node, steps: &self.steps };
        let holding = self.rules.iter().filter(|rule| rule.holds(&seen));
        let by_rules = holding.flat_map(|rule| rule.declarations.iter().copied());
        let mut all: Vec<_> = by_rules.chain(declarations(style)).collect();
        all.sort_by_key(|declaration| declaration.important);
        for declaration in all {
            self.take(declaration.value.len())?;
            declared.add_declaration(declaration);
        }
        self.take(self.rules.len())?;
        Ok(declared)
    }

    /// Returns the value of a property, or `None` if the element does not set it.
    fn settled(
        &self,
        node: Node,
        (property, candidates): (&str, &[Candidate]),
        scope: &Scope,
    ) -> Result<Option<String>, SketchError> {
        let is_length = GEOMETRY.contains(&property);
        let kind = kind(property).unwrap_or(if is_length { Kind::Distance } else { Kind::Any });
        let mut trouble = None;
        for Candidate { value, is_attribute } in candidates.iter().rev() {
            self.take(value.len())?;
            let resolved =
                if refers(value) { scope.variables.resolve(value) } else { Ok((*value).to_owned()) };
            let checked = match &resolved {
                Err(unresolved) => Checked::Unreadable(unresolved.words()),
                Ok(text) if text.trim().is_empty() => continue,
                Ok(text) => match text.trim().to_ascii_lowercase().as_str() {
                    "inherit" => return Ok((!is_inherited(property)).then(|| "inherit".to_owned())),
                    "initial" => return Ok(initial(property).map(str::to_owned)),
                    "unset" | "revert" | "revert-layer" => return Ok(None),
                    // The attribute `transform` has its own syntax, which the renderer understands.
                    _ if *is_attribute && kind == Kind::Transform => Checked::Valid(text.clone()),
                    _ if scope.is_dark => check(kind, in_dark(text.trim()).trim()),
                    _ => check(kind, text.trim()),
                },
            };
            match checked {
                Checked::Valid(text) => return Ok(Some(text)),
                Checked::Unreadable(reason) => _ = trouble.get_or_insert((*value, reason)),
                Checked::Invalid if is_missed(kind, property, scope) => {
                    _ = trouble.get_or_insert((*value, "it is not a CSS colour".to_owned()));
                }
                Checked::Invalid => {}
            }
        }
        match trouble {
            Some((value, reason)) if !scope.is_hidden => {
                Err(self.unreadable(located(node), property, value, &reason))
            }
            _ => Ok(None),
        }
    }
}

impl Rule<'_> {
    fn holds(&self, seen: &Seen) -> bool {
        self.selector.as_ref().is_ok_and(|selector| selector.matches(seen))
    }
}

/// Returns true if an invalid value may make a line vanish, because nothing around the element sets another colour.
fn is_missed(kind: Kind, property: &str, scope: &Scope) -> bool {
    matches!(kind, Kind::Paint | Kind::Colour)
        && property != "background-color"
        && !(is_inherited(property) && scope.declared.contains(property))
}

/// Returns true if a property affects what is seen.
fn is_visible(property: &str) -> bool {
    let property = property.to_ascii_lowercase();
    property == "display" || kind(&property).is_some_and(|kind| kind != Kind::Any)
}

/// Returns true if a CSS property is also an attribute in SVG.
fn is_presentation(property: &str) -> bool {
    kind(property).is_some_and(|kind| kind != Kind::Undrawable)
}

/// Returns the name of an element and its line in the file.
fn located(node: Node) -> String {
    let place = node.document().text_pos_at(node.range().start);
    format!("{} in line {}", name(node), place.row)
}

/// Writes the drawing with plain attributes.
struct Walk<'a, 'input> {
    styles: &'a Styles<'a>,
    ids: BTreeMap<&'a str, Node<'a, 'input>>,
    pictures: Pictures,
    out: String,
    left_out: Vec<LeftOut>,
    served: BTreeMap<String, String>,
    affected: BTreeMap<String, String>,
    unscaled: BTreeMap<String, String>,
    labels: Vec<(String, String)>,
    last_line: Option<LastLine>,
    /// Number of texts that are left out and do not name a place.
    nameless: usize,
}

impl Walk<'_, '_> {
    fn element(&mut self, node: Node, scope: &Scope, depth: usize) -> Result<(), SketchError> {
        if depth > MOST_DEPTH {
            let limit = format!("{MOST_DEPTH} SVG elements inside each other, references included");
            return Err(self.styles.broken.too_large(limit, format!("more around {}", name(node))));
        }
        let tag = node.tag_name().name();
        if self.is_left_out(node, tag, scope)? {
            return Ok(());
        }
        let style = without_comments(node.attribute("style").unwrap_or(""));
        let declared = self.styles.declared(node, &style)?;
        let mut inside = Scope { variables: scope.variables.with(&declared.custom), ..scope.clone() };
        self.styles.take(if declared.custom.is_empty() { 0 } else { inside.variables.len() })?;
        inside.is_dark = declared.is_dark(&inside.variables).unwrap_or(scope.is_dark);
        self.write(format_args!("<{tag}"))?;
        if depth == 0 {
            self.write(format_args!(" xmlns=\"{SVG}\" xmlns:xlink=\"{XLINK}\""))?;
        }
        self.attributes(node, &declared, scope)?;
        if tag == "use" && !declared.custom.is_empty() && !scope.is_hidden {
            self.miss(LeftOut::Variables(name(node)));
        }
        let attributes = self.out.len();
        let settled = self.properties(node, &declared, &inside)?;
        inside.stroke = settled.get("stroke").cloned().or(inside.stroke);
        inside.is_hidden |= settled.get("display").is_some_and(|display| display == "none");
        inside.is_template |= TEMPLATES.contains(&tag);
        let effect = settled.get("vector-effect").map(|effect| effect.contains("non-scaling-stroke"));
        inside.keeps_width = effect.unwrap_or(false);
        inside.font = scope.font.of(&settled);
        self.watch(node, &settled, &inside, attributes)?;
        let colours = settled.into_keys().filter(|property| is_inherited(property));
        inside
            .declared
            .extend(colours.filter(|property| matches!(kind(property), Some(Kind::Paint | Kind::Colour))));
        self.write(format_args!(">"))?;
        for child in node.children().filter(|child| is_svg(*child)) {
            self.element(child, &inside, depth + 1)?;
        }
        self.write(format_args!("</{tag}>"))
    }

    /// Writes all attributes of an element except those that are styles.
    fn attributes(&mut self, node: Node, declared: &Declared, scope: &Scope) -> Result<(), SketchError> {
        let is_root = node.parent_element().is_none();
        let mut links = Vec::new();
        for attribute in node.attributes() {
            let (space, key, value) = (attribute.namespace(), attribute.name(), attribute.value());
            let overridden = !is_root && GEOMETRY.contains(&key) && declared.properties.contains_key(key);
            match space {
                None | Some(SVG | XLINK) if key == "href" => links.push((space == Some(XLINK), value)),
                None | Some(SVG)
                    if ["style", "class"].contains(&key) || is_presentation(key) || overridden => {}
                None | Some(SVG) => {
                    let value = self.styles.length(node, key, value, scope)?;
                    self.check_points(node, key, &value, scope);
                    self.attribute(key, &value)?;
                }
                _ => {}
            }
        }
        // A plain `href` takes precedence over `xlink:href`.
        links.sort_unstable();
        links.first().map_or(Ok(()), |(_, link)| self.link(node, link, scope))
    }

    /// Writes a reference to an element or a picture.
    fn link(&mut self, node: Node, link: &str, scope: &Scope) -> Result<(), SketchError> {
        match node.tag_name().name() {
            "image" | "feImage" if !link.trim_start().starts_with('#') => {
                let broken =
                    Broken { file: &format!("{}: the picture in {}", self.styles.broken.file, name(node)) };
                match self.pictures.add(link, &broken)? {
                    Ok(reference) => return self.attribute("href", &reference),
                    Err(found) if !scope.is_hidden => {
                        self.miss(LeftOut::Picture { element: name(node), found });
                    }
                    Err(_) => {}
                }
                Ok(())
            }
            "use" if !scope.is_hidden && !self.is_known(link) => {
                self.miss(LeftOut::Reference {
                    element: name(node),
                    found: link.chars().take(SHOWN).collect(),
                });
                Ok(())
            }
            _ => self.attribute("href", link),
        }
    }

    fn is_known(&self, link: &str) -> bool {
        link.trim().strip_prefix('#').is_some_and(|id| self.ids.contains_key(id))
    }

    fn miss(&mut self, what: LeftOut) {
        self.left_out.push(what);
    }

    /// Writes the properties in force as attributes, and returns them.
    fn properties(
        &mut self,
        node: Node,
        declared: &Declared,
        scope: &Scope,
    ) -> Result<BTreeMap<String, String>, SketchError> {
        let (mut settled, mut style) = (BTreeMap::new(), String::new());
        for (property, candidates) in &declared.properties {
            if kind(property).is_none() && !is_geometry(node, property) {
                continue;
            }
            let Some(value) = self.styles.settled(node, (property, candidates), scope)? else { continue };
            self.check_reference(node, property, &value, scope);
            if !STYLE_ONLY.contains(&property.as_str()) {
                let value = path_of(property, &value);
                self.check_points(node, property, value, scope);
                self.attribute(property, value)?;
            } else if value.bytes().all(|byte| byte.is_ascii_alphabetic() || byte == b'-') {
                _ = write!(style, "{property}:{value};");
            }
            settled.insert(property.clone(), value);
        }
        if !style.is_empty() {
            self.attribute("style", &style)?;
        }
        Ok(settled)
    }

    fn attribute(&mut self, key: &str, value: &str) -> Result<(), SketchError> {
        self.write(format_args!(" {key}=\"{}\"", escaped(value)))
    }

    fn write(&mut self, text: std::fmt::Arguments) -> Result<(), SketchError> {
        _ = self.out.write_fmt(text);
        if self.out.len() > MOST_BYTES {
            let limit = format!("{} MB of SVG with its styles resolved", MOST_BYTES >> 20);
            return Err(self.styles.broken.too_large(limit, "more".into()));
        }
        Ok(())
    }
}

/// Returns true if a CSS property sets the geometry of this element.
fn is_geometry(node: Node, property: &str) -> bool {
    let is_svg_element = node.tag_name().name() == "svg";
    !is_svg_element && (GEOMETRY.contains(&property) || property == "d" && node.tag_name().name() == "path")
}

/// Returns the data in `path("…")`, or any other value unchanged.
fn path_of<'v>(property: &str, value: &'v str) -> &'v str {
    let inside = (property == "d").then(|| function(value)).flatten();
    match inside {
        Some((name, data)) if name == "path" => data.trim_matches(['"', '\'']),
        _ => value,
    }
}

fn escaped(value: &str) -> Cow<'_, str> {
    if !value.contains(['&', '<', '>', '"', '\n', '\t', '\r']) {
        return value.into();
    }
    let mut text = String::with_capacity(value.len() + 16);
    for c in value.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            '\n' => text.push_str("&#10;"),
            '\t' => text.push_str("&#9;"),
            '\r' => text.push_str("&#13;"),
            c => text.push(c),
        }
    }
    text.into()
}

#[cfg(test)]
mod tests;
