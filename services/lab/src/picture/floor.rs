//! Walls, furniture and markers of a floor, as they appear in pictures.

use sketchnav_schemas::geometry::{Point, Pose, World};
use sketchnav_sim::WorldDescription;
use sketchnav_sim::convex::Convex;

/// Distance that the symbol of a marker projects from its wall, in metres.
const MARKER_DEPTH_M: f64 = 0.07;
/// Half the width of the symbol of a marker, in metres.
const MARKER_HALF_M: f64 = 0.08;

/// Shapes of walls, furniture and markers, in metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FloorShapes {
    /// Walls as segments.
    pub walls: Vec<[Point<World>; 2]>,
    /// Furniture as closed polygons.
    pub furniture: Vec<Vec<Point<World>>>,
    /// Markers as triangles. Each is on its wall and points in the direction that the marker faces.
    pub markers: Vec<Vec<Point<World>>>,
}

impl FloorShapes {
    /// Returns the shapes of a world.
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
