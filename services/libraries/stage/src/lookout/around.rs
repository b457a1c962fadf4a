//! A view of a robot's surroundings, drawn from its sensors in the robot's own axes.

use std::f64::consts::PI;

use sketchnav_schemas::channels::{SCAN, SONAR};
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::{LaserScan, SonarScan};
use sketchnav_schemas::robot::{MarkerCamera, Robot};

use super::{Color, Lookout, Picture, Shape, thinned};
use crate::{Denied, Incoming};

/// Maximum distance shown to each side, in metres.
const MOST_REACH_M: f64 = 6.0;
/// Distance shown to each side for a camera that looks down, as a multiple of the side of its view.
const WINDOWS: f64 = 3.0;
/// Minimum number of corners of an arc, and maximum angle between two of them, in radians.
const ARC: usize = 6;
const CORNER_RAD: f64 = 0.25;

/// The part of the surroundings that is shown around a robot: a square with the robot at its centre, facing up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    /// Distance from the robot to each side, in metres.
    pub reach_m: f64,
}

impl Around {
    /// Returns the surroundings that the robot's sensors reach.
    pub fn robot(robot: &Robot) -> Self {
        let ranges = [
            robot.laser.as_ref().map(|laser| laser.range_max_m),
            robot.sonar.as_ref().map(|sonar| sonar.range_max_m),
            robot.camera.as_ref().map(|camera| camera.range_max_m),
        ];
        let reach_m = match &robot.view {
            // The robot has a camera that looks down.
            Some(view) => WINDOWS * view.side_m,
            None => ranges.into_iter().flatten().fold(0.0, f64::max).clamp(1.0, MOST_REACH_M),
        };
        Self { reach_m }
    }

    /// Returns true if the sheet shows a position.
    pub fn shows(&self, place: [f64; 2]) -> bool {
        place.iter().all(|v| v.abs() <= self.reach_m)
    }
}

/// Returns the point at a distance and in a direction from `origin`.
pub fn polar(origin: [f64; 2], range_m: f64, angle_rad: f64) -> [f64; 2] {
    [origin[0] + range_m * angle_rad.cos(), origin[1] + range_m * angle_rad.sin()]
}

/// A lookout that shows the readings of the robot's laser and sonars, and the field of view of its camera.
pub struct Sensors {
    robot: Robot,
    around: Around,
    scan: Option<Box<LaserScan>>,
    sonar: Option<SonarScan>,
}

impl Sensors {
    /// Creates the view of a robot's sensors.
    pub fn new(robot: &Robot) -> Self {
        Self { robot: robot.clone(), around: Around::robot(robot), scan: None, sonar: None }
    }

    /// Returns the end points of the laser's beams.
    fn hits(&self) -> Option<Shape> {
        let scan = self.scan.as_ref()?;
        let mount: Pose<_> = self.robot.laser.as_ref()?.mount();
        let hits = scan.ranges().iter().enumerate().filter(|(_, range)| range.is_finite());
        let points = hits.map(|(i, range)| {
            polar([mount.x, mount.y], f64::from(*range), mount.yaw_rad + f64::from(scan.angle_rad(i)))
        });
        let points: Vec<_> = points.filter(|point| self.around.shows(*point)).collect();
        Some(Shape::Dots { points: thinned(points.into_iter()).collect(), color: Color::Scan })
    }
}

impl Lookout for Sensors {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        if let Some(scan) = message.on(SCAN)? {
            self.scan = Some(Box::new(*scan));
        }
        if let Some(scan) = message.on(SONAR)? {
            self.sonar = Some(*scan);
        }
        Ok(())
    }

    fn draw(&mut self, picture: &mut Picture) {
        picture.shapes.extend(self.hits());
        picture.shapes.extend(self.sonar.iter().flat_map(echoes));
        picture.shapes.extend(self.robot.camera.iter().flat_map(view_cone));
    }
}

/// Returns an arc for each echo of the sonars.
fn echoes(scan: &SonarScan) -> Vec<Shape> {
    let echo = |(i, range): (usize, &f32)| {
        let direction = f64::from(scan.angle_min_rad) + i as f64 * f64::from(scan.angle_increment_rad);
        let origin = polar([0.0; 2], f64::from(scan.ring_radius_m), direction);
        arc(origin, f64::from(*range), direction, f64::from(scan.half_opening_rad), Color::Scan)
    };
    scan.ranges().iter().enumerate().filter(|(_, range)| range.is_finite()).map(echo).collect()
}

fn arc(origin: [f64; 2], range_m: f64, direction_rad: f64, half_rad: f64, color: Color) -> Shape {
    let corners = ((2.0 * half_rad / CORNER_RAD).ceil() as usize).max(ARC);
    let angle = |i: usize| direction_rad + half_rad * (2.0 * i as f64 / (corners - 1) as f64 - 1.0);
    Shape::line((0..corners).map(|i| polar(origin, range_m, angle(i))).collect::<Vec<_>>(), color)
}

/// Returns the outline of a camera's field of view.
fn view_cone(camera: &MarkerCamera) -> Vec<Shape> {
    let origin = [camera.mount_x_m, camera.mount_y_m];
    let (yaw, half) = (camera.mount_yaw_deg.to_radians(), camera.field_of_view_deg.to_radians() / 2.0);
    let ranges = [camera.range_min_m, camera.range_max_m];
    let side = |turn: f64| Shape::line(ranges.map(|range| polar(origin, range, yaw + turn)), Color::Edge);
    let arcs = ranges.map(|range| arc(origin, range, yaw, half, Color::Edge));
    // A camera that sees all around has no sides.
    let sides = if half < PI { vec![side(half), side(-half)] } else { Vec::new() };
    sides.into_iter().chain(arcs).collect()
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    #[test]
    fn an_echo_is_an_arc_at_its_range() {
        let mut scan = SonarScan::zeroed();
        (scan.sonar_count, scan.half_opening_rad) = (2, 0.2);
        scan.ranges_m[..2].copy_from_slice(&[1.5, f32::INFINITY]);
        let shapes = echoes(&scan);
        let [Shape::Line { points, .. }] = &shapes[..] else { panic!("{shapes:?}") };
        assert!(points.iter().all(|point| point[0] <= 1.5), "no point is farther ahead: {points:?}");
    }
}
