//! Several systems run on one machine, and tools inspect one of them.

use nix::sys::signal::Signal;
use serde_json::Value;
use support::{Place, Running, room};

/// Starts a mission in real time, which lasts until the test ends it.
fn drive(place: &Place, name: &str) -> Running {
    let mut running = place.start(&format!("demo --speed 5 --json --out {name} --system {name}"));
    place.wait_until_driving(&mut running, name);
    running
}

fn stop(place: &Place, running: Running, name: &str) {
    running.signal(Signal::SIGINT);
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    place.assert_no_system_left(name);
}

/// Two robots drive in two buildings. Each system has its own processes and messages, and when one ends, the other continues.
#[test]
fn two_systems_do_not_see_each_other() {
    let place = Place::new();
    let (mut one, two) = (drive(&place, "one"), drive(&place, "two"));
    let systems = place.ps();
    let names: Vec<_> = systems.iter().map(|system| system["system"].as_str().unwrap()).collect();
    assert_eq!(names, ["one", "two"]);
    for system in &systems {
        assert_eq!(system["mission"], "building-a", "{system:#}");
        let processes = system["processes"].as_array().unwrap();
        let named: Vec<_> = processes.iter().map(|process| process["process"].as_str().unwrap()).collect();
        let expected = ["supervisor", "localizer", "planner", "recorder", "sketcher", "world"];
        assert_eq!(named, expected, "{system:#}");
    }
    stop(&place, two, "two");
    one.must_live();
    let echoed = place.run("echo scan --count 200 --system one");
    assert_eq!(echoed.code, Some(0), "{echoed}");
    stop(&place, one, "one");
    place.assert_nothing_left("one");
}

/// In lockstep, a message from another system would show up in the recording, or as a lost message.
#[test]
fn two_systems_at_full_speed_lose_nothing() {
    let place = Place::new();
    room::write(place.files());
    let start = |name: &str| place.start(&format!("run room.toml --json --out {name} --system {name}"));
    for run in ["one", "two"].map(start) {
        let ended = run.end();
        assert_eq!(ended.code, Some(0), "{ended}");
        assert_eq!(ended.json()["lost_messages"], 0, "{ended}");
    }
}

#[test]
fn a_second_system_of_the_same_name_is_refused() {
    let place = Place::new();
    let mut first = drive(&place, "lab");
    room::write(place.files());
    let second = place.run("run room.toml --json --system lab");
    assert_eq!(second.code, Some(2), "{second}");
    let supervisor = first.pid().to_string();
    for words in ["\"lab\" is running already", &supervisor] {
        assert!(second.err.contains(words), "{second}");
    }
    first.must_live();
    assert_eq!(place.processes("lab").len(), 6);
    stop(&place, first, "lab");
}

#[test]
fn an_invalid_system_name_is_refused() {
    let place = Place::new();
    room::write(place.files());
    let ended = place.run("run room.toml --system My_Lab");
    assert_ne!(ended.code, Some(0));
    assert!(ended.err.contains("My_Lab") && ended.err.contains("a-z"), "{ended}");
    place.assert_nothing_left("My_Lab");
}

/// `echo` prints messages as they arrive, as one JSON object per line, numbered without a gap, and stops after
/// `--count`.
#[test]
fn echo_prints_messages_as_they_come() {
    let place = Place::new();
    let running = drive(&place, "lab");
    // The system's name may be omitted if only one is running.
    let echoed = place.run("echo status --count 3");
    assert_eq!(echoed.code, Some(0), "{echoed}");
    let messages: Vec<Value> = echoed.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let seqs: Vec<_> = messages.iter().map(|message| message["seq"].as_u64().unwrap()).collect();
    assert_eq!(seqs, [seqs[0], seqs[0] + 1, seqs[0] + 2]);
    assert!(messages.iter().all(|message| message["message"]["task_count"] == 9), "{echoed}");
    // The drawing was sent once, long ago, but its channel keeps it for late readers.
    let sketch = place.run("echo sketch --count 1");
    assert_eq!(sketch.code, Some(0), "{}", sketch.err);
    stop(&place, running, "lab");
}

/// The laser of the demo's robot scans ten times per simulated second, regardless of the mission's speed.
#[test]
fn hz_measures_the_rate_of_a_channel() {
    let place = Place::new();
    let running = drive(&place, "lab");
    let measured = place.run("hz scan --count 20");
    assert_eq!(measured.code, Some(0), "{measured}");
    let last = measured.out.lines().rfind(|line| line.starts_with("in all: ")).unwrap();
    assert!(last.contains("10.00 per simulated second"), "{measured}");
    assert!(last.contains("20 seen"), "{measured}");
    stop(&place, running, "lab");
}

/// `hz` measures the messages that arrive while it listens. It once included the channel's history, which is handed over at the
/// same time, and reported a rate of a million per second. The drawing is only in the history and is not sent again. `hz` prints
/// its result when the system ends, but was once killed along with the system's own processes.
#[test]
fn hz_does_not_count_the_history() {
    let place = Place::new();
    let running = drive(&place, "lab");
    let mut listening = place.start("hz sketch --system lab");
    let observer = format!("observer-{}", listening.pid());
    place.wait_until_joined(&mut listening, "lab", &[&observer]);
    stop(&place, running, "lab");
    let measured = listening.end();
    assert_eq!(measured.out.lines().last(), Some("in all: sketch: no message"), "{measured}");
}

#[test]
fn an_ambiguous_system_is_an_error_that_lists_the_choices() {
    let place = Place::new();
    let (one, two) = (drive(&place, "one"), drive(&place, "two"));
    let echoed = place.run("echo status --count 1");
    assert_eq!(echoed.code, Some(2), "{echoed}");
    assert!(echoed.err.contains("--system one or --system two"), "{echoed}");
    stop(&place, one, "one");
    stop(&place, two, "two");
}

/// A developer runs the localizer under a debugger. The system waits for it and then drives as usual.
#[test]
fn a_process_can_be_run_by_hand() {
    let place = Place::new();
    room::write(place.files());
    let mut system = place.start("run room.toml --json --system lab --without localizer");
    place.wait_until_joined(&mut system, "lab", &["planner", "recorder", "sketcher", "world"]);
    let by_hand = place.start("serve localizer --system lab");
    let ended = system.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.err.contains("sketchnav serve localizer --system lab"), "{ended}");
    assert_eq!(ended.json()["lost_messages"], 0, "{ended}");
    drop(by_hand);
    place.assert_nothing_left("lab");
}

/// Two localizers would both answer, so the second one is rejected, and the mission is not affected.
#[test]
fn a_process_cannot_run_twice() {
    let place = Place::new();
    let mut running = drive(&place, "lab");
    let first = place.pid("lab", "localizer").to_string();
    let second = place.run("serve localizer --system lab");
    assert_eq!(second.code, Some(3), "{second}");
    for words in ["localizer", "lab", "already running", &first] {
        assert!(second.err.contains(words), "{second}");
    }
    running.must_live();
    stop(&place, running, "lab");
}
