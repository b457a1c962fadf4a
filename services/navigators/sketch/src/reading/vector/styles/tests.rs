use proptest::prelude::*;
use resvg::usvg::roxmltree::ParsingOptions;

use super::*;

fn svg(inside: &str) -> String {
    format!("<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'>{inside}</svg>")
}

fn flat(inside: &str) -> Result<Flat, SketchError> {
    let text = svg(inside);
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).expect("XML");
    flatten(&document, &Broken { file: "d.svg" })
}

/// Returns the attributes of the element with the id `w`.
fn attributes(inside: &str) -> BTreeMap<String, String> {
    let flat = flat(inside).unwrap_or_else(|error| panic!("{inside}: {error}"));
    let document = Document::parse(&flat.text).expect("XML");
    let wall = document.descendants().find(|node| node.attribute("id") == Some("w")).expect("the wall");
    wall.attributes().map(|one| (one.name().to_owned(), one.value().to_owned())).collect()
}

fn stroke(inside: &str) -> Option<String> {
    attributes(inside).remove("stroke")
}

fn refusal(inside: &str) -> String {
    match flat(inside) {
        Err(error) => error.to_string(),
        Ok(flat) => panic!("{inside}: {}", flat.text),
    }
}

#[test]
fn the_weightiest_declaration_that_holds_counts() {
    for (inside, expected) in [
        ("<path id='w' stroke='#111'/>", "#111111"),
        // An invalid declaration is dropped, and the attribute or the earlier declaration applies.
        ("<path id='w' stroke='#111' style='stroke: blac'/>", "#111111"),
        ("<path id='w' style='stroke:#111;stroke:color(display-p3 1)'/>", "#111111"),
        ("<path id='w' stroke='#111' style='stroke: oklch(from red l c h)'/>", "#111111"),
        ("<path id='w' stroke='red' style='stroke:#1E1E1E;stroke:color(display-p3 0 0 0);'/>", "#000000"),
        ("<style>path{stroke:#111}</style><path id='w' stroke='red'/>", "#111111"),
        ("<style>#w{stroke:#111} path{stroke:red}</style><path id='w'/>", "#111111"),
        ("<style>path{stroke:#111 !important}</style><path id='w' style='stroke:red'/>", "#111111"),
        ("<style>path{stroke:red !important}</style><path id='w' style='stroke:#111!important'/>", "#111111"),
        ("<style>:root{--a:#111} path{stroke:var(--a)}</style><path id='w'/>", "#111111"),
        ("<g style='--a: light-dark(#111, white)'><path id='w' stroke='var(--a, red)'/></g>", "#111111"),
        ("<path id='w' stroke='var(--a, rgb(17 17 17 / 100%))'/>", "#111111"),
        // A scheme that allows only dark takes the second colour. One that leaves the choice is read on white paper.
        ("<g style='color-scheme: dark'><path id='w' stroke='light-dark(red, #111)'/></g>", "#111111"),
        (
            "<style>:root{color-scheme:only dark}</style><path id='w' stroke='light-dark(red, #111)'/>",
            "#111111",
        ),
        ("<g style='color-scheme: light dark'><path id='w' stroke='light-dark(#111, red)'/></g>", "#111111"),
        (
            "<style>@property --a {syntax: '*'; inherits: true; initial-value: #111}</style>\
          <path id='w' stroke='var(--a)'/>",
            "#111111",
        ),
        (
            "<style>@media print{#w{stroke:red}} @media screen{#w{stroke:#111}}</style><path id='w'/>",
            "#111111",
        ),
        (
            "<style><![CDATA[ g > path.a { STROKE : #111 } ]]></style><g><path id='w' class='b a'/></g>",
            "#111111",
        ),
        ("<path id='w' stroke='#111' style='/* stroke: red; */ fill: none'/>", "#111111"),
        ("<path id='w' stroke='CurrentColor'/>", "currentColor"),
        ("<path id='w' stroke='#111' style='stroke:'/>", "#111111"),
    ] {
        assert_eq!(stroke(inside).as_deref(), Some(expected), "{inside}");
    }
}

#[test]
fn an_element_without_a_value_of_its_own_inherits() {
    for inside in [
        "<g stroke='#111'><path id='w' style='stroke: inherit'/></g>",
        "<g stroke='#111'><path id='w' stroke='red' style='stroke: unset'/></g>",
        "<g stroke='#111'><path id='w' stroke='null'/></g>",
        "<path id='w' stroke=''/>",
    ] {
        assert_eq!(stroke(inside), None, "{inside}");
    }
    assert_eq!(
        stroke("<g stroke='#111'><path id='w' style='stroke: initial'/></g>").as_deref(),
        Some("none")
    );
}

/// CSS has a unit that the renderer does not support: Q, a quarter of a millimetre.
#[test]
fn quarters_of_a_millimetre_are_written_as_millimetres() {
    for inside in [
        "<rect id='w' width='40Q' height='9' stroke-width='2q'/>",
        "<rect id='w' height='9' style='width: 40q; stroke-width: 2Q'/>",
    ] {
        let wall = attributes(inside);
        assert_eq!([&wall["width"], &wall["stroke-width"]], ["10mm", "0.5mm"], "{inside}");
    }
}

#[test]
fn what_cannot_be_read_is_refused_by_element_property_and_value() {
    for (inside, words) in [
        ("<path id='w' stroke='blac'/>", "<path id=\"w\"> in line 1: stroke: \"blac\""),
        (
            "<path style='stroke: oklch(from red l c h)'/>",
            "<path> in line 1: stroke: \"oklch(from red l c h)\"",
        ),
        ("<path stroke='var(--ink)'/>", "stroke: \"var(--ink)\" cannot be read: --ink has no value here"),
        (
            "<style>path{stroke:var(--a)} svg{--a:var(--b);--b:var(--a)}</style><path/>",
            "--a refers to itself",
        ),
        ("<stop stop-color='bananas'/>", "<stop> in line 1: stop-color: \"bananas\""),
        ("<path stroke-width='calc(1px + 2px)'/>", "stroke-width: \"calc(1px + 2px)\""),
        ("<path style='transform: translate(50%)'/>", "transform: \"translate(50%)\""),
        ("<rect width='5rem' height='9'/>", "<rect> in line 1: width: \"5rem\" cannot be read: the unit rem"),
        ("<rect style='width: calc(9px * 2)' height='9'/>", "width: \"calc(9px * 2)\""),
        (
            "<style>path:nth-child(2){stroke:red}</style>",
            "the rule \"path:nth-child(2)\" of a style sheet: stroke",
        ),
        ("<style>g{ path{stroke:red} }</style>", "the rule \"g\""),
    ] {
        let error = refusal(inside);
        assert!(error.contains(words), "{error}\nexpected {words}");
    }
    // Bad values don't matter in elements that are not shown, or in properties that do not affect what is seen.
    for inside in [
        "<g display='none'><path stroke='blac'/></g>",
        "<text stroke='blac'>a</text>",
        "<style>text:nth-child(2){font-size:1rem}</style>",
        "<animate fill='freeze'/>",
    ] {
        assert!(flat(inside).is_ok(), "{inside}");
    }
}

#[test]
fn properties_become_attributes() {
    let all = attributes(
        "<style>marker{fill:none}</style>\
         <rect id='w' data-a='&lt;&quot;&#10;' width='1' style='width:5px; marker:url(#m); opacity:50%; \
         mix-blend-mode:multiply; transform:rotate(0.5turn) translate(1px,2px); font-family:\"A &amp; B\"'/>",
    );
    for (key, value) in [
        ("data-a", "<\"\n"),
        ("width", "5px"),
        ("marker-mid", "url(#m)"),
        ("opacity", "0.5"),
        ("style", "mix-blend-mode:multiply;"),
        ("transform", "rotate(180) translate(1 2)"),
        ("font-family", "\"A & B\""),
    ] {
        assert_eq!(all.get(key).map(String::as_str), Some(value), "{key}: {all:?}");
    }
    assert_eq!(attributes("<path id='w' style='d: path(\"M0 0h9\")'/>").get("d").unwrap(), "M0 0h9");
    // The root element has the namespace of SVG.
    assert!(flat("").unwrap().text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\""));
}

#[test]
fn what_is_left_out_is_named() {
    let names = |inside: &str| {
        flat(inside).unwrap().left_out.iter().map(LeftOut::to_string).collect::<Vec<_>>().join("; ")
    };
    assert_eq!(names("<path d='M0 0'/><title>a</title><desc>b</desc>"), "");
    let label = "<switch><foreignObject><p xmlns='http://www.w3.org/1999/xhtml'>a</p></foreignObject><path/></switch>";
    assert_eq!(
        names(&format!("<text><textPath>a</textPath></text>{label}")),
        "2 texts, which are neither walls nor names of places"
    );
    assert!(!flat(label).unwrap().text.contains("path"));
    let picture = names("<image href='plan.png'/><image href='data:image/tiff;base64,SUkqAA=='/>");
    assert!(
        picture.contains("the file \"plan.png\"") && picture.contains("type image/tiff; embed it as PNG"),
        "{picture}"
    );
    assert_eq!(names("<use href='#a'/>"), "#a of <use>: nothing in the drawing has that id");
    assert_eq!(names("<path fill='url(#a)'/>"), "fill url(#a) of <path>: nothing in the drawing has that id");
    assert_eq!(
        names("<path filter='blur(1px) url(#a) url(#b)'/><g id='b'/>"),
        "filter url(#a) of <path>: nothing in the drawing has that id"
    );
    let foreign = "<foreignObject><svg><path d='M0 0h9'/></svg></foreignObject>";
    assert!(names(foreign).starts_with("the shapes in <foreignObject>: it contains another document"));
    for (shape, found) in [
        ("<path d='oops M1 1L2 2'/>", "\"oops M1 1L2 2\""),
        ("<path d='M1 1L2 oops'/>", "\"oops\""),
        ("<polyline points='1,1 2,2 x'/>", "\"x\""),
    ] {
        let words = names(shape);
        assert!(words.contains(&format!("in line 1 from {found} on: expected commands")), "{words}");
    }
    assert_eq!(names("<path d=' m1-1.5e-1,2Z'/><path d='none'/><path d=''/><polygon points='1,2 3 4'/>"), "");
    let variables = names("<path id='a' stroke='var(--a, white)'/><use href='#a' style='--a: black'/>");
    assert_eq!(variables, "the custom properties of <use>: what it refers to is drawn without them");
    assert_eq!(names("<path fill='url(#a) red' stroke='url(#b)'/><g id='b'/>"), "");
    let linked = format!("<?xml-stylesheet href='a.css'?>{}", svg(""));
    let linked = flatten(&Document::parse(&linked).unwrap(), &Broken { file: "d" }).unwrap();
    assert_eq!(linked.left_out, [LeftOut::Rules("<?xml-stylesheet href='a.css'?>".into())]);
    assert!(names("<style>@media (min-width: 9px) {path{stroke:red}}</style>").contains("min-width"));
}

/// A descendant selector can be matched in as many ways as there are choices of ancestors, and a rule is tried on every
/// element.
#[test]
fn style_sheets_that_take_hours_are_refused() {
    let deep = format!("{}<b/>{}", "<a>".repeat(90), "</a>".repeat(90));
    let error = refusal(&format!("<style>c {} b{{fill:red}}</style>{deep}", "a ".repeat(20)));
    assert!(error.contains("million steps for styles"), "{error}");
    let rules = format!("<style>{}</style>", ".a{fill:red}".repeat(30_000));
    let error = refusal(&format!("{rules}{}", "<path/>".repeat(5000)));
    assert!(error.contains("million steps for styles"), "{error}");
    let long =
        format!("<style>path{{font-family:'{}'}}</style>{}", "a".repeat(20_000), "<path/>".repeat(9000));
    assert!(refusal(&long).contains("at most"));
}

const PARTS: [&str; 24] = [
    "stroke",
    "fill:",
    ";",
    "{",
    "}",
    "var(--a",
    ", ",
    ")",
    "(",
    "rgb(",
    "light-dark(",
    "#000",
    "'",
    "/*",
    "*/",
    "!important",
    "--a:",
    "@media ",
    ":root",
    "path",
    "url(#",
    "color-mix(in srgb,",
    "\\",
    "oklch(from ",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_styles_never_panic(
        parts in prop::collection::vec(prop_oneof![(0..PARTS.len()).prop_map(|i| PARTS[i].to_owned()), ".{0,6}"], 0..30),
    ) {
        let text = escaped(&parts.concat()).into_owned();
        let text: String = text.chars().filter(|c| !c.is_control() && !matches!(*c, '\u{fffe}' | '\u{ffff}' | '\'')).collect();
        let inside = format!("<style>{text}</style><g style='{text}'><path stroke='{text}' style='stroke:{text}'/></g>");
        // The result is XML, and computing its styles again changes nothing.
        if let Ok(flat) = flat(&inside) {
            let document = Document::parse(&flat.text).expect("XML");
            let again = flatten(&document, &Broken { file: "d" }).expect("plain attributes");
            prop_assert_eq!(again.text, flat.text);
        }
    }
}
