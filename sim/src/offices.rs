//! Office floors: corridors or a hall, with rooms along them. [`Shape::plan`] generates the floor plan.
//!
//! A floor consists of rectangles, each surrounded by walls. Corridors come first. Rooms are then added along both sides of each
//! corridor wherever they fit, each with a door to it. The opening between two corridors that meet has their full width.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::floor_plan::{Door, FloorPlan, Furniture, Wall};
use sketchnav_schemas::seed;

const WALL_THICKNESS_M: f64 = 0.12;
/// Width of a corridor, in centimetres.
const CORRIDOR_CM: i32 = 240;
/// Minimum and maximum width of a room along its corridor, its depth, and the width of its door, in centimetres.
const ROOM_CM: [i32; 2] = [320, 560];
const DEPTH_CM: [i32; 2] = [400, 560];
const DOOR_CM: [i32; 2] = [90, 105];
/// Minimum distance from the middle of a door to the corners of its room, in centimetres.
const CORNER_CM: i32 = 90;
/// Radius of a column in a hall, and distance between columns, in metres.
const COLUMN_M: f64 = 0.3;
const BETWEEN_COLUMNS_M: f64 = 4.0;

/// The layout of a floor's corridors, as seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// One corridor turns a corner into another.
    L,
    /// One corridor ends at another.
    T,
    /// Four corridors surround a core of rooms.
    Ring,
    /// Two parallel corridors, joined in the middle by a third.
    Double,
    /// A hall with two rows of columns.
    Hall,
    /// One corridor branches into three dead ends.
    Comb,
}

impl Shape {
    /// All shapes. Two floors of each ship in `sim/missions/offices`, those with the numbers 1 and 2.
    pub const ALL: [Self; 6] = [Self::L, Self::T, Self::Ring, Self::Double, Self::Hall, Self::Comb];

    /// Returns the name, which is also that of the first shipped file.
    pub fn name(self) -> &'static str {
        match self {
            Self::L => "l",
            Self::T => "t",
            Self::Ring => "ring",
            Self::Double => "double",
            Self::Hall => "hall",
            Self::Comb => "comb",
        }
    }

    /// Returns the floor with the given shape and number. The number determines the sizes of its rooms and the positions of their
    /// doors.
    pub fn plan(self, number: u64) -> FloorPlan {
        let mut rng = seed::stream(number, &format!("offices/{}", self.name()));
        let corridors = self.corridors();
        let mut floor = Floor { areas: corridors.clone(), doors: Vec::new() };
        for (i, corridor) in corridors.iter().enumerate() {
            floor.doors.extend(corridors[..i].iter().filter_map(|other| corridor.opening(other)));
        }
        for corridor in &corridors {
            floor.add_rooms(corridor, &mut rng);
        }
        FloorPlan {
            name: format!("office floor, {}, {number}", self.name()),
            wall_thickness_m: WALL_THICKNESS_M,
            wall: floor.areas.iter().map(Area::wall).collect(),
            door: floor.doors,
            furniture: if self == Self::Hall { columns(&corridors[0]) } else { Vec::new() },
            person: Vec::new(),
            marker: Vec::new(),
        }
    }

    fn corridors(self) -> Vec<Area> {
        let along = |x: i32, y: i32, length: i32| Area { low: [x, y], high: [x + length, y + CORRIDOR_CM] };
        let up = |x: i32, y: i32, length: i32| Area { low: [x, y], high: [x + CORRIDOR_CM, y + length] };
        match self {
            Self::L => vec![along(0, 0, 2400), up(2400, -1800, 1800 + CORRIDOR_CM)],
            Self::T => vec![along(0, 0, 3000), up(1400, -1800, 1800)],
            Self::Ring => vec![
                along(0, 0, 2600),
                along(0, 1300, 2600),
                up(0, CORRIDOR_CM, 1300 - CORRIDOR_CM),
                up(2600 - CORRIDOR_CM, CORRIDOR_CM, 1300 - CORRIDOR_CM),
            ],
            Self::Double => {
                vec![along(0, 0, 3000), along(0, 1500, 3000), up(1400, CORRIDOR_CM, 1500 - CORRIDOR_CM)]
            }
            Self::Hall => vec![Area { low: [0, 0], high: [2400, 1000] }],
            Self::Comb => {
                vec![
                    along(0, 0, 3400),
                    up(400, CORRIDOR_CM, 1400),
                    up(1600, CORRIDOR_CM, 1400),
                    up(2800, CORRIDOR_CM, 1400),
                ]
            }
        }
    }
}

/// A rectangle, in centimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Area {
    low: [i32; 2],
    high: [i32; 2],
}

impl Area {
    fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] < other.high[axis] && other.low[axis] < self.high[axis])
    }

    fn wall(&self) -> Wall {
        let ([left, bottom], [right, top]) = (self.low.map(metres), self.high.map(metres));
        Wall { points: vec![[left, bottom], [right, bottom], [right, top], [left, top]], closed: true }
    }

    /// Returns an opening as wide as the edge that two areas share, or `None` if they do not share an edge.
    fn opening(&self, other: &Self) -> Option<Door> {
        (0..2).find_map(|axis| {
            let across = 1 - axis;
            let edge = [(self.low, other.high), (self.high, other.low)]
                .into_iter()
                .find_map(|(own, others)| (own[across] == others[across]).then_some(own[across]))?;
            let (from, to) = (self.low[axis].max(other.low[axis]), self.high[axis].min(other.high[axis]));
            (from < to).then(|| door(axis, (from + to) / 2, edge, to - from))
        })
    }

    /// Returns a room beside this corridor, which runs along `axis`. The room begins `from` centimetres along that axis.
    fn beside(&self, axis: usize, is_above: bool, from: i32, width: i32, depth: i32) -> Self {
        let across = 1 - axis;
        let mut room = *self;
        (room.low[axis], room.high[axis]) = (from, from + width);
        (room.low[across], room.high[across]) = if is_above {
            (self.high[across], self.high[across] + depth)
        } else {
            (self.low[across] - depth, self.low[across])
        };
        room
    }
}

fn metres(centimetres: i32) -> f64 {
    f64::from(centimetres) / 100.0
}

/// Returns a door in a wall that extends along an axis.
fn door(axis: usize, along: i32, across: i32, width: i32) -> Door {
    let at = if axis == 0 { [along, across] } else { [across, along] };
    Door { at: at.map(metres), width_m: metres(width) }
}

struct Floor {
    areas: Vec<Area>,
    doors: Vec<Door>,
}

impl Floor {
    /// Adds rooms along a corridor wherever they do not overlap with anything.
    fn add_rooms(&mut self, corridor: &Area, rng: &mut Pcg64Mcg) {
        // There are no rooms at the ends of a corridor. Its long sides are those along its longer axis.
        let length = |axis: usize| corridor.high[axis] - corridor.low[axis];
        let long = usize::from(length(1) > length(0));
        for is_above in [true, false] {
            let depth = decimetres(DEPTH_CM, rng);
            let mut from = corridor.low[long];
            loop {
                let width = decimetres(ROOM_CM, rng);
                let left = corridor.high[long] - from;
                if left < ROOM_CM[0] {
                    break;
                }
                // If the remaining space is too narrow for another room, this room is widened into it, up to the maximum width.
                let width = if left - width < ROOM_CM[0] { left.min(ROOM_CM[1]) } else { width };
                let room = corridor.beside(long, is_above, from, width, depth);
                if self.areas.iter().any(|area| area.overlaps(&room)) {
                    from += 20;
                    continue;
                }
                let across = if is_above { corridor.high[1 - long] } else { corridor.low[1 - long] };
                let at = from + rng.random_range(CORNER_CM..=width - CORNER_CM);
                self.doors.push(door(long, at, across, rng.random_range(DOOR_CM[0]..=DOOR_CM[1])));
                self.areas.push(room);
                from += width;
            }
        }
    }
}

fn decimetres([low, high]: [i32; 2], rng: &mut Pcg64Mcg) -> i32 {
    10 * rng.random_range(low / 10..=high / 10)
}

/// Returns two rows of columns in a hall.
fn columns(hall: &Area) -> Vec<Furniture> {
    let ([left, bottom], [right, top]) = (hall.low.map(metres), hall.high.map(metres));
    let count = ((right - left) / BETWEEN_COLUMNS_M) as usize;
    let column = |row: f64, i: usize| Furniture {
        name: "column".to_owned(),
        polygon: None,
        center: Some([left + (i as f64 + 0.5) * BETWEEN_COLUMNS_M, bottom + row * (top - bottom)]),
        size: None,
        yaw_deg: 0.0,
        radius_m: Some(COLUMN_M),
    };
    [0.25, 0.75].into_iter().flat_map(|row| (0..count).map(move |i| column(row, i))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_room_of_every_floor_is_reached() {
        for shape in Shape::ALL {
            for number in 1..10 {
                let plan = shape.plan(number);
                let rooms = plan.wall.len() - shape.corridors().len();
                assert!(rooms >= 10, "{shape:?} {number}: {rooms}");
                // Each room has a door, and each corridor but the first has one or two openings.
                assert!(plan.door.len() >= plan.wall.len() - 1, "{shape:?} {number}");
                crate::floor_plan::describe(&plan).unwrap();
            }
        }
    }

    #[test]
    fn rooms_do_not_overlap() {
        for shape in Shape::ALL {
            let mut rng = seed::stream(1, "rooms");
            let corridors = shape.corridors();
            let mut floor = Floor { areas: corridors.clone(), doors: Vec::new() };
            corridors.iter().for_each(|corridor| floor.add_rooms(corridor, &mut rng));
            for (i, a) in floor.areas.iter().enumerate() {
                assert!(floor.areas[..i].iter().all(|b| !a.overlaps(b)), "{shape:?}");
            }
        }
    }
}
