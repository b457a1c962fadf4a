//! Corridors with markers on their walls: straight ones as in Patil 2019, 5.3, and ones with corners, a junction and
//! closed ends. A [`Corridor`] makes the floor plan; [`Corridor::drives`] says where robots drive in it.
//!
//! Lengths that the thesis does not give are chosen here: how far walls extend beyond the way, and where markers hang.
//! [`Corridor::published`] derives them from what the thesis says about its own corridor.

use sketchnav_schemas::floor_plan::{FloorPlan, Marker, Wall};
use sketchnav_schemas::geometry::{Pose, World};

/// Length of the way in a straight corridor, metres (Patil 2019, figure 5.8).
pub const WAY_M: f64 = 7.0;
/// How far a straight corridor continues beyond both ends of the way, metres; markers hang there, too.
const BEYOND_M: f64 = 3.0;
/// From a corridor's beginning to where it turns, metres.
const LEG_M: f64 = 8.0;
/// From where it turns to the end, metres.
const ARM_M: f64 = 6.0;
/// From one leg of a U to the other, metres.
const APART_M: f64 = 5.0;
/// From a corridor's end to the start or the goal, metres.
const FROM_END_M: f64 = 1.5;
const WALL_THICKNESS_M: f64 = 0.1;
/// From one marker to the next on the same wall, metres.
const SPACING_M: f64 = 1.0;
/// The same in the corridor of the thesis, which does not give it. "At least two markers in the environment at any given point of
/// time" are its "core assumption" (3.3), and figure 5.1 shows two sets at once. Staggered rows fail because of the distance
/// between markers (figures 5.2 to 5.7). So this is the largest spacing with which opposite markers are in view everywhere along
/// the middle (a test).
const PUBLISHED_SPACING_M: f64 = 1.2;
/// Width of the corridor of the thesis, metres. The thesis does not give it.
pub const PUBLISHED_WIDTH_M: f64 = 2.0;

/// The course of a corridor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Without a turn.
    Straight,
    /// A turn to the left.
    L,
    /// Two turns to the left.
    U,
    /// It ends at another one, to the left and to the right.
    T,
}

/// Where the markers of the two walls of a straight corridor hang.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placement {
    /// Opposite each other.
    Opposite,
    /// Each between two of the other wall.
    Staggered,
}

/// How many markers the two walls have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbers {
    /// As many on both.
    Equal,
    /// Every second one of the right wall is missing.
    Uneven,
    /// The left wall has an additional marker between any two: "more number of markers on one of the walls", so that "there is
    /// always atleast one marker on the opposite wall" (Patil 2019, figures 5.5 to 5.7).
    More,
}

/// A corridor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Its course.
    pub shape: Shape,
    /// From wall to wall, metres: at most 4.
    pub width_m: f64,
    /// Where markers hang.
    pub placement: Placement,
    /// How many there are.
    pub numbers: Numbers,
    /// From one marker to the next on the same wall, metres; with [`Numbers::More`], on the right wall.
    pub spacing_m: f64,
}

/// A way through a corridor, along its middle.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// In a word or two.
    pub name: &'static str,
    /// Where the robot stands at first.
    pub start: Pose<World>,
    /// Where the way ends.
    pub goal: [f64; 2],
    /// Its length, metres.
    pub way_m: f64,
    /// Which way to turn at each junction.
    pub turns: &'static [&'static str],
}

impl Corridor {
    /// A corridor with opposite markers, as many on both walls.
    pub fn new(shape: Shape, width_m: f64) -> Self {
        let (placement, numbers, spacing_m) = (Placement::Opposite, Numbers::Equal, SPACING_M);
        Self { shape, width_m, placement, numbers, spacing_m }
    }

    /// The corridor of Patil 2019, 5.3: straight, with the markers that its text asks for.
    pub fn published(placement: Placement, numbers: Numbers) -> Self {
        let (width_m, spacing_m) = (PUBLISHED_WIDTH_M, PUBLISHED_SPACING_M);
        Self { shape: Shape::Straight, width_m, placement, numbers, spacing_m }
    }

    /// The same corridor with bare walls, for missions that place the markers themselves.
    pub fn bare_plan(&self) -> FloorPlan {
        let name = format!("{} {:.1} m, bare", self.words()[0], self.width_m);
        FloorPlan { name, marker: Vec::new(), ..self.plan() }
    }

    /// The name of the file of [`Corridor::bare_plan`].
    pub fn bare_file_name(&self) -> String {
        format!("{}-{:.1}-bare.floor.toml", self.words()[0].to_lowercase(), self.width_m)
    }

    /// The floor with its walls and markers.
    pub fn plan(&self) -> FloorPlan {
        let outline = self.outline();
        FloorPlan {
            name: self.name(),
            wall_thickness_m: WALL_THICKNESS_M,
            wall: vec![Wall { points: offset(&outline), closed: true }],
            door: Vec::new(),
            furniture: Vec::new(),
            person: Vec::new(),
            marker: self.markers(&outline),
        }
    }

    /// The corridors that ship in `sim/missions/corridor`.
    pub fn shipped() -> Vec<Self> {
        let mut all = Vec::new();
        for width_m in [1.6, 2.0, 2.4, 3.0] {
            for placement in [Placement::Opposite, Placement::Staggered] {
                for numbers in [Numbers::Equal, Numbers::Uneven] {
                    all.push(Self { placement, numbers, ..Self::new(Shape::Straight, width_m) });
                }
            }
        }
        let turning = [Shape::L, Shape::U, Shape::T];
        all.extend(turning.into_iter().flat_map(|shape| [1.6, 2.4].map(|width_m| Self::new(shape, width_m))));
        all
    }

    /// The name of the file of its floor plan: `straight-2.0-staggered-uneven.floor.toml`.
    pub fn file_name(&self) -> String {
        let words = self.words();
        let arrangement =
            if self.shape == Shape::Straight { format!("-{}-{}", words[1], words[2]) } else { String::new() };
        format!("{}-{:.1}{arrangement}.floor.toml", words[0].to_lowercase(), self.width_m)
    }

    /// `straight 2.0 m, staggered, uneven`.
    pub fn name(&self) -> String {
        let [shape, placement, numbers] = self.words();
        format!("{shape} {:.1} m, {placement}, {numbers}", self.width_m)
    }

    /// Its shape, the placement of its markers, and their numbers.
    fn words(&self) -> [&'static str; 3] {
        let shape = match self.shape {
            Shape::Straight => "straight",
            Shape::L => "L",
            Shape::U => "U",
            Shape::T => "T",
        };
        let placement = match self.placement {
            Placement::Opposite => "opposite",
            Placement::Staggered => "staggered",
        };
        let numbers = match self.numbers {
            Numbers::Equal => "equal",
            Numbers::Uneven => "uneven",
            Numbers::More => "more on the left",
        };
        [shape, placement, numbers]
    }

    /// The number of the marker nearest to a place.
    pub fn marker_beside(&self, place: [f64; 2]) -> u32 {
        let distance = |marker: &Marker| (marker.at[0] - place[0]).hypot(marker.at[1] - place[1]);
        let markers = self.plan().marker;
        let nearest = markers.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(0, |marker| marker.id)
    }

    /// The ways that robots drive in it: there and back.
    pub fn drives(&self) -> Vec<Drive> {
        let [east, north, west, south] = [0.0_f64, 90.0, 180.0, -90.0].map(f64::to_radians);
        let drive = |name, (x, y, yaw_rad), goal, way_m, turns| Drive {
            name,
            start: Pose::new(x, y, yaw_rad),
            goal,
            way_m,
            turns,
        };
        let (near, corner, far) = ([FROM_END_M, 0.0], LEG_M, [LEG_M, ARM_M - FROM_END_M]);
        let around_m = corner - FROM_END_M + far[1];
        match self.shape {
            Shape::Straight => {
                let (first, last) = ([BEYOND_M, 0.0], [BEYOND_M + WAY_M, 0.0]);
                vec![
                    drive("there", (first[0], 0.0, east), last, WAY_M, &[]),
                    drive("back", (last[0], 0.0, west), first, WAY_M, &[]),
                ]
            }
            Shape::L => {
                let start_m = corner / 2.0;
                vec![
                    drive("there", (near[0], 0.0, east), far, around_m, &[]),
                    drive("back", (far[0], far[1], south), near, around_m, &[]),
                    // The robot faces the closed end.
                    drive("out of the dead end", (start_m, 0.0, west), far, corner - start_m + far[1], &[]),
                ]
            }
            Shape::U => {
                let (end, way_m) = ([FROM_END_M, APART_M], 2.0 * (corner - FROM_END_M) + APART_M);
                vec![
                    drive("there", (near[0], 0.0, east), end, way_m, &[]),
                    drive("back", (end[0], end[1], east), near, way_m, &[]),
                ]
            }
            Shape::T => {
                let right = [far[0], -far[1]];
                vec![
                    drive("to the left", (near[0], 0.0, east), far, around_m, &["left"]),
                    drive("to the right", (near[0], 0.0, east), right, around_m, &["right"]),
                    drive("from the left", (far[0], far[1], south), near, around_m, &["right"]),
                    drive("from the right", (right[0], right[1], north), near, around_m, &["left"]),
                ]
            }
        }
    }

    /// The free floor's corners, counter-clockwise.
    fn outline(&self) -> Vec<[f64; 2]> {
        let (h, x, end) = (self.width_m / 2.0, LEG_M, ARM_M);
        match self.shape {
            Shape::Straight => {
                let length = WAY_M + 2.0 * BEYOND_M;
                vec![[0.0, -h], [length, -h], [length, h], [0.0, h]]
            }
            Shape::L => {
                vec![[0.0, -h], [x + h, -h], [x + h, end], [x - h, end], [x - h, h], [0.0, h]]
            }
            Shape::U => {
                let (inner, outer) = (APART_M - h, APART_M + h);
                vec![
                    [0.0, -h],
                    [x + h, -h],
                    [x + h, outer],
                    [0.0, outer],
                    [0.0, inner],
                    [x - h, inner],
                    [x - h, h],
                    [0.0, h],
                ]
            }
            Shape::T => vec![
                [0.0, -h],
                [x - h, -h],
                [x - h, -end],
                [x + h, -end],
                [x + h, end],
                [x - h, end],
                [x - h, h],
                [0.0, h],
            ],
        }
    }

    /// Markers along every wall except those that close an end.
    fn markers(&self, outline: &[[f64; 2]]) -> Vec<Marker> {
        let mut markers = Vec::new();
        for (i, [a, b]) in edges(outline).enumerate() {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            if (length - self.width_m).abs() < 1e-9 {
                continue;
            }
            let along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
            // Inside is on the left of every edge.
            let facing_deg = along[0].atan2(-along[1]).to_degrees();
            for at_m in self.places(i, length) {
                // Rounded to the millimetre, as people would write it.
                let at = [0, 1].map(|axis| ((a[axis] + at_m * along[axis]) * 1e3).round() / 1e3);
                markers.push(Marker { id: markers.len() as u32 + 1, at, facing_deg });
            }
        }
        markers
    }

    /// Where the markers of wall `i` hang, metres from its first corner.
    fn places(&self, i: usize, length_m: f64) -> Vec<f64> {
        let is_straight = self.shape == Shape::Straight;
        let is_right = is_straight && i == 0;
        let whole_m = self.spacing_m;
        let is_shifted = is_right && self.placement == Placement::Staggered;
        let shift = if is_shifted { whole_m } else { whole_m / 2.0 };
        let step = match self.numbers {
            Numbers::Uneven if is_right => 2.0 * whole_m,
            Numbers::More if is_straight && !is_right => whole_m / 2.0,
            _ => whole_m,
        };
        let count = ((length_m - shift) / step - 1e-9).ceil().max(0.0) as usize;
        let places = (0..count).map(|k| shift + k as f64 * step);
        // In a straight corridor, the markers of both walls are spaced from its beginning.
        if is_straight && !is_right {
            places.rev().map(|at_m| length_m - at_m).collect()
        } else {
            places.collect()
        }
    }
}

fn edges(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// The centre line of the walls around a floor with right angles.
fn offset(outline: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let outwards: Vec<_> = edges(outline)
        .map(|[a, b]| {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            [(b[1] - a[1]) / length, (a[0] - b[0]) / length].map(|v| v * WALL_THICKNESS_M / 2.0)
        })
        .collect();
    let before = outwards.iter().cycle().skip(outline.len() - 1);
    let corners = outline.iter().zip(&outwards).zip(before);
    corners
        .map(|((corner, next), before)| [corner[0] + next[0] + before[0], corner[1] + next[1] + before[1]])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Floor, floor_plan, robots};

    const SHAPES: [Shape; 4] = [Shape::Straight, Shape::L, Shape::U, Shape::T];

    #[test]
    fn every_corridor_is_a_floor_on_which_the_robot_can_start() {
        let robot = robots::find("youbot").unwrap().unwrap();
        for (shape, width_m) in
            SHAPES.into_iter().flat_map(|shape| [1.6, 2.0, 3.0].map(|width_m| (shape, width_m)))
        {
            let corridor = Corridor::new(shape, width_m);
            let text = toml::to_string(&corridor.plan()).unwrap();
            let world = floor_plan::parse(&text).unwrap();
            assert!(world.markers.len() >= 20, "{}", corridor.name());
            for drive in corridor.drives() {
                Floor::new(world.clone(), &robot, drive.start, 1).unwrap();
            }
        }
    }

    #[test]
    fn markers_hang_opposite_each_other_or_between() {
        let straight =
            |placement, numbers| Corridor { placement, numbers, ..Corridor::new(Shape::Straight, 2.0) };
        let xs = |corridor: Corridor, y: f64| -> Vec<f64> {
            let mut xs: Vec<_> = corridor
                .plan()
                .marker
                .iter()
                .filter(|m| (m.at[1] - y).abs() < 1e-9)
                .map(|m| m.at[0])
                .collect();
            xs.sort_by(f64::total_cmp);
            xs
        };
        let opposite = straight(Placement::Opposite, Numbers::Equal);
        assert_eq!(xs(opposite, -1.0), xs(opposite, 1.0));
        assert_eq!((xs(opposite, 1.0).len(), xs(opposite, 1.0)[0]), (13, 0.5));
        let staggered = straight(Placement::Staggered, Numbers::Uneven);
        assert_eq!(xs(staggered, -1.0), [1.0, 3.0, 5.0, 7.0, 9.0, 11.0]);
        assert_eq!(xs(staggered, 1.0), xs(opposite, 1.0));
        let published = Corridor::published(Placement::Staggered, Numbers::More);
        assert_eq!(xs(published, 1.0)[..4], [0.6, 1.2, 1.8, 2.4]);
        assert_eq!(xs(published, -1.0)[..2], [1.2, 2.4]);
    }
}
