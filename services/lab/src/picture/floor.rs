//! What stands on a floor, as a picture shows it.

use sketchnav_schemas::geometry::{Point, Pose, World};
use sketchnav_sim::WorldDescription;
use sketchnav_sim::convex::Convex;

/// How far a marker's picture reaches out of its wall, metres.
const MARKER_DEPTH_M: f64 = 0.07;
/// Half the width of a marker's picture, metres.
const MARKER_HALF_M: f64 = 0.08;

/// Walls, furniture and markers, metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FloorShapes {
    /// Walls, as segments.
    pub walls: Vec<[Point<World>; 2]>,
    /// Furniture, as closed polygons.
    pub furniture: Vec<Vec<Point<World>>>,
    /// Markers: each a triangle on its wall that points to where the marker looks.
    pub markers: Vec<Vec<Point<World>>>,
}

impl FloorShapes {
    /// The shapes of a world.
    pub fn of(world: &WorldDescription) -> Self {
        let point = |at: &[f64; 2]| Point::new(at[0], at[1]);
        let corners = |piece: &Convex| piece.corners().iter().map(point).collect();
        let marker = |marker: &sketchnav_schemas::floor_plan::Marker| {
            let at = Pose::<World>::new(marker.at[0], marker.at[1], marker.facing_deg.to_radians());
            let corner = |[x, y]: [f64; 2]| at.compose(&Pose::<World>::new(x, y, 0.0)).position();
            [[0.0, -MARKER_HALF_M], [MARKER_DEPTH_M, 0.0], [0.0, MARKER_HALF_M]].map(corner).to_vec()
        };
        Self {
            walls: world.outline.iter().map(|[a, b]| [point(a), point(b)]).collect(),
            furniture: world.furniture.iter().map(corners).collect(),
            markers: world.markers.iter().map(marker).collect(),
        }
    }
}
