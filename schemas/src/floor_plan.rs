//! The project's own vector floor plans, and what stands and walks in a world.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// A straight line from one point to another, metres in frame [`crate::geometry::World`].
pub type Segment = [[f64; 2]; 2];

/// How far from a wall's line a door's middle may be marked, metres (in addition to half a thickness).
const DOOR_SLACK_M: f64 = 0.01;
/// Points of a wall that are nearer than this are one point, metres.
const SAME_POINT_M: f64 = 1e-6;

/// A floor in metres (frame [`crate::geometry::World`]): walls, the doors in them, and what stands and walks there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FloorPlan {
    /// Name, for people.
    pub name: String,
    /// Thickness of the walls.
    pub wall_thickness_m: f64,
    /// The walls.
    pub wall: Vec<Wall>,
    /// Doors: each cuts a gap into every wall that it lies on.
    #[serde(default)]
    pub door: Vec<Door>,
    /// Furniture, which is not in the sketch.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// People walking around.
    #[serde(default)]
    pub person: Vec<Person>,
    /// Markers on walls and furniture, for robots with a camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marker: Vec<Marker>,
}

impl FloorPlan {
    /// The walls' middle lines between the doors, as one would draw them.
    pub fn middle_lines(&self) -> Vec<Segment> {
        let lines = self.wall.iter().flat_map(Wall::lines);
        let drawn = |line: Segment| {
            let (start, along, _) = direction(&line);
            let piece = move |[a, b]: [f64; 2]| [(start + along * a).into(), (start + along * b).into()];
            self.stretches(&line, 0.0).into_iter().map(piece)
        };
        lines.flat_map(drawn).collect()
    }

    /// What the doors leave of a wall's line that extends `beyond_m` beyond its ends, metres from its start.
    pub fn stretches(&self, line: &Segment, beyond_m: f64) -> Vec<[f64; 2]> {
        let gaps = self.door.iter().filter_map(|door| door.gap(line, self.wall_thickness_m));
        let (_, _, length_m) = direction(line);
        between(gaps.collect(), -beyond_m, length_m + beyond_m)
    }
}

impl Wall {
    /// The lines from corner to corner.
    pub fn lines(&self) -> impl Iterator<Item = Segment> + '_ {
        let ends = self.points.last().zip(self.points.first());
        let closing = ends.filter(|_| self.closed).map(|(last, first)| [*last, *first]);
        let lines = self.points.windows(2).map(|pair| [pair[0], pair[1]]);
        // A shorter line has no direction.
        lines.chain(closing).filter(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1]) > SAME_POINT_M)
    }
}

impl Door {
    /// The stretch of a wall's `line` that it opens, metres from the line's start; none if it lies elsewhere.
    pub fn gap(&self, line: &Segment, thickness_m: f64) -> Option<[f64; 2]> {
        let (start, along, length) = direction(line);
        let offset = Vector2::from(self.at) - start;
        let (t, beside) = (offset.dot(&along), offset.perp(&along).abs());
        let lies_on = beside <= thickness_m / 2.0 + DOOR_SLACK_M && (0.0..=length).contains(&t);
        lies_on.then_some([t - self.width_m / 2.0, t + self.width_m / 2.0])
    }
}

/// The stretches of [`from`, `to`] that no gap covers.
fn between(mut gaps: Vec<[f64; 2]>, mut from: f64, to: f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    gaps.sort_by(|a, b| a[0].total_cmp(&b[0]));
    gaps.push([to; 2]);
    for [begin, end] in gaps {
        if begin > from {
            kept.push([from, begin.min(to)]);
        }
        from = from.max(end);
    }
    kept
}

/// Where a line starts, its direction, and its length, metres.
pub fn direction(line: &Segment) -> (Vector2<f64>, Vector2<f64>, f64) {
    let (start, end) = (Vector2::from(line[0]), Vector2::from(line[1]));
    let length = (end - start).norm();
    (start, (end - start) / length, length)
}

/// A fiducial marker on a wall or a piece of furniture, such as ArUco's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Its number, which no other marker has.
    pub id: u32,
    /// Its middle, on the face of a wall or a piece of furniture, metres.
    pub at: [f64; 2],
    /// The direction that it faces, away from the wall: degrees counter-clockwise from the x axis.
    pub facing_deg: f64,
}

/// A wall whose centre line runs through `points`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Corners, metres.
    pub points: Vec<[f64; 2]>,
    /// Whether the last point is joined to the first.
    #[serde(default)]
    pub closed: bool,
}

/// A gap in a wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Door {
    /// Middle of the door, on a wall's line, metres.
    pub at: [f64; 2],
    /// Width of the opening.
    pub width_m: f64,
}

/// A piece of furniture: either `polygon`, or `center` with `size` and `yaw_deg`, or `center` with `radius_m`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// Name, for people.
    #[serde(default)]
    pub name: String,
    /// Corners of a convex polygon, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Centre of a box or a disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 2]>,
    /// Length and width of a box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// Turn of a box, degrees counter-clockwise.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Radius of a disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
}

/// A person who walks from waypoint to waypoint, there and back again, and waits for a robot in the way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// Waypoints, metres.
    pub waypoints: Vec<[f64; 2]>,
    /// Walking speed.
    pub speed_mps: f64,
    /// Radius of the body.
    #[serde(default = "person_radius")]
    pub radius_m: f64,
    /// How long to stay at each waypoint.
    #[serde(default)]
    pub pause_s: f64,
}

fn person_radius() -> f64 {
    0.25
}
