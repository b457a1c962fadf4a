//! The result of reading a drawing: its cells, its frame, and the direction of its walls.

use sketchnav_schemas::codes::{FREE, WALL};
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_schemas::seed;

use super::Marks;
use super::error::{Broken, SketchError};
use super::labels::Label;
use super::left_out::LeftOut;
use super::settings::Options;
use super::walls::{Kind, Walls, diagonal};
use super::{direction, pen};

/// A drawing as a grid, with whatever else was found in the file.
#[derive(Clone, PartialEq)]
pub struct DrawnMap {
    /// Name of the file, for error messages.
    pub file: String,
    /// Kind of drawing.
    pub kind: Kind,
    /// Width of the grid, in sketch pixels.
    pub width_px: u32,
    /// Height of the grid, in sketch pixels.
    pub height_px: u32,
    /// The `width_px * height_px` cells, each [`FREE`] or [`WALL`], with row 0 at the bottom. In a learned map, cells that were not
    /// seen are [`UNSEEN`](sketchnav_stage::drawn::UNSEEN).
    pub cells: Vec<u8>,
    /// Sketch pixels per image pixel. This is below 1 if the picture is larger than the canvas.
    pub scale: f64,
    /// Width of the pen's strokes, in sketch pixels. For a filled drawing, which has no strokes, this is the
    /// fineness of its edges.
    pub pen_width_px: f64,
    /// Direction of the walls in (−π/4, π/4], in radians counter-clockwise in the drawing.
    pub wall_direction_rad: f64,
    /// The start, goals and route that a strokes file marks, in image pixels.
    pub marks: Marks,
    /// The texts that are written on the drawing.
    pub labels: Vec<Label>,
    /// The goals at which the robot arrived on earlier drives by the drawing, if it now drives in what it learned there.
    pub known_goals: Vec<Label>,
    /// Content of the file that was not read as walls.
    pub left_out: Vec<LeftOut>,
}

impl DrawnMap {
    pub(crate) fn finish(walls: Walls, broken: &Broken, options: &Options) -> Result<Self, SketchError> {
        let (width_px, height_px) = walls.mask.dimensions();
        let pen_width_px = walls.pen_width();
        let settings = &options.settings;
        let gap_px = settings.close_gaps_pen_widths * pen_width_px;
        let closed = pen::close_gaps(&walls.mask, gap_px, walls.kind.is_filled());
        let cells: Vec<u8> = closed.iter().map(|&v| if v > 0 { WALL } else { FREE }).collect();
        if !cells.contains(&WALL) {
            return Err(broken.no_walls("a drawing without strokes on the page"));
        }
        if !cells.contains(&FREE) {
            return Err(SketchError::NoFreeSpace { file: broken.file() });
        }
        let mut rng = seed::stream(options.seed, "sketcher/lines");
        let wall_direction_rad = direction::walls(&closed, settings, &mut rng);
        let Walls { scale, kind, marks, labels, left_out, .. } = walls;
        let file = broken.file();
        Ok(Self {
            file,
            kind,
            width_px,
            height_px,
            cells,
            scale,
            pen_width_px,
            wall_direction_rad,
            marks,
            labels,
            known_goals: Vec::new(),
            left_out,
        })
    }

    /// Converts a position in image pixels (column, row; row 0 at the top) to the drawing's frame.
    pub fn from_image(&self, place: [f64; 2]) -> Point<Sketch> {
        Point::new(place[0] * self.scale, f64::from(self.height_px) - place[1] * self.scale)
    }

    /// Converts a position in the drawing's frame to image pixels (column, row; row 0 at the top).
    pub fn to_image(&self, point: &Point<Sketch>) -> [f64; 2] {
        [point.x / self.scale, (f64::from(self.height_px) - point.y) / self.scale]
    }

    /// Returns the width and the height of the grid, in cells.
    pub fn size(&self) -> [usize; 2] {
        [self.width_px, self.height_px].map(|side| side as usize)
    }

    /// Returns the length of the diagonal, in sketch pixels.
    pub fn diagonal_px(&self) -> f64 {
        diagonal(self.width_px, self.height_px)
    }

    /// Returns the cell at a point, or `None` outside the drawing.
    pub fn cell(&self, point: &Point<Sketch>) -> Option<u8> {
        self.index(point).map(|i| self.cells[i])
    }

    /// Returns the index of the cell at a point, or `None` outside the drawing.
    pub(crate) fn index(&self, point: &Point<Sketch>) -> Option<usize> {
        let (width, height) = (f64::from(self.width_px), f64::from(self.height_px));
        let within = (0.0..width).contains(&point.x) && (0.0..height).contains(&point.y);
        within.then(|| point.y as usize * self.width_px as usize + point.x as usize)
    }
}

/// Leaves out the cells, of which there may be millions.
impl std::fmt::Debug for DrawnMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DrawnMap")
            .field("file", &self.file)
            .field("kind", &self.kind)
            .field("width_px", &self.width_px)
            .field("height_px", &self.height_px)
            .field("scale", &self.scale)
            .field("pen_width_px", &self.pen_width_px)
            .field("wall_direction_rad", &self.wall_direction_rad)
            .field("marks", &self.marks)
            .field("labels", &self.labels)
            .field("known_goals", &self.known_goals)
            .field("left_out", &self.left_out)
            .finish_non_exhaustive()
    }
}
