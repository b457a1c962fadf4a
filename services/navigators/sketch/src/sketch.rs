//! The drawing as seen by the localizer and the planner: a grid of free and wall cells, and the direction of
//! the walls.

use sketchnav_schemas::codes::WALL;
use sketchnav_schemas::geometry::{Point, Sketch};
use sketchnav_stage::drawn::UNSEEN;

use crate::messages::SketchMap;

/// The drawing as rows of cells from the bottom up, with the direction of its walls.
///
/// Cell (column, row) covers the square from (column, row) to (column + 1, row + 1) of the frame [`Sketch`]. Everything outside the
/// grid is wall.
#[derive(Debug, Clone, PartialEq)]
pub struct SketchGrid {
    width: usize,
    height: usize,
    wall: Vec<bool>,
    /// What was not seen on earlier drives. Empty in a drawing.
    unseen: Vec<bool>,
    wall_direction_rad: f64,
}

/// The number of cells after a sketch does not match its size, or is zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("sketch: expected {width} × {height} cells, found {found}")]
pub struct CellsError {
    /// Width according to the message.
    pub width: u32,
    /// Height according to the message.
    pub height: u32,
    /// The number of cells after the message.
    pub found: usize,
}

impl SketchGrid {
    /// Creates a grid from a message and the cells that follow it.
    ///
    /// # Errors
    /// [`CellsError`] if there are no cells, or not as many as the size in the message requires.
    pub fn of_map(map: &SketchMap, cells: &[u8]) -> Result<Self, CellsError> {
        let (width, height) = (map.width_px, map.height_px);
        Self::new(width as usize, height as usize, cells, map.wall_direction_rad)
            .filter(|_| !cells.is_empty())
            .ok_or(CellsError { width, height, found: cells.len() })
    }

    /// Creates a grid from cells as they follow a `SketchMap` (row 0 at the bottom; [`WALL`] is wall, [`UNSEEN`]
    /// counts as wall, and everything else is free). Returns `None` if the number of cells is not width × height.
    pub fn new(width: usize, height: usize, cells: &[u8], wall_direction_rad: f64) -> Option<Self> {
        (width.checked_mul(height)? == cells.len()).then(|| Self {
            width,
            height,
            wall: cells.iter().map(|&c| c == WALL || c == UNSEEN).collect(),
            unseen: match cells.contains(&UNSEEN) {
                true => cells.iter().map(|&c| c == UNSEEN).collect(),
                false => Vec::new(),
            },
            wall_direction_rad,
        })
    }

    /// Returns the cells row by row from the bottom, with `true` for a wall.
    pub fn walls(&self) -> &[bool] {
        &self.wall
    }

    /// Returns a copy of the grid with additional walls where `more` is true. `more` must have as many cells as the grid.
    pub fn walled(&self, more: &[bool]) -> Self {
        let wall = self.wall.iter().zip(more).map(|(wall, more)| wall | more).collect();
        Self { wall, unseen: self.unseen.clone(), ..*self }
    }

    /// Returns a copy of the grid without the walls where `cleared` is true. `cleared` must have as many cells as the grid.
    pub fn cleared(&self, cleared: &[bool]) -> Self {
        let wall = self.wall.iter().zip(cleared).map(|(wall, cleared)| wall & !cleared).collect();
        Self { wall, unseen: self.unseen.clone(), ..*self }
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the direction φ of the reference frame R_S, in radians in the sketch frame (Boniardi et al. 2015, III-B). Scale
    /// a applies along this direction, scale b across it.
    pub fn wall_direction_rad(&self) -> f64 {
        self.wall_direction_rad
    }

    /// Returns true if the cell is a wall. Everything outside the grid is.
    pub fn is_wall_cell(&self, column: i64, row: i64) -> bool {
        let inside = (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
        !inside || self.wall[row as usize * self.width + column as usize]
    }

    /// Returns true if the position, in pixels, was not seen on earlier drives. Always false in a drawing.
    pub fn is_unseen(&self, at_px: [f32; 2]) -> bool {
        let [column, row] = at_px.map(|at| at.floor() as i64);
        let is_inside = (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
        match is_inside {
            true => {
                self.unseen.get(row as usize * self.width + column as usize).is_some_and(|unseen| *unseen)
            }
            false => !self.unseen.is_empty(),
        }
    }

    /// Returns true if the position is in a wall or outside the grid.
    pub fn is_wall(&self, place: Point<Sketch>) -> bool {
        self.is_wall_cell(place.x.floor() as i64, place.y.floor() as i64)
    }
}
