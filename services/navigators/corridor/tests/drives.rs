//! Complete drives along corridors, in one process.

#![allow(clippy::disallowed_methods)] // a floor lies in a file

use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::{COMMAND, CONTACT, ChannelSpec, STATUS, TRUTH};
use sketchnav_schemas::codes::TaskState;
use sketchnav_schemas::floor_plan::FloorPlan;
use sketchnav_schemas::message::{Contact, GroundTruth, MissionStatus, VelocityCommand};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sim::corridors::{Corridor, Drive, Numbers, Placement, Shape};
use sketchnav_sim::robots;

/// Outcome of a drive.
#[derive(Default)]
struct Ended {
    status: Option<MissionStatus>,
    truth: Option<GroundTruth>,
    contacts: Vec<Contact>,
    commands: Vec<VelocityCommand>,
}

impl Tap for Ended {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], _cells: &[u8]) {
        let is_end = |status: &&MissionStatus| status.state != TaskState::Finished.code();
        if let Some(status) = STATUS.message(spec, message).filter(is_end) {
            self.status = Some(*status);
        }
        self.truth = TRUTH.message(spec, message).copied().or(self.truth);
        self.contacts.extend(CONTACT.message(spec, message));
        self.commands.extend(COMMAND.message(spec, message));
    }
}

impl Onlooker for Ended {
    fn has_enough(&self) -> bool {
        !self.contacts.is_empty()
    }
}

impl Ended {
    fn state(&self) -> TaskState {
        self.status.and_then(|status| TaskState::from_code(status.state)).unwrap()
    }

    fn off_m(&self, goal: [f64; 2]) -> f64 {
        let pose = self.truth.unwrap().pose();
        (pose.x - goal[0]).hypot(pose.y - goal[1])
    }

    fn words(&self) -> String {
        let status = self.status.unwrap();
        let contact = self.contacts.first().map(|contact| contact.position_m);
        let pose = self.truth.unwrap().pose();
        format!(
            "{} ({}), contact {contact:?}, at ({:.2}, {:.2}) after {:.0} s",
            self.state(),
            status.reason.as_str(),
            pose.x,
            pose.y,
            status.task_time_s
        )
    }
}

fn youbot() -> Robot {
    robots::find("youbot").unwrap().unwrap()
}

fn drive(corridor: &Corridor, way: &Drive, method: &str, robot: Robot, people: &str) -> Ended {
    let goal = match corridor.shape {
        Shape::Straight => format!("metres={:?}", way.distance_m),
        _ => format!("marker={}", corridor.marker_beside(way.goal)),
    };
    drive_to(&goal, corridor, way, method, robot, people)
}

fn drive_to(goal: &str, corridor: &Corridor, way: &Drive, method: &str, robot: Robot, people: &str) -> Ended {
    drive_in(&corridor.plan(), goal, way, method, robot, people)
}

fn drive_in(plan: &FloorPlan, goal: &str, way: &Drive, method: &str, robot: Robot, people: &str) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    let floor = folder.path().join("floor.toml");
    std::fs::write(&floor, toml::to_string(plan).unwrap()).unwrap();
    let (start, turns) = (way.start, way.turns);
    let mission = format!(
        "name='m'\nrobot='youbot'\nworld={{floor_plan={:?},person=[{people}]}}\nstart={{world=[{:?},{:?}],world_heading_deg={:?}}}\n\
         [navigator]\nkind='corridor'\nmethod='{method}'\n[[task]]\nname='on'\nturns={turns:?}\ntime_limit_s=400\n{goal}\n",
        floor.display().to_string(),
        start.x,
        start.y,
        start.yaw_rad.to_degrees(),
    );
    let run = RunConfig::lockstep("test", Mission::parse(&mission).unwrap(), robot, 1);
    let mut ended = Ended::default();
    Rehearsal::new(&run).unwrap().run(&mut ended).unwrap();
    ended
}

/// In the thesis, both calculi pass opposite markers from the middle (Patil 2019, figures 5.2 and 5.5).
#[test]
fn by_the_published_rules_the_robot_passes_from_the_middle() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    for method in ["qtc-b", "argd", "combined"] {
        let way = &corridor.drives()[0];
        let ended = drive(&corridor, way, method, youbot(), "");
        assert_eq!(
            (ended.state(), ended.contacts.len()),
            (TaskState::Reached, 0),
            "{method}: {}",
            ended.words()
        );
        assert!(ended.off_m(way.goal) < 1.0, "{method}: {}", ended.words());
    }
}

#[test]
fn our_method_drives_straight_corridors_of_every_width() {
    for width_m in [1.6, 2.0, 3.0] {
        let (placement, numbers) = (Placement::Staggered, Numbers::Uneven);
        let corridor = Corridor { placement, numbers, ..Corridor::new(Shape::Straight, width_m) };
        for way in corridor.drives() {
            let ended = drive(&corridor, &way, "corridor", youbot(), "");
            assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
            assert!(ended.off_m(way.goal) < 0.5, "{}", ended.words());
        }
    }
}

#[test]
fn our_method_turns_corners_takes_junctions_and_leaves_dead_ends() {
    for shape in [Shape::L, Shape::U, Shape::T] {
        for width_m in [1.6, 2.4] {
            let corridor = Corridor::new(shape, width_m);
            for way in corridor.drives() {
                let ended = drive(&corridor, &way, "corridor", youbot(), "");
                assert_eq!(
                    (ended.state(), ended.contacts.len()),
                    (TaskState::Reached, 0),
                    "{} {}: {}",
                    corridor.name(),
                    way.name,
                    ended.words()
                );
                assert!(ended.off_m(way.goal) < 1.2, "{} {}: {}", corridor.name(), way.name, ended.words());
            }
        }
    }
}

/// Without a laser, remembered markers represent the walls. Without a camera, the robot sees the walls with its laser.
#[test]
fn our_method_works_with_either_sensor() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    let mut way = corridor.drives().swap_remove(0);
    // The robot starts next to the right wall, facing the left one.
    (way.start.y, way.start.yaw_rad) = (-0.4, 0.15);
    for robot in [Robot { laser: None, tick_hz: Some(10.0), ..youbot() }, Robot { camera: None, ..youbot() }]
    {
        let ended = drive(&corridor, &way, "corridor", robot, "");
        assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
    }
}

#[test]
fn a_walking_person_is_passed() {
    let corridor = Corridor::new(Shape::Straight, 2.4);
    let way = &corridor.drives()[0];
    let walker = "{waypoints=[[11.5,0.0],[1.5,0.0]],speed_mps=0.5,pause_s=2}";
    let ended = drive(&corridor, way, "corridor", youbot(), walker);
    assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
}

#[test]
fn two_runs_give_the_same_commands() {
    let corridor = Corridor::new(Shape::L, 1.6);
    let way = &corridor.drives()[0];
    let runs = [0, 1].map(|_| drive(&corridor, way, "corridor", youbot(), "").commands);
    assert!(runs[0] == runs[1] && runs[0].len() > 100);
}

/// A person in the corridor used to be mistaken for its end.
#[test]
fn a_person_is_not_taken_for_the_end_of_the_corridor() {
    let corridor = Corridor::new(Shape::Straight, 1.6);
    let way = &corridor.drives()[0];
    let person = "{waypoints=[[9.0,0.0],[5.0,0.0]],speed_mps=0.5,pause_s=1000}";
    let ended = drive_to("until='end'", &corridor, way, "corridor", youbot(), person);
    assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Blocked, 0), "{}", ended.words());
    let ended = drive_to("until='end'", &corridor, way, "corridor", youbot(), "");
    assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
    assert!(ended.off_m([13.0, 0.0]) < 2.0, "{}", ended.words());
}

/// The distance into a dead end and out of it again does not count. Only what follows does.
#[test]
fn metres_count_from_the_place_to_which_the_robot_returned() {
    let corridor = Corridor::new(Shape::L, 2.4);
    let way = &corridor.drives()[2];
    let ended = drive_to("metres=6.0", &corridor, way, "corridor", youbot(), "");
    assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
    assert!(ended.off_m([8.0, 2.0]) < 1.0, "{}", ended.words());
}

/// A marker that was behind the robot at the start used to count as passed immediately.
#[test]
fn only_a_marker_that_was_ahead_counts_as_passed() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    let way = &corridor.drives()[0];
    let behind = corridor.marker_beside([1.0, 1.0]);
    let ended = drive_to(&format!("marker={behind}"), &corridor, way, "corridor", youbot(), "");
    // The robot drives to the end, turns back, and only then passes the marker.
    let time_s = ended.status.unwrap().task_time_s;
    assert!(ended.state() == TaskState::Reached && time_s > 40.0, "{}", ended.words());
}

/// With QTC's own meaning of +, which is away, the printed rules do not keep the robot away from the wall.
#[test]
fn with_the_sign_of_qtc_the_published_rules_do_not_steer() {
    let corridor = Corridor::new(Shape::Straight, 1.6);
    let mut way = corridor.drives().swap_remove(0);
    // The robot faces five degrees to the left.
    way.start.yaw_rad += 0.09;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("away.toml");
    let text = sketchnav_corridor::rules::QTC_B.replace("plus = \"towards\"", "plus = \"away\"");
    std::fs::write(&file, text).unwrap();
    let method = format!("qtc-b'\nrules_file='{}", file.display());
    let ended = drive(&corridor, &way, &method, youbot(), "");
    assert_ne!(ended.state(), TaskState::Reached, "{}", ended.words());
}

/// Regression test: after a right turn at a junction, a marker that the robot had not yet reached was behind it, and counted as
/// passed from 3.5 m away.
#[test]
fn a_turn_passes_no_marker() {
    let corridor = Corridor::new(Shape::T, 2.4);
    let to_the_right = &corridor.drives()[1];
    let beside_the_junction = corridor.marker_beside([9.2, 0.5]);
    let goal = format!("marker={beside_the_junction}");
    let ended = drive_to(&goal, &corridor, to_the_right, "corridor", youbot(), "");
    let marker_off_m = ended.off_m([9.2, 0.5]);
    assert!(ended.state() != TaskState::Reached || marker_off_m < 2.0, "{}, {marker_off_m} m", ended.words());
}

/// The robot drives out of the closed left arm, past the junction and into the right arm, which counts as distance along the
/// corridor.
#[test]
fn metres_count_in_the_other_arm_after_a_dead_end() {
    let corridor = Corridor::new(Shape::T, 2.4);
    let to_the_left = &corridor.drives()[0];
    let mut plan = corridor.plan();
    plan.marker.clear();
    plan.wall[0].points = [
        [-0.05, -1.25],
        [6.75, -1.25],
        [6.75, -20.05],
        [9.25, -20.05],
        [9.25, 4.55],
        [6.75, 4.55],
        [6.75, 1.25],
        [-0.05, 1.25],
    ]
    .to_vec();
    let ended = drive_in(&plan, "metres=15.0", to_the_left, "corridor", youbot(), "");
    assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
    assert!(ended.off_m([8.0, -8.5]) < 1.5, "{}", ended.words());
}

/// There and back are two tasks, and the robot turns around between them. This used to take two runs with two starts.
#[test]
fn a_robot_that_turns_around_returns_to_its_start() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    let way = &corridor.drives()[0];
    for method in ["argd", "corridor"] {
        let there_and_back = "metres=3.0\n[[task]]\nname='back'\nabout=true\ntime_limit_s=400\nmetres=3.0";
        let ended = drive_to(there_and_back, &corridor, way, method, youbot(), "");
        assert_eq!((ended.state(), ended.contacts.len()), (TaskState::Reached, 0), "{}", ended.words());
        assert_eq!(ended.status.unwrap().task, 1, "{method}");
        let yaw_rad = ended.truth.unwrap().pose().yaw_rad;
        assert!(ended.off_m([3.0, 0.0]) < 0.5 && yaw_rad.abs() > 2.8, "{method}: {}", ended.words());
    }
}

/// The thesis leaves turning around to other behaviours ("such as turning around", conclusions), so it does not change the last
/// answer of the rules. A robot that had no pair in view after its turn once stood still until its time was up.
#[test]
fn after_turning_around_the_last_answer_of_the_rules_holds() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    let way = &corridor.drives()[0];
    let mut plan = corridor.plan();
    plan.marker.retain(|marker| (marker.at[0] - 5.5).abs() < 0.1);
    let goal = "metres=7.0\n[[task]]\nname='back'\nabout=true\ntime_limit_s=400\nmetres=0.5\n\
                [parameters.planner]\nlost_s=0.0";
    let ended = drive_in(&plan, goal, way, "argd", youbot(), "");
    assert_eq!((ended.state(), ended.status.unwrap().task), (TaskState::Reached, 1), "{}", ended.words());
}

/// "Due to lack of any motion updates" the robot of the thesis drives on (figure 5.2). Here the only two markers are soon
/// behind the robot. By default it is lost 20 s later. With `lost_s = 0` it drives on until it has covered its distance.
#[test]
fn without_a_pair_the_last_command_stays_in_force() {
    let corridor = Corridor::new(Shape::Straight, 2.0);
    let way = &corridor.drives()[0];
    let mut plan = corridor.plan();
    plan.marker.retain(|marker| (marker.at[0] - 5.5).abs() < 0.1);
    assert_eq!(plan.marker.len(), 2);
    for (parameters, state) in
        [("", TaskState::Lost), ("[parameters.planner]\nlost_s=0.0", TaskState::Reached)]
    {
        let goal = format!("metres=7.0\n{parameters}");
        let ended = drive_in(&plan, &goal, way, "argd", youbot(), "");
        assert_eq!(ended.state(), state, "{}", ended.words());
    }
}
