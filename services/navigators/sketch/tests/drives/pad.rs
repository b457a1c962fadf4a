//! Tests of runs with people who draw, with various drawings, orders and times.

use bytemuck::Zeroable;
use sketchnav_schemas::channels::{ChannelSpec, STATUS};
use sketchnav_schemas::codes::{Order, TaskState};
use sketchnav_schemas::message::*;
use sketchnav_schemas::run::Pad;
use sketchnav_sketch::messages::{ROUTE, SKETCH, SketchMap};
use sketchnav_sketch::planner::Planner;
use sketchnav_stage::{Remains, Stage};

use crate::support::*;

const SIZE: [f64; 2] = [8.0, 3.0];
const START: [f64; 3] = [1.0, 1.5, 0.0];
const NEAR: &[[f64; 2]] = &[[3.0, 1.5]];
const FAR: &[[f64; 2]] = &[[7.0, 1.5]];

fn hall() -> Vec<Line> {
    vec![[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 3.0], [8.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]]
}

/// A run whose robot waits for a drawing.
struct Table {
    drive: Drive,
    map: SketchMap,
    cells: Vec<u8>,
}

impl Table {
    fn new() -> Self {
        let scene = Scene::faithful(hall(), SIZE, START);
        let (map, cells) = scene.cells();
        let mut drive = Drive::new(scene, ROBOTINO, &[NEAR], 100.0);
        let mut run = config(ROBOTINO, "");
        run.pad = Pad::Draws;
        drive.planner = Planner::new(&run).unwrap();
        Self { drive, map, cells }
    }

    fn sketch(&mut self, seq: u64) {
        self.map.header.seq = seq;
        self.drive.receive(SKETCH, &self.map, &self.cells);
    }

    fn route(&mut self, seq: u64, sketch: u64, tasks: &[&[[f64; 2]]]) {
        let mut route = route(stretched, tasks, 100.0);
        (route.header.seq, route.header.source_seq) = (seq, sketch);
        self.drive.receive(ROUTE, &*route, &[]);
    }

    fn order(&mut self, order: Order) {
        self.drive.order(order);
    }

    /// Takes a step and returns the status of the mission after it, and the command.
    fn step(&mut self) -> (MissionStatus, VelocityCommand) {
        self.drive.sense();
        let command = self.drive.think();
        assert_eq!(command.last, 0, "the run goes on until somebody ends it");
        self.drive.act(command.twist);
        (*self.drive.said(STATUS).unwrap(), command)
    }

    /// Takes steps until the mission is in this state, for at most two minutes.
    fn until(&mut self, state: TaskState) -> MissionStatus {
        let found = (0..1200).map(|_| self.step().0).find(|status| status.state == state.code());
        found.unwrap_or_else(|| panic!("never {state}"))
    }

    fn reason(&mut self) -> String {
        self.step().0.reason.as_str().to_owned()
    }
}

#[test]
fn it_says_what_it_waits_for() {
    let mut table = Table::new();
    assert_eq!(table.reason(), "waiting for the sketch");
    table.sketch(1);
    assert_eq!(table.reason(), "waiting for the route");
    table.route(1, 1, &[NEAR]);
    assert_eq!(table.reason(), "waiting for the order to start");
}

#[test]
fn it_is_aborted_restored_and_started_again() {
    let mut table = Table::new();
    table.sketch(1);
    table.route(1, 1, &[NEAR, FAR]);
    table.order(Order::Start);
    table.until(TaskState::Reached);
    let before = table.until(TaskState::Driving);
    assert_eq!(before.task, 1);
    table.order(Order::Abort);
    let aborted = table.until(TaskState::Aborted);
    let stands = (0..20).map(|_| table.step()).last().unwrap();
    assert_eq!((stands.1.twist.vx_mps, stands.0.task_time_s), (0.0, aborted.task_time_s));
    table.order(Order::Resume);
    assert_eq!(table.until(TaskState::Driving).task, 1);
    assert_eq!(table.until(TaskState::Finished).reached_count, 2);
    table.order(Order::Start);
    let again = table.until(TaskState::Driving);
    assert_eq!((again.task, again.reached_count), (0, 0));
}

#[test]
fn new_tasks_come_when_it_does_not_drive() {
    let mut table = Table::new();
    table.sketch(1);
    table.route(1, 1, &[FAR]);
    table.order(Order::Start);
    table.until(TaskState::Driving);
    table.route(2, 1, &[NEAR, FAR]);
    assert_eq!(table.step().0.task_count, 1, "not while it drives");
    table.order(Order::Unattended);
    assert_eq!(table.reason(), "stopped: the link to the page that drives was lost");
    table.route(3, 1, &[NEAR, FAR]);
    let status = table.step().0;
    assert_eq!((status.task_count, status.state), (2, TaskState::Waiting.code()));
    table.order(Order::Start);
    assert_eq!(table.until(TaskState::Finished).reached_count, 2);
}

/// The sketch and the tasks arrive on two channels, so the tasks may be read first.
#[test]
fn another_sketch_takes_the_tasks_of_the_one_before_along() {
    let mut table = Table::new();
    table.sketch(1);
    table.route(1, 1, &[FAR]);
    table.order(Order::Start);
    table.until(TaskState::Finished);
    table.route(2, 2, &[NEAR]);
    table.sketch(2);
    assert_eq!(table.reason(), "waiting for the order to start");
    table.sketch(3);
    assert_eq!(table.reason(), "waiting for the route");
}

/// The last status of a planner that was killed.
struct Last(MissionStatus);

impl Remains for Last {
    fn last(&self, spec: &ChannelSpec) -> Option<Vec<u64>> {
        (*spec == *STATUS.spec).then(|| bytemuck::cast_slice(std::slice::from_ref(&self.0)).to_vec())
    }
}

/// Without a checkpoint, a robot that a person had stopped used to drive off again.
#[test]
fn who_knows_the_last_status_alone_does_not_drive_off() {
    for (state, pad) in [(TaskState::Paused, Pad::Absent), (TaskState::Aborted, Pad::Watches)] {
        let mut table = Table::new();
        let mut run = config(ROBOTINO, "");
        run.pad = pad;
        table.drive.planner = Planner::new(&run).unwrap();
        let last = MissionStatus { state: state.code(), ..Zeroable::zeroed() };
        table.drive.planner.recover(&Last(last));
        table.sketch(1);
        table.route(1, 0, &[NEAR]);
        table.order(Order::Start);
        assert_eq!(table.until(state).task, 0);
        table.order(Order::Resume);
        table.until(TaskState::Driving);
    }
}
