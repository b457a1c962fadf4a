//! Which room is which: a file that gives, for each room, its place on the true floor and in the drawing.
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

/// The parsed file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rooms {
    room: Vec<Room>,
}

/// A room.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Room {
    name: String,
    world: Vec<[f64; 2]>,
    sketch: Vec<[f64; 2]>,
}

/// What is wrong with the file.
#[derive(Debug, thiserror::Error)]
pub enum RoomsError {
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A room whose corners do not enclose an area.
    #[error("room {name}: expected at least three corners with finite coordinates")]
    Corners {
        /// The room.
        name: String,
    },
}

impl Rooms {
    /// Parses the file's text.
    ///
    /// # Errors
    /// [`RoomsError`].
    pub fn parse(text: &str) -> Result<Self, RoomsError> {
        let rooms: Self = toml::from_str(text)?;
        let is_area =
            |corners: &[[f64; 2]]| corners.len() >= 3 && corners.iter().flatten().all(|v| v.is_finite());
        match rooms.room.iter().find(|room| !is_area(&room.world) || !is_area(&room.sketch)) {
            Some(room) => Err(RoomsError::Corners { name: room.name.clone() }),
            None => Ok(rooms),
        }
    }

    /// The room that a true place lies in; the first in the file if there are several.
    pub fn of_world(&self, at: Point<World>) -> Option<&str> {
        self.find(|room| encloses(&room.world, [at.x, at.y]))
    }

    /// The room that a place in the drawing lies in. `height_px`: the height of the drawing.
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
