//! Tests strokes, from the file to the drawing.

use std::f64::consts::FRAC_PI_2;

use proptest::prelude::*;
use sketchnav_schemas::codes::{FREE, WALL};

use crate::reading::tests::{STROKES, refusal, too_large};
use crate::reading::{Intent, Kind, Options, Settings, read};

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

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

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
}

fn strokes_of(count: usize, points: &str, width: f64) -> Vec<u8> {
    let stroke = format!("{{\"points\":[{points}],\"width_px\":{width}}}");
    format!("{{\"canvas\":[2540,1252],\"strokes\":[{}]}}", vec![stroke; count].join(",")).into_bytes()
}

/// People do not draw 600,000 strokes, or strokes with 500,000 corners. Some smaller drawings passed the checks of the pad but took
/// 91 s to paint.
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
    // The most points that the pad accepts, drawn by a pen that moves five pixels at a time.
    let pen = |i: usize| format!("[{},{}]", 20 + (i * 5) % 2500, 20 + (i / 500) % 1200);
    let long = (0..262_144).map(pen).collect::<Vec<_>>().join(",");
    assert!(read(&strokes_of(1, &long, 3.0), "d", &Options::default()).is_ok());
}

/// A long stroke is painted in pieces but must look like one.
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
