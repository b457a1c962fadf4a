//! Sketch files: labelled strokes in JSON, as written by this project's drawing pad.
//!
//! ```json
//! { "canvas": [160, 160],
//!   "strokes": [ { "points": [[10, 80], [60, 82], [90, 40]] } ],
//!   "labels": [ { "text": "desk", "at": [100, 30] } ],
//!   "obstacles": [ { "polygon": [[20, 60], [30, 60], [30, 70]], "label": "table" } ] }
//! ```
//!
//! All coordinates are pixels of the canvas: column and row, with row 0 at the top. `canvas` and `strokes` are required. A polygon
//! in `obstacles` is read as a closed stroke with a label, and `route` as another stroke. Anything else that a pad writes (`start`,
//! `goals`, the width of its pen) is ignored. The shape of a stroke determines what it represents (see [`crate::sketch::strokes`]).
//! [`write()`] writes a sketch in the same form.

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::json;
use sketchnav_schemas::geometry::Point;

use crate::drawn::Drawn;
use crate::error::{Error, Pixel};
use crate::sketch::{Drawing, Label, Sketch, Stroke};

/// Maximum number of strokes and of labels in a drawing, and maximum number of points in all its strokes together.
const MOST_STROKES: usize = 500;
const MOST_POINTS: usize = 50_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Page {
    canvas: [f64; 2],
    strokes: Vec<Pen>,
    #[serde(default)]
    obstacles: Vec<Obstacle>,
    #[serde(default)]
    labels: Vec<Label>,
    #[serde(default)]
    route: Vec<Pixel>,
    #[serde(default, rename = "start")]
    _start: IgnoredAny,
    #[serde(default, rename = "goals")]
    _goals: IgnoredAny,
    #[serde(default, rename = "pad")]
    _pad: IgnoredAny,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Pen {
    points: Vec<Pixel>,
    #[serde(default, rename = "width_px")]
    _width_px: IgnoredAny,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Obstacle {
    polygon: Vec<Pixel>,
    #[serde(default)]
    label: String,
}

/// Reads a sketch file.
///
/// # Errors
/// - [`Error::Json`], which gives line and column, if the file is not a sketch in JSON.
/// - [`Error::Number`] if there are too many strokes, points or labels.
pub fn read(bytes: &[u8]) -> Result<Drawing, Error> {
    read_with_route(bytes, None)
}

/// Reads a sketch file as [`read`] does, but replaces the route in the file by the given one, whose points are columns and rows.
///
/// # Errors
/// Same as [`read`].
pub fn read_with_route(bytes: &[u8], route: Option<&[[f64; 2]]>) -> Result<Drawing, Error> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let page: Page = serde_json::from_slice(text).map_err(|error| Error::Json(error.to_string()))?;
    let height = page.canvas[1];
    let up = |at: Pixel| Pixel::new(at.x, height - at.y);
    let line = |points: Vec<Pixel>| Stroke { points: points.into_iter().map(up).collect() };
    let mut strokes: Vec<_> = page.strokes.into_iter().map(|pen| line(pen.points)).collect();
    let mut labels: Vec<_> =
        page.labels.into_iter().map(|label| Label { at: up(label.at), ..label }).collect();
    for Obstacle { mut polygon, label } in page.obstacles {
        let Some(first) = polygon.first().copied() else { continue };
        labels.push(Label { text: label, at: up(first) });
        polygon.push(first);
        strokes.push(line(polygon));
    }
    let route = route.map_or(page.route, |route| route.iter().copied().map(Pixel::from).collect());
    if !route.is_empty() {
        strokes.push(line(route));
    }
    check("strokes", "at most 500", strokes.len(), MOST_STROKES)?;
    let points = strokes.iter().map(|stroke| stroke.points.len()).sum();
    check("points of all strokes", "at most 50000", points, MOST_POINTS)?;
    check("labels", "at most 500", labels.len(), MOST_STROKES)?;
    Ok(Drawing { canvas: page.canvas, strokes, labels })
}

/// Writes a sketch on a canvas of the given width and height, in pixels.
pub fn write(sketch: &Sketch, canvas: [f64; 2]) -> String {
    let place = |at: &Point<Drawn>| {
        let at = sketch.pixel(*at);
        [at.x, canvas[1] - at.y].map(|x| (x * 100.0).round() / 100.0)
    };
    let line = |points: &[Point<Drawn>]| points.iter().map(place).collect::<Vec<_>>();
    let obstacles = sketch.landmarks.iter();
    let obstacles = obstacles.map(|one| json!({ "polygon": line(&one.outline), "label": one.name }));
    json!({
        "canvas": canvas,
        "strokes": [],
        "obstacles": obstacles.collect::<Vec<_>>(),
        "route": line(&sketch.route),
    })
    .to_string()
}

fn check(what: &str, expected: &'static str, found: usize, most: usize) -> Result<(), Error> {
    if found <= most {
        return Ok(());
    }
    Err(Error::Number { what: what.into(), expected, found: found as f64 })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sketch::Reading;

    #[test]
    fn what_is_written_is_read_again() {
        let drawn = br#"{ "canvas": [200, 100], "strokes": [], "route": [[5, 90], [80, 90], [190, 20]],
            "obstacles": [{ "polygon": [[20, 40], [60, 40], [60, 70], [20, 70]], "label": "table" }] }"#;
        let sketch = |bytes: &[u8]| Sketch::read(&read(bytes).unwrap(), &Reading::default()).unwrap();
        let first = sketch(drawn);
        let second = sketch(write(&first, [200.0, 100.0]).as_bytes());
        assert_eq!((second.landmarks.len(), &second.landmarks[0].name[..]), (1, "table"));
        assert_eq!(first.route.len(), second.route.len());
        let apart = first.route.iter().zip(&second.route).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(apart < 0.02, "{apart}");
        let other = read_with_route(drawn, Some(&[[5.0, 10.0], [190.0, 10.0]])).unwrap();
        assert_eq!(other.strokes.len(), 2, "a given route takes the place of the file's own");
    }

    #[test]
    fn rows_go_down_and_drawings_go_up() {
        let drawing = read(
            br#"{ "canvas": [100, 50], "strokes": [{ "points": [[1, 2], [3, 50]], "width_px": 5 }],
                "labels": [{ "text": "desk", "at": [10, 0] }], "start": { "at": [1, 2] },
                "obstacles": [{ "polygon": [[0, 0], [9, 0], [9, 9]], "label": "table" }], "route": [[5, 5], [6, 6]] }"#,
        )
        .unwrap();
        let points = |i: usize| drawing.strokes[i].points.iter().map(|at| [at.x, at.y]).collect::<Vec<_>>();
        assert_eq!(points(0), [[1.0, 48.0], [3.0, 0.0]]);
        assert_eq!(points(1), [[0.0, 50.0], [9.0, 50.0], [9.0, 41.0], [0.0, 50.0]]);
        assert_eq!(points(2), [[5.0, 45.0], [6.0, 44.0]]);
        let names: Vec<_> =
            drawing.labels.iter().map(|label| (label.text.as_str(), [label.at.x, label.at.y])).collect();
        assert_eq!(names, [("desk", [10.0, 50.0]), ("table", [0.0, 50.0])]);
    }

    #[test]
    fn what_is_no_drawing_is_rejected_with_its_place() {
        let error = read(b"{ \"canvas\": [9, 9],\n \"stroke\": [] }").unwrap_err().to_string();
        assert!(error.contains("unknown field `stroke`") && error.contains("line 2"), "{error}");
        let many =
            format!("{{ \"canvas\": [9, 9], \"strokes\": [{}] }}", ["{ \"points\": [] }"; 501].join(","));
        let error = read(many.as_bytes()).unwrap_err().to_string();
        assert_eq!(error, "strokes: expected at most 500, found 501");
    }

    proptest! {
        #[test]
        fn no_bytes_do_harm(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = read(&bytes);
        }
    }
}
