//! Finds the places that missions and people refer to in words: by name, or by the position of a room relative to others.
//!
//! The frame of reference is the sheet as drawn, so left, right, above and below are as one sees them, also in a learned map, whose
//! goals are given in the drawing. A text stands for its room if no other text is
//! in it, or else, like names in the mission, for the spot where it is.

use std::cell::OnceCell;

use sketchnav_schemas::geometry::Point;

use super::drawn_map::DrawnMap;
use super::error::SketchError;
use super::labels::Names;
use super::reference::{Reference, Relation, Side};
use crate::mission::SketchMission;
use crate::rooms::{DrawnRooms, Thing};
use sketchnav_schemas::codes::FREE;

/// Maximum number of rooms in an error.
const MOST_LISTED: usize = 6;

/// A place that words refer to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Located {
    /// Position, in image pixels.
    pub at: [f64; 2],
    /// The room that a relation refers to. `None` for a name.
    pub room: Option<Room>,
}

/// The room that a relation refers to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Room {
    /// The name of the room, if it has one.
    pub name: Option<String>,
    /// The relation and the room, in words.
    pub words: String,
}

/// The named places and the rooms of a drawing.
#[derive(Debug)]
pub(crate) struct Atlas<'a> {
    drawing: &'a DrawnMap,
    names: Names<'a>,
    rooms: OnceCell<DrawnRooms>,
}

impl<'a> Atlas<'a> {
    /// Creates the atlas of a mission's drawing.
    pub fn of(mission: &'a SketchMission, drawing: &'a DrawnMap) -> Self {
        Self { drawing, names: Names::of(mission, drawing), rooms: OnceCell::new() }
    }

    /// Like [`Atlas::of`], for a person who can also name a task.
    pub fn with_tasks(mission: &'a SketchMission, drawing: &'a DrawnMap) -> Self {
        Self { drawing, names: Names::with_tasks(mission, drawing), rooms: OnceCell::new() }
    }

    /// Finds the place that a text refers to. A name comes before a relation that reads the same.
    ///
    /// # Errors
    /// [`SketchError`] if there is no such place, or if there are several. `what` is the task, for the error.
    pub fn find(&self, what: &str, text: &str) -> Result<Located, SketchError> {
        if self.names.has(text) {
            return Ok(Located { at: self.names.find(what, text, false)?, room: None });
        }
        let reference = Reference::parse(text).map_err(|reason| SketchError::Relation {
            what: what.to_owned(),
            text: text.to_owned(),
            reason,
        })?;
        match &reference {
            Reference::Name(name) => Ok(Located { at: self.named(what, name, false)?, room: None }),
            Reference::Room(relation) => {
                let found = self.room(what, relation)?;
                let (at, name) = (self.goal(found), self.name(found).map(str::to_owned));
                let is = match &name {
                    Some(name) => format!("{name:?}"),
                    None => "the one".to_owned(),
                };
                let words = format!("{reference} is {is} at ({:.0}, {:.0})", at[0], at[1]);
                Ok(Located { at, room: Some(Room { name, words }) })
            }
        }
    }

    /// Returns the position of a named place. An article before the name is ignored unless it belongs to the name.
    fn named(&self, what: &str, name: &str, is_part: bool) -> Result<[f64; 2], SketchError> {
        let bare = name.get(..4).filter(|article| article.eq_ignore_ascii_case("the ")).map(|_| &name[4..]);
        let bare = bare
            .filter(|bare| !self.names.has(name) && (self.names.has(bare) || !Reference::may_be_meant(name)));
        self.names.find(what, bare.unwrap_or(name), is_part)
    }

    fn rooms(&self) -> &DrawnRooms {
        self.rooms.get_or_init(|| {
            let DrawnMap { width_px, height_px, cells, .. } = self.drawing;
            DrawnRooms::of(*width_px as usize, *height_px as usize, |cell| cells[cell] == FREE)
        })
    }

    fn room_at(&self, at: [f64; 2]) -> Option<usize> {
        let Point { x, y, .. } = self.drawing.from_image(at);
        self.rooms().room_at([x, y])
    }

    /// Returns the text or the mark that names a room, with its position.
    fn label(&self, room: usize) -> Option<(&'a str, [f64; 2])> {
        self.names.of_room(|at| self.room_at(at) == Some(room))
    }

    fn name(&self, room: usize) -> Option<&'a str> {
        self.label(room).map(|(name, _)| name)
    }

    /// Returns where to drive in a room: to its name, like every goal that is a name, or else to its middle.
    fn goal(&self, room: usize) -> [f64; 2] {
        let middle = || {
            let [x, y] = self.rooms().middle(room);
            self.drawing.to_image(&Point::new(x, y))
        };
        self.label(room).map_or_else(middle, |(_, at)| at)
    }

    /// Finds the room that a relation refers to.
    fn room(&self, what: &str, relation: &Relation) -> Result<usize, SketchError> {
        let found = match relation {
            Relation::Beside(side, of) => {
                let thing = self.thing(what, of)?;
                let found = self.rooms().beside(&thing, *side as usize);
                if found.is_empty() {
                    return Err(self.none(what, relation, self.around(&thing, of)));
                }
                found
            }
            Relation::Nearest(to) => self.rooms().nearest_to(&self.thing(what, to)?),
            Relation::Between(a, b) => {
                let [a, b] = [self.thing(what, a)?, self.thing(what, b)?];
                self.rooms().between(&a, &b)
            }
        };
        match found[..] {
            [room] => Ok(room),
            [] => Err(self.none(what, relation, self.listed(0..self.rooms().count()))),
            _ => Err(SketchError::SeveralRooms {
                what: what.to_owned(),
                relation: relation.to_string(),
                file: self.drawing.file.clone(),
                found: self.listed(found.into_iter()),
            }),
        }
    }

    /// Returns what a reference refers to: a room if it is one or its name, or else a spot.
    fn thing(&self, what: &str, reference: &Reference) -> Result<Thing, SketchError> {
        let at = match reference {
            Reference::Room(relation) => return Ok(self.rooms().room(self.room(what, relation)?)),
            Reference::Name(name) => self.named(what, name, true)?,
        };
        let room = self.room_at(at).filter(|room| self.label(*room).is_some_and(|(_, label)| label == at));
        let Point { x, y, .. } = self.drawing.from_image(at);
        let spot = || {
            self.rooms()
                .place([x, y])
                .ok_or_else(|| self.none(what, &Relation::Nearest(reference.clone()), String::new()))
        };
        room.map_or_else(spot, |room| Ok(self.rooms().room(room)))
    }

    fn none(&self, what: &str, relation: &Relation, others: String) -> SketchError {
        let others = if others.is_empty() { "no rooms at all".to_owned() } else { others };
        SketchError::NoRoom {
            what: what.to_owned(),
            relation: relation.to_string(),
            file: self.drawing.file.clone(),
            others,
        }
    }

    /// Lists the nearest room in each direction of something.
    fn around(&self, thing: &Thing, of: &Reference) -> String {
        let beside = Side::ALL.iter().map(|side| {
            let there = self.rooms().beside(thing, *side as usize);
            (!there.is_empty()).then(|| format!("{} {of} {}", side.words(), self.listed(there.into_iter())))
        });
        beside.flatten().collect::<Vec<_>>().join("; ")
    }

    /// Lists rooms by their names and positions.
    fn listed(&self, rooms: impl ExactSizeIterator<Item = usize>) -> String {
        let more = if rooms.len() > MOST_LISTED { " and others" } else { "" };
        let words = rooms.take(MOST_LISTED).map(|room| {
            let ([x, y], name) = (self.goal(room), self.name(room));
            let name = name.map_or_else(|| "a room".to_owned(), |name| format!("{name:?}"));
            format!("{name} at ({x:.0}, {y:.0})")
        });
        words.collect::<Vec<_>>().join(", ") + more
    }
}

#[cfg(test)]
mod tests;
