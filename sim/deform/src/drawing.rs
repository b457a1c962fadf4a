//! A floor as a person might draw it, and the correspondence between points of the floor and of the drawing.

use nalgebra::Vector2;
use rand::RngExt;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use serde_json::json;
use sketchnav_schemas::geometry::{Point, Pose, Sketch, World, wrap_angle};
use sketchnav_schemas::seed;

use crate::doors::{self, Memory, Wall};
use crate::error::DeformError;
use crate::floor::Floor;
use crate::hand::{self, Stroke};
use crate::measure::Deformation;
use crate::warp::Warp;

/// Maximum degree. Beyond it, a drawing no longer resembles the floor.
pub const MOST_DEGREE: f64 = 3.0;
/// Longer side of the drawing, and width of the margin around it, in pixels.
const SIDE_PX: f64 = 1200.0;
const MARGIN_PX: f64 = 60.0;
/// Width of the pen, and by how much it varies at degree 1, in pixels.
const PEN_PX: f64 = 4.0;
const PENS_PX: [f64; 2] = [3.0, 6.0];
/// Distance between the points that are added to a wall so that the map can bend it, in metres.
const BEND_M: f64 = 0.5;

/// A synthetic drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct DeformedDrawing {
    /// Width and height of the canvas, in pixels.
    pub canvas_px: [u32; 2],
    /// Strokes of the pen.
    pub strokes: Vec<Stroke>,
    /// Indices of the regions that were left out. [`DeformedDrawing::to_sketch`] returns `None` for points in them.
    pub forgotten: Vec<usize>,
    /// Deformation measured over [`Floor::places`], or `None` if there are too few of them.
    pub deformation: Option<Deformation>,
    /// Deformation as annotators would have marked it, for comparison with [`PEOPLE`](crate::PEOPLE).
    pub as_annotated: Option<Deformation>,
    floor: Floor,
    warp: Warp,
    px_per_m: f64,
    offset: Vector2<f64>,
}

/// Draws a floor. At degree 0, the walls are traced faithfully. At degree 1, they are deformed as much as in
/// people's drawings, and at degree 0.5 half as much. The same floor, degree and seed give a bit-identical
/// drawing.
///
/// # Errors
/// [`DeformError::Degree`] if the degree is out of range.
pub fn deform(floor: &Floor, degree: f64, mission_seed: u64) -> Result<DeformedDrawing, DeformError> {
    if !(0.0..=MOST_DEGREE).contains(&degree) {
        return Err(DeformError::Degree { most: MOST_DEGREE, found: degree });
    }
    let memory = doors::remember(floor, degree, &mut seed::stream(mission_seed, "deform/doors"));
    let mut drawing = DeformedDrawing::unfolded(floor, &memory, degree, mission_seed);
    drawing.draw(memory, degree, mission_seed);
    let places = floor.places().iter();
    let pairs: Vec<_> = places.map(|place| (*place, drawing.mapped(place.coords()).into())).collect();
    drawing.deformation = Deformation::measure(&pairs);
    drawing.as_annotated = Deformation::as_annotated(&pairs, &mut seed::stream(mission_seed, "deform/marks"));
    Ok(drawing)
}

impl DeformedDrawing {
    /// Creates the canvas around the mapped walls, without any strokes.
    fn unfolded(floor: &Floor, memory: &Memory, degree: f64, mission_seed: u64) -> Self {
        let warp = Warp::draw(floor, degree, mission_seed);
        let points = || memory.walls.iter().flat_map(|wall| finer(&wall.points)).map(|p| warp.apply(p));
        let low = points().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(&p));
        let high = points().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p));
        let px_per_m = SIDE_PX / (high - low).max();
        let size = ((high - low) * px_per_m).add_scalar(2.0 * MARGIN_PX);
        Self {
            canvas_px: [size.x.ceil() as u32, size.y.ceil() as u32],
            strokes: Vec::new(),
            forgotten: memory.forgotten.clone(),
            deformation: None,
            as_annotated: None,
            floor: floor.clone(),
            warp,
            px_per_m,
            offset: Vector2::repeat(MARGIN_PX) - low * px_per_m,
        }
    }

    fn draw(&mut self, memory: Memory, degree: f64, mission_seed: u64) {
        let mut rng = seed::stream(mission_seed, "deform/hand");
        let pen_px = PEN_PX + (rng.random_range(PENS_PX[0]..PENS_PX[1]) - PEN_PX) * degree.min(1.0);
        let paper = |wall: Wall| {
            let points = if wall.points.is_empty() { Vec::new() } else { finer(&wall.points) };
            Wall { points: points.into_iter().map(|p| self.mapped(p)).collect(), jambs: wall.jambs }
        };
        let mut walls: Vec<Wall> = memory.walls.into_iter().map(paper).collect();
        hand::widen_doors(&mut walls, &memory.doors, pen_px);
        let drawn = walls.iter().filter(|wall| wall.points.len() > 1);
        self.strokes = drawn.flat_map(|wall| hand::draw(wall, degree, pen_px, &mut rng)).collect();
    }

    fn mapped(&self, place: Vector2<f64>) -> Vector2<f64> {
        self.warp.apply(place) * self.px_per_m + self.offset
    }

    /// Returns the point of the drawing that corresponds to a point of the floor, or `None` in walls,
    /// outside, and in rooms that were left out.
    pub fn to_sketch(&self, place: &Point<World>) -> Option<Point<Sketch>> {
        let region = self.floor.region_at(place)?;
        (!self.forgotten.contains(&region)).then(|| self.mapped(place.coords()).into())
    }

    /// Returns a pose of the floor as a person would mark it in the drawing, with its heading turned like the drawing around it.
    pub fn pose_to_sketch(&self, pose: &Pose<World>) -> Option<Pose<Sketch>> {
        const AHEAD_M: f64 = 0.1;
        let at = self.to_sketch(&pose.position())?;
        let ahead = Vector2::new(pose.yaw_rad.cos(), pose.yaw_rad.sin()) * AHEAD_M;
        let way = self.mapped(pose.position().coords() + ahead) - at.coords();
        Some(Pose::new(at.x, at.y, wrap_angle(way.y.atan2(way.x))))
    }

    /// Converts a point of the drawing to image pixels: column and row, with row 0 at the top.
    pub fn to_image(&self, point: &Point<Sketch>) -> [f64; 2] {
        [point.x, f64::from(self.canvas_px[1]) - point.y]
    }

    /// Returns the drawing as a strokes file.
    pub fn strokes_json(&self) -> String {
        let stroke = |stroke: &Stroke| {
            let points: Vec<_> = stroke.points.iter().map(|p| self.to_image(p).map(tenth)).collect();
            json!({ "points": points, "width_px": tenth(stroke.width_px) })
        };
        let strokes: Vec<_> = self.strokes.iter().map(stroke).collect();
        json!({ "canvas": self.canvas_px, "strokes": strokes }).to_string()
    }

    /// Returns the drawing as SVG.
    pub fn svg(&self) -> String {
        let [width, height] = self.canvas_px;
        let line = |stroke: &Stroke| {
            let points = stroke.points.iter().map(|p| self.to_image(p));
            let points: Vec<_> = points.map(|[x, y]| format!("{:.1},{:.1}", x, y)).collect();
            format!("<polyline stroke-width=\"{:.1}\" points=\"{}\"/>\n", stroke.width_px, points.join(" "))
        };
        let lines: String = self.strokes.iter().map(line).collect();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<g fill=\"none\" stroke=\"black\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n{lines}</g>\n</svg>\n"
        )
    }

    /// Returns the drawing as PNG.
    ///
    /// # Errors
    /// [`DeformError::Picture`] if the drawing cannot be painted or encoded.
    pub fn png(&self) -> Result<Vec<u8>, DeformError> {
        let wrong = |error: &dyn std::fmt::Display| DeformError::Picture(error.to_string());
        let tree = Tree::from_str(&self.svg(), &Options::default()).map_err(|error| wrong(&error))?;
        let [width, height] = self.canvas_px;
        let mut page = Pixmap::new(width, height).ok_or_else(|| wrong(&"the canvas has no size"))?;
        page.fill(Color::WHITE);
        resvg::render(&tree, Transform::default(), &mut page.as_mut());
        page.encode_png().map_err(|error| wrong(&error))
    }
}

fn tenth(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

/// Adds points to a line, so that the map can bend it.
fn finer(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let pieces = points.windows(2).flat_map(|pair| {
        let count = ((pair[1] - pair[0]).norm() / BEND_M).ceil().max(1.0) as usize;
        (0..count).map(move |i| pair[0] + (pair[1] - pair[0]) * (i as f64 / count as f64))
    });
    pieces.chain(points.last().copied()).collect()
}
