//! Scenes of objects for routes past landmarks: the two scenes of Chronis 2007, 5.1, and randomly generated ones.
//!
//! The figures of Chronis 2007 are lost. Scene A is reconstructed from the relations of figure 4.29, and scene B from its six
//! commands. Both are in the pixels of the PDA, which are 5 inches each. A random scene is determined by a [`Kind`] and a number:
//! yards, streets of blocks with crossings, halls of pillars and machines. The scenes of [`sites`] are generated in another way.
//! Nobody looked at the scenes for which results are reported before robots had driven in them. The walls are beyond the range of
//! sonars.

pub mod sites;

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::floor_plan::{FloorPlan, Furniture, Marker, Wall};
use sketchnav_schemas::geometry::encloses;
use sketchnav_schemas::mission::{Place, Start};
use sketchnav_schemas::seed;

use self::sites::Site;

/// Size of a pixel of the PDA, in metres.
const PIXEL_M: f64 = 0.127;
/// Distance of the walls from the route, in metres, which is beyond the range of sonars, 255 inches.
const WALLS_M: f64 = 7.5;
/// Half the side length of the open area, in metres.
const OPEN_M: f64 = 70.0;
/// Maximum distance from its goal at which the robot stops, in metres: the sum of 30 inches measured by the sensors, the robot's
/// radius, and a margin.
const THERE_M: f64 = 1.15;
/// Minimum distance of an object from the route and from other objects, in metres. A robot can pass with room to spare.
const BESIDE_WAY_M: f64 = 0.9;
const BETWEEN_M: f64 = 0.9;
/// Minimum distance between the goal and another object, in metres.
const BESIDE_GOAL_M: f64 = 0.8;
/// Minimum length of a face with a marker, in metres.
const LEAST_FACE_M: f64 = 0.2;
/// Minimum number of objects in a scene.
const LEAST_OBJECTS: usize = 7;
/// Range of the lengths of routes, in metres.
const PATHS_M: std::ops::Range<f64> = 8.0..60.0;

/// A position, in metres.
pub type At = [f64; 2];

/// An object with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Name of the object, as people call it.
    pub name: String,
    /// Corners of the object, which form a convex polygon.
    pub outline: Vec<At>,
}

/// A scene: objects, and a route past them.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the scene, such as `a`, `b` or `yard-3`.
    pub name: String,
    /// Objects of the scene.
    pub objects: Vec<Object>,
    /// The intended route. It begins at the origin along x, and its points are some centimetres apart.
    pub way: Vec<At>,
    /// Index of the object at the end of the route.
    pub goal: usize,
}

/// Kinds of randomly generated scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Sheds, cars, trees and bins along a winding route.
    Yard,
    /// Blocks in rows. The route turns at crossings.
    Streets,
    /// Pillars on a grid, with machines between some of them.
    Hall,
}

impl Kind {
    /// Returns the word for this kind, as used in the names of scenes.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Yard => "yard",
            Self::Streets => "streets",
            Self::Hall => "hall",
        }
    }
}

fn boxed(name: &str, [x, y]: At, [width, height]: [f64; 2], yaw_rad: f64) -> Object {
    let (sin, cos) = yaw_rad.sin_cos();
    let [w, h] = [width / 2.0, height / 2.0];
    let corner = |[dx, dy]: At| [x + dx * cos - dy * sin, y + dx * sin + dy * cos];
    Object { name: name.into(), outline: [[-w, -h], [w, -h], [w, h], [-w, h]].map(corner).to_vec() }
}

/// Builds a route from pieces, and returns its points and the heading at its end. Each piece is a distance straight ahead, followed
/// by an arc, which is given by its angle in radians, positive to the left, and its radius.
fn way(pieces: &[(f64, f64, f64)]) -> (Vec<At>, f64) {
    const STEP_M: f64 = 0.1;
    let (mut at, mut heading) = ([0.0, 0.0], 0.0_f64);
    let mut points = vec![at];
    let mut go = |length: f64, turn: f64| {
        let steps = (length / STEP_M).ceil().max(1.0);
        for _ in 0..steps as usize {
            heading += turn / steps / 2.0;
            let chord = length / steps;
            at = [at[0] + chord * heading.cos(), at[1] + chord * heading.sin()];
            heading += turn / steps / 2.0;
            points.push(at);
        }
    };
    for (straight, turn, radius) in pieces {
        go(*straight, 0.0);
        if *turn != 0.0 {
            go(radius * turn.abs(), *turn);
        }
    }
    (points, heading)
}

/// Returns the distance between two points.
pub fn distance(a: At, b: At) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn to_segment(at: At, from: At, to: At) -> f64 {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let length = dx * dx + dy * dy;
    let part = if length > 0.0 { ((at[0] - from[0]) * dx + (at[1] - from[1]) * dy) / length } else { 0.0 };
    let part = part.clamp(0.0, 1.0);
    distance(at, [from[0] + part * dx, from[1] + part * dy])
}

/// Returns the distance from a point to an outline, which is 0 inside.
pub fn distance_to(outline: &[At], at: At) -> f64 {
    if encloses(outline, at) {
        return 0.0;
    }
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    edges.map(|(a, b)| to_segment(at, *a, *b)).fold(f64::INFINITY, f64::min)
}

/// Returns the distance between two outlines, measured from corners to edges, or 0 if one contains a corner of the other.
pub fn apart(one: &[At], other: &[At]) -> f64 {
    let corners =
        one.iter().map(|at| distance_to(other, *at)).chain(other.iter().map(|at| distance_to(one, *at)));
    corners.fold(f64::INFINITY, f64::min)
}

fn of_pixels(name: &str, objects: &[(&str, [f64; 4])], pieces: &[(f64, f64, f64)]) -> Scene {
    let objects: Vec<_> = objects
        .iter()
        .map(|(name, [x, y, width, height])| {
            boxed(name, [x * PIXEL_M, y * PIXEL_M], [width * PIXEL_M, height * PIXEL_M], 0.0)
        })
        .collect();
    let pieces: Vec<_> = pieces
        .iter()
        .map(|(straight, side, radius)| (straight * PIXEL_M, side * FRAC_PI_2, radius * PIXEL_M))
        .collect();
    let goal = objects.iter().position(|object| object.name == "desk").unwrap_or(0);
    Scene { name: name.into(), objects, way: way(&pieces).0, goal }
}

impl Scene {
    /// Scene A with eight commands: forward, left, forward, right, forward, right, forward, stop (Chronis 2007, 5.1).
    pub fn a() -> Self {
        let objects = [
            ("chair", [-9.0, 0.0, 6.0, 6.0]),
            ("files", [32.0, -12.0, 8.0, 8.0]),
            ("table", [86.0, 22.0, 18.0, 14.0]),
            ("crate", [30.0, 19.0, 8.0, 8.0]),
            ("trash", [42.0, 66.0, 10.0, 12.0]),
            ("boxes", [72.0, 98.0, 10.0, 8.0]),
            ("cabinet", [112.0, 80.0, 12.0, 10.0]),
            ("desk", [120.0, -2.0, 18.0, 10.0]),
        ];
        let pieces = [(20.0, 1.0, 28.0), (8.0, -1.0, 28.0), (16.0, -1.0, 28.0), (26.0, 0.0, 0.0)];
        of_pixels("a", &objects, &pieces)
    }

    /// Scene B with six commands: forward, left, forward, right, forward, stop (Chronis 2007, 5.1).
    pub fn b() -> Self {
        let objects = [
            ("chair", [-9.0, 0.0, 6.0, 6.0]),
            ("cabinet", [62.0, -4.0, 12.0, 14.0]),
            ("table", [24.0, 26.0, 16.0, 12.0]),
            ("boxes", [82.0, 34.0, 12.0, 12.0]),
            ("trash", [48.0, 63.0, 10.0, 8.0]),
            ("files", [92.0, 82.0, 12.0, 8.0]),
            ("desk", [115.0, 62.0, 10.0, 18.0]),
        ];
        let pieces = [(26.0, 1.0, 28.0), (6.0, -1.0, 28.0), (22.0, 0.0, 0.0)];
        of_pixels("b", &objects, &pieces)
    }

    /// Returns A and B, followed by ten random scenes: four yards, three streets and three halls. Results are
    /// reported for numbers from 1, whereas parameters are chosen with other numbers.
    pub fn twelve(first: u64) -> Vec<Self> {
        [Self::a(), Self::b()].into_iter().chain(Self::ten(first)).collect()
    }

    /// Returns ten random scenes, numbered from `first`: four yards, three streets and three halls.
    pub fn ten(first: u64) -> impl Iterator<Item = Self> {
        let kinds = [(Kind::Yard, 4), (Kind::Streets, 3), (Kind::Hall, 3)];
        kinds
            .into_iter()
            .flat_map(move |(kind, count)| (first..first + count).map(move |i| Self::laid_out(kind, i)))
    }

    /// Returns twelve scenes of other kinds, two of each [`Site`], numbered from `first`. As in [`Self::twelve`], results are
    /// reported for numbers from 1.
    pub fn sites(first: u64) -> impl Iterator<Item = Self> {
        Site::ALL.into_iter().flat_map(move |site| (first..first + 2).map(move |number| site.scene(number)))
    }

    /// Returns the floor plan of a large empty area, for scenes that do not come from a file.
    pub fn open() -> FloorPlan {
        let points = vec![[-OPEN_M, -OPEN_M], [OPEN_M, -OPEN_M], [OPEN_M, OPEN_M], [-OPEN_M, OPEN_M]];
        FloorPlan {
            name: "a wide place".into(),
            wall_thickness_m: 0.1,
            wall: vec![Wall { points, closed: true }],
            door: Vec::new(),
            furniture: Vec::new(),
            person: Vec::new(),
            marker: Vec::new(),
        }
    }

    /// Generates the scene of a kind and a number.
    pub fn laid_out(kind: Kind, number: u64) -> Self {
        let mut rng = seed::stream(number, &format!("scenes/{}", kind.word()));
        loop {
            let found = match kind {
                Kind::Yard => Some(yard(&mut rng)),
                Kind::Streets => streets(&mut rng),
                Kind::Hall => hall(&mut rng),
            };
            if let Some(scene) = found.filter(Self::holds) {
                return Self { name: format!("{}-{number}", kind.word()), ..scene };
            }
        }
    }

    /// Returns true if the scene is usable: there are enough objects, the route is clear, of suitable length and never near itself,
    /// and the goal is apart from everything else.
    fn holds(&self) -> bool {
        if self.objects.len() < LEAST_OBJECTS || !PATHS_M.contains(&self.path_m()) {
            return false;
        }
        let goal = &self.objects[self.goal].outline;
        let is_free = |object: &Object| self.clearance(&object.outline) >= BESIDE_WAY_M;
        // In a street, blocks are next to the goal.
        let is_apart = |object: &Object| apart(goal, &object.outline) >= BESIDE_GOAL_M;
        let mut others = self.objects.iter().enumerate().filter(|(i, _)| *i != self.goal);
        let points: Vec<_> = self.way.iter().step_by(5).collect();
        let comes_back = points
            .iter()
            .enumerate()
            .any(|(i, a)| points.iter().skip(i + 14).any(|b| distance(**a, **b) < 4.5));
        self.objects.iter().all(is_free) && others.all(|(_, object)| is_apart(object)) && !comes_back
    }

    /// Returns the distance between an outline and the route.
    fn clearance(&self, outline: &[At]) -> f64 {
        self.way.iter().map(|at| distance_to(outline, *at)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the file name of the scene.
    pub fn file_name(&self) -> String {
        format!("{}.floor.toml", self.name)
    }

    /// Returns a marker for the middle of each face of at least 0.2 m. Its number is 100 · object + face, with both counted
    /// from 1.
    pub fn markers(&self) -> Vec<Marker> {
        let of = |(i, object): (usize, &Object)| {
            let corners = object.outline.clone();
            let centre = middle(&corners);
            let faces = (0..corners.len()).filter_map(move |face| {
                let [from, to] = [corners[face], corners[(face + 1) % corners.len()]];
                let at = middle(&[from, to]);
                let along = [to[0] - from[0], to[1] - from[1]];
                // The normal must point away from the middle, whichever way around the corners run.
                let outward = [along[1], -along[0]];
                let is_away = outward[0] * (at[0] - centre[0]) + outward[1] * (at[1] - centre[1]) > 0.0;
                let [x, y] = if is_away { outward } else { outward.map(|length| -length) };
                let id = (100 * (i + 1) + face + 1) as u32;
                (distance(from, to) >= LEAST_FACE_M).then(|| Marker {
                    id,
                    at,
                    facing_deg: y.atan2(x).to_degrees(),
                })
            });
            faces.collect::<Vec<_>>()
        };
        self.objects.iter().enumerate().flat_map(of).collect()
    }

    /// Returns the numbers of the markers on each object, by name of the object.
    pub fn marker_numbers(&self) -> impl Iterator<Item = (&str, Vec<u32>)> {
        let markers = self.markers();
        self.objects.iter().enumerate().map(move |(i, object)| {
            let is_on = |marker: &&Marker| marker.id / 100 == i as u32 + 1;
            (object.name.as_str(), markers.iter().filter(is_on).map(|marker| marker.id).collect())
        })
    }

    /// Returns the floor plan of the scene.
    pub fn plan(&self) -> FloorPlan {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        let mut hold = |at: &At, rim: f64| {
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis] - rim);
                high[axis] = high[axis].max(at[axis] + rim);
            }
        };
        self.way.iter().for_each(|at| hold(at, WALLS_M));
        self.objects.iter().flat_map(|object| &object.outline).for_each(|at| hold(at, 1.0));
        let [x0, y0, x1, y1] = [low[0].floor(), low[1].floor(), high[0].ceil(), high[1].ceil()];
        let furniture = |object: &Object| Furniture {
            name: object.name.clone(),
            polygon: Some(
                object.outline.iter().map(|at| at.map(|x| (x * 1000.0).round() / 1000.0)).collect(),
            ),
            center: None,
            size: None,
            yaw_deg: 0.0,
            radius_m: None,
        };
        FloorPlan {
            name: format!("landmarks {}", self.name),
            wall_thickness_m: 0.1,
            wall: vec![Wall { points: vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]], closed: true }],
            door: Vec::new(),
            furniture: self.objects.iter().map(furniture).collect(),
            person: Vec::new(),
            marker: Vec::new(),
        }
    }

    /// Returns the start of the robot.
    pub fn start(&self) -> Start {
        Start { world: self.way[0], world_heading_deg: 0.0 }
    }

    /// Returns the area around the goal where the robot has arrived.
    pub fn there(&self) -> Place {
        let outline = &self.objects[self.goal].outline;
        let middle = middle(outline);
        // Each corner is moved outwards along both of its edges, by the distance to be added to each side.
        let count = outline.len();
        let corner = |i: usize| {
            let [before, at, after] =
                [outline[(i + count - 1) % count], outline[i], outline[(i + 1) % count]];
            let unit = |from: At, to: At| {
                let length = distance(from, to).max(1e-9);
                [(to[0] - from[0]) / length, (to[1] - from[1]) / length]
            };
            let [u, v] = [unit(before, at), unit(after, at)];
            [0, 1].map(|axis| ((at[axis] + THERE_M * (u[axis] + v[axis])) * 1000.0).round() / 1000.0)
        };
        let center = Some(middle.map(|x| (x * 1000.0).round() / 1000.0));
        Place { polygon: Some((0..count).map(corner).collect()), center, radius_m: None }
    }

    /// Returns the length of the route, in metres.
    pub fn path_m(&self) -> f64 {
        self.way.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
    }

    /// Adds an object and returns true if there is room for it.
    fn add(&mut self, object: Object) -> bool {
        let has_room = self.clearance(&object.outline) >= BESIDE_WAY_M
            && self.objects.iter().all(|other| apart(&other.outline, &object.outline) >= BETWEEN_M)
            && self.objects.get(self.goal).is_none_or(|goal| apart(&goal.outline, &object.outline) >= 2.2);
        if has_room {
            self.objects.push(object);
        }
        has_room
    }
}

/// Returns the mean of an outline's corners.
pub fn middle(outline: &[At]) -> At {
    [0, 1].map(|axis| outline.iter().map(|at| at[axis]).sum::<f64>() / outline.len() as f64)
}

fn side(rng: &mut Pcg64Mcg) -> f64 {
    if rng.random::<bool>() { 1.0 } else { -1.0 }
}

/// Creates the goal, with the given size across and along, straight ahead of the end of the route.
fn ahead(name: &str, way: &[At], heading: f64, [across, along]: [f64; 2], gap_m: f64) -> Object {
    let end = way[way.len() - 1];
    let beyond = gap_m + along / 2.0;
    let at = [end[0] + beyond * heading.cos(), end[1] + beyond * heading.sin()];
    boxed(name, at, [along, across], heading)
}

fn yard(rng: &mut Pcg64Mcg) -> Scene {
    const NAMES: [&str; 8] = ["shed", "car", "tree", "bin", "bench", "pallet", "trailer", "fountain"];
    let turns = rng.random_range(2..=3);
    let mut pieces = Vec::new();
    let mut last = side(rng);
    for _ in 0..turns {
        let turn = rng.random_range(60.0..115.0_f64).to_radians();
        pieces.push((rng.random_range(2.2..4.5), last * turn, rng.random_range(2.6..3.8)));
        last = if rng.random_range(0.0..1.0) < 0.7 { -last } else { last };
    }
    pieces.push((rng.random_range(2.5..4.5), 0.0, 0.0));
    let (way, heading) = way(&pieces);
    let size = [rng.random_range(1.4..2.4), rng.random_range(0.8..1.5)];
    let goal = ahead("gate", &way, heading, size, 1.3);
    let mut scene = Scene { name: String::new(), objects: vec![goal], way, goal: 0 };
    scene.add(boxed("door", [-1.4, 0.0], [0.6, 1.2], 0.0));
    let mut number = 0;
    let mut along = rng.random_range(10..20);
    while along < scene.way.len() {
        let at = scene.way[along];
        let next = scene.way[(along + 1).min(scene.way.len() - 1)];
        let before = scene.way[along - 1];
        let heading = (next[1] - before[1]).atan2(next[0] - before[0]);
        for side in [side(rng), side(rng)] {
            let size: [f64; 2] = [rng.random_range(0.6..2.2), rng.random_range(0.6..1.6)];
            let across = side * (rng.random_range(1.0..2.0) + size[1].max(size[0]) / 2.0);
            let at = [at[0] - across * heading.sin(), at[1] + across * heading.cos()];
            let turned = heading + rng.random_range(-0.3..0.3);
            let name = NAMES[number % NAMES.len()];
            number += usize::from(scene.add(boxed(name, at, size, turned)));
        }
        along += rng.random_range(20..32);
    }
    scene
}

fn streets(rng: &mut Pcg64Mcg) -> Option<Scene> {
    let block = rng.random_range(5.0..6.5);
    let street = rng.random_range(4.4..5.0);
    let pitch = block + street;
    let radius = 2.4;
    // The route goes from crossing to crossing. It starts half a block before the first one.
    let mut pieces = Vec::new();
    let mut straight = block / 2.0 + street / 2.0;
    let crossings = rng.random_range(3..=4);
    let mut sides = Vec::new();
    for _ in 0..crossings {
        let turns = rng.random_range(0.0..1.0) < 0.7;
        if turns {
            let before: f64 = sides.iter().sum();
            let side = if before.abs() >= 1.0 { -before.signum() } else { side(rng) };
            sides.push(side);
            pieces.push((straight - radius, side * FRAC_PI_2, radius));
            straight = pitch - radius;
        } else {
            straight += pitch;
        }
    }
    pieces.push((straight - pitch + block / 2.0, 0.0, 0.0));
    if sides.len() < 2 || pieces.iter().any(|piece| piece.0 < 0.3) {
        return None;
    }
    let (way, heading) = way(&pieces);
    let goal = ahead("kiosk", &way, heading, [1.6, 1.2], 1.3);
    let mut scene = Scene { name: String::new(), objects: vec![goal], way, goal: 0 };
    // The grid of streets is around the origin, and the first crossing is at half a pitch along x.
    let mut number = 0;
    for i in -5..=6 {
        for j in -6..=6 {
            let at = [pitch * f64::from(i), pitch * (f64::from(j) + 0.5)];
            let size = [block, block].map(|side| side + rng.random_range(-0.5..0.2));
            let object = boxed(&format!("block {}", number + 1), at, size, 0.0);
            let is_near = scene.clearance(&object.outline) < 4.0;
            if is_near {
                if scene.clearance(&object.outline) < BESIDE_WAY_M
                    || apart(&object.outline, &scene.objects[0].outline) < BESIDE_GOAL_M
                {
                    return None;
                }
                scene.objects.push(object);
                number += 1;
            }
        }
    }
    let blocks = scene.objects.len();
    for name in ["tree", "lamp", "bench", "sign"] {
        let at = scene.way[rng.random_range(15..scene.way.len() - 15)];
        let at = [at[0] + rng.random_range(-2.0..2.0), at[1] + rng.random_range(-2.0..2.0)];
        let object = boxed(name, at, [0.5, 0.5], 0.0);
        let is_apart = scene.objects[1..].iter().all(|other| apart(&other.outline, &object.outline) >= 0.25);
        if is_apart
            && scene.clearance(&object.outline) >= BESIDE_WAY_M
            && apart(&object.outline, &scene.objects[0].outline) > 2.2
        {
            scene.objects.push(object);
        }
    }
    // The goal is in the street, so the blocks next to it are nearer than is allowed for objects in other scenes.
    (blocks >= 6).then_some(scene)
}

fn hall(rng: &mut Pcg64Mcg) -> Option<Scene> {
    let pitch = rng.random_range(4.6..5.4);
    let radius = pitch / 2.0;
    let mut pieces = Vec::new();
    let mut sum = 0.0_f64;
    let turns = rng.random_range(2..=3);
    for i in 0..turns {
        let lanes = f64::from(rng.random_range(1..=2_u8));
        let side = if sum.abs() >= 1.0 { -sum.signum() } else { side(rng) };
        sum += side;
        let before = if i == 0 { 0.0 } else { radius };
        pieces.push((lanes * pitch - radius - before, side * FRAC_PI_2, radius));
    }
    pieces.push((pitch, 0.0, 0.0));
    let (way, heading) = way(&pieces);
    let goal = ahead("press", &way, heading, [2.2, 1.2], 1.3);
    let mut scene = Scene { name: String::new(), objects: vec![goal], way, goal: 0 };
    let [mut pillars, mut machines] = [0, 0];
    for i in -6..=8 {
        for j in -8..=8 {
            let at = [pitch * f64::from(i), pitch * (f64::from(j) + 0.5)];
            let pillar = boxed(&format!("pillar {}", pillars + 1), at, [0.7, 0.7], 0.0);
            if scene.clearance(&pillar.outline) < 3.2 {
                pillars += usize::from(scene.add(pillar));
            }
            let at = [at[0] + pitch / 2.0, at[1] + rng.random_range(-0.6..0.6)];
            let turned = if rng.random::<bool>() { 0.0 } else { PI / 2.0 };
            let machine = boxed(&format!("machine {}", machines + 1), at, [2.0, 1.0], turned);
            if rng.random_range(0.0..1.0) < 0.6 && scene.clearance(&machine.outline) < 2.5 {
                machines += usize::from(scene.add(machine));
            }
        }
    }
    (pillars >= 5).then_some(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{files, floor::Floor, floor_plan};
    use sketchnav_schemas::geometry::Pose;

    #[test]
    fn every_scene_can_be_driven_in() {
        let robot = files::robot("nomad200").unwrap();
        for scene in Scene::twelve(1) {
            let world = floor_plan::parse(&toml::to_string(&scene.plan()).unwrap()).unwrap();
            Floor::new(world, &robot, Pose::new(0.0, 0.0, 0.0), 1).unwrap();
            let (count, path_m) = (scene.objects.len(), scene.path_m());
            assert!(
                count >= LEAST_OBJECTS && PATHS_M.contains(&path_m),
                "{}: {count} objects, {path_m} m",
                scene.name
            );
            let end = scene.way[scene.way.len() - 1];
            let there = scene.there();
            let goal = &scene.objects[scene.goal].outline;
            assert!(distance_to(goal, end) < 2.6, "{}: {}", scene.name, distance_to(goal, end));
            assert!(there.contains(middle(goal)[0], middle(goal)[1]));
        }
    }

    #[test]
    fn a_seed_always_gives_the_same_scene() {
        assert_eq!(Scene::laid_out(Kind::Yard, 7), Scene::laid_out(Kind::Yard, 7));
        assert_ne!(Scene::laid_out(Kind::Yard, 7).way, Scene::laid_out(Kind::Yard, 8).way);
    }

    /// Regression test: the third hall had only six objects, because scenes were generated without the bounds that other code
    /// relies on.
    #[test]
    fn scenes_of_any_seed_have_objects_and_paths_within_bounds() {
        for kind in [Kind::Yard, Kind::Streets, Kind::Hall] {
            for number in 0..40 {
                let scene = Scene::laid_out(kind, number);
                assert!(scene.objects.len() >= LEAST_OBJECTS, "{}", scene.name);
                assert!(PATHS_M.contains(&scene.path_m()), "{}: {} m", scene.name, scene.path_m());
            }
        }
    }
}
