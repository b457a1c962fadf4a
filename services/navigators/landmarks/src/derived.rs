//! ROS 2 topics derived from this navigator's messages, for viewers.

use sketchnav_schemas::ros2::Ros2Error;
use sketchnav_schemas::ros2::derived::{Derived, derived};
use sketchnav_schemas::ros2::forms::visualization_msgs::msg::MarkerArray;
use sketchnav_schemas::ros2::shapes::{REMEMBERED_COLOR, SEEN_COLOR, Shapes};

use crate::messages::{LANDMARK_VIEW, LandmarkView};

/// The derived topics.
pub const DERIVED: &[Derived] = derived! {
    "/landmark_view/markers": "visualization_msgs/msg/MarkerArray" = landmark_markers(LANDMARK_VIEW);
};

/// Returns the returns in sixteen directions, and the positions of the objects that a robot remembers, as markers.
fn landmark_markers(view: &LandmarkView, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    const PLACE_M: f64 = 0.15;
    let mut shapes = Shapes::new(&view.header, "base_link")?;
    let step_rad = std::f64::consts::TAU / view.sectors_m.len() as f64;
    let returns = view.sectors_m.iter().enumerate().filter(|(_, range_m)| range_m.is_finite());
    for (i, range_m) in returns {
        let (sin, cos) = (i as f64 * step_rad).sin_cos();
        shapes.disc([range_m * cos, range_m * sin], PLACE_M / 2.0, REMEMBERED_COLOR);
    }
    for place in view.places() {
        shapes.disc(place.map(f64::from), PLACE_M, SEEN_COLOR);
    }
    Ok(shapes.finish())
}
