use std::time::Duration;

use bytemuck::Zeroable;
use sketchnav_schemas::codes::{FaultKind, Process};
use sketchnav_schemas::message::{Fault, Text};
use sketchnav_stage::lookout::Color;

use super::*;

const VIEW: View = View::Drawing { height_px: 100.0, scale: 0.5 };

#[test]
fn the_page_is_upside_down_and_larger() {
    assert_eq!(VIEW.point([20.0, 30.0]), [40.0, 140.0]);
    let line = Shape::line([[20.0, 30.0], [0.0, 0.04]], Color::Plan);
    assert_eq!(VIEW.shapes(vec![line]), [Shape::line([[40.0, 140.0], [0.0, 199.9]], Color::Plan)]);
    let robot = Whereabouts {
        at: [20.0, 30.0],
        heading_rad: std::f64::consts::FRAC_PI_2,
        ellipse: [4.0, 2.0, std::f64::consts::FRAC_PI_2],
        radius: 3.3,
        tracking: Tracking::Doubtful,
        effective: 0.25,
    };
    let pose = PoseView::new(&robot, &VIEW);
    assert_eq!((pose.x, pose.y, pose.heading_rad), (40.0, 140.0, 1.571));
    assert_eq!((pose.ellipse, pose.radius_px), ([8.0, 4.0, 1.571], 6.6));
    assert_eq!((pose.tracking, pose.effective), ("doubtful", 0.25));
}

#[test]
fn ahead_is_up_and_left_is_left() {
    let youbot = Robot::parse(include_str!("../../../../sim/robots/youbot.toml")).unwrap();
    let view = View::around(&youbot);
    let [middle, ahead, left] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|place| view.point(place));
    assert_eq!(middle, [500.0, 500.0]);
    assert!(ahead[0] == 500.0 && ahead[1] < 500.0, "{ahead:?}");
    assert!(left[0] < 500.0 && left[1] == 500.0, "{left:?}");
    let pose = PoseView::in_the_middle(&youbot, &view);
    assert_eq!((pose.x, pose.y, pose.heading_rad), (500.0, 500.0, std::f64::consts::FRAC_PI_2));
    assert_eq!(view.place(middle), None, "there is no drawing");
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
    let lost = QuestionView::new(&[], &VIEW);
    assert_eq!((lost.text.as_str(), lost.places.len()), ("The robot is lost. Tap where it is.", 0));
    let which = QuestionView::new(&[[0.0; 2], [0.0; 2], [20.0, 30.0]], &VIEW);
    assert_eq!(which.text, "Is the robot at A, B or C? Tap where it is.");
    assert_eq!((which.places[2].name, which.places[2].at), ('C', [40.0, 140.0]));
    let back = VIEW.place([40.0, 140.0]).unwrap();
    assert_eq!((back.x, back.y), (20.0, 30.0));
}
