//! A floor as regions joined by doors. The outline of each region is a sequence of walls, doors and gaps.

use std::collections::BTreeMap;

use sketchnav_mapping::alignment::main_direction;
use sketchnav_mapping::outline::Place;
use sketchnav_mapping::region::Region;

use super::partition::Partition;
use super::tokens::{self, Border};

/// Area, in cells, below which a region is ignored.
const LEAST_CELLS: usize = 30;
/// Maximum number of holes of a region that are joined to its outline.
const MOST_HOLES: usize = 4;

/// The kind of a stretch of a region's outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A piece of wall.
    Wall,
    /// A passage to another region.
    Door {
        /// Index of the door.
        door: u16,
        /// The region on its other side.
        beyond: u16,
    },
    /// A gap beyond which nothing has been seen yet.
    Gap,
    /// A gap that is as narrow as a door.
    NarrowGap,
    /// A cut from a hole of the region to its outline, which joins the two.
    Cut,
}

/// A stretch of a region's outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Token {
    /// The kind of the stretch.
    pub kind: Kind,
    /// Middle of the stretch.
    pub place: Place,
    /// Direction from its first point to its last, as a unit vector.
    pub direction: [f64; 2],
}

/// A region of a floor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Room {
    /// Area, in square metres.
    pub area_m2: f64,
    /// The outline, counter-clockwise. Empty if the region is too small to have one.
    pub tokens: Vec<Token>,
}

/// A passage between two regions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Door {
    /// The two regions.
    pub rooms: [u16; 2],
    /// Middle of the passage.
    pub place: Place,
    /// Width as a share of the smaller clearance of the two regions. A share near 1 is hardly a door.
    pub share: f64,
    /// Width, in cells.
    pub width: f64,
}

/// Converts positions to the frame of a [`Floor`], which is rotated such that its walls are parallel to those of the drawing and
/// whose unit is a metre, as far as the scale of a drawing is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Length of a cell, in the unit of the drawing or the map.
    pub cell: f64,
    /// Lower left corner of the cells, in the drawing or the map.
    pub origin: Place,
    /// Length of the drawing's or the map's unit, in metres.
    pub unit_m: f64,
    /// Rotation of positions, in radians.
    pub turn_rad: f64,
}

impl Frame {
    /// Converts a place of the drawing or the map.
    pub fn of_place(self, place: Place) -> Place {
        turned(place.map(|part| part * self.unit_m), self.turn_rad)
    }

    /// Converts to a place of the drawing or the map.
    pub fn to_place(self, at: Place) -> Place {
        turned(at, -self.turn_rad).map(|part| part / self.unit_m)
    }

    /// Converts a place of the drawing or the map to cells.
    pub fn to_cells(self, place: Place) -> Place {
        [0, 1].map(|k| (place[k] - self.origin[k]) / self.cell)
    }

    pub fn of_cells(self, at: Place) -> Place {
        self.of_place([0, 1].map(|k| self.origin[k] + at[k] * self.cell))
    }
}

fn turned([x, y]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = angle_rad.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

/// The input for a floor.
#[derive(Debug, Clone, Copy)]
pub struct Ground<'a> {
    /// Cells where an outline is wall. If this is `None`, it is wall everywhere except at doors.
    pub walls: Option<&'a Region>,
    /// The robot's start, in cells.
    pub start: Place,
    /// Length of a piece of wall, in cells.
    pub piece: f64,
    /// Minimum area, in cells, of a hole that is joined to the outline of its region.
    pub least_hole: usize,
    /// Maximum length, in cells, of a narrow gap.
    pub narrow: f64,
}

/// A floor as regions joined by doors.
#[derive(Debug, Clone)]
pub struct Floor {
    /// The frame of all places.
    pub frame: Frame,
    /// The rooms by their number in the partition. The first entry is empty.
    pub rooms: Vec<Room>,
    /// The passages between regions.
    pub doors: Vec<Door>,
    /// The robot's start.
    pub start: Place,
    /// The region with the start.
    pub home: u16,
    /// The cells of the regions.
    partition: Partition,
}

impl Floor {
    /// Returns the floor of a partition, in cells, or `None` if the partition has no region.
    pub fn new(partition: Partition, ground: &Ground<'_>) -> Option<Self> {
        let home = partition.at(ground.start)?;
        let (doors, door_at) = doors(&partition);
        let start = partition.nearest_of(home, ground.start)?;
        let distances = partition.distances(start);
        let count = partition.regions.len();
        let mut rooms: Vec<Room> = vec![Room::default(); count];
        for label in 1..count as u16 {
            let area = partition.regions[label as usize].0;
            if area < LEAST_CELLS {
                continue;
            }
            let outline = outline(&partition, label, ground.least_hole, &distances);
            let (partition, outline) = (&partition, &outline);
            let border = Border { partition, outline, ground, label, doors: &doors, door_at: &door_at };
            rooms[label as usize] = Room { area_m2: area as f64, tokens: tokens::tokens(&border) };
        }
        let lacks: Vec<_> = rooms.iter().map(|room| room.tokens.is_empty()).collect();
        let beyond_walls = if ground.walls.is_some() { Kind::NarrowGap } else { Kind::Wall };
        for token in rooms.iter_mut().flat_map(|room| &mut room.tokens) {
            if matches!(token.kind, Kind::Door { beyond, .. } if lacks[beyond as usize]) {
                token.kind = beyond_walls;
            }
        }
        let frame = Frame { cell: 1.0, origin: [0.0; 2], unit_m: 1.0, turn_rad: 0.0 };
        (!lacks[home as usize]).then_some(Self { frame, rooms, doors, start: ground.start, home, partition })
    }

    /// Converts a floor that is in cells.
    #[must_use]
    pub fn in_frame(mut self, frame: Frame) -> Self {
        let cell_m = frame.cell * frame.unit_m;
        for room in &mut self.rooms {
            room.area_m2 *= cell_m * cell_m;
            for token in &mut room.tokens {
                token.place = frame.of_cells(token.place);
                token.direction = turned(token.direction, frame.turn_rad);
            }
        }
        self.doors.iter_mut().for_each(|door| door.place = frame.of_cells(door.place));
        self.start = frame.of_cells(self.start);
        Self { frame, ..self }
    }

    /// Returns the main direction of the walls, modulo a right angle, and the degree to which they agree with it.
    pub fn wall_direction(&self) -> Option<(f64, f64)> {
        let tokens = self.rooms.iter().flat_map(|room| &room.tokens);
        main_direction(tokens.filter(|token| token.kind == Kind::Wall).map(|token| token.direction))
    }

    /// Returns the room at a place of the drawing or the map, or the nearest one.
    pub fn room_at(&self, place: Place) -> Option<u16> {
        self.partition.at(self.frame.to_cells(place))
    }

    /// Returns the doors on the way from the start to a room, each with the room that it leads to, or `None` if there is no such
    /// way.
    pub fn way_to(&self, goal: u16) -> Option<Vec<(u16, u16)>> {
        let mut from: BTreeMap<u16, Option<(u16, u16)>> = BTreeMap::from([(self.home, None)]);
        let mut queue = vec![self.home];
        let mut next = 0;
        while let Some(&room) = queue.get(next) {
            next += 1;
            for token in &self.rooms[room as usize].tokens {
                if let Kind::Door { door, beyond } = token.kind
                    && !from.contains_key(&beyond)
                {
                    from.insert(beyond, Some((door, room)));
                    queue.push(beyond);
                }
            }
        }
        let mut way = Vec::new();
        let mut room = goal;
        while let Some((door, before)) = *from.get(&room)? {
            way.push((door, room));
            room = before;
        }
        way.reverse();
        Some(way)
    }
}

impl Partition {
    /// Returns the cell of a region that is nearest to a place, given in cells.
    fn nearest_of(&self, label: u16, [x, y]: Place) -> Option<usize> {
        let square = |cell: usize| {
            let at = [(cell % self.width) as f64 + 0.5, (cell / self.width) as f64 + 0.5];
            (at[0] - x).powi(2) + (at[1] - y).powi(2)
        };
        let own = (0..self.labels.len()).filter(|cell| self.labels[*cell] == label);
        own.min_by(|a, b| square(*a).total_cmp(&square(*b)))
    }
}

/// Returns the doors of a partition, and the cells on both sides of each, by index.
pub fn doors(partition: &Partition) -> (Vec<Door>, BTreeMap<usize, u16>) {
    let labels = &partition.labels;
    let mut pairs: BTreeMap<[u16; 2], Vec<usize>> = BTreeMap::new();
    for [a, b] in partition.contacts() {
        let mut pair = [labels[a], labels[b]];
        pair.sort_unstable();
        pairs.entry(pair).or_default().extend([a, b]);
    }
    let (mut doors, mut door_at) = (Vec::new(), BTreeMap::new());
    for (rooms, mut cells) in pairs {
        cells.sort_unstable();
        cells.dedup();
        while let Some(first) = cells.pop() {
            let door = connected(first, &mut cells, partition.width);
            let (mut sum, mut clearance) = ([0.0; 2], 0.0_f32);
            for &cell in &door {
                sum[0] += (cell % partition.width) as f64 + 0.5;
                sum[1] += (cell / partition.width) as f64 + 0.5;
                clearance = clearance.max(partition.clearance[cell]);
                door_at.insert(cell, doors.len() as u16);
            }
            let [a, b] = rooms.map(|room| partition.regions[room as usize].1);
            let share = f64::from(clearance / a.min(b).max(1e-6));
            doors.push(Door {
                rooms,
                place: sum.map(|part| part / door.len() as f64),
                share,
                width: 2.0 * f64::from(clearance),
            });
        }
    }
    (doors, door_at)
}

/// Removes and returns the cells connected to `first` by steps of at most two columns and two rows.
fn connected(first: usize, cells: &mut Vec<usize>, width: usize) -> Vec<usize> {
    let mut found = vec![first];
    let mut next = 0;
    while let Some(&cell) = found.get(next) {
        next += 1;
        let is_near = |other: &mut usize| {
            let near = |a: usize, b: usize| a.abs_diff(b) <= 2;
            near(cell % width, *other % width) && near(cell / width, *other / width)
        };
        found.extend(cells.extract_if(.., is_near));
    }
    found
}

/// The outline of a region, with the cells where holes were joined to it.
pub struct Outline {
    pub cells: Vec<[i64; 2]>,
    pub cuts: Region,
}

/// Returns the outline of a region. A region with large holes is cut open from each hole to its outer border, so that the outline
/// includes the holes.
fn outline(partition: &Partition, label: u16, least_hole: usize, distances: &[u32]) -> Outline {
    let (width, height) = (partition.width, partition.labels.len() / partition.width);
    let mut own = Region::of(width, height, |cell| partition.labels[cell] == label);
    own = largest_part(&own);
    let mut cuts = Region::empty(width, height);
    for _ in 0..MOST_HOLES {
        let Some(hole) = largest_hole(&own, least_hole) else { break };
        let path = cut(&own, &hole, distances);
        if path.is_empty() {
            break;
        }
        let mut removed = Region::empty(width, height);
        path.iter().for_each(|cell| removed.insert(*cell));
        own.subtract(&removed);
        removed.grow(1);
        removed.iter().for_each(|cell| cuts.insert(cell));
        own = largest_part(&own);
    }
    Outline { cells: own.border(), cuts }
}

/// Returns the largest part of a region that is connected by sides.
pub fn largest_part(region: &Region) -> Region {
    let (mut rest, mut part, mut largest) = (region.clone(), Region::default(), Region::default());
    let mut waiting = Vec::new();
    while let Some(seed) = rest.first() {
        rest.move_connected(seed, &mut part, &mut waiting);
        if part.count() > largest.count() {
            std::mem::swap(&mut largest, &mut part);
        }
    }
    largest
}

/// Returns the largest set of cells that the region encloses, if it has at least `least` cells.
fn largest_hole(region: &Region, least: usize) -> Option<Region> {
    let (width, height) = (region.width(), region.height());
    let mut rest = Region::of(width, height, |cell| !region.contains(cell));
    let (mut part, mut waiting) = (Region::default(), Vec::new());
    let (mut largest, mut size) = (None, least.max(1) - 1);
    while let Some(seed) = rest.first() {
        rest.move_connected(seed, &mut part, &mut waiting);
        let is_outside = part.places().any(|[x, y]| x == 0 || y == 0 || x + 1 == width || y + 1 == height);
        if !is_outside && part.count() > size {
            (size, largest) = (part.count(), Some(part.clone()));
        }
    }
    largest
}

/// Returns the cells on the shortest path through a region to any other border, from that cell beside the hole which is farthest
/// from the start.
fn cut(region: &Region, hole: &Region, distances: &[u32]) -> Vec<usize> {
    let (width, cells) = (region.width(), region.cells());
    let sides = |cell: usize| super::partition::sides(cell, width, cells);
    let touches_hole = |cell: usize| sides(cell).any(|next| hole.contains(next));
    let reached = |cell: &usize| distances[*cell] != u32::MAX;
    let beside = region.iter().filter(|cell| touches_hole(*cell)).filter(reached);
    let Some(first) = beside.max_by_key(|cell| distances[*cell]) else { return Vec::new() };
    let is_other = |cell: usize| sides(cell).any(|next| !region.contains(next) && !hole.contains(next));
    let mut from = BTreeMap::from([(first, first)]);
    let mut queue = std::collections::VecDeque::from([first]);
    while let Some(cell) = queue.pop_front() {
        if is_other(cell) {
            let back =
                std::iter::successors(Some(cell), |cell| from.get(cell).copied().filter(|b| b != cell));
            return back.collect();
        }
        for next in sides(cell).filter(|next| region.contains(*next)) {
            from.entry(next).or_insert_with(|| {
                queue.push_back(next);
                cell
            });
        }
    }
    Vec::new()
}
