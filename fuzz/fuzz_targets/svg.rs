//! Reads an SVG with arbitrary styles: in a style sheet, in the style of a group, and in an attribute of a path. Arbitrary
//! bytes as a drawing are covered by `sketch`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sketchnav_sketch::reading::{Options, read};

fuzz_target!(|styles: [String; 3]| {
    let [sheet, style, stroke] = styles.map(|text| escaped(&text));
    let svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='64' height='64'><style>{sheet}</style><linearGradient id='g'/>\
        <clipPath id='c' clipPathUnits='objectBoundingBox'><rect width='1' height='1'/></clipPath>\
        <g style='{style}'><path id='p' d='M9 9H50V50H9z' fill='none' stroke='{stroke}'/></g><use href='#p' x='3'/></svg>"
    );
    let first = read(svg.as_bytes(), "fuzz.svg", &Options::default());
    assert!(first == read(svg.as_bytes(), "fuzz.svg", &Options::default()), "two readings differ");
});

/// Returns the text escaped for XML.
fn escaped(text: &str) -> String {
    let allowed = |c: &char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().filter(allowed).fold(String::new(), |mut text, c| {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '\'' => text.push_str("&apos;"),
            c => text.push(c),
        }
        text
    })
}
