//! A lost robot stops, and a person helps by telling the planner which state the robot was led to (Chronis 2007, 4.8).

use bytemuck::Zeroable;
use sketchnav_landmarks::instructions::Instructions;
use sketchnav_landmarks::messages::{CHANNELS, LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkRoute, LandmarkView};
use sketchnav_landmarks::mission::KIND;
use sketchnav_landmarks::planner::Planner;
use sketchnav_schemas::channels::{self, COMMAND, ChannelSpec, ODOMETRY, ORDERS, STATUS};
use sketchnav_schemas::codes::{Order, Process, TaskState};
use sketchnav_schemas::message::{MissionCommand, MissionStatus, Odometry, VelocityCommand};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::{Pad, RunConfig};
use sketchnav_stage::{Access, InProcess, Incoming, Inputs, Instant, Outbox, Reading, Stage};

const MISSION: &str = include_str!("../../../../sim/missions/landmarks/scene-a-words.toml");
const NOMAD: &str = include_str!("../../../../sim/robots/nomad200.toml");
const WORDS: &str =
    "When a box is left, then turn right. When a box is ahead, then turn left. At the end, stop.";
/// Period of a tick, in nanoseconds.
const TICK_NS: u64 = 100_000_000;

/// A world in which the robot moves but sees nothing.
struct World {
    view: Box<LandmarkView>,
    odometry: Box<Odometry>,
}

impl Inputs for World {
    fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
        let of = |message| Some(Reading { message, cells: &[], is_fresh: true });
        match spec {
            spec if *spec == *LANDMARK_VIEW.spec => of(bytemuck::bytes_of(&*self.view)),
            spec if *spec == *ODOMETRY.spec => of(bytemuck::bytes_of(&*self.odometry)),
            _ => None,
        }
    }
}

struct Drive {
    access: Access,
    planner: Planner,
    world: World,
    sent: InProcess,
    tick: u64,
}

impl Drive {
    fn begin(pad: Pad) -> Self {
        let mut mission = Mission::parse(MISSION).unwrap();
        mission.task[0].time_limit_s = 1000.0;
        let run = RunConfig::lockstep("t", mission, Robot::parse(NOMAD).unwrap(), 1);
        let mut planner = Planner::new(&RunConfig { pad, ..run }).unwrap();
        let cells = Instructions { sketch: None, words: WORDS.into(), canvas: None, markers: Vec::new() }
            .write()
            .unwrap();
        let route = LandmarkRoute::zeroed();
        let access = Access::new(Process::Planner, "landmarks");
        planner
            .receive(&Incoming::new(&access, LANDMARK_ROUTE.spec, bytemuck::bytes_of(&route), &cells))
            .unwrap();
        let (mut view, mut odometry) =
            (bytemuck::zeroed_box::<LandmarkView>(), bytemuck::zeroed_box::<Odometry>());
        view.sectors_m = [f64::INFINITY; 16];
        for pose in [&mut view.odometry, &mut view.in_sketch, &mut odometry.pose] {
            pose.orientation_w = 1.0;
        }
        channels::register(KIND, CHANNELS).unwrap();
        let sent = InProcess::of_writer(Process::Planner, KIND);
        let mut drive = Self { access, planner, world: World { view, odometry }, sent, tick: 0 };
        drive.order(Order::Start, 0);
        drive
    }

    fn order(&mut self, order: Order, task: u32) {
        let order = MissionCommand { order: order.code(), task, ..MissionCommand::zeroed() };
        let incoming = Incoming::new(&self.access, ORDERS.spec, bytemuck::bytes_of(&order), &[]);
        self.planner.receive(&incoming).unwrap();
    }

    fn step(&mut self) -> MissionStatus {
        self.tick += 1;
        self.world.view.header.stamp_ns = self.tick * TICK_NS;
        self.world.view.odometry.x_m += 0.05;
        let stamp_ns = self.tick * TICK_NS;
        let instant = Instant::new(&self.access, self.tick, stamp_ns, &self.world);
        self.planner.step(&instant, &mut Outbox::new(&mut self.sent, stamp_ns, self.tick)).unwrap();
        *self.sent.get(STATUS.spec).unwrap().typed()
    }

    /// Steps until the robot is no longer driving, and returns the last status.
    fn until_it_stands(&mut self) -> MissionStatus {
        let ended =
            (0..2000).find_map(|_| Some(self.step()).filter(|said| said.state != TaskState::Driving.code()));
        ended.expect("it drives for ever")
    }

    fn turns_left(&self) -> f64 {
        self.sent.get(COMMAND.spec).unwrap().typed::<VelocityCommand>().twist.yaw_rate_radps
    }
}

fn said(status: &MissionStatus) -> (u32, &str) {
    (status.state, status.reason.as_str())
}

#[test]
fn a_robot_that_is_lost_goes_on_from_the_state_that_it_was_led_to() {
    let mut drive = Drive::begin(Pad::Watches);
    let lost = drive.until_it_stands();
    let reason = "lost, waiting for help: state 2 was not matched within twice the expected time";
    assert_eq!(said(&lost), (TaskState::Paused.code(), reason));
    assert_eq!(said(&drive.step()), (TaskState::Paused.code(), reason), "it stands");
    assert_eq!(drive.turns_left(), 0.0);
    // Resumed at the next state, the robot carries out the command of that state.
    drive.order(Order::Resume, 3);
    assert_eq!(drive.step().state, TaskState::Driving.code());
    assert!(drive.turns_left() > 0.0);
    // Resumed at the previous state, it turns the other way, and waits for state 3 as long as that leg takes.
    drive.order(Order::Resume, 2);
    drive.step();
    assert!(drive.turns_left() < 0.0);
    assert!(drive.until_it_stands().reason.as_str().contains("state 3"));
    // Resumed where it stopped, it waits for the same state again.
    drive.order(Order::Resume, 0);
    assert_eq!(drive.step().state, TaskState::Driving.code());
    assert!(drive.until_it_stands().reason.as_str().contains("state 3"));
}

#[test]
fn a_state_that_there_is_not_is_answered_with_those_that_there_are() {
    let mut drive = Drive::begin(Pad::Watches);
    drive.until_it_stands();
    for number in [4, 9] {
        drive.order(Order::Resume, number);
        let told = drive.step();
        let expected = format!("lost, waiting for help: expected a state from 1 to 3, found {number}");
        assert_eq!(said(&told), (TaskState::Paused.code(), &expected[..]));
    }
}

#[test]
fn without_people_who_could_help_the_task_ends() {
    let mut drive = Drive::begin(Pad::Absent);
    assert_eq!(drive.until_it_stands().state, TaskState::Lost.code());
    assert_eq!(drive.step().state, TaskState::Finished.code());
}
