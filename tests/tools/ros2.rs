//! The bridge to ROS 2, tested with real ROS 2 (rclpy with Fast DDS) in a Python that `SKETCHNAV_ROS2_PYTHON` names.
//! Tests that need it are skipped if there is none.

use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;
use serde_json::Value;
use support::{BESIDE_A_DRIVER, Ended, Place, Running, repository, room};

/// Returns a Python with real ROS 2.
fn ros2_python() -> Option<PathBuf> {
    needs::python("ros2", "SKETCHNAV_ROS2_PYTHON", "rclpy, diagnostic_msgs, rosgraph_msgs")
}

/// Returns a domain that only this test process uses, among those whose ports the kernel does not assign on its own.
fn domain(of_test: u32) -> u32 {
    10 + (std::process::id() + 7 * of_test) % 90
}

/// Returns a command that runs a program with real ROS 2 in the domain.
fn script(place: &Place, python: &Path, domain: u32, file: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(python);
    command.arg(repository().join("tests").join(file)).args(arguments);
    place.settle(&mut command);
    // Only participants that use Fast DDS can share its shared memory, so it is switched off.
    command.env("ROS_DOMAIN_ID", domain.to_string()).env("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4");
    command.env("PYTHONDONTWRITEBYTECODE", "1").env("ROS_LOG_DIR", place.files());
    command
}

/// Runs a real ROS 2 node in the domain until it ends. See `ros2_node.py`.
fn node(place: &Place, python: &Path, domain: u32, arguments: &[&str]) -> Ended {
    let ended = Running::spawn(script(place, python, domain, "ros2_node.py", arguments)).end();
    assert_eq!(ended.code, Some(0), "{arguments:?}: {ended}");
    ended
}

fn numbers(report: &Value, key: &str) -> Vec<f64> {
    report[key].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Returns the latest status of the mission.
fn status(place: &Place) -> Value {
    place.fine("echo status --once --system lab").json()["message"].clone()
}

fn wait_for_status(place: &Place, what: &str, holds: impl Fn(&Value) -> bool) {
    support::wait_until(what, || holds(&status(place)));
}

#[test]
fn ros_2_receives_the_robots_topics_and_drives_it() {
    let Some(python) = ros2_python() else { return };
    let (place, domain) = (Place::new(), domain(0));
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let options = format!("--system lab --domain {domain} --interface 127.0.0.1 --orders");
    let mut bridge = place.start(&format!("bridge ros2 {options}"));

    let report = node(&place, &python, domain, &["listen", "20"]).json();
    assert_eq!((&report["scan_frame"], &report["odometry_frames"][0]), (&"laser".into(), &"odom".into()));
    assert!(
        report["beams"].as_u64().unwrap() > 100 && report["nearest_m"].as_f64().unwrap() > 0.0,
        "{report}"
    );
    for stamps in [numbers(&report, "scan_stamps_s"), numbers(&report, "clock_s")] {
        assert!(stamps.len() >= 10 && stamps.windows(2).all(|pair| pair[0] < pair[1]), "{stamps:?}");
    }
    assert!(report["poses"].as_array().unwrap().len() >= 15, "{report}");
    for process in support::SERVICES {
        assert_eq!(report["levels"][format!("lab: {process}")], 0, "{report}");
    }
    assert!(report["nodes"].as_array().unwrap().contains(&"sketchnav_lab".into()), "{report}");
    assert_eq!(report["topics"]["/estimate"], "sketchnav_msgs/msg/PoseEstimate", "{report}");

    node(&place, &python, domain, &["order", "pause"]);
    wait_for_status(&place, "the pause", |status| status["state"] == 2);
    node(&place, &python, domain, &["order", "stand on your head"]);
    node(&place, &python, domain, &["order", "resume"]);
    wait_for_status(&place, "driving on", |status| {
        status["state"] == 1 && status["speed_mps"].as_f64() > Some(0.1)
    });

    assert_eq!(status(&place)["task"], 0);
    node(&place, &python, domain, &["order", "goal 4"]);
    wait_for_status(&place, "another goal", |status| status["task"] == 3 && status["state"] == 1);

    bridge.must_live();
    running.signal(Signal::SIGINT);
    let output = running.end().json();
    assert_eq!(output["lost_messages"], 0, "{output:#}");
    let ended = bridge.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.err.contains("\"stand on your head\": expected one of start, abort"), "{ended}");
    assert!(
        ended.err.contains(", 0 dropped because a subscriber was too slow, 0 lost before that"),
        "{ended}"
    );
    place.assert_nothing_left("lab");
}

#[test]
fn bad_input_is_reported_and_nothing_is_opened() {
    let place = Place::new();
    let refused = |arguments: &str, says: &str| {
        let ended = place.run(&format!("bridge ros2 {arguments}"));
        assert_eq!(ended.code, Some(2), "{arguments}: {ended}");
        assert!(ended.err.contains(says), "{arguments}: expected {says:?}: {ended}");
    };
    refused("--system nobody", "nobody");
    refused("--system nobody --domain 233", "expected a domain of ROS 2 from 0 to 232");
    refused("--system nobody --topics (", "expected a regular expression");
    refused("--system nobody --interface robot", "invalid IP address");
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    refused("--system lab --topics scan wind.*", "expected a match of");
    refused("--system lab --topics scan wind.*", "found none for \"wind.*\"");
    let mut command = place.command("bridge ros2 --system lab");
    command.env("ROS_DOMAIN_ID", "many");
    let ended = Running::spawn(command).end();
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(
        ended.err.contains("ROS_DOMAIN_ID: expected a domain of ROS 2 from 0 to 232, found \"many\""),
        "{ended}"
    );
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("lab");
}

/// A late reader receives the drawing, which is much longer than a datagram, as a type that it only has as IDL.
#[test]
fn a_reader_of_another_vendor_gets_the_latched_drawing() {
    let Some(python) = ros2_python() else { return };
    let has_cyclone = Command::new(&python).args(["-c", "import cyclonedds"]).output();
    if !has_cyclone.is_ok_and(|output| output.status.success()) {
        return needs::skipped("ros2", "the Python with ROS 2 has no cyclonedds");
    }
    let (place, domain) = (Place::new(), domain(3));
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let drawing =
        place.fine("echo sketch --once --system lab --field grid.info.width --field grid.info.height").json();
    let size = &drawing["fields"];
    let bridge = place
        .start(&format!("bridge ros2 --system lab --domain {domain} --interface 127.0.0.1 --topics sketch"));
    let mut reader = script(&place, &python, domain, "dds_reader.py", &[]);
    let loopback = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/>\
                    </Interfaces></General></Domain></CycloneDDS>";
    reader.env("CYCLONEDDS_URI", loopback);
    let ended = Running::spawn(reader).end();
    assert_eq!(ended.code, Some(0), "{ended}");
    let read = ended.json();
    assert_eq!(
        (&read["width"], &read["height"]),
        (&size["grid.info.width"], &size["grid.info.height"]),
        "{read}"
    );
    let cells = read["width"].as_u64().unwrap() * read["height"].as_u64().unwrap();
    assert_eq!(read["cells"], cells, "{read}");
    assert!(cells > 1_000_000 && read["walls"].as_u64() > Some(1000) && read["frame"] == "sketch", "{read}");
    running.signal(Signal::SIGINT);
    running.end();
    assert_eq!(bridge.end().code, Some(0));
    place.assert_nothing_left("lab");
}

/// Two hosts, which are network namespaces connected by a wire.
struct Hosts {
    names: [String; 2],
}

impl Hosts {
    /// Creates the hosts, if this user is allowed to.
    fn new() -> Option<Self> {
        let id = std::process::id();
        let hosts = Self { names: ["a", "b"].map(|end| format!("sketchnav-{id}-{end}")) };
        let [a, b] = &hosts.names;
        let wires = ["a", "b"].map(|end| format!("sn{id}{end}"));
        let mut made = ip(&format!("netns add {a}")) && ip(&format!("netns add {b}"));
        made = made
            && ip(&format!("link add {} netns {a} type veth peer name {} netns {b}", wires[0], wires[1]));
        for ((host, wire), number) in hosts.names.iter().zip(&wires).zip(1..) {
            made = made
                && ip(&format!("-n {host} addr add 10.77.0.{number}/24 dev {wire}"))
                && ip(&format!("-n {host} link set {wire} up"))
                && ip(&format!("-n {host} link set lo up"))
                && ip(&format!("-n {host} route add 224.0.0.0/4 dev {wire}"));
        }
        if !made {
            needs::skipped("netns", "network namespaces cannot be made (ip netns, as root)");
        }
        made.then_some(hosts)
    }

    /// Returns a command that runs `command` on a host.
    fn on(&self, host: usize, place: &Place, command: &Command) -> Command {
        let mut there = needs::program("ip").expect("ip, which was there before");
        there.args(["netns", "exec", &self.names[host]]).arg(command.get_program()).args(command.get_args());
        place.settle(&mut there);
        there.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
        there
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for name in &self.names {
            ip(&format!("netns del {name}"));
        }
    }
}

fn ip(arguments: &str) -> bool {
    let ended = needs::program("ip").map(|mut ip| ip.args(arguments.split(' ')).output());
    ended.is_some_and(|ended| ended.is_ok_and(|ended| ended.status.success()))
}

/// The bridge communicates by multicast over a wire, as on any network. The node shares nothing else with the robot's
/// host.
#[test]
fn ros_2_on_another_host_sees_the_robot_and_sends_a_goal() {
    let Some(python) = ros2_python() else { return };
    let Some(hosts) = Hosts::new() else { return };
    let (place, domain) = (Place::new(), domain(2));
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let bridge =
        place.command(&format!("bridge ros2 --system lab --domain {domain} --namespace lab --orders"));
    let bridge = Running::spawn(hosts.on(0, &place, &bridge));
    let there = |arguments: &[&str]| {
        let command = script(&place, &python, domain, "ros2_node.py", arguments);
        let ended = Running::spawn(hosts.on(1, &place, &command)).end();
        assert_eq!(ended.code, Some(0), "{arguments:?}: {ended}");
        ended
    };
    let report = there(&["listen", "10", "/lab"]).json();
    assert!(report["poses"].as_array().unwrap().len() >= 8, "{report}");
    there(&["order", "goal 4", "/lab"]);
    wait_for_status(&place, "the goal", |status| status["task"] == 3 && status["state"] == 1);
    running.signal(Signal::SIGINT);
    running.end();
    assert_eq!(bridge.end().code, Some(0));
    place.assert_nothing_left("lab");
}

/// Drives the mission in two rooms with a ROS 2 robot, which takes the place of the simulated world. Its odometry has the name
/// that robot_localization gives it.
#[test]
fn a_ros_2_robot_replaces_the_world() {
    let Some(python) = ros2_python() else { return };
    let (place, domain) = (Place::new(), domain(1));
    room::write(place.files());
    let mut running = place.start("run room.toml --json --system rover --speed 1 --without world");
    place.wait_until_joined(&mut running, "rover", &BESIDE_A_DRIVER);
    let robot = Running::spawn(script(&place, &python, domain, "ros2_robot.py", &["odometry/filtered"]));
    let options =
        format!("--system rover --domain {domain} --interface 127.0.0.1 --drive --odom odometry/filtered");
    let bridge = place.start(&format!("bridge ros2 {options}"));
    room::assert_driven_to_its_goal(running, bridge, robot);
    place.assert_nothing_left("rover");
}

#[test]
fn a_system_with_its_own_world_refuses_a_robot() {
    let place = Place::new();
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let ended = place.run("bridge ros2 --system lab --domain 9 --drive");
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("expected one that was started with --without world"), "{ended}");
    running.signal(Signal::SIGINT);
    running.end();
}
