//! The page's view of a drive in a drawing: the estimate with its particles, the laser hits as placed by the
//! estimate, the plan, the parts of the drawn outline seen so far, and the robot's question.

use sketchnav_schemas::channels::SCAN;
use sketchnav_schemas::codes::Tracking;
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch};
use sketchnav_schemas::message::LaserScan;
use sketchnav_schemas::robot::Robot;
use sketchnav_stage::lookout::{self, Color, Picture, Shape, Sheet, Stroke, Walls, Whereabouts, thinned};
use sketchnav_stage::{Denied, Incoming};

use crate::messages::{
    CORRESPONDENCE, Correspondence, ESTIMATE, PARTICLES, PLAN, Particles, PartnerKind, Plan, PoseEstimate,
    QUESTION, Question, QuestionKind, SKETCH, SketchMap,
};
use crate::paths::chart::Chart;

/// Number of estimates that may still refer to the previous sketch after a new one arrives, because they were already in
/// flight.
const IN_FLIGHT: u32 = 2;

/// Keeps the latest messages of a drive and draws them.
pub struct Lookout {
    robot: Robot,
    /// Sequence number of the current sketch, or 0 before the first one.
    sketch_seq: u64,
    size_px: Option<[u32; 2]>,
    /// Whether the sketch marks where the robot starts.
    is_marked: bool,
    wall_direction_rad: f64,
    walls: Option<Walls>,
    /// Number of estimates yet to arrive that may still refer to an earlier sketch.
    in_flight: u32,
    tracking: Option<Tracking>,
    estimate: Option<Box<PoseEstimate>>,
    scan: Option<Box<LaserScan>>,
    plan: Option<Box<Plan>>,
    particles: Option<Box<Particles>>,
    correspondence: Option<Box<Correspondence>>,
    question: Option<Box<Question>>,
}

impl Lookout {
    /// Creates a lookout for a drive of a robot.
    pub fn new(robot: &Robot) -> Self {
        Self {
            robot: robot.clone(),
            sketch_seq: 0,
            size_px: None,
            is_marked: true,
            wall_direction_rad: 0.0,
            walls: None,
            in_flight: 0,
            tracking: None,
            estimate: None,
            scan: None,
            plan: None,
            particles: None,
            correspondence: None,
            question: None,
        }
    }

    fn take_sketch(&mut self, map: &SketchMap, cells: &[u8]) {
        let size_px = [map.width_px, map.height_px];
        (self.size_px, self.wall_direction_rad) = (Some(size_px), map.wall_direction_rad);
        self.is_marked = !map.start().is_anywhere(size_px.map(|side| side as usize));
        self.walls = Some(Walls { size_px, cells: cells.to_vec() });
        if map.header.seq != self.sketch_seq {
            // All messages so far refer to the previous sketch.
            (self.sketch_seq, self.in_flight) = (map.header.seq, IN_FLIGHT);
            (self.estimate, self.plan, self.particles, self.correspondence) = (None, None, None, None);
        }
    }

    fn take_estimate(&mut self, estimate: &PoseEstimate) {
        self.tracking = Tracking::from_code(estimate.tracking);
        match self.in_flight.checked_sub(1) {
            Some(left) => self.in_flight = left,
            None => self.estimate = Some(Box::new(*estimate)),
        }
    }
}

impl lookout::Lookout for Lookout {
    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), Denied> {
        if let Some(map) = message.on(SKETCH)? {
            self.take_sketch(map, message.cells());
        }
        if let Some(estimate) = message.on(ESTIMATE)? {
            self.take_estimate(estimate);
        }
        keep(&mut self.scan, message.on(SCAN)?);
        keep(&mut self.plan, message.on(PLAN)?);
        keep(&mut self.particles, message.on(PARTICLES)?);
        keep(&mut self.correspondence, message.on(CORRESPONDENCE)?);
        keep(&mut self.question, message.on(QUESTION)?);
        Ok(())
    }

    fn sheet(&self) -> Sheet {
        Sheet::Drawing(self.size_px)
    }

    fn take_walls(&mut self) -> Option<Walls> {
        self.walls.take()
    }

    fn is_ready(&self) -> bool {
        self.tracking.is_some_and(|tracking| tracking != Tracking::Waiting)
    }

    fn question(&self) -> Option<Vec<[f64; 2]>> {
        let question = self.question.as_ref()?;
        let kind = QuestionKind::from_code(question.kind).unwrap_or(QuestionKind::Nothing);
        let places = || question.places().iter().map(|place| [place.x_px, place.y_px]).collect();
        (kind != QuestionKind::Nothing).then(places)
    }

    fn draw(&mut self, picture: &mut Picture) {
        let Some(estimate) = self.estimate.as_deref() else { return };
        picture.lasting = self.correspondence.take().map(|found| outline(&found).into());
        // Where the drawing looks alike elsewhere, the particles agree on one of the places by chance. The question says that it is one.
        let is_placed = self.is_marked || self.question().is_none();
        picture.robot = robot(estimate, &self.robot).filter(|_| is_placed);
        if picture.robot.is_none() {
            return;
        }
        picture.particles = self.particles.take().map(|sample| particles(&sample));
        picture.shapes.extend(self.plan.iter().flat_map(|plan| ways(plan)));
        let hits =
            self.scan.as_deref().map(|scan| hits(scan, estimate, self.wall_direction_rad, &self.robot));
        picture.shapes.extend(hits.map(|points| Shape::Dots { points, color: Color::Scan }));
    }
}

/// Replaces the latest message of a channel if another one has arrived.
fn keep<T: Copy>(newest: &mut Option<Box<T>>, message: Option<&T>) {
    if let Some(message) = message {
        *newest = Some(Box::new(*message));
    }
}

/// Returns the robot's estimated pose, or `None` while the localizer is still waiting for its first input, or if it does not
/// know yet where the robot is.
fn robot(estimate: &PoseEstimate, robot: &Robot) -> Option<Whereabouts> {
    let tracking = Tracking::from_code(estimate.tracking).filter(|t| *t != Tracking::Waiting)?;
    if !estimate.is_placed() {
        return None;
    }
    let pose = estimate.pose.pose();
    let scale_pxpm = (estimate.scale_a_pxpm * estimate.scale_b_pxpm).sqrt();
    let [major, minor, angle] = ellipse(&estimate.covariance);
    Some(Whereabouts {
        at: [pose.x, pose.y],
        heading_rad: pose.yaw_rad,
        ellipse: [2.0 * major, 2.0 * minor, angle],
        radius: robot.radius_m * scale_pxpm,
        tracking,
        effective: estimate.effective_sample_size / f64::from(estimate.particle_count.max(1)),
    })
}

/// Returns the standard deviations along the major and minor axes of the covariance of x and y, and the direction of the major
/// axis in radians.
fn ellipse(covariance: &[f64; 25]) -> [f64; 3] {
    let (xx, xy, yy) = (covariance[0], covariance[1], covariance[6]);
    let middle = f64::midpoint(xx, yy);
    let spread = ((xx - yy) / 2.0).hypot(xy);
    let deviation = |variance: f64| variance.max(0.0).sqrt();
    [deviation(middle + spread), deviation(middle - spread), 0.5 * (2.0 * xy).atan2(xx - yy)]
}

/// Returns the positions of a thinned sample of the particles, in sketch pixels.
fn particles(particles: &Particles) -> Vec<[f64; 2]> {
    let count = (particles.count as usize).min(particles.particles.len());
    thinned(particles.particles[..count].iter()).map(|p| [p.x_px.into(), p.y_px.into()]).collect()
}

/// Returns the parts of the drawn outline whose walls the robot has seen, and the parts beyond gaps in its map.
fn outline(found: &Correspondence) -> [Shape; 2] {
    let of = |kind: PartnerKind, color| {
        let samples = found.samples().iter().filter(|sample| sample.partner == kind.code());
        Shape::Dots {
            points: samples.map(|sample| [sample.x_px.into(), sample.y_px.into()]).collect(),
            color,
        }
    };
    [of(PartnerKind::Wall, Color::Seen), of(PartnerKind::Gap, Color::Hidden)]
}

/// Returns the planned paths, one through the drawing to the end of the task and one around the obstacles in the laser's view.
fn ways(plan: &Plan) -> [Shape; 2] {
    let line = |points: &[[f32; 2]], count: u32, stroke| {
        let points = &points[..(count as usize).min(points.len())];
        let points = thinned(points.iter()).map(|point| point.map(f64::from)).collect();
        Shape::Line { points, color: Color::Plan, stroke }
    };
    [
        line(&plan.global_px, plan.global_count, Stroke::Dashed),
        line(&plan.local_px, plan.local_count, Stroke::Bold),
    ]
}

/// Returns the laser hits in sketch pixels, placed by the estimate's pose and local scales. Empty if the estimate has no valid
/// scales or the robot has no laser.
fn hits(scan: &LaserScan, estimate: &PoseEstimate, wall_direction_rad: f64, robot: &Robot) -> Vec<[f64; 2]> {
    let Some(chart) = Chart::new(estimate, wall_direction_rad) else { return Vec::new() };
    let Some(laser) = &robot.laser else { return Vec::new() };
    let sensor: Pose<Odom> = chart.robot_m().compose(&laser.mount());
    let place = |(i, range): (usize, &f32)| -> Option<[f64; 2]> {
        let hit = range.is_finite() && (scan.range_min_m..=scan.range_max_m).contains(range);
        hit.then(|| {
            let angle = sensor.yaw_rad + f64::from(scan.angle_rad(i));
            let range = f64::from(*range);
            let there = Point::<Odom>::new(sensor.x + range * angle.cos(), sensor.y + range * angle.sin());
            let there: Point<Sketch> = chart.to_sketch(there);
            [there.x, there.y]
        })
    };
    let places: Vec<_> = scan.ranges().iter().enumerate().filter_map(place).collect();
    thinned(places.into_iter()).collect()
}

#[cfg(test)]
mod tests;
