//! The rooms of a drawing, and where they lie relative to each other as one sees them on the sheet.
//!
//! A room is free space that is closed by walls except for doors, which are the narrow passages of [`Partition`]. Corridors and
//! halls are rooms as well. What is open to the edge of the sheet is outside.
//!
//! Directions are those of the histogram of gravitational forces between two rooms (Matsakis and Wendling 1999), which weighs near
//! parts more: a room that shares the whole left wall of another is left of it, however far it extends upwards.

use sketchnav_mapping::outline::{Place, distance};
use sketchnav_mapping::region::Region;
use sketchnav_qualitative::Point;
use sketchnav_qualitative::hof::{Grade, Pair, Polygon, View};

use super::floor::{Frame, largest_part};
use super::partition::{Dividing, NONE, Partition};
use super::{
    DOOR_M, FRAME, LEAST_ROOM_M2, LEAST_SHARES, MOST_CELLS, RATIO, cells_per_m, complement, fill_holes,
};

/// Number of directions in which a room can lie from another: right, above right, above and so on, counter-clockwise.
pub const DIRECTIONS: usize = 8;
/// Number of directions of a histogram.
const HISTOGRAM: usize = 72;
/// Exponents of the forces: gravitational, and constant if the gravitational ones are infinite because two things touch.
const EXPONENTS: [f64; 2] = [2.0, 0.0];
/// Half the side of the square that stands for a place that is not a room, in metres.
const PLACE_M: f64 = 0.3;

/// The rooms of a drawing. Rooms have numbers from 0, and places are in pixels of the drawing, y up.
#[derive(Debug)]
pub struct DrawnRooms {
    frame: Frame,
    partition: Partition,
    cells_per_m: f64,
    rooms: Vec<DrawnRoom>,
}

/// A room of a drawing.
#[derive(Debug)]
struct DrawnRoom {
    label: u16,
    /// The outline, in cells.
    outline: Polygon,
    /// The cell that is farthest from all walls.
    middle: usize,
}

/// A room, or a place in one or outside all of them, in relation to which a room may lie.
#[derive(Debug, Clone)]
pub struct Thing {
    /// The room, or the one that contains the place.
    pub room: Option<usize>,
    outline: Polygon,
    middle: Place,
}

impl DrawnRooms {
    /// Finds the rooms of a drawing of `width` by `height` pixels, of which those with `is_free` are free.
    pub fn of(width: usize, height: usize, is_free: impl Fn(usize) -> bool) -> Self {
        let times = width.max(height).div_ceil(MOST_CELLS).clamp(1, 64);
        let mut coarse = Region::default();
        Region::of(width, height, is_free).coarsen(times, &mut coarse);
        let cell = times as f64;
        let frame = Frame { cell, origin: [-(FRAME as f64) * cell; 2], unit_m: 1.0, turn_rad: 0.0 };
        let mut free = on_paper(&coarse);
        let sheet = free.count() as f64;
        fill_holes(&mut free, |hole| (hole.count() as f64) < LEAST_SHARES[1] * sheet);
        let solid = complement(&free);
        let none = Region::empty(free.width(), free.height());
        let divided = |least_area: f64| {
            let dividing = Dividing { ratio: RATIO, widest: f32::INFINITY, least_area: least_area as usize };
            Partition::new(&free, &solid, &none, &dividing).without_outside()
        };
        let first = divided(LEAST_SHARES[0] * sheet);
        let area = first.regions.iter().map(|(cells, _)| *cells as f64).sum::<f64>();
        let per_m = cells_per_m(&first, area);
        let partition = divided((LEAST_SHARES[0] * area).max(LEAST_ROOM_M2[0] * per_m * per_m));
        let rooms = (1..partition.regions.len() as u16).filter_map(|label| partition.drawn_room(label));
        Self { frame, rooms: rooms.collect(), partition, cells_per_m: per_m }
    }

    /// Returns the number of rooms.
    pub fn count(&self) -> usize {
        self.rooms.len()
    }

    /// Returns the room that contains a place.
    pub fn room_at(&self, place: Place) -> Option<usize> {
        let [x, y] = self.frame.to_cells(place).map(f64::floor);
        let (width, height) = (self.partition.width, self.partition.labels.len() / self.partition.width);
        let is_inside = (0.0..width as f64).contains(&x) && (0.0..height as f64).contains(&y);
        let label = is_inside.then(|| self.partition.labels[y as usize * width + x as usize])?;
        self.rooms.iter().position(|room| room.label == label)
    }

    /// Returns the place in a room that is farthest from all walls.
    pub fn middle(&self, room: usize) -> Place {
        self.frame.to_place(self.frame.of_cells(self.partition.centre(self.rooms[room].middle)))
    }

    /// Returns a room as something to which others relate.
    pub fn room(&self, room: usize) -> Thing {
        let DrawnRoom { outline, middle, .. } = &self.rooms[room];
        Thing { room: Some(room), outline: outline.clone(), middle: self.partition.centre(*middle) }
    }

    /// Returns a place as something to which rooms relate, or `None` if it is too far away to compute with.
    pub fn place(&self, place: Place) -> Option<Thing> {
        let at = self.frame.to_cells(place);
        let half = (PLACE_M * self.cells_per_m).max(1.0);
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let outline = polygon(corners.map(|[x, y]| [at[0] + x, at[1] + y]))?;
        Some(Thing { room: self.room_at(place), outline, middle: at })
    }

    /// Returns the direction of a room as seen from something, as one of [`DIRECTIONS`], or `None` if no single direction describes
    /// it.
    pub fn direction(&self, room: usize, from: &Thing) -> Option<usize> {
        direction(&self.rooms[room].outline, &from.outline)
    }

    /// Returns the direction of something as seen from a room.
    fn direction_of(&self, thing: &Thing, from: usize) -> Option<usize> {
        direction(&thing.outline, &self.rooms[from].outline)
    }

    /// Returns the rooms in a direction, as far as no other room in this direction is nearer by more than the width of a door.
    pub fn beside(&self, thing: &Thing, direction: usize) -> Vec<usize> {
        let there = self.others([thing]).filter(|room| self.direction(*room, thing) == Some(direction));
        self.nearest(there.map(|room| (room, gap(&self.rooms[room].outline, &thing.outline))).collect())
    }

    /// Returns the rooms from which two things lie in opposite directions, give or take one of [`DIRECTIONS`].
    pub fn between(&self, a: &Thing, b: &Thing) -> Vec<usize> {
        let is_between = |room: &usize| {
            let directions = self.direction_of(a, *room).zip(self.direction_of(b, *room));
            let apart = directions.map(|(a, b)| a.abs_diff(b));
            apart.is_some_and(|apart| apart.min(DIRECTIONS - apart) + 1 >= DIRECTIONS / 2)
        };
        self.others([a, b]).filter(is_between).collect()
    }

    /// Returns the rooms whose middle is the nearest to that of something, on a path through doors. There are several if their
    /// distances differ by less than the width of a door.
    pub fn nearest_to(&self, thing: &Thing) -> Vec<usize> {
        let Some(start) = self.partition.nearest_labelled(thing.middle) else { return Vec::new() };
        let distances = self.partition.distances(start);
        let far = |room: usize| Some(distances[self.rooms[room].middle]).filter(|far| *far != u32::MAX);
        self.nearest(self.others([thing]).filter_map(|room| Some((room, f64::from(far(room)?)))).collect())
    }

    fn others<const N: usize>(&self, things: [&Thing; N]) -> impl Iterator<Item = usize> {
        let own = things.map(|thing| thing.room);
        (0..self.rooms.len()).filter(move |room| !own.contains(&Some(*room)))
    }

    fn nearest(&self, mut rooms: Vec<(usize, f64)>) -> Vec<usize> {
        let least = rooms.iter().map(|(_, far)| *far).fold(f64::INFINITY, f64::min);
        rooms.retain(|(_, far)| *far < least + DOOR_M * self.cells_per_m);
        rooms.into_iter().map(|(room, _)| room).collect()
    }
}

impl Partition {
    /// Removes the region around the sheet.
    fn without_outside(mut self) -> Self {
        let outside = self.labels.first().copied().unwrap_or(NONE);
        if outside != NONE {
            self.labels.iter_mut().filter(|label| **label == outside).for_each(|label| *label = NONE);
            self.regions[outside as usize] = (0, 0.0);
        }
        self
    }

    fn drawn_room(&self, label: u16) -> Option<DrawnRoom> {
        let height = self.labels.len() / self.width;
        let own = Region::of(self.width, height, |cell| self.labels[cell] == label);
        // The middle is the cell nearest to the centroid, which may lie in a wall or outside, where the room is at least half as
        // wide as anywhere.
        let widest = own.iter().map(|cell| self.clearance[cell]).fold(0.0, f32::max);
        let count = own.iter().count() as f64;
        let sum = own
            .iter()
            .map(|cell| self.centre(cell))
            .fold([0.0; 2], |sum, at| [sum[0] + at[0], sum[1] + at[1]]);
        let off = |cell: &usize| distance(self.centre(*cell), sum.map(|sum| sum / count));
        let wide = own.iter().filter(|cell| self.clearance[*cell] >= widest / 2.0);
        let middle = wide.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let border = largest_part(&own).border();
        let corners = corners(&border).map(|[x, y]| [x as f64 + 0.5, y as f64 + 0.5]);
        Some(DrawnRoom { label, outline: polygon(corners)?, middle })
    }

    fn centre(&self, cell: usize) -> Place {
        [(cell % self.width) as f64 + 0.5, (cell / self.width) as f64 + 0.5]
    }

    /// Returns the cell of any region that is nearest to a place, given in cells.
    fn nearest_labelled(&self, place: Place) -> Option<usize> {
        let labelled = (0..self.labels.len()).filter(|cell| self.labels[*cell] != NONE);
        let far = |cell: &usize| distance(self.centre(*cell), place);
        labelled.min_by(|a, b| far(a).total_cmp(&far(b)))
    }
}

/// Returns free cells with a frame of free cells around them.
fn on_paper(coarse: &Region) -> Region {
    let (width, height) = (coarse.width() + 2 * FRAME, coarse.height() + 2 * FRAME);
    Region::of(width, height, |cell| {
        let at = [cell % width, cell / width].map(|part| part as i64 - FRAME as i64);
        coarse.index(at).is_none_or(|cell| coarse.contains(cell))
    })
}

/// Returns the points of a closed line at which it turns.
fn corners(border: &[[i64; 2]]) -> impl Iterator<Item = [i64; 2]> {
    let count = border.len();
    (0..count).filter_map(move |i| {
        let [before, at, next] = [border[(i + count - 1) % count], border[i], border[(i + 1) % count]];
        let [[ax, ay], [bx, by]] =
            [[at, before], [next, at]].map(|[to, from]| [to[0] - from[0], to[1] - from[1]]);
        (ax != bx || ay != by).then_some(at)
    })
}

fn polygon(corners: impl IntoIterator<Item = Place>) -> Option<Polygon> {
    let points: Option<Vec<_>> = corners.into_iter().map(|[x, y]| Point::new(x, y).ok()).collect();
    Polygon::new(points?).ok()
}

/// Returns the direction of one outline as seen from another, or `None` if no single direction describes it.
fn direction(argument: &Polygon, referent: &Polygon) -> Option<usize> {
    let pair = Pair::new(argument, referent);
    let assess = |exponent: f64| {
        let histogram = pair.histogram(exponent, HISTOGRAM).ok()?;
        View::new(&histogram, 0.0).assess(DIRECTIONS)
    };
    let found = EXPONENTS.into_iter().find_map(assess)?;
    (found.grade() > Grade::Unsatisfactory).then_some(found.direction)
}

/// Returns the least distance between the corners of one outline and the edges of another, in cells.
fn gap(a: &Polygon, b: &Polygon) -> f64 {
    let one_way = |from: &Polygon, to: &Polygon| {
        let far = |at: &Point| to.edges().map(|edge| off(at, edge)).fold(f64::INFINITY, f64::min);
        from.corners().iter().map(far).fold(f64::INFINITY, f64::min)
    };
    one_way(a, b).min(one_way(b, a))
}

/// Returns the distance of a point from a segment.
fn off(at: &Point, [from, to]: [Point; 2]) -> f64 {
    let [x, y] = [to.x() - from.x(), to.y() - from.y()];
    let [px, py] = [at.x() - from.x(), at.y() - from.y()];
    let along = ((px * x + py * y) / (x * x + y * y)).clamp(0.0, 1.0);
    (px - along * x).hypot(py - along * y)
}
