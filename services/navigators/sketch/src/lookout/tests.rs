use bytemuck::Zeroable;
use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{Message, PoseM, PosePx};
use sketchnav_stage::Access;
use sketchnav_stage::lookout::Lookout as _;

use super::*;

fn robotino() -> Robot {
    Robot::parse(include_str!("../../../../../sim/robots/robotino.toml")).unwrap()
}

fn estimate() -> PoseEstimate {
    let mut estimate = PoseEstimate::zeroed();
    estimate.pose = PosePx::new(&Pose::new(20.0, 30.0, std::f64::consts::FRAC_PI_2));
    estimate.odometry = PoseM::new(&Pose::<Odom>::new(7.0, 8.0, 1.0));
    (estimate.scale_a_pxpm, estimate.scale_b_pxpm) = (10.0, 10.0);
    estimate.tracking = Tracking::Tracking.code();
    estimate
}

fn receive<T: Message>(lookout: &mut Lookout, channel: Channel<T>, message: &T) {
    let access = Access::new(Process::Pad, "sketch");
    lookout.receive(&Incoming::new(&access, channel.spec, bytemuck::bytes_of(message), &[])).unwrap();
}

#[test]
fn an_ellipse_has_two_deviations_and_a_robot_that_waits_has_no_place() {
    let mut estimate = estimate();
    (estimate.covariance[0], estimate.covariance[6]) = (1.0, 4.0);
    let found = robot(&estimate, &robotino()).unwrap();
    assert_eq!((found.at, found.heading_rad), ([20.0, 30.0], std::f64::consts::FRAC_PI_2));
    assert_eq!(found.ellipse, [4.0, 2.0, std::f64::consts::FRAC_PI_2]);
    assert!((found.radius - robotino().radius_m * 10.0).abs() < 1e-9);
    estimate.tracking = Tracking::Waiting.code();
    assert!(robot(&estimate, &robotino()).is_none());
}

#[test]
fn a_beam_ahead_ends_ahead() {
    let mut scan = LaserScan::zeroed();
    (scan.beam_count, scan.range_min_m, scan.range_max_m) = (2, 0.1, 9.0);
    scan.ranges_m[..2].copy_from_slice(&[2.0, f32::INFINITY]);
    let mut robot = robotino();
    let laser = robot.laser.as_mut().unwrap();
    (laser.mount_x_m, laser.mount_y_m, laser.mount_yaw_deg) = (0.0, 0.0, 0.0);
    let [[x, y]] = hits(&scan, &estimate(), 0.0, &robot)[..] else { panic!("one beam has hit something") };
    assert!((x - 20.0).abs() < 1e-9 && (y - 50.0).abs() < 1e-9, "2 m up, 20 px of the sketch: {x}, {y}");
}

#[test]
fn a_plan_is_thinned() {
    let mut plan: Box<Plan> = bytemuck::zeroed_box();
    (plan.global_count, plan.local_count) = (1024, 9999);
    for shape in ways(&plan) {
        let Shape::Line { points, .. } = shape else { panic!("{shape:?}") };
        assert_eq!(points.len(), 256);
    }
}

#[test]
fn what_is_asked_has_places_of_the_drawing() {
    let mut lookout = Lookout::new(&robotino());
    assert_eq!(lookout.question(), None);
    let mut question = Question::zeroed();
    (question.kind, question.place_count) = (QuestionKind::Which.code(), 3);
    (question.places[2].x_px, question.places[2].y_px) = (20.0, 30.0);
    receive(&mut lookout, QUESTION, &question);
    assert_eq!(lookout.question(), Some(vec![[0.0; 2], [0.0; 2], [20.0, 30.0]]));
    receive(&mut lookout, QUESTION, &Question::zeroed());
    assert_eq!(lookout.question(), None, "it asks no more");
}

/// Two estimates are already in flight when another sketch arrives. They refer to the previous sketch and must not be shown in
/// the new one.
#[test]
fn another_sketch_forgets_the_place_in_the_one_before() {
    let mut lookout = Lookout::new(&robotino());
    let place = |lookout: &mut Lookout| {
        let mut picture = Picture::default();
        lookout.draw(&mut picture);
        picture.robot.map(|robot| robot.at)
    };
    receive(&mut lookout, ESTIMATE, &estimate());
    assert_eq!(place(&mut lookout), Some([20.0, 30.0]));
    let mut map = SketchMap::zeroed();
    map.header.seq = 2;
    receive(&mut lookout, SKETCH, &map);
    for expected in [None, None, Some([20.0, 30.0])] {
        receive(&mut lookout, ESTIMATE, &estimate());
        assert_eq!(place(&mut lookout), expected);
    }
    assert!(lookout.is_ready());
}
