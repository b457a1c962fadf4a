//! Tests with pictures made here and, if they are available, with drawings by people.

#![expect(clippy::disallowed_methods, reason = "tests read drawings by people")]

use std::path::PathBuf;

use image::{GrayImage, ImageFormat, Luma};
use sketchnav_schemas::codes::{FREE, WALL};

use crate::messages::MAX_SKETCH_CELLS;
use crate::mission::WallTone;
use crate::reading::canvas::{Sheet, encoded, photographed};
use crate::reading::tests::{
    cells, crc32, degrees_apart, read_page, refusal, rooms, svg, transparent, wrong_share,
};
use crate::reading::{Kind, Options, SketchError, read};

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

/// Some people draw free space in white and everything else in black. The black is solid then, even though there is more of it
/// and it is not a line.
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
    // The wall is where it was, but scaled.
    let small = |x: f64, y: f64| drawing.cell(&drawing.from_image([x, y]));
    let unit = 2400.0 / 140.0;
    assert_eq!(small(1800.0, 1200.0 + 30.0 * unit), Some(WALL));
    assert_eq!(small(1800.0, 1200.0 + 20.0 * unit), Some(FREE));
}

/// Maps saved by map_server used to be refused and had to be converted first.
#[test]
fn the_picture_of_a_map_is_read() {
    let page = Sheet::default().building(0.0);
    let expected = read_page(&page).cells;
    let head =
        |kind| format!("{kind}\n# CREATOR: map_saver 0.050 m/pix\n{} {}\n255\n", page.width(), page.height());
    let bytes = [head("P5").as_bytes(), page.as_raw()].concat();
    let text: Vec<_> = page.as_raw().iter().map(u8::to_string).collect();
    let text = head("P2") + &text.join("\n") + "\n";
    for picture in [bytes, text.into_bytes(), encoded(&page, ImageFormat::Pnm)] {
        assert!(cells(&picture).cells == expected, "{:?}", &picture[..2]);
    }
}

/// In a map from SLAM, whatever the robot has not seen is grey. Regression test: grey used to count as paper, so the walls of a
/// partly seen room were open, and the robot drove past its goal.
#[test]
fn unknown_cells_of_a_map_are_solid() {
    let tone = |column: u32, row: u32| match (column, row) {
        (10, 10..30) | (10..50, 10) | (49, 10..30) => 0,
        (11..49, 11..30) => 254,
        _ => 205,
    };
    let map = GrayImage::from_fn(60, 40, |column, row| Luma([tone(column, row)]));
    let read = cells(&encoded(&map, ImageFormat::Png));
    for (column, row) in (0..60).flat_map(|column| (0..40).map(move |row| (column, row))) {
        let cell = read.cells[((39 - row) * 60 + column) as usize];
        assert_eq!(cell == FREE, tone(column, row) == 254, "column {column}, row {row}");
    }
    assert_eq!(read.kind, Kind::Surveyed);
}

/// Each pass of a progressive JPEG goes through all of its pixels but takes only a few bytes of the file.
#[test]
fn a_jpeg_of_passes_without_end_is_refused_before_it_is_decoded() {
    let page = encoded(&Sheet::default().building(0.0), ImageFormat::Jpeg);
    let (head, end) = page.split_at(page.len() - 2);
    let bytes = [head, &[0xff, 0xda].repeat(10_000), end].concat();
    let error = refusal(&bytes).to_string();
    assert!(error.ends_with("2000 megapixels in all passes, found 10001 passes of 600 x 500"), "{error}");
}

/// A few bytes can announce a picture of 30000 x 30000 pixels. The header must be enough to refuse it.
#[test]
fn a_picture_bomb_is_refused_before_it_is_decoded() {
    let mut png = encoded(&GrayImage::new(3, 3), ImageFormat::Png);
    png[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(matches!(refusal(&png), SketchError::TooLarge { .. } | SketchError::Broken { .. }));
}

/// Returns the paths of drawings by people, or none if they are not available.
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
    // White rooms without lines: everything that is not white is solid.
    let rooms = cells(&svg("<path d='M100 100H1900V1100H100z' fill='white'/>"));
    assert_eq!(rooms.kind, Kind::Filled);
    assert_eq!(rooms.cell(&rooms.from_image([1000.0, 600.0])), Some(FREE));
    assert_eq!(rooms.cell(&rooms.from_image([50.0, 600.0])), Some(WALL));
    // A white card with black lines is a line drawing, not a white room.
    let card = "<rect x='50' y='50' width='1900' height='1100' fill='white'/>";
    let lines =
        format!("{card}<path d='M100 100H1900V1100H100z' fill='none' stroke='black' stroke-width='9'/>");
    assert_eq!(cells(&svg(&lines)).kind, Kind::Lines);
}
