//! Strokes in JSON, as a drawing pad writes them (the canvas and the obstacle polygons of Boniardi et al. 2016, IV). All
//! coordinates are in image pixels (column, row; row 0 at the top).
//!
//! ```json
//! { "canvas": [2540, 1252],
//!   "strokes": [ { "points": [[100, 100], [900, 120]], "width_px": 5 } ],
//!   "obstacles": [ { "polygon": [[300, 300], [360, 300], [330, 350]], "label": "table" } ],
//!   "labels": [ { "text": "kitchen", "at": [760, 380] } ],
//!   "start": { "at": [150, 200], "heading_deg": 0 },
//!   "goals": [ { "name": "kitchen", "at": [800, 400] } ],
//!   "route": [[150, 200], [400, 220], [800, 400]] }
//! ```
//! Only `canvas` and `strokes` are required. A label names the place at its centre and is not ink. A page may
//! store its own data under the key `pad`. A stroke is 5 px wide unless it has a `width_px`, and an obstacle
//! is solid. Headings are in degrees, counter-clockwise from "to the right" in the drawing.

use resvg::tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke as Pen, Transform,
};
use serde::Deserialize;
use sketchnav_schemas::message::MAX_DRAWN_POINTS;

use super::budget::{MOST_OBSTACLE_CORNERS, MOST_STROKES, Outline, PIECE_CORNERS, Steps, steps_words};
use super::error::{Broken, SketchError};
use super::ink;
use super::labels::{Label, MOST_LABELS};
use super::raster::fit;
use super::vector::gray;
use super::walls::{Kind, Walls};
use super::{GoalMark, Marks, StartMark};

/// Maximum size of a file that is parsed, in bytes.
const MAX_BYTES: usize = 32 << 20;
/// Maximum side length of a canvas, in pixels.
const MAX_CANVAS_PX: u32 = 30_000;
/// Maximum absolute value of a coordinate, in pixels. A pen may slip off the canvas, but not this far.
const MAX_COORDINATE_PX: f64 = 100_000.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Page {
    canvas: [u32; 2],
    strokes: Vec<Stroke>,
    #[serde(default)]
    obstacles: Vec<Obstacle>,
    #[serde(default)]
    labels: Vec<Label>,
    #[serde(default)]
    start: Option<StartMark>,
    #[serde(default)]
    goals: Vec<GoalMark>,
    #[serde(default)]
    route: Option<Vec<[f64; 2]>>,
    /// The page's own data, ignored here.
    #[serde(default, rename = "pad")]
    _pad: serde::de::IgnoredAny,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stroke {
    points: Vec<[f64; 2]>,
    #[serde(default = "width_px")]
    width_px: f64,
}

fn width_px() -> f64 {
    5.0
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Obstacle {
    polygon: Vec<[f64; 2]>,
    /// Human-readable label, ignored here.
    #[serde(default, rename = "label")]
    _label: String,
}

/// Parses and draws a strokes file.
pub(crate) fn walls(text: &str, broken: &Broken) -> Result<Walls, SketchError> {
    if text.len() > MAX_BYTES {
        return Err(broken.too_large(format!("{MAX_BYTES} bytes of strokes"), text.len().to_string()));
    }
    let page: Page = serde_json::from_str(text).map_err(|error| broken.other_json(text, error))?;
    page.check(broken)?;
    let [width, height] = page.canvas.map(f64::from);
    let (w, h, scale) = fit(width, height, 1.0);
    page.check_work(scale, [w, h], broken)?;
    let paper = Pixmap::new(w, h).ok_or_else(|| broken.decode("strokes", "the canvas has no size"))?;
    let mask = ink::below(&gray(&page.draw(paper, scale as f32)), 128);
    let pen_width_px = page.pen_width_px().map(|width| (width * scale).max(1.0));
    let marks = Marks { start: page.start, goals: page.goals, route: page.route };
    let labels = page.labels.iter().filter_map(Label::tidied).collect();
    Ok(Walls { mask, scale, pen_width_px, kind: Kind::Strokes, marks, labels, left_out: Vec::new() })
}

impl Page {
    fn check(&self, broken: &Broken) -> Result<(), SketchError> {
        let wrong = |key: String, expected, found: String| {
            Err(SketchError::Strokes { file: broken.file(), key, expected, found })
        };
        if !self.canvas.iter().all(|side| (1..=MAX_CANVAS_PX).contains(side)) {
            return wrong("canvas".into(), "sides of 1 to 30000 px", format!("{:?}", self.canvas));
        }
        self.check_counts(broken)?;
        for (i, stroke) in self.strokes.iter().enumerate() {
            if !(stroke.width_px > 0.0 && stroke.width_px <= 1000.0) {
                let key = format!("strokes[{i}].width_px");
                return wrong(key, "above 0, at most 1000", stroke.width_px.to_string());
            }
        }
        for (i, obstacle) in self.obstacles.iter().enumerate() {
            if obstacle.polygon.len() < 3 {
                let found = obstacle.polygon.len().to_string();
                return wrong(format!("obstacles[{i}].polygon"), "3 corners or more", found);
            }
        }
        let labels = self.labels.iter().enumerate().map(|(i, label)| ("labels", i, &label.at));
        let far = |p: &[f64; 2]| !p.iter().all(|v| v.abs() <= MAX_COORDINATE_PX);
        let Some((list, i, point)) = self.points().chain(labels).find(|(_, _, p)| far(p)) else {
            return Ok(());
        };
        wrong(format!("{list}[{i}]"), "coordinates within 100000 px", format!("{point:?}"))
    }

    fn check_counts(&self, broken: &Broken) -> Result<(), SketchError> {
        let strokes = self.strokes.len() + self.obstacles.len();
        if strokes > MOST_STROKES {
            return Err(
                broken.too_large(format!("{MOST_STROKES} strokes and obstacles"), strokes.to_string())
            );
        }
        if self.labels.len() > MOST_LABELS {
            return Err(broken.too_large(format!("{MOST_LABELS} labels"), self.labels.len().to_string()));
        }
        let corners = self.points().count();
        if corners > MAX_DRAWN_POINTS {
            return Err(
                broken.too_large(format!("{MAX_DRAWN_POINTS} corners of all strokes"), corners.to_string())
            );
        }
        let long = self.obstacles.iter().position(|obstacle| obstacle.polygon.len() > MOST_OBSTACLE_CORNERS);
        long.map_or(Ok(()), |i| {
            let found = format!("{} of obstacles[{i}]", self.obstacles[i].polygon.len());
            Err(broken.too_large(format!("{MOST_OBSTACLE_CORNERS} corners of an obstacle"), found))
        })
    }

    /// Checks that the drawing does not take too many steps to paint.
    fn check_work(&self, scale: f64, page: [u32; 2], broken: &Broken) -> Result<(), SketchError> {
        let page = page.map(f64::from);
        let (mut steps, area) = (Steps::default(), page[0] * page[1]);
        let outline = |points: &[[f64; 2]]| Outline {
            corners: points.len() as f64,
            length_px: length_px(points) * scale,
            page_height_px: page[1],
        };
        let too_much =
            |list: &str, i: usize| broken.too_large(steps_words(), format!("more from {list}[{i}] on"));
        for (i, stroke) in self.strokes.iter().enumerate() {
            let width_px = (stroke.width_px * scale).max(1.0);
            for piece in stroke.pieces() {
                let outline = outline(piece);
                let inked = (outline.length_px + outline.corners * width_px) * width_px;
                if !steps.take(outline.stroke_steps(width_px) + inked.min(area)) {
                    return Err(too_much("strokes", i));
                }
            }
        }
        let heavy = self
            .obstacles
            .iter()
            .position(|obstacle| !steps.take(outline(&obstacle.polygon).fill_steps() + area));
        heavy.map_or(Ok(()), |i| Err(too_much("obstacles", i)))
    }

    /// Returns every point of the walls, with the name of its list and the index of its stroke or obstacle in it.
    fn points(&self) -> impl Iterator<Item = (&'static str, usize, &[f64; 2])> {
        let strokes = self.strokes.iter().map(|s| &s.points).enumerate().map(|(i, p)| ("strokes", i, p));
        let polygons = self.obstacles.iter().map(|o| &o.polygon).enumerate();
        let obstacles = polygons.map(|(i, p)| ("obstacles", i, p));
        strokes.chain(obstacles).flat_map(|(list, i, points)| points.iter().map(move |p| (list, i, p)))
    }

    fn draw(&self, mut paper: Pixmap, scale: f32) -> Pixmap {
        paper.fill(Color::WHITE);
        let mut ink = Paint { anti_alias: false, ..Paint::default() };
        ink.set_color(Color::BLACK);
        let canvas = Transform::from_scale(scale, scale);
        for stroke in &self.strokes {
            // A pen that is thinner than a cell would leave dots.
            let width = (stroke.width_px as f32).max(1.0 / scale);
            let pen = Pen { width, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Pen::default() };
            for path in stroke.pieces().filter_map(|piece| path(piece, false)) {
                paper.stroke_path(&path, &ink, &pen, canvas, None);
            }
        }
        for path in self.obstacles.iter().filter_map(|obstacle| path(&obstacle.polygon, true)) {
            paper.fill_path(&path, &ink, FillRule::EvenOdd, canvas, None);
        }
        paper
    }

    /// Returns the median width of the strokes, weighted by their lengths.
    fn pen_width_px(&self) -> Option<f64> {
        let mut widths: Vec<_> = self.strokes.iter().map(|s| (s.width_px, s.length_px())).collect();
        widths.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = widths.iter().map(|w| w.1).sum::<f64>() / 2.0;
        let mut sum = 0.0;
        widths.into_iter().find_map(|(width, length)| {
            sum += length;
            (sum >= half).then_some(width)
        })
    }
}

impl Stroke {
    fn length_px(&self) -> f64 {
        length_px(&self.points)
    }

    /// Splits the stroke into pieces, each of which begins where the previous one ends. Thanks to their round caps, the pieces
    /// look like the whole stroke.
    fn pieces(&self) -> impl Iterator<Item = &[[f64; 2]]> {
        let count = self.points.len();
        let starts = (0..count.saturating_sub(1).max(1)).step_by(PIECE_CORNERS - 1);
        starts.map(move |from| &self.points[from.min(count)..(from + PIECE_CORNERS).min(count)])
    }
}

fn length_px(points: &[[f64; 2]]) -> f64 {
    points.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum()
}

fn path(points: &[[f64; 2]], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    let (first, rest) = points.split_first()?;
    builder.move_to(first[0] as f32, first[1] as f32);
    rest.iter().for_each(|p| builder.line_to(p[0] as f32, p[1] as f32));
    if rest.iter().all(|p| p == first) {
        // A tap of the pen becomes a very short line, because only a line gets round caps.
        builder.line_to(first[0] as f32 + 0.1, first[1] as f32);
    }
    if closed {
        builder.close();
    }
    builder.finish()
}

#[cfg(test)]
mod tests;
