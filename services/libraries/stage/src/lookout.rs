//! What a page shows of a run in progress, as drawn by the navigator itself.
//!
//! A [`Lookout`] hears messages and draws a [`Picture`]. It is as pure as a stage: the pad reads the channels, brings the
//! picture onto its canvas and sends it to the pages. For a navigator without a lookout only [`Sensors`] are shown.

mod around;
mod shapes;

use sketchnav_schemas::codes::Tracking;

use crate::{Denied, Heard};

pub use around::{Around, Sensors, polar};
pub use shapes::{Color, Shape, Stroke, thinned};

/// What a navigator shows.
///
/// It hears every sensor and the channels of its kind, provided that the table names the pad among the readers.
pub trait Lookout {
    /// Receives a message. Messages of irrelevant channels are to be ignored.
    ///
    /// # Errors
    /// [`Denied`] for a channel that the pad does not read.
    fn hear(&mut self, message: &Heard<'_>) -> Result<(), Denied>;

    /// What it draws on.
    fn sheet(&self) -> Sheet {
        Sheet::Robot
    }

    /// The walls of the drawing, if new ones have arrived since the last call.
    fn take_walls(&mut self) -> Option<Walls> {
        None
    }

    /// Whether the robot may be sent on its way: whether it knows where it is, if it needs to.
    fn is_ready(&self) -> bool {
        true
    }

    /// The places among which a person is asked to choose where the robot is, the likeliest first; empty if it may be anywhere.
    /// `None` while nothing is asked.
    fn question(&self) -> Option<Vec<[f64; 2]>> {
        None
    }

    /// Draws the current picture.
    fn draw(&mut self, picture: &mut Picture);
}

/// What a lookout draws on. All places and lengths are in the units of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sheet {
    /// The robot's surroundings, in its own axes: metres ahead and to the left.
    Robot,
    /// A drawing of this width and height, pixels: origin lower left, y up. `None` before it is known.
    Drawing(Option<[u32; 2]>),
}

/// What is shown at a moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// What is drawn, the lowest first.
    pub shapes: Vec<Shape>,
    /// What is drawn below the shapes and seldom changes: given once, it stays until replaced.
    pub lasting: Option<Vec<Shape>>,
    /// Guesses of where the robot is. Given once, they move along with the robot until replaced.
    pub particles: Option<Vec<[f64; 2]>>,
    /// Where the robot is in the drawing, as far as it knows.
    pub robot: Option<Whereabouts>,
    /// Words that describe what is happening.
    pub words: Vec<String>,
}

impl Picture {
    /// Draws a line.
    pub fn line(&mut self, points: impl Into<Vec<[f64; 2]>>, color: Color) {
        self.shapes.push(Shape::line(points, color));
    }
}

/// Where a robot believes it is in a drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whereabouts {
    /// Its centre.
    pub at: [f64; 2],
    /// Counter-clockwise from "to the right", radians.
    pub heading_rad: f64,
    /// Semi-axes of two standard deviations and the first one's direction, as `heading_rad`.
    pub ellipse: [f64; 3],
    /// The robot's radius.
    pub radius: f64,
    /// How sure it is.
    pub tracking: Tracking,
    /// What supports that, between 0 and 1: a share of the particles, say.
    pub effective: f64,
}

/// A grid of cells, row 0 at the bottom; those of the code [`WALL`](sketchnav_schemas::codes::WALL) are walls.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Walls {
    /// Width and height.
    pub size_px: [u32; 2],
    /// The cells.
    pub cells: Vec<u8>,
}
