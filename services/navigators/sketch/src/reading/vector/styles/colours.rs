//! Converts CSS colours to sRGB. (CSS Color Module Level 4; `light-dark()` and `color-mix()` of Level 5.)
//!
//! A drawing is read on white paper. This means that `light-dark()` stands for its light colour, unless the drawing's scheme is
//! dark ([`in_dark`]), and that system colours are those of a light page. Out-of-gamut colours are clipped, as browsers do.

use color::{ColorSpaceTag, DynamicColor, HueDirection, Srgb, parse_color};

use super::syntax::{find, function, split, words};

/// Maximum nesting depth of functions.
const MOST_DEPTH: usize = 8;

/// CSS functions that return a colour.
const FUNCTIONS: [&str; 17] = [
    "rgb",
    "rgba",
    "hsl",
    "hsla",
    "hwb",
    "lab",
    "lch",
    "oklab",
    "oklch",
    "color",
    "color-mix",
    "light-dark",
    "contrast-color",
    "device-cmyk",
    "device-color",
    "icc-color",
    "alpha",
];

/// System colours on a light page.
const SYSTEM: [(&str, [u8; 3]); 21] = [
    ("accentcolor", [0, 117, 255]),
    ("accentcolortext", [255, 255, 255]),
    ("activetext", [255, 0, 0]),
    ("buttonborder", [0, 0, 0]),
    ("buttonface", [240, 240, 240]),
    ("buttontext", [0, 0, 0]),
    ("canvas", [255, 255, 255]),
    ("canvastext", [0, 0, 0]),
    ("field", [255, 255, 255]),
    ("fieldtext", [0, 0, 0]),
    ("graytext", [128, 128, 128]),
    ("highlight", [181, 213, 255]),
    ("highlighttext", [0, 0, 0]),
    ("linktext", [0, 0, 238]),
    ("mark", [255, 255, 0]),
    ("marktext", [0, 0, 0]),
    ("selecteditem", [181, 213, 255]),
    ("selecteditemtext", [0, 0, 0]),
    ("visitedtext", [85, 26, 139]),
    ("window", [255, 255, 255]),
    ("windowtext", [0, 0, 0]),
];

/// A text read as a colour.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Colour {
    /// A colour in sRGB: `#rrggbb`, or `#rrggbbaa` if it is translucent.
    Srgb(String),
    /// The value of the property `color`.
    Current,
    /// A CSS colour that cannot be computed here, with the reason.
    Unreadable(String),
    /// Not a CSS colour.
    Invalid,
}

/// Reads a colour.
pub(super) fn read(text: &str) -> Colour {
    let text = text.trim();
    if text.eq_ignore_ascii_case("currentcolor") {
        return Colour::Current;
    }
    match resolved(text, 0) {
        Ok(color) => Colour::Srgb(hex(color)),
        Err(Trouble::Current) => Colour::Unreadable("currentColor inside a function".into()),
        Err(Trouble::Unreadable(why)) => Colour::Unreadable(why),
        Err(Trouble::Invalid) => Colour::Invalid,
    }
}

/// Replaces each `light-dark()` in a value by its second colour, as a dark colour scheme demands.
pub(super) fn in_dark(value: &str) -> String {
    const NAME: &str = "light-dark(";
    let (small, mut text, mut end) = (value.to_ascii_lowercase(), String::new(), 0);
    while let Some(at) = small[end..].find(NAME).map(|at| end + at) {
        let inside = at + NAME.len();
        let close = inside + find(&value[inside..], b")");
        text.push_str(&value[end..at]);
        text.push_str(split(&value[inside..close], b',').nth(1).unwrap_or(""));
        end = (close + 1).min(value.len());
    }
    text + &value[end..]
}

enum Trouble {
    Current,
    Unreadable(String),
    Invalid,
}

fn resolved(text: &str, depth: usize) -> Result<DynamicColor, Trouble> {
    let text = text.trim();
    if depth > MOST_DEPTH {
        return Err(Trouble::Unreadable(format!("functions nested more than {MOST_DEPTH} deep")));
    }
    if let Ok(color) = parse_color(text) {
        return Ok(color);
    }
    if text.eq_ignore_ascii_case("currentcolor") {
        return Err(Trouble::Current);
    }
    let Some((name, arguments)) = function(text) else { return system(text).ok_or(Trouble::Invalid) };
    match name.as_str() {
        "light-dark" => light(arguments, depth),
        "color-mix" => mixed(arguments, depth),
        name if FUNCTIONS.contains(&name) => trouble(name, arguments),
        _ => Err(Trouble::Invalid),
    }
}

/// Explains why a colour function could not be parsed. Arguments that would have to be computed are not mistakes.
fn trouble(name: &str, arguments: &str) -> Result<DynamicColor, Trouble> {
    let first = words(arguments).next().unwrap_or("");
    if first.eq_ignore_ascii_case("from") {
        return Err(Trouble::Unreadable("a colour that is computed from another one".into()));
    }
    let is_profile = name == "color" && first.starts_with("--");
    let is_known = !["contrast-color", "device-cmyk", "device-color", "icc-color", "alpha"].contains(&name);
    let computed = arguments.contains('(');
    if is_known && !computed && !is_profile {
        return Err(Trouble::Invalid);
    }
    Err(Trouble::Unreadable(format!("{name}() with arguments that are not supported")))
}

fn system(text: &str) -> Option<DynamicColor> {
    let name = text.to_ascii_lowercase();
    let (_, [r, g, b]) = SYSTEM.into_iter().find(|(known, _)| *known == name)?;
    Some(DynamicColor::from_alpha_color(color::AlphaColor::<Srgb>::from_rgba8(r, g, b, 255)))
}

fn light(arguments: &str, depth: usize) -> Result<DynamicColor, Trouble> {
    let both: Vec<_> = split(arguments, b',').collect();
    let [light, _] = both[..] else { return Err(Trouble::Invalid) };
    resolved(light, depth + 1)
}

/// Mixes two colours, given as `in <space> [<way> hue], <colour> [<share>], <colour> [<share>]`.
fn mixed(arguments: &str, depth: usize) -> Result<DynamicColor, Trouble> {
    let parts: Vec<_> = split(arguments, b',').collect();
    let (space, first, second) = match parts[..] {
        [space, first, second] => (space, first, second),
        // Level 5 mixes in Oklab if no colour space is given.
        [first, second] => ("in oklab", first, second),
        _ => return Err(Trouble::Invalid),
    };
    let (space, way) = way(space)?;
    let (first, first_share) = part(first, depth)?;
    let (second, second_share) = part(second, depth)?;
    let (p, q) = match (first_share, second_share) {
        (None, None) => (0.5, 0.5),
        (Some(p), None) => (p, 1.0 - p),
        (None, Some(q)) => (1.0 - q, q),
        (Some(p), Some(q)) => (p, q),
    };
    let sum = p + q;
    if sum <= 0.0 {
        return Err(Trouble::Invalid);
    }
    let mix = first.interpolate(second, space, way).eval(q / sum);
    Ok(if sum < 1.0 { mix.multiply_alpha(sum) } else { mix })
}

fn way(text: &str) -> Result<(ColorSpaceTag, HueDirection), Trouble> {
    let text = text.to_ascii_lowercase();
    let mut words = text.split_ascii_whitespace();
    if words.next() != Some("in") {
        return Err(Trouble::Invalid);
    }
    let name = words.next().ok_or(Trouble::Invalid)?;
    let space = match name {
        "hsl" => ColorSpaceTag::Hsl,
        "hwb" => ColorSpaceTag::Hwb,
        "rec2020" => ColorSpaceTag::Rec2020,
        name => name.parse().map_err(|_| Trouble::Unreadable(format!("a mix in {name}")))?,
    };
    let way = match words.next() {
        None | Some("shorter") => HueDirection::Shorter,
        Some("longer") => HueDirection::Longer,
        Some("increasing") => HueDirection::Increasing,
        Some("decreasing") => HueDirection::Decreasing,
        Some(_) => return Err(Trouble::Invalid),
    };
    Ok((space, way))
}

/// Reads one of the colours of a mix, with its share if one is given.
fn part(text: &str, depth: usize) -> Result<(DynamicColor, Option<f32>), Trouble> {
    let (mut color, mut share) = (None, None);
    for word in words(text) {
        match word.strip_suffix('%').map(str::parse::<f32>) {
            Some(Ok(percent)) if (0.0..=100.0).contains(&percent) => share = Some(percent / 100.0),
            Some(Err(_)) | None if color.is_none() => color = Some(resolved(word, depth + 1)?),
            _ => return Err(Trouble::Invalid),
        }
    }
    color.map(|color| (color, share)).ok_or(Trouble::Invalid)
}

fn hex(color: DynamicColor) -> String {
    let color::Rgba8 { r, g, b, a } = color.to_alpha_color::<Srgb>().to_rgba8();
    if a == 255 { format!("#{r:02x}{g:02x}{b:02x}") } else { format!("#{r:02x}{g:02x}{b:02x}{a:02x}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn srgb(text: &str) -> String {
        match read(text) {
            Colour::Srgb(hex) => hex,
            other => panic!("{text}: {other:?}"),
        }
    }

    /// The expected values are from CSS Color Module Level 4 and its tests.
    #[test]
    fn every_way_to_write_a_colour_is_read() {
        for (text, expected) in [
            ("Black", "#000000"),
            ("#1D1d1d", "#1d1d1d"),
            ("#f008", "#ff000088"),
            ("rgb(0 0 0 / 100%)", "#000000"),
            ("rgba(10, 20, 30, 50%)", "#0a141e80"),
            ("rgb(50% 0% 100%)", "#8000ff"),
            ("rgb(none 255 0)", "#00ff00"),
            ("hsl(120deg 100% 25%)", "#008000"),
            ("hsla(0.5turn, 100%, 50%, 1)", "#00ffff"),
            ("hwb(120 0% 49.8039%)", "#008000"),
            ("lab(46.2775% -47.5621 48.5837)", "#008000"),
            ("lch(46.2775% 67.9892 134.3912)", "#008000"),
            ("oklab(51.975% -0.1403 0.10768)", "#008000"),
            ("oklch(51.975% 0.17686 142.495)", "#008000"),
            ("oklch(0.2 0 0)", "#161616"),
            ("color(srgb 0 0.50196 0)", "#008000"),
            ("color(srgb-linear 0 0.21586 0)", "#008000"),
            ("color(display-p3 0.1176 0.1176 0.1176)", "#1e1e1e"),
            ("color(display-p3 0 1 0)", "#00ff00"),
            ("color(xyz-d65 0.07719 0.15438 0.02573)", "#008000"),
            ("light-dark(rgb(0, 0, 0), rgb(255, 255, 255))", "#000000"),
            ("LIGHT-DARK(oklch(0.2 0 0), white)", "#161616"),
            ("color-mix(in srgb, black, white)", "#808080"),
            ("color-mix(in srgb, black 25%, white)", "#bfbfbf"),
            ("color-mix(in srgb, black 25%, black 25%)", "#00000080"),
            ("color-mix(in hsl, #f00, #0f0)", "#ffff00"),
            ("color-mix(in hsl longer hue, #f00, #0f0)", "#0000ff"),
            ("CanvasText", "#000000"),
            ("transparent", "#00000000"),
        ] {
            assert_eq!(srgb(text), expected, "{text}");
        }
    }

    #[test]
    fn a_dark_scheme_takes_the_second_colour() {
        for (value, expected) in [
            ("light-dark(black, white)", "white"),
            ("url(#a) LIGHT-DARK(rgb(0, 0, 0), rgb(255, 255, 255))", "url(#a) rgb(255, 255, 255)"),
            ("color-mix(in srgb, light-dark(a, b), light-dark(c, d))", "color-mix(in srgb, b, d)"),
            ("#111", "#111"),
            ("light-dark(a", ""),
        ] {
            assert_eq!(in_dark(value), expected, "{value}");
        }
    }

    #[test]
    fn what_css_knows_and_we_do_not_is_no_mistake() {
        for text in [
            "oklch(from red l c h)",
            "rgb(calc(1 + 2) 0 0)",
            "color(--press 1 0 0 0)",
            "device-cmyk(0 81% 81% 30%)",
            "color-mix(in srgb, currentColor, white)",
            "contrast-color(white)",
        ] {
            assert!(matches!(read(text), Colour::Unreadable(_)), "{text}: {:?}", read(text));
        }
        for text in
            ["", "blac", "#12345", "rgb(1)", "light-dark(red)", "color(srgb 1)", "url(#a)", "rgb(0 0 0"]
        {
            assert_eq!(read(text), Colour::Invalid, "{text}");
        }
        assert_eq!(read("CurrentColor"), Colour::Current);
    }
}
