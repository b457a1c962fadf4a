//! Tests of a robot that asks a person where it is, and of its response to the answer.

use sketchnav_schemas::codes::{TaskState, Tracking};
use sketchnav_schemas::message::MissionStatus;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_sketch::messages::{QUESTION, Question, QuestionKind};
use sketchnav_stage::Stage;

use crate::exploring::{bent, scene};
use crate::support::*;

const GOAL: [f64; 2] = [9.2, 7.0];

/// Returns a run with a person at the pad, in which every arrival is in doubt because of a rival, since the two arms are alike.
fn doubtful(pad: Pad) -> RunConfig {
    let planner = "by_outline = true\nrival_margin = 1000.0\nask_margin = 1000.0\nask_patience_s = 30.0";
    RunConfig { pad, ..config(ROBOTINO, planner) }
}

fn drive(pad: Pad) -> Drive {
    Drive::with(scene(), doubtful(pad), &[&[GOAL]], 600.0)
}

fn is(state: TaskState) -> impl Fn(&MissionStatus) -> bool {
    move |status| status.state == state.code()
}

/// Drives until the robot asks, and returns the status and the question.
fn asked(drive: &mut Drive) -> (MissionStatus, Question) {
    let status = drive.until("asking", is(TaskState::Paused));
    let question = *drive.said(QUESTION).expect("it is news");
    (status, question)
}

fn off_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn it_asks_at_which_place_of_the_drawing_it_is_and_stands() {
    let mut drive = drive(Pad::Watches);
    let (status, question) = asked(&mut drive);
    assert!(status.reason.as_str().starts_with("is the robot at A"), "{:?}", status.reason);
    assert_eq!(question.kind, QuestionKind::Which.code());
    assert!((2..=4).contains(&question.places().len()), "{question:?}");
    // The first place is where the best alignment places the robot, which is at the goal.
    let [x, y] = bent(GOAL[0], GOAL[1]).0;
    let first = question.places()[0];
    assert!(off_m([first.x_px, first.y_px], [x, y]) < 40.0, "{question:?}, the goal is at {x}, {y}");
    let before = drive.place();
    let mut stand = || {
        let status = drive.step();
        assert!(drive.said(QUESTION).is_none(), "it is news once");
        status
    };
    let stands = (0..100).map(|_| stand()).last().unwrap();
    assert!(off_m(before, drive.place()) < 0.3);
    assert_eq!((stands.state, stands.reason), (status.state, status.reason));
    assert_eq!(stands.task_time_s, status.task_time_s, "the clock stands");
}

#[test]
fn who_says_the_likeliest_place_has_the_arrival_believed() {
    let mut drive = drive(Pad::Watches);
    let (_, question) = asked(&mut drive);
    let place = question.places()[0];
    drive.tell(place.x_px + 5.0, place.y_px);
    let status = drive.step();
    assert_eq!(status.state, TaskState::Reached.code(), "{status:?}");
    assert!(status.reason.as_str().ends_with("a person agrees"), "{:?}", status.reason);
    assert!(drive.said(QUESTION).is_some(), "that it asks no more is news");
    assert!(off_m(drive.place(), GOAL) < 1.2);
}

/// The goal then lies where the rival places it. That is farther away than `rival_away_m`, which is 2.5 m, and the robot stops near
/// it.
#[test]
fn who_says_another_place_sends_it_to_where_the_goal_lies_by_that() {
    let mut drive = drive(Pad::Watches);
    let (_, question) = asked(&mut drive);
    let place = question.places()[1];
    let before = drive.place();
    drive.tell(place.x_px, place.y_px);
    assert_eq!(drive.step().state, TaskState::Driving.code());
    assert!(drive.said(QUESTION).is_some(), "that it asks no more is news");
    let (_, question) = asked(&mut drive);
    assert!(off_m(before, drive.place()) > 2.0, "from {before:?} to {:?}", drive.place());
    let place = question.places()[0];
    drive.tell(place.x_px, place.y_px);
    assert_eq!(drive.step().state, TaskState::Reached.code());
}

#[test]
fn a_place_far_from_all_of_them_anchors_what_is_compared_from_then_on() {
    let mut drive = drive(Pad::Watches);
    let (_, question) = asked(&mut drive);
    // The middle of the hall is none of the offered places.
    let [x, y] = bent(5.5, 1.7).0;
    assert!(
        question.places().iter().all(|place| off_m([place.x_px, place.y_px], [x, y]) > 60.0),
        "{question:?}"
    );
    drive.tell(x, y);
    assert_eq!(drive.step().state, TaskState::Driving.code());
    drive.until("another word", |status| status.state != TaskState::Driving.code());
}

/// The arrival is accepted on its own evidence, as without a pad.
#[test]
fn where_nobody_answers_the_arrival_is_believed() {
    let mut drive = drive(Pad::Watches);
    asked(&mut drive);
    let waited = (0..400).map(|_| drive.step()).take_while(is(TaskState::Paused)).count();
    assert!((290..=301).contains(&waited), "{waited}");
    let mut alone = self::drive(Pad::Absent);
    let status = alone.until("the end", |status| status.state >= TaskState::Reached.code());
    assert_eq!(status.state, TaskState::Reached.code());
    assert!(status.reason.as_str().starts_with("the walls seen put the goal here: margin"), "{status:?}");
    assert!(alone.sent.get(QUESTION.spec).is_none());
}

/// The arrival is also accepted if the person resumes the mission.
#[test]
fn who_has_it_go_on_has_it_believe() {
    let mut drive = drive(Pad::Watches);
    asked(&mut drive);
    drive.order(sketchnav_schemas::codes::Order::Resume);
    let status = drive.step();
    assert_eq!(status.state, TaskState::Reached.code());
    assert!(!status.reason.as_str().contains("agrees"), "{status:?}");
}

/// A planner that is stored and restored repeatedly asks the same question, and responds in the same way to the answer.
#[test]
fn a_question_survives_the_planner() {
    let (mut whole, mut broken) = (drive(Pad::Watches), drive(Pad::Watches));
    let mut answered = false;
    for step in 0..3000 {
        let statuses = [whole.step(), broken.step()];
        assert_eq!(bytemuck::bytes_of(&statuses[0]), bytemuck::bytes_of(&statuses[1]), "step {step}");
        let news = [&whole, &broken].map(|drive| drive.said(QUESTION).copied());
        assert_eq!(news[0], news[1], "step {step}");
        let asks = statuses[0].state == TaskState::Paused.code();
        if step % 97 == 5 || asks {
            let stored = postcard::to_stdvec(&broken.planner.state()).unwrap();
            broken.planner = drive(Pad::Watches).planner;
            broken.planner.restore(postcard::from_bytes(&stored).unwrap()).unwrap();
        }
        if let (Some(question), true, false) = (news[0], asks, answered) {
            answered = true;
            let place = question.places()[1];
            whole.tell(place.x_px, place.y_px);
            broken.tell(place.x_px, place.y_px);
        }
    }
    assert!(answered);
}

/// A robot that drives by the filter also waits for a person when it is lost, if there is a pad, and continues from the position
/// that the person gives.
#[test]
fn a_lost_robot_waits_until_it_is_told_where_it_is() {
    let mut drive = Drive::with(
        scene(),
        RunConfig { pad: Pad::Watches, ..config(ROBOTINO, "by_outline = false") },
        &[&[GOAL]],
        600.0,
    );
    drive.tracking = Tracking::Lost;
    let (status, question) = asked(&mut drive);
    let expected = "lost, waiting for help: tap where it is; the scans have fitted nowhere nearby for 20 s";
    assert_eq!((status.reason.as_str(), question.kind), (expected, QuestionKind::Where.code()));
    assert_eq!(question.places().len(), 0);
    drive.tracking = Tracking::Tracking;
    drive.tell(-1.0, 5.0);
    assert_eq!(drive.step().state, TaskState::Paused.code(), "that is no place of the drawing");
    let [x, y] = bent(drive.place()[0], drive.place()[1]).0;
    drive.tell(x, y);
    assert_eq!(drive.step().state, TaskState::Driving.code());
    drive.until("there", is(TaskState::Reached));
    let mut alone = Drive::with(scene(), config(ROBOTINO, "by_outline = false"), &[&[GOAL]], 600.0);
    alone.tracking = Tracking::Lost;
    alone.until("lost", is(TaskState::Lost));
}
