//! The bridge to ROS 2 over Zenoh, tested with the package `zenoh-ros2-sdk`, which uses the same protocol as rmw_zenoh,
//! in a Python that `SKETCHNAV_ZENOH_PYTHON` names. Tests that need it are skipped if there is none.

use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;
use serde_json::Value;
use support::{BESIDE_A_DRIVER, Ended, Place, Running, repository, room};

const DOMAIN: &str = "7";

/// Returns a Python with that package.
fn zenoh_python() -> Option<PathBuf> {
    needs::python("zenoh", "SKETCHNAV_ZENOH_PYTHON", "zenoh_ros2_sdk, zenoh, rosbags")
}

/// Returns a free port.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn script(place: &Place, python: &Path, file: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(python);
    command.arg(repository().join("tests").join(file)).args(arguments);
    place.settle(&mut command);
    command.env("ROS_DOMAIN_ID", DOMAIN).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// Runs a node with that package until it ends. See `zenoh_node.py`.
fn node(place: &Place, python: &Path, arguments: &[&str]) -> Ended {
    let ended = Running::spawn(script(place, python, "zenoh_node.py", arguments)).end();
    assert_eq!(ended.code, Some(0), "{arguments:?}: {ended}");
    ended
}

/// Has a node give orders until the mission's status shows their effect.
fn order(place: &Place, python: &Path, arguments: &[&str], what: &str, holds: impl Fn(&Value) -> bool) {
    let giver = Running::spawn(script(place, python, "zenoh_node.py", arguments));
    support::wait_until(what, || holds(&place.fine("echo status --once --system lab").json()["message"]));
    giver.signal(Signal::SIGTERM);
    let ended = giver.end();
    assert_eq!(ended.code, Some(0), "{arguments:?}: {ended}");
}

fn numbers(report: &Value, key: &str) -> Vec<f64> {
    report[key].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Returns the size of the drawing that the system has.
fn drawing(place: &Place) -> Value {
    let fields = "--field grid.info.width --field grid.info.height";
    place.fine(&format!("echo sketch --once --system lab {fields}")).json()["fields"].clone()
}

fn is_whole(read: &Value, drawing: &Value) {
    let size = [&drawing["grid.info.width"], &drawing["grid.info.height"]];
    assert_eq!([&read["width"], &read["height"]], size, "{read}");
    let cells = read["width"].as_u64().unwrap() * read["height"].as_u64().unwrap();
    assert_eq!(read["cells"], cells, "{read}");
    assert!(cells > 1_000_000 && read["walls"].as_u64() > Some(1000), "{read}");
}

#[test]
fn an_rmw_zenoh_node_receives_the_robots_topics_and_drives_it() {
    let Some(python) = zenoh_python() else { return };
    let (place, port) = (Place::new(), free_port());
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let drawing = drawing(&place);
    let listen = format!("--rmw zenoh --listen tcp/127.0.0.1:{port}");
    let mut bridge = place.start(&format!("bridge ros2 --system lab --domain {DOMAIN} {listen} --orders"));
    let port = port.to_string();

    let report = node(&place, &python, &["listen", &port, "20"]).json();
    assert_eq!((&report["scan_frame"], &report["odometry_frames"][0]), (&"laser".into(), &"odom".into()));
    assert!(report["beams"].as_u64() > Some(100) && report["nearest_m"].as_f64() > Some(0.0), "{report}");
    for stamps in [numbers(&report, "scan_stamps_s"), numbers(&report, "clock_s")] {
        assert!(stamps.len() >= 10 && stamps.windows(2).all(|pair| pair[0] < pair[1]), "{stamps:?}");
    }
    assert!(report["poses"].as_array().unwrap().len() >= 15, "{report}");
    assert_eq!(report["transform"], serde_json::json!(["odom", "base_link"]), "{report}");
    for process in support::SERVICES {
        assert_eq!(report["levels"][format!("lab: {process}")], 0, "{report}");
    }
    // Each message has a number, a time and a sender.
    assert!(numbers(&report, "numbers").windows(2).all(|pair| pair[0] < pair[1]), "{report}");
    assert!(numbers(&report, "ages_s").iter().all(|age| (-60.0..3600.0).contains(age)), "{report}");
    assert_eq!(report["identities"].as_array().unwrap().len(), 1, "{report}");
    // The ROS 2 graph contains the bridge's node, its subscription and its topics.
    assert!(report["nodes"].as_array().unwrap().contains(&"sketchnav_lab".into()), "{report}");
    assert_eq!(report["subscriptions"], serde_json::json!(["%order"]), "{report}");
    for (topic, quality) in [("%scan", "2::,5:,:,:,,"), ("%sketch", ":1:,1:,:,:,,"), ("%tf", "::,100:,:,:,,")]
    {
        assert_eq!(report["topics"][topic][2], quality, "{report}");
    }

    is_whole(&node(&place, &python, &["late", &port]).json(), &drawing);

    order(&place, &python, &["order", &port, "pause"], "the pause", |status| status["state"] == 2);
    let on = ["order", &port, "stand on your head", "resume"];
    order(&place, &python, &on, "driving on", |status| {
        status["state"] == 1 && status["speed_mps"].as_f64() > Some(0.1)
    });
    order(&place, &python, &["order", &port, "goal 4"], "another goal", |status| {
        status["task"] == 3 && status["state"] == 1
    });

    bridge.must_live();
    running.signal(Signal::SIGINT);
    let output = running.end().json();
    assert_eq!(output["lost_messages"], 0, "{output:#}");
    let ended = bridge.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.err.contains("\"stand on your head\": expected one of start, abort"), "{ended}");
    place.assert_nothing_left("lab");

    // The hash of each type is the one that other software computes from the definitions in the recording.
    let recording = output["recording"].as_str().unwrap();
    let hashes = node(&place, &python, &["hashes", recording]).json();
    let hashes = hashes.as_object().unwrap();
    assert!(hashes.len() > 10, "{hashes:?}");
    for (topic, typed) in hashes {
        assert_eq!(
            [&report["topics"][topic][0], &report["topics"][topic][1]],
            [&typed[0], &typed[1]],
            "{topic}"
        );
    }
}

/// A subscriber, which is also the router, starts before the bridge.
#[test]
fn a_subscriber_waiting_at_the_router_gets_the_latched_drawing() {
    let Some(python) = zenoh_python() else { return };
    let (place, port) = (Place::new(), free_port());
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let drawing = drawing(&place);
    let mut router = Running::spawn(script(&place, &python, "zenoh_node.py", &["router", &port.to_string()]));
    support::wait_until("the router", || {
        router.must_live();
        TcpStream::connect(("127.0.0.1", port)).is_ok()
    });
    let options = format!("--rmw rmw_zenoh_cpp --router tcp/127.0.0.1:{port} --topics sketch");
    let bridge = place.start(&format!("bridge ros2 --system lab --domain {DOMAIN} {options}"));
    let ended = router.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    is_whole(&ended.json(), &drawing);
    running.signal(Signal::SIGINT);
    running.end();
    // By now, the router is gone.
    let ended = bridge.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    place.assert_nothing_left("lab");
}

/// Drives the mission in two rooms with a robot connected over Zenoh, which takes the place of the simulated world.
#[test]
fn an_rmw_zenoh_robot_replaces_the_world() {
    let Some(python) = zenoh_python() else { return };
    let (place, port) = (Place::new(), free_port());
    room::write(place.files());
    let mut running = place.start("run room.toml --json --system rover --speed 1 --without world");
    place.wait_until_joined(&mut running, "rover", &BESIDE_A_DRIVER);
    let options = format!("--rmw zenoh --listen tcp/127.0.0.1:{port} --domain {DOMAIN} --drive");
    let bridge = place.start(&format!("bridge ros2 --system rover {options}"));
    let robot = Running::spawn(script(&place, &python, "zenoh_robot.py", &[&port.to_string()]));
    room::assert_driven_to_its_goal(running, bridge, robot);
    place.assert_nothing_left("rover");
}

#[test]
fn bad_input_is_reported_and_nothing_is_opened() {
    let place = Place::new();
    let refused = |arguments: &str, code: i32, says: &str| {
        let ended = place.run(&format!("bridge ros2 {arguments}"));
        assert_eq!(ended.code, Some(code), "{arguments}: {ended}");
        assert!(ended.err.contains(says), "{arguments}: expected {says:?}: {ended}");
    };
    refused("--rmw carrier-pigeons", 2, "expected dds, zenoh or the name of an RMW implementation");
    refused("--rmw zenoh --router localhost", 2, "expected an endpoint of Zenoh over TCP");
    refused("--rmw zenoh --interface 127.0.0.1", 2, "--interface: expected this option only with --rmw dds");
    refused(
        "--rmw dds --listen tcp/localhost:7447",
        2,
        "--listen: expected this option only with --rmw zenoh",
    );
    refused("--rmw zenoh --system nobody", 2, "nobody");
    let mut command = place.command("bridge ros2 --system lab");
    command.env("RMW_IMPLEMENTATION", "rmw_email_cpp");
    let ended = Running::spawn(command).end();
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(ended.err.contains("RMW_IMPLEMENTATION: expected dds, zenoh or"), "{ended}");
    let mut running = place.start("run demo --json --system lab --speed 1");
    place.wait_until_driving(&mut running, "lab");
    let port = free_port();
    let missing = format!("--rmw zenoh --system lab --router tcp/127.0.0.1:{port}");
    refused(&missing, 3, &format!("joining the Zenoh router tcp/127.0.0.1:{port}: "));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let taken = format!("--rmw zenoh --system lab --listen tcp/127.0.0.1:{port}");
    refused(&taken, 3, &format!("acting as a Zenoh router at tcp/127.0.0.1:{port}: "));
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("lab");
}
