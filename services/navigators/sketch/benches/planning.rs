//! Times how long it takes to plan a new goal in a drawing, to plan a path around what the laser sees, and to
//! do the other work of every step.

#[path = "../tests/support/building.rs"]
mod building;

use std::hint::black_box;

use building::{Drawing, WAY, scan_from};
use bytemuck::Zeroable;
use criterion::{Criterion, criterion_group, criterion_main};
use sketchnav_motion::local::{LocalPlanner, Room};
use sketchnav_motion::obstacles::Obstacles;
use sketchnav_motion::pursuit::{Body, Pursuit};
use sketchnav_schemas::geometry::{Odom, Point, Pose, Sketch as SketchFrame};
use sketchnav_schemas::message::{LaserScan, PoseM, PosePx};
use sketchnav_schemas::robot::{Drive, Limits};
use sketchnav_sketch::messages::PoseEstimate;
use sketchnav_sketch::paths::chart::Chart;
use sketchnav_sketch::paths::cost_field::CostField;
use sketchnav_sketch::paths::parameters::Parameters;

const DRAWING: Drawing = Drawing { size: [400, 400], a: 22.0, b: 28.0, turn_rad: 0.0, wobble_px: 0.0 };
const RADIUS_M: f64 = 0.23;
const ROOM: Room = Room { hard_m: 0.28, soft_m: 0.63 };

/// The robot is in the first room, facing the door, and its goal is in the last room.
struct Scene {
    field: CostField,
    obstacles: Obstacles,
    chart: Chart,
    robot: Pose<Odom>,
    goal: Point<SketchFrame>,
    scan: LaserScan,
}

impl Scene {
    fn new() -> Self {
        let [x, y] = DRAWING.px(WAY[0]);
        let [goal_x, goal_y] = DRAWING.px(WAY[14]);
        let robot = Pose::<Odom>::new(0.3, -0.2, 0.4);
        let estimate = PoseEstimate {
            pose: PosePx::new(&Pose::new(x, y, std::f64::consts::FRAC_PI_2)),
            odometry: PoseM::new(&robot),
            scale_a_pxpm: DRAWING.a,
            scale_b_pxpm: DRAWING.b,
            ..Zeroable::zeroed()
        };
        let scan = scan_from([WAY[0][0], WAY[0][1], std::f64::consts::FRAC_PI_2], 541, -2.356, 5.6, || 0.0);
        let mut obstacles = Obstacles::new(20.0);
        obstacles.observe(&robot, RADIUS_M, &robot, &scan);
        let goal = Point::new(goal_x, goal_y);
        let mut field = CostField::new(&DRAWING.sketch());
        field.solve(goal, 25.0, &[], &Parameters::default());
        let chart = Chart::new(&estimate, 0.0).expect("finite numbers and scales above 0");
        Self { field, obstacles, chart, robot, goal, scan }
    }

    /// Returns the farthest place on the path through the drawing that is within the local planner's window.
    fn target(&self, global: &[Point<SketchFrame>]) -> Point<Odom> {
        let in_window = |p: &&Point<SketchFrame>| self.chart.distance_m(global[0], **p) < 2.5;
        let last = global.iter().take_while(in_window).last();
        self.chart.to_odom(*last.expect("a way begins where the robot is"))
    }
}

fn plan(criterion: &mut Criterion) {
    let mut scene = Scene::new();
    let mut group = criterion.benchmark_group("one plan");
    let parameters = Parameters::default();
    let (mut field, goal) = (scene.field.clone(), scene.goal);
    group.bench_function("a new goal in a drawing of 400 x 400", |bencher| {
        bencher.iter(|| field.solve(black_box(goal), 25.0, &[], &parameters));
    });
    let (mut local, mut global, mut path) = (LocalPlanner::default(), Vec::new(), Vec::new());
    group.bench_function("around what the laser sees", |bencher| {
        bencher.iter(|| {
            scene.field.descend(scene.chart.robot_px().position(), &mut global);
            let target = scene.target(&global);
            local.prepare(&scene.obstacles, scene.robot.position(), ROOM);
            local.search(scene.robot.position(), Some(target));
            local.path(target, &mut path);
            assert!(path.len() > 30);
        });
    });
    group.bench_function("where the target is shut off", |bencher| {
        bencher.iter(|| {
            local.prepare(&scene.obstacles, scene.robot.position(), ROOM);
            local.search(scene.robot.position(), None);
            local.best(0.7, |place| scene.field.raw_cost_px(scene.chart.to_sketch(place)))
        });
    });
    group.finish();
    let mut group = criterion.benchmark_group("one step");
    group.bench_function("take in a scan of 541 beams", |bencher| {
        bencher.iter(|| scene.obstacles.observe(&scene.robot, RADIUS_M, &scene.robot, &scene.scan));
    });
    let limits =
        Limits { speed_mps: 0.6, yaw_rate_radps: 1.5, acceleration_mps2: 0.8, yaw_acceleration_radps2: 3.0 };
    let mut pursuit = Pursuit::new(Body { radius_m: RADIUS_M, drive: Drive::Differential, limits });
    group.bench_function("follow the path", |bencher| {
        bencher.iter(|| pursuit.follow(black_box(&path), &scene.robot, &scene.obstacles, 1.0, 0.1));
    });
}

criterion_group!(benches, plan);
criterion_main!(benches);
