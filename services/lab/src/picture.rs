//! Draws two pictures of a mission: the drawing with the estimated path, and the true floor with the true path.
//!
//! This module is pure: it takes plain points and returns SVG as text, and the same points yield the same text. It never reads a
//! recording (to cut channels into tasks, see [`crate::judge::TaskSpan::of`]) and never writes a file.
//!
//! Both pictures are 1200 units wide and all sizes are in these units, so that lines and letters look the
//! same for canvases and buildings of any size.

mod correspondence;
mod floor;
mod map_graph;
mod marks;
mod plane;
pub mod svg;
mod task;
mod witnesses;

use image::ImageEncoder;
use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::geometry::{Point, Pose, Sketch, World};
use sketchnav_schemas::mission::Place;
use sketchnav_sketch::messages::PoseEstimate;

pub use correspondence::{SeenOutline, drawn_outline, origin_of, seen_outline};
pub use floor::FloorShapes;
pub use map_graph::map_graph;
use marks::Symbol;
pub use plane::{PlanePicture, PlannedMap, plane};
pub use svg::escape;
use svg::{GREEN, Sheet, View};
pub use task::{TaskMark, TaskPicture};
pub use witnesses::{Claims, claims, drawn_rooms};

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The number of cells does not match the size of the grid.
    #[error("sketch cells: expected {width_px} × {height_px} of them, found {found}")]
    Cells {
        /// The given width.
        width_px: u32,
        /// The given height.
        height_px: u32,
        /// The number of cells.
        found: usize,
    },
    /// The grid could not be encoded as a PNG.
    #[error("sketch cells: cannot be packed as a PNG: {0}")]
    Png(#[from] image::ImageError),
}

/// A drawing with a start and a goal, for [`drawn_outline`] and [`drawn_rooms`].
#[derive(Debug, Clone)]
pub struct DrawnGoal<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Width of the drawing, in pixels.
    pub width_px: u32,
    /// Height of the drawing, in pixels.
    pub height_px: u32,
    /// Cells of the drawing, with row 0 at the bottom.
    pub cells: &'a [u8],
    /// The robot's start pose, if somebody has marked it.
    pub start: Option<Pose<Sketch>>,
    /// Position of the goal.
    pub goal: Point<Sketch>,
}

impl DrawnGoal<'_> {
    /// Returns a sheet that shows the walls.
    fn sheet(&self) -> Result<Sheet, PictureError> {
        let view = View::new([0.0; 2], [self.width_px.into(), self.height_px.into()], 0.0);
        let mut sheet = Sheet::new(view, self.title);
        sheet.image(&wall_png(self.width_px, self.height_px, self.cells)?);
        Ok(sheet)
    }

    /// Adds the start and the goal.
    fn mark(&self, sheet: &mut Sheet) {
        self.start.iter().for_each(|start| marks::start(sheet, start));
        sheet.cross(&self.goal, GREEN);
    }
}

/// The drawing and the robot's estimates, for [`sketch()`].
#[derive(Debug, Clone)]
pub struct SketchPicture<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Width of the drawing, in pixels.
    pub width_px: u32,
    /// Height of the drawing, in pixels.
    pub height_px: u32,
    /// Cells of a [`sketchnav_sketch::messages::SketchMap`], with row 0 at the bottom.
    pub cells: &'a [u8],
    /// The robot's start pose, if somebody has marked it.
    pub start: Option<Pose<Sketch>>,
    /// The tasks in order.
    pub tasks: &'a [TaskPicture<Sketch>],
}

/// The true floor and what happened on it, for [`floor()`].
#[derive(Debug, Clone)]
pub struct FloorPicture<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Walls and objects on the floor.
    pub shapes: &'a FloorShapes,
    /// Paths of the people who walk on the floor.
    pub people: &'a [Vec<Point<World>>],
    /// Polygons of the camera's field of view at some points in time.
    pub views: &'a [Vec<Point<World>>],
    /// The robot's start pose.
    pub start: Pose<World>,
    /// The tasks in order.
    pub tasks: &'a [TaskPicture<World>],
    /// Positions where contacts began.
    pub contacts: &'a [Point<World>],
}

/// Returns the outline of a place: its corners if it is a polygon, or a polygon of 48 corners if it is a disc.
pub fn place_outline(place: &Place) -> Vec<Point<World>> {
    if let Some(polygon) = &place.polygon {
        return polygon.iter().map(|p| Point::new(p[0], p[1])).collect();
    }
    let (Some([x, y]), Some(radius)) = (place.center, place.radius_m) else { return Vec::new() };
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 48.0).sin_cos();
        Point::new(x + radius * cos, y + radius * sin)
    };
    (0..48).map(corner).collect()
}

/// Returns the estimated positions, as long as the robot was placed in the drawing.
pub fn trail(estimates: &[PoseEstimate]) -> Vec<Point<Sketch>> {
    estimates.iter().filter(|e| e.is_placed()).map(|e| e.pose.pose().position()).collect()
}

/// Draws the drawing with the estimated trajectory as SVG.
///
/// # Errors
/// [`PictureError`] if the number of cells does not match the size, or if they cannot be encoded as a PNG.
pub fn sketch(picture: &SketchPicture<'_>) -> Result<String, PictureError> {
    let (width, height) = (f64::from(picture.width_px), f64::from(picture.height_px));
    let view = View::new([0.0, 0.0], [width, height], 0.0);
    let png = wall_png(picture.width_px, picture.height_px, picture.cells)?;
    let mut sheet = Sheet::new(view, picture.title);
    sheet.image(&png);
    marks::tasks(&mut sheet, picture.tasks);
    picture.start.iter().for_each(|start| marks::start(&mut sheet, start));
    let clouds = picture.tasks.iter().any(|task| !task.particles.is_empty());
    let routes = picture.tasks.iter().any(|task| task.marks.len() > 1);
    let trails = picture.tasks.iter().any(|task| !task.trail.is_empty());
    let mut symbols: Vec<_> = picture.start.iter().map(|_| Symbol::Start).collect();
    symbols.push(Symbol::Goal);
    symbols.extend(trails.then_some(Symbol::Trail("estimated path")));
    symbols.extend(routes.then_some(Symbol::Route));
    symbols.extend([Symbol::Reached, Symbol::Failed]);
    symbols.extend(clouds.then_some(Symbol::Particles));
    marks::legend(&mut sheet, picture.tasks, &symbols);
    Ok(sheet.finish())
}

/// A snapshot of a run in a drawing, for [`moment()`].
#[derive(Debug, Clone)]
pub struct Moment<'a> {
    /// Heading of the picture.
    pub title: &'a str,
    /// Width of the drawing's grid, in pixels.
    pub width_px: u32,
    /// Height of the drawing's grid, in pixels.
    pub height_px: u32,
    /// Cells of the grid, with row 0 at the bottom.
    pub cells: &'a [u8],
    /// The robot's estimated pose.
    pub pose: Pose<Sketch>,
    /// The robot's estimated positions up to the moment.
    pub trail: &'a [Point<Sketch>],
    /// Positions of the particles.
    pub particles: &'a [Point<Sketch>],
    /// The planned path.
    pub plan: &'a [Point<Sketch>],
}

/// Draws a snapshot in the drawing as SVG: the path so far, the particles, the pose and the plan.
///
/// # Errors
/// [`PictureError`] if the number of cells does not match the size, or if they cannot be encoded as a PNG.
pub fn moment(moment: &Moment<'_>) -> Result<String, PictureError> {
    let Moment { title, width_px, height_px, cells, .. } = *moment;
    let view = View::new([0.0, 0.0], [width_px.into(), height_px.into()], 0.0);
    let png = wall_png(width_px, height_px, cells)?;
    let mut sheet = Sheet::new(view, title);
    sheet.image(&png);
    sheet.line(moment.trail, "stroke=\"#2f6fd0\" stroke-width=\"3\" stroke-opacity=\"0.55\"");
    marks::cloud(&mut sheet, moment.particles, "#e07b16");
    sheet.line(moment.plan, "stroke=\"#1d8a4a\" stroke-width=\"3.5\" stroke-dasharray=\"9 6\"");
    marks::start(&mut sheet, &moment.pose);
    Ok(sheet.finish())
}

/// Draws the true floor as SVG, with contacts, a scale bar and, if the robot drove, its true trajectory.
pub fn floor(picture: &FloorPicture<'_>) -> String {
    let start = picture.start.position();
    let around_start = [-1.0, 1.0].map(|off| Point::<World>::new(start.x + off, start.y + off));
    let trails = picture.tasks.iter().flat_map(|task| &task.trail);
    let view = View::around(picture.shapes.walls.iter().flatten().chain(trails).chain(&around_start));
    let mut sheet = Sheet::new(view, picture.title);
    marks::places(&mut sheet, picture.tasks);
    for view in picture.views {
        sheet.polygon(
            view,
            "fill=\"#7a52cc\" fill-opacity=\"0.08\" stroke=\"#7a52cc\" stroke-opacity=\"0.35\"",
        );
    }
    for polygon in &picture.shapes.furniture {
        sheet.polygon(polygon, "fill=\"#e9dcc6\" stroke=\"#cbb894\" stroke-width=\"0.8\"");
    }
    marks::ways(&mut sheet, picture.people);
    sheet
        .segments(&picture.shapes.walls, "stroke=\"#2b303b\" stroke-width=\"2.4\" stroke-linecap=\"square\"");
    for marker in &picture.shapes.markers {
        sheet.polygon(marker, "fill=\"#c23b8f\"");
    }
    marks::tasks(&mut sheet, picture.tasks);
    marks::start(&mut sheet, &picture.start);
    marks::contacts(&mut sheet, picture.contacts);
    sheet.scale_bar(1.0);
    let mut symbols = vec![Symbol::Start, Symbol::Goal];
    if picture.tasks.iter().any(|task| !task.trail.is_empty()) {
        symbols.extend([Symbol::Trail("true path"), Symbol::Reached, Symbol::Failed]);
    }
    symbols.extend((!picture.shapes.furniture.is_empty()).then_some(Symbol::Furniture));
    symbols.extend((!picture.shapes.markers.is_empty()).then_some(Symbol::Marker));
    symbols.extend((!picture.views.is_empty()).then_some(Symbol::View));
    symbols.extend((!picture.people.is_empty()).then_some(Symbol::Person));
    symbols.extend((!picture.contacts.is_empty()).then_some(Symbol::Contact));
    marks::legend(&mut sheet, picture.tasks, &symbols);
    sheet.finish()
}

/// Encodes the walls as a PNG, dark on white, with row 0 at the bottom. A whole canvas takes a few dozen kilobytes.
fn wall_png(width_px: u32, height_px: u32, cells: &[u8]) -> Result<Vec<u8>, PictureError> {
    let found = cells.len();
    if found == 0 || found as u64 != u64::from(width_px) * u64::from(height_px) {
        return Err(PictureError::Cells { width_px, height_px, found });
    }
    let rows_from_the_top = cells.chunks_exact(width_px as usize).rev().flatten();
    let shades: Vec<u8> = rows_from_the_top.map(|&cell| if cell == WALL { 48 } else { 255 }).collect();
    let mut png = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut png,
        image::codecs::png::CompressionType::Best,
        image::codecs::png::FilterType::Up,
    );
    encoder.write_image(&shades, width_px, height_px, image::ExtendedColorType::L8)?;
    Ok(png)
}

#[cfg(test)]
mod tests;
