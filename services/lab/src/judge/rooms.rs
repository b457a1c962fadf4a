//! Parses the file that gives the outline of each room on the true floor and in the drawing.
//!
//! ```toml
//! [[room]]
//! name = "corridor"
//! world = [[0.0, 0.0], [20.0, 0.0], [20.0, 2.0], [0.0, 2.0]]      # metres
//! sketch = [[10, 200], [400, 200], [400, 240], [10, 240]]         # image pixels: column, row
//! ```
//! Only the judge reads this file.

use serde::Deserialize;
use sketchnav_schemas::geometry::{Point, Sketch, World, encloses};
use sketchnav_schemas::toml_text::{self, TomlError};

/// The rooms in a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rooms {
    room: Vec<Room>,
}

/// A room, with its outlines in both frames.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Room {
    name: String,
    world: Vec<[f64; 2]>,
    sketch: Vec<[f64; 2]>,
}

/// Why a file of rooms is rejected.
#[derive(Debug, thiserror::Error)]
pub enum RoomsError {
    /// The text is not TOML, has an unknown key, or has a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// The corners of a room do not enclose an area.
    #[error("room {name}: expected at least three corners with finite coordinates")]
    Corners {
        /// Name of the room.
        name: String,
    },
}

impl Rooms {
    /// Parses the text of a rooms file.
    ///
    /// # Errors
    /// [`RoomsError`] if the text is malformed or a room has no area.
    pub fn parse(text: &str) -> Result<Self, RoomsError> {
        let rooms: Self = toml_text::read(text)?;
        let is_area =
            |corners: &[[f64; 2]]| corners.len() >= 3 && corners.iter().flatten().all(|v| v.is_finite());
        match rooms.room.iter().find(|room| !is_area(&room.world) || !is_area(&room.sketch)) {
            Some(room) => Err(RoomsError::Corners { name: room.name.clone() }),
            None => Ok(rooms),
        }
    }

    /// Returns the room at a true position. If there are several, returns the first one in the file.
    pub fn of_world(&self, at: Point<World>) -> Option<&str> {
        self.find(|room| encloses(&room.world, [at.x, at.y]))
    }

    /// Returns the room at a position in the drawing, whose height is `height_px`.
    pub fn of_sketch(&self, at: Point<Sketch>, height_px: f64) -> Option<&str> {
        self.find(|room| encloses(&room.sketch, [at.x, height_px - at.y]))
    }

    fn find(&self, is_in: impl Fn(&Room) -> bool) -> Option<&str> {
        self.room.iter().find(|room| is_in(room)).map(|room| room.name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_is_found_in_both_frames() {
        let text = "[[room]]\nname = 'a'\nworld = [[0, 0], [2, 0], [2, 2], [0, 2]]\nsketch = [[0, 80], [20, 80], [20, 100], [0, 100]]\n";
        let rooms = Rooms::parse(text).unwrap();
        assert_eq!(rooms.of_world(Point::new(1.0, 1.0)), Some("a"));
        assert_eq!(rooms.of_world(Point::new(3.0, 1.0)), None);
        // Row 90 of an image of 100 rows is ten pixels above the bottom.
        assert_eq!(rooms.of_sketch(Point::new(10.0, 10.0), 100.0), Some("a"));
        assert_eq!(rooms.of_sketch(Point::new(10.0, 90.0), 100.0), None);
        assert!(Rooms::parse("[[room]]\nname = 'a'\nworld = [[0, 0]]\nsketch = []\n").is_err());
    }
}
