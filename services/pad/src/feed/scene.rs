//! A picture of what a robot knows of its surroundings, for navigators that have no drawing. The robot stands in the
//! middle of the canvas and looks up; shapes lie around it. Pure, as all of the feed.

use serde::Serialize;
use sketchnav_schemas::codes::Trend;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::{KnownMarker, LaserScan, PairedMarker, Relations, SonarScan};
use sketchnav_schemas::robot::{MarkerCamera, Robot};

use super::{PoseView, tenth, thinned};

/// Side of the canvas, pixels.
pub const SIDE_PX: u32 = 1000;
/// Most that is shown to each side, metres.
const MOST_REACH_M: f64 = 6.0;
/// How many windows of a camera that looks down are shown to each side.
const WINDOWS: f64 = 3.0;
/// Length of the mark that says where a marker looks, metres.
const FACING_M: f64 = 0.25;
/// Corners of an arc.
const ARC: usize = 6;

/// A thing on the canvas, in its pixels.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "kebab-case")]
pub enum Shape {
    /// A line through points.
    Line {
        /// The points.
        points: Vec<[f64; 2]>,
        /// Its colour.
        color: Color,
    },
    /// A filled polygon, half transparent.
    Area {
        /// The corners.
        points: Vec<[f64; 2]>,
        /// Its colour.
        color: Color,
    },
    /// Small squares.
    Dots {
        /// Their middles.
        points: Vec<[f64; 2]>,
        /// Their colour.
        color: Color,
    },
    /// Words.
    Text {
        /// Their middle.
        at: [f64; 2],
        /// The words.
        text: String,
        /// Their colour.
        color: Color,
    },
}

/// A colour of the page's theme, by what it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Color {
    /// Edges of what a sensor could see.
    Edge,
    /// Words and outlines.
    Ink,
    /// What is in the way.
    Obstacle,
    /// What a sensor sees.
    Scan,
    /// What is remembered.
    Particle,
    /// What the robot goes by.
    Goal,
    /// Where the robot is about to go.
    Plan,
}

/// Joins the robot's frame and the canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    px_per_m: f64,
}

impl Around {
    /// As far as the robot's sensors see.
    pub fn robot(robot: &Robot) -> Self {
        let ranges = [
            robot.laser.as_ref().map(|laser| laser.range_max_m),
            robot.sonar.as_ref().map(|sonar| sonar.range_max_m),
            robot.camera.as_ref().map(|camera| camera.range_max_m),
        ];
        let reach_m = match &robot.view {
            // Of a robot that looks down.
            Some(view) => WINDOWS * view.side_m,
            None => ranges.into_iter().flatten().fold(0.0, f64::max).clamp(1.0, MOST_REACH_M),
        };
        Self { px_per_m: f64::from(SIDE_PX) / 2.0 / reach_m }
    }

    /// A place on the canvas: `x_m` forward of the robot's centre, `y_m` to its left.
    pub fn point(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let middle = f64::from(SIDE_PX) / 2.0;
        [tenth(middle - y_m * self.px_per_m), tenth(middle - x_m * self.px_per_m)]
    }

    fn polar(&self, origin: [f64; 2], range_m: f64, angle_rad: f64) -> [f64; 2] {
        self.point(origin[0] + range_m * angle_rad.cos(), origin[1] + range_m * angle_rad.sin())
    }

    fn is_on_canvas([x, y]: [f64; 2]) -> bool {
        let side = f64::from(SIDE_PX);
        (0.0..=side).contains(&x) && (0.0..=side).contains(&y)
    }

    /// The robot.
    pub fn pose(&self, robot: &Robot) -> PoseView {
        let [x, y] = self.point(0.0, 0.0);
        PoseView {
            x,
            y,
            heading_rad: std::f64::consts::FRAC_PI_2,
            ellipse: [0.0; 3],
            radius_px: tenth(robot.radius_m * self.px_per_m),
            tracking: sketchnav_schemas::codes::Tracking::Tracking.word(),
            effective: 1.0,
        }
    }

    /// What the laser sees.
    pub fn scan(&self, scan: &LaserScan, robot: &Robot) -> Option<Shape> {
        let mount: Pose<_> = robot.laser.as_ref()?.mount();
        let hits = scan.ranges().iter().enumerate().filter(|(_, range)| range.is_finite());
        let points = hits.map(|(i, range)| {
            self.polar([mount.x, mount.y], f64::from(*range), mount.yaw_rad + f64::from(scan.angle_rad(i)))
        });
        let points: Vec<_> = points.filter(|point| Self::is_on_canvas(*point)).collect();
        Some(Shape::Dots { points: thinned(points.into_iter()).collect(), color: Color::Scan })
    }

    /// What the sonars hear: an arc for each echo.
    pub fn sonar(&self, scan: &SonarScan) -> Vec<Shape> {
        let count = (scan.sonar_count as usize).min(scan.ranges_m.len());
        let arc = |(i, range): (usize, &f32)| {
            let direction = f64::from(scan.angle_min_rad) + i as f64 * f64::from(scan.angle_increment_rad);
            let ring = f64::from(scan.ring_radius_m);
            let origin = [ring * direction.cos(), ring * direction.sin()];
            self.arc(origin, f64::from(*range), direction, f64::from(scan.half_opening_rad), Color::Scan)
        };
        scan.ranges_m[..count].iter().enumerate().filter(|(_, range)| range.is_finite()).map(arc).collect()
    }

    fn arc(&self, origin: [f64; 2], range_m: f64, direction_rad: f64, half_rad: f64, color: Color) -> Shape {
        let angle = |i: usize| direction_rad + half_rad * (2.0 * i as f64 / (ARC - 1) as f64 - 1.0);
        Shape::Line { points: (0..ARC).map(|i| self.polar(origin, range_m, angle(i))).collect(), color }
    }

    /// What a camera can see.
    pub fn view_cone(&self, camera: &MarkerCamera) -> Vec<Shape> {
        let origin = [camera.mount_x_m, camera.mount_y_m];
        let (yaw, half) = (camera.mount_yaw_deg.to_radians(), camera.field_of_view_deg.to_radians() / 2.0);
        let side = |turn: f64| Shape::Line {
            points: [camera.range_min_m, camera.range_max_m]
                .map(|range| self.polar(origin, range, yaw + turn))
                .into(),
            color: Color::Edge,
        };
        let arcs = [camera.range_min_m, camera.range_max_m]
            .map(|range| self.arc(origin, range, yaw, half, Color::Edge));
        [side(half), side(-half)].into_iter().chain(arcs).collect()
    }

    /// The markers that a robot remembers, and the pair that it goes by.
    pub fn relations(&self, relations: &Relations) -> Vec<Shape> {
        let mut shapes: Vec<_> = relations.markers().iter().flat_map(|marker| self.marker(marker)).collect();
        if relations.pairs > 0 && relations.pair_age_s == 0.0 {
            shapes
                .extend([("left", &relations.left), ("right", &relations.right)].map(|(_, m)| self.sight(m)));
            let words = [&relations.left, &relations.right].map(|marker| {
                format!(
                    "{} is {}, {}",
                    marker.id,
                    class_word(marker.distance_class),
                    trend_word(marker.marker_trend())
                )
            });
            let middle = f64::from(SIDE_PX) / 2.0;
            let rows = words.into_iter().zip([30.0, 60.0]);
            shapes.extend(rows.map(|(text, y)| Shape::Text { at: [middle, y], text, color: Color::Ink }));
        }
        shapes
    }

    fn marker(&self, marker: &KnownMarker) -> Vec<Shape> {
        let [x, y, facing] = [marker.x_m, marker.y_m, marker.facing_rad].map(f64::from);
        let at = self.point(x, y);
        if !Self::is_on_canvas(at) {
            return Vec::new();
        }
        let color = if marker.age_s == 0.0 { Color::Goal } else { Color::Particle };
        let beside = self.polar([x, y], -FACING_M, facing);
        vec![
            Shape::Line { points: vec![at, self.polar([x, y], FACING_M, facing)], color },
            Shape::Text { at: beside, text: marker.id.to_string(), color: Color::Ink },
        ]
    }

    fn sight(&self, marker: &PairedMarker) -> Shape {
        let points = vec![self.point(0.0, 0.0), self.point(marker.x_m, marker.y_m)];
        Shape::Line { points, color: Color::Plan }
    }
}

fn class_word(class: u32) -> &'static str {
    ["near", "medium", "far"].get(class as usize).copied().unwrap_or("of no class")
}

fn trend_word(trend: Trend) -> &'static str {
    match trend {
        Trend::Towards => "coming nearer",
        Trend::Stable => "at the same distance",
        Trend::Away => "going away",
        Trend::Unknown => "seen for the first time",
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    fn youbot() -> Robot {
        Robot::parse(include_str!("../../../../sim/robots/youbot.toml")).unwrap()
    }

    #[test]
    fn ahead_is_up_and_left_is_left() {
        let around = Around::robot(&youbot());
        let [middle, ahead, left] = [around.point(0.0, 0.0), around.point(1.0, 0.0), around.point(0.0, 1.0)];
        assert_eq!(middle, [500.0, 500.0]);
        assert!(ahead[0] == 500.0 && ahead[1] < 500.0, "{ahead:?}");
        assert!(left[0] < 500.0 && left[1] == 500.0, "{left:?}");
        assert_eq!(around.pose(&youbot()).heading_rad, std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn an_echo_is_an_arc_as_far_away_as_it_says() {
        let around = Around::robot(&youbot());
        let mut scan = SonarScan::zeroed();
        (scan.sonar_count, scan.half_opening_rad) = (2, 0.2);
        scan.ranges_m[..2].copy_from_slice(&[1.5, f32::INFINITY]);
        let shapes = around.sonar(&scan);
        let [Shape::Line { points, .. }] = &shapes[..] else { panic!("{shapes:?}") };
        let [_, y] = around.point(1.5, 0.0);
        assert!(points.iter().all(|point| point[1] >= y), "no point is farther ahead: {points:?}");
    }

    /// A marker behind the edge of the canvas would be drawn over what is beside it.
    #[test]
    fn a_pair_is_told_in_words_and_a_far_marker_is_left_out() {
        let around = Around::robot(&youbot());
        let mut relations = Relations::zeroed();
        (relations.pairs, relations.marker_count) = (1, 2);
        relations.markers[0] = KnownMarker { id: 3, x_m: 2.0, y_m: 1.0, ..KnownMarker::zeroed() };
        relations.markers[1] = KnownMarker { id: 4, x_m: 90.0, ..KnownMarker::zeroed() };
        (relations.left.id, relations.left.distance_class) = (3, 1);
        relations.left.marker_trend = Trend::Towards.code();
        let words: Vec<_> = around
            .relations(&relations)
            .into_iter()
            .filter_map(|shape| if let Shape::Text { text, .. } = shape { Some(text) } else { None })
            .collect();
        assert_eq!(words[..2], ["3", "3 is medium, coming nearer"]);
        assert!(!words.contains(&"4".to_owned()), "{words:?}");
    }
}
