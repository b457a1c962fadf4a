//! The whole way from bytes to messages, over drawings made here and, where they lie beside the
//! project, over drawings by people.

#![expect(clippy::disallowed_methods, reason = "tests read drawings by people")]

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::PathBuf;

use crate::messages::{MAX_SKETCH_CELLS, Route, SketchMap};
use crate::mission::WallTone;
use bytemuck::Zeroable;
use image::{GrayImage, ImageFormat, Luma};
use proptest::prelude::*;
use sketchnav_schemas::codes::{FREE, WALL};

use super::canvas::{Sheet, encoded, photographed};
use super::*;
use crate::task::{ImageTask, fill_route};

fn read_page(page: &GrayImage) -> DrawnMap {
    read(&encoded(page, ImageFormat::Png), "page.png", &Options::default()).expect("a drawing")
}

fn refusal(bytes: &[u8]) -> SketchError {
    read(bytes, "page", &Options::default()).expect_err("no drawing")
}

/// How far two directions are apart, a right angle counting as none.
fn degrees_apart(a: f64, b: f64) -> f64 {
    let apart = (a - b) - FRAC_PI_2 * ((a - b) / FRAC_PI_2).round();
    apart.abs().to_degrees()
}

/// The share of cells in which a drawing differs from the page that it was read from.
fn wrong_share(drawing: &DrawnMap, page: &GrayImage) -> f64 {
    let wrong = page.enumerate_pixels().filter(|(x, row, pixel)| {
        let y = drawing.height_px - 1 - row;
        let wall = drawing.cells[(y * drawing.width_px + x) as usize] == WALL;
        wall != (pixel.0[0] < 128)
    });
    wrong.count() as f64 / drawing.cells.len() as f64
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
fn tones_are_told_apart() {
    let dark = Sheet::default();
    let light = Sheet { paper: 20, ink: 230, ..Sheet::default() };
    for (sheet, tone) in [(&dark, WallTone::Dark), (&light, WallTone::Light)] {
        let page = sheet.building(0.1);
        let found = read_page(&page);
        let told = Options { walls: tone, ..Options::default() };
        let told = read(&encoded(&page, ImageFormat::Png), "page.png", &told).expect("a drawing");
        assert_eq!(found, told);
        assert_eq!(found.kind, Kind::Lines);
        assert!((found.pen_width_px - 4.0).abs() <= 1.0, "{}", found.pen_width_px);
    }
}

/// Free space in white, all else black, as some people's drawings are. Black is solid although there is more of it,
/// and although it is no line.
#[test]
fn a_filled_drawing_is_solid_outside() {
    let page = GrayImage::from_fn(300, 200, |x, y| {
        let free = (40..200).contains(&x) && (50..120).contains(&y)
            || (180..260).contains(&x) && (60..80).contains(&y);
        Luma([if free { 255 } else { 0 }])
    });
    let drawing = read_page(&page);
    assert_eq!(drawing.kind, Kind::Filled);
    assert_eq!(wrong_share(&drawing, &page), 0.0);
}

#[test]
fn a_photograph_of_pencil_on_paper_is_read() {
    let sheet = Sheet { paper: 225, ink: 120, pen: 4.0, wobble: 1.0, width: 800, height: 600 };
    let page = sheet.building(0.15);
    for format in [ImageFormat::Png, ImageFormat::Jpeg] {
        let photo = encoded(&photographed(&page, 3), format);
        let drawing = read(&photo, "photo", &Options::default()).expect("a photograph");
        let clean = Sheet { paper: 255, ink: 0, ..sheet }.building(0.15);
        assert_eq!(drawing.kind, Kind::Photograph);
        let wrong = wrong_share(&drawing, &clean);
        assert!(wrong < 0.02, "{:.2} % of the cells are wrong", 100.0 * wrong);
        assert!(degrees_apart(drawing.wall_direction_rad, 0.15) < 2.0);
    }
}

#[test]
fn a_photograph_of_a_blackboard_is_read() {
    let sheet = Sheet { paper: 60, ink: 190, ..Sheet::default() };
    let photo = photographed(&sheet.building(0.0), 5);
    let drawing = read_page(&photo);
    assert_eq!(drawing.kind, Kind::Photograph);
    let wrong = wrong_share(&drawing, &Sheet::default().building(0.0));
    assert!(wrong < 0.03, "{:.2} % of the cells are wrong", 100.0 * wrong);
}

#[test]
fn hairline_gaps_close_and_doors_stay() {
    let wall = |gap: f64| {
        let sheet = Sheet { pen: 5.0, ..Sheet::default() };
        let box_of = [(50.0, 50.0), (550.0, 50.0), (550.0, 450.0), (50.0, 450.0)];
        let mut lines: Vec<_> = (0..4).map(|i| (box_of[i], box_of[(i + 1) % 4])).collect();
        // Round pens end half a width beyond the line.
        lines.push(((50.0, 250.0), (300.0 - gap / 2.0 - 2.5, 250.0)));
        lines.push(((300.0 + gap / 2.0 + 2.5, 250.0), (550.0, 250.0)));
        sheet.lines(&lines)
    };
    let through = |gap: f64| {
        let drawing = read_page(&wall(gap));
        let goal = ImageTask { name: "over".into(), points: vec![[300.0, 400.0]], time_limit_s: 60.0 };
        let intent = Intent { start: Some([300.0, 100.0]), heading_deg: Some(0.0), tasks: vec![goal] };
        intent.place(&drawing, &Settings::default())
    };
    let Err(error @ SketchError::Unreachable { nearest, .. }) = &through(1.5) else { panic!("a way") };
    assert!((nearest[0] - 300.0).abs() < 5.0 && (230.0..250.0).contains(&nearest[1]), "{error}");
    assert!(error.to_string().starts_with("task 1 (over): goal at (300, 400) of"), "{error}");
    assert!(error.to_string().ends_with("move it there, or draw a door"), "{error}");
    assert!(through(30.0).is_ok());
}

#[test]
fn a_large_picture_is_scaled_and_its_points_along() {
    let page = Sheet { width: 3600, height: 2400, pen: 8.0, ..Sheet::default() }.building(0.0);
    let drawing = read_page(&page);
    assert!(drawing.cells.len() <= MAX_SKETCH_CELLS && drawing.cells.len() > MAX_SKETCH_CELLS * 9 / 10);
    assert!((drawing.scale - f64::from(drawing.width_px) / 3600.0).abs() < 1e-3);
    let place = drawing.from_image([1800.0, 600.0]);
    assert!((place.x - 1800.0 * drawing.scale).abs() < 1e-9);
    assert!((place.y - f64::from(drawing.height_px) + 600.0 * drawing.scale).abs() < 1e-9);
    let back = drawing.to_image(&place);
    assert!((back[0] - 1800.0).abs() < 1e-9 && (back[1] - 600.0).abs() < 1e-9);
    // The same wall lies at the same place, scaled.
    let small = |x: f64, y: f64| drawing.cell(&drawing.from_image([x, y]));
    let unit = 2400.0 / 140.0;
    assert_eq!(small(1800.0, 1200.0 + 30.0 * unit), Some(WALL));
    assert_eq!(small(1800.0, 1200.0 + 20.0 * unit), Some(FREE));
}

const SVG: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 20" width="40" height="20">
<g fill="none" stroke="#222" stroke-width="0.2"><rect x="2" y="2" width="36" height="16"/>
<path d="M20 2 V8 M20 12 V18"/></g><text x="5" y="5">kitchen</text>
<image href="/etc/hostname" width="10" height="10"/></svg>"##;

#[test]
fn an_svg_in_metres_is_read() {
    let drawing = read(SVG.as_bytes(), "plan.svg", &Options::default()).expect("a drawing");
    assert_eq!((drawing.width_px, drawing.height_px, drawing.kind), (1024, 512, Kind::Lines));
    assert_eq!(drawing.scale, 25.6);
    assert_eq!(drawing.cell(&drawing.from_image([20.0, 5.0])), Some(WALL));
    assert_eq!(drawing.cell(&drawing.from_image([20.0, 10.0])), Some(FREE));
    assert!(drawing.wall_direction_rad.abs() < 0.01);
}

const STROKES: &str = r#"{ "canvas": [600, 400],
    "strokes": [ { "points": [[50,50],[550,50],[550,350],[50,350],[50,50]], "width_px": 6 },
                 { "points": [[300,50],[300,180]] }, { "points": [[300,240],[300,350]] } ],
    "obstacles": [ { "polygon": [[400,250],[450,250],[450,300],[400,300]], "label": "table" } ],
    "start": { "at": [100, 100], "heading_deg": 90 },
    "goals": [ { "name": "kitchen", "at": [500, 100] }, { "at": [100, 300] } ],
    "route": [[100,300],[101,299],[300,210],[500,150]] }"#;

#[test]
fn strokes_are_drawn_and_their_marks_placed() {
    let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
    assert_eq!((drawing.kind, drawing.pen_width_px), (Kind::Strokes, 6.0));
    assert_eq!(drawing.cell(&drawing.from_image([425.0, 275.0])), Some(WALL));
    assert_eq!(drawing.cell(&drawing.from_image([300.0, 100.0])), Some(WALL));
    assert_eq!(drawing.cell(&drawing.from_image([300.0, 210.0])), Some(FREE));
    let places = Intent::of_marks(&drawing.marks).place(&drawing, &Settings::default()).expect("places");
    assert_eq!((places.start.x, places.start.y, places.start.yaw_rad), (100.0, 300.0, FRAC_PI_2));
    let names: Vec<_> = places.tasks.iter().map(|task| task.name.as_str()).collect();
    assert_eq!(names, ["kitchen", "goal 2", "route"]);
}

#[test]
fn a_wrong_strokes_file_is_refused_by_its_key() {
    for (from, to, words) in [
        ("\"width_px\": 6", "\"width_px\": 0", "strokes[0].width_px"),
        ("[600, 400]", "[0, 400]", "canvas"),
        ("[[50,50],", "[[1e9,50],", "strokes[0]"),
        ("\"label\"", "\"lable\"", "lable"),
        ("[400,300]],", "[400,300]", "line"),
        ("[450,250],[450,300],[400,300]", "[450,250]", "obstacles[0]"),
    ] {
        let error = refusal(STROKES.replace(from, to).as_bytes()).to_string();
        assert!(error.contains(words) && error.starts_with("page"), "{error}");
    }
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
    ImageTask { name: name.into(), points: points.to_vec(), time_limit_s: 60.0 }
}

fn placed(start: Option<[f64; 2]>, tasks: Vec<ImageTask>) -> Result<Places, SketchError> {
    let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
    Intent { start, heading_deg: None, tasks }.place(&drawing, &Settings::default())
}

/// People begin a route with a squiggle (Boniardi et al. 2016, IV): here it goes backwards and down first.
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
            "task 2 (kitchen): goal at (10, 10) of pad.json: expected a free way from the start at (100, 100)",
        ),
        (placed(start, vec![]), "task: expected 1 to 64, found 0"),
        (placed(start, vec![task("empty", &[])]), "points of all tasks: expected 1 to 8192, found 0"),
    ] {
        let error = result.expect_err(words).to_string();
        assert!(error.contains(words), "{error}\nexpected {words}");
    }
    assert!(placed(start, route([299.0, 100.0])).is_ok(), "a route may brush a wall");
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
    let text = found(&svg("<text>kitchen</text><image href='plan.png'/>"));
    assert!(text.contains("the file \"plan.png\"; one text: labels are no walls"), "{text}");
    let card = GrayImage::from_pixel(200, 120, Luma([240]));
    let picture = found(&svg(&picture(&encoded(&card, ImageFormat::Png))));
    assert_eq!(picture, "a picture of one tone inside an SVG");
    let full = br#"{"canvas":[30,30],"strokes":[{"points":[[0,0],[30,30]],"width_px":90}]}"#;
    assert_eq!(refusal(full), SketchError::NoFreeSpace { file: "page".into() });
}

#[test]
fn what_is_no_drawing_is_refused() {
    assert_eq!(refusal(b""), SketchError::Empty { file: "page".into() });
    for bytes in [&b"GIF89a..."[..], b"P5 3 3 255 .........", b"\0\0\0\0"] {
        assert!(matches!(refusal(bytes), SketchError::Unsupported { .. }));
    }
    for (bytes, words) in [
        (&b"GIF89a..."[..], "found a GIF; export it as PNG"),
        (b"RIFF....WEBPVP8 ", "found a WebP picture"),
        (b"\0\0\0\x18ftypheic", "found a HEIC photo"),
        (b"%PDF-1.7", "found a PDF"),
    ] {
        assert!(refusal(bytes).to_string().contains(words), "{}", refusal(bytes));
    }
    let page = Sheet::default().building(0.0);
    for format in [ImageFormat::Png, ImageFormat::Jpeg] {
        let whole = encoded(&page, format);
        let error = refusal(&whole[..whole.len() / 3]);
        assert!(matches!(error, SketchError::Broken { .. }), "{error}");
    }
    assert!(matches!(refusal(b"<svg"), SketchError::Broken { kind: "SVG", .. }));
    let nested = format!("<svg xmlns=\"http://www.w3.org/2000/svg\">{}", "<g>".repeat(200_000));
    assert!(matches!(refusal(nested.as_bytes()), SketchError::Broken { kind: "SVG", .. }));
    let nested = format!("{{\"strokes\":{}", "[".repeat(200_000));
    assert!(matches!(refusal(nested.as_bytes()), SketchError::Broken { kind: "strokes", .. }));
}

/// Each pass of a progressive JPEG goes through all of its pixels, and takes a few bytes of the file.
#[test]
fn a_jpeg_of_passes_without_end_is_refused_before_it_is_decoded() {
    let page = encoded(&Sheet::default().building(0.0), ImageFormat::Jpeg);
    let (head, end) = page.split_at(page.len() - 2);
    let bytes = [head, &[0xff, 0xda].repeat(10_000), end].concat();
    let error = refusal(&bytes).to_string();
    assert!(error.ends_with("2000 megapixels in all passes, found 10001 passes of 600 x 500"), "{error}");
}

/// A picture of 30000 x 30000 in a few bytes: its header alone must be enough to refuse it.
#[test]
fn a_picture_bomb_is_refused_before_it_is_decoded() {
    let mut png = encoded(&GrayImage::new(3, 3), ImageFormat::Png);
    png[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(matches!(refusal(&png), SketchError::TooLarge { .. } | SketchError::Broken { .. }));
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
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
    fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400), kind in 0..4_usize) {
        let heads: [&[u8]; 4] = [b"\x89PNG\r\n\x1a\n", &[0xff, 0xd8, 0xff, 0xe0], b"<svg ", b"{\"canvas\":"];
        let _ = read(&[heads[kind], &bytes[..]].concat(), "garbage", &Options::default());
        let _ = read(&bytes, "garbage", &Options::default());
    }

    #[test]
    fn damaged_files_never_panic(kind in 0..4_usize, at in 0.0..1.0_f64, value in any::<u8>(), cut in 0.0..1.0_f64) {
        let page = Sheet { width: 120, height: 90, ..Sheet::default() }.building(0.3);
        let mut bytes = match kind {
            0 => encoded(&page, ImageFormat::Png),
            1 => encoded(&page, ImageFormat::Jpeg),
            2 => SVG.as_bytes().to_vec(),
            _ => STROKES.as_bytes().to_vec(),
        };
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] = value;
        let _ = read(&bytes, "damaged", &Options::default());
        bytes.truncate((cut * bytes.len() as f64) as usize);
        let _ = read(&bytes, "damaged", &Options::default());
    }

    #[test]
    fn strokes_anywhere_never_panic(
        points in prop::collection::vec((-1e5..1e5_f64, -1e5..1e5_f64), 0..12),
        canvas in (1..300_u32, 1..300_u32),
        width in 0.001..1000.0_f64,
    ) {
        let points: Vec<_> = points.iter().map(|p| [p.0, p.1]).collect();
        let page = serde_json::json!({
            "canvas": [canvas.0, canvas.1],
            "strokes": [{ "points": points, "width_px": width }],
            "obstacles": if points.len() > 2 { serde_json::json!([{ "polygon": points }]) } else { serde_json::json!([]) },
        });
        let _ = read(page.to_string().as_bytes(), "strokes", &Options::default());
    }

    #[test]
    fn points_turn_there_and_back(x in -100.0..3000.0_f64, y in -100.0..3000.0_f64) {
        let drawing = read(STROKES.as_bytes(), "pad.json", &Options::default()).expect("a drawing");
        let back = drawing.to_image(&drawing.from_image([x, y]));
        prop_assert!((back[0] - x).abs() < 1e-9 && (back[1] - y).abs() < 1e-9);
    }
}

/// Drawings by people that lie beside the project, where they do.
fn drawings(folder: &str, extension: &str) -> Vec<PathBuf> {
    let root = needs::data().join("sketches").join(folder);
    let Ok(entries) = std::fs::read_dir(&root) else {
        needs::skipped("data", format_args!("no drawings at {}", root.display()));
        return Vec::new();
    };
    let paths = entries.flatten().map(|entry| entry.path());
    let mut paths: Vec<_> = paths.filter(|path| path.extension().is_some_and(|e| e == extension)).collect();
    paths.sort();
    paths
}

#[test]
fn the_kth_drawings_are_free_where_they_are_white() {
    for path in drawings("kth", "png") {
        let (name, bytes) = (path.display().to_string(), std::fs::read(&path).expect("a drawing"));
        let drawing = read(&bytes, &name, &Options::default()).expect("a drawing");
        assert_eq!(drawing.kind, Kind::Filled, "{name}");
        let page = image::load_from_memory(&bytes).expect("a picture").into_luma8();
        let wrong = wrong_share(&drawing, &page);
        assert!(wrong < 0.01, "{name}: {:.2} % of the cells are wrong", 100.0 * wrong);
        let direction = drawing.wall_direction_rad.to_degrees();
        assert!(direction.abs() < 5.0, "{name}: {direction:.1}");
    }
}

#[test]
fn the_pen_drawings_of_real_floors_are_dark_lines() {
    for path in drawings("nus", "jpeg") {
        let (name, bytes) = (path.display().to_string(), std::fs::read(&path).expect("a drawing"));
        let drawing = read(&bytes, &name, &Options::default()).expect("a drawing");
        assert_eq!(drawing.kind, Kind::Lines, "{name}");
        let page = image::load_from_memory(&bytes).expect("a picture").into_luma8();
        assert!(wrong_share(&drawing, &page) < 0.02, "{name}");
        assert!((2.0..9.0).contains(&drawing.pen_width_px), "{name}: {}", drawing.pen_width_px);
    }
}

/// A page of black ink on white paper as PNG with ink of another tone and paper that is transparent.
fn transparent(page: &GrayImage, ink: u8) -> Vec<u8> {
    let pixels = image::GrayAlphaImage::from_fn(page.width(), page.height(), |x, y| {
        image::LumaA([ink, 255 - page.get_pixel(x, y).0[0]])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut bytes, ImageFormat::Png).expect("a picture in memory");
    bytes.into_inner()
}

/// A picture inside an SVG.
fn picture(bytes: &[u8]) -> String {
    format!("<image width='2000' height='1200' href='data:image/png;base64,{}'/>", base64(bytes))
}

fn base64(bytes: &[u8]) -> String {
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

fn svg(inside: &str) -> Vec<u8> {
    format!("<svg xmlns='http://www.w3.org/2000/svg' width='2000' height='1200'>{inside}</svg>").into_bytes()
}

fn too_large(bytes: &[u8]) -> String {
    match read(bytes, "d", &Options::default()) {
        Err(error @ SketchError::TooLarge { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

/// A filter of one line kept the sketcher busy for hours. Each octave of noise, and each neighbour of a pixel, is
/// computed for every pixel.
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

/// Masks in masks took 1.8 to 3 GB, for each holds a page of its own; patterns in patterns are painted anew each time.
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

/// Half a million corners of one path cross each row of pixels, and are sorted there; a dash is two corners.
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

fn strokes_of(count: usize, points: &str, width: f64) -> Vec<u8> {
    let stroke = format!("{{\"points\":[{points}],\"width_px\":{width}}}");
    format!("{{\"canvas\":[2540,1252],\"strokes\":[{}]}}", vec![stroke; count].join(",")).into_bytes()
}

/// 600,000 strokes, strokes of 500,000 corners, and strokes that the pad took and that took 91 s to paint.
#[test]
fn more_strokes_than_people_draw_are_refused() {
    let error = too_large(&strokes_of(600_000, "[1,1],[9,9]", 5.0));
    assert!(error.ends_with("expected at most 20000 strokes and obstacles, found 600000"), "{error}");
    let zigzag = |count: usize| {
        let points = (0..count).map(|i| format!("[{},{}]", i % 2539, (i % 2) * 1251));
        points.collect::<Vec<_>>().join(",")
    };
    let error = too_large(&strokes_of(1, &zigzag(500_000), 5.0));
    assert!(error.ends_with("expected at most 262144 corners of all strokes, found 500000"), "{error}");
    let error = too_large(&strokes_of(1, &zigzag(262_144), 1000.0));
    assert!(error.contains("steps of painting, found more from strokes[0] on"), "{error}");
    let error = too_large(&strokes_of(4000, &zigzag(64), 1000.0));
    assert!(error.contains("steps of painting, found more from strokes["), "{error}");
    let polygon =
        format!("{{\"canvas\":[9,9],\"strokes\":[],\"obstacles\":[{{\"polygon\":[{}]}}]}}", zigzag(5000));
    assert!(
        too_large(polygon.as_bytes()).contains("4096 corners of an obstacle, found 5000 of obstacles[0]")
    );
    // As much as the pad takes, drawn by a pen that moves five pixels between two points.
    let pen = |i: usize| format!("[{},{}]", 20 + (i * 5) % 2500, 20 + (i / 500) % 1200);
    let long = (0..262_144).map(pen).collect::<Vec<_>>().join(",");
    assert!(read(&strokes_of(1, &long, 3.0), "d", &Options::default()).is_ok());
}

/// A long stroke is painted in pieces, and looks as one.
#[test]
fn pieces_of_a_stroke_are_the_stroke() {
    let around = |i: usize| {
        let angle = i as f64 / 100.0;
        format!("[{:.2},{:.2}]", 1200.0 + (100.0 + i as f64 / 8.0) * angle.cos(), 600.0 + 500.0 * angle.sin())
    };
    let points: Vec<_> = (0..4000).map(around).collect();
    let whole = read(&strokes_of(1, &points.join(","), 5.0), "d", &Options::default()).unwrap();
    let pieces =
        points.windows(2).map(|two| format!("{{\"points\":[{}]}}", two.join(","))).collect::<Vec<_>>();
    let text = format!("{{\"canvas\":[2540,1252],\"strokes\":[{}]}}", pieces.join(","));
    let pieces = read(text.as_bytes(), "d", &Options::default()).unwrap();
    let wrong = whole.cells.iter().zip(&pieces.cells).filter(|(a, b)| a != b).count();
    let ink = whole.cells.iter().filter(|&&cell| cell == WALL).count();
    assert!(wrong * 200 < ink, "{wrong} of {ink} cells");
}

/// Walls of two rooms with a door between them, in pixels of a page of 2000 x 1200.
const ROOMS: [&str; 4] =
    ["M100 100 H1900", "M1900 100 V1100 H100", "M100 1100 V100", "M1000 100 V700 M1000 900 V1100"];

/// The rooms with all that makes a stroke in `paint`, what else the page holds before it.
fn rooms(before: &str, paint: &str) -> Vec<u8> {
    let walls: String =
        ROOMS.iter().map(|d| format!("<path d='{d}' fill='none' stroke-width='9' {paint}/>")).collect();
    svg(&format!("{before}{walls}"))
}

fn cells(bytes: &[u8]) -> DrawnMap {
    read(bytes, "d.svg", &Options::default()).unwrap_or_else(|error| panic!("{error}"))
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

/// A wall whose colour cannot be read is named, whatever else is drawn.
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
    for format in [ImageFormat::Png, ImageFormat::Jpeg] {
        let inside = picture(&encoded(&page, format));
        let drawing = cells(&svg(&inside));
        let wrong = wrong_share(&drawing, &page);
        assert!(wrong < 0.01, "{format:?}: {:.2} %", 100.0 * wrong);
        // One stroke over it.
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

/// The last row of a page that ends within a pixel was half covered: a line along the edge, and the only wall of a page whose
/// walls have the colour of its ground.
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
        ("<?xml version='1.0'?><xournal creator='x'><page/></xournal>", "a note of Xournal++; export it as"),
        ("<mxfile><diagram/></mxfile>", "a drawing of draw.io; export it as SVG or PNG"),
        ("<html><body>x</body></html>", "a web page; export it as"),
        ("<!DOCTYPE html><p>x<br>y", "a web page; export it as"),
        ("<kml><Document/></kml>", "XML that begins with <kml>; export it as"),
    ] {
        let error = refusal(text.as_bytes()).to_string();
        assert!(
            error.starts_with(&format!("page: expected PNG, JPEG, SVG or strokes in JSON, found {words}")),
            "{error}"
        );
    }
}

/// Half of the walls were white and half of them black, on transparent paper: one half was read, and no word of the other.
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
    // A page that is painted all over is a picture, as soon as one of its pixels is not quite opaque. It was taken for ink.
    let page = "<path d='M0 0H9999V9999H0z' fill='white' fill-opacity='.99'/>";
    assert_eq!(cells(&svg(&(page.to_owned() + &half(&ROOMS, "black")))).left_out, []);
    // Haze is seen on no paper.
    assert_eq!(left_out("white", "rgb(255 255 255 / 5%)"), []);
}

/// A gradient is fitted to the box of what it paints, and a straight line along an axis has none: it was not drawn, and
/// nobody was told. Neither were walls for readers of another language.
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

#[test]
fn ink_on_transparent_paper_is_read_whatever_its_tone() {
    let page = Sheet::default().building(0.1);
    let expected = read_page(&page);
    for ink in [0, 90, 200, 240, 255] {
        let drawing = read(&transparent(&page, ink), "page.png", &Options::default()).expect("a drawing");
        assert_eq!(drawing.kind, Kind::Lines, "{ink}");
        let wrong = drawing.cells.iter().zip(&expected.cells).filter(|(a, b)| a != b).count();
        assert!(wrong * 200 < expected.cells.len(), "{ink}: {wrong}");
    }
    let black = cells(&rooms("", "stroke='black'"));
    for (before, paint) in [
        ("", "stroke='white'"),
        ("<rect width='2000' height='1200' fill='#121212'/>", "stroke='white'"),
        ("<style>svg{background-color: light-dark(#121212, white)}</style>", "stroke='#fff'"),
    ] {
        assert!(cells(&rooms(before, paint)).cells == black.cells, "{before} {paint}");
    }
    // White rooms without lines: what is not white is solid.
    let rooms = cells(&svg("<path d='M100 100H1900V1100H100z' fill='white'/>"));
    assert_eq!(rooms.kind, Kind::Filled);
    assert_eq!(rooms.cell(&rooms.from_image([1000.0, 600.0])), Some(FREE));
    assert_eq!(rooms.cell(&rooms.from_image([50.0, 600.0])), Some(WALL));
    // A white card with black lines is a card.
    let card = "<rect x='50' y='50' width='1900' height='1100' fill='white'/>";
    let lines =
        format!("{card}<path d='M100 100H1900V1100H100z' fill='none' stroke='black' stroke-width='9'/>");
    assert_eq!(cells(&svg(&lines)).kind, Kind::Lines);
}
