//! The project's own format for vector floor plans, with the furniture, people and markers of a world.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Line segment between two points, in metres in frame [`crate::geometry::World`].
pub type Segment = [[f64; 2]; 2];

/// Tolerance, in metres, for doors whose middle lies outside the surface of their wall.
const DOOR_SLACK_M: f64 = 0.01;
/// Distance, in metres, below which two points of a wall are the same point.
const SAME_POINT_M: f64 = 1e-6;

/// A floor: walls, the doors in them, furniture, people and markers. In metres, in frame [`crate::geometry::World`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FloorPlan {
    /// Name, shown to people.
    pub name: String,
    /// Thickness of the walls, in metres.
    pub wall_thickness_m: f64,
    /// The walls.
    pub wall: Vec<Wall>,
    /// Doors, each of which cuts a gap into every wall that it lies on.
    #[serde(default)]
    pub door: Vec<Door>,
    /// Furniture, which the sketch does not show.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// People who walk around.
    #[serde(default)]
    pub person: Vec<Person>,
    /// Markers on walls and furniture, for robots with a camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marker: Vec<Marker>,
}

impl FloorPlan {
    /// Returns the centre lines of the walls, interrupted by the doors, as in a drawing.
    pub fn middle_lines(&self) -> Vec<Segment> {
        let lines = self.wall.iter().flat_map(Wall::lines);
        let drawn = |line: Segment| {
            let (start, along, _) = direction(&line);
            let piece = move |[a, b]: [f64; 2]| [(start + along * a).into(), (start + along * b).into()];
            self.stretches(&line, 0.0).into_iter().map(piece)
        };
        lines.flat_map(drawn).collect()
    }

    /// Returns the stretches of a wall between its doors, in metres from the start of the wall's line, which is extended by
    /// `beyond_m` at both ends.
    pub fn stretches(&self, line: &Segment, beyond_m: f64) -> Vec<[f64; 2]> {
        let gaps = self.door.iter().filter_map(|door| door.gap(line, self.wall_thickness_m));
        let (_, _, length_m) = direction(line);
        between(gaps.collect(), -beyond_m, length_m + beyond_m)
    }
}

impl Wall {
    /// Returns the lines from corner to corner of the wall.
    pub fn lines(&self) -> impl Iterator<Item = Segment> + '_ {
        let ends = self.points.last().zip(self.points.first());
        let closing = ends.filter(|_| self.closed).map(|(last, first)| [*last, *first]);
        let lines = self.points.windows(2).map(|pair| [pair[0], pair[1]]);
        // A shorter line would have no direction.
        lines.chain(closing).filter(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1]) > SAME_POINT_M)
    }
}

impl Door {
    /// Returns the stretch of a wall's `line` that the door takes up, in metres from the line's start, or `None` if the door does
    /// not lie on the line.
    pub fn gap(&self, line: &Segment, thickness_m: f64) -> Option<[f64; 2]> {
        let (start, along, length) = direction(line);
        let offset = Vector2::from(self.at) - start;
        let (t, beside) = (offset.dot(&along), offset.perp(&along).abs());
        let lies_on = beside <= thickness_m / 2.0 + DOOR_SLACK_M && (0.0..=length).contains(&t);
        lies_on.then_some([t - self.width_m / 2.0, t + self.width_m / 2.0])
    }
}

/// Returns the stretches of [`from`, `to`] that no gap covers.
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

/// Returns the start of a line, its direction as a unit vector, and its length in metres.
pub fn direction(line: &Segment) -> (Vector2<f64>, Vector2<f64>, f64) {
    let (start, end) = (Vector2::from(line[0]), Vector2::from(line[1]));
    let length = (end - start).norm();
    (start, (end - start) / length, length)
}

/// A fiducial marker, such as one of ArUco's, on a wall or a piece of furniture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Unique number of the marker.
    pub id: u32,
    /// Centre of the marker, on the face of a wall or of a piece of furniture, in metres.
    pub at: [f64; 2],
    /// The direction that the marker faces, away from the wall, in degrees counter-clockwise from the x axis.
    pub facing_deg: f64,
}

/// A wall whose centre line runs through `points`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Corners, in metres.
    pub points: Vec<[f64; 2]>,
    /// Whether the last point is connected to the first.
    #[serde(default)]
    pub closed: bool,
}

/// A gap in a wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Door {
    /// Centre of the door, on the centre line of a wall, in metres.
    pub at: [f64; 2],
    /// Width of the opening, in metres.
    pub width_m: f64,
}

/// A piece of furniture: either `polygon`, or `center` with `size` and `yaw_deg`, or `center` with `radius_m`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// Name, shown to people.
    #[serde(default)]
    pub name: String,
    /// Corners of a convex polygon, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Centre of a box or a disc, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center: Option<[f64; 2]>,
    /// Length and width of a box, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// Rotation of a box, in degrees counter-clockwise.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Radius of a disc, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
}

/// A person who walks back and forth along waypoints, and waits while a robot is in the way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// Waypoints, in metres.
    pub waypoints: Vec<[f64; 2]>,
    /// Walking speed, in metres per second.
    pub speed_mps: f64,
    /// Radius of the person, in metres.
    #[serde(default = "person_radius")]
    pub radius_m: f64,
    /// Pause at each waypoint, in seconds.
    #[serde(default)]
    pub pause_s: f64,
}

fn person_radius() -> f64 {
    0.25
}
