//! ROS 2 topics derived from this navigator's messages, for viewers.

use sketchnav_schemas::ros2::Ros2Error;
use sketchnav_schemas::ros2::derived::{Derived, derived};
use sketchnav_schemas::ros2::forms::visualization_msgs::msg::{Marker, MarkerArray};
use sketchnav_schemas::ros2::shapes::{REMEMBERED_COLOR, SEEN_COLOR, Shapes, turned};

use crate::messages::{RELATIONS, Relations};

/// The derived topics.
pub const DERIVED: &[Derived] = derived! {
    "/relations/markers": "visualization_msgs/msg/MarkerArray" = known_markers(RELATIONS);
};

/// Returns the markers that a robot remembers, each with its number and the direction it faces.
fn known_markers(relations: &Relations, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    const LENGTH_M: f64 = 0.3;
    let mut shapes = Shapes::new(&relations.header, "base_link")?;
    for marker in relations.markers() {
        let color = if marker.age_s == 0.0 { SEEN_COLOR } else { REMEMBERED_COLOR };
        let [x, y] = [marker.x_m, marker.y_m].map(f64::from);
        let scale = [LENGTH_M, LENGTH_M / 5.0, LENGTH_M / 5.0];
        shapes.add(Marker::ARROW, turned(x, y, marker.facing_rad.into()), scale, color);
        shapes.text([x, y + LENGTH_M / 2.0], LENGTH_M / 2.0, &marker.id.to_string());
    }
    Ok(shapes.finish())
}
