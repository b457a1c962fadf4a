use bytemuck::Zeroable;
use proptest::prelude::*;
use sketchnav_schemas::message::Text;

use super::*;

const fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

fn status(state: TaskState) -> MissionStatus {
    MissionStatus { state: state.code(), ..Zeroable::zeroed() }
}

/// A machine whose navigation answers, and the current time.
struct Scene {
    machine: Machine,
    now: Duration,
}

impl Scene {
    fn new(draws: bool) -> Self {
        let mut scene = Self { machine: Machine::new(draws), now: s(1) };
        scene.say(TaskState::Waiting);
        scene
    }

    /// The planner reports the state until it counts.
    fn say(&mut self, state: TaskState) {
        for _ in 0..SETTLING {
            self.now += Duration::from_millis(100);
            self.machine.on_status(&status(state), self.now);
        }
    }

    fn located(&mut self) {
        self.machine.on_lookout(true, false);
    }

    fn answer(&mut self, accepted: bool) -> Option<Result<(), Refusal>> {
        let mut answer = Understood { accepted: accepted.into(), scale: 0.5, ..Zeroable::zeroed() };
        answer.header.source_seq = self.machine.memory().drawing_seq;
        (answer.sketch_width_px, answer.sketch_height_px) = (300, 200);
        answer.words = Text::new(if accepted { "" } else { "expected walls" });
        self.machine.on_understood(&answer)
    }

    fn sketch(&mut self) {
        let request = SketchRequest { kind: SketchType::Png, bytes: vec![1], canvas: None };
        self.machine.send_sketch(request, true, self.now).unwrap();
        assert_eq!(self.answer(true), Some(Ok(())));
    }

    fn path(&mut self) {
        let request = PathRequest::parse(br#"{"route":[[1,2],[3,4]]}"#).unwrap();
        self.machine.send_path(request, true, self.now).unwrap();
        assert_eq!(self.answer(true), Some(Ok(())));
        self.located();
        self.say(TaskState::Waiting);
    }

    fn allowed(&self) -> Vec<Step> {
        self.machine.allowed(true, self.now)
    }

    fn order(&mut self, step: Step) -> Order {
        self.machine.order(step, true, self.now).unwrap()
    }
}

#[test]
fn each_step_opens_the_next() {
    let mut scene = Scene::new(true);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::NoSketch, vec![Step::Sketch]));
    scene.sketch();
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Sketch, vec![Step::Sketch, Step::Path]));
    assert_eq!(scene.machine.memory().sketch.as_ref().unwrap().canvas, [600, 400]);
    scene.path();
    assert_eq!(scene.machine.state(), State::Path);
    assert_eq!(scene.allowed(), [Step::Sketch, Step::Path, Step::Execute]);
    assert_eq!(scene.order(Step::Execute), Order::Start);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Driving, vec![Step::Abort]));
    scene.say(TaskState::Driving);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Driving, vec![Step::Abort]));
}

#[test]
fn what_was_aborted_is_restored_or_started_again() {
    let mut scene = Scene::new(true);
    scene.sketch();
    scene.path();
    scene.order(Step::Execute);
    scene.say(TaskState::Driving);
    assert_eq!(scene.order(Step::Abort), Order::Abort);
    scene.say(TaskState::Aborted);
    assert_eq!(scene.machine.state(), State::Aborted);
    assert_eq!(scene.allowed(), [Step::Sketch, Step::Path, Step::Restore, Step::Again]);
    assert_eq!(scene.order(Step::Restore), Order::Resume);
    scene.say(TaskState::Driving);
    scene.say(TaskState::Finished);
    assert_eq!(scene.machine.state(), State::Ended);
    assert_eq!(scene.allowed(), [Step::Sketch, Step::Path, Step::Again]);
    assert_eq!(scene.order(Step::Again), Order::Start);
    assert_eq!(scene.machine.state(), State::Driving);
}

/// A status that was in transit when an order was given refers to the time before it.
#[test]
fn an_older_status_does_not_undo_an_order() {
    let mut scene = Scene::new(true);
    scene.sketch();
    scene.path();
    scene.order(Step::Execute);
    scene.say(TaskState::Driving);
    scene.order(Step::Abort);
    scene.machine.on_status(&status(TaskState::Driving), scene.now);
    assert_eq!(scene.machine.state(), State::Aborted);
    assert!(scene.machine.check(Step::Restore, true, scene.now).is_err(), "nobody has confirmed it yet");
}

#[test]
fn an_order_waits_for_a_navigation_that_is_ready() {
    let mut scene = Scene::new(true);
    scene.sketch();
    let request = PathRequest::parse(br#"{"goals":[[1,2]]}"#).unwrap();
    scene.machine.send_path(request, true, scene.now).unwrap();
    scene.answer(true);
    scene.say(TaskState::Waiting);
    assert_eq!(scene.machine.check(Step::Execute, true, scene.now).unwrap_err().status(), 503);
    scene.located();
    assert!(scene.machine.check(Step::Execute, true, scene.now).is_ok());
    let late = scene.now + STALE;
    assert_eq!(scene.machine.check(Step::Execute, true, late).unwrap_err().status(), 503);
}

#[test]
fn what_the_sketcher_refuses_leaves_what_was_there() {
    let mut scene = Scene::new(true);
    scene.sketch();
    scene.path();
    let before = (scene.machine.memory().sketch.clone(), scene.machine.memory().path.clone());
    let request = SketchRequest { kind: SketchType::Strokes, bytes: vec![2], canvas: Some([9, 9]) };
    scene.machine.send_sketch(request.clone(), true, scene.now).unwrap();
    let busy = scene.machine.send_sketch(request, true, scene.now).unwrap_err();
    assert_eq!(busy.status(), 409);
    assert_eq!(scene.answer(false), Some(Err(Refusal::Drawing("expected walls".into()))));
    assert_eq!((scene.machine.memory().sketch.clone(), scene.machine.memory().path.clone()), before);
    assert_eq!(scene.answer(true), None, "nothing is pending");
}

#[test]
fn who_watches_can_stop_the_robot_and_nothing_else() {
    let mut scene = Scene::new(true);
    scene.sketch();
    scene.path();
    assert_eq!(scene.machine.allowed(false, scene.now), []);
    scene.order(Step::Execute);
    assert_eq!(scene.machine.allowed(false, scene.now), [Step::Abort]);
    scene.machine.order(Step::Abort, false, scene.now).unwrap();
    scene.say(TaskState::Aborted);
    assert_eq!(scene.machine.order(Step::Restore, false, scene.now).unwrap_err().status(), 403);
}

#[test]
fn a_driver_who_falls_silent_pauses_a_robot_that_drives() {
    let mut scene = Scene::new(true);
    assert_eq!(scene.machine.on_silence(), None);
    scene.sketch();
    scene.path();
    scene.order(Step::Execute);
    scene.say(TaskState::Driving);
    assert_eq!(scene.machine.on_silence(), Some(Order::Unattended));
    assert_eq!((scene.machine.state(), scene.machine.on_silence()), (State::Paused, None));
    scene.say(TaskState::Paused);
    assert_eq!(scene.order(Step::Restore), Order::Resume);
}

#[test]
fn a_mission_from_a_file_can_be_stopped_and_gone_on_with() {
    let mut scene = Scene::new(false);
    scene.located();
    scene.say(TaskState::Driving);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Driving, vec![Step::Abort]));
    scene.order(Step::Abort);
    scene.say(TaskState::Aborted);
    assert_eq!(scene.allowed(), [Step::Restore]);
    assert_eq!(scene.machine.check(Step::Sketch, true, scene.now).unwrap_err().status(), 409);
}

/// The supervisor gives the order to start such a mission. The planner was waiting for the sketcher, which was reading a large
/// photo; or it had sent nothing yet, in lockstep or to a pad that had just been restarted. The pad assumed that the mission had
/// not been ordered and ignored an abort with the answer `ok`, and the robot drove off.
#[test]
fn a_mission_from_a_file_can_be_aborted_before_the_robot_drives() {
    let mut scene = Scene { machine: Machine::new(false), now: s(1) };
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Driving, vec![Step::Abort]));
    scene.say(TaskState::Waiting);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Driving, vec![Step::Abort]));
    assert_eq!(scene.order(Step::Abort), Order::Abort);
    assert_eq!(
        scene.machine.order(Step::Abort, true, scene.now).unwrap_err().status(),
        409,
        "it was passed on"
    );
    scene.say(TaskState::Aborted);
    assert_eq!(scene.machine.state(), State::Aborted);
}

/// At many times real time, more statuses are in transit than the pad waits for. The robot had been ordered to continue, and an
/// abort was refused because it had not confirmed that yet.
#[test]
fn what_was_ordered_to_go_on_can_be_aborted_before_the_planner_says_so() {
    let mut scene = Scene::new(false);
    scene.say(TaskState::Driving);
    scene.order(Step::Abort);
    scene.located();
    scene.say(TaskState::Aborted);
    scene.order(Step::Restore);
    scene.say(TaskState::Aborted);
    assert_eq!(scene.order(Step::Abort), Order::Abort);
}

#[test]
fn a_sketcher_that_does_not_answer_is_given_up() {
    let mut scene = Scene::new(true);
    let request = SketchRequest { kind: SketchType::Png, bytes: vec![1], canvas: None };
    scene.machine.send_sketch(request, true, scene.now).unwrap();
    assert!(!scene.machine.has_waited_too_long(scene.now + PATIENCE));
    assert!(scene.machine.has_waited_too_long(scene.now + PATIENCE + s(1)));
    assert!(!scene.machine.has_waited_too_long(scene.now + PATIENCE + s(2)), "told once");
    assert_eq!(scene.allowed(), [Step::Sketch]);
    // A late answer still counts: the sketcher has accepted the drawing.
    assert_eq!(scene.answer(true), Some(Ok(())));
    assert_eq!(scene.machine.state(), State::Sketch);
}

#[test]
fn a_successor_that_knows_nothing_can_stop_a_robot_that_drives() {
    let mut scene = Scene::new(true);
    scene.machine.resume_after(7);
    scene.located();
    scene.say(TaskState::Driving);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::Driving, vec![Step::Abort]));
    scene.order(Step::Abort);
    scene.say(TaskState::Aborted);
    assert_eq!((scene.machine.state(), scene.allowed()), (State::NoSketch, vec![Step::Sketch]));
    scene.sketch();
    assert_eq!(scene.machine.memory().drawing_seq, 8);
}

/// Until the planner sends a status, the robot may be about to drive, and is assumed to be.
#[test]
fn a_successor_that_knows_nothing_can_stop_a_robot_of_which_nothing_was_heard() {
    let mut machine = Machine::new(true);
    machine.resume_after(7);
    assert_eq!((machine.state(), machine.allowed(true, s(0))), (State::Driving, vec![Step::Abort]));
    machine.on_status(&status(TaskState::Waiting), s(1));
    assert_eq!(machine.order(Step::Abort, false, s(1)), Ok(Order::Abort));
    assert_eq!((machine.state(), machine.allowed(true, s(1))), (State::NoSketch, vec![Step::Sketch]));
}

#[test]
fn a_successor_is_where_its_predecessor_was() {
    let mut scene = Scene::new(true);
    scene.sketch();
    scene.path();
    scene.order(Step::Execute);
    let mut successor = Machine::new(true);
    successor.resume(scene.machine.memory().clone(), s(0));
    assert_eq!(successor.state(), State::Driving);
    successor.on_status(&status(TaskState::Aborted), s(1));
    assert_eq!(successor.state(), State::Aborted);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// For any sequence of events, allowed steps are taken, others are refused, and a driving robot can be stopped.
    #[test]
    fn a_robot_that_drives_can_always_be_stopped(events in prop::collection::vec(0..14_u32, 0..60)) {
        let mut scene = Scene::new(true);
        let steps = [Step::Execute, Step::Abort, Step::Restore, Step::Again];
        for event in events {
            match event {
                0..4 => {
                    let step = steps[event as usize];
                    let allowed = scene.allowed().contains(&step);
                    prop_assert_eq!(scene.machine.order(step, true, scene.now).is_ok(), allowed);
                }
                4 => { let _ = scene.machine.send_sketch(
                    SketchRequest { kind: SketchType::Png, bytes: vec![], canvas: None }, true, scene.now); }
                5 => { let _ = scene.machine.send_path(
                    PathRequest::parse(br#"{"goals":[[1,2]]}"#).unwrap(), true, scene.now); }
                6 | 7 => { scene.answer(event == 6); }
                8 => scene.located(),
                9 => { scene.machine.on_silence(); }
                10 => scene.say(TaskState::Driving),
                11 => scene.say(TaskState::Aborted),
                12 => scene.say(TaskState::Finished),
                _ => scene.say(TaskState::Waiting),
            }
            if scene.machine.state() == State::Driving {
                prop_assert!(scene.allowed().contains(&Step::Abort));
                prop_assert!(!scene.allowed().contains(&Step::Sketch));
            }
        }
    }
}

/// A navigator without a drawing was once never ready, because it has no position in a drawing.
#[test]
fn a_navigator_without_a_drawing_is_ready_when_it_answers() {
    let mut machine = Machine::new(false);
    machine.on_lookout(true, false);
    assert!(!machine.is_ready(s(1)));
    machine.on_status(&MissionStatus::zeroed(), s(1));
    assert!(machine.is_ready(s(1)));
    assert!(machine.allowed(false, s(1)).contains(&Step::Abort));
}

/// Only the page that drives may set the robot's position, and only while the robot asks.
#[test]
fn a_place_is_an_answer() {
    let mut scene = Scene::new(false);
    scene.located();
    scene.say(TaskState::Paused);
    assert!(!scene.allowed().contains(&Step::Here), "it was stopped by a person");
    scene.machine.on_lookout(true, true);
    assert!(scene.allowed().contains(&Step::Here) && scene.machine.asks());
    assert!(!scene.machine.allowed(false, scene.now).contains(&Step::Here));
    assert_eq!(scene.order(Step::Here), Order::Here);
    assert_eq!((scene.machine.state(), scene.machine.asks()), (State::Driving, false));
    scene.say(TaskState::Driving);
    assert!(!scene.allowed().contains(&Step::Here));
}

/// What was learned is offered after a drive. Once it is accepted, it takes the place of the sketch, until it is rejected.
#[test]
fn what_was_learned_is_accepted_and_rejected() {
    let mut scene = Scene::new(true);
    scene.sketch();
    scene.path();
    assert!(scene.machine.accept(vec![2], true, scene.now).is_err(), "nothing was learned");
    scene.order(Step::Execute);
    scene.say(TaskState::Driving);
    scene.machine.offer(true);
    assert_eq!(scene.allowed(), [Step::Abort], "the robot drives");
    scene.say(TaskState::Finished);
    assert!(scene.machine.accept(vec![2], false, scene.now).is_err(), "another page drives");
    scene.machine.accept(vec![2], true, scene.now).unwrap();
    assert_eq!(scene.answer(true), Some(Ok(())));
    scene.machine.offer(false);
    let memory = scene.machine.memory();
    assert_eq!((memory.learned.as_deref(), &memory.path), (Some(&[2][..]), &None));
    assert_eq!(scene.allowed(), [Step::Sketch, Step::Path, Step::Reject]);
    scene.path();
    scene.machine.offer(true);
    assert_eq!(scene.machine.reject(true, scene.now), Ok(false), "what was offered");
    assert_eq!(scene.machine.reject(true, scene.now), Ok(true), "what was accepted");
    assert_eq!(scene.answer(true), Some(Ok(())));
    assert_eq!((&scene.machine.memory().learned, scene.machine.state()), (&None, State::Sketch));
    assert!(!scene.allowed().contains(&Step::Reject));
}
