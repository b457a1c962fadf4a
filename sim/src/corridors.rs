//! Corridors with markers on their walls: straight ones as in Patil 2019, 5.3, and ones with corners, a junction and closed
//! ends. A [`Corridor`] generates the floor plan, and [`Corridor::drives`] lists the drives through it.
//!
//! Some lengths are not given in the thesis and are chosen here: how far the walls extend beyond a drive, and
//! where the markers hang. [`Corridor::published`] derives them from the description of the corridor in the
//! thesis.

use sketchnav_schemas::floor_plan::{FloorPlan, Marker, Wall};
use sketchnav_schemas::geometry::{Pose, World};

/// Length of the drive through a straight corridor, in metres (Patil 2019, figure 5.8).
pub const DISTANCE_M: f64 = 7.0;
/// Length by which a straight corridor and its markers extend beyond either end of the drive, in metres.
const BEYOND_M: f64 = 3.0;
/// Distance from the beginning of a corridor to its turn, in metres.
const LEG_M: f64 = 8.0;
/// Distance from a corridor's turn to its end, in metres.
const ARM_M: f64 = 6.0;
/// Distance between the legs of a U, in metres.
const APART_M: f64 = 5.0;
/// Distance from the end of a corridor to the start or the goal, in metres.
const FROM_END_M: f64 = 1.5;
const WALL_THICKNESS_M: f64 = 0.1;
/// Distance between neighbouring markers on the same wall, in metres.
const SPACING_M: f64 = 1.0;
/// Distance between neighbouring markers on the same wall in the corridor of the thesis, in metres. The thesis does not give it.
/// "At least two markers in the environment at any given point of time" are its "core assumption" (3.3), figure 5.1 shows two sets
/// of markers at once, and staggered rows fail because of the distance between markers (figures 5.2 to 5.7). This is therefore the
/// largest spacing at which opposite markers are in view everywhere along the middle, as a test confirms.
const PUBLISHED_SPACING_M: f64 = 1.2;
/// Width of the corridor of the thesis, in metres. The thesis does not give it, so this is our choice.
pub const PUBLISHED_WIDTH_M: f64 = 2.0;

/// Shapes of corridors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A straight corridor.
    Straight,
    /// A corridor with one turn to the left.
    L,
    /// A corridor with two turns to the left.
    U,
    /// A corridor that ends at another, which leads to the left and to the right.
    T,
}

/// Placement of markers on the two walls of a straight corridor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placement {
    /// Each marker is opposite one on the other wall.
    Opposite,
    /// Each marker is between two on the other wall.
    Staggered,
}

/// Ratio of the numbers of markers on the two walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbers {
    /// Both walls have the same number.
    Equal,
    /// Every second marker of the right wall is missing.
    Uneven,
    /// The left wall has an additional marker between any two: "more number of markers on one of the walls", so that "there is
    /// always atleast one marker on the opposite wall" (Patil 2019, figures 5.5 to 5.7).
    More,
}

/// A corridor with markers on its walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Shape of the corridor.
    pub shape: Shape,
    /// Distance from wall to wall, in metres, at most 4.
    pub width_m: f64,
    /// Placement of the markers.
    pub placement: Placement,
    /// Ratio of the numbers of markers on the two walls.
    pub numbers: Numbers,
    /// Distance between neighbouring markers on the same wall, in metres. With [`Numbers::More`], this is the right wall.
    pub spacing_m: f64,
}

/// A drive along the middle of a corridor.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Name of the drive, a word or two.
    pub name: &'static str,
    /// Start pose of the robot.
    pub start: Pose<World>,
    /// End position of the drive, in metres.
    pub goal: [f64; 2],
    /// Length of the drive, in metres.
    pub distance_m: f64,
    /// Directions to take at the junctions, in order.
    pub turns: &'static [&'static str],
}

impl Corridor {
    /// Creates a corridor with opposite markers, the same number on both walls.
    pub fn new(shape: Shape, width_m: f64) -> Self {
        let (placement, numbers, spacing_m) = (Placement::Opposite, Numbers::Equal, SPACING_M);
        Self { shape, width_m, placement, numbers, spacing_m }
    }

    /// Creates the corridor of Patil 2019, 5.3, which is straight, with the markers that its text calls for.
    pub fn published(placement: Placement, numbers: Numbers) -> Self {
        let (width_m, spacing_m) = (PUBLISHED_WIDTH_M, PUBLISHED_SPACING_M);
        Self { shape: Shape::Straight, width_m, placement, numbers, spacing_m }
    }

    /// Returns the floor plan of the corridor with bare walls, for missions that place the markers themselves.
    pub fn bare_plan(&self) -> FloorPlan {
        let name = format!("{} {:.1} m, bare", self.words()[0], self.width_m);
        FloorPlan { name, marker: Vec::new(), ..self.plan() }
    }

    /// Returns the name of the file of [`Corridor::bare_plan`], such as `straight-2.0-bare.floor.toml`.
    pub fn bare_file_name(&self) -> String {
        format!("{}-{:.1}-bare.floor.toml", self.words()[0].to_lowercase(), self.width_m)
    }

    /// Returns the floor plan of the corridor, with its walls and markers.
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

    /// Returns the corridors in `sim/missions/corridor`.
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

    /// Returns the file name of the floor plan, such as `straight-2.0-staggered-uneven.floor.toml`.
    pub fn file_name(&self) -> String {
        let words = self.words();
        let arrangement =
            if self.shape == Shape::Straight { format!("-{}-{}", words[1], words[2]) } else { String::new() };
        format!("{}-{:.1}{arrangement}.floor.toml", words[0].to_lowercase(), self.width_m)
    }

    /// Returns a name such as `straight 2.0 m, staggered, uneven`.
    pub fn name(&self) -> String {
        let [shape, placement, numbers] = self.words();
        format!("{shape} {:.1} m, {placement}, {numbers}", self.width_m)
    }

    /// Returns the words for the shape of the corridor, the placement of its markers, and their numbers.
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

    /// Returns the number of the marker nearest to a position, or 0 if there are no markers.
    pub fn marker_beside(&self, place: [f64; 2]) -> u32 {
        let distance = |marker: &Marker| (marker.at[0] - place[0]).hypot(marker.at[1] - place[1]);
        let markers = self.plan().marker;
        let nearest = markers.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(0, |marker| marker.id)
    }

    /// Returns the drives through the corridor, there and back.
    pub fn drives(&self) -> Vec<Drive> {
        let [east, north, west, south] = [0.0_f64, 90.0, 180.0, -90.0].map(f64::to_radians);
        let drive = |name, (x, y, yaw_rad), goal, distance_m, turns| Drive {
            name,
            start: Pose::new(x, y, yaw_rad),
            goal,
            distance_m,
            turns,
        };
        let (near, corner, far) = ([FROM_END_M, 0.0], LEG_M, [LEG_M, ARM_M - FROM_END_M]);
        let around_m = corner - FROM_END_M + far[1];
        match self.shape {
            Shape::Straight => {
                let (first, last) = ([BEYOND_M, 0.0], [BEYOND_M + DISTANCE_M, 0.0]);
                vec![
                    drive("there", (first[0], 0.0, east), last, DISTANCE_M, &[]),
                    drive("back", (last[0], 0.0, west), first, DISTANCE_M, &[]),
                ]
            }
            Shape::L => {
                let start_m = corner / 2.0;
                vec![
                    drive("there", (near[0], 0.0, east), far, around_m, &[]),
                    drive("back", (far[0], far[1], south), near, around_m, &[]),
                    // At first, the robot faces the closed end.
                    drive("out of the dead end", (start_m, 0.0, west), far, corner - start_m + far[1], &[]),
                ]
            }
            Shape::U => {
                let (end, distance_m) = ([FROM_END_M, APART_M], 2.0 * (corner - FROM_END_M) + APART_M);
                vec![
                    drive("there", (near[0], 0.0, east), end, distance_m, &[]),
                    drive("back", (end[0], end[1], east), near, distance_m, &[]),
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

    /// Returns the corners of the free floor in counter-clockwise order.
    fn outline(&self) -> Vec<[f64; 2]> {
        let (h, x, end) = (self.width_m / 2.0, LEG_M, ARM_M);
        match self.shape {
            Shape::Straight => {
                let length = DISTANCE_M + 2.0 * BEYOND_M;
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

    /// Returns the markers along every wall except those that close an end.
    fn markers(&self, outline: &[[f64; 2]]) -> Vec<Marker> {
        let mut markers = Vec::new();
        for (i, [a, b]) in edges(outline).enumerate() {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            if (length - self.width_m).abs() < 1e-9 {
                continue;
            }
            let along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
            // The inside is to the left of every edge.
            let facing_deg = along[0].atan2(-along[1]).to_degrees();
            for at_m in self.places(i, length) {
                // Rounded to millimetres, as in a file written by hand.
                let at = [0, 1].map(|axis| ((a[axis] + at_m * along[axis]) * 1e3).round() / 1e3);
                markers.push(Marker { id: markers.len() as u32 + 1, at, facing_deg });
            }
        }
        markers
    }

    /// Returns the positions of the markers on wall `i`, in metres from its first corner.
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
        // In a straight corridor, the markers of both walls are spaced from the same end.
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

/// Returns the centre line of the walls around a floor whose corners are all right angles.
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
