//! The corridors that ship are those that [`sketchnav_sim::corridors`] generates. With the camera of `youbot-markers`, they meet
//! the requirements in the text of the thesis.

use std::path::Path;

use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::SeenMarker;
use sketchnav_sim::corridors::{Corridor, Numbers, Placement, Shape};
use sketchnav_sim::sensors::camera::Camera;
use sketchnav_sim::{floor_plan, robots};

const MADE_BY: &str = "# Made by sketchnav_sim::corridors; `SKETCHNAV_UPDATE_GOLDEN=1 cargo test -p sketchnav-sim` updates it.\n";

#[test]
fn golden_corridors_are_up_to_date() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/corridor");
    let widths_m = [1.6, 2.0, 2.4, 3.0];
    let bare = widths_m.map(|width_m| Corridor::new(Shape::Straight, width_m));
    let bare = bare.map(|corridor| (corridor.bare_file_name(), corridor.bare_plan()));
    let marked = Corridor::shipped().into_iter().map(|corridor| (corridor.file_name(), corridor.plan()));
    let all: Vec<(String, FloorPlan)> = marked.chain(bare).collect();
    for (name, plan) in all {
        let path = folder.join(name);
        let made = format!("{MADE_BY}{}", toml::to_string(&plan).unwrap());
        if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &made).unwrap();
        }
        let shipped = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(shipped == made, "{}: not as it is made", path.display());
    }
}

/// Returns the markers that an error-free `youbot-markers`, facing along a corridor, sees from a position in it.
fn seen(corridor: &Corridor, x: f64, y: f64) -> Vec<SeenMarker> {
    let world = floor_plan::parse(&toml::to_string(&corridor.plan()).unwrap()).unwrap();
    let robot = robots::find("youbot-markers").unwrap().unwrap();
    Camera::exact_view(robot.camera().unwrap(), &world, Pose::new(x, y, 0.0))
}

fn sees_a_pair(corridor: &Corridor, x: f64) -> bool {
    let seen = seen(corridor, x, 0.0);
    [1.0, -1.0].into_iter().all(|side| seen.iter().any(|marker| marker.y_m * side > 0.0))
}

/// The range of the depth image, 3.5 m, was once taken for the range at which the camera detects markers. With the thresholds
/// of the thesis, 3, 3.5 and 4 m (3.2.3), no marker was ever far, so its rules for distances could not steer.
#[test]
fn markers_can_be_far_away_in_the_published_corridor() {
    let corridor = Corridor::published(Placement::Opposite, Numbers::Equal);
    let beside_the_wall_m = -(corridor.width_m / 2.0 - 0.38 / 2.0 - 0.2);
    let farthest_m = (0..120)
        .flat_map(|step| seen(&corridor, 3.0 + 0.01 * f64::from(step), beside_the_wall_m))
        .map(|marker| f64::from(marker.x_m - 0.15).hypot(marker.y_m.into()))
        .fold(0.0, f64::max);
    assert!((4.0..4.1).contains(&farthest_m), "{farthest_m}");
}

/// This determines the spacing of the markers: at least two are in view at any time (Patil 2019, 3.3).
#[test]
fn the_spacing_of_opposite_markers_is_the_largest_that_keeps_them_in_view() {
    let corridor = Corridor::published(Placement::Opposite, Numbers::Equal);
    let everywhere = |corridor: &Corridor| (0..130).all(|i| sees_a_pair(corridor, 3.0 + 0.01 * f64::from(i)));
    assert!(everywhere(&corridor));
    assert!(!everywhere(&Corridor { spacing_m: corridor.spacing_m + 0.1, ..corridor }));
}
