//! The CSS properties that affect how a drawing looks, and checks of their values.

use super::colours::{self, Colour};
use super::syntax::{function, split, words};

/// The kind of value that a property takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// `fill`, `stroke`: a colour, a paint server, or none.
    Paint,
    /// A colour.
    Colour,
    /// A number or a percentage.
    Share,
    /// A length that is not negative.
    Length,
    /// A length of either sign.
    Distance,
    /// `visible`, `hidden` or `collapse`.
    Visibility,
    /// A list of transformations.
    Transform,
    /// A transformation by a property that exists only in CSS, such as `rotate`. It is not drawn.
    Undrawable,
    /// Any value, which the renderer interprets.
    Any,
}

/// Properties whose values are passed to the renderer unchanged.
const ANY: [&str; 45] = [
    "alignment-baseline",
    "baseline-shift",
    "clip-path",
    "clip-rule",
    "color-interpolation",
    "color-interpolation-filters",
    "color-rendering",
    "direction",
    "display",
    "dominant-baseline",
    "fill-rule",
    "filter",
    "font-family",
    "font-kerning",
    "font-size",
    "font-stretch",
    "font-style",
    "font-variant",
    "font-weight",
    "glyph-orientation-horizontal",
    "glyph-orientation-vertical",
    "image-rendering",
    "isolation",
    "letter-spacing",
    "marker-end",
    "marker-mid",
    "marker-start",
    "mask",
    "mask-type",
    "mix-blend-mode",
    "overflow",
    "paint-order",
    "shape-rendering",
    "stroke-dasharray",
    "stroke-linecap",
    "stroke-linejoin",
    "stroke-miterlimit",
    "text-anchor",
    "text-decoration",
    "text-rendering",
    "transform-origin",
    "unicode-bidi",
    "vector-effect",
    "word-spacing",
    "writing-mode",
];

/// Returns the kind of a property, or `None` if it does not affect how a drawing looks.
pub(super) fn kind(property: &str) -> Option<Kind> {
    Some(match property {
        "fill" | "stroke" => Kind::Paint,
        "color" | "stop-color" | "flood-color" | "lighting-color" | "background-color" => Kind::Colour,
        "opacity" | "fill-opacity" | "stroke-opacity" | "stop-opacity" | "flood-opacity" => Kind::Share,
        "stroke-width" => Kind::Length,
        "stroke-dashoffset" => Kind::Distance,
        "visibility" => Kind::Visibility,
        "transform" => Kind::Transform,
        "translate" | "rotate" | "scale" => Kind::Undrawable,
        other => return ANY.contains(&other).then_some(Kind::Any),
    })
}

/// Returns true if elements without a value for this property inherit their parent's.
pub(super) fn is_inherited(property: &str) -> bool {
    !matches!(
        property,
        "background-color"
            | "clip-path"
            | "display"
            | "filter"
            | "flood-color"
            | "flood-opacity"
            | "isolation"
            | "lighting-color"
            | "mask"
            | "mask-type"
            | "mix-blend-mode"
            | "opacity"
            | "overflow"
            | "rotate"
            | "scale"
            | "stop-color"
            | "stop-opacity"
            | "transform"
            | "transform-origin"
            | "translate"
            | "vector-effect"
    )
}

/// Returns the initial value of an inherited property. Other properties don't need it here: they have it whenever they are not
/// set.
pub(super) fn initial(property: &str) -> Option<&'static str> {
    Some(match property {
        "fill" | "color" => "black",
        "stroke" | "stroke-dasharray" | "marker-start" | "marker-mid" | "marker-end" => "none",
        "fill-opacity" | "stroke-opacity" | "stroke-width" => "1",
        "stroke-dashoffset" => "0",
        "stroke-linecap" => "butt",
        "stroke-linejoin" => "miter",
        "stroke-miterlimit" => "4",
        "fill-rule" | "clip-rule" => "nonzero",
        "visibility" => "visible",
        _ => return None,
    })
}

/// The result of checking a value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Checked {
    /// The value as the renderer reads it.
    Valid(String),
    /// The value is not valid for the property.
    Invalid,
    /// The value may be valid in CSS but cannot be drawn, for the given reason.
    Unreadable(String),
}

/// Checks a value whose `var()` have been replaced and that is not one of the keywords all properties take.
pub(super) fn check(kind: Kind, value: &str) -> Checked {
    match kind {
        Kind::Paint => paint(value),
        Kind::Colour => colour(value),
        Kind::Share => number(value, &["", "%"], true),
        Kind::Length => match number(value, &UNITS, false) {
            Checked::Valid(text) if text.starts_with('-') => Checked::Invalid,
            checked => checked,
        },
        Kind::Distance => number(value, &UNITS, false),
        Kind::Visibility => word(value, &["visible", "hidden", "collapse"]),
        Kind::Transform => transform(value),
        Kind::Undrawable if value.eq_ignore_ascii_case("none") => Checked::Valid("none".into()),
        Kind::Undrawable => Checked::Unreadable("only the property transform is drawn".into()),
        Kind::Any => Checked::Valid(value.to_owned()),
    }
}

/// The units that the renderer supports.
const UNITS: [&str; 10] = ["", "px", "%", "em", "ex", "in", "cm", "mm", "pt", "pc"];
/// CSS units that depend on a page or a font outside the drawing.
const FOREIGN_UNITS: [&str; 13] =
    ["rem", "ch", "rch", "lh", "rlh", "cap", "ic", "vw", "vh", "vi", "vb", "vmin", "vmax"];

fn word(value: &str, known: &[&str]) -> Checked {
    let value = value.to_ascii_lowercase();
    if known.contains(&value.as_str()) { Checked::Valid(value) } else { Checked::Invalid }
}

fn paint(value: &str) -> Checked {
    let small = value.to_ascii_lowercase();
    if ["none", "context-fill", "context-stroke"].contains(&small.as_str()) {
        return Checked::Valid(small);
    }
    if !small.starts_with("url(") {
        return colour(value);
    }
    let mut parts = words(value);
    let Some(server) = parts.next().and_then(url) else { return Checked::Invalid };
    let fallback: Vec<_> = parts.collect();
    match fallback[..] {
        [] => Checked::Valid(format!("url({server})")),
        [none] if none.eq_ignore_ascii_case("none") => Checked::Valid(format!("url({server}) none")),
        _ => match colour(&fallback.join(" ")) {
            Checked::Valid(fallback) => Checked::Valid(format!("url({server}) {fallback}")),
            other => other,
        },
    }
}

/// Returns the target of `url()`, or `None` for any other word.
pub(super) fn url(value: &str) -> Option<&str> {
    let is_url = value.get(..4)?.eq_ignore_ascii_case("url(");
    let inside = value.get(4..).filter(|_| is_url)?.strip_suffix(')')?;
    Some(inside.trim().trim_matches(['"', '\'']).trim())
}

fn colour(value: &str) -> Checked {
    match colours::read(value) {
        Colour::Srgb(hex) => Checked::Valid(hex),
        Colour::Current => Checked::Valid("currentColor".into()),
        Colour::Unreadable(why) => Checked::Unreadable(why),
        Colour::Invalid => before_profile(value),
    }
}

/// Reads an sRGB colour that is followed by a colour in a profile, as SVG 1.1 allows.
fn before_profile(value: &str) -> Checked {
    let mut parts = words(value);
    let (first, second, rest) = (parts.next(), parts.next(), parts.next());
    let is_profile = second
        .and_then(function)
        .is_some_and(|(name, _)| ["icc-color", "device-color"].contains(&name.as_str()));
    match (first.map(colours::read), rest) {
        (Some(Colour::Srgb(hex)), None) if is_profile => Checked::Valid(hex),
        _ => Checked::Invalid,
    }
}

fn number(value: &str, units: &[&str], shares: bool) -> Checked {
    if let Some((name, _)) = function(value) {
        return Checked::Unreadable(format!("{name}() is not supported here"));
    }
    let (digits, unit) = value.split_at(number_end(value));
    let unit = unit.to_ascii_lowercase();
    match digits.parse::<f64>() {
        Ok(number) if number.is_finite() && units.contains(&unit.as_str()) => {
            Checked::Valid(if shares && unit == "%" {
                (number / 100.0).to_string()
            } else {
                format!("{digits}{unit}")
            })
        }
        // A quarter of a millimetre, which is the only absolute unit of CSS that the renderer does not support.
        Ok(number) if number.is_finite() && unit == "q" && units.contains(&"mm") => {
            Checked::Valid(format!("{}mm", number / 4.0))
        }
        Ok(_) if FOREIGN_UNITS.contains(&unit.as_str()) => {
            Checked::Unreadable(format!("the unit {unit} depends on a page or a font outside the drawing"))
        }
        _ => Checked::Invalid,
    }
}

/// Returns the end index of the number at the beginning of a text.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = |at: usize| at + usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let mut end = digits(sign(0));
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = sign(end + 1);
        let after = digits(exponent);
        if after > exponent {
            end = after;
        }
    }
    end
}

/// Converts CSS transformations to the syntax of SVG, in user units and degrees.
fn transform(value: &str) -> Checked {
    if value.eq_ignore_ascii_case("none") {
        return Checked::Valid(String::new());
    }
    let mut list = Vec::new();
    let mut rest = value;
    while !rest.is_empty() {
        let Some(close) = rest.find(')') else { return Checked::Invalid };
        let Some((name, arguments)) = function(&rest[..=close]) else { return Checked::Invalid };
        match transformation(&name, arguments) {
            Some(text) => list.push(text),
            None => return Checked::Unreadable(format!("{name}({arguments}) is not drawn")),
        }
        rest = rest[close + 1..].trim_start_matches(|c: char| c.is_whitespace() || c == ',');
    }
    Checked::Valid(list.join(" "))
}

fn transformation(name: &str, arguments: &str) -> Option<String> {
    let arguments: Vec<_> = split(arguments, b',').flat_map(words).collect();
    let lengths =
        || arguments.iter().map(|text| quantity(text, &[("", 1.0), ("px", 1.0)])).collect::<Option<Vec<_>>>();
    let numbers = || arguments.iter().map(|text| quantity(text, &[("", 1.0)])).collect::<Option<Vec<_>>>();
    let turns = [("", 1.0), ("deg", 1.0), ("grad", 0.9), ("turn", 360.0), ("rad", 1_f64.to_degrees())];
    let angles = || arguments.iter().map(|text| quantity(text, &turns)).collect::<Option<Vec<_>>>();
    match (name, arguments.len()) {
        ("translate", 1 | 2) => lengths().map(|list| call("translate", &list)),
        ("translatex", 1) => lengths().map(|list| call("translate", &[list[0], 0.0])),
        ("translatey", 1) => lengths().map(|list| call("translate", &[0.0, list[0]])),
        ("scale", 1 | 2) => numbers().map(|list| call("scale", &list)),
        ("scalex", 1) => numbers().map(|list| call("scale", &[list[0], 1.0])),
        ("scaley", 1) => numbers().map(|list| call("scale", &[1.0, list[0]])),
        ("rotate", 1) => angles().map(|list| call("rotate", &list)),
        // Rotation about a centre exists only in SVG.
        ("rotate", 3) => numbers().map(|list| call("rotate", &list)),
        ("skewx", 1) => angles().map(|list| call("skewX", &list)),
        ("skewy", 1) => angles().map(|list| call("skewY", &list)),
        ("matrix", 6) => numbers().map(|list| call("matrix", &list)),
        _ => None,
    }
}

fn quantity(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let (digits, unit) = text.split_at(number_end(text));
    let (_, factor) = units.iter().find(|(known, _)| unit.eq_ignore_ascii_case(known))?;
    digits.parse::<f64>().ok().map(|number| number * factor).filter(|number| number.is_finite())
}

fn call(name: &str, arguments: &[f64]) -> String {
    let arguments: Vec<_> = arguments.iter().map(f64::to_string).collect();
    format!("{name}({})", arguments.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn valid(property: &str, value: &str) -> String {
        match check(kind(property).expect(property), value) {
            Checked::Valid(text) => text,
            other => panic!("{property}: {value}: {other:?}"),
        }
    }

    #[test]
    fn values_become_what_the_renderer_reads() {
        for (property, value, expected) in [
            ("stroke", "NONE", "none"),
            ("fill", "url( '#a' ) oklch(0.2 0 0)", "url(#a) #161616"),
            ("fill", "url(#a) none", "url(#a) none"),
            ("stroke", "#CD853F icc-color(acmecmyk, 0.11, 0.48)", "#cd853f"),
            ("stroke", "CURRENTCOLOR", "currentColor"),
            ("stroke-opacity", "50%", "0.5"),
            ("stroke-width", "1.5E1PX", "1.5E1px"),
            ("stroke-width", "2em", "2em"),
            ("stroke-width", "10Q", "2.5mm"),
            ("stroke-dashoffset", "-4q", "-1mm"),
            ("visibility", "Hidden", "hidden"),
            ("transform", "translate(10px, 20px) rotate(0.25turn)", "translate(10 20) rotate(90)"),
            ("transform", "scaleX(-1) matrix(1,0,0,1,2,3)", "scale(-1 1) matrix(1 0 0 1 2 3)"),
            ("transform", "none", ""),
        ] {
            assert_eq!(valid(property, value), expected, "{property}: {value}");
        }
    }

    #[test]
    fn mistakes_are_told_from_what_cannot_be_drawn() {
        for (property, value) in [
            ("stroke", "bananas"),
            ("stroke", "url(#a) bananas"),
            ("stroke-width", "-3"),
            ("stroke-width", "-4q"),
            ("opacity", "1q"),
            ("stroke-width", "wide"),
            ("opacity", "half"),
            ("visibility", "none"),
            ("transform", "to the left"),
        ] {
            assert_eq!(check(kind(property).unwrap(), value), Checked::Invalid, "{property}: {value}");
        }
        for (property, value) in [
            ("stroke", "rgb(from red r g b)"),
            ("stroke-width", "calc(1px + 2px)"),
            ("stroke-width", "1vw"),
            ("opacity", "var-like(1)"),
            ("transform", "translate(50%, 0)"),
            ("transform", "rotate3d(1, 1, 1, 45deg)"),
            ("rotate", "45deg"),
        ] {
            assert!(
                matches!(check(kind(property).unwrap(), value), Checked::Unreadable(_)),
                "{property}: {value}"
            );
        }
    }
}
