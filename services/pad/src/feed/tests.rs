use std::time::Duration;

use bytemuck::Zeroable;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::{Fault, PoseM, PosePx, Text};

use super::*;

const VIEW: View = View { height_px: 100.0, scale: 0.5 };

fn robot() -> Robot {
    Robot::parse(include_str!("../../../../sim/robots/robotino.toml")).unwrap()
}

fn estimate() -> PoseEstimate {
    let mut estimate = PoseEstimate::zeroed();
    estimate.pose = PosePx::new(&Pose::new(20.0, 30.0, std::f64::consts::FRAC_PI_2));
    estimate.odometry = PoseM::new(&Pose::<Odom>::new(7.0, 8.0, 1.0));
    (estimate.scale_a_pxpm, estimate.scale_b_pxpm) = (10.0, 10.0);
    estimate.tracking = Tracking::Tracking.code();
    estimate
}

#[test]
fn the_page_is_upside_down_and_larger() {
    assert_eq!(VIEW.point(20.0, 30.0), [40.0, 140.0]);
    let mut estimate = estimate();
    (estimate.covariance[0], estimate.covariance[6]) = (1.0, 4.0);
    let pose = PoseView::new(&estimate, &robot(), &VIEW).unwrap();
    assert_eq!((pose.x, pose.y, pose.heading_rad), (40.0, 140.0, 1.571));
    assert_eq!(pose.ellipse, [8.0, 4.0, 1.571]);
    assert!((pose.radius_px - robot().radius_m * 20.0).abs() < 0.1);
    estimate.tracking = Tracking::Waiting.code();
    assert!(PoseView::new(&estimate, &robot(), &VIEW).is_none());
}

#[test]
fn a_beam_ahead_ends_ahead() {
    let mut scan = LaserScan::zeroed();
    (scan.beam_count, scan.range_min_m, scan.range_max_m) = (2, 0.1, 9.0);
    scan.ranges_m[..2].copy_from_slice(&[2.0, f32::INFINITY]);
    let mut robot = robot();
    let laser = robot.laser.as_mut().unwrap();
    (laser.mount_x_m, laser.mount_y_m, laser.mount_yaw_deg) = (0.0, 0.0, 0.0);
    let seen = super::scan(&scan, &estimate(), 0.0, &robot, &VIEW);
    assert_eq!(seen, [[40.0, 100.0]], "2 m up: 20 px of the sketch, 40 of the canvas");
}

#[test]
fn lists_are_thinned() {
    let mut plan: Box<Plan> = bytemuck::zeroed_box();
    (plan.global_count, plan.local_count) = (1024, 9999);
    let view = PlanView::new(&plan, &VIEW);
    assert_eq!((view.global.len(), view.local.len()), (256, 256));
}

#[test]
fn a_trail_stays_short() {
    let mut trail = Trail::default();
    (0..100_000).for_each(|i| trail.go_to([f64::from(i), 0.0]));
    assert!((1000..=2000).contains(&trail.points().len()), "{}", trail.points().len());
    assert_eq!(trail.points()[0], [0.0, 0.0]);
}

#[test]
fn what_goes_wrong_is_said_in_words() {
    let mut services = Services::default();
    let fault = |kind: FaultKind| Fault {
        kind: kind.code(),
        process: Process::Localizer.code(),
        restarts: 1,
        ..Zeroable::zeroed()
    };
    services.on_fault(&fault(FaultKind::Died));
    services.on_fault(&fault(FaultKind::Restarted));
    let mut ends = Ends::default();
    let mut status = MissionStatus::zeroed();
    (status.state, status.name) = (TaskState::Blocked.code(), Text::new("kitchen"));
    status.reason = Text::new("no way");
    ends.on_status(&status);
    ends.on_status(&status);
    let silence = Some(Duration::from_secs(4));
    let said = warnings(None, Some(Tracking::Lost), &ends, &services, silence);
    let kinds: Vec<_> = said.iter().map(|warning| warning.kind).collect();
    assert_eq!(kinds, ["blocked", "lost", "restarting", "link"]);
    assert_eq!(said[0].text, "kitchen: no way");
    let mut idle = services.clone();
    idle.settle(2_000_000_000);
    assert_eq!(idle.down().count(), 1);
    idle.settle(4_000_000_000);
    assert_eq!(idle.down().count(), 0, "it has nothing to do, and lives");
    services.on_fault(&fault(FaultKind::Recovered));
    ends.clear();
    assert_eq!(warnings(None, None, &ends, &services, None), []);
    assert_eq!(services.views()[2], services::ServiceView { name: "localizer", up: true, restarts: 1 });
}

#[test]
fn a_question_has_letters_and_places_of_the_canvas() {
    let mut question = sketchnav_schemas::message::Question::zeroed();
    let lost = QuestionView::new(&question, &VIEW);
    assert_eq!((lost.text.as_str(), lost.places.len()), ("The robot is lost. Tap where it is.", 0));
    question.place_count = 3;
    (question.places[2].x_px, question.places[2].y_px) = (20.0, 30.0);
    let which = QuestionView::new(&question, &VIEW);
    assert_eq!(which.text, "Is the robot at A, B or C? Tap where it is.");
    assert_eq!((which.places[2].name, which.places[2].at), ('C', [40.0, 140.0]));
    let back = VIEW.place([40.0, 140.0]);
    assert_eq!((back.x, back.y), (20.0, 30.0));
}
