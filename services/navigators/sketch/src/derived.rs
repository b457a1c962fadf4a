//! ROS 2 topics derived from this navigator's channels, for viewers.

use sketchnav_schemas::ros2::derived::{Derived, derived};
use sketchnav_schemas::ros2::forms::{
    geometry_msgs::msg::{Point, Pose, PoseArray, PoseStamped},
    nav_msgs::msg::{OccupancyGrid, Path},
    visualization_msgs::msg::{Marker, MarkerArray},
};
use sketchnav_schemas::ros2::shapes::{
    REMEMBERED_COLOR, ROUTE_COLOR, SEEN_COLOR, Shapes, first, path, stamped, turned,
};
use sketchnav_schemas::ros2::{Field, Ros2Error};

use crate::messages::{
    CORRESPONDENCE, Correspondence, ESTIMATE, PARTICLES, PLAN, Particles, Plan, PoseEstimate, ROUTE, Route,
    SKETCH, SketchMap,
};

/// Every derived topic, with its ROS 2 type and the channel it is derived from.
pub const DERIVED: &[Derived] = derived! {
    "/sketch/grid": "nav_msgs/msg/OccupancyGrid" = sketch_grid(SKETCH);
    "/route/markers": "visualization_msgs/msg/MarkerArray" = route_markers(ROUTE);
    "/particles/poses": "geometry_msgs/msg/PoseArray" = particle_poses(PARTICLES);
    "/estimate/pose": "geometry_msgs/msg/PoseStamped" = estimate_pose(ESTIMATE);
    "/plan/global": "nav_msgs/msg/Path" = global_path(PLAN);
    "/plan/local": "nav_msgs/msg/Path" = local_path(PLAN);
    "/correspondence/way": "nav_msgs/msg/Path" = way_path(CORRESPONDENCE);
    "/correspondence/markers": "visualization_msgs/msg/MarkerArray" = outline_markers(CORRESPONDENCE);
};

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

/// Draws goals as discs and drawn routes as lines, each labelled with the name of its task.
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

/// Draws the partners of the outline samples in the map, together with the goal and the robot.
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

#[cfg(test)]
mod tests {
    use crate::messages::{Particle, RouteTask};
    use bytemuck::Zeroable;
    use sketchnav_schemas::channels::Channel;
    use sketchnav_schemas::message::{Header, Message, Text};
    use sketchnav_schemas::ros2::decode;

    use super::*;

    fn derive<T: Message, F: serde::de::DeserializeOwned>(
        topic: &str,
        channel: Channel<T>,
        message: &T,
        cells: &[u8],
    ) -> F {
        let derived =
            DERIVED.iter().find(|derived| derived.topic == topic && derived.of == channel.spec).unwrap();
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

    /// A foreign writer can send a count that exceeds the capacity of the array. Such a count must be clamped, not crash the
    /// viewer.
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

    /// A goal has a single point and therefore no line. The markers of an earlier route are deleted first.
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
}
