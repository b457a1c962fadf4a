//! A view of a run in progress for the page, drawn by the navigator itself.
//!
//! A [`Lookout`] receives messages and draws a [`Picture`]. Like a stage, it is pure: the pad reads the
//! channels, fits the picture onto its canvas and sends it to the pages. If a navigator has no lookout, only
//! [`Sensors`] are shown.

mod around;
mod shapes;

use sketchnav_schemas::codes::Tracking;

use crate::{Denied, Incoming};

pub use around::{Around, Sensors, polar};
pub use shapes::{Color, Shape, Stroke, thinned};

/// A navigator's view of a run in progress.
///
/// A lookout receives messages from every sensor and from those channels of its kind of navigator that list
/// the pad among their readers.
pub trait Lookout {
    /// Receives a message. Implementations should ignore messages of channels that they do not need.
    ///
    /// # Errors
    /// [`Denied`] if the implementation asks for a channel that the pad does not read.
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied>;

    /// Returns the sheet that the lookout draws on.
    fn sheet(&self) -> Sheet {
        Sheet::Robot
    }

    /// Returns the walls of the drawing if new ones have arrived since the last call.
    fn take_walls(&mut self) -> Option<Walls> {
        None
    }

    /// Returns true if the robot may set off. A robot that must first be localized is not ready until then.
    fn is_ready(&self) -> bool {
        true
    }

    /// Returns the positions where the robot may be, for a person to choose from, most likely first. The list is empty if the robot
    /// may be anywhere. Returns `None` if there is no question.
    fn question(&self) -> Option<Vec<[f64; 2]>> {
        None
    }

    /// Draws the current picture.
    fn draw(&mut self, picture: &mut Picture);
}

/// The sheet that a lookout draws on. All coordinates and lengths are in the units of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sheet {
    /// The robot's surroundings in its own axes, in metres ahead and to the left.
    Robot,
    /// A drawing of this width and height in pixels, with the origin at the lower left and y up. `None` while
    /// the size is unknown.
    Drawing(Option<[u32; 2]>),
}

/// A picture at one moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// Shapes, from bottom to top.
    pub shapes: Vec<Shape>,
    /// Shapes that are drawn below the others and seldom change. Once given, they stay until replaced.
    pub lasting: Option<Vec<Shape>>,
    /// Possible positions of the robot. Once given, they move along with the robot until replaced.
    pub particles: Option<Vec<[f64; 2]>>,
    /// The robot's estimate of where it is in the drawing.
    pub robot: Option<Whereabouts>,
    /// Text that describes the current activity.
    pub words: Vec<String>,
}

impl Picture {
    /// Draws a line.
    pub fn line(&mut self, points: impl Into<Vec<[f64; 2]>>, color: Color) {
        self.shapes.push(Shape::line(points, color));
    }
}

/// A robot's estimate of where it is in a drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whereabouts {
    /// Centre of the robot.
    pub at: [f64; 2],
    /// Heading, in radians counter-clockwise from the direction to the right.
    pub heading_rad: f64,
    /// Uncertainty of the position, as the semi-axes of the ellipse of two standard deviations and the direction of the first one,
    /// measured like `heading_rad`.
    pub ellipse: [f64; 3],
    /// Radius of the robot.
    pub radius: f64,
    /// How confident the robot is of its position.
    pub tracking: Tracking,
    /// Support for this estimate, from 0 to 1, such as the share of particles that agree with it.
    pub effective: f64,
}

/// A grid of cells with row 0 at the bottom. Cells with the code [`WALL`](sketchnav_schemas::codes::WALL) are walls.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Walls {
    /// Width and height of the grid, in pixels.
    pub size_px: [u32; 2],
    /// Codes of the cells, row by row.
    pub cells: Vec<u8>,
}
