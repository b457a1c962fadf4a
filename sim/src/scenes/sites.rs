//! Scenes that are laid out first and then walked through: shops, parks, car parks, churches, markets and depots.
//!
//! The generator of yards, streets and halls creates a route and puts objects beside it. Here, in contrast, a site is furnished the
//! way such sites are, and the route is the shortest way on which a robot keeps its distance, with rounded corners. The route can
//! therefore pass the same objects twice, and it turns where the site demands it.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::{FRAC_PI_2, TAU};

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::seed;

use super::{
    At, BESIDE_GOAL_M, BESIDE_WAY_M, LEAST_OBJECTS, Object, PATHS_M, Scene, apart, boxed, distance,
    distance_to, middle,
};

/// Cell size of the grid on which ways are searched, in metres.
const CELL_M: f64 = 0.2;
/// Distance that the way keeps from objects before its corners are rounded, in metres.
const CLEAR_M: f64 = 1.2;
/// Length of the straight part at either end of the way, in metres.
const STRAIGHT_M: f64 = 1.2;
/// Distance from the end of the way to the goal, in metres.
const GAP_M: f64 = 1.3;
/// Distance between the points of the way, in metres.
const STEP_M: f64 = 0.1;
/// Number of times that each point of the way moves halfway to the middle of its neighbours, which rounds corners over a length of
/// about a metre.
const ROUNDINGS: usize = 50;
/// Distance from the way, in metres, beyond which objects are left out because nobody would draw them.
const DRAWN_M: f64 = 4.0;
/// Minimum sum of all turns of a way, in radians. A way straight to the goal needs no landmarks.
const LEAST_TURNS_RAD: f64 = 1.8;
/// Maximum turn of a way from one of its points to the next, in radians. A way that turns back on the spot exceeds it.
const SHARPEST_RAD: f64 = 0.16;
/// Number of corners with which round objects are approximated.
const ROUND: usize = 8;

/// Kinds of sites.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Site {
    /// Rows of shelves with a cross aisle, displays at their ends, and tills.
    Shop,
    /// Trees, bushes, benches and a pond.
    Park,
    /// Rows of cars with vacant bays, and lamps.
    CarPark,
    /// Blocks of pews between pillars, and a font.
    Church,
    /// Stalls around a fountain, and carts.
    Market,
    /// Containers and stacks of pallets.
    Depot,
}

/// A furnished site, and both ends of a way through it.
struct Layout {
    /// The goal, followed by all other objects.
    objects: Vec<Object>,
    /// Start of the way and heading of the robot there, in radians.
    start: (At, f64),
    /// End of the way and heading of the robot there, in radians.
    end: (At, f64),
}

impl Site {
    /// All kinds.
    pub const ALL: [Self; 6] =
        [Self::Shop, Self::Park, Self::CarPark, Self::Church, Self::Market, Self::Depot];

    /// Returns the word for this kind, as used in the names of scenes.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Shop => "shop",
            Self::Park => "park",
            Self::CarPark => "car-park",
            Self::Church => "church",
            Self::Market => "market",
            Self::Depot => "depot",
        }
    }

    /// Generates the scene with the given number.
    pub fn scene(self, number: u64) -> Scene {
        let mut rng = seed::stream(number, &format!("scenes/{}", self.word()));
        loop {
            let layout = match self {
                Self::Shop => shop(&mut rng),
                Self::Park => park(&mut rng),
                Self::CarPark => car_park(&mut rng),
                Self::Church => church(&mut rng),
                Self::Market => market(&mut rng),
                Self::Depot => depot(&mut rng),
            };
            if let Some(scene) = layout.walked() {
                return Scene { name: format!("{}-{number}", self.word()), ..scene };
            }
        }
    }
}

impl Layout {
    /// Creates a goal with this size across and along the way, and the pose in front of it at which the way ends.
    fn goal(name: &str, at: At, heading: f64, [across, along]: [f64; 2]) -> (Object, (At, f64)) {
        (boxed(name, at, [along, across], heading), (ahead(at, heading, -GAP_M - along / 2.0), heading))
    }

    /// Adds an object if it keeps its distance from the objects, the goal and both ends of the way.
    fn add(&mut self, object: Object, gap_m: f64) {
        let ends = [
            self.start.0,
            ahead(self.start.0, self.start.1, STRAIGHT_M),
            self.end.0,
            ahead(self.end.0, self.end.1, -STRAIGHT_M),
        ];
        let is_clear = ends.iter().all(|at| distance_to(&object.outline, *at) >= CLEAR_M);
        let is_apart = self.objects.iter().all(|other| apart(&other.outline, &object.outline) >= gap_m);
        if is_clear && is_apart && apart(&self.objects[0].outline, &object.outline) >= BESIDE_GOAL_M {
            self.objects.push(object);
        }
    }

    /// Returns the scene whose route is the way through this site, or `None` if there is no way of suitable length.
    fn walked(self) -> Option<Scene> {
        let from = ahead(self.start.0, self.start.1, STRAIGHT_M);
        let to = ahead(self.end.0, self.end.1, -STRAIGHT_M);
        let corners = [vec![self.start.0], self.search(from, to)?, vec![self.end.0]].concat();
        let way = rounded(&corners);
        let turns = || way.windows(3).map(|at| turn(at[0], at[1], at[2]).abs());
        let is_winding = turns().sum::<f64>() >= LEAST_TURNS_RAD && turns().all(|turn| turn <= SHARPEST_RAD);
        // Scenes begin at the origin along x.
        let (origin, heading) = self.start;
        let (sin, cos) = heading.sin_cos();
        let placed = |at: &At| {
            let [x, y] = [at[0] - origin[0], at[1] - origin[1]];
            [x * cos + y * sin, y * cos - x * sin]
        };
        let way: Vec<_> = way.iter().map(placed).collect();
        let clearance = |object: &Object| {
            way.iter().map(|at| distance_to(&object.outline, *at)).fold(f64::INFINITY, f64::min)
        };
        let objects: Vec<_> = self
            .objects
            .into_iter()
            .map(|object| Object { outline: object.outline.iter().map(placed).collect(), ..object })
            .filter(|object| clearance(object) < DRAWN_M)
            .collect();
        let holds = is_winding
            && objects.len() >= LEAST_OBJECTS
            && objects.iter().all(|object| clearance(object) >= BESIDE_WAY_M);
        let scene = Scene { name: String::new(), objects: numbered(objects), way, goal: 0 };
        (holds && PATHS_M.contains(&scene.path_m())).then_some(scene)
    }

    /// Returns the shortest way on the grid between two points that keeps [`CLEAR_M`] from all objects.
    fn search(&self, from: At, to: At) -> Option<Vec<At>> {
        const RIM_M: f64 = 3.0;
        const NEIGHBOURS: [[i32; 2]; 8] =
            [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [1, -1], [-1, 1], [-1, -1]];
        let points =
            || self.objects.iter().flat_map(|object| object.outline.iter().copied()).chain([from, to]);
        let low = [0, 1].map(|axis| points().map(|at| at[axis]).fold(f64::INFINITY, f64::min) - RIM_M);
        let high = [0, 1].map(|axis| points().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max) + RIM_M);
        let [columns, rows] = [0, 1].map(|axis| ((high[axis] - low[axis]) / CELL_M) as i32 + 1);
        let at =
            |[column, row]: [i32; 2]| [low[0] + f64::from(column) * CELL_M, low[1] + f64::from(row) * CELL_M];
        let cell = |at: At| [0, 1].map(|axis| ((at[axis] - low[axis]) / CELL_M).round() as i32);
        let index = |[column, row]: [i32; 2]| (row * columns + column) as usize;
        let is_free = |cell: [i32; 2]| {
            self.objects.iter().all(|object| distance_to(&object.outline, at(cell)) >= CLEAR_M)
        };
        let mut known: Vec<Option<(f64, [i32; 2])>> = vec![None; (columns * rows) as usize];
        let (start, goal) = (cell(from), cell(to));
        known[index(start)] = Some((0.0, start));
        let mut open = BinaryHeap::from([Step { length: 0.0, cell: start }]);
        while let Some(Step { length, cell }) = open.pop() {
            if cell == goal {
                break;
            }
            if known[index(cell)].is_some_and(|(shorter, _)| shorter < length) {
                continue;
            }
            for [dx, dy] in NEIGHBOURS {
                let next = [cell[0] + dx, cell[1] + dy];
                if next[0] < 0 || next[1] < 0 || next[0] >= columns || next[1] >= rows {
                    continue;
                }
                let length = length + f64::from(dx).hypot(f64::from(dy));
                if known[index(next)].is_none_or(|(longer, _)| length < longer) && is_free(next) {
                    known[index(next)] = Some((length, cell));
                    open.push(Step { length, cell: next });
                }
            }
        }
        let mut way = vec![goal];
        while way[way.len() - 1] != start {
            way.push(known[index(way[way.len() - 1])]?.1);
        }
        let mut way: Vec<_> = way.into_iter().rev().map(at).collect();
        (way[0], *way.last_mut()?) = (from, to);
        Some(self.pulled(&way))
    }

    /// Pulls a way taut: keeps its first point, and from there always the last point that can be reached in a straight line.
    fn pulled(&self, way: &[At]) -> Vec<At> {
        let is_clear = |from: At, to: At| {
            let steps = (distance(from, to) / CELL_M).ceil().max(1.0) as usize;
            (0..=steps).all(|i| {
                let part = i as f64 / steps as f64;
                let at = [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
                self.objects.iter().all(|object| distance_to(&object.outline, at) >= CLEAR_M - CELL_M / 4.0)
            })
        };
        let mut kept = vec![way[0]];
        let mut from = 0;
        while from + 1 < way.len() {
            from = (from + 1..way.len()).rev().find(|to| is_clear(way[from], way[*to])).unwrap_or(from + 1);
            kept.push(way[from]);
        }
        kept
    }
}

/// A cell of the search, with the length of the way to it, in cells. Orders by length, so that the shortest is the greatest.
#[derive(PartialEq)]
struct Step {
    length: f64,
    cell: [i32; 2],
}

impl Eq for Step {}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Step {
    fn cmp(&self, other: &Self) -> Ordering {
        other.length.total_cmp(&self.length).then_with(|| other.cell.cmp(&self.cell))
    }
}

/// Returns the point at a distance from another.
fn ahead(at: At, heading: f64, distance_m: f64) -> At {
    [at[0] + distance_m * heading.cos(), at[1] + distance_m * heading.sin()]
}

fn turn_of(from: At, to: At) -> f64 {
    (to[1] - from[1]).atan2(to[0] - from[0])
}

/// Returns the turn of a way at its middle point, in radians.
fn turn(before: At, at: At, after: At) -> f64 {
    (turn_of(at, after) - turn_of(before, at)).sin().asin()
}

/// Returns the points of a way between these corners, which are rounded. Its first and last points stay in place.
fn rounded(corners: &[At]) -> Vec<At> {
    let mut points = vec![corners[0]];
    for pair in corners.windows(2) {
        let steps = (distance(pair[0], pair[1]) / STEP_M).ceil().max(1.0) as usize;
        points.extend((1..=steps).map(|i| {
            let part = i as f64 / steps as f64;
            [0, 1].map(|axis| pair[0][axis] + part * (pair[1][axis] - pair[0][axis]))
        }));
    }
    for _ in 0..ROUNDINGS {
        let before = points.clone();
        for (i, at) in points.iter_mut().enumerate().skip(1).take(before.len() - 2) {
            *at = middle(&[before[i - 1], before[i], before[i], before[i + 1]]);
        }
    }
    points
}

/// Adds numbers to names, because labels have to distinguish the objects.
fn numbered(mut objects: Vec<Object>) -> Vec<Object> {
    let mut counts = BTreeMap::<String, usize>::new();
    for object in objects.iter_mut().skip(1) {
        let count = counts.entry(object.name.clone()).or_default();
        *count += 1;
        object.name = format!("{} {count}", object.name);
    }
    objects
}

fn round(name: &str, at: At, radius_m: f64) -> Object {
    let corner = |i: usize| ahead(at, TAU * (i as f64 + 0.5) / ROUND as f64, radius_m);
    Object { name: name.into(), outline: (0..ROUND).map(corner).collect() }
}

/// Returns a random angle, at most this far from 0, in radians.
fn askew(rng: &mut Pcg64Mcg, most_rad: f64) -> f64 {
    rng.random_range(-most_rad..most_rad)
}

fn chance(rng: &mut Pcg64Mcg, share: f64) -> bool {
    rng.random_range(0.0..1.0) < share
}

/// Rows of shelves run along y, and the tills are south of them.
fn shop(rng: &mut Pcg64Mcg) -> Layout {
    const DEEP_M: f64 = 0.9;
    let pitch = DEEP_M + rng.random_range(2.5..3.1);
    let rows = rng.random_range(3..=4);
    let lengths = [rng.random_range(3.0..5.0), rng.random_range(3.0..5.0)];
    let cross = rng.random_range(2.6..3.2);
    let north = lengths[0] + cross + lengths[1];
    let counter = ["bakery", "cheese", "fish"][rng.random_range(0..3)];
    let across = rng.random_range(-0.5..f64::from(rows) - 0.5);
    let (goal, end) = Layout::goal(counter, [across * pitch, north + 4.2], FRAC_PI_2, [2.4, 1.0]);
    let entrance = [rng.random_range(-1.0..f64::from(rows)) * pitch, -5.5];
    let mut layout = Layout { objects: vec![goal], start: (entrance, FRAC_PI_2), end };
    for row in 0..rows {
        let x = f64::from(row) * pitch;
        for (length, y) in [(lengths[0], 0.0), (lengths[1], lengths[0] + cross)] {
            let length: f64 = length + rng.random_range(-0.5..0.2);
            layout.add(boxed("shelf", [x, y + length / 2.0], [DEEP_M, length], 0.0), 0.8);
        }
        if chance(rng, 0.5) {
            let y = [-1.2, north + 1.1][rng.random_range(0..2)];
            layout.add(boxed("display", [x, y], [0.8, 0.8], askew(rng, 0.3)), 0.5);
        }
        layout.add(boxed("till", [x + pitch / 2.0, -3.2], [0.7, 1.8], 0.0), 0.8);
    }
    layout
}

fn park(rng: &mut Pcg64Mcg) -> Layout {
    let size = [rng.random_range(16.0..22.0), rng.random_range(12.0..18.0)];
    let heading = askew(rng, 0.6);
    let kiosk = [size[0] + 1.5, rng.random_range(0.3..0.7) * size[1]];
    let (goal, end) = Layout::goal("kiosk", kiosk, heading, [2.0, 1.6]);
    let gate = [0.0, rng.random_range(0.0..1.0) * size[1]];
    let mut layout = Layout { objects: vec![goal], start: (gate, askew(rng, 0.8)), end };
    let pond = [rng.random_range(0.35..0.65) * size[0], rng.random_range(0.35..0.65) * size[1]];
    layout.add(round("pond", pond, rng.random_range(2.0..3.2)), 0.9);
    for _ in 0..60 {
        let at = [rng.random_range(0.0..1.0) * size[0], rng.random_range(0.0..1.0) * size[1]];
        let object = match rng.random_range(0..4) {
            0 => boxed("bench", at, [1.7, 0.6], askew(rng, 1.5)),
            1 => round("bush", at, rng.random_range(0.6..1.3)),
            _ => round("tree", at, rng.random_range(0.25..0.5)),
        };
        layout.add(object, 1.9);
    }
    layout
}

/// Cars are parked along y, in rows along x.
fn car_park(rng: &mut Pcg64Mcg) -> Layout {
    const CAR_M: [f64; 2] = [1.8, 4.3];
    let bay = rng.random_range(2.7..3.0);
    let lane = rng.random_range(4.6..5.6);
    let bays = rng.random_range(6..=8);
    let width = f64::from(bays) * bay;
    let rows = 3;
    let north = f64::from(rows) * (CAR_M[1] + lane) - lane;
    let machine = [rng.random_range(0.2..0.8) * width, north + 3.6];
    let (goal, end) = Layout::goal("ticket machine", machine, FRAC_PI_2, [0.9, 0.7]);
    let entrance = [rng.random_range(0.0..1.0) * width, -4.5];
    let mut layout = Layout { objects: vec![goal], start: (entrance, FRAC_PI_2), end };
    for row in 0..rows {
        let y = f64::from(row) * (CAR_M[1] + lane) + CAR_M[1] / 2.0;
        for column in 0..bays {
            if chance(rng, 0.68) {
                let at = [(f64::from(column) + 0.5) * bay + askew(rng, 0.15), y + askew(rng, 0.3)];
                layout.add(boxed("car", at, CAR_M, askew(rng, 0.05)), 0.6);
            }
        }
        for at in [-1.0, width + 1.0] {
            layout.add(round("lamp", [at, y], 0.2), 0.6);
        }
    }
    layout
}

/// The nave runs along y, with the altar in the north and the door in the west or the south.
fn church(rng: &mut Pcg64Mcg) -> Layout {
    let aisle = rng.random_range(2.7..3.1);
    let pews = [rng.random_range(2.8..3.6), rng.random_range(3.2..4.6)];
    let cross = rng.random_range(2.6..3.2);
    let north = 2.0 * pews[1] + cross;
    let side = aisle / 2.0 + pews[0] + rng.random_range(2.6..3.0);
    let hand = super::side(rng);
    let (altar, heading) = if chance(rng, 0.5) {
        ([0.0, north + 4.8], FRAC_PI_2)
    } else {
        ([hand * (side + 3.4), north - 1.0], if hand > 0.0 { 0.0 } else { std::f64::consts::PI })
    };
    let (goal, end) = Layout::goal("altar", altar, heading, [2.2, 1.0]);
    let door = [-hand * (side + 0.3), -5.0];
    let mut layout = Layout { objects: vec![goal], start: (door, FRAC_PI_2), end };
    layout.add(round("font", [hand * rng.random_range(0.0..1.0), -2.8], 0.5), 0.9);
    for hand in [-1.0, 1.0] {
        let x = hand * (aisle + pews[0]) / 2.0;
        for y in [0.0, pews[1] + cross] {
            let deep: f64 = pews[1] + rng.random_range(-0.6..0.0);
            layout.add(boxed("pews", [x, y + deep / 2.0], [pews[0], deep], 0.0), 0.9);
        }
        for i in 0..4 {
            layout.add(round("pillar", [hand * side, f64::from(i) * north / 3.0], 0.35), 0.9);
        }
        layout.add(
            boxed("candles", [hand * (side + 2.6), rng.random_range(0.2..0.7) * north], [0.5, 1.2], 0.0),
            0.9,
        );
    }
    layout.add(boxed("lectern", [hand * 1.9, north + 2.0], [0.6, 0.6], askew(rng, 0.5)), 0.9);
    layout
}

fn market(rng: &mut Pcg64Mcg) -> Layout {
    let size = [rng.random_range(14.0..19.0), rng.random_range(14.0..19.0)];
    let heading = askew(rng, 0.4);
    let (goal, end) =
        Layout::goal("bakery", [size[0] + 2.5, rng.random_range(0.2..0.8) * size[1]], heading, [2.8, 1.6]);
    let corner = [-2.0, rng.random_range(0.0..1.0) * size[1]];
    let mut layout = Layout { objects: vec![goal], start: (corner, askew(rng, 0.3)), end };
    layout.add(round("fountain", size.map(|side| side / 2.0), rng.random_range(1.2..1.8)), 2.4);
    let pitch = rng.random_range(4.6..5.2);
    let columns = (size[0] / pitch) as i32;
    let rows = (size[1] / pitch) as i32;
    for column in 0..=columns {
        // Stalls of neighbouring columns are staggered, so that there is no straight way through.
        let stagger = if column % 2 == 0 { 0.0 } else { pitch / 2.0 };
        for row in 0..=rows {
            let at = [
                f64::from(column) * pitch + askew(rng, 0.3),
                f64::from(row) * pitch + stagger + askew(rng, 0.3),
            ];
            if chance(rng, 0.85) {
                let wide = [rng.random_range(1.2..1.8), rng.random_range(1.8..2.6)];
                layout.add(boxed("stall", at, wide, askew(rng, 0.15)), 1.4);
            } else {
                layout.add(boxed("cart", at, [1.0, 0.7], askew(rng, 1.5)), 1.4);
            }
        }
    }
    layout
}

fn depot(rng: &mut Pcg64Mcg) -> Layout {
    const CONTAINER_M: [f64; 2] = [6.0, 2.4];
    let lane = rng.random_range(3.0..3.8);
    let ramp = [rng.random_range(8.0..20.0), 3.0 * (CONTAINER_M[1] + lane) + 3.5];
    let (goal, end) = Layout::goal("ramp", ramp, FRAC_PI_2, [3.0, 1.2]);
    let gate = [rng.random_range(0.0..12.0), -4.5];
    let mut layout = Layout { objects: vec![goal], start: (gate, FRAC_PI_2), end };
    for row in 0..3 {
        let y = f64::from(row) * (CONTAINER_M[1] + lane) + CONTAINER_M[1] / 2.0;
        let mut x = rng.random_range(-4.0..0.0);
        while x < 22.0 {
            let at = [x + CONTAINER_M[0] / 2.0, y + askew(rng, 0.2)];
            if chance(rng, 0.7) {
                layout.add(boxed("container", at, CONTAINER_M, askew(rng, 0.04)), 0.8);
                x += CONTAINER_M[0] + rng.random_range(2.7..3.6);
            } else {
                let at = [x + 0.8, at[1]];
                layout.add(boxed("pallets", at, [1.3, rng.random_range(1.2..2.4)], askew(rng, 0.2)), 0.8);
                x += 1.3 + rng.random_range(2.7..3.4);
            }
        }
    }
    layout
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{files, floor::Floor, floor_plan};
    use sketchnav_schemas::geometry::Pose;

    /// The scenes for which results are reported have the numbers 1 and 2, so this test does not look at them.
    #[test]
    fn every_kind_of_place_has_a_way_to_its_goal_that_a_robot_can_drive() {
        let robot = files::robot("nomad200").unwrap();
        for (site, number) in Site::ALL.into_iter().flat_map(|site| [(site, 101), (site, 102)]) {
            let scene = site.scene(number);
            let world = floor_plan::parse(&toml::to_string(&scene.plan()).unwrap()).unwrap();
            Floor::new(world, &robot, Pose::new(0.0, 0.0, 0.0), 1).unwrap();
            let end = scene.way[scene.way.len() - 1];
            let before = scene.way[scene.way.len() - 5];
            let goal = &scene.objects[scene.goal].outline;
            assert!((distance_to(goal, end) - GAP_M).abs() < 0.05, "{}", scene.name);
            assert!(turn(before, end, middle(goal)).abs() < 0.2, "{} ends in front of its goal", scene.name);
            assert_eq!((scene.way[0], scene.way[5][1].abs() < 0.05), ([0.0, 0.0], true), "{}", scene.name);
            assert!(scene.objects.len() >= LEAST_OBJECTS && PATHS_M.contains(&scene.path_m()));
            assert_eq!(scene, site.scene(number));
        }
    }

    #[test]
    fn a_way_around_a_corner_is_round_and_keeps_its_ends() {
        let way = rounded(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]);
        assert_eq!((way[0], way[way.len() - 1]), ([0.0, 0.0], [2.0, 2.0]));
        let sharpest = way.windows(3).map(|at| turn(at[0], at[1], at[2]).abs()).fold(0.0, f64::max);
        assert!(sharpest < 0.2, "{sharpest}");
        let nearest = way.iter().map(|at| distance(*at, [2.0, 0.0])).fold(f64::INFINITY, f64::min);
        assert!((0.1..0.5).contains(&nearest), "{nearest}");
    }
}
