//! Standard messages that are derived from our own, for viewers: a 3D panel draws a `nav_msgs/Path`, but no `Plan`.
//!
//! Each derived topic belongs to a channel and is made of one message of it. Nothing reads them back, and recordings do
//! not hold them. Lengths in frame `sketch` are pixels, as everywhere; in all other frames they are metres.

use ros2_interfaces_jazzy_serde::{
    geometry_msgs::msg::{Point, Pose, PoseArray, PoseStamped, Vector3},
    nav_msgs::msg::{OccupancyGrid, Path},
    std_msgs::msg::{ColorRGBA, Header as HeaderForm},
    visualization_msgs::msg::{Marker, MarkerArray},
};

use super::fields::pose;
use super::parts::header_form;
use super::{Field, Ros2Error, definitions, encode};
use crate::channels::{
    CORRESPONDENCE, ChannelSpec, ESTIMATE, LANDMARK_VIEW, PARTICLES, PEOPLE, PLAN, RELATIONS, ROUTE, SKETCH,
    VIEW,
};
use crate::message::{
    Correspondence, DotView, Header, LandmarkView, Particles, People, Plan, PoseEstimate, Relations, Route,
    SketchMap,
};

/// A topic of standard messages, each made of one message of a channel.
#[derive(Clone, Copy)]
pub struct Derived {
    /// `/plan/global`.
    pub topic: &'static str,
    /// The channel.
    pub of: &'static ChannelSpec,
    /// `nav_msgs/msg/Path`.
    pub ros2: &'static str,
    encode: Encode,
}

/// Appends what is derived of a message and its cells to a buffer, in CDR.
type Encode = fn(&[u8], &[u8], &mut Vec<u8>) -> Result<(), Ros2Error>;

impl Derived {
    /// The `ros2msg` schema.
    pub fn schema(&self) -> String {
        definitions::schema(self.ros2, &[])
    }

    /// Appends what is derived of a message of the channel to `out`, in CDR.
    ///
    /// # Errors
    /// [`Ros2Error`] where the message cannot be said in ROS 2; `out` is then of no use.
    ///
    /// # Panics
    /// Where `message` is not of the channel's size and alignment.
    pub fn encode(&self, message: &[u8], cells: &[u8], out: &mut Vec<u8>) -> Result<(), Ros2Error> {
        (self.encode)(message, cells, out)
    }
}

macro_rules! derived {
    ($($topic:literal: $ros2:literal = $form:ident($channel:ident);)*) => {
        const TABLE: &[Derived] = &[$(Derived {
            topic: $topic,
            of: $channel.spec,
            ros2: $ros2,
            encode: |message, cells, out| encode(&$form(bytemuck::from_bytes(message), cells)?, out),
        }),*];
    };
}

derived! {
    "/sketch/grid": "nav_msgs/msg/OccupancyGrid" = sketch_grid(SKETCH);
    "/route/markers": "visualization_msgs/msg/MarkerArray" = route_markers(ROUTE);
    "/particles/poses": "geometry_msgs/msg/PoseArray" = particle_poses(PARTICLES);
    "/estimate/pose": "geometry_msgs/msg/PoseStamped" = estimate_pose(ESTIMATE);
    "/plan/global": "nav_msgs/msg/Path" = global_path(PLAN);
    "/plan/local": "nav_msgs/msg/Path" = local_path(PLAN);
    "/correspondence/way": "nav_msgs/msg/Path" = way_path(CORRESPONDENCE);
    "/correspondence/markers": "visualization_msgs/msg/MarkerArray" = outline_markers(CORRESPONDENCE);
    "/relations/markers": "visualization_msgs/msg/MarkerArray" = known_markers(RELATIONS);
    "/landmark_view/markers": "visualization_msgs/msg/MarkerArray" = landmark_markers(LANDMARK_VIEW);
    "/view/markers": "visualization_msgs/msg/MarkerArray" = dot_markers(VIEW);
    "/people/markers": "visualization_msgs/msg/MarkerArray" = people_markers(PEOPLE);
}

/// The topics that are derived of a channel.
pub fn of_channel(spec: &ChannelSpec) -> impl Iterator<Item = &'static Derived> {
    TABLE.iter().filter(move |derived| derived.of == spec)
}

fn stamped(header: &Header, frame: &str) -> Result<HeaderForm, Ros2Error> {
    header_form(header, frame, HeaderForm::default())
}

fn sketch_grid(sketch: &SketchMap, cells: &[u8]) -> Result<OccupancyGrid, Ros2Error> {
    sketch.grid(cells, OccupancyGrid::default())
}

fn estimate_pose(estimate: &PoseEstimate, _: &[u8]) -> Result<PoseStamped, Ros2Error> {
    let header = stamped(&estimate.header, "sketch")?;
    Ok(PoseStamped { header, pose: estimate.pose.to_form_in("pose", Pose::default())? })
}

fn particle_poses(particles: &Particles, _: &[u8]) -> Result<PoseArray, Ros2Error> {
    let pose = |x: f32, y: f32, yaw: f32| turned(x.into(), y.into(), yaw.into());
    let poses = first(&particles.particles, particles.count).iter();
    let poses = poses.map(|particle| pose(particle.x_px, particle.y_px, particle.yaw_rad)).collect();
    Ok(PoseArray { header: stamped(&particles.header, "sketch")?, poses })
}

fn global_path(plan: &Plan, _: &[u8]) -> Result<Path, Ros2Error> {
    path(&plan.header, "sketch", first(&plan.global_px, plan.global_count))
}

fn local_path(plan: &Plan, _: &[u8]) -> Result<Path, Ros2Error> {
    path(&plan.header, "sketch", first(&plan.local_px, plan.local_count))
}

fn way_path(found: &Correspondence, _: &[u8]) -> Result<Path, Ros2Error> {
    path(&found.header, "map", first(&found.way_m, found.way_count))
}

/// A line through points; each pose looks to the next one.
fn path(header: &Header, frame: &str, points: &[[f32; 2]]) -> Result<Path, Ros2Error> {
    let header = stamped(header, frame)?;
    let yaw = |i: usize| {
        let (from, to) = if i + 1 < points.len() { (i, i + 1) } else { (i.saturating_sub(1), i) };
        f64::from(points[to][1] - points[from][1]).atan2(f64::from(points[to][0] - points[from][0]))
    };
    let poses = points.iter().enumerate().map(|(i, [x, y])| PoseStamped {
        header: header.clone(),
        pose: turned(f64::from(*x), f64::from(*y), yaw(i)),
    });
    Ok(Path { poses: poses.collect(), header })
}

fn turned(x: f64, y: f64, yaw_rad: f64) -> Pose {
    pose(x, y, (yaw_rad / 2.0).sin(), (yaw_rad / 2.0).cos())
}

/// The entries that count.
fn first<T>(all: &[T], count: u32) -> &[T] {
    &all[..(count as usize).min(all.len())]
}

const ROUTE_COLOR: [f32; 4] = [0.85, 0.33, 0.1, 0.9];
const SEEN_COLOR: [f32; 4] = [0.93, 0.69, 0.13, 1.0];
const REMEMBERED_COLOR: [f32; 4] = [0.47, 0.53, 0.6, 0.9];
const PERSON_COLOR: [f32; 4] = [0.49, 0.18, 0.56, 0.9];

/// Shapes of one message, in one frame.
struct Shapes {
    header: HeaderForm,
    markers: Vec<Marker>,
}

impl Shapes {
    /// The first takes away those of the message before.
    fn new(header: &Header, frame: &str) -> Result<Self, Ros2Error> {
        let header = stamped(header, frame)?;
        let clear = Marker { header: header.clone(), action: Marker::DELETEALL, ..Marker::default() };
        Ok(Self { header, markers: vec![clear] })
    }

    fn add(&mut self, kind: i32, pose: Pose, scale: [f64; 3], color: [f32; 4]) -> &mut Marker {
        let [x, y, z] = scale;
        let id = self.markers.len();
        self.markers.push(Marker {
            header: self.header.clone(),
            id: id as i32, // far fewer than 2^31
            type_: kind,
            action: Marker::ADD,
            pose,
            scale: Vector3 { x, y, z },
            color: rgba(color),
            frame_locked: true,
            ..Marker::default()
        });
        &mut self.markers[id]
    }

    fn line(&mut self, points: impl Iterator<Item = [f64; 2]>, width: f64, color: [f32; 4]) {
        let marker = self.add(Marker::LINE_STRIP, turned(0.0, 0.0, 0.0), [width, 0.0, 0.0], color);
        marker.points = points.map(|[x, y]| Point { x, y, z: 0.0 }).collect();
    }

    fn text(&mut self, at: [f64; 2], height: f64, words: &str) {
        let marker =
            self.add(Marker::TEXT_VIEW_FACING, turned(at[0], at[1], 0.0), [height; 3], [0.1, 0.1, 0.1, 1.0]);
        words.clone_into(&mut marker.text);
    }

    fn disc(&mut self, at: [f64; 2], diameter: f64, color: [f32; 4]) {
        let scale = [diameter, diameter, diameter / 10.0];
        self.add(Marker::CYLINDER, turned(at[0], at[1], 0.0), scale, color);
    }

    fn finish(self) -> MarkerArray {
        MarkerArray { markers: self.markers }
    }
}

fn rgba([r, g, b, a]: [f32; 4]) -> ColorRGBA {
    ColorRGBA { r, g, b, a }
}

/// Goals as discs, drawn routes as lines, each with its name.
fn route_markers(route: &Route, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    const GOAL_PX: f64 = 12.0;
    let mut shapes = Shapes::new(&route.header, "sketch")?;
    for task in route.tasks() {
        let points: Vec<_> = route.points(task).map(|point| [point.x, point.y]).collect();
        let Some(&last) = points.last() else { continue };
        if points.len() > 1 {
            shapes.line(points.into_iter(), GOAL_PX / 4.0, ROUTE_COLOR);
        }
        shapes.disc(last, GOAL_PX, ROUTE_COLOR);
        shapes.text([last[0], last[1] + GOAL_PX], GOAL_PX, task.name.as_str());
    }
    Ok(shapes.finish())
}

/// Where the partners of the drawing's outline are in the map, and the goal among them.
fn outline_markers(found: &Correspondence, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    const SAMPLE_M: f64 = 0.08;
    let mut shapes = Shapes::new(&found.header, "map")?;
    let places = found.samples().iter().map(|sample| [f64::from(sample.x_m), f64::from(sample.y_m)]);
    let marker = shapes.add(Marker::SPHERE_LIST, turned(0.0, 0.0, 0.0), [SAMPLE_M; 3], REMEMBERED_COLOR);
    marker.points = places.map(|[x, y]| Point { x, y, z: 0.0 }).collect();
    shapes.disc(found.goal_m, 4.0 * SAMPLE_M, ROUTE_COLOR);
    shapes.disc([found.robot.x_m, found.robot.y_m], 4.0 * SAMPLE_M, SEEN_COLOR);
    Ok(shapes.finish())
}

/// The markers of a corridor that a robot remembers, each with its number and where it looks.
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

/// The returns in sixteen directions, and the places of objects that a robot remembers.
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

/// The edges of the window, and the dots in view.
fn dot_markers(view: &DotView, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    let (side_m, half_m) = (f64::from(view.side_m), f64::from(view.side_m) / 2.0);
    let mut shapes = Shapes::new(&view.header, "window")?;
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let corners = corners.into_iter().map(|corner| corner.map(|side: f64| side * half_m));
    shapes.line(corners, side_m / 100.0, REMEMBERED_COLOR);
    for dot in view.dots() {
        shapes.disc([dot.x_m, dot.y_m].map(f64::from), side_m / 30.0, SEEN_COLOR);
    }
    Ok(shapes.finish())
}

fn people_markers(people: &People, _: &[u8]) -> Result<MarkerArray, Ros2Error> {
    let mut shapes = Shapes::new(&people.header, "world")?;
    for person in people.people() {
        shapes.disc([person.x_m, person.y_m], 2.0 * person.radius_m, PERSON_COLOR);
    }
    Ok(shapes.finish())
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;
    use crate::channels::Channel;
    use crate::message::{Message, Particle, RouteTask, Text};
    use crate::ros2::decode;

    fn derive<T: Message, F: serde::de::DeserializeOwned>(
        topic: &str,
        channel: Channel<T>,
        message: &T,
        cells: &[u8],
    ) -> F {
        let derived = of_channel(channel.spec).find(|derived| derived.topic == topic).unwrap();
        let mut cdr = Vec::new();
        derived.encode(bytemuck::bytes_of(message), cells, &mut cdr).unwrap();
        decode(&cdr).unwrap()
    }

    fn sent<T: Message>() -> T {
        let mut message = T::zeroed();
        *message.header_mut() = Header { seq: 7, stamp_ns: 2_500_000_000, source_seq: 7 };
        message
    }

    #[test]
    fn a_plan_is_a_path_whose_poses_look_to_the_next_one() {
        let mut plan: Plan = sent();
        plan.global_count = 3;
        plan.global_px[..3].copy_from_slice(&[[1.0, 2.0], [1.0, 5.0], [0.0, 5.0]]);
        let path: Path = derive("/plan/global", PLAN, &plan, &[]);
        assert_eq!((path.header.frame_id.as_str(), path.header.stamp.nanosec), ("sketch", 500_000_000));
        let yaw = |i: usize| {
            let turn = &path.poses[i].pose.orientation;
            2.0 * turn.z.atan2(turn.w)
        };
        assert_eq!(path.poses.len(), 3);
        let quarter = std::f64::consts::FRAC_PI_2;
        for (i, expected) in [quarter, 2.0 * quarter, 2.0 * quarter].into_iter().enumerate() {
            assert!((yaw(i) - expected).abs() < 1e-9, "pose {i}: {}", yaw(i));
        }
        let empty: Path = derive("/plan/local", PLAN, &plan, &[]);
        assert_eq!(empty.poses.len(), 0);
    }

    #[test]
    fn particles_are_poses_and_those_behind_the_count_are_none() {
        let mut particles: Particles = sent();
        particles.count = 2;
        particles.particles[1] = Particle { x_px: 4.0, y_px: 3.0, yaw_rad: 1.0, ..Particle::zeroed() };
        let poses: PoseArray = derive("/particles/poses", PARTICLES, &particles, &[]);
        assert_eq!(poses.poses.len(), 2);
        assert_eq!((poses.poses[1].position.x, poses.poses[1].position.y), (4.0, 3.0));
        assert!((2.0 * poses.poses[1].orientation.z.asin() - 1.0).abs() < 1e-9);
    }

    /// Counts that a foreign writer made up are bounded; a viewer must not die of them.
    #[test]
    fn a_count_beyond_the_capacity_takes_what_there_is() {
        let mut particles: Particles = sent();
        particles.count = u32::MAX;
        let poses: PoseArray = derive("/particles/poses", PARTICLES, &particles, &[]);
        assert_eq!(poses.poses.len(), particles.particles.len());
    }

    #[test]
    fn a_sketch_is_a_grid_of_its_cells() {
        let mut sketch: SketchMap = sent();
        (sketch.width_px, sketch.height_px) = (2, 3);
        let grid: OccupancyGrid = derive("/sketch/grid", SKETCH, &sketch, &[0, 100, 0, 0, 100, 0]);
        assert_eq!((grid.info.width, grid.info.height, grid.info.resolution), (2, 3, 1.0));
        assert_eq!(grid.data, [0, 100, 0, 0, 100, 0]);
    }

    /// A goal has one point and no line; what was shown of an earlier route is taken away first.
    #[test]
    fn a_route_shows_its_goals_by_name() {
        let mut route: Route = sent();
        (route.task_count, route.point_count) = (2, 3);
        route.tasks[0] = RouteTask { name: Text::new("office"), point_count: 1, ..RouteTask::zeroed() };
        route.tasks[1] =
            RouteTask { name: Text::new("loop"), first_point: 1, point_count: 2, ..RouteTask::zeroed() };
        route.points_px[..3].copy_from_slice(&[[5.0, 5.0], [6.0, 6.0], [7.0, 7.0]]);
        let shapes: MarkerArray = derive("/route/markers", ROUTE, &route, &[]);
        let kinds: Vec<_> = shapes.markers.iter().map(|marker| (marker.action, marker.type_)).collect();
        let add = |kind| (Marker::ADD, kind);
        let goal = [add(Marker::CYLINDER), add(Marker::TEXT_VIEW_FACING)];
        let mut expected = vec![(Marker::DELETEALL, 0)];
        expected.extend(goal);
        expected.push(add(Marker::LINE_STRIP));
        expected.extend(goal);
        assert_eq!(kinds, expected);
        assert_eq!(shapes.markers[2].text, "office");
    }

    #[test]
    fn every_derived_type_has_a_schema_and_every_topic_stands_below_its_channel() {
        for derived in TABLE {
            assert!(!derived.schema().is_empty(), "{}", derived.ros2);
            assert!(derived.topic.starts_with(&format!("/{}/", derived.of.name)), "{}", derived.topic);
            let mut cdr = Vec::new();
            let mut message = vec![0_u64; derived.of.message.size / 8];
            message[0] = 1;
            let encoded = derived.encode(bytemuck::cast_slice(&message), &[], &mut cdr);
            assert!(encoded.is_ok(), "{}: {encoded:?}", derived.topic);
        }
    }
}
