//! The errors that people make when they remember doors and rooms: a door moves along its wall, or a room is left out.

use nalgebra::Vector2;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::floor::Floor;
use crate::regions::Regions;

/// Maximum distance that a door moves at degree 1, as a share of the wall next to it.
const DOOR_SHIFT: f64 = 0.6;
/// Minimum length of the wall that remains next to a door, in metres.
const STUB_M: f64 = 0.3;
/// Maximum distance, in metres, between the end of a wall and the side of a door for the wall to end at that door.
const JAMB_M: f64 = 0.45;
/// Maximum sine of the angle between a door and its wall.
const STRAIGHT: f64 = 0.3;
/// Maximum width of the opening of a room that may be forgotten, in metres.
const DOOR_M: f64 = 1.6;
/// Probability at degree 1 that a room that may be forgotten is forgotten.
const FORGET: f64 = 0.05;
/// Maximum share of the floor that may be forgotten.
const FORGETTABLE: f64 = 0.15;
/// Distances from the line of a wall at which the rooms on its sides are looked up, in metres.
const BESIDE_M: [f64; 4] = [0.12, 0.2, 0.3, 0.4];
const STEP_M: f64 = 0.1;

/// The line of a wall, and which of its ends are at doors.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wall {
    pub points: Vec<Vector2<f64>>,
    pub jambs: [bool; 2],
}

/// An end of a wall: the index of the wall, and 0 for its first point or 1 for its last.
pub(crate) type WallEnd = (usize, usize);

/// The walls as a person remembers them.
pub(crate) struct Memory {
    pub walls: Vec<Wall>,
    /// For each door between ends of walls, these two ends.
    pub doors: Vec<[WallEnd; 2]>,
    /// Indices of the regions that were left out.
    pub forgotten: Vec<usize>,
}

impl Wall {
    fn end(&self, end: usize) -> Vector2<f64> {
        if end == 0 { self.points[0] } else { self.points[self.points.len() - 1] }
    }

    /// Returns the direction of the last piece of the wall at the given end.
    fn direction(&self, end: usize) -> Vector2<f64> {
        let last = self.points.len() - 1;
        let piece = if end == 0 {
            self.points[1] - self.points[0]
        } else {
            self.points[last] - self.points[last - 1]
        };
        piece / piece.norm().max(1e-9)
    }

    /// Returns the length of the line, in metres.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}

/// Remembers a floor, with errors in proportion to `degree`.
pub(crate) fn remember(floor: &Floor, degree: f64, rng: &mut Pcg64Mcg) -> Memory {
    let wall = |points: &Vec<Vector2<f64>>| Wall { points: points.clone(), jambs: [false; 2] };
    let mut walls: Vec<Wall> = floor.walls.iter().map(wall).collect();
    let doors = floor.doorways().iter().map(|door| door_ends(&walls, door.jambs.map(|p| p.coords())));
    let doors: Vec<Option<[WallEnd; 2]>> = doors.collect();
    for (door, ends) in floor.doorways().iter().zip(&doors) {
        let Some(ends) = ends else { continue };
        ends.iter().for_each(|&(wall, end)| walls[wall].jambs[end] = true);
        let draw = rng.random_range(-1.0..1.0) * degree.min(1.5) * DOOR_SHIFT;
        if is_in_line(&walls, *ends) {
            shift_door(&mut walls, &floor.regions, *ends, door.regions, draw);
        }
    }
    let is_door = |ends: &Option<[WallEnd; 2]>| ends.is_some_and(|ends| is_in_line(&walls, ends));
    let in_line: Vec<bool> = doors.iter().map(is_door).collect();
    let forgotten = forget(floor, &in_line, degree, rng);
    let left_out = |k: &usize| floor.doorways()[*k].regions.iter().any(|r| forgotten.contains(r));
    let side = |(wall, end): WallEnd| walls[wall].end(end);
    let (lost, kept): (Vec<usize>, Vec<usize>) = (0..doors.len()).partition(left_out);
    let gap =
        |k: usize| doors[k].map_or(floor.doorways()[k].jambs.map(|p| p.coords()), |ends| ends.map(side));
    let closed: Vec<[Vector2<f64>; 2]> = lost.into_iter().map(gap).collect();
    let doors = kept.into_iter().filter_map(|k| doors[k]).collect();
    let mut memory = Memory { walls, doors, forgotten };
    memory.close(floor, closed);
    memory
}

/// Returns the ends of walls at the two sides of an opening, or `None` if the opening is not a gap between two ends of walls.
fn door_ends(walls: &[Wall], jambs: [Vector2<f64>; 2]) -> Option<[WallEnd; 2]> {
    let nearest = |jamb: Vector2<f64>| {
        let ends = (0..walls.len()).flat_map(|wall| [(wall, 0), (wall, 1)]);
        let far = |&(wall, end): &WallEnd| (walls[wall].end(end) - jamb).norm();
        ends.min_by(|a, b| far(a).total_cmp(&far(b))).filter(|end| far(end) < JAMB_M)
    };
    let ends = [nearest(jambs[0])?, nearest(jambs[1])?];
    (ends[0] != ends[1]).then_some(ends)
}

/// Returns true if an opening is a gap in a straight wall, which makes it a door.
fn is_in_line(walls: &[Wall], ends: [WallEnd; 2]) -> bool {
    let [a, b] = ends.map(|(wall, end)| walls[wall].end(end));
    let across = |(wall, end): WallEnd| walls[wall].direction(end).perp(&(b - a)).abs();
    ends.into_iter().all(|end| across(end) < STRAIGHT * (b - a).norm())
}

/// Moves both sides of a door along its wall, by a share (from −1 to 1) of the available length.
fn shift_door(walls: &mut [Wall], regions: &Regions, ends: [WallEnd; 2], rooms: [usize; 2], share: f64) {
    let [shorter, longer] = if share < 0.0 { ends } else { [ends[1], ends[0]] };
    let free_m = stretch_between(&walls[shorter.0], shorter.1, regions, rooms) - STUB_M;
    let by_m = share.abs() * free_m;
    if by_m < STEP_M {
        return;
    }
    let from = walls[shorter.0].end(shorter.1);
    shorten(&mut walls[shorter.0].points, shorter.1, by_m);
    let moved = walls[shorter.0].end(shorter.1) - from;
    let points = &mut walls[longer.0].points;
    let last = if longer.1 == 0 { 0 } else { points.len() - 1 };
    points[last] += moved;
}

/// Returns the length, from an end of a wall, along which the wall separates the two rooms.
fn stretch_between(wall: &Wall, end: usize, regions: &Regions, rooms: [usize; 2]) -> f64 {
    let mut steps = samples(&wall.points);
    if end == 1 {
        steps.reverse();
    }
    let between = |(at, along): &(Vector2<f64>, Vector2<f64>)| {
        let sides = sides(regions, *at, *along);
        sides == [Some(rooms[0]), Some(rooms[1])] || sides == [Some(rooms[1]), Some(rooms[0])]
    };
    // The outermost step is next to the door itself.
    let count = steps.iter().skip(2).take_while(|step| between(step)).count();
    (count as f64 * STEP_M).min(wall.length() - STEP_M)
}

/// Returns points along a line, one step apart, each with the direction of the line there.
fn samples(points: &[Vector2<f64>]) -> Vec<(Vector2<f64>, Vector2<f64>)> {
    let piece = |pair: &[Vector2<f64>]| {
        let (from, way) = (pair[0], pair[1] - pair[0]);
        let count = (way.norm() / STEP_M).ceil().max(1.0) as usize;
        let along = way / way.norm().max(1e-9);
        (0..count).map(move |i| (from + way * ((i as f64 + 0.5) / count as f64), along))
    };
    points.windows(2).flat_map(piece).collect()
}

/// Returns the regions to the left and to the right of a wall.
fn sides(regions: &Regions, at: Vector2<f64>, along: Vector2<f64>) -> [Option<usize>; 2] {
    let left = Vector2::new(-along.y, along.x);
    [left, -left].map(|side| BESIDE_M.into_iter().find_map(|far| regions.at(at + side * far)))
}

/// Shortens a line at one end. At least a tenth of its last piece remains.
pub(crate) fn shorten(points: &mut Vec<Vector2<f64>>, end: usize, by: f64) {
    if end == 0 {
        points.reverse();
    }
    let mut left = by;
    while let [.., a, b] = points[..] {
        let length = (b - a).norm();
        if length > left || points.len() == 2 {
            let last = points.len() - 1;
            points[last] = b + (a - b) * (left / length.max(1e-9)).min(0.9);
            break;
        }
        left -= length;
        points.pop();
    }
    if end == 0 {
        points.reverse();
    }
}

/// Chooses the rooms to forget, at random among the small rooms that have a single neighbour and whose only openings are doors. If
/// the walls have no ends (as with the outline of something massive), every narrow opening counts as a door.
fn forget(floor: &Floor, in_line: &[bool], degree: f64, rng: &mut Pcg64Mcg) -> Vec<usize> {
    let massive = !in_line.contains(&true);
    let is_door = |k: usize| {
        let [a, b] = floor.doorways()[k].jambs;
        a.distance(&b) < DOOR_M && (massive || in_line[k])
    };
    let behind_doors = |room: usize| {
        let own = (0..in_line.len()).filter(|&k| floor.doorways()[k].regions.contains(&room));
        own.into_iter().all(is_door)
    };
    let total: f64 = floor.regions().iter().map(|region| region.area_m2).sum();
    let neighbours = |room: usize| {
        let doors = floor.doorways().iter().filter(move |door| door.regions.contains(&room));
        let mut beside: Vec<usize> = doors.map(move |d| d.regions[0] + d.regions[1] - room).collect();
        beside.sort_unstable();
        beside.dedup();
        beside.len()
    };
    let may = |room: &usize| {
        neighbours(*room) == 1 && behind_doors(*room) && floor.regions()[*room].area_m2 < FORGETTABLE * total
    };
    let by_chance = |_: &usize| rng.random_bool((FORGET * degree).min(1.0));
    (0..floor.regions().len()).filter(may).filter(by_chance).collect()
}

impl Memory {
    /// Removes the walls that only surround forgotten rooms, and turns the doors to them into walls.
    fn close(&mut self, floor: &Floor, closed: Vec<[Vector2<f64>; 2]>) {
        if self.forgotten.is_empty() {
            return;
        }
        let mut whole = Vec::new();
        for i in 0..self.walls.len() {
            let pieces = seen(&self.walls[i], &floor.regions, &self.forgotten);
            whole.push(pieces == [self.walls[i].clone()]);
            self.walls[i].points.clear();
            let mut pieces = pieces.into_iter();
            if let Some(first) = pieces.next() {
                self.walls[i] = first;
            }
            self.walls.extend(pieces);
        }
        self.doors.retain(|ends| ends.iter().all(|&(wall, _)| whole[wall]));
        let door = |gap: [Vector2<f64>; 2]| Wall { points: gap.to_vec(), jambs: [false; 2] };
        self.walls.extend(closed.into_iter().map(door));
    }
}

/// Returns the pieces of a wall that border on a remembered region, or on no region at all.
fn seen(wall: &Wall, regions: &Regions, forgotten: &[usize]) -> Vec<Wall> {
    let kept = |(at, along): &(Vector2<f64>, Vector2<f64>)| {
        let sides = sides(regions, *at, *along);
        let lost = |side: &Option<usize>| side.is_some_and(|room| forgotten.contains(&room));
        !sides.iter().any(lost) || sides.iter().any(|side| side.is_some() && !lost(side))
    };
    let steps = samples(&wall.points);
    if steps.iter().all(kept) {
        return vec![wall.clone()];
    }
    let half = STEP_M / 2.0;
    let mut pieces = Vec::new();
    for run in steps.chunk_by(|a, b| kept(a) == kept(b)).filter(|run| kept(&run[0]) && run.len() > 2) {
        let (first, last) = (run[0], run[run.len() - 1]);
        let mut points = vec![first.0 - first.1 * half];
        points.extend(run.windows(2).filter(|pair| pair[0].1 != pair[1].1).map(|pair| pair[1].0));
        points.push(last.0 + last.1 * half);
        pieces.push(Wall { points, jambs: [false; 2] });
    }
    pieces
}
