//! A camera that detects fiducial markers: which markers it sees, and how accurately.
//!
//! The camera sees a marker that is within its field of view and its range, is not turned away too far, and is not hidden. The
//! errors of the measured distance and facing grow with the distance. All errors in an image are independent.
//!
//! If the robot's file does not describe the pixels, the distance of a slanted marker has a larger error. If it does, a marker
//! is only detected if it appears large enough, and its distance is computed from its upright edges, which are not shortened by
//! the slant.

use nalgebra::Vector2;
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::floor_plan::Marker;
use sketchnav_schemas::geometry::{Pose, World, wrap_angle};
use sketchnav_schemas::message::{MAX_MARKERS, MarkerView, SeenMarker};
use sketchnav_schemas::robot::{MarkerCamera, Pixels};
use sketchnav_schemas::seed;

use super::{DRAWS_PER_READING, Scene};
use crate::convex::Convex;
use crate::description::WorldDescription;
use crate::raycast::{Faces, cast_disc};

/// Distance between a marker and the end of a line of sight in front of it, in metres. The marker may be slightly inside its wall.
const BEFORE_M: f64 = 0.025;

/// A camera in a world with markers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    model: MarkerCamera,
    /// The markers, sorted by number.
    markers: Vec<Marker>,
    stream: Pcg64Mcg,
}

/// A marker as seen by a camera without errors.
#[derive(Debug, Clone, Copy)]
struct Sight {
    distance_m: f64,
    /// Direction of the marker, counter-clockwise from the optical axis.
    bearing_rad: f64,
    /// Direction that the marker faces, counter-clockwise from the optical axis.
    facing_rad: f64,
    /// Angle between the direction that the marker faces and the line to the camera.
    slant_rad: f64,
}

impl Camera {
    /// Creates the camera `model` in a world with `markers`. Its noise comes from `stream`.
    pub fn new(model: &MarkerCamera, markers: &[Marker], stream: Pcg64Mcg) -> Self {
        let mut markers = markers.to_vec();
        markers.sort_by_key(|marker| marker.id);
        Self { model: model.clone(), markers, stream }
    }

    /// Returns the markers that an error-free camera would see from a robot at `robot`, in a world without people.
    pub fn exact_view(model: &MarkerCamera, world: &WorldDescription, robot: Pose<World>) -> Vec<SeenMarker> {
        let exact = MarkerCamera {
            noise_per_m: 0.0,
            bearing_noise_deg: 0.0,
            facing_noise_deg_per_m: 0.0,
            miss: 0.0,
            pixels: model.pixels.map(|pixels| Pixels { corner_px: 0.0, ..pixels }),
            ..model.clone()
        };
        let furniture = world.furniture.iter().flat_map(Convex::edges);
        let faces = Faces::new(world.outline.iter().copied().chain(furniture).collect());
        let (scene, mount) = (Scene { robot, faces: &faces, people: &[] }, exact.mount());
        let camera = Self::new(&exact, &world.markers, seed::stream(0, "exact"));
        let mut stream = camera.stream.clone();
        let seen = |marker: &Marker| {
            let sight = camera.sight(&scene, &robot.compose(&mount), marker)?;
            camera.measure(marker.id, &sight, &mut stream)
        };
        camera.markers.iter().filter_map(seen).collect()
    }

    /// Fills in image number `number`, except for the header. The same arguments give the same image. If more
    /// markers are seen than fit into a message, those with the smallest numbers are kept.
    pub fn fill(&self, scene: &Scene<'_>, number: u64, view: &mut MarkerView) {
        self.fill_geometry(view);
        let camera = scene.robot.compose(&self.model.mount());
        let mut stream = self.stream.clone();
        stream.advance(u128::from(number) * DRAWS_PER_READING);
        let mut count = 0;
        for marker in &self.markers {
            let Some(sight) = self.sight(scene, &camera, marker) else { continue };
            if let Some(seen) = self.measure(marker.id, &sight, &mut stream)
                && count < MAX_MARKERS
            {
                view.markers[count] = seen;
                count += 1;
            }
        }
        view.marker_count = count as u32;
    }

    /// Returns a marker as the camera sees it, without errors, or `None` if the camera does not see it.
    fn sight(&self, scene: &Scene<'_>, camera: &Pose<World>, marker: &Marker) -> Option<Sight> {
        let (from, at) = (camera.position().coords(), Vector2::from(marker.at));
        let (distance_m, facing) = ((at - from).norm(), marker.facing_deg.to_radians());
        let towards_rad = (at - from).y.atan2((at - from).x);
        let sight = Sight {
            distance_m,
            bearing_rad: wrap_angle(towards_rad - camera.yaw_rad),
            facing_rad: wrap_angle(facing - camera.yaw_rad),
            slant_rad: wrap_angle(towards_rad + std::f64::consts::PI - facing).abs(),
        };
        (self.model.sees(distance_m, sight.bearing_rad, sight.slant_rad)
            && is_open(scene, from, at + BEFORE_M * Vector2::new(facing.cos(), facing.sin())))
        .then_some(sight)
    }

    /// Returns a marker as measured, or `None` if the camera misses it.
    fn measure(&self, id: u32, sight: &Sight, stream: &mut Pcg64Mcg) -> Option<SeenMarker> {
        let model = &self.model;
        let is_missed = stream.random::<f64>() < model.missed(sight.distance_m);
        let mut normal = || stream.sample::<f64, _>(StandardNormal);
        let error = model.distance_error(sight.distance_m, sight.slant_rad);
        let distance_m = sight.distance_m * (1.0 + normal() * error);
        let bearing_rad = sight.bearing_rad + normal() * model.bearing_noise_deg.to_radians();
        let facing_noise_rad = model.facing_noise_deg_per_m.to_radians() * sight.distance_m;
        let mount = model.mount();
        let facing_rad = wrap_angle(sight.facing_rad + normal() * facing_noise_rad + mount.yaw_rad);
        let direction_rad = mount.yaw_rad + bearing_rad;
        let x_m = mount.x + distance_m * direction_rad.cos();
        let y_m = mount.y + distance_m * direction_rad.sin();
        let [x_m, y_m, facing_rad] = [x_m, y_m, facing_rad].map(|v| v as f32);
        (!is_missed).then_some(SeenMarker { id, x_m, y_m, facing_rad })
    }

    fn half_view_rad(&self) -> f64 {
        self.model.field_of_view_deg.to_radians() / 2.0
    }

    fn fill_geometry(&self, view: &mut MarkerView) {
        let mount = self.model.mount();
        view.camera_x_m = mount.x as f32;
        view.camera_y_m = mount.y as f32;
        view.camera_yaw_rad = mount.yaw_rad as f32;
        view.half_view_rad = self.half_view_rad() as f32;
        view.range_min_m = self.model.range_min_m as f32;
        view.range_max_m = self.model.range_max_m as f32;
        view.frame_time_s = (1.0 / self.model.rate_hz) as f32;
    }
}

/// Returns true if the line between two points is clear of objects and people.
fn is_open(scene: &Scene<'_>, from: Vector2<f64>, to: Vector2<f64>) -> bool {
    let distance_m = (to - from).norm();
    let direction = (to - from) / distance_m.max(f64::MIN_POSITIVE);
    let hides = |(center, radius_m): &([f64; 2], f64)| {
        cast_disc(Vector2::from(*center), *radius_m, from, direction, distance_m).is_some()
    };
    scene.faces.cast(from, direction, distance_m).is_none() && !scene.people.iter().any(hides)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    fn model() -> MarkerCamera {
        MarkerCamera {
            model: "exact".into(),
            field_of_view_deg: 58.0,
            range_min_m: 0.8,
            range_max_m: 3.5,
            slant_max_deg: 75.0,
            rate_hz: 30.0,
            noise_per_m: 0.0,
            bearing_noise_deg: 0.0,
            facing_noise_deg_per_m: 0.0,
            miss: 0.0,
            pixels: None,
            mount_x_m: 0.2,
            mount_y_m: 0.0,
            mount_yaw_deg: 0.0,
        }
    }

    /// Returns the walls of a corridor along x, 2 m wide, with an end at x = 4 m.
    fn corridor() -> Faces {
        Faces::new(vec![[[-1.0, -1.0], [4.0, -1.0]], [[4.0, -1.0], [4.0, 1.0]], [[4.0, 1.0], [-1.0, 1.0]]])
    }

    fn marker(id: u32, x: f64, y: f64, facing_deg: f64) -> Marker {
        Marker { id, at: [x, y], facing_deg }
    }

    fn seen(model: &MarkerCamera, markers: &[Marker], people: &[([f64; 2], f64)]) -> MarkerView {
        let (faces, mut view) = (corridor(), MarkerView::zeroed());
        let scene = Scene { robot: Pose::new(0.0, 0.0, 0.0), faces: &faces, people };
        Camera::new(model, markers, seed::stream(1, "camera")).fill(&scene, 0, &mut view);
        view
    }

    fn ids(view: &MarkerView) -> Vec<u32> {
        view.markers().iter().map(|marker| marker.id).collect()
    }

    #[test]
    fn a_marker_is_seen_if_it_is_in_view_near_and_facing_the_camera() {
        let markers = [
            marker(9, 3.0, -1.0, 90.0), // on the right wall
            marker(2, 3.0, 1.0, -90.0), // on the left wall
            marker(3, 0.8, 1.0, -90.0), // beside the field of view
            marker(4, 3.0, 1.0, 90.0),  // looks away
            marker(5, 4.0, 0.0, 180.0), // too far
            marker(6, 3.0, -1.6, 90.0), // behind the wall
        ];
        let view = seen(&model(), &markers, &[]);
        assert_eq!(ids(&view), [2, 9]);
        let left = view.markers[0];
        assert!((left.x_m - 3.0).abs() < 1e-5 && (left.y_m - 1.0).abs() < 1e-5, "{left:?}");
        assert!((left.facing_rad + std::f32::consts::FRAC_PI_2).abs() < 1e-5, "{left:?}");
        let near = MarkerCamera { range_max_m: 2.5, ..model() };
        assert!(ids(&seen(&near, &markers, &[])).is_empty());
        let facing = MarkerCamera { slant_max_deg: 60.0, ..model() };
        assert!(ids(&seen(&facing, &markers, &[])).is_empty());
    }

    /// 640 pixels and 58 degrees give a focal length of 577 pixels, so a marker of 0.2 m covers 115 pixels at a distance of 1
    /// m. It must cover 16 pixels to be detected, which it does up to 7.2 m away, or half of that if it is turned by 60
    /// degrees.
    #[test]
    fn the_range_of_a_marker_follows_from_its_side_and_the_pixels() {
        let pixels =
            Pixels { width_px: 640.0, marker_side_m: 0.2, side_bits: 8.0, least_bit_px: 2.0, corner_px: 0.0 };
        let model = MarkerCamera { range_max_m: 100.0, pixels: Some(pixels), ..model() };
        let found = |distance_m, slant_deg: f64| model.resolves(distance_m, slant_deg.to_radians());
        assert_eq!([7.2, 7.3].map(|distance_m| found(distance_m, 0.0)), [true, false]);
        assert_eq!([3.6, 3.65].map(|distance_m| found(distance_m, 60.0)), [true, false]);
        let facing = [marker(1, 3.9, 0.0, 180.0), marker(2, 3.9, 0.2, 243.0)];
        assert_eq!(ids(&seen(&model, &facing, &[])), [1], "the second one is seen at 60 degrees");
    }

    /// A side of 0.2 m covers 38 pixels at 3 m. A corner that is off by a third of a pixel results in a distance error of 0.9
    /// %, and of twice that at twice the distance.
    #[test]
    fn the_error_of_a_distance_follows_from_the_pixels() {
        let pixels = Pixels {
            width_px: 640.0,
            marker_side_m: 0.2,
            side_bits: 8.0,
            least_bit_px: 2.0,
            corner_px: 1.0 / 3.0,
        };
        let model = MarkerCamera { pixels: Some(pixels), ..model() };
        let error = |distance_m| model.distance_error(distance_m, 1.2);
        assert!((error(3.0) - 0.00866).abs() < 1e-5, "{}", error(3.0));
        assert!((error(6.0) / error(3.0) - 2.0).abs() < 1e-12);
        let bare = MarkerCamera { noise_per_m: 0.01, pixels: None, ..model };
        assert!((bare.distance_error(3.0, 60_f64.to_radians()) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_person_hides_a_marker() {
        let markers = [marker(2, 3.0, 1.0, -90.0), marker(9, 3.0, -1.0, 90.0)];
        assert_eq!(ids(&seen(&model(), &markers, &[([1.6, 0.5], 0.25)])), [9]);
    }

    #[test]
    fn errors_grow_with_distance_and_markers_are_missed_at_the_stated_rate() {
        let model = MarkerCamera { noise_per_m: 0.01, miss: 0.1, slant_max_deg: 89.0, ..model() };
        let (faces, mut view) = (Faces::new(vec![[[9.0, 9.0], [9.0, 8.0]]]), MarkerView::zeroed());
        let markers = [marker(1, 1.2, 0.0, 180.0), marker(2, 3.2, 0.5, 180.0)];
        let camera = Camera::new(&model, &markers, seed::stream(1, "camera"));
        let scene = Scene { robot: Pose::new(0.0, 0.0, 0.0), faces: &faces, people: &[] };
        let (mut errors, mut counts) = ([0.0, 0.0], [0.0_f64, 0.0]);
        for number in 0..4000 {
            camera.fill(&scene, number, &mut view);
            for seen in view.markers() {
                let i = seen.id as usize - 1;
                let distance_m = f64::from(seen.x_m - 0.2).hypot(seen.y_m.into());
                let true_m = (markers[i].at[0] - 0.2).hypot(markers[i].at[1]);
                errors[i] += (distance_m - true_m).powi(2);
                counts[i] += 1.0;
            }
        }
        let deviations = [0, 1].map(|i| (errors[i] / counts[i]).sqrt());
        assert!((deviations[0] - 0.01).abs() < 0.001, "{deviations:?}");
        assert!((deviations[1] / 0.0312 - 1.0).abs() < 0.1, "{deviations:?}");
        let missed = counts.map(|count| 1.0 - count / 4000.0);
        assert!((missed[0] - 0.107).abs() < 0.02 && (missed[1] - 0.184).abs() < 0.02, "{missed:?}");
    }
}
