//! The project's own vector floor plans, and what stands and walks in a world.

use serde::{Deserialize, Serialize};

/// A floor in metres (frame [`crate::geometry::World`]): walls, the doors in them, and what stands
/// and walks there.
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
    /// What stands around and is not in the sketch.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// Who walks around.
    #[serde(default)]
    pub person: Vec<Person>,
    /// Markers on walls and furniture, for robots with a camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marker: Vec<Marker>,
}

/// A fiducial marker on a wall or a piece of furniture, such as ArUco's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Its number, which no other marker has.
    pub id: u32,
    /// Its middle, on the face of a wall or a piece of furniture, metres.
    pub at: [f64; 2],
    /// Where it looks, away from the wall: degrees counter-clockwise from the x axis.
    pub facing_deg: f64,
}

/// A wall along the middle of which runs a line through `points`.
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

/// Something that stands: either `polygon`, or `center` with `size` and `yaw_deg`, or `center` with
/// `radius_m`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// Name, for people.
    #[serde(default)]
    pub name: String,
    /// Corners of a convex polygon, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Middle of a box or a disc.
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
