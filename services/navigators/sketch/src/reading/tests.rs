//! Tests the whole path from bytes to messages. Tests of a single kind of drawing are next to its decoder.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use crate::messages::{Route, SketchMap};
use bytemuck::Zeroable;
use image::{GrayImage, ImageFormat, Luma};
use proptest::prelude::*;
use sketchnav_schemas::codes::WALL;

use super::canvas::{Sheet, encoded, photographed};
use super::*;
use crate::task::fill_route;

pub(super) fn read_page(page: &GrayImage) -> DrawnMap {
    read(&encoded(page, ImageFormat::Png), "page.png", &Options::default()).expect("a drawing")
}

pub(super) fn refusal(bytes: &[u8]) -> SketchError {
    read(bytes, "page", &Options::default()).expect_err("no drawing")
}

/// Returns the angle between two directions in degrees, modulo a right angle.
pub(super) fn degrees_apart(a: f64, b: f64) -> f64 {
    let apart = (a - b) - FRAC_PI_2 * ((a - b) / FRAC_PI_2).round();
    apart.abs().to_degrees()
}

/// Returns the share of cells in which a drawing differs from the page that it was read from.
pub(super) fn wrong_share(drawing: &DrawnMap, page: &GrayImage) -> f64 {
    let wrong = page.enumerate_pixels().filter(|(x, row, pixel)| {
        let y = drawing.height_px - 1 - row;
        let wall = drawing.cells[(y * drawing.width_px + x) as usize] == WALL;
        wall != (pixel.0[0] < 128)
    });
    wrong.count() as f64 / drawing.cells.len() as f64
}

pub(super) const SVG: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 20" width="40" height="20">
<g fill="none" stroke="#222" stroke-width="0.2"><rect x="2" y="2" width="36" height="16"/>
<path d="M20 2 V8 M20 12 V18"/></g><text x="5" y="5">kitchen</text>
<image href="/etc/hostname" width="10" height="10"/></svg>"##;

pub(super) const STROKES: &str = r#"{ "canvas": [600, 400],
    "strokes": [ { "points": [[50,50],[550,50],[550,350],[50,350],[50,50]], "width_px": 6 },
                 { "points": [[300,50],[300,180]] }, { "points": [[300,240],[300,350]] } ],
    "obstacles": [ { "polygon": [[400,250],[450,250],[450,300],[400,300]], "label": "table" } ],
    "start": { "at": [100, 100], "heading_deg": 90 },
    "goals": [ { "name": "kitchen", "at": [500, 100] }, { "at": [100, 300] } ],
    "route": [[100,300],[101,299],[300,210],[500,150]] }"#;

pub(super) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// Encodes a page of black ink on white paper as PNG, replacing the ink by another tone and making the paper transparent.
pub(super) fn transparent(page: &GrayImage, ink: u8) -> Vec<u8> {
    let pixels = image::GrayAlphaImage::from_fn(page.width(), page.height(), |x, y| {
        image::LumaA([ink, 255 - page.get_pixel(x, y).0[0]])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut bytes, ImageFormat::Png).expect("a picture in memory");
    bytes.into_inner()
}

/// Returns a picture as an element of an SVG.
pub(super) fn picture(bytes: &[u8]) -> String {
    format!("<image width='2000' height='1200' href='data:image/png;base64,{}'/>", base64(bytes))
}

pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word =
            three.iter().fold(0_u32, |word, &byte| word << 8 | u32::from(byte)) << (8 * (3 - three.len()));
        (0..=three.len()).for_each(|i| text.push(char::from(DIGITS[(word >> (18 - 6 * i)) as usize & 63])));
        text.extend(std::iter::repeat_n('=', 3 - three.len()));
    }
    text
}

pub(super) fn svg(inside: &str) -> Vec<u8> {
    format!("<svg xmlns='http://www.w3.org/2000/svg' width='2000' height='1200'>{inside}</svg>").into_bytes()
}

pub(super) fn too_large(bytes: &[u8]) -> String {
    match read(bytes, "d", &Options::default()) {
        Err(error @ SketchError::TooLarge { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

/// Walls of two rooms with a door between them, in pixels of a page of 2000 x 1200.
pub(super) const ROOMS: [&str; 4] =
    ["M100 100 H1900", "M1900 100 V1100 H100", "M100 1100 V100", "M1000 100 V700 M1000 900 V1100"];

/// Returns an SVG of the rooms. `paint` contains the attributes of the strokes, and `before` is drawn before the rooms.
pub(super) fn rooms(before: &str, paint: &str) -> Vec<u8> {
    let walls: String =
        ROOMS.iter().map(|d| format!("<path d='{d}' fill='none' stroke-width='9' {paint}/>")).collect();
    svg(&format!("{before}{walls}"))
}

pub(super) fn cells(bytes: &[u8]) -> DrawnMap {
    read(bytes, "d.svg", &Options::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_turned_drawing_gives_its_angle() {
    for degrees in [-44.0, -30.0, -12.5, 0.0, 3.0, 17.0, 28.5, 45.0, 60.0] {
        let angle = f64::to_radians(degrees);
        let drawing = read_page(&Sheet::default().building(angle));
        let found = drawing.wall_direction_rad;
        assert!(found > -FRAC_PI_4 - 1e-9 && found <= FRAC_PI_4 + 1e-9);
        let error = degrees_apart(found, angle);
        assert!(error < 1.0, "{degrees}: found {:.2}", found.to_degrees());
    }
}

#[test]
fn a_wobbly_drawing_gives_its_angle_too() {
    for degrees in [-37.0, -20.0, 0.0, 9.0, 33.0] {
        let angle = f64::to_radians(degrees);
        let sheet = Sheet { wobble: 2.5, ..Sheet::default() };
        let found = read_page(&sheet.building(angle)).wall_direction_rad;
        assert!(degrees_apart(found, angle) < 3.0, "{degrees}: found {:.2}", found.to_degrees());
    }
}

#[test]
fn the_same_seed_gives_the_same_drawing() {
    let page = Sheet { wobble: 2.0, ..Sheet::default() }.building(0.2);
    assert_eq!(read_page(&page), read_page(&page));
}

#[test]
fn hairline_gaps_close_and_doors_stay() {
    let wall = |gap: f64| {
        let sheet = Sheet { pen: 5.0, ..Sheet::default() };
        let box_of = [(50.0, 50.0), (550.0, 50.0), (550.0, 450.0), (50.0, 450.0)];
        let mut lines: Vec<_> = (0..4).map(|i| (box_of[i], box_of[(i + 1) % 4])).collect();
        // A round pen draws half its width beyond the end of a line.
        lines.push(((50.0, 250.0), (300.0 - gap / 2.0 - 2.5, 250.0)));
        lines.push(((300.0 + gap / 2.0 + 2.5, 250.0), (550.0, 250.0)));
        sheet.lines(&lines)
    };
    let through = |gap: f64| {
        let drawing = read_page(&wall(gap));
        let goal = ImageTask {
            name: "over".into(),
            points: vec![[300.0, 400.0]],
            is_named: false,
            resolved: None,
            time_limit_s: 60.0,
        };
        let intent = Intent {
            start: Some([300.0, 100.0]),
            heading_deg: Some(0.0),
            tasks: vec![goal],
            ..Intent::default()
        };
        intent.place(&drawing, &Settings::default())
    };
    let Err(error @ SketchError::Unreachable { nearest, .. }) = &through(1.5) else { panic!("a way") };
    assert!((nearest[0] - 300.0).abs() < 5.0 && (230.0..250.0).contains(&nearest[1]), "{error}");
    assert!(error.to_string().starts_with("task 1 (over): goal at (300, 400) of"), "{error}");
    assert!(error.to_string().ends_with("move it there, or draw a door"), "{error}");
    assert!(through(30.0).is_ok());
}

#[test]
fn messages_hold_what_was_drawn() {
    let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
    let places = Intent::of_marks(&drawing.marks).place(&drawing, &Settings::default()).expect("places");
    let (mut map, mut cells) = (SketchMap::zeroed(), vec![7; drawing.cells.len()]);
    fill_sketch(&drawing, &places, &mut map);
    fill_cells(&drawing, &mut cells);
    assert_eq!((map.width_px, map.height_px, &cells), (600, 400, &drawing.cells));
    assert_eq!(map.start.pose().x, 100.0);

    let mut route: Box<Route> = bytemuck::zeroed_box();
    route.points_px[8000] = [1.0, 1.0];
    fill_route(&places.tasks, &mut route);
    assert_eq!((route.task_count, route.point_count, route.points_px[8000]), (3, 6, [0.0; 2]));
    let last: Vec<_> = route.points(&route.tasks()[2]).map(|p| (p.x, p.y)).collect();
    assert_eq!(last, [(100.0, 100.0), (101.0, 101.0), (300.0, 190.0), (500.0, 250.0)]);
}

fn task(name: &str, points: &[[f64; 2]]) -> ImageTask {
    ImageTask {
        name: name.into(),
        points: points.to_vec(),
        is_named: false,
        resolved: None,
        time_limit_s: 60.0,
    }
}

fn placed(start: Option<[f64; 2]>, tasks: Vec<ImageTask>) -> Result<Places, SketchError> {
    let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
    Intent { start, tasks, ..Intent::default() }.place(&drawing, &Settings::default())
}

/// People begin a route with a squiggle (Boniardi et al. 2016, IV). This one goes backwards and down first.
#[test]
fn a_squiggle_does_not_turn_the_start() {
    let route = [[100.0, 300.0], [97.0, 303.0], [95.0, 300.0], [100.0, 280.0], [100.0, 200.0]];
    let places = placed(None, vec![task("route", &route)]).expect("places");
    assert_eq!((places.start.x, places.start.y), (100.0, 100.0));
    assert!((places.start.yaw_rad - FRAC_PI_2).abs() < 1e-9, "{}", places.start.yaw_rad);
}

#[test]
fn what_cannot_be_is_refused_with_its_name_and_place() {
    let goal = |at| vec![task("kitchen", &[at])];
    let route = |middle| vec![task("kitchen", &[[100.0, 100.0], middle, [200.0, 200.0]])];
    let start = Some([100.0, 100.0]);
    let far = vec![task("way", &[[100.0, 100.0], [200.0, 100.0]]), task("kitchen", &[[10.0, 10.0]])];
    for (result, words) in [
        (placed(None, goal([200.0, 200.0])), "navigator.start"),
        (placed(start, goal([200.0, 200.0])), "navigator.start_heading_deg"),
        (
            placed(Some([300.0, 100.0]), route([150.0, 150.0])),
            "navigator.start at (300, 100) of pad.json: expected free space, found a wall; the nearest free place is (298, 100)",
        ),
        (
            placed(Some([100.0, 1000.0]), route([150.0, 150.0])),
            "navigator.start at (100, 1000): expected a place in pad.json, 600 x 400 px",
        ),
        (placed(start, route([-5.0, 150.0])), "task 1 (kitchen): route point 2 at (-5, 150)"),
        (
            placed(start, route([425.0, 275.0])),
            "task 1 (kitchen): route point 2 at (425, 275) of pad.json: expected free space",
        ),
        (
            placed(start, far),
            "task 2 (kitchen): goal at (10, 10) of pad.json: expected a free path from the start at (100, 100)",
        ),
        // A start in metres instead of pixels was once reported as an error in the goal.
        (
            placed(
                Some([0.9, 6.15]),
                vec![task("kitchen", &[[0.9, 6.15], [10.0, 300.0]]), task("kitchen", &[[200.0, 200.0]])],
            ),
            "navigator.start at (1, 6) of pad.json: expected a place within the walls around task 2 (kitchen): goal at (200, 200), \
             found one outside them; the start is in pixels of the drawing",
        ),
        (placed(start, vec![]), "task: expected 1 to 64, found 0"),
        (placed(start, vec![task("empty", &[])]), "points of all tasks: expected 1 to 8192, found 0"),
    ] {
        let error = result.expect_err(words).to_string();
        assert!(error.contains(words), "{error}\nexpected {words}");
    }
    assert!(placed(start, route([299.0, 100.0])).is_ok(), "a route may brush a wall");
}

/// Without a start, the robot may be anywhere from where it can get to the first goal.
#[test]
fn a_start_that_nobody_has_marked_may_be_anywhere() {
    let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
    let place = |tasks: &[ImageTask], heading_deg| {
        let intent =
            Intent { heading_deg, tasks: tasks.to_vec(), may_start_anywhere: true, ..Intent::default() };
        intent.place(&drawing, &Settings::default())
    };
    let kitchen = task("kitchen", &[[200.0, 200.0]]);
    let places = place(std::slice::from_ref(&kitchen), None).unwrap();
    assert!(places.is_anywhere(&drawing) && places.start_spread_rad >= std::f64::consts::PI);
    // A heading may be known although the place is not.
    let facing = place(std::slice::from_ref(&kitchen), Some(90.0)).unwrap();
    assert!(facing.is_anywhere(&drawing) && facing.start_spread_rad < 0.1);
    assert!((facing.start.yaw_rad - FRAC_PI_2).abs() < 1e-9);
    // The errors are about the goals, not about the start that the robot is assumed to have.
    for (goals, words) in [
        (vec![[425.0, 275.0]], "task 1 (goal): goal at (425, 275) of pad.json: expected free space"),
        (vec![[9999.0, 60.0]], "task 1 (goal): goal at (9999, 60): expected a place in pad.json"),
        (
            vec![[10.0, 10.0], [200.0, 200.0]],
            "task 2 (goal): goal at (200, 200) of pad.json: expected a free path from the first goal at (10, 10)",
        ),
    ] {
        let tasks: Vec<_> = goals.iter().map(|goal| task("goal", &[*goal])).collect();
        let error = place(&tasks, None).unwrap_err().to_string();
        assert!(error.starts_with(words), "{error}\nexpected {words}");
    }
    let route = task("way", &[[100.0, 100.0], [200.0, 100.0]]);
    let error = place(&[kitchen, route.clone()], None).unwrap_err().to_string();
    assert!(error.starts_with("task 2 (way).route: expected a goal, or a marked start"), "{error}");
    assert!(!place(&[route], Some(0.0)).unwrap().is_anywhere(&drawing), "a route places the robot");
}

#[test]
fn pages_without_walls_or_space_are_refused() {
    let blank = GrayImage::from_pixel(200, 100, Luma([240]));
    let found = |bytes: &[u8]| match refusal(bytes) {
        SketchError::NoWalls { found, .. } => found,
        other => panic!("{other}"),
    };
    assert_eq!(found(&encoded(&blank, ImageFormat::Png)), "a picture of one tone");
    assert!(found(&encoded(&photographed(&blank, 1), ImageFormat::Jpeg)).contains("no tone stands out"));
    assert_eq!(found(br#"{"canvas":[30,30],"strokes":[]}"#), "a drawing without strokes on the page");
    assert_eq!(
        found(&transparent(&GrayImage::from_pixel(30, 30, Luma([255])), 0)),
        "a picture that is transparent everywhere"
    );
    assert_eq!(found(&svg("")), "an SVG without shapes");
    assert_eq!(
        found(&svg("<path d='M0 -9h99' stroke='black'/>")),
        "shapes of SVG that paint nothing within the page"
    );
    let white =
        found(&svg("<rect width='2000' height='1200' fill='white'/><path d='M0 9h99' stroke='#fefefe'/>"));
    assert_eq!(
        white,
        "shapes of SVG that all have the colour of the paper, or nearly so: draw the walls darker"
    );
    let text = found(&svg("<text><textPath>kitchen</textPath></text><image href='plan.png'/>"));
    assert!(
        text.contains("the file \"plan.png\"; embed it as PNG; one text, which is neither a wall"),
        "{text}"
    );
    let card = GrayImage::from_pixel(200, 120, Luma([240]));
    let picture = found(&svg(&picture(&encoded(&card, ImageFormat::Png))));
    assert_eq!(picture, "a picture of one tone inside an SVG");
    let full = br#"{"canvas":[30,30],"strokes":[{"points":[[0,0],[30,30]],"width_px":90}]}"#;
    assert_eq!(refusal(full), SketchError::NoFreeSpace { file: "page".into() });
}

#[test]
fn what_is_no_drawing_is_refused() {
    assert_eq!(refusal(b""), SketchError::Empty { file: "page".into() });
    for bytes in [&b"II*\0....."[..], b"P9 3 3 255 .........", b"\0\0\0\0"] {
        assert!(matches!(refusal(bytes), SketchError::Unsupported { .. }));
    }
    for (bytes, words) in [
        (&b"II*\0....."[..], "found a TIFF; export it as PNG"),
        (b"\0\0\0\x18ftypheix", "found a HEIC photo"),
        (b"gimp xcf v011\0", "found a GIMP file (XCF); export it as PNG"),
        (b"version https://git-lfs.github.com/spec/v1\n", "found a Git LFS pointer instead of the file"),
        (br#"{"type":"excalidraw","version":2}"#, "found an Excalidraw drawing; export it as SVG or PNG"),
        (b"\x00\x00\x01\x00", r#"found a file that begins with "\x00\x00\x01\x00""#),
        (b"%PDF-1.7", "found a PDF"),
        (
            b"image: floor.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n",
            "found a map's YAML; name its picture \"floor.pgm\" as the drawing",
        ),
    ] {
        assert!(refusal(bytes).to_string().contains(words), "{}", refusal(bytes));
    }
    let page = Sheet::default().building(0.0);
    for format in [
        ImageFormat::Png,
        ImageFormat::Jpeg,
        ImageFormat::Gif,
        ImageFormat::WebP,
        ImageFormat::Bmp,
        ImageFormat::Pnm,
    ] {
        let whole = encoded(&page, format);
        let error = refusal(&whole[..whole.len() / 3]);
        assert!(matches!(error, SketchError::Broken { .. }), "{error}");
    }
    assert!(matches!(refusal(b"P5 0 0 255 "), SketchError::Broken { kind: "PNM", .. }));
    assert!(matches!(refusal(b"<svg"), SketchError::Broken { kind: "SVG", .. }));
    let nested = format!("<svg xmlns=\"http://www.w3.org/2000/svg\">{}", "<g>".repeat(200_000));
    assert!(matches!(refusal(nested.as_bytes()), SketchError::Broken { kind: "SVG", .. }));
    let nested = format!("{{\"strokes\":{}", "[".repeat(200_000));
    assert!(matches!(refusal(nested.as_bytes()), SketchError::Broken { kind: "strokes", .. }));
}

#[test]
fn a_preview_is_a_picture_of_the_same_size() {
    let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
    let places = Intent::of_marks(&drawing.marks).place(&drawing, &Settings::default()).expect("places");
    let picture = image::load_from_memory(&preview(&drawing, Some(&places)).expect("a PNG")).expect("a PNG");
    assert_eq!((picture.width(), picture.height()), (600, 400));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400), kind in 0..8_usize) {
        let heads: [&[u8]; 8] = [
            b"\x89PNG\r\n\x1a\n", &[0xff, 0xd8, 0xff, 0xe0], b"<svg ", b"{\"canvas\":", b"GIF89a",
            b"RIFF\x90\x01\0\0WEBPVP8 ", b"BM\x90\x01\0\0\0\0\0\0", b"P5 9 9 255\n",
        ];
        let _ = read(&[heads[kind], &bytes[..]].concat(), "garbage", &Options::default());
        let _ = read(&bytes, "garbage", &Options::default());
    }

    #[test]
    fn damaged_files_never_panic(kind in 0..8_usize, at in 0.0..1.0_f64, value in any::<u8>(), cut in 0.0..1.0_f64) {
        let page = Sheet { width: 120, height: 90, ..Sheet::default() }.building(0.3);
        let mut bytes = match kind {
            0 => encoded(&page, ImageFormat::Png),
            1 => encoded(&page, ImageFormat::Jpeg),
            2 => SVG.as_bytes().to_vec(),
            3 => encoded(&page, ImageFormat::Gif),
            4 => encoded(&page, ImageFormat::WebP),
            5 => encoded(&page, ImageFormat::Bmp),
            6 => encoded(&page, ImageFormat::Pnm),
            _ => STROKES.as_bytes().to_vec(),
        };
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] = value;
        let _ = read(&bytes, "damaged", &Options::default());
        bytes.truncate((cut * bytes.len() as f64) as usize);
        let _ = read(&bytes, "damaged", &Options::default());
    }

    #[test]
    fn points_turn_there_and_back(x in -100.0..3000.0_f64, y in -100.0..3000.0_f64) {
        let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
        let back = drawing.to_image(&drawing.from_image([x, y]));
        prop_assert!((back[0] - x).abs() < 1e-9 && (back[1] - y).abs() < 1e-9);
    }
}
