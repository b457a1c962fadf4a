//! Tests SVG, from the file to the drawing.

use image::{GrayImage, ImageFormat};
use sketchnav_schemas::codes::{FREE, WALL};

use crate::reading::canvas::{Sheet, encoded};
use crate::reading::tests::{
    ROOMS, STROKES, SVG, cells, crc32, picture, read_page, refusal, rooms, svg, too_large, wrong_share,
};
use crate::reading::{DrawnMap, Kind, LeftOut, Options, read};

#[test]
fn an_svg_in_metres_is_read() {
    let drawing = read(SVG.as_bytes(), "plan.svg", &Options::default()).expect("a drawing");
    assert_eq!((drawing.width_px, drawing.height_px, drawing.kind), (1024, 512, Kind::Lines));
    assert_eq!(drawing.scale, 25.6);
    assert_eq!(drawing.cell(&drawing.from_image([20.0, 5.0])), Some(WALL));
    assert_eq!(drawing.cell(&drawing.from_image([20.0, 10.0])), Some(FREE));
    assert!(drawing.wall_direction_rad.abs() < 0.01);
}

/// A filter of one line kept the sketcher busy for hours, because every octave of noise and every neighbour is computed for
/// each pixel.
#[test]
fn a_filter_that_takes_hours_is_refused_by_its_name() {
    let filtered = |part: &str| {
        svg(&format!("<filter id='f'>{part}</filter><rect width='2000' height='1200' filter='url(#f)'/>"))
    };
    for (part, name) in [
        ("<feTurbulence baseFrequency='.1' numOctaves='10000'/>", "feTurbulence"),
        ("<feTurbulence baseFrequency='.1' numOctaves='1000000000'/>", "feTurbulence"),
        ("<feMorphology operator='dilate' radius='300'/>", "feMorphology"),
    ] {
        let error = too_large(&filtered(part));
        let words = format!(
            "expected at most 3000 million steps of painting, found more from filter \"f\", {name} on"
        );
        assert!(error.ends_with(&words), "{error}");
    }
    let many = too_large(&filtered(&"<feOffset/>".repeat(100)));
    assert!(many.ends_with("found more from filter \"f\", a simple part on"), "{many}");
    let blurred = "<filter id='b'><feGaussianBlur stdDeviation='3'/></filter>\
        <path d='M100 100 H1900 V1100 H100 Z' fill='none' stroke='black' stroke-width='8' filter='url(#b)'/>";
    assert!(read(&svg(blurred), "d", &Options::default()).is_ok(), "a shadow is no crime");
}

/// Nested masks took 1.8 to 3 GB, since each has its own page. Nested patterns are painted again for every tile.
#[test]
fn masks_and_patterns_inside_each_other_are_few() {
    let masks: String = (0..24)
        .map(|i| {
            let inner = if i == 0 { String::new() } else { format!("mask='url(#m{})'", i - 1) };
            format!(
                "<mask id='m{i}' maskUnits='userSpaceOnUse' width='2000' height='1200'>\
                <rect width='2000' height='1200' fill='white' {inner}/></mask>"
            )
        })
        .collect();
    let error = too_large(&svg(&format!("{masks}<rect width='2000' height='1200' mask='url(#m23)'/>")));
    assert!(error.contains("8 masks, patterns and clip paths of SVG inside each other"), "{error}");
    assert!(error.contains("mask \"m15\""), "{error}");
    let pattern = |i: usize, inside: &str| {
        format!(
            "<pattern id='p{i}' patternUnits='userSpaceOnUse' width='2000' height='1200'>{inside}</pattern>"
        )
    };
    let patterns: String = (0..6)
        .map(|i| {
            let fill = if i == 0 { "black".to_owned() } else { format!("url(#p{})", i - 1) };
            pattern(i, &format!("<rect width='2000' height='1200' fill='{fill}'/>").repeat(4))
        })
        .collect();
    let error = too_large(&svg(&format!("{patterns}<rect width='2000' height='1200' fill='url(#p5)'/>")));
    assert!(error.contains("steps of painting") || error.contains("held at the same time"), "{error}");
    let huge = "<pattern id='h' patternUnits='userSpaceOnUse' width='1e6' height='1e6'><path d='M0 0h9v9z'/></pattern>\
        <rect width='9' height='9' fill='url(#h)'/>";
    let error = too_large(&svg(huge));
    assert!(error.contains("held at the same time") && error.contains("pattern \"h\""), "{error}");
}

/// A path with half a million corners may cross every row of pixels half a million times, and the crossings in each row have to be
/// sorted. A dash counts as two corners.
#[test]
fn a_path_that_crosses_itself_without_end_is_refused() {
    let zigzag = |count: usize| -> String {
        (0..count).map(|i| format!("L{} {}", i % 1999, (i % 2) * 1200)).collect()
    };
    let fill = format!("<path id='z' d='M0 0{}'/>", zigzag(500_000));
    let error = too_large(&svg(&fill));
    assert!(error.ends_with("found more from path \"z\" on"), "{error}");
    let dashed =
        format!("<path id='s' d='M0 0{}' fill='none' stroke='black' stroke-dasharray='0.001'/>", zigzag(100));
    assert!(too_large(&svg(&dashed.repeat(10))).contains("path \"s\""));
    let hatched = format!("<path d='M0 0{}' fill='none' stroke='black'/>", zigzag(1000));
    assert!(read(&svg(&hatched), "d", &Options::default()).is_ok(), "an architect's hatching");
}

/// Each way to write a colour gives the same drawing as its plain twin.
#[test]
fn walls_are_drawn_however_their_colour_is_written() {
    let black = cells(&rooms("", "stroke='#000000'"));
    let grey = cells(&rooms("", "stroke='#161616'"));
    assert!(black.cells.iter().filter(|&&cell| cell == WALL).count() > 40_000);
    for (before, paint, plain) in [
        ("", "stroke='#000000' style='stroke: light-dark(rgb(0, 0, 0), rgb(255, 255, 255))'", &black),
        ("", "stroke='light-dark(#000, #fff)'", &black),
        ("", "stroke='var(--tl-color-text, #000)'", &black),
        ("<style>:root { --ink: #000 }</style>", "stroke='var(--ink)'", &black),
        ("<style>path { --ink: black; stroke: var(--ink) }</style>", "", &black),
        ("", "style='--ink: #000; stroke: var(--ink)'", &black),
        ("", "style='stroke:#161616;stroke:color(display-p3 0 0 0);stroke-opacity:1'", &black),
        ("", "stroke='color(srgb 0 0 0)'", &black),
        ("", "stroke='color(rec2020 0% 0% 0%)'", &black),
        ("", "stroke='oklch(0.2 0 0)'", &grey),
        ("", "stroke='oklab(20% 0 0)'", &grey),
        ("", "stroke='lab(0 0 0)'", &black),
        ("", "stroke='lch(0% 0 none)'", &black),
        ("", "stroke='hwb(0 0% 100%)'", &black),
        ("", "stroke='hsl(0deg 0% 0% / 1)'", &black),
        ("", "style='stroke:rgb(0 0 0 / 100%)'", &black),
        ("", "stroke='rgb(0% 0% 0%)'", &black),
        ("", "stroke='color-mix(in oklab, #000 40%, black)'", &black),
        ("", "color='oklch(0.2 0 0)' stroke='currentColor'", &grey),
        ("", "stroke='CanvasText'", &black),
        ("", "stroke='#000' style='stroke: a-colour-of-2040(1)'", &black),
        ("<style>.x{stroke:none} .x{stroke:#000}</style>", "class='x'", &black),
        (
            "<linearGradient id='g'><stop stop-color='oklch(0 0 0)'/></linearGradient>",
            "stroke='url(#g)'",
            &black,
        ),
    ] {
        let read = cells(&rooms(before, paint));
        assert_eq!((read.cells.len(), read.kind), (plain.cells.len(), plain.kind), "{before} {paint}");
        let wrong = read.cells.iter().zip(&plain.cells).filter(|(a, b)| a != b).count();
        assert!(wrong == 0, "{before} {paint}: {wrong} cells");
    }
}

/// A wall whose colour cannot be read is named in the error, regardless of what else is drawn.
#[test]
fn a_wall_of_a_colour_that_cannot_be_read_is_named() {
    for paint in ["stroke='oklch(from red l c h)'", "style='stroke: var(--ink)'", "stroke='bananas'"] {
        let seen = "<path d='M9 9h1980v1180h-1980z' fill='none' stroke='black' stroke-width='9'/>";
        let error = refusal(&rooms(seen, paint)).to_string();
        assert!(error.starts_with("page: <path> in line 1: stroke: "), "{error}");
    }
}

#[test]
fn an_svg_is_read_in_every_encoding_and_packed() {
    let plain = rooms("<title>K\u{fc}che</title>", "stroke='black'");
    let text = std::str::from_utf8(&plain).unwrap();
    let expected = cells(&plain);
    let wide = |mark: &[u8], bytes: fn(u16) -> [u8; 2]| {
        [mark, &text.encode_utf16().flat_map(bytes).collect::<Vec<_>>()].concat()
    };
    let latin = |label: &str| {
        let text = format!("<?xml version='1.0' encoding='{label}'?>{text}");
        text.chars().map(|c| c as u8).collect::<Vec<_>>()
    };
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, &plain).unwrap();
    let packed = packed.finish().unwrap();
    for (bytes, name) in [
        (wide(b"\xff\xfe", u16::to_le_bytes), "UTF-16 LE"),
        (wide(b"\xfe\xff", u16::to_be_bytes), "UTF-16 BE"),
        (wide(b"", u16::to_le_bytes), "UTF-16 LE without a mark"),
        (wide(b"", u16::to_be_bytes), "UTF-16 BE without a mark"),
        ([b"\xef\xbb\xbf", &plain[..]].concat(), "UTF-8 with a mark"),
        ([b"<?xml version='1.0' encoding='utf-16'?>", &plain[..]].concat(), "UTF-8 that says UTF-16"),
        (latin("ISO-8859-1"), "Latin-1"),
        (latin("windows-1252"), "Windows"),
        (packed.clone(), "gzip"),
    ] {
        let read =
            read(&bytes, "d.svg", &Options::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(read.cells == expected.cells, "{name}");
    }
    let strokes: Vec<_> = STROKES.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(
        cells(&strokes),
        DrawnMap { file: "d.svg".into(), ..read(STROKES.as_bytes(), "d.svg", &Options::default()).unwrap() }
    );
    assert!(refusal(&packed[..packed.len() / 2]).to_string().contains("expected a whole gzip file"));
    assert!(refusal(&latin("EBCDIC-9")).to_string().contains("\"EBCDIC-9\" is not known; save it as UTF-8"));
    let garbled: Vec<_> = text.chars().map(|c| c as u8).collect();
    assert!(refusal(&garbled).to_string().contains("its bytes are not UTF-8"));
}

#[test]
fn pictures_inside_an_svg_are_drawn() {
    let page = Sheet { width: 2000, height: 1200, ..Sheet::default() }.building(0.0);
    let expected = read_page(&page);
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Gif, ImageFormat::WebP, ImageFormat::Bmp]
    {
        let inside = picture(&encoded(&page, format));
        let drawing = cells(&svg(&inside));
        let wrong = wrong_share(&drawing, &page);
        assert!(wrong < 0.01, "{format:?}: {:.2} %", 100.0 * wrong);
        // The same drawing with a stroke over the picture.
        let both = cells(&svg(&format!("{inside}<path d='M0 1150 H2000' stroke='black' stroke-width='9'/>")));
        let more = both.cells.iter().filter(|&&cell| cell == WALL).count();
        assert!(more > expected.cells.iter().filter(|&&cell| cell == WALL).count() + 15_000);
    }
    // A drawing in other units keeps the picture's pixels.
    let small = String::from_utf8(svg(&picture(&encoded(&page, ImageFormat::Png)))).unwrap();
    let small =
        small.replacen("width='2000' height='1200'", "width='500' height='300' viewBox='0 0 2000 1200'", 1);
    assert_eq!(cells(small.as_bytes()).width_px, 2000);
    let cut = encoded(&page, ImageFormat::Png);
    let error = refusal(&svg(&picture(&cut[..cut.len() / 2]))).to_string();
    assert!(error.starts_with("page: the picture in <image>: expected a whole PNG file"), "{error}");
    let mut bomb = encoded(&GrayImage::new(3, 3), ImageFormat::Png);
    bomb[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    let crc = crc32(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(refusal(&svg(&picture(&bomb))).to_string().contains("the picture in <image>"));
    let many = format!(
        "<g id='a'>{}</g>{}",
        picture(&encoded(&page, ImageFormat::Png)),
        "<use href='#a'/>".repeat(30)
    );
    assert!(too_large(&svg(&many)).contains("steps of painting"));
}

/// If a page ended within a pixel, its last row was only half covered and was read as a wall along the edge. On a page whose
/// walls have the colour of the background, it was the only wall.
#[test]
fn a_page_that_ends_within_a_pixel_has_no_wall_along_its_edge() {
    for colour in ["white", "black", "#404040"] {
        let page = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='960' height='640'><rect width='960' height='640' fill='{colour}'/>\
             <path d='M40 40H900V600' fill='none' stroke='{colour}' stroke-width='5'/></svg>"
        );
        let error = refusal(page.as_bytes()).to_string();
        assert!(error.contains("shapes of SVG that all have the colour of the paper"), "{colour}: {error}");
    }
}

#[test]
fn xml_of_other_programs_is_named() {
    for (text, words) in [
        ("<?xml version='1.0'?><xournal creator='x'><page/></xournal>", "a Xournal++ note; export it as"),
        ("<mxfile><diagram/></mxfile>", "a draw.io drawing; export it as SVG or PNG"),
        ("<html><body>x</body></html>", "a web page; export it as"),
        ("<!DOCTYPE html><p>x<br>y", "a web page; export it as"),
        ("<kml><Document/></kml>", "XML that begins with <kml>; export it as"),
    ] {
        let error = refusal(text.as_bytes()).to_string();
        assert!(
            error.starts_with(&format!(
                "page: expected PNG, JPEG, GIF, WebP, BMP, PNM, SVG or strokes in JSON, found {words}"
            )),
            "{error}"
        );
    }
}

/// With half of the walls white and half of them black on transparent paper, one half was read and the other was dropped
/// without a warning.
#[test]
fn ink_of_two_tones_on_transparent_paper_is_doubted() {
    let half = |walls: &[&str], paint: &str| -> String {
        walls
            .iter()
            .map(|d| format!("<path d='{d}' fill='none' stroke-width='9' stroke='{paint}'/>"))
            .collect()
    };
    let left_out = |first: &str, second: &str| {
        let (a, b) = ROOMS.split_at(2);
        cells(&svg(&(half(a, first) + &half(b, second)))).left_out
    };
    for (first, second) in [("black", "white"), ("white", "black")] {
        let found = left_out(first, second);
        assert!(matches!(found[..], [LeftOut::Tone { share }] if (0.2..0.4).contains(&share)), "{found:?}");
    }
    assert_eq!(left_out("white", "#eee"), []);
    assert_eq!(left_out("black", "#777"), []);
    // A page that is painted all over is a picture, even if one of its pixels is not quite opaque. It used to be taken for ink.
    let page = "<path d='M0 0H9999V9999H0z' fill='white' fill-opacity='.99'/>";
    assert_eq!(cells(&svg(&(page.to_owned() + &half(&ROOMS, "black")))).left_out, []);
    // Haze is invisible on any paper.
    assert_eq!(left_out("white", "rgb(255 255 255 / 5%)"), []);
}

/// A gradient is fitted to the box of what it paints, and a straight line along an axis has none. Such lines used to vanish
/// silently, and so did walls for readers of another language.
#[test]
fn walls_that_would_vanish_are_drawn_or_named() {
    let gradient =
        |units: &str| format!("<linearGradient id='g' {units}><stop/><stop offset='1'/></linearGradient>");
    let walls = "<path d='M100 100L1900 140' stroke='black' stroke-width='9'/>\
        <g stroke='url(#g)' stroke-width='9'><path d='M100 900H1900'/><path id='b' d='M100 100V900'/></g>";
    let words = |units: &str| {
        let drawing = cells(&svg(&format!("{}{walls}", gradient(units))));
        drawing.left_out.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let [named, unnamed] = &words("")[..] else { panic!("{:?}", words("")) };
    assert!(named.starts_with("the stroke of <path id=\"b\"> in line 1: its gradient or pattern"), "{named}");
    assert!(unnamed.starts_with("the stroke of <path> in line 1: its gradient or pattern"), "{unnamed}");
    assert_eq!(words("gradientUnits='userSpaceOnUse'"), Vec::<String>::new());
    let plain = cells(&rooms("", "stroke='black'"));
    for language in ["de", "fr-CH, en"] {
        let walls = rooms("", &format!("stroke='black' systemLanguage='{language}'"));
        assert!(cells(&walls).cells == plain.cells, "{language}");
    }
}

/// A straight line along an axis vanished silently under a filter, a mask or a clip path in units of its own box.
#[test]
fn lines_that_an_effect_leaves_nothing_of_are_named() {
    let effects = "<filter id='f'><feGaussianBlur stdDeviation='2'/></filter>\
        <mask id='m'><rect width='2000' height='1200' fill='white'/></mask>\
        <mask id='n' maskUnits='userSpaceOnUse' maskContentUnits='objectBoundingBox' width='2000' height='1200'>\
        <rect width='1' height='1' fill='white'/></mask>\
        <clipPath id='c' clipPathUnits='objectBoundingBox'><rect width='1' height='1'/></clipPath>\
        <filter id='u' filterUnits='userSpaceOnUse' width='2000' height='1200'><feOffset/></filter>";
    let left_out = |element: &str| {
        let drawing = cells(&svg(&format!(
            "{effects}<g fill='none' stroke='black' stroke-width='9'><path d='M100 100L1900 140V1100'/>{element}</g>"
        )));
        drawing.left_out.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    for effect in ["filter='url(#f)'", "mask='url(#m)'", "mask='url(#n)'", "clip-path='url(#c)'"] {
        let line = left_out(&format!("<path id='a' d='M100 900H1900' {effect}/>"));
        let words = "<path id=\"a\"> in line 1: its filter, mask, clip path or gradient leaves nothing of it";
        assert!(line.starts_with(words), "{effect}: {line}");
        let both =
            left_out(&format!("<path d='M100 900H1900' {effect}/><path d='M100 900L1900 950' {effect}/>"));
        assert_eq!(both.matches("leaves nothing").count(), 1, "{effect}: {both}");
        let group = left_out(&format!("<g id='b' {effect}><path d='M100 900H1900'/></g>"));
        assert!(group.starts_with("<g id=\"b\"> in line 1: its filter"), "{effect}: {group}");
        // Two lines together have a box.
        assert_eq!(
            left_out(&format!("<g {effect}><path d='M100 900H1900'/><path d='M100 950H1900'/></g>")),
            ""
        );
        assert_eq!(left_out(&format!("<g {effect}/><g {effect}><title>a</title></g>")), "");
        assert_eq!(left_out(&format!("<g display='none'><path d='M100 900H1900' {effect}/></g>")), "");
        assert_eq!(left_out(&format!("<defs><path d='M100 900H1900' {effect}/></defs>")), "");
    }
    assert_eq!(left_out("<path d='M100 900H1900' filter='url(#u)' clip-path='none'/>"), "");
}

/// A wall with a gradient that was drawn once and referred to twice was lost twice. One without a fill was not even reported.
#[test]
fn lines_that_a_gradient_cannot_paint_are_named_wherever_they_are_drawn() {
    let gradient = "<linearGradient id='g'><stop/><stop offset='1'/></linearGradient>";
    let left_out = |inside: &str| {
        let page =
            format!("{gradient}<path d='M100 100L1900 140V1100' stroke='black' stroke-width='9'/>{inside}");
        cells(&svg(&page)).left_out.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    let bare = left_out("<path id='b' fill='none' stroke='url(#g)' d='M100 900H1900'/>");
    assert!(bare.starts_with("the stroke of <path id=\"b\"> in line 1: its gradient"), "{bare}");
    let line = "<defs><path id='l' d='M0 0H1800' stroke='url(#g)' stroke-width='9'/></defs>";
    let used = left_out(&format!("{line}<use id='u' href='#l' x='100' y='900'/>"));
    assert!(used.starts_with("<use id=\"u\"> in line 1: its filter, mask, clip path or gradient"), "{used}");
    let slanted = line.replace("M0 0H1800", "M0 0L1800 50");
    assert_eq!(left_out(&format!("{slanted}<use href='#l' x='100' y='900'/>")), "");
}

/// Illustrator keeps its own data in the first part of a `<switch>`. The drawing in the second part was mistaken for a label
/// and left out.
#[test]
fn a_switch_shows_its_first_part_that_needs_no_extension() {
    let walls = String::from_utf8(rooms("", "stroke='black'")).unwrap();
    let expected = cells(walls.as_bytes());
    let own = "<switch><foreignObject requiredExtensions='http://ns.adobe.com/AdobeIllustrator/10.0/'><i/></foreignObject><g>";
    let switched =
        walls.replacen("<path", &format!("{own}<path"), 1).replace("</svg>", "</g></switch></svg>");
    let drawing = cells(switched.as_bytes());
    assert!(drawing.cells == expected.cells);
    assert_eq!(drawing.left_out, []);
}

/// CAD programs keep their pens at the same width at every scale. In a drawing in metres, they were silently drawn 40 times as
/// wide.
#[test]
fn what_is_drawn_otherwise_than_it_says_is_named() {
    let left_out = |text: &str| {
        cells(text.as_bytes()).left_out.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    let walls = |units: &str, paint: &str| {
        format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='800' height='400' viewBox='0 0 {units}'>\
             <path id='w' d='M2 2H38V18H2z' fill='none' stroke='black' {paint}/></svg>"
        )
    };
    let thick = left_out(&walls("40 20", "stroke-width='.2' vector-effect='non-scaling-stroke'"));
    let words = "the vector-effect of <path id=\"w\"> in line 1: its stroke is drawn 20.0 times as wide";
    assert!(thick.starts_with(words), "{thick}");
    assert_eq!(left_out(&walls("800 400", "stroke-width='1' vector-effect='non-scaling-stroke'")), "");
    let clipped = left_out(&walls("40 20", "stroke-width='.2' style='clip-path: inset(1px 2px)'"));
    assert!(
        clipped.starts_with("clip-path: inset(1px 2px) of <path id=\"w\">: it is not supported"),
        "{clipped}"
    );
}

/// Walls in a light colour, such as yellow, were silently left out if there were dark walls as well.
#[test]
fn strokes_that_are_fainter_than_the_walls_are_named() {
    let left_out = |second: &str| {
        let paths = ROOMS.iter().zip(["black", second, "black", second]);
        let walls: String = paths
            .map(|(d, paint)| format!("<path d='{d}' fill='none' stroke-width='9' stroke='{paint}'/>"))
            .collect();
        cells(&svg(&walls)).left_out
    };
    for faint in ["yellow", "cyan", "#ccc", "#ffc9c9"] {
        let found = left_out(faint);
        assert!(
            matches!(found[..], [LeftOut::Faint { share }] if (0.5..0.8).contains(&share)),
            "{faint}: {found:?}"
        );
    }
    for read in ["black", "#555", "blue"] {
        assert_eq!(left_out(read), [], "{read}");
    }
    // Tinted rooms are not walls.
    let rooms = String::from_utf8(rooms("", "stroke='black'")).unwrap();
    let tinted = rooms.replacen("<path", "<path d='M200 200h500v400h-500z' fill='#ffc9c9'/><path", 1);
    assert_eq!(cells(tinted.as_bytes()).left_out, []);
}

/// Returns the labels of a drawing of rooms with these texts, with their positions in whole pixels, and what was left out.
fn labels_and_rest(texts: &str) -> (Vec<(String, [i64; 2])>, Vec<LeftOut>) {
    let walls = String::from_utf8(rooms("", "stroke='black'")).unwrap();
    let bare = cells(walls.as_bytes());
    let drawing = cells(walls.replace("</svg>", &format!("{texts}</svg>")).as_bytes());
    assert!(drawing.cells == bare.cells, "{texts}: texts are not walls");
    assert_eq!(bare.labels, [], "{texts}");
    let labels = drawing.labels.into_iter().map(|label| (label.text, label.at.map(|at| at.round() as i64)));
    (labels.collect(), drawing.left_out)
}

fn labels(texts: &str) -> Vec<(String, [i64; 2])> {
    let (labels, left_out) = labels_and_rest(texts);
    assert_eq!(left_out, [], "{texts}");
    labels
}

/// A text of four characters of 20 px is taken to be 44 px wide and 14 px high.
#[test]
fn a_text_names_the_place_where_it_stands() {
    for (text, at) in [
        ("<text x='500' y='400' font-size='20'>hall</text>", [522, 393]),
        ("<text x='500' y='400' style='font-size: 20px; text-anchor: middle'>hall</text>", [500, 393]),
        (
            "<g text-anchor='end' font-size='20'><text x='500' y='400'><tspan>hall</tspan></text></g>",
            [478, 393],
        ),
        (
            "<style>.r{font-size:15pt}</style><text class='r' x='500' y='400'> ha<tspan dx='0'>ll</tspan></text>",
            [522, 393],
        ),
        // As Inkscape writes it.
        (
            "<g transform='translate(100)'><text transform='scale(2)' style='font-size:10px'><tspan x='200' y='200'>hall</tspan></text></g>",
            [522, 393],
        ),
        (
            "<svg x='400' y='300' width='200' height='200' viewBox='0 0 100 100'><text x='50' y='50' font-size='10'>hall</text></svg>",
            [522, 393],
        ),
        // As draw.io writes it.
        (
            "<switch><foreignObject><p xmlns='http://www.w3.org/1999/xhtml'>hall</p></foreignObject><text x='500' y='400' font-size='20'>hall</text></switch>",
            [522, 393],
        ),
        // The renderer cannot read these styles; a text needs none.
        (
            "<text x='500' y='400' font-size='20' fill='blurple' style='transform: matrix(oops)'>hall</text>",
            [522, 393],
        ),
    ] {
        assert_eq!(labels(text), [("hall".to_owned(), at)], "{text}");
    }
    assert_eq!(
        labels("<g display='none'><text x='9' y='9'>a</text></g><text style='display:none'>b</text>"),
        []
    );
}

/// Outside a switch, a text after HTML is a separate text. It used to be read twice, so that its name was ambiguous.
#[test]
fn a_text_beside_html_is_read_once() {
    let html = "<foreignObject><p xmlns='http://www.w3.org/1999/xhtml'>note</p></foreignObject>";
    let group = format!("<g>{html}<text x='500' y='400' font-size='20'>hall</text></g>");
    let hall = vec![("hall".to_owned(), [522, 393])];
    assert_eq!(labels_and_rest(&group), (hall, vec![LeftOut::Labels(1)]));
}

#[test]
fn the_lines_of_a_text_are_one_name() {
    let spans = "<text font-size='20'><tspan x='500' y='400'>living</tspan><tspan x='500' dy='1.2em'>room</tspan></text>";
    assert_eq!(labels(spans), [("living room".to_owned(), [533, 405])]);
    // As Excalidraw exports it.
    let line = |y: i32, text: &str| {
        format!("<text x='0' y='{y}' font-size='20px' style='white-space: pre;'>{text}</text>")
    };
    let group = format!(
        "<g transform='translate(500 400) rotate(0 20 25)'>{}{}</g>",
        line(18, "living"),
        line(43, "room")
    );
    assert_eq!(labels(&group), [("living room".to_owned(), [533, 411])]);
    // Two texts of one layer.
    let layer = format!("<g>{}{}</g>", line(400, "hall"), line(500, "bath"));
    let names: Vec<_> = labels(&layer).into_iter().map(|(text, _)| text).collect();
    assert_eq!(names, ["hall", "bath"]);
}

#[test]
fn texts_that_name_nothing_are_counted() {
    let walls = String::from_utf8(rooms("", "stroke='black'")).unwrap();
    let remark = "x".repeat(61);
    let texts =
        format!("<text>{remark}</text><text><textPath>round</textPath></text><defs><text>a</text></defs>");
    let drawing = cells(walls.replace("</svg>", &format!("{texts}</svg>")).as_bytes());
    assert_eq!((&drawing.labels[..], &drawing.left_out[..]), (&[][..], &[LeftOut::Labels(3)][..]));
}
