//! The drawing as the navigators see it: a grid of free and wall cells with a direction.

use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::geometry::{Point, Sketch as SketchFrame};

/// The drawing: cells in rows from the bottom up, and the direction of its walls.
///
/// Cell (column, row) covers the square from (column, row) to (column + 1, row + 1) of the frame
/// [`SketchFrame`]. What lies outside the grid is wall.
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    width: usize,
    height: usize,
    wall: Vec<bool>,
    wall_direction_rad: f64,
}

impl Sketch {
    /// From cells as they travel behind a `SketchMap` (row 0 at the bottom; [`WALL`] is wall, all
    /// else free). Returns `None` where the count of cells is not width × height.
    pub fn new(width: usize, height: usize, cells: &[u8], wall_direction_rad: f64) -> Option<Self> {
        (width.checked_mul(height)? == cells.len()).then(|| Self {
            width,
            height,
            wall: cells.iter().map(|&c| c == WALL).collect(),
            wall_direction_rad,
        })
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The direction φ of the reference frame R_S (paper 001, III-B): scale a runs along it, scale b
    /// across; radians in the sketch frame.
    pub fn wall_direction_rad(&self) -> f64 {
        self.wall_direction_rad
    }

    /// Whether the cell is wall; outside is wall.
    pub fn is_wall_cell(&self, column: i64, row: i64) -> bool {
        let inside = (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
        !inside || self.wall[row as usize * self.width + column as usize]
    }

    /// Whether the place is in a wall or outside.
    pub fn is_wall(&self, place: Point<SketchFrame>) -> bool {
        self.is_wall_cell(place.x.floor() as i64, place.y.floor() as i64)
    }
}
